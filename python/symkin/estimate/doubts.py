# SPDX-License-Identifier: MIT
"""What speaks against an estimate from observations of any kind, and what would explain them."""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Iterator, Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.corrections import Hypothesis, cause_in_words, frame_in_words, with_readings
from symkin.estimate.diagnosis import Outlier
from symkin.estimate.fit import FALSE_ALARMS, UNKNOWN, unguarded_note
from symkin.estimate.found import Found
from symkin.estimate.precision import Heights
from symkin.estimate.problem import KINDS, Problem, Rows, observed_count
from symkin.estimate.reading_checks import Taken, lost_turns, other_modes
from symkin.estimate.solution import settled
from symkin.estimate.wider_models import Alternative, Fitting, all_free, help_in_words
from symkin.model.core_setup import scalar_values
from symkin.model.symmetry.groups import detect_symmetry

__all__ = [
    "blunder_limit",
    "blunders_of",
    "contradiction_of",
    "doubts_of",
    "notes_of",
    "outliers_of",
    "symptoms_of",
    "unexplained_rows",
]

Array = NDArray[np.float64]

_NAMED = 3
_ALIKE = 1 - 1e-6  # of t: observations of a pose that nothing tells apart
_AS_GOOD = 9.0  # more of chi-square: an order of the legs that cannot be told from another
_TURNS = ("base.phi", "base.rz")


class Blunder(NamedTuple):
    """An observation that does not fit: which of the rows, and how far."""

    row: int
    t: float
    size: float


def doubts_of(
    found: Found, symptoms: Sequence[str], hypotheses: Sequence[Hypothesis]
) -> Iterator[str]:
    """Say why not to trust an estimate, the worst first."""
    cause = cause_in_words(hypotheses)
    # What a mistake does to the estimate is not worth telling beside the mistake.
    yield from [cause] if cause else symptoms
    for leg in np.flatnonzero(np.isnan(found.measurements.readings).all(axis=0)).tolist():
        if any(name.startswith(f"leg{leg + 1}.") for name in found.names):
            yield f"leg {leg + 1} has no reading: its parameters stay where the priors have them"


def symptoms_of(found: Found, alternatives: Sequence[Alternative], model: Fitting) -> Iterator[str]:
    """Say what speaks against an estimate, whatever the cause, the worst first."""
    numbers = found.measurements.row_numbers
    aside = unexplained_rows(found)
    if aside:
        shown = ", ".join(str(numbers[row]) for row in aside[:8])
        more = f" and {len(aside) - 8} more" if len(aside) > 8 else ""
        yield (
            f"no pose explains row{'s' * (len(aside) > 1)} {shown}{more}, which "
            f"{'is' if len(aside) == 1 else 'are'} left out"
        )
    yield from _turns(found)
    yield from _blunders_in_words(found)
    alarming = [each for each in alternatives if each.alarms]
    alarming.sort(key=lambda each: (each.p_value, -each.statistic))
    for kind in (("frames",), ("quadratic", "eccentric", "held")):
        # Each of these explains a part of what is due to another.
        yield from [_in_words(found, each, model) for each in alarming if each.what in kind][:1]
    if found.degrees_of_freedom <= 0:
        yield (
            "there are as many unknowns as equations, so that nothing can speak against the "
            "estimate: measure more"
        )
    elif found.options.noise == "estimate":
        pass  # chi-square is what it was made to be
    elif found.unexplained:
        yield (
            f"the residuals are {found.spread:.3g} times larger than the declared noise explains "
            f"(chi-square {found.chi_square:.4g} for {found.degrees_of_freedom:.4g} degrees of "
            f"freedom; expected at most {found.limit:.4g})"
        )
    elif found.chi_square < found.least:
        share = math.sqrt(found.chi_square / found.degrees_of_freedom)
        yield (
            f"the residuals are {share:.3g} times as large as the declared noise and the priors "
            f"lead to expect (chi-square {found.chi_square:.4g} for {found.degrees_of_freedom:.4g} "
            f"degrees of freedom; expected at least {found.least:.4g})"
        )
    yield from _far_from_the_drawing(found)
    unknown = [
        each.name
        for each in found.unknowns
        if each.shown and each.deviation > UNKNOWN * each.tolerance
    ]
    if unknown:
        yield (
            f"the observations say nothing of {_listed(unknown)}: the standard deviation is more "
            f"than {UNKNOWN} times the tolerance, so the drawing knows better"
        )


def _turns(found: Found) -> Iterator[str]:
    """Readings that are turns, or a working mode, away from the calibrated model."""
    readings = np.where(np.isfinite(found.reading_errors), found.measurements.readings, np.nan)
    numbers = found.measurements.row_numbers
    taken = Taken(found.nominal, found.mechanism, found.latent_poses, readings, numbers)
    # Where residuals are not explained, neither are the poses that tell modes apart.
    if not found.unexplained:
        yield from other_modes(taken)
    yield from lost_turns(taken)


def unexplained_rows(found: Found) -> list[int]:
    """Rows that were set aside and that the noise does not explain: what they observed is lost.

    Not those where no more was observed than a pose has coordinates, which noise alone may leave
    without any pose, nor those that hardly show a direction of the pose, in which nothing can be
    linearised.
    """
    told = observed_count(found.measurements) - found.nominal.space.dof
    problem = settled(found.mechanism, found.noise, found.measurements)
    core = problem.mechanism.straight, problem.setup, problem.observations
    limit = FALSE_ALARMS / max(len(found.conditions), 1)
    return [
        row
        for row in found.aside
        if told[row] > 0
        and _core.chi_square_tail(
            _core.left_unexplained(*core, found.latent_poses, row), int(told[row])
        )
        < limit
    ]


def notes_of(found: Found, heights: Heights | None, symptoms: Sequence[str]) -> Iterator[str]:
    """Say what to know of an estimate."""
    if found.gauge:
        yield f"{found.gauge[0].upper()}{found.gauge[1:]}: parameters and deviations depend on it."
    silent = [each.name for each in found.unknowns if each.status.startswith("held by its prior")]
    if heights is not None:
        yield from heights.notes
    elif silent:
        yield (
            f"The data say next to nothing of {_listed(silent)}: what stands there is the prior."
        )
    yield from unguarded_note(found.measurements, found.unguarded)
    if found.options.noise == "estimate":
        yield (
            "The noise was estimated from the same observations, so that chi-square says nothing "
            "of the model."
        )
    orders = [
        ", ".join(str(leg + 1) for leg in order)
        for order in _exchanges(found, heights is not None, symptoms)
    ]
    if orders:
        yield (
            "The observations do not show which leg is which: with the readings of the legs in the "
            f"order {' or '.join(orders)} the estimate is as good. See by hand that every column "
            "is of the leg that it names."
        )
    if found.mechanism.curvature is not None:
        yield (
            "The calibrated sensors are curved: kinematics and errors at measured poses use them; "
            "plans, simulations and identification leg by leg refuse them."
        )
    if found.rejected:
        shown = ", ".join(
            f"{what} in row {found.measurements.row_numbers[row]}"
            for row, what in found.rejected[:5]
        )
        more = f" and {len(found.rejected) - 5} more" if len(found.rejected) > 5 else ""
        yield f"Left out as blunders: {shown}{more}."


def _exchanges(found: Found, probed: bool, symptoms: Sequence[str]) -> Iterator[tuple[int, ...]]:
    """Give other orders of the readings' columns that explain the observations as well.

    Such are symmetries of the drawing where nothing shows how the robot is turned: a place of its
    base that is unknown, or heights alone. One rotation and one mirror are tried for all.
    """
    turns = probed or any(name in _TURNS for name in found.names)
    if not turns or not found.converged or symptoms:
        return
    orders = detect_symmetry(found.nominal).permutations
    for label in ("r1", "s0"):
        order = orders.get(label, ())
        if order == tuple(sorted(order)):
            continue
        exchanged = with_readings(found.measurements, operator.itemgetter((slice(None), order)))
        try:
            _, fit, _ = Problem.of(found.nominal, exchanged, found.options).resolved()
        except SymkinError:
            continue
        if fit.converged and fit.goodness.chi_square < found.chi_square + _AS_GOOD:
            yield order


def blunder_limit(found: Found) -> float:
    """Beyond which t any observation of a robot lies once in 1000 sound robots.

    Where all residuals are too large, one that is as large as the others is no blunder.
    """
    known = max(int(np.isfinite(found.rows.t).sum()), 1)
    return found.spread * NormalDist().inv_cdf(1 - FALSE_ALARMS / 2 / known)


def blunders_of(found: Found) -> list[Blunder]:
    """Observations that do not fit, the worst first; of a pose only the worst."""
    rows = found.rows
    t = np.nan_to_num(rows.t)
    limit = blunder_limit(found)
    worst: dict[int, Blunder] = {}
    for row in np.argsort(-np.abs(t)).tolist():
        if abs(t[row]) <= limit:
            break
        found_blunder = Blunder(row, float(t[row]), float(rows.blunder[row]))
        worst.setdefault(int(rows.pose[row]), found_blunder)
    return list(worst.values())


def contradiction_of(found: Found) -> str:
    """Why an estimate did not converge that would if nothing was held; empty if that is not why."""
    options = found.options
    if options.free is None and not options.fixed and not options.shared:
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


def _in_words(found: Found, other: Alternative, model: Fitting) -> str:
    evidence = f"F({other.terms}, {other.spare}) = {other.statistic:.3g}"
    if other.what == "frames":
        fit = Problem.of(found.nominal, found.measurements, other.options).resolved()[1]
        space, why = found.nominal.space, f" ({evidence})"
        return frame_in_words(space, fit.setup.base, found.options, other.options, why)
    if other.what == "held":
        problem, fit, _ = Problem.of(found.nominal, found.measurements, other.options).resolved()
        moved = _most_moved(found, problem, fit)
        return (
            f"parameters that are held or shared are not as they are said to be ({evidence} if "
            f"all are free, which moves {moved}); free them{_help(found, other, model)}"
        )
    shape = {"quadratic": "bend", "eccentric": "err once a turn"}[other.what]
    return (
        f"the sensors are not straight, they {shape} ({evidence}); identify with "
        f"--sensor {other.what}{_help(found, other, model)}"
    )


def _help(found: Found, other: Alternative, model: Fitting) -> str:
    models = model("identified"), model(other.what)
    before, after = (each.unseen_rms if each else math.nan for each in models)
    return help_in_words(before, after, found.nominal.space.closure_unit)


def outliers_of(found: Found) -> Iterator[Outlier]:
    """Give the observations that do not fit, the worst first."""
    rows, numbers, space = found.rows, found.measurements.row_numbers, found.nominal.pose_space
    for each in blunders_of(found):
        row = int(rows.pose[each.row])
        yield Outlier(
            row=row,
            row_number=int(numbers[row]),
            what=rows.what(each.row, space),
            leg=int(rows.index[each.row]) if KINDS[rows.kind[each.row]] == "readings" else None,
            student=each.t,
            p_value=2 * NormalDist().cdf(-abs(each.t) / found.spread),
        )


def _blunders_in_words(found: Found) -> Iterator[str]:
    blunders = blunders_of(found)
    if not blunders:
        return
    space, unit = found.nominal.pose_space, found.nominal.reading_unit
    named = "; ".join(
        f"row {found.measurements.row_numbers[found.rows.pose[each.row]]}, "
        f"{found.rows.what(each.row, space)}: off by {each.size:+.3g} "
        f"{found.rows.unit(each.row, space, unit)} ({abs(each.t):.3g} deviations"
        f"{_or_another(found.rows, each)})"
        for each in blunders[:_NAMED]
    )
    more = f" and {len(blunders) - _NAMED} more" if len(blunders) > _NAMED else ""
    yield f"single observations do not fit: {named}{more}"


def _or_another(rows: Rows, blunder: Blunder) -> str:
    """Whether another observation of the pose may be to blame: with one condition any may be."""
    same = (rows.pose == rows.pose[blunder.row]) & (np.abs(rows.t) > _ALIKE * abs(blunder.t))
    return ", or as well another observation of that row" if same.sum() > 1 else ""


def _far_from_the_drawing(found: Found) -> Iterator[str]:
    """Parameters without a prior that moved further than tolerance and noise allow."""
    moved = [
        (abs(each.value - each.nominal) / math.hypot(each.tolerance, each.deviation), each)
        for each in found.unknowns
        if each.shown and math.isfinite(each.tolerance) and math.isnan(each.prior)
        and not each.name.rpartition(".")[2].startswith(("sensor_quad", "sensor_cos", "sensor_sin"))
    ]  # fmt: skip
    if not moved:
        return
    limit = NormalDist().inv_cdf(1 - FALSE_ALARMS / 2 / len(moved))
    far = sorted((each for each in moved if each[0] > limit), key=lambda each: -each[0])
    if far:
        named = ", ".join(
            f"{each.name} by {each.value - each.nominal:+.3g} {each.unit}".rstrip()
            + f" ({distance:.3g} times what tolerance and noise allow)"
            for distance, each in far[:_NAMED]
        )
        more = f" and {len(far) - _NAMED} more" if len(far) > _NAMED else ""
        yield f"parameters are further from the drawing than is plausible: {named}{more}"


def _listed(names: list[str], most: int = 6) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
