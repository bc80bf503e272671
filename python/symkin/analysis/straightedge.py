# SPDX-License-Identifier: MIT
"""Offsets from a straightedge: positions of which the coordinate along a line was not measured.

The edge is the x axis of the measuring device's frame, and where that is nobody knows. Along the
edge it may be moved, which no offset shows, and turned about it, which small ones hardly do.
"""

from __future__ import annotations

import numpy as np

from symkin.data.measurements import Measurements
from symkin.errors import NotIdentifiableError
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    Transform,
    frame,
    rotations_from_vectors,
    transforms,
)
from symkin.model.settings import Frames
from symkin.values import Array


def edge_of(mechanism: Mechanism, measurements: Measurements) -> Transform:
    """The base in the frame of the edge, as the robot's poses at the readings have it.

    Its x axis is the line nearest to the poses. Which way that points, where on it x is zero, and
    how the frame is turned about it, is as drawn.

    Raises
    ------
    NotIdentifiableError
        For poses of which too few can be computed from the readings.
    """
    space, frames = measurements.space, mechanism.frames or Frames()
    taken = mechanism.replace(frames=None).forward_kinematics(measurements.readings)[0]
    kept = np.isfinite(taken).all(axis=1)
    kept &= np.isfinite(measurements.poses[:, 1 : space.size]).all(axis=1)
    if kept.sum() < space.size:
        raise NotIdentifiableError(
            f"where the edge is needs at least {space.size} offsets at poses that can be computed "
            f"from the readings; there are {kept.sum()}"
        )
    robot = transforms(measurements.pose_space, taken[kept])
    places = (robot @ frame(measurements.pose_space, frames.target)).translation
    offsets = np.zeros((len(places), 3))
    offsets[:, 1 : space.size] = measurements.poses[kept, 1 : space.size]
    middle, shift = places.mean(axis=0), offsets.mean(axis=0)
    drawn = frame(measurements.pose_space, frames.base)
    rotation = _turned(drawn.rotation, np.linalg.svd(places - middle)[2][0])
    position = shift - rotation @ middle
    position[0] = drawn.translation[0]
    return Transform(rotation, position)


def _turned(rotation: Array, axis: Array) -> Array:
    """The nearest rotation to another one that has this axis, either way, for x."""
    before = rotation[0]
    axis = axis if axis @ before >= 0 else -axis
    across = np.cross(axis, before)
    sine = float(np.linalg.norm(across))
    angle = np.arctan2(sine, axis @ before)
    turn = across * (angle / sine if sine > 0 else 1.0)
    return np.asarray(rotation @ rotations_from_vectors(turn[None])[0])


def on_the_edge(mechanism: Mechanism, poses: Array) -> Array:
    """Poses of the platform moved straight to the edge that the frames have drawn."""
    space, frames = mechanism.space, mechanism.frames or Frames()
    base, target = (frame(mechanism.pose_space, each) for each in (frames.base, frames.target))
    seen = base @ (transforms(mechanism.pose_space, poses) @ target)
    away = seen.translation.copy()
    away[:, 0] = 0.0
    moved = np.array(poses)
    moved[:, : space.size] -= (away @ base.rotation)[:, : space.size]
    return moved
