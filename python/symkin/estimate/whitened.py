# SPDX-License-Identifier: MIT
"""The whitened rows of an estimate, and what they and the priors say of the unknowns."""

from __future__ import annotations

import dataclasses

import numpy as np

from symkin import _core
from symkin.estimate.problem import Problem
from symkin.estimate.unknowns import Layout
from symkin.values import Array

_RANK = 1e-12  # of the largest eigenvalue, with the unknowns in their typical sizes


def whitened_rows(problem: Problem, fit: _core.JointFit) -> Array:
    """Whitened rows of every pose at the estimate, shape (N, r, unknowns); zeros where aside."""
    measurements = problem.measurements
    there = dataclasses.replace(measurements, readings=measurements.readings + fit.reading_errors)
    seen = problem.observed_in(there)
    rows = problem.layout.rows_of(problem.mechanism.straight, fit.setup, seen, fit.poses)
    return np.nan_to_num(rows)


def typical_sizes(layout: Layout) -> Array:
    """Typical sizes of the unknowns: tolerances, else priors, else a millimetre."""
    tolerances, priors = layout.column_tolerances, layout.prior
    return np.where(tolerances > 0, tolerances, np.where(np.isfinite(priors), priors, 1e-3))


def information_of(layout: Layout, rows: Array) -> tuple[Array, Array]:
    """What rows (N, r, unknowns) and the priors show, and its inverse, zero along what is not."""
    information = np.einsum("nri,nrj->ij", rows, rows) + layout.prior_information
    sizes = typical_sizes(layout)
    scale = np.outer(sizes, sizes)
    values, vectors = np.linalg.eigh(information * scale)
    shown = values > _RANK * values[-1]
    half = vectors[:, shown] / np.sqrt(values[shown])
    return information, half @ half.T * scale
