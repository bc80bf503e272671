# SPDX-License-Identifier: MIT
"""TOML files: where their keys stand, and what values may be, as they are read or in a schema."""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Literal, TypeVar

from symkin.errors import (
    MechanismFileError,
    QuantityError,
    SymkinError,
    TomlFileError,
    did_you_mean,
)
from symkin.storage.quantities import evaluate_quantity
from symkin.storage.tables import file_bytes, kind_of_file
from symkin.values import record

KeyPath = tuple[str | int, ...]
_Value = TypeVar("_Value")
_MOST_BYTES = 1_000_000
# What may be open at the end of a line. Below a statement of more lines, nothing has a place.
_CLOSINGS, _MOST_LINES = ("", "]", "]]", "]]]"), 200
Schema = dict[str, Any]
Sign = Literal["any", "positive", "not negative", "not zero"]
_LEAST = 1e-100  # in any unit: less is zero to whoever divides by its square
_ACCEPTS: dict[Sign, Callable[[float], bool]] = {
    "any": math.isfinite,
    "positive": lambda value: value > _LEAST,
    "not negative": lambda value: value >= 0,
    "not zero": lambda value: abs(value) > _LEAST,
}


@record
class TomlSource:
    """The text of a TOML file and the plain values in it."""

    path: Path
    text: str
    values: dict[str, Any]
    kind: type[TomlFileError] = MechanismFileError  # of its errors
    written: Mapping[KeyPath, KeyPath] = field(default_factory=dict)  # where the text has values

    def error(self, keys: KeyPath, message: str) -> TomlFileError:
        """An error at a key, or at the table that should have held it."""
        for length in range(len(keys), 0, -1):
            if keys[:length] in self.written:
                keys = (*self.written[keys[:length]], *keys[length:])
                break
        return self.kind(message, self.path, self.line_of(keys), dotted(keys))

    def line_of(self, keys: KeyPath) -> int:
        """Line, from 1, of a key or table header; of the nearest enclosing one if it is absent."""
        lines = lines_of_keys(self.text)
        found = (lines.get(keys[:length]) for length in range(len(keys), 0, -1))
        return next((line for line in found if line is not None), 1)

    def call(self, keys: KeyPath, function: Callable[[], _Value]) -> _Value:
        """Return ``function()``; errors about what it was given are placed at `keys`."""
        try:
            return function()
        except TomlFileError:
            raise
        except ValueError as error:
            raise self.error(keys, str(error)) from error


def read_toml(path: Path, kind: type[TomlFileError] = MechanismFileError) -> TomlSource:
    """Read a TOML file; errors about it are of this kind.

    Raises
    ------
    TomlFileError
        If it is not a readable file, is empty, or is not TOML; the last with the line.
    """
    data = file_bytes(path, lambda message: kind(message, path), _MOST_BYTES)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise kind("is not a text file in UTF-8", path) from error
    try:
        return TomlSource(path, text, tomllib.loads(text), kind)
    except (ValueError, RecursionError) as error:
        other = kind_of_file(path)
        if other and path.suffix.lower() != ".toml":
            raise kind(f"is {other}; expected {kind.whole}", path) from error
        reason, _, place = str(error).partition(" (at ")
        line: int | None = None
        if number := re.match(r"line (\d+)", place):
            line = int(number[1])
        elif place:
            reason, line = f"{reason}; the file ends too early", text.rstrip().count("\n") + 1
        raise kind(f"is not valid TOML: {reason}", path, line) from error


def toml_value(value: Any) -> str:
    """Write a number, text, a list or a table in one line."""
    if isinstance(value, Mapping):
        pairs = (f"{toml_key(key)} = {toml_value(each)}" for key, each in value.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, str):
        # JSON's escapes are TOML's, which wants one for a further character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    # numpy's numbers show their type.
    return repr(float(value)) if isinstance(value, float) else repr(int(value))


def toml_key(name: str) -> str:
    """Write a key as TOML wants it: patterns, and letters beyond ASCII, in quotation marks."""
    return name if name.isascii() and name.replace("_", "a").isalnum() else toml_value(name)


def dotted(keys: KeyPath) -> str:
    """Write a path as ``legs[2].base_radius``; list items count from 1."""
    name = ""
    for key in keys:
        name += f"[{key + 1}]" if isinstance(key, int) else f".{key}" if name else key
    return name


@record
class Statement:
    """A statement of a TOML file: a header, a key with its value, or a line that says nothing."""

    first: int  # line, from 0
    end: int  # the line after its last
    values: dict[str, Any]  # as if it stood alone
    paths: list[KeyPath]  # of all that it gives, outer ones first; none of a comment
    table: KeyPath  # in which it stands

    @property
    def path(self) -> KeyPath | None:
        """Of its table if it is a header, of its key if not; none of a comment."""
        if not self.paths:
            return None
        return self.table if self.paths[-1] == self.table else self.paths[0]


def statements(text: str) -> Iterator[tuple[Statement, bool]]:
    """The statements of a file and whether each ends there, since they can be read one by one.

    One that goes on is given again with each of its lines.
    """
    counts: dict[KeyPath, int] = {}  # of the tables in each list of tables
    table: KeyPath = ()
    lines = text.split("\n")
    start = 0
    for end in range(1, len(lines) + 1):
        if end - start > _MOST_LINES:
            break
        statement = "\n".join(lines[start:end])
        values, complete = _parsed(statement)
        if values is None:
            continue
        if complete and statement.lstrip().startswith("["):
            table = _path_of_header(values, counts)
            paths = [table[:length] for length in range(1, len(table) + 1)]
        else:
            paths = [(*table, *keys) for keys in _paths(values)]
        yield Statement(start, end, values, paths, table), complete
        start = end if complete else start


def lines_of_keys(text: str) -> dict[KeyPath, int]:
    """Line, from 1, where each table, key and item begins."""
    places: dict[KeyPath, int] = {}
    for each, _ in statements(text):
        for path in each.paths:
            in_list = any(isinstance(key, int) for key in path[len(each.table) :])
            places.setdefault(path, each.end if in_list else each.first + 1)
    return places


def _parsed(statement: str) -> tuple[dict[str, Any] | None, bool]:
    """The values of a statement, or of its beginning, and whether it is complete."""
    for closing in _CLOSINGS:
        try:
            return tomllib.loads(f"{statement}\n{closing}"), not closing
        except (ValueError, RecursionError):
            continue
    return None, False


def _path_of_header(values: Any, counts: dict[KeyPath, int]) -> KeyPath:
    """The path of a table; of a list of tables it is the last one so far."""
    path: KeyPath = ()
    while isinstance(values, dict) and values:
        name, values = next(iter(values.items()))
        path = (*path, name)
        if isinstance(values, list):
            counts[path] = counts.get(path, 0) + 1
        if path in counts:
            path = (*path, counts[path] - 1)
    return path


def _paths(values: Any) -> Iterator[KeyPath]:
    """All paths in nested tables and lists, outer ones first."""
    pending: list[tuple[KeyPath, Any]] = [((), values)]
    while pending:  # a recursion would end where a file nests deeply
        path, values = pending.pop()
        for key, value in values.items() if isinstance(values, dict) else enumerate(values):
            yield (*path, key)
            if isinstance(value, dict | list):
                pending.append(((*path, key), value))


class WrongValueError(SymkinError):
    """A value that a file may not have, and the path to it."""

    def __init__(self, message: str, keys: KeyPath = ()) -> None:
        super().__init__(message)
        self.keys = keys


def check_keys(
    given: Collection[str], known: Collection[str], required: Iterable[str] = (), *place: str
) -> None:
    """Refuse a table at a place for a key that nobody knows, or for one that is missing."""
    # A misspelt key is reported rather than the one that is missing because of it.
    for key in given:
        if key not in known:
            raise WrongValueError(f"unknown key{did_you_mean(key, known)}", (*place, key))
    for key in required:
        if key not in given:
            raise WrongValueError("this key is missing", (*place, key))


@record
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


def boolean() -> Kind:
    """True or false."""

    def read(raw: Any) -> Any:
        if not isinstance(raw, bool):
            raise WrongValueError(f"is {raw!r}; expected true or false")
        return raw

    return Kind(read, {"type": "boolean"})


def schema_version(own: int) -> Kind:
    """The number of a file's schema, of which this package reads one."""
    usual = choice(own)

    def read(raw: Any) -> Any:
        if isinstance(raw, int) and not isinstance(raw, bool) and raw > own:
            raise WrongValueError(
                f"is {raw}, of a newer symkin; expected {own}: update symkin, or write the file "
                "with this one"
            )
        return usual.read(raw)

    return Kind(read, usual.schema)


def choice(*values: Any) -> Kind:
    """One of some words or numbers."""

    def read(raw: Any) -> Any:
        # TOML's true and 1.0 equal 1, but are not meant.
        if isinstance(raw, bool | float) and isinstance(values[0], int):
            raise WrongValueError(f"is {str(raw).lower()}; expected a whole number")
        if raw not in values:
            words = [value for value in values if isinstance(value, str)]
            near = did_you_mean(raw, words) if isinstance(raw, str) else ""
            raise WrongValueError(f"is {raw!r}; expected {' or '.join(map(repr, values))}{near}")
        return raw

    return Kind(read, {"const": values[0]} if len(values) == 1 else {"enum": list(values)})


def list_of(kind: Kind, least: int = 0, most: int | None = None) -> Kind:
    """A list of so many values."""

    def read(raw: Any) -> list[Any]:
        if not isinstance(raw, list):
            raise WrongValueError("is not a list; expected one")
        if len(raw) < least or (most is not None and len(raw) > most):
            wanted = least if least == most else f"{least} to {most}"
            raise WrongValueError(f"has {len(raw)} items; expected {wanted}")
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
        check_keys(raw, kinds, required)
        return {name: read_at(name, kinds[name], value) for name, value in raw.items()}

    properties = {}
    for name, kind in kinds.items():
        default = getattr(settings, name, None)
        finite = isinstance(default, int | float) and math.isfinite(default)
        properties[name] = kind.schema | ({"default": default} if finite else {})
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return Kind(read, schema | ({"required": list(required)} if required else {}))


def estimate(value: Kind, others: Mapping[str, Kind]) -> Kind:
    """A value, or a table of it as ``value`` and of what is known of its errors; reads a table."""
    kinds = {"value": value, **others}

    def read(raw: Any) -> dict[str, Any]:
        if not isinstance(raw, dict):
            return {"value": value.read(raw)}
        for name in raw:
            if name not in kinds:
                raise QuantityError(f'has an unknown key "{name}"{did_you_mean(name, kinds)}')
        if "value" not in raw:
            raise QuantityError('has no "value"')
        return {name: kinds[name].read(each) for name, each in raw.items()}

    return Kind(read, {"anyOf": [value.schema, table(kinds, ("value",)).schema]})


def read_at(key: str | int, kind: Kind, raw: Any) -> Any:
    """Read one value; an error says at which key."""
    try:
        return kind.read(raw)
    except WrongValueError as error:
        raise WrongValueError(str(error), (key, *error.keys)) from error
    except SymkinError as error:
        raise WrongValueError(str(error), (key,)) from error


def read_table(source: TomlSource, kind: Kind, keys: KeyPath = ()) -> dict[str, Any]:
    """Read the table below `keys` of a file."""
    values: Any = source.values
    for key in keys:
        values = values[key]
    try:
        read: dict[str, Any] = kind.read(values)
    except WrongValueError as error:
        raise source.error(keys + error.keys, str(error)) from error
    return read
