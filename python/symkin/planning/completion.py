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

from symkin.values import Array

_POOL = 40  # of the best candidates of every step, for which members are exchanged
_SWEEPS = 3
_EXCHANGED = 25  # members that are exchanged; those after them are chosen again before their time
_BETTER = 1 + 1e-3  # of the gain: less is no exchange
_NEGLIGIBLE = 1e-12  # of the largest eigenvalue of the form
_NEEDED = 1e-6  # of the identity: what a member leaves less of is known by that member alone
_LEFT = 1e-2  # of the largest W W': with less the differences have cost digits


@dataclass
class Completing:
    """Candidates to choose from, and what is known without them."""

    rows: Array  # (n, r, p): what each candidate brings, in units of the unknowns' scale
    form: Array  # (p, p): the mean squared error, by errors of the unknowns
    information: Array  # (p, p): of priors and of the rows that are taken
    # (n,): how likely each candidate can be measured; of what must not be chosen, zero.
    chance: Array

    def __post_init__(self) -> None:
        """Take the root of the form."""
        values, vectors = np.linalg.eigh(self.form)
        kept = values > _NEGLIGIBLE * values[-1]
        self.root = vectors[:, kept] * np.sqrt(values[kept])

    def completion(
        self, held: Sequence[int], reached: Callable[[Array], bool], most: int
    ) -> list[int]:
        """Return members with which the accuracy is reached, at most so many and at least one.

        `held` are those that it begins with; `reached` says it of a covariance.
        """
        members = [each for each in held if self.chance[each] > 0]
        pool = set(members)
        known = self.covariance(members)
        gains: _Gains | None = None
        while len(members) < most and not (members and reached(known)):
            gains = gains or _Gains(self, known)
            worth = gains.total() * self.chance
            worth[members] = -np.inf
            best = int(np.argmax(worth))
            if not worth[best] > 0:
                break
            members.append(best)
            pool.update(np.argpartition(-worth, min(_POOL, len(worth) - 1))[:_POOL].tolist())
            known = self.covariance(members)
            gains.add(best, known)
        members = self._exchanged(members, np.array(sorted(pool), dtype=np.intp))
        while len(members) > 1 and reached(self.covariance(less := self._without_least(members))):
            members = less
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
        return _traces(*_seen(rows, covariance, self.root)) * chance

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
        """All but the one that takes least off the mean squared error: here S = I - J A J'."""
        spread, square = _seen(self.rows[members], self.covariance(members), self.root)
        left = 2 * np.eye(len(spread))[:, :, None] - spread
        needed = np.linalg.eigvalsh(left.transpose(2, 0, 1))[:, 0] < _NEEDED
        least = int(np.argmin(np.where(needed, np.inf, _traces(left, square))))
        return members[:least] + members[least + 1 :]


class _Gains:
    """What every candidate takes off the mean squared error, while members are added.

    A member with rows j changes A by -H' S^-1 H, H = j A and S = I + j A j', of few rows: so what
    is made of A follows by thin products, a tenth of the work of making it anew.
    """

    def __init__(self, completing: Completing, covariance: Array) -> None:
        self._of, self._flat = completing, completing.rows.reshape(-1, completing.rows.shape[2])
        self._covariance = covariance
        self._compute()

    def total(self) -> Array:
        """Return the gains, shape (n,)."""
        return _traces(self._spread, self._square)

    def add(self, member: int, covariance: Array) -> None:
        """Add a candidate to the members; with it they leave this covariance."""
        rows = self._of.rows[member]
        held = self._covariance
        moved = rows @ held
        own = np.linalg.inv(np.eye(len(rows)) + moved @ rows.T)
        weighted = moved @ self._of.root
        # Products of all rows with H' and (H F A)', then S^-1 from the right.
        r, size = len(rows), len(self._of.rows)
        both = np.vstack([moved, weighted @ (self._of.root.T @ held)])
        across = (self._flat @ both.T).reshape(size, r, 2, r).transpose(2, 1, 3, 0)
        solved = own @ across[0]
        self._spread -= _product(solved, across[0])
        once = _product(solved, (weighted @ weighted.T / 2) @ solved - across[1])
        self._square += once + once.transpose(1, 0, 2)
        self._covariance = covariance
        if self._square.max() < _LEFT * self._largest:
            self._compute()

    def _compute(self) -> None:
        self._spread, self._square = _seen(self._of.rows, self._covariance, self._of.root)
        self._largest = self._square.max()


def _seen(rows: Array, covariance: Array, root: Array) -> tuple[Array, Array]:
    """Return S and W W' of candidates, both with the candidates last: shape (r, r, n)."""
    moved = rows @ covariance
    spread = moved @ rows.transpose(0, 2, 1) + np.eye(rows.shape[1])
    seen = moved @ root
    square = seen @ seen.transpose(0, 2, 1)
    return _candidates_last(spread), _candidates_last(square)


def _candidates_last(matrices: Array) -> Array:
    return np.ascontiguousarray(matrices.transpose(1, 2, 0))


def _product(a: Array, b: Array) -> Array:
    """Return a b', of matrices with the candidates last."""
    terms = (a[:, None, k] * b[None, :, k] for k in range(a.shape[1]))
    return np.asarray(sum(terms, next(terms)))


def _traces(spread: Array, square: Array) -> Array:
    """Return tr(S^-1 W W'): S eliminated row by row, for all candidates together."""
    s, w = spread.copy(), square.copy()
    total = np.zeros(s.shape[2])
    for i in range(len(s)):
        total += w[i, i] / s[i, i]
        for j in range(i + 1, len(s)):
            share = s[j, i] / s[i, i]
            s[j, i + 1 :] -= share * s[i, i + 1 :]
            w[j] -= share * w[i]
            w[:, j] -= share * w[:, i]
    return total
