# SPDX-License-Identifier: MIT
"""``symkin plan``, ``pose-count``, ``simulate``, ``run`` and ``study``: the protocol, its parts."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import symkin
from symkin.analysis.observed import Observed
from symkin.cli.console import (
    JsonOption,
    Telling,
    not_converged,
    print_result,
    progress,
    progress_bar,
    searching,
    write_result,
    write_result_then_report,
)
from symkin.cli.options import (
    AccuracyOption,
    AvoidOption,
    Choosing,
    ChoosingForPlan,
    ColumnsOption,
    Measured,
    MechanismArgument,
    Observing,
    Unknown,
    accuracies_of,
    argument,
    columns_of,
    command,
    folder_of,
    length_of,
    of,
    option,
    refuse_unless,
    region_of,
    share_of,
    sizes_of,
)
from symkin.data.pose_tables import read_pose_list
from symkin.errors import SymkinError
from symkin.options import Estimator, Format, PoseUse, Visit
from symkin.pipeline import ProtocolResult
from symkin.planning import NeededPoses, Plan, PoseCountCurve
from symkin.planning.observing import is_probing
from symkin.planning.plan_files import klipper_points, write_bed_points
from symkin.planning.simulation import Simulation
from symkin.storage.output_files import OutputFiles
from symkin.study import StudyResult, builtin_studies, builtin_text, load_study, run_study

_PLAN_FILES = ("plan.csv", "plan.json", "plan.html")
_POINTS = ("points.csv", "points.cfg")  # the table, and the same for Klipper
_COUNT_FILES = ("pose-count.json", "pose-count.html")


@command(
    "symkin plan 3RRR --out planned",
    "symkin plan 3RRR --out orbits --design orbits --avoid y=0.3:",
    "symkin plan linear_delta --out probe --observe height",
    "symkin plan 3RRR --out seen --design mechanism --observe position --prior tolerances",
)
def plan(
    *,
    mechanism: MechanismArgument,
    out: Annotated[Path, folder_of("plan.csv, plan.json and plan.html")],
    pose_count: int | None = None,
    candidates: int | None = None,
    choosing: ChoosingForPlan,
    required: Annotated[
        Path | None,
        option(
            "FILE",
            "Table of poses that must be measured; they count among the poses of every leg.",
            like="candidates",
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        option(
            "FILE", "Measurements that exist already, to which poses are added.", like="candidates"
        ),
    ] = None,
    columns: ColumnsOption = None,
    ignore: list[str] | None = None,
    robot: str | None = None,
    by: Measured,
    seen: Observing,
    unknown: Unknown,
    avoid: AvoidOption = None,
    minimum_distance: str = "0",
    symmetry: Annotated[bool, of("symmetry", "--symmetry/--no-symmetry")] = True,
    visit: Visit | None = None,
    spares: int | None = None,
    time_limit: float | None = None,
    confidence: str = "0.95",
    threads: int = 0,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Choose the poses to measure.

    Poses are chosen from the workspace for the reference leg, so that they show its parameters
    best, and carried to the other legs by the symmetry. Every set gets spares too, for poses that
    the robot cannot take.

    With --observe, or unknowns as `symkin identify` has them, poses are chosen for what will be
    observed and is unknown then, all at once (--design mechanism). Priors count as information that
    is there beforehand. With --observe height alone a delta probes its bed: points.csv has x and y,
    in mm, of where to touch it, and points.cfg the same as Klipper's option "points".

    The certificate printed is a proven bound: no set of so many poses exceeds the efficiency 1.
    """
    _refuse_unused_count(choosing, pose_count, spares)
    share = share_of(confidence, "confidence")
    refuse_unless(
        columns is None or measured is not None,
        "--columns says how to read measurements; it goes with --measured alone",
    )
    refuse_unless(ignore is None or measured is not None, "--ignore goes with --measured alone")
    refuse_unless(robot is None or measured is not None, "--robot goes with --measured alone")
    refuse_unless(
        time_limit is None or choosing.method == "exhaustive",
        "--time-limit goes with --method exhaustive alone",
    )
    with progress() as stage:
        stage("reading the mechanism")
        loaded = by.on(symkin.load_mechanism(mechanism))
        mapping = columns_of(columns)
        needed = read_pose_list(required, loaded) if required else None
        taken = (
            symkin.read_measurements(measured, loaded, mapping, ignore=ignore or (), robot=robot)
            if measured
            else None
        )
        limits = [region_of(text) for text in avoid or ()]
        distance = length_of(minimum_distance, "--minimum-distance")
        observe = seen.planned(loaded)
        probing = is_probing(loaded, observe)
        refuse_unless(
            symmetry or (choosing.design in (None, "legs") and not probing),
            "--no-symmetry chooses a set of poses for every leg by itself; it goes with --design "
            "legs alone",
        )
        files = (*_POINTS, *_PLAN_FILES) if probing else _PLAN_FILES
        with OutputFiles([*loaded.files, required, measured, columns], overwrite) as outputs:
            folder = outputs.folder(out, *_POINTS, *_PLAN_FILES)
            stage("sampling the workspace")
            sample = symkin.sample_workspace(loaded, candidates, seed)
            stage("selecting poses")
            made = symkin.make_plan(
                loaded,
                sample,
                pose_count,
                seed,
                required=needed,
                measured=taken,
                avoid=limits,
                minimum_distance=distance,
                symmetry=symmetry,
                visit=visit,
                spares=spares,
                time_limit=time_limit,
                threads=threads,
                confidence=share,
                observe=observe,
                **vars(choosing),
                **unknown.arguments(),
            )
            document = {"command": "plan", **made.to_dict()}
            stage("writing the report")
            made.save(folder / "plan.csv")
            if probing:
                write_bed_points(made, folder / _POINTS[0])
                (folder / _POINTS[1]).write_text(
                    klipper_points(made), encoding="utf-8", newline="\n"
                )
            write_result(made, telling, document, folder, "plan")
    print_result(made, telling, out, files, document)


@command(
    "symkin pose-count 3RRR --out counted",
    "symkin pose-count 3RRR --accuracy 0.05mm",
    "symkin pose-count 3RRR --accuracy 0.05mm --confidence 99%",
)
def pose_count(
    *,
    mechanism: MechanismArgument,
    out: Annotated[Path | None, folder_of("pose-count.json and pose-count.html")] = None,
    accuracy: AccuracyOption = None,
    confidence: str = "0.95",
    least_gain: float = 0.02,
    estimator: Estimator | None = None,
    poses: PoseUse = "all",
    candidates: int | None = None,
    choosing: Choosing,
    by: Measured,
    seen: Observing,
    unknown: Unknown,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Predict how many poses are enough.

    For numbers of poses from that of a leg's parameters to ten times as many, poses are selected,
    and the end-effector error after identification is predicted from the declared noise: what such
    robots have on average, and what --confidence of them are within. With --accuracy, the fewest
    poses are found with which so many are; if they are too many, what else would help.
    With --observe, or unknowns as `symkin identify` has them, for what is observed and unknown then
    (--design mechanism).
    """
    wanted, share = accuracies_of(accuracy), share_of(confidence, "confidence")
    with progress_bar() as tell:
        tell("reading the mechanism", 0.0)
        loaded = by.on(symkin.load_mechanism(mechanism))
        with OutputFiles(loaded.files, overwrite) as outputs:
            folder = outputs.folder(out, *_COUNT_FILES) if out else None
            tell("sampling the workspace", 0.0)
            sample = symkin.sample_workspace(loaded, candidates, seed)
            curve = symkin.pose_count_curve(
                loaded,
                sample,
                seed=seed,
                estimator=estimator,
                poses=poses,
                least_gain=least_gain,
                confidence=share,
                observe=seen.planned(loaded),
                progress=tell,
                **vars(choosing),
                **unknown.arguments(),
            )
            result: PoseCountCurve | NeededPoses = curve
            if accuracy:
                tell("looking for the number of poses", 1.0)
                result = curve.for_accuracy(*wanted)
            document = {"command": "pose-count", **result.to_dict()}
            if folder is not None:
                write_result(result, telling, document, folder, "pose-count")
    print_result(result, telling, out, _COUNT_FILES, document)


def _refuse_unused_count(
    choosing: ChoosingForPlan, pose_count: int | None, spares: int | None = None
) -> None:
    """Refuse numbers of poses beside the method that takes whatever may be measured."""
    refuse_unless(
        choosing.method != "all" or (pose_count is None and not spares),
        "--method all takes every candidate; --pose-count and --spares go with the other methods",
    )


def _made_for(path: Path, plan: Plan) -> Observed | None:
    """What will be observed at a plan's poses, by the result that was written beside its table."""
    beside = path.with_name("plan.json")
    try:
        found = symkin.read_result(beside) if beside.exists() else None
    except SymkinError:
        return None  # of another version
    if not isinstance(found, Plan) or found.basis is None or found.basis.survey is None:
        return None
    same = found.poses.shape == plan.poses.shape and np.allclose(
        found.poses, plan.poses, rtol=0, atol=1e-8
    )
    return found.basis.survey.observed if same else None


@command(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --seed 2 --out second",
    "symkin simulate 3RRR --plan out/plan.csv --observe position --missing 0.2 --out third",
    "symkin simulate 3RRR --plan out/plan.csv --changes 'leg2.drift=1 mrad' --out fourth",
)
def simulate(
    *,
    mechanism: MechanismArgument,
    plan: Annotated[Path, option("FILE", "A plan of `symkin plan`.")],
    out: Annotated[Path, folder_of("measurements.csv and actual.toml, the robot")],
    actual: Annotated[
        str | None,
        option("FILE", "The robot as made, such as actual.toml of another simulation."),
    ] = None,
    by: Measured,
    seen: Observing,
    changes: list[str] | None = None,
    missing: float = 0.0,
    spread: float = 0.0,
    seed: int | None = None,
    overwrite: bool = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate the measurements of a plan.

    A robot is made that differs from the mechanism within its tolerances, or is the one that
    --actual gives. It takes the poses of the plan and is measured with its noise. Poses that it
    cannot take are replaced by spares. Without a word what is observed is what the plan was made
    for, as plan.json beside it has it. Frames and points may have units: '1 m, 20 cm,
    170 deg'. With --changes something changes meanwhile, which `symkin identify` finds.
    """
    with progress() as stage:
        stage("reading the mechanism and the plan")
        loaded = by.on(symkin.load_mechanism(mechanism))
        commanded = symkin.read_plan(plan, loaded)
        observe = _made_for(plan, commanded) if seen == Observing() else None
        if observe is None:
            observe = seen.observed(loaded)
        observe = dataclasses.replace(observe, missing=missing, spread=spread)
        robot = symkin.load_mechanism(actual) if actual is not None else None
        inputs = [*loaded.files, *(robot.files if robot else ()), plan]
        with OutputFiles(inputs, overwrite) as outputs:
            folder = outputs.folder(out, *Simulation.FILES)
            stage("simulating measurements")
            expected = 'names with a size each, such as "leg2.drift=1 mrad"'
            changed = sizes_of(changes, "--changes", expected)
            simulation = symkin.simulate(
                loaded, commanded, seed, robot, observe=observe, changes=changed
            )
            simulation.write(folder)
    print_result(simulation, Telling(as_json=as_json), out, Simulation.FILES)


@command("symkin run 3RRR --out out")
def run(
    *,
    mechanism: MechanismArgument,
    out: Annotated[Path, folder_of("all files of the run")],
    estimator: Estimator | None = None,
    poses: PoseUse = "all",
    choosing: ChoosingForPlan,
    pose_count: int | None = None,
    by: Measured,
    candidates: int | None = None,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Run all of it on a simulated robot, and write a report.

    Writes plan.csv, measurements.csv, actual.toml (the simulated robot), calibrated.toml,
    results.json and report.html. The last line printed is the report's path.
    """
    _refuse_unused_count(choosing, pose_count)
    with progress() as stage:
        stage("reading the mechanism")
        nominal = by.on(symkin.load_mechanism(mechanism))
        given = {"pose_count": pose_count, "candidates": candidates}
        changes = {name: value for name, value in given.items() if value is not None}
        nominal = nominal.replace(protocol=dataclasses.replace(nominal.protocol, **changes))
        with OutputFiles(nominal.files, overwrite) as outputs, searching(stage):
            target = outputs.folder(out, *ProtocolResult.SOMETIMES, *ProtocolResult.FILES)
            result = symkin.run_protocol(
                nominal,
                estimator=estimator,
                poses=poses,
                **vars(choosing),
                seed=seed,
                progress=stage,
            )
            stage("looking for what speaks against it")
            _ = result.identification.doubts  # which are found when they are asked for, and kept
            stage("writing the report")
            telling = write_result_then_report(result, target, telling)
    print_result(result, telling, out, ProtocolResult.FILES)
    if not result.identification.converged:
        not_converged(result.identification.failure)


def _builtin(incomplete: str) -> list[str]:
    return [name for name in builtin_studies() if name.startswith(incomplete)]


@command(
    "symkin study protocols --accuracy 0.05mm --workers 2 --out studied",
    "symkin study --show protocols > mine.toml",
)
def study(
    *,
    name: Annotated[
        str | None,
        argument(
            "[NAME|FILE]",
            "A study file, or a built-in study: protocols, cost, symmetry, or paper.",
            autocompletion=_builtin,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        option("DIR", "Folder for the table, results.json, report.html and, while it runs, parts."),
    ] = None,
    show: Annotated[
        str | None,
        option(
            "NAME",
            "Print the file of a built-in study, to begin one's own with.",
            autocompletion=_builtin,
        ),
    ] = None,
    mechanism: Annotated[
        list[str] | None,
        option(
            "MECHANISM",
            "Instead of those of the study; a file or a name. May be given several times.",
        ),
    ] = None,
    robots: int | None = None,
    accuracy: AccuracyOption = None,
    confidence: str = "0.95",
    workers: int = 1,
    scheduler: str | None = None,
    format: Format = "csv",  # noqa: A002  # the option's name
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Compare protocols on the same simulated robots.

    A study is a TOML file of lists: mechanisms, designs, rows, criteria, estimators, numbers of
    poses, noise. Every combination is a cell; all cells have the same robots and the same noise.
    The same command continues a study that was killed, and adds robots to one that has fewer. The
    same seed gives the same table, byte for byte, on any number of processes or machines.
    """
    if show is not None:
        others = (
            name, out, mechanism, robots, accuracy, confidence != "0.95", workers > 1, scheduler,
            format != "csv", overwrite, telling != Telling(),
        )  # fmt: skip
        refuse_unless(
            not any(others), "--show prints a study; expected no other study and no other option"
        )
        sys.stdout.write(builtin_text(show))
        return
    if name is None:
        raise typer.BadParameter("a study is missing: expected its name or file, or --show NAME")
    if out is None:
        raise typer.BadParameter("is missing: expected a folder", param_hint="--out")
    definition = load_study(name)
    refuse_unless(
        robots is None or definition.kind != "cost",
        f"--robots simulates robots, and {definition.name} is a study of cost, which has none",
    )
    changes = {"mechanisms": tuple(mechanism) if mechanism else None, "robots": robots}
    definition = definition.replace(**{key: each for key, each in changes.items() if each})
    wanted, share = accuracies_of(accuracy), share_of(confidence, "confidence")
    if accuracy and definition.kind != "accuracy":
        raise typer.BadParameter(
            f"goes with a study of accuracy, and {definition.name} is one of {definition.kind}",
            param_hint="--accuracy",
        )
    with progress_bar() as tell:
        result = run_study(
            definition,
            out,
            workers=workers,
            scheduler=scheduler,
            format=format,
            progress=tell,
            overwrite=overwrite,
        )
        if accuracy and isinstance(result, StudyResult):
            tell("looking for the cheapest protocol", 1.0)
            result = result.for_accuracy(*wanted, share)
        tell("writing the report", 1.0)
        report = result.write(out, overwrite=True, report=telling.report)
    print_result(result, telling, out, (report.name,))
