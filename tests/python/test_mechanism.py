# SPDX-License-Identifier: MIT
"""Mechanisms, their kinematics and what they refuse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symkin
from symkin.errors import MeasurementError, MechanismError

NEAR_HOME = st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-0.1, 0.3))


@given(NEAR_HOME)
def test_forward_kinematics_of_inverse_kinematics_returns_the_pose(pose):
    mechanism = symkin.load_mechanism("3RRR")
    found, converged = mechanism.forward_kinematics(mechanism.inverse_kinematics(pose))
    assert converged.all()
    np.testing.assert_allclose(found[0], pose, atol=1e-11)


@given(st.lists(st.floats(-0.15, 0.15), min_size=6, max_size=6))
def test_a_hexapods_forward_kinematics_undo_its_inverse_kinematics(step):
    mechanism = symkin.load_mechanism("hexapod_jugglebot")
    sample = symkin.sample_workspace(mechanism, 5, seed=int(1e6 * (1 + sum(step))))
    found, converged = mechanism.forward_kinematics(sample.readings)
    assert converged.all()
    np.testing.assert_allclose(found[:, :3], sample.poses[:, :3], atol=1e-10)
    quaternions = (
        found[:, 3:] * np.sign(np.sum(found[:, 3:] * sample.poses[:, 3:], axis=1))[:, None]
    )
    np.testing.assert_allclose(quaternions, sample.poses[:, 3:], atol=1e-10)


def test_one_name_has_the_role_that_it_plays_in_its_chain():
    crank, slider = symkin.chain_info("[R]RR"), symkin.chain_info("[P]RR")
    assert crank.parameter_roles["base_radius"] == ("base", "radius")
    assert slider.parameter_roles["base_radius"] == ("base", "direction_distance")
    assert slider.parameter_roles["base_angle"] == ("base", "direction_azimuth")
    assert slider.parameter_roles["platform_angle"] == ("platform", "azimuth")
    of_sensor = [name for name, role in slider.parameter_roles.items() if role.of_sensor]
    assert of_sensor == ["sensor_gain", "sensor_offset"]


def test_gains_of_sensors_are_those_of_the_parameters(paper):
    parameters = paper.parameters.copy()
    parameters[:, paper.parameter_names.index("sensor_gain")] = 1.5, -2, 3
    assert paper.with_parameters(parameters).sensor_gains.tolist() == [1.5, -2, 3]


def test_arrays_have_the_documented_shapes(paper, hexapod):
    for mechanism, coordinates, dof in ((paper, 3, 3), (hexapod, 7, 6)):
        legs, p = len(mechanism.legs), len(mechanism.parameter_names)
        poses = symkin.sample_workspace(mechanism, 5, seed=1).poses
        assert poses.shape == (5, coordinates)
        assert mechanism.parameters.shape == (legs, p)
        assert mechanism.inverse_kinematics(poses).shape == (5, legs)
        assert mechanism.parameter_jacobian(0, poses).shape == (5, p)
        assert mechanism.pose_jacobian(poses).shape == (5, legs, dof)
        readings = mechanism.inverse_kinematics(poses)
        assert mechanism.closure(1, poses, readings[:, 1]).shape == (5,)


def test_a_leg_out_of_reach_gives_nan_and_no_exception(paper):
    readings = paper.inverse_kinematics([[0, 0, 0], [5, 0, 0]])
    assert np.isfinite(readings[0]).all()
    assert np.isnan(readings[1]).all()


def test_a_mechanism_is_built_in_code_as_in_a_file(paper):
    built = symkin.Mechanism("built", [symkin.Leg(leg.chain, leg.parameters) for leg in paper.legs])
    np.testing.assert_array_equal(built.parameters, paper.parameters)
    np.testing.assert_array_equal(
        built.inverse_kinematics([0.1, 0, 0]), paper.inverse_kinematics([0.1, 0, 0])
    )


def changed(leg, **parameters):
    return symkin.Leg(leg.chain, {**leg.parameters, **parameters}, leg.working_mode)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda legs: legs[:2], "2 legs"),
        (lambda _: [], "none"),
        (lambda legs: [changed(legs[0], distal_length=-1.0), *legs[1:]], "leg 1.*distal_length"),
        (lambda legs: [*legs[:2], changed(legs[2], lenght=1.0)], "leg 3.*lenght"),
        (lambda legs: [*legs[:2], changed(legs[2], sensor_gain=0.0)], "leg 3.*sensor_gain"),
        (lambda _: [symkin.Leg("[R]RX", {})] * 3, 'unknown chain.*nearest.*"\\[R\\]R'),
        (lambda _: [symkin.Leg("P[R]P", {})] * 3, "orientation only"),
    ],
)
def test_what_cannot_be_a_mechanism_is_refused_in_words(paper, change, words):
    with pytest.raises(symkin.SymkinError, match=words):
        symkin.Mechanism("changed", change(list(paper.legs)))


@pytest.mark.parametrize("value", ["1 m", None, [1.0]])
def test_a_parameter_that_is_no_number_is_refused(value):
    with pytest.raises(symkin.SymkinError, match=r'"base_radius" is .*; expected a number'):
        symkin.Leg("R[P]R", {"base_radius": value})


def test_poses_of_another_kind_are_refused(paper):
    with pytest.raises(symkin.SymkinError, match="2 columns"):
        paper.inverse_kinematics([0.0, 0.0])


def test_the_gain_of_a_motor_that_winds_a_cable_has_its_unit(hexapod, paper):
    assert hexapod.parameter_units(0)[6:] == ("m/rad", "m")
    assert paper.parameter_units(0)[6:] == ("", "rad")


@pytest.mark.parametrize("quaternion", [(0, 0, 0, 0), (0, 0, 0, 2), (1e200, 0, 0, 0)])
def test_a_quaternion_that_is_no_rotation_is_refused(
    hexapod: symkin.Mechanism, quaternion: tuple[float, ...]
) -> None:
    poses = np.array([[0, 0, 0.7, 0, 0, 0, 1], [0, 0, 0.7, *quaternion]])
    readings = hexapod.inverse_kinematics(poses[:1])
    for function in (
        hexapod.inverse_kinematics,
        hexapod.pose_jacobian,
        hexapod.singularity_measures,
        lambda poses: hexapod.closure(0, poses, np.zeros(2)),
        lambda poses: hexapod.parameter_jacobian(0, poses),
        lambda poses: hexapod.forward_kinematics(readings, poses[1]),
    ):
        with pytest.raises(MechanismError, match="has a quaternion of norm"):
            function(poses)
    with pytest.raises(MeasurementError, match="row 2 has a quaternion of norm"):
        symkin.Measurements.of(poses, np.zeros((2, 6)))
    with pytest.raises(MeasurementError, match="row 2 has a reported quaternion of norm"):
        symkin.Measurements.of(poses[[0, 0]], np.zeros((2, 6)), reported=poses)


def test_every_public_name_is_offered_for_completion_and_is_there():
    assert set(symkin.__all__) <= set(dir(symkin))
    assert all(hasattr(symkin, name) for name in symkin.__all__)
    assert symkin.__version__[0].isdigit()


def test_a_plan_of_poses_where_their_number_belongs_is_refused_in_words(paper):
    with pytest.raises(symkin.SymkinError, match="pose_count is a WorkspaceSample; expected"):
        paper.plan(symkin.sample_workspace(paper, 20, seed=1))


def test_the_pose_jacobian_is_that_of_the_readings_of_curved_sensors_too(paper):
    curved = paper.replace(curvature=np.tile([0.02, 0.01, -0.03], (3, 1)))
    poses = symkin.sample_workspace(paper, 20, seed=1).poses
    step = 1e-6
    differences = np.stack(
        [
            curved.inverse_kinematics(poses + move) - curved.inverse_kinematics(poses - move)
            for move in step * np.eye(3)
        ],
        axis=2,
    ) / (2 * step)
    assert curved.pose_jacobian(poses) == pytest.approx(differences, rel=1e-6, abs=1e-7)
    assert np.abs(curved.pose_jacobian(poses) / paper.pose_jacobian(poses) - 1).max() > 1e-3
