# SPDX-License-Identifier: MIT
"""Intervals, chi-squares and doubts of 200 simulated robots for each estimator."""

from dataclasses import replace

import numpy as np
import pytest

import symkin
from symkin.errors import NotIdentifiableError

ROBOTS = 200
ESTIMATORS = ("paper", "inverse", "implicit", "joint")


@pytest.fixture(scope="module")
def planned(paper):
    return symkin.make_plan(paper, symkin.sample_workspace(paper, 6000, seed=1), seed=1)


def identified(mechanism, plan, estimator, **noise):
    """Robots measured with other noise than declared, as 72 poses that serve all legs."""
    actual_noise = mechanism.replace(noise=replace(mechanism.noise, **noise))
    for seed in range(ROBOTS):
        simulation = symkin.simulate(actual_noise, plan, seed)
        yield simulation.actual, symkin.identify(mechanism, simulation.measurements, estimator)


def coverage(robots):
    """Share of 95% intervals that hold the true parameter, in percent."""
    inside = []
    for actual, found in robots:
        errors = found.mechanism.parameters - actual.parameters
        inside.append(np.abs(errors) < 1.959964 * found.mechanism.deviations)
    return 100 * float(np.mean(inside))


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_intervals_and_chi_square_hold_and_sound_robots_raise_no_doubt(paper, planned, estimator):
    robots = list(identified(paper, planned, estimator))
    assert 93.5 <= coverage(robots) <= 96.5
    fits = [fit for _, found in robots for fit in found.goodness]
    freedom = fits[0].degrees_of_freedom
    standard_error = np.sqrt(2 / freedom / len(fits))
    assert np.mean([fit.chi_square_ratio for fit in fits]) == pytest.approx(
        1, abs=4 * standard_error
    )
    assert sum(bool(found.doubts) for _, found in robots) <= ROBOTS // 100


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("noise", [{"orientation": 3e-4}, {"reading": 2e-4}], ids=str)
def test_intervals_hold_although_the_declared_noise_is_wrong(paper, planned, estimator, noise):
    robots = list(identified(paper, planned, estimator, **noise))
    assert 93.5 <= coverage(robots) <= 96.5
    # An unexplained chi-square is a doubt.
    doubted = sum(any(fit.unexplained for fit in found.goodness) for _, found in robots)
    assert doubted >= 0.99 * ROBOTS


def test_the_joint_chi_square_is_that_of_the_common_covariance(paper, planned):
    # 3.59 for three times the declared orientation noise; each leg's own would say 2.4.
    robots = identified(paper, planned, "joint", orientation=3e-4)
    chi_squares = [found.goodness[0].chi_square_ratio for _, found in robots]
    assert np.mean(chi_squares) == pytest.approx(3.59, rel=0.05)


def test_one_spare_pose_is_not_said_to_scale_anything(paper, planned):
    rows = np.linspace(0, 71, 9).astype(int)
    for seed in range(25):
        measurements = symkin.simulate(paper, planned, seed).measurements.subset(rows)
        found = symkin.identify(paper, measurements)
        scaled = any(doubt.code == "residuals-large" for doubt in found.doubts)
        assert scaled == any(fit.unexplained for fit in found.goodness)
        assert any("to-spare" in doubt.code for doubt in found.doubts)


@pytest.mark.parametrize(
    ("poses", "spare"),
    [(5, 0), (6, 1), (7, 2), (8, None)],
)
def test_a_pose_of_a_leg_with_two_closures_counts_twice(poses, spare):
    """Of a 3-RPS five poses show the nine parameters of a leg, and eight leave three to spare."""
    bound = symkin.load_mechanism("3RPS")
    sample = symkin.sample_workspace(bound, 3000, seed=1)
    plan = symkin.make_plan(bound, sample, 24, seed=1, visit="sets")
    measurements = symkin.simulate(bound, plan, 1).measurements
    found = symkin.identify(bound, measurements.subset(np.linspace(0, 71, poses).astype(int)))
    assert {fit.degrees_of_freedom for fit in found.goodness} == {2 * poses - 9}
    said = [(each.legs, each.size) for each in found.doubts if each.code == "little-to-spare"]
    assert said == [((leg,), spare) for leg in range(3) if spare is not None]


def test_the_real_hexapod_is_doubted_for_what_is_known_of_it(hexapod, hexapod_table):
    found = symkin.identify(hexapod, symkin.read_measurements(hexapod_table, hexapod), "joint")
    assert found.goodness[0].degrees_of_freedom == 600
    assert found.goodness[0].chi_square_ratio == pytest.approx(2.22, abs=0.01)
    # One factor for all legs: the deviations of legs 4 to 6 too.
    tests = {(test.suspect, test.legs): test for test in found.tests}
    curved = tests["sensor_curvature", tuple(range(6))]
    assert curved.degrees_of_freedom == (6, 594)
    assert curved.statistic == pytest.approx(86.6, rel=0.05)
    assert all(tests["sensor_curvature", (leg,)].alarms for leg in range(6))
    assert tests["estimators", tuple(range(6))].degrees_of_freedom == (15, 585)
    assert tests["estimators", tuple(range(6))].statistic == pytest.approx(14.8, rel=0.06)
    said = {doubt.code: doubt for doubt in found.doubts}
    assert {"sensor-curved", "estimators-disagree", "rows-unlike"} <= said.keys()
    assert 63 in said["rows-unlike"].rows


def test_a_simulated_hexapod_is_doubted_for_nothing(hexapod):
    plan = symkin.make_plan(hexapod, symkin.sample_workspace(hexapod, 3000, seed=1), seed=1)
    for seed in range(5):
        measurements = symkin.simulate(hexapod, plan, seed).measurements
        for estimator in ("implicit", "joint"):
            assert symkin.identify(hexapod, measurements, estimator).doubts == ()


def test_a_pose_that_does_not_fit_is_named_by_its_row_with_and_without_a_loss(paper, planned):
    measurements = symkin.simulate(paper, planned, 5).measurements
    poses = measurements.poses.copy()
    poses[17, 0] += 20 * paper.noise.position
    spoiled = replace(measurements, poses=poses)
    row = measurements.row_numbers[17]
    for loss in ("none", "cauchy"):
        found = symkin.identify(paper, spoiled, loss=loss)
        assert [outlier.row for outlier in found.outliers] == [17]
        assert any(row in doubt.rows for doubt in found.doubts)


def test_missing_readings_are_no_doubt(paper, planned):
    measurements = symkin.simulate(paper, planned, 5).measurements
    readings = measurements.readings.copy()
    readings[::5, 0] = np.nan
    readings[3::7, 2] = np.nan
    partial = replace(measurements, readings=readings)
    for estimator in ESTIMATORS:
        found = symkin.identify(paper, partial, estimator)
        assert found.converged
        assert found.doubts == ()


def test_iterations_are_those_of_gauss_newton(paper, planned):
    measurements = symkin.simulate(paper, planned, 5).measurements
    assert max(leg.iterations for leg in symkin.identify(paper, measurements).legs) <= 7


def test_a_leg_that_was_never_moved_is_refused_by_the_combination_that_it_hides(paper, planned):
    measurements = symkin.simulate(paper, planned, 5).measurements
    readings = measurements.readings.copy()
    readings[:, 0] = 0
    for estimator in ESTIMATORS:
        with pytest.raises(NotIdentifiableError, match=r"leg 1 .*sensor_gain"):
            symkin.identify(paper, replace(measurements, readings=readings), estimator)


def test_residuals_of_a_small_workspace_are_judged_as_often_as_it_says():
    # The Hexa moves by 16 mm and 10 degrees: its parameters nearly explain what a pose would add.
    hexa = symkin.load_mechanism("hexa")
    plan = symkin.make_plan(hexa, symkin.sample_workspace(hexa, 2000, seed=1), seed=1)
    values = []
    for seed in range(12):
        found = symkin.identify(hexa, symkin.simulate(hexa, plan, seed).measurements, "joint")
        tests = found.tests
        values += [test.p_value for test in tests if test.suspect == "geometry"]
    assert len(values) == 72
    # 3.6 are expected; by derivatives at the measured poses there were 20.
    assert sum(value < 0.05 for value in values) <= 10
    assert min(values) > 5e-4
