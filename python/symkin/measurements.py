# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MeasurementError, NotIdentifiableError, printable
from symkin.poses import space_named, wrong_quaternion
from symkin.result import Result, Value, field, record

if TYPE_CHECKING:
    from symkin.report.content import Page

__all__ = ["ALL_LEGS", "Measurements", "pose_rows"]

ALL_LEGS = -1  # the set of poses that serve every leg; in files it is 0, and legs count from 1


def pose_rows(poses: ArrayLike | Any) -> NDArray[np.float64]:
    """Poses as rows, shape (N, coordinates), of an array or of what has poses: a sample, a plan."""
    return np.atleast_2d(np.ascontiguousarray(getattr(poses, "poses", poses), dtype=np.float64))


@record
class Measurements(Result):
    """Measured poses with the sensor readings taken at them, in SI units.

    Attributes
    ----------
    poses : ndarray, shape (N, coordinates)
        ``x, y, phi`` (planar), ``x, y`` (point), ``x, y, z, qx, qy, qz, qw`` (spatial) or
        ``x, y, z`` (translating); m, rad.
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
    pose_space : {"planar", "point", "spatial", "translating"}
        Kind of the poses. If nobody said it, the one with so many coordinates; planar if two have.
    reading_unit : {"rad", "m", ""}
        The sensors' unit; empty if nobody said it.
    """

    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    leg_sets: NDArray[np.intp] = field(number=True)
    row_numbers: NDArray[np.intp]
    source: Path | None = None
    pose_space: str = ""
    reading_unit: str = ""

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose, and that quaternions are rotations."""
        make_arrays(
            self,
            poses=(2, "float"),
            readings=(2, "float"),
            leg_sets=(1, "int"),
            row_numbers=(1, "int"),
        )
        space = space_named(self.pose_space, self.poses.shape[1])
        object.__setattr__(self, "pose_space", space.name)
        rows = len(self.poses)
        for name in ("readings", "leg_sets", "row_numbers"):
            count = len(getattr(self, name))
            if count != rows:
                raise MeasurementError(f"there are {count} {name} for {rows} poses")
        wrong = wrong_quaternion(self.poses)
        if wrong is not None:
            raise MeasurementError(
                f"row {self.row_numbers[wrong[0]]} has a quaternion of norm {wrong[1]:.6g}; "
                "expected 1"
            )
        legs = self.readings.shape[1]
        if rows and not ALL_LEGS <= self.leg_sets.min() <= self.leg_sets.max() < legs:
            raise MeasurementError(
                f"a leg set is not one of the legs 0 to {legs - 1}, or {ALL_LEGS} for all"
            )
        super().__post_init__()

    @classmethod
    def of(
        cls,
        poses: ArrayLike,
        readings: ArrayLike,
        leg_sets: ArrayLike | None = None,
        reading_unit: str = "",
        pose_space: str = "",
    ) -> Measurements:
        """Measurements from arrays, rows from 1; without `leg_sets`, each serves all legs."""
        rows = np.asarray(poses, dtype=np.float64)
        sets = np.full(len(rows), ALL_LEGS) if leg_sets is None else np.asarray(leg_sets)
        numbers = np.arange(1, len(rows) + 1)
        return cls(
            rows,
            np.asarray(readings),
            sets,
            numbers,
            reading_unit=reading_unit,
            pose_space=pose_space,
        )

    @property
    def source_name(self) -> str:
        """Name of the file, as it can be printed; empty without one."""
        return printable(self.source.name) if self.source else ""

    def rows_of(self, leg: int) -> NDArray[np.intp]:
        """Return the rows, from 0, that identify a leg (from 0): of its set, with its reading.

        Returns
        -------
        ndarray of int
        """
        return self._leg_rows[leg]

    @cached_property
    def _leg_rows(self) -> tuple[NDArray[np.intp], ...]:
        own = self.leg_sets[:, np.newaxis] == np.arange(self.readings.shape[1])
        used = (own | (self.leg_sets == ALL_LEGS)[:, np.newaxis]) & np.isfinite(self.readings)
        rows = tuple(np.flatnonzero(each) for each in used.T)
        for each in rows:
            each.flags.writeable = False
        return rows

    @property
    def measured_legs(self) -> tuple[int, ...]:
        """The legs, from 0, that have any row of their own."""
        return tuple(leg for leg, rows in enumerate(self._leg_rows) if len(rows))

    def for_all_legs(self) -> Measurements:
        """Return the same measurements without sets: every row serves all legs.

        Returns
        -------
        Measurements
        """
        return replace(self, leg_sets=np.full(len(self.poses), ALL_LEGS))

    def require(self, count: int) -> None:
        """Refuse fewer poses per measured leg than it has parameters.

        Raises
        ------
        NotIdentifiableError
            Naming the leg, its number of poses and `count`.
        """
        origin = f"{self.source}: " if self.source else ""
        if not self.measured_legs:
            raise NotIdentifiableError(f"{origin}no leg has a measured pose")
        for leg in self.measured_legs:
            poses = len(self.rows_of(leg))
            if poses < count:
                raise NotIdentifiableError(
                    f"{origin}leg {leg + 1} has {poses} measured poses; "
                    f"its {count} parameters need at least {count}"
                )

    def subset(self, rows: NDArray[np.intp]) -> Measurements:
        """Return the measurements of some rows, from 0.

        Returns
        -------
        Measurements
        """
        try:
            return Measurements(
                self.poses[rows],
                self.readings[rows],
                self.leg_sets[rows],
                self.row_numbers[rows],
                self.source,
                self.pose_space,
                self.reading_unit,
            )
        except IndexError as error:
            raise MeasurementError(f"no subset of {len(self.poses)} rows: {error}") from None

    def page(self) -> Page:
        """Return what was measured."""
        from symkin.report.measurements import measurements_page

        return measurements_page(self)

    def columns(self) -> Mapping[str, Any]:
        """Return the columns of its file."""
        from symkin.io.measurements import measurement_columns

        return measurement_columns(self, self.reading_unit)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write it as CSV or Parquet, by extension; `read_measurements` reads it.

        Parameters
        ----------
        path : str or path
            The file.
        overwrite : bool
            Whether a file that exists may be replaced.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        MeasurementError
            If nobody said the unit of the readings.
        """
        from symkin.io.output_files import OutputFiles
        from symkin.io.tables import write_table

        if not self.reading_unit:
            raise MeasurementError(
                "the readings have no unit; give their reading_unit, or use write_measurements"
            )
        with OutputFiles(overwrite=overwrite) as outputs:
            write_table(outputs.file(Path(path)), self.columns())
        return Path(path)


def make_arrays(table: Value, **fields: tuple[int, str]) -> None:
    """Make arrays of a frozen table's fields, each of so many dimensions and such a type.

    Raises
    ------
    MeasurementError
        Naming the field, its shape or type and what is expected.
    """
    for name, (dimensions, kind) in fields.items():
        array = np.asarray(getattr(table, name), dtype=None if kind == "int" else kind)
        if array.ndim != dimensions:
            raise MeasurementError(
                f"{name} have shape {array.shape}; expected {dimensions} "
                f"dimension{'s' * (dimensions > 1)}"
            )
        if kind == "int" and array.size and array.dtype.kind not in "iu":
            raise MeasurementError(f"{name} are of type {array.dtype}; expected integers")
        object.__setattr__(table, name, array)
