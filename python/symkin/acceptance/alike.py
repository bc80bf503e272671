# SPDX-License-Identifier: MIT
"""Rows that agree with others better than the noise of measuring lets two visits of a pose do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.model.chains import shortest
from symkin.model.poses import rotations_from_quaternions, vectors_from_rotations
from symkin.model.settings import NoiseSettings
from symkin.values import Array

_BY_CHANCE = 1e-5  # of honest tables, at most, are taken for copies
_ONE_POSE = 4.0  # standard deviations beyond the usual, within which two rows may be of one pose
_UNITS = (1.0, np.pi / 180, 0.0254)  # of a column, which decimal prefixes do not change
_DIGITS, _EXACT = 9, 1e-9
_UNTURNED = (0.0, 0.0, 0.0, 1.0)


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
    parts = [*_parts(known, table, noise, stated)]
    count = len(table.poses)
    chances = np.ones(count)
    for row in range(count):
        sums, sizes = np.zeros((2, len(known.poses)))
        for part in parts:
            off = part.off(row) ** 2
            sums += np.nansum(off, axis=1)
            sizes += np.isfinite(off).sum(axis=1)
        seen = np.flatnonzero(sizes)
        if not len(seen):
            continue
        sums, sizes = sums[seen], sizes[seen]
        nearest = int(np.argmin(sums / sizes))
        below = _core.noncentral_chi_square(sums[nearest], int(sizes[nearest]), 0.0)
        visits = int((sums / 2 < (np.sqrt(sizes) + _ONE_POSE) ** 2).sum())
        chances[row] = min(max(visits, 1) * below, 1.0)
    order = np.argsort(chances, kind="stable")
    seldom = [_so_many(float(chances[row]), rank, count) for rank, row in enumerate(order, 1)]
    found = np.zeros(count, dtype=bool)
    if count and count * min(seldom) < _BY_CHANCE:
        found[order[: count - int(np.argmin(seldom[::-1]))]] = True
    return found


class _Part(NamedTuple):
    """What was observed of one kind, a known row and a row of the table each."""

    known: Array
    table: Array
    deviations: Array
    steps: Array  # of the last digits
    size: int | None = None  # of the position, behind which the coordinates of a pose are turns

    def off(self, row: int) -> Array:
        """How far a row is from the known ones, in standard deviations; NaN of what is unknown."""
        own = self.table[row]
        apart = own - self.known if self.size is None else _between(self.size, self.known, own)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = (np.abs(apart) + self.steps) / self.deviations[row]
        return np.where(self.deviations[row] > 0, found, np.nan)


def _parts(
    known: Measurements, table: Measurements, noise: NoiseSettings, stated: Array | None
) -> list[_Part]:
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
            found.append(_Part(others, own, size, steps, space.size))
            continue
        if name == "points":
            size = np.broadcast_to(size.min(axis=2, keepdims=True), own.shape)
            size = size if stated is None else np.fmin(size, stated[: space.size])
        first, second, sizes = (each.reshape(len(each), -1) for each in (others, own, size))
        found.append(_Part(first, second, sizes, steps))
    return found


def _between(size: int, known: Array, own: Array) -> Array:
    """From known poses to another one: coordinates of the position, and the rotation."""
    by_place, turned = own[:size] - known[:, :size], own[size:] - known[:, size:]
    if turned.shape[1] == len(_UNTURNED):
        seen = np.isfinite(turned).all(axis=1, keepdims=True)
        first, second = (
            rotations_from_quaternions(np.where(seen, each, _UNTURNED))
            for each in (known[:, size:], np.broadcast_to(own[size:], turned.shape))
        )
        vectors = vectors_from_rotations(second @ np.swapaxes(first, -1, -2))
        turned = np.where(seen, vectors, np.nan)
    else:
        turned = shortest(turned, 2 * np.pi)
    return np.hstack([by_place, turned])


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
