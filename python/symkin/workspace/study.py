# SPDX-License-Identifier: MIT
"""What a workspace looks like, and whether it has the symmetry of the legs, tested on poses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from symkin import _core
from symkin.mechanism import Mechanism
from symkin.result import Result, Value, plain, record
from symkin.symmetry import DetectedSymmetry, SymmetryElement, SymmetryGroup, detect_symmetry
from symkin.workspace.sample import WorkspaceSample, sample_workspace, workspace_options
from symkin.workspace.slices import (
    ConstantOrientation,
    ModeSlices,
    mode_slices,
    other_working_modes,
)

__all__ = [
    "READING_ROUNDING",
    "ElementCheck",
    "WorkspaceStudy",
    "check_elements",
    "study_workspace",
]

READING_ROUNDING = 1e-9  # rad or m, far above what the readings inside a workspace differ by


@record
class ElementCheck(Value):
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


@record
class WorkspaceStudy(Result):
    """A mechanism's workspace.

    Attributes
    ----------
    mechanism : Mechanism
        Whose it is.
    symmetry : DetectedSymmetry
        Found from the legs.
    modes : tuple of ModeSlices
        The constant-orientation workspaces, first in the mechanism's own working modes, then, if
        they were asked for, in the others.
    sample : WorkspaceSample
        Poses of the total workspace; the readings there are the active-joint workspace.
    elements : tuple of ElementCheck
        For each element of the structure's group.
    """

    mechanism: Mechanism
    symmetry: DetectedSymmetry
    modes: tuple[ModeSlices, ...]
    sample: WorkspaceSample
    elements: tuple[ElementCheck, ...]

    PAGE: ClassVar[str] = "workspace.workspace_page"

    @property
    def slices(self) -> tuple[ConstantOrientation, ...]:
        """The constant-orientation workspaces in the mechanism's own working modes."""
        return self.modes[0].slices

    @property
    def share(self) -> float:
        """Share of the box that the total workspace takes."""
        return self.sample.share

    @property
    def workspace_group(self) -> tuple[str, ...]:
        """G_W: elements that map this workspace, in its modes and its aspect, onto itself."""
        return tuple(
            check.element for check in self.elements if check.keeps_aspect and check.mismatches == 0
        )

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row for each constant orientation of each working mode."""
        rows = [
            {"working_modes": modes.title, **found.to_dict()}
            for modes in self.modes
            for found in modes.slices
        ]
        return {name: [row[name] for row in rows] for name in rows[0]}

    def to_dict(self) -> dict[str, Any]:
        """Return figures and verdicts, without poses and grids."""
        symmetry, sample, unit = self.symmetry, self.sample, self.mechanism.reading_unit
        elements = [check.to_dict() for check in self.elements]
        for element in elements:
            element[f"reading_deviation_{unit}"] = element.pop("reading_deviation")
        return {
            "mechanism": self.mechanism.name,
            "symmetry": {
                "structure": symmetry.structure.name,
                "structure_in_the_paper": symmetry.structure.paper_name,
                "with_working_modes": symmetry.with_modes.name,
                "workspace": list(self.workspace_group),
            },
            "elements": elements,
            "total_workspace": {"poses": len(sample), **sample.to_dict()},
            "active_joint_workspace": {
                f"lower_{unit}": sample.readings.min(axis=0).tolist(),
                f"upper_{unit}": sample.readings.max(axis=0).tolist(),
            },
            "constant_orientations": plain(self.modes),
        }


def study_workspace(
    mechanism: Mechanism,
    orientations: Sequence[float] | None = None,
    count: int = 100_000,
    seed: int | None = None,
    resolution: int = 201,
    both_modes: bool = False,
) -> WorkspaceStudy:
    """Study the workspace and the active-joint workspace (section 6.2 of the paper).

    Parameters
    ----------
    mechanism : Mechanism
        With its workspace settings.
    orientations : sequence of float, optional
        Of the constant-orientation workspaces, rad; see `constant_orientations`.
    count : int
        Poses of the total workspace, and poses tested for each element of the symmetry.
    seed : int, optional
        By default the protocol's. The same seed gives the same study.
    resolution : int
        Cells along each side of the constant-orientation workspaces.
    both_modes : bool
        Whether to evaluate these with all legs in their other working mode too.

    Returns
    -------
    WorkspaceStudy

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, its home is not in it, or hardly any pose of its box is.
    """
    seed = mechanism.protocol.seed if seed is None else seed
    symmetry = detect_symmetry(mechanism)
    shown = [mechanism, other_working_modes(mechanism) if both_modes else None]
    return WorkspaceStudy(
        mechanism=mechanism,
        symmetry=symmetry,
        modes=tuple(mode_slices(each, orientations, resolution) for each in shown if each),
        sample=sample_workspace(mechanism, count, seed),
        elements=check_elements(mechanism, symmetry.structure, count, seed),
    )


def check_elements(
    mechanism: Mechanism,
    group: SymmetryGroup,
    count: int,
    seed: int,
    tolerance: tuple[float, float, float] | None = None,
) -> tuple[ElementCheck, ...]:
    """Test the theorem and the conjecture on so many poses of the box for each element of a group.

    The group maps the legs onto themselves within a tolerance of lengths (m), angles (rad) and
    gains, by default that of `detect_symmetry`.

    Raises
    ------
    SymmetryError
        If an element does not.
    """
    options = workspace_options(mechanism)
    allowed = _core.SymmetryTolerance(*(tolerance or ()))
    checks = []
    for element in group.elements:
        found = _core.verify_workspace_symmetry(
            mechanism.core, options, group.core, element, count, seed, allowed
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
    image = _core.transform_poses(group.core, element, mechanism.core, home)
    _, parallel, _ = mechanism.singularity_measures(np.concatenate([home, image]))
    return bool(parallel[0] * parallel[1] > 0)
