# SPDX-License-Identifier: MIT
"""What the estimators make of the same measurements."""

from __future__ import annotations

from dataclasses import dataclass

from symkin.errors import SymkinError
from symkin.evaluation import Evaluation, evaluate
from symkin.identification.estimate import Estimator, Identification, PoseUse, identify
from symkin.observability import ExpectedAccuracy, expected_accuracy
from symkin.pipeline import ProtocolResult

__all__ = ["EstimatorFigures", "compare_estimators"]

# The paper's, then each step that takes more out of the same measurements.
_ESTIMATORS: tuple[tuple[Estimator, PoseUse], ...] = (
    ("paper", "own"),
    ("implicit", "own"),
    ("implicit", "all"),
    ("joint", "all"),
)


@dataclass(frozen=True)
class EstimatorFigures:
    """What one estimator achieves.

    Attributes
    ----------
    estimator, poses : str
        As `identify` takes them.
    converged : bool
        Whether it did.
    evaluation : Evaluation or None
        End-effector errors over the candidates; None if it gave nothing to evaluate.
    expected : ExpectedAccuracy or None
        The same figures, predicted from its covariance.
    """

    estimator: Estimator
    poses: PoseUse
    converged: bool
    evaluation: Evaluation | None
    expected: ExpectedAccuracy | None


def compare_estimators(result: ProtocolResult) -> tuple[EstimatorFigures, ...]:
    """Identify and evaluate with every estimator on the measurements of a protocol's run."""
    return tuple(_figures(result, estimator, poses) for estimator, poses in _ESTIMATORS)


def _figures(result: ProtocolResult, estimator: Estimator, poses: PoseUse) -> EstimatorFigures:
    try:
        identification = identify(
            result.nominal, result.simulation.measurements, estimator, poses=poses
        )
        evaluation = evaluate(
            identification.mechanism,
            actual=result.simulation.actual,
            poses=result.candidates.poses,
        )
    except SymkinError:  # too few poses for it, or an estimate that no pose suits
        return EstimatorFigures(estimator, poses, False, None, None)
    return EstimatorFigures(
        estimator, poses, identification.converged, evaluation, expected(result, identification)
    )


def expected(result: ProtocolResult, identification: Identification) -> ExpectedAccuracy:
    """Predict the end-effector error over the candidates from an identification's covariance."""
    return expected_accuracy(
        identification.mechanism, result.candidates.poses, identification.covariance
    )
