# SPDX-License-Identifier: MIT
"""``symkin kinematics``, ``export`` and ``import``: what controllers and simulators need."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.option_values import quantity_of
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, command
from symkin.drawing import as_drawn
from symkin.io.columns import own_columns, pose_column_names, reading_column_names
from symkin.io.output_files import OutputFiles
from symkin.io.plans import read_pose_list
from symkin.io.sensor_tables import read_all_readings, shown_readings
from symkin.io.tables import csv_text, read_table, write_table

_OUT_OF_REACH = 1
# Those of symkin.exports.FORMATS, which a test compares.
_To = Literal[
    "klipper",
    "marlin",
    "reprapfirmware",
    "linuxcnc",
    "mjcf",
    "urdf",
    "sdf",
    "json",
    "yaml",
    "c-header",
    "table",
]
_MECHANISM, _PROBED = "mechanism.toml", "probed.csv"


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
    with progress() as stage:
        stage("reading the mechanism and the table")
        robot = symkin.load_mechanism(mechanism)
        file = "poses.csv" if forward else "readings.csv"
        with OutputFiles([*robot.files, table], overwrite) as outputs:
            target = outputs.folder(out, file) if out else None
            if forward:
                read = read_table(table, robot.step)
                named = own_columns(read, robot.pose_space, len(robot.legs))
                readings = read_all_readings(read, named, robot, "a pose takes those of all")
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
        sys.stdout.write(csv_text(columns))
    else:
        say(str(out / file))
    if missed:
        typer.echo(f"out of reach: {missed} of {len(poses)} rows, left empty", err=True)
        raise typer.Exit(_OUT_OF_REACH)


@command(
    "symkin export out/calibrated.toml --to mjcf --out robot.xml",
    "symkin export linear_delta --to klipper --endstops '400 mm'",
    "symkin export out/calibrated.toml --to table --nominal 3RRR --out table.csv",
)
def export(
    mechanism: MechanismArgument,
    to: Annotated[_To, typer.Option(help="The format.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The file; by default stdout.")
    ] = None,
    endstops: Annotated[
        str | None,
        typer.Option(
            metavar="READING,...",
            help="What the sensors read at their endstops, one for all legs or one for each: "
            "'400 mm'. By default the joint limit. Of deltas, for firmware.",
        ),
    ] = None,
    nominal: Annotated[
        str | None,
        typer.Option(
            metavar="MECHANISM", help="What the controller computes with, for a correction table."
        ),
    ] = None,
    grid: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, max=1000, help="Poses of a table along each coordinate; 0: 21 or 5."
        ),
    ] = 0,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a mechanism for a controller or a simulator.

    klipper, marlin, reprapfirmware: deltas. linuxcnc: hexapods, linear deltas. mjcf, urdf, sdf:
    models with bodies and joints. json, yaml, c-header: the parameters. table: for controllers that
    know the nominal kinematics alone, which pose to command for each that is wanted.

    A robot that a format cannot express is refused, or written as near as can be; then the largest
    end-effector error that this makes in the workspace is printed. Notes and errors are on stderr
    if the text is on stdout.
    """
    with progress() as stage:
        stage("reading the mechanism")
        robot = symkin.load_mechanism(mechanism)
        drawn = symkin.load_mechanism(nominal) if nominal else None
        each = endstops.split(",") if endstops else ()
        unit = robot.reading_unit
        stops = [quantity_of(text, unit, "--endstops", is_reading=True) for text in each]
        stage("writing")
        made = symkin.export(
            robot, to, out, endstops=stops, nominal=drawn, grid=grid, overwrite=overwrite
        )
    lines = [f"{note}." for note in made.notes]
    if made.loss is not None:
        lines.append(f"End-effector errors with this file: {made.loss}.")
    if as_json:
        document = {"command": "export", "mechanism": robot.name, **made.to_dict()}
        print_json(document if out else {**document, "text": made.text})
    elif out is None:
        sys.stdout.write(made.text)
        for line in lines:
            typer.echo(line, err=True)
    else:
        for line in lines:
            say(line)
        say(str(out))


@command(
    "symkin import printer.cfg --out printer",
    "symkin identify printer/mechanism.toml printer/probed.csv --out calibrated",
)
def import_(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Klipper's printer.cfg of a linear delta, or an MJCF or URDF file of symkin.",
        ),
    ],
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for mechanism.toml and probed.csv.")
    ],
    overwrite: OverwriteOption = False,
) -> None:
    """Make a mechanism file of a printer's configuration, and a table of what it has probed.

    Of Klipper's printer.cfg, linear deltas with what SAVE_CONFIG wrote: towers, rods, endstops, and
    the heights that DELTA_CALIBRATE recorded. Models are read if symkin wrote them. Last printed
    are the files that were written.
    """
    from symkin.exports.reading import import_mechanism

    with OutputFiles([file], overwrite) as outputs:
        folder = outputs.folder(out, _MECHANISM, _PROBED)
        found = import_mechanism(file)
        header = f"Read from {file.name}"
        symkin.save_mechanism(found.mechanism, folder / _MECHANISM, header=header)
        if found.measurements is not None:
            symkin.write_measurements(found.measurements, folder / _PROBED, found.mechanism)
    for note in found.notes:
        say(f"{note}.")
    say(str(out / _MECHANISM))
    if found.measurements is not None:
        say(str(out / _PROBED))
