# SPDX-License-Identifier: MIT
"""All that speaks against an estimate, however it was asked for: tests, then what would explain it.

Chi-square and the parameters alarm for one of 1000 sound robots, each kind of test of the residuals
for one of 2000, so that all of them together raise a doubt about fewer than 1 of 100.
"""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.covariates import clock
from symkin.estimate.evidence.bodies import (
    exchanged_points,
    with_another_point,
    with_points_in_order,
)
from symkin.estimate.evidence.changes import CHANGES, change_tests, doubts_of_changes, whole_change
from symkin.estimate.evidence.computed import rows_not_measured, without_computed
from symkin.estimate.evidence.corrections import (
    Budget,
    Hypothesis,
    corrected_by,
    hypotheses_of,
    likely_cause,
)
from symkin.estimate.evidence.distortion import distortion_that_explains
from symkin.estimate.evidence.drawing import (
    hiding_noise,
    implausible_parameters,
    strained_ties,
    unknown_parameters,
)
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.fit_checks import (
    CONDITION_LIMIT,
    doubts_of_lost_rows,
    doubts_of_noise,
    doubts_of_poses,
    doubts_of_size,
)
from symkin.estimate.evidence.gross_errors import gross_errors
from symkin.estimate.evidence.late import late_that_explains
from symkin.estimate.evidence.measured import (
    coarse_readings,
    copied_columns,
    copied_rows,
    copies,
    signs_of_mistakes,
    taken_from,
    with_lost_turns,
)
from symkin.estimate.evidence.models import Fitting, help_of, model_of
from symkin.estimate.evidence.outliers import (
    Outlier,
    doubts_of_rows,
    drop_without,
    explain_all,
    outliers_of,
)
from symkin.estimate.evidence.parts import of_another_robot
from symkin.estimate.evidence.residuals import (
    BETTER,
    ResidualTest,
    diagnosed,
    doubts_of_residuals,
    tests_of,
)
from symkin.estimate.evidence.sag import doubts_of_sag
from symkin.estimate.evidence.scatter import doubts_of_scatter, is_due_to_scatter
from symkin.estimate.evidence.sessions import (
    SESSIONS,
    doubts_of_sessions,
    session_tests,
    shift_is_shown,
    shift_that_explains,
)
from symkin.estimate.evidence.shown_noise import doubts_of_directions
from symkin.estimate.evidence.standing import what_stands_still
from symkin.estimate.evidence.watching import is_watched
from symkin.estimate.evidence.wider import Alternative, alternatives_of, doubts_of_models
from symkin.estimate.fit import by_leg
from symkin.estimate.found import Found
from symkin.estimate.options import EstimateOptions
from symkin.estimate.solution import together
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames, NoiseSettings

# Standard deviations: with residuals of this size something else is wrong than a term.
_GROSS = 30
_AS_LIKELY = math.exp(-BETTER / 2)  # of probabilities that may be taken for equal
_SINGLE = 3  # rows with gross errors of their own
_SENSORS = {"sensor-curved", "sensor-eccentric"}
_DISTORTED = "device-distorted"
# What no change of parameters explains, since all that they could was taken out.
_SHAPES = {
    *_SENSORS,
    *CHANGES,
    *SESSIONS,
    _DISTORTED,
    *("depends-on-pose", "sags", "neighbours-alike", "neighbours-opposite"),
    *("legs-together", "estimators-disagree", "rows-unlike"),
}
_FAR = {*SESSIONS, "clock-late"}  # by which rows may be as far apart as one likes
# What a change while it was measured brings about, too.
_OF_RESIDUALS = (_SHAPES - CHANGES - SESSIONS - {_DISTORTED}) | {
    "residuals-large",
    "few-far-off",
    "readings-coarse",
}
# What readings that scatter bring about.
_OF_SCATTER = {"residuals-large", "few-far-off", "legs-together", "rows-unlike"}
# What rows of another robot look like.
_MAYBE_ANOTHER = {"steps", "readings-scatter", "rows-scatter"}
_OF_NOISE = {*_OF_SCATTER, "residuals-small"}
# How far parameters are from the drawing, which any of these makes of a sound robot's.
_OF_PARAMETERS = {"moved-together", "parameters-far", "far-from-drawing", "parameters-unknown"}
# What a table says itself, without a robot.
_PLAIN = {"rows-computed", "stands-still", "columns-copied", "points-exchanged"}
_MENDED: dict[str, Callable[[Found], Measurements]] = {
    "turns-lost": lambda found: with_lost_turns(taken_from(found), found.measurements),
    "rows-computed": lambda found: without_computed(found.nominal, found.measurements),
    "points-exchanged": lambda found: with_points_in_order(found.nominal, found.measurements),
}


class Noticed(NamedTuple):
    """What speaks against an estimate, whatever the cause.

    Attributes
    ----------
    lasting : tuple of Doubt
        What no mistake brings about: too little was measured, or the same twice.
    symptoms : tuple of Doubt
        What a mistake may bring about, the worst first.
    tests, outliers
        See `Estimate`.
    rest : Found or None
        What was tested, if that is an estimate without rows that stand there twice.
    """

    lasting: tuple[Doubt, ...]
    symptoms: tuple[Doubt, ...]
    tests: tuple[ResidualTest, ...]
    outliers: tuple[Outlier, ...]
    rest: Found | None = None


class Evidence(NamedTuple):
    """What is to be told of it, and whether every correction could be tried.

    `corrected` are the measurements as the likely cause corrects them, if it is one of the table,
    `redrawn` is the mechanism, if it is one of the drawing.
    """

    doubts: tuple[Doubt, ...]
    hypotheses: tuple[Hypothesis, ...]
    complete: bool
    corrected: Measurements | None = None
    redrawn: Mechanism | None = None


def noticed(
    found: Found, alternatives: Callable[[], Sequence[Alternative]], model: Fitting
) -> Noticed:
    """Test an estimate by its residuals, its parameters and the measurements themselves.

    Rows that stand there twice are not independent: then what is tested is an estimate without.
    """
    try:
        return _without_copies(found, alternatives, model)
    except KeyboardInterrupt:
        if not is_watched():
            raise
        return Noticed((*copies(found), Doubt("tests-ended")), (), (), ())


def _without_copies(
    found: Found, alternatives: Callable[[], Sequence[Alternative]], model: Fitting
) -> Noticed:
    copied, size = list(copies(found)), list(doubts_of_size(found))
    if not copied:
        return _noticed(found, size, alternatives, model)
    once = np.delete(np.arange(len(found.measurements.poses)), copied_rows(found))
    try:
        taken = found.measurements.subset(once)
        rest = (by_leg if found.legs else together)(found.nominal, taken, found.options)
    except SymkinError:
        return Noticed((*copied, *size), (), (), ())
    of_rest = _tested(rest, size)
    rows = (int(once[each.row]) for each in of_rest.outliers)
    outliers = [
        dataclasses.replace(each, row=row, place=-1)
        for each, row in zip(of_rest.outliers, rows, strict=True)
    ]
    lasting = (*copied, *of_rest.lasting)
    return of_rest._replace(lasting=lasting, outliers=tuple(outliers), rest=rest)


def _tested(found: Found, size: Sequence[Doubt]) -> Noticed:
    wider = cache(lambda: tuple(alternatives_of(found)))
    return _noticed(found, size, wider, lambda what: model_of(found, wider(), what))


def _noticed(
    found: Found,
    size: Sequence[Doubt],
    alternatives: Callable[[], Sequence[Alternative]],
    model: Fitting,
) -> Noticed:
    taken = taken_from(found)
    framed = found.mechanism if found.converged else found.nominal
    drawn = found.nominal.replace(frames=framed.frames)
    plain = (
        *rows_not_measured(found.nominal, found.measurements),
        *what_stands_still(drawn, found.measurements, (found.nominal, found.options)),
        *copied_columns(taken),
        *exchanged_points(found.nominal, found.measurements),
    )
    if plain:  # and then all else says nothing
        return Noticed(tuple(size), plain, (), ())
    result = diagnosed(found)
    tests, outliers = tests_of(found, result), outliers_of(found, result)
    lost = list(doubts_of_lost_rows(found))
    # Of single errors all else may be a consequence.
    if explain_all(found, outliers) and not _explains_more(found, outliers):
        return Noticed(tuple(size), (*doubts_of_rows(found, outliers), *lost), tests, outliers)
    symptoms = [
        *lost,
        *doubts_of_poses(found),
        *signs_of_mistakes(found, taken),
        *doubts_of_noise(found),
    ]
    # Where poses hardly tell parameters apart, first-order statistics say nothing of a model.
    told_apart = all(leg.condition <= CONDITION_LIMIT for leg in found.legs)
    far = not told_apart or _all_is_far_off(found)
    apart = [each.row for each in outliers]
    changes = [] if far else _changes(found, apart)
    if (found.unexplained or not found.converged) and whole_change(changes) is None:
        changes = shift_that_explains(found) or late_that_explains(found) or changes
    symptoms += changes
    if told_apart:
        if not far:
            symptoms += doubts_of_rows(found, outliers)
            symptoms += _doubts_of_the_model(found, tests, alternatives(), model)
            symptoms += [] if changes else doubts_of_sag(found, apart)
        symptoms = _with_distortion(symptoms, distortion_that_explains(found))
        far_off = [*implausible_parameters(found), *strained_ties(found)]
        sags = _sags_within_tolerances(found, apart) if far_off and not symptoms else []
        symptoms += sags or far_off
    if told_apart and not far:
        scattered = [*doubts_of_scatter(found)] or [*doubts_of_scatter(found, apart)]
        symptoms = _with_scatter(symptoms, scattered)
    if changes:  # which say what is alike
        symptoms = [each for each in symptoms if not each.code.startswith("neighbours-")]
    symptoms += [*hiding_noise(found), *unknown_parameters(found)]
    symptoms += coarse_readings(taken, found.noise) if symptoms else []
    # What can be asked for instead comes first: the rest may be due to that.
    symptoms.sort(key=lambda each: not each.options)
    return Noticed(tuple(size), tuple(symptoms), tests, outliers)


def _with_distortion(symptoms: list[Doubt], distorted: Doubt | None) -> list[Doubt]:
    """What is told if a distorted device would explain it all.

    Changes, sensors, frames, a sag and what is held explain a part of that, as it does of what is
    due to them.
    """
    whole = whole_change(symptoms)
    if distorted is None or (whole is not None and math.isnan(whole.p)):
        return symptoms
    rivals = [each for each in symptoms if each.options or each.code in ("sags", "held-is-wrong")]
    rivals = [each for each in rivals if math.isfinite(each.p)]
    best = min(rivals, key=lambda each: each.p, default=distorted)
    if best.p < _AS_LIKELY * distorted.p:
        return symptoms
    alike = (best,) if best is not distorted and distorted.p >= _AS_LIKELY * best.p else ()
    return [dataclasses.replace(distorted, others=alike), *_unasked(symptoms)]


def _explains_more(found: Found, outliers: Sequence[Outlier]) -> bool:
    """Whether something that scatters does, each single error being one that was looked for.

    What scatters is seldom seen in a single row.
    """
    looked_for = BETTER if len(outliers) > 1 else BETTER / 2
    by_outliers = drop_without(found, outliers) - len(outliers) * looked_for
    return any(each.figures["gain"] > by_outliers for each in doubts_of_scatter(found))


def _with_scatter(symptoms: list[Doubt], scattered: list[Doubt]) -> list[Doubt]:
    """What is told if what scatters would explain it all, and better than all else.

    A change that does so without outliers explains less than what makes these.
    """
    rivals = [each for each in symptoms if each.code not in _OF_SCATTER]
    whole = whole_change(rivals)
    best = min((each.p for each in rivals if math.isfinite(each.p)), default=1.0)
    if not scattered or not scattered[0].p < _AS_LIKELY * best:
        return symptoms
    if whole is not None:
        by_score = whole.p > 0 and whole.code in CHANGES
        explained = -2 * math.log(whole.p) if by_score else math.inf
        if not scattered[0].figures["gain"] > explained + BETTER:
            return symptoms
    return [*scattered, *_unasked(symptoms)]


def _unasked(symptoms: Sequence[Doubt]) -> list[Doubt]:
    """Those but for what can be asked for, or changed: a part of what explains it all."""
    left_out = {*CHANGES, "sags"}
    return [each for each in symptoms if not each.options and each.code not in left_out]


def _sags_within_tolerances(found: Found, apart: Sequence[int]) -> list[Doubt]:
    """Say of a robot that is far from the drawing where a sag would explain it.

    Without priors its parameters take up most of that.
    """
    if found.options.prior is not None or found.noise_is_estimated:
        return []
    # Leg by leg a robot is estimated in its own frame.
    robot = found.nominal.replace(frames=None) if found.legs else found.nominal
    options = dataclasses.replace(
        found.options, prior="tolerances", gauge="prior", poses="all", noise=found.noise
    )
    try:
        within = together(robot, found.measurements, options)
        return list(doubts_of_sag(within, apart, whole=True))
    except SymkinError:
        return []


def _changes(found: Found, apart: Sequence[int]) -> list[Doubt]:
    """What changed from row to row or between sessions, whichever shows more; without outliers."""
    changes: list[Doubt] = []
    for without in ((), apart) if apart else ((),):
        tests, sessions = change_tests(found, without), session_tests(found, without)
        alarms = [abs(each.statistic) for each in tests if each.alarms]
        changes = list(doubts_of_sessions(found, sessions))
        if alarms and not shift_is_shown(sessions, max(alarms)):
            changes = list(doubts_of_changes(tests))
        if whole_change(changes) is not None:
            break
    return changes


def _doubts_of_the_model(
    found: Found,
    tests: Sequence[ResidualTest],
    alternatives: Sequence[Alternative],
    model: Fitting,
) -> list[Doubt]:
    """What the closures depend on, and wider models, without saying the same twice."""
    help_in_words = help_of(found, model)
    wider = list(doubts_of_models(found, alternatives, help_in_words))
    told = {each.code for each in wider}
    # What is held shows in the residuals as whatever it resembles.
    if "held-is-wrong" in told or "frame-not-as-drawn" in told:
        return wider
    by_test = doubts_of_residuals(found, tests, help_in_words)
    return wider + [each for each in by_test if not (each.code in _SENSORS and told & _SENSORS)]


def _all_is_far_off(found: Found) -> bool:
    """Whether most residuals are so large that no single cause can be read off them."""
    return any(np.mean(np.abs(leg.standardised) > _GROSS) > 0.5 for leg in found.legs)


def _beside(changed: Doubt, symptoms: Sequence[Doubt]) -> list[Doubt]:
    """What is told with a change that was found, but for what it does to the estimate."""
    if changed.code in _FAR:  # and then all else says nothing
        return [each for each in symptoms if each.code in _FAR]
    follows = _OF_RESIDUALS | _OF_PARAMETERS
    return [each for each in symptoms if each.code not in follows]


def judged(estimate: Found, what: Noticed) -> Evidence:
    """Look for a cause of what was noticed; what it does to the estimate is not told beside it."""
    try:
        return _judged(estimate, what)
    except KeyboardInterrupt:
        if not is_watched():
            raise
        told = (Doubt("search-ended"), *what.lasting, *what.symptoms)
        return Evidence(told, (), complete=True)


def _has_shape(what: Noticed) -> bool:
    return any(each.code in _SHAPES for each in what.symptoms)


def _never(*_: object) -> bool:
    return False


def _another(
    found: Found, mechanism: Mechanism, measurements: Measurements, options: EstimateOptions
) -> Found | None:
    """Another estimate, made as this one was; None where it is refused or has no end."""
    try:
        other = (by_leg if found.legs else together)(mechanism, measurements, options)
    except SymkinError:
        return None
    return other if other.converged else None


def _shaped(
    found: Found, mechanism: Mechanism, measurements: Measurements, options: EstimateOptions
) -> bool:
    """Whether residuals of another estimate still have a shape, or it has no end."""
    other = _another(found, mechanism, measurements, options)
    return other is None or _has_shape(_tested(other, ()))


def _with_mended_table(found: Found, what: Noticed) -> Evidence | None:
    """What there is to tell once the table is mended of what it says itself, if that is sound."""
    for code, mended in _MENDED.items():
        if causes := [each for each in what.symptoms if each.code == code]:
            table = mended(found)
            other = _another(found, found.nominal, table, found.options)
            return None if other is None else _mended(what, causes, table, other)
    return None


def _with_moved_point(found: Found, what: Noticed) -> Evidence | None:
    """What there is to tell once a point that moved on the platform is two, if that is sound.

    A step of legs or frames, which explains a part, tells the row; each point is tried from there.
    """
    points, given = found.measurements.points, (found.nominal.frames or Frames()).points
    if not found.unexplained or points is None or given:
        return None
    steps = [each for each in change_tests(found) if each.what == "step"]
    worst = max(steps, key=lambda each: abs(each.statistic), default=None)
    if worst is None or worst.p_value >= worst.limit:
        return None
    time, count = clock(found.measurements), points.shape[1]
    later = time >= time[found.measurements.row_numbers == worst.row]
    tried = []
    for point in range(count):
        table = with_another_point(found.measurements, point, later)
        other = _another(found, found.nominal, table, found.options)
        if other is not None:
            tried.append((other.chi_square, point, table, other))
    tried.sort(key=operator.itemgetter(0, 1))
    if not tried or (len(tried) > 1 and tried[1][0] - tried[0][0] < BETTER):
        return None
    _, point, table, other = tried[0]
    figures = {"which": point + 1, "another": count + 1}
    moved = Doubt("point-moved", (), (worst.row,), figures=figures)
    return _mended(what, [moved], table, other)


def _with_directed_noise(found: Found, what: Noticed) -> Evidence | None:
    """What there is to tell if the device sees better along one axis, and nothing else is wrong."""
    if not any(each.code in _OF_NOISE for each in what.symptoms):
        return None

    def another(noise: NoiseSettings) -> Found | None:
        options = dataclasses.replace(found.options, noise=noise)
        other = _another(found, found.nominal, found.measurements, options)
        return None if other is None or _tested(other, ()).symptoms else other

    told = next(doubts_of_directions(found, another), None)
    return None if told is None else Evidence((told, *what.lasting), (), complete=True)


def _mended(
    what: Noticed, causes: Sequence[Doubt], table: Measurements, other: Found
) -> Evidence | None:
    """What there is to tell beside what a table without it was mended of; None if more is left."""
    if other.unexplained:
        return None
    left = _tested(other, ())
    if _has_shape(left):
        return None
    rest = judged(other, left) if left.symptoms else Evidence((), (), complete=True)
    doubts = (*causes, *rest.doubts, *what.lasting)
    return rest._replace(doubts=doubts, corrected=rest.corrected or table)


def _judged(estimate: Found, what: Noticed) -> Evidence:
    found, changed = what.rest or estimate, whole_change(what.symptoms)
    if what.rest is None:
        mended = _with_mended_table(found, what)
        if mended is None and changed is None:
            mended = _with_moved_point(found, what) or _with_directed_noise(found, what)
        if mended is not None:
            return mended
    hidden = any(each.code == "noise-hides-robot" for each in what.symptoms)
    if changed is not None and not hidden:  # of so large a noise anything explains the rest
        return Evidence((*_beside(changed, what.symptoms), *what.lasting), (), complete=True)
    doubts = (*what.lasting, *what.symptoms)
    if any(each.code in _PLAIN for each in what.symptoms):
        return Evidence(doubts, (), complete=True)
    sought = _sought(estimate, what) if what.symptoms or not found.converged else _Sought()
    cause, most = sought.cause, next(iter(_mostly(what.symptoms)), None)
    if most is not None and most.code == _DISTORTED and cause is not None and not cause.explains:
        cause = None  # which explains a part of what that explains
    if cause is not None:
        doubts = (cause, *what.lasting)
    elif most is not None:
        doubts = (*what.lasting, *_beside(most, what.symptoms))
    if cause is None or not cause.explains:
        return Evidence(doubts, sought.tried, sought.complete)
    redrawn = sought.redrawn
    if redrawn is not None:  # leg by leg a cause is looked for in the robot's own frame
        redrawn = redrawn.replace(frames=found.nominal.frames)
    return Evidence(doubts, sought.tried, sought.complete, sought.corrected, redrawn)


def _mostly(symptoms: Sequence[Doubt]) -> list[Doubt]:
    """Of symptoms those that explain most of what noise does not."""
    return [each for each in symptoms if each.figures.get("most") is True]


class _Sought(NamedTuple):
    """A mistake that symptoms may come from, what was tried, and what is corrected of it."""

    cause: Doubt | None = None
    tried: tuple[Hypothesis, ...] = ()
    complete: bool = True
    corrected: Measurements | None = None
    redrawn: Mechanism | None = None


def _sought(estimate: Found, what: Noticed) -> _Sought:
    """Look for what the symptoms come from: a mistake, another robot, or gross errors."""
    found = what.rest or estimate
    gross, rest = gross_errors(found) if found.legs else (None, found.measurements)
    if is_due_to_scatter(gross, what.symptoms):
        gross, rest = None, found.measurements
    cause: Doubt | None = None
    tried: tuple[Hypothesis, ...] = ()
    corrected: Measurements | None = None
    redrawn: Mechanism | None = None
    budget = Budget()
    shaped = partial(_shaped, found) if _has_shape(what) else _never
    # Without gross errors too, if there are some: but all rows say which belong together, and
    # those that do not fit, if they are many, what they have in common.
    asked_of = (found.measurements, rest) if gross is None else (found.measurements,)
    for rows in asked_of if gross is None or len(gross.rows) > _SINGLE else ():
        asked = found.nominal, rows, found.options
        tried = hypotheses_of(*asked, by_leg=bool(found.legs), budget=budget, shaped=shaped)
        cause = likely_cause(tried)
        if rows is estimate.measurements:  # no row of these is lost
            corrected, redrawn = corrected_by(tried)
        if rest is found.measurements or (cause is not None and cause.explains):
            break
    steps = {each.code for each in _mostly(what.symptoms)}
    single = what.rest is None and explain_all(found, what.outliers)
    another = gross is None and not single and steps <= _MAYBE_ANOTHER
    if (cause is None or not cause.explains) and another:
        cause = of_another_robot(found, partial(_another, found)) or cause
    if gross is not None and (cause is None or not cause.explains):
        cause, corrected, redrawn = gross, None, None
    if single and cause is not None and not cause.explains:
        cause = None  # which explains a part of what these do
    if cause is None and not found.legs:  # dearer than what comes before it
        cause = _gross_alone(found, what.symptoms)
    return _Sought(cause, tried, not budget.spent, corrected, redrawn)


def _gross_alone(found: Found, symptoms: Sequence[Doubt]) -> Doubt | None:
    """Gross errors of single rows, unless symptoms tell as much: how far each is off, or more."""
    cause, _ = gross_errors(found)
    if cause is None or is_due_to_scatter(cause, symptoms):
        return None
    unlike = {row for each in symptoms if each.code == "rows-unlike" for row in each.rows}
    return None if unlike == {*cause.rows} else cause
