# SPDX-License-Identifier: MIT
"""The paper's conditions, each with its verdict and the figure behind it."""

from __future__ import annotations

from symkin.checks.check import CheckResult
from symkin.report.content import Group, Section, Table
from symkin.report.wording import NONE, count
from symkin.symmetry.conditions import Condition, Conditions

__all__ = ["conditions_section"]

_TITLES = {
    4: "Section 4: symmetrical active-joint workspace",
    5: "Section 5: symmetrical observability",
}


def conditions_section(result: CheckResult) -> Section:
    """List the conditions (1)-(5) of section 4 and (1)-(7) of section 5."""
    conditions = result.conditions
    if conditions is None:
        text = f"The conditions are not tested: {result.untested}."
        return Section("conditions", "Conditions", [text])
    paragraph = (
        f"Each element of {conditions.group.paper_name} was tested on {count(conditions.tested)} "
        "poses of the workspace box: a pose is in the workspace exactly if its image is (Eq. 2), "
        "and the readings at the image are the image of the readings (Eq. 5). One that does not "
        "keep the working modes is tested against the workspace of the other modes."
    )
    parts = [_conditions(conditions), _elements(result, conditions)]
    return Section("conditions", "Conditions", [paragraph], parts)


def _conditions(conditions: Conditions) -> Table:
    groups = [
        Group([_row(found) for found in conditions.conditions if found.section == section], title)
        for section, title in _TITLES.items()
    ]
    columns = ("Condition", "Verdict", "Figure", "Allowed")
    return Table("The paper's conditions", columns, groups, wordy=True)


def _row(condition: Condition) -> tuple[str, ...]:
    return (
        f"({condition.number}) {condition.text}",
        "holds" if condition.holds else "fails",
        condition.figure,
        condition.tolerance or NONE,
    )


def _elements(result: CheckResult, conditions: Conditions) -> Table:
    rows = [
        (
            found.element,
            "yes" if found.keeps_modes else "no",
            "yes" if found.keeps_aspect else "no",
            count(found.tested),
            count(found.inside),
            count(found.mismatches),
            f"{found.reading_deviation:.2g} {result.mechanism.reading_unit}",
        )
        for found in conditions.elements
    ]
    columns = ("Element", "Keeps modes", "Keeps aspect", "Tested", "Inside", "Mismatches")
    return Table("Workspace and readings", (*columns, "Largest deviation"), [Group(rows)])
