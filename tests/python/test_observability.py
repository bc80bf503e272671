# SPDX-License-Identifier: MIT
"""What poses show of the parameters."""

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observability import analyse_observability, expected_accuracy
from symkin.model.settings import Tolerances
from symkin.model.symmetry import leg_carriers, map_poses
from symkin.planning.simulation import disturb


def largest_deviation(mechanism, reference, poses):
    """Of abs(R_ii) of all legs at the mapped poses from the reference leg's, relative (Eq. 10)."""
    first = analyse_observability(mechanism, 0, poses).r_diagonal
    worst = 0.0
    for leg, (_, element) in enumerate(leg_carriers(reference)):
        mapped = map_poses(reference, element, poses)
        diagonal = analyse_observability(mechanism, leg, mapped).r_diagonal
        worst = max(worst, np.max(np.abs(diagonal / first - 1)))
    return worst


@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot"])
def test_legs_are_equally_observable_at_mapped_poses_and_not_when_one_is_perturbed(name):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, 24, seed=2).poses
    assert largest_deviation(mechanism, mechanism, poses) < 1e-10
    parameters = mechanism.parameters.copy()
    parameters[1, 0] *= 1.01
    perturbed = mechanism.replace(symmetry=None).with_parameters(parameters)
    assert largest_deviation(perturbed, mechanism, poses) > 1e-4


def test_the_parameters_that_no_pose_shows_are_named(paper):
    # All poses at one orientation cannot tell the platform point from the base point.
    generator = np.random.default_rng(1)
    poses = np.column_stack([generator.uniform(-0.3, 0.3, (30, 2)), np.zeros(30)])
    seen = analyse_observability(paper, 0, poses)
    assert seen.rank == 6
    assert len(seen.unseen) == 2
    assert "platform" in " ".join(seen.unseen)
    assert "base" in " ".join(seen.unseen)


def test_expected_accuracy_equals_the_error_of_a_small_disturbance(paper):
    poses = symkin.sample_workspace(paper, 200, seed=3).poses
    small = paper.replace(tolerances=Tolerances(1e-6, 1e-6, 1e-6))
    actual = disturb(small, seed=4)
    error = (actual.parameters - paper.parameters).ravel()
    expected = expected_accuracy(paper, poses, np.outer(error, error))
    achieved = symkin.evaluate(paper, actual=actual, poses=poses)
    assert expected.position == pytest.approx(achieved.position_rms, rel=1e-3)
    assert expected.orientation == pytest.approx(achieved.orientation_rms, rel=1e-3)


@pytest.mark.parametrize("values", [(0, 1e-3, 1e-3), (1e-3, -1, 1e-3), (1e-3, 1e-3, np.nan)])
def test_a_tolerance_that_is_no_scale_is_refused(values):
    with pytest.raises(symkin.SymkinError, match="expected a positive standard deviation"):
        Tolerances(*values)


def test_the_sign_of_a_first_order_error_is_that_of_the_model_at_measured_readings(paper):
    # delta pose = E (model - robot): what evaluate() gives for measurements, and the negative of
    # what it gives for commanded poses, where the robot takes the pose that the model wanted.
    poses = symkin.sample_workspace(paper, 5, 2).poses
    random = np.random.default_rng(4)
    change = 1e-6 * random.standard_normal(paper.parameters.shape)
    robot = paper.replace(symmetry=None)
    model = robot.with_parameters(paper.parameters + change)
    readings = robot.inverse_kinematics(poses)
    expected = []
    for pose, reading in zip(poses, readings, strict=True):
        legs = [_core.linearise(paper.core, leg, pose[None], reading[[leg]]) for leg in range(3)]
        by_pose = np.concatenate([rows.by_pose for rows in legs])
        moved = [rows.by_parameters[0] @ change[leg] for leg, rows in enumerate(legs)]
        expected.append(-np.linalg.solve(by_pose, moved))
    measured = symkin.Measurements(poses, readings, np.zeros(5, dtype=np.intp), np.arange(1, 6))
    of_model = symkin.evaluate(model, measurements=measured).differences
    of_robot = symkin.evaluate(model, actual=robot, poses=poses).differences
    np.testing.assert_allclose(of_model, expected, atol=1e-9)
    np.testing.assert_allclose(of_robot, -np.array(expected), atol=1e-9)
    assert np.abs(expected).max() > 1e-6
