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

from symkin.chains import chain_info, chains
from symkin.errors import QuantityError, SymkinError, did_you_mean, printable
from symkin.io.quantities import evaluate_quantity
from symkin.io.toml_file import KeyPath, TomlSource
from symkin.settings import (
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)

__all__ = [
    "COORDINATES",
    "HEADER",
    "MEASUREMENTS",
    "ListOf",
    "Table",
    "mechanism_schema",
    "mechanism_table",
    "read_table",
]

Schema = dict[str, Any]

# Coordinates of bounds and home, position then orientation, and their units.
COORDINATES: dict[str, dict[str, str]] = {
    "planar": {"x": "m", "y": "m", "phi": "rad"},
    "point": {"x": "m", "y": "m"},
    "spatial": {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"},
}
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


class Kind:
    """What a value may be."""

    def read(self, raw: Any) -> Any:
        """Return the value; SymkinError says what is expected."""
        raise NotImplementedError

    def schema(self) -> Schema:
        """Return its JSON Schema."""
        raise NotImplementedError


@dataclass(frozen=True)
class Quantity(Kind):
    """A number or an expression, read as a float in an SI unit; the note is for its description."""

    unit: str
    sign: Sign = "any"
    note: str = ""
    direction: bool = False

    def read(self, raw: Any) -> float:
        value = evaluate_quantity(raw, self.unit, direction=self.direction)
        if not _ACCEPTS[self.sign](value):
            raise QuantityError(f"is {raw}; expected a value that is {self.sign}")
        return value

    def schema(self) -> Schema:
        plain = "a plain number" if self.unit == "1" else f"{self.unit} unless a unit is written"
        sign = "" if self.sign == "any" else f"; {self.sign}"
        return {"type": ["number", "string"], "description": f"{self.note or plain}{sign}"}


@dataclass(frozen=True)
class Coordinates(Kind):
    """A list of quantities, each in its own unit."""

    units: tuple[str, ...]

    def read(self, raw: Any) -> tuple[float, ...]:
        if not isinstance(raw, list) or len(raw) != len(self.units):
            count = len(raw) if isinstance(raw, list) else "no list of"
            raise QuantityError(
                f"has {count} values; expected {len(self.units)}, in {', '.join(self.units)}"
            )
        pairs = zip(raw, self.units, strict=True)
        return tuple(evaluate_quantity(item, unit, direction=unit == "rad") for item, unit in pairs)

    def schema(self) -> Schema:
        items = [Quantity(unit).schema() for unit in self.units]
        count = len(self.units)
        return {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count}


class Interval(Coordinates):
    """``[lower, upper]`` in one unit."""

    def __init__(self, unit: str) -> None:
        super().__init__((unit, unit))

    def read(self, raw: Any) -> tuple[float, ...]:
        lower, upper = super().read(raw)
        if lower > upper:
            raise QuantityError(f"is {raw}; expected the lower bound first")
        return lower, upper


@dataclass(frozen=True)
class Estimate(Kind):
    """A value and its standard deviation, which is NaN where the file gives none.

    A quantity, or a table ``{ value = ..., standard_deviation = ... }``.
    """

    quantity: Quantity

    def read(self, raw: Any) -> tuple[float, float]:
        if not isinstance(raw, dict):
            return self.quantity.read(raw), math.nan
        names = ("value", "standard_deviation")
        for name in raw:
            if name not in names:
                raise QuantityError(f'has an unknown key "{name}"{did_you_mean(name, names)}')
        if "value" not in raw:
            raise QuantityError('has no "value"')
        deviation = Quantity(self.quantity.unit, "not negative")
        given = deviation.read(raw["standard_deviation"]) if len(raw) == 2 else math.nan
        return self.quantity.read(raw["value"]), given

    def schema(self) -> Schema:
        value = self.quantity.schema()
        deviation = Quantity(self.quantity.unit, "not negative").schema()
        table = _table_schema({"value": value, "standard_deviation": deviation}, ["value"])
        return {"anyOf": [value, table]}


@dataclass(frozen=True)
class Text(Kind):
    """Text of some characters, or that a function has nothing against."""

    most: int = 10_000
    check: Callable[[str], str] = str

    def read(self, raw: Any) -> str:
        if not isinstance(raw, str):
            raise _ValueError(f"is {raw!r}; expected text")
        if len(raw) > self.most:
            raise _ValueError(f"has {len(raw)} characters; expected at most {self.most}")
        return self.check(raw)

    def schema(self) -> Schema:
        return {"type": "string", "maxLength": self.most}


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number between two bounds."""

    least: int
    most: int

    def read(self, raw: Any) -> int:
        if not isinstance(raw, int) or isinstance(raw, bool):
            raise _ValueError(f"is {raw!r}; expected a whole number (an integer)")
        if raw < self.least:
            raise _ValueError(f"is {raw}; expected a value greater than or equal to {self.least}")
        if raw > self.most:
            raise _ValueError(f"is too large; expected a value less than or equal to {self.most}")
        return raw

    def schema(self) -> Schema:
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


class OneOf(Kind):
    """One of a few values."""

    def __init__(self, *values: Any) -> None:
        self.values = values

    def read(self, raw: Any) -> Any:
        # TOML's true and 1.0 equal 1, but are not meant.
        if isinstance(raw, bool | float) and isinstance(self.values[0], int):
            raise _ValueError(f"is {str(raw).lower()}; expected a whole number")
        if raw not in self.values:
            raise _ValueError(f"is {raw!r}; expected {' or '.join(map(repr, self.values))}")
        return raw

    def schema(self) -> Schema:
        return {"const": self.values[0]} if len(self.values) == 1 else {"enum": list(self.values)}


class AnyValue(Kind):
    """What is read later."""

    def read(self, raw: Any) -> Any:
        return raw

    def schema(self) -> Schema:
        return {}


@dataclass(frozen=True)
class ListOf(Kind):
    """A list of values of one kind."""

    kind: Kind
    least: int = 0
    most: int | None = None

    def read(self, raw: Any) -> list[Any]:
        """Return what the items are read as."""
        if not isinstance(raw, list):
            raise _ValueError("is not a list; expected one")
        if len(raw) < self.least or (self.most is not None and len(raw) > self.most):
            raise _ValueError(f"has {len(raw)} items; expected {self.least} to {self.most}")
        return [_read_at(index, self.kind, item) for index, item in enumerate(raw)]

    def schema(self) -> Schema:
        """Return an array of items of the kind."""
        most = {} if self.most is None else {"minItems": self.least, "maxItems": self.most}
        return {"type": "array", "items": self.kind.schema(), **most}


class Table(Kind):
    """A table of keys; `settings` has the defaults of those that may be left out."""

    def __init__(
        self, kinds: Mapping[str, Kind], required: tuple[str, ...] = (), settings: Any = None
    ) -> None:
        self.kinds = kinds
        self.required = required
        self.settings = settings

    def read(self, raw: Any) -> dict[str, Any]:
        """Return what the keys that are there are read as."""
        if not isinstance(raw, dict):
            raise _ValueError("is not a table of keys; expected one")
        # A misspelt key is reported rather than the one that is missing because of it.
        for name in raw:
            if name not in self.kinds:
                raise _ValueError(f"unknown key{did_you_mean(name, self.kinds)}", (name,))
        for name in self.required:
            if name not in raw:
                raise _ValueError("this key is missing", (name,))
        return {name: _read_at(name, self.kinds[name], value) for name, value in raw.items()}

    def schema(self) -> Schema:
        """Return an object with these keys and no others."""
        properties = {}
        for name, kind in self.kinds.items():
            default = getattr(self.settings, name, None)
            finite = isinstance(default, int | float) and math.isfinite(default)
            properties[name] = kind.schema() | ({"default": default} if finite else {})
        return _table_schema(properties, list(self.required))


def read_table(source: TomlSource, table: Table, keys: KeyPath = ()) -> dict[str, Any]:
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
        return table.read(values)
    except _ValueError as error:
        raise source.error(keys + error.keys, str(error)) from error


def _read_at(key: str | int, kind: Kind, raw: Any) -> Any:
    try:
        return kind.read(raw)
    except _ValueError as error:
        raise _ValueError(str(error), (key, *error.keys)) from error
    except SymkinError as error:
        raise _ValueError(str(error), (key,)) from error


def _table_schema(properties: Schema, required: list[str]) -> Schema:
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return schema | ({"required": required} if required else {})


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


_SYMMETRY = Table(
    {
        "group": Text(check=_check_group),
        "legs": Whole(1, _MOST_LEGS),
        "axis": Quantity("rad", direction=True),
        "elements": ListOf(Text()),
    },
    ("group",),
)
_TOLERANCES = Table(
    {
        "length": Quantity("m", "positive"),
        "angle": Quantity("rad", "positive"),
        "gain": Quantity("1", "positive", "relative to the gain"),
    },
    settings=Tolerances,
)
_PROTOCOL = Table(
    {
        "pose_count": Whole(1, 10**6),
        "candidates": Whole(1, 10**7),
        "seed": Whole(0, 2**63 - 1),
    },
    settings=ProtocolSettings,
)
MEASUREMENTS = Table(
    {
        "position": ListOf(Text()),
        "readings": ListOf(Text()),
        "angle": Text(),
        "quaternion": ListOf(Text()),
        "rotation_vector": ListOf(Text()),
        "position_unit": Text(),
        "orientation_unit": Text(),
        "reading_unit": Text(),
        "leg": Text(),
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
    "schema": OneOf(1),
    "name": Text(200, _check_name),
    "chain": Text(),
    "platform": OneOf("rigid", "point"),
    "reading_unit": OneOf("rad", "m"),
}
HEADER = Table(_HEADER_KINDS | dict.fromkeys(_SECTIONS, AnyValue()), ("schema", "chain"))


@functools.cache
def mechanism_table(chain: str, platform: str, reading_unit: str | None) -> Table:
    """Describe the files of mechanisms with this chain.

    Raises
    ------
    SymkinError
        If there is no such chain, or it cannot carry the platform.
    """
    info = chain_info(chain, platform)
    unit = reading_unit or info.reading_unit
    units = info.units_of_sensor(unit)
    parameters = {name: _parameter(chain, name, units[name]) for name in units}
    estimates = {name: Estimate(quantity) for name, quantity in parameters.items()}
    mode: dict[str, Kind] = {"working_mode": OneOf(-1, 1)}
    coordinates = COORDINATES[info.pose_space]
    limit = Quantity(unit, note="in the sensor's unit")
    workspace = Table(
        {name: Interval(unit) for name, unit in coordinates.items()}
        | {
            "home": Coordinates(tuple(coordinates.values())),
            "reach_margin": Quantity("m", "not negative"),
            "conditioning_limit": Quantity("1", "positive"),
            "characteristic_length": Quantity("m", "positive"),
        },
        tuple(coordinates),
        WorkspaceSettings,
    )
    noise = Table(
        {
            "position": Quantity("m", "not negative"),
            "orientation": Quantity("rad", "not negative"),
            "reading": Quantity(unit, "not negative", "in the sensor's unit"),
        },
        settings=NoiseSettings,
    )
    sections: dict[str, Kind] = {
        "chain": OneOf(chain),
        "platform": OneOf(platform),
        "symmetry": _SYMMETRY,
        "reference_leg": Table(mode | parameters, tuple(parameters)),
        "legs": ListOf(Table(mode | estimates, tuple(parameters)), 1, _MOST_LEGS),
        "workspace": workspace,
        "noise": noise,
        "tolerances": _TOLERANCES,
        "joint_limits": Table({"lower": limit, "upper": limit}, settings=JointLimits),
        "protocol": _PROTOCOL,
        "measurements": MEASUREMENTS,
    }
    required = ("schema", "chain") + (("platform",) if platform == "point" else ())
    return Table(_HEADER_KINDS | sections, required)


def _parameter(chain: str, name: str, unit: str) -> Quantity:
    sign: Sign = "any"
    joints = chain.replace("[", "").replace("]", "")
    end = {"base_radius": joints[0], "platform_radius": joints[-1]}.get(name, "")
    if name.endswith("_length"):
        sign = "positive"
    elif name == "sensor_gain":
        sign = "not zero"
    elif name.endswith("_radius") and end != "P":
        sign = "not negative"  # a guide's distance from the centre is signed, a point's is not
    note = "active joint per sensor reading" if name == "sensor_gain" else ""
    return Quantity(unit, sign, note, direction=unit == "rad")


def mechanism_schema() -> Schema:
    """Return the JSON Schema (draft 2020-12) of mechanism files, one alternative per chain.

    Returns
    -------
    dict
    """
    files = [
        mechanism_table(chain, platform, None).schema()
        for platform in ("rigid", "point")
        for chain in chains(platform)
    ]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "symkin mechanism file",
        "anyOf": files,
    }


if __name__ == "__main__":
    sys.stdout.write(json.dumps(mechanism_schema(), indent=1) + "\n")
