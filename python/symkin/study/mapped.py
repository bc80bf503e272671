# SPDX-License-Identifier: MIT
"""What poses that a symmetry carries from leg to leg are worth to legs that lack it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.mechanism import Mechanism
from symkin.observability import observability_rows
from symkin.planning import Plan
from symkin.planning.designs import allowed_candidates, design_tasks
from symkin.planning.selection import LegRows, select_poses
from symkin.symmetry import map_poses

__all__ = ["log_information", "mapped_candidates", "mapped_efficiency"]

Array = NDArray[np.float64]


def mapped_candidates(plan: Plan, candidates: Array) -> tuple[Array, ...]:
    """What each leg's poses could have been: the candidates of its reference leg, carried to it.

    Parameters
    ----------
    plan : Plan
        Of design "legs", as it was made.
    candidates : ndarray, shape (n, coordinates)
        From which it chose.
    """
    mechanism, basis = plan.mechanism, plan.basis
    assert basis is not None
    carried: dict[int, Array] = {}
    for task in design_tasks(mechanism, "legs", use_symmetry=True):
        allowed = allowed_candidates(mechanism, task, candidates, None, (), basis.clearance)
        for leg, (element,) in task.sets:
            carried[leg] = map_poses(mechanism, element, candidates[allowed])
    return tuple(carried[leg] for leg in sorted(carried))


def mapped_efficiency(robot: Mechanism, plan: Plan, candidates: tuple[Array, ...]) -> float:
    """Compare a plan's poses with those that would have been chosen for the robot itself.

    Parameters
    ----------
    robot : Mechanism
        As it was made.
    plan : Plan
        Of design "legs", for the mechanism as drawn.
    candidates : tuple of ndarray, shape (n, coordinates)
        For each leg, see `mapped_candidates`.

    Returns
    -------
    float
        ``(det M_plan / det M_own)^(1/p)`` of the least lucky leg, with M the information of the
        leg's own poses: with 0.9, so much is lost as with every tenth pose.
    """
    assert plan.basis is not None
    gains = []
    for leg, where in enumerate(candidates):
        poses = plan.poses[plan.rows_of(leg)]
        reached = where[np.isfinite(robot.inverse_kinematics(where)[:, leg])]
        own = select_poses(
            LegRows(robot, leg, reached, "noise_aware"), len(poses), plan.basis.seed, threads=1
        )
        gains.append(log_information(robot, leg, poses) - own.log_det)
    return float(np.exp(min(gains) / len(robot.parameter_names)))


def log_information(mechanism: Mechanism, leg: int, poses: Array) -> float:
    """Logarithm of the determinant of what a leg's poses show; those out of reach show nothing."""
    rows = observability_rows(mechanism, leg, poses, "noise_aware")
    rows = rows[np.isfinite(rows).all(axis=1)]
    sign, value = np.linalg.slogdet(rows.T @ rows)
    return float(value) if sign > 0 else -np.inf
