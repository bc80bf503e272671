# SPDX-License-Identifier: MIT
"""Base and platform frames that are others than those of a nominal mechanism."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray

from symkin.mechanism import Mechanism
from symkin.poses import Transform, rotations_from_vectors, vectors_from_rotations

__all__ = ["anchor", "with_moved_workspace"]

Array = NDArray[np.float64]

_TURN = 2 * np.pi
_MOVED = 5.0  # expected displacements of a frame, beyond which it is another one
# Components of translation and rotation vector that the coordinates of a pose are.
_COMPONENTS = {"planar": [0, 1, 5], "point": [0, 1], "spatial": [0, 1, 2, 3, 4, 5]}


def anchor(mechanism: Mechanism, end: str) -> str:
    """Whether an end of the legs is a "point", a guide's "line" or its "direction" alone."""
    kinds = {role.kind for role in mechanism.parameter_roles if role.end == end}
    if "radius" in kinds:
        return "point"
    if "direction_distance" in kinds:
        return "line"
    return "direction" if kinds else "none"


_STAYS = Transform(np.eye(3), np.zeros(3))


def with_moved_workspace(nominal: Mechanism, made: Mechanism) -> Mechanism:
    """Carry home and box along with frames that are others than the nominal ones."""
    if nominal.workspace is None:
        return made
    base, tool = (_frame_motion(nominal, made, end) for end in ("base", "platform"))
    if base is _STAYS and tool is _STAYS:
        return made
    settings = nominal.workspace
    # The same place of the platform's points over the base's points, in other frames.
    home = np.array(settings.home or (0.0,) * nominal.core.dof)
    sides = [(a, (a + b) / 2, b) for a, b in zip(settings.lower, settings.upper, strict=True)]
    box = np.array(list(itertools.product(*sides)))
    moved_home = _moved(nominal, base, tool, home[None])[0]
    moved = _moved(nominal, base, tool, box, near=moved_home)
    return made.replace(
        workspace=dataclasses.replace(
            settings,
            lower=tuple(moved.min(axis=0).tolist()),
            upper=tuple(moved.max(axis=0).tolist()),
            home=tuple(moved_home.tolist()),
        )
    )


def _moved(
    mechanism: Mechanism,
    base: Transform,
    tool: Transform,
    coordinates: Array,
    near: Array | None = None,
) -> Array:
    """Coordinates (N, dof) of ``base @ pose @ tool^-1``."""
    components = _COMPONENTS[mechanism.pose_space]
    tangents = np.zeros((len(coordinates), 6))
    tangents[:, components] = coordinates
    found = (
        base @ Transform(rotations_from_vectors(tangents[:, 3:]), tangents[:, :3]) @ tool.inverse
    )
    vectors = vectors_from_rotations(found.rotation)
    if mechanism.pose_space == "planar":
        vectors[:, 2] = tangents[:, 5] + base.turn - tool.turn
    elif near is not None and mechanism.pose_space == "spatial":
        vectors = _on_the_branch_of(near[3:], vectors)
    return np.asarray(np.hstack([found.translation, vectors])[:, components])


def _frame_motion(nominal: Mechanism, made: Mechanism, end: str) -> Transform:
    """The motion of base or platform frame that best explains the parameters of that end.

    None at all, as long as the tolerances may do the same.
    """
    kind = anchor(nominal, end)
    if kind == "none":
        return _STAYS
    before, after = (_anchor_points(each, end) for each in (nominal, made))
    if kind == "point":
        motion = _best_motion(before, after, in_plane=nominal.pose_space != "spatial")
    else:
        motion = _motion_of_lines(nominal, made, end)
    displaced = before @ motion.rotation.T + motion.translation - before
    tolerances = nominal.tolerances
    expected = np.hypot(tolerances.length, tolerances.angle * np.linalg.norm(before, axis=1))
    return motion if _rms(displaced) > _MOVED * _rms(expected) else _STAYS


def _anchor_points(mechanism: Mechanism, end: str) -> Array:
    """The points of all legs, the feet of their guides or, of mere directions, where those point.

    Shape (legs, 3).
    """
    values = dict(zip(mechanism.parameter_names, mechanism.parameters.T, strict=True))
    if mechanism.pose_space == "spatial":
        polar, azimuth = values[f"{end}_polar_angle"], values[f"{end}_azimuth"]
        level = np.sin(polar)
        unit = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.cos(polar)], axis=1)
    else:
        angle = values[f"{end}_angle"]
        unit = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    radius = values.get(f"{end}_radius", np.full(len(unit), mechanism.characteristic_length))
    return np.asarray(radius[:, None] * unit)


def _best_motion(before: Array, after: Array, *, in_plane: bool) -> Transform:
    """Least squares (Kabsch)."""
    centres = before.mean(axis=0), after.mean(axis=0)
    left, _, right = np.linalg.svd((after - centres[1]).T @ (before - centres[0]))
    if in_plane:
        product = (after - centres[1]).T @ (before - centres[0])
        turn = np.arctan2(product[1, 0] - product[0, 1], product[0, 0] + product[1, 1])
        rotation = rotations_from_vectors(np.array([[0, 0, turn]]))[0]
    else:
        left[:, 2] *= np.linalg.det(left @ right)
        rotation = left @ right
    return Transform(rotation, centres[1] - rotation @ centres[0])


def _motion_of_lines(nominal: Mechanism, made: Mechanism, end: str) -> Transform:
    """The turn that all directions share, and the translation that the distances show."""
    angle = nominal.parameter_names.index(f"{end}_angle")
    # The distance of a guide that has none of its own is part of the sensor's offset.
    distance = f"{end}_radius" if anchor(nominal, end) == "line" else "sensor_offset"
    column = nominal.parameter_names.index(distance)
    before, after = nominal.parameters, made.parameters
    turn = np.angle(np.exp(1j * (after[:, angle] - before[:, angle])).sum())
    normals = np.stack([np.cos(after[:, angle]), np.sin(after[:, angle])], axis=1)
    shift = np.linalg.lstsq(normals, after[:, column] - before[:, column], rcond=1e-9)[0]
    return Transform(rotations_from_vectors(np.array([[0, 0, turn]]))[0], np.array([*shift, 0.0]))


def _rms(values: Array) -> float:
    """Root mean square over rows."""
    return float(np.sqrt(np.sum(values**2) / len(values)))


def _on_the_branch_of(near: Array, vectors: Array) -> Array:
    """Rotation vectors of the same rotations that are nearest to another one."""
    angles = np.linalg.norm(vectors, axis=1, keepdims=True)
    around = vectors * (1 - _TURN / np.where(angles > 0, angles, 1))
    nearer = np.linalg.norm(around - near, axis=1) < np.linalg.norm(vectors - near, axis=1)
    return np.where(nearer[:, None] & (angles > 0), around, vectors)
