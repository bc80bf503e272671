# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings as tables."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.io.columns import (
    PoseValues,
    StatedUnit,
    check_columns,
    has_columns,
    own_columns,
    pose_column_names,
    read_pose_values,
    read_readings,
    reading_column_names,
    stated_units,
    uses_own_names,
)
from symkin.io.output_files import OutputFiles
from symkin.io.quantities import unit_factor
from symkin.io.tables import Table, TableSource, read_table, write_table
from symkin.measurements import ALL_LEGS, Measurements
from symkin.settings import MeasurementColumns

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

__all__ = ["measurement_columns", "read_measurements", "write_measurements"]

# A wrong unit leaves closures as large as the legs; an uncalibrated mechanism, a few percent.
_POOR_FIT = 0.05
_MUCH_BETTER = 10.0
# Small enough units make every pose and reading nearly zero, which fits a mechanism whose home is
# there: a fit is one only if the readings of other poses would not do as well.
_BETTER_THAN_MIXED_UP = 5.0
_MISTAKEN_FOR_EACH_OTHER = {"rad": ("rad", "deg", "rev"), "m": ("m", "mm", "cm", "inch")}


def read_measurements(
    source: TableSource,
    mechanism: Mechanism,
    columns: MeasurementColumns | None = None,
) -> Measurements:
    """Read measured poses and readings from a table.

    Parameters
    ----------
    source : str, path, stream, DataFrame or dict of arrays
        A file or an open stream: CSV with commas, semicolons or tabs, or Parquet by the extension
        ``.parquet`` or ``.pq``, as it is or compressed by gzip. Or the columns themselves, where
        NaN is an empty cell.
    mechanism : Mechanism
        Gives the kind of pose, the number of legs and the readings' unit.
    columns : MeasurementColumns, optional
        Which columns hold what. By default what the ``[measurements]`` section of the mechanism's
        file says, if the table has its columns; else the columns that symkin writes (``x_m``,
        ``phi_rad``, ``psi_1_rad``, ..., with any unit in the name).

    Returns
    -------
    Measurements
        In SI units. A reading that was not taken, because its cell is empty or its leg has no
        column, is NaN. Row numbers are lines of a CSV file, else rows, from 1.

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column: a missing column, a cell that is no finite number,
        a quaternion that is not of unit length, a row without any reading, a repeated row, or
        values whose units are evidently others than stated.
    NotIdentifiableError
        If all legs are measured, with fewer poses than a leg has parameters.
    """
    table = read_table(source)
    columns = columns or _columns_for(table, mechanism)
    check_columns(columns, mechanism.pose_space, len(mechanism.legs), mechanism.reading_unit)
    values = read_pose_values(table, columns)
    measurements = Measurements(
        poses=values.poses(),
        readings=read_readings(table, columns, mechanism.reading_unit),
        leg_sets=_leg_sets(table, columns, len(mechanism.legs)),
        row_numbers=table.row_numbers,
        source=table.path,
        reading_unit=mechanism.reading_unit,
        pose_space=mechanism.pose_space,
    )
    _check_unread_rows(table, measurements)
    _check_repeated_rows(table, measurements)
    stated = stated_units(table, columns, mechanism.reading_unit)
    _check_units(table, values, measurements, mechanism, stated)
    if len(measurements.measured_legs) == len(mechanism.legs):
        # A leg may be identified from the sets of all legs, so these count too.
        measurements.for_all_legs().require(mechanism.estimated_count)
    return measurements


def write_measurements(
    measurements: Measurements,
    path: str | os.PathLike[str],
    mechanism: Mechanism,
    *,
    overwrite: bool = False,
) -> None:
    """Write measurements as CSV or Parquet, by extension; they read back to the same numbers.

    A file that exists is replaced only with `overwrite`.
    """
    with OutputFiles(overwrite=overwrite) as outputs:
        columns = measurement_columns(measurements, mechanism.reading_unit)
        write_table(outputs.file(Path(path)), columns)


def measurement_columns(
    measurements: Measurements, reading_unit: str
) -> dict[str, NDArray[np.generic]]:
    """Return the columns of a table of measurements; ``leg`` only if the rows differ in it."""
    columns: dict[str, NDArray[np.generic]] = {}
    if (measurements.leg_sets != ALL_LEGS).any():
        columns["leg"] = measurements.leg_sets + 1
    names = pose_column_names(measurements.pose_space)
    columns |= dict(zip(names, measurements.poses.T, strict=True))
    names = reading_column_names(measurements.readings.shape[1], reading_unit)
    return columns | dict(zip(names, measurements.readings.T, strict=True))


def _columns_for(table: Table, mechanism: Mechanism) -> MeasurementColumns:
    mapped = mechanism.measurement_columns
    if mapped is not None and has_columns(table, mapped):
        return mapped
    if mapped is None or uses_own_names(table, mechanism.pose_space):
        return own_columns(table, mechanism.pose_space, len(mechanism.legs))
    return mapped


def _leg_sets(table: Table, columns: MeasurementColumns, leg_count: int) -> NDArray[np.intp]:
    if columns.leg is None:
        return np.full(table.row_count, ALL_LEGS)
    table.require(columns.leg, "the leg whose set the pose belongs to")
    return table.whole_numbers(columns.leg, 0, leg_count) - 1


def _check_unread_rows(table: Table, measurements: Measurements) -> None:
    unread = np.isnan(measurements.readings).all(axis=1)
    if unread.any():
        raise table.row_error(
            int(np.argmax(unread)),
            "has no reading of any leg; fill in what was read, or take the row out",
        )


def _check_repeated_rows(table: Table, measurements: Measurements) -> None:
    rows = np.column_stack(
        [measurements.leg_sets, measurements.poses, np.nan_to_num(measurements.readings)]
    )
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    repeated = np.flatnonzero(first[inverse.ravel()] != np.arange(len(rows)))
    if len(repeated):
        original = table.row_numbers[first[inverse.ravel()[repeated[0]]]]
        more = f" ({len(repeated)} repeated rows in all)" if len(repeated) > 1 else ""
        raise table.row_error(
            int(repeated[0]),
            f"repeats row {original}{more}; a repeated row adds no information but looks as if it "
            "did",
        )


def _check_units(
    table: Table,
    values: PoseValues,
    measurements: Measurements,
    mechanism: Mechanism,
    stated_units: Sequence[StatedUnit],
) -> None:
    """Refuse measurements that fit the nominal mechanism far better in other units.

    Fits are told by medians over the finite closures, which outliers do not move.

    Raises
    ------
    MeasurementError
        If the median closure of all legs is above 5% of the mean leg dimension, and other units of
        one or more groups of columns make it ten times smaller. Names the columns, their stated
        units and the likely ones.
    """
    as_stated = _median_closure(measurements, mechanism)
    if not as_stated > _POOR_FIT * _leg_dimension(measurements, mechanism):
        return
    with np.errstate(over="ignore", invalid="ignore"):
        trials = [
            (_median_closure(changed, mechanism), units, changed)
            for units, changed in _in_other_units(values, measurements, stated_units)
        ]
    closure, units, likely = min(trials, key=lambda trial: trial[0])
    mixed_up = _median_closure(_mixed_up(likely), mechanism)
    if closure * _MUCH_BETTER <= as_stated and closure * _BETTER_THAN_MIXED_UP < mixed_up:
        wrong = ", and ".join(
            f'the {stated.values} (column "{stated.column}") are stated in {stated.unit} but fit '
            f"in {unit}"
            for stated, unit in zip(stated_units, units, strict=True)
            if unit != stated.unit
        )
        raise table.error(
            f"{wrong}: at the nominal parameters, the legs would close to "
            f"{closure:.3g} m in the median instead of {as_stated:.3g} m"
        )


def _in_other_units(
    values: PoseValues, measurements: Measurements, stated_units: Sequence[StatedUnit]
) -> Iterator[tuple[tuple[str, ...], Measurements]]:
    """Every other combination of units, and the measurements in it."""
    stated = tuple(group.unit for group in stated_units)
    choices = [
        dict.fromkeys((group.unit, *_MISTAKEN_FOR_EACH_OTHER[group.si_unit]))
        for group in stated_units
    ]
    for units in itertools.product(*choices):
        if units == stated:
            continue
        factors = {
            group.values: unit_factor(unit, group.si_unit) / unit_factor(group.unit, group.si_unit)
            for group, unit in zip(stated_units, units, strict=True)
        }
        poses = values.poses(factors["positions"], factors.get("angles", 1.0))
        readings = measurements.readings * factors["readings"]
        yield units, replace(measurements, poses=poses, readings=readings)


def _mixed_up(measurements: Measurements) -> Measurements:
    """Each pose with the readings of another pose of its set."""
    readings = measurements.readings.copy()
    for leg in measurements.measured_legs:
        rows = measurements.rows_of(leg)
        readings[rows, leg] = np.roll(readings[rows, leg], max(1, len(rows) // 2))
    return replace(measurements, readings=readings)


def _median_closure(measurements: Measurements, mechanism: Mechanism) -> float:
    """Infinite if no closure is finite."""
    closures: list[NDArray[np.float64]] = []
    for leg in measurements.measured_legs:
        rows = measurements.rows_of(leg)
        readings = measurements.readings[rows, leg]
        closures.append(mechanism.closure(leg, measurements.poses[rows], readings))
    sizes = np.abs(np.concatenate(closures)) if closures else np.empty(0)
    finite = sizes[np.isfinite(sizes)]
    return float(np.median(finite)) if len(finite) else np.inf


def _leg_dimension(measurements: Measurements, mechanism: Mechanism) -> float:
    """Mean size of the legs' lengths and radii; of the positions for a chain that has neither."""
    lengths = [
        abs(value)
        for leg in mechanism.legs
        for name, value in leg.parameters.items()
        if name.endswith(("_length", "_radius")) and value
    ]
    if lengths:
        return float(np.mean(lengths))
    return float(np.median(np.abs(measurements.poses[:, :2])))
