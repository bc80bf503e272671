# SPDX-License-Identifier: MIT
"""Targets at unknown places of which only the place is observed, or only the turn."""

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.analysis.seen import Seen
from symkin.present import page_of, page_text

ASKED = {"frames": ["base", "target"], "prior": "tolerances"}


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


@pytest.fixture(scope="module")
def plan(robot):
    return robot.plan(30, candidates=1500, observe="position", **ASKED)


@pytest.fixture(scope="module")
def found(robot, plan):
    seen = Observed(("position",), base=(0.3, -0.2, 0.35), target=(0.1, 0.05, 0.0))
    return robot.identify(robot.simulate(plan, 1, observe=seen).measurements, **ASKED)


def test_a_target_of_which_only_the_place_is_seen_has_no_turn_to_be_found(plan, found):
    assert "target.phi" not in found.names
    assert {"target.x", "target.y"} <= {*found.names}
    assert {each.name for each in plan.unknowns} == {*found.names}


def test_the_orientation_of_a_platform_is_promised_up_to_the_turn_that_nothing_shows(
    robot, plan, found
):
    assert plan.expected.up_to_turn
    assert found.expected.up_to_turn
    whole = robot.plan(30, candidates=1500, observe="pose", **ASKED)
    assert not whole.expected.up_to_turn
    # What tolerances leave of the turn alone is more than 0.5 mrad.
    assert plan.expected.orientation < 3e-4
    assert "which no observation shows" in page_text(page_of(found), whole=True)


def test_positions_alone_are_evaluated_before_and_after(robot, plan, found):
    seen = Observed(("position",), base=(0.3, -0.2, 0.35), target=(0.1, 0.05, 0.0))
    anew = robot.simulate(plan, 1, observe=seen, actual=robot.simulate(plan, 1).actual)
    after = found.mechanism.evaluate(measurements=anew.measurements)
    noise = np.sqrt(2) * robot.noise.position
    assert found.before.position_rms > 10 * noise
    for each in (after, found.after):
        assert each.position_rms < 1.2 * noise
        assert each.kinds == [("position", "m")]
        assert np.isnan(each.differences[:, 2]).all()
    assert after.closures is None


def test_the_first_screen_says_how_accurate_a_robot_is_of_which_positions_were_measured(found):
    told = page_text(page_of(found))
    assert f"{1e3 * found.before.position_rms:.2f} \N{RIGHTWARDS ARROW} " in told
    assert f"{1e3 * found.expected.position_bound:.4f}" in told
    assert f"{np.degrees(found.expected.orientation_bound):.4f}" in told


def test_the_command_after_a_plan_asks_for_the_same_unknowns(plan):
    told = page_text(page_of(plan))
    assert "--prior tolerances --frames base --frames target --out identified" in told


def test_what_kinds_show_of_a_target_is_what_their_measurements_show():
    robot = symkin.load("hexapod_jugglebot")
    plan = robot.plan(12, candidates=200, spares=0)
    shown = {}
    for kind in ("pose", "position", "orientation", "attitude", "tilt", "height", "readings"):
        taken = robot.simulate(plan, 1, observe=kind).measurements
        seen = Seen.by([kind], robot.space)
        assert Seen.of(taken) == seen, kind
        shown[kind] = seen.placed, seen.turned
    assert shown["attitude"] == shown["orientation"] == (False, True)
    assert shown["height"] == shown["position"] == (True, False)


def test_a_turn_that_is_freed_by_name_stays_free(robot):
    with pytest.raises(symkin.SymkinError, match=r"target\.phi"):
        robot.plan(
            30,
            candidates=1500,
            observe="position",
            free=["leg?", "base.*", "target.x", "target.y", "target.phi"],
            prior="tolerances",
        )
