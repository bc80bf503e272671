# SPDX-License-Identifier: MIT
"""A mechanism drawn at a pose; and with its workspace, to be turned by hand (with plotly)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import ArrayLike

from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.data.columns import pose_column_names
from symkin.errors import MeasurementError, MechanismError
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows, space_named
from symkin.model.symmetry.groups import SymmetryGroup
from symkin.planning import Plan
from symkin.show.figures.style import (
    COLOUR_MAP,
    SMALL,
    dressed,
    equal_box,
    flat_axes,
    leg_style,
    legend,
    legend_below,
    new_figure,
    sign,
    spatial_axes,
)
from symkin.show.skeleton import Joint, Skeleton, arcs, skeleton_of
from symkin.show.theme import ACCENT, BEFORE, INK, LINE, PAPER
from symkin.show.units import on_paper
from symkin.show.wording import setting
from symkin.values import Array, evenly, record

_BODIES = {"base": "#BDBDBD", "platform": "#8FB8DE"}
_JOINTS = {"R": "revolute", "P": "prismatic", "U": "universal", "S": "spherical"}
_SWING: dict[str, Any] = {"linewidth": 3, "alpha": 0.35}


@record
class DrawnSymmetry:
    """The symmetry of a drawing.

    Attributes
    ----------
    group : SymmetryGroup
        With its centre and its axis.
    keeps_modes : collection of str
        Labels of the elements that keep the working modes.
    nearly : bool
        Whether the mechanism has it within its tolerances only.
    """

    group: SymmetryGroup
    keeps_modes: Collection[str]
    nearly: bool = False


def mechanism(
    mechanism: Mechanism,
    pose: ArrayLike | None = None,
    *,
    symmetry: DrawnSymmetry | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw a mechanism at a pose: base, platform, and the numbered legs with their joints.

    Parameters
    ----------
    mechanism : Mechanism
        A spatial one is drawn in space and from above, others in the plane; of a spherical one the
        joints' axes where they leave the unit sphere.
    pose : array_like, shape (coordinates,), optional
        One that all legs reach, by default home.
    symmetry : DrawnSymmetry, optional
        Whose centre and mirrors are drawn too, in the plane.
    ax : Axes, optional
        Where to draw: in the plane, seen from above, or in space if it has three dimensions. By
        default in a new figure.

    Returns
    -------
    Axes
        Where it is drawn; if it is in space and from above, the latter.
    """
    skeleton = skeleton_of(mechanism, mechanism.home if pose is None else np.asarray(pose, float))
    handles = _joint_handles(itertools.chain(*skeleton.joints))
    if any(each is not None for each in skeleton.swings):
        handles.append(Line2D([], [], label="limits of a crank", color=INK, **_SWING))
    factor, unit = (1.0, "") if skeleton.on_sphere else on_paper("m")
    skeleton = skeleton.scaled(factor)
    labels = [f"{axis}, {unit}" if unit else axis for axis in "xyz"]
    if ax is not None:
        x, y, _ = labels
        handles += _draw(dressed(ax, x=x, y=y), skeleton, symmetry, factor)
        legend(ax, handles, below=False)
        return ax
    spatial = mechanism.space.in_space
    figure = new_figure(8.4 if spatial else 4.6, 4.6)
    places = figure.add_gridspec(1, 1 + spatial, width_ratios=(1.25, 1) if spatial else None)
    if spatial:
        _draw(spatial_axes(figure, places[0], labels=labels), skeleton, None, factor)
    title = "from above" if spatial else ""
    axes = flat_axes(figure, places[-1], title=title, x=labels[0], y=labels[1])
    handles += _draw(axes, skeleton, symmetry, factor)
    legend_below(figure, handles, columns=6 if spatial else 3 if symmetry is None else 2)
    return axes


def _draw(
    axes: Any, skeleton: Skeleton, symmetry: DrawnSymmetry | None, factor: float
) -> list[Line2D]:
    """Draw in the plane or in space; returns the legend entries of the symmetry."""
    flat = not isinstance(axes, Axes3D)
    for body, corners in skeleton.bodies.items():
        if flat:
            axes.add_patch(Polygon(corners[:, :2], closed=True, **_body_style(body)))
        else:
            axes.add_collection3d(Poly3DCollection([corners], **_body_style(body)))
    points = skeleton.points[:, :2] if flat else skeleton.points
    for leg, centres in enumerate(skeleton.legs):
        _draw_leg(axes, skeleton, leg, centres)
        _number_leg(axes, leg, centres, points.mean(axis=0))
    if not flat:
        equal_box(axes, points)
        axes.view_init(elev=22, azim=-65)
        return []
    axes.plot(0, 0, "+", color=INK, markersize=9, zorder=5)
    _frame(axes, np.vstack([points, np.zeros(2)]))
    return [] if symmetry is None else _draw_symmetry(axes, symmetry, factor)


def _frame(axes: Axes, points: Array) -> None:
    """One scale for x and y, with room for the numbers beyond the base."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    margin = 0.12 * float(np.max(upper - lower))
    axes.set_xlim(lower[0] - margin, upper[0] + margin)
    axes.set_ylim(lower[1] - margin, upper[1] + margin)
    axes.set_aspect("equal", adjustable="box")


def _draw_leg(axes: Any, skeleton: Skeleton, leg: int, centres: Array) -> None:
    colour = leg_style(leg).colour
    shown = slice(None) if isinstance(axes, Axes3D) else slice(2)
    links = arcs(centres) if skeleton.on_sphere else centres
    joints = list(zip(skeleton.joints[leg], centres[:, shown], strict=True))
    rail = skeleton.rails[leg] if skeleton.rails else None
    swing = skeleton.swings[leg] if skeleton.swings else None
    if swing is not None:
        axes.plot(*swing[:, shown].T, color=colour, zorder=2, **_SWING)
    if rail is not None:
        # The carriage stands where its leg begins, and joins the next joint there.
        axes.plot(*rail[:, shown].T, color=LINE, linewidth=5, alpha=0.5, zorder=2, marker="|")
        links, joints = centres[1:], [(joints[0][0], centres[1, shown]), *joints[1:]]
    elif len(joints) > 2 and joints[1][0] == Joint("P", actuated=True):  # a cylinder and its rod
        axes.plot(*links[:2, shown].T, color=colour, linewidth=6, alpha=0.45, zorder=2)
    axes.plot(*links[:, shown].T, color=colour, linewidth=2.4, solid_capstyle="round", zorder=3)
    for joint, centre in joints:
        axes.plot(
            *([value] for value in centre),
            markerfacecolor=colour if joint.actuated else PAPER,
            markeredgecolor=colour,
            linestyle="none",
            zorder=4,
            **joint.style,
        )


def _number_leg(axes: Any, leg: int, centres: Array, middle: Array) -> None:
    """Write the number beyond the base joint, away from the middle."""
    style: dict[str, Any] = {"ha": "center", "va": "center", "fontweight": "bold"}
    style |= {"color": leg_style(leg).colour, "fontsize": SMALL + 2}
    if isinstance(axes, Axes3D):
        outwards = (centres[0] - middle) * (1, 1, 0)
        axes.text(*(centres[0] + 0.16 * outwards), str(leg + 1), **style)
        return
    base = centres[0, :2]
    outwards = base - middle
    distance = float(np.hypot(*outwards))
    # A base joint in the middle has no outward direction; write its number below it.
    direction = outwards / distance if distance > 1e-9 else np.array([0.0, -1.0])
    axes.annotate(
        str(leg + 1), base, xytext=tuple(14 * direction), textcoords="offset points", **style
    )


def _body_style(body: str) -> dict[str, Any]:
    colour = _BODIES[body]
    return {"facecolor": colour + "40", "edgecolor": colour, "linewidth": 1, "zorder": 1}


def _joint_handles(joints: Iterable[Joint]) -> list[Any]:
    """Legend entries of the joints that occur, of the bodies and the origin."""
    handles: list[Any] = []
    for joint in dict.fromkeys(joints):
        state = "actuated" if joint.actuated else "passive"
        label = f"{state} {_JOINTS.get(joint.kind, joint.kind)} joint"
        face = INK if joint.actuated else PAPER
        style = joint.style | {"markerfacecolor": face, "markeredgecolor": INK}
        handles.append(sign(style.pop("marker"), label, size=style.pop("markersize"), **style))
    bodies = [Polygon(np.zeros((1, 2)), label=body, **_body_style(body)) for body in _BODIES]
    return [*handles, sign("+", "origin", size=9), *bodies]


def _draw_symmetry(axes: Axes, symmetry: DrawnSymmetry, factor: float) -> list[Line2D]:
    """Draw the centre of the rotations and the lines of the reflections, seen from above."""
    group = symmetry.group
    centre = factor * np.asarray(group.frame.base_centre, dtype=float)
    shown: dict[bool, Line2D] = {}
    for element in group.elements:
        if element.reflection:
            kept = element.label in symmetry.keeps_modes
            azimuth = group.frame.base_axis + group.angle(element)
            towards = (centre[0] + math.cos(azimuth), centre[1] + math.sin(azimuth))
            style: dict[str, Any] = {
                "color": ACCENT if kept else BEFORE,
                "linestyle": "--" if kept else ":",
                "linewidth": 1.2,
            }
            axes.axline((centre[0], centre[1]), towards, zorder=2, **style)
            label = "mirror" if kept else "mirror, flips the working modes"
            shown[kept] = Line2D([], [], label=label, **style)
    handles = [shown[kept] for kept in sorted(shown, reverse=True)]
    if group.rotations > 1:
        # A polygon with as many corners as there are turns; a diamond for two.
        handles += axes.plot(
            *centre,
            marker=(group.rotations, 0, 0) if group.rotations > 2 else "d",
            markersize=12,
            markerfacecolor="none",
            markeredgecolor=ACCENT,
            linestyle="none",
            label=f"{group.rotations}-fold centre",
            zorder=6,
        )
    return handles


_CLOUD = 3000  # poses drawn of the workspace
_STEPS = 150  # poses that the slider offers
_SYMBOLS = ("circle", "square", "diamond", "cross", "x")
_BODY_COLOURS = {"base": BEFORE, "platform": INK}


def explore(
    mechanism: Mechanism,
    plan: Plan | ArrayLike | None = None,
    *,
    candidates: WorkspaceSample | ArrayLike | None = None,
) -> Any:
    """Show workspace, chosen poses and mechanism in three dimensions, to be turned by hand.

    The third dimension is z, the angle of a platform that moves in the plane, or, of a point there,
    the common logarithm of the condition number. The workspace has the colour of that number. The
    mechanism stands at home, and a slider takes it to the chosen poses. Needs plotly:
    ``pip install "symkin[interactive]"``.

    Parameters
    ----------
    mechanism : Mechanism
        To be drawn.
    plan : Plan, or array_like of shape (N, coordinates), optional
        Chosen poses, which the mechanism must reach.
    candidates : WorkspaceSample, or array_like of shape (n, coordinates), optional
        The workspace; by default the plan's candidates, or else some that are drawn from it. Of
        many only a part is shown.

    Returns
    -------
    plotly.graph_objects.Figure
        A notebook shows it; ``figure.write_html("poses.html")`` makes a page of it.

    Raises
    ------
    ImportError
        If plotly is not installed.
    SymkinError
        If a chosen pose is out of reach, there is no workspace to draw candidates from, or the
        platform only turns.
    """
    try:
        import plotly.graph_objects as go
    except ImportError as error:
        raise ImportError('explore needs plotly: pip install "symkin[interactive]"') from error
    if not mechanism.space.position:
        raise MechanismError(
            f'the platform of "{mechanism.name}" has no position; expected one that moves'
        )
    chosen = plan if isinstance(plan, Plan) or plan is None else pose_rows(plan)
    poses = np.empty((0, len(mechanism.home))) if chosen is None else pose_rows(chosen)
    cloud = _cloud(mechanism, chosen, candidates)
    space_named(mechanism.pose_space, cloud.shape[1])
    stops = [("home", mechanism.home), *_stops(poses, chosen)]
    stood = [_standing(mechanism, name, pose) for name, pose in stops]
    traces = [_workspace(mechanism, cloud), *_chosen(mechanism, poses, chosen), *stood[0]]
    figure = go.Figure(traces)
    height = {"planar": "phi, rad", "point": "log10 of the condition number"}
    figure.update_layout(
        scene={
            **{f"{axis}axis": {"title": {"text": f"{axis}, m"}} for axis in "xy"},
            "zaxis": {"title": {"text": height.get(mechanism.pose_space, "z, m")}},
            "camera": {"eye": {"x": 1.5, "y": -1.5, "z": 1.1}},
            "aspectmode": "data" if mechanism.space.in_space else "manual",
            **({} if mechanism.space.in_space else {"aspectratio": _aspect(cloud, stood)}),
        },
        legend={"itemsizing": "constant", "orientation": "h", "y": 1.02, "yanchor": "bottom"},
        margin={"l": 0, "r": 0, "t": 30, "b": 0},
        height=620,
        sliders=[_slider([name for name, _ in stops], stood, len(traces))],
    )
    return figure


def _cloud(
    mechanism: Mechanism, chosen: Plan | Array | None, given: WorkspaceSample | ArrayLike | None
) -> Array:
    if given is None and isinstance(chosen, Plan):
        given = chosen.candidates
    cloud = pose_rows(sample_workspace(mechanism, _CLOUD) if given is None else given)
    return cloud[evenly(len(cloud), _CLOUD)]


def _height(mechanism: Mechanism, poses: Array) -> Array:
    """The third coordinate at which poses are shown."""
    if mechanism.pose_space == "point":
        height: Array = np.log10(mechanism.singularity_measures(poses)[2])
        return height
    return poses[:, 2]


def _words(mechanism: Mechanism, poses: Array) -> list[str]:
    """Each pose as its coordinates, a line each."""
    names = pose_column_names(mechanism.pose_space)
    return [
        "<br>".join(f"{name} = {setting(value)}" for name, value in zip(names, pose, strict=True))
        for pose in poses.tolist()
    ]


def _workspace(mechanism: Mechanism, cloud: Array) -> dict[str, Any]:
    conditions = mechanism.singularity_measures(cloud)[2]
    return {
        **_points(mechanism, cloud),
        "name": "workspace",
        "marker": {
            "size": 2,
            "opacity": 0.5,
            "color": np.log10(conditions),
            "colorscale": COLOUR_MAP,
            "colorbar": {"title": {"text": "log10 of the<br>condition number"}, "len": 0.6},
        },
        "text": [f"condition number {setting(each, digits=3)}" for each in conditions.tolist()],
        "hovertemplate": "%{text}<extra></extra>",
    }


def _points(mechanism: Mechanism, poses: Array) -> dict[str, Any]:
    return {
        "type": "scatter3d",
        "mode": "markers",
        "x": poses[:, 0],
        "y": poses[:, 1],
        "z": _height(mechanism, poses),
    }


def _chosen(mechanism: Mechanism, poses: Array, plan: Plan | Array | None) -> list[dict[str, Any]]:
    """A trace for the poses of each leg's set, and one for the spares."""
    if not len(poses):
        return []
    sets, spare = np.full(len(poses), -1), np.zeros(len(poses), dtype=bool)
    if isinstance(plan, Plan):
        sets, spare = plan.leg_sets, plan.spare
    traces = []
    for number in np.unique(sets).tolist():
        own = (sets == number) & ~spare
        colour = INK if number < 0 else leg_style(number).colour
        name = "chosen" if number < 0 else f"chosen for leg {number + 1}"
        marker = {"size": 5, "color": colour, "symbol": _SYMBOLS[number % len(_SYMBOLS)]}
        traces.append((own, name, marker))
    if spare.any():
        traces.append((spare, "spares", {"size": 3, "color": BEFORE, "symbol": "circle-open"}))
    return [
        {
            **_points(mechanism, poses[own]),
            "name": name,
            "marker": marker,
            "text": _words(mechanism, poses[own]),
            "hovertemplate": "%{text}<extra>" + name + "</extra>",
        }
        for own, name, marker in traces
    ]


def _stops(poses: Array, plan: Plan | Array | None) -> list[tuple[str, Array]]:
    """Where the slider takes the mechanism, in the order of the poses, without spares."""
    taken = ~plan.spare if isinstance(plan, Plan) else np.ones(len(poses), dtype=bool)
    rows = np.flatnonzero(taken)[:_STEPS]
    return [(f"row {row + 1}", poses[row]) for row in rows.tolist()]


def _standing(mechanism: Mechanism, name: str, pose: Array) -> list[dict[str, Any]]:
    """The mechanism at a pose: a trace for each leg, base and platform."""
    if not np.isfinite(mechanism.inverse_kinematics(pose)).all():
        raise MeasurementError(
            f"the mechanism does not reach the pose of {name}; "
            "expected poses within reach of all legs"
        )
    skeleton: Skeleton = skeleton_of(mechanism, pose)
    height = float(_height(mechanism, pose[np.newaxis])[0])
    traces = []
    for leg, centres in enumerate(skeleton.legs):
        style = {"color": leg_style(leg).colour, "width": 7}
        traces.append(_line(centres, height, f"leg {leg + 1}", style, "lines+markers"))
    for body, corners in skeleton.bodies.items():
        closed = np.vstack([corners, corners[:1]])
        traces.append(
            _line(closed, height, body, {"color": _BODY_COLOURS[body], "width": 4}, "lines")
        )
    return traces


def _line(
    points: Array, height: float, name: str, style: dict[str, Any], mode: str
) -> dict[str, Any]:
    """Its coordinates are lists: plotly packs arrays in a way that its sliders cannot read."""
    if points.shape[1] == 2:
        points = np.column_stack([points, np.full(len(points), height)])
    x, y, z = points.T.tolist()
    return {
        "type": "scatter3d",
        "mode": mode,
        "x": x,
        "y": y,
        "z": z,
        "name": name,
        "line": style,
        "marker": {"size": 3, "color": style["color"]},
        "hoverinfo": "name",
    }


def _aspect(cloud: Array, stood: list[list[dict[str, Any]]]) -> dict[str, float]:
    """One scale for x and y; the height, which is no length, is as high as they are wide."""
    spans = [
        np.ptp(np.concatenate([cloud[:, at], *(line[axis] for line in stood[0])]))
        for at, axis in enumerate("xy")
    ]
    longest = float(max(spans))
    return {"x": float(spans[0]) / longest, "y": float(spans[1]) / longest, "z": 0.8}


def _slider(names: list[str], stood: list[list[dict[str, Any]]], count: int) -> dict[str, Any]:
    """Move the mechanism, which is the last traces, to each stop."""
    moved = list(range(count - len(stood[0]), count))
    steps = [
        {
            "label": name,
            "method": "restyle",
            "args": [{axis: [line[axis] for line in lines] for axis in "xyz"}, moved],
        }
        for name, lines in zip(names, stood, strict=True)
    ]
    return {"steps": steps, "currentvalue": {"prefix": "mechanism at "}, "pad": {"t": 10, "b": 10}}
