# SPDX-License-Identifier: MIT
"""Columns of a table that nothing was read from: told, or refused where they seem to be meant."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from symkin.data.columns import has_observed_columns, is_present
from symkin.data.foreign import mapping_of_all, names_robots
from symkin.model.mechanism import Mechanism
from symkin.model.poses import POSE_SPACES
from symkin.model.settings import MeasurementColumns
from symkin.shell import typed_word
from symkin.storage.quantities import is_unit
from symkin.storage.tables import Table

_OF_PLANS = {"leg", "order", "role"}  # what a plan says of its poses, where it was filled in
_Gap = tuple[str, str, str]  # what no column holds, its SI unit, and what the table calls it


def unread_columns(table: Table, ignored: Sequence[str]) -> tuple[str, ...]:
    """Return the columns that nothing was read from, less those that are meant to be left out.

    Raises
    ------
    MeasurementError
        For a name to ignore that is no column, or one that was read.
    """
    for name in ignored:
        table.require(name, "to ignore")
        if name not in table.unread:
            raise table.error(
                f'column "{name}" is to be ignored, and was read; take it out of one of the two'
            )
    own = _OF_PLANS if set(table.names) >= _OF_PLANS else set()
    return tuple(name for name in table.unread if name not in ignored and name not in own)


def refuse_what_is_missed(
    table: Table,
    columns: MeasurementColumns,
    unread: Sequence[str],
    pose_space: str,
    reading_unit: str,
) -> None:
    """Refuse a table that lacks a reading or a coordinate while a column without use may hold it.

    Such a column has its name but for case and signs between letters, or a unit of its kind. The
    columns are those of symkin's own names: who maps columns has said which he means.
    """
    gaps = list(_gaps(table, columns, pose_space, reading_unit))
    for name in unread:
        for stem, unit, what in gaps:
            if _plain(name) == _plain(stem) or _measures(name, unit):
                raise table.error(
                    f'column "{name}" is not read, and no column holds the {what}; name it '
                    f'"{stem}" with its unit, such as "{stem}_{unit}", if that is what it holds, '
                    f"or say that it is left out ({_ignored(name)})"
                )


def refuse_several_robots(table: Table, column: str) -> None:
    """Refuse a table as one robot's whose column of robots has several, which is read with this."""
    labels = table.labels(column)
    met = np.unique(labels.codes)
    if len(met) > 1:
        raise table.error(
            f'has rows of {len(met)} robots, by its column "{column}"; '
            f"{_one(labels.distinct[met[0]])}, and symkin identify-batch all, in Python "
            "identify_many"
        )


def refuse_unread_robots(table: Table, unread: Sequence[str], mechanism: Mechanism) -> None:
    """Refuse a table as one robot's of which a column that is not read seems to name several."""
    for name in filter(names_robots, unread):
        met = dict.fromkeys(filter(None, table.texts(name)))
        if len(met) > 1:
            mapping = mapping_of_all(table, mechanism)
            called = f'if it is called "robot" (or in a mapping robot = "{name}")'
            if mapping:
                called = (
                    'if it is called "robot", or this line is in a file (--columns FILE, in Python '
                    f"columns=symkin.load_columns(FILE)): {mapping}"
                )
            error = table.error(
                f'column "{name}" is not read, and has {len(met)} different names: if all rows are '
                f"of one robot, leave it out ({_ignored(name)}); if these are robots, "
                f"{_one(next(iter(met)))}, and symkin identify-batch all, in Python identify_many, "
                f"{called}"
            )
            error.mapping = mapping
            raise error


def _one(robot: str) -> str:
    """How a robot of a table of many is taken by itself."""
    return (
        f"one of them is taken with --robot {typed_word(robot)}, in Python read_measurements with "
        f'robot="{robot}"'
    )


def _ignored(name: str) -> str:
    return f'--ignore {typed_word(name)}, in Python ignore=["{name}"]'


def _gaps(
    table: Table, columns: MeasurementColumns, pose_space: str, reading_unit: str
) -> Iterator[_Gap]:
    for leg, name in enumerate(columns.readings, 1):
        if not is_present(table, name, columns.reading_unit):
            yield name, reading_unit, f"reading of leg {leg}"
    if has_observed_columns(table, pose_space):
        return  # whose tables have no poses on purpose
    space = POSE_SPACES[pose_space]
    for axis, name in zip(space.position, columns.position, strict=True):
        if not name:
            yield axis, "m", f"coordinate {axis}"
    turned = columns.angle is not None or columns.quaternion or columns.rotation_vector
    if not turned:
        for name in space.rotation:
            yield name, "rad", f"angle {name}" if len(space.rotation) == 1 else "orientation"


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _measures(name: str, unit: str) -> bool:
    """Whether a column's name ends in a unit of this kind."""
    stem, _, own = name.rpartition("_")
    return bool(stem) and is_unit(own, unit)
