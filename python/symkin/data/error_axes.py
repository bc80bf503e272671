# SPDX-License-Identifier: MIT
"""Axes along which errors of places are independent, where an instrument sees along one better."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.model.settings import NoiseSettings
from symkin.values import Array


class Directed(NamedTuple):
    """Errors of places, as many of each row as there are, independent along axes of their own."""

    # (N, n, size, size): by rows, each in the place of the coordinate that it is nearest to; of a
    # coordinate that was not measured the coordinate itself.
    axes: Array
    deviations: Array  # (N, n, size): along these, m

    @property
    def in_space(self) -> Array:
        """The axes as nine numbers of each place, shape (N, 9 n)."""
        rows, count, size, _ = self.axes.shape
        whole = np.tile(np.eye(3), (rows, count, 1, 1))
        whole[:, :, :size, :size] = self.axes
        return np.ascontiguousarray(whole.reshape(rows, 9 * count))

    def without(self, own: NDArray[np.bool_], deviations: Array) -> Directed:
        """Return them with coordinates as axes where a place has deviations of its own."""
        axes = np.where(own[..., None, None], np.eye(self.axes.shape[-1]), self.axes)
        return Directed(axes, np.where(own[..., None], deviations, self.deviations))

    def but(self, own: NDArray[np.bool_], other: Directed) -> Directed:
        """Return them with those of another where a place is its own."""
        axes = np.where(own[..., None, None], other.axes, self.axes)
        return Directed(axes, np.where(own[..., None], other.deviations, self.deviations))


def directed_errors(noise: NoiseSettings, places: Array) -> Directed:
    """Errors of places, shape (N, n, size), in the frame of an instrument at its origin."""
    size = places.shape[-1]
    known = np.isfinite(places)
    seen = np.where(known, places, 0.0)
    distances = np.linalg.norm(seen, axis=-1)
    if noise.direction == "beam":
        nearest = np.zeros(places.shape)
        nearest[..., 0] = 1.0
        far = (distances > 0)[..., None]
        along = np.where(far, seen / np.where(far, distances[..., None], 1.0), nearest)
    else:
        along = np.broadcast_to(np.eye(3)["xyz".index(noise.direction)][:size], places.shape)
    across, own = noise.at(distances), noise.along_at(distances)
    covariances = across[..., None, None] ** 2 * np.eye(size) + (own**2 - across**2)[
        ..., None, None
    ] * (along[..., :, None] * along[..., None, :])
    both = known[..., :, None] & known[..., None, :]
    return _principal(np.where(both, covariances, 0.0), known)


def correlated_errors(deviations: Array, correlations: Array, known: NDArray[np.bool_]) -> Directed:
    """Errors of places from their standard deviations, (N, n, size), and their correlations.

    The correlations, (N, n, size (size - 1) / 2), are of xy, xz, yz. Those with a coordinate that
    was not measured count for nothing.
    """
    matrices = correlation_matrices(correlations, deviations.shape[-1])
    sizes = np.where(known, deviations, 0.0)
    both = known[..., :, None] & known[..., None, :]
    covariances = matrices * sizes[..., :, None] * sizes[..., None, :]
    return _principal(np.where(both, covariances, 0.0), known)


def correlation_matrices(correlations: Array, size: int) -> Array:
    """Matrices of correlations xy, xz, yz, of which NaN is none."""
    matrices = np.broadcast_to(np.eye(size), (*correlations.shape[:-1], size, size)).copy()
    first, second = np.triu_indices(size, 1)
    matrices[..., first, second] = matrices[..., second, first] = np.nan_to_num(correlations)
    return matrices


def _principal(covariances: Array, known: NDArray[np.bool_]) -> Directed:
    """Axes and deviations of covariances that are zero where a coordinate was not measured."""
    size = known.shape[-1]
    axes = np.broadcast_to(np.eye(size), covariances.shape).copy()
    deviations = np.zeros(known.shape)
    for pattern in np.unique(known.reshape(-1, size), axis=0):
        own = np.flatnonzero(pattern)
        if not len(own):
            continue
        rows = (known == pattern).all(axis=-1)
        values, vectors = np.linalg.eigh(covariances[rows][:, own[:, None], own])
        found = np.swapaxes(vectors, 1, 2)  # by rows
        # The one that differs from the others in the place of the coordinate that it is nearest to.
        different = np.abs(values - np.median(values, axis=1)[:, None]).argmax(axis=1)
        count = np.arange(len(found))
        place = np.abs(found[count, different]).argmax(axis=1)
        order = np.tile(np.arange(len(own)), (len(found), 1))
        order[count, place], order[count, different] = different, place
        block = np.take_along_axis(found, order[:, :, None], axis=1)
        inside = axes[rows]
        inside[:, own[:, None], own] = block
        axes[rows] = inside
        spread = np.zeros((len(found), size))
        spread[:, own] = np.sqrt(np.maximum(np.take_along_axis(values, order, axis=1), 0.0))
        deviations[rows] = spread
    return Directed(axes, deviations)


def drawn_along(noise: NoiseSettings, places: Array, random: Array) -> Array:
    """Errors of places from standard normal numbers of their shape, (N, n, size)."""
    found = directed_errors(noise, places)
    return np.asarray(np.einsum("...ki,...k->...i", found.axes, found.deviations * random))
