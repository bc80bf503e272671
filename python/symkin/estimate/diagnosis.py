# SPDX-License-Identifier: MIT
"""What speaks against an estimate that may well have converged.

Chi-square and the parameters alarm for one of 1000 sound robots, each kind of test of the residuals
for one of 2000 (Bonferroni within the kind), so that all of them together raise a doubt about fewer
than 1 of 100.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.workspace import coordinate_names
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError, named_legs
from symkin.estimate.corrections import Hypothesis, cause_in_words, hypotheses_of
from symkin.estimate.fit import (
    FALSE_ALARMS,
    UNKNOWN,
    by_leg,
    core_measurements,
    unguarded_note,
)
from symkin.estimate.found import Found, GoodnessOfFit
from symkin.estimate.options import EstimateOptions, Estimator
from symkin.estimate.reading_checks import coarse_readings, signs_of_mistakes
from symkin.estimate.unknowns import Sensor
from symkin.estimate.wider_models import help_in_words, unseen_rms
from symkin.model.poses import POSE_SPACES, cross_matrices, transforms
from symkin.model.tolerances import noise_of, parameter_tolerances
from symkin.values import Value, field, record

__all__ = [
    "Diagnosis",
    "Outlier",
    "ResidualTest",
    "diagnose",
    "implausible_parameters",
    "unknown_parameters",
    "weak_parameters",
]

Array = NDArray[np.float64]
_Unseen = Callable[[Sensor], float]

_RESIDUAL_ALARMS = FALSE_ALARMS / 2  # of one kind of test of the residuals, for a sound robot

# Beyond this the parameters of a leg are told apart only by digits that no measurement has.
_CONDITION_LIMIT = 1e5
# With fewer poses to spare, a noise three times larger than declared would often pass.
_FEW_SPARE_POSES = 3
_NAMED_ROWS = 5
# Chi-square per degree of freedom from which gross errors are looked for by a robust loss.
_GROSS_CHI_SQUARE = 9.0
# Standard deviations: with residuals of this size something else is wrong than a term.
_GROSS = 30
_NORMAL_MEDIAN = 0.6745  # of the absolute value of a standard normal
# Share of the squared distance from the drawing that a common movement must explain to be named.
_EXPLAINED = 0.5
_MOVEMENTS = {
    "base": "the frame of the measured poses is {} against the drawing's base",
    "platform": "the measured target is {} against the drawing's platform frame",
    "scale": "the measured positions are {} against the drawing's lengths",
}


@record
class ResidualTest(Value):
    """A test of the residuals for something that the model does not have.

    Attributes
    ----------
    suspect : str
        "sensor_curvature", "sensor_eccentricity", "geometry", "order", "legs" or "estimators".
    legs : tuple of int
        The legs (from 0) whose closures were tested.
    term : str
        Of "geometry", the term of the pose that shows most, such as ``"y^2"``; else empty.
    statistic : float
        F, or for "order" and "legs" standard deviations from the mean of sound residuals.
    degrees_of_freedom : tuple of int
        Degrees of freedom of F.
    p_value : float
        Probability of one as large for a sound robot.
    limit : float
        Below which `p_value` alarms: 5e-4 over the number of tests of the suspect.
    size : float
        Root mean square of what the terms explain of the legs' closures, m or rad.
    closure_unit : {"m", "rad"}
        Of the closures.
    """

    suspect: str
    legs: tuple[int, ...] = field(number=True)
    term: str
    statistic: float
    degrees_of_freedom: tuple[int, int]
    p_value: float
    limit: float
    size: float = field(unit="rms_closure")
    closure_unit: str = field(private=True, default="m")

    @property
    def alarms(self) -> bool:
        """Whether it speaks against the model."""
        return self.p_value < self.limit


@record
class Outlier(Value):
    """A pose that does not fit the others, or an observation of it.

    Attributes
    ----------
    row : int
        Of the measurements, from 0.
    row_number : int
        Where it stands in their source, from 1; this is what messages and files call its row.
    what : str
        What is furthest off there: ``closure of leg 2``, ``reading of leg 2``, ``x of the pose``.
    leg : int or None
        The leg (from 0) of it, if it is of one.
    student : float
        Its studentised residual.
    p_value : float
        Probability of a pose or observation as far off, before it is one of many.
    """

    row: int = field(private=True)
    row_number: int
    what: str
    leg: int | None = field(number=True)
    student: float
    p_value: float

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        names = {"row_number": "row", "student": "studentised_residual"}
        return {names.get(name, name): value for name, value in super().to_dict().items()}


class Diagnosis(NamedTuple):
    """What closures and parameters say of the model and of the measurements; see `Estimate`."""

    doubts: tuple[str, ...]
    symptoms: tuple[str, ...]
    hypotheses: tuple[Hypothesis, ...]
    notes: tuple[str, ...]
    tests: tuple[ResidualTest, ...]
    outliers: tuple[Outlier, ...]


def diagnose(found: Found) -> Diagnosis:
    """Diagnose an estimate from the closures of full poses."""
    result = _diagnosed(found)
    tests = _tests(found, result)
    outliers = _outliers(found, result)
    doubts = [*_doubts_of_size(found), *_doubts_of_noise(found), *signs_of_mistakes(found)]
    consequences = [*unknown_parameters(found)]
    # Where poses hardly tell parameters apart, first-order statistics say nothing of a model.
    if all(leg.condition <= _CONDITION_LIMIT for leg in found.legs):
        consequences = [*implausible_parameters(found), *consequences]
        # Most residuals may be so large that no single cause can be read off them.
        if not any(np.median(np.abs(leg.standardised)) > _GROSS for leg in found.legs):
            rows = _doubts_of_rows(outliers)
            consequences = [*rows, *_doubts_of_residuals(found, tests), *consequences]
    cause, tried = "", tuple[Hypothesis, ...]()
    symptoms = (*doubts, *consequences)
    if symptoms or not found.converged:
        cause, rest = _gross_errors(found)
        if not cause:
            tried = hypotheses_of(found.nominal, rest, found.options, by_leg=True)
            cause = cause_in_words(tried)
    # What a mistake does to the estimate is not worth telling beside the mistake.
    doubts = [cause, *doubts] if cause else [*doubts, *consequences]
    doubts += coarse_readings(found) if doubts else []
    notes = (*weak_parameters(found), *unguarded_note(found.measurements, found.unguarded))
    return Diagnosis(tuple(doubts), symptoms, tried, notes, tests, outliers)


def _diagnosed(found: Found) -> _core.Diagnosis:
    return _core.diagnose(
        found.mechanism.core,
        core_measurements(found.measurements),
        noise_of(found.noise),
        _rejected(found),
        found.nominal.reading_unit == "rad",
        _RESIDUAL_ALARMS,
    )


def _rejected(found: Found) -> list[int]:
    """Rows of which the loss rejects anything."""
    return sorted({row for row, _ in found.rejected})


def _tests(found: Found, result: _core.Diagnosis) -> tuple[ResidualTest, ...]:
    legs = tuple(range(len(found.nominal.legs)))
    names, closure_unit = coordinate_names(found.nominal), found.nominal.space.closure_unit
    terms = [*names, *(f"{name}^2" for name in names)]
    counts: dict[_core.Suspect, int] = {}
    for test in result.tests:
        counts[test.suspect] = counts.get(test.suspect, 0) + 1
    return tuple(
        ResidualTest(
            suspect=test.suspect.name,
            legs=legs
            if test.leg < 0
            else (test.leg, test.other)
            if test.suspect == _core.Suspect.legs
            else (test.leg,),
            term=terms[test.other] if test.suspect == _core.Suspect.geometry else "",
            statistic=test.statistic,
            degrees_of_freedom=(test.terms, test.spare),
            p_value=test.p_value,
            limit=_RESIDUAL_ALARMS / counts[test.suspect],
            size=test.size,
            closure_unit=closure_unit,
        )
        for test in result.tests
    )


def _outliers(found: Found, result: _core.Diagnosis) -> tuple[Outlier, ...]:
    # Half of the false alarms for poses as a whole, half for single closures.
    read = np.isfinite(result.student)
    poses = np.flatnonzero(read.any(axis=1))
    limit_of_pose = _RESIDUAL_ALARMS / 2 / max(len(poses), 1)
    limit_of_closure = _RESIDUAL_ALARMS / 2 / max(int(read.sum()), 1)
    closures = np.where(read, result.student_p, 1.0)
    numbers = found.measurements.row_numbers
    outliers = [
        Outlier(
            row=int(row),
            row_number=int(numbers[row]),
            what=f"closure of leg {np.argmin(closures[row]) + 1}",
            leg=int(np.argmin(closures[row])),
            student=float(result.student[row, np.argmin(closures[row])]),
            p_value=float(min(result.pose_p[row], closures[row].min())),
        )
        for row in poses
        if result.pose_p[row] < limit_of_pose or closures[row].min() < limit_of_closure
    ]
    return tuple(sorted(outliers, key=lambda outlier: (outlier.p_value, -abs(outlier.student))))


def _gross_errors(found: Found) -> tuple[str, Measurements]:
    """Poses without which everything fits, in words, and the measurements without them.

    No words if there are none, or if the rest fits no robot of this drawing: one that has a gain
    of the opposite sign, say, which may itself be due to a mistake.

    A robust loss finds them, since some may mask each other, and rejects a few sound ones besides.
    Only those are named that do not fit the others when they alone come back.
    """
    nothing = "", found.measurements
    worst = max((fit.chi_square_ratio for fit in found.goodness if fit.unexplained), default=0.0)
    if found.options.loss != "none" or worst < _GROSS_CHI_SQUARE:
        return nothing
    estimator: Estimator = "joint" if found.estimator == "joint" else "implicit"
    options = EstimateOptions(estimator, found.options.poses, noise=found.noise)
    count = len(found.measurements.poses)

    def fitted(rows: NDArray[np.intp], how: EstimateOptions) -> Found:
        return by_leg(found.nominal, found.measurements.subset(rows), how)

    try:
        robust = fitted(np.arange(count), replace(options, loss="cauchy"))
        gross = np.array(_rejected(robust), dtype=np.intp)
        sound = np.setdiff1d(np.arange(count), gross)
        for row in gross if robust.converged else ():
            rows = np.union1d(sound, [row])
            back = fitted(rows, options)
            if row not in rows[[each.row for each in _outliers(back, _diagnosed(back))]]:
                gross = np.setdiff1d(gross, [row])
        clean = fitted(np.setdiff1d(np.arange(count), gross), options)
    except SymkinError:
        return nothing
    if not clean.converged or not len(gross) or any(fit.unexplained for fit in clean.goodness):
        return nothing
    if any(implausible_parameters(clean)):
        return "", clean.measurements
    numbers = found.measurements.row_numbers[gross]
    listed = ", ".join(map(str, numbers[:8])) + (" ..." if len(numbers) > 8 else "")
    words = (
        f"likely cause: gross errors in rows {listed}: a robust loss (cauchy) finds {len(gross)} "
        f"of {count} poses that do not fit the others, whose chi-square is "
        f"{clean.chi_square_ratio:.3g} per degree of freedom"
    )
    return words, clean.measurements


def _doubts_of_size(found: Found) -> Iterator[str]:
    """Too few poses, or poses too much alike."""
    counts = found.nominal.estimated_counts
    for number, (leg, parameters) in enumerate(zip(found.legs, counts, strict=True), 1):
        if not np.isfinite(leg.condition) or leg.condition > _CONDITION_LIMIT:
            yield (
                f"leg {number}: the poses hardly tell its parameters apart "
                f"(condition number {leg.condition:.3g})"
            )
        closures = found.nominal.closures
        freedom = closures * (len(leg.rows) - len(leg.rejected)) - parameters
        spare = freedom // closures
        if freedom < 1:
            yield f"leg {number}: no pose to spare, so the noise cannot be checked"
        elif spare < _FEW_SPARE_POSES:
            poses = {0: "a part of a pose", 1: "one pose"}.get(spare, f"{spare} poses")
            yield f"leg {number}: only {poses} to spare, so the noise can hardly be checked"
        if len(leg.rejected) > 0.2 * len(leg.rows):
            yield (
                f"leg {number}: the robust loss rejects {len(leg.rejected)} of its "
                f"{len(leg.rows)} poses"
            )


def _doubts_of_noise(found: Found) -> Iterator[str]:
    """Residuals larger or smaller than the declared noise."""
    remedy = (
        "the standard deviations are those of the residuals that the loss keeps"
        if found.options.loss != "none"
        else "the standard deviations are scaled up by that factor"
        if found.estimator == "joint"
        else "the standard deviations are taken from the residuals instead"
    )
    judged = [fit for fit in found.goodness if fit.degrees_of_freedom > 0]
    large = [fit for fit in judged if fit.unexplained]
    if large:
        times = max(fit.chi_square_ratio for fit in large) ** 0.5
        yield (
            f"{_chi_squares(found, large)}, above {_limits(large, 'limit')} which 1 of 1000 sound "
            f"robots exceeds: residuals are {times:.2g} times what the declared noise explains; "
            f"{remedy}"
        )
        bulk = max(np.median(np.abs(leg.standardised)) for leg in found.legs) / _NORMAL_MEDIAN
        if times > 4 and bulk < times / 2:
            yield (
                f"half of the residuals are only {bulk:.2g} times as large as declared: some poses "
                "are far off; look at them, or use a robust loss"
            )
    small = [fit for fit in judged if fit.chi_square < fit.least]
    if small and found.options.loss == "none":
        why = (
            "these are numbers that were computed, such as those of a plan, not measured"
            if min(fit.chi_square_ratio for fit in small) < 1e-6
            else "the declared noise is too large, or the measurements were smoothed"
        )
        yield (
            f"{_chi_squares(found, small)}, below {_limits(small, 'least')} which 1 of 1000 sound "
            f"robots falls short of: {why}"
        )


def _chi_squares(found: Found, fits: Sequence[GoodnessOfFit]) -> str:
    legs = [leg for fit in fits for leg in fit.legs]
    who = "all legs" if len(legs) == len(found.legs) else named_legs(legs)
    values = ", ".join(f"{fit.chi_square_ratio:.3g}" for fit in fits)
    freedom = ", ".join(dict.fromkeys(f"{fit.degrees_of_freedom:.4g}" for fit in fits))
    return f"{who}: chi-square is {values} per degree of freedom ({freedom} of them)"


def _limits(fits: Sequence[GoodnessOfFit], which: str) -> str:
    limits = (getattr(fit, which) / fit.degrees_of_freedom for fit in fits)
    return ", ".join(dict.fromkeys(f"{limit:.3g}" for limit in limits))


def _doubts_of_rows(outliers: Sequence[Outlier]) -> Iterator[str]:
    if not outliers:
        return
    named = ", ".join(
        f"{each.row_number} ({each.what.removeprefix('closure of ')}, {each.student:+.1f} "
        "deviations)"
        for each in outliers[:_NAMED_ROWS]
    )
    more = len(outliers) - _NAMED_ROWS
    which = (
        f"row {named} does not fit"
        if len(outliers) == 1
        else f"rows {named}{f' and {more} more' if more > 0 else ''} do not fit"
    )
    yield f"{which} the others: look at the measurement, or use a robust loss"


def _doubts_of_residuals(found: Found, tests: Sequence[ResidualTest]) -> Iterator[str]:
    @cache
    def unseen(sensor: Sensor) -> float:
        """Closures of `joint` with such sensors at poses that it did not see."""
        options = EstimateOptions(poses=found.options.poses, noise=found.noise, sensor=sensor)
        return unseen_rms(found.nominal, found.measurements, options)

    for suspect, meaning in _MEANINGS.items():
        alarms = [test for test in tests if test.suspect == suspect and test.alarms]
        if alarms:
            yield f"{meaning(alarms, found, unseen)} {_evidence(alarms)}"


def _evidence(alarms: Sequence[ResidualTest]) -> str:
    worst = min(alarms, key=lambda test: (test.p_value, -abs(test.statistic)))
    p_value = f"p {worst.p_value:.1g}" if worst.p_value > 1e-300 else "p 0"
    if worst.suspect in ("order", "legs"):
        return f"({worst.statistic:+.1f} standard deviations, {p_value})"
    terms, spare = worst.degrees_of_freedom
    return f"(F({terms}, {spare}) = {worst.statistic:.3g}, {p_value})"


def _single_legs(alarms: Sequence[ResidualTest], found: Found) -> str:
    legs = [test for test in alarms if len(test.legs) == 1]
    if not legs or len(legs) == len(found.legs):
        return "all legs"
    return named_legs(sorted(test.legs[0] for test in legs))


def _size(alarms: Sequence[ResidualTest]) -> str:
    return f"{max(test.size for test in alarms) * 1e3:.3g} m{alarms[0].closure_unit} rms"


def _eccentric(found: Found, unseen: _Unseen) -> str:
    """What to ask for where `joint` can learn it: of sensors that read an angle."""
    if found.nominal.reading_unit != "rad":
        return ""
    return f"; identify with --sensor eccentric{_help(found, unseen, 'eccentric')}"


def _help(found: Found, unseen: _Unseen, sensor: Sensor) -> str:
    """By how much `joint` does better with such sensors at poses that it did not see."""
    return help_in_words(unseen("linear"), unseen(sensor), found.nominal.space.closure_unit)


_MEANINGS: dict[str, Callable[[Sequence[ResidualTest], Found, _Unseen], str]] = {
    "sensor_curvature": lambda alarms, found, unseen: (
        f"{_single_legs(alarms, found)}: the residuals contain a square of the reading "
        f"({_size(alarms)} of the closures): the sensors are not linear, as with a spool that "
        "fills, a rope that stretches or a slipping drive; identify with --sensor quadratic"
        f"{_help(found, unseen, 'quadratic')}"
    ),
    "sensor_eccentricity": lambda alarms, found, unseen: (
        f"{_single_legs(alarms, found)}: the residuals repeat with each turn of the sensor "
        f"({_size(alarms)} of the closures): an encoder or a spool runs out of true"
        + _eccentric(found, unseen)
    ),
    "geometry": lambda alarms, found, _: (
        f"{_single_legs(alarms, found)}: the residuals depend on the pose, most on "
        f"{', '.join(dict.fromkeys(test.term for test in alarms))} ({_size(alarms)} of the "
        "closures): something bends or sags, a joint is not where the chain has it, or the "
        "measuring device is distorted"
    ),
    "order": lambda alarms, *_: (
        "residuals of neighbouring rows are opposite: the rows alternate between two states, such "
        "as two directions of approach (backlash)"
        if alarms[0].statistic < 0
        else "residuals of neighbouring rows are alike: something drifts in the order of "
        "measuring, such as a warming structure, a slipping drive or a moving target"
    ),
    "legs": lambda alarms, *_: (
        "residuals of legs "
        f"{', '.join(f'{test.legs[0] + 1} and {test.legs[1] + 1}' for test in alarms)} vary "
        "together more than the declared noise of the pose explains: its position and orientation "
        "parts are not in the declared proportion to each other and to the readings'"
    ),
    "estimators": lambda *_: (
        "the estimators implicit and joint disagree by more than the noise explains: the declared "
        "split of the noise between pose and readings is wrong, or the model lacks something"
    ),
}


def implausible_parameters(found: Found) -> Iterator[str]:
    """Name parameters, and movements of all of them, that the tolerances make implausible."""
    nominal, moved, deviations = found.nominal, found.changes, found.deviations
    identified = nominal.is_estimated
    if not np.isfinite(deviations[identified]).all():
        return
    tolerances = parameter_tolerances(nominal)
    yield from _common_movements(found, moved, tolerances)
    distances = np.abs(moved) / np.hypot(tolerances, deviations)
    far = np.argwhere(distances > NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / identified.sum()))
    if len(far):
        order = np.argsort(-distances[tuple(far.T)])
        named = ", ".join(
            f"{nominal.parameter_names[parameter]} of leg {leg + 1} by "
            f"{moved[leg, parameter]:+.3g} {nominal.parameter_units(leg)[parameter]}".rstrip()
            + f" ({distances[leg, parameter]:.3g} times what tolerance and noise allow)"
            for leg, parameter in far[order[:3]]
        )
        more = f" and {len(far) - 3} more" if len(far) > 3 else ""
        yield f"parameters are further from the drawing than is plausible: {named}{more}"


def unknown_parameters(found: Found) -> Iterator[str]:
    """Name parameters that the measurements in effect do not show."""
    unknown = np.argwhere(found.deviations > UNKNOWN * parameter_tolerances(found.nominal))
    if len(unknown):
        yield (
            f"the measurements say nothing of {_named(found, unknown)}: the standard deviation is "
            f"more than {UNKNOWN} times the tolerance, so the drawing knows better"
        )


def weak_parameters(found: Found) -> Iterator[str]:
    """Name parameters that the drawing knows better than the measurements."""
    shares = found.deviations / parameter_tolerances(found.nominal)
    weak = np.argwhere((shares > 1) & (shares <= UNKNOWN))
    if len(weak):
        yield (
            f"the measurements say less than the tolerances of {_named(found, weak)}: the standard "
            "deviation is larger than the tolerance; what the platform does follows from "
            "combinations of these parameters, which are known better"
        )


def _named(found: Found, places: NDArray[np.intp]) -> str:
    by_name: dict[str, list[int]] = {}
    for leg, parameter in places:
        by_name.setdefault(found.nominal.parameter_names[parameter], []).append(int(leg))
    return ", ".join(f"{name} of {named_legs(legs)}" for name, legs in by_name.items())


def _common_movements(found: Found, moved: Array, tolerances: Array) -> Iterator[str]:
    """Movements of all parameters as one, which show far below the tolerance of any of them."""
    own = np.flatnonzero(found.nominal.is_estimated)
    inverse = np.linalg.inv(found.covariance + np.diag(tolerances.ravel()[own] ** 2))
    z = moved.ravel()[own]
    distance = float(z @ inverse @ z)
    if distance == 0:
        return
    best = (FALSE_ALARMS / 8, "")
    for kind, words in _MOVEMENTS.items():
        if kind == "scale" and not found.nominal.space.moves:
            continue
        directions = _directions(found, kind)
        if directions.shape[1] == 0:
            continue
        information = directions.T @ inverse @ directions
        gradient = directions.T @ inverse @ z
        amounts = np.linalg.pinv(information, rcond=1e-10) @ gradient
        explained = float(gradient @ amounts)
        share = f"which explains {explained / distance:.0%} of their distance from the drawing"
        movement = words.format(_in_words(kind, amounts, found.nominal.space.size))
        p_value = _core.chi_square_tail(explained, directions.shape[1])
        if explained < _EXPLAINED * distance:
            continue
        best = min(best, (p_value, f"{movement}, {share}"))
    if best[1]:
        yield f"the parameters of all legs moved together: {best[1]}"
        return
    p_value = _core.chi_square_tail(distance, z.size)
    if p_value < FALSE_ALARMS / 8:
        yield (
            "all parameters together are further from the drawing than their tolerances make "
            f"plausible (chi-square {distance:.3g} for {z.size} parameters)"
        )


def _directions(found: Found, kind: str) -> Array:
    """Changes of what is identified, one a column, that stand for moving a frame or for a scale.

    They are those with which the closures at the measured poses stay as they are, leg by leg.
    """
    calibrated, measurements = found.mechanism, found.measurements
    columns = []
    for leg, fit in enumerate(found.legs):
        rows = _core.linearise(
            calibrated.core,
            leg,
            measurements.poses[fit.rows],
            measurements.readings[fit.rows, leg],
        )
        movement = _movements(kind, found.nominal.pose_space, measurements.poses[fit.rows])
        movement = np.repeat(movement, calibrated.closures, axis=0)
        wanted = -np.einsum("nd,ndk->nk", rows.by_pose, movement)
        by_parameters = rows.by_parameters[:, found.nominal.estimated[leg]]
        scale = np.linalg.norm(by_parameters, axis=0)
        scale[scale == 0] = 1
        solved = np.linalg.lstsq(by_parameters / scale, wanted, rcond=1e-12)[0]
        columns.append(solved / scale[:, None])
    return np.vstack(columns)


def _movements(kind: str, pose_space: str, poses: Array) -> Array:
    """Changes of the poses on their tangent, shape (N, dof, movements)."""
    rotation, translation = transforms(pose_space, poses)
    none, same = np.zeros_like(rotation), np.broadcast_to(np.eye(3), rotation.shape)
    movements = {
        "base": np.block([[same, -cross_matrices(translation)], [none, same]]),
        "platform": np.block([[rotation, none], [none, rotation]]),
        "scale": np.concatenate([translation, np.zeros_like(translation)], axis=1)[:, :, None],
    }[kind]
    space = POSE_SPACES[pose_space]
    shown = space.components
    if kind == "scale":
        return movements[:, shown]
    free = space.frame_components
    if kind == "platform" and not space.turns:
        free = []  # its target's offset cannot be told from the base frame's
    return movements[:, shown][:, :, free]


def _in_words(kind: str, amounts: Array, positions: int) -> str:
    if kind == "scale":
        return (
            f"{100 * amounts[0]:+.3g} % too large"
            if amounts[0] > 0
            else (f"{-100 * amounts[0]:.3g} % too small")
        )
    angle = np.degrees(np.linalg.norm(amounts[positions:]))
    turned = f"turned by about {angle:.3g} degrees"
    if not positions:
        return turned
    shift = ", ".join(f"{1e3 * value:.3g}" for value in amounts[:positions])
    return f"shifted by about ({shift}) mm and {turned}"
