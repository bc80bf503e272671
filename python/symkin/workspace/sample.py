# SPDX-License-Identifier: MIT
"""Sampling of the workspace without singularities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.checks.home_pose import require_usable_home
from symkin.errors import SymkinError
from symkin.mechanism import Mechanism
from symkin.observability import tolerances_of

__all__ = [
    "WorkspaceSample",
    "closure_deviation",
    "coordinate_names",
    "inside_box",
    "inside_workspace",
    "least_reach_margin",
    "sample_workspace",
    "workspace_coordinates",
    "workspace_options",
]

_MARGIN_SIGMAS = 3.0  # as `make_plan` keeps by default
_COORDINATES = {
    "planar": ("x", "y", "phi"),
    "point": ("x", "y"),
    "spatial": ("x", "y", "z", "rx", "ry", "rz"),
}


@dataclass(frozen=True)
class WorkspaceSample:
    """Poses drawn from the workspace.

    Attributes
    ----------
    poses : ndarray, shape (N, coordinates)
        Uniform in the workspace's box, less what was rejected.
    readings : ndarray, shape (N, legs)
        The sensor readings at the poses.
    conditions : ndarray, shape (N,)
        Condition number of dq/dpose at each pose, see `Mechanism.singularity_measures`.
    drawn : int
        How many poses were drawn from the box for them.
    rejected : dict of str to int
        How many were rejected: "reach", "limits", "aspect", "conditioning".
    """

    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    conditions: NDArray[np.float64]
    drawn: int
    rejected: dict[str, int]


def sample_workspace(
    mechanism: Mechanism, count: int | None = None, seed: int | None = None
) -> WorkspaceSample:
    """Draw poses that every leg reaches, in the aspect of home and away from singularities.

    Parameters
    ----------
    mechanism : Mechanism
        With its workspace settings.
    count : int, optional
        Number of poses, by default the protocol's number of candidates.
    seed : int, optional
        By default the protocol's. The same seed gives the same poses.

    Returns
    -------
    WorkspaceSample

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, its home is not in it, or hardly any pose of its box is.
    """
    options = workspace_options(mechanism)
    require_usable_home(mechanism, least_reach_margin(mechanism))
    sample = _core.sample_workspace(
        mechanism.core,
        options,
        mechanism.protocol.candidates if count is None else count,
        mechanism.protocol.seed if seed is None else seed,
    )
    causes = ("reach", "limits", "aspect", "conditioning")
    return WorkspaceSample(
        poses=sample.poses,
        readings=sample.readings,
        conditions=sample.conditions,
        drawn=sample.drawn,
        rejected={cause: getattr(sample.rejections, cause) for cause in causes},
    )


def inside_workspace(mechanism: Mechanism, poses: ArrayLike) -> NDArray[np.bool_]:
    """Whether each pose meets the workspace's demands, shape (N,); its box is not asked."""
    rows = np.atleast_2d(np.ascontiguousarray(poses, dtype=np.float64))
    return np.array(_core.inside_workspace(mechanism.core, workspace_options(mechanism), rows))


def coordinate_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of a workspace's coordinates: position, then angle or rotation vector."""
    return _COORDINATES[mechanism.pose_space]


def workspace_coordinates(mechanism: Mechanism, poses: ArrayLike) -> NDArray[np.float64]:
    """Poses in a workspace's coordinates, shape (N, dof): m, and rad in (-pi, pi]."""
    rows = np.atleast_2d(np.asarray(poses, dtype=np.float64))
    if mechanism.pose_space == "point":
        return rows
    if mechanism.pose_space == "planar":
        turned = np.pi - np.remainder(np.pi - rows[:, 2:], 2 * np.pi)
        return np.hstack([rows[:, :2], turned])
    vector, scalar = rows[:, 3:6], rows[:, 6:]
    vector = np.where(scalar < 0, -vector, vector)
    size = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2 * np.arctan2(size, np.abs(scalar))
    return np.hstack([rows[:, :3], vector * angle / np.where(size > 0, size, 1.0)])


def inside_box(mechanism: Mechanism, poses: ArrayLike) -> NDArray[np.bool_]:
    """Whether each pose lies in the workspace's box, shape (N,); always without a workspace."""
    rows = np.atleast_2d(np.asarray(poses, dtype=np.float64))
    workspace = mechanism.workspace
    inside = np.ones(len(rows), dtype=np.bool_)
    if workspace is None:
        return inside
    if mechanism.pose_space == "planar":
        # A box may reach beyond half a turn.
        centre = (workspace.lower[2] + workspace.upper[2]) / 2
        turns = np.rint((rows[:, 2] - centre) / (2 * np.pi))
        columns = [rows[:, 0], rows[:, 1], rows[:, 2] - 2 * np.pi * turns]
    else:
        columns = list(workspace_coordinates(mechanism, rows).T)
    slack = 1e-9  # of an image that rounding has put on the other side
    for column, lower, upper in zip(columns, workspace.lower, workspace.upper, strict=True):
        inside &= (column >= lower - slack) & (column <= upper + slack)
    return inside


def closure_deviation(mechanism: Mechanism, poses: NDArray[np.float64]) -> float:
    """Standard deviation of the closures of legs as the workshop makes them, m.

    The largest of all legs and poses; zero where no leg can reach.
    """
    tolerances = tolerances_of(mechanism.tolerances)
    readings = mechanism.inverse_kinematics(poses)
    largest = 0.0
    for leg in range(len(mechanism.legs)):
        rows = _core.linearise(mechanism.core, leg, poses, readings[:, leg]).by_parameters
        deviations = np.linalg.norm(rows * tolerances.deviations(mechanism.core, leg), axis=1)
        largest = max(largest, float(np.nanmax(deviations, initial=0.0)))
    return largest


def least_reach_margin(mechanism: Mechanism) -> float:
    """Distance (m) that every leg keeps from its limits of reach in the workspace.

    Where the workspace does not say, a robot within its tolerances should follow; but never so far
    that home would be out of reach.
    """
    settings = mechanism.workspace
    if settings is not None and settings.reach_margin is not None:
        return settings.reach_margin
    home = np.atleast_2d(mechanism.home)
    kept_at_home = float(_core.reach_margin(mechanism.core, home).min())
    return min(_MARGIN_SIGMAS * closure_deviation(mechanism, home), max(0.0, kept_at_home / 2))


def workspace_options(mechanism: Mechanism) -> _core.WorkspaceOptions:
    """Workspace settings and joint limits as the core takes them."""
    settings = mechanism.workspace
    if settings is None:
        raise SymkinError(
            f'mechanism "{mechanism.name}" has no workspace; give it WorkspaceSettings, or a '
            "[workspace] table in its file"
        )
    options = _core.WorkspaceOptions()
    options.lower = np.array(settings.lower, dtype=float)
    options.upper = np.array(settings.upper, dtype=float)
    options.reach_margin = least_reach_margin(mechanism)
    options.conditioning_limit = settings.conditioning_limit
    options.characteristic_length = mechanism.characteristic_length
    options.home = mechanism.home
    options.reading_lower = mechanism.joint_limits.lower
    options.reading_upper = mechanism.joint_limits.upper
    return options
