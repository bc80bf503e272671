# SPDX-License-Identifier: MIT
"""``symkin plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import symkin
from symkin.cli.console import print_json, progress, say, show_legs
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    JsonOption,
    MechanismArgument,
    MethodOption,
    OverwriteOption,
    RowsOption,
    SeedOption,
)
from symkin.cli.output_files import OutputFiles
from symkin.cli.units import numbers


@with_example("symkin plan 3RRR --out plan.csv")
def plan(
    mechanism: MechanismArgument,
    out: Annotated[Path, typer.Option(metavar="FILE", help="The plan: CSV, or Parquet.")],
    poses: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            max=10**6,
            help="Poses to measure for each leg; by default the mechanism's.",
        ),
    ] = None,
    candidates: CandidatesOption = None,
    rows: RowsOption = "paper",
    method: MethodOption = "exchange",
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Choose the poses to measure.

    Poses are chosen from the workspace for the reference leg, so that they show its parameters
    best, and carried to the other legs by the symmetry. Every leg gets spares too, for poses that
    the robot cannot take.
    """
    from symkin.documents import plan_document

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        with OutputFiles("plan", [loaded.source], overwrite) as outputs:
            target = outputs.file(out)
            stage("sampling the workspace")
            sample = symkin.sample_workspace(loaded, candidates, seed)
            stage("selecting poses")
            made = symkin.make_plan(loaded, sample.poses, poses, seed, rows=rows, method=method)
            symkin.write_plan(made, target, loaded)
    document = {
        "command": "plan",
        "mechanism": loaded.name,
        "candidates": len(sample.poses),
        "plan": plan_document(loaded, made),
        "file": out,
    }
    if as_json:
        print_json(document)
    else:
        _show(document)


def _show(document: dict[str, Any]) -> None:
    chosen = document["plan"]
    legs = chosen["legs"]
    say(
        f"{document['mechanism']}: {chosen['poses']} poses and {chosen['spares']} spares, "
        f"chosen from {document['candidates']} candidates"
    )
    show_legs(
        "|R_ii|",
        [
            (name, numbers([leg["r_diagonal"][name] for leg in legs]))
            for name in legs[0]["r_diagonal"]
        ]
        + [
            ("O1", numbers([leg["indices"]["O1"] for leg in legs])),
            ("poses", [str(leg["poses"]) for leg in legs]),
            ("spares", [str(leg["spares"]) for leg in legs]),
        ],
    )
    say()
    say(f"written: {document['file']}")
