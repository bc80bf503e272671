# SPDX-License-Identifier: MIT
"""``symkin identify-batch``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

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
)
from symkin.identification import FitOptions, Loss
from symkin.identification.fleet import Fleet, fleet_of_files
from symkin.io.output_files import OutputFiles


@with_example(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --seed 2 --out second",
    "symkin identify-batch 3RRR out/measurements.csv second/measurements.csv --out fleet",
)
def identify_batch(
    mechanism: MechanismArgument,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILES...",
            help="Measurements, CSV or Parquet: a file a robot, or one table with a column "
            '"robot".',
        ),
    ],
    columns: ColumnsOption = None,
    estimator: EstimatorOption = "implicit",
    use: PoseUseOption = "all",
    loss: Annotated[Loss, typer.Option(help="Robust loss against outliers.")] = "none",
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the table, a row a robot, and report.html."),
    ] = None,
    table: Annotated[
        Literal["csv", "parquet"], typer.Option(help="What the table is written as.")
    ] = "csv",
    max_iterations: Annotated[
        int, typer.Option(metavar="N", min=1, help="Steps after which a solver gives up.")
    ] = 100,
    threads: Annotated[
        int,
        typer.Option(metavar="N", min=0, max=1024, help="0 for all; the table is always the same."),
    ] = 0,
    workers: Annotated[
        int,
        typer.Option(metavar="N", min=1, max=1024, help="Processes on this machine, through Dask."),
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A running Dask scheduler, such as tcp://host:8786."),
    ] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Identify many robots of one drawing into one table, a row a robot."""
    from symkin.io.mechanism_file import load_columns

    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = symkin.load_mechanism(mechanism)
        with OutputFiles([nominal.source, *files, columns], overwrite) as outputs:
            target = outputs.folder(out, f"fleet.{table}", "report.html") if out else None
            mapping = load_columns(columns) if columns else None
            robots = fleet_of_files(nominal, files, mapping)
            stage(f"identifying {len(robots)} robots")
            found = Fleet.of(
                nominal,
                robots,
                FitOptions(estimator, use, loss, None, None, max_iterations),
                threads=threads,
                workers=workers,
                scheduler=scheduler,
            )
            if target:
                stage("writing the table")
                found.write(target, table=table)
    if as_json:
        print_json(found.to_dict())
    else:
        say(found.text())
        if out:
            say(f"\n{out / f'fleet.{table}'}")
    failed = found.verdicts.count("failed")
    if failed:
        not_converged(f"{failed} of {len(found.robots)} robots; the table says why")
