# SPDX-License-Identifier: MIT
"""Where the poses lie: candidates, and the poses chosen for every leg."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from symkin.plot.poses import VIEWS, orientation_label, orientations
from symkin.plot.style import (
    COLOUR_MAP,
    colour_bar,
    flat_axes,
    leg_handles,
    leg_style,
    legend_below,
    new_figure,
    spatial_axes,
    thinned,
)

__all__ = ["poses_figure"]

Array = NDArray[np.float64]

_SIZES = {"planar": (8.6, 4.2), "point": (5.6, 4.8), "spatial": (8.8, 3.6)}  # inches
_PLAIN = "#9DB8CC"  # of poses without orientation
_FLAT_LIMIT, _SPATIAL_LIMIT = 8000, 2500  # poses drawn of a cloud


def poses_figure(
    pose_space: str, cloud: Array, leg_sets: Sequence[Array] = (), labels: Sequence[str] = ()
) -> Figure:
    """Draw a cloud of poses, coloured by orientation, and the poses of every leg's set on it.

    Parameters
    ----------
    pose_space : {"planar", "point", "spatial"}
        Kind of the poses. Planar ones are drawn in x and y, and in x, y and phi; spatial ones in
        three projections.
    cloud : ndarray, shape (n, coordinates)
        Candidates, or measured poses; of many only a part is drawn.
    leg_sets : sequence of ndarray, shape (N, coordinates)
        Poses of each leg's set.
    labels : sequence of str
        Of the sets, by default "leg 1", "leg 2", ...

    Returns
    -------
    Figure
    """
    views = VIEWS[pose_space]
    figure = new_figure(*_SIZES[pose_space])
    columns = 2 if pose_space == "planar" else len(views)
    places = figure.add_gridspec(1, columns, width_ratios=(1, 1.3) if columns == 2 else None)
    drawn = cloud[thinned(len(cloud), _FLAT_LIMIT)]
    panels = []
    for column, view in enumerate(views):
        axes = flat_axes(figure, places[column], x=view.x_label, y=view.y_label)
        panels.append(_draw_view(axes, pose_space, drawn, leg_sets, (view.x, view.y)))
        if view == VIEWS["planar"][0]:
            axes.set_aspect("equal", adjustable="box" if pose_space != "spatial" else "datalim")
    if pose_space == "planar":
        _draw_with_angle(figure, places[1], cloud, leg_sets)
    if pose_space != "point":
        where = {"location": "left"} if pose_space == "planar" else {}
        label = orientation_label(pose_space)
        colour_bar(figure, panels[0], figure.axes[: len(views)], label, shrink=0.8, **where)
    if leg_sets:
        labels = labels or [f"leg {leg + 1}" for leg in range(len(leg_sets))]
        legend_below(figure, leg_handles(labels))
    return figure


def _draw_view(
    axes: Axes, pose_space: str, cloud: Array, leg_sets: Sequence[Array], columns: tuple[int, int]
) -> Any:
    """Draw one projection; returns what the colour bar belongs to."""
    x, y = columns
    few = len(cloud) <= 500
    colours = orientations(pose_space, cloud)
    points = axes.scatter(
        cloud[:, x],
        cloud[:, y],
        c=_PLAIN if colours is None else colours,
        cmap=None if colours is None else COLOUR_MAP,
        s=22 if few else 3,
        alpha=0.9 if few else 0.4,
        linewidths=0,
        rasterized=True,
    )
    for leg, poses in enumerate(leg_sets):
        axes.scatter(poses[:, x], poses[:, y], zorder=3, **_marker(leg, len(leg_sets)))
    return points


def _draw_with_angle(figure: Figure, place: Any, cloud: Array, leg_sets: Sequence[Array]) -> None:
    labels = ("x, m", "y, m", orientation_label("planar"))
    axes = spatial_axes(figure, place, labels=labels)
    few = cloud[thinned(len(cloud), _SPATIAL_LIMIT)]
    axes.scatter(
        *few[:, :3].T,
        c=few[:, 2],
        cmap=COLOUR_MAP,
        s=3,
        alpha=0.5,
        linewidths=0,
        depthshade=False,
        rasterized=True,
    )
    for leg, poses in enumerate(leg_sets):
        axes.scatter(*poses[:, :3].T, depthshade=False, **_marker(leg, len(leg_sets)))
    axes.view_init(elev=18, azim=-60)
    axes.set_box_aspect((1, 1, 0.9), zoom=0.84)  # its labels would be cut off otherwise


def _marker(leg: int, legs: int) -> dict[str, Any]:
    style = leg_style(leg)
    size = 30 if legs <= 4 else 20
    return {
        "color": style.colour,
        "marker": style.marker,
        "s": size,
        "edgecolors": "white",
        "linewidths": 0.7,
    }
