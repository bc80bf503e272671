# SPDX-License-Identifier: MIT
"""Orientations as files write them, brought to the unit quaternions of spatial poses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["quaternions_from_rotation_vectors"]


def quaternions_from_rotation_vectors(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit quaternions (x, y, z, w), shape (N, 4), of rotation vectors (N, 3), rad."""
    half = np.linalg.norm(vectors, axis=1, keepdims=True) / 2
    # np.sinc(x) is sin(pi x) / (pi x): finite at zero rotation.
    return np.hstack([vectors * np.sinc(half / np.pi) / 2, np.cos(half)])
