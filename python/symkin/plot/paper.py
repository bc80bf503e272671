# SPDX-License-Identifier: MIT
"""The figures of the paper that need a study: Figs. 7, 9 and 10."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter
from numpy.typing import ArrayLike

from symkin.planning import Plan
from symkin.planning.plan import set_name
from symkin.plot.style import (
    AFTER,
    BEFORE,
    COLOUR_MAP,
    INK,
    LINE,
    SMALL,
    Array,
    colour_bar,
    flat_axes,
    leg_handles,
    leg_style,
    legend_below,
    new_figure,
    sign,
    thinned,
)
from symkin.plot.workspaces import (
    along_equal_readings,
    axial_axes,
    reading_axes,
    reading_limits,
)
from symkin.workspace import WorkspaceSample

if TYPE_CHECKING:
    from symkin.study.paper import LocalErrors
    from symkin.study.result import CellSummary, ErrorFigure

_CLOUD = "#C9D3DA"
_FLAT_LIMIT, _SPATIAL_LIMIT = 12_000, 3000  # points drawn of a cloud
_MILLI = 1e3


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
    cloud = np.asarray(given, dtype=float)
    sets = [leg for leg in (-1, 0, 1, 2) if plan.rows_of_set(leg).size]
    figure = new_figure(9.4, 4.6, figure)
    places = figure.add_gridspec(1, 2, width_ratios=(1.1, 1))
    limits = reading_limits(cloud)
    spatial = reading_axes(figure, places[0], plan.mechanism, range(3), "", limits)
    flat = axial_axes(figure, places[1], plan.mechanism, range(3))
    dots: dict[str, Any] = {"c": _CLOUD, "s": 2, "linewidths": 0, "rasterized": True}
    spatial.scatter(*cloud[thinned(len(cloud), _SPATIAL_LIMIT)].T, depthshade=False, **dots)
    flat.scatter(*along_equal_readings(cloud[thinned(len(cloud), _FLAT_LIMIT)]).T, **dots)
    for number, leg in enumerate(sets):
        chosen = plan.readings[plan.rows_of_set(leg)]
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
    kinds = [("position error, mm (root mean square)", [each.position for each in cells.values()])]
    turns = [each.orientation for each in cells.values()]
    if any(each.rms > 0 for each in turns):
        kinds.append(("orientation error, mrad (root mean square)", turns))
    figure = new_figure(2.2 + 3.7 * len(kinds), 1.2 + 0.36 * (len(cells) + before), figure)
    places = figure.add_gridspec(1, len(kinds))
    first: Axes | None = None
    for column, (label, errors) in enumerate(kinds):
        axes = flat_axes(figure, places[column], x=label, share_y=first)
        first = first or axes
        _draw_errors(axes, errors, before=before)
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


def local_errors(errors: Sequence[LocalErrors], *, figure: FigureBase | None = None) -> FigureBase:
    """Draw the position errors over constant-orientation workspaces (after Fig. 10).

    Parameters
    ----------
    errors : sequence of LocalErrors
        A column each; all panels have one scale.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    figure = new_figure(1.0 + 2.75 * len(errors), 5.0, figure)
    places = figure.add_gridspec(2, len(errors))
    ways = ("traditional", "divided")
    names = {"traditional": "traditional", "divided": "divide and conquer"}
    grids = [[_MILLI * getattr(each, way) for each in errors] for way in ways]
    low, high = (
        find([find(grid) for row in grids for grid in row]) for find in (np.nanmin, np.nanmax)
    )
    panels: list[Axes] = []
    for row, way in enumerate(ways):
        for column, each in enumerate(errors):
            shared = panels[0] if panels else None
            title = f"\N{GREEK SMALL LETTER PHI} = {each.orientation:g} rad" if row == 0 else ""
            axes = flat_axes(
                figure, places[row, column], title=title, share_x=shared, share_y=shared,
                x="x, m" if row else "", y=f"{names[way]}\ny, m" if column == 0 else "",
            )  # fmt: skip
            axes.grid(False)
            image = _draw_grid(axes, each, grids[row][column], (low, high))
            axes.tick_params(labelbottom=row == 1, labelleft=column == 0)
            panels.append(axes)
    _crop(panels[0], errors)
    colour_bar(
        figure, image, panels, "position error, mm (root mean square)", shrink=0.8, pad=0.015
    )
    return figure


def _draw_errors(axes: Axes, errors: Sequence[ErrorFigure], *, before: bool) -> None:
    places = np.arange(len(errors)) + before
    values = _MILLI * np.array([[each.rms, each.low, each.high, each.predicted] for each in errors])
    rms, low, high, predicted = values.T
    axes.grid(False, axis="y")
    reach = np.abs(np.nan_to_num([rms - low, high - rms]))
    if before:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        start = _MILLI * errors[0].before
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


def _draw_grid(axes: Axes, each: LocalErrors, values: Array, limits: tuple[float, float]) -> Any:
    half_x, half_y = (0.5 * (centres[1] - centres[0]) for centres in (each.x, each.y))
    axes.set_aspect("equal", adjustable="box")
    return axes.imshow(
        np.ma.masked_invalid(values),
        origin="lower",
        extent=(
            each.x[0] - half_x, each.x[-1] + half_x, each.y[0] - half_y, each.y[-1] + half_y,
        ),
        cmap=COLOUR_MAP,
        vmin=limits[0],
        vmax=limits[1],
        interpolation="nearest",
    )  # fmt: skip


def _crop(axes: Axes, errors: Sequence[LocalErrors]) -> None:
    """Show where any of the slices has a value, and a little around."""
    known = np.any([np.isfinite(each.divided) for each in errors], axis=0)
    for centres, shown, set_limits in (
        (errors[0].x, known.any(axis=0), axes.set_xlim),
        (errors[0].y, known.any(axis=1), axes.set_ylim),
    ):
        inside = centres[shown]
        margin = 0.06 * (inside[-1] - inside[0])
        set_limits(inside[0] - margin, inside[-1] + margin)
