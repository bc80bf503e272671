# SPDX-License-Identifier: MIT
"""What a laboratory asks of a plan."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symkin
from symkin import _core
from symkin.analysis.observability import error_weight, observability_rows
from symkin.analysis.workspace import inside_box, workspace_coordinates
from symkin.model.settings import JointLimits, Tolerances
from symkin.model.symmetry import map_poses
from symkin.planning import Clearance


@pytest.fixture(scope="module")
def candidates(paper):
    return symkin.sample_workspace(paper, 3000, seed=1).poses


def information(mechanism, leg, poses):
    rows = observability_rows(mechanism, leg, poses, "noise_aware")
    return rows.T @ rows


@pytest.mark.parametrize("design", ["legs", "orbits", "mechanism"])
def test_no_pose_of_any_leg_lies_in_a_region_to_avoid(paper, candidates, design):
    region = {"x": (-math.inf, 0.0), "y": (0.2, math.inf)}
    plan = symkin.make_plan(paper, candidates, design=design, avoid=[region])
    inside = (plan.poses[:, 0] <= 0) & (plan.poses[:, 1] >= 0.2)
    assert not inside.any()
    assert plan.basis.excluded > 0


def test_images_stay_in_a_box_that_lacks_the_symmetry(hexapod):
    poses = symkin.sample_workspace(hexapod, 1500).poses
    plan = symkin.make_plan(hexapod, poses, 16)
    assert inside_box(hexapod, plan.poses).all()
    images = map_poses(hexapod, "r1", poses)
    assert not inside_box(hexapod, images).all()
    assert plan.basis.excluded > 0


@pytest.mark.parametrize("design", ["legs", "orbits"])
def test_carried_poses_stay_within_the_joint_limits_of_the_legs_they_are_carried_to(
    paper, candidates, design
):
    limited = paper.replace(joint_limits=JointLimits(lower=(-1.0, 0.3, -1.0)))
    inside = limited.within_limits(limited.inverse_kinematics(candidates)).all(axis=1)
    plan = symkin.make_plan(limited, candidates[inside], design=design)
    assert limited.within_limits(plan.readings).all()
    elsewhere = symkin.make_plan(paper, candidates[inside], design=design).readings
    assert not limited.within_limits(elsewhere).all()  # or this could not fail


def test_a_required_pose_beyond_a_joint_limit_is_refused(paper, candidates):
    limited = paper.replace(joint_limits=JointLimits(lower=(-1.0, 0.3, -1.0)))
    inside = limited.within_limits(limited.inverse_kinematics(candidates)).all(axis=1)
    required = np.array([candidates[inside][0], candidates[~inside][0]])
    with pytest.raises(symkin.SymkinError, match="pose 2 is beyond the joint limits of leg 2"):
        symkin.make_plan(limited, candidates, 12, required=required)


@pytest.mark.parametrize("design", ["legs", "mechanism"])
def test_poses_of_a_set_keep_their_distance(paper, candidates, design):
    plan = symkin.make_plan(paper, candidates, 16, design=design, minimum_distance=0.1)
    for number in np.unique(plan.leg_sets):
        places = plan.poses[plan.rows_of_set(number), :2]
        distances = np.linalg.norm(places[:, None] - places[None], axis=2)
        assert distances[~np.eye(len(places), dtype=bool)].min() >= 0.1


def test_required_poses_are_measured_and_serve_all_legs(paper, candidates):
    needed = candidates[[5, 77, 300]] + 1e-4  # no candidates
    plan = symkin.make_plan(paper, candidates, 12, required=needed)
    np.testing.assert_array_equal(plan.poses[plan.rows_of_set(-1)], needed)
    for leg, choice in enumerate(plan.basis.choices):
        assert len(plan.rows_of(leg)) == 12
        found = np.linalg.slogdet(information(paper, leg, plan.poses[plan.rows_of(leg)]))[1]
        assert choice.selection.log_det == pytest.approx(found, abs=1e-9)


def test_a_plan_that_knows_what_is_measured_adds_more_than_one_that_does_not(paper, candidates):
    first = symkin.make_plan(paper, candidates, 12, seed=1)
    measured = symkin.simulate(paper, first, 1).measurements
    further = symkin.make_plan(paper, candidates, 6, measured=measured)
    blind = symkin.make_plan(paper, candidates, 8, seed=2)
    for leg in range(3):
        prior = information(paper, leg, measured.poses)
        gains = [
            np.linalg.slogdet(prior + information(paper, leg, poses))[1]
            for poses in (further.poses[further.rows_of(leg)], blind.poses[blind.rows_of(leg)[:6]])
        ]
        assert gains[0] > gains[1]
        assert len(further.rows_of(leg)) == 6


def test_measured_rows_without_a_reading_of_a_leg_count_for_the_others_only(paper, candidates):
    first = symkin.make_plan(paper, candidates, 12)
    measured = symkin.simulate(paper, first, 1).measurements
    readings = measured.readings.copy()
    readings[:, 1] = np.nan
    partial = symkin.Measurements.of(measured.poses, readings, measured.leg_sets)
    plan = symkin.make_plan(paper, candidates, 8, measured=partial)
    assert plan.basis.choices[1].selection.log_det < plan.basis.choices[0].selection.log_det - 1


def test_the_clearance_grows_with_the_tolerances(paper, candidates):
    made = {}
    for factor in (0.01, 1, 10):
        tolerances = Tolerances(1e-3 * factor, 1e-3 * factor, 1e-3 * factor)
        made[factor] = symkin.make_plan(paper.replace(tolerances=tolerances), candidates, 12).basis
    assert made[0.01].clearance == Clearance(0.05, 20.0)
    assert made[0.01].excluded == 0
    assert made[1].clearance.reach_margin == 0.05
    assert made[1].clearance.conditioning_limit < 20
    assert made[10].clearance.reach_margin > 0.05
    assert made[10].clearance.conditioning_limit < made[1].clearance.conditioning_limit
    assert made[10].excluded > made[1].excluded > 0


def test_chosen_poses_keep_their_clearance_at_every_leg(paper, candidates):
    coarse = paper.replace(tolerances=Tolerances(6e-3, 6e-3, 6e-3))
    plan = symkin.make_plan(coarse, candidates)
    kept = plan.basis.clearance
    assert kept.reach_margin > 0.05
    assert _core.reach_margin(coarse.core, plan.poses).min() >= kept.reach_margin - 1e-9
    conditions = coarse.singularity_measures(plan.poses)[2]
    assert conditions.max() <= kept.conditioning_limit * (1 + 1e-9)


def test_without_a_clearance_more_poses_cannot_be_taken(paper, candidates):
    replaced = []
    for sigmas in (0.0, 3.0):
        plan = symkin.make_plan(paper, candidates, margin_sigmas=sigmas, spares=48)
        replaced.append(sum(sum(symkin.simulate(paper, plan, seed).replaced) for seed in range(30)))
    assert replaced[1] < replaced[0] / 4


def test_the_expected_error_is_smaller_with_its_own_criterion(paper, candidates):
    plans = {
        criterion: symkin.make_plan(paper, candidates, criterion=criterion)
        for criterion in ("O1", "expected_error")
    }
    values = {}
    for criterion, plan in plans.items():
        weight = error_weight(paper, candidates[::2])[:8, :8]
        inverse = np.linalg.inv(information(paper, 0, plan.poses[plan.rows_of(0)]))
        values[criterion] = np.trace(inverse @ weight)
    assert values["expected_error"] < values["O1"]
    (choice,) = plans["expected_error"].basis.choices
    assert choice.selection.criterion_value == pytest.approx(values["expected_error"], rel=1e-6)


def test_so_it_is_where_everything_is_unknown_at_once(paper, candidates):
    unknown = {"prior": "tolerances", "frames": ["base"]}
    expected = {}
    for criterion in ("O1", "expected_error"):
        plan = symkin.make_plan(paper, candidates, 8, criterion=criterion, **unknown)
        found = symkin.predict_accuracy(paper, plan, candidates, **unknown)
        sizes = found.position, paper.characteristic_length * found.orientation
        expected[criterion] = np.hypot(*sizes)
    assert expected["expected_error"] < 0.99 * expected["O1"]


def test_a_plan_is_the_same_on_any_number_of_threads(paper, candidates):
    plans = [symkin.make_plan(paper, candidates, threads=threads) for threads in (1, 2, 3)]
    for other in plans[1:]:
        np.testing.assert_array_equal(plans[0].poses, other.poses)


@pytest.mark.parametrize(
    ("demands", "words"),
    [
        ({"criterion": "expected_error", "rows": "paper"}, 'choose rows "noise_aware"'),
        ({"design": "orbits", "minimum_distance": 0.1}, "orbits are chosen for one leg"),
        ({"design": "orbits", "required": np.zeros((1, 3))}, "orbits are chosen for one leg"),
        ({"required": [[0, 0, 0], [2, 0, 0]]}, "required pose 2 is beyond the reach of leg "),
        ({"avoid": [{"z": (0, 1)}]}, 'limits "z"; expected coordinates of the poses, x, y, phi'),
        ({"avoid": [{"x": (1, 0)}]}, "expected the lower limit first"),
        ({"avoid": [{"x": (math.nan, 0)}]}, "expected the lower limit first"),
        ({"avoid": [{}]}, "no limits"),
        ({"avoid": [{"x": (-9, 9)}]}, "only 0 of 3000 candidates may be measured"),
        ({"minimum_distance": 2.0}, "keep the minimum distance"),
        ({"method": "exhaustive", "criterion": "O2"}, "only criterion O1 can be proven"),
    ],
)
def test_demands_that_cannot_be_met_are_refused_in_words(paper, candidates, demands, words):
    with pytest.raises(symkin.SymkinError, match=words):
        symkin.make_plan(paper, candidates, **demands)


@pytest.mark.parametrize("design", ["legs", "orbits"])
def test_where_images_leave_no_poses_it_is_said_that_legs_by_themselves_would_have_them(
    paper, design
):
    half = dataclasses.replace(paper.workspace, lower=(0.0, 0.05, -0.4))  # not symmetrical
    narrow = paper.replace(workspace=half)
    poses = symkin.sample_workspace(narrow, 300, 1)
    with pytest.raises(symkin.SymkinError, match=r"Without images \d+ may be: .*--no-symmetry"):
        symkin.make_plan(narrow, poses, 24, design=design)
    assert len(symkin.make_plan(narrow, poses, 24, symmetry=False, spares=0).poses) == 72
    with pytest.raises(symkin.SymkinError) as caught:  # which has no images
        symkin.make_plan(narrow, poses, 300, design="mechanism")
    assert "--no-symmetry" not in str(caught.value)


@settings(max_examples=50)
@given(st.lists(st.floats(-1.7, 1.7), min_size=3, max_size=3), st.booleans())
def test_rotation_vectors_come_back_from_quaternions(vector, flipped):
    hexapod = symkin.load_mechanism("hexapod_jugglebot")
    vector = np.array(vector)
    half = np.linalg.norm(vector) / 2
    quaternion = np.append(vector * np.sinc(half / np.pi) / 2, np.cos(half))
    pose = np.concatenate([[0.1, 0.2, 0.3], -quaternion if flipped else quaternion])
    found = workspace_coordinates(hexapod, pose)
    np.testing.assert_allclose(found[0], [0.1, 0.2, 0.3, *vector], atol=1e-12)
