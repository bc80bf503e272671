# SPDX-License-Identifier: MIT
"""Tables of numbers: CSV, Parquet, or columns that are in memory already."""

from __future__ import annotations

import codecs
import csv
import gzip
import math
import os
import re
import stat
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from io import BytesIO
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from symkin.errors import MeasurementError, SymkinError, did_you_mean, known_extension
from symkin.storage.quantities import unit_factor


# A file, an open stream of text or bytes, or a DataFrame or other mapping of columns.
class DataFrame(Protocol):
    """A table of pandas, polars or their kin."""

    @property
    def columns(self) -> Any:
        """Names of its columns."""

    def __getitem__(self, name: Any, /) -> Any:
        """A column."""


TableSource = str | os.PathLike[str] | IO[str] | IO[bytes] | Mapping[str, Any] | DataFrame
# In which units columns in m and rad are written: as they are, unless others were asked for.
WRITTEN_UNITS: ContextVar[Mapping[str, str]] = ContextVar("written units", default={})  # noqa: B039
_PARQUET = (".parquet", ".pq")
_SPECIAL = frozenset(',"\r\n')  # of CSV
_GZIP = b"\x1f\x8b"
_MOST_BYTES = 1_000_000_000  # of what was compressed
# Text, None where a cell is empty; or numbers and where they are missing; or what else it holds.
_Column = list[str | None] | tuple[NDArray[np.float64], NDArray[np.bool_]] | str


class Table:
    """Named columns of equal length.

    Attributes
    ----------
    path : Path or None
        The file, if it is one.
    name : str
        What messages call it.
    names : list of str
        Columns, in the file's order.
    row_count : int
        Number of rows.
    row_numbers : ndarray of int, shape (N,)
        Where the rows stand in the file, from 1: lines of a CSV, whose header is row 1 if nothing
        stands above it, and rows of other tables. Messages quote these.
    step : str
        The size of the steps that columns such as ``psi_1_step`` count, ``"1.25e-05 m/step"``;
        empty if nobody said it.
    """

    step: str = ""

    def __init__(
        self,
        path: Path | None,
        name: str,
        columns: Sequence[tuple[str, _Column]],
        row_numbers: Sequence[int],
        separator: str = "",
    ) -> None:
        self.path = path
        self.name = name
        self.names = [column for column, _ in columns]
        self.row_count = len(row_numbers)
        self.row_numbers = np.array(row_numbers, dtype=np.intp)
        self._columns = dict(columns)
        self._separator = separator
        self._marked: tuple[str, str] | None = None
        self._read: set[str] = set()
        self._origin: tuple[Table, Mapping[str, str]] | None = None
        repeated = [name for name, count in Counter(self.names).items() if name and count > 1]
        if repeated:
            raise self.error(f'column "{repeated[0]}" occurs twice')
        if not self.row_count:
            raise self.error("there are no rows below the header")

    def error(self, message: str) -> MeasurementError:
        """An error about this table."""
        return MeasurementError(f"{self.name}: {message}")

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

    def renamed(self, names: Mapping[str, str]) -> Table:
        """Return these columns alone, under other names: the new one is the key.

        Raises
        ------
        MeasurementError
            If there is no such column.
        """
        for name, column in names.items():
            self.require(column, name)
        columns = [(name, self._columns[column]) for name, column in names.items()]
        table = Table(self.path, self.name, columns, self.row_numbers.tolist(), self._separator)
        table.step = self.step
        table._origin = self, names
        return table

    def subset(self, rows: NDArray[np.intp], without: Sequence[str] = ()) -> Table:
        """Return these rows alone, without some columns."""
        columns: list[tuple[str, _Column]] = []
        for name in self.names:
            column = self._columns[name]
            if name in without:
                continue
            if isinstance(column, list):
                column = [column[row] for row in rows]
            elif isinstance(column, tuple):
                column = column[0][rows], column[1][rows]
            columns.append((name, column))
        numbers = self.row_numbers[rows].tolist()
        table = Table(self.path, self.name, columns, numbers, self._separator)
        table.step = self.step
        return table

    @property
    def unread(self) -> tuple[str, ...]:
        """The columns whose cells nobody has asked for, in the file's order."""
        return tuple(name for name in self.names if name not in self._read)

    def _cells(self, name: str) -> _Column:
        """A column, which is read with this."""
        self._read.add(name)
        if self._origin is not None:
            table, names = self._origin
            table._cells(names[name])
        return self._columns[name]

    def numbers(self, name: str, *, empty_allowed: bool = False) -> NDArray[np.float64]:
        """Return a column as float64, shape (N,).

        Raises
        ------
        MeasurementError
            At the first cell that is no number or not finite, or is empty unless that is allowed;
            an allowed empty cell is NaN.
        """
        column = self._cells(name)
        if isinstance(column, str):
            raise self.error(f'column "{name}" holds {column}; expected numbers')
        if isinstance(column, list):
            column = self._parsed(name, column), np.array([cell is None for cell in column])
        values, empty = column
        if empty.any() and not empty_allowed:
            raise self.row_error(
                int(np.argmax(empty)), f'is empty in column "{name}"; expected a number'
            )
        strange = ~np.isfinite(values) & ~empty
        if strange.any():
            index = int(np.argmax(strange))
            instead = ", or an empty cell for what was not read" if empty_allowed else ""
            raise self.row_error(
                index, f'has {values[index]} in column "{name}"; expected a finite number{instead}'
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
        column = self._cells(name)
        values = [cell or "" for cell in column] if isinstance(column, list) else ["a number"]
        for index, value in enumerate(values):
            if value not in allowed:
                raise self.row_error(
                    index, f'has "{value}" in column "{name}"; expected {" or ".join(allowed)}'
                )
        return values

    def texts(self, name: str) -> list[str]:
        """Return a column of names, which may be numbers; empty cells are empty texts."""
        column = self._cells(name)
        if isinstance(column, str):
            raise self.error(f'column "{name}" holds {column}; expected names or numbers')
        if isinstance(column, tuple):
            column = [
                None if empty else f"{value:.15g}" for value, empty in zip(*column, strict=True)
            ]
        return [label or "" for label in column]

    def labels(self, name: str) -> list[str]:
        """Return a column of names, which may be numbers; none is empty."""
        labels = self.texts(name)
        if "" in labels:
            raise self.row_error(labels.index(""), f'is empty in column "{name}"; expected a name')
        return labels

    def _parsed(self, name: str, cells: list[str | None]) -> NDArray[np.float64]:
        values = np.full(len(cells), np.nan)
        for index, cell in enumerate(cells):
            if cell is None:
                continue
            try:
                values[index], mark = _number(cell, self._separator)
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


def read_table(source: TableSource, step: str = "") -> Table:
    """Read a table.

    A file is Parquet if its name ends in ``.parquet`` or ``.pq``, else CSV separated by commas,
    semicolons or tabs; with the latter two, the decimal mark may be a comma. Lines that begin with
    ``#`` are comments. Latin-1 is read where UTF-8 does not fit. What gzip has compressed is read
    too. A stream holds text or bytes of such a file; a mapping of columns is a pandas DataFrame, or
    a dictionary of arrays, where NaN is an empty cell. `step` is the size of the steps that columns
    may count.

    Raises
    ------
    MeasurementError
        If the file is missing, empty, has a header only, or has rows of unequal length.
    """
    table = _read(source)
    table.step = step
    return table


def _read(source: TableSource) -> Table:
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        name = str(path)
        data = file_bytes(path, lambda message: MeasurementError(f"{name}: {message}"))
    elif hasattr(source, "read"):
        path, name = None, f"{getattr(source, 'name', 'the stream')}"
        try:
            text: Any = source.read()
        except (OSError, ValueError) as wrong:  # closed, or text in another encoding
            raise MeasurementError(f"{name}: cannot be read: {wrong}") from wrong
        data = text.encode() if isinstance(text, str) else bytes(text)
    else:
        return _table_of_columns(source)

    def error(message: str) -> MeasurementError:
        return MeasurementError(f"{name}: {message}")

    if data.startswith(_GZIP):
        data = _decompressed(data, error)
    if not data.strip():
        raise error("the file is empty")
    if Path(name).suffix in _PARQUET or data.startswith(b"PAR1"):
        return _parquet_table(path, name, data)
    return _csv_table(path, name, data, error)


def write_table(path: Path, columns: Mapping[str, Any]) -> None:
    """Write columns as CSV, compressed if the name ends in ``.gz``, or as Parquet.

    Numbers read back to the same floats, but for those in `WRITTEN_UNITS`, which have as many
    digits as nanometres and nanoradians need; NaN is written as an empty cell.
    """
    known_extension(path, ".csv", ".txt", ".gz", *_PARQUET)
    columns = dict(_in_units(name, values) for name, values in columns.items())
    if path.suffix in _PARQUET:
        arrow, parquet = _parquet(str(path))
        # from_pandas makes NaN a missing value.
        data = {name: arrow.array(values, from_pandas=True) for name, values in columns.items()}
        parquet.write_table(arrow.table(data), path)
        return
    text = csv_text(columns).encode()
    path.write_bytes(gzip.compress(text, mtime=0) if path.suffix == ".gz" else text)


def _in_units(name: str, values: Any) -> tuple[str, Any]:
    """A column in m or rad in the unit that was asked for."""
    stem, _, unit = name.rpartition("_")
    asked = WRITTEN_UNITS.get().get(unit)
    if not stem or asked is None or asked == unit:
        return name, values
    factor = 1 / unit_factor(asked, unit)
    digits = max(0, math.ceil(9 - math.log10(factor)))
    return f"{stem}_{asked}", np.round(factor * np.asarray(values, dtype=float), digits) + 0.0


def csv_text(columns: Mapping[str, Any]) -> str:
    """Return columns as CSV."""
    cells = [[_cell(value) for value in np.asarray(each).tolist()] for each in columns.values()]
    lines = [",".join(columns), *map(",".join, zip(*cells, strict=True))]
    return "\n".join(lines) + "\n"


def file_bytes(path: Path, error: Callable[[str], SymkinError], most: int | None = None) -> bytes:
    """Return what a regular file holds; `error` makes the exception out of what is wrong with it.

    Pipes and devices are refused, since they may never end, and files of more than `most` bytes.
    """
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise error("is a directory, not a file")
        if not stat.S_ISREG(status.st_mode):
            raise error("is a device or a pipe; expected a regular file")
        if most is not None and status.st_size > most:
            raise error(f"has {status.st_size} bytes; expected at most {most}")
        data = path.read_bytes()
    except FileNotFoundError as missing:
        raise error("no such file") from missing
    except OSError as unreadable:
        raise error(f"cannot be read: {unreadable.strerror}") from unreadable
    except UnicodeError as unreadable:
        raise error("has a name that the system does not take") from unreadable
    if not data.strip():
        raise error("the file is empty")
    return data


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value).removesuffix(".0")
    text = str(value)
    if not _SPECIAL.intersection(text):
        return text
    return '"' + text.replace('"', '""') + '"'


def _decompressed(data: bytes, error: Callable[[str], MeasurementError]) -> bytes:
    """No more than a limit, since a small file may hold a great many equal bytes."""
    try:
        with gzip.open(BytesIO(data)) as file:
            text = file.read(_MOST_BYTES + 1)
    except (OSError, EOFError, zlib.error) as unreadable:
        raise error(f"cannot be decompressed: {unreadable}") from unreadable
    if len(text) > _MOST_BYTES:
        raise error(f"holds more than {_MOST_BYTES} bytes")
    return text


def _table_of_columns(columns: Any) -> Table:
    if not hasattr(columns, "keys"):
        raise MeasurementError(
            f"a {type(columns).__name__} is no table; expected a file, a stream, a DataFrame or a "
            "dictionary of columns"
        )
    made = [(str(name), _column(np.asarray(columns[name]))) for name in columns.keys()]  # noqa: SIM118
    counts = {np.shape(columns[name]) for name in columns.keys()}  # noqa: SIM118
    if len(counts) > 1 or any(len(shape) != 1 for shape in counts):
        shown = ", ".join(map(str, sorted(counts)))
        raise MeasurementError(f"the columns have shapes {shown}; expected one length")
    count = counts.pop()[0] if counts else 0
    return Table(None, "the table", made, range(1, count + 1))


def _column(values: NDArray[Any]) -> _Column:
    if values.dtype.kind in "iuf":
        numbers = values.astype(np.float64)
        return numbers, np.isnan(numbers)
    if values.dtype.kind in "OUT":
        # Missing values are None, NaN or pandas' NA, of which only text is equal to itself.
        return [str(value) if _is_there(value) else None for value in values.tolist()]
    return str(values.dtype)


def _is_there(value: Any) -> bool:
    return value is not None and str(value) not in ("", "nan", "<NA>")


def _parquet(name: str) -> tuple[Any, Any]:
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise MeasurementError(
            f"{name}: Parquet needs pyarrow: pip install 'symkin[parquet]', or use CSV"
        ) from error
    return pa, parquet


def _parquet_table(path: Path | None, name: str, data: bytes) -> Table:
    arrow, parquet = _parquet(name)
    try:
        read = parquet.read_table(arrow.BufferReader(data))
    except (arrow.ArrowException, OSError, UnicodeError) as error:
        raise MeasurementError(f"{name}: cannot be read: {error}") from error
    columns = [
        (column.strip(), _arrow_column(arrow, read.column(index)))
        for index, column in enumerate(read.column_names)
    ]
    return Table(path, name, columns, range(1, read.num_rows + 1))


def _arrow_column(arrow: Any, column: Any) -> _Column:
    types = arrow.types
    if types.is_string(column.type) or types.is_large_string(column.type):
        return [value or None for value in column.to_pylist()]
    # A column of empty cells only has the type null.
    kinds = (types.is_integer, types.is_floating, types.is_null)
    if not any(is_kind(column.type) for is_kind in kinds):
        return str(column.type)
    numbers = np.asarray(column.cast(arrow.float64(), safe=False).to_numpy(), dtype=np.float64)
    return numbers, np.asarray(column.is_null().to_numpy(), dtype=bool)


_SEPARATORS = ",;\t"
_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE | re.ASCII)
_NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x1f]")


def _csv_table(
    path: Path | None, name: str, data: bytes, error: Callable[[str], MeasurementError]
) -> Table:
    """CSV: UTF-8, UTF-16 with its mark, or Latin-1; commas, semicolons or tabs.

    Lines that begin with ``#``, empty lines and rows of empty cells are passed over.
    """
    text = _decoded(data, error)
    separator = _separator(next(_Lines(text), ""))
    lines = _Lines(text)
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
    columns = [[cell or None for cell in column] for column in zip(*rows, strict=True)]
    return Table(path, name, list(zip(names, columns, strict=True)), numbers, separator)


def _number(cell: str, separator: str) -> tuple[float, str]:
    """A cell's number and its decimal mark, which is empty if it has none."""
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
