# SPDX-License-Identifier: MIT
"""What a motion capture saw of the platform, beside encoders.

A take and a log of the encoders have clocks of their own, see `symkin.analysis.clocks`. What is
taken of both are means over rests, since there no clock matters.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.clocks import Track, align_clocks, rests_of
from symkin.data.columns import own_columns, read_readings, reading_column_names
from symkin.errors import SymkinError
from symkin.exports.logs.log import Asked, ImportedLog, Log, LogFormat
from symkin.exports.logs.topics import is_topic, topic_column, topic_table
from symkin.model.mechanism import Mechanism
from symkin.model.poses import rotations_from_quaternions
from symkin.storage.tables import read_table
from symkin.values import Array, record

LENGTH_UNITS = {"meters": 1.0, "metres": 1.0, "millimeters": 1e-3, "millimetres": 1e-3,
                "centimeters": 1e-2, "mm": 1e-3, "cm": 1e-2, "m": 1.0}  # fmt: skip
_TIMES = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6, "time_ns": 1e-9}
_LIKE = 0.5  # correlation of distances below which two logs are of two motions
_FAR = 3.0  # times as far: no error of a drawing, and no unit for another
_CLOCKS_APART = 0.01
_OFTEN = 0.5  # of the samples with the marker that was seen most


@record
class Take:
    """What a device saw of the platform."""

    times: Array
    positions: Array  # (N, 3), m
    quaternions: Array  # (N, 4), x y z w; NaN where it has none
    points: Array  # (N, k, 3)
    took: tuple[str, ...]
    left: tuple[str, ...]

    @classmethod
    def of(
        cls,
        times: Array,
        took: Sequence[str],
        left: Sequence[str],
        *,
        positions: Array | None = None,
        quaternions: Array | None = None,
        points: Array | None = None,
    ) -> Take:
        """Of what is not given nothing was seen."""
        count = len(times)
        return cls(
            times,
            np.full((count, 3), np.nan) if positions is None else positions,
            np.full((count, 4), np.nan) if quaternions is None else quaternions,
            np.zeros((count, 0, 3)) if points is None else points,
            tuple(took),
            tuple(left),
        )

    @property
    def track(self) -> Track:
        """Where it was, by what was seen throughout: not by markers that were lost for long."""
        if np.isfinite(self.positions).any():
            return Track(self.times, self.positions)
        counts = np.isfinite(self.points).all(axis=2).sum(axis=0)
        often = counts > _OFTEN * counts.max(initial=0)
        return Track(self.times, self.points[:, often].mean(axis=1))


def take_format(
    name: str, title: str, recognises: Callable[[Log], bool], read: Callable[[Log, Asked], Take]
) -> LogFormat:
    """A format whose reader joins a take with what the encoders showed."""

    def reader(log: Log, asked: Asked) -> ImportedLog:
        take = read(log, asked)
        if asked.beside is None:
            columns = _columns_of_take(take, np.arange(len(take.times)))
            columns = {"time_s": take.times, **columns}
            left = (*take.left, "rests: without a log of the encoders every sample is a row")
            return ImportedLog(title, columns, None, take.took, left)
        if asked.mechanism is None:
            raise log.error(
                "was recorded beside encoders, whose clock is found by where the robot should have "
                "been; say which robot: --mechanism FILE"
            )
        return _joined(take, asked.beside, asked.mechanism, title)

    return LogFormat(name, title, recognises, reader)


def _joined(take: Take, beside: Log, robot: Mechanism, title: str) -> ImportedLog:
    """Means of both over the rests that both show."""
    times, readings = _encoders(beside, robot)
    poses, _ = robot.forward_kinematics(readings)
    size = robot.space.size
    if not size:
        raise beside.error("is of a platform that only turns; expected one that moves")
    try:
        shown = Track(times, np.where(np.isfinite(poses[:, :size]), poses[:, :size], np.nan))
    except SymkinError as error:
        raise beside.error(str(error)) from error
    seen = take.track
    clocks = align_clocks(seen, shown)
    if abs(clocks.rate - 1) > _CLOCKS_APART:
        raise beside.error(
            "and the take are not of one motion, or not in the units that their names say: one "
            f"clock would go {clocks.rate:.3g} times as fast as the other"
        )
    rests = rests_of(seen, shown, clocks)
    rows: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []
    for begin, end in rests:
        own = np.flatnonzero((take.times >= begin) & (take.times <= end))
        there = clocks.of_first(times)
        other = np.flatnonzero((there >= begin) & (there <= end))
        if len(own) > 2 and len(other) > 2:
            rows.append((own, other))
    if not rows:
        raise beside.error(
            "and the take share no rest of 0.3 s or more; hold still at each pose, since samples "
            "taken while it moves are as wrong as the clocks are"
        )
    alike, times_as_far = _compared(seen.positions, shown.positions, rows)
    if alike < _LIKE:
        raise beside.error(
            "and the take are not of one motion: the places where they rest are otherwise apart"
        )
    if not 1 / _FAR < times_as_far < _FAR:
        raise beside.error(
            f"and the take are not in the units that they say: the take's rests are "
            f"{times_as_far:.3g} times as far apart as the nominal robot's at these readings"
        )
    columns: dict[str, Array] = {"time_s": np.array([take.times[own].mean() for own, _ in rows])}
    parts = [_columns_of_take(take, own, mean=True, robot=robot) for own, _ in rows]
    for name in parts[0]:
        columns[name] = np.array([part[name][0] for part in parts])
    means = np.array([np.nanmean(readings[other], axis=0) for _, other in rows])
    names = reading_column_names(robot.reading_count, robot.reading_unit)
    columns |= dict(zip(names, means.T, strict=True))
    off = 1e3 * (clocks.deviation if math.isfinite(clocks.deviation) else 0.0)
    took = (
        *take.took,
        f"{len(rows)} rests, means over {int(np.median([len(own) for own, _ in rows]))} samples of "
        f"the take (median)",
        f"the encoders' clock: {clocks.offset:+.4f} s, {1e6 * (clocks.rate - 1):+.0f} ppm, known "
        f"within {off:.2g} ms; speeds alike by {clocks.correlation:.3f}",
    )
    used = sum(len(own) for own, _ in rows)
    left = (*take.left, f"{len(take.times) - used} samples of the take between rests")
    return ImportedLog(title, columns, None, took, left)


def _compared(
    seen: Array, shown: Array, rows: Sequence[tuple[NDArray[np.intp], NDArray[np.intp]]]
) -> tuple[float, float]:
    """Correlation of the distances between the places where two logs rest, and their ratio.

    1 of fewer than four places, of which nobody can tell.
    """
    apart = []
    for places, which in ((seen, 0), (shown, 1)):
        means = np.array([np.nanmean(places[row[which]], axis=0) for row in rows])
        away = np.linalg.norm(means[:, None] - means[None], axis=2)
        apart.append(away[np.triu_indices(len(rows), 1)])
    if len(rows) < 4 or not apart[1].any():
        return 1.0, 1.0
    first, second = (each - each.mean() for each in apart)
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    ratio = float(np.linalg.norm(apart[0]) / np.linalg.norm(apart[1]))
    return float(first @ second) / size if size else 1.0, ratio


def _columns_of_take(
    take: Take, rows: NDArray[np.intp], *, mean: bool = False, robot: Mechanism | None = None
) -> dict[str, Array]:
    """Columns of a table of measurements; of their mean, one row."""

    def averaged(values: Array) -> Array:
        some = values[rows]
        if not mean:
            return np.asarray(some)
        good = np.isfinite(some).all(axis=1)
        return np.asarray(some[good].mean(axis=0, keepdims=True) if good.any() else some[:1])

    columns: dict[str, Array] = {}
    space = None if robot is None else robot.space
    size = 3 if space is None else space.size
    if np.isfinite(take.positions).any():
        places = averaged(take.positions)
        columns |= {f"{axis}_m": places[:, k] for k, axis in enumerate("xyz"[:size])}
    if np.isfinite(take.quaternions).any() and (space is None or space.turns):
        turns = take.quaternions.copy()
        if mean:  # q and -q are one rotation
            some = turns[rows]
            known = some[np.isfinite(some).all(axis=1)]
            turns[rows] *= np.sign(some @ known[0])[:, None] if len(known) else 1.0
        turns = averaged(turns)
        turns = turns / np.linalg.norm(turns, axis=1, keepdims=True)
        if size == 3:
            columns |= {name: turns[:, k] for k, name in enumerate(("qx", "qy", "qz", "qw"))}
        else:
            rotations = rotations_from_quaternions(turns)
            columns["phi_rad"] = np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0])
    for i in range(take.points.shape[1]):
        places = averaged(take.points[:, i])
        columns |= {f"p{i + 1}_{axis}_m": places[:, k] for k, axis in enumerate("xyz"[:size])}
    return columns


def _encoders(log: Log, robot: Mechanism) -> tuple[Array, Array]:
    """Times and readings of a table with a column of time, or of ROS's joint states."""
    legs = robot.reading_count
    if is_topic(log):
        names, values = topic_table(log)
        found = [
            topic_column(
                names, *(f"position{each}" for each in (leg, f"[{leg}]", f".{leg}", f"_{leg}"))
            )
            for leg in range(legs)
        ]
        if None in found:
            raise log.error(f"has no positions of {legs} joints (field.position0, ...)")
        return values[:, 0], values[:, [each for each in found if each is not None]]
    table = read_table(log.path)
    name = next((each for each in _TIMES if each in table.names), None)
    if name is None:
        raise log.error(
            f"has no column {', '.join(_TIMES)}, of when each sample was taken (columns present: "
            f"{', '.join(table.names)})"
        )
    times = _TIMES[name] * table.numbers(name)
    columns = own_columns(table, robot.pose_space, legs, partial=True)
    readings = read_readings(table, columns, robot.reading_unit)
    unread = np.flatnonzero(~np.isfinite(readings).any(axis=0))
    if len(unread):
        raise log.error(
            f"has no readings of {robot.named_legs(unread)} (columns present: "
            f"{', '.join(table.names)})"
        )
    return times, readings


def chosen_body(log: Log, bodies: Sequence[str], wanted: str, what: str) -> str:
    """Return the one that is wanted, or the first; empty if there is none."""
    if wanted and wanted not in bodies:
        raise log.error(f'has no {what} "{wanted}"; expected {" or ".join(bodies) or "none"}')
    return wanted or (bodies[0] if bodies else "")
