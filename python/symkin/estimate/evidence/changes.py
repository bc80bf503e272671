# SPDX-License-Identifier: MIT
"""Tests for what changes while a robot is measured: drift, steps, growth, backlash, a late device.

Every term is a covariate of the rows whose slope was held at zero. One step from the estimate says
how large it would be and how many standard deviations that is, once all that the unknowns could
explain is taken out. All terms together alarm for one of 1000 sound robots, half of them steps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.covariates import (
    Covariate,
    clock,
    last_moves,
    late_clock,
)
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, as_estimated, linear_rows
from symkin.estimate.evidence.residuals import ALARMS, BETTER
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.estimate.scalars import slope_units
from symkin.model.framing import framed
from symkin.model.poses import Transform, between, frame, transforms
from symkin.model.settings import Frames
from symkin.values import Array, Value, field, record

_TRIM = 2  # rows before the first and after the last step that is looked for
SILENT = 1e-6  # of a column: the unknowns explain all of it
_SMALL_LAG = 0.5  # of the last move
_CLEAR_MOVES = 10.0  # mean square, in noise, for each row
_MOST = 0.9  # of what noise does not explain
_TURNS = "turn"  # what lags, but for positions
_AXES = {"x": 0, "y": 1, "z": 2, "rx": 3, "ry": 4, "rz": 5, "phi": 5}  # of a tangent
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@record
class ChangeTest(Value):
    """A test for something that changed while the robot was measured.

    Attributes
    ----------
    what : str
        "drift", "step", "growth", "backlash", "clock" or "lag".
    name : str
        Of the slope, as an unknown: ``leg2.drift``, ``step63.x``, ``growth``, ``clock``.
    leg : int
        The leg (from 0), or -1.
    row : int
        The row, numbered as in its source, from which on there is a step; else -1.
    size, deviation : float
        Of the slope, in its unit: one step from the estimate.
    unit : str
        "m", "rad", "1/K", "s", or empty for a number.
    statistic : float
        Standard normal for a sound robot; of a step the largest over all rows.
    p_value : float
        Probability of one as large for a sound robot.
    limit : float
        Below which `p_value` alarms.
    seen : float
        How much of the column the unknowns leave, between 0 and 1.
    explains, whole : bool
        Whether noise explains the residuals with terms of its kind, or these at least most of what
        it does not; and whether without them it does not.
    most : bool
        Whether terms of its kind explain most of what noise does not, or of noise that explains it
        since it was estimated.
    """

    what: str
    name: str
    leg: int = field(number=True)
    row: int
    size: float
    deviation: float
    unit: str
    statistic: float
    p_value: float
    limit: float
    seen: float
    explains: bool = field(private=True)
    whole: bool = field(private=True)
    most: bool = field(private=True)

    @property
    def alarms(self) -> bool:
        """Whether it speaks against the model."""
        return self.p_value < self.limit and self.explains


@record
class Term:
    """A column of whitened rows, and its length less what the unknowns explain."""

    what: str
    of: str  # the leg's block, or the component of the base
    leg: int
    row: int
    column: Array
    length: float
    p_of: Callable[[float], float]

    @property
    def kind(self) -> tuple[str, bool]:
        """What it is, and whether of the base or of all."""
        return self.what, self.leg < 0


def change_tests(found: Found, apart: Sequence[int] = ()) -> tuple[ChangeTest, ...]:
    """Test an estimate, without the poses that are outliers; empty where nothing is to spare."""
    try:
        rows = linear_rows(found, tuple(apart))
    except SymkinError:
        return ()
    if rows is None or rows.spare < 1:
        return ()
    terms = list(terms_of_changes(found, rows))
    if not terms:
        return ()
    square = rows.square
    drops = {each.kind: _drop(rows, terms, each.kind) for each in terms}
    drop, count = max(drops.values())
    most = drop  # what legs do as they come to rest looks a little like a lag
    scale = np.sqrt(max((square - drop) / max(rows.spare - count, 1), 1.0))
    counts = {step: sum((each.what == "step") == step for each in terms) for step in (False, True)}
    tests, before = [], usual(square, rows.spare)
    names, units = _names(found, terms)
    for term, name, unit in zip(terms, names, units, strict=True):
        statistic = rows.score(term.column) / float(scale)
        drop, many = drops[term.kind]
        left_over = is_noise(square - drop, rows.spare - many)
        size = float(statistic * scale / term.length)
        tests.append(
            ChangeTest(
                what=term.what,
                name=name,
                leg=term.leg,
                row=term.row,
                size=size,
                deviation=float(scale / term.length),
                unit=unit,
                statistic=statistic,
                p_value=term.p_of(abs(statistic)),
                limit=ALARMS / counts[term.what == "step"],
                seen=float(term.length / np.linalg.norm(term.column)),
                explains=(left_over or drop > (square - rows.spare) / 2)
                and (term.what != "lag" or drop == most),
                # By half a move is no first order: readings may stand in other rows.
                whole=left_over and not before and (term.what != "lag" or abs(size) < _SMALL_LAG),
                most=(left_over and before and 2 * drop > square)
                or (not before and drop > _MOST * (square - rows.spare)),
            )
        )
    return tuple(tests)


def usual(square: float, degrees: int) -> bool:
    """Whether a sound robot may have such a chi-square."""
    return degrees > 0 and bool(_core.chi_square_tail(max(square, 0.0), degrees) > FALSE_ALARMS)


def is_noise(square: float, degrees: int) -> bool:
    """Whether noise alone leaves such a chi-square, neither more nor hardly any.

    Far from the estimate, one step explains more than there is.
    """
    too_good = square <= 0 or _core.chi_square_tail(square, max(degrees, 1)) > 1 - FALSE_ALARMS
    return usual(square, degrees) and not too_good


def _drop(rows: LinearRows, terms: Sequence[Term], kind: tuple[str, bool]) -> tuple[float, int]:
    """How much of chi-square all terms of a kind explain together, and how many they are."""
    own = [each.column for each in terms if each.kind == kind]
    return rows.explained(own).drop, len(own)


def terms_of_changes(found: Found, rows: LinearRows) -> Iterator[Term]:
    """All that is tested for."""
    measured = found.measurements
    time = clock(measured)[rows.order]
    moves = last_moves(found.nominal, measured)[rows.order] / 2
    given = measured.temperatures
    warmth = time if given is None else (given - np.mean(given))[rows.order]
    legs = [(f"leg{leg + 1}", leg, rows.by_leg[..., leg]) for leg in range(rows.by_leg.shape[2])]
    bases = [(each, -1, rows.by_base[..., i]) for i, each in enumerate(rows.components)]
    for of, leg, one in (*legs, *bases):
        yield from _term(rows, "drift", of, leg, time[:, None] * one)
        if leg >= 0:
            yield from _term(rows, "backlash", of, leg, moves[:, [leg]] * one)
        yield from _step(measured.row_numbers, rows, of, leg, one)
    yield from _term(rows, "growth", "", -1, warmth[:, None] * rows.by_growth)
    late = [_along(rows, each) for each in late_clock(found.nominal, measured)]
    if late:  # the same time in all that was seen
        yield from _term(rows, "clock", "", -1, np.sum(late, axis=0))
    for of, behind in _lags(found, rows):
        yield from _term(rows, "lag", of, -1, behind)


def _lags(found: Found, rows: LinearRows) -> Iterator[tuple[str, Array]]:
    """Of positions, and of orientations, that stay behind by a share of the last move, n x r.

    As if the base had stood so much further back, turned about where the platform is. What is seen
    of a move has a row's noise, as its residual has, which passes for a lag where moves are small:
    those of a platform whose turns its legs bind are no matter.
    """
    measured = found.measurements
    if not (np.isfinite(measured.poses).any() or measured.points is not None):
        return
    robot, places = as_estimated(found)
    frames = robot.frames or Frames()
    seen = transforms(robot.pose_space, framed(robot, places)[rows.order])
    before, after = (Transform(*(e[some] for e in seen)) for some in (slice(-1), slice(1, None)))
    moves = np.nan_to_num(between(before, after))
    away = np.nan_to_num(seen.translation - frame(robot.pose_space, frames.base).translation)[1:]
    turns = np.zeros_like(moves)
    turns[:, :3], turns[:, 3:] = np.cross(away, moves[:, 3:]), moves[:, 3:]
    moves[:, 3:] = 0.0
    for of, behind in (("", moves), (_TURNS, turns)):
        column = np.zeros_like(rows.residual)
        for i, name in enumerate(rows.components):
            column[1:] -= behind[:, [_AXES[name]]] * rows.by_base[1:, :, i]
        if np.square(column).sum() > _CLEAR_MOVES * np.count_nonzero(column) ** 2:
            yield of, column


def _along(rows: LinearRows, late: Covariate) -> Array:
    """Of a slope of readings, or of the base along the axis that it is named after, n x r."""
    values = late.values[rows.order]
    if late.of == "reading":
        return np.asarray(np.einsum("nrl,nl->nr", rows.by_leg, values))
    along = rows.components.index(late.name.rpartition("_")[2])
    return np.asarray(values[:, None] * rows.by_base[..., along])


def _two_sided(u: float) -> float:
    return float(_core.chi_square_tail(u**2, 1))


def _term(
    rows: LinearRows,
    what: str,
    of: str,
    leg: int,
    column: Array,
    row: int = -1,
    p_of: Callable[[float], float] = _two_sided,
) -> Iterator[Term]:
    """A term, unless the unknowns explain all of it, as of a step where one is unknown already."""
    length = rows.length(column)
    if length > SILENT * np.linalg.norm(column) > 0:
        yield Term(what, of, leg, row, column, length, p_of)


def _step(
    numbers: NDArray[np.intp], rows: LinearRows, of: str, leg: int, one: Array
) -> Iterator[Term]:
    """The step that shows most of all rows, between the first and the last few."""
    steps, scores, alike = step_scores(one, rows.basis, rows.residual)
    if not len(steps):
        return
    step = steps[np.abs(scores).argmax()]
    # As the unknown has it, -1 before: a constant beside is not.
    column = np.where(np.arange(len(one))[:, None] < step, -one, 0.0)
    row = int(numbers[rows.order[step]])
    yield from _term(rows, "step", of, leg, column, row, lambda u: largest_of_steps(u, alike))


def step_scores(one: Array, basis: Array, residual: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Where a step may be, the score of each, and the correlations of neighbouring scores.

    Of rows that change by `one` from the step on, shape (n, r); residuals likewise, of which what
    the orthonormal basis, shape (n, r, k), explains is taken out. Empty where a step cannot be told
    from that.
    """
    steps = np.arange(_TRIM, len(one) - _TRIM + 1)
    if len(steps) < _TRIM:
        return steps[:0], np.empty(0), np.empty(0)

    def from_here(values: Array) -> Array:
        return np.asarray(np.cumsum(values[::-1], axis=0)[::-1][steps])

    squares = from_here(np.square(one).sum(axis=1))
    explained = from_here(np.einsum("nrk,nr->nk", basis, one))
    left = squares - np.square(explained).sum(axis=1)
    if not (left > SILENT**2 * squares).all():
        return steps[:0], np.empty(0), np.empty(0)
    scores = from_here((one * residual).sum(axis=1)) / np.sqrt(left)
    shared = squares[1:] - (explained[1:] * explained[:-1]).sum(axis=1)
    return steps, scores, np.clip(shared / np.sqrt(left[1:] * left[:-1]), -1.0, 1.0)


def largest_of_steps(largest: float, alike: Array) -> float:
    """Probability, hardly exceeded, that the largest of scores of a series is as large.

    Of standard normal scores whose neighbours have these correlations: that the first is beyond,
    or any is whose neighbour before is not (Davies 1977, in steps).
    """
    slopes = np.sqrt((1 - alike) / (1 + alike).clip(1e-300))
    # Owen's T(h, a): the probability that of two of this correlation one is beyond h is 2 T.
    nodes = slopes[:, None] * (_NODES + 1) / 2
    values = np.exp(-(largest**2) * (1 + nodes**2) / 2) / (1 + nodes**2)
    crossings = slopes / 2 * (values @ _WEIGHTS) / (2 * np.pi)
    return float(min(_two_sided(largest) + 4 * crossings.sum(), 1.0))


def _names(found: Found, terms: Sequence[Term]) -> tuple[list[str], tuple[str, ...]]:
    per = "K" if found.measurements.temperatures is not None else ""
    names = []
    for each in terms:
        own = f"step{each.row}" if each.what == "step" else each.what
        names.append(
            own if not each.of else f"{each.of}.{own}" if each.leg >= 0 else f"{own}.{each.of}"
        )
    full = [f"leg1.{each}" if each == "growth" else each for each in names]
    units = slope_units(found.nominal, full, {"growth": per})
    return names, tuple(
        "" if each.startswith("lag") else unit for each, unit in zip(names, units, strict=True)
    )


_CODES = {
    "drift": "drifts",
    "step": "steps",
    "growth": "grows",
    "backlash": "has-backlash",
    "clock": "clock-late",
    "lag": "lags",
}
CHANGES = frozenset(_CODES.values())
_SHOWN = {"": "positions", _TURNS: "orientations"}


def whole_change(doubts: Sequence[Doubt]) -> Doubt | None:
    """What explains all that noise does not, so that no other cause has to be looked for."""
    return next((each for each in doubts if each.figures.get("whole") is True), None)


def doubts_of_changes(tests: Sequence[ChangeTest]) -> Iterator[Doubt]:
    """Say what changed most, and what explains as much: other terms often show a part of it."""
    alarms = [each for each in tests if each.alarms]
    alarms.sort(key=lambda each: (not each.whole, each.p_value / each.limit, -abs(each.statistic)))
    if not alarms:
        return
    worst, told = alarms[0], dict[tuple[str, bool], ChangeTest]()
    for each in alarms:
        as_much = worst.statistic**2 - each.statistic**2 < BETTER
        if as_much and each.whole >= worst.whole:
            told.setdefault((each.what, each.leg < 0), each)
    first, *others = (_doubt_of(each, alarms) for each in told.values())
    yield dataclasses.replace(first, others=tuple(others))


def _doubt_of(worst: ChangeTest, alarms: Sequence[ChangeTest]) -> Doubt:
    legs = (worst.leg,) if worst.leg >= 0 else ()
    component = worst.name.partition(".")[2]
    figures = {
        "whose": f"what the sensor of leg {worst.leg + 1} shows"
        if legs
        else f"{component} of where the robot stands to the measuring device",
        "amount": _amount(worst),
        "whole": worst.whole,
        "most": worst.most,
        "evidence": f" ({abs(worst.statistic):.1f} standard deviations, p {worst.p_value:.1g})",
    }
    if worst.what == "lag":
        lags = {each.name for each in alarms if each.what == "lag"}
        figures["shown"] = "poses" if len(lags) > 1 else _SHOWN[component]
    rows = (worst.row,) if worst.what == "step" else ()
    return Doubt(
        _CODES[worst.what], legs, rows, worst.size, worst.p_value, figures, asked_for(worst)
    )


def asked_for(change: ChangeTest | Term) -> dict[str, Any]:
    """Options by which it is an unknown; none if there are none."""
    asked: dict[str, dict[str, Any]] = {
        "drift": {"drift": ["leg" if change.leg >= 0 else "frame"]},
        "step": {"step": [f"{change.row}" if change.leg >= 0 else f"frame:{change.row}"]},
        "growth": {"growth": True},
        "backlash": {"backlash": True},
        "clock": {"clock_offset": True},
        "lag": {},
    }
    return asked[change.what]


def _amount(test: ChangeTest) -> str:
    """The size with its deviation, in thousandths; of a growth in millionths."""
    if test.what == "growth":
        per = "/K" if test.unit else ""
        return f"{1e6 * test.size:+.0f} +- {1e6 * test.deviation:.0f} ppm{per}"
    if test.what == "lag":
        return f"{100 * test.size:.3g} +- {100 * test.deviation:.2g} %"
    return thousandths(test.size, test.deviation, test.unit)


def thousandths(size: float, deviation: float, unit: str) -> str:
    """A size with its deviation, in thousandths of its unit."""
    return f"{1e3 * size:+.3g} +- {1e3 * deviation:.2g} m{unit}"
