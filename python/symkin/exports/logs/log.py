# SPDX-License-Identifier: MIT
"""What readers of logs take and give."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.values import Array, Value, field, record

_COMMA = re.compile(r"\s*[-+]?\d*,\d+(?:[eE][-+]?\d+)?\s*")


@record
class Asked:
    """What is said beside a log."""

    mechanism: Mechanism | None = None  # the robot that was logged
    beside: Log | None = None  # a second log of the same motion: what the encoders showed
    radius: float | None = None  # how far from the middle a bed was probed, m
    body: str = ""  # name of the rigid body that is the platform's; empty: the first


@record
class Log:
    """A file, and its text."""

    path: Path
    data: bytes

    @cached_property
    def text(self) -> str:
        """As UTF-8 or, where that does not fit, Latin-1."""
        for encoding in ("utf-8-sig", "latin-1"):
            try:
                return self.data.decode(encoding)
            except UnicodeDecodeError:
                continue
        raise self.error("is no text")

    @cached_property
    def lines(self) -> list[str]:
        """Lines without what ends them."""
        return self.text.splitlines()

    def error(self, message: str) -> SymkinError:
        """An error about this file."""
        return SymkinError(f"{self.path}: {message}")


@record
class ImportedLog(Value):
    """What was measured, read from a log."""

    kind: str  # title of the format
    # A table of measurements; empty if the log has none.
    columns: Mapping[str, Any] = field(private=True)
    mechanism: Mechanism | None = field(private=True)  # the robot, if the log has its geometry
    took: tuple[str, ...]  # what was taken from the log, and what was left in it
    left: tuple[str, ...]


@record
class LogFormat:
    """A kind of log."""

    name: str  # in a word, and in words
    title: str
    recognises: Callable[[Log], bool]  # whether a file is one, by what it holds
    read: Callable[[Log, Asked], ImportedLog]  # what it says


def rows_of(log: Log) -> list[list[str]]:
    """Cells between commas; or between semicolons or tabs, with which a comma may be decimal."""
    head = log.lines[0] if log.lines else ""
    mark = max(",;\t", key=head.count)
    try:
        rows = list(csv.reader(log.lines, delimiter=mark))
    except csv.Error as error:
        raise log.error(f"is no CSV: {error}") from error
    if mark == ",":
        return rows
    return [[c.replace(",", ".") if _COMMA.fullmatch(c) else c for c in row] for row in rows]


def numbers_of(log: Log, rows: Sequence[Sequence[str]], first: int, width: int) -> Array:
    """Cells as numbers; NaN where nothing was seen. `first` is the number of the first row."""
    found = np.full((len(rows), width), np.nan)
    for i, row in enumerate(rows):
        if len(row) > width:
            raise log.error(f"row {first + i} has {len(row)} cells; expected {width}")
        for k, cell in enumerate(row):
            if not cell.strip():
                continue
            try:
                found[i, k] = float(cell)
            except ValueError as error:
                raise log.error(f'row {first + i} has "{cell[:40]}"; expected a number') from error
    return np.where(np.isfinite(found), found, np.nan)
