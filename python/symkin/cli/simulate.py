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
from symkin.errors import QuantityError, SymkinError
from symkin.io.output_files import OutputFiles
from symkin.io.quantities import evaluate_quantity
from symkin.simulation import Observed, Simulation


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
    observe: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND",
            help="pose (the default), position, orientation, points, distance, height, or readings "
            "alone; may be repeated.",
        ),
    ] = None,
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
    base: Annotated[
        str | None,
        typer.Option(
            metavar="FRAME",
            help="The base in the measuring device's frame: 'x, y, phi' or 'x, y, z, rx, ry, rz'.",
        ),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(metavar="FRAME", help="What is measured, in the platform's frame."),
    ] = None,
    point: Annotated[
        list[str] | None,
        typer.Option(metavar="POINT", help="A target point in the platform's frame; several."),
    ] = None,
    anchor: Annotated[
        list[str] | None,
        typer.Option(metavar="POINT", help="Where distances are measured from; several."),
    ] = None,
    plane: Annotated[
        str,
        typer.Option(metavar="C", help="'c0, c1, c2' of z = c0 + c1 x + c2 y for heights."),
    ] = "0, 0, 0",
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
        size = loaded.space.size
        frame = ("m", "m", "m", "rad", "rad", "rad") if size == 3 else ("m", "m", "rad")
        observed = Observed(
            tuple(observe or ["pose"]),  # type: ignore[arg-type]  # which it checks
            _quantities("--base", base, frame) if base else None,
            _quantities("--target", target, frame) if target else None,
            tuple(_quantities("--point", each, frame[:size]) for each in point or ()),
            tuple(_quantities("--anchor", each, frame[:size]) for each in anchor or ()),
            _quantities("--plane", plane, ("m", "1", "1")),
            missing,
            spread,
        )
        with OutputFiles([loaded.source, plan], overwrite) as outputs:
            folder = outputs.folder(out, *Simulation.FILES)
            stage("simulating measurements")
            simulation = symkin.simulate(loaded, commanded, seed, observe=observed)
            simulation.write(folder)
    if as_json:
        print_json(simulation.to_dict())
    else:
        say(simulation.text())
        say(f"\n{out / 'measurements.csv'}\n{out / 'actual.toml'}")


def _quantities(option: str, text: str, units: tuple[str, ...]) -> tuple[float, ...]:
    """Values separated by commas, each in its unit."""
    parts = text.split(",")
    if len(parts) != len(units):
        raise SymkinError(
            f'{option} "{text}" has {len(parts)} values; expected {len(units)}, in '
            f"{', '.join(units)}"
        )
    try:
        return tuple(
            evaluate_quantity(part, unit, direction=unit == "rad")
            for part, unit in zip(parts, units, strict=True)
        )
    except QuantityError as error:
        raise SymkinError(f"{option}: {error}") from error
