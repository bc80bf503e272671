# SPDX-License-Identifier: MIT
"""Identification of the parameters from measurements."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.checks import undefined_angles
from symkin.errors import FailedFitError, NotIdentifiableError, named_legs, one_of
from symkin.identification.calibrated import calibrated_mechanism
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import noise_of, tolerances_of, with_combinations
from symkin.settings import NoiseSettings

if TYPE_CHECKING:
    from symkin.identification.diagnosis import Diagnosis

__all__ = [
    "Estimator",
    "GoodnessOfFit",
    "Identification",
    "LegFit",
    "Loss",
    "PoseUse",
    "identify",
]

Estimator = Literal["paper", "inverse", "implicit", "joint"]
Loss = Literal["none", "huber", "cauchy", "tukey"]
PoseUse = Literal["all", "own"]


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
        Accepted steps of the solver.
    chi_square : float
        Per degree of freedom, of the leg's own fit or, with the estimator `joint`, of all legs': 1
        is what the declared noise explains; NaN without a degree of freedom.
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
class GoodnessOfFit:
    """Chi-square of one least-squares problem.

    Attributes
    ----------
    legs : tuple of int
        The legs (from 0) that were fitted together: one, or all with the estimator `joint`.
    chi_square : float
        Of the whitened closures at the estimate, without poses that the loss rejects.
    degrees_of_freedom : int
        Closures less parameters.
    limit, least : float
        What it exceeds, and falls short of, in one of 1000 sound robots (all problems of a robot
        together); NaN without a degree of freedom.
    """

    legs: tuple[int, ...]
    chi_square: float
    degrees_of_freedom: int
    limit: float
    least: float

    @property
    def unexplained(self) -> bool:
        """Whether the residuals are larger than the declared noise explains."""
        return self.chi_square > self.limit

    @property
    def per_degree(self) -> float:
        """Chi-square per degree of freedom; NaN without one."""
        spare = self.degrees_of_freedom
        return self.chi_square / spare if spare > 0 else float("nan")


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
        explains (`GoodnessOfFit.unexplained`), that of `joint` is scaled up by chi-square per
        degree of freedom; that of the others is the jackknife's, from the residuals of all legs.
    legs : tuple of LegFit
        How each leg was fitted.
    goodness : tuple of GoodnessOfFit
        Chi-square of each fit: one a leg, or one of all legs with the estimator `joint`.
    converged : bool
        Whether every leg's estimator converged.
    residual_rms, residual_max : float
        Closures of all legs, m.
    nominal : Mechanism
        From which the estimators started.
    measurements : Measurements
        What was fitted.
    noise : NoiseSettings
        What the measurements were taken to have.
    options : dict
        Further arguments of `identify`: poses, loss, loss_scale, max_iterations.
    """

    mechanism: Mechanism
    estimator: Estimator
    covariance: NDArray[np.float64]
    legs: tuple[LegFit, ...]
    goodness: tuple[GoodnessOfFit, ...]
    converged: bool
    residual_rms: float
    residual_max: float
    nominal: Mechanism = field(repr=False)
    measurements: Measurements = field(repr=False)
    noise: NoiseSettings = field(repr=False)
    options: dict[str, Any] = field(repr=False)

    @cached_property
    def diagnosis(self) -> Diagnosis:
        """What the residuals and the parameters say of the model and of the measurements."""
        from symkin.identification.diagnosis import diagnose

        return diagnose(self)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons not to trust the estimate, apart from convergence; empty if there are none.

        All tests together raise one in fewer than 1 of 100 sound robots.
        """
        return self.diagnosis.doubts

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
        For fewer poses than parameters, or for poses and readings that leave a combination of
        parameters without effect; names the combination.
    FailedFitError
        For an estimate that no mechanism can be, such as a negative length.
    SymkinError
        For measurements that do not fit the mechanism's shape.
    """
    try:
        return identify_once(
            mechanism,
            measurements,
            estimator,
            poses=poses,
            loss=loss,
            loss_scale=loss_scale,
            noise=noise,
            max_iterations=max_iterations,
        )
    except FailedFitError as error:
        raise _explained(error, mechanism, measurements) from error


def identify_once(
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
    """Identify without looking for what may be wrong with measurements that allow no estimate."""
    noise = noise or mechanism.noise
    _require_poses(mechanism, measurements, poses)
    try:
        result = _core.identify(
            mechanism.core,
            core_measurements(measurements),
            one_of("estimator", estimator, _core.Estimator.__members__),
            one_of("poses", poses, _core.PoseUse.__members__),
            noise_of(noise),
            one_of("loss", loss, _core.LossKind.__members__),
            loss_scale or 0.0,
            max_iterations,
        )
    except NotIdentifiableError as error:
        raise _named(error, mechanism) from None
    calibrated, covariance = calibrated_mechanism(
        mechanism, result.parameters, result.covariance, measurements.poses
    )
    deviations = np.sqrt(np.diag(covariance)).reshape(result.parameters.shape)
    if result.converged and not np.isfinite(deviations).all():
        leg, parameter = np.argwhere(~np.isfinite(deviations))[0]
        raise NotIdentifiableError(
            f"leg {leg + 1}: {mechanism.parameter_names[parameter]} has no finite standard "
            "deviation: the measurements do not determine it"
        )
    goodness = tuple(_goodness(each) for each in result.goodness)
    return Identification(
        mechanism=calibrated,
        estimator=estimator,
        covariance=covariance,
        legs=tuple(_leg_fit(number, leg, goodness) for number, leg in enumerate(result.legs)),
        goodness=goodness,
        converged=result.converged,
        residual_rms=result.residual_rms,
        residual_max=result.residual_max,
        nominal=mechanism,
        measurements=measurements,
        noise=noise,
        options={
            "poses": poses,
            "loss": loss,
            "loss_scale": loss_scale,
            "max_iterations": max_iterations,
        },
    )


def core_measurements(measurements: Measurements) -> _core.MeasurementSet:
    """Measurements as the core takes them."""
    return _core.MeasurementSet(
        measurements.poses, measurements.readings, measurements.leg_sets.tolist()
    )


def _require_poses(mechanism: Mechanism, measurements: Measurements, poses: PoseUse) -> None:
    used = measurements.for_all_legs() if poses == "all" else measurements
    unmeasured = sorted(set(range(len(mechanism.legs))) - set(used.measured_legs))
    if unmeasured:
        whose = "its" if len(unmeasured) == 1 else "their"
        raise NotIdentifiableError(
            f"no readings of {named_legs(unmeasured)}: {whose} parameters cannot be identified"
        )
    used.require(len(mechanism.parameter_names))


def _named(error: NotIdentifiableError, mechanism: Mechanism) -> NotIdentifiableError:
    """The error with the combinations of parameters, in tolerances, that nothing shows."""
    scale = tolerances_of(mechanism.tolerances).deviations(mechanism.core, 0)
    named = with_combinations(error, mechanism.parameter_names, scale)
    causes = [
        each for leg in range(len(mechanism.legs)) for each in undefined_angles(mechanism, leg)
    ]
    return NotIdentifiableError("; ".join([str(named), *causes]))


def _explained(
    error: FailedFitError, mechanism: Mechanism, measurements: Measurements
) -> FailedFitError:
    """The error with what may be wrong with the measurements."""
    from symkin.identification.corrections import better_readings

    causes = better_readings(mechanism, measurements)
    return FailedFitError(f"{error}. Likely cause: {causes[0]}") if causes else error


def _goodness(fit: _core.GoodnessOfFit) -> GoodnessOfFit:
    return GoodnessOfFit(
        legs=tuple(fit.legs),
        chi_square=fit.chi_square,
        degrees_of_freedom=fit.degrees_of_freedom,
        limit=fit.limit,
        least=fit.least,
    )


def _leg_fit(
    number: int, leg: _core.LegIdentification, goodness: tuple[GoodnessOfFit, ...]
) -> LegFit:
    return LegFit(
        rows=np.array(leg.rows, dtype=np.intp),
        residuals=leg.residuals,
        standardised=leg.standardised,
        rejected=np.array(leg.rejected, dtype=np.intp),
        converged=leg.converged,
        failure=leg.failure,
        iterations=leg.iterations,
        chi_square=next(fit.per_degree for fit in goodness if number in fit.legs),
        condition=leg.condition,
    )
