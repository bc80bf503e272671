# SPDX-License-Identifier: MIT
"""What explains the residuals of a joint estimate: noise, sensors, frames or geometry."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from symkin.errors import SymkinError
from symkin.identification.hypotheses import with_frames
from symkin.identification.problem import JointOptions, Problem
from symkin.result import Value, field, record

if TYPE_CHECKING:
    from symkin.identification.fit import Fit
    from symkin.identification.joint import JointIdentification

__all__ = ["Model", "help_in_words", "model_of", "models_of", "unseen_rms"]

_FOLDS = 5


@record
class Model(Value):
    """A model of the robot, its sensors and its surroundings, and what it leaves.

    Attributes
    ----------
    what : str
        "identified", "noise" (as large as the residuals ask for), "quadratic" or "eccentric"
        sensors, "held" for what is held or shared, "frames" besides the geometry within its
        tolerances, or "frames alone" with the geometry as drawn.
    unknowns : int
        How many are estimated.
    chi_square : float
        Of observations and priors, by the declared noise but for "noise".
    degrees_of_freedom : int
        Its degrees of freedom.
    unseen_rms : float
        Closures of the legs at full poses that the fit did not see, in 5 parts, root mean square,
        m; NaN without full poses.
    """

    what: str
    unknowns: int
    chi_square: float
    degrees_of_freedom: int
    unseen_rms: float = field(unit="m")


def models_of(found: JointIdentification) -> Iterator[Model]:
    """Fit models besides the one that was asked for to the same observations."""
    identified = found.model("identified")
    assert identified is not None
    yield identified
    if found.spread > 1:
        yield dataclasses.replace(
            identified,
            what="noise",
            unknowns=identified.unknowns + 1,
            chi_square=float(found.degrees_of_freedom),
        )
    wider = [found.model(each.what) for each in found.alternatives]
    yield from (each for each in (*wider, found.model("frames alone")) if each is not None)


def model_of(found: JointIdentification, what: str) -> Model | None:
    """Fit what was identified, one of its alternatives, or "frames alone"; None without a fit."""
    if what == "identified":
        goodness = found.chi_square, found.degrees_of_freedom
        return Model(what, len(found.names), *goodness, unseen_rms(found, found.options))
    options = {each.what: each.options for each in found.alternatives}.get(what)
    if what == "frames alone":
        framed = with_frames(found.nominal, found.measurements, found.options)
        options = framed and dataclasses.replace(
            framed, free=framed.frames, shared=(), prior=None, noise=found.noise
        )
    if options is None:
        return None
    try:
        problem, fit, _ = Problem.of(found.nominal, found.measurements, options).resolved()
    except SymkinError:
        return None
    if not fit.converged:
        return None
    goodness = fit.goodness.chi_square, fit.goodness.degrees_of_freedom
    return Model(what, len(problem.layout.names), *goodness, unseen_rms(found, options))


def unseen_rms(found: Fit | JointIdentification, options: JointOptions) -> float:
    """How a model does at full poses that it did not see: closures of the legs, m; NaN without."""
    from symkin.identification.estimate import joint_cross_validation

    seed = found.nominal.protocol.seed
    try:
        validation = joint_cross_validation(
            found.nominal, found.measurements, _FOLDS, seed, options
        )
    except SymkinError:
        return math.nan
    return validation.residual_rms


def help_in_words(before: float, after: float, closure_unit: str) -> str:
    """By how much a model helps at poses that the fit did not see; empty where nobody knows."""
    if not math.isfinite(before + after):
        return ""
    return (
        f", which brings the closures at unseen poses from {1e3 * before:.3g} to "
        f"{1e3 * after:.3g} m{closure_unit}"
    )
