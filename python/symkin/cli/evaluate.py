# SPDX-License-Identifier: MIT
"""``symkin evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import symkin
from symkin.cli.console import print_result, progress, write_result
from symkin.cli.option_values import columns_of
from symkin.cli.options import (
    CandidatesOption,
    ColumnsOption,
    JsonOption,
    OverwriteOption,
    SeedOption,
    command,
)
from symkin.io.output_files import OutputFiles
from symkin.mechanism import require_same_shape

if TYPE_CHECKING:
    from symkin.evaluation import Evaluation
    from symkin.mechanism import Mechanism

_FILES = ("evaluation.json", "evaluation.html")


@command(
    "symkin run 3RRR --out out",
    "symkin evaluate 3RRR --actual out/actual.toml",
    "symkin evaluate out/calibrated.toml --actual out/actual.toml",
    "symkin evaluate out/calibrated.toml --measurements out/measurements.csv",
)
def evaluate(
    model: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="The mechanism file that a controller would use, or a shipped name.",
            show_default=False,
        ),
    ],
    actual: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="The simulated robot, of `symkin simulate`."),
    ] = None,
    plan: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A plan whose poses are commanded."),
    ] = None,
    candidates: CandidatesOption = None,
    measurements: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measured poses and readings.")
    ] = None,
    columns: ColumnsOption = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for evaluation.json and evaluation.html."),
    ] = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say how far the end-effector is from where the model puts it.

    Against a simulated robot: the poses that it takes, less those commanded through the model, over
    the poses of a plan or else over the robot's workspace. Against measurements: the model's poses
    at the measured readings, less the measured poses. "Aligned" is what remains after the best
    constant motions of base and tool, which say nothing of the mechanism.
    The closures are how far each leg is from reaching the measured poses at the measured readings.
    """
    given = {"actual": actual, "plan": plan, "candidates": candidates}
    given |= {"measurements": measurements, "columns": columns}
    _require_one_robot(given)
    with progress() as stage:
        stage("reading the model")
        loaded = symkin.load_mechanism(model)
        robot = symkin.load_mechanism(actual) if actual is not None else None
        inputs = [loaded.source, robot.source if robot else None, plan, measurements, columns]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.folder(out, *_FILES) if out else None
            stage("evaluating")
            if robot is None:
                result = _against_measurements(loaded, measurements, columns)
            else:
                result = _against_robot(loaded, robot, plan, candidates, seed)
            document = {
                "command": "evaluate",
                "mechanism": loaded.name,
                "settings": {**given, "seed": seed},
                "evaluation": result.to_dict(),
            }
            if target:
                write_result(result, document, target, "evaluation")
    print_result(result, document, as_json=as_json, after=out and out / "evaluation.html")


def _require_one_robot(given: dict[str, Any]) -> None:
    """Refuse options that do not go together."""
    actual, plan, candidates, measurements, columns = given.values()
    if (actual is None) == (measurements is None):
        raise typer.BadParameter("give either --actual or --measurements")
    if measurements is not None and (plan is not None or candidates is not None):
        raise typer.BadParameter("--plan and --candidates go with --actual alone")
    if plan is not None and candidates is not None:
        raise typer.BadParameter("give --plan or --candidates, not both")
    if columns is not None and measurements is None:
        raise typer.BadParameter("--columns goes with --measurements alone")


def _against_measurements(model: Mechanism, path: Any, columns: Path | None) -> Evaluation:
    mapping = columns_of(columns)
    return symkin.evaluate(model, measurements=symkin.read_measurements(path, model, mapping))


def _against_robot(
    model: Mechanism, robot: Mechanism, plan: Path | None, candidates: int | None, seed: int | None
) -> Evaluation:
    require_same_shape(robot, model)
    if plan is not None:
        commanded = symkin.read_plan(plan, model)
        return symkin.evaluate(model, actual=robot, poses=commanded.poses[~commanded.spare])
    sample = symkin.sample_workspace(robot, candidates, seed)
    return symkin.evaluate(model, actual=robot, poses=sample)
