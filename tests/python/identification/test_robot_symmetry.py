# SPDX-License-Identifier: MIT
"""How symmetric a robot is, as it was identified."""

import json
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.estimate.robot_symmetry import _contrast_test, _Legs, robot_symmetry
from symkin.model.symmetry import symmetry_pairs
from symkin.model.tolerances import parameter_tolerances
from symkin.planning.simulation import disturb

DECLARED = Path(__file__).parents[3] / "mechanisms" / "declared"


@pytest.fixture(scope="module")
def plan(paper):
    return symkin.plan(paper)


def identified(paper, plan, differing, seed=5, **options):
    """A robot with errors in common, and some that differ from leg to leg, in tolerances."""
    rng = np.random.default_rng(seed)
    tolerances = parameter_tolerances(paper)
    errors = rng.normal(0, 1, tolerances.shape[1]) + differing * rng.normal(0, 1, tolerances.shape)
    actual = paper.with_parameters(paper.parameters + errors * tolerances)
    simulated = symkin.simulate(paper, plan, seed=seed, actual=actual)
    return symkin.identify(paper, simulated.measurements, **options)


def test_a_robot_whose_errors_are_all_in_common_is_symmetric(paper, plan):
    judged = robot_symmetry(identified(paper, plan, 0.0))
    assert judged.group == "C_3"
    assert [each.degrees_of_freedom for each in judged.tests] == [12, 12]
    assert all(each.p_value > 0.05 for each in judged.tests)
    assert all(each.different < 0.1 for each in judged.kinds)


def test_differences_between_the_legs_are_noticed(paper, plan):
    found = identified(paper, plan, 0.3)
    judged = robot_symmetry(found)
    assert all(each.p_value < 1e-6 for each in judged.tests)
    together = judged.kinds[0]
    assert together.kind == "all"
    assert 0.15 < together.different < 0.6
    assert 0.5 < together.share < 1
    assert "has no symmetry of the drawing's C_3" in judged.text()


def test_errors_that_only_move_the_frames_count_for_nothing(paper):
    legs = _Legs(paper)
    frames = legs.frames()
    assert frames.shape == (24, 6)
    (_, turn, _) = symmetry_pairs(paper).keep_modes_and_home
    contrasts = legs.action(turn) - np.eye(24)
    moved = 5 * frames @ np.arange(1.0, 7)
    value, freedom = _contrast_test(moved, np.eye(24), contrasts, frames)
    assert (freedom, value < 1e-12) == (12, True)
    assert _contrast_test(moved, np.eye(24), contrasts, np.zeros((24, 0)))[0] > 1


def test_the_action_of_a_group_on_errors_is_a_group(hexapod):
    legs = _Legs(hexapod)
    elements = symmetry_pairs(hexapod).keep_modes_and_home
    actions = [legs.action(element) for element in elements]
    np.testing.assert_allclose(actions[0], np.eye(len(actions[0])), atol=1e-6)
    product = elements[1].core.compose(elements[3].core)
    images = [tuple(each.permutation) for each in elements]
    wanted = tuple(elements[1].permutation[leg] for leg in elements[3].permutation)
    found = actions[images.index(wanted)]
    np.testing.assert_allclose(actions[1] @ actions[3], found, atol=1e-5)
    assert product.improper


@pytest.mark.parametrize("name", ["3RPS", "orthoglide_rods"])
def test_legs_that_bind_their_platform_are_compared_by_all_their_closures(name):
    mechanism = symkin.load_mechanism(name)
    plan = symkin.plan(mechanism, 30, design="mechanism", candidates=300)
    for differing, alike in ((0.0, True), (0.3, False)):
        judged = robot_symmetry(identified(mechanism, plan, differing))
        # Mirrors turn round what is the same number in all legs.
        turns = [each.p_value for each in judged.tests if each.words.startswith("turn")]
        assert [each > 0.05 for each in turns] == [alike, alike]


def test_what_rests_on_priors_or_has_no_symmetry_is_not_tested(paper, plan):
    with pytest.raises(symkin.SymkinError, match="rests on priors"):
        robot_symmetry(identified(paper, plan, 0.0, prior="tolerances"))
    with pytest.raises(symkin.SymkinError, match="estimated by itself"):
        robot_symmetry(identified(paper, plan, 0.0, estimator="joint", shared=["sensor_gain"]))
    tricept = symkin.load_mechanism("tricept")
    taken = symkin.simulate(tricept, symkin.plan(tricept, candidates=300), seed=1).measurements
    with pytest.raises(symkin.SymkinError, match="closures of a leg have no reading"):
        robot_symmetry(symkin.identify(tricept, taken))
    other = symkin.load_mechanism("3RRR_asymmetric")
    simulated = symkin.simulate(other, symkin.plan(other, design="mechanism"), seed=1)
    with pytest.raises(symkin.SymkinError, match="no symmetry that keeps"):
        robot_symmetry(symkin.identify(other, simulated.measurements))


def test_chi_squares_are_those_of_the_reference(shared_reference):
    case = json.loads((shared_reference / "symmetry_pairs.json").read_text())["statistics"][0]
    rows, y = np.array(case["rows"]), np.array(case["y"])
    covariance = np.linalg.inv(rows.T @ rows)
    estimate = covariance @ rows.T @ y
    frames = np.array(case["frame_directions"]).T
    for each in case["element_tests"]:
        action = np.zeros((24, 24))
        for leg, onto in enumerate(each["permutation"]):
            block = slice(8 * onto - 8, 8 * onto), slice(8 * leg, 8 * leg + 8)
            action[block] = np.diag(each["signs"][leg])
        for free, expected in (np.zeros((24, 0)), each), (frames, each["frames_free"]):
            value, freedom = _contrast_test(estimate, covariance, action - np.eye(24), free)
            assert value == pytest.approx(expected["chi_square"], rel=1e-5)
            assert freedom == expected["degrees_of_freedom"]


def test_errors_alike_in_legs_about_a_tilted_axis_keep_its_turns_and_not_its_mirrors():
    mechanism = symkin.load_mechanism(DECLARED / "orthoglide.toml")
    of_all = disturb(mechanism, seed=1).parameters[0] - mechanism.parameters[0]
    # Three tolerances, since the base's frame takes a part of what mirrors turn round.
    actual = mechanism.with_parameters(mechanism.parameters + 3 * of_all * mechanism.is_estimated)
    plan = symkin.plan(mechanism, 24, candidates=300)
    measured = symkin.simulate(mechanism, plan, 1, actual=actual).measurements
    judged = robot_symmetry(symkin.identify(mechanism, measured))
    assert judged.group == "C_3v"
    assert _Legs(mechanism).frames().shape == (24, 6)
    for test in judged.tests:
        # A mirror turns round base.y and base.rz of the leg that it leaves where it is.
        assert (test.p_value > 0.05) == test.words.startswith("turn")
    assert all(np.isfinite([each.common, each.different]).all() for each in judged.kinds)
