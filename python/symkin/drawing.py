# SPDX-License-Identifier: MIT
"""The frames of a mechanism's file, if they are others than the mechanism's own."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import SymkinError
from symkin.frames import moved_workspace, transforms
from symkin.measurements import pose_rows
from symkin.mechanism import Mechanism
from symkin.poses import POSE_SPACES, Transform
from symkin.settings import DrawnPoints, Frames, WorkspaceSettings

__all__ = [
    "as_drawn",
    "drawn_frames",
    "drawn_workspace",
    "from_drawing",
    "own_frames",
    "own_workspace",
]

Array = NDArray[np.float64]


def _shift(centre: tuple[float, ...] | None) -> Array:
    """A centre as a translation in space."""
    moved = np.zeros(3)
    moved[: len(centre or ())] = centre or ()
    return moved


def _motions(points: DrawnPoints) -> tuple[Transform, Transform]:
    """From the mechanism's frames of base and platform to those of its file."""
    ends = (points.base, points.platform)
    base, platform = (Transform(np.eye(3), _shift(each)) for each in ends)
    return base, platform


def as_drawn(mechanism: Mechanism, poses: ArrayLike) -> Array:
    """Return poses in a mechanism's own frames as the frames of its file have them.

    Parameters
    ----------
    mechanism : Mechanism
        Whose `points` say where the frames are.
    poses : array_like, shape (N, coordinates)
        m and rad (spatial: position and quaternion).

    Returns
    -------
    ndarray, shape (N, coordinates)
    """
    return _carried(mechanism, poses, inverse=False)


def from_drawing(mechanism: Mechanism, poses: ArrayLike) -> Array:
    """Return poses in the frames of a mechanism's file in its own: `as_drawn` back.

    Parameters
    ----------
    mechanism : Mechanism
    poses : array_like, shape (N, coordinates)

    Returns
    -------
    ndarray, shape (N, coordinates)
    """
    return _carried(mechanism, poses, inverse=True)


def _carried(mechanism: Mechanism, given: ArrayLike, *, inverse: bool) -> Array:
    poses, points = pose_rows(given), mechanism.points
    if poses.ndim != 2 or poses.shape[1] != mechanism.space.coordinates:
        raise SymkinError(
            f"poses have the shape {poses.shape}; expected N rows of {mechanism.space.coordinates}"
        )
    if points is None or not points.moved:
        return poses
    base, platform = _motions(points)
    if inverse:
        base, platform = base.inverse, platform.inverse
    # The frames' axes are parallel, so that orientations stay as they are.
    size = mechanism.space.size
    if not (mechanism.space.turns and platform.translation.any()):
        shift = np.zeros(poses.shape[1])
        shift[:size] = (base.translation - platform.translation)[:size]
        return np.asarray(poses + shift)  # each coordinate by itself: some may not be known
    carried = base @ transforms(mechanism.pose_space, poses) @ platform.inverse
    made = np.array(poses, dtype=float)
    made[:, :size] = carried.translation[:, :size]
    return made


def own_workspace(
    pose_space: str, settings: WorkspaceSettings | None, points: DrawnPoints
) -> WorkspaceSettings | None:
    """Home and box of a file in the mechanism's frames; the box is the one around its image."""
    if settings is None or not points.moved:
        return settings
    base, platform = _motions(points)
    return _workspace_in(pose_space, settings, base.inverse, platform.inverse)


def drawn_workspace(mechanism: Mechanism) -> WorkspaceSettings | None:
    """Home and box as the file of a mechanism has them, or would have them."""
    points, settings = mechanism.points, mechanism.workspace
    if points is None or settings is None or not points.moved:
        return settings
    carried = _workspace_in(mechanism.pose_space, settings, *_motions(points))
    given, before = points.workspace, own_workspace(mechanism.pose_space, points.workspace, points)
    if given is None or before is None:
        return carried
    # What has not changed stays as the file has it: a box that is carried to and fro grows.
    if (before.lower, before.upper) == (settings.lower, settings.upper):
        carried = dataclasses.replace(carried, lower=given.lower, upper=given.upper)
    if before.home == settings.home:
        carried = dataclasses.replace(carried, home=given.home)
    return carried


def _workspace_in(
    pose_space: str, settings: WorkspaceSettings, base: Transform, platform: Transform
) -> WorkspaceSettings:
    if platform.translation.any() and POSE_SPACES[pose_space].turns:
        return moved_workspace(pose_space, settings, base, platform)
    size = POSE_SPACES[pose_space].size
    shift = np.zeros(len(settings.lower))
    shift[:size] = (base.translation - platform.translation)[:size]
    lower, upper, home = (
        tuple((np.array(each) + shift).tolist())
        for each in (settings.lower, settings.upper, settings.home_or_origin)
    )
    return dataclasses.replace(settings, lower=lower, upper=upper, home=home)


def own_frames(pose_space: str, frames: Frames, points: DrawnPoints) -> Frames | None:
    """What a file says of frames, for the mechanism's own; None if nothing."""
    base, platform = _motions(points)
    return _frames_in(pose_space, frames, base, platform) if points.moved else _or_none(frames)


def drawn_frames(mechanism: Mechanism) -> Frames | None:
    """The frames of a mechanism as its file has them, or would have them."""
    points = mechanism.points
    if points is None or mechanism.frames is None or not points.moved:
        return mechanism.frames
    base, platform = _motions(points)
    return _frames_in(mechanism.pose_space, mechanism.frames, base.inverse, platform.inverse)


def _frames_in(
    pose_space: str, frames: Frames, base: Transform, platform: Transform
) -> Frames | None:
    """Frames for base and platform frames that stand elsewhere, by translations, than before."""
    space = POSE_SPACES[pose_space]
    count, size = len(space.frame_components), space.size
    outer, inner = (np.array(each or (0.0,) * count) for each in (frames.base, frames.target))
    turn = np.zeros((1, 3))
    turn[0, 3 - (count - size) :] = outer[size:]
    turned = transforms("spatial", np.hstack([np.zeros((1, 3)), turn])).rotation[0]
    outer[:size] += (turned @ base.translation)[:size]
    inner[:size] -= platform.translation[:size]
    plane: tuple[float, ...] = ()
    if space.in_space:  # z = 0 if nobody says so, in these frames or in those
        c0, c1, c2 = frames.plane or (0.0, 0.0, 0.0)
        x, y, z = base.translation.tolist()
        plane = (c0 + c1 * x + c2 * y - z, c1, c2)
    points = tuple(
        tuple((np.array(each) - platform.translation[:size]).tolist()) for each in frames.points
    )
    made = Frames(
        tuple(outer.tolist()) if outer.any() else (),
        tuple(inner.tolist()) if inner.any() else (),
        points,
        frames.anchors,
        plane if any(plane) else (),
    )
    return _or_none(made)


def _or_none(frames: Frames) -> Frames | None:
    return frames if any(vars(frames).values()) else None
