# SPDX-License-Identifier: MIT
"""What the texts of options mean: lengths, angles, regions, frames, priors."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence
from pathlib import Path

import typer

from symkin.drawing import drawn_frames, own_frames
from symkin.errors import QuantityError
from symkin.identification.unknowns import Priors
from symkin.io.mechanism_file import load_columns
from symkin.io.quantities import evaluate_quantity, unit_factor
from symkin.io.sensor_tables import read_sensor_table
from symkin.mechanism import Mechanism
from symkin.planning import Region
from symkin.probing import CALIPER, PrintedLength
from symkin.settings import Frames, MeasurementColumns


def quantity_of(text: str, unit: str, option: str, *, is_reading: bool = False) -> float:
    """Read a number, in any unit; without one it is in `unit`. Readings may be many turns."""
    direction = unit == "rad" and not is_reading
    try:
        return evaluate_quantity(_spaced(text), unit, direction=direction)
    except QuantityError as error:
        raise typer.BadParameter(str(error), param_hint=option) from error


def _spaced(text: str) -> str:
    """``5cm`` as ``5 cm``: a command line is easier without spaces."""
    stripped = text.strip()
    number = stripped.rstrip("abcdefghijklmnopqrstuvwxyz")
    return f"{number} {stripped[len(number) :]}" if number and stripped != number else stripped


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


def angles_of(text: str, option: str) -> list[float]:
    """Read a list of different angles, rad."""
    values = [quantity_of(part, "rad", option) for part in text.split(",")]
    if len(set(values)) < len(values):
        raise typer.BadParameter(
            f'"{text}" has an angle twice; expected each once', param_hint=option
        )
    return values


def accuracies_of(texts: Sequence[str] | None) -> tuple[float | None, float | None]:
    """Read the errors that are wanted: of the position, m, and of the orientation, rad."""
    wanted: dict[str, float] = {}
    for text in texts or ():
        unit = _unit_of(text)
        if unit in wanted:
            kind = "position" if unit == "m" else "orientation"
            raise typer.BadParameter(
                f'"{text}" is a second error of the {kind}; expected one', param_hint="--accuracy"
            )
        wanted[unit] = quantity_of(text, unit, "--accuracy")
        if wanted[unit] <= 0:
            raise typer.BadParameter(
                f'"{text}" is not positive; expected an error', param_hint="--accuracy"
            )
    return wanted.get("m"), wanted.get("rad")


def _unit_of(text: str) -> str:
    """The SI unit, m or rad, of a text that must have one: 0.05 alone could be mm or m."""
    name = text.strip().lstrip("+-.0123456789eE").strip()
    for unit in ("m", "rad") if name else ():
        try:
            unit_factor(name, unit)
        except QuantityError:
            continue
        return unit
    raise typer.BadParameter(
        f'"{text}" is no length or angle with a unit; expected such as 0.05mm, 50um or 0.1mrad',
        param_hint="--accuracy",
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
        path,
        legs=len(mechanism.legs),
        reading_unit=mechanism.reading_unit,
        step=mechanism.step,
    )
    return mechanism.replace(sensor_table=table)


def several_of(given: Sequence[str] | None) -> list[str] | None:
    """Patterns that were given one by one, or several with commas outside of brackets."""
    if given is None:
        return None
    return [part.strip() for each in given for part in re.split(r",(?![^\[]*\])", each)]


def priors_of(given: Sequence[str] | None) -> Priors | None:
    """Read ``tolerances``, or patterns with a standard deviation each."""
    if given is None or given == ["tolerances"]:
        return None if given is None else "tolerances"
    priors = dict(each.rpartition("=")[::2] for each in given)
    if "" in priors:
        raise typer.BadParameter(
            f'--prior is {", ".join(given)}; expected "tolerances", or patterns with a standard '
            'deviation each, such as "leg1.*=0.1 mm"'
        )
    return priors
