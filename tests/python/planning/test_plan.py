# SPDX-License-Identifier: MIT
"""The order of visiting, and what a plan promises."""

from itertools import permutations

import numpy as np
import pytest

import symkin
from symkin.analysis.observability import expected_accuracy
from symkin.cli import main
from symkin.model.poses import poses_from_bounds
from symkin.model.settings import WorkspaceSettings
from symkin.planning import pose_count_curve, predict_accuracy, travel_length
from symkin.planning.visiting import visiting_order


@pytest.fixture(scope="module")
def candidates(paper):
    return symkin.sample_workspace(paper, 2000, seed=1).poses


def test_the_way_through_few_poses_is_the_shortest(paper, candidates):
    for seed in range(5):
        poses = candidates[7 * seed : 7 * seed + 7]
        found = travel_length(paper, poses[visiting_order(paper, poses, seed)])
        best = min(travel_length(paper, poses[list(order)]) for order in permutations(range(7)))
        assert found == pytest.approx(best, rel=1e-6)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 599, 600, 1205])
def test_plans_of_any_size_are_put_in_an_order(paper, count):
    # Around 600 poses the way is improved piece by piece.
    angles = np.random.default_rng(count).permutation(count) * (2 * np.pi / count)
    circle = 0.1 * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])
    order = visiting_order(paper, circle, seed=1)
    assert sorted(order) == list(range(count))
    assert travel_length(paper, circle[order]) <= 0.1 + 0.2 * np.pi


def test_the_order_depends_on_the_seed_alone(paper, candidates):
    orders = [visiting_order(paper, candidates[:60], seed) for seed in (1, 1, 2**63 - 1)]
    np.testing.assert_array_equal(orders[0], orders[1])
    assert sorted(orders[2]) == list(range(60))


@pytest.mark.parametrize("name", ["3RRR", "5bar", "hexapod_jugglebot"])
def test_visiting_shortens_the_way_and_changes_nothing_else(name):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, 500).poses
    by_sets, on_the_way = (
        symkin.make_plan(mechanism, poses, 16, visit=visit) for visit in ("sets", "travel")
    )
    ways = [travel_length(mechanism, plan.poses[~plan.spare]) for plan in (by_sets, on_the_way)]
    assert ways[1] < 0.6 * ways[0]
    for leg in range(len(mechanism.legs)):
        np.testing.assert_array_equal(
            by_sets.poses[by_sets.rows_of(leg)], on_the_way.poses[on_the_way.rows_of(leg)]
        )
    np.testing.assert_array_equal(
        on_the_way.readings, mechanism.inverse_kinematics(on_the_way.poses)
    )
    assert on_the_way.spare[np.count_nonzero(~on_the_way.spare) :].all()


@pytest.mark.parametrize("size", [1e-3, 1e-6, 1e-9, 0.0])
def test_a_workspace_of_any_size_is_visited(hexapod, size):
    size = np.full(6, size)
    middle = np.array([0.0, 0.0, 0.75, 0.1, 0.2, 0.3])
    poses = np.random.default_rng(1).uniform(middle - size, middle + size, (12, 6))
    poses = poses_from_bounds("spatial", poses)
    small = hexapod.replace(
        workspace=WorkspaceSettings(tuple(middle - size), tuple(middle + size), home=tuple(middle))
    )
    order = visiting_order(small, poses, seed=1)
    assert sorted(order) == list(range(12))
    assert travel_length(small, poses[order]) <= travel_length(small, poses)
    assert travel_length(small, np.array([small.home])) == 0


def test_opposite_quaternions_are_no_way_apart(hexapod):
    home = hexapod.home
    turned = np.concatenate([home[:3], -home[3:]])
    assert travel_length(hexapod, turned[None]) == 0


def test_a_turn_is_part_of_the_way(paper):
    turned = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 0.0]])
    assert travel_length(paper, turned) == pytest.approx(paper.characteristic_length)


def test_the_prediction_is_the_covariance_of_the_estimator(paper, candidates):
    plan = symkin.make_plan(paper, candidates)
    simulation = symkin.simulate(paper, plan, 1, actual=paper)
    for estimator in ("implicit", "joint"):
        found = symkin.identify(paper, simulation.measurements, estimator)
        expected = expected_accuracy(paper, candidates, found.covariance)
        predicted = predict_accuracy(paper, plan, candidates, estimator)
        assert predicted.position == pytest.approx(expected.position, rel=0.02)


def test_more_poses_promise_more_and_the_curve_says_when_it_is_enough(paper, candidates):
    told = []
    curve = pose_count_curve(
        paper,
        candidates,
        [8, 12, 16, 24, 48, 96],
        estimator="joint",
        progress=lambda doing, share: told.append((doing, share)),
    )
    assert told[3] == ("24 poses", 0.5)
    assert (np.diff(curve.position) < 0).all()
    assert curve.measured.tolist() == [24, 36, 48, 72, 144, 288]
    # Four times as many poses halve the error.
    assert curve.position[3] / curve.position[5] == pytest.approx(2, rel=0.1)
    gains = 1 - (curve.position[1:] / curve.position[:-1]) ** (1 / np.diff(curve.counts))
    at = curve.counts.tolist().index(curve.enough)
    assert gains[at - 1] >= 0.02
    assert (gains[at:] < 0.02).all()


def test_a_curve_that_still_falls_has_no_end(paper, candidates):
    assert pose_count_curve(paper, candidates, [8, 10, 12], least_gain=0.005).enough is None


def test_a_curve_goes_from_p_to_ten_p_in_whole_orbits(paper, candidates):
    counts = pose_count_curve(paper, candidates, design="orbits").counts
    assert (counts % 3 == 0).all()
    assert counts[0] == 9
    assert counts[-1] == 81


def test_a_share_that_is_none_is_refused(paper, candidates):
    with pytest.raises(symkin.SymkinError, match="expected a number from 0 to 1"):
        pose_count_curve(paper, candidates, least_gain=2)


def test_poses_that_do_not_show_all_parameters_promise_nothing(paper, candidates):
    plan = symkin.make_plan(paper, candidates, 8, spares=0)
    alike = symkin.Plan(
        paper,
        plan.leg_sets,
        plan.order,
        plan.spare,
        plan.poses[:1].repeat(24, axis=0),
        plan.readings[:1].repeat(24, axis=0),
    )
    with pytest.raises(symkin.SymkinError, match="do not show all of its 8 parameters"):
        predict_accuracy(paper, alike, candidates[:50])


def test_python_and_the_command_line_make_the_same_plan(paper, tmp_path):
    assert main(["plan", "3RRR", "--pose-count", "24", "--out", str(tmp_path)]) == 0
    symkin.load("3RRR").plan(24).save(tmp_path / "python.csv")
    symkin.plan(paper, 24).save(tmp_path / "function.csv")
    written = (tmp_path / "plan.csv").read_bytes()
    assert (tmp_path / "python.csv").read_bytes() == written
    assert (tmp_path / "function.csv").read_bytes() == written


def test_candidates_are_a_number_or_poses(paper):
    sample = symkin.sample_workspace(paper, 400, 3)
    by_number = symkin.plan(paper, 10, candidates=400, seed=3)
    by_poses = symkin.plan(paper, 10, candidates=sample, seed=3)
    assert np.array_equal(by_number.poses, by_poses.poses)


def test_of_very_many_candidates_a_plan_keeps_some_and_the_number_of_all(paper, tmp_path):
    sample = symkin.sample_workspace(paper, 100_001, 1)
    plan = symkin.make_plan(paper, sample, 12, spares=0)
    assert np.array_equal(plan.candidates.poses, sample.poses[::2])
    assert np.array_equal(plan.candidates.conditions, sample.conditions[::2])
    assert plan.basis.candidates == 100_001
    assert "100 001" in plan.report(tmp_path / "plan.html").read_text("utf-8").replace("\xa0", " ")
    assert np.array_equal(
        symkin.make_plan(paper, sample.poses, 12, spares=0).candidates, sample.poses[::2]
    )


def test_a_time_limit_goes_with_a_proof(paper, candidates):
    with pytest.raises(symkin.SymkinError, match='the method is "exchange"'):
        symkin.make_plan(paper, candidates, 10, time_limit=1.0)
