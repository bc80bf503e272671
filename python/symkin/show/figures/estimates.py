# SPDX-License-Identifier: MIT
"""What was planned, identified and achieved: observability, residuals, errors."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, NullLocator, ScalarFormatter
from numpy.typing import ArrayLike, NDArray

from symkin.analysis.evaluation import Evaluation
from symkin.analysis.promises import NORMAL_95, ExpectedAccuracy
from symkin.analysis.workspace import WorkspaceSample, coordinate_names, workspace_coordinates
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.outliers import blunder_limit
from symkin.estimate.problem import KINDS
from symkin.model.mechanism import Mechanism
from symkin.model.poses import PoseSpace
from symkin.planning import PoseCountCurve
from symkin.show.figures.style import (
    COLOUR_MAP,
    SMALL,
    colour_bar,
    flat_axes,
    leg_patches,
    leg_style,
    legend,
    legend_below,
    new_figure,
    own_axes,
    powers_of_ten,
    sign,
)
from symkin.show.figures.workspaces import View, shown_of, views_of
from symkin.show.observations import in_deviations, rms
from symkin.show.theme import ACCENT, AFTER, BEFORE, INK, LINE, MANY, name_points
from symkin.show.units import on_paper
from symkin.show.wording import milli, quantity, small
from symkin.values import Array

INTERVAL = NORMAL_95  # standard deviations: holds 95% of normal errors
_COLUMNS = 3  # of panels, one a leg
_FEW = 1500  # poses that a map shows one by one
_BINS, _LEAST_IN_BIN = 120, 20
_WORST = 100  # rows of a leg
_HELD = (0.05, 0.95)  # quantiles between which a bin holds most
_NAMED = 5  # blunders


def observability(names: Sequence[str], r_diagonals: ArrayLike, *, ax: Axes | None = None) -> Axes:
    """Draw abs(R_ii) (Eqs. 9, 10) of all legs side by side for each parameter.

    Parameters
    ----------
    names : sequence of str
        The p parameters.
    r_diagonals : array_like, shape (legs, p)
        `Observability.r_diagonal` of each leg, in units of the reading over the parameter's.
    ax : Axes, optional
        Where to draw, by default in a new figure.

    Returns
    -------
    Axes
    """
    diagonals = np.asarray(r_diagonals, dtype=float)
    legs, count = diagonals.shape
    axes = own_axes(ax, 8.6, 3.8, y="|Rᵢᵢ|, reading per parameter (SI)")
    legend(axes, leg_patches(legs), below=ax is None)
    width = 0.8 / legs
    for leg, values in enumerate(diagonals):
        places = np.arange(count) - 0.4 + width * (leg + 0.5)
        axes.bar(places, values, 0.88 * width, color=leg_style(leg).colour)
    axes.set_yscale("log")
    shown = diagonals[diagonals > 0]
    if shown.size:
        axes.set_ylim(10 ** np.floor(np.log10(shown.min()) - 0.3), shown.max() * 2)
    powers_of_ten(axes.yaxis)
    axes.grid(False, axis="x")
    # "platform_polar_angle" fits under a group of bars in three lines.
    axes.set_xticks(range(count), [name.replace("_", "\n") for name in names], fontsize=SMALL)
    axes.tick_params(axis="x", length=0)
    return axes


def pose_count(curve: PoseCountCurve, *, figure: FigureBase | None = None) -> FigureBase:
    """Draw expected errors and efficiency against the number of poses.

    Parameters
    ----------
    curve : PoseCountCurve
        Of `pose_count_curve`. Without an orientation error it has one panel less.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    panels: list[tuple[tuple[Array, ...], str, bool]] = [
        (
            (factor * getattr(curve, kind), factor * getattr(curve, f"{kind}_bound")),
            f"{kind} error, mean and {100 * curve.confidence:.5g}%, {told}",
            True,
        )
        for kind, unit in curve.mechanism.space.errors
        for factor, told in (small(unit),)
    ]
    panels.append(((100 * curve.efficiency,), "efficiency, %", False))
    figure = new_figure(0.6 + 3.0 * len(panels), 3.4, figure)
    places = figure.add_gridspec(1, len(panels))
    for column, (values, label, logarithmic) in enumerate(panels):
        axes = flat_axes(figure, places[column], x="poses a leg", y=label)
        for each, style in zip(values, ("o-", "^--"), strict=False):
            axes.plot(curve.counts, each, style, color=AFTER, markersize=3.5, linewidth=1.2)
        if logarithmic:
            axes.set_yscale("log")
            _plain_ticks(axes)
        else:
            axes.set_ylim(top=100.2)
        _mark_enough(axes, curve)
    return figure


def residuals(found: Estimate, *, figure: FigureBase | None = None) -> FigureBase:
    """Draw the closure of every leg at every pose that was measured, a panel for each leg.

    Where no pose was measured in full, the estimated errors of the readings.

    Parameters
    ----------
    found : Estimate
        Of `identify`.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    left = [_left(found, leg) for leg in range(len(found.nominal.legs))]
    titles = [
        f"leg {leg}: rms {milli(rms(own.values), own.unit)}" for leg, own in enumerate(left, 1)
    ]
    figure, panels = _panels(titles, left[0], figure)
    for leg, (own, axes) in enumerate(zip(left, panels, strict=True)):
        values, colour = small(own.unit)[0] * own.values, leg_style(leg).colour
        numbers = found.measurements.row_numbers[own.rows]
        _draw_left(axes, leg, own.unit, numbers, values, numbers)
        if len(values) <= MANY:
            # One line with gaps: a line for each row would take long, and most of the page.
            stems = np.stack([np.zeros_like(values), values, np.full_like(values, np.nan)], axis=1)
            look: dict[str, Any] = {"linewidth": 0.8, "alpha": 0.5, "zorder": 1.9}
            axes.plot(numbers.repeat(3), stems.ravel(), color=colour, **look)
        axes.plot(numbers[own.rejected], values[own.rejected], "x", color=ACCENT, markersize=6)
        if leg + _COLUMNS >= len(left):
            axes.set_xlabel("row of the measurements", fontsize=SMALL, color=INK)
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    if any(own.rejected.any() for own in left):
        legend_below(figure, [sign("x", "rejected as an outlier", ACCENT, 6)])
    return figure


def dependence(found: Estimate, *, figure: FigureBase | None = None) -> FigureBase:
    """Draw the closures of every leg against what they depend on most, with a parabola.

    That is the leg's reading, a coordinate of the pose or the order of measuring, that of which
    a parabola explains most.

    Parameters
    ----------
    found : Estimate
        Of `identify`.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    strongest = [_strongest(found, leg) for leg in range(len(found.nominal.legs))]
    titles = [
        f"leg {leg}: {most.name} explains {most.share:.0%}" for leg, most in enumerate(strongest, 1)
    ]
    figure, panels = _panels(titles, strongest[0].left, figure)
    for leg, (most, axes) in enumerate(zip(strongest, panels, strict=True)):
        reading = found.nominal.reading_unit if most.name == "reading" else ""
        factor, told = on_paper(found.nominal.space.units.get(most.name, reading))
        against = factor * most.against
        values = small(most.left.unit)[0] * most.left.values
        numbers = found.measurements.row_numbers[most.left.rows]
        _draw_left(axes, leg, most.left.unit, against, values, numbers)
        if len(values) > 2:
            along = np.linspace(against.min(), against.max(), 50)
            parabola = np.polynomial.Polynomial.fit(against, values, 2)
            axes.plot(along, parabola(along), color=INK, linewidth=1.2)
        label = f"{most.name}, {told}" if told else most.name
        axes.set_xlabel(label, fontsize=SMALL, color=INK)
    return figure


def t_values(found: Estimate, *, ax: Axes | None = None) -> Axes:
    """Draw the estimated error of every observation in standard deviations, row by row.

    What does not fit the others is named, and lies beyond the lines.

    Parameters
    ----------
    found : Estimate
        Of `identify`.
    ax : Axes, optional
        Where to draw, by default in a new figure.

    Returns
    -------
    Axes
    """
    axes = own_axes(ax, 9.2, 3.8, x="row of the measurements", y="t, standard deviations")
    rows, space = found.rows, found.nominal.pose_space
    numbers = found.measurements.row_numbers[rows.pose]
    reading = np.isin(rows.kind, [KINDS.index("readings"), KINDS.index("closures")])
    groups = [(reading & (rows.index == leg), leg) for leg in range(len(found.nominal.legs))]
    handles = []
    for own, leg in [*groups, (~reading, None)]:
        if not own.any():
            continue
        style = None if leg is None else leg_style(leg)
        colour = INK if style is None else style.colour
        marker = "." if style is None else style.marker
        worst = np.flatnonzero(own)[_one_by_one(axes, numbers[own], rows.t[own], colour)]
        (points,) = axes.plot(
            numbers[worst], rows.t[worst], marker, color=colour, markersize=4, linestyle="none"
        )
        shown = zip(worst.tolist(), numbers[worst], rows.t[worst], strict=True)
        names = [f"row {number}, {rows.what(row, space)}: {t:+.2g}" for row, number, t in shown]
        name_points(points, names)
        label = "poses and others" if leg is None else f"leg {leg + 1}"
        handles.append(sign(marker, label, colour, 5))
    blunders = [each for each in found.outliers if each.place >= 0]
    limit = blunder_limit(found, blunders)
    for side in (-limit, limit):
        axes.axhline(side, color=ACCENT, linewidth=0.9, linestyle="--")
    for each in blunders[:_NAMED]:
        name = f" {each.what}, row {each.row_number}"
        place = (each.row_number, rows.t[each.place])
        axes.annotate(name, place, fontsize=SMALL, color=INK, va="center")
    axes.axhline(0, color=LINE, linewidth=0.8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend(axes, handles, below=ax is None)
    return axes


def parameter_errors(
    found: Estimate, actual: Mechanism, *, figure: FigureBase | None = None
) -> FigureBase:
    """Draw (estimate - truth) / standard deviation of every parameter, a panel for each leg.

    Parameters
    ----------
    found : Estimate
        Of simulated measurements.
    actual : Mechanism
        The true one.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    in_sigmas = in_deviations(found, actual)
    legs, count = in_sigmas.shape
    rows = -(-legs // _COLUMNS)
    figure = new_figure(8.8, 0.9 + rows * (0.75 + 0.22 * count), figure)
    places = figure.add_gridspec(rows, min(legs, _COLUMNS))
    first = None
    for leg, errors in enumerate(in_sigmas):
        row, column = divmod(leg, _COLUMNS)
        place, title = places[row, column], f"leg {leg + 1}"
        axes = flat_axes(figure, place, title=title, share_x=first, share_y=first)
        first = first or axes
        axes.axvspan(-INTERVAL, INTERVAL, color=AFTER, alpha=0.12, linewidth=0)
        axes.axvline(0, color=LINE, linewidth=0.8)
        outside = np.abs(errors) > INTERVAL
        for chosen, colour, marker in ((~outside, AFTER, "o"), (outside, ACCENT, "D")):
            axes.plot(errors[chosen], np.flatnonzero(chosen), marker, color=colour, markersize=5)
        names = [name.replace("_", " ") for name in actual.parameter_names]
        axes.set_yticks(range(count), names, fontsize=SMALL)
        axes.tick_params(axis="y", length=0, labelleft=column == 0)
        if leg + _COLUMNS >= legs:
            axes.set_xlabel("error / standard deviation", fontsize=SMALL, color=INK)
    if first is not None:
        largest = np.nanmax(np.abs(in_sigmas), initial=3)
        first.set_xlim(-1.08 * largest, 1.08 * largest)
        first.set_ylim(count - 0.4, -0.6)
    handles = [
        sign("o", "truth within the 95% interval", AFTER, 5),
        sign("D", "truth outside", ACCENT, 5),
        Patch(color=AFTER, alpha=0.12, label="95% interval"),
    ]
    legend_below(figure, handles)
    return figure


def error_histogram(
    before: Evaluation,
    after: Evaluation,
    expected: ExpectedAccuracy | None = None,
    *,
    figure: FigureBase | None = None,
) -> FigureBase:
    """Draw the distribution of the errors on a logarithmic scale, with their root mean squares.

    Parameters
    ----------
    before, after : Evaluation
        With the nominal and the calibrated mechanism.
    expected : ExpectedAccuracy, optional
        Root mean squares to expect after.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    names = before.kinds
    labels = [f"{kind} error, {small(unit)[1]}" for kind, unit in names]
    factors = [small(unit)[0] for _, unit in names]
    kinds = list(zip(factors, labels, _error_sizes(before), _error_sizes(after), strict=True))
    foreseen = [None if expected is None else getattr(expected, kind) for kind, _ in names]
    figure = new_figure(8.6 if len(kinds) > 1 else 4.6, 3.5, figure)
    places = figure.add_gridspec(1, len(kinds))
    for column, (factor, label, *sizes) in enumerate(kinds):
        axes = flat_axes(figure, places[column], x=label, y="poses, %")
        value = foreseen[column]
        told = None if value is None else factor * value
        _draw_histogram(axes, factor * sizes[0], factor * sizes[1], told)
    handles: list[Any] = [
        Patch(color=BEFORE, alpha=0.75, label="before"),
        Patch(color=AFTER, alpha=0.75, label="after"),
        Line2D([], [], color=INK, linestyle="--", label="root mean square"),
    ]
    if expected is not None:
        handles.append(Line2D([], [], color=INK, linestyle=":", label="expected after"))
    legend_below(figure, handles, 4 if len(kinds) > 1 else 2)
    return figure


def error_map(
    poses: ArrayLike | WorkspaceSample,
    before: Evaluation,
    after: Evaluation | None = None,
    *,
    figure: FigureBase | None = None,
) -> FigureBase:
    """Draw the position error over the workspace: before in the upper row, after in the lower.

    Of a spherical platform it is the orientation error. The columns are bands of orientation
    (planar) or projections (in space). Each row has its own colour bar, since the errors differ by
    orders of magnitude.

    Parameters
    ----------
    poses : array_like, shape (N, coordinates), or WorkspaceSample
        Those of both evaluations. Where they are many, a cell shows their root mean square.
    before, after : Evaluation
        With the nominal and the calibrated mechanism; one alone is that of any model.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    rows = np.asarray(poses.poses if isinstance(poses, WorkspaceSample) else poses, dtype=float)
    panels = _map_panels(rows, before.space)
    rows = shown_of(before.space, rows)
    (kind, unit), *_ = before.kinds
    states = {"": before} if after is None else {"before": before, "after": after}
    flat = len(panels) == 1
    figure = new_figure(8.6, 3.4 if flat or after is None else 5.4, figure)
    columns = range(len(panels))
    places = figure.add_gridspec(*((1, len(states)) if flat else (len(states), len(panels))))
    factor, told = small(unit)
    first: Axes | None = None
    for row, (state, evaluation) in enumerate(states.items()):
        grid = [places[row * len(panels) + column] for column in columns]
        sizes = factor * _error_sizes(evaluation)[0]
        label = f"{kind} error\n{state}, {told}" if state else f"{kind} error, {told}"
        first = _draw_row(figure, grid, panels, rows, sizes, label, first)
    return figure


def _mark_enough(axes: Axes, curve: PoseCountCurve) -> None:
    axes.set_xscale("log")
    ticks = [curve.counts[0] * factor for factor in (1, 2, 3, 5, 10)]
    axes.set_xticks([tick for tick in ticks if tick <= curve.counts[-1]])
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_locator(NullLocator())
    if curve.enough is not None:
        axes.axvline(curve.enough, color=ACCENT, linewidth=1.0, linestyle="--")
        where: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top"}
        axes.annotate(f" {curve.enough}", (curve.enough, 1.0), fontsize=SMALL, color=INK, **where)


def _plain_ticks(axes: Axes) -> None:
    """Thousandths read better than powers of ten over less than a decade."""
    for formatter in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        plain = ScalarFormatter()
        plain.set_scientific(False)
        formatter(plain)
    axes.tick_params(axis="y", which="minor", labelsize=SMALL - 1, labelcolor=INK)


class Left(NamedTuple):
    """What an estimate leaves of a leg: closures, or errors of readings, and their rows."""

    what: str
    unit: str
    values: Array
    rows: NDArray[np.intp]
    rejected: NDArray[np.bool_]


class Dependence(NamedTuple):
    """What those depend on most: its name and values, and the share that it explains."""

    name: str
    against: Array
    left: Left
    share: float


def _left(found: Estimate, leg: int) -> Left:
    unit = found.nominal.space.closure_unit
    if found.legs:
        fit = found.legs[leg]
        rejected = np.isin(fit.closure_rows, fit.rejected)
        return Left("closure", unit, fit.residuals, fit.closure_rows, rejected)
    what, every = "closure", found.closures()
    if not np.isfinite(every).any():
        what, unit, every = "reading error", found.nominal.reading_unit, found.reading_errors
    rows = np.flatnonzero(np.isfinite(every[:, leg]))
    lost = [*found.aside, *(row for row, _ in found.rejected)]
    return Left(what, unit, every[rows, leg], rows, np.isin(rows, lost))


def _strongest(found: Estimate, leg: int) -> Dependence:
    left = _left(found, leg)
    own = found.own_poses if left.what == "closure" else found.latent_poses
    kept = ~left.rejected & np.isfinite(own[left.rows]).all(axis=1)
    left = left._replace(
        values=left.values[kept], rows=left.rows[kept], rejected=left.rejected[kept]
    )
    poses = workspace_coordinates(found.nominal, own[left.rows])
    against = {
        "reading": found.measurements.readings[left.rows, leg],
        **dict(zip(coordinate_names(found.nominal), poses.T, strict=True)),
        "order of measuring": np.arange(len(left.rows), dtype=float),
    }
    total = float(np.sum((left.values - left.values.mean()) ** 2)) if len(left.values) > 2 else 0.0
    shares = {}
    for name, each in against.items():
        shares[name] = 0.0
        if total > 0 and np.ptp(each) > 0:
            parabola = np.polynomial.Polynomial.fit(each, left.values, 2)
            shares[name] = 1 - float(np.sum((left.values - parabola(each)) ** 2)) / total
    name = max(shares, key=lambda name: shares[name])
    return Dependence(name, against[name], left, shares[name])


def _panels(
    titles: Sequence[str], left: Left, figure: FigureBase | None
) -> tuple[FigureBase, list[Axes]]:
    """A panel for each leg, all with the same scale."""
    rows = -(-len(titles) // _COLUMNS)
    figure = new_figure(9.2, 0.7 + 2.1 * rows, figure)
    places = figure.add_gridspec(rows, min(len(titles), _COLUMNS))
    panels: list[Axes] = []
    for leg, title in enumerate(titles):
        row, column = divmod(leg, _COLUMNS)
        first = panels[0] if panels else None
        axes = flat_axes(figure, places[row, column], title=title, share_y=first)
        axes.axhline(0, color=LINE, linewidth=0.8)
        axes.tick_params(labelleft=column == 0)
        if column == 0:
            axes.set_ylabel(f"{left.what}, {small(left.unit)[1]}", fontsize=SMALL, color=INK)
        panels.append(axes)
    return figure, panels


def _draw_left(
    axes: Axes, leg: int, unit: str, x: NDArray[Any], values: Array, rows: NDArray[np.intp]
) -> None:
    colour = leg_style(leg).colour
    shown = _one_by_one(axes, x, values, colour)
    (points,) = axes.plot(x[shown], values[shown], "o", color=colour, markersize=3)
    named = zip(rows[shown], values[shown], strict=True)
    told = small(unit)[1]
    name_points(points, [f"row {row}, leg {leg + 1}: {c:+.3g} {told}" for row, c in named])


def _one_by_one(axes: Axes, x: NDArray[Any], values: Array, colour: str) -> NDArray[np.intp]:
    """Which points are to be drawn: all, or of many the worst, once the others are in bins.

    Each bin is drawn by its median and by what holds most of its values.
    """
    every = np.arange(len(values))
    if len(values) <= MANY:
        return every
    known = np.flatnonzero(np.isfinite(values))
    if len(known) > _LEAST_IN_BIN:
        along = known[np.argsort(x[known], kind="stable")]
        parts = np.array_split(along, min(_BINS, len(along) // _LEAST_IN_BIN))
        middle = [float(np.median(x[part])) for part in parts]
        low, half, high = np.array(
            [np.quantile(values[part], (_HELD[0], 0.5, _HELD[1])) for part in parts]
        ).T
        axes.fill_between(middle, low, high, color=colour, alpha=0.3, linewidth=0)
        axes.plot(middle, half, color=colour, linewidth=1.0)
    worst = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")[:_WORST]
    return np.sort(worst)


class Panel(NamedTuple):
    """Poses of one panel of the map, by row, and the two coordinates that it shows."""

    title: str
    rows: NDArray[np.intp]
    view: View


def _error_sizes(evaluation: Evaluation) -> list[Array]:
    """Distance (m) and angle (rad) of each pose's error, of those that were evaluated."""
    sizes = dict(zip(("position", "orientation"), evaluation.errors, strict=True))
    return [sizes[kind] for kind, _ in evaluation.kinds]


def _draw_histogram(axes: Axes, before: Array, after: Array, expected: float | None) -> None:
    shown = [sizes[sizes > 0] for sizes in (before, after)]
    both = np.concatenate(shown)
    if not both.size:
        return
    # The smallest errors are a long thin tail, left out because it would squeeze the rest.
    low, high = np.quantile(both, 0.002), both.max() * 1.1
    bins = np.geomspace(min(low, 0.5 * high), high, 50 if len(both) > 1000 else 26).tolist()
    for sizes, colour in zip(shown, (BEFORE, AFTER), strict=True):
        weights = np.full(len(sizes), 100 / max(1, len(sizes)))
        style: dict[str, Any] = {"histtype": "stepfilled", "color": colour, "alpha": 0.75}
        axes.hist(sizes, bins=bins, weights=weights, **style)
        if len(sizes):
            axes.axvline(rms(sizes), color=colour, linewidth=1.6, linestyle="--")
    if expected:
        axes.axvline(expected, color=INK, linewidth=1.4, linestyle=":")
    axes.set_xscale("log")
    powers_of_ten(axes.xaxis)


def _draw_row(
    figure: FigureBase,
    places: Sequence[SubplotSpec],
    panels: Sequence[Panel],
    poses: Array,
    sizes: Array,
    label: str,
    first: Axes | None,
) -> Axes:
    """Draw all panels of one state with one colour bar; returns the first of the figure."""
    row_axes: list[Axes] = []
    drawn = []
    for place, panel in zip(places, panels, strict=True):
        # Bands of orientation show the same view, so one scale serves them all.
        shared = first if panel.title else None
        y = "" if row_axes and shared else panel.view.y_label
        axes = flat_axes(
            figure,
            place,
            title=panel.title,
            x="" if panel.title and not place.is_last_row() else panel.view.x_label,
            y=y,
            share_x=shared,
            share_y=shared,
        )
        if panel.title:
            axes.tick_params(labelleft=not row_axes, labelbottom=place.is_last_row())
        first = first or axes
        drawn.append(_draw_errors(axes, poses[panel.rows], sizes[panel.rows], panel.view))
        row_axes.append(axes)
    values = np.concatenate([np.ma.filled(each.get_array(), np.nan) for each in drawn])
    if np.isfinite(values).any():
        for each in drawn:
            each.set_clim(np.nanmin(values), np.nanmax(values))
    colour_bar(figure, drawn[0], row_axes, label, pad=0.01, shrink=0.85)
    assert first is not None
    return first


def _map_panels(poses: Array, space: PoseSpace) -> list[Panel]:
    every, views = np.arange(len(poses)), views_of(space)
    if space.name != "planar":
        return [Panel("", every, view) for view in views]
    edges = np.quantile(poses[:, 2], (0, 1 / 3, 2 / 3, 1))
    bands = np.clip(np.searchsorted(edges, poses[:, 2], side="right") - 1, 0, 2)
    factor, unit = on_paper("rad")
    panels = []
    for band, ends in enumerate(pairwise(edges.tolist())):
        low, high = (quantity(factor * end, unit, 2) for end in ends)
        title = f"\N{GREEK SMALL LETTER PHI} from {low} to {high}"
        panels.append(Panel(title, np.flatnonzero(bands == band), views[0]))
    return panels


def _draw_errors(axes: Axes, poses: Array, sizes: Array, view: View) -> Any:
    good = np.isfinite(sizes)
    x, y, sizes = poses[good, view.x], poses[good, view.y], sizes[good]
    if (view.x, view.y) == (0, 1):
        axes.set_aspect("equal", adjustable="box")
    if len(poses) <= _FEW:
        style: dict[str, Any] = {"cmap": COLOUR_MAP, "s": 18, "linewidths": 0}
        return axes.scatter(x, y, c=sizes, rasterized=len(poses) > 200, **style)
    style = {"gridsize": 26, "cmap": COLOUR_MAP, "linewidths": 0.2, "rasterized": True}
    return axes.hexbin(x, y, C=sizes, reduce_C_function=lambda own: rms(np.asarray(own)), **style)
