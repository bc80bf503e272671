# SPDX-License-Identifier: MIT
"""The look that all figures share: sizes, colours, axes.

Figures are made without pyplot, so nothing here touches matplotlib's global state. Colours are
those of Okabe and Ito, which every kind of colour vision tells apart; legs differ in marker too.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure, FigureBase
from matplotlib.gridspec import SubplotSpec
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, LogFormatter, LogLocator, MaxNLocator
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from symkin.show.theme import GRID, INK, LEG_COLOURS, LINE, PANE, PAPER
from symkin.show.wording import SUPERSCRIPTS
from symkin.values import Array

DARK = "#222222"  # on coloured areas, which do not follow the page's theme
COLOUR_MAP = "viridis"
SMALL = 9.0  # pt: ticks and legends
_LABEL = 10.0  # pt: axis labels and titles
_LEG_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")


_DECADES = 1e3  # the span from which a logarithmic axis has fewer marks between its powers

# In plain characters: matplotlib takes long over formulas, and pages set text in the reader's font.
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class MeasuredOnce(ConstrainedLayoutEngine):
    """Matplotlib's arrangement of axes, for which it measures their labels twice, measured once.

    Its second round, after it has moved the axes, finds the same labels but for a rare tick.
    """

    def execute(self, figure: Figure) -> None:  # noqa: D102
        for axes in figure.axes:
            axes.get_tightbbox = _remembered(axes)  # type: ignore[method-assign]
        try:
            super().execute(figure)
        finally:
            for axes in figure.axes:
                del axes.get_tightbbox


class ShownFigure(Figure):
    """A figure that a notebook shows, which by itself it does for those of pyplot only."""

    def _repr_svg_(self) -> str:
        return _svg(self)


class ShownAxes(Axes):
    """Axes that a notebook shows as the figure that they are in."""

    def _repr_svg_(self) -> str:
        return _svg(self.figure.figure)


class Powers(LogFormatter):
    """Powers of ten in plain characters: pages set in the reader's font what is no formula."""

    def __call__(self, x: float, pos: int | None = None) -> str:  # noqa: D102
        if not super().__call__(x, pos):
            return ""
        exponent = math.floor(math.log10(x) + 1e-9)
        factor = f"{x / 10.0**exponent:.3g}"
        power = f"10{str(exponent).translate(SUPERSCRIPTS)}"
        return power if factor == "1" else f"{factor}\N{MULTIPLICATION SIGN}{power}"


class LegStyle(NamedTuple):
    """How a leg is drawn in every figure."""

    colour: str
    marker: str


def leg_style(leg: int) -> LegStyle:
    """Colour and marker of a leg (from 0); the pair repeats only after 56 legs."""
    return LegStyle(LEG_COLOURS[leg % len(LEG_COLOURS)], _LEG_MARKERS[leg % len(_LEG_MARKERS)])


def new_figure(width: float, height: float, figure: FigureBase | None = None) -> FigureBase:
    """The figure that is given, or an empty one of this size in inches that arranges its axes."""
    if figure is None:
        figure = ShownFigure(figsize=(width, height), facecolor=PAPER)
    if isinstance(figure, Figure) and figure.get_layout_engine() is None:
        figure.set_layout_engine(MeasuredOnce(w_pad=0.06, h_pad=0.06, wspace=0.03, hspace=0.03))
    return figure


def flat_axes(
    figure: FigureBase,
    place: SubplotSpec,
    *,
    title: str = "",
    x: str = "",
    y: str = "",
    share_x: Axes | None = None,
    share_y: Axes | None = None,
) -> Axes:
    """Add axes in the house style."""
    axes = figure.add_subplot(place, axes_class=ShownAxes, sharex=share_x, sharey=share_y)
    return dressed(axes, title=title, x=x, y=y)


def own_axes(ax: Axes | None, width: float, height: float, *, x: str = "", y: str = "") -> Axes:
    """The axes that are given, in the house style, or those of a new figure of this size."""
    if ax is not None:
        return dressed(ax, x=x, y=y)
    figure = new_figure(width, height)
    return flat_axes(figure, figure.add_gridspec(1, 1)[0], x=x, y=y)


def dressed(axes: Axes, *, title: str = "", x: str = "", y: str = "") -> Axes:
    """Give axes the house style."""
    axes.set_axisbelow(True)
    axes.grid(True, color=GRID, linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(LINE)
    _label(axes, title, x, y)
    return axes


def spatial_axes(
    figure: FigureBase, place: SubplotSpec, *, labels: Sequence[str], title: str = ""
) -> Any:
    """Add three-dimensional axes in the house style."""
    axes = figure.add_subplot(place, projection="3d")
    assert isinstance(axes, Axes3D)
    axes.patch.set_visible(False)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color(PANE)
        axis.line.set_color(LINE)
        axis._axinfo["grid"].update(color=GRID, linewidth=0.6)
        axis.set_major_locator(MaxNLocator(4))
    _label(axes, title, labels[0], labels[1])
    axes.set_zlabel(labels[2], fontsize=_LABEL, color=INK)
    axes.tick_params(axis="z", labelsize=SMALL, labelcolor=INK)
    return axes


def equal_box(axes: Any, points: Array) -> None:
    """Give three-dimensional axes one scale, with room for the points."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * float(np.max(upper - lower))
    for set_limits, low, high in zip(
        (axes.set_xlim, axes.set_ylim, axes.set_zlim), lower - margin, upper + margin, strict=True
    ):
        set_limits(low, high)
    axes.set_box_aspect(upper - lower + 2 * margin, zoom=0.85)  # with room for the labels


def powers_of_ten(axis: Axis) -> None:
    """Label a logarithmic axis whose limits are known by powers of ten."""
    axis.set_major_formatter(Powers())
    axis.set_minor_formatter(Powers())
    low, high = axis.get_view_interval()
    subs = (2, 5) if high > _DECADES * low else None
    marks = np.asarray(LogLocator(subs=subs).tick_values(low, high))
    # Those alone that are seen: matplotlib makes, measures and moves decades of others.
    axis.set_minor_locator(FixedLocator(marks[(marks >= low) & (marks <= high)].tolist()))


def sign(marker: str, label: str, colour: str = INK, size: float = 5.5, **style: Any) -> Line2D:
    """A legend entry that is one marker."""
    look: dict[str, Any] = {"color": colour, "marker": marker, "markersize": size}
    return Line2D([], [], label=label, linestyle="none", **(look | style))


def leg_handles(labels: Sequence[str]) -> list[Line2D]:
    """Legend entries of the legs, or of what is drawn as legs are."""
    styles = (leg_style(leg) for leg in range(len(labels)))
    return [
        sign(style.marker, label, style.colour) for style, label in zip(styles, labels, strict=True)
    ]


def leg_patches(count: int) -> list[Patch]:
    """Legend entries of the legs where areas are filled."""
    return [Patch(color=leg_style(leg).colour, label=f"leg {leg + 1}") for leg in range(count)]


def legend_below(figure: FigureBase, handles: Sequence[Any], columns: int = 8) -> None:
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


def legend(axes: Axes, handles: Sequence[Any], *, below: bool) -> None:
    """Put a legend under axes, or to the right of those that belong to somebody else's figure."""
    if below:
        legend_below(axes.figure.figure, handles)
        return
    look: dict[str, Any] = {"fontsize": SMALL, "labelcolor": INK, "frameon": False}
    axes.legend(handles=list(handles), loc="upper left", bbox_to_anchor=(1.01, 1), **look)


def colour_bar(
    figure: FigureBase, mappable: Any, axes: Sequence[Any], label: str, **place: Any
) -> None:
    """Add one colour bar for some axes."""
    bar = figure.colorbar(mappable, ax=list(axes), **place)
    bar.set_label(label, fontsize=_LABEL, color=INK)
    bar.ax.tick_params(labelsize=SMALL, labelcolor=INK, color=LINE)
    bar.outline.set_visible(False)
    bar.solids.set(alpha=1.0, rasterized=True)  # type: ignore[union-attr]


def _label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, fontsize=_LABEL, color=INK)
    axes.set_xlabel(x, fontsize=_LABEL, color=INK)
    axes.set_ylabel(y, fontsize=_LABEL, color=INK)
    axes.tick_params(labelsize=SMALL, labelcolor=INK, color=LINE)


def _remembered(axes: Any) -> Any:
    """`get_tightbbox` of axes, that after the first time moves what it found with the axes."""
    measure: Any = axes.get_tightbbox
    margins: list[Array] = []

    def get_tightbbox(renderer: Any = None, **options: Any) -> Any:
        if not margins:
            found = measure(renderer, **options)
            if found is None:
                return None
            margins.append(found.get_points() - axes.bbox.get_points())
            return found
        locator = axes.get_axes_locator()
        axes.apply_aspect(locator(axes, renderer) if locator else None)
        return Bbox(axes.bbox.get_points() + margins[0])

    return get_tightbbox


def _svg(figure: Any) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg")
    return buffer.getvalue()
