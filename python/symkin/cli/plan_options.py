# SPDX-License-Identifier: MIT
"""Options with lengths and angles in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import typer

from symkin.errors import QuantityError
from symkin.planning import Region

__all__ = [
    "AccuracyOption",
    "AvoidOption",
    "MinimumDistanceOption",
    "accuracies",
    "angles",
    "length",
    "regions",
]

AccuracyOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ERROR",
        help="End-effector error (rms) that is wanted, such as 0.05mm or 50um of the position, "
        "0.1mrad of the orientation. May be given for both.",
    ),
]

AvoidOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="REGION",
        help="Measure no pose in this region, such as x=0.1:0.3,y=:-20cm (m and rad, or units; an "
        "open end has no limit). May be given several times.",
    ),
]
MinimumDistanceOption = Annotated[
    str,
    typer.Option(
        metavar="LENGTH",
        help="Between the positions of any two poses of a set, such as 0.05 or 5cm.",
    ),
]


def length(text: str, hint: str) -> float:
    """Read a length that is not negative, m."""
    value = _quantity(text, "m", hint)
    if value < 0:
        raise typer.BadParameter(f'"{text}" is negative; expected a length', param_hint=hint)
    return value


def accuracies(texts: Sequence[str]) -> tuple[float | None, float | None]:
    """Read the errors that are wanted: of the position, m, and of the orientation, rad."""
    wanted: dict[str, float] = {}
    for text in texts:
        unit = _unit_of(text)
        if unit in wanted:
            kind = "position" if unit == "m" else "orientation"
            raise typer.BadParameter(
                f'"{text}" is a second error of the {kind}; expected one', param_hint="--accuracy"
            )
        wanted[unit] = _quantity(text, unit, "--accuracy")
        if wanted[unit] <= 0:
            raise typer.BadParameter(
                f'"{text}" is not positive; expected an error', param_hint="--accuracy"
            )
    return wanted.get("m"), wanted.get("rad")


def _unit_of(text: str) -> str:
    """The SI unit, m or rad, of a text that must have one: 0.05 alone could be mm or m."""
    from symkin.io.quantities import unit_factor

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


def regions(texts: Sequence[str]) -> list[Region]:
    """Read regions to avoid."""
    return [_region(text) for text in texts]


def _region(text: str) -> Region:
    region: dict[str, tuple[float, float]] = {}
    for part in text.split(","):
        name, limits = _limits(part, text)
        if name in region:
            raise typer.BadParameter(
                f'"{text}" limits {name} twice; expected each coordinate once (one --avoid for '
                "each region)",
                param_hint="--avoid",
            )
        region[name] = limits
    return region


def _limits(part: str, text: str) -> tuple[str, tuple[float, float]]:
    name, equals, limits = part.partition("=")
    lower, colon, upper = limits.partition(":")
    name = name.strip()
    if not (name and equals and colon):
        raise typer.BadParameter(
            f'"{part}" in "{text}" is no limit; expected such as x=0.1:0.3', param_hint="--avoid"
        )
    unit = "rad" if name in ("phi", "rx", "ry", "rz") else "m"
    return name, (
        _quantity(lower, unit, "--avoid") if lower.strip() else -math.inf,
        _quantity(upper, unit, "--avoid") if upper.strip() else math.inf,
    )


def angles(text: str, hint: str) -> list[float]:
    """Read a list of different angles, rad."""
    values = [_quantity(part, "rad", hint) for part in text.split(",")]
    if len(set(values)) < len(values):
        raise typer.BadParameter(
            f'"{text}" has an angle twice; expected each once', param_hint=hint
        )
    return values


def _quantity(text: str, unit: str, hint: str) -> float:
    from symkin.io.quantities import evaluate_quantity

    try:
        return evaluate_quantity(_spaced(text), unit, direction=unit == "rad")
    except QuantityError as error:
        raise typer.BadParameter(str(error), param_hint=hint) from error


def _spaced(text: str) -> str:
    """``5cm`` as ``5 cm``: a command line is easier without spaces."""
    stripped = text.strip()
    number = stripped.rstrip("abcdefghijklmnopqrstuvwxyz")
    return f"{number} {stripped[len(number) :]}" if number and stripped != number else stripped
