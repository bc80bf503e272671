# SPDX-License-Identifier: MIT
"""The look that all figures share: sizes, colours, axes.

Figures are made without pyplot, so nothing here touches matplotlib's global state. Colours are
those of Okabe and Ito, which every kind of colour vision tells apart; legs differ in marker too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from numpy.typing import NDArray

__all__ = [
    "ACCENT",
    "AFTER",
    "BEFORE",
    "COLOUR_MAP",
    "INK",
    "SMALL",
    "LegStyle",
    "colour_bar",
    "equal_box",
    "flat_axes",
    "leg_handles",
    "leg_patches",
    "leg_style",
    "legend_below",
    "new_figure",
    "spatial_axes",
    "thinned",
]

INK = "#333333"
BEFORE = "#8C8C8C"
AFTER = "#0072B2"
ACCENT = "#D55E00"
COLOUR_MAP = "viridis"
SMALL = 8.0  # pt: ticks and legends
_LABEL = 9.0  # pt: axis labels and titles
_LEG_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_LEG_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")


class LegStyle(NamedTuple):
    """How a leg is drawn in every figure."""

    colour: str
    marker: str


def leg_style(leg: int) -> LegStyle:
    """Colour and marker of a leg (from 0); the pair repeats only after 56 legs."""
    return LegStyle(_LEG_COLOURS[leg % len(_LEG_COLOURS)], _LEG_MARKERS[leg % len(_LEG_MARKERS)])


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure, width and height in inches, that arranges its own axes."""
    figure = Figure(figsize=(width, height), facecolor="white")
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.06, wspace=0.03, hspace=0.03)
    return figure


def flat_axes(
    figure: Figure,
    place: SubplotSpec,
    *,
    title: str = "",
    x: str = "",
    y: str = "",
    share_x: Axes | None = None,
    share_y: Axes | None = None,
) -> Axes:
    """Add axes in the house style."""
    axes = figure.add_subplot(place, sharex=share_x, sharey=share_y)
    axes.set_axisbelow(True)
    axes.grid(True, color="#E4E4E4", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#999999")
    _label(axes, title, x, y)
    return axes


def spatial_axes(
    figure: Figure, place: SubplotSpec, *, labels: Sequence[str], title: str = ""
) -> Any:
    """Add three-dimensional axes in the house style."""
    axes = figure.add_subplot(place, projection="3d")
    assert isinstance(axes, Axes3D)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color("#FAFAFA")
        axis.line.set_color("#999999")
        axis._axinfo["grid"].update(color="#E4E4E4", linewidth=0.6)
        axis.set_major_locator(MaxNLocator(5))
    _label(axes, title, labels[0], labels[1])
    axes.set_zlabel(labels[2], fontsize=_LABEL, color=INK)
    axes.tick_params(axis="z", labelsize=SMALL, labelcolor=INK)
    return axes


def equal_box(axes: Any, points: NDArray[np.float64]) -> None:
    """Give three-dimensional axes one scale, with room for the points."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * float(np.max(upper - lower))
    for set_limits, low, high in zip(
        (axes.set_xlim, axes.set_ylim, axes.set_zlim), lower - margin, upper + margin, strict=True
    ):
        set_limits(low, high)
    axes.set_box_aspect(upper - lower + 2 * margin, zoom=0.95)


def leg_handles(labels: Sequence[str]) -> list[Line2D]:
    """Legend entries of the legs, or of what is drawn as legs are."""
    return [
        Line2D(
            [],
            [],
            color=leg_style(leg).colour,
            marker=leg_style(leg).marker,
            markersize=5.5,
            linestyle="none",
            label=label,
        )
        for leg, label in enumerate(labels)
    ]


def leg_patches(count: int) -> list[Patch]:
    """Legend entries of the legs where areas are filled."""
    return [Patch(color=leg_style(leg).colour, label=f"leg {leg + 1}") for leg in range(count)]


def legend_below(figure: Figure, handles: Sequence[Any], columns: int = 8) -> None:
    """Put a legend under all axes."""
    figure.legend(
        handles=list(handles),
        loc="outside lower center",
        ncols=min(columns, len(handles)),
        fontsize=SMALL,
        labelcolor=INK,
        frameon=False,
        handletextpad=0.4,
        columnspacing=1.4,
    )


def colour_bar(
    figure: Figure, mappable: Any, axes: Sequence[Any], label: str, **place: Any
) -> None:
    """Add one colour bar for some axes."""
    bar = figure.colorbar(mappable, ax=list(axes), **place)
    bar.set_label(label, fontsize=_LABEL, color=INK)
    bar.ax.tick_params(labelsize=SMALL, labelcolor=INK, color="#999999")
    bar.outline.set_visible(False)
    bar.solids.set_alpha(1.0)  # type: ignore[union-attr]


def thinned(count: int, limit: int) -> NDArray[np.intp]:
    """At most `limit` indices, evenly spread over `count`."""
    return np.unique(np.linspace(0, count - 1, min(count, limit)).astype(np.intp))


def _label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=_LABEL, color=INK)
    axes.set_xlabel(x, fontsize=_LABEL, color=INK)
    axes.set_ylabel(y, fontsize=_LABEL, color=INK)
    axes.tick_params(labelsize=SMALL, labelcolor=INK, color="#999999")
