# SPDX-License-Identifier: MIT
"""What may have been mistaken where anything is observed: each correction is tried by a refit.

Signs, order, zeros, gains and units of the readings, working modes, units and conventions of what
was observed, frames that nobody mentioned. All are judged alike: by chi-square with the drawing's
tolerances as priors, so that an estimate far from the drawing counts as much as residuals do.
"""

from __future__ import annotations

import dataclasses
import heapq
import itertools
import math
import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.workspace import best_homes
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, NotIdentifiableError, SymkinError, named_legs
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem, layout_of, observed_count
from symkin.estimate.reading_checks import Taken, nearer_other_root, turns_in_words, with_modes
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.model.mechanism import Mechanism
from symkin.model.poses import PoseSpace
from symkin.model.settings import NoiseSettings
from symkin.model.turns import turn_of
from symkin.values import Value, record

__all__ = [
    "Hypothesis",
    "cause_in_words",
    "explained",
    "frame_in_words",
    "hypotheses_of",
    "in_modes",
    "with_frames",
    "with_readings",
]

Array = NDArray[np.float64]
_Words = str | Callable[[_core.JointFit], str]  # which may depend on the fit

# Per degree of freedom: where observations lost what they say; with few degrees it may be chance.
_TOO_GOOD = 0.1
_FAR_TOO_GOOD = 0.01
_AS_GOOD = 20.0  # of chi-square: corrections that differ by less are not told apart
# Poses (without and with unknown frames) and steps of first looks, which what is mistaken does not
# survive, and how many do.
_LOOKS = ((2, 5, 4, 24), (12, 12, 6, 8))
_TESTS = 10  # of the first at least, by what is observed besides the coordinates of its poses
_HOPELESS = 1000.0  # times what another leaves that may well explain the data
_WIDER = 3  # times as many steps for what is further from its start
_SECOND = (40, 40)
_REJECTED = 0.5  # of a pose's weight: below it a loss rejects the pose
_ASIDE = 0.1  # share of the poses that may remain without explanation, if not one
_NAMED = 3
_FEW_LEGS = 4  # of which any combination is tried
_WIDE_GAIN = 1.0  # of the sensor's gain, where it is in question
# What a correction must leave less of chi-square than what is stated does, per degree of freedom.
_MUCH_BETTER = 9.0
_HUGE = 1000.0  # so much better suffices even if something else is wrong besides
_FACTORS = {
    180 / math.pi: "degrees that were stated as radians",
    math.pi / 180: "radians that were stated as degrees",
    2 * math.pi: "radians that were stated as turns",
    1 / (2 * math.pi): "turns that were stated as radians",
    1e-3: "metres that were stated as millimetres",
    1e3: "millimetres that were stated as metres",
}


@record
class Hypothesis(Value):
    """A mistake that may have been made, and what a refit says once it is corrected.

    Attributes
    ----------
    what : str
        The mistake in words; empty for everything being as it is stated.
    chi_square : float
        Of observations and tolerances together; infinite where no estimate was found. Of what is
        stated, the least that its solver reached from any start, converged or not.
    degrees_of_freedom : int or float
        Its degrees of freedom; 0 where no estimate was found.
    limit : float
        What chi-square exceeds in one of 1000 sound robots; 0 where no estimate was found.
    proposed : bool
        Whether it, or one that cannot be told from it, explains the data and what is stated does
        not.
    """

    what: str
    chi_square: float
    degrees_of_freedom: float
    limit: float
    proposed: bool

    @property
    def explained(self) -> bool:
        """Whether the declared noise explains what it leaves."""
        return self.chi_square <= self.limit

    @property
    def per_degree(self) -> float:
        """Chi-square per degree of freedom."""
        return self.chi_square / max(self.degrees_of_freedom, 1)


@dataclasses.dataclass(frozen=True, eq=False)
class _Model:
    """A robot and how it is fitted, with tolerances as priors; laid out once for all readings."""

    mechanism: Mechanism
    options: EstimateOptions

    def problem(self, measurements: Measurements, steps: int) -> Problem:
        """Of some measurements; errors are those of `identify`."""
        options = dataclasses.replace(self._options, max_iterations=steps)
        # The tolerance of a quadratic term depends on the readings.
        if options.sensor == "quadratic":
            problem = Problem.of(self.mechanism, measurements, options)
            return problem.with_layout(problem.layout.with_prior("tolerances"))
        return Problem.of(self.mechanism, measurements, options, self._layout)

    @cached_property
    def _options(self) -> EstimateOptions:
        given = self.options
        noise = given.noise if isinstance(given.noise, NoiseSettings) else None
        return dataclasses.replace(given, gauge="prior", loss="none", loss_per="pose", noise=noise)

    @cached_property
    def _layout(self) -> Layout:
        robot = self.mechanism
        nothing = np.zeros((0, len(robot.legs)))
        made = layout_of(robot, core_setup(robot), self._options, nothing)
        return made.with_prior("tolerances")


class _Correction(NamedTuple):
    """What to fit instead; `wide` counts unknowns besides."""

    words: _Words
    model: _Model
    measurements: Measurements
    wide: int = 0

    @property
    def mechanism(self) -> Mechanism:
        return self.model.mechanism

    @property
    def options(self) -> EstimateOptions:
        return self.model.options

    def of(self, words: _Words, mechanism: Mechanism, options: EstimateOptions) -> _Correction:
        """Of another robot, or fitted otherwise."""
        return self._replace(words=words, model=_Model(mechanism, options))

    def fit(
        self, steps: int, *, whole: bool = True, start: Array | None = None
    ) -> _core.JointFit | None:
        """With tolerances as priors; None where that has no solution, or not the `whole` of it."""
        try:
            fit = self.model.problem(self.measurements, steps).fit(start=start)
        except SymkinError:
            return None
        explained = len(fit.aside) <= max(_ASIDE * len(self.measurements.poses), 1)
        good = explained and fit.goodness.degrees_of_freedom > 0 and (fit.converged or not whole)
        # A closure does not know its leg's mode: what fits another robot than this is none of it.
        return (
            fit
            if good and not (_per_degree(fit) < _MUCH_BETTER and self._in_other_modes(fit))
            else None
        )

    def _in_other_modes(self, fit: _core.JointFit) -> bool:
        """Whether at fitted poses most readings of any leg are those of another mode."""
        measured = self.measurements
        try:
            robot = self.mechanism.with_parameters(fit.setup.parameters, symmetry=None)
        except SymkinError:  # the estimate is no mechanism
            return False
        taken = Taken(robot, robot, fit.poses, measured.readings, measured.row_numbers)
        other = nearer_other_root(taken)
        return any(
            other[rows, leg].sum() > len(rows) // 2
            for leg in range(other.shape[1])
            if len(rows := taken.rows(leg))
        )

    def look(self, poses: int, steps: int) -> float:
        """What comes first in a look at few poses: not where observations lost what they say."""
        value = _per_degree(
            self.some(poses).fit(_WIDER * steps if self.wide else steps, whole=False)
        )
        return value if value > _FAR_TOO_GOOD else math.inf

    def some(self, most: int) -> _Correction:
        """With few of the poses, evenly spread, and over the sets of the legs too."""
        order = np.argsort(self.measurements.leg_sets, kind="stable")
        count = len(order)
        places = np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))
        return self.subset(np.sort(order[places]))

    def subset(self, rows: NDArray[np.intp]) -> _Correction:
        """With some of the poses."""
        return self._replace(measurements=self.measurements.subset(rows))

    def not_rejected(self) -> NDArray[np.intp]:
        """Rows that the loss keeps; all unless it keeps most, of which a wrong robot has few."""
        every = np.arange(len(self.measurements.poses))
        try:
            fit = self.model.problem(self.measurements, _SECOND[1]).fit(loss=self.options.loss)
        except SymkinError:
            return every
        kept = np.flatnonzero(np.asarray(fit.loss_weights) >= _REJECTED)
        return kept if 2 * len(kept) > len(every) else every


@contextmanager
def explained(
    mechanism: Mechanism,
    measurements: Measurements,
    options: EstimateOptions,
    *,
    by_leg: bool = False,
) -> Iterator[None]:
    """Say of measurements that allow no estimate what may be wrong with them."""
    try:
        yield
    except SymkinError as error:
        # What is refused before anything is fitted says why itself.
        fitted = isinstance(error, FailedFitError) or (
            isinstance(error, NotIdentifiableError) and not by_leg
        )
        tried = hypotheses_of(mechanism, measurements, options, by_leg=by_leg) if fitted else ()
        words = cause_in_words(tried)
        if not words:
            raise
        # Its fields name directions, so the error stays the same object.
        error.args = (f"{error}. {words[0].upper()}{words[1:]}",)
        raise


def cause_in_words(tried: Sequence[Hypothesis]) -> str:
    """The corrections that are proposed, with what speaks for them; empty if none are.

    A doubt where even they leave what nothing explains.
    """
    proposed = [each for each in tried if each.proposed]
    if not proposed:
        return ""
    whole = all(each.explained for each in proposed)
    causes = ", or as well: ".join(each.what for each in proposed)
    after = max(each.per_degree for each in proposed)
    before = next(each.per_degree for each in tried if not each.what)
    evidence = f"so corrected, chi-square with the tolerances is {after:.3g} per degree of freedom"
    evidence += f", before {before:.3g}" if math.isfinite(before) else ", before none was found"
    if whole:
        return f"likely cause: {causes} ({evidence})"
    return (
        f"part of what is wrong may be: {causes} ({evidence}; that is more than the noise explains)"
    )


def hypotheses_of(
    nominal: Mechanism,
    measurements: Measurements,
    options: EstimateOptions,
    *,
    by_leg: bool = False,
) -> tuple[Hypothesis, ...]:
    """Try corrections of what people mistake most often, the best first.

    Each is tried on a few of the poses, what comes out best on more, and the best on all. What
    explains the data as well as another but has unknowns besides is left to the other. Two at once
    are tried where one does not explain the data, or only a part: then with that one. That of no
    mistake is among them.
    """
    if by_leg:
        # Full poses are in the robot's own frame, and a mistake shows in all that was read there.
        nominal = nominal.replace(frames=None)
        options = dataclasses.replace(options, poses="all")
    stated = _Correction("", _Model(nominal, options), measurements)
    alone = _judged(stated, _corrections(stated))
    proposed = [each for each in alone if each.proposed]
    before = next(each.per_degree for each in alone if not each.what)
    if max((each.per_degree for each in proposed), default=before) < _MUCH_BETTER:
        return alone
    # Of so many some are much less bad than a great mistake; what they leave has to be little.
    pairs = _judged(stated, _pairs(stated, {each.what for each in proposed}))
    found = (each.per_degree for each in pairs if each.proposed)
    return pairs if max(found, default=math.inf) < _MUCH_BETTER else alone


def _judged(stated: _Correction, corrections: Iterable[_Correction]) -> tuple[Hypothesis, ...]:
    """What is stated and the best of corrections, each with what it leaves, the best first."""
    told = observed_count(stated.measurements) - stated.mechanism.space.dof
    enough = math.ceil(_TESTS / max(float(told.mean()), _TESTS / _LOOKS[-1][0]))
    for number, framed, steps, followed in _LOOKS:
        looks = (
            (each.look(max(framed if each.options.frames else number, enough), steps), each)
            for each in corrections
        )
        best = heapq.nsmallest(followed, looks, key=operator.itemgetter(0))
        least = min((value for value, _ in best), default=math.inf)
        most = _HOPELESS * max(least, 1.0) if least < _MUCH_BETTER else math.inf
        corrections = [each for value, each in best if value <= most]
    poses, steps = _SECOND
    tried = [(each, each.some(poses).fit(steps)) for each in corrections]
    rivals = _rivals(tried)
    if rivals and stated.options.loss != "none":
        sound = rivals[0].not_rejected()
        stated, *rivals = (each.subset(sound) for each in (stated, *rivals))
    settled = [(each, fit) for each in rivals if (fit := each.fit(_SECOND[1]))]
    named = {id(each) for each in _rivals(settled)}
    as_stated = _as_stated(stated, [fit for each, fit in settled if id(each) in named])
    hypotheses = [_told(stated, as_stated)]
    for each, fit in settled:
        proposed = id(each) in named and _explains(fit, as_stated)
        hypotheses.append(_told(each, fit, proposed=proposed))
    kept = {id(each) for each in rivals}
    hypotheses += [_told(each, fit) for each, fit in tried if fit and id(each) not in kept]
    return tuple(sorted(hypotheses, key=lambda each: (not each.proposed, each.per_degree)))


def _as_stated(stated: _Correction, corrected: Sequence[_core.JointFit]) -> _core.JointFit | None:
    """What is stated, at the best that its solver reaches, or None.

    From its own start, and from the poses that corrections found: that it did not converge, or to
    no good end, is no evidence of the mistake. Most corrections set more free than is stated, and
    would be proposed for a sound robot whose own start was poor.
    """
    best = stated.fit(_SECOND[1], whole=False)
    for fit in corrected:
        if _explains(fit, best):
            again = stated.fit(_SECOND[1], whole=False, start=fit.poses)
            best = min(best, again, key=_per_degree)
    return best


def _explains(fit: _core.JointFit, as_stated: _core.JointFit | None) -> bool:
    """Whether a correction explains what is not explained as it is stated.

    If it explains only a part, so much less must be left by the measurements: a robot that shrinks
    until nothing matters is as little worse than any nonsense as its tolerances make it.
    """
    after, before = _per_degree(fit), _per_degree(as_stated)
    if after * _MUCH_BETTER >= before:
        return False
    by_residuals = float(np.nansum(fit.chi_squares)) > fit.goodness.chi_square / 2
    return after < _MUCH_BETTER or (by_residuals and math.inf > before > after * _HUGE)


def _rivals(tried: Iterable[tuple[_Correction, _core.JointFit | None]]) -> list[_Correction]:
    """The best correction, and those that the data do not tell from it; none if these are many."""
    found = [
        (each, fit.goodness.chi_square, _per_degree(fit))
        for each, fit in tried
        if fit and _per_degree(fit) > _TOO_GOOD
    ]
    if not found:
        return []
    _, least, share = min(found, key=lambda each: each[1])
    # Where the model lacks something, all are worse by as much.
    found.sort(key=lambda each: each[1])
    near = [each for each, value, _ in found if value <= least + _AS_GOOD * max(share, 1.0)]
    fewest = min(each.wide for each in near)
    # The same correction may have been tried from several starts.
    rivals = {each.words: each for each in reversed(near) if each.wide == fewest}
    return list(rivals.values()) if len(rivals) <= _NAMED else []


def _per_degree(fit: _core.JointFit | None) -> float:
    return math.inf if fit is None else fit.goodness.chi_square / fit.goodness.degrees_of_freedom


def _told(
    correction: _Correction, fit: _core.JointFit | None, *, proposed: bool = False
) -> Hypothesis:
    words = correction.words
    if not isinstance(words, str):
        words = "" if fit is None else words(fit)
    return Hypothesis(
        what=words,
        chi_square=math.inf if fit is None else fit.goodness.chi_square,
        degrees_of_freedom=0 if fit is None else fit.goodness.degrees_of_freedom,
        limit=0.0 if fit is None else fit.goodness.limit,
        proposed=proposed,
    )


def _corrections(stated: _Correction) -> Iterator[_Correction]:
    yield from itertools.chain.from_iterable(kind(stated) for kind in _KINDS)
    yield from _sensors(stated)
    options = stated.options
    if options.free is not None or options.fixed or options.shared:
        yield stated.of(
            "parameters that are held or shared are not as they are said to be: free them",
            stated.mechanism,
            dataclasses.replace(options, free=None, fixed=(), shared=()),
        )


def _pairs(stated: _Correction, parts: Collection[str] = ()) -> Iterator[_Correction]:
    """Two corrections of different kinds at once, without what has more unknowns.

    If corrections are known to be `parts` of what is wrong, pairs with one of them.
    """
    for number, kind in enumerate(_KINDS):
        for one in kind(stated):
            for other in itertools.chain.from_iterable(each(one) for each in _KINDS[number + 1 :]):
                words = {each for each in (one.words, other.words) if isinstance(each, str)}
                # Words that depend on the fit may be those of a part.
                if not parts or len(words) < 2 or not words.isdisjoint(parts):
                    yield other._replace(words=_both(one.words, other.words))


def _both(one: _Words, other: _Words) -> _Words:
    if isinstance(one, str) and isinstance(other, str):
        return f"{one}; with that corrected, {other}"
    return lambda fit: "; with that corrected, ".join(
        words if isinstance(words, str) else words(fit) for words in (one, other)
    )


def _sets(count: int, *, alone: bool = False) -> list[tuple[int, ...]]:
    """Legs that a mistake may be of: any of few legs, one or all of many or if it comes `alone`."""
    if alone or count > _FEW_LEGS:
        return [(leg,) for leg in range(count)] + [tuple(range(count))] * (count > 1)
    every = range(1, count + 1)
    return [legs for size in every for legs in itertools.combinations(range(count), size)]


def with_readings(measured: Measurements, change: Callable[[Array], Array]) -> Measurements:
    """With other readings; their standard deviations change as differences of readings do."""
    changes: dict[str, Array] = {"readings": change(np.array(measured.readings))}
    if measured.reading_deviations is not None:
        nothing = np.zeros_like(measured.reading_deviations)
        moved = change(np.array(measured.reading_deviations)) - change(nothing)
        changes["reading_deviations"] = np.abs(moved)
    return dataclasses.replace(measured, **changes)  # type: ignore[arg-type]


def _with_readings(
    stated: _Correction, words: str, change: Callable[[Array], Array]
) -> _Correction:
    return stated._replace(words=words, measurements=with_readings(stated.measurements, change))


def _orders(stated: _Correction) -> Iterator[_Correction]:
    """The columns of the readings in another order: any of few, of many two exchanged."""
    count = stated.measurements.readings.shape[1]
    own = tuple(range(count))
    orders = set(itertools.permutations(own)) if count <= _FEW_LEGS else {own[::-1]}
    for i, j in itertools.combinations(own, 2):
        orders.add(tuple(j if leg == i else i if leg == j else leg for leg in own))
    orders |= {own[shift:] + own[:shift] for shift in own}
    for order in sorted(orders - {own}):
        moved = [leg for leg in own if order[leg] != leg]
        columns = ", ".join(str(order[leg] + 1) for leg in moved)
        words = f"the readings of {named_legs(moved)} are in the columns of legs {columns}"
        yield _with_readings(stated, words, operator.itemgetter((slice(None), order)))


def _modes(stated: _Correction) -> Iterator[_Correction]:
    nominal = stated.mechanism
    modes = nominal.working_modes
    home = nominal.inverse_kinematics(nominal.home[None])
    for legs in _sets(len(modes)):
        flipped = [-mode if leg in legs else mode for leg, mode in enumerate(modes)]
        parts = []
        for mode in (-1, 1):
            own = [leg for leg in legs if flipped[leg] == mode]
            if own:
                verb = "stands" if len(own) == 1 else "stand"
                parts.append(
                    f"{named_legs(own)} {verb} in working mode {mode:+d}: set working_mode = {mode}"
                )
        for robot in in_modes(nominal, flipped):
            # A chain with one root does not care.
            if not np.array_equal(robot.inverse_kinematics(nominal.home[None]), home):
                yield stated.of("; ".join(parts), robot, stated.options)


def in_modes(mechanism: Mechanism, modes: Sequence[int]) -> list[Mechanism]:
    """The mechanism in other working modes, with a home on either side of the singularities.

    Its own home, as long as the new modes leave it a good one.
    """
    robot = with_modes(mechanism, list(modes))
    settings = robot.workspace
    if settings is None:
        return [robot]
    condition = robot.singularity_measures(robot.home[None])[2][0]
    if condition <= settings.conditioning_limit:
        return [robot]
    return [
        robot.replace(workspace=dataclasses.replace(settings, home=tuple(home)))
        for home, _ in best_homes(robot)
    ]


def _changed(legs: Sequence[int], change: Callable[[Array], Array]) -> Callable[[Array], Array]:
    def of_all(values: Array) -> Array:
        values[:, legs] = change(values[:, legs])
        return values

    return of_all


def _signs(stated: _Correction) -> Iterator[_Correction]:
    for legs in _sets(stated.measurements.readings.shape[1]):
        words = f"the readings of {named_legs(legs)} have the opposite sign"
        yield _with_readings(stated, words, _changed(legs, np.negative))


def _units(stated: _Correction) -> Iterator[_Correction]:
    for legs in _sets(stated.measurements.readings.shape[1], alone=True):
        for factor, unit in _FACTORS.items():
            if ("metres" in unit) == (stated.mechanism.reading_unit == "m"):
                words = f"the readings of {named_legs(legs)} look like {unit}"
                yield _with_readings(stated, words, _changed(legs, partial(_over, factor)))


def _half_turns(stated: _Correction) -> Iterator[_Correction]:
    nominal = stated.mechanism
    for legs in _sets(stated.measurements.readings.shape[1], alone=True):
        turns = [turn_of(nominal, leg) for leg in legs]
        if None not in turns:
            words = (
                f"the sensor{'s' * (len(legs) > 1)} of {named_legs(legs)} "
                f"{'was' if len(legs) == 1 else 'were'} set to zero {turns_in_words(0.5)} off the "
                "drawing's zero"
            )
            half = np.array(turns, dtype=float) / 2
            yield _with_readings(stated, words, _changed(legs, partial(np.add, -half)))


def _over(factor: float, values: Array) -> Array:
    return values / factor


def _sensors(stated: _Correction) -> Iterator[_Correction]:
    """Gains and zeros that the tolerances do not explain, of one leg or of all."""
    nominal, count = stated.mechanism, stated.measurements.readings.shape[1]
    gains = nominal.sensor_gains
    named = list(nominal.parameter_names)
    angular = np.array([nominal.leg_info(leg).reading_unit == "rad" for leg in range(count)])
    # Gains of angles are compared with each other, and so are those of lengths.
    largest = [np.abs(gains[angular == each]).max() for each in angular]
    widths = {
        "sensor_gain": _WIDE_GAIN * np.array(largest),
        "sensor_offset": np.where(angular, math.pi, nominal.characteristic_length),
    }

    def words(legs: Sequence[int], name: str) -> Callable[[_core.JointFit], str]:
        def of(fit: _core.JointFit) -> str:
            found = fit.setup.parameters[list(legs), named.index(name)]
            drawn = nominal.parameters[list(legs), named.index(name)]
            if name == "sensor_gain":
                rates = ", ".join(f"{rate:.3g}" for rate in drawn / found)
                return (
                    f"the readings of {named_legs(legs)} grow {rates} times as fast as the "
                    "drawing's: sensor_gain or the unit is wrong"
                )
            shifts = ", ".join(f"{shift:+.3g}" for shift in (drawn - found) / gains[list(legs)])
            return (
                f"the sensor{'s' * (len(legs) > 1)} of {named_legs(legs)} "
                f"{'was' if len(legs) == 1 else 'were'} set to zero {shifts} "
                f"{nominal.reading_unit} off the drawing's zero: identify with a wide prior of "
                "sensor_offset"
            )

        return of

    given = {} if stated.options.prior in (None, "tolerances") else stated.options.prior
    if isinstance(given, str):
        return
    for legs in _sets(count, alone=True):
        for name, width in widths.items():
            if name in named:
                wide = {f"leg{leg + 1}.{name}": float(width[leg]) for leg in legs}
                priors = {**given, **wide}
                options = dataclasses.replace(stated.options, prior=priors)
                made = stated.of(words(legs, name), nominal, options)
                yield made._replace(wide=len(legs))


def _observed(stated: _Correction) -> Iterator[_Correction]:
    """What was observed in another unit or convention."""
    measured = stated.measurements
    for factor, unit in ((1e-3, "millimetres"), (1e3, "a thousandth of what they should be")):
        lengths = _scaled(measured, factor)
        if lengths is not None:
            words = f"lengths that were observed are {unit}" + ", not metres" * (factor < 1)
            yield stated._replace(words=words, measurements=lengths)
    for words, poses in _conventions(stated.mechanism, measured.poses):
        if not np.array_equal(poses, measured.poses, equal_nan=True):
            made = dataclasses.replace(measured, poses=poses)
            yield stated._replace(words=f"in the measured poses {words}", measurements=made)


def _conventions(nominal: Mechanism, poses: Array) -> Iterator[tuple[str, Array]]:
    """Ways in which poses may have been written down."""
    # A mirrored rotation keeps the component of its axis along the mirror's normal.
    rotations: dict[str, tuple[int, ...]] = {
        "x is mirrored": (1, -1, -1, 1),
        "y is mirrored": (-1, 1, -1, 1),
        "z is mirrored": (-1, -1, 1, 1),
        "the quaternions turn the other way (base to platform)": (-1, -1, -1, 1),
    }
    conventions: dict[str, dict[str, tuple[int, ...]]] = {
        "planar": {"y is mirrored": (1, -1, -1), "x is mirrored": (-1, 1, -1)},
        "point": {"y is mirrored": (1, -1), "x is mirrored": (-1, 1)},
        "translating": {
            "x is mirrored": (-1, 1, 1),
            "y is mirrored": (1, -1, 1),
            "z is mirrored": (1, 1, -1),
        },
        "spherical": rotations,
    }
    positions = conventions["translating"]
    conventions["spatial"] = {
        words: positions.get(words, (1, 1, 1)) + signs for words, signs in rotations.items()
    }
    for words, factors in conventions[nominal.pose_space].items():
        yield words, poses * np.array(factors, dtype=float)
    if nominal.pose_space == "planar":
        yield "the angle has the opposite sign", poses * np.array([1.0, 1.0, -1.0])
        yield "angles are degrees, not radians", poses * np.array([1.0, 1.0, math.pi / 180])
    if nominal.space.has_quaternion:
        position = nominal.space.size
        scalar_last = np.hstack([poses[:, :position], np.roll(poses[:, position:], -1, axis=1)])
        yield "the quaternions are in the order w, x, y, z", scalar_last


def _scaled(measured: Measurements, factor: float) -> Measurements | None:
    """With other lengths, but for what a controller reports; None without any that have a unit."""
    size = measured.space.size
    changes: dict[str, Array] = {}
    for name in ("poses", "pose_deviations"):
        if getattr(measured, name) is not None:
            changes[name] = np.array(getattr(measured, name))
            changes[name][:, :size] *= factor
    for kind in ("point", "distance", "height"):
        for name in (f"{kind}s", f"{kind}_deviations"):
            if getattr(measured, name) is not None:
                changes[name] = factor * getattr(measured, name)
    lengths = (
        np.abs(values[:, :size] if name == "poses" else values)
        for name, values in changes.items()
        if not name.endswith("_deviations")
    )
    known = np.concatenate([each[np.isfinite(each)] for each in lengths])
    # Heights where a probe touches are zero in any unit: a wrong one would only become small.
    if not len(known) or np.median(known) == 0:
        return None
    return dataclasses.replace(measured, **changes)  # type: ignore[arg-type]


def _frames(stated: _Correction) -> Iterator[_Correction]:
    options = with_frames(stated.mechanism, stated.measurements, stated.options)
    if options is None:
        return

    def words(fit: _core.JointFit) -> str:
        return frame_in_words(stated.mechanism.space, fit.setup.base, stated.options, options)

    yield stated.of(words, stated.mechanism, options)


def with_frames(
    mechanism: Mechanism, measurements: Measurements, options: EstimateOptions
) -> EstimateOptions | None:
    """The same with unknown frames of device and target; None where these cannot be found."""
    space = mechanism.space
    if options.frames or not np.isfinite(measurements.poses[:, : space.size or None]).any():
        return None
    # A target on a platform that never turns does what the base's frame does.
    if not space.turns:
        return dataclasses.replace(options, frames=("base",))
    fixed = options.fixed
    if not np.isfinite(measurements.poses[:, space.size :]).any():
        fixed += ("target.phi",) if len(space.rotation) == 1 else ("target.r?",)
    return dataclasses.replace(options, frames=("base", "target"), fixed=fixed)


def frame_in_words(
    space: PoseSpace,
    base: _core.Frame,
    stated: EstimateOptions,
    framed: EstimateOptions,
    why: str = "",
) -> str:
    """That the measurements have a frame of their own, how far it is off, and what to ask for."""
    shift = ", ".join(f"{1e3 * value:.3g}" for value in base.position)
    moved = f"shifted by about ({shift}) mm and " if space.moves else ""
    cosine = np.clip((np.trace(base.rotation) - 1) / 2, -1, 1)
    asked = [f"--frames {frame}" for frame in framed.frames]
    asked += [f"--fixed {name}" for name in framed.fixed if name not in stated.fixed]
    return (
        f"the frame of the measurements is not the drawing's{why}: {moved}turned by about "
        f"{np.degrees(np.arccos(cosine)):.3g} degrees; identify with {' '.join(asked)}"
    )


# Those of a pair are made in this order.
_KINDS = (_orders, _modes, _signs, _units, _half_turns, _observed, _frames)
