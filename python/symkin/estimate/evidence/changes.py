# SPDX-License-Identifier: MIT
"""Tests for what changes while a robot is measured: drift, steps, growth, backlash, a late device.

Every term is a covariate of the rows whose slope was held at zero. One step from the estimate says
how large it would be and how many standard deviations that is, once all that the unknowns could
explain is taken out. All terms together alarm for one of 1000 sound robots, half of them steps.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.changes import slopes_found
from symkin.estimate.covariates import (
    Covariate,
    clock,
    last_moves,
    late_clock,
    observations_of,
)
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.residuals import ALARMS, BETTER
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.estimate.kept import once
from symkin.estimate.problem import own_readings
from symkin.estimate.scalars import slope_units
from symkin.model.core_setup import core_setup, scalar_names
from symkin.model.framing import framed, unframed
from symkin.model.poses import Transform, between, frame, transforms
from symkin.model.settings import Frames
from symkin.values import Array, Value, field, record

_TRIM = 2  # rows before the first and after the last step that is looked for
_RANK = 1e-9  # of the largest singular value
_ALIKE = 1e-10  # of the largest eigenvalue of columns of unit length
SILENT = 1e-6  # of a column: the unknowns explain all of it
_SMALL_LAG = 0.5  # of the last move
_CLEAR_MOVES = 10.0  # mean square, in noise, for each row
_MOST = 0.9  # of what noise does not explain
_PER_LEG, _GROWS = "one", "all"  # names of covariates that are 1 in every row
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


class Explained(NamedTuple):
    """What columns explain of residuals, together: sizes and their covariance, of chi-square."""

    sizes: Array
    covariance: Array
    drop: float


@record
class Rows:
    """Whitened rows of poses in the order of time, and what is left of them."""

    residual: Array  # n x r, less what the unknowns explain
    basis: Array  # n x r x k, orthonormal, of what they explain
    by_basis: Array  # k x unknowns: how these move with it
    by_leg: Array  # n x r x legs: of readings that show 1 more
    by_growth: Array  # n x r
    by_base: Array  # n x r x components
    by_point: Array  # n x r x points x axes: of places on the platform
    components: tuple[str, ...]
    order: NDArray[np.intp]  # the rows of the measurements
    spare: int
    used: NDArray[np.bool_]  # n x r: which are conditions
    by_priors: float = 0.0  # of chi-square: what they ask for

    @property
    def square(self) -> float:
        """Chi-square, as a sum of squares."""
        return float(np.square(self.residual).sum()) + self.by_priors

    def left(self, column: Array) -> Array:
        """What the unknowns leave of a column, n x r."""
        explained = np.einsum("nrk,nr->k", self.basis, column)
        return np.asarray(column - self.basis @ explained)

    def length(self, column: Array) -> float:
        """Of what the unknowns leave of a column: by how many deviations a unit of it shows.

        Unknowns with priors explain it at a cost, so that more is left than `left` is long.
        """
        return math.sqrt(max(float(np.sum(column * self.left(column))), 0.0))

    def score(self, column: Array) -> float:
        """How many standard deviations of noise as declared there are of a column alone."""
        return -float(np.sum(column * self.residual)) / self.length(column)

    def explained(self, columns: Sequence[Array]) -> Explained:
        """By columns together, which may be of very different lengths, or alike."""
        stacked = np.stack(columns)
        shared = np.einsum("anr,bnr->ab", stacked, np.stack([self.left(each) for each in stacked]))
        unit = 1 / np.sqrt(np.diag(shared))
        both = unit[:, None] * unit
        inverse = np.linalg.pinv(shared * both, rcond=_ALIKE, hermitian=True) * both
        along = -np.einsum("anr,nr->a", stacked, self.residual)
        sizes = inverse @ along
        return Explained(sizes, inverse, float(along @ sizes))

    def shown_by_repeating(self, column: Array) -> Array:
        """How much longer each row would make what is `left` (squared), measured again without it.

        Shape (n,): by what the unknowns explain of the column there, and how well they are known.
        """
        there = column - self.left(column)
        known = np.eye(there.shape[1]) + self.basis @ self.basis.swapaxes(1, 2)
        return np.asarray(
            np.einsum("nr,nr->n", there, np.linalg.solve(known, there[..., None])[..., 0])
        )

    def moved(self, column: Array) -> Array:
        """By how much the unknowns are off if so much of a column, n x r, was taken for noise."""
        return np.asarray(-np.einsum("nrk,nr->k", self.basis, column) @ self.by_basis)


def change_tests(found: Found, apart: Sequence[int] = ()) -> tuple[ChangeTest, ...]:
    """Test an estimate, without the poses that are outliers; empty where nothing is to spare."""
    try:
        rows = rows_of_changes(found, tuple(apart))
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


def _drop(rows: Rows, terms: Sequence[Term], kind: tuple[str, bool]) -> tuple[float, int]:
    """How much of chi-square all terms of a kind explain together, and how many they are."""
    own = [each.column for each in terms if each.kind == kind]
    return rows.explained(own).drop, len(own)


def terms_of_changes(found: Found, rows: Rows) -> Iterator[Term]:
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


def _lags(found: Found, rows: Rows) -> Iterator[tuple[str, Array]]:
    """Of positions, and of orientations, that stay behind by a share of the last move, n x r.

    As if the base had stood so much further back, turned about where the platform is. What is seen
    of a move has a row's noise, as its residual has, which passes for a lag where moves are small:
    those of a platform whose turns its legs bind are no matter.
    """
    measured, robot = found.measurements, found.mechanism
    if not (np.isfinite(measured.poses).any() or measured.points is not None):
        return
    places = unframed(robot, measured.poses) if found.legs else found.latent_poses
    robot = robot.replace(frames=None) if found.legs else robot
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


def _along(rows: Rows, late: Covariate) -> Array:
    """Of a slope of readings, or of the base along the axis that it is named after, n x r."""
    values = late.values[rows.order]
    if late.of == "reading":
        return np.asarray(np.einsum("nrl,nl->nr", rows.by_leg, values))
    along = rows.components.index(late.name.rpartition("_")[2])
    return np.asarray(values[:, None] * rows.by_base[..., along])


def _two_sided(u: float) -> float:
    return float(_core.chi_square_tail(u**2, 1))


def _term(
    rows: Rows,
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


def _step(numbers: NDArray[np.intp], rows: Rows, of: str, leg: int, one: Array) -> Iterator[Term]:
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


@once
def rows_of_changes(found: Found, apart: tuple[int, ...]) -> Rows | None:
    """Rows of the poses that were estimated from, linearised at the estimate."""
    robot, measured = found.mechanism, found.measurements
    places = unframed(robot, measured.poses) if found.legs else found.latent_poses
    curvature = robot.curvature
    if found.legs:
        robot = robot.replace(frames=None)
    if found.options.poses == "own":
        measured = own_readings(robot, measured)
    robot, legs = robot.replace(curvature=None), len(robot.legs)
    estimated = found.options.covariates(robot, measured)
    ones = np.ones((len(measured), legs))
    added = (
        Covariate(_PER_LEG, "reading", ones),
        *((Covariate(_GROWS, "lengths", ones),) if robot.space.moves else ()),
        Covariate(_PER_LEG, "base", ones[:, 0]),
    )
    covariates = (*estimated, *added)
    setup = core_setup(robot, curvature, slopes_found(found, covariates))
    names = scalar_names(robot, setup)
    values = {each.name: each for each in found.unknowns}
    column = [values[each].column if each in values else -1 for each in names]
    free = len(found.names)
    wanted = [i for i, each in enumerate(names) if {*each.split(".")} & {_PER_LEG, _GROWS}]
    count = free
    for i in wanted:
        if not names[i].endswith(_GROWS):
            column[i], count = count, count + 1
    for i in wanted:
        if names[i].endswith(_GROWS):
            column[i] = count
    count += any(names[i].endswith(_GROWS) for i in wanted)
    placed = [i for i, each in enumerate(names) if each.startswith("point")]
    if any(column[i] < 0 and names[i] in values and values[names[i]].moves for i in placed):
        placed = []
    for i in placed:
        if column[i] < 0:
            column[i], count = count, count + 1
    seen = observations_of(measured, found.noise, covariates)
    ties = [
        (i, *each)
        for i, name in enumerate(names)
        if column[i] < 0 and name in values
        for each in values[name].moves
    ]
    rows = _core.observed_rows(
        robot.core,
        setup,
        seen,
        column,
        np.full(count, np.inf),
        np.ascontiguousarray(places),
        ties=ties,
    )
    n = len(measured)
    jacobian, residual = rows.jacobian.reshape(n, -1, count), rows.residual.reshape(n, -1)
    aside = {*apart, *found.aside, *(row for row, _ in found.rejected)}
    finite = np.isfinite(jacobian).all(axis=(1, 2))
    without = np.isin(np.arange(n), [*aside])
    order = np.argsort(clock(measured), kind="stable")
    order = order[(finite & ~without)[order]]
    removed = _gradient(jacobian[finite & without, :, :free], residual[finite & without])
    by_priors = found.chi_square - float(np.square(residual[finite]).sum())
    jacobian, residual = jacobian[order], residual[order]
    if not residual.size:
        return None
    priors = found.prior_rows
    own = jacobian[..., :free]
    if len(priors) and found.options.loss == "none":  # where all gradients cancel
        gradient = -removed
    else:
        asked = priors @ np.nan_to_num(np.array([each.change for each in found.first_unknowns]))
        gradient, by_priors = _gradient(own, residual) + priors.T @ asked, float(asked @ asked)
    stacked = np.concatenate([own.reshape(-1, free), priors])
    lengths = np.linalg.norm(stacked, axis=0)
    lengths[lengths == 0] = 1
    tall, upper = np.linalg.qr(stacked / lengths)
    left, singular, right = np.linalg.svd(upper, full_matrices=False)
    shown = singular > _RANK * singular[0]
    basis = (tall @ left[:, shown])[: residual.size].reshape(*residual.shape, -1)
    half = (right[shown] / lengths) / singular[shown, None]
    residual = residual - own @ (half.T @ (half @ gradient))
    used = np.abs(jacobian).max(axis=2) > 0
    places_of_base = [i for i in wanted if names[i].startswith(f"{_PER_LEG}.")]
    by = jacobian[..., free:]
    bases = by[..., legs : legs + len(places_of_base)]
    at_growth = legs + len(places_of_base)
    growth = by[..., at_growth] if robot.space.moves else np.zeros_like(residual)
    points = len({names[i].partition(".")[0] for i in placed})
    spare = int(used.sum()) + int(np.linalg.matrix_rank(priors)) - int(shown.sum())
    components = tuple(names[i].partition(".")[2] for i in places_of_base)
    by_leg = by[..., :legs]
    return Rows(
        residual=residual,
        basis=basis,
        by_basis=half,
        by_leg=by_leg,
        by_growth=growth,
        by_base=bases,
        by_point=jacobian[..., [column[i] for i in placed]].reshape(
            *residual.shape, points, len(placed) // max(points, 1)
        ),
        components=components,
        order=order,
        spare=spare,
        used=used,
        by_priors=max(by_priors, 0.0),
    )


def _gradient(rows: Array, residual: Array) -> Array:
    return np.asarray(np.einsum("nrk,nr->k", rows, residual))


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
