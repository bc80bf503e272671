# SPDX-License-Identifier: MIT
"""Figures of a workspace, after Figs. 6a to 6d of the paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from symkin import _core
from symkin.mechanism import Mechanism
from symkin.plot.style import (
    ACCENT,
    INK,
    SMALL,
    flat_axes,
    leg_style,
    legend_below,
    new_figure,
    spatial_axes,
    thinned,
)
from symkin.workspace.slices import ConstantOrientation, ModeSlices
from symkin.workspace.study import WorkspaceStudy

__all__ = ["active_joint_figure", "constant_orientation_figure"]

Array = NDArray[np.float64]

_OUT, _HOME_SIDE, _USABLE, _OTHER_SIDE = "#FFFFFF", "#CFE5F2", "#7DB8DC", "#F9DFA8"
_LABELLED_SHARE = 0.01  # of the reachable area, from which an aspect gets its number
_POINTS = 12_000  # in a cloud


def constant_orientation_figure(rows: Sequence[ModeSlices]) -> Figure:
    """Draw constant-orientation workspaces with their aspects and singularities.

    Parameters
    ----------
    rows : sequence of ModeSlices
        One, or one for each working mode, all on the same grids.

    Returns
    -------
    Figure
    """
    columns = max(len(row.slices) for row in rows)
    figure = new_figure(0.8 + 3.2 * columns, 0.6 + 3.3 * len(rows))
    grid = figure.add_gridspec(len(rows), columns)
    for number, row in enumerate(rows):
        for column, found in enumerate(row.slices):
            label = _slice_title(row.title if len(rows) > 1 else "", found)
            axes = flat_axes(figure, grid[number, column], title=label, x="x, m", y="y, m")
            _draw_slice(axes, found)
    legend_below(figure, _slice_legend([found for row in rows for found in row.slices]), columns)
    return figure


def active_joint_figure(study: WorkspaceStudy) -> Figure:
    """Draw the active-joint workspace: of all poses, and of each constant orientation.

    Of more than three legs three are drawn, such that rotations carry onto each other if there are
    any. A point has the colour of the leg with the largest reading, so that these rotations carry
    the colours onto each other.
    """
    readings = study.sample.readings
    if readings.shape[1] == 2:
        return _two_leg_figure(study)
    figure = new_figure(10.4, 7.4)
    grid = figure.add_gridspec(2, max(3, len(study.slices)))
    legs = _drawn_legs(study)
    clouds = {"all orientations": readings[:, legs]} | {
        _slice_title("", found): found.readings[found.side > 0][:, legs] for found in study.slices
    }
    limits = _limits(np.concatenate(list(clouds.values())))
    places = [grid[0, 0], *(grid[1, column] for column in range(len(study.slices)))]
    labels = [_reading_label(study.mechanism, leg) for leg in legs]
    for place, (title, cloud) in zip(places, clouds.items(), strict=True):
        _draw_cloud(spatial_axes(figure, place, title=title, labels=labels), cloud, legs, limits)
    _draw_along_axis(figure, grid[0, 1:], study, legs)
    legend_below(figure, _cloud_legend(legs, "equal readings"))
    return figure


def _draw_slice(axes: Axes, found: ConstantOrientation) -> None:
    axes.grid(False)
    kinds = np.select([found.usable, found.side > 0, found.side < 0], [2, 1, 3], default=0)
    half_x, half_y = (0.5 * (centres[1] - centres[0]) for centres in (found.x, found.y))
    axes.imshow(
        np.ma.masked_equal(kinds, 0),
        origin="lower",
        extent=(
            found.x[0] - half_x,
            found.x[-1] + half_x,
            found.y[0] - half_y,
            found.y[-1] + half_y,
        ),
        cmap=ListedColormap([_OUT, _HOME_SIDE, _USABLE, _OTHER_SIDE]),
        vmin=0,
        vmax=3,
        interpolation="nearest",
    )
    for values, colour, style in (
        (found.reach_margin, INK, "solid"),
        (found.parallel, ACCENT, "dashed"),
    ):
        if _crosses_zero(values):
            axes.contour(
                found.x,
                found.y,
                np.ma.masked_invalid(values),
                levels=[0],
                colors=[colour],
                linestyles=[style],
                linewidths=1.4,
            )
    _number_aspects(axes, found)


def _crosses_zero(values: Array) -> bool:
    return bool((values < 0).any() and (values > 0).any())


def _number_aspects(axes: Axes, found: ConstantOrientation) -> None:
    areas = np.abs(found.aspect_areas)
    for number in np.flatnonzero(areas > _LABELLED_SHARE * areas.sum()) + 1:
        rows, columns = np.nonzero(found.aspects == number)
        middle = np.argmin((rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2)
        place = found.x[columns[middle]], found.y[rows[middle]]
        axes.annotate(str(number), place, ha="center", va="center", color=INK, fontweight="bold")


def _slice_legend(slices: Sequence[ConstantOrientation]) -> list[Any]:
    handles: list[Any] = [
        Patch(facecolor=_USABLE, label="workspace"),
        Patch(facecolor=_HOME_SIDE, label="other reachable poses on home's side"),
    ]
    if any((found.side < 0).any() for found in slices):
        label = "reachable poses beyond a parallel singularity"
        handles.append(Patch(facecolor=_OTHER_SIDE, label=label))
    if any(_crosses_zero(found.reach_margin) for found in slices):
        handles.append(Line2D([], [], color=INK, label="serial singularity (type 1)"))
    if any(_crosses_zero(found.parallel) for found in slices):
        label = "parallel singularity (type 2)"
        handles.append(Line2D([], [], color=ACCENT, linestyle="dashed", label=label))
    return handles


def _slice_title(title: str, found: ConstantOrientation) -> str:
    orientation = "" if math.isnan(found.orientation) else f"{found.orientation:.3g} rad"
    return ", ".join(part for part in (title, orientation) if part)


def _drawn_legs(study: WorkspaceStudy) -> list[int]:
    permutations = study.symmetry.permutations
    orbit = [permutations[f"r{turn}"][0] for turn in range(3) if f"r{turn}" in permutations]
    return orbit if len(set(orbit)) == 3 else [0, 1, 2]


def _limits(readings: Array) -> tuple[float, float]:
    return float(readings.min()), float(readings.max())


def _scatter(axes: Any, points: Array, colours: Sequence[str]) -> None:
    axes.scatter(*points.T, c=colours, s=1.5, alpha=0.5, linewidths=0, rasterized=True)


def _coloured(readings: Array, legs: Sequence[int]) -> tuple[Array, list[str]]:
    """Readings that a figure can hold, and the colour of the leg that reads most."""
    shown = readings[thinned(len(readings), _POINTS)]
    return shown, [leg_style(legs[number]).colour for number in shown.argmax(axis=1)]


def _draw_cloud(
    axes: Any, readings: Array, legs: Sequence[int], limits: tuple[float, float]
) -> None:
    axes.plot(limits, limits, limits, color=INK, linewidth=1.2)
    axes.set(xlim=limits, ylim=limits, zlim=limits)
    axes.set_box_aspect((1, 1, 1), zoom=0.85)
    axes.view_init(elev=26, azim=25)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    axes.xaxis.labelpad = 8  # clear of the numbers, which it meets at this angle
    axes.zaxis.set_rotate_label(False)  # by itself it would stand on its head
    axes.zaxis.label.set_rotation(90)
    if len(readings) == 0:
        axes.text2D(0.5, 0.5, "out of reach", ha="center", color=INK, transform=axes.transAxes)
        return
    _scatter(axes, *_coloured(readings, legs))


def _draw_along_axis(figure: Figure, place: Any, study: WorkspaceStudy, legs: list[int]) -> None:
    first, second, third = (rf"\psi_{leg + 1}" for leg in legs)
    unit = study.mechanism.reading_unit
    axes = flat_axes(
        figure,
        place,
        title="along the line of equal readings",
        x=rf"$({second} - {first})/\sqrt{{2}}$, {unit}",
        y=rf"$(2{third} - {first} - {second})/\sqrt{{6}}$, {unit}",
    )
    shown, colours = _coloured(study.sample.readings[:, legs], legs)
    across = (shown[:, 1] - shown[:, 0]) / math.sqrt(2)
    up = (2 * shown[:, 2] - shown[:, 0] - shown[:, 1]) / math.sqrt(6)
    _scatter(axes, np.column_stack([across, up]), colours)
    axes.plot(0, 0, "+", color=INK, markersize=10)
    axes.set_aspect("equal", adjustable="box")


def _cloud_legend(legs: Sequence[int], line: str) -> list[Line2D]:
    handles = [
        Line2D(
            [],
            [],
            marker="o",
            ls="",
            color=leg_style(leg).colour,
            label=f"leg {leg + 1} reads most",
        )
        for leg in legs
    ]
    return [*handles, Line2D([], [], color=INK, label=line)]


def _two_leg_figure(study: WorkspaceStudy) -> Figure:
    """The cloud in the plane, and the line about which the symmetry mirrors it."""
    figure = new_figure(5.4, 5.4)
    x, y = (_reading_label(study.mechanism, leg) for leg in (0, 1))
    axes = flat_axes(figure, figure.add_gridspec(1, 1)[0], title=study.mechanism.name, x=x, y=y)
    readings = study.sample.readings
    shown = readings[thinned(len(readings), _POINTS)]
    sign = _exchange_sign(study)
    nearer = (shown[:, 0] < sign * shown[:, 1]).astype(np.intp)
    _scatter(axes, shown, [leg_style(leg).colour for leg in nearer])
    ends = np.array(_limits(shown))
    line = axes.plot(ends, sign * ends, color=INK, linewidth=1.2)
    axes.set_aspect("equal")
    axes.legend(line, ["mirror line"], fontsize=SMALL, labelcolor=INK, frameon=False)
    return figure


def _exchange_sign(study: WorkspaceStudy) -> float:
    """With what sign the readings go over when the symmetry exchanges the two legs."""
    for element in study.symmetry.structure.elements:
        if study.symmetry.permutations[element.label] == (1, 0):
            return float(_core.reading_sign(element, study.mechanism.core))
    return 1.0


def _reading_label(mechanism: Mechanism, leg: int) -> str:
    return rf"$\psi_{leg + 1}$, {mechanism.reading_unit}"
