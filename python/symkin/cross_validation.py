# SPDX-License-Identifier: MIT
"""How well an identification predicts poses that it did not see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.identification import Estimator, identify
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism

__all__ = ["CrossValidation", "cross_validate"]


@dataclass(frozen=True)
class CrossValidation:
    """Closures of poses that the identification did not see.

    Attributes
    ----------
    folds : int
        Number of parts, each predicted from the others.
    residual_rms, residual_max : float
        m.
    residuals : ndarray, shape (N, legs)
        m, NaN where a leg was not read.
    """

    folds: int
    residual_rms: float
    residual_max: float
    residuals: NDArray[np.float64]


def cross_validate(
    mechanism: Mechanism,
    measurements: Measurements,
    folds: int = 5,
    seed: int = 1,
    estimator: Estimator = "implicit",
    **options: object,
) -> CrossValidation:
    """Predict each part of the measurements from an identification on the others.

    Parameters
    ----------
    mechanism, measurements, estimator
        As for `identify`, and so are the other `options`.
    folds : int
        Number of parts, from 2 to the number of poses.
    seed : int
        Of the random assignment of poses to parts.

    Returns
    -------
    CrossValidation

    Raises
    ------
    SymkinError
        For an impossible number of folds, or too few poses left in one.
    """
    count = len(measurements.poses)
    if not 2 <= folds <= count:
        raise SymkinError(f"cross-validation in {folds} folds; expected from 2 to {count}")
    fold_of = np.random.default_rng(seed).permutation(np.arange(count) % folds)
    residuals = np.full(measurements.readings.shape, np.nan)
    for fold in range(folds):
        seen, unseen = np.flatnonzero(fold_of != fold), np.flatnonzero(fold_of == fold)
        fitted = identify(mechanism, measurements.subset(seen), estimator, **options)  # type: ignore[arg-type]
        for leg in range(len(mechanism.legs)):
            residuals[unseen, leg] = fitted.mechanism.closure(
                leg, measurements.poses[unseen], measurements.readings[unseen, leg]
            )
    return CrossValidation(
        folds=folds,
        residual_rms=float(np.sqrt(np.nanmean(residuals**2))),
        residual_max=float(np.nanmax(np.abs(residuals))),
        residuals=residuals,
    )
