# SPDX-License-Identifier: MIT
"""The paper's conditions for symmetrical workspaces and symmetrical observability, with figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symkin import _core
from symkin.mechanism import Mechanism
from symkin.symmetry import DetectedSymmetry, detect_symmetry, leg_carriers, symmetry_group
from symkin.workspace import sample_workspace, workspace_options

__all__ = ["Condition", "Conditions", "check_conditions"]

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Condition:
    """One condition of the paper.

    Attributes
    ----------
    section : int
        4 (symmetrical active-joint workspace) or 5 (symmetrical observability).
    number : int
        Its number there.
    text : str
        What it asks for.
    holds : bool
        The verdict.
    figure : str
        What the verdict rests on.
    tolerance : str
        What is allowed; empty where there is nothing to allow.
    """

    section: int
    number: int
    text: str
    holds: bool
    figure: str
    tolerance: str = ""


@dataclass(frozen=True)
class Conditions:
    """The groups of a mechanism and the conditions that they meet.

    Attributes
    ----------
    structure : str
        G_M in the paper's notation: of the structure, working modes aside.
    with_modes : str
        Its subgroup that keeps the working modes; verified as G_W and G_Q where the conditions on
        the workspace and the readings hold.
    carriers : tuple of str
        G_C: for each leg ``"leg 1 by r1"``, where it comes from.
    conditions : tuple of Condition
        Those of section 4, then of section 5.
    tested : int
        Poses on which workspace and readings were compared, for each element.
    """

    structure: str
    with_modes: str
    carriers: tuple[str, ...]
    conditions: tuple[Condition, ...]
    tested: int


@dataclass(frozen=True)
class _Measured:
    """Figures that several conditions share."""

    mismatches: int
    deviation: float
    closure: float
    home: float
    gains: float


def check_conditions(
    mechanism: Mechanism, count: int = 20_000, seed: int | None = None
) -> Conditions:
    """Test the conditions (1)-(5) of section 4 and (1)-(7) of section 5 of the paper.

    A mechanism with more legs than degrees of freedom fails condition 4(1) alone, which does not
    stop the protocol.

    Parameters
    ----------
    mechanism : Mechanism
        With workspace settings.
    count : int
        Poses on which each group element is tested.
    seed : int, optional
        Of the poses, by default the protocol's.

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, or hardly any pose of its box is in it.
    """
    seed = mechanism.protocol.seed if seed is None else seed
    found = detect_symmetry(mechanism)
    measured = _measure(mechanism, found, count, seed)
    return Conditions(
        structure=found.structure.paper_name,
        with_modes=found.with_modes.paper_name,
        carriers=tuple(
            f"leg {reference + 1} by {element.label}"
            for reference, element in leg_carriers(mechanism)
        ),
        conditions=(
            *_section_4(mechanism, found, measured),
            *_section_5(mechanism, found, measured),
        ),
        tested=count,
    )


def _measure(mechanism: Mechanism, found: DetectedSymmetry, count: int, seed: int) -> _Measured:
    options = workspace_options(mechanism)
    results = [
        _core.verify_workspace_symmetry(
            mechanism.core, options, found.structure, element, count, seed
        )
        for element in found.structure.elements
    ]
    sample = sample_workspace(mechanism, min(count, 1000), seed)
    closures = [
        mechanism.closure(leg, sample.poses, sample.readings[:, leg])
        for leg in range(len(mechanism.legs))
    ]
    gains = mechanism.parameters[:, -2]
    return _Measured(
        mismatches=sum(result.mismatches for result in results),
        deviation=max(result.reading_deviation for result in results),
        closure=float(np.max(np.abs(closures))),
        home=_home_deviation(mechanism),
        gains=float(np.ptp(gains) / np.abs(gains).max()),
    )


def _home_deviation(mechanism: Mechanism) -> float:
    """How far the home readings are from the images of the reference legs' readings."""
    group = symmetry_group(mechanism)
    readings = mechanism.inverse_kinematics(mechanism.home)[0]
    deviations = [0.0]
    for leg, (reference, element) in enumerate(leg_carriers(mechanism)):
        home = mechanism.home[None, :]
        moved = _core.transform_poses(group, element, mechanism.core, home)
        expected = _core.reading_sign(element, mechanism.core) * readings[reference]
        deviations.append(abs(mechanism.inverse_kinematics(moved)[0, leg] - expected))
        deviations.append(abs(readings[leg] - expected))
    return float(max(deviations))


def _section_4(
    mechanism: Mechanism, found: DetectedSymmetry, measured: _Measured
) -> list[Condition]:
    legs, dof = len(mechanism.legs), mechanism.core.dof
    return [
        Condition(
            4,
            1,
            "as many legs as degrees of freedom",
            legs == dof,
            f"{legs} legs, {dof} degrees of freedom",
        ),
        Condition(4, 2, "all legs have the same structure", True, f"{legs} legs {mechanism.chain}"),
        Condition(
            4,
            3,
            "each leg closes as g - q = 0",
            measured.closure <= _ROUNDING,
            f"largest closure {measured.closure:.1e} m",
            f"{_ROUNDING:.0e} m",
        ),
        Condition(
            4,
            4,
            "the structure has a symmetry group",
            found.structure.size > 1,
            f"G_M = {found.structure.paper_name} of {found.structure.size} elements",
            "1e-06 m, rad",
        ),
        Condition(
            4,
            5,
            "the active joints are symmetric in the symmetric configuration",
            measured.home <= _ROUNDING and found.with_modes.size > 1,
            f"home readings deviate by {measured.home:.1e} {mechanism.reading_unit}",
            f"{_ROUNDING:.0e} {mechanism.reading_unit}",
        ),
    ]


def _section_5(
    mechanism: Mechanism, found: DetectedSymmetry, measured: _Measured
) -> list[Condition]:
    names = mechanism.parameter_names
    spatial = mechanism.pose_space == "spatial"
    symmetric = found.structure.size > 1
    polar = "radius, polar angle, azimuth" if spatial else "radius (or distance), angle"
    return [
        Condition(
            5,
            1,
            "the structure's symmetry is a group G_M",
            symmetric,
            f"G_M = {found.structure.paper_name}",
        ),
        Condition(
            5,
            2,
            "the workspace has the symmetry (Eq. 2)",
            symmetric and measured.mismatches == 0,
            f"{measured.mismatches} poses whose image differs",
            "0",
        ),
        Condition(
            5, 3, "geometric model, perfect joints", True, "one closure a leg, by construction"
        ),
        Condition(5, 4, "base points in polar coordinates", True, polar),
        Condition(5, 5, "platform points in polar coordinates", True, polar),
        Condition(
            5,
            6,
            "equal nominal gains",
            measured.gains <= _ROUNDING,
            f"{names[-2]} differs by {measured.gains:.1e} of its size",
            f"{_ROUNDING:.0e}",
        ),
        Condition(
            5,
            7,
            "the active-joint workspace has the symmetry (Eq. 5)",
            symmetric and measured.deviation <= _ROUNDING,
            f"readings deviate by {measured.deviation:.1e} {mechanism.reading_unit}",
            f"{_ROUNDING:.0e} {mechanism.reading_unit}",
        ),
    ]
