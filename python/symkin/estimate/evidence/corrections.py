# SPDX-License-Identifier: MIT
"""What may have been mistaken where anything is observed: each correction is tried by a refit.

Signs, order, zeros, gains and units of the readings, working modes, units and conventions of what
was observed, frames that nobody mentioned. All are judged alike: by chi-square with the drawing's
tolerances as priors, so that an estimate far from the drawing counts as much as residuals do.
"""

from __future__ import annotations

import dataclasses
import functools
import heapq
import itertools
import math
import operator
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import ClassVar

import numpy as np

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, NotIdentifiableError, SymkinError
from symkin.estimate.evidence.bodies import AsPoses, exchanged_points, with_points_in_order
from symkin.estimate.evidence.computed import rows_not_measured, without_computed
from symkin.estimate.evidence.edits import corrections_of, pairs_of
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.look_alikes import look_alikes
from symkin.estimate.evidence.measured import copied_columns, taken_as_drawn
from symkin.estimate.evidence.numbers import numbers_of_the_drawing
from symkin.estimate.evidence.residuals import BETTER
from symkin.estimate.evidence.screen import FIRST, Screen, ShortList, agrees, leaves_noise
from symkin.estimate.evidence.standing import what_stands_still
from symkin.estimate.evidence.trial import LITTLE, SECOND, Correction, Statement, per_degree
from symkin.estimate.evidence.watching import is_watched
from symkin.estimate.fit import LOOK_FOR
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import spare_conditions
from symkin.model.mechanism import Mechanism
from symkin.model.turns import turn_of
from symkin.values import Value, field, record

_TOO_GOOD = 0.1  # per degree of freedom; with few degrees it may be chance
# Causes that say of a parameter of some legs that the drawing has it wrong.
_OF_THE_DRAWING = {"gain": "sensor_gain", "zero": "sensor_offset"}
_EXPLAINED = 3.0  # per degree of freedom, at most, of what is named as the cause
# Poses (without and with unknown frames) and steps of first looks, which what is mistaken does not
# survive, and how many do.
_LOOKS = ((2, 5, 4, 24), (12, 12, 6, 8))
_ALONE = 6.0  # columns that a screened correction costs as much as, whatever the robot
_A_LOOK = 5 / 3  # columns that a look costs as much as, of a robot with one leg
_A_NUMBER = 1 / 3  # of them, that a number of the legs adds where they have many
_TESTS = 10  # of the first at least, by what is observed besides the coordinates of its poses
_HOPELESS = 100.0  # times what another leaves, itself less than that per degree
_NAMED = 4
_BEGUN = 12  # steps, after which it shows what may come to rest,
_FOLLOWED = 4  # and how many of what has not are followed
_GREAT = 100.0  # per degree: of two mistakes of the table at least one leaves more
_HUGE = 1000.0  # times better suffices even if something else is wrong besides


@record
class Hypothesis(Value):
    """A mistake that may have been made, and what a refit says once it is corrected.

    Attributes
    ----------
    cause : Doubt or None
        The mistake; None for everything being as it is stated, and where no estimate was found that
        would tell.
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
    table : Measurements or None
        The measurements as it corrects them; None if it leaves them as they are.
    drawing : Mechanism or None
        The mechanism as it corrects that; None if it leaves it as it is.
    """

    derived: ClassVar[tuple[str, ...]] = ("what",)

    cause: Doubt | None = field(private=True)
    chi_square: float
    degrees_of_freedom: float
    limit: float
    proposed: bool
    table: Measurements | None = field(private=True, compare=False, repr=False, default=None)
    drawing: Mechanism | None = field(private=True, compare=False, repr=False, default=None)

    @property
    def what(self) -> str:
        """The mistake in words; empty for everything being as it is stated."""
        return "" if self.cause is None else self.cause.words

    @property
    def explained(self) -> bool:
        """Whether the declared noise explains what it leaves."""
        return self.chi_square <= self.limit

    @property
    def per_degree(self) -> float:
        """Chi-square per degree of freedom."""
        return self.chi_square / max(self.degrees_of_freedom, 1)


@dataclasses.dataclass
class Budget:
    """What may be spent on looking for causes, counted so that the answer depends on no clock.

    Attributes
    ----------
    left : float
        What a screened correction costs, a column of readings of it; besides it costs as much as
        some columns. One at whose poses there has to be a look costs as the square of the legs, or
        as their numbers, where these are many. As many as there are for a hexapod, of two
        corrections at once too, if they are screened.
    spent : bool
        Whether it did not do for everything.
    """

    left: float = 2e4
    spent: bool = False

    def of(
        self, corrections: Iterable[Correction], robot: Mechanism, *, screened: bool
    ) -> Iterator[Correction]:
        """As many of them as there is a budget for."""
        legs = len(robot.legs)
        look = max(_A_LOOK * legs**2, _A_NUMBER * robot.parameters.size)
        for each in corrections:
            self.left -= _ALONE + legs if screened else look
            if self.left < 0:
                self.spent = True
                return
            yield each


# Tables that are mended of what they say themselves.
_MENDED = {"rows-computed": without_computed, "points-exchanged": with_points_in_order}
Shaped = Callable[[Mechanism, Measurements, EstimateOptions], bool]


def _perhaps(*_: object) -> bool:
    return True


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
        if not isinstance(error, (FailedFitError, NotIdentifiableError)):
            raise
        tried: tuple[Hypothesis, ...] = ()
        try:
            plain = itertools.chain(
                rows_not_measured(mechanism, measurements),
                what_stands_still(mechanism, measurements, (mechanism, options)),
                copied_columns(taken_as_drawn(mechanism, measurements)),
                exchanged_points(mechanism, measurements),
            )
            cause = next(plain, None)
            if cause is None:
                tried = hypotheses_of(mechanism, measurements, options, by_leg=by_leg)
                cause = likely_cause(tried)
        except KeyboardInterrupt:
            if not is_watched():
                raise
            error.args = (f"{error}; Ctrl-C ended the search for a cause",)
            raise error from None
        if cause is None:
            raise
        error.likely_cause, words = cause, str(cause)
        error.corrected, error.redrawn = corrected_by(tried)
        if cause.code in _MENDED:
            error.corrected = _MENDED[cause.code](mechanism, measurements)
        if error.redrawn is not None:
            error.redrawn = error.redrawn.replace(frames=mechanism.frames)
        said = str(error).removesuffix(f". {LOOK_FOR.capitalize()}").removesuffix(f"; {LOOK_FOR}")
        # Its fields name directions, so the error stays the same object.
        error.args = (f"{said}. {words[0].upper()}{words[1:]}",)
        raise


def likely_cause(tried: Sequence[Hypothesis]) -> Doubt | None:
    """The corrections that are proposed, with what speaks for them; None if none are.

    A part of what is wrong where even they leave what nothing explains.
    """
    proposed = [each for each in tried if each.proposed and each.cause is not None]
    causes = [each.cause for each in proposed if each.cause is not None]
    if not causes:
        return None
    before = next(each.per_degree for each in tried if not each.what)
    after = max(each.per_degree for each in proposed)
    whole = all(each.explained for each in proposed)
    return causes[0].as_cause(causes[1:], before, after, whole=whole)


def corrected_by(tried: Sequence[Hypothesis]) -> tuple[Measurements | None, Mechanism | None]:
    """Table and drawing as the one cause that explains all corrects them, if there is one."""
    proposed = [each for each in tried if each.proposed and each.cause is not None]
    if len(proposed) != 1 or not proposed[0].explained:
        return None, None
    return proposed[0].table, proposed[0].drawing


def hypotheses_of(
    nominal: Mechanism,
    measurements: Measurements,
    options: EstimateOptions,
    *,
    by_leg: bool = False,
    budget: Budget | None = None,
    shaped: Shaped = _perhaps,
) -> tuple[Hypothesis, ...]:
    """Try corrections of what people mistake most often, the best first.

    Each is tried on a few of the poses, what comes out best on more, and the best on all. What
    explains the data as well as another but has unknowns besides is left to the other. Two at once
    are tried where one does not explain the data, or only a part: then with that one. That of no
    mistake is among them. `shaped`: whether what is so estimated leaves residuals of a shape that
    no parameter gives them; asked of corrections that set more free and explain the data otherwise.
    """
    if body := AsPoses.of(nominal, measurements, options):
        asked = body.mechanism, body.measurements, body.options
        return tuple(
            _of_points(body, each) for each in hypotheses_of(*asked, budget=budget, shaped=shaped)
        )
    if by_leg:
        # Full poses are in the robot's own frame, and a mistake shows in all that was read there.
        nominal = nominal.replace(frames=None)
        options = dataclasses.replace(options, poses="all")
    stated = Correction(_as_it_is, Statement(nominal, options), measurements)
    budget = budget or Budget()
    screen = Screen.of(stated)
    tried = budget.of(corrections_of(stated), nominal, screened=screen is not None)
    listed = screen.short_list(stated, tried) if screen else _looked_at(stated, tried)
    if not listed.explains:
        numbers = budget.of(numbers_of_the_drawing(stated), nominal, screened=False)
        listed = listed._replace(open=(*listed.open, *numbers))
    alone = _judged(stated, listed, shaped)
    proposed = [each for each in alone if each.proposed]
    before = next(each.per_degree for each in alone if each.cause is None)
    if max((each.per_degree for each in proposed), default=before) < LITTLE:
        return alone
    # Too many to be named may each explain the data, and a second mistake is none then.
    if any(each.explained and each.per_degree > _TOO_GOOD for each in alone):
        return alone
    if before < _GREAT or agrees(stated, screen):
        return alone
    # Of so many some are much less bad than a great mistake; what they leave has to be little.
    parts = {each.what for each in proposed}
    pairs_first = pairs_of(stated, parts, listed.first)
    tried = budget.of(pairs_first, nominal, screened=screen is not None)
    listed = screen.short_list(stated, tried) if screen else _looked_at(stated, tried)
    pairs = _judged(stated, listed, shaped)
    found = (each.per_degree for each in pairs if each.proposed)
    return pairs if max(found, default=math.inf) < LITTLE else alone


def _of_points(body: AsPoses, of_poses: Hypothesis) -> Hypothesis:
    """What was tried of poses, of the points that they come from."""
    cause, table = of_poses.cause, of_poses.table
    if cause is None:
        return of_poses
    told = body.told(cause)
    return dataclasses.replace(
        of_poses,
        cause=told or cause,
        proposed=of_poses.proposed and told is not None,
        table=None if table is None else body.table(cause, table),
    )


def _judged(stated: Correction, listed: ShortList, shaped: Shaped) -> tuple[Hypothesis, ...]:
    """What is stated and the best of corrections, each with what it leaves, the best first."""
    corrections = [each for _, each in listed.likely]
    still = listed.open
    if listed.explains:  # a turned frame may do what columns do in another order
        own = {each.cause.code for each in corrections if isinstance(each.cause, Doubt)}
        framed = [each for each in still if each.options.frames and not stated.options.frames]
        still = tuple(framed) if "columns-exchanged" in own else ()
    corrections += _looked_through(stated, still, _LOOKS)
    poses = SECOND[0]
    if any(each.left_out for each in corrections):  # of which few poses may have none
        poses = len(stated.measurements.poses)
    tried = _with_redrawn(_fitted(corrections, poses), poses)
    known = {id(each): fit for each, fit in tried if len(each.measurements.poses) <= poses}
    rivals = _rivals(tried)
    tables = {each.key: each.measurements for each in rivals}
    unchanged = stated.measurements
    if rivals and stated.options.loss != "none":
        sound = rivals[0].not_rejected()
        stated, *rivals = (each.subset(sound) for each in (stated, *rivals))
    again = [(each, known.get(id(each)) or each.fit(SECOND[1])) for each in rivals]
    settled = [(each, fit) for each, fit in again if fit]
    named = {id(each) for each in _rivals(settled)}
    as_stated = _as_stated(stated, [fit for each, fit in settled if id(each) in named])
    hypotheses = [_told(stated, as_stated)]
    for each, fit in settled:
        freed, table = each.options is not stated.options, tables[each.key]
        told = _told(each, fit, table=None if table is unchanged else table)
        told = dataclasses.replace(told, drawing=_redrawn(stated, each, fit, told))
        cause = told.cause
        if cause is not None and cause.code == "zero-half-a-turn-off" and not cause.then:
            turned = _with_zeros_turned(stated.mechanism, list(cause.legs), unchanged)
            if turned is not None:
                told = dataclasses.replace(told, drawing=turned, table=None)
        # A number that the drawing has wrong has to leave nothing else.
        may_be = id(each) in named and (told.explained or not each.redrawn)
        more = freed or each.redrawn
        explains = may_be and _explains(fit, as_stated, freed=more, weak=not more)
        if may_be and more and not explains:
            of_sensor = told.cause is not None and told.cause.code in _OF_THE_DRAWING
            options = stated.options if of_sensor else each.options
            asked = told.drawing or each.mechanism, table, options
            explains = _explains(fit, as_stated, weak=True) and not shaped(*asked)
        hypotheses.append(dataclasses.replace(told, proposed=explains))
    kept = {id(each) for each in rivals}
    found = [each for each in rivals if id(each) in named]
    if any(each.options is not stated.options or each.redrawn for each in found):
        hypotheses = _with_look_alikes(stated, hypotheses, [fit for _, fit in settled])
    hypotheses += [_told(each, fit) for each, fit in tried if fit and id(each) not in kept]
    return tuple(sorted(hypotheses, key=_rank))


def _rank(hypothesis: Hypothesis) -> tuple[bool, bool, float]:
    """What is proposed comes first, and of that what happens more often than a wrong drawing."""
    cause, proposed = hypothesis.cause, hypothesis.proposed
    drawn = proposed and cause is not None and cause.code == "drawn-wrong"
    return not proposed, drawn, hypothesis.per_degree


def _with_look_alikes(
    stated: Correction, hypotheses: list[Hypothesis], settled: Sequence[_core.JointFit]
) -> list[Hypothesis]:
    """With what explains as well what parameters that are set free do, or better."""
    proposed = [each for each in hypotheses if each.proposed]
    if not proposed:
        return hypotheses
    every = len(stated.measurements.poses)
    tried = (_told(*each, proposed=True) for each in _fitted(look_alikes(stated), every, settled))
    alike = [each for each in tried if each.explained]
    best = min((*proposed, *alike), key=lambda each: each.chi_square)
    most = best.chi_square + BETTER * max(best.per_degree, 1.0)
    return [
        dataclasses.replace(each, proposed=each.proposed and each.chi_square <= most)
        for each in (*hypotheses, *alike)
    ]


def _looked_at(stated: Correction, corrections: Iterable[Correction]) -> ShortList:
    """The best after a look at few poses: what a screen does, where poses are not known."""
    settled = (each if each.wide else each.settled(_learnt) for each in corrections)
    best = _looked_through(stated, settled, _LOOKS[:1])
    return ShortList((), tuple(best), tuple(each for each in best if not each.wide)[:FIRST])


Tried = list[tuple[Correction, _core.JointFit | None]]


def _fitted(
    corrections: Iterable[Correction], poses: int, beside: Sequence[_core.JointFit] = ()
) -> Tried:
    """Each at some of the poses; None without a fit.

    What is right comes to rest soon, and what is not takes most of its steps nowhere: after some of
    them what is far behind another, or one `beside`, is left, and of the others all but the best.
    """
    some = [(each, each.some(poses)) for each in corrections]
    begun = [(each, few, few.fit(_BEGUN, whole=False)) for each, few in some]
    settled = [*beside, *(fit for _, _, fit in begun if fit and fit.converged)]
    least = min(map(per_degree, settled), default=math.inf)
    most = _HOPELESS * max(least, 1.0) if least < _HOPELESS else math.inf
    open_ = [
        (per_degree(fit), number)
        for number, (_, _, fit) in enumerate(begun)
        if not (fit and fit.converged) and per_degree(fit) <= most
    ]
    followed = {number for _, number in heapq.nsmallest(_FOLLOWED, open_)}
    return [
        (each, fit if fit and fit.converged else few.fit(SECOND[1]) if i in followed else None)
        for i, (each, few, fit) in enumerate(begun)
    ]


def _with_redrawn(tried: Tried, poses: int) -> Tried:
    """With the drawing corrected, by a robot that is known by now, where that is the correction.

    Where even free numbers leave far too much one number in all legs does not do, and where none
    comes to rest the best may do robustly.
    """
    kept = [(each, fit) for each, fit in tried if not each.wide or each.again is None]
    redrawn, robustly = [], 1
    for each, fit in tried:
        if not each.wide or each.again is None:
            continue
        if fit and fit.goodness.chi_square > _HOPELESS * fit.goodness.limit:
            continue
        if fit is None:
            robustly -= 1
            if robustly < 0:
                continue
        corrected = each.settled(_learnt if fit is None else functools.partial(_as_fitted, fit))
        if corrected.again is None:
            redrawn.append(corrected)
    return [*kept, *_fitted(redrawn, poses, [fit for _, fit in kept if fit])]


def _as_fitted(fit: _core.JointFit, correction: Correction) -> Mechanism:
    """The robot after a fit."""
    return correction.mechanism.with_parameters(fit.setup.parameters, symmetry=None)


def _learnt(correction: Correction) -> Mechanism:
    """The robot after a robust fit."""
    fit = correction.model.problem(correction.measurements, SECOND[1]).fit(loss="cauchy")
    return _as_fitted(fit, correction)


def _looked_through(
    stated: Correction, corrections: Iterable[Correction], looks: Sequence[tuple[int, ...]]
) -> list[Correction]:
    """The best after looks at few poses, and then at more, the best first.

    And what leaves rows out: few poses may have none of these. Where frames are unknown no screen
    tells whether an edit explains it all: if one does, nothing need be set free, nor looked at.
    """
    told = spare_conditions(stated.mechanism, stated.measurements)
    enough = math.ceil(_TESTS / max(float(told.mean()), _TESTS / _LOOKS[-1][0]))
    every = list(corrections)
    best, without = (
        [each for each in every if bool(each.left_out) == some] for some in (False, True)
    )
    seen: dict[tuple[int, int, int], float] = {}

    def look(each: Correction, number: int, framed: int, steps: int) -> float:
        poses = max(framed if each.options.frames else number, enough)
        key = id(each), poses, steps
        if key not in seen:
            seen[key] = each.look(poses, steps)
        return seen[key]

    def followed(some: list[Correction]) -> list[Correction]:
        for *how, count in looks:
            if len(some) <= count:
                continue
            looked = ((look(each, *how), each) for each in some)
            kept = heapq.nsmallest(count, looked, key=operator.itemgetter(0))
            least = min((value for value, _ in kept), default=math.inf)
            most = _HOPELESS * max(least, 1.0) if least < _HOPELESS else math.inf
            some = [each for value, each in kept if value <= most]
        return some

    if stated.options.frames and len(looks) > 1:
        edits, how = followed([each for each in best if not each.wide]), looks[-1][:-1]
        least = min((look(each, *how) for each in edits), default=math.inf)
        if leaves_noise(least, lambda: look(stated, *how)):
            return [*edits, *without]
    return [*followed(best), *without]


def _as_stated(stated: Correction, corrected: Sequence[_core.JointFit]) -> _core.JointFit | None:
    """What is stated, at the best that its solver reaches, or None.

    From its own start, and from the poses that corrections found: that it did not converge, or to
    no good end, is no evidence of the mistake. Most corrections set more free than is stated, and
    would be proposed for a sound robot whose own start was poor.
    """
    best = stated.fit(SECOND[1], whole=False)
    for fit in corrected:
        if per_degree(fit) < per_degree(best):
            again = stated.fit(SECOND[1], whole=False, start=fit.poses)
            best = min(best, again, key=per_degree)
    return best


def _explains(
    fit: _core.JointFit,
    as_stated: _core.JointFit | None,
    *,
    freed: bool = True,
    weak: bool = False,
) -> bool:
    """Whether a correction explains what is not explained as it is stated.

    Of measurements that say little, as of poses that are all alike, noise is explained too: a unit
    in which it is smaller does that. What only edits the table is not better by so much by chance;
    what sets more free has to be better by twice that, and to leave nothing that noise does not
    explain; but not by that alone (`weak`) if it leaves residuals of a shape that no parameter
    gives them. What explains only a part must leave so much less of the measurements: a robot that
    shrinks until nothing matters is as little worse than any nonsense as its tolerances make it.
    Rows that are set aside, and no longer are, were not explained.
    """
    if as_stated and len(fit.aside) < len(as_stated.aside):
        as_stated = None
    stated = as_stated.goodness if as_stated and as_stated.converged else None
    if stated and stated.chi_square <= stated.limit:  # there is nothing to explain
        return False
    after, before = per_degree(fit), per_degree(as_stated)
    gained = (before - after) * fit.goodness.degrees_of_freedom
    whole = fit.goodness.chi_square <= fit.goodness.limit
    if weak and (whole if freed else after < _EXPLAINED):
        return gained > (2 * BETTER if freed else BETTER)
    if after * LITTLE >= before:
        return False
    by_residuals = float(np.nansum(fit.chi_squares)) > fit.goodness.chi_square / 2
    return after < LITTLE or (by_residuals and math.inf > before > after * _HUGE)


def _rivals(tried: Iterable[tuple[Correction, _core.JointFit | None]]) -> list[Correction]:
    """The best correction, and those that the data do not tell from it; none if these are many."""
    # A row that is left out is explained by nothing, and one that no pose explains less than that.
    found = [
        (each, fit.goodness.chi_square + BETTER * (each.left_out + 2 * len(fit.aside)), fit)
        for each, fit in tried
        if fit and per_degree(fit) > _TOO_GOOD
    ]
    if not found:
        return []
    _, least, best = min(found, key=lambda each: each[1])
    # Where the model lacks something, all are worse by as much.
    found.sort(key=lambda each: each[1])
    most = least + BETTER * max(per_degree(best), 1.0)
    near = [
        each for each, value, fit in found if value <= most and len(fit.aside) <= len(best.aside)
    ]
    fewest = min(each.wide for each in near)
    near = [each for each in near if each.wide == fewest and not _is_wider(each, near)]
    # Rows in another order can do much that is done by less, and so can going without rows.
    near = [each for each in near if each.again is None] or near
    fewest = min(each.left_out for each in near)
    near = [each for each in near if each.left_out == fewest]
    # The same correction may have been tried from several starts, and the same table be made twice.
    rivals = {each.key: each for each in reversed(near)}
    near = [each for each in near if rivals[each.key] is each]
    rivals = {each.key: each for i, each in enumerate(near) if not _is_among(each, near[:i])}
    return list(rivals.values()) if len(rivals) <= _NAMED else []


def _is_wider(correction: Correction, others: Iterable[Correction]) -> bool:
    """Whether another does with one of its unknown frames."""
    frames = set(correction.options.frames)
    return any(set() < set(each.options.frames) < frames for each in others)


def _is_among(correction: Correction, others: Iterable[Correction]) -> bool:
    """Whether another makes the same table, of the same robot."""
    return any(
        each.model is correction.model and each.measurements == correction.measurements
        for each in others
    )


def _as_it_is(_: _core.JointFit) -> None:
    """No mistake."""


def _redrawn(
    stated: Correction, corrected: Correction, fit: _core.JointFit, told: Hypothesis
) -> Mechanism | None:
    """The mechanism as a correction has it, if it says that the drawing is wrong."""
    nominal, cause = stated.mechanism, told.cause
    if corrected.redrawn or cause is None or cause.code not in _OF_THE_DRAWING:
        return None if corrected.mechanism is nominal else corrected.mechanism
    name, legs = _OF_THE_DRAWING[cause.code], list(cause.legs)
    place = list(nominal.parameter_names).index(name)
    parameters = nominal.parameters.copy()
    parameters[legs, place] = fit.setup.parameters[legs, place]
    return nominal.with_parameters(parameters, symmetry=None)


def _with_zeros_turned(
    nominal: Mechanism, legs: list[int], taken: Measurements
) -> Mechanism | None:
    """With the zeros of legs half a turn on; None if readings would be whole turns off then."""
    parameters = nominal.parameters.copy()
    zeros = parameters[:, list(nominal.parameter_names).index("sensor_offset")]
    zeros[legs] += np.where(zeros[legs] > 0, -math.pi, math.pi)
    turned = nominal.with_parameters(parameters, symmetry=None)
    turns = np.array([turn_of(nominal, leg) for leg in legs], dtype=float)
    at_home = turned.inverse_kinematics(turned.home)[0, legs]
    off = np.nanmedian(taken.readings[:, legs], axis=0) - at_home
    return turned if (np.abs(off) < turns / 2).all() else None


def _told(
    correction: Correction,
    fit: _core.JointFit | None,
    *,
    proposed: bool = False,
    table: Measurements | None = None,
) -> Hypothesis:
    return Hypothesis(
        cause=correction.told(fit),
        chi_square=math.inf if fit is None else fit.goodness.chi_square,
        degrees_of_freedom=0 if fit is None else fit.goodness.degrees_of_freedom,
        limit=0.0 if fit is None else fit.goodness.limit,
        proposed=proposed,
        table=table,
    )
