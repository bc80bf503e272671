# SPDX-License-Identifier: MIT
"""Tables of numbers: CSV, Parquet, or columns that are in memory already."""

from __future__ import annotations

import codecs
import gzip
import math
import os
import re
import stat
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from io import BytesIO
from pathlib import Path
from typing import IO, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import MeasurementError, SymkinError, did_you_mean, known_extension
from symkin.storage.csv_headers import with_plain_header
from symkin.storage.quantities import unit_factor
from symkin.storage.table_columns import Column, CsvCells, Numbers, Words, column_of
from symkin.values import Array


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
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # .xlsx and .ods, and .xls
GZIP = b"\x1f\x8b"  # how what it has compressed begins
UNDECOMPRESSED = (OSError, EOFError, zlib.error)
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
MOST_BYTES = 1_000_000_000  # of what was compressed
_ROWS_WRITTEN = 5000  # at a time
_Column = Column | str  # or what else it holds
_OTHER_FILES = {
    ".csv": "a table", ".tsv": "a table", ".parquet": "a table", ".pq": "a table",
    ".toml": "a mechanism file or another in TOML", ".json": "a result in JSON", ".html": "a page",
}  # fmt: skip


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
    marked : (str, str) or None
        The first number with a decimal mark that was read, and its mark.
    """

    step: str = ""

    def __init__(
        self,
        path: Path | None,
        name: str,
        columns: Sequence[tuple[str, _Column]],
        row_numbers: NDArray[np.intp],
    ) -> None:
        self.path = path
        self.name = name
        self.names = [column for column, _ in columns]
        self.row_count = len(row_numbers)
        self.row_numbers = row_numbers
        self._columns = dict(columns)
        self.marked: tuple[str, str] | None = None
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
        """Return these columns alone, under other names: the new one is the key."""
        for name, column in names.items():
            self.require(column, name)
        columns = [(name, self._columns[column]) for name, column in names.items()]
        table = Table(self.path, self.name, columns, self.row_numbers)
        table.step = self.step
        table._origin = self, names
        return table

    def subset(self, rows: NDArray[np.intp], without: Sequence[str] = ()) -> Table:
        """Return these rows alone, without some columns."""
        columns = [
            (name, column if isinstance(column, str) else column.subset(rows))
            for name, column in self._columns.items()
            if name not in without
        ]
        table = Table(self.path, self.name, columns, self.row_numbers[rows])
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

    def numbers(self, name: str, *, empty_allowed: bool = False) -> Array:
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
        numbers = column.numbers()
        instead = ", or an empty cell for what was not read" if empty_allowed else ""
        if numbers.text:
            row, cell = numbers.text
            raise self.row_error(
                row, f'has "{cell}" in column "{name}"; expected a number{instead}'
            )
        self._check_marks(numbers)
        values, empty = numbers.values, numbers.empty
        if empty.any() and not empty_allowed:
            raise self.row_error(
                int(np.argmax(empty)), f'is empty in column "{name}"; expected a number'
            )
        strange = ~np.isfinite(values) & ~empty
        if strange.any():
            index = int(np.argmax(strange))
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

    def legs(self, name: str, least: int, count: int) -> NDArray[np.intp]:
        """Return a column of legs of a mechanism with so many, counted from 1, shape (N,)."""
        values = self.numbers(name)
        beyond = (values > count) & (values == np.round(values))
        if beyond.any():
            index = int(np.argmax(beyond))
            raise self.row_error(
                index,
                f'has {values[index]:g} in column "{name}", and the mechanism has {count} legs; '
                f"expected a whole number from {least} to {count}: is the table another robot's?",
            )
        return self.whole_numbers(name, least, count)

    def words(self, name: str, allowed: Sequence[str]) -> list[str]:
        """Return a column of words out of a few."""
        column = self._cells(name)
        words = Words.of(["a number"]) if isinstance(column, str) else column.words()
        texts = [*words.distinct, ""]
        values = [texts[code] for code in words.codes.tolist()]
        for index, value in enumerate(values):
            if value not in allowed:
                raise self.row_error(
                    index, f'has "{value}" in column "{name}"; expected {" or ".join(allowed)}'
                )
        return values

    def texts(self, name: str) -> list[str]:
        """Return a column of names, which may be numbers; empty cells are empty texts."""
        words = self._words(name)
        distinct = [*words.distinct, ""]
        return [distinct[code] for code in words.codes.tolist()]

    def labels(self, name: str) -> Words:
        """Return a column of names, which may be numbers; none is empty."""
        words = self._words(name)
        if (words.codes < 0).any():
            index = int(np.argmax(words.codes < 0))
            raise self.row_error(index, f'is empty in column "{name}"; expected a name')
        return words

    def _words(self, name: str) -> Words:
        column = self._cells(name)
        if isinstance(column, str):
            raise self.error(f'column "{name}" holds {column}; expected names or numbers')
        return column.words()

    def _check_marks(self, numbers: Numbers) -> None:
        """A comma may divide thousands where others have a decimal point, so nobody can tell."""
        for (_, cell), mark in sorted((cell, mark) for mark, cell in numbers.marks.items()):
            if self.marked is None:
                self.marked = cell, mark
            elif self.marked[1] != mark:
                raise self.error(
                    f'has "{self.marked[0]}" and "{cell}"; expected one kind of decimal mark'
                )


def read_table(source: TableSource, step: str = "") -> Table:
    """Read a table.

    A file is Parquet if its name ends in ``.parquet`` or ``.pq``, else CSV separated by commas,
    semicolons or tabs; with the latter two, the decimal mark may be a comma. Lines that begin with
    ``#`` are comments, and units may stand in the line below the names. Latin-1 is read where UTF-8
    does not fit. What gzip has compressed is read too. A stream holds text or bytes of such a file;
    a mapping of columns is a pandas DataFrame, or a dictionary of arrays, where NaN is an empty
    cell. `step` is the size of the steps that columns may count.

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
        require_kind(path)
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

    if data.startswith(GZIP):
        data = _decompressed(data, error)
    if not data or data.isspace():
        raise error("the file is empty")
    if is_parquet(name, data):
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
        arrow, parquet = parquet_modules(str(path))
        # from_pandas makes NaN a missing value.
        data = {name: arrow.array(values, from_pandas=True) for name, values in columns.items()}
        parquet.write_table(arrow.table(data), path)
        return
    with ExitStack() as opened_files:
        file: Any = opened_files.enter_context(path.open("wb"))
        if path.suffix == ".gz":
            file = opened_files.enter_context(gzip.GzipFile("", "wb", fileobj=file, mtime=0))
        for text in _csv_parts(columns):
            file.write(text.encode())


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
    return "".join(_csv_parts(columns))


def _csv_parts(columns: Mapping[str, Any]) -> Iterator[str]:
    """The header, and some rows at a time."""
    yield ",".join(columns) + "\n"
    arrays = [np.asarray(values) for values in columns.values()]
    for first in range(0, len(arrays[0]) if arrays else 0, _ROWS_WRITTEN):
        cells = [_cells(values[first : first + _ROWS_WRITTEN]) for values in arrays]
        yield "".join(f"{','.join(row)}\n" for row in zip(*cells, strict=True))


def _cells(values: NDArray[Any]) -> list[str]:
    if values.dtype.kind == "f":
        return _core.csv_cells(values)
    return [_cell(value) for value in values.tolist()]


def require_kind(path: Path) -> None:
    """Refuse a file of symkin that is no table, by its name."""
    if (kind := kind_of_file(path)) not in ("", "a table"):
        raise MeasurementError(f"{path}: is {kind}; expected a table, such as measured.csv")


def is_parquet(name: str, start: bytes) -> bool:
    """Whether a file is Parquet, by its name or how it begins."""
    return Path(name).suffix in _PARQUET or start.startswith(b"PAR1")


def is_utf16(start: bytes) -> bool:
    """Whether a file has the mark of UTF-16."""
    return start.startswith(_UTF16)


def kind_of_file(path: Path) -> str:
    """What a file of symkin is by its name, or an empty string."""
    return _OTHER_FILES.get(path.suffix.lower(), "")


def file_bytes(path: Path, error: Callable[[str], SymkinError], most: int | None = None) -> bytes:
    """Return what a regular file holds; `error` makes the exception out of what is wrong with it.

    Pipes and devices are refused, since they may never end, and files of more than `most` bytes.
    """
    with opened(path, error, most) as file:
        data = file.read()
    if not data or data.isspace():
        raise error("the file is empty")
    return data


@contextmanager
def opened(
    path: Path, error: Callable[[str], SymkinError], most: int | None = None
) -> Iterator[IO[bytes]]:
    """Open a file as `file_bytes` does, and say what is wrong while it is read."""
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise error("is a directory, not a file")
        if not stat.S_ISREG(status.st_mode):
            raise error("is a device or a pipe; expected a regular file")
        if most is not None and status.st_size > most:
            raise error(f"has {status.st_size} bytes; expected at most {most}")
        with path.open("rb") as file:
            yield file
    except FileNotFoundError as missing:
        raise error("no such file") from missing
    except OSError as unreadable:
        raise error(f"cannot be read: {unreadable.strerror}") from unreadable
    except UnicodeError as unreadable:
        raise error("has a name that the system does not take") from unreadable


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
            text = file.read(MOST_BYTES + 1)
    except UNDECOMPRESSED as unreadable:
        raise error(f"cannot be decompressed: {unreadable}") from unreadable
    if len(text) > MOST_BYTES:
        raise error(f"holds more than {MOST_BYTES} bytes")
    return text


def _table_of_columns(columns: Any) -> Table:
    if not hasattr(columns, "keys"):
        raise MeasurementError(
            f"a {type(columns).__name__} is no table; expected a file, a stream, a DataFrame or a "
            "dictionary of columns"
        )
    made = [(str(name), column_of(np.asarray(columns[name]))) for name in columns.keys()]  # noqa: SIM118
    counts = {np.shape(columns[name]) for name in columns.keys()}  # noqa: SIM118
    if len(counts) > 1 or any(len(shape) != 1 for shape in counts):
        shown = ", ".join(map(str, sorted(counts)))
        raise MeasurementError(f"the columns have shapes {shown}; expected one length")
    count = counts.pop()[0] if counts else 0
    return Table(None, "the table", made, _rows_from_one(count))


def _rows_from_one(count: int) -> NDArray[np.intp]:
    return np.arange(1, count + 1)


def parquet_modules(name: str) -> tuple[Any, Any]:
    """Return pyarrow and its Parquet, or say that the file needs them."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError as error:
        raise MeasurementError(
            f"{name}: Parquet needs pyarrow: pip install 'symkin[parquet]', or use CSV"
        ) from error
    return pa, parquet


def _parquet_table(path: Path | None, name: str, data: bytes) -> Table:
    arrow, parquet = parquet_modules(name)
    try:
        read = parquet.ParquetFile(arrow.BufferReader(data)).read()
    except (arrow.ArrowException, OSError, UnicodeError) as error:
        raise MeasurementError(f"{name}: cannot be read: {error}") from error
    return Table(path, name, arrow_columns(arrow, read), _rows_from_one(read.num_rows))


def arrow_columns(arrow: Any, table: Any) -> list[tuple[str, _Column]]:
    """Return the columns of a table of pyarrow."""
    return [
        (column.strip(), _arrow_column(arrow, table.column(index)))
        for index, column in enumerate(table.column_names)
    ]


def _arrow_column(arrow: Any, column: Any) -> _Column:
    types = arrow.types
    if types.is_string(column.type) or types.is_large_string(column.type):
        coded = column.combine_chunks().dictionary_encode()
        distinct = coded.dictionary.to_pylist()
        codes, empty = _arrays(coded.indices, np.int32)
        if "" in distinct:
            empty |= codes == distinct.index("")
        return Words(np.where(empty, -1, codes), distinct)
    # A column of empty cells only has the type null.
    kinds = (types.is_integer, types.is_floating, types.is_null)
    if not any(is_kind(column.type) for is_kind in kinds):
        return str(column.type)
    values, empty = _arrays(column.combine_chunks().cast(arrow.float64(), safe=False), np.float64)
    return Numbers(np.where(empty, np.nan, values), empty)


def _arrays(column: Any, kind: type) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Values and where they are missing, without `to_numpy`, which imports pandas: a second."""

    def array(of: Any, dtype: type) -> NDArray[Any]:
        values: NDArray[Any] = np.frombuffer(of.buffers()[1] or b"", dtype)
        return values[of.offset : of.offset + len(of)]

    return array(column, kind), array(column.is_null().cast("uint8"), np.uint8) > 0


# Of Unicode alone: the reader knows those of ASCII.
_SPACES = re.compile("[\x85\xa0\u1680\u2000-\u200a\u2028\u2029\u202f\u205f\u3000]")


def _csv_table(
    path: Path | None, name: str, data: bytes, error: Callable[[str], MeasurementError]
) -> Table:
    """CSV: UTF-8, UTF-16 with its mark, or Latin-1; commas, semicolons or tabs."""
    try:
        read = _core.CsvTable(with_plain_header(utf8(data, error)))
    except _core.Error as unreadable:
        raise error(str(unreadable)) from unreadable
    return Table(path, name, csv_columns(read), read.lines)


def csv_columns(read: _core.CsvTable) -> list[tuple[str, _Column]]:
    """Return the columns of a CSV."""
    return [(read.column(place).name, CsvCells(read, place)) for place in range(read.column_count)]


def utf8(data: bytes, error: Callable[[str], MeasurementError]) -> bytes:
    """Return the text with plain spaces; what is ASCII stays where it is."""
    if data.startswith(_WORKBOOKS):
        raise error("is a workbook of a spreadsheet, or another archive; save it as CSV")
    if data.isascii():
        return data
    try:
        text = data.decode("utf-16" if is_utf16(data) else "utf-8-sig")
    except UnicodeDecodeError as undecodable:
        if undecodable.encoding != "utf-8":
            raise error(f"cannot be read: {undecodable.reason}") from undecodable
        text = data.decode("latin-1")
    return _SPACES.sub(" ", text).encode()
