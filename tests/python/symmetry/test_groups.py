# SPDX-License-Identifier: MIT
"""The groups by their names in the paper and in general."""

import symkin
from symkin.analysis.conditions import check_conditions
from symkin.model.symmetry import SymmetryGroup
from symkin.model.symmetry.groups import describe_element, mechanism_groups, subgroup_names


def named(groups):
    return [(each.symbol, each.paper_name, each.name, len(each.elements)) for each in groups]


def test_the_paper_mechanism_has_d6_and_c3_for_one_working_mode(paper):
    assert named(check_conditions(paper, count=2000).groups) == [
        ("G_M", "D_6", "D_3", 6),
        ("G_M", "C_3", "C_3", 3),
        ("G_W", "D_6", "D_3", 6),
        ("G_W", "C_3", "C_3", 3),
        ("G_Q", "C_3", "C_3", 3),
        ("G_C", "C_3", "C_3", 3),
    ]


def test_the_hexapod_has_d3_for_everything(hexapod):
    groups = check_conditions(hexapod, count=500).groups
    assert {each[1:] for each in named(groups)} == {("D_6", "D_3", 6)}


def test_a_five_bar_needs_its_reflection():
    five_bar = symkin.load_mechanism("5bar")
    *_, observability = mechanism_groups(five_bar, symkin.detect_symmetry(five_bar))
    assert observability.title == "D_2 (D_1)"
    assert observability.described == ("the identity", "reflection about the axis at 90°")


def test_elements_that_are_no_group_have_no_name():
    group = SymmetryGroup("D3")
    assert subgroup_names(group, [group.parse("r0"), group.parse("r1")]) == ("", "")
    assert subgroup_names(group, [group.parse("r0"), group.parse("s2")]) == ("D_2", "D_1")


def test_elements_are_described_by_their_angles():
    group = SymmetryGroup("D4", axis=0.0)
    words = [describe_element(group, element) for element in group.elements]
    assert words[1] == "rotation by 90°"
    assert words[5] == "reflection about the axis at 45°"
