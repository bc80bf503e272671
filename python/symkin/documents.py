# SPDX-License-Identifier: MIT
"""Results as plain values, for results files and for machines.

Keys of lengths end in ``_m``, of angles in ``_rad``; legs and rows count from 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symkin.evaluation import AlignedErrors, Evaluation
from symkin.identification.comparison import EstimatorFigures, expected
from symkin.identification.estimate import Identification
from symkin.identification.outcome import MeasuredIdentification, closure_residual
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import ExpectedAccuracy
from symkin.pipeline import ProtocolResult

__all__ = [
    "difference_names",
    "evaluation_document",
    "identification_document",
    "measured_document",
    "run_document",
]

Document = dict[str, Any]


def run_document(
    result: ProtocolResult, comparison: Sequence[EstimatorFigures] = (), **settings: Any
) -> Document:
    """Return what ``results.json`` of a run holds; `settings` are how it was run."""
    measurements = result.simulation.measurements
    return {
        "command": "run",
        "mechanism": result.nominal.name,
        "settings": settings,
        "candidates": len(result.candidates.poses),
        "plan": result.plan.to_dict(),
        "simulation": {
            "measured": len(measurements.poses),
            "replaced": list(result.simulation.replaced),
        },
        "identification": identification_document(
            result.nominal, measurements, result.identification
        ),
        "evaluation": {
            "before": evaluation_document(result.before),
            "after": evaluation_document(result.after),
            "expected": _accuracy_document(expected(result, result.identification)),
        },
        "comparison": [_figures_document(figures) for figures in comparison],
    }


def measured_document(result: MeasuredIdentification, **settings: Any) -> Document:
    """Return what ``results.json`` of an identification holds; `settings` are how it was made."""
    measurements, validation = result.measurements, result.cross_validation
    return {
        "command": "identify",
        "mechanism": result.nominal.name,
        "measurements": {
            "file": measurements.source_name if measurements.source else None,
            "poses": len(measurements.poses),
        },
        "settings": settings,
        "identification": identification_document(
            result.nominal, measurements, result.identification
        ),
        "evaluation": {
            "before": evaluation_document(result.before),
            "after": evaluation_document(result.after),
        },
        "cross_validation": validation
        and {
            "folds": validation.folds,
            "blocks": validation.blocks,
            "converged": validation.converged,
            "residual_rms_m": validation.residual_rms,
            "residual_max_m": validation.residual_max,
            "evaluation": evaluation_document(validation.evaluation),
        },
    }


def identification_document(
    nominal: Mechanism, measurements: Measurements, identification: Identification
) -> Document:
    """Return the estimate, its uncertainty and what speaks for and against it."""
    return {
        "estimator": identification.estimator,
        "converged": identification.converged,
        "trustworthy": identification.trustworthy,
        "doubts": identification.doubts,
        "notes": identification.diagnosis.notes,
        "goodness_of_fit": [
            {
                "legs": [leg + 1 for leg in fit.legs],
                "chi_square": fit.chi_square,
                "degrees_of_freedom": fit.degrees_of_freedom,
                "limit": fit.limit,
                "least": fit.least,
            }
            for fit in identification.goodness
        ],
        "residual_tests": [
            {
                "suspect": test.suspect,
                "legs": [leg + 1 for leg in test.legs],
                "term": test.term,
                "statistic": test.statistic,
                "degrees_of_freedom": test.freedom,
                "p_value": test.p_value,
                "limit": test.limit,
                "size_rms_m": test.size,
            }
            for test in identification.diagnosis.tests
        ],
        "outliers": [
            {
                "row": measurements.row_numbers[outlier.row],
                "leg": outlier.leg + 1,
                "studentised_residual": outlier.student,
                "p_value": outlier.p_value,
            }
            for outlier in identification.diagnosis.outliers
        ],
        "residual_before_rms_m": closure_residual(nominal, measurements),
        "residual_after_rms_m": identification.residual_rms,
        "residual_after_max_m": identification.residual_max,
        "legs": [
            _leg_document(nominal, measurements, identification, leg)
            for leg in range(len(nominal.legs))
        ],
        "covariance": identification.covariance,
    }


def evaluation_document(evaluation: Evaluation | None) -> Document | None:
    """Return the figures of an evaluation, without the single poses."""
    if evaluation is None:
        return None
    return {
        "position_rms_m": evaluation.position_rms,
        "position_max_m": evaluation.position_max,
        "orientation_rms_rad": evaluation.orientation_rms,
        "orientation_max_rad": evaluation.orientation_max,
        "evaluated": evaluation.evaluated,
        "failed": evaluation.failed,
        "mean_difference": dict(zip(difference_names(evaluation), evaluation.means, strict=True)),
        "closures": _closure_document(evaluation),
        "aligned": evaluation.aligned and _aligned_document(evaluation.aligned),
    }


def difference_names(evaluation: Evaluation) -> tuple[str, ...]:
    """Coordinates of an evaluation's differences with their units."""
    position, angles = ("x_m", "y_m"), ("rx_rad", "ry_rad", "rz_rad")
    by_size = {2: position, 3: (*position, "phi_rad"), 6: (*position, "z_m", *angles)}
    return by_size[evaluation.differences.shape[1]]


def _aligned_document(aligned: AlignedErrors) -> Document:
    return {
        "position_rms_m": aligned.position_rms,
        "position_max_m": aligned.position_max,
        "orientation_rms_rad": aligned.orientation_rms,
        "orientation_max_rad": aligned.orientation_max,
        "base": aligned.base,
        "tool": aligned.tool,
    }


def _closure_document(evaluation: Evaluation) -> Document | None:
    if evaluation.closure_rms is None:
        return None
    rms, legs = evaluation.closure_rms
    return {"rms_m": rms, "legs_rms_m": legs}


def _leg_document(
    nominal: Mechanism, measurements: Measurements, identification: Identification, leg: int
) -> Document:
    fit, calibrated = identification.legs[leg], identification.mechanism
    names = nominal.parameter_names
    deviations = calibrated.deviations
    return {
        "leg": leg + 1,
        "converged": fit.converged,
        "failure": fit.failure,
        "iterations": fit.iterations,
        "poses": len(fit.rows),
        "rejected_rows": measurements.row_numbers[fit.rejected],
        "chi_square_per_degree_of_freedom": fit.chi_square,
        "condition": fit.condition,
        "parameters": {
            name: {
                "nominal": nominal.parameters[leg, index],
                "value": calibrated.parameters[leg, index],
                "standard_deviation": None if deviations is None else deviations[leg, index],
            }
            for index, name in enumerate(names)
        },
    }


def _accuracy_document(accuracy: ExpectedAccuracy) -> Document:
    return {
        "position_rms_m": accuracy.position,
        "orientation_rms_rad": accuracy.orientation,
        "evaluated": accuracy.evaluated,
        "failed": accuracy.failed,
    }


def _figures_document(figures: EstimatorFigures) -> Document:
    return {
        "estimator": figures.estimator,
        "poses": figures.poses,
        "converged": figures.converged,
        "evaluation": evaluation_document(figures.evaluation),
        "expected": figures.expected and _accuracy_document(figures.expected),
    }
