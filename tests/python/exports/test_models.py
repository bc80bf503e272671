# SPDX-License-Identifier: MIT
"""Models of bodies and joints, in the programs that they are written for."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.exports import joint_values
from symkin.exports.reading import import_mechanism

PLANAR = ("3RRR", "5bar", "4RRR", "3PRR", "3RPR")
SPATIAL = ("hexapod_jugglebot", "linear_delta", "rotary_delta", "hexaglide", "hexa")
BOUND = ("3RPS", "3PRS")  # platforms that the legs bind
PINNED = ("3PRP", "2RRR_PRP")  # pins on guides of the platform
MEASURED = ("3RRR", "5bar", "hexapod_jugglebot", "linear_delta")


@pytest.fixture(scope="module")
def mujoco() -> Any:
    return pytest.importorskip("mujoco")


def loaded(mujoco: Any, mechanism: symkin.Mechanism) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(symkin.export(mechanism, "mjcf").text)
    return model, mujoco.MjData(model)


def size(mechanism: symkin.Mechanism) -> float:
    """Longest distance of a first body from the base's origin, or the longest link."""
    if not mechanism.space.moves:
        return 0.1  # of a sphere
    names = mechanism.parameter_names
    lengths = [names.index(n) for n in names if n in ("base_radius", "distal_length")]
    return float(np.abs(mechanism.parameters[:, lengths]).max())


@pytest.mark.parametrize("name", MEASURED)
def test_readings_that_mujoco_finds_at_a_thousand_poses_are_those_of_our_inverse_kinematics(
    name: str, made: Callable, mujoco: Any
) -> None:
    """MuJoCo holds the platform, and closes the legs by itself from joints that are off."""
    robot = made(name)
    poses = symkin.sample_workspace(robot, 1000).poses
    expected = robot.inverse_kinematics(poses)
    values = joint_values(robot, poses)
    model, data = loaded(mujoco, robot)
    legs = [joint for joint in values if joint.startswith("leg")]
    places = [model.joint(joint).qposadr[0] for joint in legs]
    columns = [model.joint(joint).dofadr[0] for joint in legs]
    off = np.random.default_rng(1).normal(0, 1e-3, (len(poses), len(legs)))
    worst_reading = worst_gap = 0.0
    for row in range(len(poses)):
        for joint, each in values.items():
            data.joint(joint).qpos = each[row]
        data.qpos[places] += off[row]
        mujoco.mj_fwdPosition(model, data)
        assert np.abs(data.efc_pos[: data.ne]).max() > 1e-6 * size(robot)
        for _ in range(5):
            jacobian = data.efc_J.reshape(data.nefc, model.nv)[: data.ne, columns]
            gap = data.efc_pos[: data.ne]
            data.qpos[places] -= np.linalg.lstsq(jacobian, gap, rcond=None)[0]
            mujoco.mj_fwdPosition(model, data)
        mujoco.mj_sensorPos(model, data)
        worst_gap = max(worst_gap, float(np.abs(data.efc_pos[: data.ne]).max()))
        joints = (data.sensordata - expected[row]) * robot.sensor_gains
        worst_reading = max(worst_reading, float(np.abs(joints).max()))
    assert worst_gap < 1e-9 * size(robot)
    assert worst_reading < 1e-9 * size(robot)


@pytest.mark.parametrize("name", [*PLANAR, *PINNED, *SPATIAL, *BOUND, "agile_eye"])
def test_our_values_of_all_joints_close_the_loops_in_mujoco(
    name: str, made: Callable, mujoco: Any
) -> None:
    robot = made(name)
    sample = symkin.sample_workspace(robot, 50)
    values = joint_values(robot, sample)
    model, data = loaded(mujoco, robot)
    assert sum(each.shape[-1] if each.ndim > 1 else 1 for each in values.values()) == model.nq
    for row in range(50):
        for joint, each in values.items():
            data.joint(joint).qpos = each[row]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.efc_pos[: data.ne], 0, atol=1e-9 * size(robot))
        np.testing.assert_allclose(data.sensordata, sample.readings[row], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(
            data.body("platform").xpos[: robot.space.size], sample.poses[row, : robot.space.size]
        )


def test_a_spherical_platform_turns_as_its_poses_say(made: Callable, mujoco: Any) -> None:
    robot = made("agile_eye")
    sample = symkin.sample_workspace(robot, 20)
    values = joint_values(robot, sample)
    model, data = loaded(mujoco, robot)
    for row in range(20):
        for joint, each in values.items():
            data.joint(joint).qpos = each[row]
        mujoco.mj_kinematics(model, data)
        scalar_first = np.roll(sample.poses[row], 1)
        assert abs(data.body("platform").xquat @ scalar_first) == pytest.approx(1, abs=1e-12)


def test_a_spherical_model_is_written_as_sdf_and_refused_on_the_way_back(
    made: Callable, tmp_path: Path
) -> None:
    robot = made("agile_eye")
    root = ET.fromstring(symkin.export(robot, "sdf").text)
    assert len([joint for joint in root.iter("joint") if joint.attrib["type"] == "ball"]) == 3
    symkin.export(robot, "mjcf", tmp_path / "eye.xml")
    with pytest.raises(SymkinError, match="spherical platform"):
        import_mechanism(tmp_path / "eye.xml")


def test_a_model_stands_still_at_its_key_frame_without_gravity(made: Callable, mujoco: Any) -> None:
    robot = made("hexapod_jugglebot")
    model, data = loaded(mujoco, robot)
    model.opt.gravity[:] = 0
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_step(model, data, 100)
    np.testing.assert_allclose(data.body("platform").xpos, robot.home[:3], atol=1e-9)


@pytest.mark.parametrize("name", ["linear_delta", "5bar", "agile_eye"])
def test_bodies_of_small_robots_weigh_what_a_simulation_can_hold(
    name: str, made: Callable, mujoco: Any
) -> None:
    model, _ = loaded(mujoco, made(name))
    moving = model.body_mass[1:]
    assert moving.min() == pytest.approx(1.0)


@pytest.mark.parametrize("name", [*PLANAR, *SPATIAL, *BOUND, "agile_eye"])
def test_the_tree_of_a_urdf_meets_its_cut_joints(name: str, made: Callable, mujoco: Any) -> None:
    parser = pytest.importorskip("urdf_parser_py.urdf")
    robot = made(name)
    text = symkin.export(robot, "urdf").text
    links = parser.URDF.from_xml_string(text.encode())
    assert links.get_root() == "base"
    assert not set(links.link_map) & set(links.joint_map)
    assert {f"leg{leg}_active" for leg in range(1, len(robot.legs) + 1)} <= set(links.joint_map)
    model = mujoco.MjModel.from_xml_string(text)  # which reads URDF too
    data = mujoco.MjData(model)
    poses = symkin.sample_workspace(robot, 20).poses
    values = joint_values(robot, poses)
    cuts = re.findall(r"point (\S+ \S+ \S+) of (\w+) = point (\S+ \S+ \S+) of platform", text)
    assert len(cuts) == len(robot.legs)
    for row in range(20):
        for joint, each in values.items():
            called = "platform_joint" if joint == "platform" else joint  # a link has that name
            data.joint(called).qpos = each[row]
        mujoco.mj_kinematics(model, data)
        for point, body, held in cuts:
            ends = [
                data.body(each).xpos
                + data.body(each).xmat.reshape(3, 3) @ [float(x) for x in place.split()]
                for each, place in ((body, point), ("platform", held))
            ]
            np.testing.assert_allclose(ends[0], ends[1], atol=1e-9 * size(robot))


@pytest.mark.parametrize("name", ["3RRR", "5bar", "linear_delta", "rotary_delta", "hexaglide"])
def test_an_sdf_stands_closed_at_home(name: str, made: Callable) -> None:
    robot = made(name)
    root = ET.fromstring(symkin.export(robot, "sdf").text)
    place = {
        link.attrib["name"]: [float(x) for x in link.findtext("pose").split()]
        for link in root.iter("link")
    }
    np.testing.assert_allclose(
        place["platform"][: robot.space.size], robot.home[: robot.space.size]
    )
    balls = [joint for joint in root.iter("joint") if joint.attrib["type"] == "ball"]
    assert len(balls) == len(robot.legs)
    assert {joint.findtext("child") for joint in balls} == {"platform"}
    for leg, joint in zip(robot.legs, balls, strict=True):
        held = [float(x) for x in joint.findtext("pose").split()][:3]
        assert place["platform"][3:] == [0, 0, 0]  # so that the point is only moved
        rod = np.add(place["platform"][:3], held) - place[joint.findtext("parent")][:3]
        assert np.linalg.norm(rod) == pytest.approx(leg.parameters["distal_length"], abs=1e-12)


@pytest.mark.parametrize("to", ["mjcf", "urdf"])
@pytest.mark.parametrize("name", [*PLANAR, *SPATIAL, *BOUND])
def test_a_model_is_read_back_as_the_mechanism_that_it_was(
    name: str, to: str, made: Callable, tmp_path: Path
) -> None:
    robot = made(name)
    symkin.export(robot, to, tmp_path / "model.xml")
    back = import_mechanism(tmp_path / "model.xml").mechanism
    assert (back.name, back.chain, back.platform) == (robot.name, robot.chain, robot.platform)
    assert back.reading_unit == robot.reading_unit
    sample = symkin.sample_workspace(robot, 50)
    readings = back.inverse_kinematics(sample)
    np.testing.assert_allclose(readings, sample.readings, rtol=1e-12, atol=1e-12)
    symkin.save_mechanism(back, tmp_path / "back.toml")


def test_geometry_that_is_changed_in_a_model_is_read(made: Callable, tmp_path: Path) -> None:
    path = tmp_path / "model.xml"
    root = ET.fromstring(symkin.export(made("5bar"), "mjcf").text)
    next(s for s in root.iter("site") if s.attrib["name"] == "leg2_end").set("pos", "0.5 0 0")
    comments = symkin.export(made("5bar"), "mjcf").text.split("<mujoco")[0]
    path.write_text(comments + ET.tostring(root, encoding="unicode"))
    found = import_mechanism(path).mechanism
    assert found.legs[1].parameters["distal_length"] == 0.5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mujoco><worldbody/></mujoco>", 'no body "platform"'),
        ("<robot name='arm'/>", "0 links without a parent"),
        ("<sdf", "is neither a printer.cfg nor XML"),
        (
            '<!-- symkin: {"chain": "[R]RR"} --><mujoco><worldbody/></mujoco>',
            "not as symkin writes",
        ),
    ],
)
def test_a_foreign_model_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "model.xml").write_text(text)
    with pytest.raises(SymkinError, match=words):
        import_mechanism(tmp_path / "model.xml")


@pytest.mark.parametrize("to", ["mjcf", "urdf", "sdf"])
def test_a_robot_that_has_no_model_is_refused_in_words(to: str) -> None:
    with pytest.raises(SymkinError, match=re.escape('not written for chain "[R]RP"; expected')):
        symkin.export(symkin.load_mechanism("3RRP"), to)
    bent = symkin.load_mechanism("5bar").replace(curvature=[[0.1, 0, 0], [0, 0, 0]])
    with pytest.raises(SymkinError, match="not straight lines"):
        symkin.export(bent, to)


def test_a_name_cannot_end_a_comment() -> None:
    robot = symkin.load_mechanism("5bar").replace(name='--> <a "b" & --- ')
    for to in ("mjcf", "urdf", "sdf"):
        root = ET.fromstring(symkin.export(robot, to).text)
        named = root if to != "sdf" else root.find("model")
        assert robot.name in named.attrib.values()
