# SPDX-License-Identifier: MIT
"""``symkin accept`` and ``compare``: whether a robot keeps its tolerance, and what has moved."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.acceptance import ABOUT, Acceptance
from symkin.cli.console import Telling, print_result, progress, write_result
from symkin.cli.options import (
    ColumnsOption,
    IgnoreOption,
    OverwriteOption,
    accuracies_of,
    columns_of,
    command,
    folder_of,
    of,
    option,
    several_of,
)
from symkin.options import Judge
from symkin.robot import load_mechanism
from symkin.storage.output_files import OutputFiles

_FILES = ("comparison.json", "comparison.html")


@command(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --actual out/actual.toml --seed 2 --out later",
    "symkin accept out later/measurements.csv --tolerance 0.1mm --out certificate",
)
def accept(
    *,
    calibrated: Annotated[
        str,
        typer.Argument(
            metavar="CALIBRATED",
            help="The folder that `symkin identify` wrote, or its calibrated.toml.",
            show_default=False,
        ),
    ],
    table: Annotated[
        Path,
        typer.Argument(
            metavar="TABLE",
            help="Measurements that the calibration has not seen.",
            show_default=False,
        ),
    ],
    tolerance: Annotated[
        list[str] | None,
        option(
            "ERROR",
            "What the error must not exceed, such as 0.05mm of the position, 0.1mrad of the "
            "orientation. May be given for both.",
        ),
    ] = None,
    judge: Annotated[Judge, of("judge")] = "rms",
    uncertainty: Annotated[
        list[str] | None,
        option(
            "ERROR",
            "Standard uncertainty of a coordinate that the device measures, such as 10um; by "
            "default what the table or the noise of the calibration says.",
        ),
    ] = None,
    frames: Annotated[list[str] | None, of("frames")] = None,
    about: Annotated[
        list[str] | None,
        option(
            "FIELD=TEXT",
            f"What else the certificate states: {', '.join(ABOUT)}. May be given several times.",
        ),
    ] = None,
    columns: ColumnsOption = None,
    ignore: IgnoreOption = None,
    out: Annotated[Path | None, folder_of("acceptance.json and certificate.html")] = None,
    overwrite: OverwriteOption = False,
    telling: Telling,
) -> None:
    """Judge whether a calibrated robot keeps a tolerance.

    By measurements that the calibration has not seen; its own rows are refused. The commanded pose
    is the calibrated model's at the readings. Rows that are nearer to each other than the tolerance
    are visits of one pose. Pass or fail is said where the device's uncertainty allows it, with 95%
    confidence, and undecided otherwise. With --frames base the device was set up anew, and its
    frame is fitted to the table.

    Exit code: 0 for pass; 1 for fail and undecided.
    """
    wanted = accuracies_of(tolerance, "--tolerance")
    known = accuracies_of(uncertainty, "--uncertainty")
    stated = dict(_field(each) for each in about or ())
    with progress() as stage:
        stage("reading the calibration and the measurements")
        path = Path(calibrated)
        is_folder = path.is_dir() or path.suffix == ".json"
        found = symkin.read_estimate(calibrated) if is_folder else None
        model = found.mechanism if found is not None else load_mechanism(calibrated)
        inputs = [*model.files, table, columns, path if path.suffix == ".json" else None]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.folder(out, *Acceptance.FILES) if out else None
            measured = symkin.read_measurements(
                table, model, columns_of(columns), ignore=ignore or ()
            )
            stage("testing")
            result = symkin.accept(
                calibrated,
                measured,
                *wanted,
                judge=judge,
                uncertainty=known[0],
                orientation_uncertainty=known[1],
                frames=several_of(frames),  # type: ignore[arg-type]  # which it checks
                about=stated,
            )
            if target:
                stage("writing the certificate")
                result.write_files(target, report=telling.report)
    print_result(result, telling, out, Acceptance.FILES)
    if result.verdict != "pass":
        raise typer.Exit(1)


def _field(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise typer.BadParameter(
            f'"{text}" has no "="; expected such as serial=A12', param_hint="--about"
        )
    return name.strip(), value.strip()


@command(
    "symkin run 3RRR --seed 1 --out monday",
    "symkin simulate 3RRR --plan monday/plan.csv --actual monday/actual.toml --seed 2 --out later",
    "symkin identify 3RRR later/measurements.csv --out friday",
    "symkin compare monday friday",
)
def compare(
    *,
    first: Annotated[
        Path,
        typer.Argument(metavar="FIRST", help="The folder of a calibration.", show_default=False),
    ],
    second: Annotated[
        Path,
        typer.Argument(metavar="SECOND", help="That of another.", show_default=False),
    ],
    out: Annotated[Path | None, folder_of("comparison.json and comparison.html")] = None,
    overwrite: OverwriteOption = False,
    telling: Telling,
) -> None:
    """Say what moved between two calibrations of one robot.

    Both rest on the same drawing, which is taken into account where priors hold parameters. How far
    the end-effector moved is said over the workspace, without what a device that was set up anew
    explains.
    """
    with progress() as stage, OutputFiles([first, second], overwrite) as outputs:
        target = outputs.folder(out, *_FILES) if out else None
        stage("reading the calibrations")
        pair = [symkin.read_estimate(each) for each in (first, second)]
        stage("comparing")
        result = symkin.compare(*pair)
        document = {"command": "compare", **result.to_dict()}
        if target:
            write_result(result, telling, document, target, "comparison")
    print_result(result, telling, out, _FILES, document)
