# SPDX-License-Identifier: MIT
"""What speaks against the estimates of a fleet, all robots at once."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from symkin.errors import FailedFitError, named_legs
from symkin.estimate.fit import FALSE_ALARMS, UNKNOWN, as_mechanism
from symkin.estimate.options import EstimateOptions
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import parameter_tolerances

__all__ = ["doubts_of", "impossible", "suspects"]

Array = NDArray[np.float64]

_LARGEST_ANGLE = 1e9  # beyond it the canonical form of an angle is noise


def suspects(nominal: Mechanism, parameters: Array, deviations: Array) -> NDArray[np.intp]:
    """Robots whose parameters may be no mechanism's, or whose deviations are unknown."""
    legs = range(len(nominal.legs))
    kinds = np.array([[role.kind for role in nominal.parameter_roles(leg)] for leg in legs])
    sized = np.isfinite(parameters).all(axis=(1, 2))
    strange = (parameters[:, kinds == "length"] <= 0).any(axis=1)
    strange |= (np.abs(parameters) > _LARGEST_ANGLE).any(axis=(1, 2))
    strange |= (parameters[:, kinds == "gain"] == 0).any(axis=1)
    return np.flatnonzero(sized & (strange | ~np.isfinite(deviations).all(axis=(1, 2))))


def impossible(nominal: Mechanism, parameters: Array, deviations: Array) -> str:
    """Why an estimate is none, or empty."""
    try:
        as_mechanism(nominal, parameters, deviations)
    except FailedFitError as error:
        return str(error)
    if not np.isfinite(deviations).all():
        legs = sorted({int(leg) for leg in np.argwhere(~np.isfinite(deviations))[:, 0]})
        return f"the measurements do not determine all parameters of {named_legs(legs)}"
    return ""


def doubts_of(
    nominal: Mechanism,
    options: EstimateOptions,
    parameters: Array,
    deviations: Array,
    found: Mapping[str, Array],
) -> list[str]:
    """What speaks against each robot's estimate: a sentence, or nothing."""
    chi_square, freedom = found["chi_square"], found["degrees_of_freedom"]
    identified = nominal.is_estimated
    tolerances, deviations = parameter_tolerances(nominal)[identified], deviations[:, identified]
    changes = (parameters - nominal.parameters)[:, identified]
    distances = np.abs(changes) / np.hypot(tolerances, deviations)
    farthest = NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / tolerances.size)
    with np.errstate(invalid="ignore"):
        times = np.sqrt(chi_square / freedom)
    causes = {
        "no pose to spare, so the noise cannot be checked": freedom < 1,
        "residuals are {:.2g} times what the declared noise explains": (
            chi_square > found["limit"]
        ),
        "residuals are {:.2g} times what the declared noise makes: it is too large, or the "
        "measurements were smoothed or computed": (
            (chi_square < found["least"]) & (options.loss == "none")
        ),
        "the measurements say nothing of some parameters: their standard deviations are more than "
        f"{UNKNOWN} times the tolerance": deviations > UNKNOWN * tolerances,
        "parameters are further from the drawing than is plausible, by up to {:.3g} times what "
        "tolerance and noise allow": distances > farthest,
    }
    sizes = (freedom, times, times, deviations, distances)
    doubts: list[list[str]] = [[] for _ in parameters]
    for (cause, alarms), size in zip(causes.items(), sizes, strict=True):
        for robot in np.flatnonzero(alarms.reshape(len(doubts), -1).any(axis=1)):
            doubts[robot].append(cause.format(float(np.max(size[robot][alarms[robot]]))))
    return ["; ".join(each) for each in doubts]
