# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings as the columns of a table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from symkin.data.columns import observed_stems, pose_column_names, reading_column_names
from symkin.data.measured_rows import ALL_LEGS, MeasuredRows
from symkin.data.observables import (
    CIRCUMSTANCES,
    COMMANDED,
    OBSERVABLES,
    PAIR,
    REPORTED,
    ROW,
    TURN_AXIS,
    Sizes,
)
from symkin.errors import MeasurementError
from symkin.model.file_frames import as_drawn
from symkin.model.mechanism import Mechanism
from symkin.model.poses import POSE_SPACES
from symkin.values import Array

LOST_ORIENTATION = (
    "has a reported position without an orientation; the mechanism's file has its platform's frame "
    "elsewhere than symkin, so that expected are both or neither"
)


def measurement_columns(
    measurements: MeasuredRows, of: Mechanism | str
) -> dict[str, NDArray[np.generic]]:
    """Return the columns of a table of measurements; ``leg`` only if the rows differ in it.

    `of` is the mechanism, or the unit of the readings where there are no reported poses.
    """
    if isinstance(of, str):
        reading_unit = of
    else:
        reading_unit = of.reading_unit
        _require_measured(of, measurements)
        if measurements.reported is not None:
            drawn = as_drawn(of, measurements.reported)
            lost = lost_row(measurements.reported, drawn)
            if lost is not None:
                raise MeasurementError(f"row {measurements.row_numbers[lost]} {LOST_ORIENTATION}")
            measurements = replace(measurements, reported=drawn)
        if measurements.commanded is not None:
            ordered = as_drawn(of, measurements.commanded)
            measurements = replace(measurements, commanded=ordered)
    measurements = as_shown(measurements)
    columns: dict[str, NDArray[np.generic]] = {}
    if (measurements.leg_sets != ALL_LEGS).any():
        columns["leg"] = measurements.leg_sets + 1
    names = pose_column_names(measurements.pose_space)
    columns |= {
        name: values
        for name, values in zip(names, measurements.poses.T, strict=True)
        if measurements.pose_deviations is not None or not np.isnan(values).all() or not len(values)
    }
    names = reading_column_names(measurements.readings.shape[1], reading_unit)
    columns |= dict(zip(names, measurements.readings.T, strict=True))
    columns |= observed_columns(measurements, reading_unit)
    for name, each in CIRCUMSTANCES.items():
        values = getattr(measurements, name)
        if values is not None:
            names = each.columns(
                Sizes(measurements.space, measurements.readings.shape[1], reading_unit)
            )
            columns |= dict(zip(names, values.reshape(len(values), -1).T, strict=True))
    first = measurements.readings.shape[1] if isinstance(of, str) else of.reading_count
    without = tuple(f"psi_{leg + 1}_" for leg in range(first, measurements.readings.shape[1]))
    return {name: values for name, values in columns.items() if not name.startswith(without)}


def _require_measured(mechanism: Mechanism, measurements: MeasuredRows) -> None:
    """Refuse to write what would not be read with this mechanism as it is."""
    measurements.require_legs(len(mechanism.legs))
    for what, own, wanted in (
        ("poses", measurements.pose_space, mechanism.pose_space),
        ("readings", measurements.reading_unit or mechanism.reading_unit, mechanism.reading_unit),
    ):
        if own != wanted:
            raise MeasurementError(
                f'the {what} are {own}, and those of "{mechanism.name}" {wanted}; expected the '
                "mechanism that was measured"
            )


def lost_row(given: Array, carried: Array) -> int | None:
    """The first row, from 0, of which a value got lost between the frames; None without one."""
    rows = np.flatnonzero((np.isfinite(given) & ~np.isfinite(carried)).any(axis=1))
    return int(rows[0]) if len(rows) else None


def as_shown(measurements: MeasuredRows) -> MeasuredRows:
    """Return measurements with what the sensors show, as files have them.

    Raises
    ------
    MeasurementError
        For a reading that the sensors' table does not reach.
    """
    table, straight = measurements.sensor_table, measurements.readings
    if table is None:
        return measurements
    readings = table.shown(straight)
    beyond = np.argwhere(np.isfinite(straight) & np.isnan(readings))
    if len(beyond):
        row, leg = beyond[0].tolist()
        raise MeasurementError(
            f"row {measurements.row_numbers[row]}: the table of the sensors has nothing that leg "
            f"{leg + 1} would show at {straight[row, leg]:.6g} {measurements.reading_unit}; set "
            "joint_limits within the table"
        )
    deviations = measurements.reading_deviations
    if deviations is not None:
        deviations = deviations / np.abs(table.slope(readings))
    return replace(
        measurements, readings=readings, reading_deviations=deviations, sensor_table=None
    )


def observed_columns(measurements: MeasuredRows, reading_unit: str) -> dict[str, Array]:
    """Return the columns that symkin writes for what `read_observed` reads."""
    columns: dict[str, Array] = {}
    posed = {REPORTED: measurements.reported, COMMANDED: measurements.commanded}
    for before, poses in posed.items():
        if poses is not None:
            names = [f"{before}{name}" for name in pose_column_names(measurements.pose_space)]
            columns |= dict(zip(names, poses.T, strict=True))
    points, distances = measurements.points, measurements.distances
    sizes = Sizes(
        POSE_SPACES[measurements.pose_space],
        measurements.readings.shape[1],
        reading_unit,
        0 if points is None else points.shape[1],
        0 if distances is None else distances.shape[1],
        0 if measurements.partners is None else measurements.partners.shape[1],
    )
    stems = observed_stems(sizes)
    if measurements.turn_axes is not None:
        columns |= dict(zip(TURN_AXIS, measurements.turn_axes.T, strict=True))
    if measurements.partners is not None:
        places = measurements.partner_places
        rows = np.where(places >= 0, places + 1.0, np.nan)
        columns[ROW] = np.arange(1, len(places) + 1, dtype=np.float64)
        for pair, own in enumerate(rows.T):
            columns[f"{PAIR}{pair + 1}_row"] = np.asarray(own, dtype=np.float64)
    for name, own in stems.items():
        values = getattr(measurements, name)
        if own and values is not None:
            names = [f"{stem}_{unit}" if unit else stem for stem, unit in own]
            table = values.reshape(len(values), len(names))
            columns |= dict(zip(names, table.T, strict=True))
    for each in OBSERVABLES.values():
        between = getattr(measurements, each.correlations) if each.correlations else None
        if between is not None:
            table = between.reshape(len(between), -1)
            columns |= dict(zip(each.correlation_columns(sizes), table.T, strict=True))
    return columns
