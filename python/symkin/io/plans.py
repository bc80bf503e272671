# SPDX-License-Identifier: MIT
"""Measurement plans and lists of poses as tables."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from symkin.drawing import as_drawn, from_drawing
from symkin.errors import MeasurementError
from symkin.io.columns import own_columns, pose_column_names, read_pose_values, reading_column_names
from symkin.io.output_files import OutputFiles
from symkin.io.sensor_tables import read_all_readings, shown_readings
from symkin.io.tables import TableSource, read_table, write_table
from symkin.planning import Plan

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

_ROLES = ("primary", "spare")


def write_plan(
    plan: Plan, path: str | os.PathLike[str], mechanism: Mechanism, *, overwrite: bool = False
) -> None:
    """Write a plan as CSV or Parquet, by extension; it reads back to the same numbers.

    A file that exists is replaced only with `overwrite`.

    Columns ``leg, order, role``, the pose (``x_m, y_m, phi_rad``, or spatially ``x_m, y_m, z_m, qx,
    qy, qz, qw``) and the reading of every leg (``psi_1_rad``, ...).
    """
    with OutputFiles(overwrite=overwrite) as outputs:
        write_table(outputs.file(Path(path)), plan_columns(plan, mechanism))


def plan_columns(plan: Plan, mechanism: Mechanism) -> dict[str, Any]:
    """Return the columns of a plan's table."""
    pose_names = pose_column_names(mechanism.pose_space)
    reading_names = reading_column_names(len(mechanism.legs), mechanism.reading_unit)
    readings = shown_readings(mechanism, plan.readings)
    beyond = np.argwhere(np.isnan(readings))
    if len(beyond):
        row, leg = beyond[0].tolist()
        raise MeasurementError(
            f"the plan has pose {plan.order[row]} where the table of the sensors has nothing that "
            f"leg {leg + 1} would show; set joint_limits within the table, or measure more of it"
        )
    return {
        "leg": plan.leg_sets + 1,
        "order": plan.order,
        "role": [_ROLES[int(spare)] for spare in plan.spare],
        **dict(zip(pose_names, as_drawn(mechanism, plan.poses).T, strict=True)),
        **dict(zip(reading_names, readings.T, strict=True)),
    }


def read_plan(source: TableSource, mechanism: Mechanism) -> Plan:
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
    table = read_table(source, mechanism.step)
    leg_count = len(mechanism.legs)
    for name, purpose in (
        ("leg", "the leg whose set the pose belongs to"),
        ("order", "the place in the set"),
        ("role", "primary or spare"),
    ):
        table.require(name, purpose)
    columns = own_columns(table, mechanism.pose_space, leg_count)
    readings = read_all_readings(table, columns, mechanism, "a plan commands every leg")
    spare = np.array([role == "spare" for role in table.words("role", _ROLES)])
    if spare.all():
        raise table.error("has spares only; expected primary poses that they stand in for")
    return Plan(
        mechanism=mechanism,
        leg_sets=table.whole_numbers("leg", 0, leg_count) - 1,
        order=table.whole_numbers("order", 1, table.row_count),
        spare=spare,
        poses=from_drawing(mechanism, read_pose_values(table, columns).poses()),
        readings=readings,
    )


def read_pose_list(source: TableSource, mechanism: Mechanism) -> NDArray[np.float64]:
    """Read poses from a table with pose columns as `write_plan` names them, any unit.

    Parameters
    ----------
    source : str, path, stream, DataFrame or dict of arrays
        As `read_measurements` takes it; further columns are not read.
    mechanism : Mechanism
        Its kind of platform says which columns there must be.

    Returns
    -------
    ndarray, shape (N, coordinates)
        m and rad (spatial: position and unit quaternion), in the mechanism's own frames. A table
        is in those of the mechanism's file, see `DrawnPoints`.

    Raises
    ------
    MeasurementError
        Naming the file, the row and the column.
    """
    table = read_table(source)
    columns = own_columns(table, mechanism.pose_space, len(mechanism.legs))
    return from_drawing(mechanism, read_pose_values(table, columns).poses())
