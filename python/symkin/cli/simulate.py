# SPDX-License-Identifier: MIT
"""``symkin simulate`` and ``symkin run``: measurements of a simulated robot, or all with one."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import not_converged, print_result, progress
from symkin.cli.options import (
    CandidatesOption,
    ChoosingForPlan,
    EstimatorOption,
    JsonOption,
    MechanismArgument,
    Observing,
    OverwriteOption,
    PoseCountOption,
    PoseUseOption,
    SeedOption,
    command,
)
from symkin.io.output_files import OutputFiles
from symkin.pipeline import ProtocolResult
from symkin.simulation import Simulation


@command(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --seed 2 --out second",
    "symkin simulate 3RRR --plan out/plan.csv --observe position --missing 0.2 --out third",
)
def simulate(
    *,
    mechanism: MechanismArgument,
    plan: Annotated[Path, typer.Option(metavar="FILE", help="A plan of `symkin plan`.")],
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for measurements.csv and actual.toml, the robot."),
    ],
    seen: Observing,
    missing: Annotated[
        float, typer.Option(metavar="FRACTION", help="Of the readings, that are not taken.")
    ] = 0.0,
    spread: Annotated[
        float,
        typer.Option(
            metavar="S",
            help="Times exp(S z), z normal, the noise differs from row to row; the table says it.",
        ),
    ] = 0.0,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate the measurements of a plan.

    A robot is made that differs from the mechanism within its tolerances, takes the poses of the
    plan, and is measured with its noise. Poses that it cannot take are replaced by spares. Frames
    and points may have units: '1 m, 20 cm, 170 deg'.
    """
    with progress() as stage:
        stage("reading the mechanism and the plan")
        loaded = symkin.load_mechanism(mechanism)
        commanded = symkin.read_plan(plan, loaded)
        observe = seen.observed(loaded, missing, spread)
        with OutputFiles([loaded.source, plan], overwrite) as outputs:
            folder = outputs.folder(out, *Simulation.FILES)
            stage("simulating measurements")
            simulation = symkin.simulate(loaded, commanded, seed, observe=observe)
            simulation.write(folder)
    after = f"{out / 'measurements.csv'}\n{out / 'actual.toml'}"
    print_result(simulation, as_json=as_json, after=after)


@command("symkin run 3RRR --out out")
def run(
    *,
    mechanism: MechanismArgument,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for all files of the run.")],
    estimator: EstimatorOption = "implicit",
    use: PoseUseOption = "all",
    choosing: ChoosingForPlan,
    pose_count: PoseCountOption = None,
    candidates: CandidatesOption = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run the whole protocol on a simulated robot and write a report.

    Writes plan.csv, measurements.csv, actual.toml (the simulated robot), calibrated.toml,
    results.json and report.html. The last line printed is the report's path.
    """
    with progress() as stage:
        stage("reading the mechanism")
        nominal = symkin.load_mechanism(mechanism)
        given = {"pose_count": pose_count, "candidates": candidates}
        changes = {name: value for name, value in given.items() if value is not None}
        nominal = nominal.replace(protocol=dataclasses.replace(nominal.protocol, **changes))
        with OutputFiles([nominal.source], overwrite) as outputs:
            target = outputs.folder(out, *ProtocolResult.FILES)
            result = symkin.run_protocol(
                nominal,
                estimator=estimator,
                poses=use,
                **vars(choosing),
                seed=seed,
                progress=stage,
            )
            stage("writing the report")
            result.write(target)
    print_result(result, as_json=as_json, after=out / "report.html")
    if not result.identification.converged:
        not_converged(result.identification.failure)
