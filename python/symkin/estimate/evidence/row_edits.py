# SPDX-License-Identifier: MIT
"""Corrections of rows: readings and poses that do not belong together, and units of some rows."""

from __future__ import annotations

import dataclasses
import itertools
import math
import operator
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from symkin.data.measured_rows import changed_arrays
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.assignment import assigned
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction
from symkin.model.framing import framed, unframed
from symkin.model.mechanism import Mechanism
from symkin.model.turns import shortest_ways
from symkin.values import Array

_LATE = 3  # rows, of all readings
_LATE_ALONE = 2  # of one leg's
_LATE_IN_PAIRS = 1  # of two legs'
_MOST = 400  # rows that are put in another order
_MOST_TRIED = 100  # rows, if each value of a column is tried in each of them
_FEW = 8  # rows from which a sorted column is none by chance
_FAR = 30.0  # times as far out as the drawing has it: in another unit
_BEYOND = 1e6  # of a cell that cannot be
_READ = ("readings", "reading_deviations")


def edits_of_rows(stated: Correction) -> Iterator[Correction]:
    """All of them."""
    yield from _shifts(stated)
    poses = stated.measurements.poses
    if np.isfinite(poses).all():
        yield from _units_of_rows(stated)
        yield from _lost_rows(stated)
        yield from _orders(stated)
    elif np.isfinite(poses[:, : stated.mechanism.space.size]).all() and not _is_elsewhere(stated):
        yield from _lost_rows(stated)
        yield from _orders(stated)
    if _is_elsewhere(stated) or not np.isfinite(stated.measurements.poses).all():
        yield from _far_out(stated)


def _is_elsewhere(stated: Correction) -> bool:
    """Whether nobody knows where the device stands."""
    return "base" in stated.options.frames


def _shifts(stated: Correction) -> Iterator[Correction]:
    """Readings that stand some rows late or early, of all legs, of one or of two."""
    measured = stated.measurements
    count, legs = len(measured.readings), stated.columns
    if count <= 2 * _LATE:
        return
    every = tuple(range(legs))
    pairs = [each for each in itertools.combinations(every, 2) if len(each) < legs]
    for size in range(1, _LATE + 1):
        alone = [(leg,) for leg in every if size <= _LATE_ALONE]
        for late in (size, -size):
            for own in (every, *alone, *(pairs if size <= _LATE_IN_PAIRS else ())):
                yield _moved(stated, own, late)


def _moved(stated: Correction, own: tuple[int, ...], late: int, begin: int = 0) -> Correction:
    """Move readings back, from a row on."""
    measured, n = stated.measurements, abs(late)
    rows = np.arange(len(measured.readings))
    # Rows without a partner: the last ones, or those from where they are late.
    rows = rows[:-n] if late > 0 else np.delete(rows, slice(begin, begin + n))
    partners = rows + np.where(rows >= begin, late, 0)

    def moved(values: Array) -> Array:
        found = values[rows]
        found[:, own] = values[partners][:, own]
        return found

    since = f" from row {measured.row_numbers[begin]} on" if begin else ""
    figures = {
        "shift": f"{n} row{'s' * (n > 1)} {'late' if late > 0 else 'early'}{since}",
        "back": f"{n} row{'s' * (n > 1)} {'up' if late > 0 else 'down'}{since}",
    }
    return stated._replace(
        cause=Doubt("rows-shifted", own, size=float(late), figures=figures),
        measurements=dataclasses.replace(
            measured.subset(rows), **changed_arrays(measured, moved, *_READ)
        ),
    )


def _lost_rows(stated: Correction) -> Iterator[Correction]:
    """Readings that stand a row late or early from somewhere on, where a row is lost."""
    robot, measured = stated.mechanism, stated.measurements
    readings = measured.readings
    if len(readings) <= 2 * _FEW:
        return
    begins = np.arange(_FEW // 2, len(readings) - _FEW // 2)
    as_read = _misfits(robot, measured, readings)
    before = np.append(0.0, np.cumsum(as_read))
    for late in (1, -1):
        rolled = np.roll(readings, -late, axis=0)
        for own in (tuple(range(stated.columns)), *((leg,) for leg in range(stated.columns))):
            moved = np.array(readings)
            moved[:, own] = rolled[:, own]
            after = np.cumsum(_misfits(robot, measured, moved)[::-1])[::-1]
            # Where early, that row has none.
            since = (before[begins] + after[begins + (late < 0)]).argmin()
            yield _moved(stated, own, late, int(begins[since]))


def _misfits(robot: Mechanism, measured: Measurements, readings: Array) -> Array:
    """How far each row of readings is from what a robot has at its pose, or position."""
    if np.isfinite(measured.poses).all():
        return _total(_distances(robot, measured.poses, readings))
    drawn = framed(robot, robot.forward_kinematics(readings)[0])
    away = (measured.poses - drawn)[:, : robot.space.size]
    return _total(np.where(np.isfinite(away), away, _BEYOND))


def _units_of_rows(stated: Correction) -> Iterator[Correction]:
    """Some rows in another unit: of each that one which the drawing likes better."""
    measured, robot = stated.measurements, stated.mechanism
    size = measured.space.size
    as_read = _distances(robot, measured.poses, measured.readings)
    if size:
        for factor, unit in ((1e-3, "millimetres"), (1e-2, "centimetres")):
            poses = np.array(measured.poses)
            poses[:, :size] *= factor
            other = _distances(robot, poses, measured.readings)
            far = _total(other) < _total(as_read)
            yield from _of_rows(stated, far, "poses", poses, f"the positions|{unit}|metres")
    if stated.mechanism.reading_unit == "rad":
        readings = np.radians(measured.readings)
        other = _distances(robot, measured.poses, readings)
        far = _total(other) < _total(as_read)
        yield from _of_rows(stated, far, "readings", readings, "the readings|degrees|radians")


def _far_out(stated: Correction) -> Iterator[Correction]:
    """Positions far beyond those that the drawing, or other rows, have, as if in millimetres."""
    measured, size = stated.measurements, stated.measurements.space.size
    out = np.linalg.norm(measured.poses[:, :size], axis=1)
    if not size or not np.isfinite(out).any():
        return
    if _is_elsewhere(stated):
        far = np.sort(out[np.isfinite(out) & (out > 0)])
        gaps = far[1:] / far[:-1]
        usual = far[gaps.argmax()] if len(gaps) and gaps.max() > _FAR else math.inf
    else:
        try:
            drawn = stated.mechanism.forward_kinematics(measured.readings)[0]
        except SymkinError:
            return
        distances = np.linalg.norm(drawn[:, :size], axis=1)
        usual = np.nanmedian(distances) if np.isfinite(distances).any() else math.inf
    poses = np.array(measured.poses)
    poses[:, :size] *= 1e-3
    rows = out > (1.0 if _is_elsewhere(stated) else _FAR) * usual
    yield from _of_rows(stated, rows, "poses", poses, "the positions|millimetres|metres")


def _of_rows(
    stated: Correction, rows: NDArray[np.bool_], name: str, values: Array, words: str
) -> Iterator[Correction]:
    """Take other values in some rows, if these are some and not all."""
    if not rows.any() or rows.all():
        return
    measured = stated.measurements
    changed = np.where(rows[:, None], values, getattr(measured, name))
    numbers = tuple(measured.row_numbers[rows].tolist())
    what, unit, usual = words.split("|")
    figures = {"what": what, "unit": unit, "usual": usual}
    yield stated._replace(
        cause=Doubt("rows-in-another-unit", rows=numbers, figures=figures),
        measurements=dataclasses.replace(measured, **{name: changed}),  # type: ignore[arg-type]
    )


def _orders(stated: Correction) -> Iterator[Correction]:
    """Poses and readings in different orders, or one column that was sorted by itself."""
    measured = stated.measurements
    count = len(measured.poses)
    if not _FEW <= count <= _MOST:
        return
    yield from _ordered(stated, None)
    in_full = np.isfinite(measured.poses).all()
    in_any = in_full or count <= _MOST_TRIED
    columns = [("readings", leg) for leg in range(stated.columns) if in_any]
    columns += [("poses", axis) for axis in range(measured.space.size)]
    for name, column in columns:
        steps = np.diff(getattr(measured, name)[:, column])
        if (steps >= 0).all() or (steps <= 0).all():
            yield from _ordered(stated, (name, column))


def _ordered(stated: Correction, column: tuple[str, int] | None) -> Iterator[Correction]:
    """Put rows, or the values of a column, where a robot has them; by default the drawing."""

    def by(robot: Mechanism) -> Correction | None:
        measured = stated.measurements
        made = _matched(robot, measured) if column is None else _ranked(robot, measured, *column)
        if made is None:
            return None
        if column is None:
            figures = {"what": "poses and readings stand in different orders"}
        else:
            named = _name_of(robot, *column)
            figures = {"what": f"the column {named} was sorted by itself"}
        legs = (column[1],) if column is not None and column[0] == "readings" else ()
        return stated._replace(
            cause=Doubt("rows-out-of-order", legs, figures=figures), measurements=made, again=by
        )

    try:
        made = by(stated.mechanism)
    except SymkinError:
        return
    if made is not None:
        yield made


def _name_of(robot: Mechanism, name: str, column: int) -> str:
    if name == "readings":
        return f"of the readings of leg {column + 1}"
    return robot.space.position[column]


def _matched(robot: Mechanism, measured: Measurements) -> Measurements | None:
    """Rows of readings put to the poses, or positions, at which a robot has them."""
    order = assigned(_by_readings(robot, measured))
    if (order == np.arange(len(order))).all():
        return None
    return dataclasses.replace(
        measured, **changed_arrays(measured, operator.itemgetter(order), *_READ)
    )


def _by_readings(robot: Mechanism, measured: Measurements) -> Array:
    """What it costs to put readings, second axis, to poses."""
    if not np.isfinite(measured.poses).all():
        drawn = framed(robot, robot.forward_kinematics(measured.readings)[0])
        away = measured.poses[:, None] - drawn[None]
        costs = np.square(away[..., : robot.space.size]).sum(axis=2)
        return np.where(np.isfinite(costs), costs, _BEYOND)
    roots = robot.inverse_kinematics(unframed(robot, measured.poses))
    # Of poses, readings and legs.
    away = shortest_ways(robot, measured.readings[None] - roots[:, None])
    read = np.isfinite(measured.readings)
    spread = np.std(np.where(read, measured.readings, 0.0), axis=0, where=read | ~read.any(axis=0))
    costs = np.nansum((away / np.where(spread > 0, spread, 1.0)) ** 2, axis=2)
    costs[~np.isfinite(roots).any(axis=1)] = _BEYOND
    return np.asarray(costs)


def _ranked(robot: Mechanism, measured: Measurements, name: str, column: int) -> Measurements:
    """Values of a column given to rows by the rank that a robot says they have."""
    if name == "readings" and not np.isfinite(measured.poses).all():
        return _tried(robot, measured, column)
    if name == "readings":
        expected = robot.inverse_kinematics(unframed(robot, measured.poses))[:, column]
    else:
        if robot.frames is not None:  # what its readings say is in the robot's own frame
            robot = robot.replace(frames=None)
        expected = robot.forward_kinematics(measured.readings)[0][:, column]
    values = np.array(getattr(measured, name))
    ranks = np.argsort(np.argsort(np.nan_to_num(expected, nan=np.inf), kind="stable"))
    values[:, column] = np.sort(values[:, column])[ranks]
    return dataclasses.replace(measured, **{name: values})  # type: ignore[arg-type]


def _tried(robot: Mechanism, measured: Measurements, column: int) -> Measurements:
    """Values of a column of readings given to rows where they fit positions best."""
    count, size = len(measured.readings), robot.space.size
    values = np.array(measured.readings)
    tried = np.repeat(values, count, axis=0)
    tried[:, column] = np.tile(values[:, column], count)
    drawn = framed(robot, robot.forward_kinematics(tried)[0])[:, :size]
    away = measured.poses[:, None, :size] - drawn.reshape(count, count, size)
    costs = np.square(away).sum(axis=2)
    order = assigned(np.where(np.isfinite(costs), costs, _BEYOND))
    values[:, column] = values[order, column]
    return dataclasses.replace(measured, readings=values)


def _distances(robot: Mechanism, poses: Array, readings: Array) -> Array:
    """How far readings are from those of a robot at poses, (N, legs), in their spread."""
    away = shortest_ways(robot, readings - robot.inverse_kinematics(unframed(robot, poses)))
    return np.where(np.isfinite(readings) & ~np.isfinite(away), _BEYOND, np.nan_to_num(away))


def _logs(distances: Array) -> Array:
    """So that a reading that is far off says no more than another."""
    return np.asarray(np.log1p((distances / 1e-3) ** 2))


def _total(distances: Array) -> Array:
    """Of each row."""
    return np.asarray(_logs(distances).sum(axis=1))
