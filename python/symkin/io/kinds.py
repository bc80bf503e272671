# SPDX-License-Identifier: MIT
"""What a value in a TOML file may be: how it is read, or refused, and its JSON Schema."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from symkin.errors import QuantityError, SymkinError, did_you_mean
from symkin.io.quantities import evaluate_quantity
from symkin.io.toml_file import KeyPath, TomlSource

Schema = dict[str, Any]
Sign = Literal["any", "positive", "not negative", "not zero"]
_ACCEPTS: dict[Sign, Callable[[float], bool]] = {
    "any": math.isfinite,
    "positive": lambda value: value > 0,
    "not negative": lambda value: value >= 0,
    "not zero": lambda value: value != 0,
}


class WrongValueError(SymkinError):
    """A value that a file may not have, and the path to it."""

    def __init__(self, message: str, keys: KeyPath = ()) -> None:
        super().__init__(message)
        self.keys = keys


@dataclass(frozen=True)
class Kind:
    """What a value may be: how it is read, or refused, and its JSON Schema."""

    read: Callable[[Any], Any]
    schema: Schema


def quantity(unit: str, sign: Sign = "any", note: str = "", direction: bool = False) -> Kind:
    """A number or an expression, read in an SI unit; the note is for its description."""

    def read(raw: Any) -> float:
        value = evaluate_quantity(raw, unit, direction=direction)
        if not _ACCEPTS[sign](value):
            raise QuantityError(f"is {raw}; expected a value that is {sign}")
        return value

    plain = "a plain number" if unit == "1" else f"{unit} unless a unit is written"
    described = (note or plain) + ("" if sign == "any" else f"; {sign}")
    return Kind(read, {"type": ["number", "string"], "description": described})


def text(most: int = 10_000, check: Callable[[str], str] = str) -> Kind:
    """Text, which `check` may refuse or change."""

    def read(raw: Any) -> str:
        if not isinstance(raw, str):
            raise WrongValueError(f"is {raw!r}; expected text")
        if len(raw) > most:
            raise WrongValueError(f"has {len(raw)} characters; expected at most {most}")
        return check(raw)

    return Kind(read, {"type": "string", "maxLength": most})


def whole(least: int, most: int) -> Kind:
    """An integer between two bounds."""

    def read(raw: Any) -> int:
        if not isinstance(raw, int) or isinstance(raw, bool):
            raise WrongValueError(f"is {raw!r}; expected a whole number (an integer)")
        if raw < least:
            raise WrongValueError(f"is {raw}; expected a value greater than or equal to {least}")
        if raw > most:
            raise WrongValueError(f"is too large; expected a value less than or equal to {most}")
        return raw

    return Kind(read, {"type": "integer", "minimum": least, "maximum": most})


def choice(*values: Any) -> Kind:
    """One of some words or numbers."""

    def read(raw: Any) -> Any:
        # TOML's true and 1.0 equal 1, but are not meant.
        if isinstance(raw, bool | float) and isinstance(values[0], int):
            raise WrongValueError(f"is {str(raw).lower()}; expected a whole number")
        if raw not in values:
            near = did_you_mean(raw, filter(_is_text, values)) if _is_text(raw) else ""
            raise WrongValueError(f"is {raw!r}; expected {' or '.join(map(repr, values))}{near}")
        return raw

    return Kind(read, {"const": values[0]} if len(values) == 1 else {"enum": list(values)})


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def list_of(kind: Kind, least: int = 0, most: int | None = None) -> Kind:
    """A list of so many values."""

    def read(raw: Any) -> list[Any]:
        if not isinstance(raw, list):
            raise WrongValueError("is not a list; expected one")
        if len(raw) < least or (most is not None and len(raw) > most):
            raise WrongValueError(f"has {len(raw)} items; expected {least} to {most}")
        return [read_at(index, kind, item) for index, item in enumerate(raw)]

    bounds = {} if most is None else {"minItems": least, "maxItems": most}
    return Kind(read, {"type": "array", "items": kind.schema, **bounds})


def one_or_list(kind: Kind, least: int = 0, most: int | None = None) -> Kind:
    """A value for all, or a list of so many."""
    several = list_of(kind, least, most)

    def read(raw: Any) -> Any:
        return (several if isinstance(raw, list) else kind).read(raw)

    return Kind(read, {"anyOf": [kind.schema, several.schema]})


def table(kinds: Mapping[str, Kind], required: tuple[str, ...] = (), settings: Any = None) -> Kind:
    """A table of keys; `settings` has the defaults of those that may be left out."""

    def read(raw: Any) -> dict[str, Any]:
        if not isinstance(raw, dict):
            raise WrongValueError("is not a table of keys; expected one")
        # A misspelt key is reported rather than the one that is missing because of it.
        for name in raw:
            if name not in kinds:
                raise WrongValueError(f"unknown key{did_you_mean(name, kinds)}", (name,))
        for name in required:
            if name not in raw:
                raise WrongValueError("this key is missing", (name,))
        return {name: read_at(name, kinds[name], value) for name, value in raw.items()}

    properties = {}
    for name, kind in kinds.items():
        default = getattr(settings, name, None)
        finite = isinstance(default, int | float) and math.isfinite(default)
        properties[name] = kind.schema | ({"default": default} if finite else {})
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return Kind(read, schema | ({"required": list(required)} if required else {}))


def read_at(key: str | int, kind: Kind, raw: Any) -> Any:
    """Read one value; an error says at which key."""
    try:
        return kind.read(raw)
    except WrongValueError as error:
        raise WrongValueError(str(error), (key, *error.keys)) from error
    except SymkinError as error:
        raise WrongValueError(str(error), (key,)) from error


def read_table(source: TomlSource, kind: Kind, keys: KeyPath = ()) -> dict[str, Any]:
    """Read the table below `keys` of a file.

    Raises
    ------
    TomlFileError
        At the first wrong key.
    """
    values: Any = source.values
    for key in keys:
        values = values[key]
    try:
        read: dict[str, Any] = kind.read(values)
    except WrongValueError as error:
        raise source.error(keys + error.keys, str(error)) from error
    return read
