# SPDX-License-Identifier: MIT
"""Robust losses from Python; what they compute is tested in C++."""

import dataclasses
from typing import get_args

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.estimate.options import Loss
from symkin.model.settings import Frames


@pytest.fixture(scope="module")
def simulated(paper):
    candidates = symkin.sample_workspace(paper, 2000, seed=1)
    return symkin.simulate(paper, symkin.make_plan(paper, candidates, 16), seed=1)


def test_every_loss_of_the_core_has_its_name_here():
    assert tuple(each for each in get_args(Loss) if each != "robust") == tuple(_core.loss_names())


def test_deviations_with_a_loss_follow_students_t(paper, simulated):
    measured = simulated.measurements.for_all_legs()
    found = symkin.identify(paper, measured, loss="cauchy")
    plain = symkin.identify(paper, measured)
    for leg in found.legs:
        assert leg.student_degrees == len(measured.poses) - 8
        assert leg.interval == pytest.approx(2.021, abs=1e-3)
    assert plain.legs[0].interval == pytest.approx(1.95996, abs=1e-5)
    assert found.trustworthy
    np.testing.assert_allclose(found.deviations, plain.deviations, rtol=0.5)


@pytest.mark.parametrize("estimator", ["implicit", "joint"])
def test_a_loss_is_refused_where_a_pose_decides_too_much(paper, simulated, estimator):
    few = simulated.measurements.for_all_legs().subset(np.arange(10))
    with pytest.raises(symkin.SymkinError, match=r"gross error at pose \d+.*measure 14 poses more"):
        symkin.identify(paper, few, estimator, loss="tukey")


def test_a_note_names_the_pose_at_which_a_gross_error_would_not_be_seen(paper, simulated):
    measured = simulated.measurements.for_all_legs()
    for count in range(16, 30):
        try:
            found = symkin.identify(paper, measured.subset(np.arange(count)), loss="cauchy")
        except symkin.SymkinError:
            continue
        unguarded = sorted({row for leg in found.legs for row in leg.unguarded})
        notes = [note for note in found.notes if note.code == "rows-unguarded"]
        assert len(notes) == bool(unguarded)
        if unguarded:
            assert notes[0].rows == tuple(measured.row_numbers[unguarded])
            return
    pytest.fail("every fit was refused, or none left a pose to doubt")


def test_a_loss_that_rejects_more_rows_than_there_are_unknowns_is_doubted(paper, simulated):
    measured = simulated.measurements.for_all_legs()
    poses = np.array(measured.poses)
    poses[1:, :2] -= 0.01 * np.diff(poses[:, :2], axis=0)  # a device that lags behind
    found = symkin.identify(paper, symkin.Measurements.of(poses, measured.readings), loss="robust")
    assert len({row for row, _ in found.rejected}) > len(poses) - 24 / 3
    assert "many-rejected" in {doubt.code for doubt in found.doubts}


@pytest.mark.parametrize("observed", ["pose", "position"])
def test_chi_square_says_at_how_many_poses_the_loss_rejected_something(paper, simulated, observed):
    measured = simulated.measurements.for_all_legs()
    poses, readings = np.array(measured.poses), np.array(measured.readings)
    readings[3] += 0.1, -0.1, 0.1
    if observed == "position":
        poses[:, 2] = np.nan
    spoilt = symkin.Measurements.of(poses, readings)
    found = symkin.identify(paper, spoilt, loss="cauchy")
    rows = {row for row, _ in found.rejected} | set(found.aside)
    assert 3 in rows
    (line,) = (each for each in found.summary().headlines if each[0].startswith("Chi-square"))
    count = "1 pose" if len(rows) == 1 else f"{len(rows)} poses"
    assert line[2].endswith(f"for sound robots; without what was rejected at {count}")


@pytest.mark.parametrize("loss", ["huber", "cauchy", "tukey"])
def test_poses_with_many_points_are_kept_by_a_loss(loss):
    places = ((0.05, 0.0, 0.0), (0.0, 0.05, 0.0), (0.0, 0.0, 0.05))
    robot = symkin.load_mechanism("3RPS").replace(frames=Frames(points=places))
    plan = symkin.plan(robot, 60, design="mechanism", candidates=500, seed=1)
    taken = symkin.simulate(robot, plan, 3, observe=("pose", "points")).measurements
    found = symkin.identify(robot, taken, loss=loss, frames=["points"])
    assert found.trustworthy, found.doubts
    assert len(found.rejected) < 0.4 * len(taken)
    plain = symkin.identify(robot, taken, frames=["points"])
    assert found.degrees_of_freedom > plain.degrees_of_freedom / 2


def test_rows_that_a_loss_leaves_where_they_nearly_say_nothing_are_not_unlike():
    robot = symkin.load_mechanism("hexa").replace(frames=Frames(plane=(0.01, 0.0, 0.0)))
    plan = symkin.plan(robot, 60, design="mechanism", candidates=500, seed=1)
    unknown = {"prior": "tolerances", "frames": ["plane"]}
    for seed in range(5000, 5006):
        taken = symkin.simulate(robot, plan, seed, observe=("height", "separation")).measurements
        found = symkin.identify(robot, taken, loss="huber", **unknown)
        assert not found.doubts, seed


def test_rows_of_sound_robots_are_not_unlike_the_others_where_a_loss_weighs_them_less(paper):
    plan = symkin.plan(paper, 24, seed=1)
    for seed in range(40):
        taken = symkin.simulate(paper, plan, seed).measurements.for_all_legs()
        found = symkin.identify(paper, taken, loss="huber", prior="tolerances")
        assert not found.doubts, seed


def test_what_single_readings_that_are_left_out_do_not_show_is_not_doubted():
    robot = symkin.load_mechanism("rotary_delta")
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 3000, seed=1), 30, seed=1)
    taken = symkin.simulate(robot, plan, 0).measurements.for_all_legs()
    readings = np.array(taken.readings)
    readings[[57, 75], 0] += 100 * robot.noise.reading
    wrong = dataclasses.replace(taken, readings=readings)
    found = symkin.identify(robot, wrong, loss_per="reading", prior="tolerances")
    assert found.rejected == ((57, "reading of leg 1"), (75, "reading of leg 1"))
    assert not found.doubts  # they are taken for a platform that sags, where they count
    influence = found.influence
    assert influence is not None
    # Their other observations are used.
    assert np.isfinite(influence.residual).all()


def test_a_row_that_is_left_out_of_what_single_errors_leave_is_no_doubt():
    robot = symkin.load_mechanism("rotary_delta").replace(frames=Frames(plane=(0.01, 0, 0)))
    sample = symkin.sample_workspace(robot, 500, seed=1)
    plan = symkin.make_plan(robot, sample, 60, design="mechanism")
    taken = symkin.simulate(robot, plan, 0, observe="height").measurements.for_all_legs()
    readings = np.array(taken.readings)
    readings[12, 2] -= 0.02
    wrong = dataclasses.replace(taken, readings=readings)
    asked = {"prior": "tolerances", "frames": ["plane"]}
    found = symkin.identify(robot, wrong, loss_per="reading", **asked)
    # Its height, or one of its readings: nothing tells which, and a reading is seldom typed.
    assert found.rejected == ((12, "height"),)
    assert not found.doubts


def test_a_wrong_height_is_left_out_alone():
    robot = symkin.load_mechanism("rotary_delta").replace(frames=Frames(plane=(0.01, 0, 0)))
    plan = symkin.plan(robot, 24, seed=1)
    kinds = ("position", "height")
    taken = symkin.simulate(robot, plan, 0, observe=kinds).measurements.for_all_legs()
    heights = np.array(taken.heights)
    heights[7] += 0.005
    wrong = dataclasses.replace(taken, heights=heights)
    asked = {"prior": "tolerances", "frames": ["plane"]}
    found = symkin.identify(robot, wrong, loss_per="reading", **asked)
    assert found.rejected == ((7, "height"),)
    assert not found.doubts
