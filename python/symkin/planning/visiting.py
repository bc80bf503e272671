# SPDX-License-Identifier: MIT
"""The order in which poses are visited, so that the robot travels little."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.mechanism import Mechanism

__all__ = ["travel_length", "visiting_order"]

_ITERATIONS = 1000  # of the solver: within a percent or two of the shortest known tours
_STEPS = 10**7  # into which the longest way is divided: the solver counts in integers
_NOWHERE = 1e-200  # m, what a way is divided by if no two stations differ


def travel_length(mechanism: Mechanism, poses: NDArray[np.float64]) -> float:
    """Length of the way from home through poses in their order, m.

    A rotation counts as the way of a point at the characteristic length from the centre.
    """
    poses = np.atleast_2d(poses)
    stations = np.vstack([mechanism.home, poses])
    distances = _distances(mechanism, stations)
    return float(distances[np.arange(len(poses)), np.arange(1, len(stations))].sum())


def visiting_order(mechanism: Mechanism, poses: NDArray[np.float64], seed: int) -> NDArray[np.intp]:
    """Order poses for a short way from home through all of them (a heuristic).

    Parameters
    ----------
    mechanism : Mechanism
        Its home is where the way begins; it ends at the last pose.
    poses : ndarray, shape (N, coordinates)
        To visit.
    seed : int
        Of the heuristic.

    Returns
    -------
    ndarray of int, shape (N,)
        Rows of the poses; those of the given order if the heuristic finds no shorter way.
    """
    given = np.arange(len(poses), dtype=np.intp)
    if len(poses) < 2:
        return given
    found = _short_way(_distances(mechanism, np.vstack([mechanism.home, poses])), seed)
    shorter = travel_length(mechanism, poses[found]) < travel_length(mechanism, poses)
    return found if shorter else given


def _short_way(distances: NDArray[np.float64], seed: int) -> NDArray[np.intp]:
    """Order of the stations 1, 2, ... (from 0) on a short way that begins at station 0."""
    import pyvrp

    integers = np.rint(distances * (_STEPS / max(distances.max(), _NOWHERE))).astype(np.int64)
    integers[:, 0] = 0  # the way back costs nothing: the way is open
    stations = len(integers)
    data = pyvrp.ProblemData(
        locations=[pyvrp.Location(0, 0)] * stations,
        clients=[pyvrp.Client(station) for station in range(1, stations)],
        depots=[pyvrp.Depot(0)],
        vehicle_types=[pyvrp.VehicleType(1)],
        distance_matrices=[integers],
        duration_matrices=[np.zeros_like(integers)],
    )
    result = pyvrp.solve(data, pyvrp.stop.MaxIterations(_ITERATIONS), seed=seed % 2**32)
    (route,) = result.best.routes()
    return np.array([activity.idx for activity in route if activity.is_client()], dtype=np.intp)


def _distances(mechanism: Mechanism, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Way between any two poses, shape (N, N), m."""
    size = 3 if mechanism.pose_space == "spatial" else 2
    positions = poses[:, :size]
    ways = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    return np.asarray(ways + mechanism.characteristic_length * _angles(mechanism, poses[:, size:]))


def _angles(mechanism: Mechanism, orientations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle between any two orientations, rad."""
    if mechanism.pose_space == "spatial":
        # From the chord: the arc cosine of a product has 1e-8 rad of rounding near zero.
        sums, differences = (
            np.linalg.norm(orientations[:, None] + sign * orientations[None], axis=2)
            for sign in (1, -1)
        )
        return np.asarray(4 * np.arcsin(np.minimum(np.minimum(sums, differences) / 2, 1)))
    return np.asarray(np.abs(orientations[:, None] - orientations[None]).sum(axis=2))
