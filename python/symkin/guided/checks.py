# SPDX-License-Identifier: MIT
"""Whether the drawing's tolerances hold, a row is wrong, or something has slipped since."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.estimate.conflict import LIMIT
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.changes import SILENT, change_tests, terms_of_changes
from symkin.estimate.evidence.linear_rows import linear_rows
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.evidence.unseen import POWER
from symkin.model.mechanism import Mechanism
from symkin.values import Array, Value, record

_TOLD = 17  # rows from which on hardly a single one can spoil the comparison with the drawing
_FARTHEST = 10.0  # times the tolerances: where fewer rows say so they are in another unit, rather
_FALSE = 0.01  # sessions in which a sound row is doubted
_FEWEST = 60  # rows of a session, at least, that share these
_OLDER = 5  # times rarer is a row doubted that was not when it came
_SLIPPED = 12  # rows, at least, before a slip is looked for
_SLIP = 1.0  # of the limit of the tests for changes, since they are made after every row
_RATHER = (
    10.0  # of chi-square that a step explains more than a row that is off, to be looked at first
)
_NO_STEP = 0.01  # probability of what legs that have not slipped seem to, or more
_STEP = 1e-4  # and of those that have
_RANK = 1e-9  # of the largest singular value
_PRICE, PLAINLY = 2.0, 10.0  # of an unknown more, and by how much chi-square is to fall besides
_MOST_ASKED, _HALVED = 20.0, 30  # deviations, of what a test asks for at most, and how finely
_DEGREES = math.pi / 180


@record
class Verdict(Value):
    """What the last row and those before it say.

    Attributes
    ----------
    row : int
        The last one.
    deviations : float
        How far it is from what the other rows predict, in standard deviations (root mean square
        over its observations); NaN where that cannot be said yet.
    doubtful : int or None
        The row that does not fit, if any: the last, or one before.
    off : float
        How far that one is off, in standard deviations.
    likely : str
        What makes it fit, such as ``"x in mm"``; empty if nothing does alone.
    edited : mapping of str to float
        Its values then, by column.
    slipped : int or None
        The row from which on the sensors or the device show something else, if any.
    tolerances : float
        Times the drawing's tolerances count, since the robot is further from it than they say.
    decided : str
        What a repeat has shown of the row that it repeats: "row", if that was wrong, or "robot",
        if it was not; empty if it was no such repeat.
    """

    row: int
    deviations: float
    doubtful: int | None = None
    off: float = math.nan
    likely: str = ""
    edited: Mapping[str, float] = dataclasses.field(default_factory=dict)
    slipped: int | None = None
    tolerances: float = 1.0
    decided: str = ""

    @property
    def fine(self) -> bool:
        """Whether nothing is to be decided."""
        return self.doubtful is None and self.slipped is None


def tolerances_factor(
    estimate: Estimate[Any],
    others: Callable[[], Iterable[Estimate[Any] | None]],
    *,
    sound: bool,
) -> float:
    """By how much the tolerances are too small, once that is plain; else 1.

    Of few rows, unless these are known to be `sound`, or where it is a large one, it is only if
    `others`, estimates without those that may be wrong, say so too.
    """
    if not _beyond(estimate):
        return 1.0
    assert estimate.conflict is not None
    factor = estimate.conflict.factor
    # Of few rows one may spoil the comparison, and of many one that is as far off as another unit.
    far = factor >= _FARTHEST
    few = not sound and len(estimate.measurements.poses) < _TOLD
    if (far and few) or ((far or few) and not all(map(_beyond, others()))):
        return 1.0
    return factor


def rather_slipped(estimate: Estimate[Any], off: float, without: Estimate[Any] | None) -> bool:
    """Whether a step explains more than that one row is off, by so many standard deviations.

    Or than an estimate `without` it does, since of a row that is far off the first order says
    less.
    """
    beyond = off**2 * float(estimate.conditions.max())
    if without is not None:
        beyond = max(beyond, estimate.chi_square - without.chi_square)
    beyond += _RATHER
    return slipped_from(estimate, shaken=True, beyond=beyond) is not None


def rather_a_step(stepped: Estimate[Any] | None, wider: Estimate[Any] | None) -> bool:
    """Whether an estimate with a step is plainly likelier than one with `wider` tolerances.

    With it the robot must be within its drawing's, too.
    """
    if stepped is None or wider is None or _beyond(stepped):
        return False
    return _unlikely(stepped) + PLAINLY < _unlikely(wider)


def _unlikely(estimate: Estimate[Any]) -> float:
    """Minus twice the logarithm of the evidence, but for a constant that the rows share.

    Of what has no prior, frames and the like, but for steps: these are taken as drawn from a normal
    distribution of the size that they have.
    """
    priors = np.linalg.svd(estimate.prior_rows, compute_uv=False)
    told = -2 * np.log(priors[priors > _RANK * priors.max(initial=0.0)]).sum()
    told -= np.linalg.slogdet(estimate.model_covariance)[1]
    for each in estimate.unknowns:
        if each.column >= 0 and any(part.startswith("step") for part in each.name.split(".")):
            square = each.value**2 + estimate.model_covariance[each.column, each.column]
            told += math.log(square) + each.value**2 / square
    return float(estimate.chi_square + told)


def explains_more(other: Estimate[Any], estimate: Estimate[Any]) -> bool:
    """Whether one of the same rows explains more, as many more unknowns as it has counted."""
    more = len(other.names) - len(estimate.names)
    fits = other.chi_square + _PRICE * more < estimate.chi_square - PLAINLY
    return bool(other.converged and fits)


def _beyond(estimate: Estimate[Any] | None) -> bool:
    conflict = None if estimate is None else estimate.conflict
    return conflict is not None and conflict.p_large <= LIMIT


def worst_row(estimate: Estimate[Any]) -> int | None:
    """The place, among the rows of an estimate, of the one that differs most from the others."""
    influence = estimate.influence
    if influence is None or not np.isfinite(influence.residual).any():
        return None
    return int(np.nanargmax(np.square(influence.residual) * estimate.conditions))


def steady_legs(estimate: Estimate[Any], step: str, *, last: bool) -> tuple[str, ...]:
    """The steps of all legs but the one that has slipped, if it is plain that one alone has.

    And of that one too if the step is not the `last` and nothing speaks for it: it was elsewhere.
    """
    names = [name for name in estimate.names if name.endswith(f".{step}")]
    if len(names) < 2:
        return ()
    places = np.array([estimate.names.index(name) for name in names])
    values = {each.name: each.value for each in estimate.unknowns}
    sizes = np.array([values[name] for name in names])
    covariance = estimate.covariance[np.ix_(places, places)]

    def chance_of(held: NDArray[np.bool_]) -> float:
        square = sizes[held] @ np.linalg.solve(covariance[np.ix_(held, held)], sizes[held])
        return float(_core.chi_square_tail(float(square), int(held.sum())))

    legs = np.arange(len(names))
    if not last and chance_of(legs >= 0) > _NO_STEP:
        return tuple(names)
    chances = [chance_of(legs != leg) for leg in legs]
    moved = [leg for leg, chance in enumerate(chances) if chance > _STEP]
    if len(moved) != 1 or chances[moved[0]] < _NO_STEP:
        return ()
    return tuple(name for leg, name in enumerate(names) if leg != moved[0])


def judged(
    estimate: Estimate[Any], numbers: list[int], planned: int, kept: set[int]
) -> tuple[float, int | None, float]:
    """How far the last row is off, the worst row that does not fit, and how far that one is.

    Every row is compared with what the others predict, to first order. `numbers` are those of the
    rows, and `kept` of those that nobody may doubt any more.
    """
    influence = estimate.influence
    if influence is None:
        return math.nan, None, math.nan
    off = np.asarray(influence.residual)
    squares = np.where(np.isfinite(off), off, 0.0) ** 2 * estimate.conditions
    level = _FALSE / max(_FEWEST, 2 * planned)
    shares: dict[int, float] = {}
    # What was measured between rows stands at the first of them, and is told of the last.
    first = estimate.measurements.first_of_block
    told = {int(first[place]): number for place, number in enumerate(numbers)}
    newest = int(first[-1])
    for place, number in told.items():
        count = int(estimate.conditions[place])
        if number not in kept and count:
            p = _core.chi_square_tail(float(squares[place]), count)
            shares[place] = p / (level if place == newest else level / _OLDER)
    far = [place for place, share in shares.items() if share < 1]
    last = float(off[newest])
    if not far:
        return last, None, math.nan
    # Rows that did fit until the last one came are made unlike by that one.
    worst = newest if newest in far else max(far, key=lambda each: squares[each])
    return last, told[worst], float(off[worst])


def slipped_from(estimate: Estimate[Any], *, shaken: bool, beyond: float = 0.0) -> int | None:
    """The line of the table from which on there is a step, if one is plain.

    `shaken` is whether a row that was repeated has shown already that something is, or the last one
    repeats another to see that. A step must explain more of chi-square than `beyond`, which a row
    that is off does.
    """
    if not shaken and len(estimate.measurements.poses) < _SLIPPED:
        return None
    limit = 1.0 if shaken else _SLIP
    steps = [
        test
        for test in change_tests(estimate)
        if test.what == "step" and test.p_value < limit * test.limit and test.statistic**2 > beyond
    ]
    return min(steps, key=lambda each: each.p_value).row if steps else None


def suspected(estimate: Estimate[Any], share: float) -> tuple[int, list[int]] | None:
    """The line of the table from which on there may be a step, and those that would decide that.

    None if more than this share of sound robots seem to have one as large. The lines are of the
    rows whose poses would show most of it if they were measured again, the best first. Of the last
    row alone, of which no step is tested, those that come first decide.
    """
    tests = change_tests(estimate)
    steps = [each for each in tests if each.what == "step"]
    test = min(steps, key=lambda each: each.p_value, default=None)
    numbers = estimate.measurements.row_numbers.tolist()
    if test is None or test.p_value * len(steps) > share:
        return (numbers[-1], numbers[:-1]) if _chance_of_last(estimate) < share else None
    rows = linear_rows(estimate, ())
    assert rows is not None  # since there are tests
    column = [*terms_of_changes(estimate, rows)][tests.index(test)].column
    best = np.argsort(-rows.shown_by_repeating(column), kind="stable")
    return test.row, [numbers[each] for each in rows.order[best]]


def _chance_of_last(estimate: Estimate[Any]) -> float:
    """Probability of a sound row as far from what the others predict as the last one is."""
    influence, first = estimate.influence, estimate.measurements.first_of_block
    off = math.nan if influence is None else float(influence.residual[first[-1]])
    count = int(estimate.conditions[first[-1]])
    if not count or math.isnan(off):
        return 1.0
    return float(_core.chi_square_tail(off**2 * count, count))


@record
class HiddenSlip(Value):
    """The slip of a sensor, halfway through the rows, that most sessions notice, and none below it.

    Attributes
    ----------
    size : float
        In the unit of the readings; of all legs that whose slip does most.
    position, orientation : float
        What it would do to both if nobody noticed, over the workspace (rms), m and rad; to the
        coordinates of the position that are wanted.
    """

    size: float
    position: float
    orientation: float


def hidden_slip(estimate: Estimate[Any], forms: tuple[Array, Array]) -> HiddenSlip | None:
    """What may have slipped unseen, by the errors' forms; None where nothing can be said."""
    rows = linear_rows(estimate, ())
    terms = [] if rows is None else [*terms_of_changes(estimate, rows)]
    steps = [each for each in terms if each.what == "step"]
    found: list[HiddenSlip] = []
    for term in steps:
        if rows is None or term.leg < 0:
            continue
        before = np.arange(len(rows.residual))[:, None] < len(rows.residual) // 2
        column = np.where(before, -rows.by_leg[..., term.leg], 0.0)
        length = rows.length(column)
        if length <= SILENT * np.linalg.norm(column):  # an unknown already
            continue
        size = _deviations_seen_from(term.p_of, ALARMS / len(steps)) / length
        moved = size * rows.moved(column)
        position, orientation = (
            float(np.sqrt(moved @ form[: len(moved), : len(moved)] @ moved)) for form in forms
        )
        found.append(HiddenSlip(size, position, orientation))
    return max(found, key=lambda each: each.position or each.orientation, default=None)


def _deviations_seen_from(p_of: Callable[[float], float], limit: float) -> float:
    """How many deviations a step is that alarms in most sessions."""
    least, most = 0.0, _MOST_ASKED
    for _ in range(_HALVED):
        middle = (least + most) / 2
        least, most = (middle, most) if p_of(middle) > limit else (least, middle)
    return most + NormalDist().inv_cdf(POWER)


def edits_of(row: Mapping[str, float], robot: Mechanism) -> Iterator[tuple[str, dict[str, float]]]:
    """What may have gone wrong with a row: another unit, a sign, two legs exchanged."""
    readings = [name for name in row if name.startswith("psi_")]
    others: dict[str, list[str]] = {"m": [], "rad": []}
    for name in row:
        unit = name.rpartition("_")[2]
        if name not in readings and unit in others:
            others[unit].append(name)
    groups = [("readings", readings, robot.reading_unit)]
    groups += [(", ".join(each.rpartition("_")[0] for each in names), names, unit)
               for unit, names in others.items() if names]  # fmt: skip
    groups += [(name.rpartition("_")[0], [name], name.rpartition("_")[2]) for name in row]
    factors = {
        "m": (("mm", 1e-3), ("m", 1e3), ("inches", 25.4)),  # typed where mm were asked for
        "rad": (("degrees", _DEGREES), ("radians", 1 / _DEGREES)),
    }
    for what, names, unit in groups:
        for called, factor in factors.get(unit, ()):
            yield f"{what} in {called}", {**row, **{name: factor * row[name] for name in names}}
    for name in row:
        yield f"{name.rpartition('_')[0]} with the other sign", {**row, name: -row[name]}
    for i, first in enumerate(readings):
        for second in readings[i + 1 :]:
            swapped = {first: row[second], second: row[first]}
            legs = " and ".join(each.split("_")[1] for each in (first, second))
            yield f"the readings of legs {legs} exchanged", {**row, **swapped}
