# SPDX-License-Identifier: MIT
"""By how much the robots of a workshop really deviate from their drawing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from symkin import _core
from symkin.analysis.promises import NORMAL_95
from symkin.errors import SymkinError
from symkin.estimate.found import Found
from symkin.values import Array, Value, record

_SEEN = 0.7  # standard deviation of a factor's logarithm, beyond which the fleet does not show it
_LEAST = 1e-9  # eigenvalue of a covariance in tolerances that is inverted
_KINDS = {"m": "lengths", "rad": "angles"}


@record
class MadeWithin(Value):
    """How a kind of parameter is made, over the tolerance that the drawing's file has for it.

    Attributes
    ----------
    what : str
        Such as ``base_radius``, or all ``lengths``, ``angles`` or ``numbers``.
    factor : float
        On the tolerance, most likely.
    low, high : float
        Its 95% interval; 0 and infinity if the fleet does not show it.
    """

    what: str
    factor: float
    low: float
    high: float

    @property
    def is_seen(self) -> bool:
        """Whether the fleet shows it."""
        return math.isfinite(self.high)


class Share(NamedTuple):
    """What a robot says of the tolerances: names and kinds of parameters, information, scores."""

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    information: Array
    scores: Array


def workshop_tolerances(robots: Iterable[Found]) -> tuple[MadeWithin, ...]:
    """Estimate the tolerances that robots of one drawing were made within.

    First of all lengths, angles and numbers, then of each parameter by its name, each with the
    others of its list unknown too. Maximum likelihood from what the observations alone say of each
    robot, in tolerances; whether these were priors does not matter.

    Raises
    ------
    SymkinError
        For no robot, or robots of which other parameters were estimated.
    """
    return tolerances_of([share_of(each) for each in robots if each.converged])


def tolerances_of(told: Sequence[Share]) -> tuple[MadeWithin, ...]:
    """Return what `workshop_tolerances` does, from what the robots say."""
    if not told:
        raise SymkinError("no robot was identified, so that nothing says how they are made")
    names, kinds = told[0].names, told[0].kinds
    if any(each.names != names for each in told):
        raise SymkinError("other parameters were estimated of some robots than of others")
    information = np.concatenate([each.information for each in told])
    scores = np.array([each.scores for each in told])
    found: list[MadeWithin] = []
    for groups in (kinds, tuple(name.partition(".")[2] for name in names)):
        labels = list(dict.fromkeys(groups))
        numbers = [labels.index(each) for each in groups]
        estimate = _core.fleet_tolerances(information, scores, numbers)
        for label, factor, deviation in zip(
            labels, estimate.factors, estimate.log_deviations, strict=True
        ):
            found.append(_made_within(label, float(factor), float(deviation)))
    return tuple(found)


def _made_within(what: str, factor: float, deviation: float) -> MadeWithin:
    if not deviation <= _SEEN:
        return MadeWithin(what, factor, 0.0, math.inf)
    reach = math.exp(NORMAL_95 * deviation)
    return MadeWithin(what, factor, factor / reach, factor * reach)


def share_of(found: Found) -> Share:
    """What the observations alone say of a robot: of the legs' parameters with a tolerance."""
    own = [
        column
        for column, each in enumerate(found.first_unknowns)
        if each.name.startswith("leg") and each.tolerance > 0
    ]
    unknowns = [found.first_unknowns[column] for column in own]
    tolerances = np.array([each.tolerance for each in unknowns])
    moved = np.array([each.value - each.nominal for each in unknowns]) / tolerances
    covariance = found.model_covariance[np.ix_(own, own)] / np.outer(tolerances, tolerances)
    values, vectors = np.linalg.eigh(covariance)
    inverse = vectors / np.maximum(values, _LEAST) @ vectors.T
    priors = found.prior_rows[:, own] * tolerances
    shown, directions = np.linalg.eigh(inverse - priors.T @ priors)
    return Share(
        tuple(each.name for each in unknowns),
        tuple(_KINDS.get(each.unit, "numbers") for each in unknowns),
        directions * np.maximum(shown, 0) @ directions.T,
        inverse @ moved,
    )
