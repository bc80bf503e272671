# SPDX-License-Identifier: MIT
"""``symkin simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import JsonOption, MechanismArgument, OverwriteOption, SeedOption
from symkin.io.output_files import OutputFiles


@with_example(
    "symkin plan 3RRR --out plan.csv",
    "symkin simulate 3RRR plan.csv --out measurements.csv --actual-out actual.toml",
)
def simulate(
    mechanism: MechanismArgument,
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="A plan of `symkin plan`.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The measurements: CSV, or Parquet.")],
    actual_out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Mechanism file of the simulated robot."),
    ] = None,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate the measurements of a plan.

    A robot is made that differs from the mechanism within its tolerances, takes the poses of the
    plan, and is measured with its noise. Poses that it cannot take are replaced by spares.
    """
    from symkin.outputs import write_actual

    with progress() as stage:
        stage("reading the mechanism and the plan")
        loaded = symkin.load_mechanism(mechanism)
        commanded = symkin.read_plan(plan, loaded)
        with OutputFiles([loaded.source, plan], overwrite) as outputs:
            target = outputs.file(out)
            actual_target = outputs.file(actual_out) if actual_out else None
            stage("simulating measurements")
            simulation = symkin.simulate(loaded, commanded, seed)
            symkin.write_measurements(simulation.measurements, target, loaded)
            if actual_target is not None:
                write_actual(simulation.actual, loaded, actual_target)
    document = {
        "command": "simulate",
        "mechanism": loaded.name,
        "measured": len(simulation.measurements.poses),
        "replaced": dict(zip(np.unique(commanded.leg_sets) + 1, simulation.replaced, strict=True)),
        "files": {"measurements": out, "actual": actual_out},
    }
    if as_json:
        print_json(document)
    else:
        _show(document)


def _show(document: dict[str, Any]) -> None:
    replaced = document["replaced"]
    say(f"{document['mechanism']}: {document['measured']} poses measured")
    sets = ", ".join(f"leg {leg}: {count}" for leg, count in replaced.items())
    say(f"replaced by spares, since the robot cannot take them: {sum(replaced.values())} ({sets})")
    say(f"written: {', '.join(str(file) for file in document['files'].values() if file)}")
