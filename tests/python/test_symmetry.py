# SPDX-License-Identifier: MIT
"""Symmetry groups and their laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symkin
from symkin.symmetry import observability_group, symmetry_deviations

GROUPS = st.builds(
    symkin.SymmetryGroup,
    st.builds("{}{}".format, st.sampled_from("CD"), st.integers(1, 7)),
    st.floats(-3, 3),
)


@given(GROUPS, st.data())
def test_the_group_laws_hold(group, data):
    a, b, c = (data.draw(st.sampled_from(group.elements)) for _ in range(3))
    identity = group.parse("r0")
    assert group.compose(group.compose(a, b), c) == group.compose(a, group.compose(b, c))
    assert group.compose(identity, a) == a == group.compose(a, identity)
    assert group.compose(a, group.inverse(a)) == identity
    assert group.parse(a.label) == a


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.2, 0.5), st.integers(0, 2))
def test_readings_at_the_image_of_a_pose_are_the_permuted_readings(x, y, phi, turn):
    mechanism = symkin.load_mechanism("3RRR")
    pose = np.array([[x, y, phi]])
    image = symkin.map_poses(mechanism, f"r{turn}", pose)
    readings = mechanism.inverse_kinematics(pose)[0]
    np.testing.assert_allclose(
        np.roll(readings, turn), mechanism.inverse_kinematics(image)[0], atol=1e-12
    )


def test_the_carriers_of_the_hexapod_are_the_whole_of_d3(hexapod):
    labels = [element.label for element in observability_group(hexapod)]
    assert labels == ["r0", "s0", "r1", "s1", "r2", "s2"]


def test_the_paper_group_is_d6_for_the_structure_and_c3_for_one_working_mode(paper):
    found = symkin.detect_symmetry(paper)
    assert found.structure.paper_name == "D_6"
    assert found.with_modes.name == "C_3"
    assert found.permutations["r1"] == (1, 2, 0)
    assert not any(found.keeps_modes[f"s{i}"] for i in range(3))


def test_a_mechanism_that_declares_nothing_is_planned_by_the_symmetry_that_it_has(paper):
    undeclared = paper.replace(symmetry=None)
    assert [(leg, element.label) for leg, element in symkin.leg_carriers(undeclared)] == [
        (0, "r0"),
        (0, "r1"),
        (0, "r2"),
    ]


def test_what_breaks_the_symmetry_is_named_by_leg_and_parameter(paper):
    parameters = paper.parameters
    parameters[1, 4] += 0.002
    broken = paper.replace(symmetry=None).with_parameters(parameters)
    assert [leg for leg, _ in symkin.leg_carriers(broken)] == [0, 1, 2]
    group = symkin.SymmetryGroup("C3")
    deviations = symmetry_deviations(broken, group, 0.1)
    assert np.argmax(np.abs(deviations)) == 1 * 8 + 4
    assert deviations[1, 4] == pytest.approx(0.002)


def test_an_element_that_the_group_lacks_is_refused(paper):
    with pytest.raises(symkin.SymkinError, match="r0 to r2"):
        symkin.map_poses(paper, "s0", [[0, 0, 0]])
