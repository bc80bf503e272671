# SPDX-License-Identifier: MIT
"""``symkin identify``, ``identify-batch`` and ``align``: what measurements say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer

import symkin
from symkin.analysis.alignment import poses_of_columns, poses_of_mechanism
from symkin.analysis.probing import with_printed_length
from symkin.cli.console import (
    Telling,
    kept,
    not_converged,
    print_result,
    progress,
    searching,
    write_result_then_report,
)
from symkin.cli.options import (
    ColumnsOption,
    Fitting,
    Measured,
    MechanismArgument,
    Unknown,
    argument,
    columns_of,
    command,
    folder_of,
    option,
    printed_length_of,
    refuse_unless,
    share_of,
    with_sensor_table,
)
from symkin.data.joining import joined
from symkin.estimate import Estimate
from symkin.estimate.estimate import CORRECTED, REDRAWN, save_corrections
from symkin.estimate.fleet import Fleet, identify_robots
from symkin.estimate.fleet_jobs import Robots
from symkin.estimate.fleet_sources import robots_of_files
from symkin.files.mechanism_file import read_mechanism
from symkin.options import Coordinates, Format, Gauge
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import read_table


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
        list[Path],
        argument(
            "MEASUREMENTS...",
            "Measured poses and readings, CSV or Parquet; several files are one session each.",
        ),
    ],
    columns: ColumnsOption = None,
    ignore: list[str] | None = None,
    robot: str | None = None,
    fitting: Fitting,
    unknown: Unknown,
    clock_offset: bool | None = None,
    of: Coordinates | None = None,
    sensor_table: Annotated[
        Path | None,
        option(
            "FILE",
            "What the sensors show and what straight ones would, of a certificate: CSV with "
            "columns reading_deg and joint_deg (any unit), and leg if they differ. By default "
            "what the mechanism's file says.",
            like="sensor",
        ),
    ] = None,
    printed: Annotated[
        str | None,
        option(
            "LENGTH",
            "A piece that a probed delta printed along x, centred, before it was calibrated: "
            "'100 mm = 100.12 mm', commanded and measured; with '+- 0.02 mm' behind, how well "
            "(by default 0.05 mm).",
        ),
    ] = None,
    gauge: Gauge | None = None,
    confidence: str = "0.95",
    by: Measured,
    cross_validate: Annotated[
        int | None, option("K", "Predict each of K parts of the poses from the others, too.", min=2)
    ] = None,
    cross_validate_blocks: Annotated[
        bool,
        typer.Option(
            "--cross-validate-blocks",
            help="The parts are blocks of consecutive poses, instead of poses drawn at random.",
        ),
    ] = False,
    out: Annotated[Path | None, folder_of("calibrated.toml, results.json and report.html")] = None,
    max_iterations: int = 100,
    seed: int | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Identify what is unknown of a robot from measurements.

    By default these are all parameters of all legs, one leg after the other from full poses. With
    other unknowns, frames or partial poses everything is estimated together.

    Where a probe touched a bed, heights are all that is known of the poses; the bed's plane is
    unknown then, and the tolerances are priors.
    """
    for option_, given in (
        ("--cross-validate-blocks", cross_validate_blocks or None),
        ("--seed", seed),
    ):
        refuse_unless(
            given is None or cross_validate is not None,
            f"{option_} goes with --cross-validate alone",
        )
    refuse_unless(
        seed is None or not cross_validate_blocks,
        "--seed draws parts at random, and --cross-validate-blocks says that they are blocks",
    )
    fitting.require_loss()
    share = share_of(confidence, "confidence")
    if printed and (unknown.free or unknown.frames):
        raise typer.BadParameter(
            "--printed leaves open where bed and ruler lay, which --free and --frames would say; "
            "hold parameters with --fixed instead"
        )
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = with_sensor_table(read_mechanism(mechanism), sensor_table)
        nominal = by.on(nominal, estimates=True)
        mapping = columns_of(columns)
        if mapping is not None:  # what is calibrated reads such tables by itself
            nominal = nominal.replace(measurement_columns=mapping)
        measured = joined([
            symkin.read_measurements(each, nominal, mapping, ignore=ignore or (), robot=robot)
            for each in measurements
        ])  # fmt: skip
        if printed is not None:
            measured = with_printed_length(nominal, measured, printed_length_of(printed))
        inputs = [*nominal.files, *measurements, columns, sensor_table]
        with (
            _correcting(nominal, out, inputs, overwrite=overwrite),
            OutputFiles(inputs, overwrite) as outputs,
            searching(stage),
        ):
            names = (*Estimate.SOMETIMES, *Estimate.FILES)
            target = outputs.folder(out, *names) if out else None
            stage("identifying")
            found = symkin.identify(
                nominal,
                measured,
                **vars(fitting),
                max_iterations=max_iterations,
                **unknown.arguments(),
                clock_offset=clock_offset,
                gauge=gauge,
                of=of,
                confidence=share,
                noise=by.estimated,
            )
            stage("looking for what speaks against it")
            _ = found.doubts  # which are found when they are asked for, and kept
            if cross_validate is not None:
                stage("cross-validating (Ctrl-C ends this, and keeps the estimate)")
                with kept("it is not cross-validated; the estimate is as without"):
                    found = found.cross_validated(
                        cross_validate, seed, blocks=cross_validate_blocks
                    )
            if target:
                stage("writing the report")
                telling = write_result_then_report(found, target, telling)
    print_result(found, telling, out, found.files)
    if not found.converged:
        not_converged(found.failure)


@contextmanager
def _correcting(
    nominal: symkin.Mechanism, out: Path | None, inputs: Sequence[Path | None], *, overwrite: bool
) -> Iterator[None]:
    """Write table and drawing without the mistake that lets nothing be identified, if it is one."""
    try:
        yield
    except symkin.SymkinError as error:
        made = {
            kind: name
            for kind, name, each in (
                ("table", CORRECTED, error.corrected),
                ("drawing", REDRAWN, error.redrawn),
            )
            if each is not None
        }
        if not made:
            raise
        names = list(made.values())
        what = " and ".join(f"the {kind} so corrected" for kind in made)
        are = "is" if len(made) == 1 else "are"
        if out is None:
            words = f"with --out DIR {what} {are} written as DIR/{' and DIR/'.join(names)}"
        else:
            with OutputFiles(inputs, overwrite) as outputs:
                folder = outputs.folder(out, *names)
                corrected = error.corrected, error.redrawn
                save_corrections(folder, nominal, error.likely_cause.words, *corrected)
            words = f"{what} {are} {' and '.join(str(out / name) for name in names)}"
        error.args = (f"{error}; {words}",)
        raise


@command(
    "symkin run 3RRR --out out",
    "symkin simulate 3RRR --plan out/plan.csv --seed 2 --out second",
    "symkin identify-batch 3RRR out/measurements.csv second/measurements.csv --out fleet",
)
def identify_batch(
    *,
    mechanism: MechanismArgument,
    files: Annotated[
        list[Path],
        argument(
            "FILES...",
            'Measurements, CSV or Parquet: a file a robot, or tables with a column "robot".',
        ),
    ],
    columns: ColumnsOption = None,
    ignore: list[str] | None = None,
    fitting: Fitting,
    unknown: Unknown,
    clock_offset: bool | None = None,
    of: Coordinates | None = None,
    gauge: Gauge | None = None,
    by: Measured,
    tolerances: Literal["estimate"] | None = None,
    out: Annotated[Path | None, folder_of("the table, a row a robot, and report.html")] = None,
    table: Format = "csv",
    max_iterations: int = 100,
    threads: int = 0,
    workers: int = 1,
    scheduler: str | None = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Identify many robots of one drawing, a row a robot.

    What is unknown is said as for identify, by options or the mechanism's file.
    """
    fitting.require_loss()
    refuse_unless(
        table == "csv" or out is not None, "--table says what is written in --out; expected both"
    )
    refuse_unless(
        workers == 1 or scheduler is None,
        "--workers are processes on this machine; expected them or --scheduler",
    )
    refuse_unless(
        threads == 0 or (workers == 1 and scheduler is None),
        "--threads are of this process, where --workers or --scheduler compute with one each",
    )
    with progress() as stage:
        stage("reading the mechanism and the measurements")
        nominal = by.on(read_mechanism(mechanism), estimates=True)
        inputs = [*nominal.files, *files, columns]
        with OutputFiles(inputs, overwrite) as outputs, searching(stage):
            target = outputs.folder(out, *Fleet.SOMETIMES, "report.html") if out else None
            mapping = columns_of(columns)
            if mapping is not None:
                nominal = nominal.replace(measurement_columns=mapping)

            def robots(whole: bool) -> Iterator[Robots]:
                met, left_out = 0, ignore or ()
                for part in robots_of_files(nominal, files, mapping, ignore=left_out, whole=whole):
                    met += len(part)
                    stage(f"identifying robots, {met} so far")
                    yield part

            found = identify_robots(
                nominal,
                robots,
                **vars(fitting),
                max_iterations=max_iterations,
                **unknown.arguments(),
                clock_offset=clock_offset,
                gauge=gauge,
                of=of,
                noise=by.estimated,
                tolerances=tolerances,
                threads=threads,
                workers=workers,
                scheduler=scheduler,
            )
            if target:
                stage("writing the table")
                telling = write_result_then_report(found, target, telling, table=table)
    names = (f"fleet.{table}", *[REDRAWN] * (found.redrawn is not None), "report.html")
    print_result(found, telling, out, names)
    failed = found.verdicts.count("failed")
    if failed:
        not_converged(f"{failed} of {len(found.robots)} robots; the table says why")


@command(
    "symkin run hexapod_jugglebot --out out",
    "symkin align out/measurements.csv --mechanism hexapod_jugglebot --out aligned",
)
def align(
    *,
    table: Annotated[
        Path,
        argument("TABLE", "Poses of the device and of the robot, row by row."),
    ],
    mechanism: Annotated[
        str | None,
        option(
            "MECHANISM",
            "The robot: its poses are those that the table's reported_ columns hold, or else "
            "of its forward kinematics at the readings.",
        ),
    ] = None,
    columns: ColumnsOption = None,
    ignore: list[str] | None = None,
    device: Annotated[
        str | None,
        option(
            "COLUMNS",
            "Without a mechanism, columns of the device's poses with commas: x, y, then an "
            "angle; or x, y, z, then a quaternion (x, y, z, w), rotation vector or three "
            "angles.",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        option(
            "COLUMNS",
            "Likewise, of the robot's own poses; with a mechanism the name of the robot whose rows "
            "are read, of a table of many.",
        ),
    ] = None,
    angles: Annotated[
        str | None,
        option(
            "AXES",
            "Three columns of the robot are angles about these axes: XYZ each about the axis "
            "as it has turned, xyz about fixed ones; by default a rotation vector.",
        ),
    ] = None,
    convention: Annotated[
        str | None,
        option(
            "WAY",
            "How the device's poses are meant: as measured, inverse, conjugate, scalar first, "
            "mirrored, or three angles as ZYX or 'xyz in degrees, inverse'; by default what fits "
            "best, and said.",
        ),
    ] = None,
    length: float = 1.0,
    out: Annotated[Path | None, folder_of("frames.toml, results.json and report.html")] = None,
    overwrite: bool = False,
    telling: Telling,
) -> None:
    """Find where a measuring device stands, and its target.

    The robot's geometry is trusted; identify finds frames and geometry together.
    """
    if mechanism is None and not (device and robot):
        raise typer.BadParameter("expected --mechanism, or --device and --robot")
    if mechanism is not None and (device or angles):
        raise typer.BadParameter("--device and --angles go without --mechanism")
    if mechanism is None and columns is not None:
        raise typer.BadParameter("--columns goes with --mechanism alone")
    refuse_unless(mechanism is not None or ignore is None, "--ignore goes with --mechanism alone")
    twice = {each.strip() for each in (device or "").split(",")}.intersection(
        each.strip() for each in (robot or "").split(",")
    )
    refuse_unless(
        not twice - {""},
        f"column {', '.join(sorted(twice))} is the device's and the robot's; expected columns of "
        "two measurements, since poses always agree with themselves",
    )
    model = None if mechanism is None else read_mechanism(mechanism)
    names = ("frames.toml", "results.json", "report.html")
    inputs = [table, columns, *(model.files if model else ())]
    with progress() as stage, OutputFiles(inputs, overwrite) as outputs:
        folder = outputs.folder(out, *names) if out else None
        stage("reading the poses")
        if model is not None:
            measured, own, points = poses_of_mechanism(
                model, table, columns_of(columns), ignore=ignore or (), robot=robot
            )
            space = model.pose_space
        else:
            read = read_table(table)
            measured = poses_of_columns(read, (device or "").split(","), triples=True)
            own = poses_of_columns(read, (robot or "").split(","), angles)
            space, points = "", None
        stage("aligning the frames")
        found = symkin.align_frames(
            measured, own, points, convention=convention, length=length, pose_space=space
        )
        if folder:
            (folder / names[0]).write_text(found.frames_text(), encoding="utf-8", newline="\n")
            found.save(folder / names[1])
            if telling.report:
                found.report(folder / names[2])
    print_result(found, telling, out, names)
