# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symkin.data.measured_rows import ALL_LEGS, MeasuredRows
from symkin.data.writing import measurement_columns
from symkin.errors import MeasurementError
from symkin.model.mechanism import Mechanism
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import write_table
from symkin.values import record

__all__ = ["ALL_LEGS", "Measurements"]


@record
class Measurements(MeasuredRows):
    """Sensor readings and what was measured of the poses they were taken at, in SI units.

    Most measurements are full poses and nothing else, `complete`. Everything else is optional: None
    if nothing of the kind was observed, and NaN where a single value was not. A standard deviation
    that is None or NaN is the noise settings'; it is in the unit of what it belongs to.

    Attributes
    ----------
    poses : ndarray, shape (N, coordinates)
        ``x, y, phi`` (planar), ``x, y`` (point), ``x, y, z, qx, qy, qz, qw`` (spatial),
        ``x, y, z`` (translating), ``qx, qy, qz, qw`` (spherical); m, rad. NaN for a coordinate that
        was not measured, a quaternion only as a whole.
    readings : ndarray, shape (N, legs)
        In the sensor's unit, rad or m; NaN for a reading that was not taken.
    leg_sets : ndarray of int, shape (N,)
        The leg, from 0, whose set of poses the row belongs to; -1 for all legs. (Files, reports
        and messages count legs from 1, and write 0 for all.)
    row_numbers : ndarray of int, shape (N,)
        Where the rows stand in the source, from 1: lines of a CSV, header and comments included,
        or rows of a Parquet table. What was simulated has those of the CSV that symkin writes.
    source : Path or None
        The file that they were read from.
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses. If nobody said it, the one with so many coordinates; planar if two have.
    reading_unit : {"rad", "m", ""}
        The sensors' unit; empty if nobody said it.
    pose_deviations : ndarray, shape (N, dof), or None
        Of the position's coordinates, then of the angle or the rotation vector.
    pose_correlations : ndarray, shape (N, 1 or 3), or None
        Of the errors of the position between x and y, x and z, y and z, where a row has standard
        deviations of its own; NaN for none.
    reading_deviations : ndarray, shape (N, legs), or None
        Of the readings.
    reported : ndarray, shape (N, coordinates), or None
        Poses of the platform in the base frame as a controller reports them, like `poses`.
    reported_deviations : ndarray, shape (N, dof), or None
        Like `pose_deviations`, but None and NaN are zero: what is reported is what it went to.
    points : ndarray, shape (N, n, 2 or 3), or None
        Targets on the platform, in the frame of the measuring device.
    point_correlations : ndarray, shape (N, n, 1 or 3), or None
        As `pose_correlations`, of the errors of each point.
    point_deviations : ndarray, shape (N, n, 2 or 3), or None
        Of `points`.
    distances : ndarray, shape (N, k), or None
        From fixed points to the target.
    distance_deviations : ndarray, shape (N, k), or None
        Of `distances`.
    heights : ndarray, shape (N,), or None
        Of the target above a plane: zero where a probe touches it. Spatial robots only.
    height_deviations : ndarray, shape (N,), or None
        Of `heights`.
    attitudes : ndarray, shape (N, 3), or None
        Roll, pitch and yaw of the target in the device's frame, ``Rz(yaw) Ry(pitch) Rx(roll)``, as
        an attitude sensor shows them; any of them may be missing.
    attitude_deviations : ndarray, shape (N, 3), or None
        Of `attitudes`.
    turns : ndarray, shape (N,), or None
        How far the target is turned about a known axis of the device's frame, whatever it does
        about others.
    turn_deviations : ndarray, shape (N,), or None
        Of `turns`.
    turn_axes : ndarray, shape (N, 3), or None
        These axes, of length one; without them z.
    partners : ndarray of int, shape (N, k), or None
        What was measured between two rows stands in one of them, up to k times: here the number of
        the other one (see `row_numbers`), 0 for none.
    separations : ndarray, shape (N, k), or None
        How far the target is from the target in the other row.
    separation_deviations : ndarray, shape (N, k), or None
        Of `separations`.
    rises : ndarray, shape (N, k), or None
        How much higher above the plane the target is than in the other row. Spatial robots only.
    rise_deviations : ndarray, shape (N, k), or None
        Of `rises`.
    offsets : ndarray, shape (N, k, 2 or 3), or None
        How far the target is from that in the other row along each coordinate of the device's
        frame; zero where both touch the same point.
    offset_deviations : ndarray, shape (N, k, 2 or 3), or None
        Of `offsets`.
    commanded : ndarray, shape (N, coordinates), or None
        Where the robot was sent, in the base's frame: no observation, but where a fit may start.
    times : ndarray, shape (N,), or None
        When the rows were measured, s; without them one follows the other in their order.
    temperatures : ndarray, shape (N,), or None
        Of the robot, degrees Celsius.
    sessions : ndarray of int, shape (N,), or None
        In which session each row was measured, by numbers from 0.
    approaches : ndarray, shape (N, legs), or None
        From which side each leg came to rest: 1 where its reading rose, -1 where it fell, 0 where
        nobody knows; without them the readings before tell.
    velocities : ndarray, shape (N, 2 or 3), or None
        Of the target in the frame of the measuring device while it moved, m/s.
    speeds : ndarray, shape (N, legs), or None
        Of the readings while it moved, per second.
    sensor_table : SensorTable or None
        The mechanism's, which has made the readings straight; files have what the sensors show.
    unread : tuple of str
        Columns of the table that nothing was read from.
    robot : str
        Whose rows they are, of a table of many robots; else empty.
    ignored : tuple of str
        Columns of the table that were left out on purpose.
    """

    def columns(self, mechanism: Mechanism | None = None) -> Mapping[str, Any]:
        """Return the columns of its file, of readings without a unit too; else as `save`."""
        if mechanism is None and (self.reported is not None or self.commanded is not None):
            kind = "commanded" if self.reported is None else "reported"
            raise MeasurementError(
                f"{kind} poses are written in the frames of the mechanism's file, which may be "
                "others than its own; give the mechanism: save(path, mechanism)"
            )
        return measurement_columns(self, mechanism or self.reading_unit)

    def save(
        self,
        path: str | os.PathLike[str],
        mechanism: Mechanism | None = None,
        *,
        overwrite: bool = False,
    ) -> Path:
        """Write it as CSV or Parquet, by extension, and return the file; see `read_measurements`.

        Parameters
        ----------
        path : str or path
            The file. As ``.json`` it is written as other results are, see `Result.save`.
        mechanism : Mechanism, optional
            Whose measurements these are: they read back with it to the same numbers. Without it,
            too, unless there are reported or commanded poses, whose frames it alone knows.
        overwrite : bool
            Whether a file that exists may be replaced.

        Raises
        ------
        MeasurementError
            Without a mechanism, if nobody said the unit of the readings or there are reported or
            commanded poses; with one that has other legs or another unit.
        """
        if Path(path).suffix.lower() == ".json":
            return super().save(path, overwrite=overwrite)
        if mechanism is None and not self.reading_unit:
            raise MeasurementError(
                "the readings have no unit; give their reading_unit, or the mechanism"
            )
        columns = self.columns(mechanism)
        with OutputFiles(overwrite=overwrite) as outputs:
            write_table(outputs.file(Path(path)), columns)
        return Path(path)
