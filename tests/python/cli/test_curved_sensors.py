# SPDX-License-Identifier: MIT
"""Commands about a robot whose calibrated sensors are curved."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import symkin as library


def test_commands_take_a_robot_with_curved_sensors(symkin: Callable, tmp_path: Path) -> None:
    robot = library.load_mechanism("rotary_delta")
    robot = robot.replace(curvature=np.tile([0.02, 0.01, 0.01], (3, 1)))
    path = tmp_path / "bent.toml"
    library.save_mechanism(robot, path)
    out = tmp_path / "out"
    table, calibrated = out / "made" / "measurements.csv", out / "found" / "calibrated.toml"
    for command in (
        ("check", path),
        ("workspace", path, "--out", out / "workspace"),
        ("plan", path, "--pose-count", "24", "--out", out / "plan"),
        ("simulate", path, "--plan", out / "plan" / "plan.csv", "--out", out / "made"),
        ("identify", path, table, "--out", out / "found"),
        ("evaluate", calibrated, "--actual", out / "made" / "actual.toml"),
        ("run", path, "--pose-count", "20", "--out", out / "run"),
    ):
        shown = symkin(*map(str, command))
        assert shown.code == 0, shown.err
    read = library.read_plan(out / "plan" / "plan.csv", robot)
    assert read.readings == pytest.approx(robot.inverse_kinematics(read.poses), abs=1e-8)
    refused = symkin("identify", path, table, "--estimator", "paper")
    assert refused.code == 2
    assert "curved" in refused.err
