# SPDX-License-Identifier: MIT
"""Bodies with a joint to their parent, and what closes the loops again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.poses import Transform, rotations_from_quaternions, rotations_from_vectors

__all__ = ["Body", "Closure", "Joint", "Structure"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """One degree of freedom between a body and its parent.

    Attributes
    ----------
    name : str
        Such as ``leg1_active``, which the sensor reads: value = gain * reading.
    kind : {"hinge", "slide", "free"}
        A free one has all six, and no axis.
    axis : ndarray, shape (3,)
        In the body's own frame.
    """

    name: str
    kind: str
    axis: Array


@dataclass(frozen=True)
class Body:
    """A body; its joints come one after the other, each in the frame that the last one left.

    Attributes
    ----------
    name, parent : str
        The parent "" is the base.
    position, rotation : ndarray, shapes (3,) and (3, 3)
        In the parent's frame, while all joints are at zero.
    joints : tuple of Joint
        From the parent outwards.
    tip : ndarray, shape (3,)
        The end of the link that is drawn, in the body's frame.
    """

    name: str
    parent: str
    position: Array
    rotation: Array
    joints: tuple[Joint, ...]
    tip: Array


@dataclass(frozen=True)
class Closure:
    """The end of a leg, which is held at a point of the platform by a joint that turns any way."""

    name: str
    body: str
    point: Array
    platform_point: Array


@dataclass(frozen=True)
class Structure:
    """Bodies, parents first, and what closes the loops.

    Attributes
    ----------
    bodies : tuple of Body
        Those of each leg, then the platform.
    closures : tuple of Closure
        One for each leg.
    values : mapping of str to ndarray, shape (N,) or (N, 7)
        Of every joint at the poses that were asked for, m and rad; of a free joint the position
        and the quaternion, scalar first.
    home : mapping of str to ndarray
        The same at home.
    size : float
        Largest distance of a base point from the platform's origin at home, m.
    """

    bodies: tuple[Body, ...]
    closures: tuple[Closure, ...]
    values: Mapping[str, Array]
    home: Mapping[str, Array]
    size: float

    @property
    def joints(self) -> Iterator[Joint]:
        """Every joint, in the order of the bodies."""
        return (joint for body in self.bodies for joint in body.joints)

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
