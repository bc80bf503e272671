# SPDX-License-Identifier: MIT
"""Bodies, the joints that move them, and what closes the loops of a model for simulators."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from symkin.model.poses import Transform, rotations_from_quaternions, rotations_from_vectors
from symkin.values import Array, record

_X, _Y, _Z = np.eye(3)


@record
class Joint:
    """One degree of freedom between a body and its parent; a free one has all six, and no axis."""

    name: str  # such as leg1_active, which the sensor reads: value = gain * reading
    kind: Literal["hinge", "slide", "free"]
    axis: Array  # in the body's own frame


@record
class Body:
    """A body; its joints come one after the other, each in the frame that the last one left."""

    name: str
    parent: str  # "" is the base
    position: Array  # in the parent's frame, while all joints are at zero
    rotation: Array
    joints: tuple[Joint, ...]  # from the parent outwards
    tip: Array  # the end of the link that is drawn, in the body's frame

    @property
    def links(self) -> list[tuple[str, Joint]]:
        """Names of a row of links, each with the joint that moves it; the last is the body."""
        rows = [f"{self.name}_{number}" for number in range(1, len(self.joints))]
        return list(zip([*rows, self.name], self.joints, strict=True))


@record
class Closure:
    """The end of a leg, which is held at a point of the platform by a joint that turns any way.

    Of declared legs also at another body, or not turning at all: then the frames there agree.
    """

    name: str
    body: str
    point: Array
    platform_point: Array
    other: str = "platform"
    turning: Array | None = None  # of the end's frame in its body, where nothing may turn
    other_turning: Array | None = None


@record
class Coupling:
    """A joint that follows another: its value is ratio times that of the other, plus an offset."""

    joint: str
    followed: str
    ratio: float
    offset: float


@record
class Structure:
    """Bodies, parents first, and what closes the loops."""

    bodies: tuple[Body, ...]  # those of each leg, then the platform; of declared legs it is first
    closures: tuple[Closure, ...]  # one for each leg
    # Of every joint at the poses that were asked for, m and rad, shape (N,); of a free joint
    # position and quaternion, scalar first, shape (N, 7).
    values: Mapping[str, Array]
    home: Mapping[str, Array]  # the same at home
    size: float  # largest distance of a base point from the platform's origin at home, m
    couplings: tuple[Coupling, ...] = ()

    def frames(self, values: Mapping[str, Array]) -> dict[str, list[Transform]]:
        """Frames of each body in the base's, with the given joint values: after each joint."""
        placed: dict[str, list[Transform]] = {"": [Transform(np.eye(3), np.zeros(3))]}
        for body in self.bodies:
            frame = placed[body.parent][-1] @ Transform(body.rotation, body.position)
            steps = placed[body.name] = []
            for joint in body.joints:
                frame = frame @ _motion(joint, values[joint.name])
                steps.append(frame)
        del placed[""]
        return placed


def _motion(joint: Joint, value: Array) -> Transform:
    """What a joint does in its body's frame."""
    if joint.kind == "free":
        return Transform(rotations_from_quaternions(value[None, [4, 5, 6, 3]])[0], value[:3])
    if joint.kind == "slide":
        return Transform(np.eye(3), value * joint.axis)
    return Transform(rotations_from_vectors((value * joint.axis)[None])[0], np.zeros(3))


def universal(
    name: str, what: str, parent: str, place: Array, length: float, links: Array
) -> tuple[Body, dict[str, Array]]:
    """A link along z on a universal joint that is at zero at home, and its two angles.

    `links` are its directions in the parent's frame. The angle about x, then y, of a direction
    (x, y, z) in the frame at home: x is the sine of the second, (-y, z) has the first.
    """
    directions = links / np.linalg.norm(links, axis=1, keepdims=True)
    frame = _with_z(directions[0])
    x, y, z = (directions @ frame).T
    names = f"{name}_passive_x", f"{name}_passive_y"
    joints = Joint(names[0], "hinge", _X), Joint(names[1], "hinge", _Y)
    body = Body(f"{name}_{what}", parent, place, frame, joints, length * _Z)
    return body, {names[0]: np.arctan2(-y, z), names[1]: np.arctan2(x, np.hypot(y, z))}


def _with_z(direction: Array) -> Array:
    """A rotation whose third column is a unit vector."""
    across = _X if abs(direction[0]) < 0.7 else _Y
    first = np.cross(across, direction)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(direction, first), direction])
