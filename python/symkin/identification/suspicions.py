# SPDX-License-Identifier: MIT
"""What speaks against an estimate from observations of any kind, and what would explain them."""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Iterator
from statistics import NormalDist
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.identification.fit import FALSE_ALARMS, UNKNOWN
from symkin.identification.hypotheses import (
    cause_in_words,
    frame_in_words,
    with_frames,
    with_readings,
)
from symkin.identification.problem import (
    KINDS,
    OBSERVED,
    JointOptions,
    Problem,
    Rows,
    without_pose,
)
from symkin.identification.unknowns import scalar_values
from symkin.measurements import DEVIATIONS
from symkin.result import Value, field, record
from symkin.symmetry.groups import detect_symmetry

if TYPE_CHECKING:
    from symkin.identification.fit import Fit
    from symkin.identification.joint import JointIdentification
    from symkin.measurements import Measurements

__all__ = [
    "Alternative",
    "Model",
    "alternatives_of",
    "blunder_limit",
    "blunders_of",
    "contradiction_of",
    "doubts_of",
    "estimated_noise",
    "exchanges_of",
    "help_in_words",
    "model_of",
    "models_of",
    "notes_of",
    "symptoms_of",
    "unseen_rms",
    "without_blunders",
]

Array = NDArray[np.float64]

_SUSPICIOUS = 3.5  # standard deviations, from which single rows are dropped
_NOISE_STEPS = 60
_STILL = 1e-3  # change of a noise's logarithm, in its own standard deviations
_FARTHEST_STEP = 1.0  # of a noise's logarithm
_NAMED = 3
_ALIKE = 1 - 1e-6  # of t: observations of a pose that nothing tells apart
_FOLDS = 5
_AS_GOOD = 9.0  # more of chi-square: an order of the legs that cannot be told from another
_TURNS = ("base.phi", "base.rz")


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
    options : JointOptions
        With which it is identified.
    """

    what: str
    statistic: float
    terms: int
    spare: int
    p_value: float
    limit: float
    options: JointOptions = field(private=True)

    @property
    def alarms(self) -> bool:
        """Whether the narrower model lacks what this one has."""
        return self.p_value < self.limit


class Blunder(NamedTuple):
    """An observation that does not fit: which of the rows, and how far."""

    row: int
    t: float
    size: float


def doubts_of(found: JointIdentification) -> Iterator[str]:
    """Say why not to trust an estimate, the worst first."""
    cause = cause_in_words(found.hypotheses)
    # What a mistake does to the estimate is not worth telling beside the mistake.
    yield from [cause] if cause else found.symptoms
    for leg in np.flatnonzero(np.isnan(found.measurements.readings).all(axis=0)).tolist():
        if any(name.startswith(f"leg{leg + 1}.") for name in found.names):
            yield f"leg {leg + 1} has no reading: its parameters stay where the priors have them"


def symptoms_of(found: JointIdentification) -> Iterator[str]:
    """Say what speaks against an estimate, whatever the cause, the worst first."""
    numbers = found.measurements.row_numbers
    aside = found.unexplained_rows
    if aside:
        shown = ", ".join(str(numbers[row]) for row in aside[:8])
        more = f" and {len(aside) - 8} more" if len(aside) > 8 else ""
        yield (
            f"no pose explains row{'s' * (len(aside) > 1)} {shown}{more}, which "
            f"{'is' if len(aside) == 1 else 'are'} left out"
        )
    yield from found.turns
    yield from _blunders_in_words(found)
    alarming = [each for each in found.alternatives if each.alarms]
    alarming.sort(key=lambda each: (each.p_value, -each.statistic))
    for kind in (("frames",), ("quadratic", "eccentric", "held")):
        # Each of these explains a part of what is due to another.
        yield from [_in_words(found, each) for each in alarming if each.what in kind][:1]
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
            f"(chi-square {found.chi_square:.4g} for {found.degrees_of_freedom} degrees of "
            f"freedom; expected at most {found.limit:.4g})"
        )
    elif found.chi_square < found.least:
        share = math.sqrt(found.chi_square / found.degrees_of_freedom)
        yield (
            f"the residuals are {share:.3g} times as large as the declared noise and the priors "
            f"lead to expect (chi-square {found.chi_square:.4g} for {found.degrees_of_freedom} "
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


def notes_of(found: JointIdentification) -> Iterator[str]:
    """Say what to know of an estimate."""
    if found.gauge:
        yield f"{found.gauge[0].upper()}{found.gauge[1:]}: parameters and deviations depend on it."
    silent = [each.name for each in found.unknowns if each.status.startswith("held by its prior")]
    if found.heights is not None:
        yield from found.heights.notes
    elif silent:
        yield (
            f"The data say next to nothing of {_listed(silent)}: what stands there is the prior."
        )
    if found.options.noise == "estimate":
        yield (
            "The noise was estimated from the same observations, so that chi-square says nothing "
            "of the model."
        )
    orders = [", ".join(str(leg + 1) for leg in order) for order in exchanges_of(found)]
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


def exchanges_of(found: JointIdentification) -> Iterator[tuple[int, ...]]:
    """Give other orders of the readings' columns that explain the observations as well.

    Such are symmetries of the drawing where nothing shows how the robot is turned: a place of its
    base that is unknown, or heights alone. One rotation and one mirror are tried for all.
    """
    turns = found.heights is not None or any(name in _TURNS for name in found.names)
    if not turns or not found.converged or found.symptoms:
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


def blunder_limit(found: JointIdentification) -> float:
    """Beyond which t any observation of a robot lies once in 1000 sound robots.

    Where all residuals are too large, one that is as large as the others is no blunder.
    """
    known = max(int(np.isfinite(found.rows.t).sum()), 1)
    return found.spread * NormalDist().inv_cdf(1 - FALSE_ALARMS / 2 / known)


def blunders_of(found: JointIdentification) -> list[Blunder]:
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


def alternatives_of(found: JointIdentification) -> list[Alternative]:
    """Fit wider models to the same observations: curved sensors, frames of their own.

    None without degrees of freedom to tell them apart.
    """
    options = found.options
    if not found.converged or found.degrees_of_freedom <= 0 or options.loss != "none":
        return []
    options = dataclasses.replace(options, noise=found.noise)
    wider: list[tuple[str, JointOptions, JointOptions]] = []
    if options.sensor == "linear" and found.mechanism.curvature is None:
        wider.append(("quadratic", options, dataclasses.replace(options, sensor="quadratic")))
        if found.nominal.reading_unit == "rad":
            wider.append(("eccentric", options, dataclasses.replace(options, sensor="eccentric")))
    if options.free is not None or options.fixed or options.shared:
        wider.append(("held", options, _all_free(options)))
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
    found: JointIdentification, what: str, narrow: JointOptions, wide: JointOptions
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
    terms = less.degrees_of_freedom - more.degrees_of_freedom
    if terms <= 0:  # priors came with them; held exactly, they gain no more than without priors
        terms = len(solved[1][0].layout.names) - len(solved[0][0].layout.names)
    spare = more.degrees_of_freedom
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


def _all_free(options: JointOptions) -> JointOptions:
    """The same with nothing held or shared but parts of frames."""
    fixed = tuple(each for each in options.fixed if each.partition(".")[0] in ("base", "target"))
    return dataclasses.replace(options, free=None, fixed=fixed, shared=())


def contradiction_of(found: JointIdentification) -> str:
    """Why an estimate did not converge that would if nothing was held; empty if that is not why."""
    options = found.options
    if options.free is None and not options.fixed and not options.shared:
        return ""
    wide = dataclasses.replace(
        _all_free(options), prior="tolerances", gauge="prior", noise=found.noise
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


def _most_moved(found: JointIdentification, problem: Problem, fit: _core.JointFit) -> str:
    """What of the held or shared moves most where it is free."""
    held = {each.name for each in found.unknowns if each.status.partition(",")[0] != "free"}
    layout = problem.layout
    free = (layout.column >= 0) & (layout.tolerances > 0)
    moves = np.abs(scalar_values(fit.setup) - scalar_values(problem.setup))[free]
    names = np.array(layout.scalars)[free]
    moved = sorted(zip(moves / layout.tolerances[free], names, strict=True), reverse=True)
    named = [f"{name} ({by:.2g} tolerances)" for by, name in moved if name in held]
    return ", ".join(named[:_NAMED])


def _in_words(found: JointIdentification, other: Alternative) -> str:
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
            f"all are free, which moves {moved}); free them{_help(found, other)}"
        )
    shape = {"quadratic": "bend", "eccentric": "err once a turn"}[other.what]
    return (
        f"the sensors are not straight, they {shape} ({evidence}); identify with "
        f"--sensor {other.what}{_help(found, other)}"
    )


def _help(found: JointIdentification, other: Alternative) -> str:
    models = found.model("identified"), found.model(other.what)
    before, after = (each.unseen_rms if each else math.nan for each in models)
    return help_in_words(before, after, found.nominal.space.closure_unit)


def _blunders_in_words(found: JointIdentification) -> Iterator[str]:
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


def _far_from_the_drawing(found: JointIdentification) -> Iterator[str]:
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


def without_blunders(
    problem: Problem,
) -> tuple[Problem, _core.JointFit, tuple[tuple[int, str], ...]]:
    """Drop single observations that do not fit, and poses of which more than one does not.

    Begins with a robust loss of poses. A pose whose chi-square stays too large without its
    worst observation is dropped as a whole: single rows of such a pose would mislead.
    """
    rejected: list[tuple[int, str]] = []
    space, loss = problem.mechanism.pose_space, problem.options.loss
    nearest = problem.options.gauge == "nominal"
    fit = problem.fit(nearest=nearest, loss="cauchy" if loss == "none" else loss)
    for _ in range(len(problem.measurements.poses)):
        rows = Rows.of(fit)
        changes: list[tuple[int, int]] = []  # pose, row of `rows` or -1 for all
        size = np.abs(np.nan_to_num(rows.t))
        for pose in np.unique(rows.pose[size > _SUSPICIOUS]).tolist():
            own = np.flatnonzero(rows.pose == pose)
            worst = int(own[np.argmax(size[own])])
            left = fit.conditions[pose] - 1
            rest = fit.chi_squares[pose] - rows.t[worst] ** 2
            sound = left > 0 and _core.chi_square_tail(max(rest, 0.0), left) > FALSE_ALARMS
            changes.append((pose, worst if sound or left == 0 else -1))
        if not changes:
            break
        measurements = problem.measurements
        for pose, row in changes:
            what = rows.what(row, space) if row >= 0 else "everything"
            measurements = _without(measurements, pose, rows, row)
            rejected.append((pose, what))
        problem = dataclasses.replace(problem, measurements=measurements)
        fit = problem.fit(nearest=nearest, loss="none")
    return problem, fit if rejected else problem.fit(nearest=nearest, loss="none"), tuple(rejected)


def _without(measurements: Measurements, pose: int, rows: Rows, row: int) -> Measurements:
    """Without one observation of a pose, or without all (-1)."""
    if row < 0:
        return without_pose(measurements, pose)
    kind, index = OBSERVED[rows.kind[row]], int(rows.index[row])
    changed = np.array(getattr(measurements, kind))
    values = changed[pose].reshape(-1)
    space = measurements.space
    whole = kind in ("poses", "reported") and space.has_quaternion and index >= space.size
    values[slice(space.size, None) if whole else index] = np.nan
    changes = {kind: changed}
    return dataclasses.replace(measurements, **changes)  # type: ignore[arg-type]


def estimated_noise(problem: Problem, fit: _core.JointFit) -> tuple[Problem, _core.JointFit]:
    """Estimate the noise of each kind of observation with the unknowns.

    Restricted maximum likelihood: at its maximum the sum of squared residuals of each kind, in
    standard deviations, is the sum of the redundancies of its rows. That is a fixed point which is
    iterated, at a new linearisation each time. Deviations that rows have of their own stay, and so
    does a noise that is declared as zero: exact.

    Where the observations hardly tell two kinds apart, as the readings of linear sensors and the
    poses, each iteration takes a small part of the way; the secants of the last ones take the rest
    (Anderson, J. ACM 12, 1965).
    """
    history: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for _ in range(_NOISE_STEPS):
        improved, change = _improved(problem, fit)
        if change >= _STILL:
            before = {name: getattr(problem.noise, name) for name in improved}
            logs = np.log(list(before.values()))
            history.append((logs, np.log(list(improved.values())) - logs))
            improved = dict(zip(before, np.exp(_extrapolated(history)).tolist(), strict=True))
        noise = dataclasses.replace(problem.noise, **improved)
        problem = dataclasses.replace(problem, noise=noise)
        fit = problem.fit(nearest=problem.options.gauge == "nominal")
        if change < _STILL:
            return problem, fit
    raise SymkinError(
        "the noise cannot be estimated from these observations, which do not tell its parts "
        f"apart (after {_NOISE_STEPS} steps: {problem.noise}); declare it"
    )


def _extrapolated(
    history: list[tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> NDArray[np.float64]:
    """Where the steps from the places in a history would end, to first order; never far away."""
    recent = history[-1 - len(history[-1][0]) :]
    places, steps = (np.array(each) for each in zip(*recent, strict=True))
    by_place, by_step = np.diff(places, axis=0), np.diff(steps, axis=0)
    shares = np.linalg.lstsq(by_step.T, steps[-1], rcond=1e-6)[0]
    way = steps[-1] - (by_place + by_step).T @ shares
    return np.asarray(places[-1] + np.clip(way, -_FARTHEST_STEP, _FARTHEST_STEP))


def _improved(problem: Problem, fit: _core.JointFit) -> tuple[dict[str, float], float]:
    """The next noise, and the largest change of a logarithm in its own standard deviations."""
    rows, taken = Rows.of(fit), problem.measurements
    positions = taken.space.size
    kinds = np.array(KINDS)[rows.kind]
    angular = (kinds == "pose") & (rows.index >= positions)
    groups = {
        "reading": kinds == "readings",
        "orientation": angular,
        "position": ~angular & (kinds != "readings") & (kinds != "reported pose"),
    }
    found, change = {}, 0.0
    for name, of_group in groups.items():
        declared = getattr(problem.noise, name)
        used = of_group & np.isfinite(rows.t) & (rows.t != 0) & _undeclared(taken, rows)
        if declared == 0 or not used.any():
            continue
        squares = (rows.residual[used] / declared) ** 2
        redundancy = float(np.sum(squares / rows.t[used] ** 2))
        factor = math.sqrt(float(squares.sum()) / redundancy)
        found[name] = declared * factor
        # A noise that nothing shows has no redundancy, and may shrink for ever.
        change = max(change, abs(math.log(factor)) * math.sqrt(2 * redundancy))
    if not found:
        raise SymkinError("no observation is redundant, so the noise cannot be estimated")
    return found, change


def _undeclared(taken: Measurements, rows: Rows) -> NDArray[np.bool_]:
    """Which rows have no standard deviation of their own."""
    free = np.ones(len(rows.pose), dtype=bool)
    for kind, name in enumerate(DEVIATIONS.values()):
        own = getattr(taken, name)
        if own is not None:
            of_kind = rows.kind == kind
            flat = own.reshape(len(own), -1)
            free[of_kind] = np.isnan(flat[rows.pose[of_kind], rows.index[of_kind]])
    return free


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
