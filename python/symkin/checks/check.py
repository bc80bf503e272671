# SPDX-License-Identifier: MIT
"""What a mechanism is like before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.checks.undefined_angles import undefined_angles
from symkin.errors import SymkinError
from symkin.mechanism import Mechanism
from symkin.observability import Observability, analyse_observability
from symkin.symmetry.comparison import SymmetryComparison, compare_symmetry
from symkin.symmetry.conditions import Conditions, check_conditions
from symkin.symmetry.group import leg_carriers, map_poses, symmetry_group
from symkin.symmetry.named import NamedGroup, mechanism_groups
from symkin.workspace.sample import WorkspaceSample, sample_workspace

__all__ = ["CheckResult", "HomePose", "LegOrigin", "check_mechanism"]

# Enough for two digits of the workspace's share of its box, and drawn in milliseconds.
_SAMPLE_SIZE = 500


@dataclass(frozen=True)
class LegOrigin:
    """Where a leg comes from.

    Attributes
    ----------
    reference : int
        The first leg (from 0) of its orbit.
    element : str
        The group element that carries the reference to it, such as ``"r1"``.
    """

    reference: int
    element: str


@dataclass(frozen=True)
class HomePose:
    """The mechanism at its home pose.

    Attributes
    ----------
    pose : ndarray, shape (coordinates,)
        m and rad (spatial: position and quaternion).
    readings : ndarray, shape (legs,)
        In the sensor's unit.
    serial : ndarray, shape (legs,)
        dh/dq, zero at a serial singularity.
    parallel : float
        det(dg/dpose), zero at a parallel singularity.
    condition : float
        Of dq/dpose, rotations scaled by the characteristic length.
    """

    pose: NDArray[np.float64]
    readings: NDArray[np.float64]
    serial: NDArray[np.float64]
    parallel: float
    condition: float


@dataclass(frozen=True)
class CheckResult:
    """What `check_mechanism` finds.

    Attributes
    ----------
    mechanism : Mechanism
        As given.
    group : str
        Its symmetry, such as ``"C3"``: the declared one, or
    declared : bool
        (if not declared) the one found that keeps the working modes.
    comparison : SymmetryComparison
        The symmetry that the legs have, against the declared one or one that is near.
    groups : tuple of NamedGroup
        G_M, its subgroup that keeps the working modes and G_C; with workspace settings G_W and G_Q
        too.
    origins : tuple of LegOrigin
        For each leg.
    home : HomePose
        At the home pose.
    sample : WorkspaceSample or None
        Poses drawn; None for a mechanism without workspace settings, or with unusable ones.
    observability : tuple of Observability
        Of each leg at its `leg_poses`; empty without a sample.
    conditions : Conditions or None
        The paper's conditions on symmetry, tested; None without a sample.
    unusable : SymkinError or None
        Why the workspace that the mechanism has could not be sampled, such as a singular home.
    """

    mechanism: Mechanism
    group: str
    declared: bool
    comparison: SymmetryComparison
    groups: tuple[NamedGroup, ...]
    origins: tuple[LegOrigin, ...]
    home: HomePose
    sample: WorkspaceSample | None
    observability: tuple[Observability, ...]
    conditions: Conditions | None
    unusable: SymkinError | None = None

    @property
    def undefined(self) -> tuple[str, ...]:
        """Joints at the origin of their frame, where an angle means nothing, in words."""
        legs = range(len(self.mechanism.legs))
        return tuple(each for leg in legs for each in undefined_angles(self.mechanism, leg))

    @property
    def untested(self) -> str:
        """Why conditions and identifiability were not tested; empty if they were."""
        if self.sample is not None:
            return ""
        return "no [workspace] in the file" if self.unusable is None else str(self.unusable)

    @property
    def share(self) -> float:
        """Share of the box that the workspace takes; NaN without workspace settings."""
        if self.sample is None:
            return float("nan")
        return 1 - sum(self.sample.rejected.values()) / self.sample.drawn

    @property
    def leg_poses(self) -> tuple[NDArray[np.float64], ...]:
        """For each leg the sample's poses, carried by the element that carries its reference.

        There a symmetric mechanism shows the same of every leg (Eq. 10). Empty without a sample.
        """
        if self.sample is None:
            return ()
        return leg_poses(self.mechanism, self.sample.poses)

    @property
    def orbits_in_words(self) -> str:
        """Which legs are images of each other."""
        if len(self.orbits) == len(self.origins):
            return "No leg is the image of another."
        if len(self.orbits) == 1:
            return "All legs are images of leg 1."
        orbits = "; ".join(", ".join(str(leg + 1) for leg in orbit) for orbit in self.orbits)
        return f"Legs that are images of each other: {orbits}."

    @property
    def orbits(self) -> tuple[tuple[int, ...], ...]:
        """Legs (from 0) that are images of each other, the reference leg first."""
        references = dict.fromkeys(origin.reference for origin in self.origins)
        return tuple(
            tuple(leg for leg, origin in enumerate(self.origins) if origin.reference == reference)
            for reference in references
        )


def check_mechanism(mechanism: Mechanism, seed: int | None = None) -> CheckResult:
    """Check what a mechanism file describes: symmetry, home pose, workspace, identifiability.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    seed : int, optional
        Of the poses drawn from the workspace; by default the protocol's.

    Returns
    -------
    CheckResult
        If home is not in the workspace, or hardly any pose of its box is, without a sample and what
        rests on it; `CheckResult.unusable` says why.
    """
    sample, unusable = None, None
    if mechanism.workspace is not None:
        try:
            sample = sample_workspace(mechanism, _SAMPLE_SIZE, seed)
        except SymkinError as error:
            unusable = error
    sets = () if sample is None else leg_poses(mechanism, sample.poses)
    comparison = compare_symmetry(mechanism)
    conditions = check_conditions(mechanism, seed=seed) if sample is not None else None
    groups = mechanism_groups(mechanism, comparison.found)
    return CheckResult(
        mechanism=mechanism,
        group=symmetry_group(mechanism).name,
        declared=mechanism.symmetry is not None,
        comparison=comparison,
        groups=groups if conditions is None else conditions.groups,
        origins=tuple(
            LegOrigin(reference, element.label) for reference, element in leg_carriers(mechanism)
        ),
        home=_home(mechanism),
        sample=sample,
        observability=tuple(
            analyse_observability(mechanism, leg, poses) for leg, poses in enumerate(sets)
        ),
        conditions=conditions,
        unusable=unusable,
    )


def leg_poses(mechanism: Mechanism, poses: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Carry poses to each leg by the element that carries its reference leg (Eqs. 14, 22)."""
    return tuple(map_poses(mechanism, element, poses) for _, element in leg_carriers(mechanism))


def _home(mechanism: Mechanism) -> HomePose:
    serial, parallel, condition = mechanism.singularity_measures(mechanism.home)
    return HomePose(
        pose=mechanism.home,
        readings=mechanism.inverse_kinematics(mechanism.home)[0],
        serial=serial[0],
        parallel=float(parallel[0]),
        condition=float(condition[0]),
    )
