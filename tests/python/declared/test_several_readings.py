# SPDX-License-Identifier: MIT
"""Legs with several joints that are read, and robots that calibrate themselves by them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.checks import check_mechanism
from symkin.analysis.observability import analyse_observability
from symkin.analysis.readings_alone import readings_alone
from symkin.errors import SymkinError
from symkin.estimate.fleet import Fleet
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.planning.simulation import disturb

FILE = Path(__file__).parents[3] / "mechanisms" / "declared" / "3RRR_encoders.toml"

SHORT = """\
schema = 1
name = "short"
chain = "{chain}"

[symmetry]
group = "C3"
legs = 3

[reference_leg]
proximal_length = "1.5 m"
distal_length = "1.5 m"
base_radius = "6 m / sqrt(3)"
base_angle = "210 deg"
platform_radius = "1.5 m / sqrt(3)"
platform_angle = "210 deg"
home = {{ q1 = 0, q2 = "60 deg" }}

[workspace]
x = ["-0.3 m", "0.3 m"]
y = ["-0.3 m", "0.3 m"]
phi = ["-0.3 rad", "0.3 rad"]
home = ["0 m", "0 m", 0]
"""


@pytest.fixture(scope="module")
def robot() -> symkin.Mechanism:
    return symkin.load_mechanism(FILE)


def test_each_reading_stands_as_a_leg_that_shares_its_geometry(robot: symkin.Mechanism) -> None:
    assert robot.leg_readings == ((0, 3), (1, 4), (2, 5))
    assert len(robot.ties) == 18
    assert robot.ties[0] == "leg1.base_x = leg4.base_x"
    made = disturb(robot, seed=4)
    np.testing.assert_array_equal(made.parameters[:3, :-2], made.parameters[3:, :-2])
    assert (made.parameters[:3, -1] != made.parameters[3:, -1]).all()


def test_messages_count_legs_and_say_which_readings_they_mean(robot: symkin.Mechanism) -> None:
    assert "3 legs with 6 readings, 3 encoders.shoulder + 3 encoders.elbow" in repr(robot)
    assert "All 3 legs are alike" in str(check_mechanism(robot))
    poses = symkin.sample_workspace(robot, 20, seed=1).poses
    readings = disturb(robot, seed=4).inverse_kinematics(poses)
    readings[:, 4] = np.nan
    taken = symkin.Measurements.of(poses, readings, reading_unit="rad", pose_space="planar")
    told = map(str, symkin.identify(robot, taken, prior="tolerances").doubts)
    assert any(each.startswith("leg 5 (elbow of leg 2) has no reading") for each in told)


def test_a_parameter_that_all_legs_share_is_one_whichever_readings_have_it(
    robot: symkin.Mechanism,
) -> None:
    layout = Layout.of(robot, core_setup(robot), shared=["distal_x"])
    moved = layout.by_columns[:, layout.names.index("leg1+leg2+leg3.distal_x")]
    assert [n for n, by in zip(layout.scalars, moved, strict=True) if by == 1] == [
        f"leg{leg}.distal_x" for leg in range(1, 7)
    ]


def test_both_readings_close_a_loop_that_is_written_independently(robot: symkin.Mechanism) -> None:
    made = disturb(robot, seed=6)
    poses = symkin.sample_workspace(robot, 5, seed=1).poses
    readings = made.inverse_kinematics(poses)
    for leg in range(3):
        p = dict(made.legs[leg].parameters)
        shoulder = p["sensor_gain"] * readings[:, leg] + p["sensor_offset"]
        of_elbow = made.legs[leg + 3].parameters
        elbow = of_elbow["sensor_gain"] * readings[:, leg + 3] + of_elbow["sensor_offset"]
        first = p["base_azimuth"] + shoulder

        def at(angle: np.ndarray | float, x: float, y: float) -> np.ndarray:
            turned = np.array([x * np.cos(angle) - y * np.sin(angle)])
            return np.vstack([turned, [x * np.sin(angle) + y * np.cos(angle)]])

        end = at(p["base_azimuth"], p["base_x"], p["base_y"])
        end = end + at(first, p["proximal_x"], 0.0) + at(first + elbow, p["distal_x"], 0.0)
        held = poses[:, :2].T + at(
            poses[:, 2] + p["platform_azimuth"], p["platform_x"], p["platform_y"]
        )
        np.testing.assert_allclose(end, held, atol=1e-12)


def test_readings_alone_show_all_but_the_frames_and_the_size(robot: symkin.Mechanism) -> None:
    poses = symkin.sample_workspace(robot, 60, seed=1).poses
    found = readings_alone(robot, poses)
    assert found is not None
    # As the reference of declared legs has it, by singular values of another program.
    assert (found.parameters, found.shown, found.frames, found.size) == (30, 23, 6, 1)
    assert found.others == 0
    assert readings_alone(symkin.load_mechanism("3RRR"), poses) is None


def test_a_fourth_leg_makes_readings_show_all_but_the_frames_and_the_size() -> None:
    robot = symkin.load_mechanism("4RRR")
    found = readings_alone(robot, symkin.sample_workspace(robot, 60, seed=1).poses)
    assert found is not None
    assert (found.frames, found.size, found.others) == (6, 1, 0)
    assert "the size (1)" in found.datum


def test_robots_that_calibrate_themselves_scatter_as_they_say(robot: symkin.Mechanism) -> None:
    plan = symkin.plan(robot, 24, candidates=300, observe="readings")
    assert plan.basis is not None
    assert plan.basis.design == "mechanism"
    assert plan.expected is not None
    assert plan.expected.up_to_frames
    squares, unknowns = 0.0, 0
    for seed in range(4):
        actual = disturb(robot, seed)
        taken = symkin.simulate(robot, plan, seed, actual=actual, observe="readings")
        found = symkin.identify(robot, taken.measurements)
        assert found.converged
        free = sorted(
            (each for each in found.unknowns if each.column >= 0), key=lambda each: each.column
        )
        errors = np.array([
            each.value - actual.legs[int(each.name[3]) - 1].parameters[each.name[5:]]
            for each in free
        ])  # fmt: skip
        scales = np.array([each.deviation for each in free])
        correlation = found.covariance / np.outer(scales, scales)
        squares += float(errors / scales @ np.linalg.solve(correlation, errors / scales))
        unknowns += len(free)
    assert unknowns == 4 * 30
    assert 0.75 < squares / unknowns < 1.3
    before = symkin.evaluate(robot, actual=actual).aligned.position_rms
    after = symkin.evaluate(found.mechanism, actual=actual).aligned.position_rms
    assert after < before / 4
    np.testing.assert_allclose(
        found.mechanism.parameters[:3, :-2], found.mechanism.parameters[3:, :-2], atol=1e-15
    )


def test_a_leg_by_itself_is_no_estimate_of_a_leg_with_two_readings(
    robot: symkin.Mechanism,
) -> None:
    plan = symkin.plan(robot, 12, candidates=200)
    measured = symkin.simulate(robot, plan, 1).measurements
    assert symkin.identify(robot, measured).options.estimator == "joint"
    with pytest.raises(SymkinError, match="several joints of a leg are read"):
        symkin.identify(robot, measured, "implicit")
    fleet = symkin.identify_many(robot, {"first": measured})
    assert isinstance(fleet, Fleet)
    assert fleet.options.estimator == "joint"


def test_sensors_of_a_leg_are_told_apart_and_readings_may_stand_alone(tmp_path: Path) -> None:
    head, tail = FILE.read_text().split('[symmetry]\ngroup = "C3"\nlegs = 3\n')
    legs = "".join(
        f'[[legs]]\nsensor_offset = {{ elbow = "{offset} deg" }}\n'
        f'base = {{ azimuth = "{turn} deg" }}\nplatform = {{ azimuth = "{turn} deg" }}\n'
        for offset, turn in ((1, 210), (2, 330), (3, 90))
    )
    path = tmp_path / "listed.toml"
    path.write_text(head + legs + tail)
    listed = symkin.load_mechanism(path)
    assert [each.partition("@")[0] for each in listed.chains] == [
        *["encoders.shoulder"] * 3,
        *["encoders.elbow"] * 3,
    ]
    np.testing.assert_allclose(np.degrees(listed.parameters[:, -1]), [0, 0, 0, 1, 2, 3])
    alone = head.replace('chain = "encoders"\n', 'chain = "encoders.elbow"\n')
    path.write_text(alone + '[symmetry]\ngroup = "C3"\nlegs = 3\n' + tail)
    elbows = symkin.load_mechanism(path)
    assert len(elbows.legs) == 3
    assert elbows.ties == ()


def test_any_joints_of_a_planar_dyad_may_be_read_by_its_short_name(tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    readings = {}
    for chain in ("[R][R]R", "[R]R[R]"):
        path.write_text(SHORT.format(chain=chain))
        robot = symkin.load_mechanism(path)
        assert robot.leg_readings == ((0, 3), (1, 4), (2, 5))
        poses = symkin.sample_workspace(robot, 20, seed=1).poses
        readings[chain] = robot.inverse_kinematics(poses)
    first, elbow = np.hsplit(readings["[R][R]R"], 2)
    again, last = np.hsplit(readings["[R]R[R]"], 2)
    np.testing.assert_allclose(again, first, atol=1e-12)
    # Base and platform stand at equal angles, so the joints together turn as the platform does.
    off = (first + elbow + last - poses[:, 2:]) / (2 * np.pi)
    np.testing.assert_allclose(off, np.round(off), atol=1e-12)


def test_a_ball_for_a_universal_joint_is_the_chain_that_it_binds_as() -> None:
    for given, chain, platform in (
        ("S[P]S", "U[P]S", "rigid"),
        ("[P]SS", "[P]US", "translating"),
        ("[R]SS", "[R]US", "rigid"),
    ):
        assert symkin.chain_info(given, platform).name == chain
    delta = symkin.load_mechanism("linear_delta")
    legs = [symkin.Leg("[P]SS", each.parameters, each.working_mode) for each in delta.legs]
    assert delta.replace(legs=legs).legs == delta.legs


def test_all_readings_of_a_leg_show_it_together(robot: symkin.Mechanism) -> None:
    poses = symkin.sample_workspace(robot, 60, seed=1).poses
    # An elbow by itself does not show the leg's second length.
    for leg in (1, 4):
        shown = analyse_observability(robot, leg, poses)
        assert shown.rank == len(shown.parameter_names) == 10
        assert shown.parameter_names[-1] == "leg5.sensor_offset"
    assert robot.least_poses == 5


def test_check_tells_what_readings_alone_show() -> None:
    found = check_mechanism("4RRR")
    assert found.readings_alone is not None
    shown = found.readings_alone
    assert f"{shown.shown} of {shown.parameters}" in str(found)
    assert check_mechanism("3RRR").readings_alone is None


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ('{ length = "50 mm/rad" }', '{ length = "0 mm/rad" }', "legs[1].sensor_gain.length: is 0"),
        ('azimuth = "35 deg", z', 'azimuth = "35 dog", z', 'legs[5].base.azimuth: "35 dog" uses'),
    ],
)
def test_a_wrong_value_of_a_reading_is_named_as_the_file_has_it(
    tmp_path: Path, right: str, wrong: str, words: str
) -> None:
    text = (FILE.parent / "cables8_pulleys.toml").read_text(encoding="utf-8")
    path = tmp_path / "cables.toml"
    path.write_text(text.replace(right, wrong, 1), encoding="utf-8")
    line = text[: text.index(right)].count("\n") + 1
    with pytest.raises(SymkinError, match=re.escape(f"cables.toml:{line}: {words}")):
        symkin.load_mechanism(path)


def test_a_sensor_of_several_that_counts_twice_as_far_is_named(robot: symkin.Mechanism) -> None:
    poses = symkin.sample_workspace(robot, 30, seed=1).poses
    readings = np.array(disturb(robot, seed=4).inverse_kinematics(poses))
    readings[:, 0] *= 2
    with pytest.raises(SymkinError, match="singular") as error:
        symkin.identify(robot, symkin.Measurements.of(poses, readings))
    cause = error.value.likely_cause
    assert (cause.code, cause.legs, round(cause.size, 3)) == ("gain", (0,), 2.0)
