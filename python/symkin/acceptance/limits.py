# SPDX-License-Identifier: MIT
"""Between what limits an error is that was measured with noise, and what that decides.

Decision rule: guard band of ISO 14253-1; near zero, and of root mean squares, exact limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.values import Array, Value, field, record

Verdict = Literal["pass", "fail", "undecided"]

RISK = 0.05  # of a verdict that is wrong, to either side
CONTRADICTED = 0.001  # of tables whose noise is as declared have so small errors
_DOUBLINGS, _HALVINGS = 200, 200
_NO_GREATER = 1e-14  # than its limit, relative


@record
class Decision(Value):
    """What an error well above its uncertainty decides, by the guard band of ISO 14253-1.

    Attributes
    ----------
    value, uncertainty, tolerance : float
        The error, its standard uncertainty and what it must not exceed, in one unit.
    guard : float
        The guard band.
    conformance_probability : float
        That the true error is within the tolerance.
    verdict : {"pass", "fail", "undecided"}
    """

    value: float
    uncertainty: float
    tolerance: float
    guard: float
    conformance_probability: float
    verdict: Verdict

    @property
    def acceptance_limit(self) -> float:
        """Up to here it conforms."""
        return self.tolerance - self.guard

    @property
    def rejection_limit(self) -> float:
        """From here on it does not."""
        return self.tolerance + self.guard


def decide(value: float, uncertainty: float, tolerance: float, risk: float = RISK) -> Decision:
    """Decide whether an error is within its tolerance, with a guard band to either side.

    Parameters
    ----------
    value, uncertainty, tolerance : float
        The error, its standard uncertainty and what it must not exceed, in one unit.
    risk : float
        Of a verdict that is wrong: the guard band is 1.645 uncertainties for 0.05.

    Raises
    ------
    SymkinError
        For a tolerance or an uncertainty that is none.
    """
    _require(uncertainty, tolerance)
    guard = _core.student_limit(2 * risk, math.inf) * uncertainty
    probability = 0.5 * math.erfc((value - tolerance) / (uncertainty * math.sqrt(2)))
    verdict = _verdict(value + guard, value - guard, tolerance)
    return Decision(value, uncertainty, tolerance, guard, probability, verdict)


@record
class RmsLimits(Value):
    """The root mean square of errors in space or in the plane, and what it decides.

    Attributes
    ----------
    observed : float
        With the noise of the measurement.
    corrected : float
        With the noise taken off its square.
    lower, upper : float
        Limits of the true one, each with the risk.
    uncertainty, tolerance : float
        Standard deviation of the coordinates' noise, root mean square, and what must not be
        exceeded.
    rows, degrees : int
        Errors, and their coordinates less those that a frame was fitted with.
    contradicted : bool
        Whether the errors are smaller than the declared noise alone would make them: no verdict.
    verdict : {"pass", "fail", "undecided"}
    """

    observed: float
    corrected: float
    lower: float
    upper: float
    uncertainty: float
    tolerance: float
    rows: int
    degrees: int
    contradicted: bool = field(default=False)
    verdict: Verdict = "undecided"


def limits_of_rms(
    errors: Array,
    uncertainty: float | Array,
    tolerance: float,
    *,
    fitted: int = 0,
    risk: float = RISK,
) -> RmsLimits:
    """Return limits of the root mean square of errors that normal noise was added to.

    The sum of squares over the noise's variance is a noncentral chi-square, whose noncentrality
    the true root mean square is. The upper limit is where so small a sum has `risk` times the
    probability that it has without any error: it is never nothing, however small the sum. This is
    exact where the noise is as large in all coordinates; else the sum has mean ``D + sum(u^2)`` and
    a variance of at most ``2 sum(u^4) + 4 max(u^2) D``, D the sum of the true squares, whose
    directions nobody knows: those of the chi-square that is taken for it.

    Parameters
    ----------
    errors : ndarray, shape (M, d)
        Of M poses, d coordinates of each.
    uncertainty : float or ndarray, shape (M, d)
        Standard deviation of the noise of each coordinate, or along the axes of its covariance.
    tolerance : float
        What must not be exceeded.
    fitted : int
        Coordinates of a frame that was fitted to these errors.
    risk : float
        Of a limit that is wrong, each.

    Raises
    ------
    SymkinError
        For a tolerance or an uncertainty that is none, or too few errors.
    """
    errors = np.asarray(errors, dtype=float)
    if errors.ndim != 2 or not np.isfinite(errors).all():
        raise SymkinError("errors are not one finite row of coordinates for each pose")
    deviations = np.asarray(uncertainty, dtype=float)
    if deviations.ndim and deviations.shape != errors.shape:
        raise SymkinError(
            f"uncertainty has shape {deviations.shape}; expected that of the errors, {errors.shape}"
        )
    for value in {float(deviations.min(initial=math.inf)), float(deviations.max(initial=0.0))}:
        _require(value, tolerance)
    rows, degrees = len(errors), errors.size - fitted
    if degrees < 1:
        raise SymkinError(
            f"{rows} poses have {errors.size} coordinates; expected more than the {fitted} that a "
            "frame is fitted with"
        )
    squares = float(np.sum(errors**2))
    noise = _Noise.of(np.broadcast_to(deviations, errors.shape), degrees)
    value = noise.chi_square(squares)

    def below(noncentrality: float) -> float:
        return _core.noncentral_chi_square(value, noise.degrees, noncentrality)

    contradicted = noise.below(squares) < CONTRADICTED
    without = below(0.0) if value > 0 else 0.0
    upper, lower = math.nan, math.nan
    if without > 0:
        upper = _rms(_falls_to(below, risk * without, value), noise.scale, rows)
        has_lower = without > 1 - risk
        lower = _rms(_falls_to(below, 1 - risk, value), noise.scale, rows) if has_lower else 0.0
    return RmsLimits(
        observed=math.sqrt(squares / rows),
        corrected=math.sqrt(max(squares - noise.total, 0.0) / rows),
        lower=lower,
        upper=upper,
        uncertainty=math.sqrt(noise.total / degrees),
        tolerance=tolerance,
        rows=rows,
        degrees=degrees,
        contradicted=contradicted,
        verdict="undecided" if contradicted else _verdict(upper, lower, tolerance),
    )


class _Noise(NamedTuple):
    """A sum of squares of normal noise, as a chi-square of so many degrees and a scale, moved."""

    variances: Array
    share: float  # of the coordinates, less those of a frame
    scale: float
    degrees: float

    @classmethod
    def of(cls, deviations: Array, degrees: int) -> _Noise:
        variances = deviations.ravel() ** 2
        share, largest = degrees / len(variances), float(variances.max())
        effective = share * float(np.sum((variances / largest) ** 2))
        return cls(variances, share, math.sqrt(largest), effective)

    @property
    def total(self) -> float:
        return self.share * float(self.variances.sum())

    def chi_square(self, squares: float) -> float:
        """What takes the place of the sum over the variance: of the same mean.

        Of less than that the chi-square that is as rarely so small, if it is more.
        """
        value = (squares - self.total) / self.scale**2 + self.degrees
        rarely = (
            self.below(squares) if value < self.degrees < self.share * len(self.variances) else 0
        )
        if not rarely:
            return value
        form = _core.QuadraticForm(np.ones(1), np.array([self.degrees]))
        return max(value, form.quantile(rarely))

    def below(self, squares: float) -> float:
        """Probability of a sum as small without any error."""
        degrees = np.full(len(self.variances), self.share)
        above = _core.QuadraticForm(self.variances, degrees).tail(np.array([squares]))
        return 1 - float(above[0])


def poses_for_share(share: float, confidence: float) -> int:
    """Return how many random poses, all within a tolerance, say that a share of all poses is.

    By Wilks: with this confidence, as n = ln(1 - confidence) / ln(share) and more do.
    """
    if not (0 < share < 1 and 0 < confidence < 1):
        raise SymkinError(
            f"the share is {share:g} and the confidence {confidence:g}; expected both between 0 "
            "and 1"
        )
    return math.ceil(math.log1p(-confidence) / math.log(share))


def _require(uncertainty: float, tolerance: float) -> None:
    for name, value in (("uncertainty", uncertainty), ("tolerance", tolerance)):
        if not 0 < value < math.inf:
            raise SymkinError(f"the {name} is {value:g}; expected more than 0")


def _verdict(upper: float, lower: float, tolerance: float) -> Verdict:
    if upper <= tolerance:
        return "pass"
    return "fail" if lower >= tolerance else "undecided"


def _rms(noncentrality: float, uncertainty: float, rows: int) -> float:
    return uncertainty * math.sqrt(noncentrality / rows)


def _falls_to(function: Callable[[float], float], level: float, start: float) -> float:
    """Where a falling function is at a level that it is above of at zero."""
    high = max(start, 1.0)
    for _ in range(_DOUBLINGS):
        if function(high) <= level:
            break
        high *= 2
    low = 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if high - low <= _NO_GREATER * high:
            break
        low, high = (middle, high) if function(middle) > level else (low, middle)
    return 0.5 * (low + high)
