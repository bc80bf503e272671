# SPDX-License-Identifier: MIT
"""What an estimator found, as data, before anybody judges it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Generic

import numpy as np
from numpy.typing import NDArray
from typing_extensions import TypeVar

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.estimate.assumed import Assumed
from symkin.estimate.conflict import DrawingConflict
from symkin.estimate.fitted_prior import FittedPrior
from symkin.estimate.options import EstimateOptions, Estimator
from symkin.estimate.parameters import Unknown
from symkin.estimate.problem import Rows
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames, NoiseSettings
from symkin.values import Array, FrozenMapping, Value, field, record

# What is identified: a mechanism, or what is derived from one, and the estimate has it again.
M = TypeVar("M", bound=Mechanism, default=Mechanism, covariant=True)


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

    derived: ClassVar[tuple[str, ...]] = ("chi_square_ratio",)

    legs: tuple[int, ...] = field(number=True)
    chi_square: float
    degrees_of_freedom: float
    limit: float
    least: float

    @classmethod
    def of(cls, fit: _core.GoodnessOfFit) -> GoodnessOfFit:
        """Of what the core says."""
        return cls(tuple(fit.legs), fit.chi_square, fit.degrees_of_freedom, fit.limit, fit.least)

    @property
    def unexplained(self) -> bool:
        """Whether the residuals are larger than the declared noise explains."""
        return self.chi_square > self.limit

    @property
    def chi_square_ratio(self) -> float:
        """Chi-square per degree of freedom; NaN without one."""
        spare = self.degrees_of_freedom
        return self.chi_square / spare if spare > 0 else float("nan")


def total_of(fits: Sequence[GoodnessOfFit]) -> GoodnessOfFit:
    """Chi-square of fits together, and what it exceeds, and falls short of, at most so often.

    Legs share the noise of the poses, so that their sum is no chi-square. But it exceeds the sum of
    the limits only where one of them exceeds its own.
    """
    if len(fits) == 1:
        return fits[0]
    judged = [fit for fit in fits if fit.degrees_of_freedom > 0]
    sums = (
        sum(getattr(fit, name) for fit in judged) if judged else float("nan")
        for name in ("limit", "least")
    )
    return GoodnessOfFit(
        tuple(leg for fit in fits for leg in fit.legs),
        sum(fit.chi_square for fit in judged),
        sum(fit.degrees_of_freedom for fit in fits),
        *sums,
    )


@record
class Latent(Value):
    """Where the platform was at each pose, and what is to be said of each observation.

    Attributes
    ----------
    poses : ndarray, shape (N, coordinates)
        In the robot's own frame; NaN where no start was found.
    reading_errors : ndarray, shape (N, legs)
        True less read, in the sensor's unit.
    conditions : ndarray of int, shape (N,)
        How many equations each pose brings.
    rows : Rows
        Of the single observations.
    """

    poses: Array
    reading_errors: Array
    conditions: NDArray[np.intp]
    rows: Rows


@record
class Found(Value, Generic[M]):
    """The fields of `Estimate`, and what follows from them at once."""

    derived: ClassVar[tuple[str, ...]] = (
        *("chi_square", "degrees_of_freedom", "chi_square_ratio", "limit", "least"),
    )

    mechanism: M = field(private=True)
    nominal: M = field(private=True)
    measurements: Measurements = field(private=True)
    options: EstimateOptions = field(private=True)
    noise: NoiseSettings
    unknowns: tuple[Unknown, ...] = field(private=True)
    names: tuple[str, ...]
    covariance: Array
    goodness: tuple[GoodnessOfFit, ...]
    converged: bool = field(private=True)
    failure: str
    iterations: int
    rank: int
    data_rank: int
    unseen: tuple[str, ...] = ()
    unseen_directions: Array = field(private=True, default_factory=lambda: np.zeros((0, 0)))
    gauge: str = ""
    legs: tuple[LegFit, ...] = field(private=True, default=())
    latent: Latent | None = field(private=True, default=None)
    rejected: tuple[tuple[int, str], ...] = field(private=True, default=())
    aside: tuple[int, ...] = field(private=True, default=())
    student_degrees: float = field(private=True, default=math.inf)
    unguarded: tuple[int, ...] = field(private=True, default=())
    model_covariance: Array = field(private=True, default_factory=lambda: np.zeros((0, 0)))
    conflict: DrawingConflict | None = None
    noise_factor: float = 1.0
    conflict_factor: float = 1.0
    assumed: tuple[Assumed, ...] = ()
    session_noise: tuple[float, ...] = ()
    relations: Array = field(private=True, default_factory=lambda: np.zeros((0, 0)))
    fitted_prior: FittedPrior | None = None

    @property
    def own_priors(self) -> Array:
        """Standard deviations of the priors of each unknown, beside `relations`; NaN without."""
        priors = np.array([each.prior for each in self.first_unknowns])
        if self.fitted_prior is not None:
            joint = np.isin(self.names, self.fitted_prior.names)
            priors[joint] *= self.fitted_prior.widening
        return priors

    @property
    def prior_rows(self) -> Array:
        """Rows that the priors make of the unknowns' changes independent and standard normal."""
        priors = self.own_priors
        own = np.diag(np.nan_to_num(1 / priors))[np.isfinite(priors)]
        return np.vstack([own, self.relations]) if len(self.relations) else own

    @property
    def noise_is_estimated(self) -> bool:
        """Whether it was, of all observations or of every session."""
        return self.options.noise == "estimate" or bool(self.session_noise)

    @property
    def observed_covariance(self) -> Array:
        """The part of `covariance` that is not what was assumed: of noise, priors and factors."""
        known = np.array(self.covariance)
        for each in self.assumed:
            known -= each.deviation**2 * np.outer(each.moves, each.moves)
        return known

    @property
    def seen(self) -> Latent:
        """Where the platform was, and the observations; of `Estimate`, leg by leg too."""
        assert self.latent is not None
        return self.latent

    @property
    def latent_poses(self) -> Array:
        """Where the platform was, in the robot's own frame, (N, coordinates); NaN if unknown."""
        return self.seen.poses

    @property
    def reading_errors(self) -> Array:
        """True less read, in the sensor's unit, shape (N, legs)."""
        return self.seen.reading_errors

    @property
    def conditions(self) -> NDArray[np.intp]:
        """How many equations each pose brings, shape (N,)."""
        return self.seen.conditions

    @property
    def rows(self) -> Rows:
        """The single observations; leg by leg, the closures that they make."""
        return self.seen.rows

    @property
    def estimator(self) -> Estimator:
        """What estimated it."""
        return self.options.estimator

    @property
    def params(self) -> Mapping[str, Unknown]:
        """The unknowns, and what was held, by name: ``params["leg1.base_radius"].value``."""
        return FrozenMapping({each.name: each for each in self.unknowns})

    @property
    def frames(self) -> Frames:
        """Where the frames are."""
        return self.mechanism.frames or Frames()

    @property
    def chi_square(self) -> float:
        """Of all residuals and priors: the sum over the fits, see `goodness`."""
        return total_of(self.goodness).chi_square

    @property
    def degrees_of_freedom(self) -> float:
        """Of chi-square; with a loss rarely a whole number."""
        return total_of(self.goodness).degrees_of_freedom

    @property
    def chi_square_ratio(self) -> float:
        """Chi-square per degree of freedom, about 1 for a sound robot; NaN without one."""
        return total_of(self.goodness).chi_square_ratio

    @property
    def limit(self) -> float:
        """What chi-square exceeds in at most one of 1000 sound robots."""
        return total_of(self.goodness).limit

    @property
    def least(self) -> float:
        """What chi-square falls short of in at most one of 1000 sound robots."""
        return total_of(self.goodness).least

    @property
    def floats(self) -> bool:
        """Whether the frames of measuring device or target were unknown."""
        return any(name.startswith(("base.", "target.")) for name in self.names)

    @property
    def unexplained(self) -> bool:
        """Whether the residuals of any fit are larger than noise and priors explain."""
        return any(each.unexplained for each in self.goodness)

    @property
    def spread(self) -> float:
        """Factor on the declared noise, 1 if that explains the residuals."""
        ratios = [each.chi_square_ratio for each in self.goodness if each.unexplained]
        return math.sqrt(max(ratios, default=1.0))

    @property
    def first_unknowns(self) -> list[Unknown]:
        """Of each column that was estimated, the first unknown that moves with it."""
        found: dict[int, Unknown] = {}
        for each in self.unknowns:
            found.setdefault(each.column, each)
        return [found[column] for column in range(len(self.names))]

    @property
    def correlation(self) -> Array:
        """Correlations of `names`, shape (columns, columns)."""
        deviations = np.sqrt(np.diag(self.covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.covariance / np.outer(deviations, deviations))

    @property
    def parameter_covariance(self) -> Array:
        """Covariance of all parameters, leg by leg; zero of those that are held, (legs p)^2."""
        has = self.nominal.has_parameter
        by = np.zeros((*has.shape, len(self.names)))
        params = self.params
        for leg, index in np.argwhere(has).tolist():
            name = f"leg{leg + 1}.{self.nominal.parameter_names[index]}"
            for column, factor in params[name].moves if name in params else ():
                by[leg, index, column] = factor
        by = by.reshape(-1, len(self.names))
        return np.asarray(by @ self.covariance @ by.T)

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
    def widened(self) -> float:
        """Times the model's deviations of what priors alone hold are those that are printed."""
        return math.sqrt(max(self.noise_factor, self.conflict_factor))

    @property
    def noise_degrees(self) -> float:
        """Degrees of freedom of the noise that the deviations rest on; infinite if declared."""
        if self.noise_is_estimated and self.degrees_of_freedom > 0:
            return min(self.student_degrees, self.degrees_of_freedom)
        return self.student_degrees

    @property
    def interval(self) -> float:
        """Standard deviations to either side that hold 95% of the errors."""
        return _core.student_limit(0.05, self.noise_degrees)

    def columns(self) -> Mapping[str, Any]:
        """Return the unknowns, and what was held, a row each."""
        numbers = (
            *("nominal", "value", "change", "deviation", "tolerance", "prior"),
            "change_in_tolerances",
        )
        found = {
            name: [getattr(each, name) for each in self.unknowns]
            for name in ("name", "unit", *numbers, "status")
        }
        return {
            {"deviation": "standard_deviation"}.get(name, name): (
                np.array(column) if name in numbers else column
            )
            for name, column in found.items()
        }
