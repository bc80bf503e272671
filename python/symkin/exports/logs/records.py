# SPDX-License-Identifier: MIT
"""Records of other programs: lists of JSON objects, sheets of Excel, Maslow's calibration."""

from __future__ import annotations

import io
import itertools
import json
import math
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from symkin.exports.logs.log import Asked, ImportedLog, Log, LogFormat

_MOST_ROWS, _MOST_COLUMNS = 200_000, 400
_MOST_UNPACKED = 200_000_000  # bytes of a sheet
_DEEPEST = 8
_STRAY = 0.1  # of the records: lines that are none
_SHOWN = 6
_UNITS = {unit: unit for unit in ("m", "mm", "cm", "um", "rad", "mrad", "deg", "s", "ms")}
_UNITS |= {"\u00b0": "deg", "\u00b5m": "um", "\u03bcm": "um"}


def _listed(names: Iterable[str]) -> str:
    all_of = list(names)
    return ", ".join(all_of[:_SHOWN]) + " ..." * (len(all_of) > _SHOWN)


def _of_cells(
    log: Log, title: str, cells: Mapping[str, Sequence[Any]], source: str, left: Sequence[str]
) -> ImportedLog:
    """A table of the columns whose cells are numbers or empty."""
    columns, words = {}, []
    for name, values in cells.items():
        numbers = [_number(each) for each in values]
        if any(each is None for each in numbers):
            words.append(name)
        elif not all(math.isnan(each) for each in numbers if each is not None):
            columns[name] = np.array(numbers, dtype=float)
    if not columns:
        raise log.error("has no column of numbers")
    count = len(next(iter(columns.values())))
    took = (f"{count} rows of {len(columns)} columns: {_listed(columns)}", *filter(None, [source]))
    left = (*left, *[f"columns that are no numbers: {_listed(words)}"] * bool(words))
    return ImportedLog(title, columns, None, took, left)


def _number(value: Any) -> float | None:
    """A number, NaN of an empty cell, None of anything else."""
    if value is None or (isinstance(value, str) and not value.strip()):
        return math.nan
    if isinstance(value, bool):
        return None
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _is_json(log: Log) -> bool:
    # A record a line may stand below a line or two of something else.
    begins = rb"(?:\xef\xbb\xbf)?\s*(?:[^\n]*\n){0,3}\s*(?:\[\s*)?\{\s*[\"}]"
    return bool(re.match(begins, log.data[:2000]))


def _read_json(log: Log, _asked: Asked) -> ImportedLog:
    found, left = _parsed(log)
    source = ""
    if isinstance(found, dict):
        lists = {
            name: value
            for name, value in found.items()
            if isinstance(value, list) and value and isinstance(value[0], dict)
        }
        name = max(lists, key=lambda each: len(lists[each]), default="")
        others = [each for each in found if each != name]
        left += [f"keys {_listed(others)}"] if others else []
        source, found = f'the list "{name}"', lists.get(name)
    if not isinstance(found, list) or not found:
        raise log.error("has no list of records, such as [{...}, {...}]")
    wrong = next((i for i, each in enumerate(found) if not isinstance(each, dict)), None)
    if wrong is not None:
        raise log.error(f"record {wrong + 1} is no object; expected such as {{...}}")
    if len(found) > _MOST_ROWS:
        raise log.error(f"has {len(found)} records; expected at most {_MOST_ROWS}")
    flat = [_flat(log, each) for each in found]
    names = list(dict.fromkeys(name for each in flat for name in each))
    if len(names) > _MOST_COLUMNS:
        raise log.error(f"has {len(names)} different keys; expected at most {_MOST_COLUMNS}")
    cells = {name: [each.get(name) for each in flat] for name in names}
    return _of_cells(log, JSON.title, cells, source, left)


def _parsed(log: Log) -> tuple[Any, list[str]]:
    """The document, or the records of its lines, and what of these is left."""
    try:
        return json.loads(log.text), []
    except RecursionError as error:
        raise log.error("has lists in lists in lists, too deep to be measurements") from error
    except ValueError as error:
        found, strays = _lines_of_json(log)
        if not found or log.text.lstrip().startswith("["):
            raise log.error(f"is no JSON: {error}") from error
        if len(strays) > max(1, _STRAY * len(found)):
            first = _listed(map(str, strays))
            raise log.error(
                f"lines {first} are no records as JSON; expected a record a line"
            ) from error
    left = [f"line {line}, which is no record as JSON" for line in strays[:_SHOWN]]
    return found, left + [f"{len(strays) - _SHOWN} more such lines"] * (len(strays) > _SHOWN)


def _lines_of_json(log: Log) -> tuple[list[Any], list[int]]:
    """A record a line, and the numbers of lines that are none."""
    records, strays = [], []
    for number, line in enumerate(log.lines, 1):
        try:
            found = json.loads(line) if line.strip() else None
        except (ValueError, RecursionError):
            found = line
        if isinstance(found, dict):
            records.append(found)
        elif line.strip():
            strays.append(number)
    return records, strays


def _flat(log: Log, record: Mapping[str, Any]) -> dict[str, Any]:
    """Values by the path to them: ``position_x_mm``, and numbered from 1, ``psi_1``."""
    found: dict[str, Any] = {}

    def walk(value: Any, name: str, depth: int) -> None:
        if depth > _DEEPEST:
            raise log.error(f'has "{name[:60]}" in records, too deep to be a measurement')
        if isinstance(value, dict):
            for key, each in value.items():
                walk(each, f"{name}_{key}" if name else str(key), depth + 1)
        elif isinstance(value, list):
            for i, each in enumerate(value[: _MOST_COLUMNS + 1]):
                walk(each, f"{name}_{i + 1}", depth + 1)
        else:
            found[name] = value

    walk(record, "", 0)
    return found


JSON = LogFormat("json", "records as JSON", _is_json, _read_json)


def _is_excel(log: Log) -> bool:
    if not log.data.startswith(b"PK\x03\x04"):
        return False
    return b"xl/" in log.data or log.path.suffix.lower() in (".xlsx", ".xlsm")


def _read_excel(log: Log, _asked: Asked) -> ImportedLog:
    try:
        import openpyxl
    except ImportError as error:
        raise log.error(
            "is an Excel workbook, which takes openpyxl to read: pip install 'symkin[excel]', or "
            "save the sheet as CSV"
        ) from error
    try:
        with zipfile.ZipFile(io.BytesIO(log.data)) as packed:
            size = sum(each.file_size for each in packed.infolist())
        if size > _MOST_UNPACKED:
            raise log.error(f"unpacks to {size} bytes; expected at most {_MOST_UNPACKED}")
        book = openpyxl.load_workbook(io.BytesIO(log.data), read_only=True, data_only=True)
        sheets = {sheet.title: _cells_of(sheet) for sheet in book.worksheets}
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, AttributeError, EOFError,
            SyntaxError, IndexError, OSError, OverflowError) as error:  # fmt: skip
        raise log.error(f"is no Excel workbook that can be read: {error!r:.200}") from error
    for title, rows in sheets.items():
        head = _header_of(rows)
        if head is None:
            continue
        names = _names_of(rows, head)
        named = {name: k for k, name in enumerate(names) if name}
        if len(named) < sum(bool(name) for name in names):
            raise log.error(f'sheet "{title}" has a column twice: {_listed(filter(None, names))}')
        below = rows[head + 1 :]
        end = next(
            (i for i, row in enumerate(below) if all(each is None for each in row)), len(below)
        )
        body = below[:end]
        cells = {n: [row[k] if k < len(row) else None for row in body] for n, k in named.items()}
        left = [f'sheet "{each}"' for each in sheets if each != title]
        left += [f"{head} rows above the header"] * bool(head)
        left += [f"{len(below) - end - 1} rows below the table"] * (end < len(below) - 1)
        source = f'the sheet "{title}", whose header is row {head + 1}'
        return _of_cells(log, EXCEL.title, cells, source, left)
    raise log.error("has no sheet with a row of names above rows of numbers")


def _cells_of(sheet: Any) -> list[tuple[Any, ...]]:
    rows = sheet.iter_rows(max_row=_MOST_ROWS, max_col=_MOST_COLUMNS, values_only=True)
    return [tuple(row) for row in rows]


def _header_of(rows: Sequence[Sequence[Any]]) -> int | None:
    """The first row of two names or more above a row of two numbers or more."""
    for i, (row, below) in enumerate(itertools.pairwise(rows)):
        names = sum(isinstance(each, str) and _number(each) is None for each in row)
        others = sum(each is not None and not isinstance(each, str) for each in row)
        numbers = sum(
            each is not None
            and isinstance(_number(each), float)
            and not math.isnan(_number(each) or 0.0)
            for each in below
        )
        if names >= 2 and not others and numbers >= 2:
            return i
    return None


def _names_of(rows: Sequence[Sequence[Any]], head: int) -> list[str]:
    """Names of a header; of units alone, with those of the row above: ``x`` and ``mm``, x_mm."""
    below, above = (
        [str(each).strip() if each is not None else "" for each in (rows[k] if k >= 0 else ())]
        for k in (head, head - 1)
    )
    units = [_UNITS.get(each, each) for each in below]
    if not any(above) or not {*units} <= {"", *_UNITS.values()}:
        return below
    return [f"{name}_{unit}" if unit else name for name, unit in zip(above, units, strict=False)]


EXCEL = LogFormat("excel", "an Excel sheet", _is_excel, _read_excel)


_BELTS = ("tl", "tr", "bl", "br")  # corners of the frame
_ANCHOR = re.compile(
    r"^\W*Maslow_(tl|tr|bl|br)([XYZ])\s*[:=]\s*([-+]?\d+(?:\.\d*)?)", re.IGNORECASE | re.MULTILINE
)


def _is_maslow(log: Log) -> bool:
    return b"CLBM:" in log.data or b"Maslow_tlX" in log.data


def _read_maslow(log: Log, _asked: Asked) -> ImportedLog:
    rows: list[dict[str, float]] = []
    left: list[str] = []
    broken = sets = 0
    for line in log.lines:
        if "CLBM:" not in line:
            continue
        sets += 1
        rows = []  # each list has what was measured until then, too
        for record in re.findall(r"\{([^{}]*)\}", line.partition("CLBM:")[2]):
            found = {
                name: float(value)
                for name, value in re.findall(r"(tl|tr|bl|br)\W*:\s*([-+]?\d+(?:\.\d*)?)", record)
            }
            if len(found) == len(_BELTS):
                rows.append(found)
            else:
                broken += 1
    if not rows:
        raise log.error('has no measurements, as "CLBM:[{bl:..., br:..., tr:..., tl:...}, ...]"')
    anchors = {f"{m[0].lower()}{m[1].lower()}": float(m[2]) for m in _ANCHOR.findall(log.text)}
    columns = {
        f"psi_{k + 1}_mm": np.array([row[belt] for row in rows]) for k, belt in enumerate(_BELTS)
    }
    left += [f"{broken} records without all four belts"] * bool(broken)
    left += [f"{sets - 1} earlier lists of measurements"] * (sets > 1)
    if anchors:
        said = ", ".join(f"{name} {value:g}" for name, value in sorted(anchors.items()))
        left.append(
            f"the anchors ({said} mm): write them into the mechanism's file, with the arms of the "
            "sled beside"
        )
    took = (
        f"{len(rows)} measurements of four belts, top left, top right, bottom left, bottom right",
        "belts as Maslow counts them, in the plane of the frame or not, as the firmware has it",
    )
    return ImportedLog(MASLOW.title, columns, None, took, tuple(left))


MASLOW = LogFormat("maslow", "Maslow's calibration", _is_maslow, _read_maslow)
