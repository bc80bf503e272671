# SPDX-License-Identifier: MIT
"""The symmetry: groups, where the legs come from, what breaks it, the paper's conditions."""

from __future__ import annotations

import math
from collections.abc import Sequence

from symkin.conditions import Condition, Conditions
from symkin.mechanism import Mechanism
from symkin.report.content import Group, Page, Section, Table
from symkin.report.wording import NONE, count, plural, quantity, significant
from symkin.symmetry import (
    DetectedSymmetry,
    NamedGroup,
    SymmetryComparison,
    compare_symmetry,
    leg_carriers,
    symmetry_group,
)
from symkin.symmetry.group import describe_element
from symkin.workspace.study import ElementCheck

__all__ = [
    "carriers_table",
    "comparison_page",
    "conditions_page",
    "conditions_section",
    "detection_page",
    "deviations_table",
    "elements_table",
    "groups_table",
    "symmetry_section",
]

_TITLES = {
    4: "Section 4: symmetrical active-joint workspace",
    5: "Section 5: symmetrical observability",
}
_ALWAYS_SHOWN = 10  # deviations


def symmetry_section(
    mechanism: Mechanism,
    comparison: SymmetryComparison | None = None,
    groups: Sequence[NamedGroup] = (),
) -> Section:
    """State the symmetry that there is, and how every leg comes from its reference leg."""
    comparison = comparison or compare_symmetry(mechanism)
    parts = [groups_table(groups)] if groups else []
    return Section(
        "symmetry",
        "Symmetry",
        [*comparison.sentences, _orbits(mechanism)],
        [*parts, carriers_table(mechanism)],
    )


def carriers_table(mechanism: Mechanism) -> Table:
    """Show which element carries which leg to every leg."""
    group = symmetry_group(mechanism)
    rows = [
        (f"leg {leg}", f"leg {reference + 1}", element.label, describe_element(group, element))
        for leg, (reference, element) in enumerate(leg_carriers(mechanism), 1)
    ]
    caption = "Where the legs and their poses come from (Eqs. 7, 21)"
    return Table(caption, ("Leg", "Image of", "Element", "Which is"), [Group(rows)], wordy=True)


def groups_table(groups: Sequence[NamedGroup]) -> Table:
    """Show groups by their names and elements."""
    rows = [
        (
            f"{group.symbol}, {group.meaning}",
            group.paper_name or "no group",
            group.name or "no group",
            str(len(group.elements)),
            "; ".join(
                f"{label}: {words}"
                for label, words in zip(group.elements, group.described, strict=True)
            ),
        )
        for group in groups
    ]
    columns = ("Group", "In the paper", "Usually", "Size", "Elements")
    return Table("Groups", columns, [Group(rows)], wordy=True)


def deviations_table(comparison: SymmetryComparison) -> Table:
    """Show what breaks a symmetry, largest first."""
    rows = [
        (
            f"leg {found.leg + 1}, {found.parameter}",
            quantity(found.deviation, found.unit).strip(),
            significant(found.in_tolerances),
            NONE
            if math.isnan(found.standard_deviation)
            else quantity(found.standard_deviation, found.unit, 2).strip(),
        )
        for found in comparison.deviations + comparison.sensor_deviations
    ]
    columns = ("Parameter", "Deviation", "In tolerances", "Standard deviation")
    return Table(
        "Where the legs differ", columns, [Group(rows)], brief=True, brief_rows=_ALWAYS_SHOWN
    )


def elements_table(
    caption: str, elements: Sequence[ElementCheck], unit: str, *, brief: bool = False
) -> Table:
    """Show what poses say of each element of a group."""
    rows = [
        (
            found.element,
            "yes" if found.keeps_modes else "no",
            "yes" if found.keeps_aspect else "no",
            count(found.tested),
            count(found.inside),
            count(found.mismatches),
            f"{found.reading_deviation:.2g} {unit}",
        )
        for found in elements
    ]
    columns = ("Element", "Keeps modes", "Keeps aspect", "Tested", "Inside", "Mismatches")
    return Table(caption, (*columns, "Largest deviation"), [Group(rows)], brief=brief)


def conditions_section(conditions: Conditions) -> Section:
    """List the conditions (1)-(5) of section 4 and (1)-(7) of section 5."""
    paragraph = (
        f"Each element of {conditions.tested_group} was tested on {count(conditions.tested)} "
        "poses of the workspace box: a pose is in the workspace exactly if its image is (Eq. 2), "
        "and the readings at the image are the image of the readings (Eq. 5). One that does not "
        "keep the working modes is tested against the workspace of the other modes."
    )
    groups = [
        Group([_row(found) for found in conditions.conditions if found.section == section], title)
        for section, title in _TITLES.items()
    ]
    columns = ("Condition", "Verdict", "Figure", "Allowed")
    parts = [
        Table("The paper's conditions", columns, groups, wordy=True),
        elements_table("Workspace and readings", conditions.elements, conditions.reading_unit),
    ]
    return Section("conditions", "Conditions", [paragraph], parts)


def _row(condition: Condition) -> tuple[str, ...]:
    return (
        f"({condition.number}) {condition.text}",
        "holds" if condition.holds else "fails",
        condition.figure,
        condition.tolerance or NONE,
    )


def detection_page(found: DetectedSymmetry) -> Page:
    """Say which symmetry the legs have."""
    return Page(
        title="Symmetry of the legs",
        headlines=[
            ("Structure", found.structure.title, plural(found.structure.size, "element")),
            ("With the working modes", found.with_modes.title, ""),
        ],
    )


def comparison_page(comparison: SymmetryComparison) -> Page:
    """Say how near the legs are to a symmetry, and what breaks it."""
    first, *others = comparison.sentences
    sections = []
    if comparison.deviations or comparison.sensor_deviations:
        table = deviations_table(comparison)
        sections = [Section("differences", "What breaks the symmetry", (), [table])]
    return Page(
        title="Symmetry of the legs",
        headlines=[("Structure", comparison.found.structure.title, comparison.verdict)],
        verdict="good" if comparison.verdict == comparison.sensors == "exact" else "doubtful",
        judgement=first,
        notes=others,
        sections=sections,
    )


def conditions_page(conditions: Conditions) -> Page:
    """Say which of the paper's conditions hold."""
    failing = [each for each in conditions.conditions if not each.holds]
    total = len(conditions.conditions)
    return Page(
        title="The paper's conditions",
        headlines=[
            ("Conditions", f"{total - len(failing)} of {total}", "hold"),
            ("Structure, G_M", conditions.structure, ""),
            ("With the working modes", conditions.with_modes, ""),
        ],
        verdict="doubtful" if failing else "good",
        judgement="Not all conditions hold" if failing else "All conditions hold",
        doubts=[f"{each.section}({each.number}) {each.text}: {each.figure}" for each in failing],
        sections=[
            Section("groups", "Groups", (), [groups_table(conditions.groups)]),
            conditions_section(conditions),
        ],
    )


def _orbits(mechanism: Mechanism) -> str:
    """Which legs are images of each other."""
    orbits: dict[int, list[int]] = {}
    for leg, (reference, _) in enumerate(leg_carriers(mechanism)):
        orbits.setdefault(reference, []).append(leg)
    if len(orbits) == 1:
        return (
            "All legs are images of leg 1. The elements G_C of the table carry it, and the poses "
            "chosen for it, to the others: poses need to be chosen for one leg only."
        )
    if len(orbits) == len(mechanism.legs):
        return "No leg is the image of another: poses are chosen for each."
    listed = "; ".join(", ".join(str(leg + 1) for leg in orbit) for orbit in orbits.values())
    return f"Legs that are images of each other: {listed}. Poses are chosen for one of each."
