# SPDX-License-Identifier: MIT
"""What else explains the observations, and how well it does at poses that it did not see."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.cross_validation import cross_validation_of
from symkin.estimate.evidence.frames import with_frames
from symkin.estimate.evidence.wider import Alternative
from symkin.estimate.found import Found
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem
from symkin.model.mechanism import Mechanism
from symkin.values import Value, field, record

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
    degrees_of_freedom : int or float
        Its degrees of freedom.
    unseen_rms : float
        Closures of the legs at full poses that the fit did not see, in 5 parts, root mean square,
        m; NaN without full poses.
    """

    what: str
    unknowns: int
    chi_square: float
    degrees_of_freedom: float
    unseen_rms: float = field(unit="m")


Fitting = Callable[[str], Model | None]  # one of the models, by its name


def models_of(found: Found, alternatives: Sequence[Alternative], model: Fitting) -> Iterator[Model]:
    """Fit models besides the one that was asked for to the same observations."""
    identified = model("identified")
    assert identified is not None
    yield identified
    if found.spread > 1:
        yield dataclasses.replace(
            identified,
            what="noise",
            unknowns=identified.unknowns + 1,
            chi_square=float(found.degrees_of_freedom),
        )
    wider = [model(each.what) for each in alternatives]
    yield from (each for each in (*wider, model("frames alone")) if each is not None)


def model_of(found: Found, alternatives: Sequence[Alternative], what: str) -> Model | None:
    """Fit what was identified, one of its alternatives, or "frames alone"; None without a fit."""
    if what == "identified":
        goodness = found.chi_square, found.degrees_of_freedom
        return Model(
            what,
            len(found.names),
            *goodness,
            _unseen_rms(found.nominal, found.measurements, found.options),
        )
    options = {each.what: each.options for each in alternatives}.get(what)
    if what == "frames alone":
        framed = with_frames(found.nominal, found.measurements, found.options)
        options = framed and dataclasses.replace(
            framed, free=framed.frames, shared=(), tie=(), prior=None, noise=found.noise
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
    return Model(
        what,
        len(problem.layout.names),
        *goodness,
        _unseen_rms(found.nominal, found.measurements, options),
    )


def _unseen_rms(nominal: Mechanism, measurements: Measurements, options: EstimateOptions) -> float:
    """How a model does at full poses that it did not see: closures of the legs, m; NaN without."""
    try:
        validation = cross_validation_of(
            nominal, measurements, _FOLDS, nominal.protocol.seed, options
        )
    except SymkinError:
        return math.nan
    return validation.residual_rms


def help_of(found: Found, model: Fitting) -> Callable[[str], str | None]:
    """By how much a wider model helps at poses that the fit did not see, in words; maybe empty.

    None if it does harm there.
    """

    @cache
    def unseen(what: str) -> float:
        if not found.legs:
            fitted = model(what)
            return fitted.unseen_rms if fitted else math.nan
        sensor: Any = "linear" if what == "identified" else what
        options = EstimateOptions(poses=found.options.poses, noise=found.noise, sensor=sensor)
        return _unseen_rms(found.nominal, found.measurements, options)

    def words(what: str) -> str | None:
        before, after = unseen("identified"), unseen(what)
        if not math.isfinite(before + after):
            return ""
        if after > before:
            return None
        return (
            f", which brings the closures at unseen poses from {1e3 * before:.3g} to "
            f"{1e3 * after:.3g} m{found.nominal.space.closure_unit}"
        )

    return words
