# SPDX-License-Identifier: MIT
"""Names of point groups and of their elements: Schoenflies in space, C_n and D_n in the plane."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from symkin.values import Array

Matrix = Array

_SAME = 1e-3  # of entries: far less than between two elements of a group


def group_name(matrices: Sequence[Matrix], planar: bool) -> str:
    """Name the group of the orthogonal matrices, of shape (3, 3); doubled ones count once.

    Schoenflies' name, such as ``"C_3v"``; in the plane ``"C_3"`` or ``"D_3"`` (with reflections).
    """
    distinct: list[Matrix] = []
    for matrix in matrices:
        if not any(_same(matrix, other) for other in distinct):
            distinct.append(matrix)
    proper = [matrix for matrix in distinct if np.linalg.det(matrix) > 0]
    improper = [matrix for matrix in distinct if np.linalg.det(matrix) < 0]
    if planar:
        return f"{'D' if improper else 'C'}_{len(proper)}"
    rotations = _rotations_name(proper)
    if not improper:
        return rotations
    mirrors = [_normal(matrix) for matrix in improper if _is_mirror(matrix)]
    return _improper_name(rotations, proper, improper, mirrors)


def element_words(matrix: Matrix, planar: bool) -> str:
    """Say what an orthogonal matrix does: ``"turn by 120° about (1, 1, 1)"``."""
    improper = np.linalg.det(matrix) < 0
    if planar:
        turn = math.degrees(math.atan2(matrix[1, 0], matrix[0, 0]))
        if improper:
            line = (turn / 2) % 180
            return f"mirror line at {_degrees(line if line > 1e-9 else 180.0)}"
        return "identity" if abs(turn) < _SAME else f"turn by {_degrees(turn)}"
    if improper and _same(matrix, -np.eye(3)):
        return "inversion"
    if improper and _is_mirror(matrix):
        return f"mirror, normal {_vector(_normal(matrix))}"
    rotation = -matrix if improper else matrix
    if not improper and _same(rotation, np.eye(3)):
        return "identity"
    # An improper one turns by half a turn less, and mirrors along its axis.
    axis, angle = _axis_and_angle(rotation)
    if improper:
        turn = math.remainder(angle + math.pi, 2 * math.pi)
        return f"turn by {_degrees(math.degrees(turn))} and mirror along {_vector(axis)}"
    return f"turn by {_degrees(math.degrees(angle))} about {_vector(axis)}"


def _same(a: Matrix, b: Matrix) -> bool:
    return bool(np.abs(a - b).max() < _SAME)


def _is_mirror(matrix: Matrix) -> bool:
    return bool(_same(matrix @ matrix, np.eye(3)) and abs(np.trace(matrix) - 1) < _SAME)


def _normal(mirror: Matrix) -> Matrix:
    values, vectors = np.linalg.eigh((mirror + mirror.T) / 2)
    return _towards_us(vectors[:, int(np.argmin(values))])


def _axis_and_angle(rotation: Matrix) -> tuple[Matrix, float]:
    values, vectors = np.linalg.eigh((rotation + rotation.T) / 2)
    axis = _towards_us(vectors[:, int(np.argmax(values))])
    skew = rotation - rotation.T
    sine = axis @ np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / 2
    angle = math.atan2(sine, (np.trace(rotation) - 1) / 2)
    return axis, math.pi if angle < -math.pi + _SAME else angle


def _towards_us(direction: Matrix) -> Matrix:
    """Of both senses that towards +Z, then +X, then +Y."""
    for place in (2, 0, 1):
        if abs(direction[place]) > _SAME:
            return direction * math.copysign(1.0, direction[place])
    return direction


def _rotations_name(rotations: Sequence[Matrix]) -> str:
    orders = [round(2 * math.pi / abs(_axis_and_angle(each)[1])) for each in _turning(rotations)]
    count = len(rotations)
    if not orders or max(orders) == count:
        return f"C_{count}"
    if count == 12 and max(orders) == 3:
        return "T"
    if count == 24 and max(orders) == 4:
        return "O"
    if count == 60:
        return "I"
    return f"D_{count // 2}"


def _turning(rotations: Sequence[Matrix]) -> list[Matrix]:
    return [each for each in rotations if not _same(each, np.eye(3))]


def _improper_name(
    rotations: str, proper: Sequence[Matrix], improper: Sequence[Matrix], mirrors: Sequence[Matrix]
) -> str:
    if rotations == "C_1":
        return "C_s" if mirrors else "C_i"
    if rotations in ("T", "O", "I"):
        inversion = any(_same(each, -np.eye(3)) for each in improper)
        return f"{rotations}_{'h' if inversion else 'd'}"
    axes = _principal_axes(rotations, proper)
    across = any(abs(abs(axis @ normal) - 1) < _SAME for axis in axes for normal in mirrors)
    if across:
        return f"{rotations}h"
    if rotations.startswith("D"):
        return f"{rotations}d"
    return f"{rotations}v" if mirrors else f"S_{2 * len(proper)}"


def _principal_axes(rotations: str, proper: Sequence[Matrix]) -> list[Matrix]:
    found = [_axis_and_angle(each) for each in _turning(proper)]
    if rotations == "D_2":
        return [axis for axis, _ in found]
    least = min(abs(angle) for _, angle in found)
    return [axis for axis, angle in found if abs(angle) < least + _SAME]


def _degrees(angle: float) -> str:
    return f"{angle:.4g}\N{DEGREE SIGN}"


def _vector(direction: Matrix) -> str:
    scaled = direction / np.abs(direction).max()
    return f"({', '.join(f'{value:.4g}' for value in np.round(scaled, 9) + 0.0)})"
