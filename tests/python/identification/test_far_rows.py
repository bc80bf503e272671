# SPDX-License-Identifier: MIT
"""Numbers that were mistyped: their rows are named, whatever they do to the estimate."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.estimate.evidence.far_rows import without_far_rows
from symkin.estimate.evidence.trial import Correction, Statement
from symkin.estimate.options import EstimateOptions

WAYS = {
    "implicit": {},
    "joint": {"estimator": "joint"},
    "prior": {"prior": "tolerances"},
    "frames": {"frames": ["base", "target"]},
}


@pytest.fixture(scope="module", params=["3RRR", "3RPS"])
def robot(request):
    return symkin.load_mechanism(request.param)


@pytest.fixture(scope="module")
def taken(robot):
    return robot.simulate(robot.plan(seed=1), seed=1).measurements


def spoilt(taken, row, column, value, name="poses"):
    values = np.array(getattr(taken, name))
    values[row, column] = value
    return dataclasses.replace(taken, **{name: values})


def cause_of(robot, taken, **asked):
    try:
        return symkin.identify(robot, taken, **asked).doubts[0]
    except symkin.SymkinError as error:
        return error.likely_cause


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("value", [50.0, 5000.0])
def test_a_position_without_its_decimal_point_is_named(robot, taken, way, value):
    cause = cause_of(robot, spoilt(taken, 4, 1, value), **WAYS[way])
    assert (cause.code, cause.rows) == ("rows-far-off", (int(taken.row_numbers[4]),))


@pytest.mark.parametrize("way", WAYS)
def test_a_reading_without_its_decimal_point_is_named(robot, taken, way):
    cause = cause_of(robot, spoilt(taken, 4, 0, 99.0, "readings"), **WAYS[way])
    assert cause.code in ("rows-far-off", "gross-errors")
    assert cause.rows == (int(taken.row_numbers[4]),)


def test_the_number_is_told_with_what_the_drawing_has(robot, taken):
    cause = cause_of(robot, spoilt(taken, 4, 1, 50.0), prior="tolerances")
    place, by_drawing = cause.words.split("(")[1].split(")")[0].split(", by the drawing ")
    assert place == "y: 50"
    assert float(by_drawing) == pytest.approx(taken.poses[4, 1], abs=0.01)
    cause = cause_of(robot, spoilt(taken, 4, 0, 99.0, "readings"), prior="tolerances")
    place, by_drawing = cause.words.split("(")[1].split(")")[0].split(", by the drawing ")
    assert place == "reading of leg 1: 99"
    assert float(by_drawing) == pytest.approx(taken.readings[4, 0], abs=0.01)


def test_without_the_row_the_estimate_is_sound(robot, taken):
    found = symkin.identify(robot, spoilt(taken, 4, 1, 0.5), prior="tolerances")
    assert [doubt.code for doubt in found.doubts] == ["rows-far-off"]
    rest = found.corrected
    assert len(rest) == len(taken) - 1
    assert taken.row_numbers[4] not in rest.row_numbers
    assert symkin.identify(robot, rest, prior="tolerances").trustworthy


def test_it_is_no_row_in_millimetres_where_that_explains_only_a_part():
    hexapod = symkin.load_mechanism("hexapod_jugglebot")
    poses = symkin.sample_workspace(hexapod, 1000, seed=1).poses
    every, none = np.arange(len(poses)), np.zeros(len(poses), dtype=bool)
    readings = hexapod.inverse_kinematics(poses)
    plan = symkin.Plan(hexapod, np.full(len(poses), -1), every, none, poses, readings)
    taken = symkin.simulate(hexapod, plan, 1).measurements
    row = int(np.argmax(np.abs(poses[:, 1])))
    found = symkin.identify(hexapod, spoilt(taken, row, 1, 1000 * taken.poses[row, 1]))
    (doubt,) = found.doubts
    assert (doubt.code, doubt.rows) == ("rows-far-off", (int(taken.row_numbers[row]),))
    assert doubt.explains


@pytest.mark.parametrize("by", [3.0, 3000.0])
def test_a_row_of_positions_that_no_pose_explains_is_named(by):
    """Three planes bind a platform of which three coordinates were measured."""
    robot = symkin.load_mechanism("3RPS")
    taken = robot.simulate(robot.plan(seed=1), seed=1).measurements.for_all_legs()
    taken = dataclasses.replace(taken, poses=taken.poses * [1, 1, 1, *[np.nan] * 4])
    for column in range(3):
        wrong = spoilt(taken, 4, column, taken.poses[4, column] + by)
        found = symkin.identify(robot, wrong)
        doubt = found.doubts[0]
        assert (doubt.code, doubt.rows) == ("rows-far-off", (int(taken.row_numbers[4]),))


def test_several_rows_are_named_together(robot, taken):
    wrong = spoilt(spoilt(spoilt(taken, 2, 0, 7.0), 9, 1, -30.0), 14, 0, 99.0, "readings")
    cause = cause_of(robot, wrong, estimator="joint")
    assert cause.code == "rows-far-off"
    assert cause.rows == tuple(taken.row_numbers[[2, 9, 14]].tolist())


def corrections(robot, taken, **asked):
    options = EstimateOptions("joint", **asked)
    return list(without_far_rows(Correction(lambda _: None, Statement(robot, options), taken)))


def test_too_many_rows_are_no_single_mistakes(robot, taken):
    third = np.arange(len(taken)) % 3 == 0
    cause = cause_of(robot, spoilt(taken, third, 1, 50.0))
    assert cause is None or cause.code != "rows-far-off"


def test_rows_are_as_far_off_wherever_the_device_stands(robot, taken):
    wrong = spoilt(taken, 4, 1, 50.0)
    moved = spoilt(wrong, slice(None), 0, wrong.poses[:, 0] + 3.0)
    asked = {"frames": ("base",)}
    first, second = corrections(robot, wrong, **asked), corrections(robot, moved, **asked)
    assert [each.cause.rows for each in first] == [each.cause.rows for each in second]
    assert (int(taken.row_numbers[4]),) in [each.cause.rows for each in first]


@pytest.fixture(scope="module")
def printer():
    return symkin.load_mechanism("linear_delta")


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("row", "off"), [(3, 1e-3), (10, 1e-3), (6, 5e-4), (10, 5e-3)])
def test_a_height_that_was_mistyped_is_named_and_nothing_beside_it(printer, seed, row, off):
    plan = printer.plan(seed=1, observe="height")
    heights = printer.simulate(plan, seed=seed, observe="height").measurements
    wrong = spoilt(heights, row, ..., heights.heights[row] + off, "heights")
    (doubt,) = symkin.identify(printer, wrong).doubts
    assert (doubt.code, doubt.rows) == ("rows-unlike", (int(heights.row_numbers[row]),))
    assert "(height: off by " in doubt.cause
    assert doubt.size == pytest.approx(off, rel=0.35)


@pytest.mark.parametrize("seed", range(3))
def test_what_slipped_is_no_row_that_was_mistyped(printer, seed):
    plan = printer.plan(seed=1, observe="height")
    taken = printer.simulate(plan, seed=seed, observe="height").measurements
    slipped = taken.readings.copy()
    slipped[8:, 1] += 1e-3
    found = symkin.identify(printer, dataclasses.replace(taken, readings=slipped))
    assert [doubt.code for doubt in found.doubts] == ["steps"]
