# SPDX-License-Identifier: MIT
"""Planning: which poses to measure, and how many."""

from symkin.planning.designs import Design
from symkin.planning.limits import Clearance, Region
from symkin.planning.making import make_plan
from symkin.planning.plan import ChosenPoses, Plan, PlanBasis
from symkin.planning.prediction import PoseCountCurve, pose_count_curve, predict_accuracy
from symkin.planning.visiting import travel_length

__all__ = [
    "ChosenPoses",
    "Clearance",
    "Design",
    "Plan",
    "PlanBasis",
    "PoseCountCurve",
    "Region",
    "make_plan",
    "pose_count_curve",
    "predict_accuracy",
    "travel_length",
]
