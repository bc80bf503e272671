# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from symkin.errors import MeasurementError, NotIdentifiableError, printable
from symkin.poses import wrong_quaternion

__all__ = ["Measurements"]


@dataclass(frozen=True)
class Measurements:
    """Measured poses with the sensor readings taken at them, in SI units.

    Attributes
    ----------
    poses : ndarray, shape (N, coordinates)
        ``x, y, phi`` (planar), ``x, y`` (point) or ``x, y, z, qx, qy, qz, qw`` (spatial); m, rad.
    readings : ndarray, shape (N, legs)
        In the sensor's unit, rad or m; NaN for a reading that was not taken.
    leg_sets : ndarray of int, shape (N,)
        The leg, from 1, whose set of poses the row belongs to; 0 for all legs.
    row_numbers : ndarray of int, shape (N,)
        Where the rows stand in the source, from 1: lines of a CSV, header and comments included,
        or rows of a Parquet table. What was simulated has those of the CSV that symkin writes.
    source : Path or None
        The file that they were read from.
    """

    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    leg_sets: NDArray[np.intp]
    row_numbers: NDArray[np.intp]
    source: Path | None = None

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose, and that quaternions are rotations."""
        make_arrays(
            self,
            poses=(2, "float"),
            readings=(2, "float"),
            leg_sets=(1, "int"),
            row_numbers=(1, "int"),
        )
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
        if rows and not 0 <= self.leg_sets.min() <= self.leg_sets.max() <= legs:
            raise MeasurementError(f"a leg set is not one of the legs 1 to {legs}, or 0 for all")

    @classmethod
    def of(
        cls,
        poses: NDArray[np.float64],
        readings: NDArray[np.float64],
        leg_sets: NDArray[np.intp] | None = None,
    ) -> Measurements:
        """Measurements from arrays, rows from 1; without `leg_sets`, each serves all legs."""
        count = len(poses)
        sets = np.zeros(count, dtype=np.intp) if leg_sets is None else leg_sets
        return cls(poses, readings, sets, np.arange(1, count + 1))

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
        in_set = (self.leg_sets == 0) | (self.leg_sets == leg + 1)
        return np.flatnonzero(in_set & np.isfinite(self.readings[:, leg]))

    @property
    def measured_legs(self) -> tuple[int, ...]:
        """The legs, from 0, that have any row of their own."""
        return tuple(leg for leg in range(self.readings.shape[1]) if len(self.rows_of(leg)))

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
            )
        except IndexError as error:
            raise MeasurementError(f"no subset of {len(self.poses)} rows: {error}") from None


def make_arrays(table: object, **fields: tuple[int, str]) -> None:
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
