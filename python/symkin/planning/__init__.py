# SPDX-License-Identifier: MIT
"""Planning: which poses to measure, and how many."""

from symkin.estimate.survey import HeldByPriors, PlannedUnknown, Survey
from symkin.planning.accuracy import predict_accuracy
from symkin.planning.basis import ChosenPoses, PlanBasis
from symkin.planning.making import make_plan
from symkin.planning.plan import Plan
from symkin.planning.prediction import NeededPoses, PoseCountCurve, Remedy, pose_count_curve
from symkin.planning.selection import Clearance, Design, Region
from symkin.planning.visiting import travel_length

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
