# SPDX-License-Identifier: MIT
"""Two calibrations of one robot differ if it changed, and not if it did not."""

import numpy as np
import pytest

import symkin
from symkin.acceptance.comparing import covariance_of_difference
from symkin.errors import SymkinError
from symkin.planning.simulation import disturb


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


@pytest.fixture(scope="module")
def plan(robot):
    return robot.plan(12, candidates=400, seed=1)


def calibration(robot, plan, actual, seed, **options):
    return robot.identify(robot.simulate(plan, seed, actual), **options)


@pytest.mark.parametrize(
    "options", [{}, {"estimator": "joint", "prior": "tolerances"}], ids=["legs", "priors"]
)
def test_a_changed_leg_is_told_from_noise(robot, plan, options):
    actual = disturb(robot, seed=3)
    bent = actual.parameters.copy()
    bent[1, robot.parameter_names.index("distal_length")] += 1e-2
    changed = actual.with_parameters(bent)
    first = calibration(robot, plan, actual, 4, **options)
    same = symkin.compare(first, calibration(robot, plan, actual, 5, **options))
    assert not same.moved
    assert not same.shape_moved
    assert same.position < same.position_by_noise * 1.5
    other = symkin.compare(first, calibration(robot, plan, changed, 6, **options))
    assert other.moved
    assert other.shape_moved
    assert other.position > 5 * other.position_by_noise
    assert not any("two robots" in doubt for doubt in other.doubts)
    two = symkin.compare(first, calibration(robot, plan, disturb(robot, seed=8), 6, **options))
    assert any("these may be two robots of one drawing" in doubt for doubt in two.doubts)


def test_p_values_of_unchanged_robots_are_as_likely_as_any(robot, plan):
    actual = disturb(robot, seed=3)
    found = [calibration(robot, plan, actual, seed) for seed in range(10, 26)]
    pairs = [symkin.compare(*found[i : i + 2]) for i in range(0, len(found), 2)]
    for name in ("p_value", "shape_p_value"):
        values = [getattr(each, name) for each in pairs]
        assert min(values) > 1e-3
        assert 0.2 < np.mean(values) < 0.8  # three standard deviations of a mean of eight


def test_a_shared_prior_makes_differences_smaller():
    random = np.random.default_rng(1)
    prior = np.diag([1.0, 4.0, 0.25])
    rows = [random.normal(size=(2, 3)) for _ in range(2)]
    first, second = (np.linalg.inv(each.T @ each + prior) for each in rows)
    truth = random.normal(size=(40_000, 3)) / np.sqrt(np.diag(prior))
    found = []
    for each, covariance in zip(rows, (first, second), strict=True):
        seen = truth @ each.T + random.normal(size=(len(truth), 2))
        found.append(seen @ each @ covariance)
    expected = np.cov((found[1] - found[0]).T)
    np.testing.assert_allclose(
        covariance_of_difference(first, second, prior), expected, rtol=0.05, atol=0.02
    )


def test_calibrations_of_different_drawings_are_refused(robot, plan):
    actual = disturb(robot, seed=3)
    first = calibration(robot, plan, actual, 4)
    moved = robot.with_parameters(robot.parameters * 1.01)
    second = calibration(moved, plan, actual, 4)
    with pytest.raises(SymkinError, match="began with the same drawing"):
        symkin.compare(first, second)


def test_calibrations_of_the_same_rows_are_not_said_to_agree(robot, plan):
    first = calibration(robot, plan, disturb(robot, seed=3), 4)
    told = symkin.compare(first, first).text()
    assert "The two calibrations agree" not in told
    assert "in doubt" in told
