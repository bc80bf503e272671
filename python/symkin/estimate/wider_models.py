# SPDX-License-Identifier: MIT
"""Wider models of the robot, and how much better they explain the same observations."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.corrections import with_frames
from symkin.estimate.cross_validation import cross_validation_of
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem
from symkin.model.mechanism import Mechanism
from symkin.values import Value, field, record

__all__ = [
    "Alternative",
    "Fitting",
    "Model",
    "alternatives_of",
    "help_in_words",
    "model_of",
    "models_of",
    "unseen_rms",
]


_FOLDS = 5


@record
class Alternative(Value):
    """A wider model, and how much better it explains the same observations.

    Attributes
    ----------
    what : str
        "quadratic" or "eccentric" sensors, "frames", or "held" for what is held or shared.
    statistic : float
        F of what it explains besides, over what it leaves.
    terms, spare : int
        Degrees of freedom of F.
    p_value : float
        Of so large an F if the model was wide enough.
    limit : float
        Probability below which it is an alarm.
    options : EstimateOptions
        With which it is identified.
    """

    what: str
    statistic: float
    terms: int
    spare: int
    p_value: float
    limit: float
    options: EstimateOptions = field(private=True)

    @property
    def alarms(self) -> bool:
        """Whether the narrower model lacks what this one has."""
        return self.p_value < self.limit


def alternatives_of(found: Found) -> list[Alternative]:
    """Fit wider models to the same observations: curved sensors, frames of their own.

    None without degrees of freedom to tell them apart.
    """
    options = found.options
    if not found.converged or found.degrees_of_freedom <= 0 or options.loss != "none":
        return []
    options = dataclasses.replace(options, noise=found.noise)
    wider: list[tuple[str, EstimateOptions, EstimateOptions]] = []
    if options.sensor == "linear" and found.mechanism.curvature is None:
        wider.append(("quadratic", options, dataclasses.replace(options, sensor="quadratic")))
        if found.nominal.reading_unit == "rad":
            wider.append(("eccentric", options, dataclasses.replace(options, sensor="eccentric")))
    if options.free is not None or options.fixed or options.shared:
        wider.append(("held", options, all_free(options)))
    # Without priors, end points that are free follow any frame.
    held = dataclasses.replace(
        options, prior=options.prior or "tolerances", gauge="prior", noise=found.noise
    )
    framed = with_frames(found.nominal, found.measurements, held)
    if framed is not None:
        wider.append(("frames", held, framed))
    made = (_compared(found, *each) for each in wider)
    return [each for each in made if each is not None]


def _compared(
    found: Found, what: str, narrow: EstimateOptions, wide: EstimateOptions
) -> Alternative | None:
    try:
        solved = [
            Problem.of(found.nominal, found.measurements, each).resolved()
            for each in (narrow, wide)
        ]
    except SymkinError:
        return None
    fits = [fit for _, fit, _ in solved]
    if not all(fit.converged for fit in fits) or fits[0].aside != fits[1].aside:
        return None
    less, more = (fit.goodness for fit in fits)
    terms = round(less.degrees_of_freedom - more.degrees_of_freedom)
    if terms <= 0:  # priors came with them; held exactly, they gain no more than without priors
        terms = len(solved[1][0].layout.names) - len(solved[0][0].layout.names)
    spare = round(more.degrees_of_freedom)
    if terms <= 0 or spare <= 0 or more.chi_square <= 0:
        return None
    gain = max(less.chi_square - more.chi_square, 0.0)
    statistic = gain / terms / (more.chi_square / spare)
    return Alternative(
        what=what,
        statistic=statistic,
        terms=terms,
        spare=spare,
        p_value=_core.f_tail(statistic, terms, spare),
        limit=FALSE_ALARMS / 3,
        options=wide,
    )


def all_free(options: EstimateOptions) -> EstimateOptions:
    """The same with nothing held or shared but parts of frames."""
    fixed = tuple(each for each in options.fixed if each.partition(".")[0] in ("base", "target"))
    return dataclasses.replace(options, free=None, fixed=fixed, shared=())


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
            unseen_rms(found.nominal, found.measurements, found.options),
        )
    options = {each.what: each.options for each in alternatives}.get(what)
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
    return Model(
        what,
        len(problem.layout.names),
        *goodness,
        unseen_rms(found.nominal, found.measurements, options),
    )


def unseen_rms(nominal: Mechanism, measurements: Measurements, options: EstimateOptions) -> float:
    """How a model does at full poses that it did not see: closures of the legs, m; NaN without."""
    try:
        validation = cross_validation_of(
            nominal, measurements, _FOLDS, nominal.protocol.seed, options
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
