# SPDX-License-Identifier: MIT
"""Figures of studies, and of chosen poses among readings."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import ArrayLike

from symkin.analysis.promises import NORMAL_95
from symkin.analysis.workspace import WorkspaceSample
from symkin.planning import Plan
from symkin.planning.accuracy import set_name
from symkin.show.figures.style import (
    SMALL,
    flat_axes,
    leg_handles,
    leg_style,
    legend_below,
    new_figure,
    own_axes,
    sign,
)
from symkin.show.figures.workspaces import (
    along_equal_readings,
    axial_axes,
    reading_axes,
    reading_limits,
    shown_readings,
)
from symkin.show.theme import AFTER, BEFORE, INK, LINE
from symkin.show.units import on_paper
from symkin.study import CellSummary, CostResult, ErrorFigure, StudyResult
from symkin.study.asymmetry import Curve
from symkin.study.cost import TASKS
from symkin.values import evenly

_MILLI = 1e3
_LINES: tuple[Literal["-", "--", ":", "-."], ...] = ("-", "--", ":", "-.")


def study_protocols(
    result: StudyResult, mechanism: str, *, figure: FigureBase | None = None
) -> FigureBase:
    """Draw the errors of a mechanism's protocols against the measured poses.

    A row of panels for the position and, unless the platform is a point, one for the orientation; a
    panel for each design. Lines are predictions, points with 95% intervals what was simulated.

    Parameters
    ----------
    result : StudyResult
        Of a study with several numbers of poses.
    mechanism : str
        Its name.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    cells = [each for each in result.cells.values() if each.cell.mechanism == mechanism]
    designs = list(dict.fromkeys(each.cell.design for each in cells))
    choices = list(dict.fromkeys(_choice(each) for each in cells))
    estimators = list(dict.fromkeys(_estimate(each) for each in cells))
    kinds = _kinds(cells)
    figure = new_figure(1.2 + 2.9 * len(designs), 0.9 + 2.9 * len(kinds), figure)
    places = figure.add_gridspec(len(kinds), len(designs))
    for row, kind in enumerate(kinds):
        first = None
        for column, design in enumerate(designs):
            factor, unit = _unit(kind)
            axes = flat_axes(
                figure,
                places[row, column],
                title=f"design {design}" if row == 0 else "",
                x="measured poses" if row == len(kinds) - 1 else "",
                y=f"{kind} error, {unit}" if column == 0 else "",
                share_y=first,
            )
            first = first or axes
            for choice, estimator in itertools.product(choices, estimators):
                wanted = (design, choice, estimator)
                some = [e for e in cells if (e.cell.design, _choice(e), _estimate(e)) == wanted]
                colour = leg_style(choices.index(choice)).colour
                _draw_protocol(axes, some, kind, colour, estimators.index(estimator), factor)
            _logarithmic(axes)
    handles = [sign("s", choice, leg_style(at).colour) for at, choice in enumerate(choices)]
    look: dict[str, Any] = {"color": INK, "linewidth": 1.1, "markersize": 4}
    for at, each in enumerate(estimators):
        look |= {"linestyle": _LINES[at % len(_LINES)], "marker": leg_style(at).marker}
        handles.append(Line2D([], [], label=each, **look))
    legend_below(figure, handles, columns=4)
    return figure


def study_cells(result: StudyResult, *, figure: FigureBase | None = None) -> FigureBase:
    """Draw the errors of all cells below each other: simulated with its interval, and predicted.

    Parameters
    ----------
    result : StudyResult
        Of few cells.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    cells = list(result.cells.values())
    kinds = _kinds(cells)
    figure = new_figure(3.6 + 2.8 * len(kinds), 0.9 + 0.24 * len(cells), figure)
    places = figure.add_gridspec(1, len(kinds))
    rows = np.arange(len(cells))[::-1]
    for column, kind in enumerate(kinds):
        factor, unit = _unit(kind)
        axes = flat_axes(figure, places[column], x=f"{kind} error, {unit}")
        for row, each in zip(rows, cells, strict=True):
            _draw_error(axes, getattr(each, kind), row, factor)
        axes.set_xscale("log")
        _plain(axes.xaxis)
        axes.set_ylim(-0.7, len(cells) - 0.3)
        names = [each.cell.id for each in cells] if column == 0 else [""] * len(cells)
        axes.set_yticks(rows, names, fontsize=SMALL)
    legend_below(figure, [sign("o", "simulated, 95% interval", AFTER), sign("|", "predicted", INK)])
    return figure


def study_curves(
    curves: Sequence[Curve],
    level: str,
    value: str,
    *,
    percent: Sequence[float] = (),
    ax: Axes | None = None,
) -> Axes:
    """Draw what is lost against what makes it lost.

    Parameters
    ----------
    curves : sequence of Curve
        At least one.
    level, value : str
        Labels of the axes.
    percent : sequence of float
        Shares off one that are marked by lines.
    ax : Axes, optional
        Where to draw, by default in a new figure.

    Returns
    -------
    Axes
    """
    axes = own_axes(ax, 6.2, 3.4, x=level, y=value)
    for at, curve in enumerate(curves):
        colour, marker = leg_style(at)
        axes.errorbar(
            curve.levels,
            curve.values,
            NORMAL_95 * curve.errors,
            color=colour,
            marker=marker,
            markersize=4,
            linewidth=1.2,
            label=f"{curve.mechanism}: {curve.of}",
        )
    for share in percent:
        axes.axhline(1 + share, color=LINE, linewidth=0.8, linestyle="--")
    axes.set_xscale("log")
    if len(curves) > 1:
        axes.legend(fontsize=SMALL, labelcolor=INK, frameon=False)
    return axes


def study_cost(
    result: CostResult, mechanism: str, *, figure: FigureBase | None = None
) -> FigureBase:
    """Draw times against the number of legs, both logarithmic.

    Parameters
    ----------
    result : CostResult
        Of a study of cost.
    mechanism : str
        Its name.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    figure = new_figure(9.0, 3.6, figure)
    places = figure.add_gridspec(1, 3)
    legs = result.legs(mechanism)
    for column, (title, part) in enumerate(
        (("selection", "select"), ("plan", "plan"), ("identification", "identify"))
    ):
        axes = flat_axes(
            figure, places[column], title=title, x="legs", y="" if column else "time, ms"
        )
        for at, task in enumerate(name for name in TASKS if name.startswith(part)):
            colour, marker = leg_style(at)
            times = _MILLI * result.times(mechanism, task)
            label = TASKS[task].removeprefix(f"{title} ")
            axes.plot(legs, times, color=colour, marker=marker, markersize=4, label=label)
        _logarithmic(axes)
        axes.legend(fontsize=SMALL, labelcolor=INK, frameon=False)
    return figure


def _draw_protocol(
    axes: Axes, cells: Sequence[CellSummary], kind: str, colour: str, place: int, factor: float
) -> None:
    usable = [each for each in cells if each.robots > each.failed]
    cells = sorted(usable, key=lambda each: each.measured_poses)
    if not cells:
        return
    errors = [getattr(each, kind) for each in cells]
    counts = [each.measured_poses for each in cells]
    predicted = [factor * each.predicted for each in errors]
    axes.plot(counts, predicted, color=colour, linewidth=1.1, linestyle=_LINES[place % 4])
    simulated = np.array([(each.rms, each.low, each.high) for each in errors]).T * factor
    axes.errorbar(
        counts,
        simulated[0],
        np.abs(simulated[1:] - simulated[0]),
        color=colour,
        marker=leg_style(place).marker,
        markersize=3.5,
        linestyle="none",
        elinewidth=0.8,
    )


def _unit(kind: str) -> tuple[float, str]:
    """The unit in which an error is told, and how many of it are one m or rad."""
    return on_paper("m" if kind == "position" else "rad")


def _draw_error(axes: Axes, error: ErrorFigure, row: int, factor: float) -> None:
    if not np.isfinite(error.rms):
        return
    rms, low, high = factor * error.rms, factor * error.low, factor * error.high
    if np.isfinite(low):
        axes.plot([low, high], [row, row], color=AFTER, linewidth=1.4)
    axes.plot(rms, row, "o", color=AFTER, markersize=4)
    if np.isfinite(error.predicted):
        axes.plot(factor * error.predicted, row, "|", color=INK, markersize=9)


def _logarithmic(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        _plain(axis)


def _plain(axis: Axis) -> None:
    """Ticks as plain numbers; of a short axis minor ones too, else it may have a single number."""
    low, high = axis.get_view_interval()
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    short = low > 0 and high / low < 30
    axis.set_minor_formatter(FuncFormatter(_some) if short else NullFormatter())
    axis.set_tick_params(which="minor", labelsize=SMALL, labelcolor=INK)


def _some(value: float, _place: int) -> str:
    """Those that have room."""
    text = f"{value:g}"
    return text if text.strip("0.") in ("2", "3", "5") else ""


def _choice(summary: CellSummary) -> str:
    return f"{summary.cell.rows}, {summary.cell.criterion}".replace("_", "-")


def _estimate(summary: CellSummary) -> str:
    return f"{summary.cell.estimator}, {summary.cell.use}"


def _kinds(cells: Sequence[CellSummary]) -> list[str]:
    """What is in error at all: a point has no orientation, what only turns no position."""
    kinds = ("position", "orientation")
    found = [kind for kind in kinds if any(getattr(each, kind).rms > 0 for each in cells)]
    return found or ["position"]


_CLOUD = "#C9D3DA"
_FLAT_LIMIT, _SPATIAL_LIMIT = 12_000, 3000  # points drawn of a cloud


def chosen_readings(
    plan: Plan, readings: ArrayLike | WorkspaceSample, *, figure: FigureBase | None = None
) -> FigureBase:
    """Draw the chosen poses of three legs in the active-joint workspace (after Fig. 7).

    Parameters
    ----------
    plan : Plan
        Of a mechanism with three legs.
    readings : array_like, shape (n, legs), or WorkspaceSample
        Those of the workspace, rad or m.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    given = readings.readings if isinstance(readings, WorkspaceSample) else readings
    cloud = shown_readings(plan.mechanism, np.asarray(given, dtype=float))
    sets = [leg for leg in (-1, 0, 1, 2) if plan.rows_of_set(leg).size]
    figure = new_figure(9.4, 4.6, figure)
    places = figure.add_gridspec(1, 2, width_ratios=(1.1, 1))
    limits = reading_limits(cloud)
    spatial = reading_axes(figure, places[0], plan.mechanism, range(3), "", limits)
    flat = axial_axes(figure, places[1], plan.mechanism, range(3))
    dots: dict[str, Any] = {"c": _CLOUD, "s": 2, "linewidths": 0, "rasterized": True}
    spatial.scatter(*cloud[evenly(len(cloud), _SPATIAL_LIMIT)].T, depthshade=False, **dots)
    flat.scatter(*along_equal_readings(cloud[evenly(len(cloud), _FLAT_LIMIT)]).T, **dots)
    for number, leg in enumerate(sets):
        chosen = shown_readings(plan.mechanism, plan.readings[plan.rows_of_set(leg)])
        style = leg_style(number)
        look: dict[str, Any] = {"c": style.colour, "marker": style.marker, "s": 26, "zorder": 3}
        spatial.scatter(*chosen.T, depthshade=False, **look)
        flat.scatter(*along_equal_readings(chosen).T, **look)
    labels = [f"{len(plan.rows_of_set(leg))} poses of {set_name(leg)}" for leg in sets]
    line = Line2D([], [], color=INK, label="equal readings")
    legend_below(figure, [*leg_handles(labels), line])
    return figure


def protocol_errors(
    cells: Mapping[str, CellSummary], *, before: bool = True, figure: FigureBase | None = None
) -> FigureBase:
    """Draw the end-effector errors of protocols side by side (after Fig. 9).

    Parameters
    ----------
    cells : mapping of str to CellSummary
        What each is called in the figure, from above.
    before : bool
        Whether to show the errors before identification too, on a logarithmic scale.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    kinds = [("position", [each.position for each in cells.values()])]
    turns = [each.orientation for each in cells.values()]
    if any(each.rms > 0 for each in turns):
        kinds.append(("orientation", turns))
    figure = new_figure(2.2 + 3.7 * len(kinds), 1.2 + 0.36 * (len(cells) + before), figure)
    places = figure.add_gridspec(1, len(kinds))
    first: Axes | None = None
    for column, (kind, errors) in enumerate(kinds):
        factor, unit = _unit(kind)
        label = f"{kind} error, {unit} (root mean square)"
        axes = flat_axes(figure, places[column], x=label, share_y=first)
        first = first or axes
        _draw_errors(axes, errors, factor, before=before)
        axes.tick_params(axis="y", length=0, labelleft=column == 0)
    assert first is not None
    names = [*(["before"] if before else []), *cells]
    first.set_yticks(range(len(names)), names, fontsize=SMALL)
    first.set_ylim(len(names) - 0.4, -0.6)
    handles = [
        sign("o", "after identification, with 95% interval", AFTER, 6),
        sign("|", "expected to first order", INK, 10, markeredgewidth=1.5),
    ]
    legend_below(figure, [*([sign("s", "before", BEFORE, 6)] if before else []), *handles])
    return figure


def _draw_errors(axes: Axes, errors: Sequence[ErrorFigure], factor: float, *, before: bool) -> None:
    places = np.arange(len(errors)) + before
    values = factor * np.array([[each.rms, each.low, each.high, each.predicted] for each in errors])
    rms, low, high, predicted = values.T
    axes.grid(False, axis="y")
    reach = np.abs(np.nan_to_num([rms - low, high - rms]))
    if before:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        start = factor * errors[0].before
        axes.plot(start, 0, "s", color=BEFORE, markersize=6)
        _say(axes, start, 0)
        axes.hlines(places, np.nanmin(low) / 2, rms, color=LINE, linewidth=0.8)
        axes.set_xlim(np.nanmin(low) / 2, 3 * start)
    else:
        axes.barh(places, rms, 0.62, color=AFTER, alpha=0.25)
        axes.set_xlim(0, 1.18 * np.nanmax([high, predicted]))
    axes.errorbar(rms, places, xerr=reach, fmt="o", color=AFTER, markersize=5, capsize=2.5)
    axes.plot(predicted, places, "|", color=INK, markersize=11, markeredgewidth=1.5)
    for place, value, end in zip(places, rms, np.fmax(high, predicted), strict=True):
        _say(axes, value, float(place), end)


def _say(axes: Axes, value: float, place: float, end: float | None = None) -> None:
    """The number, to the right of where its interval ends."""
    axes.annotate(
        f"{value:#.3g}",
        (value if end is None else end, place),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
        fontsize=SMALL,
        color=INK,
    )
