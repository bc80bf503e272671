# SPDX-License-Identifier: MIT
"""Robots that keep their tolerance pass, others fail, and no verdict is said where none can be."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.acceptance.accepting import accept
from symkin.analysis.observed import Observed
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.model.settings import Frames, NoiseSettings
from symkin.planning.simulation import disturb


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


@pytest.fixture(scope="module")
def poses(robot):
    return symkin.sample_workspace(robot, 30, 5).poses


def measured(robot, poses, noise=1e-5, seed=1, moved=0.0):
    """Poses of a robot that is exactly as its model says, but for what all are moved by."""
    random = np.random.default_rng(seed)
    seen = poses + noise * random.normal(size=poses.shape) + moved
    readings = robot.inverse_kinematics(poses)
    return Measurements.of(seen, readings, reading_unit="rad", pose_space="planar")


def declared(robot, noise=1e-5):
    return robot.replace(noise=NoiseSettings(noise, noise, 0.0))


@pytest.mark.parametrize(
    ("moved", "verdict"), [(0.0, "pass"), (2e-5, "pass"), (4e-5, "undecided"), (6e-5, "fail")]
)
def test_the_verdict_is_that_of_the_error(robot, poses, moved, verdict):
    table = measured(robot, poses, moved=np.array([0.8, 0.6, 0.0]) * moved)
    found = accept(declared(robot), table, 4e-5, judge="rms")
    assert found.verdict == verdict
    (position,) = found.judged
    assert position.limits.lower <= moved <= position.limits.upper
    assert found.held_out is None


def test_one_bad_pose_fails_where_every_pose_is_judged(robot, poses):
    moved = np.zeros_like(poses)
    moved[7, 0] = 2e-4
    table = measured(robot, poses, moved=moved)
    assert accept(declared(robot), table, 1e-4).verdict == "pass"
    found = accept(declared(robot), table, 1e-4, judge="largest")
    assert found.verdict == "fail"
    assert found.judged[0].largest.value == pytest.approx(2e-4, abs=5e-5)
    sound = accept(declared(robot), measured(robot, poses), 1e-4, judge="largest")
    assert sound.verdict == "pass"
    assert "at least 90.5 % of all poses" in sound.notes[-1]


@pytest.mark.parametrize("judge", ["rms", "largest"])
def test_a_few_poses_cannot_pass_and_some_say_how_many_they_are(robot, poses, judge):
    for count, verdict in ((1, "undecided"), (4, "undecided"), (5, "pass")):
        found = accept(declared(robot), measured(robot, poses[:count]), 1e-3, judge=judge)
        assert found.verdict == verdict
    assert "cannot stand for all others" in accept(
        declared(robot), measured(robot, poses[:1]), 1e-3, judge=judge
    ).text(whole=True).replace("\n  ", " ")
    assert "5 poses" in found.notes[-1]
    often = accept(declared(robot), measured(robot, np.repeat(poses[:1], 30, axis=0)), 1e-3)
    assert often.verdict == "undecided"
    far = accept(declared(robot), measured(robot, poses[:1], moved=1e-2), 1e-3, judge=judge)
    assert far.verdict == "fail"


def test_a_table_that_contradicts_its_noise_has_no_verdict(robot, poses):
    found = accept(declared(robot, 1e-4), measured(robot, poses, 1e-5), 1e-3)
    assert found.verdict == "undecided"
    assert found.judged[0].limits.contradicted
    assert "state the uncertainty that it has" in found.judged[0].reason


def test_repeated_visits_have_a_repeatability(robot, poses):
    visits = np.repeat(poses[:5], 6, axis=0)
    found = accept(declared(robot), measured(robot, visits, 1e-5), 1e-4)
    assert [each.accuracy.visits for each in found.poses] == [6] * 5
    mean = np.mean([each.accuracy.position_repeatability for each in found.poses])
    assert mean == pytest.approx(3.1e-5, rel=0.25)


def test_the_uncertainty_has_the_noise_of_readings(robot, poses):
    read = robot.replace(noise=NoiseSettings(1e-5, 1e-5, 1e-4))
    random = np.random.default_rng(3)
    exact = measured(robot, poses, 1e-5)
    noisy = dataclasses.replace(
        exact, readings=exact.readings + 1e-4 * random.normal(size=exact.readings.shape)
    )
    found = accept(read, noisy, 1e-3).judged[0].limits
    assert found.uncertainty > 3e-5
    assert found.observed == pytest.approx(np.sqrt(2) * found.uncertainty, rel=0.3)


def test_a_robot_with_curved_sensors_is_judged(robot, poses):
    straight = robot.replace(noise=NoiseSettings(1e-5, 1e-5, 1e-4))
    curved = straight.replace(curvature=np.tile([0.02, 0.01, 0.0], (3, 1)))
    errors = 1e-4 * np.random.default_rng(3).normal(size=(len(poses), 3))
    tables = (measured(each, poses) for each in (curved, straight))
    found, usual = (
        accept(each, dataclasses.replace(table, readings=table.readings + errors), 1e-2)
        for each, table in zip((curved, straight), tables, strict=True)
    )
    assert found.verdict == "pass"
    uncertainties = [each.judged[0].limits.uncertainty for each in (found, usual)]
    assert uncertainties[0] == pytest.approx(uncertainties[1], rel=0.1)


def test_the_uncertainty_is_that_of_each_row_and_direction(robot, poses):
    table = measured(robot, poses)
    growing = robot.replace(noise=NoiseSettings(1e-5, 1e-5, 0.0, per_metre=1e-4))
    away = np.linalg.norm(table.poses[:, :2], axis=1)
    (position,) = accept(growing, table, 1e-3).judged
    wanted = np.sqrt(np.mean((1e-5 + 1e-4 * away) ** 2))
    assert position.limits.uncertainty == pytest.approx(wanted)
    # Along the diagonal nearly 1.4 times as much: more of the sum may be noise.
    rows, beside = np.full(len(poses), 0.95), np.full((len(poses), 3), 1e-5)
    correlated = dataclasses.replace(table, pose_deviations=beside, pose_correlations=rows[:, None])
    plain, tilted = (
        accept(declared(robot), each, 1e-3).judged[0].limits for each in (table, correlated)
    )
    assert tilted.uncertainty == pytest.approx(plain.uncertainty)
    assert tilted.upper > plain.upper


@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot", "linear_delta"])
def test_a_device_that_was_set_up_anew_has_its_frame_fitted(name):
    robot = symkin.load(name)
    poses = symkin.sample_workspace(robot, 30, 5).poses
    random = np.random.default_rng(4)
    angle = 0.3
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    size = robot.space.size
    seen = np.full_like(poses, np.nan)  # positions alone
    seen[:, :size] = poses[:, :size] @ turn[:size, :size].T + 0.2
    seen[:, :size] += 1e-5 * random.normal(size=(30, size))
    table = Measurements.of(
        seen,
        robot.inverse_kinematics(poses),
        reading_unit=robot.reading_unit,
        pose_space=robot.pose_space,
    )
    known = declared(robot)
    assert accept(known, table, 1e-4).verdict == "fail"
    found = accept(known, table, 1e-4, frames=["base"])
    assert found.verdict == "pass"
    fitted = 3 if size == 2 else 6
    assert found.judged[0].limits.degrees == 30 * size - fitted
    assert found.judged[0].limits.observed == pytest.approx(np.sqrt(size) * 1e-5, rel=0.3)


def test_poses_in_a_line_do_not_show_how_the_device_is_turned():
    robot = symkin.load_mechanism("linear_delta")
    line = robot.home + np.linspace(-0.1, 0.1, 6)[:, None] * np.array([1.0, 0.0, 0.0])
    readings = robot.inverse_kinematics(line)
    table = Measurements.of(
        line, readings, reading_unit=robot.reading_unit, pose_space=robot.pose_space
    )
    with pytest.raises(SymkinError, match="measure poses that do not lie in a line"):
        accept(declared(robot), table, 1e-4, frames=["base"])


def test_orientations_are_judged_too(robot, poses):
    table = measured(robot, poses, moved=np.array([0.0, 0.0, 1e-3]))
    found = accept(declared(robot), table, 1e-4, 5e-4)
    assert [each.verdict for each in found.judged] == ["pass", "fail"]
    assert found.verdict == "fail"


def test_rows_that_cannot_be_taken_keep_a_robot_from_passing(robot, poses):
    table = measured(robot, poses)
    readings = table.readings.copy()
    readings[3] = [0.0, 3.0, -3.0]
    found = accept(declared(robot), dataclasses.replace(table, readings=readings), 1e-4)
    assert found.failed == (table.row_numbers[3],)
    assert found.verdict == "undecided"


@pytest.fixture(scope="module")
def calibrated(robot, tmp_path_factory):
    """A calibration in a folder, and further measurements of the same robot."""
    folder = tmp_path_factory.mktemp("calibrated")
    plan = robot.plan(12, candidates=400, seed=1)
    actual = disturb(robot, seed=3)
    first = robot.simulate(plan, 3, actual)
    robot.identify(first).write(folder / "out", report=False)
    later = robot.simulate(plan, 4, actual)
    later.measurements.save(folder / "later.csv", robot)
    first.measurements.save(folder / "first.csv", robot)
    return folder


def test_the_rows_of_the_calibration_itself_are_refused(calibrated):
    found = accept(calibrated / "out", calibrated / "later.csv", 2e-4)
    assert found.held_out is True
    assert found.verdict == "pass"
    assert found.judged[0].before > 1e-3
    assert accept(calibrated / "out" / "calibrated.toml", calibrated / "later.csv", 2e-4).held_out
    with pytest.raises(SymkinError, match=r"36 of 36 rows .* are of the calibration itself"):
        accept(calibrated / "out", calibrated / "first.csv", 2e-4)


@pytest.mark.parametrize("calibrator", ["drawing", "calibrated"])
def test_rows_of_a_plan_that_nobody_measured_do_not_pass(robot, calibrated, calibrator):
    of = robot if calibrator == "drawing" else symkin.load(calibrated / "out" / "calibrated.toml")
    later = symkin.read_measurements(calibrated / "later.csv", robot)
    poses, readings = later.poses.copy(), later.readings.copy()
    poses[:4] = symkin.sample_workspace(of, 4, 7).poses
    readings[:4] = of.inverse_kinematics(poses[:4])
    table = Measurements.of(poses, readings, reading_unit="rad", pose_space="planar")
    with pytest.raises(SymkinError, match=r"4 rows \(1, 2, 3, 4\) are computed from the .* to the"):
        accept(calibrated / "out", table, 2e-4)


@pytest.mark.parametrize(("unit", "digits"), [(1.0, 6), (1e-3, 2), (np.pi / 180, 4)])
def test_rows_of_the_calibration_are_known_however_a_program_rounds_them(
    robot, calibrated, unit, digits
):
    def rounded(name):
        taken = symkin.read_measurements(calibrated / name, robot)
        length = unit if unit < 0.01 else 1e-3
        poses, readings = taken.poses.copy(), unit * np.round(taken.readings / unit, digits)
        poses[:, :2] = length * np.round(poses[:, :2] / length, max(digits - 1, 1))
        poses[:, 2] = unit * np.round(poses[:, 2] / unit, digits)
        return Measurements.of(poses, readings, reading_unit="rad", pose_space="planar")

    with pytest.raises(SymkinError, match=r"36 of 36 rows .* are of the calibration itself"):
        accept(calibrated / "out", rounded("first.csv"), 2e-3)
    assert accept(calibrated / "out", rounded("later.csv"), 2e-3).held_out is True


@pytest.fixture(scope="module")
def found(robot):
    return robot.identify(robot.simulate(robot.plan(12, candidates=400, seed=1), 3, made(robot)))


def made(robot, seed=3):
    return disturb(robot, seed=seed)


def later(robot, actual):
    """Rows that the calibration has not seen."""
    plan = robot.plan(20, candidates=400, seed=9, design="mechanism")
    return robot.simulate(plan, 5, actual).measurements


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (
            lambda rows: dataclasses.replace(rows, readings=rows.readings[:, [1, 0, 2]]),
            "columns of legs 2, 1",
        ),
        (
            lambda rows: dataclasses.replace(rows, readings=rows.readings * [-1, 1, 1]),
            "the opposite sign",
        ),
        (
            lambda rows: dataclasses.replace(rows, readings=np.roll(rows.readings, 1, axis=0)),
            "1 row late",
        ),
        (
            lambda rows: dataclasses.replace(rows, poses=25.4 * rows.poses),
            "no robot like the drawing",
        ),
        (
            lambda rows: dataclasses.replace(rows, poses=rows.poses + np.array([5e-3, 0, 0])),
            "set up anew",
        ),
    ],
    ids=["legs", "sign", "shifted", "scale", "device"],
)
def test_a_failure_by_a_mistake_in_the_rows_says_which(robot, found, change, why):
    told = symkin.accept(found, change(later(robot, made(robot))), 5e-4)
    assert told.verdict == "fail"
    assert why in " ".join(told.doubts)


@pytest.mark.parametrize(
    ("columns", "leg", "who"),
    [([], 1, "the reading of leg 2"), ([1], None, "y"), ([0, 1], None, "what the device sees")],
)
def test_what_stands_still_while_the_robot_moves_is_named(robot, found, columns, leg, who):
    rows = later(robot, made(robot))
    poses, readings = rows.poses.copy(), rows.readings.copy()
    poses[9:13, columns] = poses[9, columns]
    if leg is not None:
        readings[9:13, leg] = readings[9, leg]
    told = symkin.accept(found, dataclasses.replace(rows, poses=poses, readings=readings), 5e-4)
    assert told.verdict == "fail"
    first, last = rows.row_numbers[[9, 12]]
    assert told.doubts[0].startswith(f"{who} is the same in rows {first} to {last}")


def test_a_robot_at_rest_does_not_stand_still_in_one_column(robot, poses):
    table = measured(robot, np.repeat(poses[:10], 3, axis=0))  # three visits of each pose
    assert accept(declared(robot), table, 1e-4).doubts == ()


def test_rows_without_all_readings_are_a_doubt_of_a_robot_that_passes(robot, found):
    rows = later(robot, made(robot))
    readings = rows.readings.copy()
    readings[:8, 1] = np.nan
    told = symkin.accept(found, dataclasses.replace(rows, readings=readings), 5e-4)
    assert told.verdict == "pass"
    (doubt,) = told.doubts
    assert doubt.startswith("8 of 20 rows (2, 3, 4, 5, 6 and 3 more) lack readings of leg 2")


def test_positions_of_few_rows_are_no_test_of_as_many_poses_as_orientations(robot, poses):
    table = measured(robot, poses)
    seen = table.poses.copy()
    seen[7:, 0] = np.nan
    told = accept(declared(robot), dataclasses.replace(table, poses=seen), 1e-4)
    assert told.verdict == "pass"
    assert "is that of 7 poses" in told.notes[0]


def test_a_robot_that_was_tested_in_a_corner_is_told_of_the_rest(robot, poses):
    narrow = poses[:1] + 0.05 * (poses - poses[:1])
    told = accept(declared(robot), measured(robot, narrow), 1e-4)
    assert told.verdict == "pass"
    assert "% of x and" in told.notes[0]
    wide = symkin.sample_workspace(robot, 100, 5).poses
    assert accept(declared(robot), measured(robot, wide), 1e-4).notes == ()


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_a_failure_by_rows_of_another_robot_says_that_they_may_be(robot, found, seed):
    told = symkin.accept(found, later(robot, made(robot, seed)), 5e-4)
    assert told.verdict == "fail"
    (doubt,) = told.doubts
    assert "another robot of this drawing" in doubt
    larger = np.array(made(robot).parameters)
    larger[:, [name.endswith("length") for name in robot.parameter_names]] *= 1.1
    other = robot.with_parameters(larger, symmetry=None)
    (doubt,) = symkin.accept(found, later(robot, other), 5e-4).doubts
    assert "no robot like the drawing of 3RRR" in doubt


def test_a_robot_that_fails_a_narrow_tolerance_is_not_doubted(robot, found):
    rows = later(robot, made(robot))
    assert symkin.accept(found, rows, 5e-4).verdict == "pass"
    told = symkin.accept(found, rows, 1e-6)
    assert told.verdict == "fail"
    assert told.doubts == ()


def test_rows_of_which_none_can_be_taken_say_why():
    delta = symkin.load("linear_delta")
    plan = delta.plan(20, candidates=400, seed=9, design="mechanism")
    rows = delta.simulate(plan, 5, delta).measurements
    with pytest.raises(SymkinError, match=r"can take none .* the opposite sign"):
        symkin.accept(delta, dataclasses.replace(rows, readings=rows.readings * [-1, 1, 1]), 5e-4)


def test_points_of_few_poses_do_not_pass_for_many_poses(robot, poses):
    places = ((0.05, 0.0), (-0.03, 0.04), (0.0, -0.05))
    drawn = declared(robot).replace(frames=Frames(base=(1.0, -0.5, 0.3), points=places))
    seen = Observed("points", base=drawn.frames.base, points=places)
    exact = measured(robot, poses, noise=0.0)
    table = seen.measure(exact, drawn.noise, 1)
    few = accept(drawn, table[:4], 1e-4)
    assert (few.verdict, few.commanded, len(few.poses)) == ("undecided", 4, 12)
    some = accept(drawn, table[:12], 1e-4)
    assert (some.verdict, some.commanded) == ("pass", 12)
    assert "of 12 poses" in some.notes[-1]
    assert "36 places of points at 12 poses, 12 rows" in some.text(whole=True)
    every = accept(drawn, table[:12], 1e-4, judge="largest")
    assert f"at least {100 * 0.05 ** (1 / 12):.3g} %" in every.notes[-1]


def test_the_drawing_is_told_in_the_frames_that_it_would_have_had(robot, poses):
    actual, places = disturb(robot, 3), ((0.05, 0.0), (-0.03, 0.04), (0.0, -0.05))
    seen = Observed("points", base=(1.0, -0.5, 0.3), points=places)
    exact = Measurements.of(
        poses, actual.inverse_kinematics(poses), reading_unit="rad", pose_space="planar"
    )
    table = seen.measure(exact, robot.noise, 1)
    found = symkin.identify(robot, table[:20])
    accepted = accept(found, table[20:], 1e-3)
    told = symkin.evaluate(
        robot.replace(frames=found.mechanism.frames), measurements=table[20:]
    ).aligned
    assert accepted.judged[0].before == pytest.approx(told.position_rms)
