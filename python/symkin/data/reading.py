# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings as tables."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from statistics import median
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from symkin.data.columns import (
    NumbersMet,
    PoseValues,
    StatedUnit,
    check_columns,
    has_columns,
    has_observed_columns,
    has_pose,
    is_present,
    own_columns,
    pose_column_names,
    read_circumstances,
    read_observed,
    read_partners,
    read_pose_values,
    reading_column_names,
    stated_units,
)
from symkin.data.foreign import UNIT, mapping_for, names_robots
from symkin.data.joining import joined
from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.data.observables import OBSERVABLES, Sizes
from symkin.data.sensor_tables import read_straight_readings
from symkin.data.tries import only_counting
from symkin.data.unread import (
    refuse_several_robots,
    refuse_unread_robots,
    refuse_what_is_missed,
    unread_columns,
)
from symkin.data.writing import LOST_ORIENTATION, lost_row
from symkin.errors import MeasurementError, did_you_mean, few
from symkin.model.file_frames import from_drawing
from symkin.model.framing import unframed
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.settings import MeasurementColumns
from symkin.options import checks
from symkin.results import Result
from symkin.storage.quantities import unit_factor
from symkin.storage.tables import Table, TableSource, read_table
from symkin.values import Array


class HoldsMeasurements(Protocol):
    """What measurements came with, as a simulation."""

    @property
    def measurements(self) -> Measurements:
        """They."""


# What people have of measurements; of several sessions one each.
Measured = Measurements | HoldsMeasurements | TableSource
MeasuredSessions = Measured | Sequence[Measured]

# A wrong unit leaves closures as large as the legs; an uncalibrated mechanism, a few percent.
_POOR_FIT = 0.05
_MUCH_BETTER = 10.0
# Small enough units make every pose and reading nearly zero, which fits a mechanism whose home is
# there: a fit is one only if the readings of other poses would not do as well.
_BETTER_THAN_MIXED_UP = 5.0
_MISTAKEN_FOR_EACH_OTHER = {"rad": ("rad", "deg", "rev"), "m": ("m", "mm", "cm", "inch")}
_ROBOT = "the name or number of the robot that the row belongs to"
_MIX = np.uint64(0x9E3779B97F4A7C15)  # an odd factor that spreads bits, 2^64 over the golden ratio


@checks()
def read_measurements(
    source: TableSource,
    mechanism: MechanismGiven,
    columns: MeasurementColumns | None = None,
    *,
    ignore: Sequence[str] = (),
    robot: str | None = None,
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
        ``phi_rad``, ``psi_1_rad``, ..., with any unit in the name; ``height_m``, ``x_sd_m`` and so
        on for what else was observed). Of a table with a column ``status``, as a guided session
        writes it, the rows that are ``ok`` or ``repeat`` and were not taken back.
    ignore : sequence of str
        Columns that are left out on purpose. Of others, `Measurements.unread` names those that
        nothing was read from.
    robot : str, optional
        Of a table of many robots, the one whose rows are read, by its name in the column ``robot``,
        or in the only one that is called as such columns are (``serial``, ``SN``).

    Returns
    -------
    Measurements
        In SI units, readings made straight by the mechanism's `SensorTable`. A reading or
        coordinate that was not taken, because its cell is empty or it has no column, is NaN. Row
        numbers are lines of a CSV file, else rows, from 1.

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column: a missing column, a cell that is no finite number,
        a quaternion that is not of unit length, a row without any reading, a repeated row, a
        reading or coordinate without a column beside one without use that may hold it, values whose
        units are evidently others than stated, or nothing observed but the readings of a
        mechanism without redundant legs; rows of several robots, or none of the wanted one.
    """
    mechanism = as_mechanism(mechanism)
    table = read_table(source, mechanism.step)
    column = robot_column(mechanism, columns)
    if robot is not None:
        column = _column_of_robots(table, column)
        table = _rows_of_robot(table, column, robot)
    table = only_counting(table)
    if column in table.names and column not in ignore:
        refuse_several_robots(table, column)
    measurements = measurements_of_table(table, mechanism, columns, ignore)
    return measurements if robot is None else replace(measurements, robot=robot)


def _column_of_robots(table: Table, column: str) -> str:
    """The column that names robots, or else the only one that has a name as such a column has."""
    others = [name for name in table.names if names_robots(name)]
    if column not in table.names and len(others) == 1:
        return others[0]
    table.require(column, _ROBOT)
    return column


def _rows_of_robot(table: Table, column: str, robot: str) -> Table:
    labels = table.labels(column)
    names = list(labels.distinct)
    if robot not in names:
        near = did_you_mean(robot, names) or f" (there are {few(names, 5)})"
        raise table.error(f'no robot is called "{robot}" in column "{column}"{near}')
    return table.subset(np.flatnonzero(labels.codes == names.index(robot)))


def as_measurements(measured: MeasuredSessions, mechanism: Mechanism) -> Measurements:
    """Return measurements of a mechanism from whatever holds them.

    That is what `read_measurements` reads, or a list of it, a session each. Anything else, and what
    cannot be read, raises a `MeasurementError`.
    """
    if isinstance(measured, Measurements):
        return measured
    if isinstance(measured, list | tuple):
        if not measured:
            raise MeasurementError("the measurements are an empty list; expected one or more")
        return joined([as_measurements(each, mechanism) for each in measured])
    held = getattr(measured, "measurements", None)
    if isinstance(held, Measurements):
        return held
    table = require_table(measured, "measurements", "Measurements, a simulation")
    return read_measurements(table, mechanism)


def require_table(given: object, what: str, others: str) -> TableSource:
    """Refuse what no table can be read from; `others` it could have been, too."""
    is_table = isinstance(given, str | os.PathLike | Mapping) or hasattr(given, "read")
    own = isinstance(given, Result | Mechanism)  # which have columns, but of something else
    if own or not (is_table or hasattr(given, "columns")):
        article = "" if what.endswith("s") else "the "
        raise MeasurementError(
            f"{type(given).__name__} is given as {article}{what}; expected {others}, a path, a "
            "stream or a table of columns"
        )
    return cast(TableSource, given)


@checks()
def read_fleet(
    source: TableSource,
    mechanism: MechanismGiven,
    columns: MeasurementColumns | None = None,
    *,
    ignore: Sequence[str] = (),
) -> dict[str, Measurements]:
    """Read the measurements of many robots from one table with a column ``robot``.

    Parameters
    ----------
    source, mechanism, columns, ignore
        As for `read_measurements`. Rows of one robot need not stand together.

    Returns
    -------
    dict of str to Measurements
        By the robots' names, in their order of appearance.

    Raises
    ------
    MeasurementError
        As `read_measurements`, and for a missing or empty column ``robot``.
    """
    mechanism = as_mechanism(mechanism)
    table = read_table(source, mechanism.step)
    return measurements_by_robot(table, mechanism, columns, ignore)


def measurements_by_robot(
    table: Table,
    mechanism: Mechanism,
    columns: MeasurementColumns | None,
    ignore: Sequence[str],
    *,
    is_first: bool = True,
    row_numbers: NumbersMet | None = None,
) -> dict[str, Measurements]:
    """Return what `read_fleet` does, from a table, or the first or a further part of one.

    Parts have in common which numbers of their rows were met.
    """
    robot = robot_column(mechanism, columns)
    table.require(robot, _ROBOT)
    table = only_counting(table, robot)
    labels = table.labels(robot)
    starts = np.flatnonzero(np.append(True, np.diff(labels.codes) != 0))
    met = dict.fromkeys(labels.codes[starts].tolist())  # in their order of appearance
    places = np.zeros(max(met) + 1, dtype=np.intp)
    places[list(met)] = np.arange(len(met))
    robots = places[labels.codes]
    measurements = measurements_of_table(
        table, mechanism, columns, ignore, robots, is_first=is_first, row_numbers=row_numbers
    )
    if len(starts) > len(met):  # not together
        measurements = measurements.subset(np.argsort(robots, kind="stable"))
    ends = np.cumsum(np.bincount(robots))
    names = [labels.distinct[code] for code in met]
    return dict(zip(names, measurements.split(ends.tolist(), names), strict=True))


def robot_column(mechanism: Mechanism, columns: MeasurementColumns | None) -> str:
    """The column of the robot that a row belongs to, in tables of many."""
    given = columns or mechanism.measurement_columns
    return "robot" if given is None else given.robot


def measurements_of_table(
    table: Table,
    mechanism: Mechanism,
    columns: MeasurementColumns | None,
    ignore: Sequence[str],
    robots: NDArray[np.intp] | None = None,
    *,
    is_first: bool = True,
    row_numbers: NumbersMet | None = None,
) -> Measurements:
    """The rows of a table, checked; those of different robots may be alike.

    What is wrong with the table as a whole is told by its first part.
    """
    own = columns is None
    columns = columns or _columns_for(table, mechanism)
    own = own and columns is not mechanism.measurement_columns
    space, legs, read = mechanism.pose_space, len(mechanism.legs), mechanism.reading_count
    check_columns(columns, space, read, mechanism.reading_unit)
    values = read_pose_values(table, columns, space)
    others: dict[str, Any] = {**read_observed(table, columns, space, read, mechanism.reading_unit)}
    if others.get("commanded") is not None:
        others["commanded"] = from_drawing(mechanism, others["commanded"])
    others |= read_circumstances(table, Sizes(mechanism.space, legs, mechanism.reading_unit))
    others["partners"] = read_partners(table, columns, space, row_numbers)
    if others.get("reported") is not None:
        given = others["reported"]
        others["reported"] = from_drawing(mechanism, given)
        lost = lost_row(given, others["reported"])
        if lost is not None:
            raise table.row_error(lost, LOST_ORIENTATION)
    readings, slopes = read_straight_readings(table, columns, mechanism)
    if others.get("reading_deviations") is not None:
        of_all = np.zeros_like(slopes)
        of_all[:, :read] = others["reading_deviations"]
        others["reading_deviations"] = of_all * np.abs(slopes)
    leg_sets = _leg_sets(table, columns, legs)
    unread = unread_columns(table, ignore)
    if robots is None:
        refuse_unread_robots(table, unread, mechanism)
    if own:
        refuse_what_is_missed(table, columns, unread, space, mechanism.reading_unit)
    measurements = Measurements(
        poses=values.poses(),
        readings=readings,
        leg_sets=leg_sets,
        row_numbers=table.row_numbers,
        source=table.path,
        reading_unit=mechanism.reading_unit,
        pose_space=mechanism.pose_space,
        sensor_table=mechanism.sensor_table,
        unread=unread,
        ignored=tuple(ignore),
        **others,
    )
    _check_unread_rows(table, measurements.readings[:, mechanism.is_read])
    if is_first:
        _check_observed(table, measurements, mechanism)
    _check_repeated_rows(table, measurements, robots)
    if is_first:
        stated = stated_units(table, columns, mechanism.reading_unit)
        _check_units(table, values, measurements, mechanism, stated)
    return measurements


@checks()
def write_measurements(
    measurements: Measurements,
    path: str | os.PathLike[str],
    mechanism: MechanismGiven,
    *,
    overwrite: bool = False,
) -> None:
    """Write measurements as CSV or Parquet, by extension; they read back to the same numbers.

    A file that exists is replaced only with `overwrite`. The same as `Measurements.save`.
    """
    mechanism = as_mechanism(mechanism)
    measurements.save(path, mechanism, overwrite=overwrite)


def _columns_for(table: Table, mechanism: Mechanism) -> MeasurementColumns:
    mapped = mechanism.measurement_columns
    if mapped is not None and has_columns(table, mapped):
        return mapped
    space, legs = mechanism.pose_space, mechanism.reading_count
    columns = own_columns(table, space, legs, partial=True)
    own_names = has_pose(columns) or has_observed_columns(table, space)
    lacks_pose = not own_names and not mechanism.straight.redundant
    has_readings = any(is_present(table, name, None) for name in columns.readings)
    if mapped is None and lacks_pose and mechanism.space.in_space and has_readings:
        open_ = ", ".join(mechanism.open_coordinates)
        if open_:
            raise table.error(
                f"has readings, and nothing of the pose, of which they leave {open_} to "
                f"gravity; expected columns of what was measured beside them, {open_} or more"
            )
        raise table.error(
            "has readings, and neither poses nor heights; where a probe touched a bed, add a "
            f"column height_mm of zeros (columns present: {', '.join(table.names)})"
        )
    if (lacks_pose or not has_readings) and (mapping := mapping_for(table, mechanism)):
        wanted = [
            *([] if own_names else pose_column_names(space)[:1]),
            *([] if has_readings else reading_column_names(1, mechanism.reading_unit)),
        ]
        size = ' (of counts or pixels, the size of one: "360 deg/4096/count", "0.1 mm/px")'
        units = f", with a unit for each {UNIT}{size}," if UNIT in mapping else ""
        error = table.error(
            f"has no columns of symkin's names, such as {' and '.join(wanted)}; if this "
            f"is what it holds, put it{units} as a line into a file (--columns FILE, in Python "
            f"columns=symkin.load_columns(FILE)): {mapping}"
        )
        error.mapping = mapping
        raise error
    if mapped is not None and not own_names:
        return mapped
    if lacks_pose and not has_readings:
        (reading,), pose = reading_column_names(1, mechanism.reading_unit), pose_column_names(space)
        others = ", distance_1_m or height_m" if mechanism.space.in_space else " or distance_1_m"
        raise table.error(
            f"has no columns of symkin's names: of readings, such as {reading}, and of what was "
            f"measured beside them, such as {pose[0]}{others} (columns present: "
            f"{', '.join(table.names)}); rename them, or say with --columns which is which"
        )
    if lacks_pose:
        return own_columns(table, space, legs)  # of which there is none: the error says so
    return columns


def _leg_sets(table: Table, columns: MeasurementColumns, leg_count: int) -> NDArray[np.intp]:
    if columns.leg is None:
        return np.full(table.row_count, ALL_LEGS)
    table.require(columns.leg, "the leg whose set the pose belongs to")
    return table.legs(columns.leg, 0, leg_count) - 1


def _check_unread_rows(table: Table, readings: Array) -> None:
    unread = np.isnan(readings).all(axis=1)
    if unread.any():
        raise table.row_error(
            int(np.argmax(unread)),
            "has no reading of any leg; fill in what was read, or take the row out",
        )


def _check_observed(table: Table, measurements: Measurements, mechanism: Mechanism) -> None:
    """Refuse readings that nothing else was observed with, unless they say something of each other.

    They do with more legs than degrees of freedom.
    """
    observed = [getattr(measurements, name) for name in OBSERVABLES if name != "readings"]
    if not mechanism.straight.redundant and not any(
        each is not None and np.isfinite(each).any() for each in observed
    ):
        raise table.error(
            "no pose was measured, nor anything else but readings; with as many legs as degrees of "
            "freedom these alone identify nothing"
        )


def _check_repeated_rows(
    table: Table, measurements: Measurements, robots: NDArray[np.intp] | None
) -> None:
    values = [
        column
        for each in fields(measurements)
        if isinstance(value := getattr(measurements, each.name), np.ndarray)
        and each.name != "row_numbers"
        for column in value.reshape(table.row_count, -1).T
    ]
    if robots is not None:
        values.append(robots)
    repeated, original = _repeated(values)
    if len(repeated):
        original = table.row_numbers[original]
        more = f" ({len(repeated)} repeated rows in all)" if len(repeated) > 1 else ""
        raise table.row_error(
            int(repeated[0]),
            f"repeats row {original}{more}; a repeated row adds no information but looks as if it "
            "did",
        )


def _repeated(columns: Sequence[NDArray[Any]]) -> tuple[NDArray[np.intp], int]:
    """Rows that were there before, NaN like NaN, and where the first of them was.

    Only rows with the same key are compared, which is quick where there are none.
    """
    keys = np.zeros(len(columns[0]), dtype=np.uint64)
    for column in columns:
        bits = _comparable(column).view(np.uint64)
        keys = (keys ^ bits ^ bits >> np.uint64(32)) * _MIX
        keys ^= keys >> np.uint64(29)
    if (np.diff(np.sort(keys)) > 0).all():
        return np.empty(0, dtype=np.intp), -1
    order = np.argsort(keys, kind="stable")
    alike = np.flatnonzero(np.diff(keys[order]) == 0)
    candidates = np.sort(order[np.union1d(alike, alike + 1)])
    rows = np.column_stack([_comparable(column[candidates]) for column in columns])
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    before = first[inverse.ravel()]
    repeated = np.flatnonzero(before != np.arange(len(rows)))
    original = int(candidates[before[repeated[0]]]) if len(repeated) else -1
    return candidates[repeated], original


def _comparable(values: NDArray[Any]) -> Array:
    """As floats without NaN and negative zero."""
    return np.nan_to_num(np.asarray(values, dtype=np.float64), nan=np.inf) + 0.0


def _check_units(
    table: Table,
    values: PoseValues,
    measurements: Measurements,
    mechanism: Mechanism,
    stated_units: Sequence[StatedUnit],
) -> None:
    """Refuse measurements that fit the nominal mechanism far better in other units.

    Fits are told by medians over the finite closures, which outliers do not move; without any full
    pose, by the distances between positions, which need no orientation and no common frame.

    Raises
    ------
    MeasurementError
        If the median closure of all legs is above 5% of the mean leg dimension, and other units of
        one or more groups of columns make it ten times smaller. Names the columns, their stated
        units and the likely ones.
    """
    full = np.isfinite(measurements.poses).all(axis=1).any()
    if not full and len(measurements.poses) < 2:
        return
    misfit = _median_closure if full else _median_spacing
    as_stated = misfit(measurements, mechanism)
    if not as_stated > _POOR_FIT * _leg_dimension(measurements, mechanism):
        return
    with np.errstate(over="ignore", invalid="ignore"):
        trials = [
            (misfit(changed, mechanism), units, changed)
            for units, changed in _in_other_units(values, measurements, stated_units)
        ]
    closure, units, likely = min(trials, key=lambda trial: trial[0])
    mixed_up = misfit(_mixed_up(likely), mechanism)
    if closure * _MUCH_BETTER <= as_stated and closure * _BETTER_THAN_MIXED_UP < mixed_up:
        wrong = ", and ".join(
            f'the {stated.values} (column "{stated.column}") are stated in {stated.unit} but fit '
            f"in {unit}"
            for stated, unit in zip(stated_units, units, strict=True)
            if unit != stated.unit
        )
        what = "legs would close" if full else "distances between positions would agree"
        instead = f"{as_stated:.3g} m" if np.isfinite(as_stated) else "not at all"
        raise table.error(
            f"{wrong}: at the nominal parameters, the {what} to "
            f"{closure:.3g} m in the median instead of {instead}"
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
        poses = values.poses(factors.get("positions", 1.0), factors.get("angles", 1.0))
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
    closures: list[Array] = []
    poses = unframed(mechanism, measurements.poses)
    for leg in measurements.measured_legs:
        rows = measurements.rows_of(leg)
        readings = measurements.readings[rows, leg]
        closures.append(mechanism.closure_error(leg, poses[rows], readings))
    sizes = np.abs(np.concatenate(closures)) if closures else np.empty(0)
    finite = sizes[np.isfinite(sizes)]
    # `np.median` would load masked arrays, for longer than an estimate takes.
    return median(finite.tolist()) if len(finite) else np.inf


def _median_spacing(measurements: Measurements, mechanism: Mechanism) -> float:
    """How far distances between successive positions are from those of the nominal mechanism.

    Infinite if it can take the readings of less than half of the rows that have all of them.
    """
    axes = mechanism.space.size
    positions, readings = measurements.poses[:, :axes], measurements.readings
    rows = np.isfinite(positions).all(axis=1) & np.isfinite(readings).all(axis=1)
    if not rows.any() or mechanism.open_coordinates:  # which readings do not tell
        return np.inf
    taken = mechanism.forward_kinematics(readings[rows])[0][:, :axes]
    spacings = [np.linalg.norm(np.diff(each, axis=0), axis=1) for each in (positions[rows], taken)]
    differences = np.abs(spacings[0] - spacings[1])
    finite = differences[np.isfinite(differences)]
    return float(np.median(finite)) if 0 < len(differences) <= 2 * len(finite) else np.inf


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
    return float(np.nanmedian(np.abs(measurements.poses[:, :2])))
