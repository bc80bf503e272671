# SPDX-License-Identifier: MIT
"""Columns of a table: numbers, words, or the cells of a CSV, which may be either."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.values import Array, record

Cell = tuple[int, str]  # the row, from 0, and what stands there


@record
class Numbers:
    """A column as numbers."""

    values: Array  # (N,): NaN where a cell is empty, and where it holds something else
    empty: NDArray[np.bool_]  # (N,): which are empty
    text: Cell | None = None  # the first cell that is no number
    # For each decimal mark, the first cell that has it.
    marks: dict[str, Cell] = field(default_factory=dict)

    def numbers(self) -> Numbers:
        """Return itself."""
        return self

    def subset(self, rows: NDArray[np.intp]) -> Numbers:
        """Return some rows of what is all numbers."""
        return Numbers(self.values[rows], self.empty[rows])

    def words(self) -> Words:
        """Return the numbers as people write them."""
        distinct, places = np.unique(self.values, return_inverse=True)
        words = Words.of(None if np.isnan(each) else f"{each:.15g}" for each in distinct.tolist())
        return Words(words.codes[places], words.distinct)


@record
class Words:
    """A column as words."""

    # (N,): places among the words that differ; -1 where a cell is empty.
    codes: NDArray[np.integer[Any]]
    distinct: Sequence[str]  # these
    with_commas: bool = True  # whether a comma may be their decimal mark

    @classmethod
    def of(cls, cells: Iterable[str | None]) -> Words:
        """Words from cells, None where one is empty."""
        places: dict[str, int] = {}
        codes = [-1 if cell is None else places.setdefault(cell, len(places)) for cell in cells]
        return cls(np.array(codes, dtype=np.intp), list(places))

    def subset(self, rows: NDArray[np.intp]) -> Words:
        """Return some rows."""
        return replace(self, codes=self.codes[rows])

    def words(self) -> Words:
        """Return itself."""
        return self

    def numbers(self) -> Numbers:
        """Return the numbers that the words say."""
        found = [_core.csv_number(word, self.with_commas) for word in self.distinct]
        values = np.array([np.nan if each is None else each[0] for each in found] + [np.nan])
        marks = {mark: self._first([each and each[1] == mark for each in found]) for mark in ".,"}
        return Numbers(
            values[self.codes],
            self.codes < 0,
            self._first([each is None for each in found]),
            {mark: cell for mark, cell in marks.items() if cell},
        )

    def _first(self, wanted: Sequence[Any]) -> Cell | None:
        """The first cell of some of the words."""
        rows = np.flatnonzero(np.array([*map(bool, wanted), False])[self.codes])
        return (int(rows[0]), self.distinct[self.codes[rows[0]]]) if len(rows) else None


@record
class CsvCells:
    """A column of a CSV, by its place."""

    csv: _core.CsvTable
    place: int

    def subset(self, rows: NDArray[np.intp]) -> Words:
        """Return some rows, of which there may be few."""
        words = Words.of(self.csv.cell(row, self.place) or None for row in rows.tolist())
        return replace(words, with_commas=self.csv.with_commas)

    def words(self) -> Words:
        """Return the cells as they are written."""
        found = self.csv.words(self.place)
        return Words(found.codes, found.distinct, self.csv.with_commas)

    def numbers(self) -> Numbers:
        """Return the numbers that they say."""
        column = self.csv.column(self.place)
        marks = {".": self._cell(column.point), ",": self._cell(column.comma)}
        return Numbers(
            column.numbers,
            column.empty,
            self._cell(column.text),
            {mark: cell for mark, cell in marks.items() if cell},
        )

    def _cell(self, row: int) -> Cell | None:
        return (row, self.csv.cell(row, self.place)) if row >= 0 else None


class Column(Protocol):
    """What holds numbers or words."""

    def numbers(self) -> Numbers:
        """The column as numbers."""

    def words(self) -> Words:
        """The column as words."""

    def subset(self, rows: NDArray[np.intp], /) -> Column:
        """Some rows."""


def column_of(values: NDArray[Any]) -> Column | str:
    """Return the column that an array is, or what else it holds."""
    if values.dtype.kind in "iuf":
        numbers = values.astype(np.float64)
        return Numbers(numbers, np.isnan(numbers))
    if values.dtype.kind in "OUT":
        # Missing values are None, NaN or pandas' NA, of which only text is equal to itself.
        return Words.of(str(value) if _is_there(value) else None for value in values.tolist())
    return str(values.dtype)


def _is_there(value: Any) -> bool:
    return value is not None and str(value) not in ("", "nan", "<NA>")
