# SPDX-License-Identifier: MIT
"""End-effector errors before and after: how large, and where."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from symkin.evaluation import Evaluation
from symkin.observability import ExpectedAccuracy
from symkin.plot.poses import VIEWS, View, error_sizes
from symkin.plot.style import (
    AFTER,
    BEFORE,
    COLOUR_MAP,
    INK,
    colour_bar,
    flat_axes,
    legend_below,
    new_figure,
)
from symkin.report.wording import fixed

__all__ = ["error_histogram_figure", "error_map_figure"]

Array = NDArray[np.float64]

_FEW = 1500  # poses that a map shows one by one
_MILLI = 1e3


class Panel(NamedTuple):
    """Poses of one panel of the map, by row, and the two coordinates that it shows."""

    title: str
    rows: NDArray[np.intp]
    view: View


def error_histogram_figure(
    before: Evaluation, after: Evaluation, expected: ExpectedAccuracy | None = None
) -> Figure:
    """Draw the distribution of the errors on a logarithmic scale, with their root mean squares.

    Parameters
    ----------
    before, after : Evaluation
        With the nominal and the calibrated mechanism.
    expected : ExpectedAccuracy, optional
        Root mean squares to expect after.

    Returns
    -------
    Figure
    """
    labels = ("position error, mm", "orientation error, mrad")
    kinds = list(
        zip(labels, error_sizes(before), error_sizes(after), strict=False)
    )  # a point has one kind only
    foreseen = (None, None) if expected is None else (expected.position, expected.orientation)
    figure = new_figure(8.6 if len(kinds) > 1 else 5.2, 3.3)
    places = figure.add_gridspec(1, len(kinds))
    for column, (label, sizes_before, sizes_after) in enumerate(kinds):
        axes = flat_axes(figure, places[column], x=label, y="poses, %")
        _draw_histogram(axes, sizes_before, sizes_after, foreseen[column])
    legend_below(figure, _histogram_handles(expected is not None))
    return figure


def _draw_histogram(axes: Axes, before: Array, after: Array, expected: float | None) -> None:
    shown = [_MILLI * sizes[sizes > 0] for sizes in (before, after)]
    both = np.concatenate(shown)
    if not both.size:
        return
    # The smallest errors are a long thin tail, left out because it would squeeze the rest.
    low, high = np.quantile(both, 0.002), both.max() * 1.1
    bins = np.geomspace(min(low, 0.5 * high), high, 50 if len(both) > 1000 else 26).tolist()
    for sizes, colour in zip(shown, (BEFORE, AFTER), strict=True):
        weights = np.full(len(sizes), 100 / max(1, len(sizes)))
        axes.hist(sizes, bins=bins, weights=weights, color=colour, alpha=0.75)
        if len(sizes):
            axes.axvline(_rms(sizes), color=colour, linewidth=1.6, linestyle="--")
    if expected:
        axes.axvline(_MILLI * expected, color=INK, linewidth=1.4, linestyle=":")
    axes.set_xscale("log")


def _histogram_handles(expected: bool) -> list[Any]:
    handles: list[Any] = [
        Patch(color=BEFORE, alpha=0.75, label="before"),
        Patch(color=AFTER, alpha=0.75, label="after"),
        Line2D([], [], color=INK, linestyle="--", label="root mean square"),
    ]
    if expected:
        handles.append(Line2D([], [], color=INK, linestyle=":", label="expected after"))
    return handles


def error_map_figure(
    pose_space: str, poses: Array, before: Evaluation, after: Evaluation
) -> Figure:
    """Draw the position error over the workspace: before in the upper row, after in the lower.

    The columns are bands of orientation (planar) or projections (spatial). Each row has its own
    colour bar, since the errors differ by orders of magnitude.

    Parameters
    ----------
    pose_space : {"planar", "point", "spatial"}
        Kind of the poses.
    poses : ndarray, shape (N, coordinates)
        Those of both evaluations. Where they are many, a cell shows their root mean square.
    before, after : Evaluation
        With the nominal and the calibrated mechanism.

    Returns
    -------
    Figure
    """
    panels = _panels(pose_space, poses)
    if len(panels) == 1:
        figure = new_figure(8.6, 3.3)
        places = figure.add_gridspec(1, 2)
        rows = [[places[0]], [places[1]]]
    else:
        figure = new_figure(8.6, 5.3)
        places = figure.add_gridspec(2, len(panels))
        rows = [[places[row, column] for column in range(len(panels))] for row in range(2)]
    for state, evaluation, row in zip(("before", "after"), (before, after), rows, strict=True):
        sizes = _MILLI * error_sizes(evaluation)[0]
        _draw_row(figure, row, panels, poses, sizes, f"position error {state}, mm")
    return figure


def _draw_row(
    figure: Figure,
    places: Sequence[SubplotSpec],
    panels: Sequence[Panel],
    poses: Array,
    sizes: Array,
    label: str,
) -> None:
    """Draw all panels of one state with one colour bar."""
    row_axes: list[Axes] = []
    drawn = []
    for place, panel in zip(places, panels, strict=True):
        # Bands of orientation show the same view, so one scale serves them all.
        shared = figure.axes[0] if panel.title and figure.axes else None
        axes = flat_axes(
            figure,
            place,
            title=panel.title,
            x=panel.view.x_label,
            y="" if row_axes and shared else panel.view.y_label,
            share_x=shared,
            share_y=shared,
        )
        drawn.append(_draw_errors(axes, poses[panel.rows], sizes[panel.rows], panel.view))
        row_axes.append(axes)
    _one_scale(drawn)
    colour_bar(figure, drawn[0], row_axes, label, pad=0.01, shrink=0.85)


def _panels(pose_space: str, poses: Array) -> list[Panel]:
    every = np.arange(len(poses))
    if pose_space != "planar":
        return [Panel("", every, view) for view in VIEWS[pose_space]]
    view = VIEWS["planar"][0]
    edges = np.quantile(poses[:, 2], (0, 1 / 3, 2 / 3, 1))
    bands = np.clip(np.searchsorted(edges, poses[:, 2], side="right") - 1, 0, 2)
    return [
        Panel(
            f"\N{GREEK SMALL LETTER PHI} from {fixed(low, 2)} to {fixed(high, 2)} rad",
            np.flatnonzero(bands == band),
            view,
        )
        for band, (low, high) in enumerate(pairwise(edges.tolist()))
    ]


def _draw_errors(axes: Axes, poses: Array, sizes: Array, view: View) -> Any:
    good = np.isfinite(sizes)
    x, y, sizes = poses[good, view.x], poses[good, view.y], sizes[good]
    if view == VIEWS["planar"][0]:
        axes.set_aspect("equal", adjustable="box")
    if len(poses) <= _FEW:
        return axes.scatter(x, y, c=sizes, cmap=COLOUR_MAP, s=18, linewidths=0)
    return axes.hexbin(
        x,
        y,
        C=sizes,
        reduce_C_function=_rms,
        gridsize=26,
        cmap=COLOUR_MAP,
        linewidths=0.2,
        rasterized=True,
    )


def _one_scale(drawn: list[Any]) -> None:
    """Give the panels of a row the same colours for the same errors."""
    values = np.concatenate([np.ma.filled(panel.get_array(), np.nan) for panel in drawn])
    if np.isfinite(values).any():
        for panel in drawn:
            panel.set_clim(np.nanmin(values), np.nanmax(values))


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
