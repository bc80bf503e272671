# SPDX-License-Identifier: MIT
"""What each pose does to a joint estimate: how far it moves without the pose, without refitting."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.identification.problem import Problem
from symkin.result import Value, record

if TYPE_CHECKING:
    from symkin.identification.joint import JointIdentification

__all__ = ["Influence"]

Array = NDArray[np.float64]

_RANK = 1e-12  # of the largest eigenvalue, with the unknowns in their typical sizes
_INDISPENSABLE = 1e-9  # of the share of a condition that the other poses leave open
_HELD = 1e-4  # deviations within which one pose alone is let move the estimate
_STEPS = 50


@record
class Influence(Value):
    """Every pose against all others, to first order.

    Attributes
    ----------
    residual : ndarray, shape (N,)
        Root mean square of what its observations differ by from what the estimate without them
        predicts, in standard deviations: about 1 for a sound pose. NaN for a pose that brings no
        equation, or without which something could not be estimated.
    moves : ndarray, shape (N,)
        How far the estimate moves without the pose: the largest change of any combination of
        unknowns, in its standard deviation.
    unknown : tuple of str
        The single unknown that moves furthest; empty where nothing is known, and where single
        unknowns depend on a gauge.
    by : ndarray, shape (N,)
        How far that one moves, in its standard deviations.
    """

    residual: Array
    moves: Array
    unknown: tuple[str, ...]
    by: Array

    @classmethod
    def of(cls, found: JointIdentification) -> Influence | None:
        """Of an estimate; None if a loss has weighed its poses."""
        from symkin.identification.suspicions import without_blunders

        options = dataclasses.replace(found.options, noise=found.noise)
        problem, fit, _ = Problem.of(found.nominal, found.measurements, options).resolved()
        if options.loss_per == "reading":
            problem, fit, _ = without_blunders(problem)
        elif options.loss != "none":
            return None
        rows = _rows(problem, fit)
        sizes = _sizes(problem)
        information = np.einsum("nri,nrj->ij", rows, rows) + np.diag(problem.layout.prior**-2.0)
        covariance = _inverse(information, sizes)
        deviations = np.sqrt(np.diag(covariance))
        names = problem.layout.names
        count = len(found.measurements.poses)
        residual, moves, by = (np.full(count, np.nan) for _ in range(3))
        unknown = [""] * count
        for pose in np.flatnonzero(np.array(fit.conditions) > 0).tolist():
            gradient = _gradient(problem, fit, pose, deviations)
            own = rows[pose, : fit.conditions[pose]]
            open_to = np.eye(len(own)) - own @ covariance @ own.T
            if np.linalg.eigvalsh(open_to)[0] < _INDISPENSABLE or pose in fit.aside:
                continue
            along = covariance @ gradient
            change = along + covariance @ own.T @ np.linalg.solve(open_to, own @ along)
            squares = fit.chi_squares[pose] + gradient @ change
            residual[pose] = np.sqrt(max(squares, 0.0) / len(own))
            moves[pose] = np.sqrt(max(change @ information @ change, 0.0))
            if fit.gauge_directions == 0:
                single = np.abs(change) / deviations
                unknown[pose], by[pose] = names[int(np.argmax(single))], single.max()
        return cls(residual, moves, tuple(unknown), by)


def _sizes(problem: Problem) -> Array:
    """Typical sizes of the unknowns."""
    tolerances, priors = problem.layout.column_tolerances, problem.layout.prior
    return np.where(tolerances > 0, tolerances, np.where(np.isfinite(priors), priors, 1e-3))


def _rows(problem: Problem, fit: _core.JointFit) -> Array:
    """Whitened rows of every pose at the estimate, shape (N, r, unknowns); zeros where aside."""
    layout, measurements = problem.layout, problem.measurements
    there = dataclasses.replace(measurements, readings=measurements.readings + fit.reading_errors)
    rows = _core.observed_rows(
        problem.mechanism.straight,
        fit.setup,
        there.observations(problem.noise),
        layout.column.tolist(),
        layout.prior,
        fit.poses,
    )
    return np.nan_to_num(rows.reshape(len(fit.poses), -1, len(layout.names)))


def _inverse(information: Array, sizes: Array) -> Array:
    """Of what is shown; nothing of what is not, which no pose moves."""
    values, vectors = np.linalg.eigh(information * np.outer(sizes, sizes))
    shown = values > _RANK * values[-1]
    half = vectors[:, shown] / np.sqrt(values[shown])
    return np.asarray(half @ half.T * np.outer(sizes, sizes))


def _gradient(problem: Problem, fit: _core.JointFit, pose: int, deviations: Array) -> Array:
    """Half the derivative of a pose's chi-square by the unknowns, its latent pose moving along.

    With everything else held by priors, the estimate from this pose alone moves by their variance
    times it: the estimator's own elimination of the pose tells, whatever was observed.
    """
    layout = problem.layout
    held = _HELD * np.where(deviations > 0, deviations, _sizes(problem))
    alone = _core.fit_jointly(
        problem.mechanism.straight,
        fit.setup,
        problem.measurements.subset(np.array([pose])).observations(problem.noise),
        layout.column.tolist(),
        held,
        _core.LossKind.none,
        0.0,
        0.0,
        _STEPS,
        False,
        layout.column_tolerances,
        fit.poses[pose : pose + 1],
        rows=False,
    )
    return np.asarray(-alone.change / held**2)
