# SPDX-License-Identifier: MIT
"""Planning: which poses to measure, and how many."""

from symkin.planning.making import make_plan
from symkin.planning.observing import HeldByPriors, PlannedUnknown, Survey
from symkin.planning.plan import ChosenPoses, Plan, PlanBasis, travel_length
from symkin.planning.prediction import (
    NeededPoses,
    PoseCountCurve,
    Remedy,
    pose_count_curve,
    predict_accuracy,
)
from symkin.planning.selection import Clearance, Design, Region

__all__ = [
    "ChosenPoses",
    "Clearance",
    "Design",
    "HeldByPriors",
    "NeededPoses",
    "Plan",
    "PlanBasis",
    "PlannedUnknown",
    "PoseCountCurve",
    "Region",
    "Remedy",
    "Survey",
    "make_plan",
    "pose_count_curve",
    "predict_accuracy",
    "travel_length",
]
