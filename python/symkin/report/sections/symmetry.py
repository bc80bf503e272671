# SPDX-License-Identifier: MIT
"""The symmetry, and which element carries a leg to the others."""

from __future__ import annotations

from symkin._core import SymmetryGroup
from symkin.mechanism import Mechanism
from symkin.report.content import Group, Section, Table
from symkin.symmetry.group import (
    DetectedSymmetry,
    detect_symmetry,
    leg_carriers,
    observability_group,
    symmetry_group,
)
from symkin.symmetry.named import describe_element

__all__ = ["symmetry_section"]


def symmetry_section(mechanism: Mechanism) -> Section:
    """State the groups G_M and G_C, and how every leg comes from its reference leg."""
    group = symmetry_group(mechanism)
    found = detect_symmetry(mechanism)
    carriers = [
        (f"leg {leg}", f"leg {reference + 1}", element.label, describe_element(group, element))
        for leg, (reference, element) in enumerate(leg_carriers(mechanism), 1)
    ]
    table = Table(
        "Where the legs and their poses come from (Eqs. 7, 21)",
        ("Leg", "Image of", "Element", "Which is"),
        [Group(carriers)],
        wordy=True,
    )
    return Section("symmetry", "Symmetry", [_groups(found), _observability(mechanism)], [table])


def _groups(found: DetectedSymmetry) -> str:
    structure, kept = found.structure, found.with_modes
    if structure.size == 1:
        return "No symmetry was found in the nominal parameters."
    text = (
        f"The legs of the nominal mechanism are symmetric under {_name(structure)} "
        f"({structure.size} elements, {_name_in_paper(structure)} in the paper's notation), which "
        "is its group G_M."
    )
    if kept.size < structure.size:
        text += (
            f" Of these, {_name(kept)} keeps the working modes too; the other elements map the "
            "mechanism onto the one with opposite modes."
        )
    return text


def _observability(mechanism: Mechanism) -> str:
    elements = observability_group(mechanism)
    if elements is None:
        return (
            "Not every leg is an image of leg 1, so poses are chosen for more than one reference "
            "leg."
        )
    labels = ", ".join(element.label for element in elements)
    return (
        f"Every leg is an image of leg 1. The elements G_C = {{{labels}}} carry it, and the poses "
        "chosen for it, to legs 1, 2, \N{HORIZONTAL ELLIPSIS}: poses need to be chosen for one leg "
        "only."
    )


def _name(group: SymmetryGroup) -> str:
    return group.name.replace("_", "")


def _name_in_paper(group: SymmetryGroup) -> str:
    return group.paper_name.replace("_", "")
