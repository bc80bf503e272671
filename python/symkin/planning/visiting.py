# SPDX-License-Identifier: MIT
"""The order in which poses are visited."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.analysis.workspace import WorkspaceSample
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.values import Array


def travel_length(mechanism: Mechanism, poses: ArrayLike | WorkspaceSample) -> float:
    """Length of the way from home through poses in their order, m; of a platform that turns, rad.

    Beside a position a rotation counts as the way of a point at the characteristic length from the
    centre.
    """
    stations = np.vstack([mechanism.home, pose_rows(poses)])
    return float(_distances(mechanism, stations[:-1], stations[1:]).sum())


def visiting_order(
    mechanism: Mechanism, poses: Array, seed: int, start: Array | None = None
) -> NDArray[np.intp]:
    """Order poses for a short way from home, or `start`, through all of them (a heuristic).

    Rows of the poses, shape (N,); in the given order if the heuristic finds no shorter way.
    """
    given = np.arange(len(poses), dtype=np.intp)
    if len(poses) < 2:
        return given
    stations = np.vstack([mechanism.home if start is None else start, poses])
    ways = np.zeros((len(stations) + 1,) * 2)  # the last one is nowhere: it ends an open way
    ways[:-1, :-1] = _distances(mechanism, stations[:, None], stations[None])
    found = _short_way(ways / max(ways.max(), 1e-300), seed)[1:-1] - 1
    shorter = _length(ways, [0, *(found + 1)]) < _length(ways, range(len(stations)))
    return found if shorter else given


def there_and_back(way: Way) -> Way:
    """Visit every second station of a way going, and the others coming back.

    What drifts with time is then as far on at one end of the way as at the other in the mean, and
    no function of the pose looks like it.
    """
    return np.concatenate([way[::2], way[1::2][::-1]])


def _short_way(ways: Array, seed: int) -> Way:
    """A short path through all stations, from the first to the last."""
    count = len(ways)
    best = _improved(ways, _nearest_neighbours(ways))
    random = np.random.default_rng(seed)
    width = min(_NEIGHBOURHOOD, count - 2)
    for _ in range(min(_KICKS, _EFFORT // count**2) if width >= 3 else 0):
        begin = random.integers(1, count - width)
        first, second, third = begin + np.sort(random.choice(width, 3, replace=False))
        swapped = [best[:first], best[second:third], best[first:second], best[third:]]
        tried = _improved(ways, np.concatenate(swapped))
        if _length(ways, tried) < _length(ways, best):
            best = tried
    return best


def _nearest_neighbours(ways: Array) -> Way:
    """Always go to the nearest station that is left."""
    left = ways.copy()
    path = [0]
    for _ in range(len(ways) - 2):
        left[:, path[-1]] = np.inf
        path.append(int(left[path[-1], :-1].argmin()))
    return np.array([*path, len(ways) - 1], dtype=np.intp)


def _improved(ways: Array, path: Way) -> Way:
    """The path when neither turning a part of it round nor moving a few stations helps."""
    if len(path) > _PIECE:
        pieces = range(0, len(path) - 1, _PIECE - 1)
        improved = [_improved(ways, path[begin : begin + _PIECE]) for begin in pieces]
        return np.concatenate([*(piece[:-1] for piece in improved), path[-1:]])
    while len(path) > 3:
        between = ways[np.ix_(path, path)]
        better = _turned(between)
        if better is None:
            better = _moved(between)
        if better is None:
            break
        path = path[better]
    return path


def _turned(ways: Array) -> Way | None:
    """Places of the path in a better order, by the part that is best turned round."""
    steps, last = ways.diagonal(1), len(ways) - 2
    gains = np.triu(ways[:last, 1:-1] + ways[1:-1, 2:] - steps[:-1, None] - steps[1:], 1)
    first, end = np.unravel_index(gains.argmin(), gains.shape)
    if gains[first, end] > _GAIN:
        return None
    order = np.arange(len(ways))
    order[first + 1 : end + 2] = order[first + 1 : end + 2][::-1]
    return order


def _moved(ways: Array) -> Way | None:
    """The same by moving up to three stations to the best other place (or-opt)."""
    steps, order = ways.diagonal(1), np.arange(len(ways))
    gaps = order[:-1]
    best, better = _GAIN, None
    for size in range(1, min(_MOVED, len(ways) - 3) + 1):
        first = np.arange(1, len(ways) - size)
        last = first + size - 1
        freed = steps[first - 1] + steps[last] - ways[first - 1, last + 1]
        forth = ways[first, :-1] + ways[last, 1:]
        back = ways[last, :-1] + ways[first, 1:]
        gains = np.minimum(forth, back) - steps - freed[:, None]
        gains[(gaps >= first[:, None] - 1) & (gaps <= last[:, None])] = 0
        at, gap = np.unravel_index(gains.argmin(), gains.shape)
        if gains[at, gap] < best:
            best = gains[at, gap]
            part = order[first[at] : last[at] + 1]
            part = part[::-1] if back[at, gap] < forth[at, gap] else part
            rest = np.delete(order, part)
            place = gap + 1 if gap < first[at] else gap + 1 - size
            better = np.concatenate([rest[:place], part, rest[place:]])
    return better


def _length(ways: Array, path: ArrayLike) -> float:
    stations = np.asarray(path)
    return float(ways[stations[:-1], stations[1:]].sum())


def _distances(mechanism: Mechanism, one: Array, other: Array) -> Array:
    """Way between poses, in the shape that the poses broadcast to, m or rad."""
    size = mechanism.space.size
    ways = np.linalg.norm(one[..., :size] - other[..., :size], axis=-1)
    if mechanism.space.has_quaternion:
        # From the chord: the arc cosine of a product has 1e-8 rad of rounding near zero.
        chords = [
            np.linalg.norm(one[..., size:] + sign * other[..., size:], axis=-1) for sign in (1, -1)
        ]
        angles = 4 * np.arcsin(np.minimum(np.minimum(*chords) / 2, 1))
    else:
        angles = np.abs(one[..., size:] - other[..., size:]).sum(axis=-1)
    length = mechanism.characteristic_length if mechanism.space.moves else 1.0
    return np.asarray(ways + length * angles)


_KICKS = 100  # restarts from a way that is changed a little
_EFFORT = 5 * 10**6  # restarts times the square of the stations, so that large plans do not wait
_NEIGHBOURHOOD = 50  # stations among which a way is changed
_PIECE = 600  # stations that are improved together
_MOVED = 3  # stations that are moved together
_GAIN = -1e-12  # of the longest distance: less is rounding


Way = NDArray[np.intp]  # stations in their order; what stands first and last stays there
