# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings as tables."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.io.column_mapping import check_columns
from symkin.io.columns import (
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
from symkin.io.tables import Table, read_table, write_table
from symkin.io.unit_check import check_units
from symkin.measurements import Measurements
from symkin.settings import MeasurementColumns

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

__all__ = ["read_measurements", "write_measurements"]


def read_measurements(
    path: str | os.PathLike[str],
    mechanism: Mechanism,
    columns: MeasurementColumns | None = None,
) -> Measurements:
    """Read measured poses and readings from a CSV or Parquet table.

    Parameters
    ----------
    path : str or path
        Parquet by the extension ``.parquet`` or ``.pq``, else CSV with commas, semicolons or tabs.
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
        column, is NaN. Row numbers are lines of the file.

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column: a missing column, a cell that is no finite number,
        a quaternion that is not of unit length, a row without any reading, a repeated row, or
        values whose units are evidently others than stated.
    NotIdentifiableError
        If all legs are measured, with fewer poses than a leg has parameters.
    """
    table = read_table(Path(path))
    columns = columns or _columns_for(table, mechanism)
    check_columns(columns, mechanism.pose_space, len(mechanism.legs), mechanism.reading_unit)
    values = read_pose_values(table, columns)
    measurements = Measurements(
        poses=values.poses(),
        readings=read_readings(table, columns, mechanism.reading_unit),
        leg_sets=_leg_sets(table, columns, len(mechanism.legs)),
        row_numbers=table.row_numbers,
        source=table.path,
    )
    _check_unread_rows(table, measurements)
    _check_repeated_rows(table, measurements)
    stated = stated_units(table, columns, mechanism.reading_unit)
    check_units(values, measurements, mechanism, stated)
    if len(measurements.measured_legs) == len(mechanism.legs):
        # A leg may be identified from the sets of all legs, so these count too.
        everything = replace(measurements, leg_sets=np.zeros_like(measurements.leg_sets))
        everything.require(len(mechanism.parameter_names))
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
    columns: dict[str, NDArray[np.generic]] = {}
    if measurements.leg_sets.any():
        columns["leg"] = measurements.leg_sets
    names = pose_column_names(mechanism.pose_space)
    columns |= dict(zip(names, measurements.poses.T, strict=True))
    names = reading_column_names(len(mechanism.legs), mechanism.reading_unit)
    columns |= dict(zip(names, measurements.readings.T, strict=True))
    with OutputFiles(overwrite=overwrite) as outputs:
        write_table(outputs.file(Path(path)), columns)


def _columns_for(table: Table, mechanism: Mechanism) -> MeasurementColumns:
    mapped = mechanism.measurement_columns
    if mapped is not None and has_columns(table, mapped):
        return mapped
    if mapped is None or uses_own_names(table, mechanism.pose_space):
        return own_columns(table, mechanism.pose_space, len(mechanism.legs))
    return mapped


def _leg_sets(table: Table, columns: MeasurementColumns, leg_count: int) -> NDArray[np.intp]:
    if columns.leg is None:
        return np.zeros(table.row_count, dtype=np.intp)
    table.require(columns.leg, "the leg whose set the pose belongs to")
    return table.whole_numbers(columns.leg, 0, leg_count)


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
