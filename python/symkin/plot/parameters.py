# SPDX-License-Identifier: MIT
"""Errors of the identified parameters, in a simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from symkin.plot.style import (
    ACCENT,
    AFTER,
    SMALL,
    flat_axes,
    legend_below,
    new_figure,
)

__all__ = ["INTERVAL", "parameter_errors_figure"]

INTERVAL = 1.96  # standard deviations: holds 95% of normal errors
_COLUMNS = 3


def parameter_errors_figure(names: Sequence[str], in_sigmas: NDArray[np.float64]) -> Figure:
    """Draw (estimate - truth) / standard deviation of every parameter, a panel for each leg.

    Parameters
    ----------
    names : sequence of str
        The p parameters.
    in_sigmas : ndarray, shape (legs, p)
        NaN where there is no standard deviation.

    Returns
    -------
    Figure
    """
    legs, count = in_sigmas.shape
    rows = -(-legs // _COLUMNS)
    figure = new_figure(8.6, 0.9 + rows * (0.75 + 0.2 * count))
    places = figure.add_gridspec(rows, min(legs, _COLUMNS))
    first = None
    for leg, errors in enumerate(in_sigmas):
        row, column = divmod(leg, _COLUMNS)
        axes = flat_axes(
            figure, places[row, column], title=f"leg {leg + 1}", share_x=first, share_y=first
        )
        first = first or axes
        axes.axvspan(-INTERVAL, INTERVAL, color=AFTER, alpha=0.12, linewidth=0)
        axes.axvline(0, color="#999999", linewidth=0.8)
        outside = np.abs(errors) > INTERVAL
        for chosen, colour, marker in ((~outside, AFTER, "o"), (outside, ACCENT, "D")):
            axes.plot(errors[chosen], np.flatnonzero(chosen), marker, color=colour, markersize=5)
        axes.set_yticks(range(count), [name.replace("_", " ") for name in names], fontsize=SMALL)
        axes.tick_params(axis="y", length=0, labelleft=column == 0)
        if leg + _COLUMNS >= legs:
            axes.set_xlabel("(identified \N{MINUS SIGN} true) / standard deviation", fontsize=SMALL)
    if first is not None:
        largest = np.nanmax(np.abs(in_sigmas), initial=3)
        first.set_xlim(-1.08 * largest, 1.08 * largest)
        first.set_ylim(count - 0.4, -0.6)
    legend_below(figure, _handles())
    return figure


def _handles() -> list[Line2D | Patch]:
    def dot(colour: str, marker: str, label: str) -> Line2D:
        return Line2D(
            [], [], color=colour, marker=marker, linestyle="none", markersize=5, label=label
        )

    return [
        dot(AFTER, "o", "truth within the 95% interval"),
        dot(ACCENT, "D", "truth outside"),
        Patch(color=AFTER, alpha=0.12, label="95% interval"),
    ]
