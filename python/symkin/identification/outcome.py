# SPDX-License-Identifier: MIT
"""An identification together with what can be said of it without knowing the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symkin.errors import SymkinError
from symkin.evaluation import Evaluation, evaluate
from symkin.identification.cross_validation import CrossValidation
from symkin.identification.estimate import Identification
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism

__all__ = ["MeasuredIdentification", "closure_residual"]


@dataclass(frozen=True)
class MeasuredIdentification:
    """An identification from measurements of a robot.

    Attributes
    ----------
    nominal : Mechanism
        The mechanism as drawn.
    measurements : Measurements
        What was measured.
    identification : Identification
        The calibrated mechanism and its uncertainty.
    before, after : Evaluation or None
        End-effector errors of the nominal and the calibrated mechanism at the measured poses; None
        if no pose has readings of all legs that the mechanism can take.
    cross_validation : CrossValidation or None
        If it was asked for.
    """

    nominal: Mechanism
    measurements: Measurements
    identification: Identification
    before: Evaluation | None
    after: Evaluation | None
    cross_validation: CrossValidation | None = None

    @classmethod
    def of(
        cls,
        nominal: Mechanism,
        measurements: Measurements,
        identification: Identification,
        cross_validation: CrossValidation | None = None,
    ) -> MeasuredIdentification:
        """Evaluate an identification on its measurements."""
        return cls(
            nominal,
            measurements,
            identification,
            _evaluation(nominal, measurements),
            _evaluation(identification.mechanism, measurements),
            cross_validation,
        )


def closure_residual(mechanism: Mechanism, measurements: Measurements) -> float:
    """Root mean square of the closures of all legs over all poses at which they were read, m."""
    closures = [
        mechanism.closure(leg, measurements.poses, measurements.readings[:, leg])
        for leg in range(len(mechanism.legs))
    ]
    return float(np.sqrt(np.nanmean(np.square(closures))))


def _evaluation(mechanism: Mechanism, measurements: Measurements) -> Evaluation | None:
    try:
        return evaluate(mechanism, measurements=measurements)
    except SymkinError:
        return None
