# SPDX-License-Identifier: MIT
"""What an identification predicts at poses that it did not see."""

import dataclasses

import numpy as np
import pytest

import symkin


@pytest.fixture(scope="module")
def measurements(paper):
    """24 poses for each leg, all legs read at each."""
    plan = symkin.make_plan(paper, symkin.sample_workspace(paper, 2000, seed=1).poses)
    return symkin.simulate(paper, plan, 1).measurements


def shared(measurements):
    return measurements.for_all_legs()


def test_unseen_poses_of_a_real_hexapod_are_predicted_worse_in_blocks(hexapod, hexapod_table):
    measured = symkin.read_measurements(hexapod_table, hexapod)
    random = symkin.cross_validate(hexapod, measured, folds=5)
    blocks = symkin.cross_validate(hexapod, measured, folds=5, blocks=True)
    assert random.residual_rms == pytest.approx(0.468e-3, rel=0.01)
    assert blocks.residual_rms == pytest.approx(0.576e-3, rel=0.01)
    assert random.evaluation.position_rms == pytest.approx(1.06e-3, rel=0.01)
    assert blocks.evaluation.position_rms == pytest.approx(1.53e-3, rel=0.01)
    assert random.evaluation.evaluated == blocks.evaluation.evaluated == 108
    assert random.converged
    assert (random.name, blocks.name) == ("5-fold cross-validation", "5-block cross-validation")


@pytest.mark.parametrize("blocks", [False, True])
def test_every_pose_is_predicted_by_an_identification_without_it(paper, measurements, blocks):
    """A gross error of one reading is predicted in full, whatever the parts."""
    readings = measurements.readings.copy()
    readings[5, 1] += 0.1
    wrong = shared(dataclasses.replace(measurements, readings=readings))
    validated = symkin.cross_validate(paper, wrong, folds=6, blocks=blocks)
    seen = symkin.identify(paper, wrong).legs[1].residuals[5]
    assert abs(validated.residuals[5, 1]) > 1.02 * abs(seen)
    true = paper.closure(1, measurements.poses[[5]], readings[[5], 1])
    assert validated.residuals[5, 1] == pytest.approx(true[0], rel=0.05)


def test_blocks_are_consecutive_poses(paper, measurements):
    measured = shared(measurements)
    blocks = symkin.cross_validate(paper, measured, folds=3, blocks=True)
    rest = symkin.identify(paper, measured.subset(np.arange(24, 72))).mechanism
    for leg in range(3):
        expected = rest.closure(leg, measured.poses[:24], measured.readings[:24, leg])
        np.testing.assert_allclose(blocks.residuals[:24, leg], expected, rtol=1e-9)
    poses, _ = rest.forward_kinematics(measured.readings[:24], measured.poses[:24])
    expected = poses - measured.poses[:24]
    np.testing.assert_allclose(blocks.evaluation.differences[:24], expected, atol=1e-9)


@pytest.mark.parametrize("blocks", [False, True])
def test_a_leg_with_its_own_poses_is_predicted_at_those_alone(paper, measurements, blocks):
    validated = symkin.cross_validate(paper, measurements, 3, blocks=blocks, poses="own")
    predicted = np.isfinite(validated.residuals)
    fits = symkin.identify(paper, measurements, poses="own").legs
    for leg, fit in enumerate(fits):
        np.testing.assert_array_equal(np.flatnonzero(predicted[:, leg]), fit.rows)


def test_blocks_of_own_poses_are_blocks_of_each_set(paper, measurements):
    blocks = symkin.cross_validate(paper, measurements, 3, blocks=True, poses="own")
    first = [measurements.rows_of(leg)[:8] for leg in range(3)]
    rest = measurements.subset(np.setdiff1d(np.arange(72), np.concatenate(first)))
    found = symkin.identify(paper, rest, poses="own").mechanism
    for leg, rows in enumerate(first):
        poses, readings = measurements.poses[rows], measurements.readings[rows, leg]
        expected = found.closure(leg, poses, readings)
        np.testing.assert_allclose(blocks.residuals[rows, leg], expected, rtol=1e-9)


def test_own_sets_of_few_poses_lose_poses_evenly(paper, measurements):
    """Eleven poses a leg in four parts leave each leg its eight."""
    rows = np.concatenate([measurements.rows_of(leg)[:11] for leg in range(3)])
    few = measurements.subset(rows)
    for seed in range(5):
        validated = symkin.cross_validate(paper, few, 4, seed, poses="own")
        assert np.isfinite(validated.residuals).sum() == 33


def test_readings_of_single_legs_have_no_end_effector_error(paper, measurements):
    own = measurements.leg_sets[:, np.newaxis] == np.arange(3)
    readings = np.where(own, measurements.readings, np.nan)
    single = dataclasses.replace(measurements, readings=readings)
    validated = symkin.cross_validate(paper, single, folds=3)
    assert validated.evaluation is None
    assert np.isfinite(validated.residuals).sum() == 72


def test_an_impossible_number_of_folds_is_refused(paper, measurements):
    with pytest.raises(symkin.SymkinError, match="1 folds"):
        symkin.cross_validate(paper, measurements, folds=1)


def test_an_identification_that_did_not_converge_is_told(paper, measurements):
    assert symkin.cross_validate(paper, measurements, folds=2).converged
    assert not symkin.cross_validate(paper, measurements, folds=2, max_iterations=1).converged


def test_a_refusal_without_a_part_of_the_poses_says_so() -> None:
    robot = symkin.load_mechanism("3RRR")
    data = robot.simulate(robot.plan(12), seed=1).measurements
    fit = symkin.identify(robot, data, loss="cauchy")
    with pytest.raises(symkin.SymkinError, match="in cross-validation, without part 1 of 2"):
        fit.cross_validated(2)
