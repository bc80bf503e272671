# SPDX-License-Identifier: MIT
"""Poses and rotations as vectors, matrices and quaternions, rigid motions, and frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import MeasurementError, one_of, shown
from symkin.values import Array

__all__ = [
    "POSE_SPACES",
    "PoseSpace",
    "Transform",
    "cross_matrices",
    "pose_rows",
    "poses_from_bounds",
    "quaternions_from_rotation_vectors",
    "rotations_from_quaternions",
    "rotations_from_vectors",
    "space_named",
    "vectors_from_quaternions",
    "vectors_from_rotations",
    "wrong_quaternion",
]


# What can be in error of a pose, with the units.
POSE_ERRORS = (("position", "m"), ("orientation", "rad"))


class PoseSpace(NamedTuple):
    """What the poses of a kind of platform are made of.

    Attributes
    ----------
    name : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        As `Mechanism.pose_space` says it.
    position : tuple of str
        Coordinates of the position, m.
    rotation : tuple of str
        Coordinates of the orientation in bounds, errors and derivatives, rad.
    orientation : tuple of str
        Columns of the orientation in a pose array.
    """

    name: str
    position: tuple[str, ...]
    rotation: tuple[str, ...] = ()
    orientation: tuple[str, ...] = ()

    @property
    def units(self) -> dict[str, str]:
        """The coordinates of bounds, position then orientation, with their units."""
        return dict.fromkeys(self.position, "m") | dict.fromkeys(self.rotation, "rad")

    @property
    def dof(self) -> int:
        """Degrees of freedom."""
        return len(self.position) + len(self.rotation)

    @property
    def coordinates(self) -> int:
        """Columns of a pose array."""
        return len(self.position) + len(self.orientation)

    @property
    def size(self) -> int:
        """How many of the columns are the position: 2 in the plane, 3 in space, or none."""
        return len(self.position)

    @property
    def moves(self) -> bool:
        """Whether the platform does, or only turns."""
        return bool(self.position)

    @property
    def closure_unit(self) -> str:
        """Unit of a leg's closure and of the margin to the end of its reach: "m" or "rad"."""
        return "m" if self.moves else "rad"

    @property
    def errors(self) -> list[tuple[str, str]]:
        """What can be in error of a pose, "position" and "orientation", with the units."""
        has = (self.moves, self.turns)
        return [each for each, there in zip(POSE_ERRORS, has, strict=True) if there]

    @property
    def turns(self) -> bool:
        """Whether the platform does."""
        return bool(self.rotation)

    @property
    def in_space(self) -> bool:
        """Whether it leaves the plane."""
        return self.size != 2

    @property
    def has_quaternion(self) -> bool:
        """Whether the last four columns are a unit quaternion."""
        return len(self.orientation) == 4

    @property
    def has_angle(self) -> bool:
        """Whether the last column is an angle about z."""
        return len(self.orientation) == 1

    @property
    def components(self) -> list[int]:
        """Which components of a tangent in space (translation, rotation vector) poses have."""
        rotation = {1: [5], 3: [3, 4, 5]}.get(len(self.rotation), [])
        return [*range(self.size), *rotation]

    @property
    def frame_components(self) -> list[int]:
        """Which of them the motion of a frame has: it turns where the platform does not."""
        if not self.moves:
            return self.components
        return list(range(6)) if self.in_space else [0, 1, 5]


_PLANE, _SPACE = ("x", "y"), ("x", "y", "z")
_VECTOR, _QUATERNION = ("rx", "ry", "rz"), ("qx", "qy", "qz", "qw")
POSE_SPACES = {
    each.name: each
    for each in (
        PoseSpace("planar", _PLANE, ("phi",), ("phi",)),
        PoseSpace("point", _PLANE),
        PoseSpace("spatial", _SPACE, _VECTOR, _QUATERNION),
        PoseSpace("translating", _SPACE),
        PoseSpace("spherical", (), _VECTOR, _QUATERNION),
        PoseSpace("schoenflies", _SPACE, ("theta",), ("theta",)),
    )
}


class Transform(NamedTuple):
    """Rigid motions: each point turned, then moved.

    Attributes
    ----------
    rotation : ndarray, shape (..., 3, 3)
        Rotation matrices.
    translation : ndarray, shape (..., 3)
        m.
    """

    rotation: Array
    translation: Array

    def __matmul__(self, other: Transform) -> Transform:
        """First the other, then this one."""
        moved = np.einsum("...ij,...j->...i", self.rotation, other.translation)
        return Transform(self.rotation @ other.rotation, moved + self.translation)

    @property
    def inverse(self) -> Transform:
        """The motion back, of a single one."""
        return Transform(self.rotation.T, -self.rotation.T @ self.translation)

    @property
    def tangent(self) -> Array:
        """Translations (m) and rotation vectors (rad), shape (..., 6)."""
        turns = vectors_from_rotations(self.rotation.reshape(-1, 3, 3))
        return np.concatenate([self.translation, turns.reshape(self.translation.shape)], axis=-1)

    @property
    def turn(self) -> Array:
        """Angles about z, rad, of the turns about z that are nearest to the rotations."""
        r = self.rotation
        return np.asarray(np.arctan2(r[..., 1, 0] - r[..., 0, 1], r[..., 0, 0] + r[..., 1, 1]))


STAYS = Transform(np.eye(3), np.zeros(3))  # no motion


def space_named(name: str, coordinates: int) -> PoseSpace:
    """Return the kind of poses with so many coordinates; without a name the first that has them.

    Raises
    ------
    MeasurementError
        If there is none.
    """
    if name:
        space: PoseSpace = one_of("pose_space", name, POSE_SPACES)
        if coordinates != space.coordinates:
            raise MeasurementError(
                f"poses of {coordinates} coordinates; a {name} pose has {space.coordinates}"
            )
        return space
    for space in POSE_SPACES.values():
        if space.coordinates == coordinates:
            return space
    raise MeasurementError(f"poses of {coordinates} coordinates; expected 2, 3, 4 or 7")


def cross_matrices(vectors: Array) -> Array:
    """Matrices of the vector product from the left, shape (N, 3, 3)."""
    vectors = _shaped("vectors", vectors, 3)
    crossed = np.zeros((len(vectors), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        crossed[:, k, j], crossed[:, j, k] = vectors[:, i], -vectors[:, i]
    return crossed


def rotations_from_vectors(vectors: Array) -> Array:
    """Rotation matrices (N, 3, 3) of rotation vectors (N, 3), rad."""
    vectors = _shaped("rotation vectors", vectors, 3)
    angles = np.linalg.norm(vectors, axis=1)[:, None, None]
    crossed = cross_matrices(vectors)
    # np.sinc(x) is sin(pi x) / (pi x): finite at zero rotation.
    once, twice = np.sinc(angles / np.pi), np.sinc(angles / (2 * np.pi)) ** 2 / 2
    return np.asarray(np.eye(3) + once * crossed + twice * crossed @ crossed)


def vectors_from_rotations(rotations: Array) -> Array:
    """Rotation vectors (N, 3), rad, of rotation matrices (N, 3, 3)."""
    rotations = _shaped("rotation matrices", rotations, 3, 3)
    skew = np.stack(
        [rotations[:, k, j] - rotations[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))], axis=1
    )
    sines = np.linalg.norm(skew, axis=1) / 2
    cosines = (np.trace(rotations, axis1=1, axis2=2) - 1) / 2
    angles = np.arctan2(sines, cosines)
    # sin(angle) / angle, which is nothing at half a turn: there the axis is a column of R + I.
    vectors = skew / (2 * np.sinc(angles / np.pi))[:, None]
    half_turn = (sines < 1e-6) & (cosines < 0)
    if half_turn.any():
        columns = np.swapaxes(rotations[half_turn] + np.eye(3), 1, 2)
        longest = np.linalg.norm(columns, axis=2).argmax(axis=1)
        axes = columns[np.arange(len(columns)), longest]
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        vectors[half_turn] = angles[half_turn, None] * axes
    return np.asarray(vectors)


def roll_pitch_yaw(rotations: Array) -> Array:
    """Angles (N, 3), rad, about fixed x, y, z of rotation matrices (N, 3, 3), as URDF has them."""
    r = np.moveaxis(_shaped("rotation matrices", rotations, 3, 3), 0, -1)
    level = np.hypot(r[0, 0], r[1, 0])
    pitch = np.arctan2(-r[2, 0], level)
    # Pitched upright, roll and yaw turn about the same line: all of it is roll then.
    yaw = np.where(level < 1e-12, 0.0, np.arctan2(r[1, 0], r[0, 0]))
    # Near there, the roll of what is left without the yaw, whose numbers are not small.
    cosine, sine = np.cos(yaw), np.sin(yaw)
    left = np.arctan2(sine * r[0, 2] - cosine * r[1, 2], cosine * r[1, 1] - sine * r[0, 1])
    roll = np.where(level < 1e-3, left, np.arctan2(r[2, 1], r[2, 2]))
    return np.column_stack([roll, pitch, yaw])


def rotations_from_quaternions(quaternions: Array) -> Array:
    """Rotation matrices (N, 3, 3) of unit quaternions (x, y, z, w), shape (N, 4)."""
    x, y, z, w = _shaped("quaternions", quaternions, 4).T
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)


def vectors_from_quaternions(quaternions: Array) -> Array:
    """Rotation vectors (N, 3), rad, of unit quaternions (x, y, z, w), shape (N, 4)."""
    quaternions = _shaped("quaternions", quaternions, 4)
    vector, scalar = quaternions[:, :3], quaternions[:, 3:]
    vector = np.where(scalar < 0, -vector, vector)
    size = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2 * np.arctan2(size, np.abs(scalar))
    return np.asarray(vector * angle / np.where(size > 0, size, 1.0))


def quaternions_from_rotation_vectors(vectors: Array) -> Array:
    """Return unit quaternions (x, y, z, w), shape (N, 4), of rotation vectors (N, 3), rad."""
    vectors = _shaped("rotation vectors", vectors, 3)
    half = np.linalg.norm(vectors, axis=1, keepdims=True) / 2
    # np.sinc(x) is sin(pi x) / (pi x): finite at zero rotation.
    return np.hstack([vectors * np.sinc(half / np.pi) / 2, np.cos(half)])


def wrong_quaternion(poses: Array) -> tuple[int, float] | None:
    """Return the first of poses whose quaternion is not of unit length, and its norm.

    A norm within 1e-3 of 1 is rounded, and is brought to 1 by the core; NaN is no pose at all.
    """
    poses = np.asarray(poses, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] not in (4, 7):
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        norms = np.linalg.norm(poses[:, -4:], axis=1)
        wrong = np.flatnonzero(np.abs(norms - 1) > 1e-3)
    return (int(wrong[0]), float(norms[wrong[0]])) if len(wrong) else None


def poses_from_bounds(pose_space: str, values: ArrayLike) -> Array:
    """Poses written as position and angle or rotation vector, as pose arrays.

    Parameters
    ----------
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses.
    values : array_like, shape (..., dof)
        Position (m), then angle or rotation vector (rad).

    Returns
    -------
    ndarray, shape (..., coordinates)
    """
    values = np.ascontiguousarray(values, dtype=np.float64)
    space = POSE_SPACES[pose_space]
    if values.shape[-1] != space.dof:
        raise MeasurementError(
            f"coordinates have shape {values.shape}; expected (..., {space.dof}) of a {space.name} "
            "pose"
        )
    if not space.has_quaternion:
        return values
    position, vectors = values[..., : space.size], values[..., space.size :]
    quaternions = quaternions_from_rotation_vectors(vectors.reshape(-1, 3))
    return np.concatenate([position, quaternions.reshape(*values.shape[:-1], 4)], axis=-1)


def transforms(pose_space: str, poses: Array) -> Transform:
    """Poses, or coordinates of a workspace's bounds, as motions from platform to base frame."""
    space = POSE_SPACES[pose_space]
    if space.has_quaternion and poses.shape[1] == space.coordinates:
        places = np.zeros((len(poses), 3))
        places[:, : space.size] = poses[:, : space.size]
        return Transform(rotations_from_quaternions(poses[:, space.size :]), places)
    tangents = tangents_of(space, poses)
    return Transform(rotations_from_vectors(tangents[:, 3:]), tangents[:, :3])


def coordinates_of(pose_space: str, motions: Transform) -> Array:
    """Motions from platform to base frame as coordinates of bounds, shape (N, dof).

    Of a motion that leaves what the platform does, such as a tilted one of a platform that turns
    about z, those of the pose from which `between` finds no way in these coordinates.
    """
    space = POSE_SPACES[pose_space]
    values = np.asarray(motions.tangent[:, space.components])
    if space.has_angle:
        values[:, -1] = motions.turn
    return values


def poses_of(pose_space: str, motions: Transform) -> Array:
    """Motions from platform to base frame as poses, shape (N, coordinates)."""
    return poses_from_bounds(pose_space, coordinates_of(pose_space, motions))


def frame(pose_space: str, values: Sequence[float]) -> Transform:
    """A frame of a file; without values, no motion.

    It has ``x, y, phi``, ``x, y, z, rx, ry, rz`` or, of a spherical platform, ``rx, ry, rz``.
    """
    if not len(values):
        return STAYS
    rows = np.zeros((1, 6))
    rows[0, POSE_SPACES[pose_space].frame_components] = values
    return Transform(rotations_from_vectors(rows[:, 3:])[0], rows[0, :3])


def moved(base: Transform, poses: Transform, tool: Transform, wanted: Transform) -> Array:
    """Tangents (N, 6) from the wanted poses to ``base @ poses @ tool``: m, rad."""
    return between(wanted, base @ poses @ tool)


def between(wanted: Transform, found: Transform) -> Array:
    """Tangents (..., 6) from one motion to another, m and rad: `stepped` takes them."""
    turned = found.rotation @ np.swapaxes(wanted.rotation, -1, -2)
    return Transform(turned, found.translation - wanted.translation).tangent


def tangents_of(space: PoseSpace, changes: Array) -> Array:
    """Changes of the coordinates of bounds (N, dof) as tangents in space (N, 6)."""
    made = np.zeros((len(changes), 6))
    made[:, space.components] = changes
    return made


def stepped(motions: Transform, tangents: Array) -> Transform:
    """Motions, each turned about its own place and moved by a tangent (..., 6), m and rad.

    As `between` tells of them: in the frame in which the motions are given.
    """
    turns = rotations_from_vectors(tangents[..., 3:].reshape(-1, 3))
    turned = turns.reshape(*tangents.shape[:-1], 3, 3) @ motions.rotation
    return Transform(turned, motions.translation + tangents[..., :3])


def in_plane(matrix: Array) -> Array:
    """The part of a matrix that is a rotation in the plane, but for its size."""
    cosine, sine = matrix[0, 0] + matrix[1, 1], matrix[1, 0] - matrix[0, 1]
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def nearest_rotation(matrix: Array) -> Array:
    """The rotation that differs least from a matrix."""
    left, _, right = np.linalg.svd(matrix)
    left[:, 2] *= np.linalg.det(left @ right)
    return np.asarray(left @ right)


def _shaped(name: str, values: Array, *shape: int) -> Array:
    """Refuse arrays that are not rows of this shape."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape[1:] != shape or array.ndim != len(shape) + 1:
        expected = ", ".join(map(str, shape))
        raise MeasurementError(f"{name} have shape {array.shape}; expected (N, {expected})")
    return array


def pose_rows(poses: ArrayLike | Any) -> Array:
    """Poses as rows, shape (N, coordinates), of an array or of what has poses: a sample, a plan."""
    try:
        rows = np.ascontiguousarray(getattr(poses, "poses", poses), dtype=np.float64)
    except (TypeError, ValueError):
        raise MeasurementError(f"poses are {shown(poses)}; expected an array of numbers") from None
    if rows.ndim > 2:
        raise MeasurementError(f"poses have shape {rows.shape}; expected a pose a row")
    return np.atleast_2d(rows)
