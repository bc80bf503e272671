# SPDX-License-Identifier: MIT
"""Motion capture beside encoders: Motive's and Vicon's CSV, and what ROS bags are exported to.

A take and a log of the encoders have clocks of their own, see `symkin.analysis.clocks`. What is
taken of both are means over rests, since there no clock matters.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.clocks import Track, align_clocks, rests_of
from symkin.data.columns import own_columns, read_readings, reading_column_names
from symkin.errors import SymkinError
from symkin.exports.logs.log import (
    Asked,
    ImportedLog,
    Log,
    LogFormat,
    numbers_of,
    rows_of,
)
from symkin.model.mechanism import Mechanism
from symkin.model.poses import quaternions_from_rotation_vectors, rotations_from_quaternions
from symkin.storage.quantities import unit_factor
from symkin.storage.tables import read_table
from symkin.values import Array, record

_UNITS = {"meters": 1.0, "metres": 1.0, "millimeters": 1e-3, "millimetres": 1e-3,
          "centimeters": 1e-2, "mm": 1e-3, "cm": 1e-2, "m": 1.0}  # fmt: skip
_TIMES = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6, "time_ns": 1e-9}
_LIKE = 0.5  # correlation of distances below which two logs are of two motions
_FAR = 3.0  # times as far: no error of a drawing, and no unit for another
_CLOCKS_APART = 0.01
# From y up to z up.
_UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@record
class _Take:
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
    ) -> _Take:
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
        """Where it was, by what was seen throughout."""
        if np.isfinite(self.positions).any():
            return Track(self.times, self.positions)
        return Track(self.times, self.points.mean(axis=1))


def _of_take(read: Callable[[Log, Asked], _Take], title: str) -> Callable[[Log, Asked], Any]:
    """A reader that joins a take with what the encoders showed."""

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

    return reader


def _joined(take: _Take, beside: Log, robot: Mechanism, title: str) -> ImportedLog:
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
    take: _Take, rows: NDArray[np.intp], *, mean: bool = False, robot: Mechanism | None = None
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
            turns[rows] *= np.sign(turns[rows] @ turns[rows][0])[:, None]
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
    if _is_ros(log):
        names, values = _ros_table(log)
        found = [
            _ros_column(
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


def _is_motive(log: Log) -> bool:
    return (
        log.data[:2000].lstrip(b"\xef\xbb\xbf").startswith((b"Format Version,", b"Format Version;"))
    )


def _read_motive(log: Log, asked: Asked) -> _Take:
    rows = rows_of(log)
    said = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = said.get("Length Units", "Meters")
    if unit.lower() not in _UNITS:
        raise log.error(f'has Length Units "{unit}"; expected Meters, Centimeters or Millimeters')
    factor = _UNITS[unit.lower()]
    head = next((i for i, row in enumerate(rows[:12]) if row and row[0] == "Frame"), None)
    if head is None or head < 3:
        raise log.error('has no row that begins with "Frame"; expected a take that Motive exported')
    by = {row[1]: row for row in rows[1:head] if len(row) > 1 and row[1]}
    for name in ("Type", "Name"):
        if name not in by:
            raise log.error(f'has no row "{name}" above its columns; export it with a header')
    width = len(rows[head])
    what, axes = rows[head - 1], rows[head]
    cells = [[*row, *[""] * (width - len(row))] for row in (by["Type"], by["Name"], what)]
    types, names, kinds = cells
    data = numbers_of(log, rows[head + 1 :], head + 2, width)
    data = data[np.isfinite(data[:, 1])] if width > 1 else data
    if len(data) < 1 or width < 5:
        raise log.error("has no samples below its header")
    bodies, markers = (
        list(dict.fromkeys(n for t, n in zip(types, names, strict=True) if t == wanted and n))
        for wanted in ("Rigid Body", "Marker")
    )

    def columns(name: str, kind: str, of: str) -> list[int]:
        found = {
            axes[k]: k
            for k in range(width)
            if names[k] == name and types[k] == kind and kinds[k] == of
        }
        return [found[axis] for axis in ("XYZW" if of == "Rotation" else "XYZ") if axis in found]

    body = _chosen(log, bodies, asked.body, "rigid body")
    seen: dict[str, Array] = {}
    left = [f'rigid body "{each}"' for each in bodies if each != body]
    if body:
        place = columns(body, "Rigid Body", "Position")
        if len(place) != 3:
            raise log.error(f'has no position X, Y, Z of the rigid body "{body}"')
        seen["positions"] = factor * data[:, place] @ _UPRIGHT.T
        turn = columns(body, "Rigid Body", "Rotation")
        if len(turn) == 4:
            vectors = data[:, turn[:3]] @ _UPRIGHT.T
            seen["quaternions"] = np.column_stack([vectors, data[:, turn[3]]])
        elif turn:
            left.append(
                f'the rotation of "{body}" as Euler angles: export it as quaternions, which have '
                "one order"
            )
        left += [f"{len(markers)} markers"] * bool(markers)
    elif markers:
        found = [columns(each, "Marker", "Position") for each in markers]
        if any(len(each) != 3 for each in found):
            raise log.error("has markers without X, Y, Z")
        seen["points"] = np.stack([factor * data[:, each] @ _UPRIGHT.T for each in found], axis=1)
    else:
        raise log.error("has neither a rigid body nor markers")
    what_of = f"the rigid body {body!r}" if body else f"{len(markers)} markers"
    took = (
        f"{len(data)} samples of {what_of} of the take {said.get('Take Name', 'without a name')!r}",
        "axes with z up, x as Motive has it (Motive's y is up)",
    )
    left += [each for each in ("Mean Marker Error",) if each in kinds]
    return _Take.of(data[:, 1], took, left, **seen)


def _chosen(log: Log, bodies: Sequence[str], wanted: str, what: str) -> str:
    if wanted and wanted not in bodies:
        raise log.error(f'has no {what} "{wanted}"; expected {" or ".join(bodies) or "none"}')
    return wanted or (bodies[0] if bodies else "")


_VICON = ("Trajectories", "Segments", "Objects", "Global Coordinates")


def _is_vicon(log: Log) -> bool:
    first = log.data[:400].lstrip(b"\xef\xbb\xbf").splitlines()[:1]
    return bool(first) and first[0].strip(b' ,;"\t').decode("latin-1") in _VICON


def _read_vicon(log: Log, asked: Asked) -> _Take:
    rows = rows_of(log)
    head = next((i for i, row in enumerate(rows[:8]) if row and row[0].strip() == "Frame"), None)
    if head is None or head < 2 or len(rows) < head + 3:
        raise log.error('has no row that begins with "Frame"; expected what Vicon exports as CSV')
    rate_text = (rows[1] or [""])[0]
    try:
        rate = float(rate_text)
    except ValueError:
        rate = math.nan
    if not 0 < rate < 1e5:
        raise log.error(f'has the rate "{rate_text}" in its second row; expected samples a second')
    end = next(
        (i for i in range(head + 2, len(rows)) if not any(each.strip() for each in rows[i])),
        len(rows),
    )
    columns = _vicon_columns(rows[head - 1], rows[head], rows[head + 1])
    data = numbers_of(log, rows[head + 2 : end], head + 3, len(columns))
    if not len(data):
        raise log.error("has no samples below its header")
    frames = data[:, 0] + (np.nan_to_num(data[:, 1]) / 10 if len(columns) > 2 else 0)
    bodies = list(dict.fromkeys(_plain(each.name) for each in columns if each.axis == "RX"))
    left = [f"{len(rows) - end} rows below the first table"] * (end < len(rows))
    if bodies:
        body = _chosen(log, bodies, asked.body, "object")
        seen, took = _body_of_vicon(log, columns, data, body)
        left += [f'object "{each}"' for each in bodies if each != body]
    else:
        seen, took = _marks_of_vicon(log, columns, data)
    return _Take.of((frames - frames[0]) / rate, took, left, **seen)


class _Column(NamedTuple):
    """A column of what Vicon exports: the group that it is of, ``TX``, and its unit."""

    name: str
    axis: str
    unit: str


def _vicon_columns(names: list[str], axes: list[str], units: list[str]) -> list[_Column]:
    """Columns of the header's three rows; a name stands above the first of its columns alone."""
    found, name = [], ""
    beside = itertools.zip_longest(axes, names[: len(axes)], units[: len(axes)], fillvalue="")
    for axis, cell, unit in beside:
        name = cell.strip() or name
        found.append(_Column(name, axis.strip(), unit.strip()))
    return found


def _lengths(log: Log, columns: Sequence[_Column], data: Array, places: Sequence[int]) -> Array:
    """These columns in metres, as those without a unit are."""
    units = {columns[k].unit or "m" for k in places}
    if other := sorted(units - _UNITS.keys()):
        raise log.error(f'has lengths in "{other[0]}"; expected mm, cm or m')
    return np.asarray(data[:, places] * [_UNITS[columns[k].unit or "m"] for k in places])


def _marks_of_vicon(
    log: Log, columns: Sequence[_Column], data: Array
) -> tuple[dict[str, Array], list[str]]:
    named = [each.name for each in columns[2:] if each.axis == "X" and each.name]
    groups = list(dict.fromkeys(named))
    found = [
        [k for k, each in enumerate(columns) if (each.name, each.axis) == (name, axis)]
        for name in groups
        for axis in "XYZ"
    ]
    if not groups or any(len(each) != 1 for each in found):
        raise log.error("has neither segments (RX ... TZ) nor markers (X, Y, Z)")
    points = _lengths(log, columns, data, [k for (k,) in found]).reshape(len(data), -1, 3)
    seen = f"{len(data)} samples of {len(groups)} markers: {', '.join(map(_plain, groups))}"
    return {"points": points}, [seen]


def _body_of_vicon(
    log: Log, columns: Sequence[_Column], data: Array, body: str
) -> tuple[dict[str, Array], list[str]]:
    own = {each.axis: k for k, each in enumerate(columns) if _plain(each.name) == body}
    if not {"TX", "TY", "TZ"} <= own.keys():
        raise log.error(f'has no TX, TY, TZ of the object "{body}"')
    places = _lengths(log, columns, data, [own[axis] for axis in ("TX", "TY", "TZ")])
    turn = [own[axis] for axis in ("RX", "RY", "RZ", "RW") if axis in own]
    turns, how = np.full((len(data), 4), np.nan), "none"
    if len(turn) == 4:
        turns, how = data[:, turn], "as quaternions"
    elif len(turn) == 3:
        unit = columns[turn[0]].unit or "rad"
        if unit not in ("deg", "rad"):
            raise log.error(
                f'has rotations in "{unit}"; expected deg or rad in the row below the axes'
            )
        vectors = data[:, turn] * unit_factor(unit, "rad")
        good = np.isfinite(vectors).all(axis=1)
        turns[good] = quaternions_from_rotation_vectors(vectors[good])
        how = "as rotation vectors, as Vicon has them"
    took = [f'{len(data)} samples of the object "{body}"', f"its rotation {how}"]
    return {"positions": places, "quaternions": turns}, took


def _plain(name: str) -> str:
    """``Global Angle robot:plate`` as ``plate``."""
    return re.sub(r"^Global (Angle|Translation)\s+", "", name).rpartition(":")[2].strip()


# Of a header's time whole seconds and the rest, as the two ROS name them.
_STAMPS = (("stamp.sec", "stamp.nanosec"), ("stamp.secs", "stamp.nsecs"))


def _is_ros(log: Log) -> bool:
    head = log.data[:20_000].lstrip(b"\xef\xbb\xbf").partition(b"\n")[0]
    if re.match(rb"(%time|__time)[,;]", head):
        return True
    names = _names_of(head.decode("latin-1"))
    return len(names) > 2 and _stamp_of(names) is not None


def _names_of(head: str) -> list[str]:
    return [each.strip().strip('"') for each in re.split("[,;]", head)]


def _stamp_of(names: Sequence[str]) -> tuple[int, int] | None:
    """The columns of a header's time in seconds and nanoseconds."""
    for ends in _STAMPS:
        first, second = (_ros_column(names, end) for end in ends)
        if first is not None and second is not None:
            return first, second
    return None


def _ros_table(log: Log) -> tuple[list[str], Array]:
    """Names of the columns that hold numbers, time first in s, and their values."""
    rows = rows_of(log)
    names = [each.strip() for each in rows[0]]
    width = len(names)
    body = [row for row in rows[1:] if any(cell.strip() for cell in row)]
    if not body:
        raise log.error("has no rows below its header")
    stamp = None if names[0] in ("%time", "__time") else _stamp_of(names)
    times = (0,) if stamp is None else stamp
    plain = [*times, *(k for k in range(width) if k not in times and _is_number(body[0], k))]
    values = numbers_of(log, [[row[k] if k < len(row) else "" for k in plain] for row in body], 2,
                      len(plain))  # fmt: skip
    since = values[:, : len(times)] - values[0, : len(times)]
    if stamp is not None:
        seconds = since[:, 0] + 1e-9 * since[:, 1]
        return ["stamp", *(names[k] for k in plain[2:])], np.column_stack([seconds, values[:, 2:]])
    values[:, 0] = since[:, 0] * (1e-9 if names[0] == "%time" else 1.0)  # nanoseconds
    return [names[k] for k in plain], values


def _is_number(row: Sequence[str], k: int) -> bool:
    try:
        float(row[k])
    except (ValueError, IndexError):
        return False
    return True


def _ros_column(names: Sequence[str], *ends: str) -> int | None:
    """The column whose name ends so, with ``.`` or ``/`` before."""
    for k, name in enumerate(names):
        plain = name.replace("/", ".")
        if any(plain == end or plain.endswith(f".{end}") for end in ends):
            return k
    return None


def _read_ros(log: Log, _asked: Asked) -> _Take:
    names, values = _ros_table(log)
    place = [
        _ros_column(names, f"position.{axis}", f"translation.{axis}", f"point.{axis}")
        for axis in "xyz"
    ]
    if None in place:
        raise log.error(
            "has no position.x, position.y, position.z, as poses do; a table of joint states is "
            "the second file, beside one of poses"
        )
    turn = [_ros_column(names, f"orientation.{a}", f"rotation.{a}") for a in "xyzw"]
    used = [each for each in place if each is not None]
    seen = {"positions": values[:, used]}
    if None not in turn:
        columns = [each for each in turn if each is not None]
        seen["quaternions"] = values[:, columns]
        used += columns
    others = [name for k, name in enumerate(names) if k and k not in used]
    took = (f"{len(values)} poses of {re.sub(r'[./]x$', '', names[used[0]])}",)
    left = (f"columns {', '.join(others[:6])}{' ...' if len(others) > 6 else ''}",) * bool(others)
    return _Take.of(values[:, 0], took, left, **seen)


MOTIVE = LogFormat("motive", "a take of OptiTrack's Motive", _is_motive,
                   _of_take(_read_motive, "a take of OptiTrack's Motive"))  # fmt: skip
VICON = LogFormat("vicon", "a capture of Vicon", _is_vicon,
                  _of_take(_read_vicon, "a capture of Vicon"))  # fmt: skip
ROS = LogFormat("ros", "a topic of a ROS bag", _is_ros, _of_take(_read_ros, "a topic of a ROS bag"))
