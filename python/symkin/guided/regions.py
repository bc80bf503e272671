# SPDX-License-Identifier: MIT
"""How likely poses can be measured, by what became of others.

A device that does not see part of the workspace loses the poses beyond a plane, in their positions
(a wall, the robot itself), in their orientations (a target turned away) or in both, or those around
a point. Which is not known: of many such cuts each says how many of the tries beyond it failed, and
how many on this side, and so how likely it is (Bayesian model averaging, the two shares of failures
having beta distributions). They are averaged, and with them that there is no region at all.
Nearness alone tells little of poses of six coordinates, of which no two are near; that failures lie
on one side a few of them tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.values import Array

Places = NDArray[np.intp]

_NONE = 0.5  # probability that there is no region
_WITHIN = (9, 1)  # failures and successes that count as seen before, in a region
_APART = (1, 9)  # and elsewhere
_SHARES = np.linspace(0.5, 0.04, 12)  # of the poses, that lie beyond a cut
_PLANES = 150  # directions, in each part of the coordinates
_POINTS = 50
_AMONG = 2000  # poses that tell where a cut has its share beyond it


class Regions:
    """Cuts through poses, made once; what became of tries is told for every answer."""

    def __init__(self, coordinates: Array, positions: int, seed: int) -> None:
        """Draw them: of the first coordinates, which are positions, of the others and of all.

        `coordinates` are in standard deviations of the poses, shape (n, coordinates).
        """
        rng = np.random.default_rng(seed)
        parts = [coordinates[:, :positions], coordinates[:, positions:]]
        if not all(part.shape[1] for part in parts):
            parts = []
        found = []
        for part in (*parts, coordinates):
            found.append(part @ rng.normal(size=(part.shape[1], _PLANES)))
            points = part[rng.integers(len(part), size=_POINTS)]
            found.append(-np.linalg.norm(part[:, None] - points, axis=2))
        # Of each pose and direction: beyond how many of its cuts.
        self._beyond = np.hstack([_beyond(depths) for depths in found])

    def chance(self, tried: Sequence[int], failed: Sequence[int]) -> Array:
        """How likely each pose can be measured, by tries of these poses and those that failed."""
        cuts = np.arange(len(_SHARES))[:, None, None]
        tries = (self._beyond[list(tried)] > cuts).sum(axis=1)
        fails = (self._beyond[list(failed)] > cuts).sum(axis=1)
        others, failures = len(tried) - tries, len(failed) - fails
        within, odds = _updated(_WITHIN, fails, tries)
        apart, odds_apart = _updated(_APART, failures, others)
        alone, odds_alone = _updated(_APART, np.array([len(failed)]), np.array([len(tried)]))
        logs = np.append(odds + odds_apart - np.log(odds.size / (1 - _NONE)), odds_alone)
        logs[-1] += np.log(_NONE)
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        cut = weights[:-1].reshape(odds.shape)
        # What a pose adds by being beyond 0, 1, 2, ... cuts of a direction.
        added = np.zeros((len(_SHARES) + 1, odds.shape[1]))
        np.cumsum(cut * (within - apart), axis=0, out=added[1:])
        fail = np.full(len(self._beyond), weights[-1] * alone[0] + np.sum(cut * apart))
        for beyond, more in zip(self._beyond.T, added.T, strict=True):
            fail += more[beyond]
        return np.asarray(1 - fail)


def _beyond(depths: Array) -> NDArray[np.uint8]:
    """Beyond how many cuts of its direction each pose lies, by its depths along directions."""
    some = depths[:: -(-len(depths) // _AMONG)]
    count = np.zeros(depths.shape, dtype=np.uint8)
    for cut in np.quantile(some, 1 - _SHARES, axis=0):
        count += depths > cut
    return count


def _updated(prior: tuple[int, int], failed: Places, tried: Places) -> tuple[Array, Array]:
    """Share that is expected to fail, and the logarithm of how likely these failures were."""
    fails, passes = prior[0] + failed, prior[1] + tried - failed
    logs = np.cumsum(np.log(np.arange(1, int((fails + passes).max()))))
    factorial = np.concatenate([[0.0], logs])

    def beta(fails: Places, passes: Places) -> Array:
        return np.asarray(
            factorial[fails - 1] + factorial[passes - 1] - factorial[fails + passes - 1]
        )

    share = fails / (fails + passes)
    return share, beta(fails, passes) - beta(*np.array(prior))
