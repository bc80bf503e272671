# SPDX-License-Identifier: MIT
"""What mapped poses are worth to robots as they were made."""

from __future__ import annotations

import numpy as np

from symkin.analysis.observability import observability_rows
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry import map_poses
from symkin.planning import Plan
from symkin.planning.selection import LegRows, allowed_candidates, design_tasks, select_poses
from symkin.values import Array


def mapped_candidates(plan: Plan, candidates: Array) -> tuple[Array, ...]:
    """What each leg's poses could have been: the candidates of its reference leg, carried to it.

    The plan is of design "legs", and chose from the candidates, shape (n, coordinates).
    """
    mechanism, basis = plan.mechanism, plan.basis
    assert basis is not None
    carried: dict[int, Array] = {}
    for task in design_tasks(mechanism, "legs", use_symmetry=True):
        allowed = allowed_candidates(task, candidates, None, (), basis.clearance)
        for leg, (element,) in task.sets:
            carried[leg] = map_poses(mechanism, element, candidates[allowed])
    return tuple(carried[leg] for leg in sorted(carried))


def mapped_efficiency(robot: Mechanism, plan: Plan, candidates: tuple[Array, ...]) -> float:
    """Compare a plan's poses with those that would have been chosen for the robot as it was made.

    With the `mapped_candidates`: ``(det M_plan / det M_own)^(1/p)`` of the least lucky leg, with M
    the information of the leg's own poses. With 0.9, so much is lost as with every tenth pose.
    """
    assert plan.basis is not None
    gains = []
    for leg, where in enumerate(candidates):
        poses = plan.poses[plan.rows_of(leg)]
        reached = where[np.isfinite(robot.inverse_kinematics(where)[:, leg])]
        own = select_poses(
            LegRows(robot, leg, reached, "noise_aware"), len(poses), plan.basis.seed, threads=1
        )
        gain = _log_information(robot, leg, poses) - own.log_det
        gains.append(gain / robot.estimated_counts[leg])
    return float(np.exp(min(gains)))


def _log_information(mechanism: Mechanism, leg: int, poses: Array) -> float:
    """Logarithm of the determinant of what a leg's poses show; those out of reach show nothing."""
    rows = observability_rows(mechanism, leg, poses, "noise_aware")
    rows = rows[np.isfinite(rows).all(axis=1)]
    sign, value = np.linalg.slogdet(rows.T @ rows)
    return float(value) if sign > 0 else -np.inf
