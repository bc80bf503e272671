# SPDX-License-Identifier: MIT
"""The table of all options."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, Literal

from symkin.options.option import Option
from symkin.options.words import (
    Coordinates,
    Criterion,
    Design,
    Estimator,
    Format,
    Frame,
    Gauge,
    Judge,
    Loss,
    LossPer,
    Moving,
    Observable,
    Platform,
    PoseUse,
    RowKind,
    SelectionMethod,
    Sensor,
    SessionsOwn,
    Visit,
)

# Titles of the groups that the short help leaves out
_CHOOSING = "How poses are chosen"
_OBSERVING = "What is observed, and where things stand"
_UNKNOWN = "What is unknown"
_FITTING = "How it is fitted"
_COMPUTING = "How it is computed"
_TABLES = "How tables are read"

# fmt: off
_ALL = (
    # Of all commands
    Option("seed", int, metavar="N", least=0, most=2**63 - 1, seldom=_COMPUTING,
           help="Of all that is random; by default the mechanism's. Same seed, same bytes."),
    Option("threads", int, default=0, metavar="N", least=0, most=1024, seldom=_COMPUTING,
           help="0 for all; the result is always the same."),
    Option("workers", int, default=1, metavar="N", least=1, most=1024, seldom=_COMPUTING,
           help="Processes on this machine; more than 1 need Dask."),
    Option("scheduler", str, metavar="ADDRESS", seldom=_COMPUTING,
           help="A running Dask scheduler, whose workers compute: tcp://host:8786."),
    Option("overwrite", bool, default=False,
           help="Replace the files of an earlier run, or remove those not written again; never one "
                "that is read."),
    Option("report", bool, default=True,
           help="Draw the page, which takes as long as all else."),
    Option("all_figures", bool, default=False,
           help="Draw the page's figures for details too, which that of a good result leaves out."),
    Option("units", str, default="", metavar="UNITS",
           help="Tell lengths and angles in these units, such as mm,mrad or m,rad, and tables "
                "too; by default mm and degrees, and tables in m and rad."),
    Option("ignore", list[str], metavar="COLUMN", seldom=_TABLES,
           help="A column of the measurements that is left out on purpose. May be given several "
                "times."),
    Option("robot", str, metavar="NAME", seldom=_TABLES,
           help="Of a table of many robots, the one whose rows are read, by its name in the column "
                "robot (or serial, SN, ...)."),
    # How poses are chosen
    Option("pose_count", int, metavar="N", least=1, most=10**6,
           help="Poses that each leg is identified from; by default the mechanism's."),
    Option("candidates", int, metavar="N", least=1, most=10**7, objects=True, seldom=_CHOOSING,
           help="Poses drawn from the workspace; by default the mechanism's."),
    Option("design", Design,
           help="A set of poses for each leg, the default; whole orbits of poses under the "
                "symmetry, N in all, which every leg uses; or N poses in all, chosen for all legs"
                " at once, the default where what is observed or unknown needs it."),
    Option("rows", RowKind, default="noise_aware", seldom=_CHOOSING,
           help="What a pose is worth to the selection: the paper's dg/dparam, or the closures' "
                "derivatives weighted by the declared noise."),
    Option("criterion", Criterion, default="O1", seldom=_CHOOSING,
           help="Observability index to maximise, or the expected end-effector error to minimise."),
    Option("method", SelectionMethod, default="exchange", seldom=_CHOOSING,
           help="Exchange; Sun and Hollerbach's; exchange with a proof; or a baseline."),
    Option("margin_sigmas", float, default=3.0, metavar="K", least=0, seldom=_CHOOSING,
           help="Keep poses K standard deviations of what the tolerances do away from the end of "
                "a leg's reach and from singularities, if that is more than the mechanism's "
                "margins."),
    Option("minimum_distance", float, default=0.0, metavar="LENGTH", least=0, unit="m",
           seldom=_CHOOSING,
           help="Between the positions of any two poses of a set, such as 0.05 or 5cm."),
    Option("symmetry", bool, default=True, seldom=_CHOOSING,
           help="Choose for the reference leg alone, or for every leg by itself."),
    Option("visit", Visit, seldom=_CHOOSING,
           help="Order of the rows: a short way from home, every second pose going and the others "
                "coming back, which shows a drift, the default without a device; the shortest way; "
                "or set by set."),
    Option("spares", int, metavar="N", least=0, seldom=_CHOOSING,
           help="Spares of each selection; by default half as many as poses."),
    Option("time_limit", float, metavar="S", least=0, seldom=_CHOOSING,
           help="Seconds for the proof of the method exhaustive; by default 10."),
    Option("least_gain", float, default=0.02, metavar="SHARE", least=0, most=1, seldom=_CHOOSING,
           help="Of the position error, that another pose must save to be worth while."),
    Option("confidence", float, default=0.95, metavar="SHARE", least=0.5, most=0.9999, unit="1",
           seldom=_FITTING,
           help="Of all such robots, that shall keep the accuracy, such as 0.95 or 95%."),
    Option("of", Coordinates, seldom=_CHOOSING,
           help="Coordinates, in the device's frame, that the accuracy of the position is of: z, "
                "xy, ..., or the height above the bed that a probe touches; by default all."),
    # What is observed
    Option("observe", list[Observable], metavar="KIND", objects=True,
           help="What is observed: pose (the default), position, orientation, straightness "
                "(offsets from a straightedge, the device's x axis), points, distance, height, "
                "attitude (roll, pitch and yaw), tilt (without yaw), reported (the platform's pose "
                "by the controller), or readings alone; between rows 1 and 2, 3 and 4, ...: "
                "separation, rise, offset. May be repeated."),
    Option("missing", float, default=0.0, metavar="FRACTION", least=0, most=1, seldom=_OBSERVING,
           help="Of the readings, that are not taken."),
    Option("spread", float, default=0.0, metavar="S", least=0, most=3, seldom=_OBSERVING,
           help="Times exp(S z), z normal, the noise differs from row to row; the table says it."),
    Option("device_kind", str, metavar="KIND",
           help="What measures, with its typical noise and what is unknown then, instead of the "
                "file's: a name of `symkin list --devices`, such as 'laser tracker'."),
    # What is unknown
    Option("free", list[str], metavar="PATTERN",
           help="Unknown, and nothing else: names such as leg2.base_radius or base.x with * and "
                "?; without a dot, in any leg. By default all parameters of all legs."),
    Option("fixed", list[str], metavar="PATTERN",
           help="Held, whatever else says so."),
    Option("shared", list[str], metavar="PATTERN", seldom=_UNKNOWN,
           help="Changed together in all legs that match; mirror images by opposite amounts."),
    Option("tie", list[str], metavar="EQUATION", seldom=_UNKNOWN,
           help="Parameters that follow others: 'leg1.distal_length = leg2.distal_length', with "
                "factors and sums ('... = 0.2 m'), nearly ('... within 10 um'); may be repeated."),
    Option("prior", dict, metavar="PRIOR", objects=True,
           help="'tolerances'; 'fitted', these times a scale and with the share that legs have in "
                "common, as measured; or PATTERN=DEVIATION about the drawing: 'base.*=1 mm'."),
    Option("frames", list[Frame], metavar="FRAME",
           help="Unknown: base, target, points, anchors or plane. May be given several times, as "
                "may the patterns, or several in one, with commas."),
    Option("sensor", Sensor, seldom=_UNKNOWN,
           help="What sensors may do besides a straight line: bend, or err once a turn."),
    Option("drift", list[Moving], metavar="WHAT", seldom=_UNKNOWN,
           help="What may drift with time (column time_s, or row by row): leg, what each sensor "
                "shows; frame, where the robot stands to the measuring device."),
    Option("step", list[str], metavar="ROW", objects=True, seldom=_UNKNOWN,
           help="A row from which on what each sensor shows may be different, such as 63; or "
                "frame:63. May be given several times."),
    Option("growth", bool, seldom=_UNKNOWN,
           help="All lengths may grow alike with the temperature (column temperature_c), or else "
                "with time."),
    Option("backlash", bool, seldom=_UNKNOWN,
           help="Each leg may come to rest elsewhere from above than from below (columns "
                "approach_1 and so on, or the reading before)."),
    Option("clock_offset", bool, seldom=_UNKNOWN,
           help="The device may see the robot where it was some time before the readings, in "
                "samples taken while it moved (columns velocity_x_m_s of the target, or "
                "speed_1_rad_s of the readings)."),
    Option("sessions", list[SessionsOwn], metavar="WHAT", seldom=_UNKNOWN,
           help="What every session (column session, or each of several files) has of its own: "
                "offsets of the sensors, frames (where the robot stands to the measuring device), "
                "noise."),
    Option("bow", str, metavar="SIZE", objects=True, seldom=_UNKNOWN,
           help="The probed bed may not be flat: how far its rim may be above its middle, as a "
                "standard deviation, such as 0.2mm. It is estimated then."),
    Option("changes", dict, metavar="NAME=SIZE", objects=True, seldom=_OBSERVING,
           help="What changes while the robot is measured, by the names of the unknowns: "
                "leg2.drift=1 mrad, drift.x=0.1 mm, leg1.step40=1 mrad, growth=5e-5, "
                "backlash=0.2 mrad, leg1.session1=1 mrad, session1.x=1 mm, session1.noise=2 "
                "(times as large)."),
    Option("gauge", Gauge, seldom=_UNKNOWN,
           help="What settles combinations that no observation shows: the tolerances as priors; "
                "the nearest to the drawing; or as few held parameters as will do."),
    Option("loss_per", LossPer, seldom=_FITTING,
           help="Whether a blunder spoils its pose, or is found and left out alone."),
    Option("assume", dict, metavar="NAME=DEVIATION", objects=True, seldom=_UNKNOWN,
           help="How far what is held may be from what is assumed, such as 'target=0.5 mm', "
                "scale=1e-4 (of the measuring device), 'bed=0.1 mm' (its rim above its middle), "
                "'sag=0.1 mm' (of the outermost pose below the middle), tolerances=1 (times the "
                "tolerance of all that is held of legs) or a pattern of parameters; may be given "
                "several times."),
    # How it is estimated
    Option("estimator", Estimator,
           help="Whitened closures of each leg, the default; the paper's Gauss-Newton on g - psi;"
                " the same cost by Levenberg-Marquardt; or all together, the default where it is "
                "needed."),
    Option("poses", PoseUse, default="all", seldom=_FITTING,
           help="Whether a leg uses all poses, or only its own set, as in the paper."),
    Option("loss", Loss, default="none",
           help="Robust loss against outliers; robust is Cauchy's, which protects best."),
    Option("loss_scale", float, metavar="S", least=1e-9, seldom=_FITTING,
           help="Where the loss bends, in standard deviations; by default where it keeps 95% "
                "efficiency."),
    Option("noise", str, metavar="NOISE", objects=True,
           help="'estimate': with the unknowns, where there are measurements; or standard "
                "deviations, such as 'position=20 um,reading=10 urad'; by default the "
                "mechanism's."),
    Option("max_iterations", int, default=100, metavar="N", least=1, most=10**9, seldom=_FITTING,
           help="Steps after which a solver gives up."),
    # Of single commands
    Option("judge", Judge, default="rms",
           help="What must be within the tolerance: the root mean square over the poses, or the "
                "largest error, the accuracy at every pose."),
    Option("tolerances", Literal["estimate"],
           help="Estimate what the workshop really makes: by which factors the robots deviate from "
                "the drawing, over its tolerances, by kind and by name."),
    Option("resolution", int, default=201, metavar="N", least=2, most=4000,
           help="Grid cells a side."),
    Option("count", int, default=100_000, metavar="N", least=1, most=10**8,
           help="Poses of the total workspace, and poses tested for each symmetry element."),
    Option("both_modes", bool, default=False,
           help="Show the legs' other working mode too, for comparison."),
    Option("robots", int, metavar="N", least=1, most=10**7,
           help="In each cell, instead of the study's."),
    Option("format", Format, default="csv",
           help="Of the table, a row a robot and cell."),
    Option("table", Format, default="csv",
           help="What the table is written as."),
    Option("grid", int, default=0, metavar="N", least=0, most=1000,
           help="Poses of a table along each coordinate; 0: 21, 11 or 5."),
    Option("length", float, default=1.0, metavar="M", least=1e-9,
           help="At which a rotation counts as much as a translation, m."),
    Option("platform", Platform, default="rigid",
           help="A platform that turns, a point that only moves in the plane (five-bar), one that"
                " moves in space and never turns (delta), or one that only turns (Agile Eye)."),
)
# fmt: on
OPTIONS: Mapping[str, Option] = {each.name: each for each in _ALL}


def flags_of(given: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return options as the command line has them: a flag and a value, again for each of many."""
    return [(OPTIONS[name].flag, each) for name, value in given.items() for each in _each_of(value)]


def _each_of(value: Any) -> Iterable[Any]:
    if dataclasses.is_dataclass(value):  # what is zero is as the mechanism has it
        value = {name: each for name, each in vars(value).items() if each}
    if isinstance(value, Mapping) and all(isinstance(each, str | float) for each in value.values()):
        return [f"{name}={each}" for name, each in value.items()]
    return value if isinstance(value, tuple | list) else (value,)


def checked(**given: object) -> None:
    """Refuse values that the options of these names cannot have; other names are passed over."""
    for name, value in given.items():
        if name in OPTIONS:
            OPTIONS[name].check(value)
