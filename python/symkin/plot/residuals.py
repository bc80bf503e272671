# SPDX-License-Identifier: MIT
"""What the identified legs leave unexplained of the measurements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from symkin.identification.estimate import Identification, LegFit
from symkin.measurements import Measurements
from symkin.plot.style import (
    ACCENT,
    SMALL,
    flat_axes,
    leg_style,
    legend_below,
    new_figure,
)
from symkin.report.wording import significant
from symkin.workspace.sample import coordinate_names, workspace_coordinates

__all__ = ["dependence_figure", "residuals_figure"]

_COLUMNS = 3
_UNITS = {"x": "m", "y": "m", "z": "m", "phi": "rad", "rx": "rad", "ry": "rad", "rz": "rad"}


def residuals_figure(measurements: Measurements, identification: Identification) -> Figure:
    """Draw the closure of every leg at every pose that it used, a panel for each leg."""
    fits = identification.legs
    figure, panels = _panels(
        [f"leg {leg}: rms {significant(_rms(fit))} mm" for leg, fit in enumerate(fits, 1)]
    )
    for leg, (fit, axes) in enumerate(zip(fits, panels, strict=True)):
        residuals = 1e3 * fit.residuals
        numbers = measurements.row_numbers[fit.rows]
        axes.vlines(numbers, 0, residuals, color=leg_style(leg).colour, linewidth=0.8, alpha=0.5)
        axes.plot(numbers, residuals, "o", color=leg_style(leg).colour, markersize=3)
        rejected = np.isin(fit.rows, fit.rejected)
        axes.plot(numbers[rejected], residuals[rejected], **_rejected_style())
        if leg + _COLUMNS >= len(fits):
            axes.set_xlabel("row of the measurements", fontsize=SMALL)
    if any(len(fit.rejected) for fit in fits):
        legend_below(figure, [Line2D([], [], label="rejected as an outlier", **_rejected_style())])
    return figure


def dependence_figure(measurements: Measurements, identification: Identification) -> Figure:
    """Draw the closures of every leg against what they depend on most, with a parabola.

    That is the leg's reading, a coordinate of the pose or the order of measuring, that of which
    a parabola explains most.
    """
    found = [
        _strongest(measurements, identification, leg) for leg in range(len(identification.legs))
    ]
    figure, panels = _panels(
        [
            f"leg {leg}: {name} explains {share:.0%}"
            for leg, (name, _, _, share) in enumerate(found, 1)
        ]
    )
    for leg, ((name, values, residuals, _), axes) in enumerate(zip(found, panels, strict=True)):
        axes.plot(values, 1e3 * residuals, "o", color=leg_style(leg).colour, markersize=3)
        along = np.linspace(values.min(), values.max(), 50)
        parabola = np.polynomial.Polynomial.fit(values, 1e3 * residuals, 2)
        axes.plot(along, parabola(along), color=ACCENT, linewidth=1.2)
        unit = _UNITS.get(name, identification.nominal.reading_unit if name == "reading" else "")
        axes.set_xlabel(f"{name}, {unit}" if unit else name, fontsize=SMALL)
    return figure


def _strongest(
    measurements: Measurements, identification: Identification, leg: int
) -> tuple[str, NDArray[np.float64], NDArray[np.float64], float]:
    """Name and values of what a leg's closures depend on most, the closures, and the share."""
    fit = identification.legs[leg]
    kept = ~np.isin(fit.rows, fit.rejected)
    rows, residuals = fit.rows[kept], fit.residuals[kept]
    poses = workspace_coordinates(identification.nominal, measurements.poses[rows])
    values = {
        "reading": measurements.readings[rows, leg],
        **dict(zip(coordinate_names(identification.nominal), poses.T, strict=True)),
        "order of measuring": np.arange(len(rows), dtype=float),
    }
    total = float(np.sum((residuals - residuals.mean()) ** 2))
    shares = {}
    for name, each in values.items():
        left = 0.0
        if np.ptp(each) > 0 and total > 0:
            parabola = np.polynomial.Polynomial.fit(each, residuals, 2)
            left = 1 - float(np.sum((residuals - parabola(each)) ** 2)) / total
        shares[name] = left
    name = max(shares, key=lambda name: shares[name])
    return name, values[name], residuals, shares[name]


def _panels(titles: Sequence[str]) -> tuple[Figure, list[Axes]]:
    """A panel for each leg, all with the same scale of closures."""
    rows = -(-len(titles) // _COLUMNS)
    figure = new_figure(8.6, 0.7 + 1.9 * rows)
    places = figure.add_gridspec(rows, min(len(titles), _COLUMNS))
    panels: list[Axes] = []
    for leg, title in enumerate(titles):
        row, column = divmod(leg, _COLUMNS)
        axes = flat_axes(
            figure, places[row, column], title=title, share_y=panels[0] if panels else None
        )
        axes.axhline(0, color="#999999", linewidth=0.8)
        axes.tick_params(labelleft=column == 0)
        if column == 0:
            axes.set_ylabel("closure, mm", fontsize=SMALL)
        panels.append(axes)
    return figure, panels


def _rms(fit: LegFit) -> float:
    return 1e3 * float(np.sqrt(np.mean(fit.residuals**2)))


def _rejected_style() -> dict[str, Any]:
    return {"linestyle": "none", "marker": "x", "color": ACCENT, "markersize": 6}
