# SPDX-License-Identifier: MIT
"""``symkin plan``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import symkin
from symkin.cli.console import print_json, progress, say, show_legs
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    ColumnsOption,
    CriterionOption,
    DesignOption,
    JsonOption,
    MechanismArgument,
    MethodOption,
    OverwriteOption,
    PoseCountOption,
    RowsOption,
    SeedOption,
    ThreadsOption,
)
from symkin.cli.plan_options import AvoidOption, MinimumDistanceOption, length, regions
from symkin.cli.units import milli, numbers
from symkin.errors import SymkinError
from symkin.io.output_files import OutputFiles
from symkin.planning import predict_accuracy, travel_length

if TYPE_CHECKING:
    from symkin.identification.estimate import Estimator
    from symkin.measurements import Measurements
    from symkin.mechanism import Mechanism
    from symkin.observability import ExpectedAccuracy
    from symkin.planning import Plan

_AVERAGED = 2000  # candidates over which the expected error is averaged


@with_example(
    "symkin plan 3RRR --out plan.csv --report planned",
    "symkin plan 3RRR --out orbits.csv --design orbits --avoid y=0.3:",
)
def plan(
    mechanism: MechanismArgument,
    out: Annotated[Path, typer.Option(metavar="FILE", help="The plan: CSV, or Parquet.")],
    poses: PoseCountOption = None,
    candidates: CandidatesOption = None,
    design: DesignOption = "legs",
    rows: RowsOption = "noise_aware",
    criterion: CriterionOption = "O1",
    method: MethodOption = "exchange",
    required: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Table of poses that must be measured; they count among the poses of every leg.",
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Measurements that exist already, to which poses are added."
        ),
    ] = None,
    columns: ColumnsOption = None,
    avoid: AvoidOption = None,
    minimum_distance: MinimumDistanceOption = "0",
    margin_sigmas: Annotated[
        float,
        typer.Option(
            metavar="K",
            min=0,
            help="Keep poses K standard deviations of what the tolerances do away from the end of "
            "a leg's reach and from singularities, if that is more than the mechanism's margins.",
        ),
    ] = 3.0,
    symmetry: Annotated[
        bool,
        typer.Option(
            "--symmetry/--no-symmetry",
            help="Choose for the reference leg alone, or for every leg by itself.",
        ),
    ] = True,
    visit: Annotated[
        Literal["sets", "travel"],
        typer.Option(help="Order of the rows: a short way from home, or set by set."),
    ] = "travel",
    spares: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=0, help="Spares of each selection; by default half as many as poses."
        ),
    ] = None,
    time_limit: Annotated[
        float,
        typer.Option(metavar="S", min=0, help="Seconds for the proof of the method exhaustive."),
    ] = 10.0,
    threads: ThreadsOption = 0,
    report: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for plan.html, its figures and plan.json."),
    ] = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Choose the poses to measure.

    Poses are chosen from the workspace for the reference leg, so that they show its parameters
    best, and carried to the other legs by the symmetry. Every set gets spares too, for poses that
    the robot cannot take.

    The certificate printed is a proven bound: no set of so many poses exceeds the efficiency 1.
    """
    from symkin.documents import plan_document
    from symkin.io.mechanism_file import load_columns
    from symkin.io.plans import read_pose_list
    from symkin.io.results import write_results
    from symkin.outputs import PLAN_FILES

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        mapping = load_columns(columns) if columns else None
        needed = read_pose_list(required, loaded) if required else None
        taken = symkin.read_measurements(measured, loaded, mapping) if measured else None
        limits = regions(avoid or [])
        distance = length(minimum_distance, "--minimum-distance")
        inputs = [loaded.source, required, measured, columns]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.file(out)
            folder = outputs.folder(report, *PLAN_FILES) if report else None
            stage("sampling the workspace")
            sample = symkin.sample_workspace(loaded, candidates, seed)
            stage("selecting poses")
            made = symkin.make_plan(
                loaded,
                sample,
                poses,
                seed,
                design=design,
                rows=rows,
                criterion=criterion,
                method=method,
                required=needed,
                measured=taken,
                avoid=limits,
                minimum_distance=distance,
                margin_sigmas=margin_sigmas,
                use_symmetry=symmetry,
                visit=visit,
                spares=spares,
                time_limit=time_limit,
                threads=threads,
            )
            # What is chosen for all legs at once is worth most to the estimate of all at once.
            estimator: Estimator = "joint" if design == "mechanism" else "implicit"
            expected = _expected(loaded, made, sample.poses[:_AVERAGED], estimator, taken)
            document = {
                "command": "plan",
                "mechanism": loaded.name,
                "candidates": len(sample.poses),
                "plan": plan_document(loaded, made, taken),
                "expected": expected
                and {
                    "estimator": estimator,
                    "position_rms_m": expected.position,
                    "orientation_rms_rad": expected.orientation,
                },
                "file": out,
            }
            symkin.write_plan(made, target, loaded)
            if folder is not None:
                from symkin.report.plan_report import write_plan_report

                stage("writing the report")
                write_results(document, folder / "plan.json")
                write_plan_report(loaded, sample, made, expected, folder, taken)
    if as_json:
        print_json(document)
    else:
        _show(loaded, made, document, expected)
        if report:
            say(str(report / "plan.html"))


def _expected(
    mechanism: Mechanism,
    made: Plan,
    poses: Any,
    estimator: Estimator,
    measured: Measurements | None,
) -> ExpectedAccuracy | None:
    """None where the estimator cannot tell, as `joint` without a noise of redundant readings."""
    try:
        return predict_accuracy(mechanism, made, poses, estimator, measured=measured)
    except SymkinError:
        return None


def _show(
    mechanism: Mechanism,
    made: Plan,
    document: dict[str, Any],
    expected: ExpectedAccuracy | None,
) -> None:
    chosen = document["plan"]
    legs = chosen["legs"]
    say(
        f"{mechanism.name}: {chosen['poses']} poses and {chosen['spares']} spares, "
        f"chosen from {document['candidates']} candidates"
    )
    show_legs(
        "|R_ii|",
        [
            (name, numbers([leg["r_diagonal"][name] for leg in legs]))
            for name in legs[0]["r_diagonal"]
        ]
        + [
            (f"O1, {made.row_kind} rows", numbers([leg["indices"]["O1"] for leg in legs])),
            ("poses", [str(leg["poses"]) for leg in legs]),
            ("spares", [str(leg["spares"]) for leg in legs]),
        ],
    )
    say()
    _show_certificates(made)
    say(f"way through the poses {travel_length(mechanism, made.poses[~made.spare]):.3g} m")
    if expected is not None:
        errors = [milli(expected.position, "m")]
        errors += [milli(expected.orientation, "rad")] if mechanism.pose_space != "point" else []
        estimator = document["expected"]["estimator"]
        say(f"expected end-effector error rms {' and '.join(errors)} ({estimator}, all poses)")
    say(f"written: {document['file']}")


def _show_certificates(made: Plan) -> None:
    if made.basis is None:
        return
    basis = made.basis
    if basis.excluded:
        say(f"left out by the limits: {basis.excluded} of {basis.candidates} candidates")
    for choice in basis.choices:
        selection, certificate = choice.selection, choice.selection.certificate
        legs = f"leg{'s' * (len(choice.legs) > 1)} {', '.join(map(str, choice.legs))}"
        proven = ", proven optimal" if certificate.proven_optimal else ""
        value = f"{basis.criterion} of the {basis.rows} rows {selection.criterion_value:.6g}"
        if basis.criterion == "expected_error":
            value = f"expected error {milli(selection.criterion_value**0.5, 'm')}"
        say(f"{legs}: {value}, efficiency {certificate.efficiency:.4f}{proven}")
