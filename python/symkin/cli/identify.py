# SPDX-License-Identifier: MIT
"""``symkin identify``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import symkin
from symkin.cli.console import print_json, progress, say, show_table
from symkin.cli.errors import not_converged
from symkin.cli.fits import show_fits, unconverged_legs
from symkin.cli.help import with_example
from symkin.cli.options import (
    ColumnsOption,
    EstimatorOption,
    JsonOption,
    MechanismArgument,
    OverwriteOption,
    PoseUseOption,
    SeedOption,
)
from symkin.cli.units import error_rows, left_out_rows, milli, root_mean_squares
from symkin.identification.estimate import Loss
from symkin.io.output_files import OutputFiles

if TYPE_CHECKING:
    from symkin.identification.outcome import MeasuredIdentification


@with_example(
    "symkin run 3RRR --out out",
    "symkin identify 3RRR out/measurements.csv --cross-validate 5 --out identified",
)
def identify(
    mechanism: MechanismArgument,
    measurements: Annotated[
        Path,
        typer.Argument(metavar="MEASUREMENTS", help="Measured poses and readings: CSV or Parquet."),
    ],
    columns: ColumnsOption = None,
    estimator: EstimatorOption = "implicit",
    poses: PoseUseOption = "all",
    loss: Annotated[Loss, typer.Option(help="Robust loss against outliers.")] = "none",
    cross_validate: Annotated[
        int | None,
        typer.Option(
            metavar="K", min=2, help="Predict each of K parts of the poses from the others, too."
        ),
    ] = None,
    cross_validate_blocks: Annotated[
        bool,
        typer.Option(
            "--cross-validate-blocks",
            help="The parts are blocks of consecutive poses, instead of poses drawn at random.",
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Folder for calibrated.toml, results.json and report.html."
        ),
    ] = None,
    max_iterations: Annotated[
        int, typer.Option(metavar="N", min=1, help="Steps after which a solver gives up.")
    ] = 100,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Identify the parameters of all legs from measurements."""
    from symkin.documents import measured_document
    from symkin.identification.outcome import MeasuredIdentification
    from symkin.io.mechanism_file import load_columns
    from symkin.outputs import IDENTIFICATION_FILES, write_identification

    if cross_validate_blocks and cross_validate is None:
        raise typer.BadParameter("--cross-validate-blocks goes with --cross-validate alone")
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = symkin.load_mechanism(mechanism)
        mapping = load_columns(columns) if columns else None
        measured = symkin.read_measurements(measurements, nominal, mapping)
        inputs = [nominal.source, measurements, columns]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.folder(out, *IDENTIFICATION_FILES) if out else None
            stage("identifying the legs")
            options: dict[str, Any] = {
                "poses": poses,
                "loss": loss,
                "max_iterations": max_iterations,
            }
            identification = symkin.identify(nominal, measured, estimator, **options)
            validation = None
            if cross_validate is not None:
                stage("cross-validating")
                seed = nominal.protocol.seed if seed is None else seed
                validation = symkin.cross_validate(
                    nominal,
                    measured,
                    cross_validate,
                    seed,
                    estimator,
                    blocks=cross_validate_blocks,
                    **options,
                )
            result = MeasuredIdentification.of(nominal, measured, identification, validation)
            document = measured_document(result, poses=poses, loss=loss)
            stage("writing the report")
            report = write_identification(result, target, document) if target else None
    if as_json:
        print_json(document)
    else:
        _show(result, document)
        if out:
            say()
            say(
                str(out / report.name)
                if report
                else f"{out}: no report, since no pose was "
                "measured with readings of all legs that the mechanism can take"
            )
    if not identification.converged:
        not_converged(unconverged_legs(identification))


def _show(result: MeasuredIdentification, document: dict[str, Any]) -> None:
    from symkin.identification.calibrated import changed_settings

    nominal, identification = result.nominal, result.identification
    before = document["identification"]["residual_before_rms_m"]
    say(
        f"{nominal.name}: {len(result.measurements.poses)} poses, "
        f"estimator {identification.estimator} ({document['settings']['poses']} poses)"
    )
    rows = [
        [
            "closure residual rms",
            milli(before, "m"),
            milli(identification.residual_rms, "m"),
        ],
        ["closure residual maximum", "", milli(identification.residual_max, "m")],
    ]
    if result.before is not None and result.after is not None:
        rows += error_rows(nominal, result.before, result.after)
        rows += left_out_rows(result.before.failed, result.after.failed)
    validation = result.cross_validation
    if validation is not None:
        label = validation.name
        rows.append([f"{label} rms", "", milli(validation.residual_rms, "m")])
        rows.append([f"{label} maximum", "", milli(validation.residual_max, "m")])
        rows += [
            [f"{label} {kind} error rms", "", milli(value, unit)]
            for kind, value, unit in root_mean_squares(nominal, validation.evaluation)
        ]
    show_table(["", "before", "after"], rows)
    if validation is not None and not validation.converged:
        say("Not every identification of the cross-validation converged.")
    show_fits(identification)
    for change in changed_settings(nominal, identification.mechanism):
        say(change)
