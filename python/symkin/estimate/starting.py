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
from symkin.model.core_setup import of_core, setup_with, to_core
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    Transform,
    between,
    cross_matrices,
    nearest_rotation,
    poses_of,
    stepped,
    tangents_of,
    transforms,
)
from symkin.model.settings import Frames, NoiseSettings
from symkin.values import Array

_PARTS = 4  # of the way from a start,
_MORE = 8  # and steps at its end, at most
_OPEN = 1e-6  # of the largest singular value: a direction that a row leaves open
_STILL = 1e-6  # of the characteristic length: a step that ends it
_NEAR = 0.05  # of the characteristic length: what a drawing may be off by


def starting_poses(
    mechanism: Mechanism,
    setup: _core.Setup,
    measurements: Measurements,
    observations: _core.Observations,
) -> Array:
    """Where latent poses start, shape (N, coordinates); NaN where nothing says.

    What was reported or measured in full, else forward kinematics, else what points say, else where
    the robot was sent, else, if no row has a start, continuation from home by what was observed.
    The observations are those of the measurements.
    """
    poses = _core.starting_poses(mechanism.straight, setup, observations, mechanism.home)
    for more in (_by_points, _by_command, _by_steps):
        open_ = np.flatnonzero(~whole(poses))
        if more is _by_steps and len(open_) < len(poses):
            break  # neighbours do better, once the others are known
        if len(open_):
            poses[open_] = more(mechanism, setup, measurements.subset(open_))
    return poses


def _by_points(mechanism: Mechanism, setup: _core.Setup, measurements: Measurements) -> Array:
    """Poses of the platform by points that were seen together."""
    poses = np.full_like(measurements.poses, np.nan)
    if measurements.points is None:
        return poses
    seen = motions_of(in_three(measurements.points), setup.points, mechanism.space)
    known = whole(seen.translation)
    base = of_core(setup.base).inverse
    inside = base @ Transform(seen.rotation[known], seen.translation[known])
    poses[known] = poses_of(mechanism.pose_space, inside)
    return poses


def _by_command(mechanism: Mechanism, setup: _core.Setup, measurements: Measurements) -> Array:
    """Where the robot was sent, brought by steps to what was observed there."""
    commanded = measurements.commanded
    if commanded is None:
        return np.full_like(measurements.poses, np.nan)
    return _followed(mechanism, setup, measurements, commanded)


def _by_steps(mechanism: Mechanism, setup: _core.Setup, measurements: Measurements) -> Array:
    """From home, by steps to what was observed: of what it leaves open the nearest."""
    home = np.repeat(np.atleast_2d(mechanism.home), len(measurements), axis=0)
    return _followed(mechanism, setup, measurements, home)


def _followed(
    mechanism: Mechanism, setup: _core.Setup, measurements: Measurements, starts: Array
) -> Array:
    """Poses that readings and measured coordinates ask for, by continuation from others.

    Of the closures of the legs that were read and of what was measured of poses, the shortest steps
    of least squares, while both go from what they are at the start to what was observed. NaN for a
    row that does not come near, which is followed until a step does not halve what is left.
    """
    space = mechanism.space
    known = whole(starts)
    poses = np.where(known[:, None], starts, np.atleast_2d(mechanism.home))
    there = transforms(space.name, np.where(np.isnan(measurements.poses), 0.5, measurements.poses))
    at = transforms(space.name, poses)
    first, _ = _misfits(mechanism, setup, measurements, poses, at, there)
    length = mechanism.characteristic_length
    scale = np.repeat([1.0, length], [space.size, len(space.rotation)])
    off = np.full(len(poses), np.inf)
    for step in (*range(1, _PARTS + 1), *(_PARTS,) * _MORE):
        left, by_pose = _misfits(mechanism, setup, measurements, poses, at, there)
        wanted = left - (1 - step / _PARTS) * first
        usable = np.isfinite(wanted).all(axis=1) & np.isfinite(by_pose).all(axis=(1, 2))
        known = known & usable
        if step == _PARTS:
            before, off = off, np.abs(left).max(axis=1)
            known &= (off < _NEAR * length) | (off < before / 2)
        if not known.any():
            break
        inverse = np.linalg.pinv(np.where(known[:, None, None], by_pose / scale, 0.0), _OPEN)
        moves = -np.einsum("nij,nj->ni", inverse, np.where(known[:, None], wanted, 0.0)) / scale
        if step == _PARTS and np.abs(moves * scale).max() < _STILL * length:
            break
        at = stepped(at, tangents_of(space, moves))
        poses = poses_of(space.name, at)
    left, _ = _misfits(mechanism, setup, measurements, poses, at, there)
    reached = np.abs(left).max(axis=1) < _NEAR * length
    return np.where((known & reached)[:, None], poses, np.nan)


def _misfits(
    mechanism: Mechanism,
    setup: _core.Setup,
    measurements: Measurements,
    poses: Array,
    platform: Transform,
    measured: Transform,
) -> tuple[Array, Array]:
    """What closures and measured coordinates are off by, (N, r), and by the pose's tangent.

    The poses are where the platform is; those as measured have something in place of what was not.
    Orientations count at the characteristic length; what was not observed is zero.
    """
    space, length = mechanism.space, mechanism.characteristic_length
    misfits, rows = [], []
    readings = mechanism.straightened(measurements.readings)
    for leg in range(len(mechanism.legs)):
        read = np.isfinite(readings[:, leg])
        psi = np.ascontiguousarray(np.where(read, readings[:, leg], 0.0))
        made = _core.linearise(mechanism.straight, leg, np.ascontiguousarray(poses), psi)
        closures = np.asarray(made.closure).reshape(len(poses), -1)
        by_pose = np.asarray(made.by_pose).reshape(len(poses), closures.shape[1], -1)
        misfits.append(np.where(read[:, None], closures, 0.0))
        rows.append(np.where(read[:, None, None], by_pose, 0.0))
    base, target = of_core(setup.base), of_core(setup.target)
    seen = base @ platform @ target
    off = between(measured, seen)
    arms = np.einsum("nij,j->ni", platform.rotation, target.translation)
    by_tangent = np.zeros((len(poses), 6, 6))
    by_tangent[:, :3, :3] = by_tangent[:, 3:, 3:] = base.rotation
    by_tangent[:, :3, 3:] = -base.rotation @ cross_matrices(arms)
    known = np.zeros((len(poses), 6), dtype=bool)
    size = space.size
    known[:, :size] = np.isfinite(measurements.poses[:, :size])
    if space.turns:
        turned = whole(measurements.poses[:, size:])
        known[:, space.components[size:]] = turned[:, None]
    weights = known * np.repeat([1.0, length], 3)
    misfits.append(np.where(known, off, 0.0) * weights)
    rows.append(by_tangent[:, :, space.components] * weights[:, :, None])
    return np.concatenate(misfits, axis=1), np.concatenate(rows, axis=1)


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

    `base` and `target` say which frames are unknown, of which the target's place is not looked for,
    `free`, shape (n,), whose places; those that are given somewhere count as known to begin with.
    Raises `NotIdentifiableError` if no row with a point has a pose that the readings or the
    controller tell.
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
        base=of_core(setup.base),
        base_free=base,
        turned=turned,
    )
    if found is None:
        unread = np.flatnonzero(~np.isfinite(measurements.readings).any(axis=0))
        why = f" ({mechanism.named_legs(unread)}: not read at all)" if len(unread) else ""
        raise NotIdentifiableError(
            f"no row with a measured point has readings that the nominal robot can take{why}, so "
            "that nothing says where the points and the device are; read all legs at some of "
            "them, or give points and base in the [frames] of the mechanism's file"
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
    return setup_with(
        setup,
        mechanism.straight,
        base=to_core(found.base),
        target=None if turn is None else _core.Frame(setup.target.position, turn),
        points=found.places,
    )
