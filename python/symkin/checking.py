# SPDX-License-Identifier: MIT
"""What a mechanism is like before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.conditions import Conditions, check_conditions
from symkin.mechanism import Mechanism
from symkin.observability import Observability, analyse_observability
from symkin.symmetry import leg_carriers, symmetry_group
from symkin.workspace import WorkspaceSample, sample_workspace

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
        Of dg/dpose, rotations scaled by the characteristic length.
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
    origins : tuple of LegOrigin
        For each leg.
    home : HomePose
        At the home pose.
    sample : WorkspaceSample or None
        Poses drawn; None for a mechanism without workspace settings.
    observability : tuple of Observability
        Of each leg over the sample; empty without one.
    conditions : Conditions or None
        The paper's conditions on symmetry, tested; None without workspace settings.
    """

    mechanism: Mechanism
    group: str
    declared: bool
    origins: tuple[LegOrigin, ...]
    home: HomePose
    sample: WorkspaceSample | None
    observability: tuple[Observability, ...]
    conditions: Conditions | None


def check_mechanism(mechanism: Mechanism, seed: int | None = None) -> CheckResult:
    """Check what a mechanism file describes: symmetry, home pose, workspace, identifiability.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    seed : int, optional
        Of the poses drawn from the workspace; by default the protocol's.

    Raises
    ------
    SymkinError
        If home is not in the workspace, or hardly any pose of its box is.
    """
    sample = None
    if mechanism.workspace is not None:
        sample = sample_workspace(mechanism, _SAMPLE_SIZE, seed)
    legs = range(len(mechanism.legs)) if sample is not None else ()
    return CheckResult(
        mechanism=mechanism,
        group=symmetry_group(mechanism).name,
        declared=mechanism.symmetry is not None,
        origins=tuple(
            LegOrigin(reference, element.label) for reference, element in leg_carriers(mechanism)
        ),
        home=_home(mechanism),
        sample=sample,
        observability=tuple(
            analyse_observability(mechanism, leg, sample.poses) for leg in legs if sample
        ),
        conditions=check_conditions(mechanism, seed=seed) if sample is not None else None,
    )


def _home(mechanism: Mechanism) -> HomePose:
    serial, parallel, condition = mechanism.singularity_measures(mechanism.home)
    return HomePose(
        pose=mechanism.home,
        readings=mechanism.inverse_kinematics(mechanism.home)[0],
        serial=serial[0],
        parallel=float(parallel[0]),
        condition=float(condition[0]),
    )
