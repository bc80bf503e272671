# SPDX-License-Identifier: MIT
"""What the identified legs leave unexplained of the measurements."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from symkin.identification import Identification
from symkin.measurements import Measurements
from symkin.report.figures.style import (
    ACCENT,
    SMALL,
    flat_axes,
    leg_style,
    legend_below,
    new_figure,
)
from symkin.report.wording import significant

__all__ = ["residuals_figure"]

_COLUMNS = 3


def residuals_figure(measurements: Measurements, identification: Identification) -> Figure:
    """Draw the closure of every leg at every pose that it used, a panel for each leg."""
    fits = identification.legs
    rows = -(-len(fits) // _COLUMNS)
    figure = new_figure(8.6, 0.7 + 1.9 * rows)
    places = figure.add_gridspec(rows, min(len(fits), _COLUMNS))
    first = None
    for leg, fit in enumerate(fits):
        row, column = divmod(leg, _COLUMNS)
        residuals = 1e3 * fit.residuals
        rms = float(np.sqrt(np.mean(residuals**2)))
        axes = flat_axes(
            figure,
            places[row, column],
            title=f"leg {leg + 1}: rms {significant(rms)} mm",
            share_y=first,
        )
        first = first or axes
        numbers = measurements.row_numbers[fit.rows]
        axes.axhline(0, color="#999999", linewidth=0.8)
        axes.vlines(numbers, 0, residuals, color=leg_style(leg).colour, linewidth=0.8, alpha=0.5)
        axes.plot(numbers, residuals, "o", color=leg_style(leg).colour, markersize=3)
        rejected = np.isin(fit.rows, fit.rejected)
        axes.plot(numbers[rejected], residuals[rejected], **_rejected_style())
        axes.tick_params(labelleft=column == 0)
        if column == 0:
            axes.set_ylabel("closure, mm", fontsize=SMALL)
        if leg + _COLUMNS >= len(fits):
            axes.set_xlabel("row of the measurements", fontsize=SMALL)
    if any(len(fit.rejected) for fit in fits):
        legend_below(figure, [Line2D([], [], label="rejected as an outlier", **_rejected_style())])
    return figure


def _rejected_style() -> dict[str, Any]:
    return {"linestyle": "none", "marker": "x", "color": ACCENT, "markersize": 6}
