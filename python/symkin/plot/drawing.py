# SPDX-License-Identifier: MIT
"""A mechanism drawn at a pose, with the centre and the mirrors of its symmetry."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import ArrayLike, NDArray

from symkin.mechanism import Mechanism
from symkin.plot.style import (
    ACCENT,
    BEFORE,
    INK,
    PAPER,
    SMALL,
    dressed,
    equal_box,
    flat_axes,
    leg_style,
    legend_below,
    legend_beside,
    new_figure,
    sign,
    spatial_axes,
)
from symkin.skeleton import Joint, Skeleton, arcs, skeleton_of
from symkin.symmetry.groups import SymmetryGroup

Array = NDArray[np.float64]

_BODIES = {"base": "#BDBDBD", "platform": "#8FB8DE"}
_JOINTS = {"R": "revolute", "P": "prismatic", "U": "universal", "S": "spherical"}


@dataclass(frozen=True)
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
    labels = ("x", "y", "z") if skeleton.on_sphere else ("x, m", "y, m", "z, m")
    if ax is not None:
        x, y, _ = labels
        handles += _draw(dressed(ax, x=x, y=y), skeleton, symmetry)
        legend_beside(ax, handles)
        return ax
    spatial = mechanism.space.in_space
    figure = new_figure(8.4 if spatial else 4.6, 4.6)
    places = figure.add_gridspec(1, 1 + spatial, width_ratios=(1.25, 1) if spatial else None)
    if spatial:
        _draw(spatial_axes(figure, places[0], labels=labels), skeleton, None)
    title = "from above" if spatial else ""
    axes = flat_axes(figure, places[-1], title=title, x=labels[0], y=labels[1])
    handles += _draw(axes, skeleton, symmetry)
    legend_below(figure, handles, columns=6 if spatial else 3 if symmetry is None else 2)
    return axes


def _draw(axes: Any, skeleton: Skeleton, symmetry: DrawnSymmetry | None) -> list[Line2D]:
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
    return [] if symmetry is None else _draw_symmetry(axes, symmetry)


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
    axes.plot(*links[:, shown].T, color=colour, linewidth=2.4, solid_capstyle="round", zorder=3)
    for joint, centre in zip(skeleton.joints[leg], centres[:, shown], strict=True):
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
    style = {
        "color": leg_style(leg).colour,
        "ha": "center",
        "va": "center",
        "fontsize": SMALL + 2,
        "fontweight": "bold",
    }
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


def _draw_symmetry(axes: Axes, symmetry: DrawnSymmetry) -> list[Line2D]:
    """Draw the centre of the rotations and the lines of the reflections, seen from above."""
    group = symmetry.group
    centre = np.asarray(group.frame.base_centre, dtype=float)
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
