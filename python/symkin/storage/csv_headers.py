# SPDX-License-Identifier: MIT
"""What spreadsheets and loggers write around the names of columns in CSV."""

from __future__ import annotations

import re

from symkin.storage.quantities import unit_names

_HINT = re.compile(rb"\A(?=sep=[,;\t][ \t]*\r?\n)", re.IGNORECASE)
_BEFORE = re.compile(rb"(?:[ \t]*(?:#[^\n]*)?\r?\n)*")  # empty lines and comments
_NONE = {"", "-"}
_HAS_UNIT = re.compile(r"[\])]\s*$")


def with_plain_header(text: bytes) -> bytes:
    """Return CSV whose names of columns come first, with their units.

    A line "sep=;" before them, which a spreadsheet reads, and a line of units below them become
    comments, so that the rows keep their numbers.
    """
    return _with_units_in_names(_HINT.sub(b"#", text, count=1))


def _with_units_in_names(text: bytes) -> bytes:
    begin = _BEFORE.match(text)
    assert begin is not None
    end = text.find(b"\n", begin.end())
    last = text.find(b"\n", end + 1)
    below = text[end + 1 : last]
    if min(end, last) < 0 or b'"' in text[begin.end() : last] or re.search(rb"[#\d]", below):
        return text
    header = text[begin.end() : end].decode().rstrip("\r")
    separator = next((each for each in ";\t" if each in header), ",")
    names, units = header.split(separator), [_unit(e) for e in below.decode().split(separator)]
    known = {*unit_names()}
    if len(names) != len(units) or not known & {*units} or not {*units} <= known | _NONE:
        return text
    told = separator.join(_named(*each) for each in zip(names, units, strict=True))
    return text[: begin.end()] + told.encode() + b"\n#" + text[end + 1 :]


def _unit(cell: str) -> str:
    unit = cell.strip().strip("[]()").replace("°", "deg")
    return unit.lower() if unit.isupper() else unit


def _named(name: str, unit: str) -> str:
    has = unit in _NONE or name.strip().endswith(f"_{unit}") or _HAS_UNIT.search(name)
    return name if has else f"{name.strip()} [{unit}]"
