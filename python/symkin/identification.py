# SPDX-License-Identifier: MIT
"""Identification of the parameters from measurements."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.calibrated import calibrated_mechanism, fit_that_may_fail
from symkin.errors import NotIdentifiableError, SymkinError, named_legs
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import noise_of
from symkin.settings import NoiseSettings

__all__ = [
    "CrossValidation",
    "Estimator",
    "Identification",
    "LegFit",
    "Loss",
    "PoseUse",
    "cross_validate",
    "identify",
]

Estimator = Literal["paper", "inverse", "implicit", "joint"]
Loss = Literal["none", "huber", "cauchy", "tukey"]
PoseUse = Literal["all", "own"]

# Beyond this the parameters of a leg are told apart only by digits that no measurement has.
_CONDITION_LIMIT = 1e5


@dataclass(frozen=True)
class LegFit:
    """How one leg was fitted.

    Attributes
    ----------
    rows : ndarray of int
        Rows of the measurements that it used.
    residuals : ndarray
        Closures at the estimate, m, one a row.
    standardised : ndarray
        Over their standard deviation from the declared noise: standard normal if all is right.
    rejected : ndarray of int
        Rows whose weight the robust loss put below one half.
    converged : bool
        Whether the estimator converged, and
    failure : str
        why not.
    iterations : int
        Of the solver.
    chi_square : float
        Per degree of freedom: 1 is what the declared noise explains; NaN without one to spare.
    condition : float
        Of the scaled Jacobian.
    """

    rows: NDArray[np.intp]
    residuals: NDArray[np.float64]
    standardised: NDArray[np.float64]
    rejected: NDArray[np.intp]
    converged: bool
    failure: str
    iterations: int
    chi_square: float
    condition: float


@dataclass(frozen=True)
class Identification:
    """What the measurements say of the parameters.

    Attributes
    ----------
    mechanism : Mechanism
        The calibrated one, with the standard deviation of each parameter.
    estimator : str
        What estimated it.
    covariance : ndarray, shape (legs p, legs p)
        Of all parameters, leg by leg. Where the residuals are larger than the declared noise
        explains, it is scaled up by chi-square per degree of freedom.
    legs : tuple of LegFit
        How each leg was fitted.
    converged : bool
        Whether every leg's estimator converged.
    residual_rms, residual_max : float
        Closures of all legs, m.
    doubts : tuple of str
        Reasons not to trust the estimate, apart from convergence; empty if there are none.
    """

    mechanism: Mechanism
    estimator: Estimator
    covariance: NDArray[np.float64]
    legs: tuple[LegFit, ...]
    converged: bool
    residual_rms: float
    residual_max: float
    doubts: tuple[str, ...]

    @property
    def trustworthy(self) -> bool:
        """Whether it converged and nothing speaks against it."""
        return self.converged and not self.doubts

    @property
    def correlation(self) -> NDArray[np.float64]:
        """Correlations of all parameters, shape (legs p, legs p)."""
        deviations = np.sqrt(np.diag(self.covariance))
        correlation: NDArray[np.float64] = self.covariance / np.outer(deviations, deviations)
        return correlation


def identify(
    mechanism: Mechanism,
    measurements: Measurements,
    estimator: Estimator = "implicit",
    *,
    poses: PoseUse = "all",
    loss: Loss = "none",
    loss_scale: float | None = None,
    noise: NoiseSettings | None = None,
    max_iterations: int = 100,
) -> Identification:
    """Identify the parameters of all legs from measured poses and readings.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, from which the estimators start.
    measurements : Measurements
        At least as many poses for a leg as it has parameters.
    estimator : {"implicit", "paper", "inverse", "joint"}
        Whitened closures per leg; the paper's Gauss-Newton on g - psi per leg (Eqs. 15, 24-26); the
        same cost by Levenberg-Marquardt; all legs together, maximum likelihood to first order.
    poses : {"all", "own"}
        Which poses a leg uses: all at which it was read, or those of its own set (the paper).
    loss : {"none", "huber", "cauchy", "tukey"}
        Robust loss.
    loss_scale : float, optional
        Where the loss bends, in standard deviations; by default where it keeps 95% efficiency on
        normal residuals (1.345, 2.385 and 4.685).
    noise : NoiseSettings, optional
        Of the measurements, by default the mechanism's.
    max_iterations : int
        Of each solve.

    Returns
    -------
    Identification

    Raises
    ------
    NotIdentifiableError
        For fewer poses than parameters.
    FailedFitError
        For an estimate that no mechanism can be, such as a negative length.
    SymkinError
        For measurements that do not fit the mechanism's shape.
    """
    noise = noise or mechanism.noise
    _require_poses(mechanism, measurements, poses)
    with fit_that_may_fail():
        result = _core.identify(
            mechanism.core,
            _core.MeasurementSet(
                measurements.poses, measurements.readings, (measurements.leg_sets - 1).tolist()
            ),
            getattr(_core.Estimator, estimator),
            getattr(_core.PoseUse, poses),
            noise_of(noise),
            getattr(_core.LossKind, loss),
            loss_scale or 0.0,
            max_iterations,
        )
    legs = tuple(_leg_fit(leg) for leg in result.legs)
    calibrated, covariance = calibrated_mechanism(
        mechanism, result.parameters, result.covariance, measurements.poses
    )
    return Identification(
        mechanism=calibrated,
        estimator=estimator,
        covariance=covariance,
        legs=legs,
        converged=result.converged,
        residual_rms=result.residual_rms,
        residual_max=result.residual_max,
        doubts=tuple(_doubts(result)),
    )


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


def _require_poses(mechanism: Mechanism, measurements: Measurements, poses: PoseUse) -> None:
    used = measurements
    if poses == "all":
        used = replace(measurements, leg_sets=np.zeros_like(measurements.leg_sets))
    unmeasured = sorted(set(range(len(mechanism.legs))) - set(used.measured_legs))
    if unmeasured:
        whose = "its" if len(unmeasured) == 1 else "their"
        raise NotIdentifiableError(
            f"no readings of {named_legs(unmeasured)}: {whose} parameters cannot be identified"
        )
    used.require(len(mechanism.parameter_names))


def _leg_fit(leg: _core.LegIdentification) -> LegFit:
    spare = leg.degrees_of_freedom
    return LegFit(
        rows=np.array(leg.rows, dtype=np.intp),
        residuals=leg.residuals,
        standardised=leg.standardised,
        rejected=np.array(leg.rejected, dtype=np.intp),
        converged=leg.converged,
        failure=leg.failure,
        iterations=leg.iterations,
        chi_square=leg.chi_square / spare if spare > 0 else float("nan"),
        condition=leg.condition,
    )


def _doubts(result: _core.Identification) -> list[str]:
    """What speaks against an estimate that may well have converged."""
    doubts = []
    for number, leg in enumerate(result.legs, 1):
        spare = leg.degrees_of_freedom
        if not np.isfinite(leg.condition) or leg.condition > _CONDITION_LIMIT:
            doubts.append(
                f"leg {number}: the poses hardly tell its parameters apart "
                f"(condition number {leg.condition:.3g})"
            )
        if spare < 1:
            doubts.append(f"leg {number}: no pose to spare, so the noise cannot be checked")
        elif leg.chi_square > 4 * spare:
            doubts.append(
                f"leg {number}: residuals are {np.sqrt(leg.chi_square / spare):.2g} times what the "
                "declared noise explains; the standard deviations are scaled up accordingly"
            )
        if len(leg.rejected) > 0.2 * len(leg.rows):
            doubts.append(
                f"leg {number}: the robust loss rejects {len(leg.rejected)} of its "
                f"{len(leg.rows)} poses"
            )
    return doubts
