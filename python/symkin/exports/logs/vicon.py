# SPDX-License-Identifier: MIT
"""Captures of Vicon, as it exports them to CSV."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from symkin.exports.logs.log import Asked, Log, numbers_of, rows_of
from symkin.exports.logs.takes import LENGTH_UNITS, Take, chosen_body, take_format
from symkin.model.poses import quaternions_from_rotation_vectors
from symkin.storage.quantities import unit_factor
from symkin.values import Array

_VICON = ("Trajectories", "Segments", "Objects", "Global Coordinates")


def _is_vicon(log: Log) -> bool:
    first = log.data[:400].lstrip(b"\xef\xbb\xbf").splitlines()[:1]
    return bool(first) and first[0].strip(b' ,;"\t').decode("latin-1") in _VICON


def _read_vicon(log: Log, asked: Asked) -> Take:
    rows = rows_of(log)
    head = next((i for i, row in enumerate(rows[:8]) if row and row[0].strip() == "Frame"), None)
    if head is None or head < 2 or len(rows) < head + 3:
        raise log.error('has no row that begins with "Frame"; expected what Vicon exports as CSV')
    rate_text = (rows[1] or [""])[0]
    try:
        rate = float(rate_text)
    except ValueError:
        rate = math.nan
    if not 0 < rate < 1e5:
        raise log.error(f'has the rate "{rate_text}" in its second row; expected samples a second')
    end = next(
        (i for i in range(head + 2, len(rows)) if not any(each.strip() for each in rows[i])),
        len(rows),
    )
    columns = _vicon_columns(rows[head - 1], rows[head], rows[head + 1])
    data = numbers_of(log, rows[head + 2 : end], head + 3, len(columns))
    if not len(data):
        raise log.error("has no samples below its header")
    frames = data[:, 0] + (np.nan_to_num(data[:, 1]) / 10 if len(columns) > 2 else 0)
    bodies = list(dict.fromkeys(_plain(each.name) for each in columns if each.axis == "RX"))
    left = [f"{len(rows) - end} rows below the first table"] * (end < len(rows))
    if bodies:
        body = chosen_body(log, bodies, asked.body, "object")
        seen, took = _body_of_vicon(log, columns, data, body)
        left += [f'object "{each}"' for each in bodies if each != body]
    else:
        seen, took = _marks_of_vicon(log, columns, data)
    return Take.of((frames - frames[0]) / rate, took, left, **seen)


class _Column(NamedTuple):
    """A column of what Vicon exports: the group that it is of, ``TX``, and its unit."""

    name: str
    axis: str
    unit: str


def _vicon_columns(names: list[str], axes: list[str], units: list[str]) -> list[_Column]:
    """Columns of the header's three rows; a name stands above the first of its columns alone."""
    found, name = [], ""
    beside = itertools.zip_longest(axes, names[: len(axes)], units[: len(axes)], fillvalue="")
    for axis, cell, unit in beside:
        name = cell.strip() or name
        found.append(_Column(name, axis.strip(), unit.strip()))
    return found


def _lengths(log: Log, columns: Sequence[_Column], data: Array, places: Sequence[int]) -> Array:
    """These columns in metres, as those without a unit are."""
    units = {columns[k].unit or "m" for k in places}
    if other := sorted(units - LENGTH_UNITS.keys()):
        raise log.error(f'has lengths in "{other[0]}"; expected mm, cm or m')
    return np.asarray(data[:, places] * [LENGTH_UNITS[columns[k].unit or "m"] for k in places])


def _marks_of_vicon(
    log: Log, columns: Sequence[_Column], data: Array
) -> tuple[dict[str, Array], list[str]]:
    named = [each.name for each in columns[2:] if each.axis == "X" and each.name]
    groups = list(dict.fromkeys(named))
    found = [
        [k for k, each in enumerate(columns) if (each.name, each.axis) == (name, axis)]
        for name in groups
        for axis in "XYZ"
    ]
    if not groups or any(len(each) != 1 for each in found):
        raise log.error("has neither segments (RX ... TZ) nor markers (X, Y, Z)")
    points = _lengths(log, columns, data, [k for (k,) in found]).reshape(len(data), -1, 3)
    seen = f"{len(data)} samples of {len(groups)} markers: {', '.join(map(_plain, groups))}"
    return {"points": points}, [seen]


def _body_of_vicon(
    log: Log, columns: Sequence[_Column], data: Array, body: str
) -> tuple[dict[str, Array], list[str]]:
    own = {each.axis: k for k, each in enumerate(columns) if _plain(each.name) == body}
    if not {"TX", "TY", "TZ"} <= own.keys():
        raise log.error(f'has no TX, TY, TZ of the object "{body}"')
    places = _lengths(log, columns, data, [own[axis] for axis in ("TX", "TY", "TZ")])
    turn = [own[axis] for axis in ("RX", "RY", "RZ", "RW") if axis in own]
    turns, how = np.full((len(data), 4), np.nan), "none"
    if len(turn) == 4:
        turns, how = data[:, turn], "as quaternions"
    elif len(turn) == 3:
        unit = columns[turn[0]].unit or "rad"
        if unit not in ("deg", "rad"):
            raise log.error(
                f'has rotations in "{unit}"; expected deg or rad in the row below the axes'
            )
        vectors = data[:, turn] * unit_factor(unit, "rad")
        good = np.isfinite(vectors).all(axis=1)
        turns[good] = quaternions_from_rotation_vectors(vectors[good])
        how = "as rotation vectors, as Vicon has them"
    took = [f'{len(data)} samples of the object "{body}"', f"its rotation {how}"]
    return {"positions": places, "quaternions": turns}, took


def _plain(name: str) -> str:
    """``Global Angle robot:plate`` as ``plate``."""
    return re.sub(r"^Global (Angle|Translation)\s+", "", name).rpartition(":")[2].strip()


VICON = take_format("vicon", "a capture of Vicon", _is_vicon, _read_vicon)
