# SPDX-License-Identifier: MIT
"""Points on the platform are poses: reflectors at places that nobody knows, a device anywhere."""

import dataclasses
import functools
import json

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.analysis.reflectors import body_of, motions_of, orders_of_points
from symkin.cli import main
from symkin.data.reading import write_measurements
from symkin.errors import FailedFitError, MeasurementError, NotIdentifiableError, SymkinError
from symkin.model.poses import POSE_SPACES
from symkin.model.settings import Frames, NoiseSettings
from symkin.planning.simulation import disturb
from symkin.show.wording import promise

TURN = np.radians(65) * np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
BASES = {"spatial": (2.0, 1.5, -0.4, *TURN), "planar": (2.0, -1.5, 2.4)}
BASES["translating"] = BASES["spatial"]
PLACES = {
    "spatial": ((0.12, 0.0, 0.03), (-0.06, 0.1, 0.03), (-0.05, -0.11, 0.05), (0.02, 0.05, 0.09)),
    "planar": ((0.05, 0.02), (-0.06, 0.03), (0.01, 0.07)),
    "translating": ((0.02, 0.0, 0.01), (-0.01, 0.03, 0.0), (0.0, -0.02, 0.02)),
}


def nominal_of(name, times=1.0):
    """A shipped robot, measured to 15 um and made within so many times 0.3 mm and 1 mrad."""
    robot = symkin.load_mechanism(name)
    made = dataclasses.replace(
        robot.tolerances, length=times * 3e-4, angle=times * 1e-3, gain=times * 1e-4
    )
    reading = 4e-4 if name == "hexapod_jugglebot" else 1e-5
    noise = dataclasses.replace(robot.noise, position=15e-6, orientation=5e-5, reading=reading)
    return robot.replace(tolerances=made, noise=noise)


@functools.cache
def poses_of(name, rows):
    return symkin.sample_workspace(symkin.load_mechanism(name), rows, seed=3).poses


def seen(robot, actual, *kinds, points=3, rows=60, seed=1, base=None, places=None):
    space, poses = robot.pose_space, poses_of(robot.name, rows)
    places = places or PLACES[space][:points]
    exact = symkin.Measurements.of(
        poses, actual.inverse_kinematics(poses), reading_unit=robot.reading_unit, pose_space=space
    )
    device = Observed(("points", *kinds), base=base or BASES[space], points=places)
    return device.measure(exact, robot.noise, seed)


@pytest.fixture(scope="module")
def hexapod():
    return nominal_of("hexapod_jugglebot")


@pytest.fixture(scope="module")
def tracked(hexapod):
    return disturb(hexapod, 7), seen(hexapod, disturb(hexapod, 7))


@pytest.fixture(scope="module")
def found(hexapod, tracked):
    return symkin.identify(hexapod, tracked[1][:40])


def test_a_tracker_and_three_reflectors_identify_a_hexapod_with_nothing_else_known(found):
    assert found.trustworthy
    np.testing.assert_allclose(found.frames.base, BASES["spatial"], atol=2e-3)
    np.testing.assert_allclose(found.frames.points, PLACES["spatial"][:3], atol=1e-3)
    # No drawing says where they are, so that no tolerance holds them.
    unknown = found.params["point2.y"]
    assert np.isnan(unknown.nominal)
    assert np.isnan(unknown.prior)


def test_errors_to_expect_are_those_that_no_frames_would_take_away(tracked, found):
    expected = found.expected
    assert expected.up_to_frames
    assert expected.held.position < 1e-9
    poses = poses_of("hexapod_jugglebot", 60)
    model = found.mechanism.replace(frames=None)
    off = symkin.evaluate(model, actual=tracked[0], poses=poses)
    assert 0.5 < off.aligned.position_rms / expected.position < 2
    assert 0.5 < off.aligned.orientation_rms / expected.orientation < 2
    # The platform's frame is as the drawing's tolerances have it.
    assert off.position_rms > 5 * off.aligned.position_rms
    assert "no other base and platform frame" in promise(found.nominal.space, expected)


def test_reflectors_that_are_seen_together_are_poses_before_after_and_anew(tracked, found):
    held_out = symkin.evaluate(found.mechanism, measurements=tracked[1][40:])
    assert held_out.evaluated == 20
    assert found.before.aligned.position_rms > 5 * found.after.aligned.position_rms
    # Noise of 15 um an axis in the middle of three points.
    assert held_out.position_rms < 2 * 15e-6 * np.sqrt(3 / 3) + 2 * found.expected.position
    left_out = symkin.cross_validate(found.nominal, tracked[1][:40], 2)
    assert left_out.evaluation.position_rms < 1e-4
    assert left_out.residual_rms < 1e-4


def test_rows_held_out_are_accepted_where_chi_square_rises_by_their_degrees(
    hexapod, tracked, found
):
    joined = symkin.identify(hexapod, tracked[1])
    rise = joined.chi_square - found.chi_square
    degrees = joined.degrees_of_freedom - found.degrees_of_freedom
    assert degrees == 20 * 9
    assert abs(rise - degrees) < 4 * np.sqrt(2 * degrees)
    later = tracked[1][40:]
    accepted = symkin.accept(found, later, 3 * found.expected.position)
    assert accepted.verdict == "pass"
    (judged,) = accepted.judged
    # Every point is a position, and what the device cannot tell is a part of the error.
    away = symkin.accept(found.mechanism, later, 1e-5, frames=["base"])
    assert away.verdict == "fail"
    assert away.judged[0].limits.observed == pytest.approx(judged.limits.observed, rel=0.3)
    with pytest.raises(SymkinError, match="no row has a measured orientation, of which a"):
        symkin.accept(found, later, 1e-4, orientation_tolerance=1e-3)
    with pytest.raises(SymkinError, match="where they are on the platform"):
        symkin.accept(hexapod, later, 1e-4)


@pytest.mark.parametrize(
    ("name", "points", "times"),
    [
        ("hexapod_jugglebot", 2, 10),
        ("hexapod_jugglebot", 1, 10),
        ("3RRR", 2, 3),
        ("3RRR", 1, 3),
        ("linear_delta", 3, 1),
    ],
)
def test_few_reflectors_and_loose_tolerances_do(name, points, times):
    robot = nominal_of(name, times)
    measured = seen(robot, disturb(robot, 2), points=points, rows=40)
    found = symkin.identify(robot, measured)
    assert found.converged
    assert not found.unexplained
    if robot.space.turns:  # else the base's frame takes the place of the first on itself
        np.testing.assert_allclose(found.frames.base, BASES[robot.pose_space], atol=0.02)


def test_reflectors_may_be_hidden(hexapod, tracked):
    measured = seen(hexapod, tracked[0], points=4)
    hidden = np.random.default_rng(1).random(measured.points.shape[:2]) < 0.4
    points = np.where(hidden[:, :, None], np.nan, measured.points)
    found = symkin.identify(hexapod, dataclasses.replace(measured, points=points))
    assert found.trustworthy
    np.testing.assert_allclose(found.frames.points, PLACES["spatial"], atol=1e-3)


def test_places_that_are_given_are_held_and_empty_ones_are_found(hexapod, tracked, tmp_path):
    places = (PLACES["spatial"][0], (), PLACES["spatial"][2])
    path = tmp_path / "robot.toml"
    hexapod.replace(frames=Frames(points=places)).save(path)
    robot = symkin.load_mechanism(path)
    assert robot.frames.points == places
    found = symkin.identify(robot, tracked[1])
    assert found.trustworthy
    assert {name for name in found.names if name.startswith("point")} == {
        f"point2.{axis}" for axis in "xyz"
    }
    np.testing.assert_allclose(found.frames.points[1], PLACES["spatial"][1], atol=1e-4)


def test_what_is_held_of_the_base_is_as_drawn(hexapod, tracked):
    held = symkin.identify(hexapod, tracked[1][:20], frames=["base"], fixed=["base.x"])
    assert held.mechanism.frames.base[0] == 0


def test_a_base_in_the_file_is_held(hexapod, tracked):
    robot = hexapod.replace(frames=Frames(base=BASES["spatial"]))
    found = symkin.identify(robot, tracked[1])
    assert found.converged
    assert not any(name.startswith("base.") for name in found.names)


def test_one_reflector_and_an_orientation_of_anything_on_the_platform_do(hexapod, tracked):
    measured = seen(hexapod, tracked[0], "orientation", points=1)
    found = symkin.identify(hexapod, measured)
    assert found.converged
    assert not found.unexplained
    assert {"target.rx", "target.ry", "target.rz"} < set(found.names)
    assert "target.x" not in found.names


def test_align_finds_device_and_reflectors_for_a_robot_that_is_trusted(hexapod, tmp_path):
    measured = seen(hexapod, hexapod, points=4, rows=20)
    hexapod.save(tmp_path / "robot.toml")
    write_measurements(measured, tmp_path / "tracked.csv", hexapod)
    out = tmp_path / "aligned"
    main([
        "align", str(tmp_path / "tracked.csv"), "--mechanism", str(tmp_path / "robot.toml"),
        "--out", str(out), "--no-report",
    ])  # fmt: skip
    text = (out / "frames.toml").read_text(encoding="utf-8")
    path = tmp_path / "framed.toml"
    path.write_text((tmp_path / "robot.toml").read_text(encoding="utf-8") + text, encoding="utf-8")
    frames = symkin.load_mechanism(path).frames
    np.testing.assert_allclose(frames.base, BASES["spatial"], atol=1e-4)
    np.testing.assert_allclose(frames.points, PLACES["spatial"], atol=1e-4)
    assert frames.target == ()


def test_align_says_which_points_are_no_pose(hexapod):
    measured = seen(hexapod, hexapod, points=2, rows=10)
    with pytest.raises(MeasurementError, match="three points that are not in a line"):
        symkin.analysis.alignment.poses_of_mechanism(hexapod, measured.columns(hexapod))


def test_a_plan_for_reflectors_has_device_and_places_unknown(hexapod):
    tracker = Observed("points", points=PLACES["spatial"][:3])
    cloud = poses_of("hexapod_jugglebot", 60)
    plan = symkin.make_plan(hexapod, cloud, 16, observe=tracker, spares=0)
    assert plan.basis.design == "mechanism"
    names = {each.name for each in plan.unknowns}
    assert {"base.x", "point1.x", "point3.z"} < names
    promised = symkin.predict_accuracy(hexapod, plan, cloud)
    assert promised.up_to_frames
    assert promised.position < 1e-4


def test_points_that_are_all_given_are_a_start_where_poses_were_measured_too(paper):
    placed = paper.replace(frames=Frames(points=((0.05, 0.0), (0.0, 0.05))))
    plan = symkin.plan(placed, 30, design="mechanism", candidates=500, seed=1)
    taken = symkin.simulate(placed, plan, 1, observe=("pose", "points")).measurements
    found = symkin.identify(placed, taken, frames=["points"])
    assert found.trustworthy, found.doubts


def test_rows_without_readings_that_the_robot_can_take_say_what_is_missing():
    robot = nominal_of("3RRR")
    few = seen(robot, robot, rows=4)
    readings = np.where(np.arange(3) < 1, few.readings, np.nan)
    measured = dataclasses.replace(few, readings=readings)
    with pytest.raises(NotIdentifiableError, match="no row with a measured point has readings"):
        symkin.identify(robot, measured)


def test_zeros_with_which_no_reading_is_reached_are_named_with_the_corrected_drawing(
    hexapod, tracked
):
    parameters = hexapod.parameters.copy()
    parameters[:, hexapod.parameter_names.index("sensor_offset")] -= 1.0  # m of the strut
    drawn = hexapod.with_parameters(parameters, symmetry=None)
    with pytest.raises(NotIdentifiableError, match="no row with a measured point") as refused:
        symkin.identify(drawn, tracked[1])
    assert refused.value.likely_cause.code == "zero"
    assert refused.value.likely_cause.legs == tuple(range(6))
    assert symkin.identify(refused.value.redrawn, tracked[1]).converged


def test_a_reflector_that_moved_on_the_platform_is_named_with_the_corrected_table(hexapod, tracked):
    actual, taken = tracked
    first, second, third = PLACES["spatial"][:3]
    knocked = first, tuple(np.add(second, (3e-4, -1e-4, 2e-4))), third
    points = taken.points.copy()
    points[31:] = seen(hexapod, actual, places=knocked).points[31:]
    found = symkin.identify(hexapod, dataclasses.replace(taken, points=points))
    (doubt,) = found.doubts
    assert (doubt.code, doubt.figures["which"], doubt.rows) == ("point-moved", 2, (32,))
    again = symkin.identify(hexapod, found.corrected)
    assert again.trustworthy
    np.testing.assert_allclose(
        np.subtract(again.frames.points[3], again.frames.points[1]), (3e-4, -1e-4, 2e-4), atol=3e-5
    )


@pytest.mark.parametrize("order", [(1, 0, 2), (2, 0, 1)])
@pytest.mark.parametrize("rows", [[17], range(0, 60, 3), range(31, 60)])
def test_reflectors_in_each_others_columns_are_named_with_the_corrected_table(
    hexapod, tracked, order, rows
):
    taken, rows = tracked[1], list(rows)
    points = taken.points.copy()
    points[rows] = points[rows][:, order]
    wrong = dataclasses.replace(taken, points=points)
    try:
        found = symkin.identify(hexapod, wrong)
        (doubt,), corrected = found.doubts, found.corrected
    except FailedFitError as error:
        doubt, corrected = error.likely_cause, error.corrected
    assert (doubt.code, doubt.rows) == ("points-exchanged", tuple(r + 1 for r in rows))
    np.testing.assert_array_equal(corrected.points, taken.points)


def test_reflectors_that_are_named_otherwise_than_where_they_are_said_to_sit_are_told(
    hexapod, tracked
):
    placed = hexapod.replace(frames=Frames(points=PLACES["spatial"][:3]))
    wrong = dataclasses.replace(tracked[1], points=tracked[1].points[:, [0, 2, 1]])
    (doubt,) = symkin.identify(placed, wrong).doubts
    assert (doubt.code, doubt.figures["which"], len(doubt.rows)) == ("points-exchanged", "2, 3", 60)


def test_reflectors_all_as_far_from_each_other_are_in_order():
    random = np.random.default_rng(1)
    body = 0.1 * np.array([[1.0, 0, 0], [-0.5, 0.75**0.5, 0], [-0.5, -(0.75**0.5), 0]])
    seen = body + random.normal(0, 2e-5, (4000, 3, 3))
    assert (orders_of_points(seen) == [0, 1, 2]).all()
    assert (orders_of_points(seen, body) == [0, 1, 2]).all()


@pytest.mark.parametrize("name", ["hexapod_jugglebot", "3RRR"])
def test_a_reflector_that_is_loose_is_named_with_its_size(name):
    robot = nominal_of(name)
    for seed in range(1, 4):
        taken = seen(robot, disturb(robot, seed), seed=seed)
        points = taken.points.copy()
        points[:, 1] += 6e-5 * np.random.default_rng(seed).standard_normal(points[:, 1].shape)
        found = symkin.identify(robot, dataclasses.replace(taken, points=points))
        (doubt,) = found.doubts
        assert (doubt.code, doubt.figures["whose"]) == ("point-scatters", "point 2")
        assert doubt.size == pytest.approx(6e-5, rel=0.3)


@pytest.mark.parametrize("early", [False, True])
def test_a_tracker_that_is_worse_in_some_rows_is_told_with_the_row(hexapod, early):
    for seed in range(1, 4):
        taken = seen(hexapod, disturb(hexapod, seed), seed=seed)
        more = 15e-6 * np.sqrt(15) * np.random.default_rng(seed).standard_normal((60, 3, 3))
        some = (np.arange(60) < 22) == early
        worse = taken.points + some[:, None, None] * more
        (doubt,) = symkin.identify(hexapod, dataclasses.replace(taken, points=worse)).doubts
        assert doubt.code == "rows-scatter"
        assert abs(doubt.rows[0] - (22 if early else 23)) <= 2
        assert doubt.size == pytest.approx(4, rel=0.2)
        assert ("until" if early else "on scatters") in str(doubt)


def test_a_tracker_that_moved_is_named_before_a_leg_that_explains_less(hexapod, tracked):
    later = np.arange(60)[:, None, None] >= 31
    by = np.where(later, (3e-4, 1e-4, 2e-4), 0.0)
    moved = dataclasses.replace(tracked[1], points=tracked[1].points + by)
    (doubt,) = symkin.identify(hexapod, moved).doubts
    assert (doubt.code, doubt.legs, doubt.rows) == ("steps", (), (32,))
    assert symkin.identify(hexapod, moved, step=["frame:32"]).trustworthy


def test_readings_of_all_legs_that_are_noisier_than_declared_are_no_loose_joint_of_one():
    robot = nominal_of("rotary_delta")
    noisy = robot.replace(noise=dataclasses.replace(robot.noise, reading=3e-5))
    told = []
    for seed in range(8):
        taken = seen(noisy, disturb(robot, seed), seed=seed, rows=40)
        told += [each.code for each in symkin.identify(robot, taken).doubts]
    assert told.count("residuals-large") > 4
    assert "readings-scatter" not in told


def test_more_places_than_points_are_refused(hexapod, tracked):
    robot = hexapod.replace(frames=Frames(points=PLACES["spatial"]))
    with pytest.raises(SymkinError, match="3 points were observed, and 4 points are given"):
        symkin.identify(robot, tracked[1])


@pytest.mark.parametrize("space", ["spatial", "planar"])
def test_a_body_is_found_by_its_distances_and_not_as_its_mirror_image(space):
    kind = POSE_SPACES[space]
    random = np.random.default_rng(3)
    body = random.normal(0, 0.1, (5, 3))
    angles = random.normal(0, 1, (30, 3))
    if space == "planar":
        body[:, 2], angles[:, :2] = 0.0, 0.0
    turns = symkin.model.poses.rotations_from_vectors(angles)
    moved = np.einsum("nij,kj->nki", turns, body) + random.normal(0, 1, (30, 1, 3))
    if space == "planar":
        moved[:, :, 2] = 0.0
    moved[random.random((30, 5)) < 0.2] = np.nan
    found = body_of(moved, kind)
    motions = motions_of(moved, found, kind)
    made = np.einsum("nij,kj->nki", motions.rotation, found) + motions.translation[:, None]
    known = np.isfinite(moved) & np.isfinite(made)
    assert known.mean() > 0.7
    np.testing.assert_allclose(made[known], moved[known], atol=1e-9)


def test_points_in_a_line_are_no_body_nor_is_a_single_one():
    one = np.arange(18.0).reshape(6, 1, 3)
    assert np.isnan(motions_of(one, one[0], POSE_SPACES["spatial"]).translation).all()
    line = np.outer(np.arange(4.0), [1.0, 2.0, 0.5])[None] + np.zeros((6, 1, 1))
    assert body_of(line, POSE_SPACES["spatial"]) is None
    motions = motions_of(line, line[0], POSE_SPACES["spatial"])
    assert np.isnan(motions.translation).all()


@pytest.mark.parametrize("name", ["hexapod_three_points_unknown", "hexapod_two_points_unknown"])
def test_hexapods_are_identified_as_by_explicit_least_squares(name, shared_reference):
    text = (shared_reference / "observations.json").read_text(encoding="utf-8")
    (case,) = (each for each in json.loads(text)["cases"] if each["name"] == name)
    drawn = symkin.load_mechanism("hexapod_jugglebot")
    legs = tuple(
        dataclasses.replace(
            leg, parameters={each: case["scalars"][f"{each}_{k}"] for each in drawn.parameter_names}
        )
        for k, leg in enumerate(drawn.legs, 1)
    )
    taken, prior = case["measurements"], {}
    for row in case["priors"]:
        ((_, scalar),) = row["terms"]
        prior[name_of(scalar)] = row["sd"]
    home = dataclasses.replace(drawn.workspace, home=(0, 0, 0.43, 0, 0, 0))
    noise = NoiseSettings(taken["points_sd"], 1e-5, taken["reading_sd"])
    robot = drawn.replace(legs=legs, symmetry=None, noise=noise, reading_unit="m", workspace=home)
    points = np.array(taken["points"], dtype=float)
    measured = symkin.Measurements.of(
        np.full((len(points), 7), np.nan), taken["readings"], reading_unit="m", points=points
    )
    found = symkin.identify(robot, measured, prior=prior, fixed=["sensor_gain"])
    expected = case["expected"]
    assert found.chi_square == pytest.approx(expected["chi_square"], rel=1e-8)
    assert found.degrees_of_freedom == expected["degrees_of_freedom"]
    assert (found.rank, found.data_rank) == (expected["rank"], expected["rank_of_data"])
    for scalar, value, deviation in zip(
        case["free"], expected["estimate"], expected["sd"], strict=True
    ):
        if scalar.startswith("base_frame_r"):
            continue  # of a rotation about another start
        unknown = found.params[name_of(scalar)]
        own = found.names.index(unknown.name)
        assert unknown.value == pytest.approx(value, abs=1e-5 * deviation)
        assert found.model_covariance[own, own] == pytest.approx(deviation**2, rel=2e-6)


def name_of(scalar):
    """As symkin has it, of a name in the reference."""
    first, *middle, last = scalar.split("_")
    if first == "point":
        return f"point{middle[0]}.{last}"
    if scalar.startswith("base_frame"):
        return f"base.{last}"
    return f"leg{last}." + "_".join((first, *middle))
