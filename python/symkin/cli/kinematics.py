# SPDX-License-Identifier: MIT
"""``symkin kinematics``."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from numpy.typing import NDArray

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, command
from symkin.io.output_files import OutputFiles

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism

_OUT_OF_REACH = 1


@command(
    "symkin run 3RRR --out out",
    "symkin kinematics out/calibrated.toml out/plan.csv --out out",
    "symkin kinematics out/calibrated.toml out/readings.csv --forward > taken.csv",
)
def kinematics(
    mechanism: MechanismArgument,
    table: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Poses (x_m, y_m, phi_rad, ...), or readings (psi_1_rad, ...)."
        ),
    ],
    forward: Annotated[
        bool,
        typer.Option(
            "--forward", help="From readings to poses, in the aspect of home; else the reverse."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for readings.csv, or poses.csv with --forward."),
    ] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Calculate the sensor readings at poses, or the poses at sensor readings.

    The columns are named as in symkin's other files, in any unit; others are not read. What comes
    out is a table with the poses first, then the readings, in the order of the rows: on stdout, or
    in a folder. In rows that the mechanism cannot take, the cells of what was to be calculated are
    empty; such rows are counted on stderr, and then the exit code is 1.
    """
    from symkin.drawing import as_drawn
    from symkin.io.columns import pose_column_names, reading_column_names
    from symkin.io.plans import read_pose_list
    from symkin.io.sensor_tables import shown_readings
    from symkin.io.tables import write_table

    with progress() as stage:
        stage("reading the mechanism and the table")
        robot = symkin.load_mechanism(mechanism)
        file = "poses.csv" if forward else "readings.csv"
        with OutputFiles([robot.source, table], overwrite) as outputs:
            target = outputs.folder(out, file) if out else None
            if forward:
                readings = _readings(table, robot)
                stage("calculating")
                poses, _ = robot.forward_kinematics(readings)
            else:
                poses = read_pose_list(table, robot)
                stage("calculating")
                readings = robot.inverse_kinematics(poses)
            names = pose_column_names(robot.pose_space)
            names += reading_column_names(len(robot.legs), robot.reading_unit)
            shown = shown_readings(robot, readings)
            columns = dict(zip(names, [*as_drawn(robot, poses).T, *shown.T], strict=True))
            if target:
                write_table(target / file, columns)
    missed = int(np.isnan(poses if forward else shown).any(axis=1).sum())
    if as_json:
        document = {"command": "kinematics", "mechanism": robot.name, "forward": forward}
        print_json({**document, "rows": len(poses), "out_of_reach": missed, **columns})
    elif out is None:
        _print(columns)
    else:
        say(str(out / file))
    if missed:
        typer.echo(f"out of reach: {missed} of {len(poses)} rows, left empty", err=True)
        raise typer.Exit(_OUT_OF_REACH)


def _readings(path: Path, mechanism: Mechanism) -> NDArray[np.float64]:
    """Readings of all legs, columns named as symkin names them."""
    from symkin.io.columns import own_columns
    from symkin.io.sensor_tables import read_straight_readings
    from symkin.io.tables import read_table

    table = read_table(path, mechanism.step)
    columns = own_columns(table, mechanism.pose_space, len(mechanism.legs))
    readings, _ = read_straight_readings(table, columns, mechanism)
    missing = np.argwhere(np.isnan(readings))
    if len(missing):
        row, leg = missing[0].tolist()
        raise table.row_error(row, f"has no reading of leg {leg + 1}; a pose takes those of all")
    return readings


def _print(columns: Mapping[str, NDArray[np.float64]]) -> None:
    """Print numbers as CSV, as a file has them."""
    sys.stdout.write(",".join(columns) + "\n")
    for row in zip(*(values.tolist() for values in columns.values()), strict=True):
        cells = ("" if math.isnan(value) else repr(value) for value in row)
        sys.stdout.write(",".join(cells) + "\n")
