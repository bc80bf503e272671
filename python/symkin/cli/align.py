# SPDX-License-Identifier: MIT
"""``symkin align``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from symkin.alignment import Convention
from symkin.cli.console import print_result, progress
from symkin.cli.option_values import columns_of
from symkin.cli.options import ColumnsOption, JsonOption, OverwriteOption, command


@command(
    "symkin run hexapod_jugglebot --out out",
    "symkin align out/measurements.csv --mechanism hexapod_jugglebot --out aligned",
)
def align(
    table: Annotated[
        Path,
        typer.Argument(metavar="TABLE", help="Poses of the device and of the robot, row by row."),
    ],
    mechanism: Annotated[
        str | None,
        typer.Option(
            metavar="MECHANISM",
            help="The robot: its poses are those that the table's reported_ columns hold, or else "
            "of its forward kinematics at the readings.",
        ),
    ] = None,
    columns: ColumnsOption = None,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMNS",
            help="Without a mechanism, columns of the device's poses with commas: x, y, then an "
            "angle; or x, y, z, then a quaternion (x, y, z, w), rotation vector or three angles.",
        ),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="COLUMNS", help="Likewise, of the robot's own poses.")
    ] = None,
    angles: Annotated[
        str | None,
        typer.Option(
            metavar="AXES",
            help="Three columns of the robot are angles about these axes: XYZ each about the axis "
            "as it has turned, xyz about fixed ones; by default a rotation vector.",
        ),
    ] = None,
    convention: Annotated[
        Convention | None,
        typer.Option(help="How the device's poses are meant; by default what fits best, and said."),
    ] = None,
    length: Annotated[
        float,
        typer.Option(
            metavar="M", min=1e-9, help="At which a rotation counts as much as a translation, m."
        ),
    ] = 1.0,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for frames.toml, results.json and report.html."),
    ] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find where a measuring device stands, and what it measures on the platform.

    The robot's geometry is trusted; identify finds frames and geometry together.
    """
    from symkin.alignment import align_frames, poses_of_columns, poses_of_mechanism
    from symkin.io.mechanism_file import load_mechanism
    from symkin.io.output_files import OutputFiles
    from symkin.io.tables import read_table

    if mechanism is None and not (device and robot):
        raise typer.BadParameter("expected --mechanism, or --device and --robot")
    if mechanism is not None and (device or robot or angles):
        raise typer.BadParameter("--device, --robot and --angles go without --mechanism")
    with progress() as stage, OutputFiles([table, columns], overwrite) as outputs:
        names = ("frames.toml", "results.json", "report.html")
        folder = outputs.folder(out, *names) if out else None
        stage("reading the poses")
        if mechanism is not None:
            mapping = columns_of(columns)
            model = load_mechanism(mechanism)
            measured, own = poses_of_mechanism(model, table, mapping)
        else:
            read = read_table(table)
            measured = poses_of_columns(read, (device or "").split(","))
            own = poses_of_columns(read, (robot or "").split(","), angles)
        stage("aligning the frames")
        space = model.pose_space if mechanism is not None else ""
        found = align_frames(measured, own, convention=convention, length=length, pose_space=space)
        if folder:
            (folder / names[0]).write_text(found.frames_text(), encoding="utf-8")
            found.save(folder / names[1])
            found.report(folder / names[2])
    print_result(found, as_json=as_json)
