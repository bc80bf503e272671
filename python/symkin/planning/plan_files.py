# SPDX-License-Identifier: MIT
"""Measurement plans and lists of poses as tables."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from symkin.data.columns import own_columns, read_pose_values
from symkin.data.reading import require_table
from symkin.data.sensor_tables import read_all_readings
from symkin.errors import MeasurementError
from symkin.model.file_frames import from_drawing
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.options import checks
from symkin.planning.plan import ROLES, Plan
from symkin.storage.tables import TableSource, read_table, write_table


@checks()
def read_plan(source: TableSource, mechanism: MechanismGiven) -> Plan:
    """Read a plan.

    Parameters
    ----------
    source : str, path, stream, DataFrame or dict of arrays
        As `read_measurements` takes it.
    mechanism : Mechanism
        That it is for.

    Returns
    -------
    Plan

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column: a missing column, a cell that is no number, a leg
        that the mechanism does not have, an unknown role; or that the plan has spares only.
    """
    mechanism = as_mechanism(mechanism)
    table = read_table(source, mechanism.step)
    leg_count = len(mechanism.legs)
    for name, purpose in (
        ("leg", "the leg whose set the pose belongs to"),
        ("order", "the place in the set"),
        ("role", "primary or spare"),
    ):
        table.require(name, purpose)
    columns = own_columns(table, mechanism.pose_space, mechanism.reading_count)
    readings = read_all_readings(table, columns, mechanism, "a plan commands every leg")
    spare = np.array([role == "spare" for role in table.words("role", ROLES)])
    if spare.all():
        raise table.error("has spares only; expected primary poses that they stand in for")
    return Plan(
        mechanism=mechanism,
        leg_sets=table.legs("leg", 0, leg_count) - 1,
        order=table.whole_numbers("order", 1, table.row_count),
        spare=spare,
        poses=from_drawing(mechanism, read_pose_values(table, columns).poses()),
        readings=readings,
    )


def as_plan(plan: Plan | TableSource, mechanism: Mechanism) -> Plan:
    """Return a plan, read if it is what `read_plan` reads.

    Raises
    ------
    MeasurementError
        For anything else, and for a plan of other legs.
    """
    if not isinstance(plan, Plan):
        plan = read_plan(require_table(plan, "plan", "a Plan"), mechanism)
    own = plan.mechanism
    if len(own.legs) != len(mechanism.legs) or own.pose_space != mechanism.pose_space:
        raise MeasurementError(
            f'the plan is of {len(own.legs)} legs and {own.pose_space} poses; "{mechanism.name}" '
            f"has {len(mechanism.legs)} and {mechanism.pose_space} ones"
        )
    return plan


def write_bed_points(plan: Plan, path: str | os.PathLike[str]) -> None:
    """Write where to probe, in the order of the plan, without spares: ``x_mm,y_mm``."""
    points = np.round(1e3 * plan.poses[~plan.spare, :2], 2)
    write_table(Path(path), {"x_mm": points[:, 0], "y_mm": points[:, 1]})


def klipper_points(plan: Plan) -> str:
    """Return where to probe as the option ``points`` of a section of Klipper's printer.cfg, mm."""
    points = np.round(1e3 * plan.poses[~plan.spare, :2], 2) + 0.0  # no negative zero
    return "\n".join(["points:", *(f"  {x:g}, {y:g}" for x, y in points.tolist())]) + "\n"
