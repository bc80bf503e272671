# SPDX-License-Identifier: MIT
"""``symkin pose-count``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say, show_table
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    CriterionOption,
    DesignOption,
    EstimatorOption,
    JsonOption,
    MechanismArgument,
    OverwriteOption,
    PoseUseOption,
    RowsOption,
    SeedOption,
)
from symkin.cli.units import milli
from symkin.io.output_files import OutputFiles
from symkin.planning import pose_count_curve

if TYPE_CHECKING:
    from symkin.mechanism import Mechanism
    from symkin.planning import PoseCountCurve


@with_example("symkin pose-count 3RRR --out counted")
def pose_count(
    mechanism: MechanismArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for pose-count.html, its figure and pose-count.json."
        ),
    ] = None,
    least_gain: Annotated[
        float,
        typer.Option(
            metavar="SHARE",
            help="Of the position error, that another pose must save to be worth while.",
        ),
    ] = 0.02,
    estimator: EstimatorOption = "implicit",
    poses: PoseUseOption = "all",
    candidates: CandidatesOption = None,
    design: DesignOption = "legs",
    rows: RowsOption = "noise_aware",
    criterion: CriterionOption = "O1",
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Predict how many poses are enough.

    For numbers of poses from that of a leg's parameters to ten times as many, poses are selected,
    and the end-effector error after identification is predicted from the declared noise.
    """
    from symkin.documents import pose_count_document
    from symkin.io.results import write_results
    from symkin.outputs import POSE_COUNT_FILES

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        with OutputFiles([loaded.source], overwrite) as outputs:
            folder = outputs.folder(out, *POSE_COUNT_FILES) if out else None
            stage("sampling the workspace")
            sample = symkin.sample_workspace(loaded, candidates, seed)
            stage("selecting and predicting")
            curve = pose_count_curve(
                loaded,
                sample.poses,
                seed=seed,
                design=design,
                rows=rows,
                criterion=criterion,
                estimator=estimator,
                poses=poses,
                least_gain=least_gain,
            )
            document = pose_count_document(
                loaded,
                curve,
                design=design,
                rows=rows,
                criterion=criterion,
                estimator=estimator,
                poses=poses,
            )
            if folder is not None:
                from symkin.report.plan_report import write_pose_count_report

                write_results(document, folder / "pose-count.json")
                write_pose_count_report(loaded, curve, folder)
    if as_json:
        print_json(document)
    else:
        _show(loaded, curve)
        if out:
            say(str(out / "pose-count.html"))


def _show(mechanism: Mechanism, curve: PoseCountCurve) -> None:
    turns = mechanism.pose_space != "point"
    rows = []
    for at, count in enumerate(curve.counts.tolist()):
        row = [str(count), str(curve.measured[at]), milli(curve.position[at], "m")]
        row += [milli(curve.orientation[at], "rad")] if turns else []
        rows.append([*row, f"{curve.efficiency[at]:.4f}"])
    heading = ["poses a leg", "in all", "position rms", *(["orientation rms"] * turns)]
    show_table([*heading, "efficiency"], rows, words=0)
    say()
    gain = f"{100 * curve.least_gain:g}%"
    if curve.enough is None:
        say(f"every further pose saves at least {gain} of the position error")
    else:
        say(
            f"enough: {curve.enough} poses a leg; another one saves less than {gain} of the "
            "position error"
        )
