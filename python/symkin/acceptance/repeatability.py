# SPDX-License-Identifier: MIT
"""Pose accuracy and pose repeatability, in the terms of ISO 9283."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.values import Array, Value, field, record


@record
class PoseAccuracy(Value):
    """How n visits of one commanded pose, from one direction, come out.

    Attributes
    ----------
    visits : int
        n; the standard has 30.
    position_accuracy : float
        AP: how far the barycentre of the attained positions is from the commanded one, m.
    mean_distance, distance_deviation : float
        Of the attained positions from their barycentre, m; NaN of one visit.
    components : ndarray, shape (dof,)
        AP of each coordinate: mean attained less commanded, m and rad.
    angle_deviations : ndarray
        S of each angle, rad; NaN of one visit.
    """

    visits: int
    position_accuracy: float = field(unit="m")
    mean_distance: float = field(unit="m")
    distance_deviation: float = field(unit="m")
    components: Array
    angle_deviations: Array = field(unit="rad")

    @property
    def position_repeatability(self) -> float:
        """RP: mean distance from the barycentre and three standard deviations, m."""
        return self.mean_distance + 3 * self.distance_deviation

    @property
    def angle_repeatability(self) -> Array:
        """RP of each angle: three standard deviations, rad."""
        return 3 * self.angle_deviations


def pose_accuracy(errors: Array, positions: int) -> PoseAccuracy:
    """Return pose accuracy and repeatability of the visits of one commanded pose.

    Parameters
    ----------
    errors : ndarray, shape (n, dof)
        Attained less commanded: coordinates of the position, m, then angles, rad.
    positions : int
        How many of the columns are of the position.

    Raises
    ------
    SymkinError
        Without a visit.
    """
    errors = np.array(errors, dtype=float, order="C")  # sums round by the order
    if errors.ndim != 2 or not len(errors):
        raise SymkinError(f"errors have shape {errors.shape}; expected (visits, coordinates)")
    count, mean = len(errors), errors.mean(axis=0)
    scatter = errors - mean
    distances = np.linalg.norm(scatter[:, :positions], axis=1)
    single = count == 1
    return PoseAccuracy(
        visits=count,
        position_accuracy=float(np.linalg.norm(mean[:positions])),
        mean_distance=math.nan if single else float(distances.mean()),
        distance_deviation=math.nan if single else float(distances.std(ddof=1)),
        components=mean,
        angle_deviations=np.full(errors.shape[1] - positions, math.nan)
        if single
        else scatter[:, positions:].std(axis=0, ddof=1),
    )


def visits_of(commanded: Array, apart: float) -> list[NDArray[np.intp]]:
    """Return rows that are visits of one pose: those nearer to its first visit than `apart`.

    Parameters
    ----------
    commanded : ndarray, shape (N, k)
        Commanded poses, of which distances mean something.
    apart : float
        In the same unit.

    Raises
    ------
    SymkinError
        For poses that are not finite, or a distance that is not positive.
    """
    commanded = np.asarray(commanded, dtype=float)
    if commanded.ndim != 2 or not np.isfinite(commanded).all() or not apart > 0:
        raise SymkinError("expected finite commanded poses, one a row, and a positive distance")
    left, found = np.arange(len(commanded)), []
    while len(left):
        near = np.linalg.norm(commanded[left] - commanded[left[0]], axis=1) < apart
        found.append(left[near])
        left = left[~near]
    return found
