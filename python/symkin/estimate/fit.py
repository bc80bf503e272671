# SPDX-License-Identifier: MIT
"""Fits of the parameters to measurements, and the mechanisms that they describe."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Generic, Literal, Self, cast

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypeVar

from symkin import _core
from symkin.analysis.checks import undefined_angles
from symkin.analysis.homes import with_usable_home
from symkin.analysis.observability import with_combinations
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, MechanismError, NotIdentifiableError, named_legs, one_of
from symkin.model.canonical import canonical
from symkin.model.file_frames import with_correlations, with_moved_workspace
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.model.tolerances import noise_of, parameter_tolerances
from symkin.values import Value, field, record

__all__ = [
    "FALSE_ALARMS",
    "UNKNOWN",
    "Estimator",
    "Fit",
    "FitOptions",
    "GoodnessOfFit",
    "LegFit",
    "Loss",
    "PoseUse",
    "as_mechanism",
    "calibrated_mechanism",
    "changed_settings",
    "core_measurements",
    "unguarded_note",
]

Array = NDArray[np.float64]
# What is identified: a mechanism, or what is derived from one, and the estimate has it again.
M = TypeVar("M", bound=Mechanism, default=Mechanism, covariant=True)
Estimator = Literal["paper", "inverse", "implicit", "joint"]
Loss = Literal["none", "huber", "cauchy", "tukey"]
PoseUse = Literal["all", "own"]

# Share of sound robots that one kind of test doubts, such as that of all parameters' distances.
FALSE_ALARMS = 1e-3
# Times the tolerance: a parameter of such a standard deviation is in effect not measured.
UNKNOWN = 10

_FARTHEST = 1e12  # m and rad, which no file may hold either
_LOOK_FOR = (
    "look for readings in another unit, of another leg, or with another sign, zero or working mode "
    "than the mechanism has, and for poses in another unit or frame"
)


@record
class FitOptions(Value):
    """How parameters are estimated; the attributes are the arguments of `identify`."""

    estimator: Estimator = "implicit"
    poses: PoseUse = "all"
    loss: Loss = "none"
    loss_scale: float | None = None
    noise: NoiseSettings | None = None
    max_iterations: int = 100

    def __post_init__(self) -> None:
        """Refuse words that mean nothing, naming those that do."""
        for name, choices in (("estimator", Estimator), ("poses", PoseUse), ("loss", Loss)):
            one_of(name, getattr(self, name), choices)


@record
class LegFit(Value):
    """How one leg was fitted.

    Attributes
    ----------
    converged : bool
        Whether the estimator converged, and
    failure : str
        why not.
    iterations : int
        Accepted steps of the solver.
    rows : ndarray of int
        Rows of the measurements that it used.
    rejected : ndarray of int
        Rows whose weight the robust loss put below one half.
    residuals : ndarray
        Closures at the estimate, m, one a row (k a row where a leg has k closures).
    standardised : ndarray
        Over their standard deviation from the declared noise: standard normal if all is right. Of
        several closures a row each less what those before it say of it.
    chi_square : float
        Per degree of freedom, of the leg's own fit or, with the estimator `joint`, of all legs': 1
        is what the declared noise explains; NaN without a degree of freedom.
    condition : float
        Of the scaled Jacobian.
    student_degrees : float
        Of Student's t, which errors over their standard deviations follow; infinite without a loss,
        where the standard deviations are those of the declared noise.
    unguarded : tuple of int
        Rows at which the robust loss would not see a gross error.
    """

    converged: bool
    failure: str
    iterations: int
    rows: NDArray[np.intp] = field(private=True)
    rejected: NDArray[np.intp] = field(private=True)
    residuals: Array = field(private=True)
    standardised: Array = field(private=True)
    chi_square: float = field(unit="per_degree_of_freedom")
    condition: float
    student_degrees: float = field(private=True, default=math.inf)
    unguarded: tuple[int, ...] = field(private=True, default=())

    @property
    def interval(self) -> float:
        """Standard deviations to either side that hold 95% of the errors."""
        return _core.student_limit(0.05, self.student_degrees)

    @property
    def closure_rows(self) -> NDArray[np.intp]:
        """The row of each residual."""
        return np.repeat(self.rows, len(self.residuals) // max(len(self.rows), 1))

    @property
    def residual_rms(self) -> float:
        """Root mean square of the closures, m or rad."""
        return float(np.sqrt(np.mean(self.residuals**2))) if self.residuals.size else float("nan")


@record
class GoodnessOfFit(Value):
    """Chi-square of one least-squares problem.

    Attributes
    ----------
    legs : tuple of int
        The legs (from 0) that were fitted together: one, or all with the estimator `joint`.
    chi_square : float
        Of the whitened closures at the estimate; with a loss, of the poses that it keeps, brought
        to the scale of closures that nothing truncates.
    degrees_of_freedom : int or float
        Closures less parameters; with a loss, of that scale, rarely a whole number.
    limit, least : float
        What it exceeds, and falls short of, in one of 1000 sound robots (all problems of a robot
        together); NaN without a degree of freedom.
    """

    legs: tuple[int, ...] = field(number=True)
    chi_square: float
    degrees_of_freedom: float
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


@record
class Fit(Value, Generic[M]):
    """An estimate of the parameters.

    Attributes
    ----------
    mechanism : Mechanism
        The calibrated one, with the standard deviation of each parameter.
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
    options : FitOptions
        How.
    """

    mechanism: M
    covariance: Array
    legs: tuple[LegFit, ...]
    goodness: tuple[GoodnessOfFit, ...]
    converged: bool
    residual_rms: float
    residual_max: float
    nominal: M
    measurements: Measurements
    options: FitOptions

    @classmethod
    def of(
        cls, mechanism: Mechanism, measurements: Measurements, options: FitOptions | None = None
    ) -> Self:
        """Estimate the parameters; arguments and errors are those of `identify`."""
        options = options or FitOptions()
        _require_poses(mechanism, measurements, options.poses)
        try:
            result = _core.identify(
                mechanism.core,
                core_measurements(measurements),
                _core.Estimator.__members__[options.estimator],
                _core.PoseUse.__members__[options.poses],
                noise_of(options.noise or mechanism.noise),
                options.loss,
                options.loss_scale or 0.0,
                options.max_iterations,
            )
        except NotIdentifiableError as error:
            raise _named(error, mechanism) from None
        calibrated, covariance = calibrated_mechanism(
            mechanism, result.parameters, result.covariance, measurements.poses
        )
        if result.converged:
            _require_deviations(calibrated)
        goodness = tuple(
            GoodnessOfFit(
                tuple(fit.legs), fit.chi_square, fit.degrees_of_freedom, fit.limit, fit.least
            )
            for fit in result.goodness
        )
        return cls(
            mechanism=cast("M", calibrated),  # of the class of the nominal one
            covariance=covariance,
            legs=tuple(_leg_fit(number, leg, goodness) for number, leg in enumerate(result.legs)),
            goodness=goodness,
            converged=result.converged,
            residual_rms=result.residual_rms,
            residual_max=result.residual_max,
            nominal=cast("M", mechanism),
            measurements=measurements,
            options=options,
        )

    @property
    def estimator(self) -> Estimator:
        """What estimated it."""
        return self.options.estimator

    @property
    def noise(self) -> NoiseSettings:
        """What the measurements were taken to have."""
        return self.options.noise or self.nominal.noise

    @property
    def chi_square(self) -> float:
        """Chi-square per degree of freedom of all fits together."""
        spare = sum(max(fit.degrees_of_freedom, 0) for fit in self.goodness)
        return sum(fit.chi_square for fit in self.goodness) / max(spare, 1)

    @property
    def failure(self) -> str:
        """Which legs' estimators did not converge, and why; empty if all did."""
        if self.converged:
            return ""
        failures = [
            f"leg {number}" + (f" ({leg.failure})" if leg.failure else "")
            for number, leg in enumerate(self.legs, 1)
            if not leg.converged
        ]
        return ", ".join(failures) or "the joint estimate of all legs"

    @property
    def changes(self) -> Array:
        """Parameters less those of the drawing, shape (legs, p)."""
        return np.asarray(self.mechanism.parameters - self.nominal.parameters)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the parameters, shape (legs, p); NaN of those that are held."""
        found = self.mechanism.deviations
        return np.full(self.nominal.parameters.shape, np.nan) if found is None else found

    @property
    def correlation(self) -> Array:
        """Correlations of all parameters, shape (legs p, legs p); NaN of those that are held."""
        deviations = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore"):
            return np.asarray(self.covariance / np.outer(deviations, deviations))


def core_measurements(measurements: Measurements) -> _core.MeasurementSet:
    """Measurements as the core takes them."""
    return _core.MeasurementSet(
        measurements.poses,
        measurements.readings,
        measurements.leg_sets.astype(np.int64, copy=False),
    )


def _require_poses(mechanism: Mechanism, measurements: Measurements, poses: PoseUse) -> None:
    measurements.require_legs(len(mechanism.legs))
    measurements.require_complete()
    used = measurements.for_all_legs() if poses == "all" else measurements
    unmeasured = sorted(set(range(len(mechanism.legs))) - set(used.measured_legs))
    if unmeasured:
        whose = "its" if len(unmeasured) == 1 else "their"
        origin = f"{measurements.source}: " if measurements.source else ""
        raise NotIdentifiableError(
            f"{origin}no readings of {named_legs(unmeasured)}: {whose} parameters cannot be "
            "identified"
        )
    used.require([-(-count // mechanism.closures) for count in mechanism.estimated_counts])


def _require_deviations(calibrated: Mechanism) -> None:
    found = np.isfinite(np.asarray(calibrated.deviations))
    unknown = np.argwhere(calibrated.is_estimated & ~found)
    if len(unknown):
        leg, parameter = unknown[0]
        raise NotIdentifiableError(
            f"leg {leg + 1}: {calibrated.parameter_names[parameter]} has no finite standard "
            "deviation: the measurements do not determine it"
        )


def _named(error: NotIdentifiableError, mechanism: Mechanism) -> NotIdentifiableError:
    """The error with the combinations of parameters, in tolerances, that nothing shows."""
    names = list(mechanism.parameter_names)
    scales = parameter_tolerances(mechanism)
    legs, scale = len(mechanism.legs), scales.max(axis=0)
    if len(getattr(error, "null_directions", ())) == scales.size:  # of all legs together
        names = [f"{name} of leg {leg + 1}" for leg in range(legs) for name in names]
        scale = scales.ravel()
    named = with_combinations(error, names, scale)
    causes = [
        each for leg in range(len(mechanism.legs)) for each in undefined_angles(mechanism, leg)
    ]
    return NotIdentifiableError("; ".join([str(named), *causes]))


def _leg_fit(
    number: int, leg: _core.LegIdentification, goodness: tuple[GoodnessOfFit, ...]
) -> LegFit:
    return LegFit(
        converged=leg.converged,
        failure=leg.failure,
        iterations=leg.iterations,
        rows=np.array(leg.rows, dtype=np.intp),
        rejected=np.array(leg.rejected, dtype=np.intp),
        residuals=leg.residuals,
        standardised=leg.standardised,
        chi_square=next(fit.per_degree for fit in goodness if number in fit.legs),
        condition=leg.condition,
        student_degrees=leg.student_degrees,
        unguarded=tuple(leg.unguarded),
    )


def unguarded_note(measurements: Measurements, rows: Sequence[int]) -> Iterator[str]:
    """Say where the loss would not see a gross error."""
    if rows:
        numbers = ", ".join(map(str, measurements.row_numbers[list(rows)]))
        which = f"row {numbers}" if len(rows) == 1 else f"any of the rows {numbers}"
        yield (
            f"a gross error in {which} would not be seen, since the estimate follows it: measure "
            "more poses near it"
        )


def calibrated_mechanism(
    nominal: Mechanism, parameters: Array, covariance: Array, poses: Array
) -> tuple[Mechanism, Array]:
    """Return the mechanism that an estimate describes, and the covariance of its parameters.

    Points are given by radii that are not negative and angles near the nominal ones; where a radius
    changes its sign, its covariances do. Where the frames of the measurements are others than the
    nominal ones, home and the workspace's box move with them; see also `with_usable_home`.
    """
    values, signs = canonical(nominal, parameters)
    covariance = covariance * np.outer(signs, signs)
    made = as_mechanism(nominal, values, np.sqrt(np.diag(covariance)).reshape(values.shape))
    made = with_correlations(made, covariance)
    return with_usable_home(with_moved_workspace(nominal, made), poses), covariance


def as_mechanism(nominal: Mechanism, values: Array, deviations: Array) -> Mechanism:
    """Return the mechanism with parameters (legs, p) that were found, without its symmetry.

    What is held has no standard deviation.

    Raises
    ------
    FailedFitError
        If no mechanism has such parameters.
    """
    far = np.argwhere(~(np.abs(values) < _FARTHEST))
    if len(far):
        leg, parameter = far[0]
        raise FailedFitError(
            f"the estimate ran away: leg {leg + 1}, {nominal.parameter_names[parameter]} = "
            f"{values[leg, parameter]:.3g}; {_LOOK_FOR}"
        )
    legs = range(len(nominal.legs))
    given = np.array([[role.is_given for role in nominal.parameter_roles(leg)] for leg in legs])
    known = nominal.is_estimated | (given & (deviations > 0))  # given, but freed
    deviations = np.where(known, deviations, np.nan)
    try:
        made = nominal.with_parameters(values, deviations, symmetry=None)
    except MechanismError as error:
        raise FailedFitError(
            f"the estimate is no mechanism: {error}. {_LOOK_FOR.capitalize()}"
        ) from error
    return with_correlations(made, None)


def changed_settings(nominal: Mechanism, calibrated: Mechanism) -> list[str]:
    """Say in sentences what was changed besides the parameters, and why."""
    before, after = nominal.workspace, calibrated.workspace
    changes = []
    if before is not None and after is None:
        changes.append("The workspace is left out, since the legs found reach no measured pose.")
    elif before is not None and after is not None and after != before:
        if (after.lower, after.upper) == (before.lower, before.upper):
            changes.append("Home is a measured pose, since the legs found do not suit the old one.")
        else:
            changes.append("Home and workspace are moved, as the frames are not the nominal ones.")
    if calibrated.joint_limits != nominal.joint_limits:
        changes.append("The joint limits are left out, since the zeros found do not suit them.")
    return changes
