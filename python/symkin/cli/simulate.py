# SPDX-License-Identifier: MIT
"""``symkin simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, SeedOption
from symkin.cli.unknown_options import (
    NO_PLANE,
    AnchorOption,
    BaseOption,
    ObserveOption,
    PlaneOption,
    PointOption,
    TargetOption,
    observed,
)
from symkin.io.output_files import OutputFiles
from symkin.simulation import Simulation


@with_example(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --seed 2 --out second",
    "symkin simulate 3RRR --plan out/plan.csv --observe position --missing 0.2 --out third",
)
def simulate(
    mechanism: MechanismArgument,
    plan: Annotated[Path, typer.Option(metavar="FILE", help="A plan of `symkin plan`.")],
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for measurements.csv and actual.toml, the robot."),
    ],
    observe: ObserveOption = None,
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
    base: BaseOption = None,
    target: TargetOption = None,
    point: PointOption = None,
    anchor: AnchorOption = None,
    plane: PlaneOption = NO_PLANE,
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
        seen = observed(
            loaded, observe, base, target, point, anchor, plane, missing=missing, spread=spread
        )
        with OutputFiles([loaded.source, plan], overwrite) as outputs:
            folder = outputs.folder(out, *Simulation.FILES)
            stage("simulating measurements")
            simulation = symkin.simulate(loaded, commanded, seed, observe=seen)
            simulation.write(folder)
    if as_json:
        print_json(simulation.to_dict())
    else:
        say(simulation.text())
        say(f"\n{out / 'measurements.csv'}\n{out / 'actual.toml'}")
