# SPDX-License-Identifier: MIT
"""What poses show of the parameters."""

import numpy as np
import pytest

import symkin


def largest_deviation(mechanism, reference, poses):
    """Of abs(R_ii) of all legs at the mapped poses from the reference leg's, relative (Eq. 10)."""
    first = symkin.analyse_observability(mechanism, 0, poses).r_diagonal
    worst = 0.0
    for leg, (_, element) in enumerate(symkin.leg_carriers(reference)):
        mapped = symkin.map_poses(reference, element, poses)
        diagonal = symkin.analyse_observability(mechanism, leg, mapped).r_diagonal
        worst = max(worst, np.max(np.abs(diagonal / first - 1)))
    return worst


@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot"])
def test_legs_are_equally_observable_at_mapped_poses_and_not_when_one_is_perturbed(name):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, 24, seed=2).poses
    assert largest_deviation(mechanism, mechanism, poses) < 1e-10
    parameters = mechanism.parameters
    parameters[1, 0] *= 1.01
    perturbed = mechanism.replace(symmetry=None).with_parameters(parameters)
    assert largest_deviation(perturbed, mechanism, poses) > 1e-4


def test_the_parameters_that_no_pose_shows_are_named(paper):
    # All poses at one orientation cannot tell the platform point from the base point.
    generator = np.random.default_rng(1)
    poses = np.column_stack([generator.uniform(-0.3, 0.3, (30, 2)), np.zeros(30)])
    seen = symkin.analyse_observability(paper, 0, poses)
    assert seen.rank == 6
    assert len(seen.unseen) == 2
    assert "platform" in " ".join(seen.unseen)
    assert "base" in " ".join(seen.unseen)


def test_expected_accuracy_equals_the_error_of_a_small_disturbance(paper):
    poses = symkin.sample_workspace(paper, 200, seed=3).poses
    small = paper.replace(tolerances=symkin.Tolerances(1e-6, 1e-6, 1e-6))
    actual = symkin.disturb(small, seed=4)
    error = (actual.parameters - paper.parameters).ravel()
    expected = symkin.expected_accuracy(paper, poses, np.outer(error, error))
    achieved = symkin.evaluate(paper, actual=actual, poses=poses)
    assert expected.position == pytest.approx(achieved.position_rms, rel=1e-3)
    assert expected.orientation == pytest.approx(achieved.orientation_rms, rel=1e-3)


@pytest.mark.parametrize("values", [(0, 1e-3, 1e-3), (1e-3, -1, 1e-3), (1e-3, 1e-3, np.nan)])
def test_a_tolerance_that_is_no_scale_is_refused(values):
    with pytest.raises(symkin.SymkinError, match="expected a positive standard deviation"):
        symkin.Tolerances(*values)
