# SPDX-License-Identifier: MIT
"""Which candidates may be measured at all."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.mechanism import Mechanism
from symkin.planning.designs import Task
from symkin.symmetry import map_poses
from symkin.workspace.sample import (
    closure_deviation,
    coordinate_names,
    inside_box,
    least_reach_margin,
    workspace_coordinates,
)

__all__ = ["Clearance", "Region", "allowed_candidates", "check_regions", "clearance"]

Region = Mapping[str, tuple[float, float]]

_BLOCK = 2**17  # candidates
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


@dataclass(frozen=True)
class Clearance:
    """How far candidates stay from where a robot with errors may not follow.

    Attributes
    ----------
    reach_margin : float
        Least distance of every leg from the end of its reach, m.
    conditioning_limit : float
        Largest condition number of dg/dpose, see `Mechanism.singularity_measures`.
    """

    reach_margin: float
    conditioning_limit: float


def clearance(mechanism: Mechanism, poses: NDArray[np.float64], sigmas: float) -> Clearance:
    """Return the clearance that the manufacturing tolerances ask for, or the workspace's own.

    A leg closes with an error of `sigmas` standard deviations of the closure h, whose parameters
    have errors of the tolerances' size (the largest of some of the poses): so far every leg stays
    from the end of its reach. The platform is moved by that error times the condition number c,
    and a singularity lies about the characteristic length over c away, to first order: so c stays
    below the square root of the length over the error. Poses up to twice as ill-conditioned as home
    are never left out.
    """
    workspace = mechanism.workspace
    own = Clearance(
        least_reach_margin(mechanism) if workspace else 0.0,
        workspace.conditioning_limit if workspace else math.inf,
    )
    error = sigmas * closure_deviation(mechanism, poses[:: -(-len(poses) // _SAMPLE)])
    if error == 0:
        return own
    home = float(mechanism.singularity_measures(mechanism.home)[2][0])
    limit = max(math.sqrt(mechanism.characteristic_length / error), 2 * home)
    return Clearance(max(own.reach_margin, error), min(own.conditioning_limit, limit))


def allowed_candidates(
    mechanism: Mechanism,
    task: Task,
    poses: NDArray[np.float64],
    conditions: NDArray[np.float64] | None,
    regions: Sequence[Region],
    kept: Clearance,
) -> NDArray[np.bool_]:
    """Whether each candidate may be measured, at all its images, shape (n,).

    Every image must lie in the workspace's box and in no region to avoid; where the clearance is
    wider than the workspace's own, the candidate must keep it. `conditions` are the candidates'
    condition numbers, if they are known.
    """
    if len(poses) > _BLOCK:  # images of all candidates at once would take more memory than they do
        blocks = [slice(first, first + _BLOCK) for first in range(0, len(poses), _BLOCK)]
        return np.concatenate(
            [
                allowed_candidates(
                    mechanism,
                    task,
                    poses[block],
                    None if conditions is None else conditions[block],
                    regions,
                    kept,
                )
                for block in blocks
            ]
        )
    allowed = np.ones(len(poses), dtype=np.bool_)
    settings = mechanism.workspace
    if settings is not None and kept.reach_margin > least_reach_margin(mechanism):
        margins = _core.reach_margin(mechanism.core, poses).min(axis=1)
        allowed &= margins >= kept.reach_margin
    if settings is not None and kept.conditioning_limit < settings.conditioning_limit:
        if conditions is None:
            conditions = mechanism.singularity_measures(poses)[2]
        allowed &= conditions <= kept.conditioning_limit
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
