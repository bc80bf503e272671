# SPDX-License-Identifier: MIT
"""The figures under the names that report pages call them by."""

from typing import Any

from symkin.plot import drawing, estimates, workspaces

__all__ = [
    "dependence_figure",
    "error_histogram_figure",
    "error_map_figure",
    "mechanism_figure",
    "observability_figure",
    "parameter_errors_figure",
    "pose_count_figure",
    "poses_figure",
    "residuals_figure",
]

active_joint_figure: Any = workspaces.active_joints
constant_orientation_figure: Any = workspaces.workspace
dependence_figure: Any = estimates.dependence
error_histogram_figure: Any = estimates.error_histogram
parameter_errors_figure: Any = estimates.draw_parameter_errors
residuals_figure: Any = estimates.residuals


def mechanism_figure(mechanism: Any, pose: Any, symmetry: Any = None) -> Any:
    """See `symkin.plot.mechanism`."""
    return drawing.mechanism(mechanism, pose, symmetry=symmetry).figure


def poses_figure(_pose_space: str, *arguments: Any) -> Any:
    """See `symkin.plot.poses`."""
    return workspaces.poses(*arguments)


def observability_figure(names: Any, r_diagonals: Any) -> Any:
    """See `symkin.plot.observability`."""
    return estimates.observability(names, r_diagonals).figure


def error_map_figure(_pose_space: str, *arguments: Any) -> Any:
    """See `symkin.plot.error_map`."""
    return estimates.error_map(*arguments)


def pose_count_figure(curve: Any, *, turns: bool) -> Any:  # noqa: ARG001
    """See `symkin.plot.pose_count`."""
    return estimates.pose_count(curve)
