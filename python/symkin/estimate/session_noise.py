# SPDX-License-Identifier: MIT
"""The noise of every session, as so many times the declared one."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.errors import SymkinError
from symkin.estimate.covariates import sessions_of
from symkin.estimate.problem import OBSERVED, Problem, Rows
from symkin.model.settings import NoiseSettings
from symkin.values import Array

_STEPS = 30
_STILL = 1e-3  # change of a factor's logarithm, in its own standard deviations


def noise_of_sessions(
    problem: Problem, fit: _core.JointFit
) -> tuple[Problem, _core.JointFit, tuple[float, ...]]:
    """Estimate it with the unknowns, by restricted maximum likelihood.

    At its maximum the squared residuals of each session, in standard deviations, add up to the
    redundancies of its rows: a fixed point that is iterated. All deviations of a session change
    alike, those that rows have of their own too; what is exact stays exact. Returns the problem and
    its fit with the deviations that were found in the measurements, and of each session in the
    order of their numbers how many times the declared noise that is. Raises `SymkinError` if
    nothing in a session is redundant.
    """
    declared = problem.measurements
    sessions = sessions_of(declared)
    logs = np.zeros(len(sessions))
    for _ in range(_STEPS):
        change = 0.0
        rows = Rows.of(fit)
        within = _in_deviations(problem, rows)
        for k, (number, own) in enumerate(sessions.items()):
            used = own[rows.pose] & np.isfinite(within) & np.isfinite(rows.t) & (rows.t != 0)
            squares = np.square(within[used])
            redundancy = float(np.sum(squares / np.square(rows.t[used])))
            if not redundancy > 0:
                raise SymkinError(
                    f"nothing in session {number} is redundant, so that its noise cannot be "
                    "estimated; leave noise out of sessions"
                )
            step = math.log(float(squares.sum()) / redundancy) / 2
            logs[k] += step
            change = max(change, abs(step) * math.sqrt(2 * redundancy))
        if change < _STILL:
            return problem, fit, tuple(np.exp(logs).tolist())
        factors = np.ones(len(declared))
        for own, log in zip(sessions.values(), logs.tolist(), strict=True):
            factors[own] = math.exp(log)
        scaled = _scaled(declared, problem.noise, factors)
        problem = dataclasses.replace(problem, measurements=scaled)
        fit = problem.fit(nearest=problem.options.gauge == "nominal")
    raise SymkinError(
        f"the noise of the sessions is not found in {_STEPS} steps; declare it by columns of "
        "standard deviations"
    )


def _in_deviations(problem: Problem, rows: Rows) -> Array:
    """Residuals over their standard deviations; NaN of what is exact."""
    deviations = np.full(len(rows.pose), np.nan)
    found = problem.measurements.standard_deviations(problem.noise)
    for kind, name in enumerate(OBSERVED):
        if name in found:
            own = rows.kind == kind
            flat = found[name].reshape(len(problem.measurements), -1)
            deviations[own] = flat[rows.pose[own], rows.index[own]]
    deviations[deviations == 0] = np.nan
    return np.asarray(rows.residual / deviations)


def _scaled(measurements: Measurements, noise: NoiseSettings, factors: Array) -> Measurements:
    """With the deviations of every row times its factor."""
    if noise.along is not None:
        raise SymkinError(
            "sessions with noise of their own want a noise of positions that is the same in all "
            "directions; leave along out of the [noise], or declare the sessions' by columns of "
            "standard deviations"
        )
    changes = {
        OBSERVABLES[name].deviations: own * factors.reshape(-1, *[1] * (own.ndim - 1))
        for name, own in measurements.coordinate_deviations(noise).items()
    }
    return dataclasses.replace(measurements, **changes)  # type: ignore[arg-type]
