# SPDX-License-Identifier: MIT
"""A row of a session: which columns it has, and how it and a commanded pose are written."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.observed import Observed
from symkin.data.columns import own_pose_columns, read_pose_values
from symkin.data.measurements import Measurements
from symkin.data.observables import COMMANDED
from symkin.data.reading import read_measurements
from symkin.errors import MeasurementError, SymkinError
from symkin.model.file_frames import from_drawing
from symkin.model.mechanism import Mechanism
from symkin.storage.tables import read_table

__all__ = ["Cells", "RowFormat"]

Array = NDArray[np.float64]
Cells = dict[str, str]
_READING = "psi_"


@dataclass(frozen=True)
class RowFormat:
    """The columns of a robot's rows when this is observed.

    Attributes
    ----------
    robot : Mechanism
    observed : Observed
        With its frames.
    """

    robot: Mechanism
    observed: Observed

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """What is measured of a row, SI."""
        return tuple(self._exact(self.robot.home))

    @cached_property
    def commanded(self) -> tuple[str, ...]:
        """Where the robot was sent."""
        return tuple(self.commanded_cells(self.robot.home))

    def commanded_cells(self, pose: Array) -> Cells:
        """A commanded pose as the table has it."""
        sent = Measurements.of(
            np.full_like(pose[None], np.nan),
            np.full((1, len(self.robot.legs)), np.nan),
            reading_unit=self.robot.reading_unit,
            pose_space=self.robot.pose_space,
            commanded=pose[None],
        )
        columns = sent.columns(self.robot)
        return {
            name: _cell(float(columns[name][0])) for name in columns if name.startswith(COMMANDED)
        }

    def cells(self, row: Mapping[str, float] | Measurements, pose: Array) -> Cells:
        """A row measured where the robot was sent to a pose, checked as a table of one row is.

        Raises
        ------
        SymkinError
            For columns that the session does not have, and values that cannot be.
        """
        given = row.columns(self.robot) if isinstance(row, Measurements) else self._whole(row, pose)
        measured = read_measurements(dict(given), self.robot)
        if len(measured.poses) != 1:
            raise SymkinError(f"{len(measured.poses)} rows were given; expected one")
        found = measured.columns(self.robot)
        strange = [*measured.unread, *(name for name in found if name not in self.columns)]
        if strange:
            raise SymkinError(
                f'"{strange[0]}" is not a column of this session; expected of '
                f"{', '.join(self.columns)}, in any units"
            )
        return {name: _cell(float(values[0])) for name, values in found.items()}

    def pose(self, cells: Cells) -> Array | None:
        """Where a line's robot was sent; without that where it was, if that is known in full."""
        names = (*self.commanded, *self.columns)
        table = read_table({name: np.array([cells[name] or None], dtype=object) for name in names})
        for prefix in (COMMANDED, ""):
            try:
                columns = own_pose_columns(table, self.robot.pose_space, prefix)
                pose = read_pose_values(table, columns).poses()
            except MeasurementError:
                continue
            return np.asarray((from_drawing(self.robot, pose) if prefix else pose)[0])
        return None

    def _whole(self, row: Mapping[str, float], pose: Array) -> dict[str, Array]:
        """A row with the readings that were commanded where it has none."""
        given = {name: np.array([value], dtype=float) for name, value in row.items()}
        known = {name.rpartition("_")[0] for name in given}
        more = {
            name: values
            for name, values in self._exact(pose).items()
            if name.startswith(_READING) and name.rpartition("_")[0] not in known
        }
        return given | more

    def _exact(self, pose: Array) -> dict[str, Array]:
        """The columns of a row that the robot as drawn has at a pose."""
        exact = Measurements.of(
            pose[None],
            self.robot.inverse_kinematics(pose[None]),
            reading_unit=self.robot.reading_unit,
            pose_space=self.robot.pose_space,
        )
        return dict(self.observed.exact(exact).columns(self.robot))


def _cell(value: float) -> str:
    return "" if math.isnan(value) else repr(value).removesuffix(".0")
