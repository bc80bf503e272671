# SPDX-License-Identifier: MIT
"""The groups by their names, where the legs come from, and what breaks the symmetry."""

from __future__ import annotations

import math

from symkin.checks.check import CheckResult
from symkin.report.content import Group, Section, Table
from symkin.report.wording import NONE, quantity, significant
from symkin.symmetry.group import symmetry_group
from symkin.symmetry.named import describe_element

__all__ = ["groups_section"]


def groups_section(result: CheckResult) -> Section:
    """State G_M, G_W, G_Q and G_C, and compare them with what is declared."""
    parts = [_groups(result), _legs(result)]
    if result.comparison.deviations or result.comparison.sensor_deviations:
        parts.append(_deviations(result))
    paragraphs = [*result.comparison.sentences, result.orbits_in_words]
    return Section("symmetry", "Symmetry", paragraphs, parts)


def _groups(result: CheckResult) -> Table:
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
        for group in result.groups
    ]
    columns = ("Group", "In the paper", "Usually", "Size", "Elements")
    return Table("Groups", columns, [Group(rows)], wordy=True)


def _legs(result: CheckResult) -> Table:
    group = symmetry_group(result.mechanism)
    rows = [
        (
            f"leg {leg}",
            f"leg {origin.reference + 1}",
            origin.element,
            describe_element(group, group.parse(origin.element)),
        )
        for leg, origin in enumerate(result.origins, 1)
    ]
    caption = "Where the legs come from (Eqs. 7, 21)"
    return Table(caption, ("Leg", "Image of", "Element", "Which is"), [Group(rows)], wordy=True)


def _deviations(result: CheckResult) -> Table:
    """What breaks the symmetry, largest first."""
    mechanism, comparison = result.mechanism, result.comparison
    units = dict(zip(mechanism.parameter_names, mechanism.parameter_units, strict=True))
    rows = []
    for found in comparison.deviations + comparison.sensor_deviations:
        unit = units[found.parameter]
        known = not math.isnan(found.standard_deviation)
        rows.append(
            (
                f"leg {found.leg + 1}, {found.parameter}",
                quantity(found.deviation, unit).strip(),
                significant(found.in_tolerances),
                quantity(found.standard_deviation, unit, 2).strip() if known else NONE,
            )
        )
    reference = comparison.reference
    columns = ("Parameter", "Deviation", "In tolerances", "Standard deviation")
    broken = reference.paper_name if reference else "the symmetry of the sensors"
    return Table(f"What breaks {broken}", columns, [Group(rows)])
