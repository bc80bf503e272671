# SPDX-License-Identifier: MIT
"""A test for a leg whose readings scatter: a joint or a sensor that is loose.

The score test of a variance (Rao): errors of readings count as they move what was measured.
Chi-square, for which all rows are alike, sees them late.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import Rows, is_noise, rows_of_changes, thousandths
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.sag import SAG_ALARMS
from symkin.estimate.found import Found
from symkin.values import Array, record

_ALL = 300  # rows, for whose squares eigenvalues are computed
_LARGE = 2.0  # standard deviations, beyond which a tail is computed
_RANK = 1e-9
_HALVINGS = 50


@record
class _Scatter:
    """Squares of scores of errors of a leg's readings, one for each row, that are large.

    `scores` are uncorrelated combinations, of a sound robot with variances `weights`.
    """

    leg: int
    scores: Array
    weights: Array

    @property
    def square(self) -> float:
        """The sum of squares."""
        return float(np.square(self.scores).sum())

    @property
    def p_value(self) -> float:
        """Probability of scores as large for a sound robot."""
        return _tail(self.weights, _halved(lambda z: _mean(self.weights, z) < self.square))

    def drop(self, variance: float) -> float:
        """How much of chi-square errors with such a variance take."""
        return float((np.square(self.scores) / (1 / variance + self.weights)).sum())

    def variance(self, excess: float) -> float:
        """Of the errors, as the scores show it, or as leaves noise where that is more.

        That takes the `excess` of chi-square over its degrees (Paule and Mandel 1982).
        """

        def of(share: float) -> float:
            return share / (1 - share) / float(self.weights.max())

        shown = (self.square - self.weights.sum()) / np.square(self.weights).sum()
        return max(float(shown), of(_halved(lambda share: self.drop(of(share)) < excess)))

    def deviation(self, variance: float) -> float:
        """Of the root of such a variance."""
        own = self.weights * (1 + variance * self.weights)
        of_variance = math.sqrt(2 * np.square(own).sum()) / np.square(self.weights).sum()
        return float(of_variance / (2 * math.sqrt(variance)))


def doubts_of_scatter(found: Found, apart: Sequence[int] = ()) -> Iterator[Doubt]:
    """Say which leg's readings scatter, if that explains all that noise does not."""
    try:
        rows = rows_of_changes(found, tuple(apart))
    except SymkinError:
        return
    if rows is None or rows.spare < 1 or found.noise_is_estimated:
        return
    worst = min(_scatters_of(rows), key=lambda each: each.p_value, default=None)
    if worst is None or (p_value := worst.p_value) >= SAG_ALARMS / rows.by_leg.shape[2]:
        return
    variance = worst.variance(rows.square - rows.spare)
    if not is_noise(rows.square - worst.drop(variance), rows.spare):
        return
    size = math.sqrt(variance)
    figures = {
        "whose": f"the sensor of leg {worst.leg + 1}",
        "amount": thousandths(size, worst.deviation(variance), found.nominal.reading_unit).lstrip(
            "+"
        ),
        "evidence": f" (p {p_value:.1g})",
        "most": True,
    }
    yield Doubt("readings-scatter", (worst.leg,), (), size, p_value, figures)


def _scatters_of(rows: Rows) -> Iterator[_Scatter]:
    """Of legs where they are larger than those of most sound robots."""
    for leg in range(rows.by_leg.shape[2]):
        column = rows.by_leg[..., leg]
        own = np.square(column).sum(axis=1)
        by_basis = np.einsum("nrk,nr->nk", rows.basis, column)
        scores = np.einsum("nr,nr->n", column, rows.residual)
        mean, most = own.sum() - np.square(by_basis).sum(), math.sqrt(2 * np.square(own).sum())
        if not np.square(scores).sum() > mean + _LARGE * most > 0:
            continue
        kept = own > 0
        weights, by_basis, scores = own[kept], by_basis[kept], scores[kept]
        if len(weights) > _ALL:  # unknowns take little of each
            weights = weights * (mean / weights.sum())
        else:
            weights, axes = np.linalg.eigh(np.diag(weights) - by_basis @ by_basis.T)
            scores = axes.T @ scores
        kept = weights > _RANK * weights.max()
        yield _Scatter(leg, scores[kept], weights[kept])


def _halved(is_below: Callable[[float], bool]) -> float:
    """Where, between 0 and 1, something is no longer so."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if is_below(middle) else (low, middle)
    return (low + high) / 2


def _mean(weights: Array, z: float) -> float:
    """Of the squares' sum, tilted by so much of what is possible: the tail's saddle point."""
    return float((weights / (1 - z * weights / weights.max())).sum())


def _tail(weights: Array, z: float) -> float:
    """Probability of a sum of squares beyond `_mean(weights, z)` (Lugannani and Rice 1980)."""
    relative = weights / weights.max()
    tilted = 1 - z * relative
    beyond = float(z * (relative / tilted).sum() + np.log(tilted).sum())
    if not beyond > 1e-9:
        return 0.5
    w, v = math.sqrt(beyond), z * math.sqrt(float(np.square(relative / tilted).sum()) / 2)
    return math.erfc((w + math.log(v / w) / w) / math.sqrt(2)) / 2
