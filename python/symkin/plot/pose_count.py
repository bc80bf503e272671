# SPDX-License-Identifier: MIT
"""What more poses bring."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator, ScalarFormatter

from symkin.planning import PoseCountCurve
from symkin.plot.style import ACCENT, AFTER, INK, SMALL, flat_axes, new_figure

__all__ = ["pose_count_figure"]


def pose_count_figure(curve: PoseCountCurve, *, turns: bool) -> Figure:
    """Draw expected errors and efficiency against the number of poses.

    Parameters
    ----------
    curve : PoseCountCurve
        Of `pose_count_curve`.
    turns : bool
        Whether the platform has an orientation.
    """
    panels = [(1e3 * curve.position, "expected position error, mm")]
    if turns:
        panels.append((1e3 * curve.orientation, "expected orientation error, mrad"))
    figure = new_figure(4.0 * len(panels) + 0.6 + 4.0, 3.4)
    places = figure.add_gridspec(1, len(panels) + 1)
    for column, (errors, label) in enumerate(panels):
        axes = flat_axes(figure, places[column], x="poses a leg", y=label)
        axes.plot(curve.counts, errors, color=AFTER, marker="o", markersize=3.5, linewidth=1.2)
        axes.set_yscale("log")
        _plain_ticks(axes)
        _mark_enough(axes, curve)
    axes = flat_axes(figure, places[len(panels)], x="poses a leg", y="efficiency, %")
    axes.plot(
        curve.counts, 100 * curve.efficiency, color=AFTER, marker="o", markersize=3.5, linewidth=1.2
    )
    axes.set_ylim(top=100.2)
    _mark_enough(axes, curve)
    return figure


def _mark_enough(axes: Axes, curve: PoseCountCurve) -> None:
    axes.set_xscale("log")
    ticks = [curve.counts[0] * factor for factor in (1, 2, 3, 5, 10)]
    axes.set_xticks([tick for tick in ticks if tick <= curve.counts[-1]])
    axes.xaxis.set_major_formatter(ScalarFormatter())
    axes.xaxis.set_minor_locator(NullLocator())
    if curve.enough is not None:
        axes.axvline(curve.enough, color=ACCENT, linewidth=1.0, linestyle="--")
        axes.annotate(
            f" {curve.enough}",
            (curve.enough, 1.0),
            xycoords=("data", "axes fraction"),
            va="top",
            fontsize=SMALL,
            color=INK,
        )


def _plain_ticks(axes: Axes) -> None:
    """Thousandths read better than powers of ten over less than a decade."""
    for formatter in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        plain = ScalarFormatter()
        plain.set_scientific(False)
        formatter(plain)
    axes.tick_params(axis="y", which="minor", labelsize=SMALL - 1)
