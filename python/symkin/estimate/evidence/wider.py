# SPDX-License-Identifier: MIT
"""Wider models of the robot, and how much better they explain the same observations."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from symkin import _core
from symkin.analysis.seen import Seen
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.frames import frame_doubt, with_frames
from symkin.estimate.evidence.residuals import HARMFUL, Help
from symkin.estimate.evidence.shown_noise import is_unusual, shown_by
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found, GoodnessOfFit, total_of
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem
from symkin.estimate.unknowns import BED
from symkin.model.core_setup import scalar_values
from symkin.values import Value, field, record

_NAMED = 3
_STEPS = 40  # of a wider model
_BOW = "1 mm"  # of a bed that nobody said to be flat: any that is used


@record
class Alternative(Value):
    """A wider model, and how much better it explains the same observations.

    Attributes
    ----------
    what : str
        "quadratic" or "eccentric" sensors, "bow" of a bed, "frames", or "held" for what is held or
        shared.
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
    if found.legs:
        return []  # where every parameter is free, the tests of the closures tell
    options = dataclasses.replace(options, noise=found.noise)
    if options.prior == "fitted":  # of both models the same, or else chi-squares do not compare
        options = dataclasses.replace(options, prior="tolerances")
    wider: list[tuple[str, EstimateOptions, EstimateOptions]] = []
    if options.sensor == "linear" and found.mechanism.curvature is None:
        wider.append(("quadratic", options, dataclasses.replace(options, sensor="quadratic")))
        if found.nominal.reading_unit == "rad":
            wider.append(("eccentric", options, dataclasses.replace(options, sensor="eccentric")))
    if Seen.of(found.measurements).probed and options.bow is None:
        assumed = {key: size for key, size in (options.assume or {}).items() if key != BED}
        free = dataclasses.replace(options, bow=_BOW, assume=assumed)
        wider.append(("bow", options, free))
    if options.free is not None or options.fixed or options.shared or options.tie:
        wider.append(("held", options, all_free(options)))
    # Without priors, end points that are free follow any frame.
    held = dataclasses.replace(
        options, prior=options.prior or "tolerances", gauge="prior", noise=found.noise
    )
    framed = with_frames(found.nominal, found.measurements, held)
    if framed is not None:
        wider.append(("frames", held, framed))
    solved: list[tuple[EstimateOptions, _Solved]] = []
    if not found.noise_is_estimated and not found.options.sessions:
        known = _Solved(found.converged, total_of(found.goodness), found.aside, len(found.names))
        solved.append((dataclasses.replace(found.options, noise=found.noise), known))
    made = []
    for what, narrow, wide in wider:
        other = _compared(found, solved, what, narrow, wide)
        if other is not None:
            made.append(_unless_of_noise(found, solved, other, narrow) if other.alarms else other)
    return made


def _unless_of_noise(
    found: Found,
    before: list[tuple[EstimateOptions, _Solved]],
    alarm: Alternative,
    narrow: EstimateOptions,
) -> Alternative:
    """An alarm by the noise that each kind shows too, where chi-square is none of the declared.

    What is redundant among many points says little of what a sensor does: F over all that is left
    of both says too much where the noise of one is not as declared. It is as the wider model shows
    it: in that of the narrow one is what this lacks.
    """
    shown = shown_by(found, alarm.options) if is_unusual(found) else None
    if shown is None:
        return alarm
    both = (dataclasses.replace(each, noise=shown.noise) for each in (narrow, alarm.options))
    again = _compared(found, before, alarm.what, *both)
    if again is None or again.alarms:
        return alarm
    return dataclasses.replace(again, options=alarm.options)


class _Solved(NamedTuple):
    """A fit of one of two models."""

    converged: bool
    goodness: GoodnessOfFit
    aside: tuple[int, ...]
    columns: int

    @classmethod
    def of(cls, found: Found, options: EstimateOptions) -> _Solved:
        problem, fit, _ = Problem.of(found.nominal, found.measurements, options).resolved()
        count = len(problem.layout.names)
        return cls(fit.converged, GoodnessOfFit.of(fit.goodness), tuple(fit.aside), count)


def _compared(
    found: Found,
    before: list[tuple[EstimateOptions, _Solved]],
    what: str,
    narrow: EstimateOptions,
    wide: EstimateOptions,
) -> Alternative | None:
    """Two models, of which the narrow one may have been solved `before`."""
    known = next((each for options, each in before if options == narrow), None)
    try:
        if known is None:
            known = _Solved.of(found, narrow)
            before.append((narrow, known))
        if not known.converged:
            return None
        # What explains more comes to its end soon.
        steps = min(wide.max_iterations, _STEPS)
        wider = _Solved.of(found, dataclasses.replace(wide, max_iterations=steps))
    except SymkinError:
        return None
    if not wider.converged or known.aside != wider.aside:
        return None
    less, more = known.goodness, wider.goodness
    terms = round(less.degrees_of_freedom - more.degrees_of_freedom)
    if terms <= 0:  # priors came with them; held exactly, they gain no more than without priors
        terms = wider.columns - known.columns
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
    return dataclasses.replace(options, free=None, fixed=fixed, shared=(), tie=())


def doubts_of_models(
    found: Found, alternatives: Sequence[Alternative], help_in_words: Help
) -> Iterator[Doubt]:
    """Say which wider model explains best what is not explained."""
    alarming = [each for each in alternatives if each.alarms]
    if alarming:
        # Each of these explains a part of what is due to another.
        best = min(alarming, key=lambda each: (each.p_value, -each.statistic))
        yield _doubt_of(found, best, help_in_words)


def _doubt_of(found: Found, other: Alternative, help_in_words: Help) -> Doubt:
    evidence = f"F({other.terms}, {other.spare}) = {other.statistic:.3g}"
    figures = {"evidence": f" ({evidence})"}
    if other.what in ("frames", "held", "bow"):
        problem, fit, _ = Problem.of(found.nominal, found.measurements, other.options).resolved()
    if other.what == "frames":
        asked = found.nominal.space, fit.setup, found.options, other.options
        return frame_doubt(*asked, figures["evidence"], other.p_value)
    if other.what == "bow":
        bow = float(fit.setup.plane[3])
        figures["amount"] = f"{1e3 * bow:+.2g} mm"
        return Doubt("bed-bowed", size=bow, p=other.p_value, figures=figures, options={"bow": _BOW})
    helps = help_in_words(other.what)
    figures["help"] = helps or ""
    if other.what == "held":
        moved = _most_moved(found, problem, fit)
        figures["evidence"] = f" ({evidence} if all are free, which moves {moved})"
        return Doubt("held-is-wrong", p=other.p_value, figures=figures)
    code = {"quadratic": "sensor-curved", "eccentric": "sensor-eccentric"}[other.what]
    figures |= {"whose": "all legs", "amount": ""}
    every, options = tuple(range(len(found.nominal.legs))), {"sensor": other.what}
    if helps is None:
        figures["evidence"] += HARMFUL
        options = {}
    return Doubt(code, every, p=other.p_value, figures=figures, options=options)


def contradiction_of(found: Found) -> str:
    """Why an estimate did not converge that would if nothing was held; empty if that is not why."""
    options = found.options
    if options.free is None and not options.fixed and not options.shared and not options.tie:
        return ""
    wide = dataclasses.replace(
        all_free(options), prior="tolerances", gauge="prior", noise=found.noise
    )
    try:
        problem, fit, _ = Problem.of(found.nominal, found.measurements, wide).resolved()
    except SymkinError:
        return ""
    if not fit.converged or fit.goodness.chi_square > fit.goodness.limit:
        return ""
    if not found.unexplained:
        return (
            "the observations hardly show what is free; with everything free within the "
            "tolerances (--prior tolerances) it converges"
        )
    return (
        "what is held or shared contradicts the observations: with everything free within the "
        f"tolerances it converges, to chi-square {fit.goodness.chi_square:.3g} "
        f"instead of {found.chi_square:.3g}, and moves {_most_moved(found, problem, fit)}"
    )


def _most_moved(found: Found, problem: Problem, fit: _core.JointFit) -> str:
    """What of the held or shared moves most where it is free."""
    held = {each.name for each in found.unknowns if each.status.partition(",")[0] != "free"}
    layout = problem.layout
    free = (layout.column >= 0) & (layout.tolerances > 0)
    moves = np.abs(scalar_values(fit.setup) - scalar_values(problem.setup))[free]
    names = np.array(layout.scalars)[free]
    moved = sorted(zip(moves / layout.tolerances[free], names, strict=True), reverse=True)
    named = [f"{name} ({by:.2g} tolerances)" for by, name in moved if name in held]
    return ", ".join(named[:_NAMED])
