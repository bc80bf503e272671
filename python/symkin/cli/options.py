# SPDX-License-Identifier: MIT
"""Arguments and options that several commands share, alone and in groups, and what they mean.

A group is a dataclass of options: a command takes it as one parameter, see `command`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer

import symkin
from symkin.analysis.observed import Observed
from symkin.analysis.probing import CALIPER, PrintedLength
from symkin.data.observables import words_with
from symkin.data.sensor_tables import read_sensor_table
from symkin.errors import QuantityError, SymkinError
from symkin.estimate.options import Unknowns
from symkin.estimate.unknowns import Priors
from symkin.files.mechanism_file import load_columns
from symkin.files.mechanism_schema import noise_kinds
from symkin.model.file_frames import drawn_frames, own_frames
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames, MeasurementColumns
from symkin.options import (
    OPTIONS,
    Criterion,
    Design,
    Estimator,
    Frame,
    Loss,
    LossPer,
    PoseUse,
    Prior,
    RowKind,
    SelectionMethod,
    Sensor,
)
from symkin.planning import Region
from symkin.present import with_figures
from symkin.show.units import in_units
from symkin.storage.quantities import evaluate_quantity, is_unit
from symkin.values import record

Command = Callable[..., None]


def command(*examples: str) -> Callable[[Command], Command]:
    """Let parameters be the options of their names, or groups of them, with examples in the help.

    One that is no option of the table, or says more than it, is annotated with what it is.
    """

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
            telling = given.get("telling")
            every = getattr(telling, "all_figures", False)
            with in_units(getattr(telling, "units", "")), with_figures(every):
                function(**given)

        flat = [_of_the_table(each) for each in flat]
        called.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
        called.__annotations__ = {each.name: each.annotation for each in flat}
        text = inspect.cleandoc(function.__doc__ or "")
        example = "\n".join(f"  {line}" for line in examples)
        # A line with a backspace alone tells typer not to fill the paragraph that follows.
        called.__doc__ = f"{text}\n\n\b\nExample:\n{example}"
        return called

    return made


def _of_the_table(parameter: inspect.Parameter) -> inspect.Parameter:
    """The option of a parameter's name, if it does not say itself what it is."""
    said = get_origin(parameter.annotation) is Annotated
    if said or parameter.name not in OPTIONS:
        return parameter
    return parameter.replace(annotation=Annotated[parameter.annotation, of(parameter.name)])


def option(metavar: str, help: str, like: str = "", **limits: Any) -> Any:  # noqa: A002  # as typer
    """An option that takes a value; it stands in the help where the one that it is `like` does."""
    group = OPTIONS[like].seldom if like else ""
    return typer.Option(metavar=metavar, help=help, rich_help_panel=group, **limits)


def argument(metavar: str, help: str, **others: Any) -> Any:  # noqa: A002  # as typer
    """What stands on a command line without a name."""
    return typer.Argument(metavar=metavar, help=help, show_default=False, **others)


def of(name: str, *flags: str) -> Any:
    """An option of the table: its help, what stands for a value, and its limits."""
    known = OPTIONS[name]
    if known.kind is bool:
        return typer.Option(
            *(flags or (known.flag,)), help=known.help, rich_help_panel=known.seldom
        )
    limits: dict[str, Any] = {"min": known.least, "max": known.most} if not known.unit else {}
    if known.metavar:
        limits["metavar"] = known.metavar
    return typer.Option(*flags, help=known.help, rich_help_panel=known.seldom, **limits)


def refuse_unless(goes: bool, sentence: str) -> None:
    """Refuse an option that would be passed over in silence beside the others."""
    if not goes:
        raise typer.BadParameter(sentence)


def folder_of(files: str) -> Any:
    """The option of a folder in which these files are written."""
    return option("DIR", f"Folder for {files}.")


def _shipped(incomplete: str) -> list[str]:
    """What completes a mechanism's name, besides the shell's own files."""
    return [name for name in symkin.shipped_mechanisms() if name.startswith(incomplete)]


MechanismArgument = Annotated[
    str,
    argument(
        "MECHANISM",
        "A mechanism file, or the name of a shipped one (see `symkin list`).",
        autocompletion=_shipped,
    ),
]
ColumnsOption = Annotated[
    Path | None,
    option(
        "FILE",
        "TOML file whose [measurements] section says which columns hold what; by default "
        "the section of the mechanism's file, or symkin's own column names.",
        like="ignore",
    ),
]
AccuracyOption = Annotated[
    list[str] | None,
    option(
        "ERROR",
        "End-effector error (rms) that is wanted, such as 0.05mm or 50um of the position,"
        " 0.1mrad of the orientation. May be given for both.",
    ),
]
AvoidOption = Annotated[
    list[str] | None,
    option(
        "REGION",
        "Measure no pose in this region, such as x=0.1:0.3,y=:-20cm (m and rad, or units; "
        "an open end has no limit). May be given several times.",
        like="candidates",
    ),
]


@record
class Choosing:
    """How poses are chosen, as `make_plan` and `pose_count_curve` take it."""

    design: Design | None = None
    rows: RowKind = "noise_aware"
    criterion: Criterion = "O1"


@record
class ChoosingForPlan(Choosing):
    """And where a plan is made."""

    method: SelectionMethod = "exchange"
    margin_sigmas: float = 3.0


@record
class Fitting:
    """How what is unknown is fitted, as `identify` takes it."""

    estimator: Estimator | None = None
    poses: PoseUse = "all"
    loss: Loss = "none"
    loss_scale: float | None = None
    loss_per: LossPer | None = None

    def require_loss(self) -> None:
        """Refuse what says how a loss is, without one."""
        has_loss = self.loss != "none"
        refuse_unless(
            self.loss_per != "pose" or has_loss, "--loss-per pose goes with a --loss alone"
        )
        refuse_unless(self.loss_scale is None or has_loss, "--loss-scale goes with a --loss alone")


@record
class Measured:
    """What measures, and how well."""

    device_kind: str | None = None
    noise: list[str] | None = None

    @property
    def estimated(self) -> Literal["estimate"] | None:
        """Whether the noise is to be estimated, as `identify` takes it."""
        return "estimate" if self.noise == ["estimate"] else None

    def on(self, mechanism: Mechanism, *, estimates: bool = False) -> Mechanism:
        """The mechanism measured so."""
        if self.device_kind is not None:
            mechanism = mechanism.with_device(self.device_kind)
        if self.noise is None or (estimates and self.estimated):
            return mechanism
        kinds = noise_kinds(mechanism.reading_unit)
        said: dict[str, Any] = {}
        for each in several_of(self.noise) or ():
            name, _, text = each.partition("=")
            if name not in kinds or not text.strip():
                what = '"estimate", or ' if estimates else ""
                raise typer.BadParameter(
                    f'"{each}" is no noise; expected {what}{", ".join(kinds)} with a value each, '
                    'such as "position=20 um"',
                    param_hint="--noise",
                )
            try:
                said[name] = kinds[name].read(text)
            except SymkinError as error:
                raise typer.BadParameter(f"{name} {error}", param_hint="--noise") from error
        if "position" in said:  # of which a device's preset would be more
            said.setdefault("per_metre", 0.0)
        settings = mechanism.identification
        if settings is not None and settings.noise is not None:  # which is not to be estimated then
            settings = dataclasses.replace(settings, noise=None)
        noise = dataclasses.replace(mechanism.noise, **said)
        return mechanism.replace(noise=noise, identification=settings)


@record
class Observing:
    """What is observed."""

    observe: list[str] | None = None
    base: Annotated[
        str | None,
        option(
            "FRAME",
            "The base in the measuring device's frame: 'x, y, phi' or 'x, y, z, rx, ry, rz'.",
            like="missing",
        ),
    ] = None
    target: Annotated[
        str | None, option("FRAME", "What is measured, in the platform's frame.", like="missing")
    ] = None
    points: Annotated[
        list[str] | None,
        option("POINT", "A target point in the platform's frame; several.", like="missing"),
    ] = None
    anchors: Annotated[
        list[str] | None,
        option("POINT", "Where distances are measured from; several.", like="missing"),
    ] = None
    plane: Annotated[
        str | None,
        option(
            "C",
            "'c0, c1, c2' of z = c0 + c1 x + c2 y for heights; by default 0, 0, 0. Of a bed "
            "that is not flat how far its rim is above its middle, and the rim's radius, beside.",
            like="missing",
        ),
    ] = None

    def observed(self, mechanism: Mechanism, missing: float = 0.0, spread: float = 0.0) -> Observed:
        """Read it; what is not given is as the mechanism and its device have it."""
        wanted: Any = tuple(self.observe or ())
        if not wanted and mechanism.device is None:
            wanted = ("pose",)
        size = mechanism.space.size
        frame = ("m",) * size + ("rad",) * (len(mechanism.space.frame_components) - size)
        given = Frames(
            base=quantities_of(self.base, frame, "--base") if self.base else (),
            target=quantities_of(self.target, frame, "--target") if self.target else (),
            points=tuple(quantities_of(e, frame[:size], "--points") for e in self.points or ()),
            anchors=tuple(quantities_of(e, frame[:size], "--anchors") for e in self.anchors or ()),
            plane=_plane_of(self.plane or "0, 0, 0"),
        )
        given = own_frames_of(mechanism, given)
        said = {name: each for name, each in vars(given).items() if each}
        if not any(given.plane):
            del said["plane"]
        placed = dataclasses.replace(mechanism.frames or Frames(), **said)
        observed = Observed.of(mechanism.replace(frames=placed), wanted or None)
        assert observed is not None  # since there is a device where nothing is wanted
        self._refuse_unused(observed.kinds)
        return dataclasses.replace(observed, missing=missing, spread=spread)

    def _refuse_unused(self, wanted: Sequence[str]) -> None:
        """Refuse frames that nothing observed depends on."""
        for frame in get_args(Frame):
            kinds = words_with(frame)
            refuse_unless(
                getattr(self, frame) is None or not kinds.isdisjoint(wanted),
                f"--{frame} says nothing of what is observed, {', '.join(wanted)}; it goes with "
                f"--observe {' or '.join(sorted(kinds))}",
            )

    def planned(self, mechanism: Mechanism) -> Observed | None:
        """Read what will be observed; None if nothing is said of it."""
        if self == Observing() and mechanism.device is None:
            return None
        return self.observed(mechanism)


@record
class Unknown:
    """What is unknown."""

    free: list[str] | None = None
    fixed: list[str] | None = None
    shared: list[str] | None = None
    tie: list[str] | None = None
    prior: list[str] | None = None
    frames: list[str] | None = None
    sensor: Sensor | None = None
    drift: list[str] | None = None
    step: list[str] | None = None
    growth: bool | None = None
    backlash: bool | None = None
    assume: list[str] | None = None
    sessions: list[str] | None = None
    bow: str | None = None

    def arguments(self) -> Unknowns:
        """Read it, as arguments of `identify`."""
        return {
            "free": several_of(self.free),
            "fixed": several_of(self.fixed),
            "shared": several_of(self.shared),
            "tie": self.tie,
            "prior": priors_of(several_of(self.prior)),
            "frames": several_of(self.frames),
            "sensor": self.sensor,
            "drift": several_of(self.drift),
            "step": several_of(self.step),
            "growth": self.growth,
            "backlash": self.backlash,
            "assume": sizes_of(
                several_of(self.assume),
                "--assume",
                'names with a standard deviation each, such as "target=0.5 mm" or "scale=1e-4"',
            ),
            "sessions": several_of(self.sessions),
            "bow": None if self.bow is None else quantity_of(self.bow, "m", "--bow"),
        }


def _plane_of(text: str) -> tuple[float, ...]:
    """Read the plane of a bed, with the bow and the radius of one that is not flat."""
    units = ("m", "1", "1") + ("m", "m") * (text.count(",") > 2)
    plane = quantities_of(text, units, "--plane")
    if len(plane) > 3 and not plane[-1] > 0:
        raise typer.BadParameter(
            f'--plane "{text}" ends with the radius of the rim; expected it above zero'
        )
    return plane


def quantity_of(text: str, unit: str, option: str, *, is_reading: bool = False) -> float:
    """Read a number, in any unit; without one it is in `unit`. Readings may be many turns."""
    direction = unit == "rad" and not is_reading
    try:
        return evaluate_quantity(text, unit, direction=direction)
    except QuantityError as error:
        raise typer.BadParameter(str(error), param_hint=option) from error


def quantities_of(text: str, units: Sequence[str], option: str) -> tuple[float, ...]:
    """Read numbers separated by commas, each in its unit."""
    parts = text.split(",")
    if len(parts) != len(units):
        raise typer.BadParameter(
            f'{option} "{text}" has {len(parts)} values; expected {len(units)}, in '
            f"{', '.join(units)}"
        )
    return tuple(quantity_of(part, unit, option) for part, unit in zip(parts, units, strict=True))


def length_of(text: str, option: str) -> float:
    """Read a length that is not negative, m."""
    value = quantity_of(text, "m", option)
    if value < 0:
        raise typer.BadParameter(f'"{text}" is negative; expected a length', param_hint=option)
    return value


def share_of(text: str, name: str) -> float:
    """Read a share that an option of the table takes, such as ``0.95`` or ``95%``."""
    number, percent, rest = text.strip().partition("%")
    value = quantity_of(number, "1", OPTIONS[name].flag) / (100 if percent else 1)
    try:
        OPTIONS[name].check(math.nan if rest else value)
    except SymkinError as error:
        raise typer.BadParameter(f'"{text}": {error}', param_hint=OPTIONS[name].flag) from error
    return value


def angles_of(text: str, option: str) -> list[float]:
    """Read a list of different angles, rad."""
    values = [quantity_of(part, "rad", option) for part in text.split(",")]
    if len(set(values)) < len(values):
        raise typer.BadParameter(
            f'"{text}" has an angle twice; expected each once', param_hint=option
        )
    return values


def accuracies_of(
    texts: Sequence[str] | None, flag: str = "--accuracy"
) -> tuple[float | None, float | None]:
    """Read the errors that an option names: of the position, m, and of the orientation, rad."""
    wanted: dict[str, float] = {}
    for text in texts or ():
        unit = _unit_of(text, flag)
        if unit in wanted:
            kind = "position" if unit == "m" else "orientation"
            raise typer.BadParameter(
                f'"{text}" is a second error of the {kind}; expected one', param_hint=flag
            )
        wanted[unit] = quantity_of(text, unit, flag)
        if wanted[unit] <= 0:
            raise typer.BadParameter(
                f'"{text}" is not positive; expected an error', param_hint=flag
            )
    return wanted.get("m"), wanted.get("rad")


def _unit_of(text: str, flag: str) -> str:
    """The SI unit, m or rad, of a text that must have one: 0.05 alone could be mm or m."""
    name = text.strip().lstrip("+-.0123456789eE").strip()
    for unit in ("m", "rad"):
        if is_unit(name, unit):
            return unit
    raise typer.BadParameter(
        f'"{text}" is no length or angle with a unit; expected such as 0.05mm, 50um or 0.1mrad',
        param_hint=flag,
    )


def region_of(text: str) -> Region:
    """Read a region to avoid, such as ``x=0.1:0.3,y=:-20cm``."""
    region: dict[str, tuple[float, float]] = {}
    for part in text.split(","):
        name, equals, limits = part.partition("=")
        lower, colon, upper = limits.partition(":")
        name = name.strip()
        if not (name and equals and colon):
            raise typer.BadParameter(
                f'"{part}" in "{text}" is no limit; expected such as x=0.1:0.3',
                param_hint="--avoid",
            )
        unit = "rad" if name in ("phi", "rx", "ry", "rz") else "m"
        if name in region:
            raise typer.BadParameter(
                f'"{text}" limits {name} twice; expected each coordinate once (one --avoid for '
                "each region)",
                param_hint="--avoid",
            )
        region[name] = (
            quantity_of(lower, unit, "--avoid") if lower.strip() else -math.inf,
            quantity_of(upper, unit, "--avoid") if upper.strip() else math.inf,
        )
    return region


def own_frames_of(mechanism: Mechanism, given: Frames) -> Frames:
    """What was typed in the frames of the mechanism's file, and what that has besides, in its own.

    Points and anchors that were not typed stay away.
    """
    if mechanism.points is None or not mechanism.points.moved:
        return given
    drawn = drawn_frames(mechanism) or Frames()
    level = not any(given.plane)
    typed = dataclasses.replace(
        given,
        base=given.base or drawn.base,
        target=given.target or drawn.target,
        plane=drawn.plane if level else given.plane,
    )
    return own_frames(mechanism.pose_space, typed, mechanism.points) or Frames()


def printed_length_of(text: str) -> PrintedLength:
    """Read a printed length, such as ``100 mm = 100.12 mm +- 0.02 mm``."""
    commanded, equal, rest = text.partition("=")
    measured, _, deviation = rest.partition("+-")
    if not equal:
        raise typer.BadParameter(
            f'--printed "{text}" has no "="; expected a commanded and a measured length, such as '
            '"100 mm = 100.12 mm"'
        )
    lengths = [quantity_of(each, "m", "--printed") for each in (commanded, measured)]
    known = quantity_of(deviation, "m", "--printed") if deviation else CALIPER
    return PrintedLength(commanded=lengths[0], measured=lengths[1], deviation=known)


def columns_of(path: Path | None) -> MeasurementColumns | None:
    """Read which columns of measurements hold what, if a file says it."""
    return None if path is None else load_columns(path)


def with_sensor_table(mechanism: Mechanism, path: Path | None) -> Mechanism:
    """Return the mechanism with the sensors' table of a file, if there is one."""
    if path is None:
        return mechanism
    table = read_sensor_table(
        path, legs=len(mechanism.legs), reading_unit=mechanism.reading_unit, step=mechanism.step
    )
    return mechanism.replace(sensor_table=table)


def several_of(given: Sequence[str] | None) -> list[str] | None:
    """Patterns that were given one by one, or several with commas outside of brackets."""
    if given is None:
        return None
    return [part.strip() for each in given for part in re.split(r",(?![^\[]*\])", each)]


def sizes_of(given: Sequence[str] | None, flag: str, expected: str) -> dict[str, str] | None:
    """Read names or patterns with a size each, such as ``scale=1e-4``; None if none was given."""
    if given is None:
        return None
    sizes = dict(each.rpartition("=")[::2] for each in several_of(given) or ())
    if "" in sizes:
        raise typer.BadParameter(f"{flag} is {', '.join(given)}; expected {expected}")
    return sizes


def priors_of(given: Sequence[str] | None) -> Priors | None:
    """Read ``tolerances`` or ``fitted``, or patterns with a standard deviation each."""
    if given is not None and len(given) == 1 and given[0] in get_args(Prior):
        return given[0]
    expected = (
        '"tolerances", "fitted", or patterns with a standard deviation each, such as '
        '"leg1.*=0.1 mm", beside which the tolerances are priors of all others anyway'
    )
    return sizes_of(given, "--prior", expected)
