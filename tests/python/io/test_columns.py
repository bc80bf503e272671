# SPDX-License-Identifier: MIT
from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from symkin.data.columns import (
    check_columns,
    own_columns,
    pose_column_names,
    read_pose_values,
    read_readings,
    reading_column_names,
)
from symkin.errors import MeasurementError, MechanismFileError
from symkin.files.mechanism_file import load_columns
from symkin.model.settings import MeasurementColumns
from symkin.storage.tables import Table, read_table

Write = Callable[..., Path]
MECHANISMS = Path(__file__).parents[3] / "mechanisms"


@pytest.fixture
def table(write: Write) -> Callable[[str, str], Table]:
    return lambda header, row: read_table(write(f"{header}\n{row}\n", "t.csv"))


def test_written_columns_carry_their_units() -> None:
    assert pose_column_names("planar") == ["x_m", "y_m", "phi_rad"]
    assert pose_column_names("point") == ["x_m", "y_m"]
    assert pose_column_names("spatial") == ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]
    assert reading_column_names(2, "rad") == ["psi_1_rad", "psi_2_rad"]


@pytest.mark.parametrize(
    ("header", "space", "row", "pose"),
    [
        ("x_m,y_m,phi_rad", "planar", "1,2,0.5", [1, 2, 0.5]),
        ("phi_deg,y_mm,x_cm", "planar", "90,2,3", [0.03, 0.002, math.pi / 2]),
        ("x_m,y_inch", "point", "1,2", [1, 0.0508]),
        ("x_m,y_m,z_m,qx,qy,qz,qw", "spatial", "1,2,3,0.6,0,0,0.8", [1, 2, 3, 0.6, 0, 0, 0.8]),
        ("x_m,y_m,z_m,rx_deg,ry_rad,rz_rad", "spatial", "1,2,3,90,0,0",
         [1, 2, 3, math.sqrt(0.5), 0, 0, math.sqrt(0.5)]),
        ("x_m,y_m,z_m,rx_rad,ry_rad,rz_rad", "spatial", "1,2,3,0,0,0", [1, 2, 3, 0, 0, 0, 1]),
    ],
)  # fmt: skip
def test_poses_are_read_in_any_unit_that_the_names_state(
    table: Callable[[str, str], Table], header: str, space: str, row: str, pose: list[float]
) -> None:
    data = table(header + ",psi_1_rad", row + ",0")
    poses = read_pose_values(data, own_columns(data, space, 1)).poses()
    assert np.allclose(poses, [pose], rtol=1e-15, atol=1e-16)


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("x_m,z_m,phi_rad", 'column "y_m" (position) is missing'),
        ("x_m,y_m,psi_9_rad", "positions alone do not identify the legs of a rigid platform"),
        ("x_m,y_deg,phi_rad", '"1 deg" is an angle; expected a length'),
        ("x_m,y_m,phi_mm", '"1 mm" is a length; expected an angle'),
        ("x,y_m,phi_rad", 'the unit of column "x" is unknown'),
        ("x_m,x_mm,phi_rad", "columns x_m and x_mm both hold x"),
        ("x_m,y_m,phi_rad,note", 'row 2 has 1e+13 in column "y_m"; expected at most 1e+12 m'),
    ],
)
def test_a_pose_column_that_cannot_be_used_is_named(
    table: Callable[[str, str], Table], header: str, words: str
) -> None:
    row = "1,1e13,3,4,5" if "note" in header else "1,2,3,4"
    data = table(header + ",psi_1_rad", row)
    with pytest.raises(MeasurementError) as error:
        read_pose_values(data, own_columns(data, "planar", 1)).poses()
    assert words in str(error.value)


def test_a_spatial_pose_without_orientation_is_refused(
    table: Callable[[str, str], Table],
) -> None:
    data = table("x_m,y_m,z_m", "1,2,3")
    with pytest.raises(MeasurementError, match=r'"qx" .*positions alone do not identify'):
        read_pose_values(data, own_columns(data, "spatial", 6)).poses()


def test_a_quaternion_is_normalised_within_a_thousandth_and_refused_beyond(
    table: Callable[[str, str], Table],
) -> None:
    header = "x_m,y_m,z_m,qx,qy,qz,qw"
    data = table(header, "1,2,3,0,0,0.6003,0.8004")
    quaternion = read_pose_values(data, own_columns(data, "spatial", 6)).poses()[0, 3:]
    assert np.allclose(quaternion, [0, 0, 0.6, 0.8], atol=1e-15)
    data = table(header, "1,2,3,0,0,0.6,0.9")
    with pytest.raises(MeasurementError, match=r"row 2 .* norm 1\.08167; expected 1"):
        read_pose_values(data, own_columns(data, "spatial", 6)).poses()


def test_a_leg_without_a_reading_column_is_nan(table: Callable[[str, str], Table]) -> None:
    data = table("x_m,y_m,psi_1_deg,psi_3_rev", "1,2,180,0.5")
    readings = read_readings(data, own_columns(data, "point", 3), "rad")
    assert np.allclose(readings, [[math.pi, np.nan, math.pi]], equal_nan=True)


def test_a_table_without_any_reading_is_refused(table: Callable[[str, str], Table]) -> None:
    data = table("x_m,y_m,theta_1", "1,2,3")
    with pytest.raises(MeasurementError, match=r'"psi_1_rad" \(reading of leg 1\) is missing'):
        read_readings(data, own_columns(data, "point", 3), "rad")


MAPPING = """\
[measurements]
position = ["px", "py"]
position_unit = "mm"
angle = "turn"
orientation_unit = "deg"
readings = ["motor a", "motor b"]
reading_unit = "rev"
leg = "set"
"""


def test_a_mapping_file_names_foreign_columns_and_units(
    write: Write, table: Callable[[str, str], Table]
) -> None:
    columns = load_columns(write(MAPPING))
    assert columns == MeasurementColumns(
        position=("px", "py"),
        readings=("motor a", "motor b"),
        angle="turn",
        position_unit="mm",
        orientation_unit="deg",
        reading_unit="rev",
        leg="set",
    )
    data = table("set,motor a,motor b,turn,px,py", "2,1,0.5,180,1,2")
    assert np.allclose(read_pose_values(data, columns).poses(), [[1e-3, 2e-3, math.pi]])
    assert np.allclose(read_readings(data, columns, "rad"), [[2 * math.pi, math.pi]])


def test_the_mapping_of_a_mechanism_file_is_read(write: Write) -> None:
    columns = load_columns(MECHANISMS / "hexapod_jugglebot.toml")
    assert columns.position == ("position_x", "position_y", "position_z")
    assert columns.reading_unit == "rev"
    with pytest.raises(MechanismFileError, match=r"measurements: .* no such section"):
        load_columns(MECHANISMS / "3RRR.toml")
    assert load_columns(write('chain = "[R]RR"\n' + MAPPING)).leg == "set"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"readings": ("a", "b", "a")}, 'names column "a" twice'),
        ({"angle": "x"}, 'names column "x" twice'),
        ({"leg": "b"}, 'names column "b" twice'),
        ({"position_unit": "mm*0"}, 'position_unit of the column mapping is "mm*0"; did you mean'),
        ({"position_unit": "deg"}, "is an angle; expected a length"),
        ({"reading_unit": ""}, 'reading_unit of the column mapping is ""; expected'),
    ],
)
def test_a_mapping_that_cannot_be_meant_is_refused(change: dict[str, Any], words: str) -> None:
    columns = MeasurementColumns(("x", "y"), ("a", "b", "c"), angle="t")
    check_columns(columns, "planar", 3, "rad")
    with pytest.raises(MeasurementError) as error:
        check_columns(replace(columns, **change), "planar", 3, "rad")
    assert words in str(error.value)


def test_a_mapping_may_leave_the_units_to_the_names(table: Callable[[str, str], Table]) -> None:
    columns = MeasurementColumns(("px_mm", "py_mm"), ("motor_rev",))
    data = table("px_mm,py_mm,motor_rev", "1,2,0.5")
    assert np.allclose(read_pose_values(data, columns).poses(), [[1e-3, 2e-3]])
    assert np.allclose(read_readings(data, columns, "rad"), [[math.pi]])


@pytest.mark.parametrize(
    ("old", "new", "key", "line"),
    [
        ("readings =", "reading =", "measurements.reading", 6),
        ("[measurements]", "[measurement]", "measurement", 1),
        ('["px", "py"]', '"px"', "measurements.position", 2),
        ('angle = "turn"', "angle = 3", "measurements.angle", 4),
    ],
)
def test_a_wrong_mapping_file_is_refused_at_its_line(
    write: Write, old: str, new: str, key: str, line: int
) -> None:
    with pytest.raises(MechanismFileError) as error:
        load_columns(write(MAPPING.replace(old, new)))
    assert (error.value.key, error.value.line) == (key, line)
