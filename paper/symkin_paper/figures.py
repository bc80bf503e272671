# SPDX-License-Identifier: MIT
"""The paper's Fig. 10, drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase
from numpy.typing import NDArray

from symkin.show.figures.style import COLOUR_MAP, colour_bar, flat_axes, new_figure
from symkin_paper.findings import LocalErrors

__all__ = ["local_errors"]

Array = NDArray[np.float64]

_MILLI = 1e3


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
