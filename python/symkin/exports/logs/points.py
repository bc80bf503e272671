# SPDX-License-Identifier: MIT
"""Lists of points, a row a point, as trackers, measuring arms and cameras export them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from symkin.data.foreign import ColumnName
from symkin.errors import SymkinError
from symkin.exports.logs.log import Asked, ImportedLog, Log, LogFormat, numbers_of, rows_of
from symkin.storage.quantities import is_unit
from symkin.storage.tables import Table, read_table
from symkin.values import Array

_TITLE = "a list of points"
_TIMES = {"time", "timestamp", "date"}
_NUMBERED = {"pose", "no", "nr", "id", "number", "name", "point", "target", "group"}
_WORDS = re.compile(r"[^\W\d_]+|\d+")

_Key = tuple[str, ...]


class _List(NamedTuple):
    """Rows below the heading: words of what each point is called, and its coordinates' cells.

    And the columns that are neither.
    """

    head: int
    names: list[_Key]
    cells: list[list[str]]
    unit: str
    others: tuple[str, ...]


def _list_of(log: Log) -> _List | None:
    """None of what has no coordinates x and y, perhaps z, nor names beside them."""
    rows = rows_of(log)
    head = next((i for i, row in enumerate(rows) if _places(row)), None)
    if head is None:
        return None
    places = _places(rows[head])
    body = [row for row in rows[head + 1 :] if any(each.strip() for each in row)]
    if len(body) < 2 or any(len(row) != len(rows[head]) for row in body):
        return None
    columns = [ColumnName.of(name.strip()) for name in rows[head]]
    named = [
        k
        for k, each in enumerate(columns)
        if k not in places
        and (each is None or each.last not in _TIMES)
        and (any(_is_text(row[k]) for row in body) or (each and each.last in _NUMBERED))
    ]
    if not named:
        return None
    words = [tuple(_words(" ".join(row[k] for k in named))) for row in body]
    units = {each.unit for k in places if (each := columns[k])}
    unit = units.pop() if len(units) == 1 else ""
    used = {*places, *named}
    others = tuple(name.strip() for k, name in enumerate(rows[head]) if k not in used)
    return _List(head, words, [[row[k] for k in places] for row in body], unit, others)


def _places(row: Sequence[str]) -> list[int]:
    """Where the columns of x, y and perhaps z are, whose names begin alike; empty without them."""
    columns = [ColumnName.of(name.strip()) for name in row]
    found = {
        axis: [k for k, each in enumerate(columns) if each and each.last == axis] for axis in "xyz"
    }
    if len(found["x"]) != 1 or len(found["y"]) != 1 or len(found["z"]) > 1:
        return []
    places = [each[0] for each in found.values() if each]
    return places if len({each.before for k in places if (each := columns[k])}) == 1 else []


def _is_text(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return bool(cell.strip())
    return False


def _words(name: str) -> list[str]:
    return [str(int(word)) if word.isdecimal() else word for word in _WORDS.findall(name)]


def _poses_and_points(log: Log, names: Sequence[_Key]) -> tuple[list[str], list[str]]:
    """What each row says of its pose and of its point.

    Of what varies in the names the pose is what takes more values. Where points alone are named,
    a pose ends where a name comes again.
    """
    if len({len(each) for each in names}) > 1:
        raise log.error("names points by unequally many words; expected names such as pose1 smr1")
    varying = [column for column in zip(*names, strict=True) if len(set(column)) > 1]
    if len(varying) > 2:
        raise log.error(
            f"names points by {len(varying)} words that change; expected those of pose and point"
        )
    if not varying:
        raise log.error("has the same name in all rows; expected those of pose and point")
    varying.sort(key=lambda column: len(set(column)))
    points = list(varying[0])
    if len(varying) == 2:
        if len(set(varying[0])) == len(set(varying[1])):
            raise log.error("has as many poses as points by its names, so that none tells them")
        return list(varying[1]), points
    if len(set(points)) == len(points):
        return points, ["1"] * len(points)
    poses, seen = [0], {points[0]}
    for each in points[1:]:
        poses.append(poses[-1] + (each in seen))
        seen = {each} if each in seen else seen | {each}
    return [str(each + 1) for each in poses], points


def _is_list(log: Log) -> bool:
    try:
        return _list_of(log) is not None
    except SymkinError:  # of what is no table
        return False


def _read(log: Log, asked: Asked) -> ImportedLog:
    found = _list_of(log)
    assert found is not None
    if not is_unit(found.unit, "m"):
        raise log.error(
            "does not say in which unit its coordinates are; write it into the heading, as in "
            "X [mm]"
        )
    own, point_of = _poses_and_points(log, found.names)
    twice = [key for key, count in Counter(zip(own, point_of, strict=True)).items() if count > 1]
    if twice:
        raise log.error(f"has point {twice[0][1]} of pose {twice[0][0]} twice; leave one of them")
    poses, points = list(dict.fromkeys(own)), list(dict.fromkeys(point_of))
    size = len(found.cells[0])
    values = numbers_of(log, found.cells, found.head + 2, size)
    numbers = poses if all(map(str.isdecimal, poses)) else range(1, len(poses) + 1)
    columns: dict[str, Array] = {"pose": np.array([int(each) for each in numbers], dtype=float)}
    for number, point in enumerate(points, 1):
        rows = [k for k, each in enumerate(point_of) if each == point]
        places = np.full((len(poses), size), np.nan)
        places[[poses.index(own[k]) for k in rows]] = values[rows]
        for axis, column in zip("xyz"[:size], places.T, strict=True):
            columns[f"p{number}_{axis}_{found.unit}"] = column
    named = ", ".join(f"p{number} is {point}" for number, point in enumerate(points, 1))
    seen = int(np.isfinite(values).all(axis=1).sum())
    took = [f"{len(poses)} poses with {len(points)} points ({named}), {seen} of which were seen"]
    left = [f"columns {', '.join(found.others)} of the list"] if found.others else []
    if asked.beside is not None:
        table = read_table(asked.beside.path)
        beside, order, how = _beside(asked.beside, table, columns["pose"])
        others = [name for name in table.names if name not in (*beside, how)]
        left += [f"columns {', '.join(others)} of {asked.beside.path}"] if others else []
        took.append(f"readings of {asked.beside.path}, by {how or 'the order of the rows'}")
        columns = {name: each[order] for name, each in columns.items()} | beside
    return ImportedLog(_TITLE, columns, None, tuple(took), tuple(left))


def _beside(log: Log, table: Table, poses: Array) -> tuple[dict[str, Array], list[int], str]:
    """Columns of numbers of a table, the pose that each row is of, and the column that says which.

    By a column of the poses' numbers if there is one, else by the order of as many rows.
    """
    values = {}
    for name in table.names:
        with suppress(SymkinError):  # of words
            values[name] = table.numbers(name, empty_allowed=True)
    for name, own in values.items():
        found = ColumnName.of(name)
        if found and found.last in _NUMBERED and np.isin(own, poses).all():
            if len(set(own.tolist())) < len(own):
                raise log.error(f'has a pose twice in its column "{name}"')
            order = [int(np.flatnonzero(poses == each)[0]) for each in own]
            return {key: each for key, each in values.items() if key != name}, order, name
    if table.row_count != len(poses):
        raise log.error(
            f"has {table.row_count} rows, and the list {len(poses)} poses; expected a column of "
            "the poses' numbers, such as pose, or a row a pose"
        )
    return values, list(range(len(poses))), ""


POINTS = LogFormat("points", f"{_TITLE}, a row a point", _is_list, _read)
