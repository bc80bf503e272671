# SPDX-License-Identifier: MIT
"""Limits and decisions against numbers that were made independently, and by simulation."""

import json
import math

import numpy as np
import pytest

from symkin import _core
from symkin.acceptance import (
    decide,
    limits_of_rms,
    pose_accuracy,
    poses_for_share,
    visits_of,
)
from symkin.acceptance.comparing import covariance_of_difference, statistic_of
from symkin.errors import SymkinError


@pytest.fixture(scope="module")
def reference(shared_reference):
    return json.loads((shared_reference / "acceptance.json").read_text())


def test_accuracy_and_repeatability_equal_the_reference(reference):
    for case in reference["pose_accuracy"]:
        errors = np.array(case["attained"]) - np.array(case["commanded"])
        found = pose_accuracy(errors, case["position_columns"])
        assert found.visits == case["n"]
        assert found.position_accuracy == pytest.approx(case["AP_position"], rel=1e-9)
        np.testing.assert_allclose(found.components, case["AP_components"], rtol=1e-9, atol=1e-15)
        assert found.mean_distance == pytest.approx(case["l_mean"], rel=1e-9)
        assert found.distance_deviation == pytest.approx(case["S_l"], rel=1e-9)
        assert found.position_repeatability == pytest.approx(case["RP_position"], rel=1e-9)
        np.testing.assert_allclose(found.angle_repeatability, case.get("RP_angles", []), rtol=1e-9)


def test_decisions_equal_the_reference(reference):
    for case in reference["decision"]:
        found = decide(case["y"], case["u"], case["tolerance"])
        assert found.verdict == case["verdict"]
        assert found.guard == pytest.approx(case["guard"], rel=1e-9)
        assert found.acceptance_limit == pytest.approx(case["acceptance_limit"], rel=1e-9)
        assert found.rejection_limit == pytest.approx(case["rejection_limit"], rel=1e-9)
        expected = pytest.approx(case["conformance_probability"], rel=1e-6)
        assert found.conformance_probability == expected


def test_limits_of_root_mean_squares_equal_the_reference(reference):
    for case in reference["rms_limits"]:
        found = limits_of_rms(np.array(case["errors"]), case["u"], case["tolerance"])
        assert found.contradicted is case["noise_contradicted"]
        assert found.verdict == case["verdict"]
        assert found.observed == pytest.approx(case["rms_observed"], rel=1e-9)
        assert found.corrected == pytest.approx(case["rms_corrected"], rel=1e-9)
        assert found.lower == pytest.approx(case["lower95"], rel=1e-6, abs=1e-15)
        assert found.upper == pytest.approx(case["upper95"], rel=1e-6)


def test_numbers_of_random_poses_equal_the_reference(reference):
    for case in reference["wilks"]:
        assert poses_for_share(case["share"], case["confidence"]) == case["poses"]


def test_the_comparison_equals_the_reference(reference):
    case = reference["comparison"]
    prior = np.diag(np.array(case["tolerances"]) ** -2.0)
    rows = [np.array(case[name]) for name in ("J_A", "J_B")]
    first, second = (np.linalg.inv(each.T @ each + prior) for each in rows)
    covariance = covariance_of_difference(first, second, prior)
    np.testing.assert_allclose(covariance, case["covariance_of_difference"], rtol=1e-9, atol=1e-12)
    difference = np.array(case["estimate_B"]) - np.array(case["estimate_A"])
    statistic, degrees = statistic_of(difference, covariance)
    assert (statistic, degrees) == (pytest.approx(case["statistic"], rel=1e-6), case["degrees"])
    assert _core.chi_square_tail(statistic, degrees) == pytest.approx(case["p_value"], rel=1e-6)


def test_limits_are_wrong_as_seldom_as_they_say():
    random = np.random.default_rng(1)
    true, noise, below, above = 2e-5, 1e-5, 0, 0
    tables = 1000
    directions = random.normal(size=(tables, 20, 3))
    directions *= true / np.linalg.norm(directions, axis=2, keepdims=True)
    for errors in directions + noise * random.normal(size=directions.shape):
        found = limits_of_rms(errors, noise, 1.0)
        below += found.upper < true
        above += found.lower > true
    # Four standard deviations of a share of 5% around it.
    assert 0.022 < below / tables < 0.078
    assert 0.022 < above / tables < 0.078


@pytest.mark.parametrize("axis", [0, 2])
def test_limits_hold_where_the_device_sees_one_direction_worse(axis):
    """Their risk is reached where errors are along that direction, and is less elsewhere."""
    random = np.random.default_rng(1)
    true, noise, below, above = 5e-5, np.tile([1e-5, 1e-5, 5e-5], (20, 1)), 0, 0
    tables = 1000
    errors = np.zeros((20, 3))
    errors[:, axis] = true
    for scattered in errors + noise * random.normal(size=(tables, 20, 3)):
        found = limits_of_rms(scattered, noise, 1.0)
        below += found.upper < true
        above += found.lower > true
    assert below / tables < 0.078
    assert above / tables < 0.078
    if axis == 2:
        assert above / tables > 0.022
    assert found.uncertainty == pytest.approx(3e-5)
    alike = limits_of_rms(scattered, found.uncertainty, 1.0)
    assert found.lower < alike.lower


def test_no_error_near_zero_has_an_upper_limit_of_nothing():
    found = limits_of_rms(np.full((5, 3), 5e-6), 1e-5, 5e-5)
    assert found.corrected == 0
    assert found.lower == 0
    assert 0 < found.upper < 5e-5
    assert found.verdict == "pass"


def test_a_fitted_frame_costs_its_coordinates():
    errors = 1e-5 * np.random.default_rng(2).normal(size=(10, 3))
    whole = limits_of_rms(errors, 1e-5, 5e-5)
    fitted = limits_of_rms(errors, 1e-5, 5e-5, fitted=6)
    assert (whole.degrees, fitted.degrees) == (30, 24)
    assert fitted.upper > whole.upper
    with pytest.raises(SymkinError, match="more than the 30"):
        limits_of_rms(errors, 1e-5, 5e-5, fitted=30)


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_what_is_no_tolerance_or_uncertainty_is_refused(value):
    with pytest.raises(SymkinError, match="tolerance"):
        decide(1e-5, 1e-6, value)
    with pytest.raises(SymkinError, match="uncertainty"):
        limits_of_rms(np.zeros((3, 3)), value, 1e-5)
    with pytest.raises(SymkinError, match="uncertainty"):
        limits_of_rms(np.zeros((3, 3)), np.full((3, 3), value), 1e-5)
    with pytest.raises(SymkinError, match=r"shape \(3,\)"):
        limits_of_rms(np.zeros((3, 3)), np.ones(3), 1e-5)


def test_visits_of_a_pose_are_found_in_any_order():
    poses = np.array([[0.0, 0.0], [1.0, 0.0], [0.001, 0.0], [1.0, 0.001], [2.0, 2.0]])
    found = [rows.tolist() for rows in visits_of(poses, 0.01)]
    assert found == [[0, 2], [1, 3], [4]]
