# SPDX-License-Identifier: MIT
"""Rows that are nowhere near what the drawing and the others say of them, as if mistyped.

So far off, one row turns an estimate into no mechanism, and a robust loss ends anywhere: they are
told before anything is fitted, by what no unknown frame changes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError, few
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction
from symkin.model.framing import framed, unframed
from symkin.model.poses import transforms
from symkin.model.turns import shortest_ways
from symkin.values import Array, evenly

_MOST = 0.25  # of the rows: more than that are no errors of single rows
_FAR = (30.0, 6.0)  # times as far off as most rows
_TRIED = 8  # first: where none of them has a pose, hardly half of the rows have one
_COMPARED = 200  # rows that each is compared with
_NAMED = 5


def without_far_rows(stated: Correction) -> Iterator[Correction]:
    """Leave out the rows that are far from the others, and no more than some."""
    try:
        apart = _apart(stated)
        away = None if apart is None else _Away.of(stated)
    except SymkinError:
        return
    if apart is None or away is None:
        return
    told: set[tuple[int, ...]] = set()
    for far in (apart > times for times in _FAR):
        for rows in (np.flatnonzero(far & np.isfinite(apart)), np.flatnonzero(far)):
            if 0 < len(rows) <= _MOST * len(apart) and tuple(rows) not in told:
                told.add(tuple(rows))
                yield _without(stated, rows, away)


def _without(stated: Correction, rows: NDArray[np.intp], away: _Away) -> Correction:
    measured = stated.measurements
    numbers = measured.row_numbers[rows].tolist()
    each = [f"{number}{away.told(row)}" for number, row in zip(numbers, rows, strict=True)]
    be, it = ("is", "it") if len(rows) == 1 else ("are", "them")
    figures = {"which": f"row{'s' * (len(rows) > 1)} {few(each, _NAMED)}", "be": be, "it": it}
    return stated._replace(
        cause=Doubt("rows-far-off", rows=tuple(numbers), figures=figures),
        measurements=measured.subset(np.setdiff1d(np.arange(len(measured.poses)), rows)),
        left_out=len(rows),
    )


def _apart(stated: Correction) -> Array | None:
    """How far each row is from its place among the others, over what most rows are; NaN unknown.

    By distances and turns from row to row, which depend on no frame. None where most rows are not
    known well enough.
    """
    robot, measured = stated.mechanism, stated.measurements
    space, poses = measured.space, measured.poses
    read = np.asarray(np.isfinite(measured.readings).all(axis=1))
    placed = np.asarray(np.isfinite(poses[:, : space.size or None]).all(axis=1))
    known = read & placed
    if 2 * known.sum() <= len(known):
        return None
    whole = np.asarray(np.isfinite(poses).all(axis=1))
    drawn = np.full_like(poses, np.nan)
    # From where it was seen, if that is in the robot's own frame: else from home.
    start = unframed(robot, poses[known]) if "base" not in stated.options.frames else None
    start = start if whole[known].all() else None
    readings = measured.readings[known]
    few = evenly(len(readings), _TRIED)
    tried = robot.forward_kinematics(readings[few], None if start is None else start[few])[0]
    if not np.isfinite(tried).all(axis=1).any():
        return None
    drawn[known] = robot.forward_kinematics(readings, start)[0]
    reached = np.asarray(np.isfinite(drawn).all(axis=1))
    if 2 * reached.sum() <= len(known):
        return None
    some = np.flatnonzero(reached)
    some = some[evenly(len(some), _COMPARED)]
    apart = np.zeros(len(poses))
    tolerances = robot.tolerances
    if space.moves:
        by_place = [
            np.linalg.norm(each[:, None, : space.size] - each[None, some, : space.size], axis=2)
            for each in (poses, drawn)
        ]
        apart = np.fmax(apart, _over_usual(by_place[0] - by_place[1], tolerances.length))
    if space.turns and whole[known].all():
        turned = [_turns(space.name, each, some) for each in (poses, drawn)]
        apart = np.fmax(apart, _over_usual(turned[0] - turned[1], tolerances.angle))
    apart[known & ~reached] = np.inf
    apart[~known] = np.nan
    return apart


def _turns(name: str, poses: Array, some: NDArray[np.intp]) -> Array:
    """Angles between the orientations of all poses and of some."""
    rotations = np.full((len(poses), 3, 3), np.nan)
    known = np.isfinite(poses).all(axis=1)
    rotations[known] = transforms(name, poses[known]).rotation
    traces = np.einsum("nij,mij->nm", rotations, rotations[some])
    return np.asarray(np.arccos(np.clip((traces - 1) / 2, -1, 1)))


def _over_usual(differences: Array, least: float) -> Array:
    """Of each row the median over others, over that of most rows."""
    known = np.isfinite(differences).any(axis=1)
    off = np.full(len(differences), np.nan)
    off[known] = np.nanmedian(np.abs(differences[known]), axis=1)
    return off / max(float(np.nanmedian(off)), least)


@dataclasses.dataclass(frozen=True)
class _Away:
    """Rows as they are and as the drawing has them, where its frames are known; else NaN."""

    columns: tuple[str, ...]
    poses: Array
    drawn: Array
    readings: Array
    expected: Array
    away: Array  # of readings, the shorter way round

    @classmethod
    def of(cls, stated: Correction) -> _Away:
        robot, measured = stated.mechanism, stated.measurements
        poses, readings = measured.poses, measured.readings
        drawn, expected = np.full_like(poses, np.nan), np.full_like(readings, np.nan)
        away = expected.copy()
        if not stated.options.frames:
            read = np.isfinite(readings).all(axis=1)
            drawn[read] = framed(robot, robot.forward_kinematics(readings[read])[0])
            whole = np.isfinite(poses).all(axis=1)
            roots = robot.inverse_kinematics(unframed(robot, poses[whole]))
            away[whole] = shortest_ways(robot, readings[whole] - roots)
            # Counted as most readings are.
            usual = np.zeros(roots.shape[1])
            seen = np.isfinite(readings).any(axis=0)
            usual[seen] = np.nanmedian(readings[:, seen], axis=0)
            expected[whole] = usual + shortest_ways(robot, roots - usual)
        space = measured.space
        columns = (*space.position, *space.orientation)
        return cls(columns, poses, drawn, readings, expected, away)

    def told(self, row: int) -> str:
        """The one reading, or coordinate, of a row that alone is far off; else nothing."""
        reading = self._only(self.away, row)
        if reading is not None:
            value, usual = self.readings[row, reading], self.expected[row, reading]
            return f" (reading of leg {reading + 1}: {value:.6g}, by the drawing {usual:.4g})"
        place = self._only(self.poses - self.drawn, row)
        if place is None:
            return ""
        value, usual = self.poses[row, place], self.drawn[row, place]
        return f" ({self.columns[place]}: {value:.6g}, by the drawing {usual:.4g})"

    @staticmethod
    def _only(away: Array, row: int) -> int | None:
        away = np.abs(away)
        known = np.asarray(np.isfinite(away).all(axis=1))
        if not known[row]:
            return None
        far = np.flatnonzero(away[row] > _FAR[1] * np.median(away[known], axis=0))
        return int(far[0]) if len(far) == 1 else None
