# SPDX-License-Identifier: MIT
"""Tables with names of their own: which mapping is proposed, and that it reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.data.foreign import mapping_for
from symkin.data.reading import read_fleet
from symkin.errors import MeasurementError
from symkin.storage.tables import read_table

_LEGS = [f"leg_length_{number}" for number in range(6)]
_QUATERNION = [f"orientation_{axis}" for axis in "xyzw"]


def proposed(robot: str, names: list[str]) -> str:
    values = {name: np.arange(3) + number / 10 for number, name in enumerate(names)}
    return mapping_for(read_table(values), symkin.load_mechanism(robot))


@pytest.mark.parametrize(
    ("robot", "names", "mapping"),
    [
        (
            "5bar",
            ["No", "X [mm]", "Y [mm]", "Motor 1 [deg]", "Motor 2 [deg]"],
            'position = ["X [mm]", "Y [mm]"], position_unit = "mm", '
            'readings = ["Motor 1 [deg]", "Motor 2 [deg]"], reading_unit = "deg"',
        ),
        (
            "5bar",
            ["Nr", "X", "Y", "Servo links", "Servo rechts"],
            'position = ["X", "Y"], position_unit = "?", '
            'readings = ["Servo links", "Servo rechts"], reading_unit = "?"',
        ),
        (
            "5bar",
            ["Serial No", "X [mm]", "Y [mm]", "left [deg]", "right [deg]"],
            'position = ["X [mm]", "Y [mm]"], position_unit = "mm", '
            'readings = ["left [deg]", "right [deg]"], reading_unit = "deg", robot = "Serial No"',
        ),
        (
            "5bar",
            ["x_mm", "y_mm", "pwm_1_us", "pwm_2_us"],
            'position = ["x_mm", "y_mm"], position_unit = "mm", '
            'readings = ["pwm_1_us", "pwm_2_us"], reading_unit = "?"',
        ),
        (
            "3RRR",
            ["Pos_X (mm)", "Pos_Y (mm)", "yaw (°)", "enc1_deg", "enc2_deg", "enc3_deg"],
            'position = ["Pos_X (mm)", "Pos_Y (mm)"], position_unit = "mm", '
            'readings = ["enc1_deg", "enc2_deg", "enc3_deg"], reading_unit = "deg", '
            'angle = "yaw (°)", orientation_unit = "deg"',
        ),
        (
            "hexapod_jugglebot",
            [f"position_{axis}" for axis in "xyz"] + _QUATERNION + _LEGS,
            'position = ["position_x", "position_y", "position_z"], position_unit = "?", '
            f"readings = {_LEGS}, ".replace("'", '"')
            + f'reading_unit = "?", quaternion = {_QUATERNION}'.replace("'", '"'),
        ),
        (
            "hexapod_jugglebot",
            ["TX [MM]", "TY [MM]", "TZ [MM]", "QW", "QX", "QY", "QZ"]
            + [f"encoder_{number}_counts" for number in range(1, 7)],
            'position = ["TX [MM]", "TY [MM]", "TZ [MM]"], position_unit = "mm", '
            f"readings = {[f'encoder_{number}_counts' for number in range(1, 7)]}, ".replace(
                "'", '"'
            )
            + 'reading_unit = "?", quaternion = ["QX", "QY", "QZ", "QW"]',
        ),
        (
            "hexapod_jugglebot",
            ["X [mm]", "Y [mm]", "Z [mm]", "Roll [deg]", "Pitch [deg]", "Yaw [deg]", *_LEGS],
            'position = ["X [mm]", "Y [mm]", "Z [mm]"], position_unit = "mm", '
            f"readings = {_LEGS}, ".replace("'", '"')
            + 'reading_unit = "?", names = { roll_deg = "Roll [deg]", pitch_deg = "Pitch [deg]", '
            'yaw_deg = "Yaw [deg]" }',
        ),
        (
            "3RRR",
            ["LED1 X", "LED1 Y", "LED2 X", "LED2 Y", "enc1_deg", "enc2_deg", "enc3_deg"],
            'readings = ["enc1_deg", "enc2_deg", "enc3_deg"], reading_unit = "deg", '
            'names = { p1_x_? = "LED1 X", p1_y_? = "LED1 Y", p2_x_? = "LED2 X", '
            'p2_y_? = "LED2 Y" }',
        ),
        (
            "hexapod_jugglebot",
            [f"SMR{number} {axis} [mm]" for number in (2, 4) for axis in "XYZ"] + _LEGS,
            f"readings = {_LEGS}, ".replace("'", '"')
            + 'reading_unit = "?", names = { p1_x_mm = "SMR2 X [mm]", p1_y_mm = "SMR2 Y [mm]", '
            'p1_z_mm = "SMR2 Z [mm]", p2_x_mm = "SMR4 X [mm]", p2_y_mm = "SMR4 Y [mm]", '
            'p2_z_mm = "SMR4 Z [mm]" }',
        ),
    ],
)
def test_columns_are_proposed_by_their_names(robot: str, names: list[str], mapping: str) -> None:
    assert proposed(robot, names) == f"measurements = {{ {mapping} }}"


@pytest.mark.parametrize(
    ("robot", "names"),
    [
        ("5bar", ["a x mm", "a y mm", "b x mm", "b y mm", "q1 deg", "q2 deg"]),  # two positions
        ("5bar", ["x mm", "y mm", "q1 deg", "q2 deg", "p1 deg", "p2 deg"]),  # two sets of motors
        ("5bar", ["x mm", "y mm", "q1 deg", "q2 deg", "q3 deg"]),  # of three legs
        ("5bar", ["x", "y", "left", "right", "temperature"]),
        ("5bar", ["x mm", "y m", "q1 deg", "q2 deg"]),
        ("5bar", ["x deg", "y deg", "q1 mm", "q2 mm"]),
        ("3RRR", ["x mm", "y mm", "q1 deg", "q2 deg", "q3 deg"]),  # no orientation
        ("hexapod_jugglebot", ["x", "y", "z", "rx", "ry", "rz", *_LEGS]),  # of any convention
    ],
)
def test_nothing_is_proposed_where_names_leave_a_choice(robot: str, names: list[str]) -> None:
    assert proposed(robot, names) == ""


def test_the_line_that_a_refusal_proposes_reads_the_table(tmp_path: Path) -> None:
    robot = symkin.load_mechanism("5bar")
    taken = symkin.simulate(robot, symkin.plan(robot, 6)).measurements
    columns = {
        "Nr": np.arange(len(taken.poses)),
        "Motor 1 [deg]": np.degrees(taken.readings[:, 0]),
        "Motor 2 [deg]": np.degrees(taken.readings[:, 1]),
        "X [mm]": 1e3 * taken.poses[:, 0],
        "Y [mm]": 1e3 * taken.poses[:, 1],
    }
    with pytest.raises(MeasurementError, match="load_columns") as refused:
        symkin.read_measurements(columns, robot)
    assert str(refused.value).endswith(refused.value.mapping)
    (tmp_path / "columns.toml").write_text(refused.value.mapping)
    mapping = symkin.load_columns(tmp_path / "columns.toml")
    read = symkin.read_measurements(columns, robot, mapping, ignore=["Nr"])
    assert np.allclose(read.poses, taken.poses)
    assert np.allclose(read.readings, taken.readings)


@pytest.mark.parametrize("robot", ["hexapod_jugglebot", "3RPS"])
def test_a_mapping_is_proposed_where_readings_alone_have_foreign_names(robot: str) -> None:
    mechanism = symkin.load_mechanism(robot)
    taken = symkin.simulate(mechanism, symkin.plan(mechanism, 8, design="mechanism")).measurements
    columns = dict(zip(("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"), taken.poses.T, strict=True))
    columns |= {f"joint{leg + 1}": each for leg, each in enumerate(taken.readings.T)}
    with pytest.raises(MeasurementError, match=r'readings = \["joint1", "joint2", "joint3"'):
        symkin.read_measurements(columns, mechanism)


def fleet_of_two(robot: symkin.Robot, name: str) -> dict[str, object]:
    taken = symkin.simulate(robot, symkin.plan(robot, 6)).measurements
    rows = len(taken.poses)
    return {
        name: ["A7"] * rows + ["A8"] * rows,
        "x_m": np.tile(taken.poses[:, 0], 2),
        "y_m": np.tile(taken.poses[:, 1], 2),
        "psi_1_rad": np.tile(taken.readings[:, 0], 2),
        "psi_2_rad": np.tile(taken.readings[:, 1], 2),
    }


def test_a_mapping_says_which_column_names_the_robot(tmp_path: Path) -> None:
    robot = symkin.load_mechanism("5bar")
    (tmp_path / "columns.toml").write_text(
        'measurements = { position = ["x_m", "y_m"], readings = ["psi_1_rad", "psi_2_rad"], '
        'robot = "Serial" }'
    )
    mapping = symkin.load_columns(tmp_path / "columns.toml")
    read = read_fleet(fleet_of_two(robot, "Serial"), robot, mapping)
    assert list(read) == ["A7", "A8"]
    np.testing.assert_array_equal(read["A7"].readings, read["A8"].readings)


def test_rows_of_several_robots_are_not_taken_for_those_of_one() -> None:
    robot = symkin.load_mechanism("5bar")
    table = fleet_of_two(robot, "robot")
    with pytest.raises(MeasurementError, match='rows of 2 robots, by its column "robot"'):
        symkin.read_measurements(table, robot)
