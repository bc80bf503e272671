# SPDX-License-Identifier: MIT
"""The joint estimate as the solver leaves it, and the mechanism that it describes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.homes import with_usable_home
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, SymmetryError
from symkin.estimate.blunders import estimated_noise, without_blunders
from symkin.estimate.fit import as_mechanism
from symkin.estimate.problem import JointOptions, Problem
from symkin.model.canonical import canonical
from symkin.model.core_setup import frames_of, scalar_values
from symkin.model.file_frames import with_correlations
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.model.symmetry import verify_declared

__all__ = ["Solution", "settled", "solved"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Solution:
    """What the solver found.

    Attributes
    ----------
    problem : Problem
        Without blunders, and with the noise that was estimated, if any.
    fit : JointFit
        Of it.
    gauge : str
        How directions that nothing shows were settled; empty if there are none.
    rejected : tuple of (int, str)
        Rows of the measurements, from 0, and what of them was left out as a blunder.
    values, deviations : ndarray
        Of all scalars; NaN deviations of those that are held.
    mechanism : Mechanism
        The calibrated one.
    """

    problem: Problem
    fit: _core.JointFit
    gauge: str
    rejected: tuple[tuple[int, str], ...]
    values: Array
    deviations: Array
    mechanism: Mechanism


def solved(mechanism: Mechanism, measurements: Measurements, options: JointOptions) -> Solution:
    """Estimate what is unknown; the errors are those of `identify`."""
    problem, fit, gauge = Problem.of(mechanism, measurements, options).resolved()
    rejected: tuple[tuple[int, str], ...] = ()
    if options.loss_per == "reading":
        problem, fit, rejected = without_blunders(problem)
    if options.noise == "estimate":
        problem, fit = estimated_noise(problem, fit)
    values, deviations, calibrated = _calibrated(mechanism, problem, fit)
    return Solution(problem, fit, gauge, rejected, values, deviations, calibrated)


def settled(robot: Mechanism, noise: NoiseSettings, measurements: Measurements) -> Problem:
    """Observations of a calibrated robot, of which only the poses are unknown."""
    held = JointOptions(free=("leg1.sensor_offset",), prior={"leg1.sensor_offset": _HELD})
    return Problem.of(robot.replace(identification=None, noise=noise), measurements, held)


def _calibrated(
    nominal: Mechanism, problem: Problem, fit: _core.JointFit
) -> tuple[Array, Array, Mechanism]:
    """Values and deviations of all scalars, and the mechanism that they describe."""
    setup, layout = fit.setup, problem.layout
    values = scalar_values(setup)
    with np.errstate(invalid="ignore"):
        of_columns = np.append(np.sqrt(np.diag(fit.covariance)), np.nan)
    deviations = of_columns[layout.column]
    legs, count = len(nominal.legs), len(nominal.parameter_names)
    parameters, signs = canonical(nominal, setup.parameters)
    by_leg = deviations[: legs * (count + 3)].reshape(legs, count + 3)
    by_value = values[: legs * (count + 3)].reshape(legs, count + 3)
    by_value[:, :count] = parameters
    made = as_mechanism(nominal.replace(curvature=None), parameters, by_leg[:, :count])
    of_legs = layout.column[: legs * (count + 3)].reshape(legs, count + 3)[:, :count].ravel()
    covariance = np.pad(fit.covariance, (0, 1))  # the column of what is held
    made = with_correlations(made, covariance[np.ix_(of_legs, of_legs)] * np.outer(signs, signs))
    made = _with_symmetry(made, nominal)
    latent = fit.poses[np.isfinite(fit.poses).all(axis=1)]
    if not len(latent):
        raise FailedFitError("no measured pose could be explained at all: see units, order, signs")
    made = with_usable_home(made, latent)
    with_frames = nominal.frames is not None or any(
        name.partition(".")[0][:3] != "leg" for name in layout.names if "." in name
    )
    return (
        values,
        deviations,
        made.replace(
            frames=frames_of(nominal, setup) if with_frames else None,
            curvature=setup.curvature,
            noise=problem.noise,
        ),
    )


def _with_symmetry(made: Mechanism, nominal: Mechanism) -> Mechanism:
    """Keep the declared symmetry where the estimate still has it."""
    if nominal.symmetry is None:
        return made
    declared = made.replace(symmetry=nominal.symmetry)
    try:
        verify_declared(declared)
    except SymmetryError:
        return made
    return declared


_HELD = 1e-12  # m or rad: a prior that is as good as none of it being free
