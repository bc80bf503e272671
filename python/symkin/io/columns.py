# SPDX-License-Identifier: MIT
"""Finding poses and readings in a table: names, units, quaternions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.errors import MeasurementError, QuantityError, did_you_mean
from symkin.io.quantities import unit_factor, unit_names
from symkin.io.tables import Table
from symkin.poses import POSE_SPACES, quaternions_from_rotation_vectors
from symkin.settings import MeasurementColumns

__all__ = [
    "PoseValues",
    "StatedUnit",
    "check_columns",
    "has_columns",
    "own_columns",
    "pose_column_names",
    "read_pose_values",
    "read_poses",
    "read_readings",
    "reading_column_names",
    "stated_units",
    "uses_own_names",
]

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
}
# Nothing that was measured is larger, and squares of it can still be added.
_MOST = 1e12
# Rounded files keep about four digits; a larger error of the norm means that it is no quaternion.
_QUATERNION_NORM_TOLERANCE = 1e-3


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
    if allowed and len(named) != 1:
        raise MeasurementError(
            f"the column mapping gives the orientation by {' and '.join(named) or 'nothing'}; "
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
    """Return the columns that symkin writes for readings: ``psi_1_rad``, ``psi_2_rad``, ..."""
    unit = f"_{reading_unit}" if reading_unit else ""
    return [f"psi_{leg + 1}{unit}" for leg in range(leg_count)]


def own_columns(table: Table, pose_space: str, leg_count: int) -> MeasurementColumns:
    """Return the columns of a table that names them as symkin does, with any unit."""
    space = POSE_SPACES[pose_space]
    quaternion, vector = (
        (space.orientation, space.rotation) if pose_space == "spatial" else ((), ())
    )
    has_vector = any(_with_units(table, name) for name in vector)
    return MeasurementColumns(
        position=space.position,
        readings=tuple(f"psi_{leg + 1}" for leg in range(leg_count)),
        angle="phi" if pose_space == "planar" else None,
        quaternion=() if has_vector else quaternion,
        rotation_vector=vector if has_vector else (),
        leg="leg" if "leg" in table.names else None,
    )


def uses_own_names(table: Table, pose_space: str) -> bool:
    """Whether the position columns are named as symkin names them."""
    return all(_with_units(table, name) for name in POSE_SPACES[pose_space].position)


def has_columns(table: Table, columns: MeasurementColumns) -> bool:
    """Whether a table has the columns of the pose and at least one of the readings."""
    angles = _angle_columns(columns)
    return (
        all(_is_present(table, name, columns.position_unit) for name in columns.position)
        and all(_is_present(table, name, columns.orientation_unit) for name, _ in angles)
        and set(columns.quaternion) <= set(table.names)
        and any(_is_present(table, name, columns.reading_unit) for name in columns.readings)
    )


@dataclass(frozen=True)
class StatedUnit:
    """The unit that a file states for some of its values.

    Attributes
    ----------
    values : {"readings", "positions", "angles"}
        Which values.
    column : str
        The first of the columns that hold them.
    unit, si_unit : str
        The unit stated, and the one that the values are in now.
    """

    values: str
    column: str
    unit: str
    si_unit: str


@dataclass(frozen=True)
class PoseValues:
    """Poses as a table has them, SI.

    Attributes
    ----------
    positions : ndarray, shape (N, 2) or (N, 3)
        m.
    angles : ndarray, shape (N, 0), (N, 1) or (N, 3)
        The platform's angle, or its rotation vector, rad.
    quaternions : ndarray, shape (N, 0) or (N, 4)
        x, y, z, w.
    """

    positions: NDArray[np.float64]
    angles: NDArray[np.float64]
    quaternions: NDArray[np.float64]

    def poses(self, length_factor: float = 1.0, angle_factor: float = 1.0) -> NDArray[np.float64]:
        """Return the pose array, its positions and angles times a factor."""
        orientation = self.angles * angle_factor
        if orientation.shape[1] == 3:
            orientation = quaternions_from_rotation_vectors(orientation)
        parts = [self.positions * length_factor, orientation, self.quaternions]
        return np.ascontiguousarray(np.hstack(parts))


def read_pose_values(table: Table, columns: MeasurementColumns) -> PoseValues:
    """Return what the columns of the pose hold.

    Raises
    ------
    MeasurementError
        If a column is missing, its unit is unknown or of another dimension, a cell is not a finite
        number, or a quaternion is not of unit length within 1e-3; closer ones are normalised.
    """
    positions = [
        _scaled(table, name, columns.position_unit, "m", "position") for name in columns.position
    ]
    angles = [
        _scaled(table, name, columns.orientation_unit, "rad", purpose)
        for name, purpose in _angle_columns(columns)
    ]
    none = np.empty((table.row_count, 0))
    return PoseValues(
        np.column_stack(positions),
        np.column_stack(angles) if angles else none,
        _quaternions(table, columns.quaternion) if columns.quaternion else none,
    )


def read_poses(table: Table, columns: MeasurementColumns) -> NDArray[np.float64]:
    """Return the poses, SI, shape (N, coordinates); errors are those of `read_pose_values`."""
    return read_pose_values(table, columns).poses()


def read_readings(
    table: Table, columns: MeasurementColumns, reading_unit: str
) -> NDArray[np.float64]:
    """Return the readings in `reading_unit`, shape (N, legs).

    A leg without a column and an empty cell are NaN: not measured.

    Raises
    ------
    MeasurementError
        As `read_poses`; and if no leg has a column.
    """
    readings = np.full((table.row_count, len(columns.readings)), np.nan)
    present = [_is_present(table, name, columns.reading_unit) for name in columns.readings]
    for leg, name in enumerate(columns.readings):
        if present[leg] or not any(present):
            purpose = f"reading of leg {leg + 1}"
            readings[:, leg] = _scaled(
                table, name, columns.reading_unit, reading_unit, purpose, empty_allowed=True
            )
    return readings


def stated_units(table: Table, columns: MeasurementColumns, reading_unit: str) -> list[StatedUnit]:
    """Return the units that the table or the mapping states, group by group."""
    reading = next(
        name for name in columns.readings if _is_present(table, name, columns.reading_unit)
    )
    groups = [
        ("readings", reading, columns.reading_unit, reading_unit),
        ("positions", columns.position[0], columns.position_unit, "m"),
    ]
    angles = [name for name, _ in _angle_columns(columns)]
    if angles:
        groups.append(("angles", angles[0], columns.orientation_unit, "rad"))
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
    """The columns ``stem_unit`` of a table, for any unit."""
    return [name for name in (f"{stem}_{unit}" for unit in unit_names()) if name in table.names]


def _is_present(table: Table, name: str, unit: str | None) -> bool:
    return name in table.names or (unit is None and bool(_with_units(table, name)))


def _scaled(
    table: Table,
    name: str,
    unit: str | None,
    si_unit: str,
    purpose: str,
    *,
    empty_allowed: bool = False,
) -> NDArray[np.float64]:
    """A column in SI."""
    column, unit = _column_and_unit(table, name, unit, si_unit, purpose)
    try:
        factor = unit_factor(unit, si_unit)
    except QuantityError as error:
        raise table.error(f'column "{column}" ({purpose}): {error}') from error
    values = table.numbers(column, empty_allowed=empty_allowed)
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
    if unit not in unit_names():
        raise table.error(
            f'the unit of column "{column}" is unknown; write it in the name, such as '
            f'"{column}_{si_unit}", or in the column mapping'
        )
    return column, unit


def _quaternions(table: Table, names: Sequence[str]) -> NDArray[np.float64]:
    for name in names:
        table.require(name, _QUATERNION_PURPOSE)
    quaternions = np.column_stack([table.numbers(name) for name in names])
    with np.errstate(over="ignore"):
        norms = np.linalg.norm(quaternions, axis=1)
    wrong = np.abs(norms - 1) > _QUATERNION_NORM_TOLERANCE
    if wrong.any():
        index = int(np.argmax(wrong))
        raise table.row_error(
            index,
            f"has a quaternion ({', '.join(names)}) of norm {norms[index]:.6g}; expected 1",
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
    names = [*columns.position, *columns.quaternion, *columns.rotation_vector, *columns.readings]
    names += [name for name in (columns.angle, columns.leg) if name is not None]
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise MeasurementError(f'the column mapping names column "{repeated[0]}" twice')


def _check_unit(key: str, unit: str | None, si_unit: str) -> None:
    if unit is None:
        return
    if unit not in unit_names():
        raise MeasurementError(
            f'{key} of the column mapping is "{unit}"{did_you_mean(unit, unit_names())}; expected '
            "the name of a unit"
        )
    try:
        unit_factor(unit, si_unit)
    except QuantityError as error:
        raise MeasurementError(f"{key} of the column mapping: {error}") from error
