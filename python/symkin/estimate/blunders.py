# SPDX-License-Identifier: MIT
"""Observations that do not fit."""

from __future__ import annotations

import dataclasses

import numpy as np

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.options import ROBUST, Loss
from symkin.estimate.problem import OBSERVED, Problem, Rows, without_pose

_SUSPICIOUS = 3.5  # standard deviations, from which single rows are dropped


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
