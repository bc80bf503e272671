# SPDX-License-Identifier: MIT
"""``symkin identify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.errors import not_converged
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
from symkin.identification import Identification, Loss
from symkin.io.output_files import OutputFiles


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
    use: PoseUseOption = "all",
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
    from symkin.io.mechanism_file import load_columns

    if cross_validate_blocks and cross_validate is None:
        raise typer.BadParameter("--cross-validate-blocks goes with --cross-validate alone")
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = symkin.load_mechanism(mechanism)
        mapping = load_columns(columns) if columns else None
        measured = symkin.read_measurements(measurements, nominal, mapping)
        with OutputFiles([nominal.source, measurements, columns], overwrite) as outputs:
            target = outputs.folder(out, *Identification.FILES) if out else None
            stage("identifying the legs")
            found = symkin.identify(
                nominal, measured, estimator, poses=use, loss=loss, max_iterations=max_iterations
            )
            if cross_validate is not None:
                stage("cross-validating")
                found = found.cross_validated(cross_validate, seed, blocks=cross_validate_blocks)
            if target:
                stage("writing the report")
                found.write(target)
    if as_json:
        print_json(found.to_dict())
    else:
        say(found.text())
        if out:
            say(f"\n{out / 'report.html'}")
    if not found.converged:
        not_converged(found.failure)
