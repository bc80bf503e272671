# SPDX-License-Identifier: MIT
"""Where poses lie, and what a mechanism's workspace looks like (after Figs. 6a to 6d)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import FigureBase
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from symkin import _core
from symkin.analysis.workspace import WorkspaceSample
from symkin.analysis.workspace.study import (
    ConstantOrientation,
    ModeSlices,
    WorkspaceStudy,
    slice_coordinates,
)
from symkin.data.measurements import Measurements
from symkin.model.mechanism import Mechanism
from symkin.model.poses import POSE_SPACES, PoseSpace, space_named, vectors_from_quaternions
from symkin.show.figures.style import (
    COLOUR_MAP,
    DARK,
    SMALL,
    SUBSCRIPTS,
    colour_bar,
    flat_axes,
    leg_handles,
    leg_style,
    legend_below,
    new_figure,
    own_axes,
    sign,
    spatial_axes,
)
from symkin.show.theme import (
    ACCENT,
    INK,
    LINE,
    MANY,
    PAPER,
)
from symkin.show.units import on_paper
from symkin.show.wording import given
from symkin.values import Array, evenly

_SIZES = {"planar": (8.6, 4.2), "point": (4.6, 4.4)}  # inches
_SIZE_IN_SPACE = (8.8, 3.7)
_PLAIN = "#9DB8CC"  # of poses without orientation
_FLAT_LIMIT, _SPATIAL_LIMIT = 4000, 2500  # poses drawn of a cloud
_HOME_SIDE, _USABLE, _OTHER_SIDE = "#CFE5F2", "#7DB8DC", "#F9DFA8"
_LABELLED_SHARE = 0.01  # of the reachable area, from which an aspect gets its number
_POINTS = 12_000  # in a cloud of readings


class View(NamedTuple):
    """Two coordinates of what is shown of poses, by column, and the labels of their axes."""

    x: int
    y: int
    x_label: str
    y_label: str


_TOP, _SIDES = (0, 1), ((0, 2), (1, 2))


def views_of(space: PoseSpace) -> tuple[View, ...]:
    """From above, and in space from the sides too; of a spherical platform its rotation."""
    unit = on_paper("m" if space.moves else "rad")[1]
    of = "" if space.moves else " of the rotation vector"
    shown = (_TOP, *_SIDES) if space.in_space or not space.moves else (_TOP,)
    return tuple(View(x, y, f"{'xyz'[x]}{of}, {unit}", f"{'xyz'[y]}, {unit}") for x, y in shown)


def shown_of(space: PoseSpace, poses: Array) -> Array:
    """What the views show of poses, as it is told: places, or rotation vectors, (n, 2 or 3)."""
    if not space.moves:
        return on_paper("rad")[0] * vectors_from_quaternions(poses)
    return on_paper("m")[0] * poses[:, : space.size]


def bed_points(points: ArrayLike, *, ax: Axes | None = None) -> Axes:
    """Draw where a probe touches a bed, numbered in the order of measuring.

    Parameters
    ----------
    points : array_like, shape (N, 2)
        x and y, m.
    ax : Axes, optional
        Where to draw, by default in a new figure.

    Returns
    -------
    Axes
    """
    factor, unit = on_paper("m")
    places = factor * np.asarray(points, dtype=float)
    axes = own_axes(ax, 5.4, 5.0, x=f"x, {unit}", y=f"y, {unit}")
    axes.plot(*places.T, color=LINE, linewidth=0.8, zorder=1)
    axes.plot(*places.T, "o", color=ACCENT, markersize=4, zorder=2)
    style: dict[str, Any] = {"textcoords": "offset points", "fontsize": SMALL, "color": INK}
    for number, place in enumerate(places.tolist(), 1):
        axes.annotate(str(number), place, xytext=(4, 4), **style)
    axes.set_aspect("equal", adjustable="datalim")
    return axes


def poses(
    poses: ArrayLike | WorkspaceSample | Measurements,
    sets: Sequence[ArrayLike] = (),
    labels: Sequence[str] = (),
    *,
    pose_space: str | None = None,
    figure: FigureBase | None = None,
) -> FigureBase:
    """Draw a cloud of poses, coloured by orientation, and the poses of every leg's set on it.

    Planar ones are drawn in x and y, and in x, y and phi; those in space in three projections, of a
    spherical platform of the rotation vector.

    Parameters
    ----------
    poses : array_like, shape (n, coordinates), WorkspaceSample or Measurements
        Candidates, or measured poses; of many only a part is drawn.
    sets : sequence of array_like, shape (N, coordinates)
        Poses of each leg's set.
    labels : sequence of str
        Of the sets, by default "leg 1", "leg 2", ...
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}, optional
        Kind of the poses; by default what they say, or by how many coordinates they have.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    cloud = np.asarray(getattr(poses, "poses", poses), dtype=float)
    chosen = [np.asarray(each, dtype=float) for each in sets]
    space = space_named(pose_space or getattr(poses, "pose_space", "") or "", cloud.shape[1]).name
    views = views_of(POSE_SPACES[space])
    figure = new_figure(*_SIZES.get(space, _SIZE_IN_SPACE), figure)
    columns = 2 if space == "planar" else len(views)
    places = figure.add_gridspec(1, columns, width_ratios=(1, 1.3) if columns == 2 else None)
    drawn = cloud[evenly(len(cloud), _FLAT_LIMIT)]
    panels, axes = [], []
    for column, view in enumerate(views):
        axes.append(flat_axes(figure, places[column], x=view.x_label, y=view.y_label))
        panels.append(_draw_view(axes[-1], space, drawn, chosen, view))
        if (view.x, view.y) == _TOP and POSE_SPACES[space].moves:
            axes[-1].set_aspect("equal", adjustable="box" if len(views) == 1 else "datalim")
    if space == "planar":
        _draw_with_angle(figure, places[1], cloud, chosen)
    if POSE_SPACES[space].turns and POSE_SPACES[space].moves:
        where = {"location": "left"} if space == "planar" else {}
        colour_bar(figure, panels[0], axes, _orientation_label(space), shrink=0.8, **where)
    if chosen:
        legend_below(figure, leg_handles(labels or [f"leg {n}" for n in range(1, len(sets) + 1)]))
    return figure


def workspace(
    study: WorkspaceStudy | Sequence[ModeSlices], *, figure: FigureBase | None = None
) -> FigureBase:
    """Draw constant-orientation workspaces with their aspects and singularities.

    Parameters
    ----------
    study : WorkspaceStudy, or sequence of ModeSlices
        Of `study_workspace`; or a row for each working mode, all on the same grids.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    rows = study.modes if isinstance(study, WorkspaceStudy) else study
    columns = max(len(row.slices) for row in rows)
    figure = new_figure(0.8 + 3.2 * columns, 0.6 + 3.3 * len(rows), figure)
    grid = figure.add_gridspec(len(rows), columns)
    for number, row in enumerate(rows):
        names = list(row.mechanism.space.units)
        (x, y), _ = slice_coordinates(row.mechanism)
        for column, found in enumerate(row.slices):
            title = _slice_title(row.title if len(rows) > 1 else "", found)
            unit = on_paper(found.units[1])[1]
            across, up = f"{names[x]}, {unit}", f"{names[y]}, {unit}"
            axes = flat_axes(figure, grid[number, column], title=title, x=across, y=up)
            _draw_slice(axes, found)
    legend_below(figure, _slice_legend([found for row in rows for found in row.slices]), columns)
    return figure


def active_joints(study: WorkspaceStudy, *, figure: FigureBase | None = None) -> FigureBase:
    """Draw the active-joint workspace: of all poses, and of each constant orientation.

    Of more than three legs three are drawn, such that rotations carry onto each other if there are
    any. A point has the colour of the leg with the largest reading, so that these rotations carry
    the colours onto each other.

    Parameters
    ----------
    study : WorkspaceStudy
        Of `study_workspace`.
    figure : Figure or SubFigure, optional
        Where to draw, by default in a new one.

    Returns
    -------
    Figure or SubFigure
    """
    readings = study.sample.readings
    if readings.shape[1] == 2:
        return _draw_two_legs(study, figure)
    figure = new_figure(10.4, 7.4, figure)
    grid = figure.add_gridspec(2, max(3, len(study.slices)))
    legs = _drawn_legs(study)
    whole = "all poses" if study.mechanism.bound else "all orientations"
    clouds = {whole: readings[:, legs]} | {
        _slice_title("", found): found.readings[found.side > 0][:, legs] for found in study.slices
    }
    clouds = {name: shown_readings(study.mechanism, cloud) for name, cloud in clouds.items()}
    limits = reading_limits(np.concatenate(list(clouds.values())))
    places = [grid[0, 0], *(grid[1, column] for column in range(len(study.slices)))]
    for place, (title, cloud) in zip(places, clouds.items(), strict=True):
        axes = reading_axes(figure, place, study.mechanism, legs, title, limits)
        _draw_cloud(axes, cloud, legs)
    _draw_along_axis(figure, grid[0, 1:], study, legs)
    handles = [sign("o", f"leg {leg + 1} reads most", leg_style(leg).colour) for leg in legs]
    legend_below(figure, [*handles, Line2D([], [], color=INK, label="equal readings")])
    return figure


def _orientations(space: str, poses: Array) -> Array | None:
    """Orientation of each pose as one number: the angle, or the angle of the rotation."""
    factor, _ = on_paper("rad")
    if POSE_SPACES[space].has_angle:
        return factor * poses[:, -1]
    if space == "spatial":
        vector = np.linalg.norm(poses[:, 3:6], axis=1)
        return np.asarray(2 * factor * np.arctan2(vector, np.abs(poses[:, 6])))
    return None


def _orientation_label(space: str) -> str:
    letters = {"phi": "\N{GREEK SMALL LETTER PHI}", "theta": "\N{GREEK SMALL LETTER THETA}"}
    of = letters.get(POSE_SPACES[space].rotation[0], "angle of rotation")
    return f"{of}, {on_paper('rad')[1]}"


def _draw_view(axes: Axes, space: str, cloud: Array, sets: Sequence[Array], view: View) -> Any:
    """Draw one projection; returns what the colour bar belongs to."""
    few = len(cloud) <= 500
    colours = _orientations(space, cloud)
    shown = shown_of(POSE_SPACES[space], cloud)
    points = axes.scatter(
        shown[:, view.x],
        shown[:, view.y],
        c=_PLAIN if colours is None else colours,
        cmap=None if colours is None else COLOUR_MAP,
        s=22 if few else 3,
        alpha=0.9 if few else 0.4,
        linewidths=0,
        rasterized=True,
    )
    for leg, each in enumerate(sets):
        chosen = shown_of(POSE_SPACES[space], each)
        look = {"zorder": 3, "rasterized": len(each) > MANY, **_marker(leg, len(sets))}
        axes.scatter(chosen[:, view.x], chosen[:, view.y], **look)
    return points


def _draw_with_angle(figure: FigureBase, place: Any, cloud: Array, sets: Sequence[Array]) -> None:
    (length, unit), (angle, _) = on_paper("m"), on_paper("rad")
    labels = (f"x, {unit}", f"y, {unit}", _orientation_label("planar"))
    axes = spatial_axes(figure, place, labels=labels)
    scale = np.array([length, length, angle])
    few, *sets = (
        scale * each[:, :3] for each in (cloud[evenly(len(cloud), _SPATIAL_LIMIT)], *sets)
    )
    style: dict[str, Any] = {"cmap": COLOUR_MAP, "s": 3, "alpha": 0.5, "linewidths": 0}
    axes.scatter(*few[:, :3].T, c=few[:, 2], depthshade=False, rasterized=True, **style)
    for leg, chosen in enumerate(sets):
        look = {"rasterized": len(chosen) > MANY, **_marker(leg, len(sets))}
        axes.scatter(*chosen[:, :3].T, depthshade=False, **look)
    axes.view_init(elev=18, azim=-60)
    axes.set_box_aspect((1, 1, 0.9), zoom=0.84)  # its labels would be cut off otherwise


def _marker(leg: int, legs: int) -> dict[str, Any]:
    style = leg_style(leg)
    look = {"color": style.colour, "marker": style.marker, "edgecolors": PAPER, "linewidths": 0.7}
    return look | {"s": 30 if legs <= 4 else 20}


def _draw_slice(axes: Axes, found: ConstantOrientation) -> None:
    axes.grid(False)
    kinds = np.select([found.usable, found.side > 0, found.side < 0], [2, 1, 3], default=0)
    x, y = _centres(found)
    half_x, half_y = (0.5 * (centres[1] - centres[0]) for centres in (x, y))
    left, right, bottom, top = x[0], x[-1], y[0], y[-1]
    axes.imshow(
        np.ma.masked_equal(kinds, 0),
        origin="lower",
        extent=(left - half_x, right + half_x, bottom - half_y, top + half_y),
        cmap=ListedColormap([_HOME_SIDE, _USABLE, _OTHER_SIDE]),
        vmin=1,
        vmax=3,
        interpolation="nearest",
    )
    for values, colour, style in (
        (found.reach_margin, INK, "solid"),
        (found.parallel, ACCENT, "dashed"),
    ):
        if _crosses_zero(values):
            known = np.ma.masked_invalid(values)
            lines: dict[str, Any] = {"colors": [colour], "linestyles": [style], "linewidths": 1.4}
            axes.contour(x, y, known, levels=[0], **lines)
    _number_aspects(axes, found)


def _centres(found: ConstantOrientation) -> tuple[Array, Array]:
    """Centres of the cells, as they are told."""
    factor, _ = on_paper(found.units[1])
    return factor * found.x, factor * found.y


def _crosses_zero(values: Array) -> bool:
    return bool((values < 0).any() and (values > 0).any())


def _number_aspects(axes: Axes, found: ConstantOrientation) -> None:
    areas, (x, y) = np.abs(found.aspect_areas), _centres(found)
    for number in np.flatnonzero(areas > _LABELLED_SHARE * areas.sum()) + 1:
        rows, columns = np.nonzero(found.aspects == number)
        middle = np.argmin((rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2)
        place = x[columns[middle]], y[rows[middle]]
        axes.annotate(str(number), place, ha="center", va="center", color=DARK, fontweight="bold")


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
    orientation = ""
    if not math.isnan(found.orientation):
        orientation = given(found.orientation, found.units[0])
    return ", ".join(filter(None, (title, orientation)))


def _drawn_legs(study: WorkspaceStudy) -> list[int]:
    permutations = study.symmetry.permutations
    orbit = [permutations[f"r{turn}"][0] for turn in range(3) if f"r{turn}" in permutations]
    return orbit if len(set(orbit)) == 3 else [0, 1, 2]


def shown_readings(mechanism: Mechanism, readings: Array) -> Array:
    """Readings as they are told."""
    return on_paper(mechanism.reading_unit)[0] * readings


def reading_limits(readings: Array) -> tuple[float, float]:
    """The least and the largest."""
    return float(readings.min()), float(readings.max())


def _scatter(axes: Any, points: Array, colours: Sequence[str]) -> None:
    axes.scatter(*points.T, c=colours, s=1.5, alpha=0.5, linewidths=0, rasterized=True)


def _coloured(readings: Array, legs: Sequence[int]) -> tuple[Array, list[str]]:
    """Readings that a figure can hold, and the colour of the leg that reads most."""
    shown = readings[evenly(len(readings), _POINTS)]
    return shown, [leg_style(legs[number]).colour for number in shown.argmax(axis=1)]


def reading_axes(
    figure: FigureBase,
    place: Any,
    mechanism: Mechanism,
    legs: Sequence[int],
    title: str,
    limits: tuple[float, float],
) -> Any:
    """Three-dimensional axes for the readings of three legs, with the line of equal ones."""
    labels = [_reading_label(mechanism, leg) for leg in legs]
    axes = spatial_axes(figure, place, title=title, labels=labels)
    axes.plot(limits, limits, limits, color=INK, linewidth=1.2)
    axes.set(xlim=limits, ylim=limits, zlim=limits)
    axes.set_box_aspect((1, 1, 1), zoom=0.85)
    axes.view_init(elev=26, azim=25)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4))
    axes.xaxis.labelpad = 8  # clear of the numbers, which it meets at this angle
    axes.zaxis.set_rotate_label(False)  # by itself it would stand on its head
    axes.zaxis.label.set_rotation(90)
    return axes


def _draw_cloud(axes: Any, readings: Array, legs: Sequence[int]) -> None:
    if len(readings) == 0:
        axes.text2D(0.5, 0.5, "out of reach", ha="center", color=INK, transform=axes.transAxes)
        return
    _scatter(axes, *_coloured(readings, legs))


def _draw_along_axis(
    figure: FigureBase, place: Any, study: WorkspaceStudy, legs: list[int]
) -> None:
    axes = axial_axes(figure, place, study.mechanism, legs)
    readings = shown_readings(study.mechanism, study.sample.readings[:, legs])
    shown, colours = _coloured(readings, legs)
    _scatter(axes, along_equal_readings(shown), colours)


def axial_axes(figure: FigureBase, place: Any, mechanism: Mechanism, legs: Sequence[int]) -> Axes:
    """Axes for the readings of three legs, seen along the line of equal ones."""
    first, second, third = (_symbol(leg) for leg in legs)
    unit, minus = on_paper(mechanism.reading_unit)[1], "\N{MINUS SIGN}"
    axes = flat_axes(
        figure,
        place,
        title="along the line of equal readings",
        x=f"({second} {minus} {first})/√2, {unit}",
        y=f"(2{third} {minus} {first} {minus} {second})/√6, {unit}",
    )
    axes.plot(0, 0, "+", color=INK, markersize=10)
    axes.set_aspect("equal", adjustable="box")
    return axes


def along_equal_readings(readings: Array) -> Array:
    """Readings of three legs, seen along the line of equal ones, shape (n, 2)."""
    across = (readings[:, 1] - readings[:, 0]) / math.sqrt(2)
    up = (2 * readings[:, 2] - readings[:, 0] - readings[:, 1]) / math.sqrt(6)
    return np.column_stack([across, up])


def _draw_two_legs(study: WorkspaceStudy, figure: FigureBase | None) -> FigureBase:
    """The cloud in the plane, and the line about which the symmetry mirrors it."""
    figure = new_figure(4.6, 4.6, figure)
    x, y = (_reading_label(study.mechanism, leg) for leg in (0, 1))
    axes = flat_axes(figure, figure.add_gridspec(1, 1)[0], title=study.mechanism.name, x=x, y=y)
    readings = shown_readings(study.mechanism, study.sample.readings)
    shown = readings[evenly(len(readings), _POINTS)]
    exchange = _exchange_sign(study)
    nearer = (shown[:, 0] < exchange * shown[:, 1]).astype(np.intp)
    _scatter(axes, shown, [leg_style(leg).colour for leg in nearer])
    ends = np.array(reading_limits(shown))
    axes.plot(ends, exchange * ends, color=INK, linewidth=1.2)
    axes.set_aspect("equal")
    legend_below(figure, [Line2D([], [], color=INK, linewidth=1.2, label="mirror line")])
    return figure


def _exchange_sign(study: WorkspaceStudy) -> float:
    """With what sign the readings go over when the symmetry exchanges the two legs."""
    for element in study.symmetry.structure.elements:
        if study.symmetry.permutations[element.label] == (1, 0):
            return float(_core.reading_sign(element, study.mechanism.straight))
    return 1.0


def _reading_label(mechanism: Mechanism, leg: int) -> str:
    return f"{_symbol(leg)}, {on_paper(mechanism.reading_unit)[1]}"


def _symbol(leg: int) -> str:
    return "\N{GREEK SMALL LETTER PSI}" + str(leg + 1).translate(SUBSCRIPTS)
