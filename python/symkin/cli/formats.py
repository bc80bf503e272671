# SPDX-License-Identifier: MIT
"""``symkin export`` and ``symkin import``: formats of controllers and simulators."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.option_values import quantity_of
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, command
from symkin.io.output_files import OutputFiles

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
