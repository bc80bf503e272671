# SPDX-License-Identifier: MIT
"""``symkin run``."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import symkin
from symkin.cli.console import print_json, progress, say, show_table
from symkin.cli.errors import not_converged
from symkin.cli.fits import unconverged_legs
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    CriterionOption,
    DesignOption,
    EstimatorOption,
    JsonOption,
    MechanismArgument,
    MethodOption,
    OverwriteOption,
    PoseCountOption,
    PoseUseOption,
    RowsOption,
    SeedOption,
)
from symkin.cli.units import error_rows, left_out_rows, milli
from symkin.io.output_files import OutputFiles

if TYPE_CHECKING:
    from symkin.identification.comparison import EstimatorFigures
    from symkin.mechanism import Mechanism
    from symkin.pipeline import ProtocolResult


@with_example("symkin run 3RRR --out out")
def run(
    mechanism: MechanismArgument,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all files of the run.")],
    estimator: EstimatorOption = "implicit",
    poses: PoseUseOption = "own",
    design: DesignOption = "legs",
    rows: RowsOption = "noise_aware",
    criterion: CriterionOption = "O1",
    method: MethodOption = "exchange",
    pose_count: PoseCountOption = None,
    candidates: CandidatesOption = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run the whole protocol on a simulated robot and write a report.

    Writes plan.csv, measurements.csv, actual.toml (the simulated robot), calibrated.toml,
    results.json, report.html and its figures. The last line printed is the report's path.
    """
    from symkin.documents import run_document
    from symkin.identification.comparison import compare_estimators
    from symkin.outputs import RUN_FILES, write_run

    with progress() as stage:
        stage("reading the mechanism")
        nominal = _with_protocol(symkin.load_mechanism(mechanism), pose_count, candidates)
        with OutputFiles([nominal.source], overwrite) as outputs:
            target = outputs.folder(out, *RUN_FILES)
            result = symkin.run_protocol(
                nominal,
                estimator=estimator,
                poses=poses,
                design=design,
                rows=rows,
                criterion=criterion,
                method=method,
                seed=seed,
                progress=stage,
            )
            stage("comparing the estimators")
            comparison = compare_estimators(result)
            document = run_document(
                result,
                comparison,
                estimator=estimator,
                poses=poses,
                design=design,
                rows=rows,
                criterion=criterion,
                method=method,
                pose_count=nominal.protocol.pose_count,
                seed=nominal.protocol.seed if seed is None else seed,
            )
            stage("writing the report")
            report = write_run(result, target, document, comparison)
    if as_json:
        print_json(document)
    else:
        _show(result, document)
        _show_comparison(nominal, comparison)
        say()
        say(str(out / report.name))
    if not result.identification.converged:
        not_converged(unconverged_legs(result.identification))


def _with_protocol(
    mechanism: Mechanism, pose_count: int | None, candidates: int | None
) -> Mechanism:
    given = {"pose_count": pose_count, "candidates": candidates}
    changes = {name: value for name, value in given.items() if value is not None}
    if not changes:
        return mechanism
    return mechanism.replace(protocol=dataclasses.replace(mechanism.protocol, **changes))


def _show(result: ProtocolResult, document: dict[str, Any]) -> None:
    nominal, plan = result.nominal, document["plan"]
    say(
        f"{nominal.name}: {plan['poses']} poses for {len(nominal.legs)} legs, chosen from "
        f"{len(result.candidates.poses)} candidates"
    )
    replaced = sum(result.simulation.replaced)
    say(f"replaced by spares, since the robot cannot take them: {replaced} poses")
    settings, expected = document["settings"], document["evaluation"]["expected"]
    figures = {
        "position error rms": milli(expected["position_rms_m"], "m"),
        "orientation error rms": milli(expected["orientation_rms_rad"], "rad"),
    }
    show_table(
        [f"{settings['estimator']}, {settings['poses']} poses", "before", "after", "expected"],
        [
            *(
                [*row, figures.get(row[0], "")]
                for row in error_rows(nominal, result.before, result.after)
            ),
            *left_out_rows(result.before.failed, result.after.failed, expected["failed"]),
        ],
    )
    for doubt in result.identification.doubts:
        say(f"Doubt: {doubt}")
    for note in result.identification.diagnosis.notes:
        say(f"Note: {note}")


def _show_comparison(mechanism: Mechanism, comparison: Sequence[EstimatorFigures]) -> None:
    """Print what every estimator makes of the same measurements."""
    turns = mechanism.pose_space != "point"
    rows = []
    for figures in comparison:
        row: list[str] = [figures.estimator, figures.poses]
        for kind, unit in (("position", "m"), ("orientation", "rad"))[: 2 if turns else 1]:
            reached, expected = figures.evaluation, figures.expected
            row.append(milli(getattr(reached, f"{kind}_rms"), unit) if reached else "-")
            row.append(milli(getattr(expected, kind), unit) if expected else "-")
        rows.append([*row, "" if figures.converged else "not converged"])
    heading = ["estimator", "poses", "position rms", "expected"]
    heading += ["orientation rms", "expected"] if turns else []
    show_table([*heading, ""], rows, words=2)
