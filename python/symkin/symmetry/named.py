# SPDX-License-Identifier: MIT
"""The groups of a mechanism by their names: G_M, G_W, G_Q and G_C of the paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from symkin.mechanism import Mechanism
from symkin.symmetry.group import (
    DetectedSymmetry,
    SymmetryElement,
    SymmetryGroup,
    leg_carriers,
    symmetry_group,
)
from symkin.symmetry.verification import ElementCheck

__all__ = [
    "READING_ROUNDING",
    "NamedGroup",
    "describe_element",
    "group_title",
    "mechanism_groups",
    "subgroup_names",
    "tested_groups",
]

READING_ROUNDING = 1e-9  # rad or m, far above what the readings inside a workspace differ by


@dataclass(frozen=True)
class NamedGroup:
    """A group of the paper, or a set of elements that is none.

    Attributes
    ----------
    symbol : str
        Such as ``"G_M"``.
    meaning : str
        Of what it is the group.
    paper_name : str
        ``"D_6"`` for the dihedral group with six elements; empty if the elements form no group.
    name : str
        The usual name of the same, ``"D_3"``.
    elements : tuple of str
        By label: ``"r0"``, ``"r1"``, ..., ``"s0"``, ...
    described : tuple of str
        The same in words.
    """

    symbol: str
    meaning: str
    paper_name: str
    name: str
    elements: tuple[str, ...]
    described: tuple[str, ...]

    @property
    def title(self) -> str:
        """Its name in the paper, with the usual one if it is another: ``"D_6 (D_3)"``."""
        return group_title(self.paper_name, self.name) if self.name else "no group"


def mechanism_groups(mechanism: Mechanism, found: DetectedSymmetry) -> tuple[NamedGroup, ...]:
    """Return the groups that the legs alone tell: G_M, its subgroup, and G_C.

    Parameters
    ----------
    mechanism : Mechanism
        Whose they are.
    found : DetectedSymmetry
        Of `detect_symmetry`.

    Returns
    -------
    tuple of NamedGroup
        Three.
    """
    structure = found.structure
    kept = [element for element in structure.elements if found.keeps_modes[element.label]]
    group = symmetry_group(mechanism)
    carriers = list(dict.fromkeys(element for _, element in leg_carriers(mechanism)))
    return (
        _named("G_M", "structure", structure, structure.elements),
        _named("G_M", "with the working modes", structure, kept),
        _named("G_C", "observability", group, carriers),
    )


def tested_groups(group: SymmetryGroup, checks: Sequence[ElementCheck]) -> tuple[NamedGroup, ...]:
    """Return G_W and G_Q: the elements for which poses bore out Eq. 2, and Eq. 5 too.

    Elements that flip the working modes carry the workspace onto that of the other modes: they
    belong to G_W of both together, and neither to that of one nor to its G_Q.

    Parameters
    ----------
    group : SymmetryGroup
        Whose elements were tested.
    checks : sequence of ElementCheck
        One for each element.

    Returns
    -------
    tuple of NamedGroup
        G_W, its subgroup that keeps modes and aspect, and G_Q.
    """
    both = [check.mismatches == 0 for check in checks]
    workspace = [holds and check.keeps_aspect for holds, check in zip(both, checks, strict=True)]
    joints = [
        holds and check.reading_deviation <= READING_ROUNDING
        for holds, check in zip(workspace, checks, strict=True)
    ]
    return (
        _named("G_W", "workspace", group, _chosen(group, both)),
        _named("G_W", "with the working modes", group, _chosen(group, workspace)),
        _named("G_Q", "active joints", group, _chosen(group, joints)),
    )


def subgroup_names(group: SymmetryGroup, elements: Sequence[SymmetryElement]) -> tuple[str, str]:
    """Name a set of a group's elements, in the paper's and the usual notation.

    Returns
    -------
    paper_name, name : str
        Such as ``"D_6"`` and ``"D_3"``; empty if the elements form no group.
    """
    inside = set(elements)
    if {group.compose(outer, inner) for outer in inside for inner in inside} != inside:
        return "", ""
    rotations = sum(not element.reflection for element in inside)
    if len(inside) == rotations:
        return f"C_{rotations}", f"C_{rotations}"
    return f"D_{2 * rotations}", f"D_{rotations}"


def group_title(paper_name: str, name: str) -> str:
    """Return the paper's name of a group, with the usual one if it is another: ``D_6 (D_3)``."""
    return paper_name if paper_name == name else f"{paper_name} ({name})"


def describe_element(group: SymmetryGroup, element: SymmetryElement) -> str:
    """Say in words what an element of a group does."""
    turn = group.angle(element)
    if element.reflection:
        azimuth = math.remainder(group.frame.base_axis + turn, math.pi) % math.pi
        return f"reflection about the axis at {_degrees(azimuth)}"
    if element.rotation == 0:
        return "the identity"
    return f"rotation by {_degrees(turn)}"


def _chosen(group: SymmetryGroup, holds: Sequence[bool]) -> list[SymmetryElement]:
    return [element for element, yes in zip(group.elements, holds, strict=True) if yes]


def _named(
    symbol: str, meaning: str, group: SymmetryGroup, elements: Sequence[SymmetryElement]
) -> NamedGroup:
    return NamedGroup(
        symbol,
        meaning,
        *subgroup_names(group, elements),
        tuple(element.label for element in elements),
        tuple(describe_element(group, element) for element in elements),
    )


def _degrees(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.4g}\N{DEGREE SIGN}"
