# SPDX-License-Identifier: MIT
"""Mistakes are recognised by refits, and nothing is proposed for sound data."""

import math
from dataclasses import replace

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.errors import FailedFitError
from symkin.estimate import problem
from symkin.estimate.evidence.corrections import Budget, hypotheses_of
from symkin.estimate.evidence.edits import in_modes
from symkin.estimate.evidence.fit_checks import unexplained_rows
from symkin.estimate.evidence.trial import Correction
from symkin.estimate.evidence.watching import watched_search
from symkin.estimate.options import EstimateOptions
from symkin.model.settings import Frames, NoiseSettings
from symkin.present import asked_by

POSITIONS = Observed("position")
TRACKER = Observed("pose", base=(1.0, -0.5, 3.0), target=(0.05, 0.0, 0.17))


@pytest.fixture(scope="module")
def paper():
    return symkin.load_mechanism("3RRR")


@pytest.fixture(scope="module")
def plan(paper):
    return paper.plan(9, seed=3)


def measured(robot, plan, observe, seed=2):
    return symkin.simulate(robot, plan, seed=seed, observe=observe).measurements.for_all_legs()


def of_leg(leg, change):
    def changed(taken):
        readings = np.array(taken.readings)
        readings[:, leg] = change(readings[:, leg])
        return replace(taken, readings=readings)

    return changed


def exchanged(taken):
    return replace(taken, readings=taken.readings[:, [1, 0, 2]])


def in_millimetres(taken):
    return replace(taken, poses=taken.poses * [1e3, 1e3, 1])


def said_of(mechanism, taken, **options):
    try:
        return symkin.identify(mechanism, taken, max_iterations=40, **options).doubts[:1]
    except symkin.SymkinError as error:
        return (error.likely_cause,)


def told(doubt):
    """Code and legs of a cause, and of what else is wrong with that corrected."""
    return [(each.code, tuple(leg + 1 for leg in each.legs)) for each in (doubt, *doubt.then)]


def late(legs, rows):
    def changed(taken):
        readings = np.array(taken.readings)
        readings[:, legs] = np.roll(readings[:, legs], rows, axis=0)
        kept = np.arange(rows, len(readings))
        return replace(taken, readings=readings).subset(kept)

    return changed


def half_in_millimetres(taken):
    poses = np.array(taken.poses)
    poses[::2, :2] *= 1e3
    return replace(taken, poses=poses)


MISTAKES = {
    "sign": (of_leg(1, np.negative), "opposite-sign", (2,)),
    "signs": (lambda m: replace(m, readings=-m.readings), "opposite-sign", (1, 2, 3)),
    "order": (exchanged, "columns-exchanged", (1, 2)),
    "unit": (of_leg(0, np.degrees), "unit-of-readings", (1,)),
    "gain": (of_leg(0, lambda r: 1.2 * r), "gain", (1,)),
    "half a turn": (of_leg(2, lambda r: r + math.pi), "zero-half-a-turn-off", (3,)),
    "a turn": (of_leg(2, lambda r: r + 2 * math.pi), "turns-away", (3,)),
    "millimetres": (in_millimetres, "unit-of-lengths", ()),
    "late": (late((0, 1, 2), 1), "rows-shifted", (1, 2, 3)),
    "one leg late": (late((1,), 2), "rows-shifted", (2,)),
    "exchanged": (lambda m: replace(m, poses=m.poses[:, [1, 0, 2]]), "convention-of-poses", ()),
    "block": (half_in_millimetres, "rows-in-another-unit", ()),
    "mirror": (lambda m: replace(m, poses=m.poses * [1, -1, 1]), "convention-of-poses", ()),
}


@pytest.mark.parametrize(("mistake", "code", "legs"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_in_positions_is_named_with_its_evidence(paper, plan, mistake, code, legs):
    (said,) = said_of(paper, mistake(measured(paper, plan, POSITIONS)))
    assert told(said) == [(code, legs)]
    assert not said.others
    if code == "gain":
        assert said.size == pytest.approx(1.2, rel=1e-2)


def test_what_was_sorted_by_itself_is_put_to_its_rows_by_positions(paper, plan):
    taken = measured(paper, plan, POSITIONS)
    order = np.argsort(taken.poses[:, 0])
    readings = np.array(taken.readings)
    readings[:, 1] = np.sort(readings[:, 1])
    of_poses = replace(taken, poses=taken.poses[order])
    of_a_leg = replace(taken, readings=readings)
    for wrong, legs, meant in (
        (of_poses, (), taken.readings[order]),
        (of_a_leg, (2,), taken.readings),
    ):
        tried = hypotheses_of(paper, wrong, EstimateOptions("joint"))
        assert told(tried[0].cause) == [("rows-out-of-order", legs)]
        np.testing.assert_array_equal(tried[0].table.readings, meant)


def of_points(change):
    return lambda taken: replace(taken, points=change(np.array(taken.points)))


def later_in_millimetres(points):
    points[len(points) // 2 :] *= 1e3
    return points


OF_POINTS = {
    "sign": MISTAKES["sign"],
    "unit": MISTAKES["unit"],
    "inches": (of_points(lambda p: p / 0.0254), "unit-of-lengths", ()),
    "inches in columns of millimetres": (of_points(lambda p: p / 25.4), "unit-of-lengths", ()),
    "block": (of_points(later_in_millimetres), "rows-in-another-unit", ()),
    "mirror": (of_points(lambda p: p[..., [1, 0]]), "convention-of-poses", ()),
}


@pytest.mark.parametrize(("mistake", "code", "legs"), OF_POINTS.values(), ids=OF_POINTS)
def test_a_mistake_is_named_where_reflectors_are_somewhere(paper, plan, mistake, code, legs):
    seen = Observed("points", base=(1.0, -0.5, 3.0), points=((0.1, 0.0), (-0.1, 0.05)))
    taken = measured(paper, plan, seen)
    wrong = mistake(taken)
    (said,) = said_of(paper, wrong)
    assert told(said) == [(code, legs)]
    table = hypotheses_of(paper, wrong, EstimateOptions(frames=("base",)))[0].table
    if code == "convention-of-poses":
        assert said.figures["do"] == "negate the columns of y of all points"
        assert table is None
    else:
        np.testing.assert_allclose(table.points, taken.points)
        np.testing.assert_allclose(table.readings, taken.readings)


def test_mirrored_axes_and_exchanged_legs_that_do_the_same_are_named_together():
    delta = symkin.load_mechanism("rotary_delta")
    sample = symkin.sample_workspace(delta, 500, seed=1)
    seen = Observed("position", base=(1.0, -0.5, 0.3, 0.0, 0.0, 3.0))
    taken = exchanged(measured(delta, symkin.make_plan(delta, sample, 30, visit="sets"), seen))
    (said,) = said_of(delta, taken, frames=["base"])
    every = [said, *said.others]
    assert not any(each.then for each in every)
    assert {each.legs for each in every} == {(), (0, 1), (1, 2), (0, 2)}
    assert {each.code for each in every} == {"columns-exchanged", "convention-of-poses"}


def test_gross_errors_are_named_where_everything_is_estimated_together(paper, plan):
    taken = measured(paper, plan, TRACKER)
    readings = np.array(taken.readings)
    readings[[3, 9, 14], 1] = 0.0  # an encoder that drops out
    framed = {"frames": ["base", "target"]}
    wrong = replace(taken, readings=readings)
    (said,) = symkin.identify(paper, wrong, **framed).doubts
    assert (said.code, said.rows) == ("gross-errors", (5, 11, 16))
    assert "each in the reading of leg 2" in said.cause
    assert said.options == {"loss": "cauchy", "loss_per": "reading"}
    followed, sound = (
        symkin.identify(paper, each, **framed, **asked)
        for each, asked in ((wrong, said.options), (taken, {}))
    )
    assert followed.converged
    assert not followed.unexplained
    off = followed.mechanism.parameters - sound.mechanism.parameters
    assert np.nanmax(np.abs(off / followed.deviations)) < 2


def test_heights_are_not_told_to_be_in_a_unit_in_which_all_of_them_are_noise():
    delta = symkin.load_mechanism("linear_delta")
    points = delta.plan(36, observe="height", seed=1)
    taken = symkin.simulate(delta, points, seed=1, observe="height").measurements
    order = np.argsort(taken.readings[:, 0])
    wrong = replace(taken, readings=taken.readings[order])
    assert "unit-of-lengths" not in {each.code for each in symkin.identify(delta, wrong).doubts}
    lost = replace(taken, readings=taken.readings * [-1, 1, 1])
    with pytest.raises(symkin.SymkinError, match="can take none of the readings") as refused:
        symkin.identify(delta, lost, bow="0.2 mm")
    assert refused.value.likely_cause.code == "opposite-sign"


def test_axes_are_told_to_be_mirrored_once_where_the_frames_are_unknown(paper, plan):
    taken = measured(paper, plan, TRACKER)
    mirrored = replace(taken, poses=taken.poses * [1, -1, -1])
    (said,) = said_of(paper, mirrored, frames=["base", "target"])
    assert said.code == "convention-of-poses"
    assert "or another axis" in said.figures["convention"]
    assert all(each.code != said.code for each in said.others)


@pytest.mark.parametrize(
    ("mistake", "code", "legs"),
    [MISTAKES["sign"], MISTAKES["unit"], MISTAKES["block"]],
    ids=["sign", "unit", "block"],
)
def test_a_mistake_is_named_where_the_frames_are_unknown(paper, plan, mistake, code, legs):
    taken = mistake(measured(paper, plan, TRACKER))
    (said,) = said_of(paper, taken, frames=["base", "target"])
    assert told(said) == [(code, legs)]


def test_legs_that_a_turned_frame_makes_alike_are_all_named(paper, plan):
    taken = exchanged(measured(paper, plan, TRACKER))
    (said,) = said_of(paper, taken, frames=["base", "target"])
    assert {each.legs for each in (said, *said.others)} == {(0, 1), (1, 2), (0, 2)}
    assert {each.code for each in (said, *said.others)} == {"columns-exchanged"}


def test_a_zero_half_a_turn_off_is_corrected_in_the_drawing_unless_turns_are_missing_then(
    paper, plan
):
    sound = measured(paper, plan, POSITIONS)
    of_sound = symkin.identify(paper, sound).params
    for half, redrawn in ((math.pi, False), (-math.pi, True)):
        taken = of_leg(2, lambda r, half=half: r + half)(sound)
        with pytest.raises(FailedFitError) as refused:
            symkin.identify(paper, taken)
        drawing, table = refused.value.redrawn, refused.value.corrected
        assert [drawing is not None, table is not None] == [redrawn, not redrawn]
        again = symkin.identify(drawing or paper, table or taken)
        assert again.trustworthy
        # Not the same to the last digit: a zero's tolerance holds where the zero is.
        turned = math.pi if redrawn else 0
        change = again.params["leg3.sensor_offset"].value - of_sound["leg3.sensor_offset"].value
        assert change == pytest.approx(turned, abs=4e-3)


def test_legs_in_another_working_mode_are_named(paper):
    (robot, *_) = in_modes(paper, [1, -1, -1])
    taken = measured(robot, robot.plan(9, seed=3), POSITIONS)
    (said,) = said_of(paper, taken)
    assert told(said) == [("working-mode", (1,))]
    assert "leg 1 stands in working mode +1: set working_mode = 1" in said.cause


def test_a_frame_that_nobody_mentioned_is_found_from_positions(paper, plan):
    taken = measured(paper, plan, Observed("position", base=(0.3, -0.2, 0.5)))
    (said,) = said_of(paper, taken)
    assert told(said) == [("frame-not-as-drawn", ())]
    assert "shifted by about (30" in said.cause
    assert said.options == {"frames": ("base",)}
    assert 'identify with frames=["base"]' in str(said)
    with asked_by("command"):
        assert "identify with --frames base" in str(said)


def test_a_turned_hexapod_drum_is_named():
    quiet = NoiseSettings(1e-4, 1e-4, 5e-4)
    hexapod = symkin.load_mechanism("hexapod_jugglebot").replace(noise=quiet)
    taken = of_leg(4, np.negative)(measured(hexapod, hexapod.plan(9, seed=3), POSITIONS))
    assert told(said_of(hexapod, taken)[0]) == [("opposite-sign", (5,))]


@pytest.fixture(scope="module")
def missing(paper):
    """Positions of sound robots with readings missing: a function of the seed."""
    sample = symkin.sample_workspace(paper, 3000, seed=1)
    plan = symkin.make_plan(paper, sample, 20, visit="sets")
    return lambda seed: measured(paper, plan, Observed("position", missing=0.2), seed)


def test_a_pose_that_never_comes_to_rest_is_set_aside(paper, missing):
    found = symkin.identify(paper, missing(1082))
    assert found.trustworthy
    assert found.aside == (2, 22)
    assert unexplained_rows(found) == []


def test_a_pose_on_the_wrong_side_of_a_fold_is_taken_in_again(paper, missing):
    found = symkin.identify(paper, missing(1234))
    assert found.trustworthy
    assert found.aside == ()
    assert found.chi_square < 95


def test_a_pose_with_a_start_of_its_own_is_set_aside_too():
    """Of a trial that is stuck: without observations it must not stay where it started."""
    arm = symkin.load_mechanism("5bar").replace(frames=Frames(anchors=((2.0, 1.0),)))
    plan = symkin.make_plan(arm, symkin.sample_workspace(arm, 3000, seed=1), 30)
    taken = measured(arm, plan, Observed("distance", anchors=((2.0, 1.0),)), seed=1000)
    (said,) = said_of(arm, replace(taken, readings=-taken.readings))
    assert told(said) == [("opposite-sign", (1, 2))]


@pytest.mark.parametrize(
    ("name", "observed", "least"),
    [
        ("3RRR", Observed("position"), 5),
        ("5bar", Observed("distance", anchors=((2.0, 1.0),)), 10),
    ],
    ids=["two of a pose to spare", "one"],
)
def test_a_first_look_has_enough_to_judge_by(monkeypatch, name, observed, least):
    """Of five degrees of freedom chi-square is far too small by chance in one of a hundred."""
    arm = symkin.load_mechanism(name).replace(frames=Frames(anchors=((2.0, 1.0),)))
    plan = symkin.make_plan(arm, symkin.sample_workspace(arm, 3000, seed=1), 30)
    taken = of_leg(0, np.negative)(measured(arm, plan, observed))
    looks, some = [], Correction.some

    def noted(correction, most):
        looks.append(most)
        return some(correction, most)

    monkeypatch.setattr(Correction, "some", noted)
    tried = hypotheses_of(arm, taken, EstimateOptions())
    assert told(tried[0].cause) == [("opposite-sign", (1,))]
    assert min(looks) == least


def test_a_watched_search_that_is_interrupted_keeps_the_estimate(paper, plan, monkeypatch):
    sound = symkin.simulate(paper, plan, seed=3).measurements
    wrong = replace(sound, readings=sound.readings * [1, -1, 1])
    counted = []

    def interrupt(count):
        counted.append(count)
        if count == 3:
            raise KeyboardInterrupt

    with watched_search(interrupt):
        found = symkin.identify(paper, wrong)
        assert [each.is_cause for each in found.doubts][:2] == [False, False]
    assert counted == [1, 2, 3]
    assert found.doubts[0].code == "search-ended"
    assert [each.code for each in symkin.identify(paper, wrong).doubts] == ["opposite-sign"]

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("symkin.estimate.evidence.examine.tests_of", interrupted)
    with watched_search(lambda _: None):
        found = symkin.identify(paper, sound)
        assert [each.code for each in found.doubts] == ["tests-ended"]
    monkeypatch.undo()
    monkeypatch.setattr(Correction, "fit", interrupted)
    with pytest.raises(KeyboardInterrupt):  # since nobody watches, it is the script's
        _ = symkin.identify(paper, wrong).doubts


def test_two_mistakes_at_once_are_named_in_the_order_of_their_correction(paper, plan):
    """The sign is of the leg, not of the column that its readings stand in."""
    taken = exchanged(of_leg(0, np.negative)(measured(paper, plan, POSITIONS)))
    (said,) = said_of(paper, taken)
    assert told(said) == [("columns-exchanged", (1, 2)), ("opposite-sign", (1,))]
    assert not said.others


def test_what_a_correction_leaves_is_looked_for_with_that_correction(paper, plan):
    """Of lengths a thousand times too large anything else is a small part."""
    framed = measured(paper, plan, Observed("position", base=(0.03, -0.02, 0.05)))
    (said,) = said_of(paper, in_millimetres(framed))
    assert told(said) == [("unit-of-lengths", ()), ("frame-not-as-drawn", ())]


def test_a_leg_of_a_five_bar_in_the_other_working_mode_is_named():
    arm = symkin.load_mechanism("5bar")
    (robot,) = in_modes(arm, [1, 1])
    sample = symkin.sample_workspace(robot, 3000, seed=1)
    plan = symkin.make_plan(robot, sample, 30, symmetry=False)
    taken = measured(robot, plan, Observed("position", base=(1.0, -0.5, 3.0)))
    (said,) = said_of(arm, taken, frames=["base"])
    assert told(said) == [("working-mode", (1,))]


def test_a_solver_that_stands_still_is_no_evidence_of_a_mistake(paper, missing, monkeypatch):
    monkeypatch.setattr(problem, "_FEW", 0)
    found = symkin.identify(paper, missing(1082))
    assert "no step lowers the cost" in found.failure
    assert not any(each.proposed for each in found.hypotheses)
    (stated,) = (each for each in found.hypotheses if not each.what)
    assert stated.explained


def test_what_is_stated_has_a_second_start_where_a_correction_ended(paper, plan, monkeypatch):
    """Unknown frames explain all that a sound robot shows, and would be proposed without."""
    starting_poses = problem._core.starting_poses
    taken = measured(paper, plan, POSITIONS)

    def none_as_stated(mechanism, setup, observations, home):
        poses = starting_poses(mechanism, setup, observations, home)
        return poses if np.any(setup.base.position) else np.full_like(poses, np.nan)

    monkeypatch.setattr(problem._core, "starting_poses", none_as_stated)
    tried = hypotheses_of(paper, taken, EstimateOptions())
    codes = [each.cause.code for each in tried if each.cause is not None]
    assert "frame-not-as-drawn" in codes
    assert not any(each.proposed for each in tried)


def test_a_correction_that_leaves_more_than_noise_is_a_part_of_what_is_wrong(paper, plan):
    taken = of_leg(1, np.negative)(measured(paper, plan, POSITIONS))
    noise = 3e-4 * np.random.default_rng(1).standard_normal(taken.poses.shape)
    (said,) = said_of(paper, replace(taken, poses=taken.poses + noise))
    assert told(said) == [("opposite-sign", (2,))]
    assert str(said).startswith("part of what is wrong may be: ")


def test_sound_measurements_are_not_corrected(paper, plan):
    found = symkin.identify(paper, measured(paper, plan, POSITIONS))
    assert found.doubts == found.hypotheses == ()


def test_what_no_correction_explains_is_left_at_its_symptoms(paper, plan):
    taken = measured(paper, plan, POSITIONS)
    noisy = taken.readings + 0.02 * np.random.default_rng(1).standard_normal(taken.readings.shape)
    found = symkin.identify(paper, replace(taken, readings=noisy))
    assert found.doubts == found.symptoms
    assert not any(each.proposed for each in found.hypotheses)
    assert found.hypotheses[0].per_degree <= found.hypotheses[-1].per_degree


def test_a_gain_so_far_off_that_no_pose_follows_from_the_readings_is_named():
    robot = symkin.load_mechanism("3RPS")
    poses = symkin.sample_workspace(robot, 40, seed=1).poses
    every, readings = np.arange(40), robot.inverse_kinematics(poses)
    own = symkin.Plan(robot, np.full(40, -1), every, every >= 30, poses, readings)
    taken = of_leg(0, lambda r: 2 * r)(measured(robot, own, POSITIONS))
    tried = hypotheses_of(robot, taken, EstimateOptions("joint"))
    assert told(tried[0].cause) == [("gain", (1,))]
    assert tried[0].cause.size == pytest.approx(2, rel=0.02)
    place = robot.parameter_names.index("sensor_gain")
    redrawn = tried[0].drawing.parameters.copy()
    assert redrawn[0, place] == pytest.approx(robot.parameters[0, place] / 2, rel=0.02)
    redrawn[0, place] = robot.parameters[0, place]
    np.testing.assert_array_equal(redrawn, robot.parameters)


def test_noise_that_is_estimated_from_a_mistake_is_told_with_its_cause(paper, plan):
    seen = Observed("points", base=(1.0, -0.5, 3.0), points=((0.1, 0.0), (-0.1, 0.05)))
    taken = of_leg(0, lambda r: 2 * r)(measured(paper, plan, seen))
    found = symkin.identify(paper, taken, frames=["base"], noise="estimate")
    assert not found.converged
    assert told(found.doubts[0]) == [("gain", (1,))]


def test_two_corrections_that_leave_much_are_not_proposed():
    """Of a thousand pairs some are a thousand times less bad than readings out of all order."""
    arm = symkin.load_mechanism("5bar")
    plan = symkin.make_plan(arm, symkin.sample_workspace(arm, 3000, seed=1), 30, visit="sets")
    taken = measured(arm, plan, Observed("position", base=(1.0, -0.5, 3.0)), seed=1000)
    shuffled = of_leg(0, np.random.default_rng(0).permutation)(taken)
    found = symkin.identify(arm, shuffled, frames=["base"], max_iterations=15)
    assert found.doubts == found.symptoms


def test_a_refusal_says_its_likely_cause(paper, plan):
    taken = measured(paper, plan, POSITIONS)
    with pytest.raises(
        FailedFitError, match="Likely cause: the readings of legs 1, 2, 3 look like"
    ):
        symkin.identify(paper, replace(taken, readings=np.degrees(taken.readings)))


def test_a_unit_in_which_the_observations_say_nothing_is_no_explanation():
    """Heights near zero fit the drawing in millimetres, whatever the robot is."""
    delta = symkin.load_mechanism("linear_delta")
    probed = delta.plan(30, observe="height")
    for seed in (1, 2):
        taken = measured(delta, probed, Observed("height"), seed)
        found = symkin.identify(delta, taken, free=["guide_swing", "plane"])
        assert found.doubts
        assert "unit-of-lengths" not in [doubt.code for doubt in found.doubts]


def test_what_is_spent_on_looking_for_a_cause_is_bounded_and_said(paper, plan):
    taken = measured(paper, plan, POSITIONS)
    noisy = taken.readings + 0.02 * np.random.default_rng(1).standard_normal(taken.readings.shape)
    wrong = replace(taken, readings=noisy)
    for budget, spent in ((Budget(), False), (Budget(left=90.0), True)):
        tried = hypotheses_of(paper, wrong, EstimateOptions("joint"), budget=budget)
        assert budget.spent == spent
        assert tried


def test_errors_in_most_rows_are_no_gross_errors():
    """A robust loss finds a few rows that fit, by which a robot of many legs is determined."""
    robot = symkin.load_mechanism("hexa")
    poses = symkin.sample_workspace(robot, 40, seed=1).poses
    every, readings = np.arange(40), robot.inverse_kinematics(poses)
    own = symkin.Plan(robot, np.full(40, -1), every, every < 0, poses, readings)
    rough = np.random.default_rng(2).normal(0, 0.02, 40) * (every >= 24)
    taken = of_leg(0, lambda r: r + rough)(measured(robot, own, None))
    found = symkin.identify(robot, taken, frames=["base", "target"])
    assert found.doubts
    assert "gross-errors" not in {each.code for each in found.doubts}


def sixty_poses(robot):
    return symkin.make_plan(
        robot, symkin.sample_workspace(robot, 500, seed=1), 60, design="mechanism"
    )


def test_two_gross_errors_are_named_without_what_they_make_look_wrong():
    robot = symkin.load_mechanism("3RPS")
    plan = sixty_poses(robot)
    for seed in range(3):
        made = symkin.simulate(robot, plan, seed, observe="separation")
        taken = made.measurements.for_all_legs()
        values = np.array(taken.separations)
        rows = np.flatnonzero(np.isfinite(values).any(axis=1))[[15 + seed, 18 + seed]]
        values[rows] -= 0.004
        wrong = replace(taken, separations=values)
        (said,) = symkin.identify(robot, wrong, prior="tolerances").doubts
        assert said.code == "rows-unlike"
        assert sorted(said.rows) == taken.row_numbers[rows].tolist()


def test_one_wrong_pose_late_in_a_table_is_no_device_that_is_noisier_from_there_on():
    robot = symkin.load_mechanism("3RPS")
    plan = sixty_poses(robot)
    for seed in range(4):
        taken = symkin.simulate(robot, plan, seed).measurements.for_all_legs()
        poses = np.array(taken.poses)
        poses[38 + seed, 0] += 40 * robot.noise.position
        (said,) = symkin.identify(robot, replace(taken, poses=poses)).doubts
        assert (said.code, said.rows) == ("rows-unlike", (int(taken.row_numbers[38 + seed]),))


def test_two_wrong_readings_of_a_hexa_are_not_another_robot_from_there_on():
    robot = symkin.load_mechanism("hexa")
    plan = sixty_poses(robot)
    for seed in range(3):
        taken = symkin.simulate(robot, plan, seed).measurements.for_all_legs()
        readings = np.array(taken.readings)
        rows = [31 + seed, 46 + seed]
        readings[rows, [1, 2]] += 40 * robot.noise.reading
        (said,) = symkin.identify(robot, replace(taken, readings=readings)).doubts
        assert said.code == "rows-unlike"
        assert sorted(said.rows) == taken.row_numbers[rows].tolist()


def test_a_part_of_what_two_wrong_rows_explain_is_not_told_in_their_place(paper):
    plan = paper.plan(24, seed=1)
    for seed in range(4):
        taken = symkin.simulate(paper, plan, seed).measurements
        readings, poses = np.array(taken.readings), np.array(taken.poses)
        readings[29, 1] += 0.02
        poses[69, 0] += 0.001
        wrong = replace(taken, readings=readings, poses=poses)
        (said,) = symkin.identify(paper, wrong, "joint", prior="tolerances").doubts
        assert said.code == "rows-unlike", seed
        assert sorted(said.rows) == taken.row_numbers[[29, 69]].tolist()
