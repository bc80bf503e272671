# SPDX-License-Identifier: MIT
"""Mistakes are recognised by refits, and nothing is proposed for sound data."""

import math
from dataclasses import replace

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.errors import FailedFitError
from symkin.estimate import corrections, problem
from symkin.estimate.corrections import hypotheses_of, in_modes
from symkin.estimate.doubts import unexplained_rows
from symkin.estimate.options import EstimateOptions
from symkin.model.settings import Frames, NoiseSettings

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
        return (str(error),)


MISTAKES = [
    (of_leg(1, np.negative), "the readings of leg 2 have the opposite sign"),
    (lambda m: replace(m, readings=-m.readings), "readings of legs 1, 2, 3 have the opposite sign"),
    (exchanged, "the readings of legs 1, 2 are in the columns of legs 2, 1"),
    (of_leg(0, np.degrees), "the readings of leg 1 look like degrees that were stated as radians"),
    (of_leg(0, lambda r: 1.2 * r), "the readings of leg 1 grow 1.2 times as fast"),
    (of_leg(2, lambda r: r + math.pi), "the sensor of leg 3 was set to zero half a turn off"),
    (of_leg(2, lambda r: r + 2 * math.pi), "leg 3: all readings are a whole turn away"),
    (in_millimetres, "lengths that were observed are millimetres, not metres"),
    (lambda m: replace(m, poses=m.poses * [1, -1, 1]), "in the measured poses y is mirrored"),
]


@pytest.mark.parametrize(("mistake", "words"), MISTAKES, ids=[words for _, words in MISTAKES])
def test_a_mistake_in_positions_is_named_with_its_evidence(paper, plan, mistake, words):
    (said,) = said_of(paper, mistake(measured(paper, plan, POSITIONS)))
    assert words in said
    assert ", or as well: " not in said


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (of_leg(1, np.negative), "the readings of leg 2 have the opposite sign"),
        (of_leg(0, np.degrees), "the readings of leg 1 look like degrees"),
    ],
    ids=["sign", "unit"],
)
def test_a_mistake_is_named_where_the_frames_are_unknown(paper, plan, mistake, words):
    taken = mistake(measured(paper, plan, TRACKER))
    assert words in said_of(paper, taken, frames=["base", "target"])[0]


def test_legs_that_a_turned_frame_makes_alike_are_all_named(paper, plan):
    taken = exchanged(measured(paper, plan, TRACKER))
    (said,) = said_of(paper, taken, frames=["base", "target"])
    for pair in ("legs 1, 2 are", "legs 2, 3 are", "legs 1, 3 are"):
        assert pair in said


def test_legs_in_another_working_mode_are_named(paper):
    (robot, *_) = in_modes(paper, [1, -1, -1])
    taken = measured(robot, robot.plan(9, seed=3), POSITIONS)
    assert "leg 1 stands in working mode +1: set working_mode = 1" in said_of(paper, taken)[0]


def test_a_frame_that_nobody_mentioned_is_found_from_positions(paper, plan):
    taken = measured(paper, plan, Observed("position", base=(0.3, -0.2, 0.5)))
    (said,) = said_of(paper, taken)
    assert "shifted by about (30" in said
    assert "--frames base --frames target --fixed target.phi" in said


def test_a_turned_hexapod_drum_is_named():
    quiet = NoiseSettings(1e-4, 1e-4, 5e-4)
    hexapod = symkin.load_mechanism("hexapod_jugglebot").replace(noise=quiet)
    taken = of_leg(4, np.negative)(measured(hexapod, hexapod.plan(9, seed=3), POSITIONS))
    assert "the readings of leg 5 have the opposite sign" in said_of(hexapod, taken)[0]


@pytest.fixture(scope="module")
def missing(paper):
    """Positions of sound robots with readings missing: a function of the seed."""
    plan = symkin.make_plan(paper, symkin.sample_workspace(paper, 3000, seed=1), 20)
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
    assert "the readings of legs 1, 2 have the opposite sign" in said


@pytest.mark.parametrize(
    ("observed", "least"),
    [(Observed("position"), 5), (Observed("distance", anchors=((2.0, 1.0),)), 10)],
    ids=["two of a pose to spare", "one"],
)
def test_a_first_look_has_enough_to_judge_by(monkeypatch, observed, least):
    """Of five degrees of freedom chi-square is far too small by chance in one of a hundred."""
    arm = symkin.load_mechanism("5bar").replace(frames=Frames(anchors=((2.0, 1.0),)))
    plan = symkin.make_plan(arm, symkin.sample_workspace(arm, 3000, seed=1), 30)
    taken = of_leg(0, np.negative)(measured(arm, plan, observed))
    looks, some = [], corrections._Correction.some

    def noted(correction, most):
        looks.append(most)
        return some(correction, most)

    monkeypatch.setattr(corrections._Correction, "some", noted)
    tried = hypotheses_of(arm, taken, EstimateOptions())
    assert "the readings of leg 1 have the opposite sign" in tried[0].what
    assert min(looks) == least


def test_two_mistakes_at_once_are_named_in_the_order_of_their_correction(paper, plan):
    """The sign is of the leg, not of the column that its readings stand in."""
    taken = exchanged(of_leg(0, np.negative)(measured(paper, plan, POSITIONS)))
    (said,) = said_of(paper, taken)
    assert (
        "the readings of legs 1, 2 are in the columns of legs 2, 1; with that corrected, "
        "the readings of leg 1 have the opposite sign" in said
    )
    assert ", or as well: " not in said


def test_what_a_correction_leaves_is_looked_for_with_that_correction(paper, plan):
    """Of lengths a thousand times too large anything else is a small part."""
    framed = measured(paper, plan, Observed("position", base=(0.03, -0.02, 0.05)))
    (said,) = said_of(paper, in_millimetres(framed))
    assert said.startswith("likely cause: lengths that were observed are millimetres")
    assert "; with that corrected, the frame of the measurements is not the drawing's" in said


def test_a_leg_of_a_five_bar_in_the_other_working_mode_is_named():
    arm = symkin.load_mechanism("5bar")
    (robot,) = in_modes(arm, [1, 1])
    sample = symkin.sample_workspace(robot, 3000, seed=1)
    plan = symkin.make_plan(robot, sample, 30, symmetry=False)
    taken = measured(robot, plan, Observed("position", base=(1.0, -0.5, 3.0)))
    (said,) = said_of(arm, taken, frames=["base"])
    assert "leg 1 stands in working mode +1: set working_mode = 1" in said


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
    assert any("the frame of the measurements is not" in each.what for each in tried)
    assert not any(each.proposed for each in tried)


def test_a_correction_that_leaves_more_than_noise_is_a_part_of_what_is_wrong(paper, plan):
    taken = of_leg(1, np.negative)(measured(paper, plan, POSITIONS))
    noise = 3e-4 * np.random.default_rng(1).standard_normal(taken.poses.shape)
    (said,) = said_of(paper, replace(taken, poses=taken.poses + noise))
    assert said.startswith("part of what is wrong may be: the readings of leg 2 have the opposite")
    assert said.endswith("; that is more than the noise explains)")


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


def test_two_corrections_that_leave_much_are_not_proposed():
    """Of a thousand pairs some are a thousand times less bad than readings out of all order."""
    arm = symkin.load_mechanism("5bar")
    plan = symkin.make_plan(arm, symkin.sample_workspace(arm, 3000, seed=1), 30)
    taken = measured(arm, plan, Observed("position", base=(1.0, -0.5, 3.0)), seed=1000)
    shuffled = of_leg(0, np.random.default_rng(0).permutation)(taken)
    found = symkin.identify(arm, shuffled, frames=["base"], max_iterations=40)
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
        assert not any("millimetres" in doubt for doubt in found.doubts)
