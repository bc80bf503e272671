# SPDX-License-Identifier: MIT
"""What the lines of a session say of the robot, computed once for so many of them."""

from __future__ import annotations

import bisect
import dataclasses
import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.tries import DROPPED, LINK, STATUS
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.estimate import Estimate
from symkin.estimate.identification import tried
from symkin.estimate.precision import expected_over, promising
from symkin.guided.checks import (
    PLAINLY,
    HiddenSlip,
    Verdict,
    edits_of,
    explains_more,
    hidden_slip,
    judged,
    rather_a_step,
    rather_slipped,
    slipped_from,
    steady_legs,
    suspected,
    tolerances_factor,
    worst_row,
)
from symkin.guided.choosing import not_known
from symkin.guided.tries_table import KEPT, SLIPPED, TriesTable
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Tolerances
from symkin.options import Coordinates
from symkin.values import record

LEAST_DEGREES = 20  # of freedom, before anything may stop by a noise that was estimated
TAKEN_AS = "taken as "  # begins the remark of a row that was put right
_LOOKED_AT = 6  # rows, from the last, of which one may keep all others from being fitted
_LOOKED_BACK = 40  # rows, at most, since one that nobody has decided
_TRIED = 3  # edits, the most likely ones, that are fitted
_SAME_SLIP = 2  # rows that two slips are apart, at most, to be one
_KEPT = 2  # rows, the last that nobody doubts any more, at which something may have slipped
_REMEMBERED = 50  # fits of some of the rows, which are asked for more than once
_FITS = 0.01  # probability of a repeat that the other rows explain
_APART = 3.0  # times the growth of chi-square by a repeat; see `_differ`


@record
class Known:
    """What so many lines say.

    Attributes
    ----------
    robot : Mechanism
        The drawing, its tolerances as they count, and what is unknown of it: what `identify` takes.
    estimate : Estimate or None
        None where there is none, and
    failure : str
        why.
    unlike : bool
        Whether that is since no robot like the drawing has such rows.
    tolerances : float
        Times the drawing's tolerances count.
    repaired : bool
        Whether rows were put right, so that more is asked of the rest.
    """

    robot: Mechanism
    estimate: Estimate[Any] | None = None
    failure: str = ""
    unlike: bool = False
    tolerances: float = 1.0
    repaired: bool = False


class Knowledge:
    """Estimates and verdicts by the number of lines that they are of.

    The accuracy is `of` these coordinates of the position, by default of all.
    """

    def __init__(
        self,
        robot: Mechanism,
        table: TriesTable,
        confidence: float,
        noise: Literal["estimate"] | None,
        least: int,
        of: Coordinates | None,
    ) -> None:
        self._robot, self._table, self._least = robot, table, least
        self._of = of
        self._confidence, self._noise = confidence, noise
        self._known: dict[int, Known] = {}
        self._verdicts: dict[int, Verdict] = {}
        self._fitted: dict[tuple[tuple[int, ...], tuple[str, ...], float | None, bool], Known] = {}

    def forget(self, upto: int) -> None:
        """Lines behind so many are others than they were."""
        self._known = {count: known for count, known in self._known.items() if count <= upto}
        self._verdicts.clear()
        self._fitted.clear()

    def of(self, count: int) -> Known:
        """By the first lines."""
        if count not in self._known:
            lines = self._table.lines[:count]
            as_other = any(each["remark"].startswith(TAKEN_AS) for each in lines)
            repaired = as_other or bool(self._table.said(DROPPED, SLIPPED, upto=count))
            self._known[count] = dataclasses.replace(self._by(count), repaired=repaired)
        return self._known[count]

    def bounds(self, known: Known, confidence: float) -> tuple[dict[str, float], str]:
        """What such robots keep, by name, m and rad; and why that is not known."""
        if known.estimate is None:
            return not_known(), known.failure
        try:
            poses = expected_over(known.estimate.mechanism, self._of)
            found = known.estimate.expected_accuracy(poses, confidence, of=self._of)
        except SymkinError as error:  # as of a row that no robot can have
            return not_known(), str(error)
        return {"position": found.position_bound, "orientation": found.orientation_bound}, ""

    def verdict(self, planned: int) -> Verdict | None:
        """What the last row and those before it say; None before the first."""
        count, rows = len(self._table.lines), self._table.counting
        if not rows:
            return None
        if count not in self._verdicts:
            self._verdicts[count] = self._judged(count, rows, len(rows) + planned)
        return self._verdicts[count]

    def suspected(self, count: int, share: float) -> tuple[int, list[int]] | None:
        """The row from which on there may be a step, and places of rows to decide that by.

        None if more than this share of sound robots seem to have one, or it was kept as it is.
        """
        estimate = self.of(count).estimate
        found = None if estimate is None else suspected(estimate, share)
        if found is None:
            return None
        begin, *places = (line - 2 for line in (found[0], *found[1]))  # the header is line 1
        rows = self._table.counting
        for kept in map(self._table.place, self._table.said(KEPT, upto=count)):
            away = bisect.bisect_left(rows, kept) - bisect.bisect_left(rows, begin)
            if abs(away) <= _SAME_SLIP:
                return None
        return self._table.number(begin), places

    def hidden(self, known: Known) -> HiddenSlip | None:
        """What may have slipped without that anybody noticed; None where that cannot be said."""
        found = known.estimate
        if found is None:
            return None
        try:
            survey, _ = promising(found, found.mechanism)
            position, orientation, *_ = survey.error_forms(
                expected_over(found.mechanism, self._of), self._of
            )
        except SymkinError:
            return None
        return hidden_slip(found, (position, orientation))

    def _by(
        self,
        count: int,
        without: tuple[int, ...] = (),
        *,
        factor: float | None = None,
        slipped: int | None = None,
    ) -> Known:
        """By the first lines `without` some, by default with the tolerances times what they need.

        As if a line had said that something has `slipped` at the row of that number.
        """
        lines = tuple(str(place + 2) for place in self._slips(count, slipped))
        return self._fit(count, without, lines, factor)

    def _fit(
        self, count: int, without: tuple[int, ...], lines: tuple[str, ...], factor: float | None
    ) -> Known:
        """The same with steps from these lines on; what was asked for lately is remembered."""
        rows = tuple(self._table.counting_of(count, without))
        # What is said of rows besides changes only what may be to blame for what they say.
        key = (rows, lines, factor, factor is None and self._kept_one(count))
        if key not in self._fitted:
            for old in [*self._fitted][: len(self._fitted) - _REMEMBERED]:
                del self._fitted[old]
            made = self._widened if factor is None else self._fit_anew
            self._fitted[key] = made(count, without, lines, factor or 1.0)
        return self._fitted[key]

    def _widened(
        self, count: int, without: tuple[int, ...], lines: tuple[str, ...], least: float
    ) -> Known:
        """With the tolerances times what they need, at least so many times."""
        known = self._fit(count, without, lines, least)
        found = known.estimate
        if found is None:
            return known
        factor = tolerances_factor(
            found,
            lambda: self._others(found, count, without),
            sound=self._kept_one(count),
        )
        return self._fit_anew(count, without, lines, factor) if factor > least else known

    def _fit_anew(
        self, count: int, without: tuple[int, ...], lines: tuple[str, ...], factor: float
    ) -> Known:
        robot = self._with(step=lines) if lines else self._robot
        try:
            measured = self._table.measurements(robot, count, without)
            if measured is None or len(measured.poses) < self._least:
                return Known(robot)
            robot, found = self._stepped(measured, lines)
            if factor > 1:
                tolerances = {
                    name: factor * value for name, value in vars(robot.tolerances).items()
                }
                robot = robot.replace(tolerances=Tolerances(**tolerances))
                found = self._tried(robot, measured)
        except SymkinError as error:
            few = isinstance(error, NotIdentifiableError)
            return Known(robot, failure=str(error), unlike=not few)
        if not found.converged:
            return Known(robot, failure=found.failure, unlike=True)
        return Known(robot, found, tolerances=factor)

    def _tried(self, robot: Mechanism, measured: Measurements) -> Estimate[Any]:
        """An estimate: with the noise too, where that is wanted, once rows tell it."""
        found = tried(robot, measured, confidence=self._confidence)
        if self._noise is None or found.degrees_of_freedom < LEAST_DEGREES:
            return found
        return tried(robot, measured, confidence=self._confidence, noise=self._noise)

    def _slips(self, count: int, slipped: int | None = None) -> list[int]:
        """Places of the rows from which on something has slipped, as the first lines say.

        Of slips too close to be told apart the one that was said last holds.
        """
        said = [*self._table.said(SLIPPED, upto=count), *([] if slipped is None else [slipped])]
        rows, found = self._table.counting, list[int]()
        for place in map(self._table.place, said):
            rank = bisect.bisect_left(rows, place)
            found = [
                each for each in found if abs(bisect.bisect_left(rows, each) - rank) > _SAME_SLIP
            ]
            found.append(place)
        return found

    def _stepped(
        self, measured: Measurements, lines: tuple[str, ...]
    ) -> tuple[Mechanism, Estimate[Any]]:
        """The robot and its estimate with steps from these lines on, of what has slipped there.

        Of one leg where that is plain; of the device if that explains more than steps of all legs;
        else of every leg. Where a device is that was moved is unknown from then on: the robot is as
        it sees it now.
        """
        robot = self._with(step=lines) if lines else self._robot
        found = self._tried(robot, measured)
        steady = tuple(
            name
            for line in lines
            for name in steady_legs(found, f"step{line}", last=line == max(lines, key=int))
        )
        if steady:
            robot = self._with(step=lines, fixed=(*self._fixed, *steady))
            found = self._tried(robot, measured)
        steps = lines
        for place, line in enumerate(lines):
            moved = (*steps[:place], f"frame:{line}", *steps[place + 1 :])
            own = tuple(name for name in steady if f"step{line}" not in name.split("."))
            frames = tuple(dict.fromkeys(("base", *self._frames)))
            other = self._with(step=moved, fixed=(*self._fixed, *own), frames=frames)
            try:
                shown = self._tried(other, measured)
            except SymkinError:  # as where not all of a frame is shown
                continue
            if explains_more(shown, found):
                robot, found, steps, steady = other, shown, moved, own
        return robot, found

    def _others(
        self, found: Estimate[Any], count: int, without: tuple[int, ...]
    ) -> Iterator[Estimate[Any] | None]:
        """Estimates without the last row, and without the one that differs most."""
        rows = self._table.counting_of(count, without)
        worst = worst_row(found)
        for place in dict.fromkeys((rows[-1], rows[-1 if worst is None else worst])):
            others = (*without, *self._table.together(place))
            yield self._by(count, others, factor=1.0).estimate

    @property
    def _frames(self) -> tuple[str, ...]:
        settings = self._robot.identification
        return tuple(settings.frames or ()) if settings is not None else ()

    @property
    def _fixed(self) -> tuple[str, ...]:
        settings = self._robot.identification
        return () if settings is None or settings.fixed is None else settings.fixed

    def _with(self, **changes: Any) -> Mechanism:
        settings = self._robot.identification
        assert settings is not None
        return self._robot.replace(identification=dataclasses.replace(settings, **changes))

    def _judged(self, count: int, rows: list[int], planned: int) -> Verdict:
        numbers = [self._table.number(place) for place in rows]
        last, known = rows[-1], self.of(count)
        if self._table.lines[last].get(LINK) == "":  # of which nothing is measured yet
            return Verdict(numbers[-1], math.nan)
        together = self._table.together
        again, kept = self._table.lines[last]["repeat_of"], set(self._table.said(KEPT, SLIPPED))
        decided = ""
        if again.isdigit() and int(again) in numbers and not {int(again), numbers[-1]} & kept:
            decided = self._decided(
                known, count, self._table.place(int(again)), last, planned, kept
            )
        if decided:
            return Verdict(
                numbers[-1], math.nan, int(again), tolerances=known.tolerances, decided=decided
            )
        if known.estimate is None:
            if kept and self._table.said(KEPT, upto=count):
                slipped = self._begun_at(None, count)
                if slipped is not None:
                    return Verdict(numbers[-1], math.nan, slipped=slipped)
            earlier = self._doubted(count, together(last), planned, kept)
            places = rows[: -_LOOKED_AT - 1 : -1]
            for place in places if earlier is None else (self._table.place(earlier[0]), *places):
                before = self._by(count, together(place))
                if before.estimate is not None:
                    number = self._table.number(place)
                    return self._explained(Verdict(numbers[-1], math.inf, number), count, before)
            return self._of_no_robot(Verdict(numbers[-1], math.nan), count, known, kept)
        kept_one = self._kept_one(count)
        off, doubtful, size = judged(known.estimate, numbers, planned, kept)
        if doubtful == numbers[-1]:
            earlier = self._doubted(count, together(last), planned, kept)
            doubtful, size = earlier or (doubtful, size)
        made = Verdict(numbers[-1], off, doubtful, size, tolerances=known.tolerances)
        slipped = None
        rather = False
        if doubtful is not None:
            row = together(self._table.place(doubtful))
            without = self._by(count, row, factor=known.tolerances).estimate
            rather = rather_slipped(known.estimate, size, without)
        if doubtful is None or kept_one or rather:
            shaken = kept_one or rather
            slipped = self._slipped(known, count, repeated=again.isdigit(), kept_one=shaken)
        # What a repeat has shown of the robot may be that it is not as it was drawn.
        blamed = slipped is None and (known.tolerances > 1 or not kept_one)
        if doubtful is not None and blamed:
            before = self._by(count, together(self._table.place(doubtful)))
            return self._explained(made, count, before)
        return dataclasses.replace(made, doubtful=None, slipped=slipped)

    def _doubted(
        self, count: int, without: tuple[int, ...], planned: int, kept: set[int]
    ) -> tuple[int, float] | None:
        """The row that does not fit, `without` the last ones, and how far it is off.

        As long as nobody decides what is wrong with it, it makes sound rows after it look wrong.
        """
        found = None
        for _ in range(_LOOKED_BACK):
            rows, known = self._table.counting_of(count, without), self._by(count, without)
            if known.estimate is None and not known.unlike:
                break
            last, doubtful, off = self._table.number(rows[-1]), None, math.inf
            if known.estimate is not None:
                numbers = [self._table.number(place) for place in rows]
                _, doubtful, off = judged(known.estimate, numbers, planned, kept)
                if doubtful is None:
                    break
            found = (last if doubtful is None else doubtful, off)
            if found[0] != last:
                break
            without = (*without, *self._table.together(rows[-1]))
        return found

    def _kept_one(self, count: int) -> bool:
        """Whether a repeat has shown that no row is wrong since something slipped, if anything."""
        said = [line[STATUS] for line in self._table.lines[:count]]
        last = next((each for each in reversed(said) if each in (SLIPPED, KEPT)), "")
        return last == KEPT

    def _slipped(self, known: Known, count: int, *, repeated: bool, kept_one: bool) -> int | None:
        """The number of the row from which on there is a step, if one is plain.

        What has slipped looks like a robot beyond its tolerances, too: rather than these it is a
        step if the robot is within them with one, and rows say so that wider ones do not explain.
        """

        def number_of(estimate: Estimate[Any] | None, *, shaken: bool) -> int | None:
            line = None if estimate is None else slipped_from(estimate, shaken=shaken)
            return None if line is None else self._table.number(line - 2)

        wider = known.tolerances > 1
        found = number_of(known.estimate, shaken=repeated or (kept_one and not wider))
        if found is not None:
            found = self._begun_at(found, count)
        if found is None and wider and not self._table.said(SLIPPED):
            drawn = self._by(count, factor=1.0).estimate
            found = number_of(drawn, shaken=repeated or kept_one)
            if found is not None:
                found = self._begun_at(found, count)
            if found is not None:
                stepped = self._by(count, factor=1.0, slipped=found).estimate
                return found if rather_a_step(stepped, known.estimate) else None
        return found

    def _begun_at(self, number: int | None, count: int) -> int | None:
        """Where a step explains most; None where one is already, or none explains anything.

        It is looked for about the row that the tests name, and about those that a repeat has shown
        to be no blunders. The tests are of steps of single legs and to first order: those of a
        device that was moved, or large ones, may be far off.
        """
        rows, misfits = self._table.counting_of(count), dict[int, float]()

        def misfit(at: int) -> float:
            if not 0 < at < len(rows):
                return math.inf
            if at not in misfits:
                own = self._table.number(rows[at])
                found = self._by(count, factor=1.0, slipped=own).estimate
                misfits[at] = math.inf if found is None else found.chi_square
            return misfits[at] - (PLAINLY if at in doubted else 0.0)

        kept = self._table.said(KEPT, upto=count)[-_KEPT:]
        # Of the rows that were kept the first was doubted, when it was the last one.
        doubted = [bisect.bisect_left(rows, self._table.place(each)) for each in kept[:1]]
        starts = [bisect.bisect_left(rows, self._table.place(each)) for each in kept]
        if number is not None:
            starts.append(bisect.bisect_left(rows, self._table.place(number)))
        at = min(starts, key=misfit)
        for _ in range(_SAME_SLIP):
            best = min((at, at - 1, at + 1), key=misfit)
            if best == at:
                break
            at = best
        if math.isinf(misfit(at)) or rows[at] in self._slips(count):
            return None
        return self._table.number(rows[at])

    def _decided(
        self, known: Known, count: int, place: int, again: int, planned: int, kept: set[int]
    ) -> str:
        """Whether a row that was doubted is wrong, now that its pose was measured again.

        One that is still doubted is decided by its second repeat at the latest.
        """
        alone, repeated = self._table.together(place), self._table.together(again)
        first = self._by(count, repeated, factor=known.tolerances)
        rows = [each for each in self._table.counting if each not in repeated]
        if first.estimate is not None and known.estimate is not None:
            doubted = {
                judged(found, [self._table.number(each) for each in of], planned, kept)[1]
                for found, of in (
                    (first.estimate, rows),
                    (known.estimate, self._table.counting),
                )
            }
            if self._table.number(place) not in doubted:
                return ""
        others, repeat = self._by(count, (*alone, *repeated)), self._by(count, alone)
        if _chance(repeat.estimate, others.estimate) > _FITS:
            return "row"
        if first.estimate is None or known.estimate is None:
            # Where no robot has such a row, but one has its repeat, they do not say the same.
            none = first.estimate is None and known.estimate is None
            return "row" if none and repeat.estimate is not None else "robot"
        differ = self._differ(known, count, alone, (*alone, *repeated))
        return "row" if differ else "robot"

    def _differ(
        self, known: Known, count: int, alone: tuple[int, ...], both: tuple[int, ...]
    ) -> bool:
        """Whether a row and its repeat are further from each other than the repeat from the others.

        By what chi-square grows of the repeat, q1, and of both. What has two rows that say the same
        grows by no more than 2 q1 and q2, half the square of their difference, whatever is known of
        the robot; if it does by more than 3 q1, q2 is above q1.
        """
        assert known.estimate is not None
        others = self._by(count, both, factor=known.tolerances).estimate
        repeat = self._by(count, alone, factor=known.tolerances).estimate
        if others is None or repeat is None:
            return False
        of_both = known.estimate.chi_square - others.chi_square
        return of_both > _APART * max(repeat.chi_square - others.chi_square, 0.0)

    def _of_no_robot(self, verdict: Verdict, count: int, known: Known, kept: set[int]) -> Verdict:
        """Doubt a row that no robot like the drawing can have, unless others were like that."""
        if kept or not known.unlike:
            return verdict
        place = self._table.place(verdict.row)
        passing: list[tuple[str, dict[str, float]]] = []
        edits = self._edits(place)
        for (what, edited), measured in zip(
            edits, self._each_edited(count, place, edits), strict=True
        ):
            found = self._edited(known.robot, measured)
            if found is None:
                continue
            conditions = int(found.conditions.sum())
            if found.converged and _core.chi_square_tail(found.chi_square, conditions) > _FITS:
                passing.append((what, edited))
        made = dataclasses.replace(verdict, doubtful=verdict.row, off=math.inf)
        return _named(made, passing)

    def _edits(self, place: int) -> list[tuple[str, dict[str, float]]]:
        """What may have gone wrong with a row, and its values then: of equal ones the first."""
        named = [*edits_of(self._table.values(place), self._robot)]
        return list({tuple(each[1].values()): each for each in reversed(named)}.values())[::-1]

    def _edited(self, robot: Mechanism, measured: Measurements | None) -> Estimate[Any] | None:
        """What is known with other values in a row; None where there is no estimate."""
        try:
            return None if measured is None else self._tried(robot, measured)
        except SymkinError:
            return None

    def _explained(self, verdict: Verdict, count: int, before: Known) -> Verdict:
        """Look for the slip of hand that makes the doubtful row fit."""
        if verdict.doubtful is None or before.estimate is None:
            return verdict
        place = self._table.place(verdict.doubtful)
        passing: list[tuple[str, dict[str, float]]] = []
        likely = [*self._likely(count, place, before)]
        for (what, edited), measured in zip(
            likely, self._each_edited(count, place, likely), strict=True
        ):
            found = self._edited(before.robot, measured)
            if found is None:
                continue
            if _chance(found, before.estimate) > _FITS:
                passing.append((what, edited))
        return _named(verdict, passing)

    def _likely(
        self, count: int, place: int, before: Known
    ) -> Iterator[tuple[str, dict[str, float]]]:
        """The edits of a row that the robot, as known without it, explains best."""
        assert before.estimate is not None
        edits = self._edits(place)
        scored: list[tuple[float, str, dict[str, float]]] = []
        together = self._table.together(place)
        others = [each for each in self._table.counting if each not in together]
        for (what, edited), alone in zip(
            edits, self._each_edited(count, place, edits, others), strict=True
        ):
            if alone is None:
                continue
            try:
                misfit = float(before.estimate.predicting(alone).chi_square_data)
            except SymkinError:
                continue
            scored.append((misfit, what, edited))
        best = sorted(scored, key=lambda each: each[0])[:_TRIED]
        yield from ((what, edited) for _, what, edited in best)

    def _each_edited(
        self,
        count: int,
        place: int,
        edits: list[tuple[str, dict[str, float]]],
        without: Sequence[int] = (),
    ) -> Iterator[Measurements | None]:
        """The first lines with each of these values in a row, `without` some; None if it cannot be.

        Of a row that is alone then all are read together where that can be, since reading takes
        longer than what it is for.
        """
        left = self._table.counting_of(count, without)
        if left == [place]:
            read = self._table.alone(self._robot, place, [edited for _, edited in edits])
            if len(read) == len(edits):
                yield from read
                return
        for _, edited in edits:
            try:
                yield self._table.measurements(self._robot, count, without, edited={place: edited})
            except SymkinError:
                yield None


def _named(verdict: Verdict, passing: list[tuple[str, dict[str, float]]]) -> Verdict:
    """A verdict with what makes its row fit, if one edit alone does."""
    values = {tuple(edited.values()): (what, edited) for what, edited in reversed(passing)}
    if len(values) != 1:
        return verdict
    ((what, edited),) = values.values()
    return dataclasses.replace(verdict, likely=what, edited=edited)


def _chance(found: Estimate[Any] | None, without: Estimate[Any] | None) -> float:
    """Probability that sound rows worsen a fit by as much as these did."""
    if found is None or without is None or not found.converged:
        return 0.0
    more = int(found.conditions.sum() - without.conditions.sum())
    worse = max(found.chi_square - without.chi_square, 0.0)
    return _core.chi_square_tail(worse, more) if more > 0 else 0.0
