# SPDX-License-Identifier: MIT
"""Tables of numbers: CSV, or Parquet by extension."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from symkin.errors import MeasurementError, did_you_mean

__all__ = ["Table", "read_table", "write_table"]

_PARQUET = (".parquet", ".pq")


class Table:
    """Named columns of equal length. Rows are counted from 1, without the header.

    Attributes
    ----------
    path : Path
        The file, for messages.
    names : list of str
        Columns, in the file's order.
    row_count : int
        Number of rows.
    """

    def __init__(self, path: Path, data: pa.Table) -> None:
        self.path = path
        self.names: list[str] = list(data.column_names)
        self.row_count: int = data.num_rows
        self._data = data

    def error(self, message: str) -> MeasurementError:
        """An error about this table."""
        return MeasurementError(f"{self.path}: {message}")

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
            raise self.error(f'row {_first(empty)} is empty in column "{name}"; expected a number')
        strange = ~np.isfinite(values) & ~empty
        if strange.any():
            row = _first(strange)
            raise self.error(
                f'row {row} has {values[row - 1]} in column "{name}"; expected a finite number'
            )
        return np.where(empty, np.nan, values)

    def whole_numbers(self, name: str, least: int, most: int) -> NDArray[np.intp]:
        """Return a column of integers between two bounds, shape (N,)."""
        values = self.numbers(name)
        wrong = (values != np.round(values)) | (values < least) | (values > most)
        if wrong.any():
            row = _first(wrong)
            raise self.error(
                f'row {row} has {values[row - 1]:g} in column "{name}"; '
                f"expected a whole number from {least} to {most}"
            )
        return values.astype(np.intp)

    def words(self, name: str, allowed: Sequence[str]) -> list[str]:
        """Return a column of words out of a few."""
        values = [str(value) for value in self._data.column(name).to_pylist()]
        for row, value in enumerate(values, start=1):
            if value not in allowed:
                raise self.error(
                    f'row {row} has "{value}" in column "{name}"; expected {" or ".join(allowed)}'
                )
        return values

    def _parsed(self, name: str, cells: list[str | None]) -> NDArray[np.float64]:
        values = np.full(len(cells), np.nan)
        for row, cell in enumerate(cells, start=1):
            try:
                values[row - 1] = np.nan if cell is None else float(cell)
            except ValueError as error:
                raise self.error(
                    f'row {row} has "{cell}" in column "{name}"; expected a number'
                ) from error
        return values


def read_table(path: Path) -> Table:
    """Read a table; ``.parquet`` and ``.pq`` are Parquet, everything else is CSV with commas.

    Raises
    ------
    MeasurementError
        If the file is missing, empty, has a header only, or has rows of unequal length.
    """
    if not path.exists():
        raise MeasurementError(f"{path}: no such file")
    if path.is_dir():
        raise MeasurementError(f"{path}: is a directory, not a table")
    if path.stat().st_size == 0:
        raise MeasurementError(f"{path}: the file is empty")
    try:
        data = _read_parquet(path) if path.suffix in _PARQUET else _read_csv(path)
    except (pa.ArrowException, OSError, UnicodeError) as error:
        raise MeasurementError(f"{path}: {_in_rows(str(error))}") from error
    table = Table(path, data.rename_columns([name.strip() for name in data.column_names]))
    repeated = [name for name, count in Counter(table.names).items() if count > 1]
    if repeated:
        raise table.error(f'column "{repeated[0]}" occurs twice')
    if table.row_count == 0:
        raise table.error("there are no rows below the header")
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


def _read_csv(path: Path) -> pa.Table:
    with path.open("rb") as file:
        header = file.readline().decode("utf-8-sig")
    if "," not in header:
        for separator, name in ((";", "semicolons"), ("\t", "tabs")):
            if separator in header:
                raise MeasurementError(f"{path}: is separated by {name}; expected commas")
    # One thread, since only then does an error about a ragged row name the row.
    return csv.read_csv(
        path,
        csv.ReadOptions(use_threads=False),
        convert_options=csv.ConvertOptions(null_values=[""], strings_can_be_null=True),
    )


def _read_parquet(path: Path) -> pa.Table:
    from pyarrow import parquet

    return parquet.read_table(path)


def _is_number(kind: pa.DataType) -> bool:
    # A column of empty cells only has the type null.
    return bool(pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind))


def _first(rows: NDArray[np.bool_]) -> int:
    return int(np.argmax(rows)) + 1


def _in_rows(message: str) -> str:
    """pyarrow's message in one line, its row number without the header."""
    message = " ".join(message.split()).removeprefix("CSV parse error: ")
    ragged = re.match(r"Row #(\d+): Expected (\d+) columns, got (\d+)", message)
    if ragged:
        row, expected, got = map(int, ragged.groups())
        return f"row {row - 1} has {got} cells; expected {expected}"
    if message.startswith("Empty CSV"):
        return "there are no rows below the header"
    return f"cannot be read: {message}"
