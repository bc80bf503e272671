# SPDX-License-Identifier: MIT
"""Takes of OptiTrack's Motive, as it exports them to CSV."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from symkin.exports.logs.log import Asked, Log, numbers_of, rows_of
from symkin.exports.logs.takes import LENGTH_UNITS, Take, chosen_body, take_format
from symkin.values import Array

# From y up to z up.
_UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def _is_motive(log: Log) -> bool:
    return (
        log.data[:2000].lstrip(b"\xef\xbb\xbf").startswith((b"Format Version,", b"Format Version;"))
    )


class _Channel(NamedTuple):
    """A column of a take: of a rigid body or a marker, of this name, its position along X."""

    of: str
    name: str
    kind: str
    axis: str


def _channels(log: Log, rows: Sequence[Sequence[str]]) -> tuple[int, list[_Channel]]:
    """The row of the axes, and what each column holds, by the rows above."""
    head = next((i for i, row in enumerate(rows[:12]) if row and row[0] == "Frame"), None)
    if head is None or head < 3:
        raise log.error('has no row that begins with "Frame"; expected a take that Motive exported')
    by = {row[1]: row for row in rows[1:head] if len(row) > 1 and row[1]}
    for name in ("Type", "Name"):
        if name not in by:
            raise log.error(f'has no row "{name}" above its columns; export it with a header')
    width = len(rows[head])
    above = (by["Type"], by["Name"], rows[head - 1])
    cells = ([*row, *[""] * (width - len(row))][:width] for row in above)
    return head, [_Channel(*each) for each in zip(*cells, rows[head], strict=True)]


def _read_motive(log: Log, asked: Asked) -> Take:
    rows = rows_of(log)
    said = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = said.get("Length Units", "Meters")
    if unit.lower() not in LENGTH_UNITS:
        raise log.error(f'has Length Units "{unit}"; expected Meters, Centimeters or Millimeters')
    factor = LENGTH_UNITS[unit.lower()]
    head, channels = _channels(log, rows)
    width = len(channels)
    data = numbers_of(log, rows[head + 1 :], head + 2, width)
    data = data[np.isfinite(data[:, 1])] if width > 1 else data
    if len(data) < 1 or width < 5:
        raise log.error("has no samples below its header")

    def columns(of: str, name: str, kind: str) -> list[int]:
        found = {each.axis: k for k, each in enumerate(channels) if each[:3] == (of, name, kind)}
        return [found[axis] for axis in ("XYZW" if kind == "Rotation" else "XYZ") if axis in found]

    bodies, markers = (
        list(dict.fromkeys(each.name for each in channels if each.of == of and each.name))
        for of in ("Rigid Body", "Marker")
    )
    body = chosen_body(log, bodies, asked.body, "rigid body")
    seen: dict[str, Array] = {}
    left = [f'rigid body "{each}"' for each in bodies if each != body]
    if body:
        place = columns("Rigid Body", body, "Position")
        if len(place) != 3:
            raise log.error(f'has no position X, Y, Z of the rigid body "{body}"')
        seen["positions"] = factor * data[:, place] @ _UPRIGHT.T
        turn = columns("Rigid Body", body, "Rotation")
        if len(turn) == 4:
            vectors = data[:, turn[:3]] @ _UPRIGHT.T
            seen["quaternions"] = np.column_stack([vectors, data[:, turn[3]]])
        elif turn:
            left.append(
                f'the rotation of "{body}" as Euler angles: export it as quaternions, which have '
                "one order"
            )
        left += [f"{len(markers)} markers"] * bool(markers)
    elif markers:
        found = [columns("Marker", each, "Position") for each in markers]
        if any(len(each) != 3 for each in found):
            raise log.error("has markers without X, Y, Z")
        seen["points"] = np.stack([factor * data[:, each] @ _UPRIGHT.T for each in found], axis=1)
    else:
        raise log.error("has neither a rigid body nor markers")
    what_of = f"the rigid body {body!r}" if body else f"{len(markers)} markers"
    took = (
        f"{len(data)} samples of {what_of} of the take {said.get('Take Name', 'without a name')!r}",
        "axes with z up, x as Motive has it (Motive's y is up)",
    )
    left += ["Mean Marker Error"] * any(each.kind == "Mean Marker Error" for each in channels)
    return Take.of(data[:, 1], took, left, **seen)


MOTIVE = take_format("motive", "a take of OptiTrack's Motive", _is_motive, _read_motive)
