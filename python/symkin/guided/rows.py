# SPDX-License-Identifier: MIT
"""A row of a session: which columns it has, and how it and a commanded pose are written."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from symkin.analysis.observed import Observed
from symkin.data.columns import own_pose_columns, read_pose_values
from symkin.data.measurements import Measurements
from symkin.data.observables import COMMANDED, PAIR
from symkin.data.reading import read_measurements
from symkin.data.tries import LINK, ROW
from symkin.errors import MeasurementError, SymkinError
from symkin.model.file_frames import from_drawing
from symkin.model.mechanism import Mechanism
from symkin.storage.tables import read_table
from symkin.values import Array, record

Cells = dict[str, str]
_READING = "psi_"


@record
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
        return tuple(name for name in self._exact(self.robot.home) if name not in (ROW, LINK))

    @property
    def links(self) -> tuple[str, ...]:
        """Where a row says which one it is measured with."""
        return (LINK,) if self.observed.together > 1 else ()

    def columns_of(self, partner: int | None) -> tuple[str, ...]:
        """Those of a row that is measured with another one, or is the first of both."""
        if partner is not None:
            return self.columns
        return tuple(name for name in self.columns if not name.startswith(PAIR))

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

    def cells(
        self, row: Mapping[str, float] | Measurements, pose: Array, partner: int | None = None
    ) -> Cells:
        """A row measured where the robot was sent to a pose, checked as a table of one row is.

        Or as one of two, if it is measured with a `partner`, whose number it has then.

        Raises
        ------
        SymkinError
            For columns that the session does not have, and values that cannot be.
        """
        given = row.columns(self.robot) if isinstance(row, Measurements) else self._whole(row, pose)
        if any(len(values) != 1 for values in given.values()):
            raise SymkinError("several rows were given; expected one")
        own = self.columns_of(partner)
        early = [name for name in given if name.startswith(PAIR) and partner is None]
        if early:
            raise SymkinError(
                f'"{early[0]}" is not a column of such a row, the first of two between which that '
                f"is measured; expected of {', '.join(own)}, in any units"
            )
        if self.links:  # as the second of two rows
            given = {
                name: np.append(values if name.startswith(_READING) else np.nan, values)
                for name, values in given.items()
            }
            given |= {ROW: np.array([1.0, 2.0]), LINK: np.array([np.nan, 1.0])}
            if partner is None:  # what will be measured, whatever it will be
                given |= {name: np.array([np.nan, 0.0]) for name in self.columns if name not in own}
        try:
            measured = read_measurements(dict(given), self.robot)
        except MeasurementError as error:  # it was read as a table of one row
            raise SymkinError(str(error).replace("the table: ", "the row: ", 1)) from None
        found = measured.columns(self.robot)
        known = (*self.columns, ROW, LINK)
        strange = [*measured.unread, *(name for name in found if name not in known)]
        if strange:
            raise SymkinError(
                f'"{strange[0]}" is not a column of this session; expected of '
                f"{', '.join(own)}, in any units"
            )
        cells = {name: _cell(float(found[name][-1])) for name in own if name in found}
        return cells if partner is None else cells | {LINK: str(partner)}

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
