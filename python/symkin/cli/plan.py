# SPDX-License-Identifier: MIT
"""``symkin plan``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

import symkin
from symkin.cli.console import print_json, progress, say
from symkin.cli.help import with_example
from symkin.cli.options import (
    CandidatesOption,
    ColumnsOption,
    CriterionOption,
    DesignOption,
    JsonOption,
    MarginSigmasOption,
    MechanismArgument,
    MethodOption,
    OverwriteOption,
    PoseCountOption,
    RowsOption,
    SeedOption,
    ThreadsOption,
)
from symkin.cli.plan_options import AvoidOption, MinimumDistanceOption, length, regions
from symkin.cli.unknown_options import (
    NO_PLANE,
    AnchorOption,
    BaseOption,
    FixedOption,
    FramesOption,
    FreeOption,
    ObserveOption,
    PlaneOption,
    PointOption,
    PriorOption,
    SensorOption,
    SharedOption,
    TargetOption,
    planned,
    unknowns,
)
from symkin.io.output_files import OutputFiles
from symkin.planning.probing import is_probing, write_bed_points

_FILES = ("plan.csv", "plan.json", "plan.html")
_POINTS = "points.csv"


@with_example(
    "symkin plan 3RRR --out planned",
    "symkin plan 3RRR --out orbits --design orbits --avoid y=0.3:",
    "symkin plan linear_delta --out probe --observe height",
    "symkin plan 3RRR --out seen --design mechanism --observe position --prior tolerances",
)
def plan(
    mechanism: MechanismArgument,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for plan.csv, plan.json and plan.html.")
    ],
    pose_count: PoseCountOption = None,
    candidates: CandidatesOption = None,
    design: DesignOption = "legs",
    rows: RowsOption = "noise_aware",
    criterion: CriterionOption = "O1",
    method: MethodOption = "exchange",
    required: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Table of poses that must be measured; they count among the poses of every leg.",
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Measurements that exist already, to which poses are added."
        ),
    ] = None,
    columns: ColumnsOption = None,
    observe: ObserveOption = None,
    base: BaseOption = None,
    target: TargetOption = None,
    point: PointOption = None,
    anchor: AnchorOption = None,
    plane: PlaneOption = NO_PLANE,
    free: FreeOption = None,
    fixed: FixedOption = None,
    shared: SharedOption = None,
    prior: PriorOption = None,
    frames: FramesOption = None,
    sensor: SensorOption = None,
    avoid: AvoidOption = None,
    minimum_distance: MinimumDistanceOption = "0",
    margin_sigmas: MarginSigmasOption = 3.0,
    symmetry: Annotated[
        bool,
        typer.Option(
            "--symmetry/--no-symmetry",
            help="Choose for the reference leg alone, or for every leg by itself.",
        ),
    ] = True,
    visit: Annotated[
        Literal["sets", "travel"],
        typer.Option(help="Order of the rows: a short way from home, or set by set."),
    ] = "travel",
    spares: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=0, help="Spares of each selection; by default half as many as poses."
        ),
    ] = None,
    time_limit: Annotated[
        float,
        typer.Option(metavar="S", min=0, help="Seconds for the proof of the method exhaustive."),
    ] = 10.0,
    threads: ThreadsOption = 0,
    seed: SeedOption = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Choose the poses to measure.

    Poses are chosen from the workspace for the reference leg, so that they show its parameters
    best, and carried to the other legs by the symmetry. Every set gets spares too, for poses that
    the robot cannot take.

    With --observe, or unknowns as `symkin identify` has them, poses are chosen for what will be
    observed and is unknown then, all at once (--design mechanism). Priors count as information that
    is there beforehand. With --observe height alone a delta probes its bed: points.csv has x and y,
    in mm, of where to touch it.

    The certificate printed is a proven bound: no set of so many poses exceeds the efficiency 1.
    """
    from symkin.io.mechanism_file import load_columns
    from symkin.io.plans import read_pose_list
    from symkin.io.results import write_results

    with progress() as stage:
        stage("reading the mechanism")
        loaded = symkin.load_mechanism(mechanism)
        mapping = load_columns(columns) if columns else None
        needed = read_pose_list(required, loaded) if required else None
        taken = symkin.read_measurements(measured, loaded, mapping) if measured else None
        limits = regions(avoid or [])
        distance = length(minimum_distance, "--minimum-distance")
        seen = planned(loaded, observe, base, target, point, anchor, plane)
        probing = seen is not None and is_probing(loaded, seen)
        files = (*_FILES, _POINTS) if probing else _FILES
        with OutputFiles([loaded.source, required, measured, columns], overwrite) as outputs:
            folder = outputs.folder(out, *files)
            stage("sampling the workspace")
            sample = symkin.sample_workspace(loaded, candidates, seed)
            stage("selecting poses")
            made = symkin.make_plan(
                loaded,
                sample,
                pose_count,
                seed,
                design=design,
                rows=rows,
                criterion=criterion,
                method=method,
                required=needed,
                measured=taken,
                avoid=limits,
                minimum_distance=distance,
                margin_sigmas=margin_sigmas,
                use_symmetry=symmetry,
                visit=visit,
                spares=spares,
                time_limit=time_limit,
                threads=threads,
                observe=seen,
                **unknowns(free, fixed, shared, prior, frames, sensor),
            )
            document = {"command": "plan", **made.to_dict()}
            stage("writing the report")
            made.save(folder / "plan.csv")
            if probing:
                write_bed_points(made, folder / _POINTS)
            write_results(document, folder / "plan.json")
            made.report(folder / "plan.html")
    if as_json:
        print_json(document)
    else:
        say(f"{made.text()}\n\nWritten: {', '.join(str(out / name) for name in files)}")
