# SPDX-License-Identifier: MIT
"""``symkin pose-count``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    CriterionOption,
    DesignOption,
    JsonOption,
    MechanismArgument,
    OptionalEstimatorOption,
    OverwriteOption,
    PoseUseOption,
    RowsOption,
    SeedOption,
)
from symkin.cli.plan_options import AccuracyOption, accuracies
from symkin.cli.unknown_options import (
    NO_PLANE,
    AnchorOption,
    BaseOption,
    FixedOption,
    FramesOption,
    FreeOption,
    ObserveOption,
    PlaneOption,
    PointOption,
    PriorOption,
    SensorOption,
    SharedOption,
    TargetOption,
    planned,
    unknowns,
)
from symkin.io.output_files import OutputFiles
from symkin.planning import NeededPoses, PoseCountCurve, pose_count_curve

_FILES = ("pose-count.json", "pose-count.html")


@with_example(
    "symkin pose-count 3RRR --out counted",
    "symkin pose-count 3RRR --accuracy 0.05mm",
)
def pose_count(
    mechanism: MechanismArgument,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for pose-count.json and pose-count.html."),
    ] = None,
    accuracy: AccuracyOption = None,
    least_gain: Annotated[
        float,
        typer.Option(
            metavar="SHARE",
            help="Of the position error, that another pose must save to be worth while.",
        ),
    ] = 0.02,
    estimator: OptionalEstimatorOption = None,
    use: PoseUseOption = "all",
    candidates: CandidatesOption = None,
    design: DesignOption = "legs",
    rows: RowsOption = "noise_aware",
    criterion: CriterionOption = "O1",
    observe: ObserveOption = None,
    base: BaseOption = None,
    target: TargetOption = None,
    point: PointOption = None,
    anchor: AnchorOption = None,
    plane: PlaneOption = NO_PLANE,
    free: FreeOption = None,
    fixed: FixedOption = None,
    shared: SharedOption = None,
    prior: PriorOption = None,
    frames: FramesOption = None,
    sensor: SensorOption = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Predict how many poses are enough.

    For numbers of poses from that of a leg's parameters to ten times as many, poses are selected,
    and the end-effector error after identification is predicted from the declared noise. With
    --accuracy, the fewest poses are found that give it; if they are too many, what else would help.
    With --observe, or unknowns as `symkin identify` has them, for what is observed and unknown then
    (--design mechanism).
    """
    from symkin.io.results import write_results

    position, orientation = accuracies(accuracy or [])

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        with OutputFiles([loaded.source], overwrite) as outputs:
            folder = outputs.folder(out, *_FILES) if out else None
            stage("sampling the workspace")
            sample = symkin.sample_workspace(loaded, candidates, seed)
            stage("selecting and predicting")
            curve = pose_count_curve(
                loaded,
                sample,
                seed=seed,
                design=design,
                rows=rows,
                criterion=criterion,
                estimator=estimator,
                poses=use,
                least_gain=least_gain,
                observe=planned(loaded, observe, base, target, point, anchor, plane),
                **unknowns(free, fixed, shared, prior, frames, sensor),
            )
            result: PoseCountCurve | NeededPoses = curve
            if accuracy:
                stage("looking for the number of poses")
                result = curve.for_accuracy(position, orientation)
            document = {"command": "pose-count", **result.to_dict()}
            if folder is not None:
                write_results(document, folder / "pose-count.json")
                result.report(folder / "pose-count.html")
    if as_json:
        print_json(document)
        return
    say(result.text())
    if out:
        say(f"\nWritten: {', '.join(str(out / name) for name in _FILES)}")
