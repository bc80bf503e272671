# SPDX-License-Identifier: MIT
"""Mistakes of the table are named, of mechanisms of every kind."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.conventions import taken_as
from symkin.data.measurements import Measurements
from symkin.estimate.evidence.assignment import assigned
from symkin.estimate.evidence.computed import computed_rows
from symkin.estimate.evidence.measured import copied_columns, taken_as_drawn
from symkin.estimate.evidence.standing import what_stands_still
from symkin.model.poses import poses_of
from symkin.planning.made import disturb

DECLARED = Path(__file__).parents[3] / "mechanisms" / "declared"
MECHANISMS = ("3RRR", "rotary_delta", "3RPS", "2RRR_PRP", "hexa")


@pytest.fixture(scope="module", params=MECHANISMS)
def taken(request):
    """A robot, and what was measured of it in 40 poses that nobody planned."""
    robot = symkin.load_mechanism(request.param)
    poses = symkin.sample_workspace(robot, 200, seed=1).poses[:40]
    own, none = np.full(len(poses), -1), np.zeros(len(poses), dtype=bool)
    plan = symkin.Plan(
        robot, own, np.arange(len(poses)), none, poses, robot.inverse_kinematics(poses)
    )
    return robot, symkin.simulate(robot, plan, seed=5).measurements.for_all_legs()


def read(change):
    return lambda _, table: replace(table, readings=change(np.array(table.readings)))


def two_late(_, table):
    readings = np.array(table.readings)
    readings[:, :2] = np.roll(readings[:, :2], 1, axis=0)
    return replace(table, readings=readings).subset(np.arange(1, len(readings)))


def first_sorted(readings):
    readings[:, 0] = np.sort(readings[:, 0])
    return readings


def in_millimetres(robot, table):
    poses = np.array(table.poses)
    poses[::2, : robot.space.size] *= 1e3
    return replace(table, poses=poses)


def by_x(_, table):
    return replace(table, poses=table.poses[np.argsort(table.poses[:, 0])])


MISTAKES = {
    "two legs a row late": (two_late, "rows-shifted", (0, 1)),
    "poses sorted": (by_x, "rows-out-of-order", ()),
    "a column sorted": (read(first_sorted), "rows-out-of-order", (0,)),
    "millimetres in half the rows": (in_millimetres, "rows-in-another-unit", ()),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_of_the_table_is_named_of_every_kind_of_mechanism(taken, mistake):
    robot, table = taken
    change, code, legs = MISTAKES[mistake]
    try:
        cause = symkin.identify(robot, change(robot, table)).doubts[0]
    except symkin.SymkinError as error:
        cause = error.likely_cause
    assert (cause.code, cause.legs, cause.others) == (code, legs, ())
    # Values of a column that differ by less than the tolerances may stay in each other's rows.
    assert cause.explains or mistake == "a column sorted"
    if code == "rows-in-another-unit":
        assert cause.rows == tuple(table.row_numbers[::2])


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_table_that_is_corrected_gives_the_robot_of_a_sound_one(taken, mistake):
    robot, table = taken
    change, code, _ = MISTAKES[mistake]
    try:
        corrected = symkin.identify(robot, change(robot, table)).corrected
    except symkin.SymkinError as error:
        corrected = error.corrected
    if corrected is None:  # where a part of what is wrong may be left
        assert mistake == "a column sorted"
        return
    found = symkin.identify(robot, corrected)
    if mistake == "a column sorted":  # values that are alike may stay in each other's rows
        return
    assert found.trustworthy
    # Two legs are back, and the last row has none of theirs.
    shifted = code == "rows-shifted"
    kept = np.arange(1, len(table.poses) - 1) if shifted else np.arange(len(table.poses))
    sound = symkin.identify(robot, table.subset(kept))
    np.testing.assert_allclose(
        found.mechanism.parameters, sound.mechanism.parameters, rtol=1e-6, atol=1e-8
    )


@pytest.fixture(scope="module", params=["3RRR", "hexapod_jugglebot"])
def planned(request):
    """A robot, and what was measured of it in planned poses, a set for each leg."""
    robot = symkin.load_mechanism(request.param)
    table = robot.simulate(robot.plan(seed=1), seed=5).measurements
    assert set(table.leg_sets) == set(range(len(robot.legs)))
    return robot, table


def cause_of(robot, table):
    try:
        return symkin.identify(robot, table).doubts[0]
    except symkin.SymkinError as error:
        return error.likely_cause


def late(_, table):
    moved = replace(table, readings=np.roll(table.readings, 1, axis=0))
    return moved.subset(np.arange(1, len(table)))


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (late, "rows-shifted"),
        (two_late, "rows-shifted"),
        (by_x, "rows-out-of-order"),
        (read(first_sorted), "rows-out-of-order"),
    ],
)
def test_mistakes_are_named_in_tables_of_plans_too(planned, change, code):
    robot, table = planned
    assert cause_of(robot, change(robot, table)).code == code


@pytest.mark.parametrize("row", [8, 20, -9])
def test_it_is_said_from_which_row_on_readings_are_late(planned, row):
    robot, table = planned
    row %= len(table)
    rest = table.subset(np.arange(len(table) - 1))
    lost = replace(rest, readings=np.delete(table.readings, row, axis=0))
    cause = cause_of(robot, lost)
    assert (cause.code, cause.size) == ("rows-shifted", -1.0)
    assert f"1 row early from row {table.row_numbers[row]} on" in cause.words
    doubled = replace(table, readings=np.insert(table.readings, row, 0, axis=0)[:-1])
    cause = cause_of(robot, doubled)
    assert (cause.code, cause.size) == ("rows-shifted", 1.0)
    assert f"1 row late from row {table.row_numbers[row]} on" in cause.words


def test_a_column_that_was_copied_is_told_first(planned):
    robot, table = planned
    readings = np.array(table.readings)
    readings[:, 2] = readings[:, 0]
    told = symkin.identify(robot, replace(table, readings=readings)).doubts[0]
    assert (told.code, told.legs) == ("columns-copied", (0, 2))


def test_of_a_drawing_that_reaches_nothing_no_column_is_told_to_be_copied():
    robot = symkin.load_mechanism("3RRR")
    parameters = robot.parameters.copy()
    parameters[:, robot.parameter_names.index("base_radius")] *= 9
    far = robot.with_parameters(parameters, symmetry=None)
    table = robot.simulate(robot.plan(seed=1), seed=1).measurements.for_all_legs()
    readings = np.array(table.readings)
    readings[:, 2] = readings[:, 0]
    taken = taken_as_drawn(far, replace(table, readings=readings))
    assert not np.isfinite(far.inverse_kinematics(taken.poses)).any()
    assert list(copied_columns(taken)) == []


@pytest.mark.parametrize(
    "options", [{}, {"estimator": "joint"}, {"prior": "tolerances"}, {"frames": ["base"]}], ids=str
)
@pytest.mark.parametrize("rows", [slice(12, 16), slice(None)], ids=["some", "all"])
@pytest.mark.parametrize("positions_alone", [False, True])
def test_a_sensor_that_was_not_read_is_told_with_its_rows(taken, rows, options, positions_alone):
    robot, table = taken
    readings, poses = np.array(table.readings), np.array(table.poses)
    readings[rows, 1] = readings[rows, 1][0]
    poses[:, robot.space.size if positions_alone else len(poses[0]) :] = np.nan
    try:
        wrong = replace(table, readings=readings, poses=poses)
        told, *rest = symkin.identify(robot, wrong, **options).doubts
    except symkin.SymkinError as error:
        told, rest = error.likely_cause, []
    assert (told.code, told.legs) == ("stands-still", (1,))
    assert told.rows == tuple(table.row_numbers[rows].tolist())
    assert not rest


def test_of_a_plan_with_poses_for_each_leg_a_sensor_that_was_not_read_is_told(planned):
    robot, table = planned
    (used,) = np.nonzero(np.isfinite(table.readings[:, 1]))
    readings = np.array(table.readings)
    readings[used[3:8], 1] = readings[used[3], 1]
    (told,) = symkin.identify(robot, replace(table, readings=readings)).doubts
    assert (told.code, told.legs) == ("stands-still", (1,))
    assert told.rows == tuple(table.row_numbers[used[3:8]].tolist())


@pytest.mark.parametrize("columns", [[0], [0, 1, 2]])
def test_a_device_that_shows_what_it_showed_is_told(columns):
    robot = symkin.load_mechanism("hexapod_jugglebot")
    table = robot.simulate(robot.plan(40, seed=1, candidates=400), seed=1).measurements
    poses = np.array(table.poses)
    poses[5:9, columns] = poses[5, columns]
    (told,) = symkin.identify(robot, replace(table, poses=poses)).doubts
    assert (told.code, told.legs) == ("stands-still", ())
    assert ("x" if len(columns) == 1 else "what the device sees") in told.words.split(" is ")[0]


@pytest.mark.parametrize("name", [*MECHANISMS, "hexapod_jugglebot", "5bar", "hexaglide"])
def test_a_leg_that_a_plan_keeps_where_it_is_was_read(name):
    robot = symkin.load_mechanism(name)
    random, noise = np.random.default_rng(1), robot.noise.position
    sample = symkin.sample_workspace(robot, 60, seed=1).poses
    for leg in range(len(robot.legs)):
        actual = disturb(robot, leg)
        readings = actual.inverse_kinematics(sample)
        readings[:, leg] = readings[0, leg]
        poses, reached = actual.forward_kinematics(readings, sample)
        assert reached.sum() > 10
        poses = np.array(poses)
        places = poses[:, : robot.space.size]
        places += noise * random.standard_normal(places.shape)
        rested = symkin.Measurements.of(poses[reached], readings[reached])
        assert list(what_stands_still(robot, rested)) == []
        # And in a row of a raster, measured without noise.
        again = np.array(sample)
        again[:, 0] = sample[0, 0]
        made = robot.inverse_kinematics(again)
        whole = np.isfinite(made).all(axis=1)
        assert whole.sum() > 3
        raster = symkin.Measurements.of(again[whole], made[whole])
        assert list(what_stands_still(robot, raster)) == []


def test_readings_of_a_coarse_sensor_were_read(taken):
    robot, table = taken
    order = np.argsort(table.readings[:, 0])
    slow = table.subset(order)
    step = np.ptp(slow.readings[:, 0]) / 16
    readings = np.array(slow.readings)
    readings[:, 0] = step * np.round(readings[:, 0] / step)
    assert (np.diff(readings[:, 0]) == 0).sum() > 10
    assert list(what_stands_still(robot, replace(slow, readings=readings))) == []


@pytest.mark.parametrize("name", ["3RRR", "3RPS"])
def test_of_positions_too_it_is_said_from_which_row_on_readings_are_early(name):
    robot = symkin.load_mechanism(name)
    table = robot.simulate(robot.plan(seed=1), seed=1).measurements.for_all_legs()
    poses = np.array(table.poses)
    poses[:, robot.space.size :] = np.nan
    rest = replace(table, poses=poses).subset(np.arange(len(table) - 1))
    cause = cause_of(robot, replace(rest, readings=np.delete(table.readings, 20, axis=0)))
    assert (cause.code, cause.size) == ("rows-shifted", -1.0)
    assert f"1 row early from row {table.row_numbers[20]} on" in cause.words
    one = np.array(rest.readings)
    one[:, 1] = np.delete(table.readings[:, 1], 15)
    cause = cause_of(robot, replace(rest, readings=one))
    assert (cause.code, cause.legs) == ("rows-shifted", (1,))


def test_readings_that_the_drawing_has_alike_are_no_copies():
    delta = symkin.load_mechanism("rotary_delta")
    poses = np.zeros((20, 3))
    poses[:, 2] = delta.home[2] + np.linspace(-0.02, 0.02, 20)
    readings = delta.inverse_kinematics(poses)
    readings[:] = readings[:, :1]
    taken = symkin.Measurements.of(poses * [1, 1, 1.02], readings)
    try:
        codes = [each.code for each in symkin.identify(delta, taken, prior="tolerances").doubts]
    except symkin.SymkinError:
        codes = []
    assert "columns-copied" not in codes


def test_nothing_is_corrected_of_a_sound_table_nor_by_what_is_only_a_part(taken):
    robot, table = taken
    assert symkin.identify(robot, table).corrected is None
    poses = np.array(table.poses)
    poses[:, 0] += 5e-3 * np.random.default_rng(1).standard_normal(len(poses))
    assert symkin.identify(robot, replace(table, poses=poses)).corrected is None


def test_noise_is_no_mistake_of_the_table(taken):
    robot, table = taken
    size = robot.space.size
    poses = np.array(table.poses)
    shape = (len(poses), size)
    poses[:, :size] += 3 * robot.noise.position * np.random.default_rng(1).standard_normal(shape)
    assert not any(
        each.is_cause for each in symkin.identify(robot, replace(table, poses=poses)).doubts
    )


def test_a_target_that_is_elsewhere_is_told_as_the_target_with_its_size():
    robot = symkin.load_mechanism("3RRR")
    table = symkin.simulate(robot, robot.plan(24), seed=1).measurements.for_all_legs()
    poses = np.array(table.poses)
    poses[:, 0] += 0.02 * np.cos(poses[:, 2])
    poses[:, 1] += 0.02 * np.sin(poses[:, 2])
    (doubt,) = symkin.identify(robot, replace(table, poses=poses)).doubts
    assert (doubt.code, doubt.options) == ("frame-not-as-drawn", {"frames": ("target",)})
    assert doubt.size == pytest.approx(0.02, rel=0.1)
    assert doubt.cause.startswith("the target that was measured")


@pytest.mark.parametrize("name", ["3RRR", "lsst_camera_hexapod"])
def test_poses_of_the_base_as_the_platform_sees_it_are_named_and_put_right(name):
    robot = symkin.load_mechanism(name)
    table = symkin.simulate(robot, robot.plan(24), seed=1).measurements.for_all_legs()
    space = robot.pose_space
    seen = poses_of(space, taken_as("inverse", np.array(table.poses), space))
    found = symkin.identify(robot, replace(table, poses=seen))
    assert found.doubts[0].code == "convention-of-poses"
    assert "the base is told as the platform sees it" in found.doubts[0].cause
    np.testing.assert_allclose(found.corrected.poses, table.poses, atol=1e-12)


def test_more_rows_than_a_quarter_are_no_gross_errors():
    robot = symkin.load_mechanism("3RPS")
    table = symkin.simulate(robot, robot.plan(9), seed=2).measurements.for_all_legs()
    readings = np.array(table.readings)
    readings[len(readings) // 2 :, 0] += 2e-3
    found = symkin.identify(robot, replace(table, readings=readings))
    assert found.doubts
    assert not any(each.code == "gross-errors" for each in found.doubts)


def test_an_assignment_has_the_least_cost_of_all_orders():
    random = np.random.default_rng(0)
    for count in range(1, 7):
        costs = random.random((count, count))
        orders = (np.array(each) for each in itertools.permutations(range(count)))
        rows = np.arange(count)
        least = min(costs[rows, order].sum() for order in orders)
        assert costs[rows, assigned(costs)].sum() == pytest.approx(least)


CONVENTIONS = {
    "negate the columns of y, phi": lambda poses: poses * [1, -1, -1],
    "negate the column of y": lambda poses: poses * [1, -1, 1],
    "exchange the columns of x and y": lambda poses: poses[:, [1, 0, 2]],
    "name their column phi_deg": lambda poses: poses * [1, 1, 180 / np.pi],
    "add 90 degrees to phi": lambda poses: poses - [0, 0, np.pi / 2],
}


@pytest.mark.parametrize("remedy", CONVENTIONS)
def test_a_convention_is_told_with_what_to_do_to_the_table(remedy):
    robot = symkin.load_mechanism("3RRR")
    table = symkin.simulate(robot, robot.plan(24), seed=1).measurements.for_all_legs()
    wrong = replace(table, poses=CONVENTIONS[remedy](np.array(table.poses)))
    try:
        cause = symkin.identify(robot, wrong).doubts[0]
    except symkin.SymkinError as error:
        cause = error.likely_cause
    assert (cause.code, cause.remedy) == ("convention-of-poses", remedy)


@pytest.fixture(scope="module")
def cables():
    """Eight cables over pulleys that are read twice each: 16 columns of readings."""
    robot = symkin.load_mechanism(DECLARED / "cables8_pulleys.toml")
    return robot, symkin.simulate(robot, robot.plan(), seed=1).measurements.for_all_legs()


def exchanged(table, name):
    values = np.array(getattr(table, name))
    values[:, [0, 1]] = values[:, [1, 0]]
    return replace(table, **{name: values})


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda table: exchanged(table, "readings"), "columns-exchanged"),
        (lambda table: exchanged(table, "poses"), "convention-of-poses"),
        (lambda table: by_x(None, table), "rows-out-of-order"),
        (
            lambda table: replace(table, poses=table.poses * ([100.0] * 3 + [1.0] * 4)),
            "unit-of-lengths",
        ),
    ],
    ids=["readings exchanged", "x and y exchanged", "poses sorted", "centimetres"],
)
def test_a_mistake_is_named_among_many_columns_before_the_search_has_to_end(cables, change, code):
    robot, table = cables
    wrong = change(table)
    try:
        found = symkin.identify(robot, wrong)
        cause, corrected = found.doubts[0], found.corrected
        assert "search-cut-short" not in {note.code for note in found.notes}
    except symkin.SymkinError as error:
        cause, corrected = error.likely_cause, error.corrected
    assert (cause.code, cause.explains) == (code, True)
    assert symkin.identify(robot, corrected).trustworthy


@pytest.mark.parametrize("name", ["3RRR", "5bar", "linear_delta", "tricept"])
@pytest.mark.parametrize("positions", [False, True], ids=["poses", "positions"])
def test_rows_of_the_plan_that_nobody_measured_are_told_and_left_out(name, positions):
    robot = symkin.load_mechanism(name)
    plan = robot.plan(24, seed=1, candidates=400, design="mechanism", spares=0)
    table = robot.simulate(plan, seed=1).measurements
    poses, readings = np.array(table.poses), np.array(table.readings)
    left = np.arange(len(poses) - 5, len(poses))
    poses[left] = plan.poses[left].round(9)
    readings[left, : robot.reading_count] = plan.readings[left, : robot.reading_count].round(9)
    if positions:
        poses[:, robot.space.size :] = np.nan
    table = replace(table, poses=poses, readings=readings)
    found = symkin.identify(robot, table)
    told, *rest = found.doubts
    assert told.code == "rows-computed"
    assert told.rows == tuple(table.row_numbers[left].tolist())
    assert not rest
    assert "tolerances-wide" not in {note.code for note in found.notes}  # which they make of it
    assert symkin.identify(robot, found.corrected).trustworthy


@pytest.mark.parametrize("name", ["3RRR", "5bar", "hexapod_jugglebot"])
def test_no_row_of_a_robot_that_is_as_drawn_is_told_to_be_computed(name):
    robot = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(robot, 2000, seed=3).poses
    random, size = np.random.default_rng(1), robot.space.size
    readings = robot.inverse_kinematics(poses)
    seen = np.array(poses)
    seen[1:, :size] += robot.noise.position * random.normal(size=(len(poses) - 1, size))
    # The first row is home by definition.
    table = Measurements.of(
        seen, readings, reading_unit=robot.reading_unit, pose_space=robot.pose_space
    )
    assert computed_rows(robot, table).size == 0
    seen[:, size:] = np.nan
    assert computed_rows(robot, replace(table, poses=seen)).size == 0
