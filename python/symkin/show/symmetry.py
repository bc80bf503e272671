# SPDX-License-Identifier: MIT
"""Symmetries of a mechanism, and how far an identified robot has them."""

from __future__ import annotations

import math

from symkin.errors import SymkinError
from symkin.estimate.estimate import Estimate
from symkin.estimate.robot_symmetry import RobotSymmetry, robot_symmetry
from symkin.model.symmetry import SymmetryPairs
from symkin.present import Group, Page, Section, Table, page_of
from symkin.show.wording import NONE, significant

_LIKELY = 0.05  # p values above it speak for the symmetry, or not against it


def pairs_table(pairs: SymmetryPairs) -> Table:
    """Show every symmetry: what it does, and what it keeps."""
    rows = [
        (
            each.label,
            each.words,
            " ".join(str(leg + 1) for leg in each.permutation),
            _yes(each.keeps_modes),
            _yes(each.fixes_home),
            _yes(each.permutes_readings),
        )
        for each in pairs.elements
    ]
    columns = ("Element", "Of the base", "Legs go to", "Keeps modes", "Keeps home", "Sensors agree")
    return Table("All symmetries", columns, [Group(rows)], wordy=True)


@page_of.register(SymmetryPairs)
def pairs_page(pairs: SymmetryPairs) -> Page:
    """Say which symmetries there are, and which of them carry poses."""
    kept, home = len(pairs.keep_modes), len(pairs.keep_modes_and_home)
    return Page(
        title="Symmetries of the mechanism",
        headlines=[
            ("In all", str(len(pairs.pairs)), pairs.name(pairs.pairs)),
            ("Keep the working modes", str(kept), pairs.name(pairs.keep_modes)),
            ("Keep home too, G_M", str(home), pairs.name(pairs.keep_modes_and_home)),
        ],
        notes=list(pairs.sentences[1:]),
        sections=[Section("pairs", "Symmetries", (), [pairs_table(pairs)])],
    )


def _yes(holds: bool) -> str:
    return "yes" if holds else "no"


def robot_symmetry_section(found: Estimate) -> Section:
    """Say how symmetric the robot is, or why that was not tested."""
    try:
        judged = robot_symmetry(found)
    except SymkinError as error:
        return Section("robot", "How symmetric the robot is", [f"Not tested: {error}."])
    return _section(judged)


@page_of.register(RobotSymmetry)
def robot_symmetry_page(judged: RobotSymmetry) -> Page:
    """Say the same on a page of its own."""
    return Page(
        title="How symmetric the robot is",
        judgement=_judgement(judged),
        sections=[_section(judged)],
    )


def _judgement(judged: RobotSymmetry) -> str:
    broken = [each.words for each in judged.tests if each.p_value < _LIKELY]
    if not broken:
        return f"Nothing speaks against the drawing's symmetry {judged.group}."
    if len(broken) == len(judged.tests):
        return f"The robot has no symmetry of the drawing's {judged.group}."
    return f"Of the drawing's {judged.group} the robot lacks {'; '.join(broken)}."


def _section(judged: RobotSymmetry) -> Section:
    tests = [
        (
            each.label,
            each.words,
            significant(each.chi_square),
            str(each.degrees_of_freedom),
            significant(each.p_value, 2),
        )
        for each in judged.tests
    ]
    kinds = [
        (
            each.kind,
            significant(each.common, 2),
            significant(each.different, 2),
            NONE if math.isnan(each.share) else f"{100 * each.share:.0f} %",
        )
        for each in judged.kinds
    ]
    text = (
        "Each symmetry is tested by what it changes in the robot's errors; a p value under 0.05 "
        "speaks against it. What only moves base or platform as a whole counts for nothing. The "
        "likeliest standard deviations of errors say how much all legs have in common and how much "
        "differs from leg to leg."
    )
    columns = ("Element", "Of the base", "Chi-square", "Degrees of freedom", "p value")
    return Section(
        "robot",
        "How symmetric the robot is",
        [_judgement(judged), text],
        [
            Table("Symmetries that the robot may have", columns, [Group(tests)], wordy=True),
            Table(
                "Errors, in tolerances",
                ("Of", "In common", "Different", "Common share of the variance"),
                [Group(kinds)],
            ),
        ],
    )
