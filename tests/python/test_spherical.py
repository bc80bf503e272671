# SPDX-License-Identifier: MIT
"""Platforms that only turn: their poses in arrays and files, and what is said of them."""

from dataclasses import replace

import numpy as np
import pytest

import symkin
from symkin.analysis.alignment import poses_of_mechanism
from symkin.analysis.checks import undefined_angles
from symkin.analysis.observed import Observed
from symkin.errors import MeasurementError, MechanismFileError, SymkinError
from symkin.model.poses import poses_from_bounds
from symkin.model.settings import ProtocolSettings
from symkin.planning import make_plan


@pytest.fixture(scope="module")
def eye():
    eye = symkin.load_mechanism("agile_eye")
    return eye.replace(protocol=ProtocolSettings(eye.protocol.pose_count, 1500, 1))


@pytest.fixture(scope="module")
def plan(eye):
    return make_plan(eye, symkin.sample_workspace(eye, 500))


@pytest.fixture(scope="module")
def measured(eye, plan):
    return symkin.simulate(eye, plan, seed=3)


def test_at_home_all_neighbouring_axes_of_the_agile_eye_stand_at_right_angles(eye):
    readings = eye.inverse_kinematics(eye.home)[0]
    for leg, reading in enumerate(readings):
        base, elbow, platform = eye.core.joint_centres(leg, eye.home, reading)
        np.testing.assert_allclose([base @ elbow, elbow @ platform], 0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm([base, elbow, platform], axis=1), 1)
    motors = [eye.core.joint_centres(leg, eye.home, 0.0)[0] for leg in range(3)]
    np.testing.assert_allclose(np.array(motors) @ np.array(motors).T, np.eye(3), atol=1e-12)


def test_forward_kinematics_finds_the_orientation_that_the_readings_came_from(eye):
    poses = symkin.sample_workspace(eye, 200).poses
    found, converged = eye.forward_kinematics(eye.inverse_kinematics(poses))
    assert converged.all()
    signs = np.sign(np.sum(found * poses, axis=1, keepdims=True))
    np.testing.assert_allclose(signs * found, poses, atol=1e-9)


def test_a_pose_is_a_unit_quaternion_alone(eye):
    np.testing.assert_array_equal(eye.home, [0, 0, 0, 1])
    with pytest.raises(SymkinError, match=r"quaternion of norm 1\.1"):
        eye.inverse_kinematics([[0, 0, 0, 1.1]])
    with pytest.raises(SymkinError, match="a spherical pose has 4"):
        eye.inverse_kinematics([[0, 0, 0.1]])


def test_an_arc_of_half_a_turn_and_a_position_in_the_workspace_are_refused(eye, tmp_path):
    text = eye.source.read_text()
    path = tmp_path / "eye.toml"
    path.write_text(text.replace('distal_arc = "90 deg"', 'distal_arc = "180 deg"'))
    with pytest.raises(MechanismFileError, match=r"distal_arc = 3\.14.*between 0 and pi"):
        symkin.load_mechanism(path)
    path.write_text(text.replace("[workspace]", '[workspace]\nx = ["-1 mm", "1 mm"]'))
    with pytest.raises(MechanismFileError, match=r"workspace\.x: unknown key"):
        symkin.load_mechanism(path)


def test_a_mechanism_file_reads_back(eye, tmp_path):
    own = eye.replace(workspace=replace(eye.workspace, reach_margin=0.05))
    own.save(tmp_path / "saved.toml")
    assert "reach_margin = 0.05  # rad" in (tmp_path / "saved.toml").read_text()
    again = symkin.load_mechanism(tmp_path / "saved.toml")
    np.testing.assert_array_equal(again.parameters, eye.parameters)
    assert again.workspace == own.workspace


def test_measurements_are_written_as_quaternions_and_read_as_rotation_vectors_too(
    eye, measured, tmp_path
):
    taken = measured.measurements
    path = taken.save(tmp_path / "measured.csv")
    assert path.read_text().splitlines()[0].startswith("leg,qx,qy,qz,qw,psi_1_rad")
    again = symkin.read_measurements(path, eye)
    assert again.pose_space == "spherical"
    np.testing.assert_array_equal(again.poses, taken.poses)
    vectors = np.array([[0.1, -0.2, 0.05], [0.02, 0.1, 0.2]])
    rows = [
        [*np.degrees(vector), *reading]
        for vector, reading in zip(
            vectors, eye.inverse_kinematics(poses_from_bounds("spherical", vectors)), strict=True
        )
    ]
    lines = ["rx_deg,ry_deg,rz_deg,psi_1_rad,psi_2_rad,psi_3_rad"]
    lines += [",".join(map(str, row)) for row in rows]
    path.write_text("\n".join(lines))
    turned = symkin.read_measurements(path, eye)
    np.testing.assert_allclose(turned.poses, poses_from_bounds("spherical", vectors), atol=1e-15)


@pytest.mark.parametrize("estimator", ["paper", "inverse", "implicit", "joint"])
def test_every_estimator_finds_the_parameters_within_their_deviations(eye, measured, estimator):
    found = symkin.identify(eye, measured.measurements, estimator=estimator)
    assert found.converged
    errors = found.mechanism.parameters - measured.actual.parameters
    assert (np.abs(errors / found.deviations) < 4).all()
    assert found.after.orientation_rms < found.before.orientation_rms / 3


def test_what_is_said_has_angles_alone(eye, plan, measured, tmp_path):
    found = symkin.identify(eye, measured.measurements)
    pages = [
        eye.check(),
        plan,
        found,
        found.after,
        symkin.cross_validate(eye, measured.measurements),
    ]
    for text in (page.text(whole=True) for page in pages):
        assert " mm" not in text, text
        assert "osition error" not in text, text
    found.save_calibrated(tmp_path / "found.toml")
    assert " rad before, " in (tmp_path / "found.toml").read_text().splitlines()[2]
    assert "rms_rad" in found.after.to_dict()["closures"]
    assert "residual_rms_rad" in symkin.cross_validate(eye, measured.measurements).to_dict()


def test_robots_scatter_as_the_first_order_prediction_says(eye, plan):
    ratios = []
    for seed in range(30):
        simulated = symkin.simulate(eye, plan, seed=seed)
        found = symkin.identify(eye, simulated.measurements)
        errors = found.mechanism.parameters - simulated.actual.parameters
        ratios.append((errors / found.deviations) ** 2)
    # 720 squares of standard normals, correlated within a leg.
    assert 0.8 < np.mean(ratios) < 1.2


def test_the_frames_of_a_tracker_are_found_from_orientations(eye, plan, tmp_path):
    base, target = (0.3, -0.2, 1.1), (0.1, 0.2, -0.4)
    tracker = Observed("pose", base=base, target=target)
    taken = symkin.simulate(eye, plan, seed=4, observe=tracker).measurements
    table = taken.save(tmp_path / "tracked.csv")
    aligned = symkin.align_frames(*poses_of_mechanism(eye, table))
    assert aligned.trustworthy, aligned.doubts
    np.testing.assert_allclose(aligned.frames.base, base, atol=0.02)
    np.testing.assert_allclose(aligned.frames.target, target, atol=0.02)
    assert " mm" not in aligned.text(whole=True)
    found = symkin.identify(eye, taken, frames=["base", "target"], prior="tolerances")
    assert found.trustworthy, found.doubts
    frames = found.mechanism.frames
    np.testing.assert_allclose([*frames.base, *frames.target], [*base, *target], atol=0.02)


@pytest.mark.parametrize(
    ("observed", "words"),
    [
        ({"kinds": "height"}, "a height above a plane is observed in space"),
        ({"kinds": ("pose",), "base": (1, 2, 3, 4, 5, 6)}, "expected rx, ry, rz in rad"),
    ],
)
def test_what_needs_a_position_is_refused(eye, plan, observed, words):
    with pytest.raises(SymkinError, match=words):
        symkin.simulate(eye, plan, observe=Observed(**observed))


def test_a_wanted_position_and_another_kind_of_poses_are_refused(eye, measured):
    curve = symkin.pose_count_curve(eye, symkin.sample_workspace(eye, 200), counts=[12])
    with pytest.raises(SymkinError, match="only turns: it has no position"):
        curve.for_accuracy(position=1e-4)
    with pytest.raises(MeasurementError, match="a spatial pose has 7"):
        replace(measured.measurements, pose_space="spatial")


def test_an_axis_along_z_has_no_azimuth(eye):
    values = eye.parameters.copy()
    values[:, list(eye.parameter_names).index("base_polar_angle")] = 0.0
    (said,) = undefined_angles(eye.replace(symmetry=None).with_parameters(values), 0)
    assert "base_polar_angle is 0 deg: its base axis is on Z" in said
    assert "base_azimuth does what sensor_offset does" in said
