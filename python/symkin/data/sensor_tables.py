# SPDX-License-Identifier: MIT
"""Calibration tables of sensors, and readings in files, which go through them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from symkin.data.columns import is_present, read_readings, scaled_column
from symkin.model.mechanism import Mechanism
from symkin.model.sensor_table import SensorTable, wrong_row
from symkin.model.settings import MeasurementColumns
from symkin.model.turns import turned_home, turned_into_table
from symkin.storage.tables import Table, TableSource, read_table
from symkin.values import Array

# More would not fit into a mechanism's file.
MOST_ROWS = 10_000


def read_sensor_table(
    source: TableSource, *, legs: int, reading_unit: str, step: str = ""
) -> SensorTable:
    """Read a calibration table of the sensors; the source is as `read_measurements` takes it.

    It has columns ``reading_rad`` (what the sensor shows) and ``joint_rad`` (what a straight one
    would show), in any unit of the sensor's kind, or in steps of the size `step`; and ``leg``, from
    1, if the sensors differ.

    Raises
    ------
    MeasurementError
        Naming the file, and the row or the column at fault: a missing column, another kind of unit,
        fewer than two rows for a leg, a reading that is repeated, values that neither grow nor fall
        throughout.
    """
    table = read_table(source, step)
    if table.row_count > MOST_ROWS:
        raise table.error(f"has {table.row_count} rows; expected at most {MOST_ROWS}")
    shown = scaled_column(table, "reading", None, reading_unit, "what the sensor shows")
    straight = scaled_column(table, "joint", None, reading_unit, "what a straight one would show")
    own = np.zeros(table.row_count, dtype=np.intp)
    if "leg" in table.names:
        own = table.legs("leg", 1, legs) - 1
        missing = np.setdiff1d(np.arange(legs), own)
        if len(missing):
            raise table.error(
                f"has no rows of leg {missing[0] + 1}; expected all legs, those with straight "
                "sensors by two rows, or no column leg if the sensors are alike"
            )
    curves = []
    for leg in range(own.max() + 1):
        rows = np.flatnonzero(own == leg)
        pairs = tuple(zip(shown[rows].tolist(), straight[rows].tolist(), strict=True))
        wrong = wrong_row(pairs)
        if wrong is not None:
            raise table.row_error(int(rows[wrong[0]]), f"{wrong[1]} ({reading_unit})")
        curves.append(pairs)
    path = Path(source) if isinstance(source, str | os.PathLike) else None
    return SensorTable(tuple(curves), path)


def read_straight_readings(
    table: Table, columns: MeasurementColumns, mechanism: Mechanism
) -> tuple[Array, Array]:
    """Return readings as straight sensors would show them, and the slopes of the sensors' table.

    Both have the shape (N, legs); slopes are 1 for sensors without a table. Where the mechanism
    says that its sensors wrap, the readings are those within half a turn of home.

    Raises
    ------
    MeasurementError
        As `read_readings`; and for a reading beyond the sensors' table.
    """
    own = read_readings(table, columns, mechanism.reading_unit)
    readings = np.zeros((len(own), len(mechanism.legs)))
    readings[:, : mechanism.reading_count] = own
    curves = mechanism.sensor_table
    if curves is None:
        return _unwrapped(mechanism, readings), np.ones_like(readings)
    straight = curves.straight(readings)
    beyond = np.argwhere(np.isfinite(readings) & np.isnan(straight))
    if len(beyond):
        row, leg = beyond[0].tolist()
        name, unit = columns.readings[leg], mechanism.reading_unit
        column = name if is_present(table, name, columns.reading_unit) else f"leg {leg + 1}"
        first, last = curves.reach(leg)
        raise table.row_error(
            row,
            f'has a reading of {readings[row, leg]:.6g} {unit} in column "{column}"; the table of '
            f"the sensor goes from {first:.6g} to {last:.6g} {unit}",
        )
    return _unwrapped(mechanism, straight), curves.slope(readings)


def _unwrapped(mechanism: Mechanism, readings: Array) -> Array:
    return turned_home(mechanism, readings) if mechanism.reading_wraps else readings


def read_all_readings(
    table: Table, columns: MeasurementColumns, mechanism: Mechanism, why: str
) -> Array:
    """Return the readings of `read_straight_readings`, of every leg in every row."""
    readings, _ = read_straight_readings(table, columns, mechanism)
    missing = np.argwhere(np.isnan(readings))
    if len(missing):
        row, leg = missing[0].tolist()
        raise table.row_error(row, f"has no reading of leg {leg + 1}; {why}")
    return readings


def shown_readings(mechanism: Mechanism, straight: Array) -> Array:
    """Return what the sensors show where straight ones would show this; NaN beyond their table."""
    if mechanism.sensor_table is None:
        return straight
    return mechanism.sensor_table.shown(turned_into_table(mechanism, straight))
