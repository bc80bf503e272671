# SPDX-License-Identifier: MIT
"""Whether a calibrated robot keeps a tolerance, and what moved between two calibrations."""

from symkin.acceptance.accepting import accept
from symkin.acceptance.certificate import ABOUT, Acceptance, Judged, TestedPose
from symkin.acceptance.comparing import Comparison, MovedParameter, compare
from symkin.acceptance.limits import (
    Decision,
    RmsLimits,
    Verdict,
    decide,
    limits_of_rms,
    poses_for_share,
)
from symkin.acceptance.repeatability import PoseAccuracy, pose_accuracy, visits_of

__all__ = [
    "ABOUT",
    "Acceptance",
    "Comparison",
    "Decision",
    "Judged",
    "MovedParameter",
    "PoseAccuracy",
    "RmsLimits",
    "TestedPose",
    "Verdict",
    "accept",
    "compare",
    "decide",
    "limits_of_rms",
    "pose_accuracy",
    "poses_for_share",
    "visits_of",
]
