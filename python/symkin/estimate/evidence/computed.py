# SPDX-License-Identifier: MIT
"""Rows of a table that were computed from a robot's model and never measured.

Such as rows of a plan that nobody overwrote with what was measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.conflict import LIMIT
from symkin.estimate.evidence.findings import Doubt
from symkin.model.framing import framed, unframed
from symkin.model.mechanism import Mechanism
from symkin.model.turns import shortest_ways

_EXACT = 1e-2  # of the noise: what a number differs by that was rounded and has none
_CHANCE = _EXACT * math.sqrt(2 / math.pi)  # of a measured number to come so near
_FEWEST = 2  # a single row may be a home by definition


def computed_rows(robot: Mechanism, measured: Measurements) -> NDArray[np.intp]:
    """Rows, from 0, of which the model computes all readings, or the position, without noise."""
    exact, conditions = _exact_readings(robot, measured)
    others = np.flatnonzero((conditions == 0) & np.isfinite(measured.readings).all(axis=1))
    if len(others):
        exact[others], conditions[others] = _exact_positions(robot, measured.subset(others))
    rows = np.flatnonzero(exact)
    by_chance = float(np.sum(_CHANCE ** conditions[conditions > 0]))
    # Of sound rows a number that is nearly Poisson's; the logarithm, since it may be minute.
    likely = len(rows) * math.log(max(by_chance, 1e-300)) - math.lgamma(len(rows) + 1)
    return rows if len(rows) >= _FEWEST and likely < math.log(LIMIT) else rows[:0]


def rows_not_measured(
    robot: Mechanism, measured: Measurements, model: str = "the drawing"
) -> Iterator[Doubt]:
    """Name the rows that are computed from the robot, which is this model, if others are not."""
    rows = computed_rows(robot, measured)
    if 0 < len(rows) < len(measured.poses):
        numbers = tuple(measured.row_numbers[rows].tolist())
        figures = {"count": len(rows), "model": model}
        yield Doubt("rows-computed", (), numbers, figures=figures)


def without_computed(robot: Mechanism, measured: Measurements) -> Measurements:
    """The rows that are left."""
    rows = np.arange(len(measured.poses))
    return measured.subset(np.setdiff1d(rows, computed_rows(robot, measured)))


def _exact_readings(
    robot: Mechanism, measured: Measurements
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Of each row whether all readings are those at its pose, and how many there are to compare."""
    straight, space = robot.replace(curvature=None), robot.space
    exact = np.zeros(len(measured.poses), dtype=np.bool_)
    conditions = np.zeros(len(exact), dtype=np.intp)
    whole = np.flatnonzero(np.isfinite(measured.poses).all(axis=1))
    poses = unframed(robot, measured.poses[whole])
    made = straight.inverse_kinematics(poses)
    readings = measured.readings[whole]
    known = np.isfinite(readings) & robot.is_read
    rows = known.any(axis=1)
    whole, known = whole[rows], known[rows]
    away = np.abs(shortest_ways(robot, made[rows] - readings[rows]))
    slopes = straight.pose_jacobian(poses[rows])
    noise = robot.noise
    by_place = np.linalg.norm(slopes[..., : space.size], axis=-1) * noise.position
    by_turn = np.linalg.norm(slopes[..., space.size :], axis=-1) * noise.orientation
    limit = _EXACT * np.sqrt(by_place**2 + by_turn**2 + noise.reading**2)
    exact[whole] = np.where(known, away < limit, True).all(axis=1)
    conditions[whole] = known.sum(axis=1)
    return exact, conditions


def _exact_positions(
    robot: Mechanism, measured: Measurements
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """The same of rows without orientation, by the positions at their readings."""
    size = robot.space.size
    seen = measured.poses[:, :size]
    known = np.isfinite(seen)
    try:
        poses, taken = robot.forward_kinematics(measured.readings)
    except SymkinError:  # as of cables, which leave something to gravity
        return np.zeros(len(seen), dtype=np.bool_), np.zeros(len(seen), dtype=np.intp)
    away = np.abs(framed(robot, poses)[:, :size] - seen)
    exact = np.where(known, away < _EXACT * robot.noise.position, True).all(axis=1)
    return exact & taken & known.any(axis=1), np.where(taken, known.sum(axis=1), 0)
