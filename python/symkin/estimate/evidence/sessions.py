# SPDX-License-Identifier: MIT
"""Tests for what differs between the sessions of measurements: noise, offsets, frames.

Noise comes first, since under a wrong one shifts seem to be there that are not. Shifts are tested
by F, in which the noise is the residuals' own; and a block is named only if it shows with the
other's columns taken out, since a turned base is nearly an offset on every sensor.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.covariates import sessions_of
from symkin.estimate.evidence.changes import thousandths
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found
from symkin.estimate.scalars import slope_units
from symkin.estimate.solution import together
from symkin.values import Array, Value, record

_NAMED = 0.01  # p of a block with the other taken out, below which it is named
_SHOWN = 5.0  # standard deviations, of a shift that explains what others do not
_NEARLY = 0.01  # of what noise does not explain: what is left of it is another matter
_AS_MUCH = 0.9  # of the score of another change; two levels show 0.87 of a ramp, a drift
_RANK = 1e-8  # of the largest singular value: columns that others explain
_TOGETHER = 2  # kinds of test that share the share of false alarms: noise and shifts
SESSIONS = frozenset({"sessions-noise", "sessions-offsets", "sessions-frames", "sessions-moved"})


@record
class SessionTest(Value):
    """A test for something that sessions have of their own.

    Attributes
    ----------
    what : str
        "noise", "offsets" or "frames".
    session : int
        Of noise, the session that is compared with all others; else -1.
    statistic : float
        F: of noise, the ratio of both variances; else of what the columns explain over the rest.
    degrees_of_freedom : tuple of int
        Degrees of freedom of F.
    p_value : float
        Probability of one as far out for a sound robot.
    p_besides : float
        Likewise with the columns of the other block taken out; of noise the same.
    limit : float
        Below which `p_value` alarms.
    largest : str
        Of the columns, the one that shows most by itself, as an unknown is named.
    size, deviation : float
        Of it, in its unit: one step from the estimate; of noise, times that of the others.
    score : float
        Of it alone, in standard deviations.
    whole : bool
        Whether noise explains all that these columns, or another noise of the session, leave.
    """

    what: str
    session: int
    statistic: float
    degrees_of_freedom: tuple[int, int]
    p_value: float
    p_besides: float
    limit: float
    largest: str
    size: float
    deviation: float
    score: float
    whole: bool

    @property
    def alarms(self) -> bool:
        """Whether it speaks against the model."""
        return self.p_value < self.limit


def session_tests(found: Found, apart: Sequence[int] = ()) -> tuple[SessionTest, ...]:
    """Test an estimate, without the poses that are outliers; empty where there are no sessions."""
    try:
        sessions = sessions_of(found.measurements)
        rows = linear_rows(found, tuple(apart))
    except SymkinError:
        return ()
    if rows is None or rows.spare < 2:
        return ()
    own = {number: of[rows.order] for number, of in sessions.items() if of[rows.order].any()}
    if len(own) < 2:
        return ()
    share = _NAMED if found.unexplained else ALARMS  # of what something is wrong with anyhow
    noise: tuple[SessionTest, ...] = ()
    if not found.session_noise:
        noise = tuple(_of_noise(_whatever_shifted(found, rows, own), own, share / _TOGETHER))
    times = np.ones(len(rows.residual))
    for each in noise:
        if each.alarms:  # of several the strongest is not the only one: each by its own
            times[own[each.session]] = each.size
    return (*noise, *_of_shifts(found, rows, own, times, share / _TOGETHER))


def _whatever_shifted(
    found: Found, rows: LinearRows, own: dict[int, NDArray[np.bool_]]
) -> LinearRows:
    """Rows with all that sessions may have of their own among what is explained."""
    weights = rows.used.ravel().astype(float)
    blocks = _blocks(found, rows, own, weights)
    if not blocks:
        return rows
    span = _span(np.column_stack([each.columns for each in blocks]))
    shape = (*rows.residual.shape, -1)
    basis = np.concatenate([rows.basis, span.reshape(shape)], axis=2)
    left = _less(rows.residual.ravel(), span).reshape(rows.residual.shape)
    return dataclasses.replace(rows, basis=basis, residual=left)


def _of_noise(
    rows: LinearRows, own: dict[int, NDArray[np.bool_]], share: float
) -> Iterator[SessionTest]:
    """Of each session against all others: mean squares over what is redundant in them."""
    squares = np.square(rows.residual).sum(axis=1)
    free = (rows.used * (1 - np.square(rows.basis).sum(axis=2))).sum(axis=1)
    sessions = list(own.items())[: len(own) if len(own) > 2 else 1]
    for number, of in sessions:
        degrees = round(float(free[of].sum())), round(float(free[~of].sum()))
        if min(degrees) < 1:
            continue
        mine, others = squares[of].sum() / free[of].sum(), squares[~of].sum() / free[~of].sum()
        ratio = float(mine / others)
        tail = _core.f_tail(ratio, *degrees)
        p_value = min(2 * min(tail, 1 - tail), 1.0)
        times = _times(rows, of)
        within = np.where(of, squares / times**2, squares)
        rest = _core.chi_square_tail(float(within.sum()), sum(degrees))
        spread = float(np.sqrt(sum(1 / each for each in degrees) / 2))
        yield SessionTest(
            what="noise",
            session=number,
            statistic=ratio,
            degrees_of_freedom=degrees,
            p_value=p_value,
            p_besides=p_value,
            limit=share / len(sessions),
            largest=f"session{number}.noise",
            size=times,
            deviation=times * spread,
            score=abs(float(np.log(ratio))) / 2 / spread,
            whole=bool(rest > FALSE_ALARMS),
        )


def _times(rows: LinearRows, of: NDArray[np.bool_]) -> float:
    """How many times the noise of the others that of some rows is.

    Residuals of either contain a share of the other's noise, which this takes out (Rao, J. Am.
    Stat. Assoc. 67, 1972): sums of squares are what both variances would have them be in the mean.
    """
    parts = (of, ~of)
    grams = [np.einsum("nri,nrj->ij", rows.basis[each], rows.basis[each]) for each in parts]
    own = [rows.used[e].sum() - 2 * np.trace(g) for e, g in zip(parts, grams, strict=True)]
    mean = np.array([[np.sum(a * b) for b in grams] for a in grams]) + np.diag(own)
    squares = [np.square(rows.residual[each]).sum() for each in parts]
    mine, others = np.linalg.solve(mean, squares).clip(1e-3 * max(squares) / max(map(len, grams)))
    return float(np.sqrt(mine / others))


@record
class _Block:
    """Columns of one kind, by the names of their unknowns, M x k."""

    what: str
    names: list[str]
    columns: Array


def _basis(rows: LinearRows, weights: Array) -> Array:
    """What the unknowns explain of rows of such weights."""
    basis = rows.basis.reshape(len(weights), -1) * weights[:, None]
    return basis if np.isin(weights, (0, 1)).all() else np.linalg.qr(basis)[0]


def _blocks(
    found: Found, rows: LinearRows, own: dict[int, NDArray[np.bool_]], weights: Array
) -> list[_Block]:
    """What the unknowns leave of what all sessions but the last may have of their own."""
    basis = _basis(rows, weights)
    earlier = [(number, of) for number, of in own.items() if number != max(own)]
    legs = [f"leg{leg + 1}" for leg in range(rows.by_leg.shape[2])]
    blocks = []
    for what, of_one, names in (
        ("offsets", rows.by_leg, [f"{leg}.session{{}}" for leg in legs]),
        ("frames", rows.by_base, [f"session{{}}.{each}" for each in rows.components]),
    ):
        columns = [
            (of[:, None, None] * of_one).reshape(len(weights), -1) * weights[:, None]
            for _, of in earlier
        ]
        named = [name.format(number) for number, _ in earlier for name in names]
        if what not in found.options.sessions:
            blocks.append(_Block(what, named, _less(np.column_stack(columns), basis)))
    return blocks


def _of_shifts(
    found: Found, rows: LinearRows, own: dict[int, NDArray[np.bool_]], times: Array, share: float
) -> Iterator[SessionTest]:
    """Of what all sessions but the last have of their own."""
    weights = (rows.used / times[:, None]).ravel()
    residual = _less(rows.residual.ravel() * weights, _basis(rows, weights))
    blocks = _blocks(found, rows, own, weights)
    for block in blocks:
        test = _tested(block, residual, rows.spare)
        if test is None:
            continue
        statistic, degrees, square = test
        others = [each.columns for each in blocks if each is not block]
        besides = _core.f_tail(statistic, *degrees)
        if others:
            span = _span(np.column_stack(others))
            left = _Block(block.what, block.names, _less(block.columns, span))
            more = _tested(left, _less(residual, span), rows.spare - span.shape[1])
            besides = 1.0 if more is None else _core.f_tail(more[0], *more[1])
        scale = np.sqrt(max(square / degrees[1], 1.0))
        lengths = np.linalg.norm(block.columns, axis=0)
        lengths[lengths == 0] = np.inf
        scores = -(block.columns / lengths).T @ residual / scale
        worst = int(np.abs(scores).argmax())
        yield SessionTest(
            what=block.what,
            session=-1,
            statistic=statistic,
            degrees_of_freedom=degrees,
            p_value=_core.f_tail(statistic, *degrees),
            p_besides=besides,
            limit=share / len(blocks),
            largest=block.names[worst],
            size=float(scores[worst] * scale / lengths[worst]),
            deviation=float(scale / lengths[worst]),
            score=float(abs(scores[worst])),
            whole=bool(_core.chi_square_tail(square, degrees[1]) > FALSE_ALARMS),
        )


def _tested(
    block: _Block, residual: Array, spare: int
) -> tuple[float, tuple[int, int], float] | None:
    """F of columns, its degrees of freedom and the squares that they leave; None without any."""
    span = _span(block.columns)
    terms, rest = span.shape[1], spare - span.shape[1]
    if terms < 1 or rest < 1:
        return None
    explained = float(np.square(span.T @ residual).sum())
    left = max(float(np.square(residual).sum()) - explained, 1e-300)
    return explained / terms / (left / rest), (terms, rest), left


def _span(columns: Array) -> Array:
    """Orthonormal columns that span these."""
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns / np.where(lengths > 0, lengths, 1.0)
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, values > _RANK * max(values.max(initial=0.0), 1e-300)])


def _less(columns: Array, basis: Array) -> Array:
    """What an orthonormal basis leaves of columns; of what it explains wholly, nothing."""
    left = columns - basis @ (basis.T @ columns)
    if columns.ndim == 1:
        return np.asarray(left)
    sizes, kept = (np.linalg.norm(each, axis=0) for each in (columns, left))
    return np.asarray(np.where(kept > 1e-6 * sizes, left, 0.0))


def shift_that_explains(found: Found) -> list[Doubt]:
    """What sessions have of their own if that alone explains nearly all that noise does not.

    By estimates, since of a device that was set up elsewhere the first order says nothing.
    """
    already = [*found.options.sessions]
    try:
        sessions_of(found.measurements)
    except SymkinError:
        return []
    best: tuple[float, Found, list[str]] | None = None
    for blocks in (["frames"], ["offsets"], ["offsets", "frames"]):
        what = [each for each in blocks if each not in already]
        if not what or (best is not None and len(blocks) > 1):
            continue
        own = (*already, *what)
        try:
            options = dataclasses.replace(found.options, estimator="joint", sessions=own)
            tried = together(found.nominal, found.measurements, options)
        except SymkinError:
            continue
        most = tried.converged and leaves_little(found, tried)
        if most and (best is None or tried.chi_square_ratio < best[0]):
            best = tried.chi_square_ratio, tried, what
    if best is None:
        return []
    _, tried, what = best
    moved = [each for each in tried.unknowns if "session" in each.name and each.column >= 0]
    worst = max(moved, key=lambda each: abs(each.value) / each.deviation)
    if abs(worst.value) < _SHOWN * worst.deviation:  # the other start explains it, not a shift
        return []
    amount = thousandths(worst.value, worst.deviation, worst.unit)
    told = {"whole": True, "evidence": "", "largest": worst.name, "amount": amount, "which": "and"}
    code = f"sessions-{what[0] if len(what) == 1 else 'moved'}"
    return [Doubt(code, (), (), worst.value, 0.0, told, {"sessions": [*already, *what]})]


def leaves_little(found: Found, tried: Found) -> bool:
    """Whether another estimate explains nearly all that noise does not of this one."""
    left = (tried.chi_square_ratio - 1) / (found.chi_square_ratio - 1)
    return not tried.unexplained or left < _NEARLY


def shift_is_shown(tests: Sequence[SessionTest], score: float) -> bool:
    """Whether sessions that shifted show at least nearly as much as another change does."""
    shifts = [each.score for each in tests if each.what != "noise" and each.alarms]
    return bool(shifts) and max(shifts) > _AS_MUCH * score


def doubts_of_sessions(found: Found, tests: Sequence[SessionTest]) -> Iterator[Doubt]:
    """Say which of them differ, and in what; noise first."""
    already = list(found.options.sessions)

    def doubt(code: str, test: SessionTest, more: list[str], **figures: Any) -> Doubt:
        told = {"whole": test.whole, "evidence": f" (p {test.p_value:.1g})", **figures}
        options = {"sessions": [*already, *(each for each in more if each not in already)]}
        return Doubt(code, (), (), test.size, test.p_value, told, options)

    noise = [each for each in tests if each.what == "noise" and each.alarms]
    if noise:
        worst = min(noise, key=lambda each: each.p_value)
        figures = {"session": worst.session, "times": f"{worst.size:.2g}"}
        yield doubt("sessions-noise", worst, ["noise"], **figures)
    shifts = [each for each in tests if each.what != "noise"]
    if not any(each.alarms for each in shifts):
        return
    named = [each for each in shifts if each.alarms and each.p_besides < _NAMED]
    worst = min(named or shifts, key=lambda each: (each.p_besides, each.p_value))
    code = f"sessions-{named[0].what}" if len(named) == 1 else "sessions-moved"
    which = "and" if len(named) == 2 else "or"
    blocks = [each.what for each in named or shifts]
    (unit,) = slope_units(found.nominal, [worst.largest], {})
    amount = thousandths(worst.size, worst.deviation, unit)
    what = [*(["noise"] if noise else []), *blocks]
    yield doubt(code, worst, what, which=which, largest=worst.largest, amount=amount)
