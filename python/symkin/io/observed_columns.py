# SPDX-License-Identifier: MIT
"""Columns of what is observed besides poses and readings, and of standard deviations."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.errors import MeasurementError, did_you_mean
from symkin.io.columns import (
    has_pose,
    is_present,
    own_pose_columns,
    pose_column_names,
    read_pose_values,
    scaled_column,
)
from symkin.io.quantities import unit_names
from symkin.io.tables import Table
from symkin.poses import POSE_SPACES
from symkin.settings import MeasurementColumns

if TYPE_CHECKING:
    from symkin.measurements import Measurements

_Array = NDArray[np.float64]
_REPORTED = "reported_"
_PURPOSES = {
    "pose_deviations": "standard deviation of a pose",
    "reading_deviations": "standard deviation of a reading",
    "reported_deviations": "standard deviation of a reported pose",
    "points": "target point",
    "point_deviations": "standard deviation of a target point",
    "distances": "distance",
    "distance_deviations": "standard deviation of a distance",
    "heights": "height above the plane",
    "height_deviations": "standard deviation of a height",
}


def read_observed(
    table: Table, columns: MeasurementColumns, pose_space: str, leg_count: int, reading_unit: str
) -> dict[str, _Array]:
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
    points, distances = _counts(table, pose_space)
    stems_of = _stems(pose_space, leg_count, points, distances, reading_unit)
    for name in columns.names or ():
        _check_name(name, pose_space, stems_of)
    pose = own_pose_columns(table, pose_space, _REPORTED, partial=True)
    found: dict[str, _Array] = {}
    if has_pose(pose):
        found["reported"] = read_pose_values(table, pose, pose_space).poses()
    for name, stems in stems_of.items():
        present = [is_present(table, stem, None) for stem, _ in stems]
        if any(present):
            found[name] = np.full((table.row_count, len(stems)), np.nan)
        for index in np.flatnonzero(present):
            stem, unit = stems[index]
            if stem.endswith("_sd"):
                _require_value(table, whole, stem, columns, pose)
            found[name][:, index] = scaled_column(
                table, stem, None, unit, _PURPOSES[name], empty_allowed=True,
                negative_allowed=not stem.endswith("_sd"),
            )  # fmt: skip
    shapes = {"points": (-1, points, POSE_SPACES[pose_space].size), "heights": (-1,)}
    shapes |= {"point_deviations": shapes["points"], "height_deviations": (-1,)}
    return {name: values.reshape(shapes.get(name, values.shape)) for name, values in found.items()}


def has_observed_columns(table: Table, pose_space: str) -> bool:
    """Whether a table has columns of what is observed besides poses and readings."""
    points, distances = _counts(table, pose_space)
    reported = own_pose_columns(table, pose_space, _REPORTED, partial=True)
    heights = POSE_SPACES[pose_space].size == 3 and is_present(table, "height", None)
    return bool(points or distances or heights or has_pose(reported))


def observed_columns(measurements: Measurements, reading_unit: str) -> dict[str, _Array]:
    """Return the columns that symkin writes for what `read_observed` reads."""
    columns: dict[str, _Array] = {}
    reported = measurements.reported
    if reported is not None:
        names = [f"{_REPORTED}{name}" for name in pose_column_names(measurements.pose_space)]
        columns |= dict(zip(names, reported.T, strict=True))
    points, distances = measurements.points, measurements.distances
    stems = _stems(
        measurements.pose_space,
        measurements.readings.shape[1],
        0 if points is None else points.shape[1],
        0 if distances is None else distances.shape[1],
        reading_unit,
    )
    for name, own in stems.items():
        values = getattr(measurements, name)
        if values is not None:
            names = [f"{stem}_{unit}" if unit else stem for stem, unit in own]
            table = values.reshape(len(values), len(names))
            columns |= dict(zip(names, table.T, strict=True))
    return columns


def _stems(
    pose_space: str, leg_count: int, points: int, distances: int, reading_unit: str
) -> dict[str, list[tuple[str, str]]]:
    """The columns' names without their unit, and the SI unit; reported poses are read as poses."""
    space = POSE_SPACES[pose_space]
    axes, pose = space.position, [*space.units.items()]
    targets = [(f"p{point + 1}_{axis}", "m") for point in range(points) for axis in axes]
    ranges = [(f"distance_{number + 1}", "m") for number in range(distances)]
    height = [("height", "m")] if space.size == 3 else []

    def deviations(stems: list[tuple[str, str]], prefix: str = "") -> list[tuple[str, str]]:
        return [(f"{prefix}{stem}_sd", unit) for stem, unit in stems]

    return {
        "pose_deviations": deviations(pose),
        "reading_deviations": [(f"psi_{leg + 1}_sd", reading_unit) for leg in range(leg_count)],
        "reported_deviations": deviations(pose, _REPORTED),
        "points": targets,
        "point_deviations": deviations(targets),
        "distances": ranges,
        "distance_deviations": deviations(ranges),
        "heights": height,
        "height_deviations": deviations(height),
    }


def _counts(table: Table, pose_space: str) -> tuple[int, int]:
    """How many points and distances there are columns of, all those from 1."""
    if not POSE_SPACES[pose_space].moves:
        return 0, 0
    units = "|".join(unit_names())
    axes = "".join(POSE_SPACES[pose_space].position)
    counts = []
    for start, end in (("p", f"_[{axes}]"), ("distance_", "")):
        pattern = re.compile(rf"{start}(0|[1-9][0-9]*){end}(?:_sd)?_(?:{units})", re.ASCII)
        numbers = {match[1]: name for name in table.names if (match := pattern.fullmatch(name))}
        for number, name in numbers.items():
            if len(number) > 6 or not 1 <= int(number) <= len(numbers):
                raise table.error(
                    f'column "{name}" has number {number}; expected 1 to {len(numbers)}, since '
                    f"there are {len(numbers)} of the kind"
                )
        counts.append(len(numbers))
    return counts[0], counts[1]


def _check_name(name: str, pose_space: str, stems_of: Mapping[str, list[tuple[str, str]]]) -> None:
    """Refuse what a mapping calls a column if symkin has no such name."""
    known = [f"{stem}_{unit}" for stems in stems_of.values() for stem, unit in stems]
    known += [f"{_REPORTED}{each}" for each in pose_column_names(pose_space)]
    known += [f"{_REPORTED}{each}_rad" for each in POSE_SPACES[pose_space].rotation]
    stems = {each.rpartition("_")[0] for each in known}
    stem, _, unit = name.rpartition("_")
    if name not in known and not (stem in stems and unit in unit_names()):
        raise MeasurementError(
            f'names of the column mapping has "{name}"{did_you_mean(name, known)}; expected names '
            "that symkin gives to what is observed besides poses and readings"
        )


def _require_value(
    table: Table,
    whole: Table,
    stem: str,
    columns: MeasurementColumns,
    reported: MeasurementColumns,
) -> None:
    """Refuse a standard deviation of what has no column."""
    value = stem.removesuffix("_sd")
    pose = reported if value.startswith(_REPORTED) else columns
    name = value.removeprefix(_REPORTED)
    if name in ("x", "y", "z"):
        there = "xyz".index(name) < len(pose.position) and bool(pose.position["xyz".index(name)])
    elif name in ("phi", "rx", "ry", "rz"):
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
