# SPDX-License-Identifier: MIT
"""Poses in the frames of the device and of the robot."""

from __future__ import annotations

from symkin.model.mechanism import Mechanism
from symkin.model.poses import frame, poses_of, transforms
from symkin.values import Array


def unframed(mechanism: Mechanism, poses: Array) -> Array:
    """Poses of the target in the device's frame as poses of the platform in the base's."""
    return _through_frames(mechanism, poses, inverse=True)


def framed(mechanism: Mechanism, poses: Array) -> Array:
    """Poses of the platform in the base's frame as those of the target in the device's."""
    return _through_frames(mechanism, poses, inverse=False)


def _through_frames(mechanism: Mechanism, poses: Array, *, inverse: bool) -> Array:
    frames = mechanism.frames
    if frames is None or not (frames.base or frames.target):
        return poses
    space = mechanism.pose_space
    ends = [frame(space, values) for values in (frames.base, frames.target)]
    base, target = [each.inverse for each in ends] if inverse else ends
    found = poses_of(space, base @ transforms(space, poses) @ target)
    if space == "planar":
        found[:, 2] = poses[:, 2] + base.turn + target.turn  # on the branch that was given
    return found
