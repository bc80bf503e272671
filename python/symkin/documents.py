# SPDX-License-Identifier: MIT
"""Results as plain values, for results files and for machines.

Keys of lengths end in ``_m``, of angles in ``_rad``; legs and rows count from 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import analyse_observability
from symkin.planning import Plan, PlanBasis, PoseCountCurve, travel_length

__all__ = ["plan_document", "pose_count_document"]

Document = dict[str, Any]


def plan_document(
    mechanism: Mechanism, plan: Plan, measured: Measurements | None = None
) -> Document:
    """Return what a plan shows of each leg's parameters, and how it was made.

    The indices are those of the rows that the selection saw, the rest of the paper's rows.

    With measurements to which the plan adds, what both show together.
    """
    legs = []
    for leg, poses in enumerate(plan.leg_poses(measured)):
        rows = plan.rows_of(leg)
        shown = analyse_observability(mechanism, leg, poses)
        indices = analyse_observability(mechanism, leg, poses, plan.row_kind).indices
        spares = sum(len(plan.rows_of_set(number, spare=True)) for number in (leg + 1, 0))
        legs.append(
            {
                "leg": leg + 1,
                "poses": len(rows),
                "spares": spares,
                "r_diagonal": dict(zip(mechanism.parameter_names, shown.r_diagonal, strict=True)),
                "indices": indices,
                "condition": shown.condition,
            }
        )
    return {
        "poses": int(np.sum(~plan.spare)),
        "spares": int(np.sum(plan.spare)),
        "travel_m": travel_length(mechanism, plan.poses[~plan.spare]),
        "selection": plan.basis and _basis_document(plan.basis),
        "legs": legs,
    }


def pose_count_document(mechanism: Mechanism, curve: PoseCountCurve, **settings: Any) -> Document:
    """Return what more poses bring; `settings` are what they were predicted for."""
    return {
        "command": "pose-count",
        "mechanism": mechanism.name,
        "settings": settings,
        "poses_per_leg": curve.counts,
        "poses": curve.measured,
        "position_rms_m": curve.position,
        "orientation_rms_rad": curve.orientation,
        "efficiency": curve.efficiency,
        "least_gain": curve.least_gain,
        "enough": curve.enough,
    }


def _basis_document(basis: PlanBasis) -> Document:
    return {
        "design": basis.design,
        "rows": basis.rows,
        "criterion": basis.criterion,
        "method": basis.method,
        "seed": basis.seed,
        "candidates": basis.candidates,
        "excluded": basis.excluded,
        "reach_margin_m": basis.clearance.reach_margin,
        "conditioning_limit": basis.clearance.conditioning_limit,
        "choices": [
            {
                "legs": choice.legs,
                "elements": choice.elements,
                "candidates": choice.selection.indices,
                "criterion_value": choice.selection.criterion_value,
                "log_det": choice.selection.log_det,
                "efficiency": choice.selection.certificate.efficiency,
                "o1_efficiency": choice.selection.certificate.o1_efficiency,
                "efficiency_repeats": choice.selection.certificate.efficiency_repeats,
                "proven_optimal": choice.selection.certificate.proven_optimal,
            }
            for choice in basis.choices
        ],
    }
