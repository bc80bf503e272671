# SPDX-License-Identifier: MIT
"""Observations that do not fit, and noise that is estimated."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.errors import FailedFitError, NotIdentifiableError, SymkinError
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.options import ROBUST, Loss
from symkin.estimate.problem import KINDS, OBSERVED, Problem, Rows, without_pose
from symkin.values import Array

_SUSPICIOUS = 3.5  # standard deviations, from which single rows are dropped
_NOISE_STEPS = 60
_STILL = 1e-3  # change of a noise's logarithm, in its own standard deviations
_FARTHEST_STEP = 1.0  # of a noise's logarithm


def without_blunders(
    problem: Problem, fit: _core.JointFit, most: int | None = None
) -> tuple[Problem, _core.JointFit, tuple[tuple[int, str], ...]]:
    """Drop single observations that do not fit, and poses of which more than one does not.

    Begins with a robust loss of poses, which the fit may have already. A pose whose chi-square
    stays too large without its worst observation is dropped as a whole: single rows of such a pose
    would mislead. Ends as it is where that would drop more than `most`.
    """
    rejected: list[tuple[int, str]] = []
    space, loss = problem.mechanism.pose_space, problem.options.loss
    nearest = problem.options.gauge == "nominal"
    if loss == "none":
        fit = _robust(problem, nearest=nearest, loss=ROBUST)
    for _ in range(len(problem.measurements.poses)):
        rows = Rows.of(fit)
        changes: list[tuple[int, int]] = []  # pose, row of `rows` or -1 for all
        size = np.abs(np.nan_to_num(rows.t))
        for pose in np.unique(rows.pose[size > _SUSPICIOUS]).tolist():
            own = np.flatnonzero(rows.pose == pose)
            worst = int(own[np.argmax(size[own])])
            left = fit.conditions[pose] - 1
            rest = fit.chi_squares[pose] - rows.t[worst] ** 2
            sound = left > 0 and _core.chi_square_tail(max(rest, 0.0), left) > FALSE_ALARMS
            changes.append((pose, worst if sound or left == 0 else -1))
        if not changes or (most is not None and len(rejected) + len(changes) > most):
            break
        measurements = problem.measurements
        for pose, row in changes:
            what = rows.what(row, space) if row >= 0 else "everything"
            measurements = _without(measurements, pose, rows, row)
            rejected.append((pose, what))
        problem = dataclasses.replace(problem, measurements=measurements)
        fit = problem.fit(nearest=nearest, loss="none")
    return problem, fit if rejected else problem.fit(nearest=nearest, loss="none"), tuple(rejected)


def _robust(problem: Problem, *, nearest: bool, loss: Loss) -> _core.JointFit:
    """Fit with a loss, or without where single poses decide too much for one."""
    try:
        return problem.fit(nearest=nearest, loss=loss)
    except NotIdentifiableError:
        raise
    except SymkinError:
        return problem.fit(nearest=nearest, loss="none")


def _without(measurements: Measurements, pose: int, rows: Rows, row: int) -> Measurements:
    """Without one observation of a pose, or without all (-1)."""
    if row < 0:
        return without_pose(measurements, pose)
    kind, index = OBSERVED[rows.kind[row]], int(rows.index[row])
    changed = np.array(getattr(measurements, kind))
    values = changed[pose].reshape(-1)
    space = measurements.space
    whole = kind in ("poses", "reported") and space.has_quaternion and index >= space.size
    values[slice(space.size, None) if whole else index] = np.nan
    changes = {kind: changed}
    return dataclasses.replace(measurements, **changes)  # type: ignore[arg-type]


def estimated_noise(problem: Problem, fit: _core.JointFit) -> tuple[Problem, _core.JointFit]:
    """Estimate the noise of each kind of observation with the unknowns.

    Restricted maximum likelihood: at its maximum the sum of squared residuals of each kind, in
    standard deviations, is the sum of the redundancies of its rows. That is a fixed point which is
    iterated, at a new linearisation each time. Deviations that rows have of their own stay, and so
    does a noise that is declared as zero: exact.

    Where the observations hardly tell two kinds apart, as the readings of linear sensors and the
    poses, each iteration takes a small part of the way; the secants of the last ones take the rest
    (Anderson, J. ACM 12, 1965).
    """
    history: list[tuple[Array, Array]] = []
    told: tuple[str, ...] = ()
    for _ in range(_NOISE_STEPS):
        improved, change = _improved(problem, fit)
        if change >= _STILL:
            before = {name: getattr(problem.noise, name) for name in improved}
            if tuple(before) != told:  # others have rows to spare than in the step before
                history, told = [], tuple(before)
            logs = np.log(list(before.values()))
            history.append((logs, np.log(list(improved.values())) - logs))
            improved = dict(zip(before, np.exp(_extrapolated(history)).tolist(), strict=True))
        if "position" in improved:  # what distance adds to it grows alike
            factor = improved["position"] / problem.noise.position
            improved["per_metre"] = problem.noise.per_metre * factor
            improved["along_per_metre"] = problem.noise.along_per_metre * factor
            if problem.noise.along is not None:
                improved["along"] = problem.noise.along * factor
        noise = dataclasses.replace(problem.noise, **improved)  # type: ignore[arg-type]
        problem = dataclasses.replace(problem, noise=noise)
        fit = problem.fit(nearest=problem.options.gauge == "nominal")
        if change < _STILL:
            return problem, fit
    raise FailedFitError(
        "the noise cannot be estimated from these observations, which do not tell its parts "
        f"apart (after {_NOISE_STEPS} steps: {problem.noise}); declare it"
    )


def _extrapolated(
    history: list[tuple[Array, Array]],
) -> Array:
    """Where the steps from the places in a history would end, to first order; never far away."""
    recent = history[-1 - len(history[-1][0]) :]
    places, steps = (np.array(each) for each in zip(*recent, strict=True))
    by_place, by_step = np.diff(places, axis=0), np.diff(steps, axis=0)
    shares = np.linalg.lstsq(by_step.T, steps[-1], rcond=1e-6)[0]
    way = steps[-1] - (by_place + by_step).T @ shares
    return np.asarray(places[-1] + np.clip(way, -_FARTHEST_STEP, _FARTHEST_STEP))


def _improved(problem: Problem, fit: _core.JointFit) -> tuple[dict[str, float], float]:
    """The next noise, and the largest change of a logarithm in its own standard deviations."""
    rows, taken = Rows.of(fit), problem.measurements
    positions = taken.space.size
    kinds = np.array(KINDS)[rows.kind]
    angles = [each.kind for each in OBSERVABLES.values() if each.is_angle]
    angular = (kinds == "pose") & (rows.index >= positions) | np.isin(kinds, angles)
    groups = {
        "reading": kinds == "readings",
        "orientation": angular,
        "position": ~angular & (kinds != "readings") & (kinds != "reported pose"),
    }
    found, change = {}, 0.0
    sigma = _deviations(taken.standard_deviations(problem.noise), rows)
    for name, of_group in groups.items():
        declared = getattr(problem.noise, name)
        used = of_group & np.isfinite(rows.t) & (rows.t != 0) & _undeclared(taken, rows)
        if declared == 0 or not used.any():
            continue
        squares = (rows.residual[used] / sigma[used]) ** 2
        redundancy = float(np.sum(squares / rows.t[used] ** 2))
        factor = math.sqrt(float(squares.sum()) / redundancy)
        found[name] = declared * factor
        # A noise that nothing shows has no redundancy, and may shrink for ever.
        change = max(change, abs(math.log(factor)) * math.sqrt(2 * redundancy))
    if not found:
        raise SymkinError("no observation is redundant, so the noise cannot be estimated")
    return found, change


def _undeclared(taken: Measurements, rows: Rows) -> NDArray[np.bool_]:
    """Which rows have no standard deviation of their own."""
    own = {name: getattr(taken, each.deviations) for name, each in OBSERVABLES.items()}
    return np.isnan(_deviations(own, rows))


def _deviations(tables: Mapping[str, Array | None], rows: Rows) -> Array:
    """Those of each row, out of tables by what was observed; NaN where there is none."""
    found = np.full(len(rows.pose), np.nan)
    for kind, name in enumerate(OBSERVABLES):
        table, own = tables.get(name), rows.kind == kind
        if table is not None:
            found[own] = table.reshape(len(table), -1)[rows.pose[own], rows.index[own]]
    return found
