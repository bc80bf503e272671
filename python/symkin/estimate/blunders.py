# SPDX-License-Identifier: MIT
"""Observations that do not fit."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from statistics import NormalDist

import numpy as np

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.estimate.options import ROBUST, Loss
from symkin.estimate.problem import KINDS, OBSERVED, Problem, Rows, without_pose

_POSES = ("poses", "reported")
ALIKE = 1 - 1e-6  # of t: observations that nothing tells apart
_AT_ONCE = 0.05  # of the poses
_READING = KINDS.index("readings")


def limit_of(count: int) -> float:
    """Which the t of some observation exceeds in one of 1000 sound robots with so many."""
    return NormalDist().inv_cdf(1 - FALSE_ALARMS / 2 / max(count, 1))


def worst_first(rows: Rows, limit: float) -> list[int]:
    """Of each pose the observation that fits worst, if its t is beyond the limit; the worst first.

    Of those that nothing tells apart no reading, which is seldom typed: with one condition any
    observation of the pose may be it.
    """
    size = np.abs(np.nan_to_num(rows.t))
    worst = []
    for pose in np.unique(rows.pose[size > limit]).tolist():
        own = np.flatnonzero(rows.pose == pose)
        alike = own[size[own] > ALIKE * size[own].max()]
        worst.append(int(alike[np.argmin(rows.kind[alike] == _READING)]))
    return sorted(worst, key=lambda row: (-round(float(size[row]), 3), rows.kind[row] == _READING))


def without_blunders(
    problem: Problem, fit: _core.JointFit, most: int | None = None
) -> tuple[Problem, _core.JointFit, tuple[tuple[int, str], ...]]:
    """Drop single observations that do not fit, and poses of which more than one does not.

    Looks first while a robust loss holds what does not fit down, then without. A pose whose worst
    observation is not the only one that does not fit is dropped as a whole: single rows of such a
    pose would mislead. Ends as it is where that would drop more than `most`.
    """
    rejected: list[tuple[int, str]] = []
    nearest = problem.options.gauge == "nominal"
    loss: Loss = problem.options.loss
    if loss == "none":
        loss, fit = ROBUST, _robust(problem, nearest=nearest, loss=ROBUST)
    while True:
        changes = list(_worst(problem, Rows.of(fit), {pose for pose, _ in rejected}))
        if most is not None and len(rejected) + len(changes) > most:
            changes = []
        if not changes and loss == "none":
            return problem, fit, tuple(sorted(rejected, key=lambda each: each[0]))
        if not changes:
            loss = "none"
        again = {pose for pose, _ in changes}
        rejected = [each for each in rejected if each[0] not in again] + changes
        measurements = without(problem.measurements, changes)
        problem = dataclasses.replace(problem, measurements=measurements)
        fit = _robust(problem, nearest=nearest, loss=loss)


def _worst(problem: Problem, rows: Rows, spoiled: set[int]) -> Iterator[tuple[int, str]]:
    """What to drop next: a few, no less than half as far off as the worst, which may make them so.

    Of poses that measurements join one, which may be all that is wrong.
    """
    blocks, dropped = problem.measurements.first_of_block, set[int]()
    worst = worst_first(rows, limit_of(int(np.isfinite(rows.t).sum())))
    for row in worst:
        pose = int(rows.pose[row])
        far = abs(rows.t[row]) >= abs(rows.t[worst[0]]) / 2
        few = len(dropped) < max(_AT_ONCE * len(blocks), 1)
        if far and few and blocks[pose] not in dropped:
            dropped.add(int(blocks[pose]))
            whole, space = pose in spoiled, problem.mechanism.pose_space
            yield pose, "everything" if whole else rows.what(row, space)


def _robust(problem: Problem, *, nearest: bool, loss: Loss) -> _core.JointFit:
    """Fit with a loss, or without where single poses decide too much for one."""
    try:
        return problem.fit(nearest=nearest, loss=loss)
    except NotIdentifiableError:
        raise
    except SymkinError:
        return problem.fit(nearest=nearest, loss="none")


def without_rejected(found: Found) -> Measurements:
    """What everything was estimated from together: without the observations that were left out."""
    return found.measurements if found.legs else without(found.measurements, found.rejected)


def without(measurements: Measurements, rejected: Sequence[tuple[int, str]]) -> Measurements:
    """Without single observations of poses, or all of one."""
    places = dict(_places(measurements)) if rejected else {}
    for pose, what in rejected:
        measurements = _without(measurements, pose, places.get(what))
    return measurements


def _places(measurements: Measurements) -> Iterator[tuple[str, tuple[str, int]]]:
    """The name of each observation that a row may have, and where that is kept."""
    space = measurements.space
    for kind in OBSERVED:
        values = getattr(measurements, kind)
        if values is not None:
            count = space.dof if kind in _POSES else values[:1].size
            for index in range(count):
                yield Rows.named(OBSERVABLES[kind].kind, index, space.name), (kind, index)


def _without(measurements: Measurements, pose: int, place: tuple[str, int] | None) -> Measurements:
    """Without one observation of a pose, or without all where none is told."""
    if place is None:
        return without_pose(measurements, pose)
    kind, index = place
    changed = np.array(getattr(measurements, kind))
    values = changed.reshape(len(changed), -1)[pose]
    space = measurements.space
    whole = kind in _POSES and space.has_quaternion and index >= space.size
    values[slice(space.size, None) if whole else index] = np.nan
    changes = {kind: changed}
    return dataclasses.replace(measurements, **changes)  # type: ignore[arg-type]
