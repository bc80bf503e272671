# SPDX-License-Identifier: MIT
"""How many poses a wanted accuracy needs."""

import numpy as np
import pytest

import symkin
from symkin.model.settings import NoiseSettings
from symkin.planning import pose_count_curve, predict_accuracy


@pytest.fixture(scope="module")
def sample(paper):
    return symkin.sample_workspace(paper, 1500, seed=1)


@pytest.fixture(scope="module")
def curve(paper, sample):
    return pose_count_curve(paper, sample, [8, 16, 24])


def expected_of(mechanism, sample, count, **demands):
    plan = symkin.make_plan(mechanism, sample, count, spares=0, **demands)
    return predict_accuracy(mechanism, plan, sample, anywhere=sample)


@pytest.mark.parametrize("beyond", [0.9, 0.7])
def test_the_count_is_enough_and_one_less_is_not(paper, sample, curve, beyond):
    # Within the curve, and beyond its end.
    wanted = beyond * curve.position_bound[1 if beyond == 0.9 else -1]
    needed = curve.for_accuracy(wanted)
    assert needed.expected == expected_of(paper, sample, needed.count)
    assert needed.expected.position_bound <= wanted
    assert expected_of(paper, sample, needed.count - 1).position_bound > wanted
    assert needed.measured == 3 * needed.count
    assert needed.excess <= 1
    assert needed.remedies == ()


def test_an_orientation_may_ask_for_more_poses_than_the_position(curve):
    position, orientation = curve.position_bound[1], curve.orientation_bound[-1]
    both = curve.for_accuracy(position, orientation)
    alone = curve.for_accuracy(position)
    assert both.count == curve.for_accuracy(orientation=orientation).count > alone.count
    assert both.expected.orientation_bound <= orientation


def test_the_fewest_poses_are_those_of_a_leg_s_parameters(curve):
    assert curve.for_accuracy(1.0).count == 8


def test_orbits_are_counted_whole(paper, sample):
    orbits = pose_count_curve(paper, sample, [9, 12], design="orbits")
    needed = orbits.for_accuracy(0.9 * orbits.position[-1])
    assert needed.count % 3 == 0
    assert needed.measured == needed.count


def test_an_accuracy_out_of_reach_says_what_else_would_help(paper, sample, curve):
    needed = curve.for_accuracy(2e-6)
    assert needed.count is None
    assert needed.tried == 50 * 8
    assert needed.excess == pytest.approx(needed.expected.position_bound / 2e-6)
    errors = [remedy.expected.position_bound for remedy in needed.remedies]
    assert errors == sorted(errors)
    assert errors[-1] < needed.expected.position_bound
    assert needed.remedies[0].change == "half the noise of the measured positions"
    # The noise that the answer asks for is just enough.
    noise = paper.noise.deviations
    quiet = {name: value / needed.excess for name, value in noise.items()}
    quieter = paper.replace(noise=NoiseSettings(**quiet))
    promised = expected_of(quieter, sample, needed.tried)
    assert promised.position_bound == pytest.approx(2e-6, rel=1e-3)


def test_what_helps_says_whether_it_is_enough(paper):
    few = symkin.sample_workspace(paper, 60, seed=1)
    curve = pose_count_curve(paper, few, [8], poses="own", estimator="paper", rows="paper")
    most = curve.for_accuracy(1e-9)
    assert 8 < most.tried <= 60
    changes = {remedy.change: remedy for remedy in most.remedies}
    joint = changes["the estimator joint"]
    answer = curve.for_accuracy(1.001 * joint.expected.position_bound)
    assert answer.count is None
    assert {each.change: each.enough for each in answer.remedies}["the estimator joint"]
    assert "every leg identified from all poses" in changes
    assert np.isfinite(answer.excess)


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({}, "no accuracy is wanted"),
        ({"position": 0.0}, "the position error wanted is 0; expected a positive one"),
        ({"position": np.nan}, "expected a positive one"),
        ({"orientation": -1.0}, "the orientation error wanted is -1"),
    ],
)
def test_an_accuracy_that_makes_no_sense_is_refused(curve, wanted, words):
    with pytest.raises(symkin.SymkinError, match=words):
        curve.for_accuracy(**wanted)


def test_a_point_has_no_orientation_to_be_accurate_in():
    point = symkin.load_mechanism("5bar")
    curve = pose_count_curve(point, symkin.sample_workspace(point, 200), [6])
    with pytest.raises(symkin.SymkinError, match="never turns"):
        curve.for_accuracy(orientation=1e-3)
    assert curve.for_accuracy(0.9 * curve.position[0]).count > 6


def test_a_curve_begins_where_poses_show_all_that_is_unknown(paper):
    # 8 poses bring 24 conditions, as many as there are parameters, and none for the drifts.
    few = symkin.sample_workspace(paper, 300, seed=1)
    with pytest.raises(symkin.SymkinError, match="do not show all of the 27 unknowns"):
        pose_count_curve(paper, few, [8, 24], drift=["leg"])
    drifting = pose_count_curve(paper, few, drift=["leg"])
    assert drifting.counts[0] == 9
    assert drifting.for_accuracy(2 * drifting.position_bound[0]).count == 9
