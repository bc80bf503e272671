# SPDX-License-Identifier: MIT
"""Tables with names of their own: which mapping is proposed, and that it reads them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.data.foreign import mapping_for
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
    (line,) = re.findall(r"measurements = \{.*\}", str(refused.value))
    (tmp_path / "columns.toml").write_text(line)
    mapping = symkin.load_columns(tmp_path / "columns.toml")
    read = symkin.read_measurements(columns, robot, mapping, ignore=["Nr"])
    assert np.allclose(read.poses, taken.poses)
    assert np.allclose(read.readings, taken.readings)
