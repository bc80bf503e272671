# SPDX-License-Identifier: MIT
"""A small drawing of a mechanism at a pose, without matplotlib: for pages that are drawn often."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from symkin.model.mechanism import Mechanism
from symkin.show.skeleton import arcs, skeleton_of
from symkin.show.theme import LEG_COLOURS
from symkin.values import Array

_AZIMUTH, _ELEVATION = math.radians(-65), math.radians(22)  # as figures and pages look at it
_WIDTH, _HEIGHT, _MARGIN = 360.0, 240.0, 14.0  # pixels


def sketch(mechanism: Mechanism, pose: Array) -> str:
    """Return a mechanism at a pose as an SVG element, whose classes are those of pages."""
    skeleton = skeleton_of(mechanism, pose)
    at_home = skeleton_of(mechanism, mechanism.home)
    placed = _placed(np.concatenate([_seen(each.points) for each in (at_home, skeleton)]))
    parts = [
        f'<polygon class="{body}" points="{_points(placed(_seen(corners)))}"/>'
        for body, corners in skeleton.bodies.items()
    ]
    parts += [
        f'<polyline class="rail" points="{_points(placed(_seen(way)))}"/>'
        for way in (*skeleton.rails, *skeleton.swings)
        if way is not None
    ]
    for number, (leg, joints) in enumerate(zip(skeleton.legs, skeleton.joints, strict=True), 1):
        line = arcs(leg) if skeleton.on_sphere else leg
        colour = f"var(--leg{(number - 1) % len(LEG_COLOURS) + 1})"
        parts.append(f'<g class="leg" stroke="{colour}">')
        parts.append(f'<polyline points="{_points(placed(_seen(line)))}"/>')
        for (x, y), joint in zip(placed(_seen(leg)).tolist(), joints, strict=True):
            fill = colour if joint.actuated else "var(--paper)"
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{fill}"/>')
        parts.append("</g>")
    box = f'viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}"'
    return f'<svg role="img" aria-label="The robot at this pose" {box}>{"".join(parts)}</svg>'


def _seen(points: Array) -> Array:
    """To the right and downwards on the drawing, m."""
    if points.shape[1] == 2:
        return points * [1, -1]
    x, y, z = points.T
    towards = math.cos(_AZIMUTH) * x + math.sin(_AZIMUTH) * y
    across = math.cos(_AZIMUTH) * y - math.sin(_AZIMUTH) * x
    return np.column_stack([across, math.sin(_ELEVATION) * towards - math.cos(_ELEVATION) * z])


def _placed(points: Array) -> Any:
    """What maps what is seen of points such as these into the drawing."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = np.array([_WIDTH, _HEIGHT]) - 2 * _MARGIN
    scale = float((room / np.maximum(high - low, 1e-12)).min())
    middle = np.array([_WIDTH, _HEIGHT]) / 2
    return lambda seen: middle + scale * (seen - (low + high) / 2)


def _points(places: Array) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places.tolist())
