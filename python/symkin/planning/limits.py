# SPDX-License-Identifier: MIT
"""Which candidates may be measured at all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.mechanism import Mechanism
from symkin.observability import tolerances_of
from symkin.planning.designs import Task
from symkin.symmetry import map_poses
from symkin.workspace import coordinate_names, inside_box, inside_workspace, workspace_coordinates

__all__ = ["Region", "allowed_candidates", "check_regions", "tolerance_margin"]

Region = Mapping[str, tuple[float, float]]

_SAMPLE = 200  # poses at which the effect of the tolerances is evaluated


def check_regions(mechanism: Mechanism, regions: Sequence[Region]) -> None:
    """Raise SymkinError for a region whose coordinates or limits make no sense."""
    known = coordinate_names(mechanism)
    for region in regions:
        if not region:
            raise SymkinError("a region to avoid has no limits; that would be every pose")
        for name, (lower, upper) in region.items():
            if name not in known:
                raise SymkinError(
                    f'a region to avoid limits "{name}"; expected coordinates of the poses, '
                    f"{', '.join(known)}"
                )
            if math.isnan(lower) or math.isnan(upper) or not lower <= upper:
                raise SymkinError(
                    f"a region to avoid reaches from {name} = {lower:g} to {upper:g}; expected "
                    "the lower limit first"
                )


def tolerance_margin(mechanism: Mechanism, poses: NDArray[np.float64], sigmas: float) -> float:
    """Distance from the end of every leg's reach that the manufacturing tolerances ask for, m.

    So many standard deviations of the closure h of a leg whose parameters have errors of the
    tolerances' size, the largest of some of the poses: a leg that is nearer to its stretch may miss
    the pose once the robot is made.
    """
    some = poses[:: -(-len(poses) // _SAMPLE)]
    tolerances = tolerances_of(mechanism.tolerances)
    readings = mechanism.inverse_kinematics(some)
    largest = 0.0
    for leg in range(len(mechanism.legs)):
        rows = _core.linearise(mechanism.core, leg, some, readings[:, leg]).by_parameters
        deviations = np.linalg.norm(rows * tolerances.deviations(mechanism.core, leg), axis=1)
        largest = max(largest, float(np.nanmax(deviations, initial=0.0)))
    return sigmas * largest


def allowed_candidates(
    mechanism: Mechanism,
    task: Task,
    poses: NDArray[np.float64],
    regions: Sequence[Region],
    reach_margin: float,
) -> NDArray[np.bool_]:
    """Whether each candidate may be measured, at all its images, shape (n,).

    Every image must lie in the workspace's box and in no region to avoid; where `reach_margin` is
    larger than the workspace's own, the candidate must keep it.
    """
    allowed = np.ones(len(poses), dtype=np.bool_)
    settings = mechanism.workspace
    if settings is not None and reach_margin > settings.reach_margin:
        wider = mechanism.replace(workspace=replace(settings, reach_margin=reach_margin))
        allowed &= inside_workspace(wider, poses)
    for element in task.elements:
        images = map_poses(mechanism, element, poses)
        allowed &= inside_box(mechanism, images)
        for region in regions:
            allowed &= ~_contains(mechanism, region, images)
    return allowed


def _contains(
    mechanism: Mechanism, region: Region, poses: NDArray[np.float64]
) -> NDArray[np.bool_]:
    names = coordinate_names(mechanism)
    coordinates = workspace_coordinates(mechanism, poses)
    inside = np.ones(len(poses), dtype=np.bool_)
    for name, (lower, upper) in region.items():
        values = coordinates[:, names.index(name)]
        inside &= (values >= lower) & (values <= upper)
    return inside
