# SPDX-License-Identifier: MIT
"""What a mechanism file may say.

A kind says how a TOML value is read and how JSON Schema describes it. The keys of a leg and of the
workspace depend on the chain, so a whole file is described for one chain, platform and reading
unit. ``python -m symkin.io.mechanism_schema`` prints the JSON Schema, for editors that complete and
check TOML.
"""

from __future__ import annotations

import functools
import json
import math
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from symkin.chains import PLATFORMS, ChainInfo, chain_info, chains
from symkin.errors import QuantityError, SymkinError, did_you_mean, printable
from symkin.io.quantities import evaluate_quantity
from symkin.io.toml_file import KeyPath, TomlSource
from symkin.poses import POSE_SPACES
from symkin.settings import (
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)

__all__ = [
    "HEADER",
    "MEASUREMENTS",
    "Kind",
    "mechanism_schema",
    "mechanism_table",
    "read_table",
    "table",
]

Schema = dict[str, Any]

# More would be slow beyond use, and no such mechanism is known.
_MOST_LEGS = 64

Sign = Literal["any", "positive", "not negative", "not zero"]
_ACCEPTS: dict[Sign, Callable[[float], bool]] = {
    "any": math.isfinite,
    "positive": lambda value: value > 0,
    "not negative": lambda value: value >= 0,
    "not zero": lambda value: value != 0,
}


class _ValueError(SymkinError):
    """A value that a file may not have, and the path to it."""

    def __init__(self, message: str, keys: KeyPath = ()) -> None:
        super().__init__(message)
        self.keys = keys


@dataclass(frozen=True)
class Kind:
    """What a value may be: how it is read, or refused, and its JSON Schema."""

    read: Callable[[Any], Any]
    schema: Schema


def _quantity(unit: str, sign: Sign = "any", note: str = "", direction: bool = False) -> Kind:
    """A number or an expression, read in an SI unit; the note is for its description."""

    def read(raw: Any) -> float:
        value = evaluate_quantity(raw, unit, direction=direction)
        if not _ACCEPTS[sign](value):
            raise QuantityError(f"is {raw}; expected a value that is {sign}")
        return value

    plain = "a plain number" if unit == "1" else f"{unit} unless a unit is written"
    described = (note or plain) + ("" if sign == "any" else f"; {sign}")
    return Kind(read, {"type": ["number", "string"], "description": described})


def _coordinates(*units: str) -> Kind:
    """A list of quantities, each in its own unit."""
    kinds = [_quantity(unit, direction=unit == "rad") for unit in units]

    def read(raw: Any) -> tuple[float, ...]:
        if not isinstance(raw, list) or len(raw) != len(units):
            count = len(raw) if isinstance(raw, list) else "no list of"
            raise QuantityError(f"has {count} values; expected {len(units)}, in {', '.join(units)}")
        return tuple(kind.read(item) for kind, item in zip(kinds, raw, strict=True))

    items = [kind.schema for kind in kinds]
    count = len(units)
    return Kind(read, {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count})


def _interval(unit: str) -> Kind:
    """``[lower, upper]``."""
    both = _coordinates(unit, unit)

    def read(raw: Any) -> tuple[float, float]:
        lower, upper = both.read(raw)
        if lower > upper:
            raise QuantityError(f"is {raw}; expected the lower bound first")
        return lower, upper

    return Kind(read, both.schema)


def _estimate(unit: str, quantity: Kind) -> Kind:
    """A quantity, or ``{ value = ..., standard_deviation = ... }``; NaN where there is none."""
    deviation = _quantity(unit, "not negative")
    kinds = {"value": quantity, "standard_deviation": deviation}

    def read(raw: Any) -> tuple[float, float]:
        if not isinstance(raw, dict):
            return quantity.read(raw), math.nan
        for name in raw:
            if name not in kinds:
                raise QuantityError(f'has an unknown key "{name}"{did_you_mean(name, kinds)}')
        if "value" not in raw:
            raise QuantityError('has no "value"')
        values = {name: kinds[name].read(each) for name, each in raw.items()}
        return values["value"], values.get("standard_deviation", math.nan)

    return Kind(read, {"anyOf": [quantity.schema, table(kinds, ("value",)).schema]})


def _text(most: int = 10_000, check: Callable[[str], str] = str) -> Kind:
    def read(raw: Any) -> str:
        if not isinstance(raw, str):
            raise _ValueError(f"is {raw!r}; expected text")
        if len(raw) > most:
            raise _ValueError(f"has {len(raw)} characters; expected at most {most}")
        return check(raw)

    return Kind(read, {"type": "string", "maxLength": most})


def _whole(least: int, most: int) -> Kind:
    def read(raw: Any) -> int:
        if not isinstance(raw, int) or isinstance(raw, bool):
            raise _ValueError(f"is {raw!r}; expected a whole number (an integer)")
        if raw < least:
            raise _ValueError(f"is {raw}; expected a value greater than or equal to {least}")
        if raw > most:
            raise _ValueError(f"is too large; expected a value less than or equal to {most}")
        return raw

    return Kind(read, {"type": "integer", "minimum": least, "maximum": most})


def _one_of(*values: Any) -> Kind:
    def read(raw: Any) -> Any:
        # TOML's true and 1.0 equal 1, but are not meant.
        if isinstance(raw, bool | float) and isinstance(values[0], int):
            raise _ValueError(f"is {str(raw).lower()}; expected a whole number")
        if raw not in values:
            raise _ValueError(f"is {raw!r}; expected {' or '.join(map(repr, values))}")
        return raw

    return Kind(read, {"const": values[0]} if len(values) == 1 else {"enum": list(values)})


def _list_of(kind: Kind, least: int = 0, most: int | None = None) -> Kind:
    def read(raw: Any) -> list[Any]:
        if not isinstance(raw, list):
            raise _ValueError("is not a list; expected one")
        if len(raw) < least or (most is not None and len(raw) > most):
            raise _ValueError(f"has {len(raw)} items; expected {least} to {most}")
        return [_read_at(index, kind, item) for index, item in enumerate(raw)]

    bounds = {} if most is None else {"minItems": least, "maxItems": most}
    return Kind(read, {"type": "array", "items": kind.schema, **bounds})


def table(kinds: Mapping[str, Kind], required: tuple[str, ...] = (), settings: Any = None) -> Kind:
    """A table of keys; `settings` has the defaults of those that may be left out."""

    def read(raw: Any) -> dict[str, Any]:
        if not isinstance(raw, dict):
            raise _ValueError("is not a table of keys; expected one")
        # A misspelt key is reported rather than the one that is missing because of it.
        for name in raw:
            if name not in kinds:
                raise _ValueError(f"unknown key{did_you_mean(name, kinds)}", (name,))
        for name in required:
            if name not in raw:
                raise _ValueError("this key is missing", (name,))
        return {name: _read_at(name, kinds[name], value) for name, value in raw.items()}

    properties = {}
    for name, kind in kinds.items():
        default = getattr(settings, name, None)
        finite = isinstance(default, int | float) and math.isfinite(default)
        properties[name] = kind.schema | ({"default": default} if finite else {})
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return Kind(read, schema | ({"required": list(required)} if required else {}))


def _read_at(key: str | int, kind: Kind, raw: Any) -> Any:
    try:
        return kind.read(raw)
    except _ValueError as error:
        raise _ValueError(str(error), (key, *error.keys)) from error
    except SymkinError as error:
        raise _ValueError(str(error), (key,)) from error


def read_table(source: TomlSource, kind: Kind, keys: KeyPath = ()) -> dict[str, Any]:
    """Read the table below `keys` of a file.

    Raises
    ------
    MechanismFileError
        At the first wrong key.
    """
    values: Any = source.values
    for key in keys:
        values = values[key]
    try:
        read: dict[str, Any] = kind.read(values)
    except _ValueError as error:
        raise source.error(keys + error.keys, str(error)) from error
    return read


def _check_name(name: str) -> str:
    if not name:
        raise _ValueError("is empty; expected a name")
    if not name.isprintable():
        raise _ValueError(f"is {printable(name)!r}; expected characters that can be printed")
    return name


def _check_group(group: str) -> str:
    number = re.fullmatch("[CD]([1-9][0-9]*)", group, re.ASCII)
    if not number:
        raise _ValueError(
            f'is "{group}"; expected C (rotations) or D (rotations and reflections) and the number '
            'of rotations, such as "C3" or "D3"'
        )
    if len(number[1]) > len(str(_MOST_LEGS)) or int(number[1]) > _MOST_LEGS:
        raise _ValueError(f'is "{group}"; expected at most {_MOST_LEGS} rotations')
    return group


_SYMMETRY = table(
    {
        "group": _text(check=_check_group),
        "legs": _whole(1, _MOST_LEGS),
        "axis": _quantity("rad", direction=True),
        "elements": _list_of(_text()),
    },
    ("group",),
)
_TOLERANCES = table(
    {
        "length": _quantity("m", "positive"),
        "angle": _quantity("rad", "positive"),
        "gain": _quantity("1", "positive", "relative to the gain"),
    },
    settings=Tolerances,
)
_PROTOCOL = table(
    {
        "pose_count": _whole(1, 10**6),
        "candidates": _whole(1, 10**7),
        "seed": _whole(0, 2**63 - 1),
    },
    settings=ProtocolSettings,
)
MEASUREMENTS = table(
    {
        "position": _list_of(_text()),
        "readings": _list_of(_text()),
        "angle": _text(),
        "quaternion": _list_of(_text()),
        "rotation_vector": _list_of(_text()),
        "position_unit": _text(),
        "orientation_unit": _text(),
        "reading_unit": _text(),
        "leg": _text(),
    },
    ("position", "readings"),
    MeasurementColumns,
)
_SECTIONS = (
    "symmetry", "reference_leg", "legs", "workspace", "noise", "tolerances", "joint_limits",
    "protocol", "measurements",
)  # fmt: skip
# The keys that every file may have, and those that decide about the others.
_HEADER_KINDS: dict[str, Kind] = {
    "schema": _one_of(1),
    "name": _text(200, _check_name),
    "chain": _text(),
    "platform": _one_of(*PLATFORMS),
    "reading_unit": _one_of("rad", "m"),
}
HEADER = table(
    _HEADER_KINDS | dict.fromkeys(_SECTIONS, Kind(lambda raw: raw, {})), ("schema", "chain")
)


@functools.cache
def mechanism_table(chain: str, platform: str, reading_unit: str | None) -> Kind:
    """Describe the files of mechanisms with this chain.

    Raises
    ------
    SymkinError
        If there is no such chain, or it cannot carry the platform.
    """
    info = chain_info(chain, platform)
    unit = reading_unit or info.reading_unit
    units = info.units_of_sensor(unit)
    parameters = {name: _parameter(info, name, units[name]) for name in units}
    estimates = {name: _estimate(units[name], kind) for name, kind in parameters.items()}
    mode: dict[str, Kind] = {"working_mode": _one_of(-1, 1)}
    coordinates = POSE_SPACES[info.pose_space].units
    needed = tuple(name for name in parameters if name not in info.defaults)
    limit = _quantity(unit, note="in the sensor's unit")
    workspace = table(
        {name: _interval(unit) for name, unit in coordinates.items()}
        | {
            "home": _coordinates(*coordinates.values()),
            "reach_margin": _quantity("m", "not negative"),
            "conditioning_limit": _quantity("1", "positive"),
            "characteristic_length": _quantity("m", "positive"),
        },
        tuple(coordinates),
        WorkspaceSettings,
    )
    noise = table(
        {
            "position": _quantity("m", "not negative"),
            "orientation": _quantity("rad", "not negative"),
            "reading": _quantity(unit, "not negative", "in the sensor's unit"),
        },
        settings=NoiseSettings,
    )
    sections: dict[str, Kind] = {
        "chain": _one_of(chain),
        "platform": _one_of(platform),
        "symmetry": _SYMMETRY,
        "reference_leg": table(mode | parameters, needed),
        "legs": _list_of(table(mode | estimates, needed), 1, _MOST_LEGS),
        "workspace": workspace,
        "noise": noise,
        "tolerances": _TOLERANCES,
        "joint_limits": table({"lower": limit, "upper": limit}, settings=JointLimits),
        "protocol": _PROTOCOL,
        "measurements": MEASUREMENTS,
    }
    required = ("schema", "chain") + (("platform",) if platform != "rigid" else ())
    return table(_HEADER_KINDS | sections, required)


def _parameter(info: ChainInfo, name: str, unit: str) -> Kind:
    sign: Sign = "any"
    kind = info.parameter_roles[name].kind
    if kind == "length":
        sign = "positive"
    elif kind == "gain":
        sign = "not zero"
    elif kind == "radius" and not info.signed_radius:  # a guide's distance is signed
        sign = "not negative"
    note = "active joint per sensor reading" if kind == "gain" else ""
    if name in info.defaults:
        note = f"held; by default {info.defaults[name]}"
    return _quantity(unit, sign, note, direction=unit == "rad")


def mechanism_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of mechanism files, one alternative per chain.

    Returns
    -------
    dict
    """
    files = [
        mechanism_table(chain, platform, None).schema
        for platform in PLATFORMS
        for chain in chains(platform)
    ]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "symkin mechanism file",
        "anyOf": files,
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(mechanism_schema(), indent=1) + "\n")
