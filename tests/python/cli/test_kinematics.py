# SPDX-License-Identifier: MIT
"""Inverse and forward kinematics over a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import symkin as library

POSES = "note,x_mm,y_m,phi_deg\nfirst,10,0.02,5\nsecond,-200,0.1,-8\n"


def table(text: str) -> dict[str, np.ndarray]:
    """Columns of a CSV, empty cells as NaN."""
    header, *rows = csv.reader(io.StringIO(text))
    values = np.array([[float(cell or "nan") for cell in row] for row in rows])
    return dict(zip(header, values.T, strict=True))


def readings_of(columns: dict[str, np.ndarray]) -> np.ndarray:
    return np.column_stack([columns[f"psi_{leg}_rad"] for leg in (1, 2, 3)])


@pytest.fixture
def poses(tmp_path: Path) -> Path:
    path = tmp_path / "poses.csv"
    path.write_text(POSES)
    return path


@pytest.mark.parametrize("calibrated", [False, True], ids=["shipped", "calibrated"])
def test_readings_are_those_of_the_inverse_kinematics(
    symkin: Callable, protocol: Path, poses: Path, calibrated: bool
) -> None:
    name = protocol / "calibrated.toml" if calibrated else "3RRR"
    shown = symkin("kinematics", name, poses)
    assert (shown.code, shown.err) == (0, "")
    columns = table(shown.out)
    assert list(columns) == [*("x_m", "y_m", "phi_rad"), *(f"psi_{leg}_rad" for leg in (1, 2, 3))]
    given = [[0.01, 0.02, np.radians(5)], [-0.2, 0.1, np.radians(-8)]]
    expected = library.load_mechanism(name).inverse_kinematics(given)
    np.testing.assert_allclose(readings_of(columns), expected, rtol=0, atol=1e-14)


def test_the_readings_lead_back_to_the_poses(
    symkin: Callable, refused: Callable, poses: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    inverse = symkin("kinematics", "3RRR", poses, "--out", out)
    assert inverse.out == f"{out / 'readings.csv'}\n"
    only = tmp_path / "only.csv"
    rows = [row.split(",")[3:] for row in (out / "readings.csv").read_text().splitlines()]
    only.write_text("\n".join(map(",".join, rows)) + "\n")
    forward = symkin("kinematics", "3RRR", only, "--forward", "--out", out)
    assert (forward.code, forward.out) == (0, f"{out / 'poses.csv'}\n")
    back, there = (table((out / f"{name}.csv").read_text()) for name in ("poses", "readings"))
    assert list(back) == list(there)
    for name, values in there.items():
        np.testing.assert_allclose(back[name], values, atol=1e-9)
    refused("kinematics", "3RRR", only, words='column "x_m"')
    refused("kinematics", "3RRR", poses, "--forward", words='column "psi_1_rad"')
    refused("kinematics", "3RRR", poses, "--out", out, words="exists")


def test_a_spatial_pose_goes_there_and_back(symkin: Callable, tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("x_m,y_m,z_m,rx_deg,ry_deg,rz_deg\n0.05,-0.02,0.7,3,-2,5\n")
    assert symkin("kinematics", "hexapod_jugglebot", path, "--out", tmp_path / "out").code == 0
    shown = symkin(
        "kinematics", "hexapod_jugglebot", tmp_path / "out" / "readings.csv", "--forward"
    )
    columns = table(shown.out)
    assert columns["x_m"] == pytest.approx(0.05)
    assert columns["z_m"] == pytest.approx(0.7)
    assert columns["qx"] ** 2 + columns["qw"] ** 2 < 1


def test_rows_out_of_reach_are_empty_and_counted(symkin: Callable, tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("x_m,y_m,phi_rad\n0,0,0\n9,0,0\n0.1,0,0\n0,9,0\n")
    shown = symkin("kinematics", "3RRR", path)
    assert shown.code == 1
    assert shown.err == "out of reach: 2 of 4 rows, left empty\n"
    readings = readings_of(table(shown.out))
    assert np.isfinite(readings).all(axis=1).tolist() == [True, False, True, False]
    assert shown.out.splitlines()[2].startswith("9,0,0,")
    document = symkin("kinematics", "3RRR", path, "--json").json
    assert (document["rows"], document["out_of_reach"]) == (4, 2)
    assert document["psi_1_rad"][1] is None
    file = tmp_path / "readings.csv"
    file.write_text("psi_1_rad,psi_2_rad,psi_3_rad\n0.3,0.1,2.5\n3,0,3\n")
    forward = symkin("kinematics", "3RRR", file, "--forward")
    assert forward.code == 1
    assert "," * 2 in forward.out.splitlines()[-1]


def test_a_missing_reading_is_refused(refused: Callable, tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text("psi_1_rad,psi_2_rad,psi_3_rad\n0.3,,2.5\n")
    refused("kinematics", "3RRR", path, "--forward", words="row 2 has no reading of leg 2")


def test_what_is_printed_is_what_the_file_has(symkin: Callable, tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("x_m,y_m,phi_rad\n0,0,0\n0.01,0,0\n9,0,0\n")
    out = tmp_path / "out"
    symkin("kinematics", "3RRR", path, "--out", out)
    assert symkin("kinematics", "3RRR", path).out == (out / "readings.csv").read_text()
