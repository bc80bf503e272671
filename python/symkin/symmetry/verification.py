# SPDX-License-Identifier: MIT
"""Whether workspace and readings have the symmetry of the structure, tested on poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symkin import _core
from symkin.mechanism import Mechanism
from symkin.symmetry.group import SymmetryElement, SymmetryGroup
from symkin.workspace.sample import workspace_options

__all__ = ["ElementCheck", "check_elements"]


@dataclass(frozen=True)
class ElementCheck:
    """The workspace theorem (Eq. 2) and the active-joint conjecture (Eq. 5) for one element.

    Attributes
    ----------
    element : str
        Such as ``"r1"`` or ``"s0"``.
    keeps_modes : bool
        Whether it keeps the working modes. One that does not maps the workspace onto that of the
        opposite modes, and is tested against it.
    keeps_aspect : bool
        Whether it keeps the working modes and home's side of the parallel singularities, so that it
        can map the workspace onto itself.
    tested, inside, unreachable : int
        Poses drawn from the box; how many are in the workspace, or beyond a leg's reach.
    mismatches : int
        Poses that are in the workspace while their images are not, or the reverse; or that a leg
        reaches while its image does not reach theirs.
    reading_deviation : float
        Largest difference between the readings at the image of a pose and the image of its
        readings, in the sensor's unit.
    """

    element: str
    keeps_modes: bool
    keeps_aspect: bool
    tested: int
    inside: int
    unreachable: int
    mismatches: int
    reading_deviation: float


def check_elements(
    mechanism: Mechanism,
    group: SymmetryGroup,
    count: int,
    seed: int,
    tolerance: _core.SymmetryTolerance | None = None,
) -> tuple[ElementCheck, ...]:
    """Test the theorem and the conjecture on poses of the box for each element of a group.

    Parameters
    ----------
    mechanism : Mechanism
        With its workspace settings.
    group : SymmetryGroup
        That maps the legs onto themselves.
    count : int
        Poses for each element.
    seed : int
        Of the poses.
    tolerance : SymmetryTolerance, optional
        Within which it maps the legs, by default that of `detect_symmetry`.

    Returns
    -------
    tuple of ElementCheck
        In the order of the group's elements.

    Raises
    ------
    SymmetryError
        If an element does not map the legs onto themselves.
    """
    options = workspace_options(mechanism)
    allowed = _core.SymmetryTolerance() if tolerance is None else tolerance
    checks = []
    for element in group.elements:
        found = _core.verify_workspace_symmetry(
            mechanism.core, options, group, element, count, seed, allowed
        )
        checks.append(
            ElementCheck(
                element=element.label,
                keeps_modes=found.keeps_modes,
                keeps_aspect=found.keeps_modes and _keeps_side(mechanism, group, element),
                tested=found.tested,
                inside=found.inside,
                unreachable=found.unreachable,
                mismatches=found.mismatches,
                reading_deviation=found.reading_deviation,
            )
        )
    return tuple(checks)


def _keeps_side(mechanism: Mechanism, group: SymmetryGroup, element: SymmetryElement) -> bool:
    """Whether det(dg/dpose) has the same sign at home and at its image."""
    home = mechanism.home[np.newaxis]
    image = _core.transform_poses(group, element, mechanism.core, home)
    _, parallel, _ = mechanism.singularity_measures(np.concatenate([home, image]))
    return bool(parallel[0] * parallel[1] > 0)
