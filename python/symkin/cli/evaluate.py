# SPDX-License-Identifier: MIT
"""``symkin evaluate``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import CandidatesOption, ColumnsOption, JsonOption, SeedOption
from symkin.cli.units import error_rows, milli
from symkin.errors import SymkinError

if TYPE_CHECKING:
    from symkin.evaluation import Evaluation
    from symkin.mechanism import Mechanism


@with_example(
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
    poses: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A plan whose poses are commanded."),
    ] = None,
    candidates: CandidatesOption = None,
    measurements: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measured poses and readings.")
    ] = None,
    columns: ColumnsOption = None,
    seed: SeedOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say how far the end-effector is from where the model puts it.

    Against a simulated robot: the poses that it takes, less those commanded through the model, over
    the poses of a plan or else over the robot's workspace. Against measurements: the model's poses
    at the measured readings, less the measured poses. "Aligned" is what remains after the best
    constant motions of base and tool, which say nothing of the mechanism.
    The closures are how far each leg is from reaching the measured poses at the measured readings.
    """
    _require_one_robot(actual, measurements, poses, candidates, columns)
    with progress() as stage:
        stage("reading the model")
        loaded = symkin.load_mechanism(model)
        stage("evaluating")
        unread = 0
        if measurements is not None:
            result, unread = _against_measurements(loaded, measurements, columns)
        else:
            robot = symkin.load_mechanism(str(actual))
            result = _against_robot(loaded, robot, poses, candidates, seed)
    if as_json:
        print_json(_document(loaded, result))
    else:
        _show(loaded, result, unread)


def _require_one_robot(
    actual: str | None,
    measurements: Path | None,
    poses: Path | None,
    candidates: int | None,
    columns: Path | None,
) -> None:
    """Refuse options that do not go together."""
    if (actual is None) == (measurements is None):
        raise typer.BadParameter("give either --actual or --measurements")
    if measurements is not None and (poses is not None or candidates is not None):
        raise typer.BadParameter("--poses and --candidates go with --actual alone")
    if poses is not None and candidates is not None:
        raise typer.BadParameter("give --poses or --candidates, not both")
    if columns is not None and measurements is None:
        raise typer.BadParameter("--columns goes with --measurements alone")


def _against_measurements(
    model: Mechanism, path: Path, columns: Path | None
) -> tuple[Evaluation, int]:
    """The evaluation, and the number of poses at which not all legs were read."""
    from symkin.io.mechanism_file import load_columns

    mapping = load_columns(columns) if columns else None
    measured = symkin.read_measurements(path, model, mapping)
    unread = int(np.isnan(measured.readings).any(axis=1).sum())
    return symkin.evaluate(model, measurements=measured), unread


def _against_robot(
    model: Mechanism, robot: Mechanism, plan: Path | None, candidates: int | None, seed: int | None
) -> Evaluation:
    kinds = [(made.chain, made.pose_space, len(made.legs)) for made in (model, robot)]
    if kinds[0] != kinds[1]:
        described = " and ".join(f"{legs} legs {chain} ({space})" for chain, space, legs in kinds)
        raise SymkinError(f"the model and the robot have {described}; expected the same")
    if plan is not None:
        commanded = symkin.read_plan(plan, model)
        poses = commanded.poses[~commanded.spare]
    else:
        poses = symkin.sample_workspace(robot, candidates, seed).poses
    return symkin.evaluate(model, actual=robot, poses=poses)


def _document(model: Mechanism, result: Evaluation) -> dict[str, Any]:
    from symkin.documents import evaluation_document

    return {
        "command": "evaluate",
        "mechanism": model.name,
        "evaluation": evaluation_document(result),
    }


def _show(model: Mechanism, result: Evaluation, unread: int) -> None:
    say(f"{model.name}: end-effector error over {result.evaluated} poses")
    if unread:
        say(f"left out, since not all legs were read there: {unread} poses")
    if result.failed:
        say(f"left out, since they cannot be taken: {result.failed} poses")
    say()
    for label, error in [*error_rows(model, result), *_closure_rows(result)]:
        say(f"{label:33}{error:>12}")


def _closure_rows(result: Evaluation) -> list[list[str]]:
    if result.closure_rms is None:
        return []
    rms, legs = result.closure_rms
    named = [(f"closure rms, leg {leg}", value) for leg, value in enumerate(legs.tolist(), 1)]
    return [
        [label, milli(value, "m")]
        for label, value in [("closure rms, all legs", rms), *named]
        if not math.isnan(value)
    ]
