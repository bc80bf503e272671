# SPDX-License-Identifier: MIT
"""Figures of studies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from symkin.plot.style import (
    AFTER,
    INK,
    LINE,
    SMALL,
    ShownAxes,
    dressed,
    flat_axes,
    leg_style,
    legend_below,
    new_figure,
    sign,
)

if TYPE_CHECKING:
    from symkin.study import CellSummary, CostResult, ErrorFigure, StudyResult
    from symkin.study.asymmetry import Curve

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
            unit = "mm" if kind == "position" else "mrad"
            axes = flat_axes(
                figure,
                places[row, column],
                title=f"design {design}" if row == 0 else "",
                x="measured poses" if row == len(kinds) - 1 else "",
                y=f"{kind} error, {unit}" if column == 0 else "",
                share_y=first,
            )
            first = first or axes
            for choice in choices:
                for estimator in estimators:
                    some = [
                        each
                        for each in cells
                        if (each.cell.design, _choice(each), _estimate(each))
                        == (design, choice, estimator)
                    ]
                    style = leg_style(choices.index(choice)).colour, estimators.index(estimator)
                    _draw_protocol(axes, some, kind, *style)
            _logarithmic(axes)
    handles = [sign("s", choice, leg_style(at).colour) for at, choice in enumerate(choices)]
    handles += [
        Line2D(
            [],
            [],
            color=INK,
            linewidth=1.1,
            linestyle=_LINES[at % len(_LINES)],
            marker=leg_style(at).marker,
            markersize=4,
            label=each,
        )
        for at, each in enumerate(estimators)
    ]
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
        unit = "mm" if kind == "position" else "mrad"
        axes = flat_axes(figure, places[column], x=f"{kind} error, {unit}")
        for row, each in zip(rows, cells, strict=True):
            _draw_error(axes, getattr(each, kind), row)
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
    axes = new_figure(6.2, 3.4).add_subplot(axes_class=ShownAxes) if ax is None else ax
    dressed(axes, x=level, y=value)
    for at, curve in enumerate(curves):
        colour, marker = leg_style(at)
        axes.errorbar(
            curve.levels,
            curve.values,
            1.96 * curve.errors,
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
    from symkin.study.cost import TASKS

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
    axes: Axes, cells: Sequence[CellSummary], kind: str, colour: str, place: int
) -> None:
    cells = sorted(
        (each for each in cells if each.robots > each.failed), key=lambda each: each.measured_poses
    )
    if not cells:
        return
    errors = [getattr(each, kind) for each in cells]
    counts = [each.measured_poses for each in cells]
    predicted = [_MILLI * each.predicted for each in errors]
    axes.plot(counts, predicted, color=colour, linewidth=1.1, linestyle=_LINES[place % 4])
    simulated = np.array([(each.rms, each.low, each.high) for each in errors]).T * _MILLI
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


def _draw_error(axes: Axes, error: ErrorFigure, row: int) -> None:
    if not np.isfinite(error.rms):
        return
    rms, low, high = _MILLI * error.rms, _MILLI * error.low, _MILLI * error.high
    if np.isfinite(low):
        axes.plot([low, high], [row, row], color=AFTER, linewidth=1.4)
    axes.plot(rms, row, "o", color=AFTER, markersize=4)
    if np.isfinite(error.predicted):
        axes.plot(_MILLI * error.predicted, row, "|", color=INK, markersize=9)


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
    cell = summary.cell
    return f"{cell.rows}, {cell.criterion}".replace("_", "-")


def _estimate(summary: CellSummary) -> str:
    return f"{summary.cell.estimator}, {summary.cell.use}"


def _kinds(cells: Sequence[CellSummary]) -> list[str]:
    """What is in error at all: a point has no orientation, what only turns no position."""
    found = {
        kind
        for each in cells
        for kind in ("position", "orientation")
        if getattr(each, kind).rms > 0
    }
    return [kind for kind in ("position", "orientation") if kind in found] or ["position"]
