# SPDX-License-Identifier: MIT
"""Rows that agree with others better than the noise of measuring lets two visits of a pose do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.model.chains import shortest
from symkin.model.poses import vectors_from_quaternions
from symkin.model.settings import NoiseSettings
from symkin.values import Array

_BY_CHANCE = 1e-5  # of honest tables, at most, are taken for copies
_ONE_POSE = 4.0  # standard deviations beyond the usual, within which two rows may be of one pose
_UNITS = (1.0, np.pi / 180, 0.0254)  # of a column, which decimal prefixes do not change
_DIGITS, _EXACT = 9, 1e-9
_PAIRS = 1_000_000  # of rows, that are compared at once


def rows_alike(
    known: Measurements, table: Measurements, noise: NoiseSettings, stated: Array | None = None
) -> NDArray[np.bool_]:
    """Which rows of a table are known ones, altered by less than noise would.

    Were the known row right where the robot is, the squares of what one that was measured anew
    differs by, over its own variances, would sum up to a chi-square; else to more. So the
    probability of the nearest known row, times the number of those that may be of its pose, is
    exceeded as often as it says, whatever was commanded; and of N rows k are below one as seldom as
    a beta distribution says, the rows being independent once the known ones are. Readings tell
    nothing, which a controller may report as it was told them, nor does what has no noise. Columns
    are known to their last digits.

    Parameters
    ----------
    known, table : Measurements
        As one device saw them.
    noise : NoiseSettings
        Of rows that have no standard deviations of their own.
    stated : ndarray, shape (dof,), optional
        Standard deviations of a pose's coordinates that count where they are smaller; else NaN.
    """
    parts = _parts(known, table, noise, stated)
    count = len(table.poses)
    chances = np.ones(count)
    step = max(_PAIRS // max(len(known.poses), 1), 1)
    for begin in range(0, count, step):
        rows = np.arange(begin, min(begin + step, count))
        of, sums, sizes = _of_one_pose(parts, rows, len(known.poses))
        order = np.lexsort((sums / sizes, of))  # of each row the nearest first
        seen, nearest, visits = np.unique(of[order], return_index=True, return_counts=True)
        for row, pair, many in zip(seen, order[nearest], visits, strict=True):
            below = _core.noncentral_chi_square(sums[pair], int(sizes[pair]), 0.0)
            chances[row] = min(many * below, 1.0)
    order = np.argsort(chances, kind="stable")
    seldom = [_so_many(float(chances[row]), rank, count) for rank, row in enumerate(order, 1)]
    found = np.zeros(count, dtype=bool)
    if count and count * min(seldom) < _BY_CHANCE:
        found[order[: count - int(np.argmin(seldom[::-1]))]] = True
    return found


def _of_one_pose(
    parts: Sequence[_Part], rows: NDArray[np.intp], known: int
) -> tuple[NDArray[np.intp], Array, NDArray[np.intp]]:
    """Pairs of a row and a known one that may be of one pose.

    Of each its row, the sum of the squares by which both differ, and how many these are. What is
    too far apart by some is not compared by the rest.
    """
    most = _within(sum(part.deviations.shape[1] for part in parts))
    near = parts[0].near(rows, most) if parts else np.zeros((len(rows), known), dtype=bool)
    of, others = np.nonzero(near)
    of = rows[of]
    sums, sizes = np.zeros(len(of)), np.zeros(len(of), dtype=np.intp)
    for part in parts:
        off = part.off(of, others) ** 2
        is_known = np.isfinite(off)
        sums += np.where(is_known, off, 0.0).sum(axis=1)
        sizes += is_known.sum(axis=1)
        near = sums < most
        of, others, sums, sizes = of[near], others[near], sums[near], sizes[near]
    near = (sizes > 0) & (sums < _within(sizes))
    return of[near], sums[near], sizes[near]


def _within(sizes: ArrayLike) -> Array:
    """What the squares of so many differences of one pose, each of two rows, add up to at most."""
    return np.asarray(2 * (np.sqrt(sizes) + _ONE_POSE) ** 2)


class _Part(NamedTuple):
    """What was observed of one kind, a known row and a row of the table each."""

    known: Array
    table: Array
    deviations: Array
    steps: Array  # of the last digits
    turn: float | None = None  # of angles

    def off(self, rows: NDArray[np.intp], others: NDArray[np.intp]) -> Array:
        """How far rows are from known ones, in standard deviations; NaN of what is unknown."""
        own, known, deviations = self.table[rows], self.known[others], self.deviations[rows]
        if self.is_quaternion:
            apart = vectors_from_quaternions(_between(known, own))
        else:
            apart = shortest(own - known, self.turn)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = (np.abs(apart) + self.steps) / deviations
        return np.where(deviations > 0, found, np.nan)

    def near(self, rows: NDArray[np.intp], most: Array) -> NDArray[np.bool_]:
        """Whether the square of the first number leaves rows as near as this to each known one."""
        if self.is_quaternion:
            return np.ones((len(rows), len(self.known)), dtype=bool)
        own, deviations = self.table[rows, :1], self.deviations[rows, :1]
        apart = np.abs(shortest(own - self.known[:, 0], self.turn)) + self.steps[0]
        return np.asarray(~(apart >= np.sqrt(most) * np.where(deviations > 0, deviations, np.inf)))

    @property
    def is_quaternion(self) -> bool:
        return bool(self.table.shape[1] > self.deviations.shape[1])


def _parts(
    known: Measurements, table: Measurements, noise: NoiseSettings, stated: Array | None
) -> list[_Part]:
    """What both have, positions before the orientations that take longer to compare."""
    space, found = table.space, []
    for name, deviations in table.standard_deviations(noise).items():
        kind, own, others = OBSERVABLES[name], getattr(table, name), getattr(known, name)
        if name in ("readings", "reported") or kind.between_rows or others is None:
            continue
        if own.shape[1:] != others.shape[1:]:
            continue
        steps = np.array([last_digit(column) for column in own.reshape(len(own), -1).T])
        size = deviations.copy()
        if name == "poses":
            if space.moves:  # the smallest, however its axes lie
                size[:, : space.size] = size[:, : space.size].min(axis=1, keepdims=True)
            size = size if stated is None else np.fmin(size, stated)
            if space.has_quaternion:  # which is normalised, and has no digits of its own
                steps = np.concatenate([steps[: space.size], np.zeros(len(space.rotation))])
            for each, turn in ((slice(space.size), None), (slice(space.size, None), 2 * np.pi)):
                if size[:, each].size:
                    part = others[:, each], own[:, each], size[:, each], steps[each]
                    found.append(_Part(*part, turn))
            continue
        if name == "points":
            size = np.broadcast_to(size.min(axis=2, keepdims=True), own.shape)
            size = size if stated is None else np.fmin(size, stated[: space.size])
        first, second, sizes = (each.reshape(len(each), -1) for each in (others, own, size))
        found.append(_Part(first, second, sizes, steps))
    return found


def _between(known: Array, own: Array) -> Array:
    """Quaternions (N, 4) of the rotations from known ones to others."""
    vector = (
        known[:, 3:] * own[:, :3] - own[:, 3:] * known[:, :3] - np.cross(own[:, :3], known[:, :3])
    )
    return np.hstack([vector, np.sum(own * known, axis=1, keepdims=True)])


def last_digit(values: Array) -> float:
    """The step of a column's last digit, in some unit; of full numbers next to nothing."""
    values = values[np.isfinite(values)]
    for unit in _UNITS:
        for digits in range(_DIGITS):
            off = np.abs(values / unit - np.round(values / unit, digits))
            if (off <= _EXACT * np.maximum(np.abs(values / unit), 10.0**-digits)).all():
                return float(unit * 10.0**-digits)
    return float(_EXACT * np.abs(values).max(initial=1.0))


def _so_many(chance: float, rank: int, count: int) -> float:
    """That `rank` of so many independent probabilities are as small: of a binomial distribution."""
    if not 0 < chance < 1:
        return float(chance > 0)
    others = count - rank + 1
    ratio = others * chance / (rank * (1 - chance))
    return _core.f_tail(1 / ratio, 2 * others, 2 * rank)
