# SPDX-License-Identifier: MIT
"""Finding poses, readings and what else was observed in a table: names, units, quaternions."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.data.observables import (
    CIRCUMSTANCES,
    COMMANDED,
    OBSERVABLES,
    PAIR,
    PAIR_ROW,
    REPORTED,
    ROW,
    TURN_AXIS,
    Sizes,
)
from symkin.errors import MeasurementError, QuantityError, did_you_mean
from symkin.model.poses import POSE_SPACES, quaternions_from_rotation_vectors
from symkin.model.settings import MeasurementColumns
from symkin.storage.quantities import COUNTS, counts_steps, unit_factor, unit_names
from symkin.storage.tables import Table
from symkin.values import Array, record

_ANGLE_PURPOSE = "platform angle; positions alone do not identify the legs of a rigid platform"
_QUATERNION_PURPOSE = (
    "orientation as a quaternion x, y, z, w; positions alone do not identify the legs of a rigid "
    "platform"
)
# How each platform's orientation can be given, and in how many columns.
_ORIENTATION: dict[str, dict[str, int]] = {
    "planar": {"angle": 1},
    "point": {},
    "spatial": {"quaternion": 4, "rotation_vector": 3},
    "translating": {},
    "spherical": {"quaternion": 4, "rotation_vector": 3},
    "schoenflies": {"angle": 1},
}
# Nothing that was measured is larger, and squares of it can still be added.
_MOST = 1e12
# Rounded files keep about four digits; a larger error of the norm means that it is no quaternion.
_QUATERNION_NORM_TOLERANCE = 1e-3
# How like a column's name is to a coordinate's that it is taken for a slip of the pen.
_MISSPELT = 0.8
_MOST_SESSIONS = 10**6
_MOST_ROWS = 10**9


def check_columns(
    columns: MeasurementColumns, pose_space: str, leg_count: int, reading_unit: str
) -> None:
    """Refuse a mapping that does not fit the platform, the number of legs or the sensors.

    Raises
    ------
    MeasurementError
        Naming the key of the mapping, its number of columns and the number expected; a column that
        it names twice; a unit that is unknown or of another dimension.
    """
    if columns.position:
        _expect("position", len(columns.position), POSE_SPACES[pose_space].size)
    _expect("readings", len(columns.readings), leg_count)
    given = {
        "angle": int(columns.angle is not None),
        "quaternion": len(columns.quaternion),
        "rotation_vector": len(columns.rotation_vector),
    }
    allowed = _ORIENTATION[pose_space]
    named = [name for name, count in given.items() if count]
    for name in named:
        _expect(name, given[name], allowed.get(name, 0))
    if len(named) > 1:
        raise MeasurementError(
            f"the column mapping gives the orientation by {' and '.join(named)}; "
            f"expected {' or '.join(allowed)}"
        )
    _check_distinct(columns)
    _check_unit("position_unit", columns.position_unit, "m")
    _check_unit("orientation_unit", columns.orientation_unit, "rad")
    _check_unit("reading_unit", columns.reading_unit, reading_unit)


def pose_column_names(pose_space: str) -> list[str]:
    """Return the columns that symkin writes for poses, in the order of a pose array."""
    space = POSE_SPACES[pose_space]
    # An angle has a unit, the numbers of a quaternion have none.
    orientation = [f"{name}_rad" if name in space.rotation else name for name in space.orientation]
    return [f"{name}_m" for name in space.position] + orientation


def reading_column_names(leg_count: int, reading_unit: str) -> list[str]:
    """Return the columns that symkin writes for readings: ``psi_1_rad``, ``psi_2_rad``, ...

    Of legs that no sensor reads, which are the last, there are none.
    """
    unit = f"_{reading_unit}" if reading_unit else ""
    return [f"psi_{leg + 1}{unit}" for leg in range(leg_count)]


def own_columns(
    table: Table, pose_space: str, leg_count: int, *, partial: bool = False
) -> MeasurementColumns:
    """Return the columns of a table that names them as symkin does, with any unit.

    Where poses may be `partial`, a coordinate without a column is left out, but one that seems
    misspelt has to be found.
    """
    return replace(
        own_pose_columns(table, pose_space, partial=partial),
        readings=tuple(f"psi_{leg + 1}" for leg in range(leg_count)),
        leg="leg" if "leg" in table.names else None,
    )


def own_pose_columns(
    table: Table, pose_space: str, prefix: str = "", *, partial: bool = False
) -> MeasurementColumns:
    """Return the columns of a pose, as `own_columns`, whose names begin with `prefix`."""

    def named(*names: str) -> tuple[str, ...]:
        return tuple(f"{prefix}{name}" for name in names)

    space = POSE_SPACES[pose_space]
    spatial = space.has_quaternion
    angle = named(*space.rotation) if space.has_angle else ()
    vector = named(*space.rotation) if spatial else ()
    quaternion = named(*space.orientation) if spatial else ()
    position = named(*space.position)
    has_vector = any(_with_units(table, name) for name in vector)
    if partial:
        position = tuple(name if _is_meant(table, name, "m") else "" for name in position)
        angle = tuple(name for name in angle if _is_meant(table, name, "rad"))
        spatial = spatial and (has_vector or any(name in table.names for name in quaternion))
    return MeasurementColumns(
        position=position,
        readings=(),
        angle=angle[0] if angle else None,
        quaternion=quaternion if spatial and not has_vector else (),
        rotation_vector=vector if spatial and has_vector else (),
        names=None,
    )


def _is_meant(table: Table, name: str, si_unit: str) -> bool:
    """Whether a coordinate has a column, or one whose name is nearly what is expected."""
    from difflib import get_close_matches  # slow to import

    if is_present(table, name, None):
        return True
    if "_" in name:  # of a reported pose, of which nobody expects a column
        return False
    known = re.compile(
        r"(reported_.*|commanded_.*|x|y|z|phi|theta|r[xyz]|psi_\d+|p\d+_[xyz]|distance_\d+|"
        r"roll|pitch|yaw|turn|pair\d+_[a-z]+)(_sd)?_.*"
    )
    others = [each.lower() for each in table.names if not known.fullmatch(each)]
    return bool(get_close_matches(f"{name}_{si_unit}", others, n=1, cutoff=_MISSPELT))


def has_pose(columns: MeasurementColumns) -> bool:
    """Whether any coordinate of the pose has a column."""
    rotation = columns.angle is not None or columns.quaternion or columns.rotation_vector
    return any(columns.position) or bool(rotation)


def has_columns(table: Table, columns: MeasurementColumns) -> bool:
    """Whether a table has the columns of the pose and at least one of the readings."""
    angles = _angle_columns(columns)
    return (
        all(is_present(table, name, columns.position_unit) for name in columns.position if name)
        and all(is_present(table, name, columns.orientation_unit) for name, _ in angles)
        and {*columns.quaternion, *(columns.names or {}).values()} <= set(table.names)
        and any(is_present(table, name, columns.reading_unit) for name in columns.readings)
    )


class StatedUnit(NamedTuple):
    """The unit that a file states for readings, positions or angles, which are in SI now."""

    values: str
    column: str  # the first of those that hold them
    unit: str
    si_unit: str


@record
class PoseValues:
    """Poses as a table has them, SI."""

    positions: Array
    angles: Array  # the platform's angle, or its rotation vector
    quaternions: Array
    unknown: int = 0  # coordinates of the orientation that have no column

    def poses(self, length_factor: float = 1.0, angle_factor: float = 1.0) -> Array:
        """Return the pose array, its positions and angles times a factor."""
        orientation = self.angles * angle_factor
        if orientation.shape[1] == 3:
            orientation = quaternions_from_rotation_vectors(orientation)
        unknown = np.full((len(self.positions), self.unknown), np.nan)
        parts = [self.positions * length_factor, orientation, self.quaternions, unknown]
        return np.ascontiguousarray(np.hstack(parts))


def read_pose_values(
    table: Table, columns: MeasurementColumns, partial_space: str = ""
) -> PoseValues:
    """Return what the columns of the pose hold.

    With a `partial_space`, the kind of poses that may have been measured in part, a coordinate
    without a column and an empty cell are NaN; else poses are whole.

    Raises
    ------
    MeasurementError
        If a column is missing, its unit is unknown or of another dimension, a cell is not a finite
        number, a quaternion is not of unit length within 1e-3 (closer ones are normalised), or a
        rotation was measured in part.
    """
    partial = bool(partial_space)
    none = np.empty((table.row_count, 0))
    names = columns.position or ("",) * (POSE_SPACES[partial_space].size if partial else 0)
    positions = [
        scaled_column(table, name, columns.position_unit, "m", "position", empty_allowed=partial)
        if name or not partial
        else np.full(table.row_count, np.nan)
        for name in names
    ]
    angles = [
        scaled_column(table, name, columns.orientation_unit, "rad", purpose, empty_allowed=partial)
        for name, purpose in _angle_columns(columns)
    ]
    quaternions = _quaternions(table, columns.quaternion, partial) if columns.quaternion else none
    if len(angles) == 3:
        _check_whole(table, np.column_stack(angles), columns.rotation_vector)
    given = bool(angles or columns.quaternion)
    return PoseValues(
        np.column_stack(positions) if positions else none,
        np.column_stack(angles) if angles else none,
        quaternions,
        0 if given or not partial else len(POSE_SPACES[partial_space].orientation),
    )


def read_readings(table: Table, columns: MeasurementColumns, reading_unit: str) -> Array:
    """Return the readings in `reading_unit`, shape (N, legs).

    A leg without a column and an empty cell are NaN: not measured.

    Raises
    ------
    MeasurementError
        As `read_pose_values`; and if no leg has a column.
    """
    readings = np.full((table.row_count, len(columns.readings)), np.nan)
    present = [is_present(table, name, columns.reading_unit) for name in columns.readings]
    for leg, name in enumerate(columns.readings):
        if present[leg] or not any(present):
            purpose = f"reading of leg {leg + 1}"
            readings[:, leg] = scaled_column(
                table, name, columns.reading_unit, reading_unit, purpose, empty_allowed=True
            )
    return readings


def stated_units(table: Table, columns: MeasurementColumns, reading_unit: str) -> list[StatedUnit]:
    """Return the units that the table or the mapping states, group by group."""
    reading = next(
        name for name in columns.readings if is_present(table, name, columns.reading_unit)
    )
    groups = [("readings", reading, columns.reading_unit, reading_unit)]
    positions = [name for name in columns.position if name]
    groups += [("positions", name, columns.position_unit, "m") for name in positions[:1]]
    angles = _angle_columns(columns)[:1]
    groups += [("angles", name, columns.orientation_unit, "rad") for name, _ in angles]
    return [
        StatedUnit(values, *_column_and_unit(table, name, unit, si_unit, values), si_unit)
        for values, name, unit, si_unit in groups
    ]


def _angle_columns(columns: MeasurementColumns) -> list[tuple[str, str]]:
    """Columns of angles with their purpose."""
    if columns.angle is not None:
        return [(columns.angle, _ANGLE_PURPOSE)]
    return [(name, "rotation vector") for name in columns.rotation_vector]


def _with_units(table: Table, stem: str) -> list[str]:
    """The columns ``stem_unit`` of a table, for any unit; readings may be counted in steps."""
    units = (*unit_names(), *(COUNTS if stem.startswith(("psi_", "reading")) else ()))
    return [name for name in (f"{stem}_{unit}" for unit in units) if name in table.names]


def is_present(table: Table, name: str, unit: str | None) -> bool:
    """Whether a table has a column, by its name or, without a `unit`, with any unit behind it."""
    return name in table.names or (unit is None and bool(_with_units(table, name)))


def scaled_column(
    table: Table,
    name: str,
    unit: str | None,
    si_unit: str,
    purpose: str,
    *,
    empty_allowed: bool = False,
    negative_allowed: bool = True,
) -> Array:
    """Return a column in SI, shape (N,); the purpose is what it holds, for messages.

    Without a `unit`, the name has none either, and any unit may stand behind it. Where empty cells
    are allowed they are NaN.
    """
    column, unit = _column_and_unit(table, name, unit, si_unit, purpose)
    try:
        factor = unit_factor(unit, si_unit)
    except QuantityError as error:
        raise table.error(f'column "{column}" ({purpose}): {error}') from error
    values = table.numbers(column, empty_allowed=empty_allowed)
    if not negative_allowed and (values < 0).any():
        index = int(np.argmax(values < 0))
        raise table.row_error(
            index, f'has {values[index]:g} in column "{column}"; expected 0 or more ({purpose})'
        )
    with np.errstate(over="ignore"):
        scaled = values * factor
    huge = np.abs(scaled) > _MOST
    if huge.any():
        index = int(np.argmax(huge))
        raise table.row_error(
            index,
            f'has {values[index]:g} in column "{column}"; expected at most {_MOST:g} {si_unit}',
        )
    return scaled


def _column_and_unit(
    table: Table, name: str, unit: str | None, si_unit: str, purpose: str
) -> tuple[str, str]:
    """Without a unit, the name carries it: ``x_mm``, or ``x`` for any of ``x_mm``, ``x_m``, ..."""
    column = name
    if unit is None and name not in table.names:
        candidates = _with_units(table, name)
        if len(candidates) > 1:
            raise table.error(f"columns {' and '.join(candidates)} both hold {name}; expected one")
        column = candidates[0] if candidates else f"{name}_{si_unit}"
    table.require(column, purpose)
    unit = unit or column.rpartition("_")[2]
    if unit in COUNTS:
        if not table.step:
            raise table.error(
                f'column "{column}" counts steps of unknown size; say it in the mechanism file or '
                'the column mapping, such as reading_unit = "1/80 mm/step"'
            )
        unit = table.step
    if unit not in unit_names() and not counts_steps(unit):
        raise table.error(
            f'the unit of column "{column}" is unknown; write it in the name, such as '
            f'"{column}_{si_unit}", or in the column mapping'
        )
    return column, unit


def _check_whole(table: Table, values: Array, names: Sequence[str]) -> None:
    missing = np.isnan(values)
    half = missing.any(axis=1) & ~missing.all(axis=1)
    if half.any():
        raise table.row_error(
            int(np.argmax(half)),
            f"has an empty cell in one of {', '.join(names)}, but not in all; a rotation in space "
            "is measured as a whole or not at all",
        )


def _quaternions(table: Table, names: Sequence[str], partial: bool) -> Array:
    for name in names:
        table.require(name, _QUATERNION_PURPOSE)
    quaternions = np.column_stack([table.numbers(name, empty_allowed=partial) for name in names])
    _check_whole(table, quaternions, names)
    with np.errstate(over="ignore"):
        norms = np.linalg.norm(quaternions, axis=1)
    wrong = np.abs(norms - 1) > _QUATERNION_NORM_TOLERANCE
    if wrong.any():
        index = int(np.argmax(wrong))
        raise table.row_error(
            index, f"has a quaternion ({', '.join(names)}) of norm {norms[index]:.6g}; expected 1"
        )
    # Left alone at rounding level, so that what symkin wrote reads back to the same numbers.
    norms[np.abs(norms - 1) < 1e-12] = 1.0
    return np.asarray(quaternions / norms[:, None])


def _expect(key: str, count: int, expected: int) -> None:
    if count != expected:
        raise MeasurementError(
            f"{key} of the column mapping has {count} columns; expected {expected}"
        )


def _check_distinct(columns: MeasurementColumns) -> None:
    names = [*filter(None, columns.position), *columns.quaternion, *columns.rotation_vector]
    names += [*columns.readings, *filter(None, (columns.angle, columns.leg)), columns.robot]
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise MeasurementError(f'the column mapping names column "{repeated[0]}" twice')


_COUNTED = {
    "position_unit": 'pixels such as "0.1 mm/px"',
    "reading_unit": 'counts such as "0.1 deg/count"',
}


def _check_unit(key: str, unit: str | None, si_unit: str) -> None:
    if unit is None:
        return
    counted = _COUNTED.get(key)
    if unit not in unit_names() and not (counted and counts_steps(unit)):
        raise MeasurementError(
            f'{key} of the column mapping is "{unit}"{did_you_mean(unit, unit_names())}; expected '
            "the name of a unit" + (f", or a size of {counted}" if counted else "")
        )
    try:
        unit_factor(unit, si_unit)
    except QuantityError as error:
        raise MeasurementError(f"{key} of the column mapping: {error}") from error


def read_observed(
    table: Table, columns: MeasurementColumns, pose_space: str, leg_count: int, reading_unit: str
) -> dict[str, Array]:
    """Return what was observed besides poses and readings, and all standard deviations.

    Of the optional attributes of `Measurements`, those that the table has a column of.

    Raises
    ------
    MeasurementError
        Naming the column: a number left out (``distance_2_m`` without ``distance_1_m``), a standard
        deviation of what has no column, or a negative one; or as `read_pose_values`.
    """
    whole = table
    if columns.names is not None:
        table = table.renamed(columns.names)
    sizes = _sizes(table, pose_space)._replace(legs=leg_count, reading_unit=reading_unit)
    stems_of = observed_stems(sizes)
    between = {name for each in OBSERVABLES.values() for name in each.correlation_columns(sizes)}
    for name in columns.names or ():
        if name not in between:
            _check_name(name, pose_space, stems_of)
    pose = own_pose_columns(table, pose_space, REPORTED, partial=True)
    found: dict[str, Array] = {}
    if has_pose(pose):
        found["reported"] = read_pose_values(table, pose, pose_space).poses()
    ordered = own_pose_columns(table, pose_space, COMMANDED, partial=True)
    if has_pose(ordered):
        found["commanded"] = read_pose_values(table, ordered, pose_space).poses()
    for each in OBSERVABLES.values():
        what = each.kind.removesuffix("s")
        for name, purpose, negative_allowed in (
            (each.name, what, True),
            (each.deviations, f"standard deviation of a {what}", False),
        ):
            stems = stems_of[name]
            present = [is_present(table, stem, None) for stem, _ in stems]
            if not any(present):
                continue
            values = np.full((table.row_count, len(stems)), np.nan)
            for index in np.flatnonzero(present):
                stem, unit = stems[index]
                if not negative_allowed:
                    _require_value(table, whole, stem, columns, pose)
                values[:, index] = scaled_column(
                    table, stem, None, unit, purpose, empty_allowed=True,
                    negative_allowed=negative_allowed,
                )  # fmt: skip
            found[name] = values if each.is_pose else values.reshape(each.shape(sizes))
        names = each.correlation_columns(sizes)
        if any(name in table.names for name in names):
            nothing = np.full(table.row_count, np.nan)
            given = np.column_stack([
                table.numbers(name, empty_allowed=True) if name in table.names else nothing
                for name in names
            ])  # fmt: skip
            many = each.name == "points"
            found[each.correlations] = (
                given.reshape(-1, sizes.points, len(names) // sizes.points) if many else given
            )
    if any(name in table.names for name in TURN_AXIS):
        for name in TURN_AXIS:
            table.require(name, "axis of turns")
        found["turn_axes"] = np.column_stack([table.numbers(name) for name in TURN_AXIS])
    return found


class NumbersMet:
    """Whole numbers that parts of a table had, as runs of them: few where rows are numbered."""

    def __init__(self) -> None:
        self._first = self._last = np.empty(0, dtype=np.intp)

    def add(self, ascending: NDArray[np.intp]) -> int | None:
        """Return the first of these numbers that was met, or have them all as met."""
        runs = np.searchsorted(self._first, ascending, side="right") - 1
        again = (runs >= 0) & (ascending <= np.append(self._last, -1)[runs])
        if again.any():
            return int(ascending[again.argmax()])
        first = np.concatenate([self._first, ascending])
        last = np.concatenate([self._last, ascending])
        order = np.argsort(first)
        first, last = first[order], last[order]
        apart = first[1:] > last[:-1] + 1
        self._first, self._last = first[np.append(True, apart)], last[np.append(apart, True)]
        return None


def read_partners(
    table: Table, columns: MeasurementColumns, pose_space: str, met: NumbersMet | None = None
) -> NDArray[np.intp] | None:
    """Return where the other rows of pairs stand in the source, 0 for none; None without pairs.

    Rows are named by numbers of their own in the column ``row``, so that a table may be sorted.
    Of a part of a table, `met` has the numbers of the parts before it, and then of this one too.

    Raises
    ------
    MeasurementError
        Without that column, for two rows of the same number, and for another row that is not there.
    """
    if columns.names is not None:
        table = table.renamed(columns.names)
    count = _sizes(table, pose_space).pairs
    if not count:
        return None
    table.require(ROW, f"number of each row, which {PAIR}1_row names the other one by")
    labels = table.whole_numbers(ROW, 0, _MOST_ROWS)
    order = np.argsort(labels, kind="stable")
    again = np.flatnonzero(np.diff(labels[order]) == 0)
    row = int(order[again[0] + 1]) if len(again) else -1
    if met is not None and row < 0 and (number := met.add(labels[order])) is not None:
        row = int(np.flatnonzero(labels == number)[0])
    if row >= 0:
        raise table.row_error(row, f'has {labels[row]} in column "{ROW}", as another row has')
    found = np.zeros((table.row_count, count), dtype=np.intp)
    for pair in range(count):
        name = f"{PAIR}{pair + 1}_row"
        given = table.numbers(name, empty_allowed=True)
        there = np.flatnonzero(np.isfinite(given))
        places = order[np.minimum(np.searchsorted(labels[order], given[there]), len(order) - 1)]
        wrong = (labels[places] != given[there]) | (places == there)
        if wrong.any():
            row = int(there[wrong.argmax()])
            raise table.row_error(
                row,
                f'has {given[row]:g} in column "{name}"; expected what another row has in column '
                f'"{ROW}"',
            )
        found[there, pair] = table.row_numbers[places]
    return found


def read_circumstances(table: Table, of: Sizes) -> dict[str, NDArray[Any]]:
    """Return what is known of the rows beside, of the optional attributes of `Measurements`.

    Raises
    ------
    MeasurementError
        For a leg without a column beside one that has one, and an empty cell.
    """
    found: dict[str, NDArray[Any]] = {}
    for name, each in CIRCUMSTANCES.items():
        if each.column in table.names and each.counts:
            found[name] = table.whole_numbers(each.column, 0, _MOST_SESSIONS)
            continue
        if each.column in table.names:
            values = table.numbers(each.column)
            found[name] = np.repeat(values[:, None], of.legs, axis=1) if each.by_leg else values
            continue
        columns = each.columns(of) if each.dimensions > 1 else []
        if any(column in table.names for column in columns):
            for column in columns:
                table.require(column, each.kind)
            found[name] = np.column_stack([table.numbers(column) for column in columns])
    return found


def has_observed_columns(table: Table, pose_space: str) -> bool:
    """Whether a table has columns of what is observed besides poses and readings."""
    stems = observed_stems(_sizes(table, pose_space))
    reported = own_pose_columns(table, pose_space, REPORTED, partial=True)
    further = [
        stem
        for each in OBSERVABLES.values()
        if each.is_further and not each.is_pose
        for stem, _ in (*stems[each.name], *(stems[each.deviations] if each.numbered else ()))
    ]
    return has_pose(reported) or any(is_present(table, stem, None) for stem in further)


def observed_stems(of: Sizes) -> dict[str, list[tuple[str, str]]]:
    """The columns' names without their unit, and the SI unit; reported poses are read as poses."""
    found = {}
    for each in OBSERVABLES.values():
        found[each.name] = each.columns(of)
        found[each.deviations] = each.deviation_columns(of)
    return found


def _sizes(table: Table, pose_space: str) -> Sizes:
    """How many points and distances there are columns of, all those from 1."""
    space = POSE_SPACES[pose_space]
    if not space.moves:
        return Sizes(space)
    units, counts = "|".join(unit_names()), {}
    for each in OBSERVABLES.values():
        if not each.numbered or each.between_rows:
            continue
        counts[each.name] = _count(table, each.numbers(space, units))
    pairs = _count(table, PAIR_ROW)  # that a row may be in, by the columns of the other rows
    return Sizes(space, 0, "", counts["points"], counts["distances"], pairs)


def _count(table: Table, pattern: re.Pattern[str]) -> int:
    """How many numbers columns of a kind have, all those from 1."""
    numbers = {match[1]: name for name in table.names if (match := pattern.fullmatch(name))}
    for number, name in numbers.items():
        if len(number) > 6 or not 1 <= int(number) <= len(numbers):
            raise table.error(
                f'column "{name}" has number {number}; expected 1 to {len(numbers)}, since there '
                f"are {len(numbers)} of the kind"
            )
    return len(numbers)


def _check_name(name: str, pose_space: str, stems_of: Mapping[str, list[tuple[str, str]]]) -> None:
    """Refuse what a mapping calls a column if symkin has no such name."""
    known = [f"{stem}_{unit}" for stems in stems_of.values() for stem, unit in stems]
    for prefix in (REPORTED, COMMANDED):
        known += [f"{prefix}{each}" for each in pose_column_names(pose_space)]
        known += [f"{prefix}{each}_rad" for each in POSE_SPACES[pose_space].rotation]
    stems = {each.rpartition("_")[0] for each in known}
    stem, _, unit = name.rpartition("_")
    if name not in known and not (stem in stems and unit in unit_names()):
        raise MeasurementError(
            f'names of the column mapping has "{name}"{did_you_mean(name, known)}; expected names '
            "that symkin gives to what is observed besides poses and readings"
        )


def _require_value(
    table: Table, whole: Table, stem: str, columns: MeasurementColumns, reported: MeasurementColumns
) -> None:
    """Refuse a standard deviation of what has no column."""
    value = stem.removesuffix("_sd")
    pose = reported if value.startswith(REPORTED) else columns
    name = value.removeprefix(REPORTED)
    if name in ("x", "y", "z"):
        there = "xyz".index(name) < len(pose.position) and bool(pose.position["xyz".index(name)])
    elif name in ("phi", "theta", "rx", "ry", "rz"):
        there = pose.angle is not None or bool(pose.quaternion or pose.rotation_vector)
    elif name.startswith("psi_"):
        reading = columns.readings[int(name.removeprefix("psi_")) - 1]
        there = is_present(whole, reading, columns.reading_unit)
    else:
        there = is_present(table, value, None)
    if not there:
        raise table.error(
            f'column "{stem}_..." is a standard deviation, but there is no column of {value}'
        )
