# SPDX-License-Identifier: MIT
"""What is the same in rows in turn, to the last digit, where the robot moves it.

A sensor that was not read, or a device that went on showing what it showed. Not what a plan keeps
where it is: by the drawing it has to move.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.clocks import runs_of
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import spare_conditions
from symkin.estimate.solution import settled, together
from symkin.model.framing import framed, unframed
from symkin.model.mechanism import Mechanism
from symkin.model.poses import Transform, between, transforms
from symkin.model.turns import shortest_ways
from symkin.values import Array

_FEWEST = 3  # rows in turn that are the same
_MOVES = 1e-3  # of its range: what moves, from a row to the next
_TOWARDS = 0.1  # of what a move would do at most; less of it a drawing may have wrong
_NOISE = 6.0  # standard deviations
_FIRST_OF_ALL = slice(1), slice(1, None)


Asked = tuple[Mechanism, EstimateOptions]


def what_stands_still(
    robot: Mechanism, measured: Measurements, asked: Asked | None = None
) -> Iterator[Doubt]:
    """Name it, with the rows, of a robot in the frames in which it was measured.

    Where these were estimated, what was asked for: with what stands still they may be anything.
    """
    space, legs = robot.space, measured.readings.shape[1]
    columns = np.hstack([measured.poses[:, : space.size], measured.readings])
    if len(columns) < _FEWEST:
        return
    same, ranges = np.diff(columns, axis=0), np.ptp(_finite(columns), axis=0)
    moves, seen = np.abs(same) > _MOVES * ranges, np.isfinite(same)

    def rows_of(own: list[int]) -> slice | None:
        """The longest run in which these are the same and most else moves."""
        others = np.delete(seen, own, axis=1).sum(axis=1)
        move = 2 * np.delete(moves, own, axis=1).sum(axis=1) > others
        return _longest((same[:, own] == 0).all(axis=1) & move)

    named = [("what the device sees", [*range(space.size)])] * space.moves
    named += [(name, [i]) for i, name in enumerate(space.position)]
    for name, own in named:
        if not np.nan_to_num(measured.poses[:, own]).any():  # as of an edge that is touched
            continue
        run = rows_of(own)
        if run is not None and _is_moved(robot, measured.readings[run], own):
            yield _doubt(name, (), measured.row_numbers[run])
            if len(own) == space.size:
                break
    for leg in range(legs):
        run = rows_of([space.size + leg])
        if run is not None and _is_turned(robot, measured, leg, run, asked):
            yield _doubt(f"the reading of leg {leg + 1}", (leg,), measured.row_numbers[run])


def _doubt(name: str, legs: tuple[int, ...], numbers: NDArray[np.intp]) -> Doubt:
    rows = tuple(numbers.tolist())
    figures = {"what": name, "first": rows[0], "last": rows[-1]}
    return Doubt("stands-still", legs, rows, figures=figures)


def _finite(columns: Array) -> Array:
    """With something in place of what was not observed that lies within the others."""
    known = np.isfinite(columns)
    first = columns[np.argmax(known, axis=0), np.arange(columns.shape[1])]
    return np.where(known, columns, np.nan_to_num(first))


def _longest(still: NDArray[np.bool_]) -> slice | None:
    """The rows of the longest run in which none differs from the one before, if there is one."""
    first, last = max(runs_of(still), key=np.ptp, default=(0, 0))
    return slice(int(first), int(last) + 1) if last - first + 1 >= _FEWEST else None


def _is_turned(
    robot: Mechanism, measured: Measurements, leg: int, run: slice, asked: Asked | None
) -> bool:
    """Whether by the drawing a leg's reading changes from row to row, by what else was measured."""
    straight, space = robot.replace(curvature=None), robot.space
    poses = measured.poses[run]
    poses = unframed(robot, poses[np.isfinite(poses).all(axis=1)])
    if not len(poses):
        poses = _without_reading(robot, measured, leg, run, asked)[run]
        poses = poses[np.isfinite(poses).all(axis=1)]
    made = straight.inverse_kinematics(poses)
    reached = np.isfinite(made[:, leg])
    if reached.sum() < 2:
        return False
    poses, made = poses[reached], made[reached]
    away = np.abs(shortest_ways(robot, made - made[0]))[1:, leg]
    slopes = straight.pose_jacobian(poses)[1:, leg]
    by_place, by_turn = (
        np.linalg.norm(each, axis=1) for each in (slopes[:, : space.size], slopes[:, space.size :])
    )
    moved, turned = _moves(robot, poses)
    noise = np.hypot(by_place * robot.noise.position, by_turn * robot.noise.orientation)
    values = np.unique(measured.readings[np.isfinite(measured.readings[:, leg]), leg])
    steps = float(np.median(np.diff(values))) if len(values) > 1 else 0.0
    least = np.maximum(_TOWARDS * (by_place * moved + by_turn * turned), _NOISE * noise)
    return bool((away > np.maximum(least, 2 * steps)).any())


def _without_reading(
    robot: Mechanism, measured: Measurements, leg: int, run: slice, asked: Asked | None
) -> Array:
    """Poses in the robot's own frame, as all but a reading says; NaN where that says nothing."""
    readings = np.array(measured.readings)
    readings[run, leg] = np.nan
    others = dataclasses.replace(measured, readings=readings)
    poses = np.full_like(measured.poses, np.nan)
    told = np.flatnonzero(spare_conditions(robot, others) >= 0)
    others = others.subset(told)
    if asked is not None:  # which may take a leg that is read
        options = dataclasses.replace(asked[1], prior="tolerances", gauge="prior")
        with suppress(SymkinError):
            poses[told] = together(asked[0], others, options).latent_poses
            return poses
    with suppress(SymkinError):
        poses[told] = settled(robot, robot.noise, others).fit().poses
    return poses


def _is_moved(robot: Mechanism, readings: Array, own: list[int]) -> bool:
    """Whether by the drawing positions change along some of their axes as readings do."""
    read = np.isfinite(readings).all(axis=1)
    if read.sum() < 2:
        return False
    try:
        poses, taken = robot.forward_kinematics(readings[read])
    except SymkinError:
        return False
    if taken.sum() < 2:
        return False
    seen = framed(robot, poses[taken])
    away = np.linalg.norm(seen[1:, own] - seen[0, own], axis=1)
    moved, turned = _moves(robot, seen)
    length = robot.characteristic_length
    least = np.maximum(_TOWARDS * (moved + length * turned), _NOISE * robot.noise.position)
    return bool((away > least).any())


def _moves(robot: Mechanism, poses: Array) -> tuple[Array, Array]:
    """How far poses are from the first of them, and by how much they are turned."""
    motions = transforms(robot.pose_space, poses)
    first, others = (Transform(*(each[rows] for each in motions)) for rows in _FIRST_OF_ALL)
    tangents = np.asarray(between(first, others))
    return np.linalg.norm(tangents[:, :3], axis=1), np.linalg.norm(tangents[:, 3:], axis=1)
