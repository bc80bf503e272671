# SPDX-License-Identifier: MIT
"""Symmetry groups and their laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symkin
from symkin.analysis.observability import analyse_observability, observability_rows
from symkin.model.symmetry import (
    SymmetryGroup,
    leg_carriers,
    map_poses,
    observability_group,
    symmetry_deviations,
)

GROUPS = st.builds(
    SymmetryGroup,
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
    image = map_poses(mechanism, f"r{turn}", pose)
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
    assert [(leg, element.label) for leg, element in leg_carriers(undeclared)] == [
        (0, "r0"),
        (0, "r1"),
        (0, "r2"),
    ]


def test_what_breaks_the_symmetry_is_named_by_leg_and_parameter(paper):
    parameters = paper.parameters.copy()
    parameters[1, 4] += 0.002
    broken = paper.replace(symmetry=None).with_parameters(parameters)
    assert [leg for leg, _ in leg_carriers(broken)] == [0, 1, 2]
    group = SymmetryGroup("C3")
    deviations = symmetry_deviations(broken, group, 0.1)
    assert np.argmax(np.abs(deviations)) == 1 * 8 + 4
    assert deviations[1, 4] == pytest.approx(0.002)


def test_an_element_that_the_group_lacks_is_refused(paper):
    with pytest.raises(symkin.SymkinError, match="r0 to r2"):
        map_poses(paper, "s0", [[0, 0, 0]])


def test_planning_by_one_leg_serves_legs_whose_sensors_differ(paper):
    # O1 does not change with offsets: the gain's column moves by a multiple of the offset's. A gain
    # scales the paper's rows: by 1/k all of them, and the gain's column by 1/k again.
    parameters = paper.parameters.copy()
    gains = np.array([1, 1.1, 1.2])
    parameters[:, -2], parameters[:, -1] = gains, [0.5, 0.4, -0.3]
    other = paper.replace(symmetry=None).with_parameters(parameters)
    assert [(leg, element.label) for leg, element in leg_carriers(other)] == [
        (0, "r0"),
        (0, "r1"),
        (0, "r2"),
    ]
    poses = symkin.sample_workspace(other, 40, 3).poses
    for leg, (_, element) in enumerate(leg_carriers(other)):
        images = map_poses(other, element, poses)
        rows = observability_rows(other, leg, images)
        alone = observability_rows(paper, leg, images)
        assert_same_up_to_turns = np.unwrap(rows[:, -2] * gains[leg] ** 2 - alone[:, -2])
        np.testing.assert_allclose(rows[:, :-2] * gains[leg], alone[:, :-2], rtol=1e-9)
        np.testing.assert_allclose(assert_same_up_to_turns, assert_same_up_to_turns[0], atol=1e-9)
        logs = [np.linalg.slogdet(each.T @ each)[1] for each in (rows, alone)]
        assert logs[0] + 18 * np.log(gains[leg]) == pytest.approx(logs[1], abs=1e-6)


def test_a_plan_is_the_same_whatever_the_offsets_are(paper):
    parameters = paper.parameters.copy()
    parameters[:, -1] += [0.2, -0.3, 0.4]
    other = paper.with_parameters(parameters)
    settings = {"pose_count": 16, "seed": 4, "spares": 0}
    poses = symkin.sample_workspace(paper, 400, 1).poses
    plans = [symkin.make_plan(each, poses, **settings) for each in (paper, other)]
    np.testing.assert_array_equal(plans[0].poses, plans[1].poses)
    assert len(plans[1].basis.choices) == 1
    values = [plan.basis.choices[0].selection.criterion_value for plan in plans]
    assert values[0] == pytest.approx(values[1], rel=1e-9)


def rewritten(mechanism, leg, **change):
    """The mechanism, undeclared, with one leg's parameters changed by name, and its mode."""
    legs = list(mechanism.legs)
    values = {name: change.get(name, value) for name, value in legs[leg].parameters.items()}
    legs[leg] = symkin.Leg(legs[leg].chain, values, change.get("mode", legs[leg].working_mode))
    return mechanism.replace(legs=tuple(legs), symmetry=None)


@pytest.mark.parametrize("end", ["base", "platform"])
def test_a_negative_radius_is_the_point_on_the_other_side(paper, end):
    leg = paper.legs[1].parameters
    there = rewritten(
        paper,
        1,
        **{f"{end}_radius": -leg[f"{end}_radius"], f"{end}_angle": leg[f"{end}_angle"] + np.pi},
    )
    assert symkin.detect_symmetry(there).structure.name == "D_3"
    assert symkin.compare_symmetry(there).verdict == "exact"


def test_a_spatial_point_is_the_same_in_any_polar_coordinates(hexapod):
    leg = hexapod.legs[3].parameters
    for radius, polar, turn in ((-1, np.pi - leg["base_polar_angle"], np.pi), (1, None, np.pi)):
        there = rewritten(
            hexapod,
            3,
            base_radius=radius * leg["base_radius"],
            base_polar_angle=-leg["base_polar_angle"] if polar is None else polar,
            base_azimuth=leg["base_azimuth"] + turn,
        )
        assert symkin.compare_symmetry(there).verdict == "exact"


@pytest.mark.parametrize(("name", "travel", "end"), [("3PRR", -1, "base"), ("3RRP", 1, "platform")])
def test_a_guide_with_its_normal_turned_round_is_the_same_guide(name, travel, end):
    drawing = symkin.load_mechanism(name)
    leg = drawing.legs[1]
    there = rewritten(
        drawing,
        1,
        mode=-leg.working_mode,
        sensor_gain=travel * leg.parameters["sensor_gain"],
        sensor_offset=travel * leg.parameters["sensor_offset"],
        **{
            f"{end}_radius": -leg.parameters[f"{end}_radius"],
            f"{end}_angle": leg.parameters[f"{end}_angle"] + np.pi,
        },
    )
    poses = symkin.sample_workspace(drawing, 20).poses
    np.testing.assert_allclose(
        there.inverse_kinematics(poses), drawing.inverse_kinematics(poses), atol=1e-12
    )
    found = symkin.detect_symmetry(there)
    expected = symkin.detect_symmetry(drawing)
    assert found.structure.size == expected.structure.size
    assert found.with_modes.size == expected.with_modes.size


def test_a_central_leg_does_not_hide_the_symmetry_of_the_others(hexapod):
    # Its azimuths mean nothing, and it may stand anywhere in the list.
    for place in (0, 3):
        legs = list(hexapod.legs)
        central = dict(legs[0].parameters)
        central.update(base_radius=0.0, platform_radius=0.0, base_azimuth=1.1, platform_azimuth=0.2)
        legs.insert(place, symkin.Leg(legs[0].chain, central, legs[0].working_mode))
        there = hexapod.replace(legs=tuple(legs), symmetry=None)
        found = symkin.detect_symmetry(there)
        assert (found.structure.name, found.with_modes.name) == ("D_3", "D_3")
        assert found.permutations["r1"][place] == place


def test_legs_that_meet_in_the_centre_of_the_platform_are_symmetric_by_their_base():
    drawing = symkin.load_mechanism("3RRR")
    for leg in range(3):
        drawing = rewritten(drawing, leg, platform_radius=0.0, platform_angle=0.3)
    assert symkin.detect_symmetry(drawing).structure.name == "D_3"
    assert symkin.compare_symmetry(drawing).verdict == "exact"


def test_a_declared_symmetry_that_the_sensors_alone_lack_is_no_error(paper, tmp_path):
    parameters = paper.parameters.copy()
    parameters[:, -1] = [0.5, 0.6, 0.7]
    path = tmp_path / "sensors.toml"
    symkin.save_mechanism(paper.with_parameters(parameters), path)
    read = symkin.load_mechanism(path)
    assert path.read_text().count("[[legs]]") == 3
    np.testing.assert_array_equal(read.parameters, parameters)
    assert read.symmetry == paper.symmetry


def test_errors_within_the_tolerance_are_found_symmetric(paper):
    random = np.random.default_rng(2)
    for _ in range(20):
        signs = random.choice([-1, 1], paper.parameters.shape)
        made = paper.replace(symmetry=None).with_parameters(paper.parameters + 1e-6 * signs)
        found = symkin.compare_symmetry(made)
        assert (found.verdict, found.found.structure.name) == ("exact", "D_3")
        loose = symkin.detect_symmetry(
            paper.with_parameters(paper.parameters + 0.01 * signs), tolerance=0.01
        )
        assert loose.structure.name == "D_3"


def test_symmetrical_observability_has_the_direction_of_eq_14_and_not_of_eq_10_as_printed(paper):
    poses = symkin.sample_workspace(paper, 24, 1).poses

    def visible(leg, at):
        return analyse_observability(paper, leg, at).r_diagonal

    off = []
    for leg, element in ((1, "r1"), (2, "r2")):
        images = map_poses(paper, element, poses)
        np.testing.assert_allclose(visible(leg, images), visible(0, poses), rtol=1e-12)
        off.append(np.abs(visible(leg, poses) / visible(0, images) - 1).max())
    assert max(off) == pytest.approx(1.14, abs=0.005)  # the figure in docs/theory.md


def test_a_tilted_spatial_symmetry_is_said_not_to_be_looked_for(hexapod):
    parameters = hexapod.parameters.copy()
    radius, polar, azimuth = parameters[:, :3].T.copy()
    points = radius * [
        np.sin(polar) * np.cos(azimuth),
        np.sin(polar) * np.sin(azimuth),
        np.cos(polar),
    ]
    tilt = 0.2
    x, y, z = points
    y, z = np.cos(tilt) * y - np.sin(tilt) * z, np.sin(tilt) * y + np.cos(tilt) * z
    x, z = np.cos(tilt) * x + np.sin(tilt) * z, np.cos(tilt) * z - np.sin(tilt) * x
    parameters[:, 1], parameters[:, 2] = np.arccos(z / radius), np.arctan2(y, x)
    tilted = hexapod.replace(symmetry=None).with_parameters(parameters)
    assert "about Z" in symkin.compare_symmetry(tilted).sentences[0]
