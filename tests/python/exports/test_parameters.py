# SPDX-License-Identifier: MIT
"""Parameters as JSON, YAML and C, and correction tables."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

import symkin
from symkin.errors import SymkinError
from symkin.exports import FORMATS
from symkin.exports.common import workspace_poses
from symkin.model.poses import poses_from_bounds


def calibrated() -> symkin.Mechanism:
    """A name that is no word of C, deviations, a curved sensor, small numbers."""
    robot = symkin.load_mechanism("5bar")
    deviations = np.full(robot.parameters.shape, 1e-5)
    deviations[0, 0] = np.nan
    return robot.replace(
        name='5-bar: ä "x" */', deviations=deviations, curvature=[[1e-5, 0, 0], [0, 0, 0]]
    )


def test_json_and_yaml_have_all_values_units_and_deviations() -> None:
    yaml = pytest.importorskip("yaml")
    robot = calibrated()
    document = json.loads(symkin.export(robot, "json").text)
    assert yaml.safe_load(symkin.export(robot, "yaml").text) == document
    assert (document["name"], document["chain"], document["platform"]) == (
        robot.name, "[R]RR", "point",
    )  # fmt: skip
    for leg, row in zip(document["legs"], robot.parameters, strict=True):
        found = [leg["parameters"][name]["value"] for name in robot.parameter_names]
        assert found == row.tolist()
        assert leg["working_mode"] == robot.working_modes[leg["leg"] - 1]
        assert leg["parameters"]["base_angle"] == {
            "value": row[robot.parameter_names.index("base_angle")],
            "unit": "rad",
            "standard_deviation": 1e-5,
        }
        assert leg["parameters"]["sensor_gain"]["unit"] == "1"
    assert "standard_deviation" not in document["legs"][0]["parameters"]["proximal_length"]
    bend = document["legs"][0]["parameters"]["sensor_quadratic"]
    assert bend == {"value": 1e-5, "unit": "rad/rad^2"}


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_a_c_compiler_reads_the_header_to_the_last_digit(tmp_path: Path) -> None:
    robot = calibrated()
    symkin.export(robot, "c-header", tmp_path / "robot.h")
    text = (tmp_path / "robot.h").read_text()
    prefix = re.search(r"(\w+)_working_mode", text)[1]
    assert re.fullmatch("robot_5_bar_+x_+", prefix)
    prints = "".join(
        f'for (int i = 0; i < 2; ++i) printf("%.17g\\n", {prefix}_{name}[i]);\n'
        for name in (*robot.parameter_names, "sensor_quadratic")
    )
    body = f'#include <stdio.h>\n#include "robot.h"\nint main(void) {{ {prints} return 0; }}\n'
    (tmp_path / "main.c").write_text(body)
    build = ["cc", "-std=c99", "-Wall", "-Werror", "-Wno-unused-variable", "main.c", "-o", "main"]
    subprocess.run(build, cwd=tmp_path, check=True)
    shown = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    expected = [*robot.parameters.T.ravel(), 1e-5, 0.0]
    assert [float(line) for line in shown.split()] == expected


def table(text: str) -> tuple[list[str], np.ndarray]:
    header, *rows = csv.reader(io.StringIO(text))
    return header, np.array(rows, dtype=float)


@pytest.mark.parametrize("name", ["3RRR", "5bar", "linear_delta", "hexapod_jugglebot"])
def test_a_controller_that_is_told_the_rows_of_a_table_goes_where_it_shall(
    name: str, made: Callable
) -> None:
    nominal, robot = symkin.load_mechanism(name), made(name)
    written = symkin.export(robot, "table", nominal=nominal, grid=3 if name[0] == "h" else 9)
    header, rows = table(written.text)
    names = [f"{each}_{unit}" for each, unit in robot.space.units.items()]
    assert header == [*names, *(f"command_{each}" for each in names)]
    wanted, told = (poses_from_bounds(robot.pose_space, part) for part in np.split(rows, 2, axis=1))
    readings = nominal.inverse_kinematics(told)
    taken, converged = robot.forward_kinematics(readings, start=wanted)
    assert converged.all()
    np.testing.assert_allclose(taken, wanted, atol=1e-9)
    assert len(rows) > 10


@pytest.mark.parametrize("name", ["5bar", "linear_delta"])
def test_the_error_that_remains_is_that_of_linear_interpolation(name: str, made: Callable) -> None:
    nominal, robot = symkin.load_mechanism(name), made(name)
    written = symkin.export(robot, "table", nominal=nominal, grid=15)
    _, rows = table(written.text)
    count = robot.space.dof
    axes = [
        np.linspace(a, b, 15)
        for a, b in zip(robot.workspace.lower, robot.workspace.upper, strict=True)
    ]
    values = np.full((*(15,) * count, count), np.nan)
    for row in rows:
        index = tuple(int(np.abs(axis - x).argmin()) for axis, x in zip(axes, row, strict=False))
        values[index] = row[count:] - row[:count]
    poses = workspace_poses(robot)
    told = poses + RegularGridInterpolator(axes, values)(poses)
    known = np.isfinite(told).all(axis=1)
    readings = nominal.inverse_kinematics(told[known])
    taken, _ = robot.forward_kinematics(readings, start=poses[known])
    errors = np.linalg.norm(taken - poses[known], axis=1)
    assert written.loss is not None
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(written.loss.position_rms, rel=1e-6)
    assert errors.max() == pytest.approx(written.loss.position_max, rel=1e-6)
    without = symkin.evaluate(nominal, actual=robot, poses=poses)
    assert written.loss.position_rms < 0.05 * without.position_rms


def test_a_finer_grid_leaves_less(made: Callable) -> None:
    nominal, robot = symkin.load_mechanism("linear_delta"), made("linear_delta")
    coarse, fine = (
        symkin.export(robot, "table", nominal=nominal, grid=grid).loss for grid in (5, 9)
    )
    # Linear interpolation errs with the square of the cell.
    assert fine.position_rms < 0.35 * coarse.position_rms


def test_a_table_that_cannot_be_made_is_refused_in_words() -> None:
    robot = symkin.load_mechanism("5bar")
    with pytest.raises(SymkinError, match="that the controller computes with"):
        symkin.export(robot, "table")
    with pytest.raises(SymkinError, match="expected the same"):
        symkin.export(robot, "table", nominal=symkin.load_mechanism("3RRR"))
    for grid in (1, 1001, -1):
        with pytest.raises(SymkinError, match=f"grid (is|of) {grid}"):
            symkin.export(robot, "table", nominal=robot, grid=grid)


def test_every_format_is_offered_by_the_command_and_written_or_refused(tmp_path: Path) -> None:
    from symkin.cli.mechanism import _To

    assert get_args(_To) == tuple(FORMATS)
    robot = symkin.load_mechanism("linear_delta")
    for to in FORMATS:
        path = tmp_path / f"robot.{to}"
        firmware = FORMATS[to].write.__module__.endswith("firmware")
        needed = {"endstops": 0.4} if firmware else {"nominal": robot if to == "table" else None}
        made = symkin.export(robot, to, path, **needed)
        assert path.read_text(encoding="utf-8") == made.text
        assert made.to_dict()["format"] == to
        with pytest.raises(SymkinError, match="exists; choose another place"):
            symkin.export(robot, to, path, **needed)
    with pytest.raises(SymkinError, match="to is 'stl'; expected"):
        symkin.export(robot, "stl")
