# SPDX-License-Identifier: MIT
"""Tables of any length a part at a time, in memory that does not grow with them."""

from __future__ import annotations

import gzip
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from symkin import _core
from symkin.errors import MeasurementError
from symkin.storage.csv_headers import with_plain_header
from symkin.storage.table_columns import Column
from symkin.storage.tables import (
    GZIP,
    MOST_BYTES,
    UNDECOMPRESSED,
    Table,
    arrow_columns,
    csv_columns,
    is_parquet,
    is_utf16,
    opened,
    parquet_modules,
    read_table,
    require_kind,
    utf8,
)

_Error = Callable[[str], MeasurementError]

_CSV_BYTES = 8_000_000  # of a block
_PARQUET_ROWS = 60_000


def table_blocks(path: Path, together: str, step: str = "") -> Iterator[Table]:
    """Read a file as `read_table` does, in parts: between two of them a column changes.

    So rows that have the same in the column `together`, and follow each other, are in one part. A
    table without the column, or in UTF-16, is one part; so are short ones.
    """
    name = str(path)

    def error(message: str) -> MeasurementError:
        return MeasurementError(f"{name}: {message}")

    with opened(path, error) as file:
        start = file.read(4)
    require_kind(path)
    if not start:
        raise error("the file is empty")
    compressed = start.startswith(GZIP)
    if compressed:
        with _unzipped(path) as unzipped:
            start = _read(unzipped, 4, error)
    if is_parquet(path.name, start):
        whole = compressed or together not in _parquet_names(path, error)
        parts = None if whole else _parquet_blocks(path, together, error)
    else:
        parts = None if is_utf16(start) else _csv_blocks(path, together, compressed, error)
    marked = None
    for table in [read_table(path, step)] if parts is None else parts:
        table.step = step
        table.marked = table.marked or marked
        yield table
        marked = table.marked


def _unzipped(path: Path) -> IO[bytes]:
    return gzip.open(path)  # type: ignore[return-value]


def _read(file: IO[bytes], size: int, error: _Error) -> bytes:
    try:
        return file.read(size)
    except UNDECOMPRESSED as unreadable:
        raise error(f"cannot be decompressed: {unreadable}") from unreadable


def _last_run(column: Column) -> int:
    """From which row on all have the same; 0 if there is none."""
    codes = column.words().codes
    return int(np.flatnonzero(np.append(True, codes[1:] != codes[:-1]))[-1]) if len(codes) else 0


def _csv_blocks(path: Path, together: str, compressed: bool, error: _Error) -> Iterator[Table]:
    """Blocks of a CSV: each is parsed with the header before it, and ends where a run does."""
    header, text, rest = b"", b"", b""
    passed, total, size = 0, 0, _CSV_BYTES
    with _unzipped(path) if compressed else opened(path, error) as file:
        for number in itertools.count():
            more = _read(file, size, error)
            total += len(more)
            if compressed and total > MOST_BYTES:
                raise error(f"holds more than {MOST_BYTES} bytes")
            last = len(more) < size
            rest += more
            end = len(rest) if last else rest.rfind(b"\n") + 1
            text += utf8(rest[:end], error)
            rest = rest[end:]
            if not number and last and (not text or text.isspace()):
                raise error("the file is empty")
            if not header:
                text = with_plain_header(text)
            given = header + text
            try:
                read = _core.CsvTable(given, passed, last)
            except _core.Error as unreadable:
                raise error(str(unreadable)) from unreadable
            names = [read.column(place).name for place in range(read.column_count)]
            rows = len(read.lines)
            if not last:
                rows = read.last_run(names.index(together)) if together in names and rows else 0
            if rows:
                if not last:
                    header, text = given[: read.header_size], given[read.start(rows) :]
                    passed = int(read.lines[rows]) - read.header_lines - 1
                    read.keep(rows)
                yield Table(path, str(path), csv_columns(read), read.lines)
            if last:
                return
            size = _CSV_BYTES if rows else 2 * size


def _parquet_names(path: Path, error: _Error) -> list[str]:
    arrow, parquet = parquet_modules(str(path))
    try:
        return [name.strip() for name in parquet.ParquetFile(path).schema_arrow.names]
    except (arrow.ArrowException, OSError, UnicodeError) as unreadable:
        raise error(f"cannot be read: {unreadable}") from unreadable


def _parquet_blocks(path: Path, together: str, error: _Error) -> Iterator[Table]:
    arrow, parquet = parquet_modules(str(path))
    left, passed = None, 0
    try:
        batches: Iterator[Any] = parquet.ParquetFile(path).iter_batches(_PARQUET_ROWS)
        following = next(batches, None)
        while following is not None:
            batch, following = following, next(batches, None)
            part = arrow.Table.from_batches([batch])
            part = part if left is None else arrow.concat_tables([left, part])
            rows = part.num_rows
            if following is not None:
                place = [name.strip() for name in part.column_names].index(together)
                ((_, labels),) = arrow_columns(arrow, part.select([place]))
                if isinstance(labels, str):
                    raise error(f'column "{together}" holds {labels}; expected names or numbers')
                rows = _last_run(labels)
            left = part.slice(rows)
            if rows:
                numbers = np.arange(passed + 1, passed + rows + 1)
                columns = arrow_columns(arrow, part.slice(0, rows))
                yield Table(path, str(path), columns, numbers)
                passed += rows
    except (arrow.ArrowException, OSError, UnicodeError) as unreadable:
        raise error(f"cannot be read: {unreadable}") from unreadable
