# SPDX-License-Identifier: MIT
"""What is still to be measured until an accuracy is reached: a completion of the rows taken.

With A the covariance of the unknowns, J the rows of a candidate (whitened, poses eliminated) and
K'K the mean squared error as a form of the unknowns, measuring the candidate takes

    tr(S^-1 W W'),   S = I + J A J',   W = J A K'

off the mean squared error, exactly. Candidates are added by that until the accuracy is reached and
then exchanged for better ones, which a plain greedy choice is 4 to 9 % worse than. `select_poses`
proves how good a plan is and takes seconds for it; this takes a fraction of one, between two rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Completing"]

Array = NDArray[np.float64]

_POOL = 40  # of the best candidates of every step, for which members are exchanged
_SWEEPS = 3
_EXCHANGED = 25  # members that are exchanged; those after them are chosen again before their time
_BETTER = 1 + 1e-3  # of the gain: less is no exchange
_NEGLIGIBLE = 1e-12  # of the largest eigenvalue of the form


@dataclass
class Completing:
    """Candidates to choose from, and what is known without them.

    Attributes
    ----------
    rows : ndarray, shape (n, r, p)
        What each candidate brings, in units of the unknowns' scale.
    form : ndarray, shape (p, p)
        The mean squared error, by errors of the unknowns.
    information : ndarray, shape (p, p)
        Of priors and of the rows that are taken.
    chance : ndarray, shape (n,)
        How likely each candidate can be measured; of what must not be chosen, zero.
    """

    rows: Array
    form: Array
    information: Array
    chance: Array

    def __post_init__(self) -> None:
        """Take the root of the form."""
        values, vectors = np.linalg.eigh(self.form)
        kept = values > _NEGLIGIBLE * values[-1]
        self._root = vectors[:, kept] * np.sqrt(values[kept])

    def completion(
        self, held: Sequence[int], reached: Callable[[Array], bool], most: int
    ) -> list[int]:
        """Return members with which the accuracy is reached, at most so many and at least one.

        `held` are those that it begins with; `reached` says it of a covariance.
        """
        members = [each for each in held if self.chance[each] > 0]
        pool = set(members)
        while len(members) < most and not (members and reached(self.covariance(members))):
            worth = self.worth(self.covariance(members))
            worth[members] = -np.inf
            best = int(np.argmax(worth))
            if not worth[best] > 0:
                break
            members.append(best)
            pool.update(np.argpartition(-worth, min(_POOL, len(worth) - 1))[:_POOL].tolist())
        members = self._exchanged(members, np.array(sorted(pool), dtype=np.intp))
        while len(members) > 1 and reached(self.covariance(self._without_least(members))):
            members = self._without_least(members)
        return members

    def first(self, members: Sequence[int], count: int) -> list[int]:
        """Return the members of largest gain, one after the other."""
        found: list[int] = []
        left = list(members)
        while left and len(found) < count:
            worth = self.worth(self.covariance(found), np.array(left))
            found.append(left.pop(int(np.argmax(worth))))
        return found

    def covariance(self, members: Sequence[int]) -> Array:
        """What is known with these, in units of the unknowns' scale."""
        rows = self.rows[list(members)].reshape(-1, self.rows.shape[2])
        return np.asarray(np.linalg.inv(self.information + rows.T @ rows))

    def worth(self, covariance: Array, among: NDArray[np.intp] | None = None) -> Array:
        """What each candidate takes off the mean squared error, times its chance."""
        rows = self.rows if among is None else self.rows[among]
        chance = self.chance if among is None else self.chance[among]
        moved = rows @ covariance
        spread = moved @ rows.transpose(0, 2, 1)
        spread += np.eye(rows.shape[1])
        seen = moved @ self._root
        return np.asarray((np.linalg.solve(spread, seen) * seen).sum(axis=(1, 2)) * chance)

    def _exchanged(self, members: list[int], pool: NDArray[np.intp]) -> list[int]:
        for _ in range(_SWEEPS):
            before = list(members)
            for place in range(min(len(members), _EXCHANGED)):
                others = members[:place] + members[place + 1 :]
                worth = self.worth(self.covariance(others), pool)
                worth[np.isin(pool, others)] = -np.inf
                best = int(np.argmax(worth))
                if worth[best] > _BETTER * worth[pool == members[place]][0]:
                    members[place] = int(pool[best])
            if members == before:
                break
        return members

    def _without_least(self, members: list[int]) -> list[int]:
        rows = self.rows[members]
        losses = [
            np.sum(self.covariance(members[:i] + members[i + 1 :]) * self.form)
            for i in range(len(rows))
        ]
        least = int(np.argmin(losses))
        return members[:least] + members[least + 1 :]
