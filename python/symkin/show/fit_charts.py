# SPDX-License-Identifier: MIT
"""What is on the page of every estimate, as data: its observations, and errors before and after."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.evaluation import Evaluation
from symkin.analysis.promises import ExpectedAccuracy
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.outliers import blunder_limit, blunders_of
from symkin.estimate.problem import KINDS
from symkin.show.chart import Area, Chart, Curve, Drawn, Note, Panel, Points, Rule, Sign
from symkin.show.theme import ACCENT, AFTER, BEFORE, INK, LINE, MANY, leg_style
from symkin.show.wording import small

__all__ = ["binned", "error_chart", "error_sizes", "rms", "t_chart"]

Array = NDArray[np.float64]

_BINS, _LEAST_IN_BIN = 120, 20
_WORST = 100  # rows of a leg
_HELD = (0.05, 0.95)  # quantiles between which a bin holds most
_NAMED = 5  # blunders
_ALPHA = 0.75


def t_chart(found: Estimate) -> Chart:
    """Show the estimated error of every observation in standard deviations, row by row."""
    rows, space = found.rows, found.nominal.pose_space
    numbers = found.measurements.row_numbers[rows.pose]
    reading = np.isin(rows.kind, [KINDS.index("readings"), KINDS.index("closures")])
    groups = [(reading & (rows.index == leg), leg) for leg in range(len(found.nominal.legs))]
    drawn: list[Drawn] = [Rule("y", 0.0, LINE, 0.8)]
    signs = []
    for own, leg in [*groups, (~reading, None)]:
        if not own.any():
            continue
        colour, marker = (INK, ".") if leg is None else leg_style(leg)
        many, kept = binned(numbers[own], rows.t[own], colour)
        worst = np.flatnonzero(own)[kept]
        shown = zip(worst.tolist(), numbers[worst], rows.t[worst], strict=True)
        names = [f"row {number}, {rows.what(row, space)}: {t:+.2g}" for row, number, t in shown]
        drawn += [*many, Points(numbers[worst], rows.t[worst], marker, colour, names)]
        signs.append(Sign("poses and others" if leg is None else f"leg {leg + 1}", colour, marker))
    limit = blunder_limit(found)
    drawn += [Rule("y", side, ACCENT, 0.9, "--") for side in (-limit, limit)]
    drawn += [
        Note(each.row_number, each.student, f" {each.what}, row {each.row_number}")
        for each in islice(blunders_of(found), _NAMED)
    ]
    panel = Panel("row of the measurements", "t, standard deviations", drawn, "whole")
    return Chart(9.2, 3.8, [panel], signs)


def error_chart(
    before: Evaluation, after: Evaluation, expected: ExpectedAccuracy | None = None
) -> Chart:
    """Show the distribution of the errors on a logarithmic scale, with root mean squares."""
    panels = []
    sizes = zip(before.kinds, error_sizes(before), error_sizes(after), strict=True)
    for (kind, unit), old, new in sizes:
        factor, told = small(unit)
        foreseen = None if expected is None else factor * getattr(expected, kind)
        drawn = list(_histogram(factor * old, factor * new, foreseen))
        panels.append(
            Panel(f"{kind} error, {told}", "poses, %", drawn, "logarithmic", from_zero=True)
        )
    signs = [
        Sign("before", BEFORE, alpha=_ALPHA),
        Sign("after", AFTER, alpha=_ALPHA),
        Sign("root mean square", INK, dash="--"),
        *[Sign("expected after", INK, dash=":")] * (expected is not None),
    ]
    return Chart(8.6 if len(panels) > 1 else 4.6, 3.5, panels, signs)


def error_sizes(evaluation: Evaluation) -> list[Array]:
    """Distance (m) and angle (rad) of each pose's error, of those that were evaluated."""
    sizes = dict(zip(("position", "orientation"), evaluation.errors, strict=True))
    return [sizes[kind] for kind, _ in evaluation.kinds]


def binned(x: NDArray[Any], values: Array, colour: str) -> tuple[list[Drawn], NDArray[np.intp]]:
    """What is drawn of many points together, and which are drawn one by one: all if they are few.

    Each bin is drawn by its median and by what holds most of its values; the worst, by themselves.
    """
    if len(values) <= MANY:
        return [], np.arange(len(values))
    drawn: list[Drawn] = []
    known = np.flatnonzero(np.isfinite(values))
    if len(known) > _LEAST_IN_BIN:
        along = known[np.argsort(x[known], kind="stable")]
        parts = np.array_split(along, min(_BINS, len(along) // _LEAST_IN_BIN))
        middle = [float(np.median(x[part])) for part in parts]
        low, half, high = np.array(
            [np.quantile(values[part], (_HELD[0], 0.5, _HELD[1])) for part in parts]
        ).T
        drawn = [Area(middle, low, high, colour, 0.3), Curve(middle, half, colour)]
    worst = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")[:_WORST]
    return drawn, np.sort(worst)


def rms(values: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def _histogram(before: Array, after: Array, expected: float | None) -> Iterator[Drawn]:
    shown = [sizes[sizes > 0] for sizes in (before, after)]
    both = np.concatenate(shown)
    if not both.size:
        return
    # The smallest errors are a long thin tail, left out because it would squeeze the rest.
    low, high = np.quantile(both, 0.002), both.max() * 1.1
    edges = np.geomspace(min(low, 0.5 * high), high, 50 if len(both) > 1000 else 26)
    for sizes, colour in zip(shown, (BEFORE, AFTER), strict=True):
        shares = 100 * np.histogram(sizes, edges)[0] / max(1, len(sizes))
        steps = shares.repeat(2)
        yield Area(edges.repeat(2)[1:-1].tolist(), np.zeros_like(steps), steps, colour, _ALPHA)
        if len(sizes):
            yield Rule("x", rms(sizes), colour, 1.6, "--")
    if expected:
        yield Rule("x", expected, INK, 1.4, ":")
