# SPDX-License-Identifier: MIT
"""``symkin kinematics``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import symkin
from symkin.cli.console import print_json, progress
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption
from symkin.io.output_files import OutputFiles

_OUT_OF_REACH = 1


@with_example(
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
    in a folder. Rows that the mechanism cannot take have empty cells for what was to be
    calculated; they are counted on stderr, and then the exit code is 1.
    """
    from symkin.io.poses import pose_and_reading_columns, read_pose_list, read_reading_list
    from symkin.io.tables import table_text, write_table

    with progress() as stage:
        stage("reading the mechanism and the table")
        robot = symkin.load_mechanism(mechanism)
        name = "poses.csv" if forward else "readings.csv"
        given = (read_reading_list if forward else read_pose_list)(table, robot)
        with OutputFiles([robot.source, table], overwrite) as outputs:
            target = outputs.folder(out, name) if out else None
            stage("calculating")
            if forward:
                found, _ = robot.forward_kinematics(given)
                columns = pose_and_reading_columns(robot, found, given)
            else:
                found = robot.inverse_kinematics(given)
                columns = pose_and_reading_columns(robot, given, found)
            if target:
                write_table(target / name, columns)
    missed = int(np.isnan(found).any(axis=1).sum())
    if as_json:
        document = {"command": "kinematics", "mechanism": robot.name, "forward": forward}
        print_json({**document, "rows": len(given), "out_of_reach": missed, **columns})
    elif out is None:
        sys.stdout.write(table_text(columns))
    else:
        sys.stdout.write(f"{out / name}\n")
    if missed:
        typer.echo(f"Out of reach: {missed} of {len(given)} rows, left empty", err=True)
        raise typer.Exit(_OUT_OF_REACH)
