# SPDX-License-Identifier: MIT
"""Where a fit starts: poses from readings, frames from what a device saw."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symkin
from symkin import _core
from symkin.analysis.observed import Observed
from symkin.errors import MeasurementError
from symkin.planning.simulation import disturb


def nothing():
    return _core.Observed(np.zeros((0, 0)), np.zeros((0, 0)))


def observed(values, deviation, columns):
    return _core.Observed(values, np.full((len(values), columns), deviation))


def rotation(axis, angle):
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def setup_of(mechanism, base=None, target=None):
    legs = len(mechanism.legs)
    own = _core.Frame(np.zeros(3), np.eye(3))
    none = np.zeros((0, 3))
    return _core.Setup(
        mechanism.core, np.zeros((legs, 3)), base or own, target or own, none, none, np.zeros(3)
    )


def seen_from(mechanism, poses, base, target, with_orientation):
    """What a device at `base` sees of `target` at the poses, as rows of poses."""
    rows = np.full(poses.shape, np.nan)
    for row, pose in zip(rows, poses, strict=True):
        if mechanism.pose_space == "planar":
            turn = rotation((0, 0, 1), pose[2])
            position = np.array([pose[0], pose[1], 0])
        else:
            x, y, z, w = pose[3:]
            turn = rotation((x, y, z), 2 * np.arctan2(np.linalg.norm([x, y, z]), w))
            position = pose[:3]
        at = base.position + base.rotation @ (position + turn @ target.position)
        turned = base.rotation @ turn @ target.rotation
        if mechanism.pose_space == "planar":
            row[:2] = at[:2]
            if with_orientation:
                row[2] = np.arctan2(turned[1, 0], turned[0, 0])
        else:
            row[:3] = at
            if with_orientation:
                row[3:] = quaternion(turned)
    return rows


def quaternion(m):
    """By the eigenvector that is accurate for any angle."""
    (a, b, c), (d, e, f), (g, h, i) = m
    k = np.array(
        [
            [a - e - i, b + d, c + g, h - f],
            [b + d, e - a - i, f + h, c - g],
            [c + g, f + h, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    return np.linalg.eigh(k)[1][:, -1]


def sampled(name, count=40):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, candidates=count, seed=3).poses
    return mechanism, poses, mechanism.inverse_kinematics(poses)


ROBOTS = {name: sampled(name) for name in ("3RRR", "hexapod_jugglebot")}


def home_of(mechanism):
    return np.ravel(mechanism.home)


@pytest.mark.parametrize("name", ROBOTS)
def test_poses_start_where_forward_kinematics_by_continuation_puts_them(name):
    mechanism, poses, readings = ROBOTS[name]
    observations = _core.Observations(
        observed(readings, 1e-5, readings.shape[1]),
        *(nothing() for _ in range(5)),
    )
    found = _core.starting_poses(
        mechanism.core, setup_of(mechanism), observations, home_of(mechanism)
    )
    if mechanism.pose_space == "spatial":  # either sign of a quaternion is the same rotation
        found[:, 3:] *= np.sign(np.sum(found[:, 3:] * poses[:, 3:], axis=1))[:, np.newaxis]
    np.testing.assert_allclose(found, poses, atol=1e-8)


def test_a_pose_with_a_missing_reading_and_no_measured_pose_has_no_start():
    mechanism, _, readings = ROBOTS["3RRR"]
    missing = readings.copy()
    missing[4, 1] = np.nan
    observations = _core.Observations(observed(missing, 1e-5, 3), *(nothing() for _ in range(5)))
    found = _core.starting_poses(
        mechanism.core, setup_of(mechanism), observations, home_of(mechanism)
    )
    assert np.isnan(found[4]).all()
    assert np.isfinite(np.delete(found, 4, axis=0)).all()


angles = st.floats(-np.pi, np.pi)
unit = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)
places = st.tuples(*[st.floats(-2, 2)] * 3)


@settings(max_examples=25)
@given(st.sampled_from(sorted(ROBOTS)), unit, angles, places, unit, angles, places, st.booleans())
def test_frames_are_found_for_any_rotation(
    name, axis, angle, place, target_axis, target_angle, lever, turned
):
    mechanism, poses, readings = ROBOTS[name]
    planar = mechanism.pose_space == "planar"
    if planar:
        axis = target_axis = (0, 0, 1)
    flat = np.array([1, 1, 0]) if planar else np.ones(3)
    base = _core.Frame(np.array(place) * flat, rotation(axis, angle))
    lever = 0.1 * np.array(lever) * flat
    target = _core.Frame(lever, rotation(target_axis, target_angle if turned else 0.0))
    seen = seen_from(mechanism, poses, base, target, turned)
    observations = _core.Observations(
        observed(readings, 0.0, readings.shape[1]),
        observed(seen, 1e-4, mechanism.core.dof),
        *(nothing() for _ in range(4)),
    )
    found = _core.with_starting_frames(
        mechanism.core, setup_of(mechanism), observations, home_of(mechanism), True, True
    )
    np.testing.assert_allclose(found.base.position, base.position, atol=1e-7)
    np.testing.assert_allclose(found.base.rotation, base.rotation, atol=1e-7)
    np.testing.assert_allclose(found.target.position, target.position, atol=1e-7)
    if turned:
        np.testing.assert_allclose(found.target.rotation, target.rotation, atol=1e-7)


@pytest.mark.parametrize("name", sorted(ROBOTS))
def test_frames_start_by_what_is_measured_well(name):
    """Of each position a direction of its own, along no coordinate, says nothing."""
    mechanism, poses, readings = ROBOTS[name]
    planar = mechanism.pose_space == "planar"
    base = _core.Frame([0.3, -0.2, 0.0], rotation((0, 0, 1), 2.0))
    seen = seen_from(mechanism, poses, base, _core.Frame(np.zeros(3), np.eye(3)), True)
    tilt = rotation((0, 1, 0), 0.0 if planar else 0.4)
    axes = np.array([rotation((0, 0, 1), i) @ tilt for i in range(len(poses))])
    size = mechanism.space.size
    off = np.random.default_rng(0).uniform(-0.05, 0.05, len(poses))
    seen[:, :size] += off[:, np.newaxis] * axes[:, 0, :size]
    deviations = np.full((len(poses), mechanism.core.dof), 1e-6)
    deviations[:, 0] = 10.0
    measured = _core.Observed(seen, deviations, axes.reshape(len(poses), 9))
    observations = _core.Observations(
        observed(readings, 0.0, readings.shape[1]), measured, *(nothing() for _ in range(4))
    )
    found = _core.with_starting_frames(
        mechanism.core, setup_of(mechanism), observations, home_of(mechanism), True, False
    )
    np.testing.assert_allclose(found.base.position, base.position, atol=1e-6)
    np.testing.assert_allclose(found.base.rotation, base.rotation, atol=1e-6)


def few_readings(commanded):
    """A hexapod of which four struts were read, and the orientation; 3 cm off where it was sent."""
    robot, poses, _ = ROBOTS["hexapod_jugglebot"]
    noise = dataclasses.replace(robot.noise, position=1e-4, orientation=5e-5, reading=4e-4)
    made = dataclasses.replace(robot.tolerances, length=3e-4, angle=1e-3, gain=1e-4)
    robot = robot.replace(noise=noise, tolerances=made)
    readings = disturb(robot, 2).inverse_kinematics(poses)
    readings[:, 4:] = np.nan
    exact = symkin.Measurements.of(poses, readings, reading_unit="rad", pose_space="spatial")
    seen = Observed("orientation").measure(exact, noise, 1)
    sent = poses.copy()
    sent[:, :3] += np.random.default_rng(0).normal(0, 0.03, (len(poses), 3))
    return robot, dataclasses.replace(seen, commanded=sent if commanded else None)


@pytest.mark.parametrize("commanded", [True, False])
def test_rows_with_fewer_readings_than_freedoms_and_no_position_are_explained(commanded):
    robot, measured = few_readings(commanded)
    found = symkin.identify(robot, measured, prior="tolerances")
    assert found.converged
    assert not found.unexplained
    poses = ROBOTS["hexapod_jugglebot"][1]
    np.testing.assert_allclose(found.latent_poses[:, :3], poses[:, :3], atol=2e-3)


def test_where_the_robot_was_sent_is_read_and_written_and_is_no_observation(tmp_path):
    robot, measured = few_readings(commanded=True)
    measured.save(tmp_path / "measured.csv", robot)
    again = symkin.read_measurements(tmp_path / "measured.csv", robot)
    assert "commanded_qw" in (tmp_path / "measured.csv").read_text().partition("\n")[0]
    np.testing.assert_allclose(again.commanded, measured.commanded, atol=1e-12)
    found = symkin.identify(robot, again, prior="tolerances")
    assert set(np.unique(found.rows.kind)) == {0, 1}  # readings, and the pose's orientation
    with pytest.raises(MeasurementError, match="commanded poses are written in the frames"):
        again.save(tmp_path / "other.csv")
