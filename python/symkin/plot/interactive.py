# SPDX-License-Identifier: MIT
"""Workspace and chosen poses in three dimensions, to be turned by hand; needs plotly."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import MeasurementError, MechanismError
from symkin.io.columns import pose_column_names
from symkin.measurements import pose_rows
from symkin.mechanism import Mechanism
from symkin.planning import Plan
from symkin.plot.style import BEFORE, COLOUR_MAP, INK, Array, leg_style, thinned
from symkin.poses import space_named
from symkin.report.wording import setting
from symkin.skeleton import Skeleton, skeleton_of
from symkin.workspace import WorkspaceSample, sample_workspace

_CLOUD = 3000  # poses drawn of the workspace
_STEPS = 150  # poses that the slider offers
_SYMBOLS = ("circle", "square", "diamond", "cross", "x")
_BODIES = {"base": BEFORE, "platform": INK}


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
    return cloud[thinned(len(cloud), _CLOUD)]


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
        traces.append(_line(closed, height, body, {"color": _BODIES[body], "width": 4}, "lines"))
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
