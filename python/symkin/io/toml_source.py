# SPDX-License-Identifier: MIT
"""A TOML file together with its text, so that an error can name the line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import tomlkit
from tomlkit.container import OutOfOrderTableProxy
from tomlkit.exceptions import ParseError, TOMLKitError
from tomlkit.items import AoT, Table

from symkin.errors import MechanismFileError
from symkin.io.sources import file_bytes

__all__ = ["MARK", "KeyPath", "TomlSource", "at", "dotted", "line_of_item", "read_toml"]

KeyPath = tuple[str | int, ...]
# Stands for a place in a text; no file has it.
MARK = "\u241fhere\u241f"
_Value = TypeVar("_Value")
# The parser takes a second for each 100 kB.
_MOST_BYTES = 1_000_000


@dataclass(frozen=True)
class TomlSource:
    """The text of a TOML file and the plain values in it."""

    path: Path
    text: str
    values: dict[str, Any]

    def error(self, keys: KeyPath, message: str) -> MechanismFileError:
        """An error at a key, or at the table that should have held it."""
        return MechanismFileError(message, self.path, self.line_of(keys), dotted(keys))

    def line_of(self, keys: KeyPath) -> int:
        """Line, from 1, of a key or table header; of the nearest enclosing one if it is absent."""
        for length in range(len(keys), 0, -1):
            line = line_of_item(self.text, keys[:length])
            if line is not None:
                return line
        return 1

    def call(self, keys: KeyPath, function: Callable[[], _Value]) -> _Value:
        """Return ``function()``; errors about what it was given are placed at `keys`."""
        try:
            return function()
        except MechanismFileError:
            raise
        except ValueError as error:
            raise self.error(keys, str(error)) from error

    def existing(self, keys: KeyPath) -> KeyPath:
        """Return the longest part of a path that the file has."""
        for length in range(len(keys), 0, -1):
            try:
                at(self.values, keys[:length])
            except (KeyError, IndexError, TypeError):
                continue
            return keys[:length]
        return ()


def read_toml(path: Path) -> TomlSource:
    """Read a TOML file.

    Returns
    -------
    TomlSource

    Raises
    ------
    MechanismFileError
        If it is not a readable file, is empty, or is not TOML; the last with the line.
    """
    data = file_bytes(path, lambda message: MechanismFileError(message, path))
    if len(data) > _MOST_BYTES:
        raise MechanismFileError(f"has {len(data)} bytes; expected at most {_MOST_BYTES}", path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MechanismFileError("is not a text file in UTF-8", path) from error
    try:
        values = tomlkit.parse(text).unwrap()
    except ParseError as error:
        reason, line = str(error).split(" at line ")[0], error.line
        if "\\x00" in reason and "\x00" not in text:  # tomlkit's end of the text, at no line
            reason, line = "the file ends too early", text.rstrip().count("\n") + 1
        raise MechanismFileError(f"is not valid TOML: {reason}", path, line) from error
    except (TOMLKitError, ValueError, RecursionError) as error:
        raise MechanismFileError(f"is not valid TOML: {error}", path) from error
    return TomlSource(path, text, values)


def dotted(keys: KeyPath) -> str:
    """Write a path as ``legs[2].base_radius``; list items count from 1."""
    name = ""
    for key in keys:
        name += f"[{key + 1}]" if isinstance(key, int) else f".{key}" if name else key
    return name


def at(values: Any, keys: KeyPath) -> Any:
    """Return what is below `keys` in nested tables and lists."""
    for key in keys:
        values = values[key]
    return values


def line_of_item(text: str, keys: KeyPath) -> int | None:
    """Return the line, from 1, of a key or a table header; None if the text does not have it."""
    # tomlkit keeps the layout but no positions: mark the item, and see where the mark comes out.
    document = tomlkit.parse(text)
    try:
        container: Any = at(document, keys[:-1])
        item: Any = container[keys[-1]]
    except (KeyError, IndexError, TypeError):
        return None
    if isinstance(item, AoT):
        item = item[0]
    if isinstance(item, Table) and not item.is_super_table():
        item.comment(MARK)
    elif isinstance(item, Table | OutOfOrderTableProxy):  # no header of its own
        return line_of_item(text, (*keys, next(iter(item))))
    else:
        container[keys[-1]] = MARK
    before, mark, _ = document.as_string().partition(MARK)
    return before.count("\n") + 1 if mark else None
