# SPDX-License-Identifier: MIT
"""Plans for each leg, for orbits, and for the whole mechanism."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symkin
from symkin.analysis.observability import mechanism_rows, observability_rows
from symkin.errors import NotIdentifiableError
from symkin.model.symmetry import map_poses, observability_group
from symkin.planning import predict_accuracy


@pytest.fixture(scope="module")
def candidates(paper):
    return symkin.sample_workspace(paper, 3000, seed=1).poses


def log_det_of_leg(mechanism, plan, leg):
    rows = observability_rows(mechanism, leg, plan.poses[plan.rows_of(leg)], "noise_aware")
    return np.linalg.slogdet(rows.T @ rows)[1]


def test_every_leg_of_an_orbit_design_uses_the_same_poses_and_knows_the_same(paper, candidates):
    plan = symkin.make_plan(paper, candidates, 24, design="orbits")
    assert np.unique(plan.leg_sets).tolist() == [-1]
    assert np.count_nonzero(~plan.spare) == 24
    log_dets = [log_det_of_leg(paper, plan, leg) for leg in range(3)]
    assert np.ptp(log_dets) < 1e-9
    (choice,) = plan.basis.choices
    assert choice.selection.log_det == pytest.approx(log_dets[0], abs=1e-9)
    assert len(choice.selection.indices) == 8


def test_an_orbit_design_is_closed_under_the_symmetry(paper, candidates):
    plan = symkin.make_plan(paper, candidates, 12, design="orbits")
    poses = plan.poses[~plan.spare]
    for element in observability_group(paper):
        images = map_poses(paper, element, poses)
        distances = np.linalg.norm(images[:, None] - poses[None], axis=2).min(axis=1)
        assert distances.max() < 1e-12


@pytest.mark.parametrize(("count", "measured"), [(8, 9), (9, 9), (10, 12)])
def test_an_orbit_design_is_rounded_up_to_whole_orbits(paper, candidates, count, measured):
    plan = symkin.make_plan(paper, candidates, count, design="orbits", spares=0)
    assert len(plan.poses) == measured


def test_a_third_of_the_measurements_serves_three_legs(paper, candidates):
    # 24 poses in orbits against the paper's 72, each with the best per-leg estimator it allows.
    orbits = symkin.make_plan(paper, candidates, design="orbits")
    own = symkin.make_plan(paper, candidates, rows="paper")
    with_orbits = predict_accuracy(paper, orbits, candidates, "implicit")
    with_paper = predict_accuracy(paper, own, candidates, "paper", poses="own")
    assert np.count_nonzero(~own.spare) == 3 * np.count_nonzero(~orbits.spare)
    assert with_orbits.position < with_paper.position
    assert with_orbits.orientation < with_paper.orientation


def test_a_design_for_the_mechanism_beats_orbits_for_the_joint_estimate(paper, candidates):
    errors = {
        design: predict_accuracy(
            paper, symkin.make_plan(paper, candidates, design=design), candidates, "joint"
        ).position
        for design in ("orbits", "mechanism")
    }
    assert errors["mechanism"] < errors["orbits"]


def test_a_design_for_the_mechanism_knows_its_determinant(paper, candidates):
    plan = symkin.make_plan(paper, candidates, 10, design="mechanism", spares=0)
    rows = mechanism_rows(paper, plan.poses, "noise_aware").reshape(-1, 24)
    (choice,) = plan.basis.choices
    assert choice.legs == (0, 1, 2)
    log_det = np.linalg.slogdet(rows.T @ rows)[1]
    assert choice.selection.log_det == pytest.approx(log_det, abs=1e-6)


@pytest.mark.parametrize("name", ["5bar", "3RPR", "4RRR", "hexapod_jugglebot"])
def test_orbits_serve_every_shipped_kind_of_mechanism(name):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, 800).poses
    size = len(observability_group(mechanism))
    plan = symkin.make_plan(mechanism, poses, 4 * size, design="orbits", spares=0)
    log_dets = [log_det_of_leg(mechanism, plan, leg) for leg in range(len(mechanism.legs))]
    assert np.ptp(log_dets) < 1e-8


def test_without_symmetry_every_leg_has_a_choice_of_its_own(paper, candidates):
    plan = symkin.make_plan(paper, candidates, symmetry=False)
    assert [choice.legs for choice in plan.basis.choices] == [(0,), (1,), (2,)]
    assert not plan.basis.symmetrical


def test_an_asymmetric_mechanism_has_no_orbits():
    mechanism = symkin.load_mechanism("3RRR_asymmetric")
    poses = symkin.sample_workspace(mechanism, 300).poses
    with pytest.raises(symkin.SymkinError, match='choose the design "legs" or "mechanism"'):
        symkin.make_plan(mechanism, poses, design="orbits")
    plan = symkin.make_plan(mechanism, poses)
    assert [choice.legs for choice in plan.basis.choices] == [(0,), (1,), (2,)]


@settings(max_examples=15)
@given(count=st.integers(8, 40), seed=st.integers(0, 9))
def test_a_plan_for_legs_is_equally_good_for_all_and_has_what_was_asked_for(count, seed):
    paper = symkin.load_mechanism("3RRR")
    poses = symkin.sample_workspace(paper, 400, seed=seed).poses
    plan = symkin.make_plan(paper, poses, count, seed)
    log_dets = [log_det_of_leg(paper, plan, leg) for leg in range(3)]
    assert np.ptp(log_dets) < 1e-8
    assert [len(plan.rows_of_set(leg)) for leg in (0, 1, 2)] == [count] * 3
    assert 0 < plan.basis.choices[0].selection.certificate.efficiency <= 1


def test_an_unknown_design_is_refused(paper, candidates):
    with pytest.raises(symkin.SymkinError, match='expected "legs", "orbits" or "mechanism"'):
        symkin.make_plan(paper, candidates, design="leg")


def test_too_few_poses_are_refused_in_words(paper, candidates):
    with pytest.raises(symkin.SymkinError, match="expected at least 8 poses"):
        symkin.make_plan(paper, candidates, 7)
    with pytest.raises(symkin.SymkinError, match="expected at least 8 poses"):
        symkin.make_plan(paper, candidates, 7, design="mechanism")


def test_what_no_pose_can_show_is_named():
    # At one orientation nobody can tell a turn of the platform points from one of the platform.
    mechanism = symkin.load_mechanism("3RRR")
    poses = symkin.sample_workspace(mechanism, 6000).poses.copy()
    poses[:, 2] = 0.1
    reached = poses[np.isfinite(mechanism.inverse_kinematics(poses)).all(axis=1)]
    with pytest.raises(NotIdentifiableError, match=r"not shown: .*platform_"):
        symkin.make_plan(mechanism, reached)


@pytest.mark.parametrize("rows", ["paper", "noise_aware"])
def test_o1_of_a_plan_is_one_figure_wherever_it_is_shown(paper, rows):
    poses = symkin.sample_workspace(paper, 300, 1).poses
    plan = symkin.make_plan(paper, poses, 12, rows=rows, spares=0)
    (choice,) = plan.basis.choices
    for leg in plan.to_dict()["legs"]:
        assert leg["indices"]["O1"] == pytest.approx(choice.selection.criterion_value, rel=1e-9)
