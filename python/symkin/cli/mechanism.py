# SPDX-License-Identifier: MIT
"""``symkin new``, ``list``, ``check``, ``workspace``, ``kinematics``, ``export``, ``import``."""

from __future__ import annotations

import dataclasses
import itertools
import re
import sys
import textwrap
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

import symkin
from symkin.cli.console import (
    JsonOption,
    Telling,
    print_json,
    print_result,
    progress,
    say,
    write_result,
)
from symkin.cli.options import (
    MechanismArgument,
    angles_of,
    argument,
    command,
    folder_of,
    option,
    quantity_of,
    refuse_unless,
)
from symkin.data.columns import own_columns, pose_column_names, reading_column_names
from symkin.data.pose_tables import read_pose_list
from symkin.data.sensor_tables import read_all_readings, shown_readings
from symkin.exports.logs import import_log, log_format_of
from symkin.exports.reading import import_mechanism
from symkin.files.template import mechanism_template
from symkin.model.chains import legs_in_words
from symkin.model.devices import DEVICES
from symkin.model.file_frames import as_drawn
from symkin.options import Platform
from symkin.shell import typed_word
from symkin.show.devices import device_in_words
from symkin.show.rendering import filled
from symkin.storage.output_files import OutputFiles
from symkin.storage.shipped import shipped_folder
from symkin.storage.tables import csv_text, read_table, write_table


def _chains(incomplete: str) -> list[str]:
    return [name for name in symkin.chains() if name.startswith(incomplete)]


@command('symkin new --chain "[R]RR" --legs 3 > robot.toml')
def new(
    chain: Annotated[
        str,
        option(
            "CHAIN",
            'Joints of a leg from base to platform, the actuated one in brackets: "[R]RR". Or '
            'how many legs have which: "2 [R]RR + 1 [P]RP".',
            show_default=False,
            autocompletion=_chains,
        ),
    ],
    legs: Annotated[
        int | None, option("N", "By default as few as the platform needs.", min=1)
    ] = None,
    platform: Platform = "rigid",
) -> None:
    """Print a mechanism file to begin with, every key explained.

    It works with every command before you put your dimensions in place of its own.
    """
    sys.stdout.write(mechanism_template(chain, legs, platform))


@command("symkin list", "symkin list --devices")
def list_mechanisms(
    devices: Annotated[
        bool,
        typer.Option("--devices", help="List the measuring devices instead, with what each sets."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """List the mechanisms that come with symkin.

    Their names can stand for a file.
    """
    if devices:
        _list_devices(as_json)
        return
    rows: list[dict[str, Any]] = []
    for name in symkin.shipped_mechanisms():
        mechanism = symkin.load_mechanism(name)
        assert mechanism.source is not None
        rows.append(
            {
                "name": name,
                "chain": mechanism.chain,
                "legs": len(mechanism.leg_readings),
                "words": legs_in_words(mechanism.legs),
                "platform": mechanism.pose_space,
                "symmetry": mechanism.symmetry.group if mechanism.symmetry else None,
                "description": _first_sentence(mechanism.source),
                "file": mechanism.source,
            }
        )
    if as_json:
        print_json({"command": "list", "mechanisms": rows})
        return
    for row in rows:
        symmetry = f", {row['symmetry']}" if row["symmetry"] else ""
        say(f"{row['name']}: {row['words']}, {row['platform']}{symmetry}")
        for line in textwrap.wrap(row["description"], 94):
            say(f"    {line}")
    say(f"The files are in {shipped_folder()}.")


def _list_devices(as_json: bool) -> None:
    if as_json:
        found = [dataclasses.asdict(each) for each in DEVICES.values()]
        print_json({"command": "list", "devices": found})
        return
    for device in DEVICES.values():
        say(filled(f"{device.kind}: {device_in_words(device)}".replace("\N{NO-BREAK SPACE}", " ")))
        if device.source:
            for line in textwrap.wrap(f"Noise: {device.source}.", 94):
                say(f"    {line}")
    say("Say it in the mechanism's file, [device] kind, or by --device-kind; what the file says")
    say("itself goes before. Noise is typical: measure your device's, and put it into [noise].")


def _first_sentence(path: Path) -> str:
    """What the comment at the top of a file says first."""
    lines = path.read_text(encoding="utf-8").splitlines()[1:]
    comment = itertools.takewhile(lambda line: line.startswith("#"), lines)
    text = " ".join(line.lstrip("# ") for line in comment).strip()
    return re.split(r"(?<=\.) +(?=[A-Z])|  ", text)[0]


_CHECK_FILES = ("check.json", "check.html")
_WORKSPACE_FILES = ("workspace.json", "workspace.html")


@command("symkin check 3RRR", "symkin check 3RRR --out checked")
def check(
    *,
    mechanism: MechanismArgument,
    out: Annotated[Path | None, folder_of("check.html and check.json")] = None,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Say what a mechanism file means, and what poses can show.

    First whether the legs are alike, so that poses chosen for one serve all, or which leg and
    parameter differs; then whether poses can show every parameter, how many are needed, and the
    command that plans them.

    --verbose, --json and the page of --out have all of it: the groups of the symmetry, how near
    home is to singularities, how well poses show each parameter, and the paper's conditions on
    symmetry, each with its verdict, the figure behind it and what is allowed.

    With --out, the last line printed is the page's path. Legs that do not have the symmetry
    declared beside them are shown like any others, then refused; so is a workspace that cannot be
    sampled, such as one around a singular home, without what rests on its poses.
    """
    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism, require_symmetry=False)
        with OutputFiles(loaded.files, overwrite) as outputs:
            target = outputs.folder(out, *_CHECK_FILES) if out else None
            stage("sampling the workspace")
            result = symkin.check_mechanism(loaded, seed)
            document = {"command": "check", "settings": {"seed": seed}, **result.to_dict()}
            if target is not None:
                stage("writing the page")
                write_result(result, telling, document, target, "check")
    print_result(result, telling, out, _CHECK_FILES, document)
    symkin.load_mechanism(mechanism)  # tells in one sentence if the declared symmetry is absent
    if result.unusable is not None:
        raise symkin.SymkinError(result.unusable)


@command("symkin workspace 3RRR --out out --both-modes")
def workspace(
    *,
    mechanism: MechanismArgument,
    out: Annotated[Path | None, folder_of("workspace.html and workspace.json")] = None,
    orientations: Annotated[
        str | None,
        option(
            "ANGLE,ANGLE,...",
            "Of the constant-orientation workspaces, such as 0,0.4 or 0,20deg; by default "
            "home's, and 0.4 and 0.6 rad from there.",
        ),
    ] = None,
    count: int = 100_000,
    resolution: int = 201,
    both_modes: bool = False,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Draw a workspace and test its symmetry.

    The workspace theorem (a pose is in the workspace exactly if its image is) and the active-joint
    conjecture (the readings at the image are the image of the readings) are tested on poses of the
    workspace box, for every element of the symmetry found. An element that does not keep the
    working modes is tested between the workspaces of the two modes.

    With --out, writes workspace.html and workspace.json, and the last line printed is the page's
    path.
    """
    orientation_list = None if orientations is None else angles_of(orientations, "--orientations")
    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        with OutputFiles(loaded.files, overwrite) as outputs:
            target = outputs.folder(out, *_WORKSPACE_FILES) if out else None
            stage("studying the workspace")
            study = symkin.study_workspace(
                loaded, orientation_list, count, seed, resolution, both_modes
            )
            settings = {"count": count, "resolution": resolution, "seed": seed}
            document = {"command": "workspace", "settings": settings, **study.to_dict()}
            if target is not None:
                stage("writing the page")
                write_result(study, telling, document, target, "workspace")
    print_result(study, telling, out, _WORKSPACE_FILES, document)


_OUT_OF_REACH = 1
# Those of symkin.exports.FORMATS, which a test compares.
_To = Literal[
    "klipper", "marlin", "reprapfirmware", "linuxcnc", "mjcf", "urdf", "sdf", "json", "yaml",
    "c-header", "table",
]  # fmt: skip
_MECHANISM, _MEASURED = "mechanism.toml", "measurements.csv"
_PROBED = "probed.csv"


@command(
    "symkin run 3RRR --out out",
    "symkin kinematics out/calibrated.toml out/plan.csv --out out",
    "symkin kinematics out/calibrated.toml out/readings.csv --forward > taken.csv",
)
def kinematics(
    mechanism: MechanismArgument,
    table: Annotated[
        Path,
        argument("FILE", "Poses (x_m, y_m, phi_rad, ...), or readings (psi_1_rad, ...)."),
    ],
    forward: Annotated[
        bool,
        typer.Option(
            "--forward", help="From readings to poses, in the aspect of home; else the reverse."
        ),
    ] = False,
    out: Annotated[Path | None, folder_of("readings.csv, or poses.csv with --forward")] = None,
    overwrite: bool = False,
    as_json: JsonOption = False,
) -> None:
    """Calculate readings at poses, or poses at readings.

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
                named = own_columns(read, robot.pose_space, robot.reading_count)
                readings = read_all_readings(read, named, robot, "a pose takes those of all")
                stage("calculating")
                poses, _ = robot.forward_kinematics(readings)
            else:
                poses = read_pose_list(table, robot)
                stage("calculating")
                readings = robot.inverse_kinematics(poses)
            names = pose_column_names(robot.pose_space)
            names += reading_column_names(robot.reading_count, robot.reading_unit)
            shown = shown_readings(robot, readings)[:, robot.is_read]
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
    out: Annotated[Path | None, option("FILE", "The file; by default stdout.")] = None,
    endstops: Annotated[
        str | None,
        option(
            "READING,...",
            "What the sensors read at their endstops, one for all legs or one for each: '400 "
            "mm'. By default the joint limit. Of deltas, for firmware.",
        ),
    ] = None,
    nominal: Annotated[
        str | None,
        option("MECHANISM", "What the controller computes with, for a correction table."),
    ] = None,
    grid: int = 0,
    overwrite: bool = False,
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
    "symkin import g33.log --radius 80mm --out marlin",
    "symkin import take.csv encoders.csv --mechanism robot.toml --out rests",
)
def import_(
    file: Annotated[
        Path,
        argument(
            "FILE",
            "Klipper's printer.cfg of a delta, a model in MJCF, URDF or SDF, or a log: of "
            "Marlin, RepRapFirmware, Motive, Vicon, ROS, Maslow, JSON, Excel, or a tracker's "
            "list of points.",
        ),
    ],
    out: Annotated[Path, folder_of("mechanism.toml, and probed.csv or measurements.csv")],
    beside: Annotated[
        Path | None,
        argument(
            "BESIDE",
            "Beside motion capture: what the encoders showed, with times. Beside points: "
            "a row a pose. Beside a model: a TOML file of its loops.",
        ),
    ] = None,
    mechanism: Annotated[
        str | None, option("ROBOT", "The robot that was logged: a file or a shipped name.")
    ] = None,
    radius: Annotated[
        str | None, option("LENGTH", "How far from the middle Marlin's G33 probed.")
    ] = None,
    body: Annotated[
        str | None,
        option(
            "NAME",
            "The body that is the platform's: of motion capture by default the first, of a model "
            "the one called platform.",
        ),
    ] = None,
    overwrite: bool = False,
) -> None:
    """Make tables, and a mechanism file where there is one, of what others have recorded.

    Of Klipper's printer.cfg, linear and rotary deltas with what SAVE_CONFIG wrote: towers, rods,
    endstops, and the heights that DELTA_CALIBRATE recorded; distances that DELTA_ANALYZE was told
    stand behind them, as rows in pairs. Legs of a model are declared joint by joint, unless they
    are known chains that symkin wrote. Logs
    are known by what they hold, and become measurements.csv; what was taken of them and what was
    left is said. Last printed are the files that were written.
    """
    known = log_format_of(file)
    if known is None:
        for name, value in (("--mechanism", mechanism), ("--radius", radius)):
            refuse_unless(value is None, f"{name} goes with a log; {file} is none that is known")
        _import_mechanism(file, out, beside, body or "", overwrite=overwrite)
        return
    with OutputFiles([file, *([beside] if beside else [])], overwrite) as outputs:
        # A robot that is given is often beside the table, and stays.
        names = (_MEASURED,) if mechanism is not None else (_MECHANISM, _MEASURED)
        folder = outputs.folder(out, *names)
        robot = None if mechanism is None else symkin.load_mechanism(mechanism)
        found = import_log(
            file,
            beside,
            mechanism=robot,
            radius=None if radius is None else quantity_of(radius, "m", "--radius"),
            body=body or "",
        )
        written = []
        if found.mechanism is not None:
            refuse_unless(mechanism is None, f"--mechanism goes with a log of measurements alone; "
                          f"{file} says the robot's geometry itself")  # fmt: skip
            header = f"Read from {file.name}"
            symkin.save_mechanism(found.mechanism, folder / _MECHANISM, header=header)
            written.append(_MECHANISM)
        if found.columns:
            write_table(folder / _MEASURED, found.columns)
            written.append(_MEASURED)
    say(f"{file.name} is {found.kind}.")
    for title, words in (("Took", found.took), ("Left", found.left)):
        for each in words:
            say(filled(f"{title} {each}."))
    if found.columns:
        of = typed_word(out / _MECHANISM if found.mechanism else mechanism or "MECHANISM")
        table, calibrated = (typed_word(out / name) for name in (_MEASURED, "calibrated"))
        say(f"\nNext: symkin identify {of} {table} --out {calibrated}\n")
    for name in written:
        say(str(out / name))


def _import_mechanism(
    file: Path, out: Path, loops: Path | None, body: str, *, overwrite: bool
) -> None:
    """Import what is no log: a printer's configuration, or a model."""
    with OutputFiles([file, *([loops] if loops else [])], overwrite) as outputs:
        folder = outputs.folder(out, _MECHANISM, _PROBED)
        found = import_mechanism(file, loops, body=body)
        header = f"Read from {file.name}"
        symkin.save_mechanism(found.mechanism, folder / _MECHANISM, header=header)
        if found.measurements is not None:
            symkin.write_measurements(found.measurements, folder / _PROBED, found.mechanism)
    for note in found.notes:
        say(filled(f"{note}."))
    written = [_MECHANISM]
    if found.measurements is not None:
        written.append(_PROBED)
        files = [typed_word(out / name) for name in written]
        calibrated = typed_word(out / "calibrated")
        say(f"\nNext: symkin identify {' '.join(files)} --out {calibrated}\n")
    for name in written:
        say(str(out / name))
