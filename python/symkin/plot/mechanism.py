# SPDX-License-Identifier: MIT
"""A mechanism drawn at a pose."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray

from symkin.mechanism import Mechanism
from symkin.plot.mirrors import DrawnSymmetry, draw_symmetry
from symkin.plot.style import (
    INK,
    SMALL,
    equal_box,
    flat_axes,
    leg_style,
    legend_below,
    new_figure,
    spatial_axes,
)

__all__ = ["mechanism_figure"]

Array = NDArray[np.float64]

_BODIES = {"base": "#BDBDBD", "platform": "#8FB8DE"}
_SQUARE, _ROUND = "s", "o"


class Joint(NamedTuple):
    """A joint of a chain: its letter, and whether it is the actuated one."""

    kind: str
    actuated: bool


class Skeleton(NamedTuple):
    """What is drawn of a mechanism: per leg the joint centres, shape (joints, 2 or 3), m."""

    legs: tuple[Array, ...]
    joints: tuple[Joint, ...]
    chain: str

    def outline(self, end: int) -> Array:
        """Corners of the base (0) or the platform (-1) in order, fewer than 3 if it has none."""
        corners = np.unique(np.round([centres[end] for centres in self.legs], 9), axis=0)
        around = corners[:, :2] - corners[:, :2].mean(axis=0)
        ordered: Array = corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
        return ordered

    @property
    def points(self) -> Array:
        """All joint centres, one a row."""
        return np.concatenate(self.legs)


def mechanism_figure(
    mechanism: Mechanism, pose: NDArray[np.float64], symmetry: DrawnSymmetry | None = None
) -> Figure:
    """Draw a mechanism at a pose: base, platform, and the numbered legs with their joints.

    Parameters
    ----------
    mechanism : Mechanism
        Planar and point platforms are drawn in the plane, spatial ones in space and from above.
    pose : ndarray, shape (coordinates,)
        One that all legs reach, such as `Mechanism.home`.
    symmetry : DrawnSymmetry, optional
        Whose centre and mirrors are drawn too.

    Returns
    -------
    Figure
    """
    skeleton = _skeleton(mechanism, pose)
    if mechanism.pose_space != "spatial":
        figure = new_figure(5.8, 4.9)
        axes = flat_axes(figure, figure.add_gridspec(1, 1)[0], x="x, m", y="y, m")
    else:
        figure = new_figure(8.4, 4.6)
        places = figure.add_gridspec(1, 2, width_ratios=(1.25, 1))
        _draw_spatial(figure, places[0], skeleton)
        axes = flat_axes(figure, places[1], title="from above", x="x, m", y="y, m")
    _draw_flat(axes, skeleton)
    handles = _joint_handles(skeleton.joints)
    if symmetry is not None:
        handles += draw_symmetry(axes, symmetry)
    columns = 5 if symmetry is None else 3
    legend_below(figure, handles, columns=6 if mechanism.pose_space == "spatial" else columns)
    return figure


def _skeleton(mechanism: Mechanism, pose: Array) -> Skeleton:
    joints = tuple(
        Joint(bracketed or free, bool(bracketed))
        for bracketed, free in re.findall(r"\[(\w)\]|(\w)", mechanism.chain)
    )
    readings = mechanism.inverse_kinematics(pose)[0]
    legs = tuple(
        _one_centre_a_joint(mechanism.core.joint_centres(leg, pose, reading), len(joints))
        for leg, reading in enumerate(readings)
    )
    return Skeleton(legs, joints, mechanism.chain)


def _one_centre_a_joint(centres: Array, joints: int) -> Array:
    """A telescopic leg has centres at its ends only; its actuator is drawn half-way."""
    missing = joints - len(centres)
    shares = np.arange(1, missing + 1)[:, np.newaxis] / (missing + 1)
    between = centres[0] + shares * (centres[1] - centres[0])
    return np.concatenate([centres[:1], between, centres[1:]])


def _draw_flat(axes: Axes, skeleton: Skeleton) -> None:
    for end, body in ((0, "base"), (-1, "platform")):
        corners = skeleton.outline(end)[:, :2]
        if len(corners) > 2:
            axes.add_patch(Polygon(corners, closed=True, **_body_style(body)))
    for leg, centres in enumerate(skeleton.legs):
        _draw_leg(axes, skeleton, leg, centres[:, :2])
        _number_leg(axes, leg, centres[:, :2], skeleton.points[:, :2].mean(axis=0))
    axes.plot(0, 0, "+", color=INK, markersize=9, zorder=5)
    _frame(axes, np.vstack([skeleton.points[:, :2], np.zeros(2)]))


def _frame(axes: Axes, points: Array) -> None:
    """One scale for x and y, with room for the numbers beyond the base."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    margin = 0.12 * float(np.max(upper - lower))
    axes.set_xlim(lower[0] - margin, upper[0] + margin)
    axes.set_ylim(lower[1] - margin, upper[1] + margin)
    axes.set_aspect("equal", adjustable="box")


def _draw_spatial(figure: Figure, place: Any, skeleton: Skeleton) -> None:
    axes = spatial_axes(figure, place, labels=("x, m", "y, m", "z, m"))
    for end, body in ((0, "base"), (-1, "platform")):
        corners = skeleton.outline(end)
        if len(corners) > 2:
            axes.add_collection3d(Poly3DCollection([corners], **_body_style(body)))
    for leg, centres in enumerate(skeleton.legs):
        _draw_leg(axes, skeleton, leg, centres)
        base, middle = centres[0], skeleton.points.mean(axis=0)
        outwards = (base - middle) * (1, 1, 0)
        axes.text(
            *(base + 0.16 * outwards), str(leg + 1), color=leg_style(leg).colour, **_number_style()
        )
    equal_box(axes, skeleton.points)
    axes.view_init(elev=22, azim=-65)


def _draw_leg(axes: Any, skeleton: Skeleton, leg: int, centres: Array) -> None:
    colour = leg_style(leg).colour
    axes.plot(*centres.T, color=colour, linewidth=2.4, solid_capstyle="round", zorder=3)
    for joint, centre in zip(skeleton.joints, centres, strict=True):
        axes.plot(
            *([value] for value in centre),
            marker=_SQUARE if joint.kind == "P" else _ROUND,
            markersize=7.5 if joint.actuated else 6,
            markerfacecolor=colour if joint.actuated else "white",
            markeredgecolor=colour,
            markeredgewidth=1.4,
            linestyle="none",
            zorder=4,
        )


def _number_leg(axes: Axes, leg: int, centres: Array, middle: Array) -> None:
    """Write the number beyond the base joint, away from the middle."""
    outwards = centres[0] - middle
    distance = float(np.hypot(*outwards))
    x, y = (13 * outwards / distance).tolist() if distance > 0 else (0.0, -13.0)
    axes.annotate(
        str(leg + 1),
        centres[0],
        xytext=(x, y),
        textcoords="offset points",
        color=leg_style(leg).colour,
        **_number_style(),
    )


def _number_style() -> dict[str, Any]:
    return {"fontsize": SMALL + 3, "fontweight": "bold", "ha": "center", "va": "center"}


def _body_style(body: str) -> dict[str, Any]:
    colour = _BODIES[body]
    return {"facecolor": colour + "40", "edgecolor": colour, "linewidth": 1, "zorder": 1}


def _joint_handles(joints: tuple[Joint, ...]) -> list[Any]:
    """Legend entries of the joints that occur, and of the bodies."""
    names = {"R": "revolute", "P": "prismatic", "U": "universal", "S": "spherical"}
    handles: list[Any] = []
    for joint in dict.fromkeys(joints):
        state = "actuated" if joint.actuated else "passive"
        handles.append(
            Line2D(
                [],
                [],
                linestyle="none",
                marker=_SQUARE if joint.kind == "P" else _ROUND,
                markersize=7.5 if joint.actuated else 6,
                markerfacecolor=INK if joint.actuated else "white",
                markeredgecolor=INK,
                label=f"{state} {names.get(joint.kind, joint.kind)} joint",
            )
        )
    bodies = [Polygon(np.zeros((1, 2)), label=body, **_body_style(body)) for body in _BODIES]
    origin = Line2D([], [], color=INK, marker="+", linestyle="none", markersize=9, label="origin")
    return [*handles, origin, *bodies]
