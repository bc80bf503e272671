# SPDX-License-Identifier: MIT
"""Observations that do not fit."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.found import Found
from symkin.estimate.options import ROBUST, Loss
from symkin.estimate.problem import OBSERVED, Problem, Rows, without_pose

_POSES = ("poses", "reported")
_SUSPICIOUS = 3.5  # standard deviations, from which single rows are dropped


def without_blunders(
    problem: Problem, fit: _core.JointFit, most: int | None = None
) -> tuple[Problem, _core.JointFit, tuple[tuple[int, str], ...]]:
    """Drop single observations that do not fit, and poses of which more than one does not.

    Looks first while a robust loss holds what does not fit down, then without. A pose whose worst
    observation is not the only one that does not fit is dropped as a whole: single rows of such a
    pose would mislead. Ends as it is where that would drop more than `most`.
    """
    rejected: list[tuple[int, str]] = []
    places = dict(_places(problem.measurements))
    space, nearest = problem.mechanism.pose_space, problem.options.gauge == "nominal"
    loss: Loss = problem.options.loss
    if loss == "none":
        loss, fit = ROBUST, _robust(problem, nearest=nearest, loss=ROBUST)
    while True:
        rows = Rows.of(fit)
        size = np.abs(np.nan_to_num(rows.t))
        changed = np.unique(rows.pose[size > _SUSPICIOUS]).tolist()
        if most is not None and len(rejected) + len(changed) > most:
            changed = []
        if not changed and loss == "none":
            return problem, fit, tuple(rejected)
        spoiled = {pose for pose, _ in rejected}
        measurements = problem.measurements
        for pose in changed:
            own = np.flatnonzero(rows.pose == pose)
            worst = int(own[np.argmax(size[own])])
            what = "everything" if pose in spoiled else rows.what(worst, space)
            measurements = _without(measurements, pose, places.get(what))
            rejected.append((pose, what))
        if not changed:
            loss = "none"
        problem = dataclasses.replace(problem, measurements=measurements)
        fit = _robust(problem, nearest=nearest, loss=loss)


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
    measurements = found.measurements
    if found.legs or not found.rejected:
        return measurements
    places = dict(_places(measurements))
    for pose, what in found.rejected:
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
