# SPDX-License-Identifier: MIT
"""End-effector errors of a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism, require_same_shape

__all__ = ["Evaluation", "evaluate"]


@dataclass(frozen=True)
class Evaluation:
    """End-effector errors over poses.

    Attributes
    ----------
    position_rms, position_max : float
        m, of the distance.
    orientation_rms, orientation_max : float
        rad, of the angle; zero for a point platform.
    evaluated, failed : int
        Poses in the figures, and poses left out because the mechanism cannot take them.
    differences : ndarray, shape (N, dof)
        Pose taken less pose wanted: position, then angle or rotation vector; NaN where it failed.
    """

    position_rms: float
    position_max: float
    orientation_rms: float
    orientation_max: float
    evaluated: int
    failed: int
    differences: NDArray[np.float64]


def evaluate(
    model: Mechanism,
    *,
    actual: Mechanism | None = None,
    poses: ArrayLike | None = None,
    measurements: Measurements | None = None,
) -> Evaluation:
    """Evaluate a model by its end-effector errors.

    Give either `actual` and `poses`, or `measurements`.

    Parameters
    ----------
    model : Mechanism
        The model that a controller would use.
    actual : Mechanism
        The robot as made (simulation): errors are those of the poses that it takes when the model's
        inverse kinematics commands `poses`.
    poses : array_like, shape (N, coordinates)
        Commanded poses.
    measurements : Measurements
        Errors are those of the model's forward kinematics at the measured readings; a row without
        all readings is left out.

    Returns
    -------
    Evaluation

    Raises
    ------
    SymkinError
        If no pose can be evaluated, or the robot is of another kind than the model.
    """
    if measurements is not None and actual is None and poses is None:
        complete = np.isfinite(measurements.readings).all(axis=1)
        if not complete.any():
            raise SymkinError("no pose has readings of all legs, so none can be evaluated")
        errors = _core.measurement_errors(
            model.core, measurements.poses[complete], measurements.readings[complete]
        )
    elif actual is not None and poses is not None and measurements is None:
        require_same_shape(actual, model)
        rows = np.atleast_2d(np.ascontiguousarray(poses, dtype=np.float64))
        errors = _core.command_errors(actual.core, model.core, rows)
    else:
        raise SymkinError("evaluate takes `actual` and `poses`, or `measurements` alone")
    if errors.evaluated == 0:
        raise SymkinError(
            f'mechanism "{model.name}" can take none of the {errors.failed} poses to evaluate'
        )
    return Evaluation(
        position_rms=errors.position_rms,
        position_max=errors.position_max,
        orientation_rms=errors.orientation_rms,
        orientation_max=errors.orientation_max,
        evaluated=errors.evaluated,
        failed=errors.failed,
        differences=errors.differences,
    )
