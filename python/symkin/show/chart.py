# SPDX-License-Identifier: MIT
"""Figures as data: points, lines and areas over two axes.

A page draws them by itself, since loading matplotlib takes longer than an estimate;
`symkin.show.figures` draws them with it for whoever asks for a figure.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from markupsafe import escape
from numpy.typing import NDArray

from symkin.show.theme import GRID, LINE, SMALL, themed

__all__ = [
    "Area",
    "Chart",
    "Curve",
    "Drawn",
    "Note",
    "Panel",
    "Points",
    "Rule",
    "Sign",
    "chart_svg",
]

Array = NDArray[np.float64]
Dash = Literal["-", "--", ":"]


@dataclass(frozen=True)
class Points:
    """Markers, in size in pt, each of which may have a name for whoever points at it."""

    x: NDArray[Any]
    y: Array
    marker: str
    colour: str
    names: Sequence[str] = ()
    size: float = 4.0


@dataclass(frozen=True)
class Curve:
    """A line through points."""

    x: Sequence[float]
    y: Array
    colour: str
    width: float = 1.0


@dataclass(frozen=True)
class Area:
    """What lies between two lines."""

    x: Sequence[float]
    low: Array
    high: Array
    colour: str
    alpha: float


@dataclass(frozen=True)
class Rule:
    """A line across the whole panel, where x or y has a value."""

    axis: Literal["x", "y"]
    at: float
    colour: str
    width: float
    dash: Dash = "-"


@dataclass(frozen=True)
class Note:
    """A text to the right of a place."""

    x: float
    y: float
    text: str


Drawn = Points | Curve | Area | Rule | Note


@dataclass(frozen=True)
class Sign:
    """An entry of the legend: a marker, a line, or an area where it has neither."""

    label: str
    colour: str
    marker: str = ""
    dash: Dash | None = None
    alpha: float = 1.0


@dataclass(frozen=True)
class Panel:
    """What is drawn over two axes, what comes later above what came before.

    Attributes
    ----------
    scale : str
        Of x; "whole" numbers have no marks between them.
    from_zero : bool
        Whether y begins there.
    """

    x: str
    y: str
    drawn: Sequence[Drawn]
    scale: Literal["linear", "whole", "logarithmic"] = "linear"
    from_zero: bool = False


@dataclass(frozen=True)
class Chart:
    """Panels side by side, of a width and height in inches, over one legend."""

    width: float
    height: float
    panels: Sequence[Panel]
    legend: Sequence[Sign]


# As SVG.

_POINTS_PER_INCH = 72
_LABEL_SIZE, _LINE_HEIGHT, _GAP, _TICK = 10.0, 15.0, 4.0, 3.5  # pt
_LETTER = 0.6  # of the size: about as wide as a digit
_SIGN, _BETWEEN = 12.0, 16.0  # pt
_ROOM = 0.05  # of what there is, beside it
_X_SPACING, _Y_SPACING = 66.0, 34.0  # pt between labels, at least
_PLAIN = (1e-3, 1e4)  # numbers between are written out
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_DASHES = {"-": "", "--": "; stroke-dasharray: 5 2.5", ":": "; stroke-dasharray: 1.4 2.2"}
_PLUS = [(-3, -1), (-1, -1), (-1, -3), (1, -3), (1, -1), (3, -1), (3, 1), (1, 1), (1, 3), (-1, 3),
         (-1, 1), (-3, 1)]  # fmt: skip
_DIAGONAL = math.sqrt(0.5)
# Outlines of markers, over half their size.
_OUTLINES: dict[str, list[tuple[float, float]]] = {
    "s": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
    "^": [(0, -1), (1, 1), (-1, 1)],
    "v": [(0, 1), (1, -1), (-1, -1)],
    "D": [(0, -1.4), (1.4, 0), (0, 1.4), (-1.4, 0)],
    "P": [(x / 3, y / 3) for x, y in _PLUS],
    "X": [(_DIAGONAL * (x - y) / 3, _DIAGONAL * (x + y) / 3) for x, y in _PLUS],
    "*": [
        ((1, 0.4)[k % 2] * math.sin(k * math.pi / 5), -(1, 0.4)[k % 2] * math.cos(k * math.pi / 5))
        for k in range(10)
    ],
}


class _Axis(NamedTuple):
    """Where values of one axis are drawn, pt, and which of them are named."""

    start: float
    end: float
    low: float
    high: float
    scale: str

    def place(self, values: Any) -> Array:
        low, high, values = self.low, self.high, np.asarray(values, dtype=float)
        if self.scale == "logarithmic":
            low, high, values = math.log10(low), math.log10(high), np.log10(values)
        placed: Array = self.start + (self.end - self.start) * (values - low) / (high - low)
        return placed

    def ticks(self, spacing: float) -> list[tuple[float, str]]:
        most = max(2, int(abs(self.end - self.start) / spacing))
        if self.scale == "logarithmic":
            return [(value, _text(value)) for value in _powers(self.low, self.high, most)]
        step = _step((self.high - self.low) / most)
        if self.scale == "whole":
            step = max(1.0, step)
        count = range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)
        decimals = max(0, -math.floor(math.log10(step) + 1e-9))
        return [
            (k * step, f"{k * step:.{decimals}f}".replace("-", "\N{MINUS SIGN}")) for k in count
        ]


class _Drawing:
    """Elements of one chart, and the outlines that its markers share."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.parts: list[str] = []
        self.outlines: dict[tuple[str, float], str] = {}

    def line(self, points: Any, colour: str, width: float, dash: Dash = "-") -> None:
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        look = f"fill: none; stroke: {themed(colour)}; stroke-width: {width:g}{_DASHES[dash]}"
        self.parts.append(f'<polyline points="{path}" style="{look}"/>')

    def area(self, points: Any, colour: str, alpha: float) -> None:
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        look = f"fill: {themed(colour)}; fill-opacity: {alpha:g}"
        self.parts.append(f'<polygon points="{path}" style="{look}"/>')

    def text(
        self,
        x: float,
        y: float,
        text: str,
        anchor: str = "middle",
        size: float = SMALL,
        turn: str = "",
    ) -> None:
        look = f"font-size: {size:g}px; text-anchor: {anchor}"
        place = f'x="{x:.1f}" y="{y:.1f}"'
        self.parts.append(f'<text style="{look}" {place}{turn}>{escape(text)}</text>')

    def markers(self, points: Any, marker: str, colour: str, size: float, names: Any) -> None:
        outline = self.outlines.setdefault(
            (marker, size), f"{self.name}-marker{len(self.outlines)}"
        )
        self.parts.append(f'<g style="fill: {themed(colour)}">')
        named = [f'data-name="{escape(each)}" ' for each in names] or [""] * len(points)
        self.parts += [
            f'<use {own}href="#{outline}" x="{x:.1f}" y="{y:.1f}"/>'
            for own, (x, y) in zip(named, points, strict=True)
            if math.isfinite(x + y)
        ]
        self.parts.append("</g>")


def chart_svg(chart: Chart, name: str, head: str) -> str:
    """Return a chart as an SVG element that begins with `head`; its identifiers, with its name."""
    width, height = (_POINTS_PER_INCH * inches for inches in (chart.width, chart.height))
    rows = _legend_rows(chart.legend, width)
    drawing, share = _Drawing(name), width / len(chart.panels)
    bottom = height - _LINE_HEIGHT * (2.2 + len(rows))
    for number, panel in enumerate(chart.panels):
        _draw_panel(drawing, panel, number * share, (number + 1) * share, bottom)
    for row, signs in enumerate(rows):
        _draw_signs(drawing, signs, width, height - _LINE_HEIGHT * (len(rows) - row - 0.5))
    shared = "".join(
        f'<path id="{identifier}" d="{_outline(marker, size / 2)}"/>'
        for (marker, size), identifier in drawing.outlines.items()
    )
    box = f'viewBox="0 0 {width:g} {height:g}"'
    return f"{head} {box}><defs>{shared}</defs>{''.join(drawing.parts)}</svg>"


def _draw_panel(drawing: _Drawing, panel: Panel, left: float, right: float, bottom: float) -> None:
    (x_low, x_high), (y_low, y_high) = _limits(panel)
    y = _Axis(bottom, _GAP, y_low, y_high, "linear")
    heights = y.ticks(_Y_SPACING)
    widest = max((len(text) for _, text in heights), default=1)
    start = left + _LINE_HEIGHT + _LETTER * SMALL * widest + 2 * _GAP
    x = _Axis(start, right - 2 * _GAP, x_low, x_high, panel.scale)
    for at, text in ((float(x.place(value)), text) for value, text in x.ticks(_X_SPACING)):
        drawing.line([(at, bottom), (at, y.end)], GRID, 0.6)
        drawing.line([(at, bottom), (at, bottom + _TICK)], LINE, 0.8)
        drawing.text(at, bottom + 14, text)
    for at, text in ((float(y.place(value)), text) for value, text in heights):
        drawing.line([(start, at), (x.end, at)], GRID, 0.6)
        drawing.line([(start, at), (start - _TICK, at)], LINE, 0.8)
        drawing.text(start - 6, at + 3, text, "end")
    for each in panel.drawn:
        _draw(drawing, each, x, y)
    drawing.line([(x.end, bottom), (start, bottom), (start, y.end)], LINE, 0.8)
    middle = (bottom + y.end) / 2
    turn = f' transform="rotate(-90 {left + 10:.1f} {middle:.1f})"'
    drawing.text(left + 10, middle, panel.y, size=_LABEL_SIZE, turn=turn)
    drawing.text((start + x.end) / 2, bottom + 28, panel.x, size=_LABEL_SIZE)


def _draw(drawing: _Drawing, each: Drawn, x: _Axis, y: _Axis) -> None:
    def placed(along: Any, values: Any) -> list[tuple[float, float]]:
        return list(zip(x.place(along).tolist(), y.place(values).tolist(), strict=True))

    match each:
        case Points():
            points = placed(each.x, each.y)
            drawing.markers(points, each.marker, each.colour, each.size, each.names)
        case Curve():
            drawing.line(placed(each.x, each.y), each.colour, each.width)
        case Area():
            around = [*placed(each.x, each.low), *reversed(placed(each.x, each.high))]
            drawing.area(around, each.colour, each.alpha)
        case Rule(axis="x"):
            at = float(x.place(each.at))
            drawing.line([(at, y.start), (at, y.end)], each.colour, each.width, each.dash)
        case Rule():
            at = float(y.place(each.at))
            drawing.line([(x.start, at), (x.end, at)], each.colour, each.width, each.dash)
        case Note():
            drawing.text(float(x.place(each.x)), float(y.place(each.y)) + 3, each.text, "start")


def _limits(panel: Panel) -> Iterator[tuple[float, float]]:
    """The least and the greatest of each axis, with room beside them."""
    values: dict[str, list[Any]] = {"x": [], "y": []}
    for each in panel.drawn:
        match each:
            case Rule():
                values[each.axis].append([each.at])
            case Area():
                values["x"].append(each.x)
                values["y"] += [each.low, each.high]
            case Points() | Curve():
                values["x"].append(each.x)
                values["y"].append(each.y)
    for axis, of_axis in values.items():
        every = np.concatenate([np.asarray(each, dtype=float) for each in of_axis] or [np.ones(0)])
        every = every[np.isfinite(every)] if np.isfinite(every).any() else np.array([1.0, 2.0])
        low, high = float(every.min()), float(every.max())
        if axis == "x" and panel.scale == "logarithmic":
            room = (high / low) ** _ROOM if high > low else 2.0
            yield low / room, high * room
        else:
            room = _ROOM * (high - low) or 0.5
            yield (0.0 if axis == "y" and panel.from_zero else low - room), high + room


def _legend_rows(signs: Sequence[Sign], width: float) -> list[list[Sign]]:
    rows: list[list[Sign]] = []
    for each in signs:
        if not rows or sum(map(_wide, (*rows[-1], each))) > width:
            rows.append([])
        rows[-1].append(each)
    return rows


def _draw_signs(drawing: _Drawing, signs: Sequence[Sign], width: float, y: float) -> None:
    """Draw a row of the legend in the middle of what is there."""
    x = (width - sum(map(_wide, signs))) / 2
    for each in signs:
        if each.marker:
            drawing.markers([(x + _SIGN / 2, y)], each.marker, each.colour, 5.0, ())
        elif each.dash is not None:
            drawing.line([(x - 6, y), (x + _SIGN, y)], each.colour, 1.5, each.dash)
        else:
            box = [(x - 4, y - 4), (x + _SIGN, y - 4), (x + _SIGN, y + 4), (x - 4, y + 4)]
            drawing.area(box, each.colour, each.alpha)
        drawing.text(x + _SIGN + _GAP, y + 3, each.label, "start")
        x += _wide(each)


def _wide(each: Sign) -> float:
    return _SIGN + _GAP + _LETTER * SMALL * len(each.label) + _BETWEEN


def _outline(marker: str, half: float) -> str:
    """The path of a marker around its place."""
    if marker in _OUTLINES:
        corners = (f"{half * x:.1f} {half * y:.1f}" for x, y in _OUTLINES[marker])
        return f"M{'L'.join(corners)}Z"
    half *= 0.5 if marker == "." else 1.0
    arcs = (f"a{half:g} {half:g} 0 1 0 {way:g} 0" for way in (2 * half, -2 * half))
    return f"M{-half:g} 0{''.join(arcs)}Z"


def _step(least: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(power * factor for factor in (1, 2, 5, 10) if power * factor >= least * (1 - 1e-9))


def _powers(low: float, high: float, most: int) -> list[float]:
    """Round numbers of a logarithmic axis: as many as there is room for."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for factors in ((1, 2, 3, 4, 5, 6, 7, 8, 9), (1, 2, 3, 5), (1, 2, 5), (1, 3), (1,)):
        found = [
            value
            for k in powers
            for value in (f * 10.0**k for f in factors)
            if low <= value <= high
        ]
        if len(found) <= most:
            break
    return found[:: -(-len(found) // most) or 1]


def _text(value: float) -> str:
    if _PLAIN[0] <= value < _PLAIN[1]:
        return f"{value:.6g}"
    exponent = math.floor(math.log10(value) + 1e-9)
    factor, power = f"{value / 10.0**exponent:.3g}", f"10{str(exponent).translate(_RAISED)}"
    return power if factor == "1" else f"{factor}\N{MULTIPLICATION SIGN}{power}"
