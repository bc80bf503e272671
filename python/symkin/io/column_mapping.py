# SPDX-License-Identifier: MIT
"""The ``[measurements]`` section: how a foreign table maps to poses and readings."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Any

from symkin.errors import MeasurementError, QuantityError, did_you_mean
from symkin.io.mechanism_schema import MappingFile, MeasurementSection
from symkin.io.quantities import unit_factor, unit_names
from symkin.io.toml_source import read_toml
from symkin.io.validation import validate
from symkin.settings import MeasurementColumns

__all__ = ["check_columns", "columns_of_section", "load_columns"]

# How each platform's orientation can be given, and in how many columns.
_ORIENTATION: dict[str, dict[str, int]] = {
    "planar": {"angle": 1},
    "point": {},
    "spatial": {"quaternion": 4, "rotation_vector": 3},
}


def load_columns(path: str | os.PathLike[str]) -> MeasurementColumns:
    """Read a column mapping: the ``[measurements]`` section of a TOML file.

    Parameters
    ----------
    path : str or path
        A file with this section alone, or a mechanism file.

    Returns
    -------
    MeasurementColumns

    Raises
    ------
    MechanismFileError
        With the file, the line and the key.
    """
    source = read_toml(Path(path))
    if "chain" not in source.values:
        return columns_of_section(validate(source, MappingFile).measurements)
    if "measurements" not in source.values:
        raise source.error(("measurements",), "this mechanism file has no such section")
    return columns_of_section(validate(source, MeasurementSection, ("measurements",)))


def columns_of_section(section: MeasurementSection) -> MeasurementColumns:
    """Return the mapping that a ``[measurements]`` section describes."""
    values: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in section.model_dump(exclude_none=True).items()
    }
    return MeasurementColumns(**values)


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
    _expect("position", len(columns.position), 3 if pose_space == "spatial" else 2)
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
