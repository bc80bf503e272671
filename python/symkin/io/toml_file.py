# SPDX-License-Identifier: MIT
"""A TOML file together with its text, so that an error can name the line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from symkin.errors import MechanismFileError, TomlFileError
from symkin.io.tables import file_bytes

KeyPath = tuple[str | int, ...]
_Value = TypeVar("_Value")
_MOST_BYTES = 1_000_000
# What may be open at the end of a line. Below a statement of more lines, nothing has a place.
_CLOSINGS, _MOST_LINES = ("", "]", "]]", "]]]"), 200


@dataclass(frozen=True)
class TomlSource:
    """The text of a TOML file and the plain values in it."""

    path: Path
    text: str
    values: dict[str, Any]
    kind: type[TomlFileError] = MechanismFileError  # of its errors

    def error(self, keys: KeyPath, message: str) -> TomlFileError:
        """An error at a key, or at the table that should have held it."""
        return self.kind(message, self.path, self.line_of(keys), dotted(keys))

    def line_of(self, keys: KeyPath) -> int:
        """Line, from 1, of a key or table header; of the nearest enclosing one if it is absent."""
        lines = _lines_of_keys(self.text)
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
    """Read a TOML file.

    Parameters
    ----------
    path : Path
        The file.
    kind : type
        Of the errors about it.

    Returns
    -------
    TomlSource

    Raises
    ------
    TomlFileError
        If it is not a readable file, is empty, or is not TOML; the last with the line.
    """
    data = file_bytes(path, lambda message: kind(message, path))
    if len(data) > _MOST_BYTES:
        raise kind(f"has {len(data)} bytes; expected at most {_MOST_BYTES}", path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise kind("is not a text file in UTF-8", path) from error
    try:
        return TomlSource(path, text, tomllib.loads(text), kind)
    except (ValueError, RecursionError) as error:
        reason, _, place = str(error).partition(" (at ")
        line: int | None = None
        if number := re.match(r"line (\d+)", place):
            line = int(number[1])
        elif place:
            reason, line = f"{reason}; the file ends too early", text.rstrip().count("\n") + 1
        raise kind(f"is not valid TOML: {reason}", path, line) from error


def dotted(keys: KeyPath) -> str:
    """Write a path as ``legs[2].base_radius``; list items count from 1."""
    name = ""
    for key in keys:
        name += f"[{key + 1}]" if isinstance(key, int) else f".{key}" if name else key
    return name


def _lines_of_keys(text: str) -> dict[KeyPath, int]:
    """Where each table, key and item begins: statements of TOML can be read one by one."""
    places: dict[KeyPath, int] = {}
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
        for path in paths:
            in_list = any(isinstance(key, int) for key in path[len(table) :])
            places.setdefault(path, end if in_list else start + 1)
        start = end if complete else start
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
