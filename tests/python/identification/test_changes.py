# SPDX-License-Identifier: MIT
"""What changes while a robot is measured: noticed, named, and estimated as an unknown."""

import dataclasses
import json
import re

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.cli import main
from symkin.errors import SymkinError
from symkin.estimate.covariates import clock, covariates_of, last_moves
from symkin.estimate.evidence.changes import change_tests, largest_of_steps, step_scores
from symkin.model.settings import Frames
from symkin.planning.simulation import disturb

CHANGES = {
    "a drift of a leg": ({"leg2.drift": "1 mrad"}, {"drift": ["leg"]}, "drifts"),
    "a drift of the frame": ({"drift.x": "0.5 mm"}, {"drift": ["frame"]}, "drifts"),
    "a step of a leg": ({"leg1.step29": "1 mrad"}, {"step": ["29"]}, "steps"),
    "a step of the frame": ({"step20.y": "0.5 mm"}, {"step": ["frame:20"]}, "steps"),
    "growth": ({"growth": 2e-3}, {"growth": True}, "grows"),
    "backlash": ({"leg3.backlash": "1 mrad"}, {"backlash": True}, "has-backlash"),
}


@pytest.fixture(scope="module")
def plan(paper):
    return symkin.plan(paper, 40, design="mechanism", candidates=2000, seed=1)


@pytest.fixture(scope="module")
def sound(paper, plan):
    return symkin.simulate(paper, plan, 1)


@pytest.fixture(scope="module", params=list(CHANGES))
def changed(request, paper, plan):
    changes, options, code = CHANGES[request.param]
    return symkin.simulate(paper, plan, 1, changes=changes), changes, options, code


def test_what_changed_is_noticed_named_and_told_how_to_be_asked_for(paper, changed):
    simulation, _, options, code = changed
    for estimator in ("implicit", "joint"):
        found = symkin.identify(paper, simulation.measurements, estimator)
        assert [doubt.code for doubt in found.doubts] == [code]
        assert found.doubts[0].options == options


def test_as_an_unknown_it_is_found_and_the_robot_is_right(paper, changed):
    simulation, changes, options, _ = changed
    found = symkin.identify(paper, simulation.measurements, **options)
    assert found.converged
    assert found.doubts == ()
    assert found.residual_rms < 0.25e-3  # as without a change
    (name,) = changes
    own = found.params["leg1.growth" if name == "growth" else name]
    true = {"drift.x": 5e-4, "step20.y": 5e-4, "growth": 2e-3}.get(name, 1e-3)
    assert abs(own.value - true) < 4 * own.deviation < true / 2
    errors = (found.mechanism.parameters - simulation.actual.parameters) / found.deviations
    assert np.nanmax(np.abs(errors)) < 3.5


def test_a_sound_robot_is_not_doubted_and_slopes_that_are_not_there_are_zero(paper, sound):
    assert symkin.identify(paper, sound.measurements).doubts == ()
    found = symkin.identify(
        paper,
        sound.measurements,
        drift=["leg", "frame"],
        step=[20, "frame:30"],
        growth=True,
        backlash=True,
    )
    names = ("drift", "step20", "step30", "growth", "backlash")
    slopes = [each for each in found.unknowns if {*each.name.split(".")} & {*names}]
    assert len(slopes) == 3 + 3 + 3 + 3 + 3 + 3
    assert found.names.count("growth") == 1
    assert all(abs(each.value) < 3.5 * each.deviation for each in slopes)
    said = found.text(whole=True)
    assert "Drift of the base in the frame of the measuring device" in said
    assert "Step of the base in the frame of the measuring device, at row 30" in said


def test_a_drift_that_is_an_unknown_is_not_tested_for(paper, sound):
    found = symkin.identify(paper, sound.measurements, drift=["leg"])
    assert not [test for test in change_tests(found) if (test.what, test.leg) == ("drift", 0)]
    assert [test for test in change_tests(found) if (test.what, test.leg) == ("drift", -1)]


@pytest.mark.parametrize("noise", [None, "estimate"])
def test_positions_that_stay_behind_by_a_share_of_the_last_move_are_told(paper, sound, noise):
    taken = sound.measurements.for_all_legs()
    poses = np.array(taken.poses)
    poses[1:, :2] -= 0.01 * np.diff(poses[:, :2], axis=0)
    found = symkin.identify(paper, dataclasses.replace(taken, poses=poses), noise=noise)
    (told,) = found.doubts
    assert told.code == "lags"
    assert told.size == pytest.approx(0.01, rel=0.1)
    assert "positions stay behind by 1" in str(told)


def test_orientations_and_reflectors_that_stay_behind_are_told_alike(paper, plan, sound):
    taken = sound.measurements.for_all_legs()
    poses = np.array(taken.poses)
    poses[1:, 2] -= 0.01 * np.diff(poses[:, 2])
    (told,) = symkin.identify(paper, dataclasses.replace(taken, poses=poses)).doubts
    assert "orientations stay behind by 1" in str(told)
    seen = Observed("points", base=(1.0, -0.5, 3.0), points=((0.1, 0.0), (-0.1, 0.05)))
    taken = symkin.simulate(paper, plan, 1, observe=seen).measurements.for_all_legs()
    points = np.array(taken.points)
    points[1:] -= 0.01 * np.diff(points, axis=0)
    late = dataclasses.replace(taken, points=points)
    (told,) = symkin.identify(paper, late, frames=["base"]).doubts
    assert told.code == "lags"
    assert told.size == pytest.approx(0.01, rel=0.1)


def test_turns_that_the_legs_bind_are_noise_and_no_lag():
    mechanism = symkin.load_mechanism("3UPU")
    plan = symkin.plan(mechanism, candidates=300)
    taken = symkin.simulate(mechanism, plan, 7, actual=disturb(mechanism, seed=7)).measurements
    found = symkin.identify(mechanism, taken)
    assert sum(each.what == "lag" for each in change_tests(found)) == 1  # of positions
    assert not found.doubts


def test_of_all_that_is_missed_each_kind_is_told(paper):
    """Which of them a robot has is what its user has to judge."""
    poses, every = symkin.sample_workspace(paper, 50, seed=1).poses, np.arange(50)
    own = symkin.Plan(
        paper, np.full(50, -1), every, every >= 40, poses, paper.inverse_kinematics(poses)
    )
    taken = symkin.simulate(paper, own, 1).measurements.for_all_legs()
    found = symkin.identify(paper, taken, estimator="joint")
    (note,) = (each for each in found.notes if each.code == "unseen")
    told, _, _ = str(note).partition(" in brackets")
    assert "backlash of" in told
    assert len(re.findall("device|sag|lag by|backlash|play", told)) == told.count(" times)") > 3
    assert note.options["backlash"] is True


def test_backlash_that_is_missed_is_told_with_what_it_does_to_the_robot(paper):
    poses, every = symkin.sample_workspace(paper, 50, seed=1).poses, np.arange(50)
    readings = paper.inverse_kinematics(poses)
    own = symkin.Plan(paper, np.full(50, -1), every, every >= 40, poses, readings)
    taken = symkin.simulate(paper, own, 1, observe="position").measurements
    found = symkin.identify(paper, taken)
    (note,) = (each for each in found.notes if each.code == "unseen")
    told = re.search(r"backlash of ([\d.]+) rad of all legs \(([\d.]+) times\)", str(note))
    assert note.options["backlash"] is True
    played = taken.readings + 0.5 * float(told[1]) * last_moves(paper, taken)
    spoiled = symkin.identify(paper, dataclasses.replace(taken, readings=played))
    poses = spoiled.latent_poses
    moved = symkin.evaluate(spoiled.mechanism, actual=found.mechanism, poses=poses)
    times = moved.position_rms / found.expected_at_poses.position
    assert times == pytest.approx(float(told[2]), rel=0.1)
    bent = symkin.identify(paper, taken, sensor="quadratic").notes
    assert "backlash of" in next(str(each) for each in bent if each.code == "unseen")
    known = symkin.identify(paper, taken, backlash=True).notes
    assert "backlash" not in " ".join(str(each) for each in known if each.code == "unseen")


def test_readings_a_row_late_along_a_smooth_path_are_no_backlash(paper, plan):
    """Their errors have the sign of the last move there, as those of a leg with play have."""
    middle, reach = plan.poses.mean(axis=0), plan.poses.std(axis=0)
    turns = 2 * np.pi * np.outer(np.arange(60) / 60, (2, 3, 5)) + (1, 2, 4)
    poses, every = middle + 0.5 * reach * np.sin(turns), np.arange(60)
    readings = paper.inverse_kinematics(poses)
    path = symkin.Plan(paper, np.full(60, -1), every, every < 0, poses, readings)
    taken = symkin.simulate(paper, path, 1).measurements.for_all_legs()
    late = np.array(taken.readings)
    late[:, 0] = np.roll(late[:, 0], 1)
    late = dataclasses.replace(taken, readings=late).subset(every[1:])
    (told,) = symkin.identify(paper, late, noise="estimate").doubts
    assert told.code == "rows-shifted"
    assert told.legs == (0,)


def test_the_score_is_the_estimate_to_first_order(paper, plan):
    simulation = symkin.simulate(paper, plan, 1, changes={"leg2.drift": "0.2 mrad"})
    found = symkin.identify(paper, simulation.measurements, "joint")
    (test,) = (each for each in change_tests(found) if each.name == "leg2.drift")
    held = {"fixed": ["leg1.drift", "leg3.drift"]}
    own = symkin.identify(paper, simulation.measurements, drift="leg", **held).params["leg2.drift"]
    assert test.size == pytest.approx(own.value, rel=0.02)
    assert test.deviation == pytest.approx(own.deviation, rel=0.05)


def test_the_same_is_said_of_a_hexapod(hexapod):
    plan = symkin.plan(hexapod, 20, design="mechanism", candidates=500, seed=1)
    simulation = symkin.simulate(hexapod, plan, 1, changes={"drift.z": "2 mm", "leg4.drift": 0.3})
    found = symkin.identify(hexapod, simulation.measurements, drift=["leg", "frame"])
    assert not found.unexplained
    for name, true in (("drift.z", 2e-3), ("leg4.drift", 0.3)):
        assert abs(found.params[name].value - true) < 4 * found.params[name].deviation


def test_scores_and_their_largest_are_those_of_the_reference(shared_reference):
    data = json.loads((shared_reference / "promises.json").read_text(encoding="utf-8"))
    for case in data["time"]:
        rows, residual = np.array(case["J"]), np.array(case["rows"])
        basis = np.linalg.qr(rows)[0]
        left = residual - basis @ (basis.T @ residual)
        one = np.ones((len(rows), 1))
        steps, scores, alike = step_scores(one, basis[:, None], left[:, None])
        assert steps[0] == case["trim"]
        np.testing.assert_allclose(np.abs(scores), np.abs(case["score"]), atol=1e-9)
        assert np.abs(scores).max() == pytest.approx(case["statistic"])
        assert steps[np.abs(scores).argmax()] == case["step_at_row"]
        for level, quantile in case["null_quantiles"].items():
            tail = 1 - float(level)
            assert 0.97 * tail < largest_of_steps(quantile, alike) < 1.2 * tail


def test_time_is_the_column_or_the_order_of_the_rows(paper, sound):
    taken = sound.measurements
    np.testing.assert_allclose(clock(taken), np.linspace(-0.5, 0.5, len(taken)))
    late = dataclasses.replace(taken, times=np.arange(len(taken))[::-1] * 30.0)
    np.testing.assert_allclose(clock(late), -clock(taken))
    forth = symkin.identify(paper, taken, drift="leg").params["leg1.drift"].value
    back = symkin.identify(paper, late, drift="leg").params["leg1.drift"].value
    assert back == pytest.approx(-forth, rel=1e-6)


def test_growth_goes_with_the_temperature_about_its_mean(paper, plan):
    taken = symkin.simulate(paper, plan, 1, changes={"growth": 2e-3}).measurements
    warm = dataclasses.replace(taken, temperatures=30 + 10 * clock(taken))
    growth = symkin.identify(paper, warm, growth=True).params["leg1.growth"]
    assert growth.unit == "1/K"
    assert abs(growth.value - 2e-4) < 4 * growth.deviation


@pytest.mark.parametrize(
    "name", ["3RRR", "2RRR_PRP", "3RPS", "linear_delta", "hexapod_jugglebot", "hexa", "tricept"]
)
def test_a_robot_that_grows_is_the_same_enlarged(name):
    robot = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(robot, 20).poses
    grown = robot.parameters.copy()
    for leg, growing in enumerate(robot.core.growing_parameters):
        grown[leg, growing] *= 1.01
    larger = poses * np.where(np.arange(poses.shape[1]) < robot.space.size, 1.01, 1.0)
    np.testing.assert_allclose(
        robot.with_parameters(grown, symmetry=None).inverse_kinematics(larger),
        robot.inverse_kinematics(poses),
        atol=1e-12,
    )


def test_where_a_growth_looks_like_a_drift_of_the_device_both_are_told():
    robot = symkin.load_mechanism("3RPS")
    taken = symkin.simulate(
        robot, symkin.plan(robot, 40, candidates=500, design="mechanism", seed=1), 1
    ).measurements
    poses = np.array(taken.poses)
    poses[:, :3] *= 1 + np.linspace(0, 5e-4, len(poses))[:, None]
    (doubt,) = symkin.identify(robot, dataclasses.replace(taken, poses=poses)).doubts
    assert {each.code for each in (doubt, *doubt.others)} == {"grows", "drifts"}
    assert "or as well: " in str(doubt)
    assert "growth=True" in str(doubt)
    assert 'drift=["frame"]' in str(doubt)


def test_the_side_that_a_leg_comes_from_is_the_column_or_the_reading_before(paper, sound):
    taken = sound.measurements
    moves = last_moves(paper, taken)
    np.testing.assert_array_equal(moves[1:], np.sign(np.diff(taken.readings, axis=0)))
    readings = taken.readings.copy()
    readings[4, 1] = np.nan
    gap = last_moves(paper, dataclasses.replace(taken, readings=readings))
    assert gap[4, 1] == 0
    assert gap[5, 1] == np.sign(readings[5, 1] - readings[3, 1])
    told = dataclasses.replace(taken, approaches=-moves)
    np.testing.assert_array_equal(last_moves(paper, told), -moves)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"step": 400}, "there is no row 400"),
        ({"step": [2]}, "no row was measured before it"),
        ({"step": "soon"}, 'step is "soon"'),
        ({"step": "leg:x"}, 'step is "leg:x"'),
        ({"drift": "platform"}, 'expected "leg" or "frame"'),
    ],
)
def test_what_cannot_change_is_refused(paper, sound, options, said):
    with pytest.raises(SymkinError, match=re.escape(said)):
        symkin.identify(paper, sound.measurements, **options)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"leg9.drift": 1e-3}, "leg9.drift"),
        ({"drift.z": 1e-3}, "drift.z"),
        ({"leg1.wobble": 1e-3}, "leg1.wobble"),
        ({"growth.x": 1e-3}, "growth.x"),
        ({"leg1.drift": "1 mm"}, "leg1.drift"),
        ({"step99": 1e-3}, "no row 99"),
    ],
)
def test_a_change_that_cannot_be_simulated_is_refused(paper, plan, changes, said):
    with pytest.raises(SymkinError, match=said):
        symkin.simulate(paper, plan, 1, changes=changes)


def test_attitudes_turn_with_the_device_and_are_turned_back(hexapod):
    plan = symkin.plan(hexapod, 40, design="mechanism", candidates=500, seed=1)
    turned = {"session1.x": "30 mm", "session1.rx": "0.2 rad", "session1.rz": "0.5 rad"}
    seen = ("position", "attitude")
    taken = symkin.simulate(hexapod, plan, 1, observe=seen, changes=turned).measurements
    found = symkin.identify(hexapod, taken, prior="tolerances", sessions=["frames"])
    assert found.trustworthy, found.doubts
    assert found.params["session1.rx"].value == pytest.approx(0.2, abs=2e-3)
    still = symkin.simulate(hexapod, plan, 1, observe=seen).measurements
    off = found.at_rest.attitudes - still.attitudes  # of which the noise is turned, too
    assert np.sqrt(np.mean(off**2)) < 2 * hexapod.noise.orientation


def test_distances_are_not_moved_with_the_device_but_left_out(paper, plan):
    placed = paper.replace(frames=Frames(anchors=((2.0, 1.0), (-1.5, 0.5))))
    seen = ("pose", "distance")
    with pytest.raises(SymkinError, match="distances are seen from where the device stands"):
        symkin.simulate(placed, plan, 1, observe=seen, changes={"drift.x": "1 mm"})
    taken = symkin.simulate(placed, plan, 1, observe=seen).measurements
    found = symkin.identify(placed, taken, drift=["frame"])
    assert found.trustworthy, found.doubts
    assert np.isnan(found.at_rest.distances).all()


def test_with_a_loss_and_priors_sound_distances_are_not_distorted():
    robot = symkin.load_mechanism("5bar").replace(frames=Frames(anchors=((1.2, 0.6), (0.3, 1.9))))
    plan = symkin.plan(robot, 60, design="mechanism", candidates=500, seed=1)
    for seed in range(8):
        taken = symkin.simulate(robot, plan, seed, observe="distance").measurements
        found = symkin.identify(robot, taken, loss="huber", prior="tolerances", frames=["anchors"])
        assert not found.doubts, seed


def test_temperatures_that_are_all_the_same_say_nothing_of_growth(paper, sound):
    taken = sound.measurements
    same = dataclasses.replace(taken, temperatures=np.full(len(taken), 21.0))
    with pytest.raises(SymkinError, match="always the same"):
        covariates_of(paper, same, growth=True)


def test_files_and_the_command_line_say_it_too(tmp_path, monkeypatch, capsys, plan):
    monkeypatch.chdir(tmp_path)
    plan.save("plan.csv")
    text = (symkin.load_mechanism("3RRR").source).read_text(encoding="utf-8")
    said = '\n[identification]\ndrift = ["leg"]\nstep = ["20"]\ngrowth = true\nbacklash = true\n'
    (tmp_path / "mine.toml").write_text(text + said, encoding="utf-8")
    change = ["--changes", "leg2.drift=1 mrad", "--seed", "1"]
    assert not main(["simulate", "3RRR", "--plan", "plan.csv", "--out", "taken", *change])
    assert not main(["identify", "3RRR", "taken/measurements.csv"])
    assert "identify with --drift leg" in " ".join(capsys.readouterr().out.split())
    asked = ["--drift", "leg", "--step", "20", "--growth", "--backlash"]
    measured = "taken/measurements.csv"
    assert not main(["identify", "3RRR", measured, *asked, "--out", "one", "--no-report"])
    assert not main(["identify", "mine.toml", measured, "--out", "other", "--no-report"])
    one, other = (symkin.read_estimate(each) for each in ("one", "other"))
    assert one.names == other.names
    assert {"leg2.drift", "leg1.step20", "growth", "leg3.backlash"} <= {*one.names}
    drift = one.params["leg2.drift"]
    assert abs(drift.value - 1e-3) < 4 * drift.deviation < 1e-3


def test_circumstances_are_written_and_read_back(tmp_path, paper, sound):
    taken = sound.measurements
    full = dataclasses.replace(
        taken,
        times=np.arange(len(taken)) * 20.0,
        temperatures=np.linspace(20, 25, len(taken)),
        approaches=last_moves(paper, taken),
    )
    full.save(tmp_path / "taken.csv", paper)
    back = symkin.read_measurements(tmp_path / "taken.csv", paper)
    for name in ("times", "temperatures", "approaches"):
        np.testing.assert_array_equal(getattr(back, name), getattr(full, name))
    assert back.unread == ()
    assert len(back[:5].times) == 5


def test_one_column_of_approach_is_of_all_legs_and_an_empty_cell_is_refused(paper, sound):
    table = dict(sound.measurements.columns(paper))
    count = len(sound.measurements)
    read = symkin.read_measurements({**table, "approach": np.ones(count)}, paper)
    np.testing.assert_array_equal(read.approaches, np.ones((count, 3)))
    with pytest.raises(SymkinError, match="approach_2"):
        symkin.read_measurements({**table, "approach_1": np.ones(count)}, paper)
    with pytest.raises(SymkinError, match="expected -1, 0, 1"):
        symkin.read_measurements({**table, "approach": np.full(count, 2.0)}, paper)
    times = np.arange(count, dtype=float)
    times[3] = np.nan
    with pytest.raises(SymkinError, match="time_s"):
        symkin.read_measurements({**table, "time_s": times}, paper)


def test_a_plan_there_and_back_shows_a_drift_and_counts_it(paper, plan):
    short = symkin.plan(paper, 40, design="mechanism", candidates=2000, seed=1, visit="travel")
    assert short.drift_shown < 0.7 < 0.94 < plan.drift_shown
    assert 1.3 < plan.travel / short.travel < 2.2
    with_drift = [
        symkin.predict_accuracy(paper, each, plan.candidates, "joint", drift=["leg"]).position
        / symkin.predict_accuracy(paper, each, plan.candidates, "joint").position
        for each in (plan, short)
    ]
    assert with_drift[0] < 1.02 < 1.05 < with_drift[1]


def test_a_plan_promises_the_deviations_that_are_found(paper):
    asked = {"drift": ["leg"], "step": ["15"], "growth": True, "backlash": True}
    plan = symkin.plan(paper, 40, candidates=2000, seed=1, **asked)
    assert plan.drift_shown is None
    taken = symkin.simulate(paper, plan, 1, actual=paper).measurements
    found = symkin.identify(paper, taken, **asked)
    promised = {each.name: each.deviation for each in plan.unknowns}
    for name in ("leg1.drift", "leg2.step15", "growth", "leg3.backlash"):
        known = np.sqrt(found.covariance[found.names.index(name), found.names.index(name)])
        assert promised[name] == pytest.approx(known, rel=0.05)
