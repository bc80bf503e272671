# SPDX-License-Identifier: MIT
"""What single poses do to a joint estimate, and what else its results say of it."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed


@pytest.fixture(scope="module")
def paper():
    return symkin.load_mechanism("3RRR")


@pytest.fixture(scope="module")
def measured(paper):
    simulated = symkin.simulate(paper, paper.plan(9, seed=3), seed=2, observe="position")
    return simulated.measurements.for_all_legs()


@pytest.fixture(scope="module")
def found(paper, measured):
    return symkin.identify(paper, measured, prior="tolerances")


@pytest.mark.parametrize("pose", [3, 11, 20])
def test_leaving_a_pose_out_is_what_a_refit_without_it_does(paper, measured, found, pose):
    others = measured.subset(np.delete(np.arange(len(measured.poses)), pose))
    refit = symkin.identify(paper, others, prior="tolerances")
    lost = found.chi_square - refit.chi_square
    told = found.influence.residual[pose] ** 2 * found.conditions[pose]
    assert told == pytest.approx(lost, rel=5e-3, abs=0.01)  # of first order
    deviations = np.sqrt(np.diag(found.model_covariance))
    values = [{u.name: u.value for u in each.unknowns} for each in (found, refit)]
    moved = np.array([values[1][name] - values[0][name] for name in found.names]) / deviations
    assert found.influence.by[pose] == pytest.approx(np.abs(moved).max(), abs=0.01)
    assert found.influence.moves[pose] >= found.influence.by[pose]


def test_a_gauge_leaves_single_unknowns_unnamed(paper):
    tracker = Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))
    made = symkin.simulate(paper, paper.plan(9, seed=3), seed=1, observe=tracker)
    taken = made.measurements.for_all_legs()
    found = symkin.identify(paper, taken, frames=["base", "target"], gauge="nominal")
    assert np.isfinite(found.influence.moves).all()
    assert set(found.influence.unknown) == {""}
    assert found.expected.worst > found.expected.position > 0


def test_poses_that_a_loss_has_weighed_have_no_influence_told(paper, measured):
    assert symkin.identify(paper, measured, loss="huber").influence is None


def test_expected_errors_cover_those_of_simulated_robots(paper):
    squares = []
    for seed in range(6):
        simulated = symkin.simulate(paper, paper.plan(9, seed=3), seed=seed, observe="position")
        taken = simulated.measurements.for_all_legs()
        found = symkin.identify(paper, taken, prior="tolerances")
        poses = paper.sample_workspace(200, 2).poses
        readings = simulated.actual.inverse_kinematics(poses)
        reached, converged = found.mechanism.forward_kinematics(readings, poses)
        kept = converged & np.isfinite(readings).all(axis=1)
        errors = np.linalg.norm((reached - poses)[kept, :2], axis=1)
        squares.append(np.mean(errors**2) / found.expected.position**2)
    assert 0.3 < np.mean(squares) < 2


def test_results_say_what_is_known_and_what_speaks_against_it(found, measured):
    told = found.to_dict()["identification"]
    assert len(told["influence"]["moves"]) == len(measured.poses)
    assert told["expected_accuracy"]["position_rms_m"] == found.expected.position
    worst, best = told["known_worst_and_best"]
    assert worst["deviation_in_tolerances"] > best["deviation_in_tolerances"]
    assert 0 < len(worst["unknowns"]) < len(found.names)
    assert abs(told["correlations"][0]["correlation"]) <= 1
    first = found.unknowns[0]
    change = (first.value - first.nominal) / first.tolerance
    assert told["params"][first.name]["change_in_tolerances"] == pytest.approx(change)
    assert told["models"] == told["hypotheses"] == []
    text = found.text(whole=True)
    assert "If a pose were left out" in text
    assert "Errors to expect over the workspace" in text


def test_models_say_what_explains_the_residuals(paper):
    simulated = symkin.simulate(paper, paper.plan(12, seed=3), seed=1)
    taken = simulated.measurements.for_all_legs()
    bent = simulated.actual.replace(curvature=[[2e-3, 0, 0]] * 3)
    wrong = dataclasses.replace(taken, readings=bent.inverse_kinematics(taken.poses))
    found = symkin.identify(paper, wrong, gauge="nominal")
    models = {each.what: each for each in found.models}
    assert models["quadratic"].unknowns == models["identified"].unknowns + 3
    assert models["quadratic"].chi_square < models["quadratic"].degrees_of_freedom * 1.5
    assert models["quadratic"].unseen_rms < models["identified"].unseen_rms
    assert "What explains the residuals" in found.text(whole=True)
