# SPDX-License-Identifier: MIT
"""The tolerances as priors, with their scale and the share that legs have in common fitted.

Legs that a symmetry carries onto each other are often made alike: of one batch, with one jig. Then
their errors have a part in common. How large that part is, and whether tolerances were stated too
wide or too narrow, a robot's own measurements tell roughly. What they leave open is averaged over
(empirical Bayes): a robot without anything in common loses next to nothing by it.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from symkin.estimate.unknowns import Layout, widening_of
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry.roles import role_images
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array, Value, field, record

_SCALES = np.geomspace(0.25, 4, 9)
_USUAL = 2.0  # times as large, or as small, as stated: a standard deviation of tolerances
_SHARES = (0.0, 0.25, 0.5, 0.75, 0.9, 0.97)
_ONE_SHARE = 0.5  # how likely one share holds for lengths, angles and sensors, beforehand
_NOTHING = 1e-9


@record
class CommonShare(Value):
    """How much of the variance of errors of one kind the legs have in common.

    Attributes
    ----------
    kind : {"length", "angle", "sensor"}
        Of which parameters.
    shares, weights : ndarray
        Shares that were tried, and how likely the measurements make each; the weights add up to 1.
    """

    kind: str
    shares: Array
    weights: Array

    derived: ClassVar[tuple[str, ...]] = ("share",)

    @property
    def share(self) -> float:
        """The mean."""
        return float(self.shares @ self.weights)


@record
class FittedPrior(Value):
    """The prior that tolerances become by the measurements.

    Attributes
    ----------
    scales, weights : ndarray
        Factors on all tolerances that were tried, and how likely the measurements make each; the
        weights add up to 1.
    common : tuple of CommonShare
        For each kind of parameter that a symmetry of the drawing carries from leg to leg.
    names : tuple of str
        The parameters that have this prior, and
    covariance : ndarray
        what it says of their errors: averaged over scales and shares.
    spread : ndarray, shape (columns, columns)
        Of all unknowns: how far the estimates under the single scales and shares are apart.
    """

    scales: Array
    weights: Array
    common: tuple[CommonShare, ...]
    names: tuple[str, ...] = field(private=True)
    covariance: Array = field(private=True)
    spread: Array = field(private=True)

    derived: ClassVar[tuple[str, ...]] = ("scale",)

    @property
    def scale(self) -> float:
        """The mean."""
        return float(self.scales @ self.weights)

    @property
    def widening(self) -> float:
        """How much wider the independent part of each prior is, beside `Estimate.relations`."""
        return widening_of(self.covariance)

    def on(self, layout: Layout) -> Layout:
        """Give a layout this prior in place of the tolerances."""
        places = {name: i for i, name in enumerate(layout.scalars)}
        return layout.with_joint_prior(tuple(places[name] for name in self.names), self.covariance)

    def signed(self, names: tuple[str, ...], signs: Array) -> FittedPrior:
        """The same of unknowns of these names, some of which changed their signs."""
        own = np.array([signs[names.index(each)] for each in self.names])
        return replace(
            self,
            covariance=self.covariance * np.outer(own, own),
            spread=self.spread * np.outer(signs, signs),
        )


def fitted_prior(
    mechanism: Mechanism, layout: Layout, change: Array, covariance: Array
) -> FittedPrior | None:
    """Fit scale and shares to an estimate.

    To first order about the estimate, the observations are what its covariance says beyond its
    priors. Under each scale and each share of lengths, angles and sensors they have an evidence, by
    which the priors are averaged. Shares that are the same for all kinds count for one half.

    The drawing's symmetry says what legs may have in common, with the signs of `shared`. The layout
    has the tolerances as priors, or a prior that was fitted before; None where no parameter of a
    leg has one. `change` is that of the unknowns since the drawing, `covariance` by noise and
    priors.
    """
    scalars = _own_scalars(mechanism, layout)
    if not scalars:
        return None
    columns, tolerances = layout.column[scalars], layout.tolerances[scalars]
    kinds, alike = _alike(mechanism, [layout.scalars[each] for each in scalars])
    names = [
        kind
        for kind in ("length", "angle", "sensor")
        if np.abs(np.tril(alike[np.ix_(kinds == kind, kinds == kind)], -1)).max(initial=0) > 0
    ]
    precision = np.linalg.inv(covariance[np.ix_(columns, columns)] / _outer(tolerances))
    before = layout.prior_information_of(scalars) * _outer(tolerances)
    shown, directions = np.linalg.eigh(precision - before)
    information = directions * np.maximum(shown, 0) @ directions.T
    scores = precision @ (change[columns] / tolerances)
    trials = _Trials.of(information, scores, kinds, alike, names)
    weights = trials.weights
    drawn = np.einsum("i,ijk->jk", weights @ _SCALES**2, trials.correlations)
    own = np.linalg.solve(np.eye(len(drawn)) + drawn @ information, drawn @ scores)
    apart = trials.estimates(weights) - own
    spread = np.einsum("k,ki,kj->ij", weights[weights > _NOTHING], apart, apart)
    follow = np.linalg.solve(covariance[np.ix_(columns, columns)], covariance[columns]).T
    follow = follow * tolerances
    return FittedPrior(
        scales=_SCALES,
        weights=weights.sum(axis=0),
        common=tuple(
            CommonShare(
                name,
                np.array(_SHARES),
                np.array([weights[trials.shares[:, i] == each].sum() for each in _SHARES]),
            )
            for i, name in enumerate(names)
        ),
        names=tuple(layout.scalars[each] for each in scalars),
        covariance=drawn * _outer(tolerances),
        spread=follow @ spread @ follow.T,
    )


def _outer(values: Array) -> Array:
    return np.asarray(np.outer(values, values))


def _own_scalars(mechanism: Mechanism, layout: Layout) -> list[int]:
    """Parameters of legs whose priors are their tolerances, each alone in its column."""
    if layout.joint_prior is not None:
        return list(layout.joint_prior[0])
    followed = {column for _, column, _ in layout.ties if column >= 0}
    counts = np.bincount(layout.column[layout.column >= 0], minlength=len(layout.names))
    return [
        i
        for i, name in enumerate(layout.scalars)
        if name.startswith("leg")
        and name.partition(".")[2] in mechanism.parameter_names
        and layout.column[i] >= 0
        and layout.tolerances[i] > 0
        and layout.deviations[i] == layout.tolerances[i]
        and counts[layout.column[i]] == 1
        and layout.column[i] not in followed
    ]


def _alike(mechanism: Mechanism, names: list[str]) -> tuple[NDArray[np.str_], Array]:
    """Kinds of parameters, and correlations of their errors where legs have all in common.

    Of what a symmetry does not carry onto another leg only the own part is left, a correlation of
    one with itself; between kinds there is none.
    """
    images, tolerances = role_images(mechanism), np.asarray(parameter_tolerances(mechanism))
    count = len(mechanism.parameter_names)
    drawn = np.zeros((len(names), tolerances.size))
    kinds = []
    for row, name in zip(drawn, names, strict=True):
        block, _, own = name.partition(".")
        leg, place = int(block[3:]) - 1, mechanism.parameter_names.index(own)
        kinds.append(_kind(mechanism, leg, place))
        image = images[leg]
        origin = image.reference
        for other in mechanism.estimated[origin]:
            by = image.by[place, other]
            if np.isfinite(by) and _kind(mechanism, origin, other) == kinds[-1]:
                brings = by * tolerances[origin, other] / tolerances[leg, place]
                row[origin * count + other] = brings
    sizes = np.linalg.norm(drawn, axis=1)
    found = drawn / np.where(sizes > _NOTHING, sizes, 1.0)[:, None]
    alike = found @ found.T
    alike[np.abs(alike) < _NOTHING] = 0.0
    np.fill_diagonal(alike, 1.0)
    return np.array(kinds), alike


def _kind(mechanism: Mechanism, leg: int, place: int) -> str:
    if mechanism.parameter_roles(leg)[place].of_sensor:
        return "sensor"
    return "angle" if mechanism.parameter_units(leg)[place] == "rad" else "length"


class _Trials:
    """All scales and shares: the evidence of each, and the estimate under it."""

    def __init__(self, shares: Array, correlations: Array, prior: Array) -> None:
        self.shares, self.correlations, self.prior = shares, correlations, prior
        self.halves: list[Array] = []
        self.values: list[Array] = []
        self.along: list[Array] = []

    @classmethod
    def of(
        cls,
        information: Array,
        scores: Array,
        kinds: NDArray[np.str_],
        alike: Array,
        names: list[str],
    ) -> _Trials:
        """Under each correlation the information is diagonal in axes that hold for all scales."""
        tried = list(itertools.product(_SHARES, repeat=len(names)))
        shares = np.array(tried).reshape(len(tried), len(names))
        own = np.eye(len(scores))
        correlations = np.array([own] * len(shares))
        for i, name in enumerate(names):
            mine = np.ix_(kinds == name, kinds == name)
            for each, share in zip(correlations, shares[:, i].tolist(), strict=True):
                each[mine] = share * alike[mine] + (1 - share) * own[mine]
        same = np.ptp(shares, axis=1) == 0 if names else np.ones(1, dtype=bool)
        prior = np.where(same, _ONE_SHARE / same.sum(), 0) + (1 - _ONE_SHARE) / len(shares)
        made = cls(shares, correlations, prior)
        for each in correlations:
            half = np.linalg.cholesky(each)
            values, vectors = np.linalg.eigh(half.T @ information @ half)
            made.halves.append(half @ vectors)
            made.values.append(np.maximum(values, 0))
            made.along.append(made.halves[-1].T @ scores)
        return made

    @property
    def weights(self) -> Array:
        """How likely each is, shape (shares, scales)."""
        grown = 1 + _SCALES[:, None] ** 2 * np.array(self.values)[:, None]
        gains = _SCALES[:, None] ** 2 / grown * np.square(self.along)[:, None]
        evidence = (gains - np.log(grown)).sum(axis=2) / 2
        evidence += np.log(self.prior)[:, None] - (np.log(_SCALES) / np.log(_USUAL)) ** 2 / 2
        found = np.exp(evidence - evidence.max())
        return np.asarray(found / found.sum())

    def estimates(self, weights: Array) -> Array:
        """The estimates of those that count, in tolerances, a row each."""
        found = []
        for i, j in np.argwhere(weights > _NOTHING).tolist():
            variance = _SCALES[j] ** 2
            found.append(
                self.halves[i] @ (variance / (1 + variance * self.values[i]) * self.along[i])
            )
        return np.array(found)
