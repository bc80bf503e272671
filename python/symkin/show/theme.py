# SPDX-License-Identifier: MIT
"""Colours of figures and pages, and the names that points of a figure have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

if TYPE_CHECKING:  # this is read where figures are not drawn
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

MANY = 3000  # rows; of more, figures show bins and those that fit worst
INK = "#333333"
LINE = "#999999"
BEFORE = "#8C8C8C"
AFTER = "#0072B2"
ACCENT = "#D55E00"
PAPER = "#FFFFFF"
GRID, PANE = "#E4E4E4", "#FAFAFA"
LEG_COLOURS = (AFTER, ACCENT, "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
# The colours that a page gives its own value, by the names of its CSS variables.
THEME = {
    INK: "ink",
    LINE: "line",
    BEFORE: "before",
    PAPER: "paper",
    GRID: "grid",
    PANE: "pane",
    **{colour: f"leg{number}" for number, colour in enumerate(LEG_COLOURS, 1)},
}
# Weak, so that it does not keep figures alive.
_point_names: WeakKeyDictionary[Line2D, Sequence[str]] = WeakKeyDictionary()


def name_points(line: Line2D, names: Sequence[str]) -> None:
    """Say what each point of a line is, for whoever points at it on a page."""
    _point_names[line] = names


def point_names(figure: Figure) -> dict[str, Sequence[str]]:
    """The names of the points of all lines that have any, by identifiers that the lines get."""
    lines = [line for axes in figure.axes for line in axes.lines if line in _point_names]
    for number, line in enumerate(lines):
        line.set_gid(f"points{number}")
    return {str(line.get_gid()): _point_names[line] for line in lines}
