# SPDX-License-Identifier: MIT
"""CSV as spreadsheets and laboratory programs write it, cell by cell."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from symkin.errors import MeasurementError

_SEPARATORS = ",;\t"
_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE | re.ASCII)
_NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x1f]")


@dataclass(frozen=True)
class CsvCells:
    """The cells of a CSV file.

    Attributes
    ----------
    names : list of str
        Of the columns.
    rows : list of list of str
        Cells without the blanks around them; each row has as many as there are names.
    row_numbers : list of int
        The line of each row in the file, from 1; header, comments and empty lines count.
    separator : str
        A comma, a semicolon or a tab.
    """

    names: list[str]
    rows: list[list[str]]
    row_numbers: list[int]
    separator: str


def read_cells(data: bytes, error: Callable[[str], MeasurementError]) -> CsvCells:
    """Read CSV: UTF-8, UTF-16 with its mark, or Latin-1; commas, semicolons or tabs.

    Lines that begin with ``#``, empty lines and rows of empty cells are passed over.

    Raises
    ------
    MeasurementError
        Made by `error`: if the file is no text, has no rows, or a row has too few or many cells.
    """
    lines = _Lines(_decoded(data, error))
    header = next(lines, None)
    if header is None:
        raise error("there are no rows below the header")
    separator = _separator(header)
    lines.again()
    records = csv.reader(lines, delimiter=separator, skipinitialspace=separator != "\t")
    names: list[str] | None = None
    rows: list[list[str]] = []
    numbers: list[int] = []
    try:
        for record in records:
            cells = [cell.strip() for cell in record]
            place = lines.first()
            if names is None:
                names = cells
            elif any(cells):
                if len(cells) != len(names):
                    raise error(f"row {place} has {len(cells)} cells; expected {len(names)}")
                rows.append(cells)
                numbers.append(place)
    except csv.Error as unreadable:
        raise error(f"row {lines.first()} cannot be read: {unreadable}") from unreadable
    if names is None or not rows:
        raise error("there are no rows below the header")
    if all(_NUMBER.fullmatch(name) for name in names):
        raise error("its first row has numbers; expected the names of the columns")
    return CsvCells(names, rows, numbers, separator)


def number(cell: str, separator: str) -> tuple[float, str]:
    """Return a cell's number and its decimal mark, which is empty if it has none.

    Raises
    ------
    ValueError
        If the cell is no number, or has a decimal comma in a table separated by commas.
    """
    if _NOT_FINITE.fullmatch(cell):
        return float(cell), ""
    if not _NUMBER.fullmatch(cell) or (separator == "," and "," in cell):
        raise ValueError(cell)
    mark = "," if "," in cell else "." if "." in cell else ""
    return float(cell.replace(",", ".")), mark


class _Lines(Iterator[str]):
    """The lines of a text without comments and empty ones, and where they stand in it."""

    def __init__(self, text: str) -> None:
        self._lines = text.split("\n")
        self._next = 0
        self._first: int | None = None

    def __next__(self) -> str:
        while self._next < len(self._lines):
            line = self._lines[self._next]
            self._next += 1
            # Inside a record, whose quotes are still open, nothing is a comment.
            if self._first is not None or (line.strip() and not line.lstrip().startswith("#")):
                self._first = self._first or self._next
                return line + "\n"
        raise StopIteration

    def again(self) -> None:
        """Begin anew."""
        self._next, self._first = 0, None

    def first(self) -> int:
        """Return the line, from 1, at which the record begins that ends here."""
        first, self._first = self._first or self._next, None
        return first


def _decoded(data: bytes, error: Callable[[str], MeasurementError]) -> str:
    try:
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            text = data.decode("utf-16")
        else:
            text = data.decode("utf-8-sig")
    except UnicodeDecodeError as undecodable:
        if undecodable.encoding != "utf-8":
            raise error(f"cannot be read: {undecodable.reason}") from undecodable
        text = data.decode("latin-1")
    strange = _NO_TEXT.search(text)
    if strange:
        row = text.count("\n", 0, strange.start()) + 1
        raise error(f"cannot be read: row {row} has a character {strange.group()!r}; expected text")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _separator(header: str) -> str:
    """What separates the names, outside of quotes, most often."""
    bare = re.sub(r'"[^"]*"', "", header)
    return max(_SEPARATORS, key=bare.count)
