# SPDX-License-Identifier: MIT
"""Which robots of a fleet something speaks against: a screen of all of them at once.

It says no more than that. What speaks against a robot is said by the tests that `identify` makes.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Mapping
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, SymkinError, named_legs
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.fit import FALSE_ALARMS, as_mechanism
from symkin.estimate.options import EstimateOptions
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import UNKNOWN, parameter_tolerances
from symkin.values import Array

_LARGEST_ANGLE = 1e9  # beyond it the canonical form of an angle is noise
_EXAMINED = 20  # robots: a fleet of which more are doubted has one cause, or a wrong drawing
_SHARED = 3  # robots at least have a cause that is not theirs


def suspects(nominal: Mechanism, parameters: Array, deviations: Array) -> NDArray[np.intp]:
    """Robots whose parameters may be no mechanism's, or whose deviations are unknown."""
    legs = range(len(nominal.legs))
    kinds = np.array([[role.kind for role in nominal.parameter_roles(leg)] for leg in legs])
    strange = (parameters <= 0) & (kinds == "length") | (parameters == 0) & (kinds == "gain")
    strange |= (np.abs(parameters) > _LARGEST_ANGLE) | ~np.isfinite(deviations)
    strange = strange.any(axis=(1, 2)) & np.isfinite(parameters).all(axis=(1, 2))
    return np.flatnonzero(strange)


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
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Whether chi-square or a parameter is not a sound robot's; and whether one is not shown.

    Of a robot that failed neither.
    """
    chi_square, freedom = found["chi_square"], found["degrees_of_freedom"]
    tolerances, estimated = parameter_tolerances(nominal), nominal.is_estimated
    farthest = NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / np.count_nonzero(estimated))
    with np.errstate(over="ignore"):  # of one that ran away
        changes = np.square(parameters - nominal.parameters)
        allowed = farthest**2 * (np.square(tolerances) + np.square(deviations))
    unlikely = (freedom < 1) | (chi_square > found["limit"])
    if options.loss == "none":
        unlikely |= chi_square < found["least"]
    strange = ((changes > allowed) & estimated).any(axis=(1, 2)) | unlikely.any(axis=1)
    hidden = ((deviations > UNKNOWN * tolerances) & estimated).any(axis=(1, 2))
    return np.asarray(strange), np.asarray(hidden)


class Looked(NamedTuple):
    """What looking into robots found, by their places."""

    doubts: dict[int, tuple[Doubt, ...]]
    failures: dict[int, str]  # why some failed
    drawings: dict[int, Mechanism]  # as likely causes would have them


def examined(
    nominal: Mechanism,
    options: EstimateOptions,
    robots: Mapping[int, Measurements],
    before: int = 0,
) -> Looked:
    """What speaks against robots by all tests, likely causes among them.

    Of more robots than a few, it is only said of those after them that they are doubted too; so
    many were `before` these.
    """
    looked = Looked({}, {}, {})
    doubts, failures, drawings = looked
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
            drawing = error.redrawn
        else:
            doubts[robot], drawing = found.doubts, found.redrawn
            if not found.converged:
                failures[robot] = found.failure
        if drawing is not None:
            drawings[robot] = drawing.replace(frames=nominal.frames)
    return looked


def unshown(
    nominal: Mechanism, options: EstimateOptions, robots: Mapping[int, Measurements]
) -> Looked:
    """The same of robots that hardly show a parameter, which may not matter.

    Where it matters to none of the first it does to none: that goes by where they were measured.
    """
    looked = examined(nominal, options, robots)
    first = [*looked.doubts.values()][:_EXAMINED]
    return looked if any(first) else looked._replace(doubts={})


def shared_cause(
    doubts: Mapping[int, tuple[Doubt, ...]], drawings: Mapping[int, Mechanism]
) -> tuple[Note, int] | None:
    """The cause that most of the robots have that were looked into, and whose is typical."""
    first = {robot: each[0] for robot, each in doubts.items() if each}
    looked_into = [each for each in first.values() if each.code != "not-examined"]
    causes = Counter((each.code, each.legs) for each in looked_into if each.explains)
    (cause, count), *_ = [*causes.most_common(1), (None, 0)]
    if count < max(_SHARED, len(looked_into) / 2):
        return None
    who = [
        robot for robot, each in doubts.items() if each and (each[0].code, each[0].legs) == cause
    ]
    drawn = [robot for robot in who if robot in drawings] or who[:1]
    typical = drawn[0]
    if typical in drawings:
        values = np.array([drawings[robot].parameters for robot in drawn])
        away = np.abs(values - np.median(values, axis=0)).reshape(len(drawn), -1)
        typical = drawn[int(np.argmin((away / np.maximum(away.max(axis=0), 1e-300)).sum(axis=1)))]
    said = first[typical]
    figures = {"count": count, "examined": len(looked_into), "words": said.words}
    return Note("cause-shared", said.legs, figures=figures), typical
