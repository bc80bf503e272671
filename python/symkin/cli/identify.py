# SPDX-License-Identifier: MIT
"""``symkin identify`` and ``symkin identify-batch``: one robot, or many of one drawing."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import symkin
from symkin.cli.console import not_converged, print_result, progress
from symkin.cli.option_values import columns_of, printed_length_of, with_sensor_table
from symkin.cli.options import (
    ColumnsOption,
    EstimatorOption,
    JsonOption,
    LossOption,
    MaxIterationsOption,
    MechanismArgument,
    OptionalEstimatorOption,
    OverwriteOption,
    PoseUseOption,
    SchedulerOption,
    SeedOption,
    ThreadsOption,
    Unknown,
    WorkersOption,
    command,
)
from symkin.identification import FitOptions, JointIdentification
from symkin.identification.fleet import Fleet, fleet_of_files
from symkin.identification.unknowns import Gauge, LossPer
from symkin.io.output_files import OutputFiles
from symkin.probing import with_printed_length


@command(
    "symkin run 3RRR --out out",
    "symkin identify 3RRR out/measurements.csv --cross-validate 5 --out identified",
    "symkin identify 3RRR out/measurements.csv --shared sensor_gain --fixed 'leg1.*_length'",
    "symkin plan linear_delta --observe height --out probe",
    "symkin simulate linear_delta --plan probe/plan.csv --observe height --out probed",
    "symkin identify linear_delta probed/measurements.csv --printed '100 mm = 100.2 mm'",
)
def identify(
    *,
    mechanism: MechanismArgument,
    measurements: Annotated[
        Path,
        typer.Argument(metavar="MEASUREMENTS", help="Measured poses and readings: CSV or Parquet."),
    ],
    columns: ColumnsOption = None,
    estimator: OptionalEstimatorOption = None,
    use: PoseUseOption = "all",
    loss: LossOption = "none",
    loss_per: Annotated[
        LossPer | None,
        typer.Option(help="Whether a blunder spoils its pose, or is found and left out alone."),
    ] = None,
    unknown: Unknown,
    sensor_table: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="What the sensors show and what straight ones would, of a certificate: CSV with "
            "columns reading_deg and joint_deg (any unit), and leg if they differ. By default "
            "what the mechanism's file says.",
        ),
    ] = None,
    printed: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="A piece that a probed delta printed along x, centred, before it was calibrated: "
            "'100 mm = 100.12 mm', commanded and measured; with '+- 0.02 mm' behind, how well (by "
            "default 0.05 mm).",
        ),
    ] = None,
    gauge: Annotated[
        Gauge | None,
        typer.Option(
            help="What settles combinations that no observation shows: the tolerances as priors; "
            "the nearest to the drawing; or as few held parameters as will do."
        ),
    ] = None,
    noise: Annotated[
        Literal["declared", "estimate"],
        typer.Option(help="The noise: the mechanism's, or estimated with the unknowns."),
    ] = "declared",
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
    max_iterations: MaxIterationsOption = 100,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Identify what is unknown of a robot from measurements.

    By default these are all parameters of all legs, one leg after the other from full poses. With
    other unknowns, frames or partial poses everything is estimated together.

    Where a probe touched a bed, heights are all that is known of the poses; the bed's plane is
    unknown then, and the tolerances are priors.
    """
    if cross_validate_blocks and cross_validate is None:
        raise typer.BadParameter("--cross-validate-blocks goes with --cross-validate alone")
    if printed and (unknown.free or unknown.frames):
        raise typer.BadParameter(
            "--printed leaves open where bed and ruler lay, which --free and --frames would say; "
            "hold parameters with --fixed instead"
        )
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = with_sensor_table(symkin.load_mechanism(mechanism), sensor_table)
        mapping = columns_of(columns)
        measured = symkin.read_measurements(measurements, nominal, mapping)
        if printed is not None:
            measured = with_printed_length(nominal, measured, printed_length_of(printed))
        inputs = [nominal.source, measurements, columns, sensor_table]
        with OutputFiles(inputs, overwrite) as outputs:
            target = outputs.folder(out, *JointIdentification.FILES) if out else None
            stage("identifying")
            found = symkin.identify(
                nominal,
                measured,
                estimator,
                poses=use,
                loss=loss,
                loss_per=loss_per,
                max_iterations=max_iterations,
                **unknown.arguments(),
                gauge=gauge,
                noise=None if noise == "declared" else noise,
            )
            if cross_validate is not None:
                stage("cross-validating")
                found = found.cross_validated(cross_validate, seed, blocks=cross_validate_blocks)
            if target:
                stage("writing the report")
                found.write(target)
    print_result(found, as_json=as_json, after=out and out / "report.html")
    if not found.converged:
        not_converged(found.failure)


@command(
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
    loss: LossOption = "none",
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for the table, a row a robot, and report.html."),
    ] = None,
    table: Annotated[
        Literal["csv", "parquet"], typer.Option(help="What the table is written as.")
    ] = "csv",
    max_iterations: MaxIterationsOption = 100,
    threads: ThreadsOption = 0,
    workers: WorkersOption = 1,
    scheduler: SchedulerOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Identify many robots of one drawing into one table, a row a robot."""
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = symkin.load_mechanism(mechanism)
        with OutputFiles([nominal.source, *files, columns], overwrite) as outputs:
            target = outputs.folder(out, f"fleet.{table}", "report.html") if out else None
            mapping = columns_of(columns)
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
    print_result(found, as_json=as_json, after=out and out / f"fleet.{table}")
    failed = found.verdicts.count("failed")
    if failed:
        not_converged(f"{failed} of {len(found.robots)} robots; the table says why")
