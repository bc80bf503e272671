# SPDX-License-Identifier: MIT
"""Which robots of a fleet something speaks against: a screen of all of them at once.

It says no more than that. What speaks against a robot is said by the tests that `identify` makes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, SymkinError, named_legs
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.fit import FALSE_ALARMS, as_mechanism
from symkin.estimate.options import EstimateOptions
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import UNKNOWN, parameter_tolerances
from symkin.values import Array

_LARGEST_ANGLE = 1e9  # beyond it the canonical form of an angle is noise
_EXAMINED = 20  # robots: a fleet of which more are doubted has one cause, or a wrong drawing


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


def doubted(
    nominal: Mechanism,
    options: EstimateOptions,
    parameters: Array,
    deviations: Array,
    found: Mapping[str, Array],
) -> NDArray[np.bool_]:
    """Whether chi-square or a parameter is not a sound robot's; of one that failed, False."""
    chi_square, freedom = found["chi_square"], found["degrees_of_freedom"]
    identified = nominal.is_estimated
    tolerances, deviations = parameter_tolerances(nominal)[identified], deviations[:, identified]
    changes = (parameters - nominal.parameters)[:, identified]
    distances = np.abs(changes) / np.hypot(tolerances, deviations)
    farthest = NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / tolerances.size)
    strange = (
        (freedom < 1) | (chi_square > found["limit"]),
        (chi_square < found["least"]) & (options.loss == "none"),
        (deviations > UNKNOWN * tolerances) | (distances > farthest),
    )
    return np.asarray(np.concatenate(strange, axis=1).any(axis=1))


def examined(
    nominal: Mechanism,
    options: EstimateOptions,
    robots: Mapping[int, Measurements],
    before: int = 0,
) -> tuple[dict[int, tuple[Doubt, ...]], dict[int, str]]:
    """What speaks against robots by all tests, likely causes among them; and why some failed.

    Of more robots than a few, it is only said of those after them that they are doubted too; so
    many were `before` these.
    """
    doubts: dict[int, tuple[Doubt, ...]] = {}
    failures: dict[int, str] = {}
    for number, (robot, measured) in enumerate(robots.items(), before):
        if number >= _EXAMINED:
            doubts[robot] = (Doubt("not-examined", figures={"examined": _EXAMINED}),)
            continue
        own = dataclasses.replace(measured, poses=unframed(nominal, measured.poses))
        try:
            found = Estimate.of(nominal.replace(frames=None), own, options, legs=True)
        except SymkinError as error:
            failures[robot] = str(error)
            cause = error.likely_cause
            doubts[robot] = () if cause is None else (cause,)
            continue
        doubts[robot] = found.doubts
        if not found.converged:
            failures[robot] = found.failure
    return doubts, failures
