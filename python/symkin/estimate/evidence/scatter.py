# SPDX-License-Identifier: MIT
"""A test for what scatters more than noise explains: a leg, a point, or rows from one on.

The score test of a variance (Rao): errors of a source count as they move what was measured.
Chi-square, for which all rows are alike, sees them late.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from statistics import NormalDist
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import is_noise, thousandths
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import BETTER
from symkin.estimate.evidence.sag import SAG_ALARMS
from symkin.estimate.found import Found
from symkin.values import Array, record

_READINGS, _ROWS = "readings-scatter", "rows-scatter"
_ALL = 300  # errors, for whose squares eigenvalues are computed
_PARTS = 100  # that begin or end somewhere
_LARGE = 2.0  # standard deviations, beyond which a tail is computed
_CLEAR = 4.0  # of a part, of which there are many
_ROUNDS = 3
_LEAST = 4  # rows that scatter where others do not, and rows that do not
_NEARLY = 0.8  # of gross errors that are in rows that scatter
_MANY = 0.25  # of rows that scatter have gross errors
_RANK = 1e-9
_HALVINGS = 50


@record
class _Source:
    """Errors of a leg's readings, of a point's place, or of all that was measured, row by row.

    Of c errors of a row that are independent of each other: their scores, n x c, what these would
    share if the robot were known, n x c x c, and with what the unknowns explain, n x c x k; and the
    sum of the squared scores of a row, its mean of a sound robot and half its variance, 3 x n.
    """

    code: str
    which: int
    scores: Array
    shared: Array
    by_basis: Array
    sums: Array

    @classmethod
    def of(cls, rows: LinearRows, code: str, which: int, errors: Array) -> Self:
        """Of what errors do to the rows, n x r x c."""
        scores = np.einsum("nrc,nr->nc", errors, rows.residual)
        shared = np.einsum("nrc,nrd->ncd", errors, errors)
        by_basis = np.einsum("nrk,nrc->nck", rows.basis, errors)
        left = shared - by_basis @ by_basis.swapaxes(1, 2)
        squares, means = np.square(scores).sum(axis=1), np.einsum("ncc->n", left)
        sums = np.stack([squares, means, np.square(left).sum(axis=(1, 2))])
        return cls(code, which, scores, shared, by_basis, sums)

    def whole(self) -> _Scatter | None:
        """Of all rows, if these scatter."""
        large = float(_sizes(self.sums.sum(axis=1))) > _LARGE
        return self.scatter(slice(0, len(self.scores)), 1) if large else None

    def scatter(self, rows: slice, many: int) -> _Scatter:
        """Of some rows, one of so many."""
        own = self.scores[rows], self.shared[rows], self.by_basis[rows]
        scores, weights = (_of_all if self.code == _ROWS else _uncorrelated)(*own)
        kept = weights > _RANK * weights.max()
        is_part = rows != slice(0, len(self.scores))
        return _Scatter(self, rows, is_part, scores[kept], weights[kept], many)

    @property
    def _ends(self) -> NDArray[np.intp]:
        count = len(self.scores)
        return np.arange(_LEAST, count - _LEAST + 1, max(1, count // _PARTS))

    @property
    def sizes_of_parts(self) -> Array:
        """By how many standard deviations the squares of each are too large."""
        return _sizes(_of_parts(self.sums.T, self._ends).T)

    def part(self) -> _Scatter | None:
        """Of the rows from one on, or until one, that scatter most; None where none does.

        With the same variance in each: first the one that it seems to have where unknowns, which
        bring what scatters into the other rows, are left aside.
        """
        ends, sizes = self._ends, self.sizes_of_parts
        if sizes.max(initial=0.0) < _CLEAR:
            return None
        parts = [slice(0, end) for end in ends.tolist()]
        parts += [slice(end, len(self.scores)) for end in ends.tolist()]
        squares, means, spreads = _of_parts(self.sums.T, ends)[sizes.argmax()]
        variance = float((squares - means) / spreads)
        for _ in range(_ROUNDS):
            best = int(self._gains(variance, ends).argmax())
            told = self.scatter(parts[best], len(parts))
            variance = told.variance
        return told

    def _gains(self, variance: float, ends: NDArray[np.intp]) -> Array:
        """As `_Scatter.gain`, of the parts at these ends."""
        inverse = np.linalg.inv(self.shared + np.eye(self.scores.shape[1]) / variance)
        scaled = inverse @ self.by_basis
        grams = _of_parts(self.by_basis.swapaxes(1, 2) @ scaled, ends)
        along = _of_parts(np.einsum("nck,nc->nk", scaled, self.scores), ends)
        drops = _of_parts(np.einsum("nc,ncd,nd->n", self.scores, inverse, self.scores), ends)
        sizes = _of_parts(np.linalg.slogdet(inverse / variance)[1], ends)
        rest = np.eye(grams.shape[1]) - grams
        drops += (along * np.linalg.solve(rest, along[..., None])[..., 0]).sum(axis=1)
        return np.asarray(drops + sizes - np.linalg.slogdet(rest)[1])


def _uncorrelated(scores: Array, shared: Array, by_basis: Array) -> tuple[Array, Array]:
    """Combinations of scores that are uncorrelated if the robot is sound, and their variances."""
    if scores.size > _ALL:  # unknowns take little of each
        weights, axes = np.linalg.eigh(shared)
        share = 1 - np.square(by_basis).sum() / weights.sum()
        return np.einsum("ncd,nc->nd", axes, scores).ravel(), share * weights.ravel()
    (count, errors), each = scores.shape, np.arange(len(scores))
    own = np.zeros((count, errors, count, errors))
    own[each, :, each] = shared
    explained = by_basis.reshape(scores.size, -1)
    weights, axes = np.linalg.eigh(own.reshape(scores.size, -1) - explained @ explained.T)
    return axes.T @ scores.ravel(), weights


def _of_all(scores: Array, shared: Array, by_basis: Array) -> tuple[Array, Array]:
    """The same of all that was measured, which the unknowns share as they explain it, or not."""
    explained = by_basis.reshape(scores.size, -1)
    shares, axes = np.linalg.eigh(explained.T @ explained)
    seen = shares > _RANK
    along = (explained @ axes[:, seen]).T @ scores.ravel() / np.sqrt(shares[seen])
    count = round(float(np.einsum("ncc->", shared))) - len(along)
    rest = max(float(np.square(scores).sum() - np.square(along).sum()), 0.0)
    alike = np.full(max(count, 0), math.sqrt(rest / max(count, 1)))
    return np.append(along, alike), np.append(1 - shares[seen], np.ones(len(alike)))


def _sizes(sums: Array) -> Array:
    """How many standard deviations sums of squares are larger than their means."""
    squares, means, spreads = sums
    return np.asarray((squares - means) / np.sqrt(2 * np.maximum(spreads, 1e-300)))


def _of_parts(values: Array, ends: NDArray[np.intp]) -> Array:
    """Sums over the rows until each end, and over those from it on."""
    sums = np.cumsum(values, axis=0)
    return np.concatenate([sums[ends - 1], sums[-1] - sums[ends - 1]])


@record
class _Scatter:
    """Squares of scores of errors of a source in some rows, that are large.

    `scores` are uncorrelated combinations, of a sound robot with variances `weights`. The source is
    one of so `many`, parts of the rows counted.
    """

    source: _Source
    rows: slice
    is_part: bool
    scores: Array
    weights: Array
    many: int

    @property
    def square(self) -> float:
        """The sum of squares."""
        return float(np.square(self.scores).sum())

    @property
    def p_value(self) -> float:
        """Probability of scores as large for a sound robot, of one of so many."""
        return _tail(self.weights, _halved(lambda z: _mean(self.weights, z) < self.square))

    def drop(self, variance: float) -> float:
        """How much of chi-square errors with such a variance take."""
        return float((np.square(self.scores) / (1 / variance + self.weights)).sum())

    def gain(self, variance: float) -> float:
        """Of twice the logarithm of the likelihood, by errors with such a variance.

        Where only some rows have them, less what that has to be better.
        """
        gained = self.drop(variance) - float(np.log1p(variance * self.weights).sum())
        return gained - BETTER * self.is_part

    @property
    def variance(self) -> float:
        """Of the errors, as is most likely."""

        def of(share: float) -> float:
            return share / (1 - share) / float(self.weights.max())

        def rises(share: float) -> bool:
            own = self.weights / (1 + of(share) * self.weights)
            return float((np.square(self.scores / self.weights * own) - own).sum()) > 0

        return of(_halved(rises))

    def deviation(self, variance: float) -> float:
        """Of the root of such a variance."""
        own = self.weights * (1 + variance * self.weights)
        of_variance = math.sqrt(2 * np.square(own).sum()) / np.square(self.weights).sum()
        return float(of_variance / (2 * math.sqrt(variance)))


def doubts_of_scatter(found: Found, apart: Sequence[int] = ()) -> Iterator[Doubt]:
    """Say what scatters, and in which rows, if that explains all that noise does not."""
    try:
        rows = linear_rows(found, tuple(apart))
    except SymkinError:
        return
    if rows is None or rows.spare < 1 or found.noise_is_estimated:
        return
    told = [(each, each.variance) for each in _scatters_of(rows)]
    worst, variance = max(told, key=lambda each: each[0].gain(each[1]), default=(None, 0.0))
    if worst is None or (worst.source.which < 0 and not worst.is_part):  # that is the noise
        return
    explains = is_noise(rows.square - worst.drop(variance), rows.spare)
    if explains and worst.p_value < SAG_ALARMS / worst.many:
        yield _doubt_of(found, rows, worst, variance)


def hardly_missed(rows: LinearRows, power: float) -> dict[int, float]:
    """From which size on errors of a leg's readings are seen in most robots, by the leg (from 0).

    What sums of squares are then is taken for a gamma variate, whose cube root is nearly normal.
    """
    sources = [each for each in _sources_of(rows) if each.code != _ROWS]
    alarms, below = SAG_ALARMS / len(sources), NormalDist().inv_cdf(1 - power)
    sizes = {}
    for source in sources:
        if source.code != _READINGS or not (source.sums[1].sum() > 0):
            continue
        weights = source.scatter(slice(0, len(rows.residual)), 1).weights
        sizes[source.which] = math.sqrt(_variance_seen_from(weights, alarms, below))
    return sizes


def _variance_seen_from(weights: Array, alarms: float, below: float) -> float:
    """The variance of which sums of squares, but for so many, are where so few sound ones are."""
    limit, largest = _mean(weights, _halved(lambda z: _tail(weights, z) > alarms)), weights.max()

    def of(share: float) -> float:
        return share / (1 - share) / float(largest)

    def is_missed(share: float) -> bool:
        own = weights * (1 + of(share) * weights)
        mean, spread = own.sum(), 2 * np.square(own).sum() / own.sum() ** 2
        return float(mean * (1 - spread / 9 + below * math.sqrt(spread) / 3) ** 3) < limit

    return of(_halved(is_missed))


def is_due_to_scatter(gross: Doubt | None, symptoms: Sequence[Doubt]) -> bool:
    """Whether gross errors are those of rows that scatter: nearly all of them, in many of these."""
    parts = [each.figures["within"] for each in symptoms if "within" in each.figures]
    if gross is None or not parts:
        return False
    first, last = parts[0]
    inside = sum(first <= row <= last for row in gross.rows)
    return bool(inside >= _NEARLY * len(gross.rows) and inside > _MANY * (last - first + 1))


def _doubt_of(found: Found, rows: LinearRows, worst: _Scatter, variance: float) -> Doubt:
    source, size, p_value = worst.source, math.sqrt(variance), worst.p_value
    legs: tuple[int, ...] = ()
    figures: dict[str, Any] = {
        "evidence": f" (p {p_value:.1g})",
        "most": True,
        "gain": worst.gain(variance),
    }
    if source.code == _ROWS:
        size = math.sqrt(1 + variance)
        figures["times"] = f"{size:.2g}"
    else:
        of_legs = source.code == _READINGS
        legs = (source.which,) if of_legs else ()
        unit = found.nominal.reading_unit if of_legs else "m"
        figures["whose"] = f"{'the sensor of leg' if of_legs else 'point'} {source.which + 1}"
        figures["amount"] = thousandths(size, worst.deviation(variance), unit).lstrip("+")
    numbers: tuple[int, ...] = ()
    if worst.is_part:
        own = found.measurements.row_numbers[rows.order[worst.rows]]
        early = worst.rows.start == 0
        numbers = (int(own[-1] if early else own[0]),)
        figures["when"] = f" until row {numbers[0]}" if early else f" from row {numbers[0]} on"
        figures["within"] = (int(own.min()), int(own.max()))
    return Doubt(source.code, legs, numbers, size, p_value, figures)


def _sources_of(rows: LinearRows) -> Iterator[_Source]:
    for leg in range(rows.by_leg.shape[2]):
        yield _Source.of(rows, _READINGS, leg, rows.by_leg[..., leg, None])
    for point in range(rows.by_point.shape[2]):
        yield _Source.of(rows, "point-scatters", point, rows.by_point[..., point, :])
    everything = rows.used[..., None] * np.eye(rows.used.shape[1])
    yield _Source.of(rows, _ROWS, -1, everything)


def _scatters_of(rows: LinearRows) -> Iterator[_Scatter]:
    """Of sources where they are larger than those of most sound robots: in all rows, or in some."""
    sources = [*_sources_of(rows)]
    *single, everything = sources
    for source in sources:
        if (whole := source.whole()) is not None:
            yield dataclasses.replace(whole, many=len(single))
    if rows.by_leg.shape[2] > 1:  # of all legs alike
        readings = _Source.of(rows, _READINGS, -1, rows.by_leg)
        if (whole := readings.whole()) is not None:
            yield whole
    worst = max(single, key=lambda each: each.sizes_of_parts.max(initial=0.0))
    for source in (worst, everything):  # of some rows the others are dear, and show less
        if (part := source.part()) is not None:
            yield dataclasses.replace(part, many=part.many * len(sources))


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
