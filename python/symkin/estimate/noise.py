# SPDX-License-Identifier: MIT
"""Noise that is estimated with the unknowns, by restricted maximum likelihood.

At its maximum the sum of squared residuals that share a noise, in standard deviations, is the sum
of the redundancies of their rows. That is a fixed point which is iterated, at a new linearisation
each time.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.errors import FailedFitError, SymkinError
from symkin.estimate.covariates import sessions_of
from symkin.estimate.problem import KINDS, OBSERVED, Problem, Rows
from symkin.model.settings import NoiseSettings
from symkin.values import Array

_STEPS = 60
_STILL = 1e-3  # change of a noise's logarithm, in its own standard deviations
_FARTHEST_STEP = 1.0  # of a noise's logarithm
_UNSEEN = 1e-4  # of a row's variance: other noise hides all of it
# What grows and shrinks together, by what it belongs to.
_Parts = Mapping[str, tuple[str, ...]]
_PARTS: _Parts = {
    "reading": ("reading",),
    "orientation": ("orientation",),
    "position": ("position", "per_metre"),
    "along": ("along", "along_per_metre"),
}
_ALL: _Parts = {"noise": tuple(name for names in _PARTS.values() for name in names)}


class Share(NamedTuple):
    """What rows of one noise say of it."""

    step: float  # of its logarithm, to the next iterate
    redundancy: float
    rows: int

    @property
    def change(self) -> float:
        """In standard deviations of the logarithm.

        A noise that nothing shows has no redundancy, and may shrink for ever.
        """
        return abs(self.step) * math.sqrt(2 * self.redundancy)

    @property
    def is_nothing(self) -> bool:
        """Whether the likelihood still grows where other noise hides it: its maximum is zero."""
        return self.step < -_STILL and self.redundancy < _UNSEEN * self.rows


def estimated_noise(problem: Problem, fit: _core.JointFit) -> tuple[Problem, _core.JointFit]:
    """Estimate the noise of each kind of observation with the unknowns.

    Deviations that rows have of their own stay, and so does a noise that is declared as zero:
    exact. One that other noise hides may be most likely zero, and is that then.

    Where the observations hardly tell two kinds apart, as the readings of linear sensors and the
    poses, each iteration takes a small part of the way; the secants of the last ones take the rest
    (Anderson, J. ACM 12, 1965). Where they do not tell them apart at all, kinds keep the declared
    proportion.
    """
    return _estimated(problem, fit, _PARTS) or _estimated(problem, fit, _ALL) or _give_up()


def keeps_proportion(declared: NoiseSettings, estimated: NoiseSettings) -> bool:
    """Whether kinds of noise were not told apart, so that they are as many times the declared."""
    factors = []
    for names in _PARTS.values():
        pairs = ((getattr(declared, name), getattr(estimated, name)) for name in names)
        factors += [own / said for said, own in pairs if said][:1]
    return len(factors) > 1 and max(factors) - min(factors) < 1e-9 * max(factors)


def _give_up() -> NoReturn:
    raise FailedFitError(
        f"the noise cannot be estimated from these observations in {_STEPS} steps; declare it"
    )


def _estimated(
    problem: Problem, fit: _core.JointFit, parts: _Parts
) -> tuple[Problem, _core.JointFit] | None:
    """The estimate with a factor for each of these parts; None where it does not settle."""
    sizes: dict[str, float] = {}  # logarithms of factors to what was declared
    history: list[tuple[Array, Array]] = []
    for _ in range(_STEPS):
        shares = _shares(problem, fit, parts)
        nothing = [name for name, each in shares.items() if each.is_nothing]
        if not nothing and max(each.change for each in shares.values()) < _STILL:
            return problem, fit
        if tuple(sizes) != tuple(shares):  # others have rows to spare than in the step before
            history, sizes = [], {name: sizes.get(name, 0.0) for name in shares}
        history.append(
            (np.array(list(sizes.values())), np.array([s.step for s in shares.values()]))
        )
        after = dict(zip(sizes, _extrapolated(history).tolist(), strict=True))
        factors = {name: math.exp(after[name] - sizes[name]) for name in sizes}
        factors |= dict.fromkeys(nothing, 0.0)
        sizes = after
        problem = dataclasses.replace(problem, noise=_times(problem.noise, factors, parts))
        fit = problem.fit(nearest=problem.options.gauge == "nominal")
    return None


def _times(
    noise: NoiseSettings, factors: Mapping[str, float], parts: _Parts = _PARTS
) -> NoiseSettings:
    """Every part times its factor; along a direction as across it where it is the same."""
    changes = {
        name: getattr(noise, name) * factor
        for part, factor in factors.items()
        for name in parts[part]
        if getattr(noise, name) is not None
    }
    return dataclasses.replace(noise, **changes)


def _extrapolated(history: list[tuple[Array, Array]]) -> Array:
    """Where the steps from the places in a history would end, to first order; never far away.

    Secants from far away may point back, where the steps themselves never lead.
    """
    recent = history[-1 - len(history[-1][0]) :]
    places, steps = (np.array(each) for each in zip(*recent, strict=True))
    by_place, by_step = np.diff(places, axis=0), np.diff(steps, axis=0)
    shares = np.linalg.lstsq(by_step.T, steps[-1], rcond=1e-6)[0]
    way = steps[-1] - (by_place + by_step).T @ shares
    way = np.where(way * steps[-1] > 0, way, steps[-1])
    return np.asarray(places[-1] + np.clip(way, -_FARTHEST_STEP, _FARTHEST_STEP))


def _shares(problem: Problem, fit: _core.JointFit, parts: _Parts) -> dict[str, Share]:
    """What the rows say of each noise that is not zero."""
    rows = Rows.of(fit)
    groups = _rows_of_parts(problem, rows)
    if parts is _ALL:
        groups = {"noise": np.logical_or.reduce([*groups.values()])}
    found = _shares_of(problem, rows, groups)
    if not found:
        raise SymkinError("no observation is redundant, so the noise cannot be estimated")
    return found


def shares_by_axis(problem: Problem, fit: _core.JointFit) -> dict[str, Share]:
    """What positions and points say along each axis of the device; nothing without such."""
    rows, space = Rows.of(fit), problem.measurements.space
    kinds, size = np.array(KINDS)[rows.kind], max(space.size, 1)
    place = ((kinds == "pose") & (rows.index < space.size)) | (kinds == "points")
    axes = {name: place & (rows.index % size == i) for i, name in enumerate(space.position)}
    found = _shares_of(problem, rows, axes)
    return {name: each for name, each in found.items() if each.redundancy > 1}


def _shares_of(
    problem: Problem, rows: Rows, groups: Mapping[str, NDArray[np.bool_]]
) -> dict[str, Share]:
    """Of groups of rows that have no deviations of their own, those of which any is redundant."""
    within = _in_deviations(problem, rows)
    shown = np.isfinite(within) & np.isfinite(rows.t) & (rows.t != 0) & _undeclared(problem, rows)
    used = {name: own & shown for name, own in groups.items()}
    return {name: _share(within[own], rows.t[own]) for name, own in used.items() if own.any()}


def _share(within: Array, t: Array) -> Share:
    squares = np.square(within)
    redundancy = float(np.sum(squares / np.square(t)))
    step = math.log(float(squares.sum()) / redundancy) / 2 if redundancy > 0 else 0.0
    return Share(step, redundancy, len(t))


def _rows_of_parts(problem: Problem, rows: Rows) -> dict[str, NDArray[np.bool_]]:
    positions = problem.measurements.space.size
    kinds = np.array(KINDS)[rows.kind]
    angles = [each.kind for each in OBSERVABLES.values() if each.is_angle]
    angular = (kinds == "pose") & (rows.index >= positions) | np.isin(kinds, angles)
    position = ~angular & (kinds != "readings") & (kinds != "reported pose")
    found = {"reading": kinds == "readings", "orientation": angular, "position": position}
    if problem.noise.along is not None:
        # Those that are half as exact with twice the noise along the direction.
        more = _times(problem.noise, {"along": 2.0})
        along = position & (_deviations(problem, rows, more) > 1.5 * _deviations(problem, rows))
        found |= {"position": position & ~along, "along": along}
    return found


def _undeclared(problem: Problem, rows: Rows) -> NDArray[np.bool_]:
    """Which rows have no standard deviation of their own."""
    taken = problem.measurements
    own = {name: getattr(taken, each.deviations) for name, each in OBSERVABLES.items()}
    return np.isnan(_of_rows({k: v for k, v in own.items() if v is not None}, rows))


def _deviations(problem: Problem, rows: Rows, noise: NoiseSettings | None = None) -> Array:
    """Standard deviations of rows, with the noise of the problem if no other is said."""
    return _of_rows(problem.measurements.standard_deviations(noise or problem.noise), rows)


def _of_rows(tables: dict[str, Array], rows: Rows) -> Array:
    """Of each row its entry in tables by what was observed; NaN where there is none."""
    found = np.full(len(rows.pose), np.nan)
    for kind, name in enumerate(OBSERVED):
        if name in tables:
            own = rows.kind == kind
            flat = tables[name].reshape(len(tables[name]), -1)
            found[own] = flat[rows.pose[own], rows.index[own]]
    return found


def _in_deviations(problem: Problem, rows: Rows) -> Array:
    """Residuals over their standard deviations; NaN of what is exact."""
    deviations = _deviations(problem, rows)
    deviations[deviations == 0] = np.nan
    return np.asarray(rows.residual / deviations)


def noise_of_sessions(
    problem: Problem, fit: _core.JointFit
) -> tuple[Problem, _core.JointFit, tuple[float, ...]]:
    """Estimate the noise of every session with the unknowns, as so many times the declared one.

    All deviations of a session change alike, those that rows have of their own too; what is exact
    stays exact. Returns the problem and its fit with the deviations that were found in
    the measurements, and of each session in the order of their numbers how many times the declared
    noise that is. Raises `SymkinError` if nothing in a session is redundant.
    """
    declared = problem.measurements
    sessions = sessions_of(declared)
    logs = np.zeros(len(sessions))
    for _ in range(_STEPS):
        change = 0.0
        rows = Rows.of(fit)
        within = _in_deviations(problem, rows)
        for k, (number, own) in enumerate(sessions.items()):
            used = own[rows.pose] & np.isfinite(within) & np.isfinite(rows.t) & (rows.t != 0)
            share = _share(within[used], rows.t[used])
            if not share.redundancy > 0:
                raise SymkinError(
                    f"nothing in session {number} is redundant, so that its noise cannot be "
                    "estimated; leave noise out of sessions"
                )
            logs[k] += share.step
            change = max(change, share.change)
        if change < _STILL:
            return problem, fit, tuple(np.exp(logs).tolist())
        factors = np.ones(len(declared))
        for own, log in zip(sessions.values(), logs.tolist(), strict=True):
            factors[own] = math.exp(log)
        scaled = _scaled(declared, problem.noise, factors)
        problem = dataclasses.replace(problem, measurements=scaled)
        fit = problem.fit(nearest=problem.options.gauge == "nominal")
    raise SymkinError(
        f"the noise of the sessions is not found in {_STEPS} steps; declare it by columns of "
        "standard deviations"
    )


def _scaled(measurements: Measurements, noise: NoiseSettings, factors: Array) -> Measurements:
    """With the deviations of every row times its factor."""
    if noise.along is not None:
        raise SymkinError(
            "sessions with noise of their own want a noise of positions that is the same in all "
            "directions; leave along out of the [noise], or declare the sessions' by columns of "
            "standard deviations"
        )
    changes = {
        OBSERVABLES[name].deviations: own * factors.reshape(-1, *[1] * (own.ndim - 1))
        for name, own in measurements.coordinate_deviations(noise).items()
    }
    return dataclasses.replace(measurements, **changes)  # type: ignore[arg-type]
