# SPDX-License-Identifier: MIT
"""``symkin identify``."""

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
    JsonOption,
    MechanismArgument,
    OptionalEstimatorOption,
    OverwriteOption,
    PoseUseOption,
    SeedOption,
)
from symkin.cli.unknown_options import (
    FixedOption,
    FramesOption,
    FreeOption,
    PrintedOption,
    PriorOption,
    SensorOption,
    SensorTableOption,
    SharedOption,
    printed_lengths,
    unknowns,
    with_sensor_table,
)
from symkin.identification import JointIdentification, Loss
from symkin.identification.unknowns import Gauge, LossPer
from symkin.io.output_files import OutputFiles
from symkin.probing import with_printed_length


@with_example(
    "symkin run 3RRR --out out",
    "symkin identify 3RRR out/measurements.csv --cross-validate 5 --out identified",
    "symkin identify 3RRR out/measurements.csv --shared sensor_gain --fixed 'leg1.*_length'",
    "symkin plan linear_delta --observe height --out probe",
    "symkin simulate linear_delta --plan probe/plan.csv --observe height --out probed",
    "symkin identify linear_delta probed/measurements.csv --printed '100 mm = 100.2 mm'",
)
def identify(
    mechanism: MechanismArgument,
    measurements: Annotated[
        Path,
        typer.Argument(metavar="MEASUREMENTS", help="Measured poses and readings: CSV or Parquet."),
    ],
    columns: ColumnsOption = None,
    estimator: OptionalEstimatorOption = None,
    use: PoseUseOption = "all",
    loss: Annotated[Loss, typer.Option(help="Robust loss against outliers.")] = "none",
    loss_per: Annotated[
        LossPer | None,
        typer.Option(help="Whether a blunder spoils its pose, or is found and left out alone."),
    ] = None,
    free: FreeOption = None,
    fixed: FixedOption = None,
    shared: SharedOption = None,
    prior: PriorOption = None,
    frames: FramesOption = None,
    sensor: SensorOption = None,
    sensor_table: SensorTableOption = None,
    printed: PrintedOption = None,
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
    max_iterations: Annotated[
        int, typer.Option(metavar="N", min=1, help="Steps after which a solver gives up.")
    ] = 100,
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
    from symkin.io.mechanism_file import load_columns

    if cross_validate_blocks and cross_validate is None:
        raise typer.BadParameter("--cross-validate-blocks goes with --cross-validate alone")
    if printed and (free or frames):
        raise typer.BadParameter(
            "--printed leaves open where bed and ruler lay, which --free and --frames would say; "
            "hold parameters with --fixed instead"
        )
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = with_sensor_table(symkin.load_mechanism(mechanism), sensor_table)
        mapping = load_columns(columns) if columns else None
        measured = symkin.read_measurements(measurements, nominal, mapping)
        for piece in printed_lengths(printed):
            measured = with_printed_length(nominal, measured, piece)
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
                **unknowns(free, fixed, shared, prior, frames, sensor),
                gauge=gauge,
                noise=None if noise == "declared" else noise,
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
