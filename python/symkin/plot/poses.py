# SPDX-License-Identifier: MIT
"""What pose arrays are drawn as: axes, orientation as one number, views of space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.evaluation import Evaluation

__all__ = ["VIEWS", "View", "error_sizes", "orientation_label", "orientations"]

Array = NDArray[np.float64]


class View(NamedTuple):
    """Two position coordinates, by column, and the labels of their axes."""

    x: int
    y: int
    x_label: str
    y_label: str


_TOP = View(0, 1, "x, m", "y, m")

VIEWS = {
    "planar": (_TOP,),
    "point": (_TOP,),
    "spatial": (_TOP, View(0, 2, "x, m", "z, m"), View(1, 2, "y, m", "z, m")),
}


def orientations(pose_space: str, poses: Array) -> Array | None:
    """Orientation of each pose as one number, rad: the angle, or the angle of the rotation."""
    if pose_space == "planar":
        return poses[:, 2]
    if pose_space == "spatial":
        vector = np.linalg.norm(poses[:, 3:6], axis=1)
        return np.asarray(2 * np.arctan2(vector, np.abs(poses[:, 6])))
    return None


def orientation_label(pose_space: str) -> str:
    """Label of that number."""
    return "\N{GREEK SMALL LETTER PHI}, rad" if pose_space == "planar" else "angle of rotation, rad"


def error_sizes(evaluation: Evaluation) -> list[Array]:
    """Distance (m) and angle (rad) of each pose's error; a point platform has no angle."""
    differences = evaluation.differences
    positions = {2: 2, 3: 2, 6: 3}[differences.shape[1]]
    parts = (differences[:, :positions], differences[:, positions:])
    return [np.linalg.norm(part, axis=1) for part in parts if part.shape[1]]
