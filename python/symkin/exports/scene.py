# SPDX-License-Identifier: MIT
"""A model for simulators as it is read: bodies, their joints, and closed loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symkin.errors import SymkinError
from symkin.model.poses import rotations_from_quaternions
from symkin.values import Array, record

WORLD = ""


@record
class Moving:
    """A joint: of its body's frame, in which the axis and the point that it turns about are."""

    name: str
    kind: str  # "hinge", "slide", "ball" or "free"
    axis: Array
    anchor: Array


@record
class Part:
    """A body: where it stands in its parent while its joints are at zero."""

    parent: str
    frame: Array  # 4 x 4
    joints: tuple[Moving, ...]


@record
class Loop:
    """What closes a loop: points of two bodies that meet, or frames that agree."""

    name: str
    body: str
    frame: Array
    other: str
    other_frame: Array
    turns: bool  # whether the frames may turn against each other


@record
class Scene:
    """A model as it is read."""

    name: str
    parts: Mapping[str, Part]
    loops: Sequence[Loop]
    followers: Mapping[str, tuple[str, float, float]]  # of a joint: what it follows, ratio, offset
    home: Mapping[str, Array]  # of joints: values, one or, of a free one, seven
    sensors: Mapping[str, tuple[float, float]]  # of joints that are read: gain, offset
    known: Mapping[str, Any]  # what symkin said of it

    def joints_to(self, body: str) -> list[tuple[str, Moving]]:
        """Bodies and joints from the base to a body."""
        found: list[tuple[str, Moving]] = []
        for name in self.line(body):
            found += [(name, joint) for joint in self.parts[name].joints]
        return found

    def line(self, body: str) -> list[str]:
        """The bodies from the base to one."""
        names: list[str] = []
        while body != WORLD:
            if body not in self.parts or body in names:
                raise SymkinError(f'has no way from the base to body "{body}"')
            names.insert(0, body)
            body = self.parts[body].parent
        return names


def frame_of(position: Array, rotation: Array) -> Array:
    """A 4 x 4 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def of_quaternion(wxyz: Array) -> Array:
    """The matrix of a quaternion, real part first."""
    unit = wxyz / np.linalg.norm(wxyz)
    return np.asarray(rotations_from_quaternions(unit[None, [1, 2, 3, 0]])[0])
