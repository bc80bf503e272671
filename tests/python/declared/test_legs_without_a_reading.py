# SPDX-License-Identifier: MIT
"""Mechanisms whose legs bind the platform differently, with several readings or none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import symkin
from symkin.errors import SymkinError
from symkin.estimate.evidence.edits import corrections_of
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction, Statement
from symkin.estimate.options import EstimateOptions
from symkin.planning.simulation import disturb
from symkin.present import page_of

Array = NDArray[np.float64]
FOLDER = Path(__file__).parents[3] / "mechanisms" / "declared"
NAMES = ("tricept", "2rps_ups", "h4_rods")


def turned(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    matrix = np.eye(4)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    matrix[[first, second], [first, second]] = c
    matrix[first, second], matrix[second, first] = -s, s
    return matrix


def moved(*by: float) -> Array:
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return matrix


def by_vector(*vector: float) -> Array:
    angle = float(np.linalg.norm(vector))
    x, y, z = np.array(vector) / (angle or 1.0)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    return matrix


def end(p: Mapping[str, float], name: str) -> Array:
    """The fixed transform at an end of a leg by its numbers, zero where there are none."""
    x, y, z, roll, pitch, rx, ry, rz = (
        float(p.get(f"{name}_{key}", 0.0))
        for key in ("x", "y", "z", "roll", "pitch", "rx", "ry", "rz")
    )
    drawn = turned(2, p.get(f"{name}_azimuth", 0.0)) @ moved(x, y, z)
    return drawn @ turned(1, pitch) @ turned(0, roll) @ by_vector(rx, ry, rz)


def pose_matrix(pose: Array) -> Array:
    x, y, z, w = pose[3:]
    half = float(np.linalg.norm(pose[3:6]))
    angle = 2 * np.arctan2(half, w)
    return moved(*pose[:3]) @ by_vector(*(np.array([x, y, z]) / (half or 1.0) * angle))


def shown(p: Mapping[str, float], reading: float) -> float:
    return p["sensor_gain"] * reading + p["sensor_offset"]


def strut(p: Mapping[str, float], q: float, pose: Array) -> list[float]:
    apart = (pose @ end(p, "platform"))[:3, 3] - end(p, "base")[:3, 3]
    return [float(np.linalg.norm(apart)) - q]


def middle(p: Mapping[str, float], pose: Array) -> list[float]:
    """What is left of the platform in the joints' frame but for two turns and the slide."""
    seen = np.linalg.inv(end(p, "base")) @ pose @ end(p, "platform")
    first = np.arctan2(seen[2, 1], seen[1, 1])
    second = np.arctan2(seen[0, 2], seen[0, 0])
    joints = turned(0, first) @ turned(1, second)
    joints = joints @ moved(0, 0, float(joints[:3, 2] @ seen[:3, 3]))
    return [float(each) for each in (seen - joints)[:3].ravel()]


def rps(p: Mapping[str, float], q: float, pose: Array) -> tuple[list[float], float]:
    """How far the ball is beside the hinge's plane and the strut's end, and the hinge's angle."""
    ball = (np.linalg.inv(end(p, "base")) @ pose @ end(p, "platform"))[:3, 3]
    along = p["foot_z"] + np.cos(p["foot_rx"]) * q
    missed = [ball[1] + np.sin(p["foot_rx"]) * q, np.hypot(ball[0], ball[2]) - along]
    return missed, float(np.arctan2(ball[0], ball[2]))


def half(p: Mapping[str, float], readings: Mapping[str, float], pose: Array) -> list[float]:
    """What four rods miss at the best turn of their plate, whose cosine and sine stand linearly."""
    hinge = pose @ end(p, "bar")
    rows, sizes = [], []
    for crank in ("front", "side"):
        body = end(p, crank) @ turned(1, readings[crank])
        for rod in (f"{crank}_1", f"{crank}_2"):
            tip = (np.linalg.inv(hinge) @ body @ end(p, f"{rod}_at"))[:3, 3]
            held = end(p, f"{rod}_end")[:3, 3]
            rows.append([tip[:2] @ held[:2], tip[1] * held[0] - tip[0] * held[1]])
            sizes.append((tip @ tip + held @ held - p[f"{rod}_length"] ** 2) / 2 - tip[2] * held[2])
    turn, *_ = np.linalg.lstsq(np.array(rows), np.array(sizes), rcond=None)
    return [*(np.array(rows) @ turn - sizes), turn @ turn - 1]


def quattro(p: Mapping[str, float], q: Sequence[float], pose: Array) -> Array:
    """What nine rods miss at the best turns of the plates, by Gauss-Newton with differences."""

    def rods(turns: Array) -> Array:
        plates = {
            "a": pose @ end(p, "hinge_a") @ turned(2, turns[0]) @ end(p, "plate_a"),
            "b": pose @ end(p, "hinge_b") @ turned(2, turns[1]) @ turned(0, turns[2]),
        }
        plates["b"] = plates["b"] @ end(p, "plate_b")
        ends = {"bar": (plates["a"], plates["b"])}
        for crank in range(4):
            body = end(p, f"base_{crank + 1}") @ turned(1, q[crank])
            ends |= {f"rod_{crank + 1}{rod}": (body, plates["aabb"[crank]]) for rod in (1, 2)}
        return np.array([
            np.linalg.norm((one @ end(p, f"{rod}_at") - other @ end(p, f"{rod}_end"))[:3, 3])
            - p[f"{rod}_length"]
            for rod, (one, other) in ends.items()
        ])  # fmt: skip

    turns = np.zeros(3)
    for _ in range(8):
        columns = [(rods(turns + each) - rods(turns - each)) / 2e-6 for each in 1e-6 * np.eye(3)]
        turns = turns - np.linalg.lstsq(np.stack(columns, axis=1), rods(turns), rcond=None)[0]
    return rods(turns)


def missed(robot: symkin.Mechanism, readings: Array, pose: Array) -> list[float]:
    """What the legs miss of closing, written joint by joint."""
    matrix = pose_matrix(pose)
    legs = [each.parameters for each in robot.legs]
    if robot.name == "h4_rods":  # its two front cranks, then its side cranks
        q = [shown(p, reading) for p, reading in zip(legs[:4], readings[:4], strict=True)]
        cranks = ({"front": q[each], "side": q[each + 2]} for each in (0, 1))
        halves = zip(legs[:2], cranks, strict=True)
        return [each for p, read in halves for each in half(p, read, matrix)]
    q = [shown(p, reading) for p, reading in zip(legs, readings, strict=True)]
    if robot.name == "quattro":
        return [float(each) for each in quattro(legs[0], q, matrix)]
    if robot.name == "tricept":
        struts = [each for leg in range(3) for each in strut(legs[leg], q[leg], matrix)]
        return struts + middle(legs[3], matrix)
    # The hinge of the first leg, the struts of the second, third and first.
    first, angle = rps(legs[3], q[3], matrix)
    second, _ = rps(legs[1], q[1], matrix)
    return [q[0] - angle, *first, *second, *strut(legs[2], q[2], matrix)]


@pytest.fixture(scope="module", params=NAMES)
def robot(request: pytest.FixtureRequest) -> symkin.Mechanism:
    return symkin.load_mechanism(FOLDER / f"{request.param}.toml")


@pytest.fixture(scope="module")
def plan(robot: symkin.Mechanism) -> symkin.Plan:
    return symkin.plan(robot, 40, design="mechanism", candidates=300)


def test_closures_without_a_reading_stand_behind_the_readings_as_legs() -> None:
    tricept, other, h4 = (symkin.load_mechanism(FOLDER / f"{name}.toml") for name in NAMES)
    assert tricept.is_read.tolist() == [True] * 3 + [False] * 3
    assert tricept.leg_readings == ((0,), (1,), (2,), (3, 4, 5))
    assert other.is_read.tolist() == [True] * 4 + [False] * 2
    assert other.leg_readings == ((0, 3, 4), (1, 5), (2,))
    assert h4.is_read.tolist() == [True] * 4 + [False] * 2
    assert h4.leg_readings == ((0, 2, 4), (1, 3, 5))
    # A half shows 33 numbers: those of its legs' geometry, and two sensors.
    assert len(h4.estimated_names(0)) == len(h4.estimated_names(4)) + 2 == 33 - 2
    assert [each.core.mobility for each in (tricept, other, h4)] == [3, 4, 4]
    assert [each.free for each in (tricept, other)] == [(2, 3, 4), (0, 2, 3, 4)]
    assert "4 legs with 3 readings, 3 strut + 1 middle without a reading" in str(tricept)
    assert "3 legs with 4 readings, 1 turned.hinge + 1 turned.q + 1 rps.q + 1 ups" in str(other)
    assert tricept.named_legs([0, 3, 4, 5]) == "legs 1, 4"
    assert tricept.named_legs([4]) == "leg 5 (closure_2 of leg 4)"
    assert other.named_legs([1, 2, 5]) == "legs 2, 3"
    assert other.named_legs([0, 3]) == "legs 1 (hinge of leg 1), 4 (q of leg 1)"
    assert [each.told_legs for each in (tricept, other)] == [[0, 1, 2, 3]] * 2
    assert not {"sensor_gain", "sensor_offset"} & {*tricept.estimated_names(3), *tricept.held[3]}


@pytest.mark.parametrize("name", [*NAMES, "quattro"])
def test_legs_close_loops_that_are_written_independently(name: str) -> None:
    robot = symkin.load_mechanism(FOLDER / f"{name}.toml")
    made = disturb(robot, seed=6)
    start = symkin.sample_workspace(robot, 5, seed=1).poses
    readings = robot.inverse_kinematics(start)
    assert not readings[:, ~robot.is_read].any()
    poses, converged = made.forward_kinematics(readings)
    assert converged.all()
    np.testing.assert_allclose(made.inverse_kinematics(poses), readings, atol=1e-12)
    for pose, row in zip(poses, readings, strict=True):
        np.testing.assert_allclose(missed(made, row, pose), 0.0, atol=1e-12)
    # And nothing but these: beside them some leg does not close.
    beside = poses + np.array([1e-4, 2e-4, -1e-4, 1e-4, -2e-4, 0, 0])
    beside[:, 3:] /= np.linalg.norm(beside[:, 3:], axis=1, keepdims=True)
    own = made.inverse_kinematics(beside)
    bound = [made.closure(leg, beside, own[:, leg]) for leg in np.flatnonzero(~made.is_read)]
    assert np.linalg.norm(bound, axis=0).min() > 1e-5


def test_tables_have_no_columns_of_what_no_sensor_reads(
    robot: symkin.Mechanism, plan: symkin.Plan, tmp_path: Path
) -> None:
    measured = symkin.simulate(robot, plan, 1).measurements
    assert not measured.readings[:, ~robot.is_read].any()
    symkin.write_measurements(measured, tmp_path / "measured.csv", robot)
    head = (tmp_path / "measured.csv").read_text().splitlines()[0].split(",")
    psi = [f"psi_{leg + 1}_{robot.reading_unit}" for leg in range(robot.reading_count)]
    assert [name for name in head if name.startswith("psi")] == psi
    if robot.name == "tricept":  # drawing a page takes seconds
        sheet = next(each for each in page_of(plan).sections if each.anchor == "sheet").parts[0]
        assert sum(name.startswith("Reading") for name in sheet.columns) == robot.reading_count
    again = symkin.read_measurements(tmp_path / "measured.csv", robot)
    np.testing.assert_array_equal(again.readings, measured.readings)
    made = disturb(robot, seed=3)
    symkin.save_mechanism(made, tmp_path / "made.toml")
    np.testing.assert_array_equal(
        symkin.load_mechanism(tmp_path / "made.toml").parameters, made.parameters
    )


def test_robots_scatter_as_their_estimates_say(robot: symkin.Mechanism, plan: symkin.Plan) -> None:
    squares, count = 0.0, 0
    for seed in range(4):
        actual = disturb(robot, seed=seed)
        measured = symkin.simulate(robot, plan, seed, actual=actual).measurements
        found = symkin.identify(robot, measured)
        assert found.converged
        errors = np.array([
            found.params[name].value - actual.legs[int(name[3]) - 1].parameters[name[5:]]
            for name in found.names
        ])  # fmt: skip
        squares += float(errors @ np.linalg.solve(found.covariance, errors))
        count += len(errors)
    assert 0.75 < squares / count < 1.3
    poses = plan.poses
    before = symkin.evaluate(robot, actual=actual, poses=poses).position_rms
    # Commanded through the model, whose own legs bind its platform.
    after = symkin.evaluate(found.mechanism, actual=actual, poses=poses).position_rms
    assert after < before / 10
    if robot.name == "tricept":
        fleet = symkin.identify_many(robot, {"last": measured})
        np.testing.assert_allclose(fleet.parameters[0], found.mechanism.parameters, atol=1e-12)
    with pytest.raises(SymkinError, match="closures of a leg have no reading"):
        symkin.identify(robot, measured, "implicit")


def test_a_robot_that_is_one_leg_is_identified() -> None:
    robot = symkin.load_mechanism(FOLDER / "quattro.toml")
    assert robot.leg_readings == ((0, 1, 2, 3, 4, 5),)
    checked = symkin.check_mechanism(robot).text()
    assert "All of it is one leg" in checked
    assert "of the one leg" in checked
    plan = symkin.plan(robot, 24, candidates=100)
    actual = disturb(robot, seed=1)
    measured = symkin.simulate(robot, plan, 1, actual=actual).measurements
    found = symkin.identify(robot, measured)
    errors = np.array([found.params[name].value for name in found.names])
    errors -= [actual.legs[int(name[3]) - 1].parameters[name[5:]] for name in found.names]
    assert found.converged
    assert 0.6 < errors @ np.linalg.solve(found.covariance, errors) / len(errors) < 1.5
    before, after = (
        symkin.evaluate(each, actual=actual, poses=plan.poses).position_rms
        for each in (robot, found.mechanism)
    )
    assert after < before / 10


def test_nothing_but_closures_without_a_reading_is_refused() -> None:
    tricept = symkin.load_mechanism(FOLDER / "tricept.toml")
    with pytest.raises(SymkinError, match=r"6 equations that bind its platform; expected 3"):
        tricept.replace(legs=[tricept.legs[3]] * 6)


def test_rods_are_what_universal_joints_and_points_are() -> None:
    robot = symkin.load_mechanism(FOLDER / "h4_rods.toml")
    joints = symkin.load_mechanism(Path(__file__).with_name("h4_joints.toml"))
    assert joints.leg_readings == robot.leg_readings
    assert len(joints.estimated_names(0)) == len(robot.estimated_names(0))
    poses = symkin.sample_workspace(robot, 20, seed=1).poses
    np.testing.assert_allclose(
        joints.inverse_kinematics(poses), robot.inverse_kinematics(poses), atol=1e-12
    )


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        (
            "tricept",
            'ry = ["-0.3 rad", "0.3 rad"]\nfree = ["z", "rx", "ry"]\n'
            'home = ["0.8 m", "0 rad", "0 rad"]',
            'free = ["z", "rx"]\nhome = ["0.8 m", "0 rad"]',
            "as many in free, and not 2",
        ),
        ("2rps_ups", '"hinge: [R] y"', '"hinge: R y"', "3 readings and 2 .* leave it free"),
        ("tricept", '"tube: P z"', '"tube: [P] z"', "4 readings and 3 .* does not assemble"),
        ("quattro", '"R x", ', "", "4 readings and 3 .* does not assemble with any error"),
        ("tricept", '"tube: P z"', '"tube: P z", "P x", "P y", "R z"', "the leg binds nothing"),
        ("h4_rods", "[symmetry]", 'closes = "point"\n[symmetry]', "of several paths none closes"),
        ("h4_rods", "rods = [", "loops = []\nrods = []\npose = [", "expected rods or loops, too"),
        ("h4_rods", '"plate: R z"', '"plat: R z"', 'a path; did you mean "plat"?'),
        ("h4_rods", '"side_motor: [R] y"', '"side_motor: [R] y", "S"', "has a ball joint"),
    ],
)
def test_what_does_not_bind_the_platform_well_is_refused(
    tmp_path: Path, name: str, old: str, new: str, says: str
) -> None:
    text = (FOLDER / f"{name}.toml").read_text()
    assert text.count(old) == 1
    path = tmp_path / "robot.toml"
    path.write_text(text.replace(old, new))
    with pytest.raises(SymkinError, match=says):
        symkin.load_mechanism(path)


@pytest.mark.parametrize("name", NAMES)
def test_no_mistake_of_readings_is_looked_for_in_a_leg_that_has_none(name: str) -> None:
    robot = symkin.load_mechanism(FOLDER / f"{name}.toml")
    poses = symkin.sample_workspace(robot, 40, seed=1).poses
    table = symkin.Measurements.of(poses, robot.inverse_kinematics(poses))
    stated = Correction("", Statement(robot, EstimateOptions()), table)
    causes = [each.cause for each in corrections_of(stated)]
    legs = {leg for cause in causes if isinstance(cause, Doubt) for leg in cause.legs}
    assert legs == set(range(robot.reading_count)) < set(range(len(robot.legs)))
