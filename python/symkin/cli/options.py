# SPDX-License-Identifier: MIT
"""Arguments and options that several commands share, alone and in groups.

A group is a dataclass of options: a command takes it as one parameter, see `command`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, get_type_hints

import typer

import symkin
from symkin.cli.option_values import (
    own_frames_of,
    priors_of,
    quantities_of,
    several_of,
)
from symkin.identification.fit import Estimator, Loss, PoseUse
from symkin.identification.unknowns import Sensor
from symkin.mechanism import Mechanism
from symkin.observability import RowKind
from symkin.planning import Design
from symkin.planning.observing import Unknowns
from symkin.planning.selection import Criterion, SelectionMethod
from symkin.settings import Frames
from symkin.simulation import Observed

Command = Callable[..., None]


def command(*examples: str) -> Callable[[Command], Command]:
    """Let parameters that are groups of options stand for these, and add examples to the help."""

    def made(function: Command) -> Command:
        parameters = inspect.signature(function, eval_str=True).parameters
        groups = {
            name: {each.name: each for each in dataclasses.fields(parameter.annotation)}
            for name, parameter in parameters.items()
            if dataclasses.is_dataclass(parameter.annotation)
        }
        flat: list[inspect.Parameter] = []
        for name, parameter in parameters.items():
            if name not in groups:
                flat.append(parameter)
                continue
            types = get_type_hints(parameter.annotation, include_extras=True)
            flat += [
                parameter.replace(name=each, default=option.default, annotation=types[each])
                for each, option in groups[name].items()
            ]

        @functools.wraps(function)
        def called(**given: object) -> None:
            for name, options in groups.items():
                kind = parameters[name].annotation
                given[name] = kind(**{each: given.pop(each) for each in options})
            function(**given)

        called.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
        called.__annotations__ = {each.name: each.annotation for each in flat}
        text = inspect.cleandoc(function.__doc__ or "")
        example = "\n".join(f"  {line}" for line in examples)
        # A line with a backspace alone tells typer not to fill the paragraph that follows.
        called.__doc__ = f"{text}\n\n\b\nExample:\n{example}"
        return called

    return made


def _shipped(incomplete: str) -> list[str]:
    """What completes a mechanism's name, besides the shell's own files."""
    return [name for name in symkin.shipped_mechanisms() if name.startswith(incomplete)]


MechanismArgument = Annotated[
    str,
    typer.Argument(
        metavar="MECHANISM",
        help="A mechanism file, or the name of a shipped one (see `symkin list`).",
        autocompletion=_shipped,
        show_default=False,
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print one JSON document instead of text.")
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=0,
        max=2**63 - 1,
        help="Of all that is random; by default the mechanism's. Same seed, same bytes.",
    ),
]
OverwriteOption = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace output files that exist; never one that is read."),
]
CandidatesOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        max=10**7,
        help="Poses drawn from the workspace; by default the mechanism's.",
    ),
]
ColumnsOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="TOML file whose [measurements] section says which columns hold what; by default the "
        "section of the mechanism's file, or symkin's own column names.",
    ),
]
PoseCountOption = Annotated[
    int | None,
    typer.Option(
        metavar="N",
        min=1,
        max=10**6,
        help="Poses that each leg is identified from; by default the mechanism's.",
    ),
]
EstimatorOption = Annotated[
    Estimator,
    typer.Option(
        help="Whitened closures of each leg; the paper's Gauss-Newton on g - psi; the same cost by "
        "Levenberg-Marquardt; or all legs together."
    ),
]
OptionalEstimatorOption = Annotated[
    Estimator | None,
    typer.Option(
        help="Whitened closures of each leg, the default; the paper's Gauss-Newton on g - psi; the "
        "same cost by Levenberg-Marquardt; or all together, the default where it is needed."
    ),
]
PoseUseOption = Annotated[
    PoseUse,
    typer.Option(help="Whether a leg uses all poses, or only its own set, as in the paper."),
]
LossOption = Annotated[Loss, typer.Option(help="Robust loss against outliers.")]
MaxIterationsOption = Annotated[
    int, typer.Option(metavar="N", min=1, help="Steps after which a solver gives up.")
]
ThreadsOption = Annotated[
    int,
    typer.Option(metavar="N", min=0, max=1024, help="0 for all; the result is always the same."),
]
WorkersOption = Annotated[
    int,
    typer.Option(
        metavar="N", min=1, max=1024, help="Processes on this machine; more than 1 need Dask."
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="A running Dask scheduler, whose workers compute: tcp://host:8786."
    ),
]
AccuracyOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ERROR",
        help="End-effector error (rms) that is wanted, such as 0.05mm or 50um of the position, "
        "0.1mrad of the orientation. May be given for both.",
    ),
]


@dataclasses.dataclass(frozen=True)
class Choosing:
    """How poses are chosen, as `make_plan` and `pose_count_curve` take it."""

    design: Annotated[
        Design,
        typer.Option(
            help="A set of poses for each leg; whole orbits of poses under the symmetry, N in all, "
            "which every leg uses; or N poses in all, chosen for all legs at once."
        ),
    ] = "legs"
    rows: Annotated[
        RowKind,
        typer.Option(
            help="What a pose is worth to the selection: the paper's dg/dparam, or the closures' "
            "derivatives weighted by the declared noise."
        ),
    ] = "noise_aware"
    criterion: Annotated[
        Criterion,
        typer.Option(
            help="Observability index to maximise, or the expected end-effector error to minimise."
        ),
    ] = "O1"


@dataclasses.dataclass(frozen=True)
class ChoosingForPlan(Choosing):
    """And where a plan is made."""

    method: Annotated[
        SelectionMethod,
        typer.Option(help="Exchange; Sun and Hollerbach's; exchange with a proof; or a baseline."),
    ] = "exchange"
    margin_sigmas: Annotated[
        float,
        typer.Option(
            metavar="K",
            min=0,
            help="Keep poses K standard deviations of what the tolerances do away from the end of "
            "a leg's reach and from singularities, if that is more than the mechanism's margins.",
        ),
    ] = 3.0


@dataclasses.dataclass(frozen=True)
class Observing:
    """What is observed."""

    observe: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND",
            help="pose (the default), position, orientation, points, distance, height, reported "
            "(the platform's pose by the controller), or readings alone; may be repeated.",
        ),
    ] = None
    base: Annotated[
        str | None,
        typer.Option(
            metavar="FRAME",
            help="The base in the measuring device's frame: 'x, y, phi' or 'x, y, z, rx, ry, rz'.",
        ),
    ] = None
    target: Annotated[
        str | None,
        typer.Option(metavar="FRAME", help="What is measured, in the platform's frame."),
    ] = None
    point: Annotated[
        list[str] | None,
        typer.Option(metavar="POINT", help="A target point in the platform's frame; several."),
    ] = None
    anchor: Annotated[
        list[str] | None,
        typer.Option(metavar="POINT", help="Where distances are measured from; several."),
    ] = None
    plane: Annotated[
        str,
        typer.Option(metavar="C", help="'c0, c1, c2' of z = c0 + c1 x + c2 y for heights."),
    ] = "0, 0, 0"

    def observed(self, mechanism: Mechanism, missing: float = 0.0, spread: float = 0.0) -> Observed:
        """Read it; points and anchors that are not given are the mechanism's."""
        own = mechanism.frames or Frames()
        wanted = self.observe or ["pose"]
        size = mechanism.space.size
        frame = ("m",) * size + ("rad",) * (len(mechanism.space.frame_components) - size)
        given = Frames(
            base=quantities_of(self.base, frame, "--base") if self.base else (),
            target=quantities_of(self.target, frame, "--target") if self.target else (),
            points=tuple(quantities_of(e, frame[:size], "--point") for e in self.point or ()),
            anchors=tuple(quantities_of(e, frame[:size], "--anchor") for e in self.anchor or ()),
            plane=quantities_of(self.plane, ("m", "1", "1"), "--plane"),
        )
        given = own_frames_of(mechanism, given)
        return Observed(
            tuple(wanted),  # type: ignore[arg-type]  # which it checks
            given.base or None,
            given.target or None,
            given.points or (own.points if "points" in wanted else ()),
            given.anchors or (own.anchors if "distance" in wanted else ()),
            given.plane or (0.0, 0.0, 0.0),
            missing,
            spread,
        )

    def planned(self, mechanism: Mechanism) -> Observed | None:
        """Read what will be observed; None if nothing is said of it."""
        return None if self == Observing() else self.observed(mechanism)


@dataclasses.dataclass(frozen=True)
class Unknown:
    """What is unknown."""

    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Unknown, and nothing else: names such as leg2.base_radius or base.x with * and "
            "?; without a dot, in any leg. By default all parameters of all legs.",
        ),
    ] = None
    fixed: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Held, whatever else says so."),
    ] = None
    shared: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Changed by the same amount in all legs that match."),
    ] = None
    prior: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PRIOR",
            help="'tolerances', or PATTERN=DEVIATION about the drawing, such as 'base.*=1 mm'.",
        ),
    ] = None
    frames: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FRAME",
            help="Unknown: base, target, points, anchors or plane. May be given several times, as "
            "may the patterns, or several in one, with commas.",
        ),
    ] = None
    sensor: Annotated[
        Sensor | None,
        typer.Option(help="What sensors may do besides a straight line: bend, or err once a turn."),
    ] = None

    def arguments(self) -> Unknowns:
        """Read it, as arguments of `identify`."""
        return {
            "free": several_of(self.free),
            "fixed": several_of(self.fixed),
            "shared": several_of(self.shared),
            "prior": priors_of(several_of(self.prior)),
            "frames": several_of(self.frames),
            "sensor": self.sensor,
        }
