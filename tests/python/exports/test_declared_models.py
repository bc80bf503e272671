# SPDX-License-Identifier: MIT
"""Declared legs as models of simulators."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symkin
from symkin.exports import joint_values
from symkin.planning.simulation import disturb

FOLDER = Path(__file__).parents[3] / "mechanisms" / "declared"
NAMES = [
    "2rps_ups", "3RRR_encoders", "3UPU", "3RRR_four_bar", "cables4", "gough_imperfect", "h4",
    "h4_rods", "orthoglide", "orthoglide_rods", "quattro", "tricept", "tripteron",
]  # fmt: skip


@pytest.fixture
def mujoco() -> Any:
    return pytest.importorskip("mujoco")


def drawn(name: str) -> symkin.Mechanism:
    return symkin.load_mechanism(FOLDER / f"{name}.toml")


def over_pulleys(tmp_path: Path) -> symkin.Mechanism:
    """The cables over pulleys, without encoders on the swivels."""
    text = (FOLDER / "cables8_pulleys.toml").read_text(encoding="utf-8")
    text = text.replace('{ length = "50 mm/rad" }', "1").replace('"rad" #', '"m" #')
    text = text.replace('reading = "1 mrad"', 'reading = "50 um"')
    path = tmp_path / "lengths.toml"
    path.write_text(text.replace("swivel: [R]", "swivel: R"), encoding="utf-8")
    return symkin.load_mechanism(path)


@pytest.mark.parametrize("name", [*NAMES, ""])
def test_values_of_all_joints_close_the_loops_in_mujoco(
    name: str, mujoco: Any, tmp_path: Path
) -> None:
    mechanism = drawn(name) if name else over_pulleys(tmp_path)
    poses = symkin.sample_workspace(mechanism, 5, seed=3).poses
    robot = disturb(mechanism, seed=3).replace(symmetry=None)
    if mechanism.bound:  # where a robot with errors stands
        poses, _ = robot.forward_kinematics(mechanism.inverse_kinematics(poses), start=poses)
    values = joint_values(robot, poses)
    model = mujoco.MjModel.from_xml_string(symkin.export(robot, "mjcf").text)
    data = mujoco.MjData(model)
    expected = robot.inverse_kinematics(poses)
    for row in range(5):
        for joint, each in values.items():
            data.joint(joint).qpos = each[row]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.efc_pos[: data.ne], 0, atol=1e-9)
        read = expected[row, robot.is_read]
        np.testing.assert_allclose(data.sensordata, read, rtol=1e-9, atol=1e-11)
        size = robot.space.size
        np.testing.assert_allclose(data.body("platform").xpos[:size], poses[row, :size])


@pytest.mark.parametrize("name", NAMES)
def test_a_model_stands_closed_at_its_key_frame(name: str, mujoco: Any) -> None:
    model = mujoco.MjModel.from_xml_string(symkin.export(drawn(name), "mjcf").text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.efc_pos[: data.ne], 0, atol=1e-9)


def test_sdf_has_a_joint_for_every_loop_and_says_what_it_loses() -> None:
    bound = ET.fromstring(symkin.export(drawn("3UPU"), "sdf").text)
    assert sum(joint.attrib["type"] == "fixed" for joint in bound.iter("joint")) == 3
    cranked = ET.fromstring(symkin.export(drawn("3RRR_four_bar"), "sdf").text)
    assert sum(joint.attrib["type"] == "ball" for joint in cranked.iter("joint")) == 6
    assert "joints that follow others" in " ".join(symkin.export(drawn("h4"), "sdf").notes)


def test_joints_that_follow_others_do_so_in_urdf() -> None:
    robot = ET.fromstring(symkin.export(drawn("h4"), "urdf").text)
    mimicked = [each.attrib for each in robot.iter("mimic")]
    assert mimicked == 4 * [{"joint": "platform_theta", "multiplier": "-1.0", "offset": "0.0"}]


def test_a_table_of_corrections_commands_an_h4_to_where_it_should_go() -> None:
    nominal = drawn("h4")
    assert nominal.workspace is not None
    lower, upper = (np.array(each) for each in (nominal.workspace.lower, nominal.workspace.upper))
    middle, half = (lower + upper) / 2, (upper - lower) / 4
    box = dataclasses.replace(
        nominal.workspace, lower=tuple(middle - half), upper=tuple(middle + half)
    )
    nominal = nominal.replace(workspace=box)
    robot = disturb(nominal, seed=3)
    table = symkin.export(robot, "table", nominal=nominal, grid=3)
    rows = np.loadtxt(table.text.splitlines()[1:], delimiter=",")
    wanted, commanded = rows[:, :4], rows[:, 4:8]
    taken, reached = robot.forward_kinematics(nominal.inverse_kinematics(commanded), start=wanted)
    assert len(rows) == 3**4
    assert reached.all()
    np.testing.assert_allclose(taken, wanted, atol=1e-9)
