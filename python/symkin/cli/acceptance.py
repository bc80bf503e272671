# SPDX-License-Identifier: MIT
"""``symkin evaluate``, ``accept`` and ``compare``: how good a robot is, and what has moved."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.acceptance import ABOUT, Acceptance
from symkin.acceptance.calibration import calibrated_of, rows_seen
from symkin.cli.console import Telling, print_result, progress, write_result
from symkin.cli.options import (
    ColumnsOption,
    accuracies_of,
    argument,
    columns_of,
    command,
    folder_of,
    option,
    refuse_unless,
    several_of,
    share_of,
)
from symkin.model.mechanism import require_same_shape
from symkin.options import Coordinates, Judge
from symkin.robot import load_mechanism
from symkin.show.wording import plural
from symkin.storage.output_files import OutputFiles

_EVALUATION = ("evaluation.json", "evaluation.html")
_COMPARISON = ("comparison.json", "comparison.html")


@command(
    "symkin run 3RRR --out out",
    "symkin evaluate 3RRR --actual out/actual.toml",
    "symkin evaluate out/calibrated.toml --actual out/actual.toml",
    "symkin evaluate out/calibrated.toml --measurements out/measurements.csv",
)
def evaluate(
    *,
    model: Annotated[
        str,
        argument("MODEL", "The mechanism file that a controller would use, or a shipped name."),
    ],
    actual: Annotated[
        str | None, option("FILE", "The simulated robot, of `symkin simulate`.")
    ] = None,
    plan: Annotated[Path | None, option("FILE", "A plan whose poses are commanded.")] = None,
    candidates: int | None = None,
    measurements: Annotated[Path | None, option("FILE", "Measured poses and readings.")] = None,
    columns: ColumnsOption = None,
    ignore: list[str] | None = None,
    robot: str | None = None,
    confidence: str = "0.95",
    out: Annotated[Path | None, folder_of("evaluation.json and evaluation.html")] = None,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Say how far the end effector is from where it should be.

    Against a simulated robot: the poses that it takes, less those commanded through the model, over
    the poses of a plan or else over the robot's workspace. Against measurements: the model's poses
    at the measured readings, less the measured poses. "Aligned" is what remains after the best
    constant motions of base and tool, which say nothing of the mechanism.
    The closures are how far each leg is from reaching the measured poses at the measured readings.
    """
    given = {"actual": actual, "plan": plan, "candidates": candidates}
    given |= {"measurements": measurements, "columns": columns}
    _require_one_robot(**given)
    share = share_of(confidence, "confidence")
    refuse_unless(
        ignore is None or measurements is not None, "--ignore goes with --measurements alone"
    )
    refuse_unless(
        robot is None or measurements is not None, "--robot goes with --measurements alone"
    )
    refuse_unless(
        seed is None or (measurements is None and plan is None),
        "--seed draws the poses that are evaluated; it goes without --measurements and --plan",
    )
    with progress() as stage:
        stage("reading the model")
        loaded = load_mechanism(model)
        real = load_mechanism(actual) if actual is not None else None
        inputs = [*loaded.files, *(real.files if real else ()), plan, measurements, columns]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.folder(out, *_EVALUATION) if out else None
            stage("evaluating")
            if measurements is not None:
                measured = symkin.read_measurements(
                    measurements, loaded, columns_of(columns), ignore=ignore or (), robot=robot
                )
                result = symkin.evaluate(loaded, measurements=measured, confidence=share)
                result = replace(result, notes=(*result.notes, *_seen(model, measured)))
            elif real is not None:
                require_same_shape(real, loaded)  # before its workspace is sampled
                if plan is None:
                    poses = symkin.sample_workspace(real, candidates, seed).poses
                else:
                    commanded = symkin.read_plan(plan, loaded)
                    poses = commanded.poses[~commanded.spare]
                result = symkin.evaluate(loaded, actual=real, poses=poses, confidence=share)
            document = {
                "command": "evaluate",
                "mechanism": loaded.name,
                "settings": {**given, "seed": seed},
                "evaluation": result.to_dict(),
            }
            if target:
                write_result(result, telling, document, target, "evaluation")
    print_result(result, telling, out, _EVALUATION, document)


def _seen(model: str, measured: symkin.Measurements) -> Iterator[str]:
    """What to know where a calibration is held against rows that it was fitted to."""
    found, _, _ = calibrated_of(model)
    again = 0 if found is None else int(rows_seen(found, measured).rows.sum())
    if again:
        yield (
            f"{again} of {plural(len(measured.poses), 'row')} are those that the calibration "
            "was fitted to, at which it looks better than elsewhere; measure others, and ask "
            "symkin accept"
        )


def _require_one_robot(
    *, actual: object, plan: object, candidates: object, measurements: object, columns: object
) -> None:
    """Refuse options that do not go together."""
    if (actual is None) == (measurements is None):
        raise typer.BadParameter("give either --actual or --measurements")
    if measurements is not None and (plan is not None or candidates is not None):
        raise typer.BadParameter("--plan and --candidates go with --actual alone")
    if plan is not None and candidates is not None:
        raise typer.BadParameter("give --plan or --candidates, not both")
    if columns is not None and measurements is None:
        raise typer.BadParameter("--columns goes with --measurements alone")


@command(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --actual out/actual.toml --seed 2 --out later",
    "symkin accept out later/measurements.csv --tolerance 0.1mm --out certificate",
)
def accept(
    *,
    calibrated: Annotated[
        str,
        argument("CALIBRATED", "The folder that `symkin identify` wrote, or its calibrated.toml."),
    ],
    table: Annotated[
        Path,
        argument("TABLE", "Measurements that the calibration has not seen."),
    ],
    tolerance: Annotated[
        list[str] | None,
        option(
            "ERROR",
            "What the error must not exceed, such as 0.05mm of the position, 0.1mrad of the "
            "orientation. May be given for both.",
        ),
    ] = None,
    judge: Judge = "rms",
    uncertainty: Annotated[
        list[str] | None,
        option(
            "ERROR",
            "Standard uncertainty of a coordinate that the device measures, such as 10um; by "
            "default what the table or the noise of the calibration says.",
        ),
    ] = None,
    frames: list[str] | None = None,
    of: Coordinates | None = None,
    about: Annotated[
        list[str] | None,
        option(
            "FIELD=TEXT",
            f"What else the certificate states: {', '.join(ABOUT)}. May be given several times.",
        ),
    ] = None,
    columns: ColumnsOption = None,
    ignore: list[str] | None = None,
    robot: str | None = None,
    out: Annotated[Path | None, folder_of("acceptance.json and certificate.html")] = None,
    overwrite: bool = False,
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
                table, model, columns_of(columns), ignore=ignore or (), robot=robot
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
                of=of,
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
        argument("FIRST", "The folder of a calibration."),
    ],
    second: Annotated[
        Path,
        argument("SECOND", "That of another."),
    ],
    out: Annotated[Path | None, folder_of("comparison.json and comparison.html")] = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Say what moved between two calibrations of one robot.

    Both rest on the same drawing, which is taken into account where priors hold parameters. How far
    the end-effector moved is said over the workspace, without what a device that was set up anew
    explains.
    """
    with progress() as stage, OutputFiles([first, second], overwrite) as outputs:
        target = outputs.folder(out, *_COMPARISON) if out else None
        stage("reading the calibrations")
        pair = [symkin.read_estimate(each) for each in (first, second)]
        stage("comparing")
        result = symkin.compare(*pair)
        document = {"command": "compare", **result.to_dict()}
        if target:
            write_result(result, telling, document, target, "comparison")
    print_result(result, telling, out, _COMPARISON, document)
