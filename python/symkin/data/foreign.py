# SPDX-License-Identifier: MIT
"""Which columns of a table with names of its own may hold poses and readings."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Sequence

from symkin.model.mechanism import Mechanism
from symkin.storage.quantities import COUNTS, is_unit
from symkin.storage.tables import Table
from symkin.values import record

_UNIT = re.compile(r"(.+?)(?:[\s_]+|\s*[\[(]\s*)([^\W\d_]+|°)\s*[\])]?")
_WORDS = re.compile(r"[^\W\d_]+|\d+")
UNIT = "?"  # of names without one
_UNIT_KEYS = {"position": "position_unit", "readings": "reading_unit", "angle": "orientation_unit"}
_ANGLES = {"phi", "theta", "yaw", "angle", "rotation", "orientation", "rz"}
_ATTITUDE = ("roll", "pitch", "yaw")
_COUNTS = {*COUNTS, "steps", "counts", "ticks", "pixel", "pixels"}  # of a size that no name says
_IN_IMAGES = {"u": "x", "v": "y"}
_BESIDE = {"no", "nr", "id", "row", "index", "number", "sample", "pose", "point", "time", "date"}
_ROBOTS = {"robot", "machine", "serial", "serialno", "serialnumber", "sn"}
_LEG = "leg"
_COORDINATE = re.compile(r"([pqt])([xyzw])")  # as in qx and tx


@record
class ColumnName:
    """A column by the words of its name: those before the last, the last, and its unit."""

    name: str
    before: tuple[str, ...]
    last: str
    unit: str

    @classmethod
    def of(cls, name: str) -> ColumnName | None:
        """None of a name without words."""
        stem, unit = name, ""
        if found := _UNIT.fullmatch(name):
            written = found[2].replace("°", "deg")
            if written.isupper():
                written = written.lower()
            if any(is_unit(written, si_unit) for si_unit in ("m", "rad")):
                stem, unit = found[1], written
            elif written in _COUNTS:
                stem = found[1]
        words = tuple(_WORDS.findall(stem.lower()))
        if words and (parts := _COORDINATE.fullmatch(words[-1])):
            words = (*words[:-1], *parts.groups())
        if not words:
            return None
        return cls(name, words[:-1], _IN_IMAGES.get(words[-1], words[-1]), unit)


def names_robots(column: str) -> bool:
    """Whether a column has a name as one of robots' names or numbers has."""
    return "".join(_WORDS.findall(column.lower())) in _ROBOTS


def mapping_for(table: Table, mechanism: Mechanism) -> str:
    """Return a line of TOML that says which columns may hold poses and readings, or nothing.

    It is a guess by names, for who knows what the table holds: a position by the last letters x, y
    and z of names that begin alike, readings by as many names, numbered from 0 or 1, as are read,
    or by nothing else being left. An orientation in space is told by a quaternion, or by roll,
    pitch and yaw; other three angles may be any. Several such positions are of points on a
    platform that turns. A unit that no name says is `UNIT`.
    """
    space, count = mechanism.space, mechanism.reading_count
    columns = [each for name in table.names if (each := ColumnName.of(name)) is not None]
    places = _alike(columns, space.position, "m") if space.size else []
    robots = [each for each in columns if names_robots(each.name)]
    others = [each for each in columns if not any(each in own for own in (*places, robots))]
    readings = _numbered(others, count) or _only(others, count)
    if space.turns and len(places) > 1 and readings:
        return _line([*_of_points(places, readings, mechanism), *_of_robots(robots)])
    position = places[0] if len(places) == 1 else []
    if len(position) < space.size or not readings:
        return ""
    said = {"position": position, "readings": readings}
    units = {"position": "m", "readings": mechanism.reading_unit}
    further = ""
    if space.has_quaternion:
        quaternions = _alike(columns, ("x", "y", "z", "w"), "")
        if len(quaternions) == 1:
            said["quaternion"] = quaternions[0]
        else:
            further = _attitude(columns)
            if not further:
                return ""
    elif space.has_angle:
        said["angle"] = [each for each in columns if each.last in _ANGLES and not each.before]
        units["angle"] = "rad"
        if len(said["angle"]) != 1:
            return ""
    if not space.size:
        del said["position"]
    parts = []
    for key, found in said.items():
        part = _key(key, found, units.get(key))
        if not part:
            return ""
        parts.append(part)
    if further:
        parts.append(further)
    return _line([*parts, *_of_robots(robots)])


def mapping_of_all(table: Table, mechanism: Mechanism) -> str:
    """The same line with the column of legs' sets, if with it nothing of the table is left out."""
    mapping = mapping_for(table, mechanism)
    if not mapping or UNIT in mapping:
        return ""
    if _LEG in table.names:
        mapping = mapping.removesuffix(" }") + f', leg = "{_LEG}" }}'
    keys = tomllib.loads(mapping)["measurements"].values()
    named = {name for said in keys for name in _names(said)}
    return mapping if named.issuperset(table.names) else ""


def _names(said: str | list[str] | dict[str, str]) -> Iterable[str]:
    """The columns that a key names."""
    if isinstance(said, str):
        return (said,)
    return said.values() if isinstance(said, dict) else said


def _line(parts: Sequence[str]) -> str:
    return f"measurements = {{ {', '.join(parts)} }}" if all(parts) else ""


def _of_robots(found: Sequence[ColumnName]) -> list[str]:
    return [f"robot = {_quoted(found[0])}"] if len(found) == 1 else []


def _of_points(
    places: Sequence[Sequence[ColumnName]], readings: Sequence[ColumnName], mechanism: Mechanism
) -> list[str]:
    said = _key("readings", readings, mechanism.reading_unit)
    names = ", ".join(
        f"p{number}_{each.last}_{each.unit or UNIT} = {_quoted(each)}"
        for number, place in enumerate(places, 1)
        for each in place
    )
    return [said, f"names = {{ {names} }}"]


def _key(key: str, found: Sequence[ColumnName], si_unit: str | None) -> str:
    """A key of the line, with that of its unit; nothing if there is none, or that is another."""
    names = [_quoted(each) for each in found]
    if not names:
        return ""
    said = f"{key} = " + (names[0] if key == "angle" else f"[{', '.join(names)}]")
    if si_unit is None:
        return said
    unit = found[0].unit
    if len({each.unit for each in found}) > 1 or (unit and not is_unit(unit, si_unit)):
        return ""
    return f'{said}, {_UNIT_KEYS[key]} = "{unit or UNIT}"'


def _attitude(columns: Sequence[ColumnName]) -> str:
    """The key that says which columns are roll, pitch and yaw, with their units; or nothing."""
    named = {name: [each for each in columns if each.last == name] for name in _ATTITUDE}
    names = []
    for name, found in named.items():
        if len(found) != 1 or (found[0].unit and not is_unit(found[0].unit, "rad")):
            return ""
        names.append(f"{name}_{found[0].unit or UNIT} = {_quoted(found[0])}")
    return f"names = {{ {', '.join(names)} }}"


def _quoted(column: ColumnName) -> str:
    return json.dumps(column.name, ensure_ascii=False)


def _alike(
    columns: Sequence[ColumnName], last: Sequence[str], si_unit: str
) -> list[list[ColumnName]]:
    """Columns that begin alike and end in these, of this unit or of none that a name says."""
    found = []
    for before in dict.fromkeys(each.before for each in columns):
        own = {each.last: each for each in columns if each.before == before}
        whole = all(name in own for name in last)
        if whole and ("w" in own) == ("w" in last):
            found.append([own[name] for name in last])
    return [each for each in found if each[0].unit == "" or is_unit(each[0].unit, si_unit)]


def _numbered(columns: Sequence[ColumnName], count: int) -> list[ColumnName]:
    """So many columns that begin alike and are numbered on; none if there are several such."""
    found = list(_runs(columns, count))
    return found[0] if len(found) == 1 else []


def _only(columns: Sequence[ColumnName], count: int) -> list[ColumnName]:
    """The columns that are left, if they are so many and none is by its name something else."""
    left = [each for each in columns if each.last not in _BESIDE]
    units = {each.unit for each in left}
    other = any(each.last in (*_ANGLES, *_ATTITUDE) for each in left)
    return left if len(left) == count and len(units) == 1 and not other else []


def _runs(columns: Sequence[ColumnName], count: int) -> Iterator[list[ColumnName]]:
    for before in dict.fromkeys(each.before for each in columns):
        own = {
            int(each.last): each
            for each in columns
            if each.before == before and each.last.isascii() and each.last.isdigit()
        }
        first = min(own, default=-1)
        if first in (0, 1) and sorted(own) == list(range(first, first + count)):
            yield [own[number] for number in sorted(own)]
