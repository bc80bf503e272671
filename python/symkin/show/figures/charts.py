# SPDX-License-Identifier: MIT
"""Figures that are data, drawn with matplotlib."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from symkin.show.chart import Area, Curve, Drawn, Note, Panel, Points, Rule, Sign
from symkin.show.figures.style import powers_of_ten, sign
from symkin.show.theme import INK, SMALL, name_points


def draw_panel(axes: Axes, panel: Panel) -> None:
    """Draw a panel into axes, whose labels are theirs."""
    draw(axes, panel.drawn)
    if panel.from_zero:
        axes.set_ylim(bottom=0)
    if panel.scale == "whole":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if panel.scale == "logarithmic" and panel.drawn:
        axes.set_xscale("log")
        powers_of_ten(axes.xaxis)


def draw(axes: Axes, drawn: Iterable[Drawn]) -> None:
    """Draw these into axes."""
    for each in drawn:
        match each:
            case Points():
                look: dict[str, Any] = {"color": each.colour, "markersize": each.size}
                (line,) = axes.plot(each.x, each.y, each.marker, linestyle="none", **look)
                if each.names:
                    name_points(line, each.names)
            case Curve():
                axes.plot(each.x, each.y, color=each.colour, linewidth=each.width)
            case Area():
                look = {"color": each.colour, "alpha": each.alpha, "linewidth": 0}
                axes.fill_between(each.x, each.low, each.high, **look)
            case Rule():
                across = axes.axvline if each.axis == "x" else axes.axhline
                across(each.at, color=each.colour, linewidth=each.width, linestyle=each.dash)
            case Note():
                place = (each.x, each.y)
                axes.annotate(each.text, place, fontsize=SMALL, color=INK, va="center")


def legend_handles(signs: Sequence[Sign]) -> list[Any]:
    """Legend entries as matplotlib has them."""
    return [_handle(each) for each in signs]


def _handle(each: Sign) -> Any:
    if each.marker:
        return sign(each.marker, each.label, each.colour, 5)
    if each.dash is not None:
        return Line2D([], [], color=each.colour, linestyle=each.dash, label=each.label)
    return Patch(color=each.colour, alpha=each.alpha, label=each.label)
