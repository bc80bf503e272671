# SPDX-License-Identifier: MIT
"""How well an identification predicts poses that it did not see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.evaluation import Evaluation, pose_differences
from symkin.identification.estimate import Estimator, PoseUse, identify
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism

__all__ = ["CrossValidation", "cross_validate"]


@dataclass(frozen=True)
class CrossValidation:
    """Errors at poses that the identification did not see.

    Attributes
    ----------
    folds : int
        Number of parts, each predicted from the others.
    blocks : bool
        Whether the parts were blocks of consecutive poses.
    converged : bool
        Whether every identification did.
    residual_rms, residual_max : float
        Closures, m.
    residuals : ndarray, shape (N, legs)
        m, NaN where a leg does not use the pose, or was not read.
    evaluation : Evaluation or None
        End-effector errors at the measured readings of all legs, as of `evaluate`; None if no such
        pose can be taken.
    """

    folds: int
    blocks: bool
    converged: bool
    residual_rms: float
    residual_max: float
    residuals: NDArray[np.float64]
    evaluation: Evaluation | None

    @property
    def name(self) -> str:
        """What it is, in words: ``5-fold cross-validation``."""
        return f"{self.folds}-{'block' if self.blocks else 'fold'} cross-validation"


def cross_validate(
    mechanism: Mechanism,
    measurements: Measurements,
    folds: int = 5,
    seed: int = 1,
    estimator: Estimator = "implicit",
    *,
    blocks: bool = False,
    poses: PoseUse = "all",
    **options: object,
) -> CrossValidation:
    """Predict each part of the measurements from an identification on the others.

    Parameters
    ----------
    mechanism, measurements, estimator, poses
        As for `identify`, and so are the other `options`. With poses "own", each leg's set is dealt
        by itself, and a leg is predicted at those poses alone.
    folds : int
        Number of parts, from 2 to the number of poses.
    seed : int
        Of the random assignment of poses to parts.
    blocks : bool
        Parts are blocks of consecutive poses. Neighbours are often measured at similar places and
        at similar times, so that random parts hide what drifts and what depends on the place.

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
    if poses == "all":
        measurements = measurements.for_all_legs()
    fold_of = _folds(measurements.leg_sets, folds, None if blocks else seed)
    residuals = np.full(measurements.readings.shape, np.nan)
    complete = np.flatnonzero(np.isfinite(measurements.readings).all(axis=1))
    differences = np.full((count, mechanism.core.dof), np.nan)
    converged = True
    for fold in np.unique(fold_of):
        seen, unseen = np.flatnonzero(fold_of != fold), np.flatnonzero(fold_of == fold)
        found = identify(
            mechanism,
            measurements.subset(seen),
            estimator,
            poses=poses,
            **options,  # type: ignore[arg-type]
        )
        converged &= found.converged
        for leg in range(len(mechanism.legs)):
            rows = np.intersect1d(measurements.rows_of(leg), unseen)
            residuals[rows, leg] = found.mechanism.closure(
                leg, measurements.poses[rows], measurements.readings[rows, leg]
            )
        whole = np.intersect1d(complete, unseen)
        differences[whole] = pose_differences(found.mechanism, measurements.subset(whole))
    return CrossValidation(
        folds=folds,
        blocks=blocks,
        converged=converged,
        residual_rms=float(np.sqrt(np.nanmean(residuals**2))),
        residual_max=float(np.nanmax(np.abs(residuals))),
        residuals=residuals,
        evaluation=Evaluation.of(
            differences[complete], measurements.poses[complete], mechanism.characteristic_length
        )
        if np.isfinite(differences).any()
        else None,
    )


def _folds(sets: NDArray[np.intp], folds: int, seed: int | None) -> NDArray[np.intp]:
    """The part that each row belongs to, dealt set by set; in blocks without a seed."""
    fold_of = np.empty(len(sets), dtype=np.intp)
    random = np.random.default_rng(seed)
    for number in np.unique(sets):
        rows = np.flatnonzero(sets == number)
        order = np.arange(len(rows))
        fold_of[rows] = (
            order * folds // len(rows) if seed is None else random.permutation(order % folds)
        )
    return fold_of
