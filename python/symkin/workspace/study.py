# SPDX-License-Identifier: MIT
"""What a workspace looks like, and whether it has the mechanism's symmetry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from symkin.mechanism import Mechanism
from symkin.symmetry.group import DetectedSymmetry, detect_symmetry
from symkin.symmetry.verification import ElementCheck, check_elements
from symkin.workspace.sample import WorkspaceSample, sample_workspace
from symkin.workspace.slices import (
    ConstantOrientation,
    ModeSlices,
    mode_slices,
    other_working_modes,
)

__all__ = ["WorkspaceStudy", "study_workspace"]


@dataclass(frozen=True)
class WorkspaceStudy:
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

    @property
    def slices(self) -> tuple[ConstantOrientation, ...]:
        """The constant-orientation workspaces in the mechanism's own working modes."""
        return self.modes[0].slices

    @property
    def share(self) -> float:
        """Share of the box that the total workspace takes."""
        return 1 - sum(self.sample.rejected.values()) / self.sample.drawn

    @property
    def workspace_group(self) -> tuple[str, ...]:
        """G_W: elements that map this workspace, in its modes and its aspect, onto itself."""
        return tuple(
            check.element for check in self.elements if check.keeps_aspect and check.mismatches == 0
        )


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
