# SPDX-License-Identifier: MIT
"""Tables of numbers: CSV, or Parquet by extension."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from symkin.errors import MeasurementError, did_you_mean
from symkin.io.csv_text import number, read_cells
from symkin.io.sources import file_bytes

__all__ = ["Table", "read_table", "write_table"]

_PARQUET = (".parquet", ".pq")


class Table:
    """Named columns of equal length.

    Attributes
    ----------
    path : Path
        The file, for messages.
    names : list of str
        Columns, in the file's order.
    row_count : int
        Number of rows.
    row_numbers : ndarray of int, shape (N,)
        Where the rows stand in the file, from 1: lines of a CSV, whose header is row 1 if nothing
        stands above it, and rows of a Parquet table. Messages quote these.
    """

    def __init__(
        self, path: Path, data: pa.Table, row_numbers: Sequence[int], separator: str = ""
    ) -> None:
        self.path = path
        self.names: list[str] = list(data.column_names)
        self.row_count: int = data.num_rows
        self.row_numbers = np.array(row_numbers, dtype=np.intp)
        self._data = data
        self._separator = separator
        self._marked: tuple[str, str] | None = None

    def error(self, message: str) -> MeasurementError:
        """An error about this table."""
        return MeasurementError(f"{self.path}: {message}")

    def row_error(self, index: int, message: str) -> MeasurementError:
        """An error about a row, from 0."""
        return self.error(f"row {self.row_numbers[index]} {message}")

    def require(self, name: str, purpose: str) -> None:
        """Refuse a table without this column, naming those that it has."""
        if name not in self.names:
            raise self.error(
                f'column "{name}" ({purpose}) is missing{did_you_mean(name, self.names)} '
                f"(columns present: {', '.join(self.names)})"
            )

    def numbers(self, name: str, *, empty_allowed: bool = False) -> NDArray[np.float64]:
        """Return a column as float64, shape (N,).

        Raises
        ------
        MeasurementError
            At the first cell that is no number or not finite, or is empty unless that is allowed;
            an allowed empty cell is NaN.
        """
        column = self._data.column(name)
        if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
            values = self._parsed(name, column.to_pylist())
        elif not _is_number(column.type):
            raise self.error(f'column "{name}" holds {column.type}; expected numbers')
        else:
            values = np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)
        empty = np.asarray(column.is_null().to_numpy(), dtype=bool)
        if empty.any() and not empty_allowed:
            raise self.row_error(
                int(np.argmax(empty)), f'is empty in column "{name}"; expected a number'
            )
        strange = ~np.isfinite(values) & ~empty
        if strange.any():
            index = int(np.argmax(strange))
            instead = ", or an empty cell for what was not read" if empty_allowed else ""
            raise self.row_error(
                index,
                f'has {values[index]} in column "{name}"; expected a finite number{instead}',
            )
        return np.where(empty, np.nan, values)

    def whole_numbers(self, name: str, least: int, most: int) -> NDArray[np.intp]:
        """Return a column of integers between two bounds, shape (N,)."""
        values = self.numbers(name)
        wrong = (values != np.round(values)) | (values < least) | (values > most)
        if wrong.any():
            index = int(np.argmax(wrong))
            raise self.row_error(
                index,
                f'has {values[index]:g} in column "{name}"; '
                f"expected a whole number from {least} to {most}",
            )
        return values.astype(np.intp)

    def words(self, name: str, allowed: Sequence[str]) -> list[str]:
        """Return a column of words out of a few."""
        values = [str(value or "") for value in self._data.column(name).to_pylist()]
        for index, value in enumerate(values):
            if value not in allowed:
                raise self.row_error(
                    index, f'has "{value}" in column "{name}"; expected {" or ".join(allowed)}'
                )
        return values

    def _parsed(self, name: str, cells: list[str | None]) -> NDArray[np.float64]:
        values = np.full(len(cells), np.nan)
        for index, cell in enumerate(cells):
            if cell is None:
                continue
            try:
                values[index], mark = number(cell, self._separator)
            except ValueError as error:
                raise self.row_error(
                    index, f'has "{cell}" in column "{name}"; expected a number'
                ) from error
            self._check_mark(cell, mark)
        return values

    def _check_mark(self, cell: str, mark: str) -> None:
        """A comma may divide thousands where others have a decimal point, so nobody can tell."""
        if not mark:
            return
        if self._marked is None:
            self._marked = cell, mark
        elif self._marked[1] != mark:
            raise self.error(
                f'has "{self._marked[0]}" and "{cell}"; expected one kind of decimal mark'
            )


def read_table(path: Path) -> Table:
    """Read a table; ``.parquet`` and ``.pq`` are Parquet, everything else is CSV.

    CSV is separated by commas, semicolons or tabs; with the latter two, the decimal mark may be a
    comma. Lines that begin with ``#`` are comments. Latin-1 is read where UTF-8 does not fit.

    Raises
    ------
    MeasurementError
        If the file is missing, empty, has a header only, or has rows of unequal length.
    """

    def error(message: str) -> MeasurementError:
        return MeasurementError(f"{path}: {message}")

    data = file_bytes(path, error)
    table = _parquet_table(path, data) if path.suffix in _PARQUET else _csv_table(path, data, error)
    counts = Counter(name for name in table.names if name)
    repeated = [name for name, count in counts.items() if count > 1]
    if repeated:
        raise error(f'column "{repeated[0]}" occurs twice')
    if table.row_count == 0:
        raise error("there are no rows below the header")
    return table


def write_table(path: Path, columns: Mapping[str, Any]) -> None:
    """Write columns as CSV or Parquet, by extension.

    Numbers read back to the same floats; NaN is written as an empty cell.
    """
    # from_pandas makes NaN a missing value.
    data = pa.table({name: pa.array(v, from_pandas=True) for name, v in columns.items()})
    if path.suffix in _PARQUET:
        from pyarrow import parquet

        parquet.write_table(data, path)
    else:
        with path.open("wb") as file:
            # Written here, since pyarrow would put the names in quotes.
            file.write((",".join(columns) + "\n").encode())
            csv.write_csv(data, file, csv.WriteOptions(include_header=False, quoting_style="none"))


def _csv_table(path: Path, data: bytes, error: Callable[[str], MeasurementError]) -> Table:
    cells = read_cells(data, error)
    columns = [
        pa.array([cell or None for cell in column], pa.large_string())
        for column in zip(*cells.rows, strict=True)
    ]
    return Table(
        path, pa.Table.from_arrays(columns, cells.names), cells.row_numbers, cells.separator
    )


def _parquet_table(path: Path, data: bytes) -> Table:
    from pyarrow import parquet

    try:
        read = parquet.read_table(pa.BufferReader(data))
    except (pa.ArrowException, OSError, UnicodeError) as error:
        raise MeasurementError(f"{path}: cannot be read: {error}") from error
    names = [name.strip() for name in read.column_names]
    return Table(path, read.rename_columns(names), range(1, read.num_rows + 1))


def _is_number(kind: pa.DataType) -> bool:
    # A column of empty cells only has the type null.
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind))
