# SPDX-License-Identifier: MIT
"""Options that say what is observed and what is unknown, and how they are read."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Annotated

import typer

from symkin.drawing import drawn_frames, own_frames
from symkin.errors import QuantityError, SymkinError
from symkin.identification.unknowns import Priors, Sensor
from symkin.io.quantities import evaluate_quantity
from symkin.mechanism import Mechanism
from symkin.observed import Observed
from symkin.planning.observing import Unknowns
from symkin.probing import CALIPER, PrintedLength
from symkin.settings import Frames

__all__ = [
    "NO_PLANE",
    "AnchorOption",
    "BaseOption",
    "FixedOption",
    "FramesOption",
    "FreeOption",
    "ObserveOption",
    "PlaneOption",
    "PointOption",
    "PrintedOption",
    "PriorOption",
    "SensorOption",
    "SensorTableOption",
    "SharedOption",
    "TargetOption",
    "observed",
    "planned",
    "printed_lengths",
    "unknowns",
    "with_sensor_table",
]

NO_PLANE = "0, 0, 0"
ObserveOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KIND",
        help="pose (the default), position, orientation, points, distance, height, reported (the "
        "platform's pose by the controller), or readings alone; may be repeated.",
    ),
]
BaseOption = Annotated[
    str | None,
    typer.Option(
        metavar="FRAME",
        help="The base in the measuring device's frame: 'x, y, phi' or 'x, y, z, rx, ry, rz'.",
    ),
]
TargetOption = Annotated[
    str | None,
    typer.Option(metavar="FRAME", help="What is measured, in the platform's frame."),
]
PointOption = Annotated[
    list[str] | None,
    typer.Option(metavar="POINT", help="A target point in the platform's frame; several."),
]
AnchorOption = Annotated[
    list[str] | None,
    typer.Option(metavar="POINT", help="Where distances are measured from; several."),
]
PlaneOption = Annotated[
    str,
    typer.Option(metavar="C", help="'c0, c1, c2' of z = c0 + c1 x + c2 y for heights."),
]
FreeOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PATTERN",
        help="Unknown, and nothing else: names such as leg2.base_radius or base.x with * and "
        "?; without a dot, in any leg. By default all parameters of all legs.",
    ),
]
FixedOption = Annotated[
    list[str] | None,
    typer.Option(metavar="PATTERN", help="Held, whatever else says so."),
]
SharedOption = Annotated[
    list[str] | None,
    typer.Option(metavar="PATTERN", help="Changed by the same amount in all legs that match."),
]
PriorOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PRIOR",
        help="'tolerances', or PATTERN=DEVIATION about the drawing, such as 'base.*=1 mm'.",
    ),
]
FramesOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FRAME",
        help="Unknown: base, target, points, anchors or plane. May be given several times, as "
        "may the patterns, or several in one, with commas.",
    ),
]
PrintedOption = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH",
        help="A piece that a probed delta printed along x, centred, before it was calibrated: "
        "'100 mm = 100.12 mm', commanded and measured; with '+- 0.02 mm' behind, how well (by "
        "default 0.05 mm).",
    ),
]
SensorOption = Annotated[
    Sensor | None,
    typer.Option(help="What sensors may do besides a straight line: bend, or err once a turn."),
]
SensorTableOption = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="What the sensors show and what straight ones would, of a certificate: CSV with "
        "columns reading_deg and joint_deg (any unit), and leg if they differ. By default what "
        "the mechanism's file says.",
    ),
]


def with_sensor_table(mechanism: Mechanism, path: Path | None) -> Mechanism:
    """Return the mechanism with the sensors' table of a file, if there is one."""
    if path is None:
        return mechanism
    from symkin.io.sensor_tables import read_sensor_table

    table = read_sensor_table(
        path,
        legs=len(mechanism.legs),
        reading_unit=mechanism.reading_unit,
        step=mechanism.step,
    )
    return mechanism.replace(sensor_table=table)


def observed(
    mechanism: Mechanism,
    kinds: list[str] | None,
    base: str | None,
    target: str | None,
    points: list[str] | None,
    anchors: list[str] | None,
    plane: str,
    *,
    missing: float = 0.0,
    spread: float = 0.0,
) -> Observed:
    """Read what is observed; points and anchors that are not given are the mechanism's."""
    own = mechanism.frames or Frames()
    wanted = kinds or ["pose"]
    size = mechanism.space.size
    frame = ("m",) * size + ("rad",) * (len(mechanism.space.frame_components) - size)
    given = Frames(
        base=_quantities("--base", base, frame) if base else (),
        target=_quantities("--target", target, frame) if target else (),
        points=tuple(_quantities("--point", each, frame[:size]) for each in points or ()),
        anchors=tuple(_quantities("--anchor", each, frame[:size]) for each in anchors or ()),
        plane=_quantities("--plane", plane, ("m", "1", "1")),
    )
    if mechanism.points is not None and mechanism.points.moved:
        given = _of_drawing(mechanism, given)
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


def _of_drawing(mechanism: Mechanism, given: Frames) -> Frames:
    """What was typed in the frames of the mechanism's file, and what that has besides, in its own.

    Points and anchors that were not typed stay away.
    """
    assert mechanism.points is not None
    drawn = drawn_frames(mechanism) or Frames()
    level = not any(given.plane)
    typed = dataclasses.replace(
        given,
        base=given.base or drawn.base,
        target=given.target or drawn.target,
        plane=drawn.plane if level else given.plane,
    )
    return own_frames(mechanism.pose_space, typed, mechanism.points) or Frames()


def planned(
    mechanism: Mechanism,
    kinds: list[str] | None,
    base: str | None,
    target: str | None,
    points: list[str] | None,
    anchors: list[str] | None,
    plane: str,
) -> Observed | None:
    """Read what will be observed; None if nothing is said of it."""
    if not (kinds or base or target or points or anchors or plane != NO_PLANE):
        return None
    return observed(mechanism, kinds, base, target, points, anchors, plane)


def printed_lengths(text: str | None) -> list[PrintedLength]:
    """Read a printed length, if there is one."""
    if text is None:
        return []
    commanded, equal, rest = text.partition("=")
    measured, _, deviation = rest.partition("+-")
    if not equal:
        raise SymkinError(
            f'--printed "{text}" has no "="; expected a commanded and a measured length, such as '
            '"100 mm = 100.12 mm"'
        )
    values = [_quantities("--printed", each, ("m",))[0] for each in (commanded, measured)]
    known = _quantities("--printed", deviation, ("m",))[0] if deviation else CALIPER
    return [PrintedLength(commanded=values[0], measured=values[1], deviation=known)]


def unknowns(
    free: list[str] | None,
    fixed: list[str] | None,
    shared: list[str] | None,
    prior: list[str] | None,
    frames: list[str] | None,
    sensor: Sensor | None,
) -> Unknowns:
    """Read what is unknown, as arguments."""
    return {
        "free": _several(free),
        "fixed": _several(fixed),
        "shared": _several(shared),
        "prior": _priors(_several(prior)),
        "frames": _several(frames),
        "sensor": sensor,
    }


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


def _several(given: list[str] | None) -> list[str] | None:
    """Patterns that were given one by one, or several with commas outside of brackets."""
    if given is None:
        return None
    return [part.strip() for each in given for part in re.split(r",(?![^\[]*\])", each)]


def _priors(given: list[str] | None) -> Priors | None:
    if given is None or given == ["tolerances"]:
        return None if given is None else "tolerances"
    priors = dict(each.rpartition("=")[::2] for each in given)
    if "" in priors:
        raise typer.BadParameter(
            f'--prior is {", ".join(given)}; expected "tolerances", or patterns with a standard '
            'deviation each, such as "leg1.*=0.1 mm"'
        )
    return priors
