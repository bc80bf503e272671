# SPDX-License-Identifier: MIT
"""What an end-effector error is made of."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.analysis.evaluation import Evaluation
from symkin.model.framing import framed
from symkin.model.poses import poses_from_bounds
from symkin.model.settings import NoiseSettings
from symkin.planning.simulation import disturb
from symkin.present import page_of

FRAMES = {
    "3RRR": ([0.05, -0.03, 0.2], [0.01, 0.02, -0.1]),
    "5bar": ([0.05, -0.03, 0.2], [0, 0, 0]),
    "hexapod_jugglebot": ([0.01, 0.02, -0.05, 0.1, -0.05, 0.2], [0.01, 0, 0.02, 0.05, 0.1, -0.1]),
}


def in_other_frames(space, poses, base, tool):
    """Poses in a base frame and with a tool that are the mechanism's no longer."""
    if space == "spatial":
        from scipy.spatial.transform import Rotation

        turn, twist = Rotation.from_rotvec(base[3:]), Rotation.from_rotvec(tool[3:])
        own = Rotation.from_quat(poses[:, 3:])
        position = base[:3] + turn.apply(poses[:, :3] + own.apply(tool[:3]))
        return np.hstack([position, (turn * own * twist).as_quat()])
    angles = poses[:, 2] if space == "planar" else np.zeros(len(poses))

    def turned(angle, point):
        cos, sin = np.cos(angle), np.sin(angle)
        return np.stack([cos * point[0] - sin * point[1], sin * point[0] + cos * point[1]])

    position = turned(base[2], poses[:, :2].T + turned(angles, tool[:2])).T + base[:2]
    if space == "point":
        return position
    return np.column_stack([position, angles + base[2] + tool[2]])


@pytest.mark.parametrize("name", FRAMES)
def test_other_frames_are_all_of_the_error_of_an_exact_model(name):
    mechanism = symkin.load_mechanism(name)
    base, tool = map(np.array, FRAMES[name])
    poses = symkin.sample_workspace(mechanism, 60, seed=2).poses
    measured = symkin.Measurements.of(
        in_other_frames(mechanism.pose_space, poses, base, tool),
        mechanism.inverse_kinematics(poses),
    )
    errors = symkin.evaluate(mechanism, measurements=measured)
    good = np.isfinite(errors.differences).all(axis=1)
    assert good.sum() > 30
    assert errors.position_rms > 0.01
    np.testing.assert_allclose(errors.aligned.differences[good], 0, atol=1e-8)
    assert errors.aligned.position_max < 1e-8
    np.testing.assert_allclose(errors.aligned.base, base, atol=1e-7)
    np.testing.assert_allclose(errors.aligned.tool, tool, atol=1e-7)


def test_the_nominal_hexapod_is_off_by_its_frames_and_by_its_legs(hexapod, hexapod_table):
    measured = symkin.read_measurements(hexapod_table, hexapod)
    before = symkin.evaluate(hexapod, measurements=measured)
    assert before.position_rms == pytest.approx(55.9e-3, rel=0.01)
    np.testing.assert_allclose(before.means[:3], [-6.33e-3, -7.39e-3, -54.9e-3], rtol=0.01)
    assert before.aligned.position_rms == pytest.approx(3.00e-3, rel=0.01)
    assert before.aligned.orientation_rms == pytest.approx(5.2e-3, rel=0.01)
    found = symkin.identify(hexapod, measured).mechanism
    after = symkin.evaluate(found, measurements=measured)
    assert after.aligned.position_rms == pytest.approx(0.949e-3, rel=0.01)
    assert np.abs(after.means[:3]).max() < 0.05e-3


@pytest.mark.parametrize("name", FRAMES)
def test_alignment_leaves_the_errors_of_single_legs(name):
    """A robot with errors is not explained by frames, but never fits worse for them."""
    mechanism = symkin.load_mechanism(name)
    robot = disturb(mechanism, seed=3)
    poses = symkin.sample_workspace(mechanism, 400, seed=2).poses
    errors = symkin.evaluate(mechanism, actual=robot, poses=poses)
    length = errors.characteristic_length

    def size(each):
        return each.position_rms**2 + (length * each.orientation_rms) ** 2

    assert 0.01 * size(errors) < size(errors.aligned) < size(errors)


def test_poses_that_fail_are_left_out_of_all_figures(paper):
    poses = symkin.sample_workspace(paper, 40, seed=2).poses
    robot = disturb(paper, seed=3)
    whole = symkin.evaluate(paper, actual=robot, poses=poses)
    far = np.insert(poses, 7, [40.0, 0, 0], axis=0)
    errors = symkin.evaluate(paper, actual=robot, poses=far)
    assert (errors.evaluated, errors.failed) == (40, 1)
    assert np.isnan(errors.aligned.differences[7]).all()
    assert errors.position_rms == pytest.approx(whole.position_rms)
    assert errors.aligned.position_rms == pytest.approx(whole.aligned.position_rms)
    np.testing.assert_allclose(errors.means, whole.means)


def test_few_poses_are_not_aligned(paper):
    poses = symkin.sample_workspace(paper, 2, seed=2).poses
    errors = symkin.evaluate(paper, actual=disturb(paper, seed=3), poses=poses)
    assert errors.aligned is None


def test_half_a_turn_is_read_from_a_quaternion_of_either_sign(hexapod):
    half = poses_from_bounds("spatial", np.array([[0.1, 0, 0, np.pi, 0, 0], [0, 0.1, 0, 0, 3, 0]]))
    poses = np.vstack([half, -half * [-1, -1, -1, 1, 1, 1, 1]])
    errors = Evaluation.of(np.zeros((4, 6)), poses, hexapod)
    assert errors.aligned.position_max < 1e-12
    assert errors.aligned.orientation_max < 1e-7


def test_without_poses_a_model_is_evaluated_over_its_workspace(paper):
    actual = disturb(paper, seed=2)
    found = symkin.evaluate(paper, actual=actual)
    same = symkin.evaluate(paper, actual=actual, poses=symkin.sample_workspace(paper))
    assert found.position_rms == same.position_rms
    assert found.evaluated > 1000


@pytest.mark.parametrize("name", ["rotary_delta", "hexapod_jugglebot", "hangprinter"])
def test_the_instrument_contributes_the_noise_of_poses_and_of_readings(name):
    robot = symkin.load_mechanism(name)
    large = NoiseSettings(position=1e-4, orientation=1e-4, reading=2e-4)
    robot = robot.replace(noise=large)
    sample = symkin.sample_workspace(robot, 800, seed=1)
    random = np.random.default_rng(3)
    readings = robot.inverse_kinematics(sample.poses)
    readings += random.normal(0, large.reading, readings.shape)
    exact = symkin.Measurements.of(framed(robot, sample.poses), readings)
    told = symkin.evaluate(robot, measurements=exact)
    for kind, _ in told.kinds:
        size = robot.space.size if kind == "position" else len(robot.space.rotation)
        own = size * 1e-8
        by_readings = getattr(told, f"{kind}_rms")
        np.testing.assert_allclose(
            told.instrument[kind], np.hypot(own**0.5, by_readings), rtol=0.05
        )


def test_errors_of_a_model_that_reaches_no_reading_are_not_said_to_be_noise(paper):
    taken = symkin.simulate(paper, paper.plan(10), 1).measurements
    gain = paper.parameter_names.index("sensor_gain")
    parameters = paper.parameters.copy()
    parameters[:, gain] = 5e-324
    told = symkin.evaluate(paper.with_parameters(parameters), measurements=taken)
    assert told.instrument is None
    page = page_of(told)
    assert (page.verdict, page.judgement) == ("", "")


def test_a_row_that_the_model_cannot_take_is_named(paper):
    taken = symkin.simulate(paper, paper.plan(10), 1).measurements
    poses = taken.poses.copy()
    poses[4, 1] = 50.0
    told = page_of(symkin.evaluate(paper, measurements=dataclasses.replace(taken, poses=poses)))
    numbers = f"1 pose (row {taken.row_numbers[4]})"
    assert told.notes == [f"left out, since the model cannot take them: {numbers}"]


def test_what_a_sound_calibration_leaves_is_told_and_not_doubted(paper):
    plan = symkin.make_plan(paper, symkin.sample_workspace(paper, 1000, 1), seed=1)
    verdicts = []
    for seed in range(4):
        made = symkin.simulate(paper, plan, seed)
        found = symkin.identify(paper, made.measurements)
        later = symkin.simulate(paper, plan, 100 + seed, made.actual).measurements
        page = page_of(symkin.evaluate(found.mechanism, measurements=later))
        verdicts.append((page.verdict, page.judgement.partition(" ")[2][:22]))
    assert {verdict for verdict, _ in verdicts} <= {"", "good"}
    assert ("", "declared noise does no") in verdicts
    as_drawn = page_of(symkin.evaluate(paper, measurements=later))
    assert as_drawn.verdict == "doubtful"
