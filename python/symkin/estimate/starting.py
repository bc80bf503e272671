# SPDX-License-Identifier: MIT
"""Where a joint estimate starts where points were observed: frames, places, latent poses."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.reflectors import PlacedPoints, in_three, motions_of, place_points, whole
from symkin.data.measurements import Measurements
from symkin.errors import NotIdentifiableError
from symkin.model.mechanism import Mechanism
from symkin.model.poses import Transform, nearest_rotation, poses_of, transforms
from symkin.model.settings import Frames, NoiseSettings

__all__ = ["setup_by_points", "starting_poses"]

Array = NDArray[np.float64]


def starting_poses(
    mechanism: Mechanism, setup: _core.Setup, measurements: Measurements, noise: NoiseSettings
) -> Array:
    """Where latent poses start, shape (N, coordinates); NaN where nothing says.

    What was reported or measured in full, else forward kinematics, else what points say.
    """
    poses = _core.starting_poses(
        mechanism.straight, setup, measurements.observations(noise), mechanism.home
    )
    open_ = ~whole(poses)
    if measurements.points is None or not open_.any():
        return poses
    seen = motions_of(in_three(measurements.points[open_]), setup.points, mechanism.space)
    known = whole(seen.translation)
    base = Transform(setup.base.rotation, setup.base.position).inverse
    inside = base @ Transform(seen.rotation[known], seen.translation[known])
    poses[np.flatnonzero(open_)[known]] = poses_of(mechanism.pose_space, inside)
    return poses


def setup_by_points(
    mechanism: Mechanism,
    setup: _core.Setup,
    measurements: Measurements,
    noise: NoiseSettings,
    *,
    base: bool,
    target: bool,
    free: NDArray[np.bool_],
) -> _core.Setup:
    """The setup with the device's frame and the places of points where the nominal robot has them.

    Parameters
    ----------
    mechanism : Mechanism
        With straight sensors.
    setup : Setup
        Where it starts without points.
    measurements, noise
        With points in some rows.
    base, target : bool
        Whether these frames are unknown. The target's place is not looked for.
    free : ndarray of bool, shape (n,)
        Whose places are unknown; those that are given somewhere count as known to begin with.

    Raises
    ------
    NotIdentifiableError
        If no row with a point has a pose that the readings or the controller tell.
    """
    assert measurements.points is not None
    frames = mechanism.frames or Frames()
    size, space = mechanism.space.size, mechanism.pose_space
    blank = np.full_like(measurements.poses, np.nan)
    alone = dataclasses.replace(measurements, poses=blank, pose_deviations=None)
    robot = _core.starting_poses(
        mechanism.straight, setup, alone.observations(noise), mechanism.home
    )
    given = np.array(setup.points)
    stated = np.array([bool(len(each)) for each in frames.points])
    given[free & ~stated] = np.nan
    turned = None
    if target and mechanism.space.turns:
        filled = np.where(np.isnan(measurements.poses), 0.0, measurements.poses)
        turned = transforms(space, filled).rotation
        turned[np.isnan(measurements.poses[:, size:]).any(axis=1)] = np.nan
        turned = turned if np.isfinite(turned).any() else None
    found = place_points(
        _motions(space, robot),
        in_three(measurements.points),
        given,
        mechanism.space,
        base=Transform(setup.base.rotation, setup.base.position),
        base_free=base,
        turned=turned,
    )
    if found is None:
        raise NotIdentifiableError(
            "no row with a measured point has readings that the nominal robot can take, so that "
            "nothing says where the points and the device are; read all legs at some of them, or "
            "give points and base in the [frames] of the mechanism's file"
        )
    return _placed(mechanism, setup, found, _target_of(space, robot, found, turned))


def _motions(space: str, poses: Array) -> Transform:
    known = whole(poses)
    found = transforms(space, np.where(known[:, None], poses, 0.5))  # any pose instead
    found.rotation[~known], found.translation[~known] = np.nan, np.nan
    return found


def _target_of(space: str, robot: Array, found: PlacedPoints, turned: Array | None) -> Array | None:
    """The rotation of what the orientations that were measured are of."""
    if turned is None:
        return None
    own = found.base.rotation @ _motions(space, robot).rotation
    turns = np.swapaxes(own, 1, 2) @ turned
    known = whole(turns.reshape(-1, 9))
    return nearest_rotation(turns[known].mean(axis=0)) if known.any() else None


def _placed(
    mechanism: Mechanism, setup: _core.Setup, found: PlacedPoints, turn: Array | None
) -> _core.Setup:
    target = setup.target if turn is None else _core.Frame(setup.target.position, turn)
    return _core.Setup(
        mechanism.straight,
        np.array(setup.curvature),
        _core.Frame(found.base.translation, found.base.rotation),
        target,
        found.places,
        np.array(setup.anchors),
        np.array(setup.plane),
    )
