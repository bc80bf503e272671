# SPDX-License-Identifier: MIT
"""Models for simulators read as declared legs: those that symkin writes, and others'."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.exports import import_mechanism
from symkin.exports.scenes import read_scene
from symkin.planning.simulation import disturb

FOLDER = Path(__file__).parents[3] / "mechanisms" / "declared"
NAMES = [
    "2rps_ups", "3RRR_encoders", "3UPU", "3RRR_four_bar", "cables4", "gough_imperfect", "h4",
    "h4_rods", "orthoglide", "orthoglide_rods", "tricept", "tripteron",
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "kind"), [*product(NAMES, ("mjcf", "urdf", "sdf")), ("quattro", "mjcf")]
)
def test_what_is_written_is_read_as_the_same_mechanism(
    name: str, kind: str, tmp_path: Path
) -> None:
    mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
    robots = [mechanism]
    if not mechanism.bound:  # made with errors
        robots.append(disturb(mechanism, seed=1).replace(symmetry=None))
    poses = symkin.sample_workspace(mechanism, 6, seed=1).poses
    for robot in robots:
        path = tmp_path / f"robot.{kind}"
        path.write_text(symkin.export(robot, kind).text)
        read = import_mechanism(path).mechanism
        readings = robot.inverse_kinematics(poses)
        np.testing.assert_allclose(read.inverse_kinematics(poses), readings, atol=1e-12)
        assert (read.pose_space, read.closures, read.free, read.leg_readings) == (
            robot.pose_space, robot.closures, robot.free, robot.leg_readings,
        )  # fmt: skip
        if not mechanism.open_coordinates:
            back, reached = read.forward_kinematics(readings)
            assert reached.all()
            np.testing.assert_allclose(back, poses, atol=1e-9)
        if kind != "mjcf":
            continue
        # The file that is written of it, and the model of that, are the same again.
        saved = tmp_path / "read.toml"
        symkin.save_mechanism(read, saved, overwrite=True)
        path.write_text(symkin.export(symkin.load_mechanism(saved), kind).text)
        again = import_mechanism(path).mechanism
        np.testing.assert_allclose(again.inverse_kinematics(poses), readings, atol=1e-12)


def test_loops_of_a_leg_that_holds_several_joints_begin_where_they_part(tmp_path: Path) -> None:
    # The axes of a universal joint do not cross: none of these is a rod.
    joints = Path(__file__).parents[1] / "declared" / "h4_joints.toml"
    apart = r'"\1: R y", { name = "\1_gap", x = "5 mm" }, "\1_z: R z"'
    text, count = re.subn(r'"(\w+): U y z"', apart, joints.read_text())
    assert count == 4
    (tmp_path / "h4.toml").write_text(text)
    robot = symkin.load_mechanism(tmp_path / "h4.toml")
    (tmp_path / "h4.xml").write_text(symkin.export(robot, "mjcf").text)
    read = import_mechanism(tmp_path / "h4.xml").mechanism
    assert (read.leg_readings, read.closures) == (robot.leg_readings, robot.closures)
    poses = symkin.sample_workspace(robot, 6, seed=1).poses
    readings = robot.inverse_kinematics(poses)
    np.testing.assert_allclose(read.inverse_kinematics(poses), readings, atol=1e-12)


def test_ways_on_the_platform_that_part_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    text = symkin.export(symkin.load_mechanism(FOLDER / "h4_rods.toml"), "mjcf").text
    site = re.search(r'<site name="platform_leg1_end_4"[^>]*/>', text)
    assert site
    hinge = f'<body name="more"><joint name="swivel" axis="1 0 0"/>{site[0]}</body>'
    text = text.replace(site[0], hinge).replace('qpos="0.0', 'qpos="0.0 0.0', 1)  # one more joint
    path.write_text(text)
    with pytest.raises(SymkinError, match=r'ways part behind joint "leg1_joint3"; expected each'):
        import_mechanism(path)


def crank_and_rod(robot: symkin.Mechanism, leg: int) -> tuple[np.ndarray, float, float]:
    """Base point, and directions of crank and rod at home, of a leg of the paper's 3-RRR."""
    own = robot.legs[leg].parameters
    crank = float(robot.inverse_kinematics(robot.home)[0, leg]) + own["sensor_offset"]

    def rho(angle: float) -> np.ndarray:
        return np.array([np.cos(angle), np.sin(angle)])

    base = own["base_radius"] * rho(own["base_angle"])
    rod = own["platform_radius"] * rho(own["platform_angle"]) - base
    rod = rod - own["proximal_length"] * rho(crank)
    return base, np.degrees(crank), np.degrees(np.arctan2(rod[1], rod[0]))


def others_model(robot: symkin.Mechanism) -> str:
    """A 3-RRR as others write one: drawn at home, in degrees, its platform on the first leg."""
    legs, loops, motors = [], [], []
    for leg in range(3):
        base, crank, rod = crank_and_rod(robot, leg)
        x, y = -robot.legs[leg].parameters["platform_radius"] * np.array(
            [np.cos(a := robot.legs[leg].parameters["platform_angle"]), np.sin(a)]
        )
        turn = np.radians(-rod)
        held = (
            f'<body name="ee" pos="{1.5 + x * np.cos(turn) - y * np.sin(turn)!s} '
            f'{x * np.sin(turn) + y * np.cos(turn)!s} 0" euler="0 0 {-rod!s}">'
            f'<joint name="wrist" pos="{-x!s} {-y!s} 0" axis="0 0 -1"/></body>'
        )
        legs.append(
            f'<body name="a{leg}" pos="{base[0]!s} {base[1]!s} 0.1" euler="0 0 {crank!s}">'
            f'<joint name="m{leg}" type="hinge" axis="0 0 {-1 if leg == 1 else 1}"/>'
            f'<body name="b{leg}" pos="1.5 0 0" euler="0 0 {rod - crank!s}"><joint name="e{leg}"/>'
            f"{held if leg == 0 else ''}</body></body>"
        )
        motors.append(f'<motor joint="m{leg}"/>')
        if leg:
            loops.append(f'<connect body1="b{leg}" body2="ee" anchor="1.5 0 0"/>')
    return (
        f'<mujoco model="other"><worldbody>{"".join(legs)}</worldbody>'
        f"<equality>{''.join(loops)}</equality><actuator>{''.join(motors)}</actuator></mujoco>"
    )


@pytest.fixture
def paper_model(tmp_path: Path) -> Path:
    path = tmp_path / "other.xml"
    path.write_text(others_model(symkin.load_mechanism("3RRR")))
    return path


def test_a_robot_with_its_platform_on_a_leg_is_read_by_its_motors(paper_model: Path) -> None:
    paper = symkin.load_mechanism("3RRR")
    text = paper_model.read_text()
    paper_model.write_text(text.replace('name="m2"', 'name="m2" ref="20"'))
    read = import_mechanism(paper_model, body="ee").mechanism
    assert read.pose_space == "planar"
    poses = symkin.sample_workspace(paper, 20, seed=1).poses
    ways = paper.inverse_kinematics(poses) - paper.inverse_kinematics(paper.home)
    np.testing.assert_allclose(
        read.inverse_kinematics(poses) * [1, -1, 1] - [0, 0, np.radians(20)],
        np.arctan2(np.sin(ways), np.cos(ways)),
        atol=1e-12,
    )  # fmt: skip


def welded(text: str) -> str:
    """The second leg's end as a body of its own, in which the platform is held as it is drawn."""
    robot = symkin.load_mechanism("3RRR")
    own, rod = robot.legs[1].parameters, np.radians(crank_and_rod(robot, 1)[2])
    way = own["platform_angle"] + np.pi - rod
    x, y = own["platform_radius"] * np.array([np.cos(way), np.sin(way)])
    relative = f"{x!s} {y!s} 0 {np.cos(rod / 2)!s} 0 0 {-np.sin(rod / 2)!s}"
    turned = '<body name="c1" pos="1.5 0 0"><joint name="end"/></body></body>'
    text = text.replace('<joint name="e1"/></body>', f'<joint name="e1"/>{turned}')
    weld = f'<weld body1="c1" body2="ee" relpose="{relative}"/>'
    text, count = re.subn(r'<connect body1="b1"[^>]*/>', weld, text)
    assert count == 1
    return text


def with_defaults(text: str, folder: Path) -> str:
    """The same with axes by classes, and with the loops in a file of their own."""
    text = text.replace('axis="0 0 -1"', 'class="down"')
    found = re.search(r"<equality>.*</equality>", text)
    assert found is not None
    (folder / "loops.xml").write_text(f"<mujoco>{found[0]}</mujoco>")
    text = text.replace(found[0], '<include file="loops.xml"/>')
    down = '<default><default class="down"><joint axis="0 0 -1"/></default></default>'
    return text.replace("<worldbody>", f"{down}<worldbody>", 1)


def test_defaults_includes_and_welds_are_read_as_mujoco_does(paper_model: Path) -> None:
    pytest.importorskip("mujoco")
    plain = paper_model.read_text()
    as_it_is = import_mechanism(paper_model, body="ee").mechanism
    poses = symkin.sample_workspace(as_it_is, 10, seed=1).poses
    readings = as_it_is.inverse_kinematics(poses)
    for text in (with_defaults(plain, paper_model.parent), welded(plain)):
        paper_model.write_text(text)
        read = import_mechanism(paper_model, body="ee").mechanism
        np.testing.assert_allclose(read.inverse_kinematics(poses), readings, atol=1e-12)
    paper_model.write_text(with_defaults(welded(plain), paper_model.parent))
    read = import_mechanism(paper_model, body="ee").mechanism
    np.testing.assert_allclose(read.inverse_kinematics(poses), readings, atol=1e-12)
    paper_model.write_text(with_defaults(plain.replace("hinge", "hunge"), paper_model.parent))
    with pytest.raises(SymkinError, match=r"no model that MuJoCo takes.*hunge"):
        import_mechanism(paper_model, body="ee")


@pytest.mark.parametrize("name", ["3RRR_four_bar", "h4_rods", "orthoglide", "cables4", "quattro"])
def test_models_of_symkin_are_read_by_mujoco_as_by_symkin(name: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
    text = symkin.export(mechanism, "mjcf").text
    path = tmp_path / "robot.xml"
    read = []
    for each in (text, text.replace("<worldbody>", "<default/><worldbody>", 1)):
        path.write_text(each)
        read.append(import_mechanism(path).mechanism)
    own, compiled = read
    assert (compiled.chains, compiled.leg_readings) == (own.chains, own.leg_readings)
    np.testing.assert_allclose(compiled.parameters, own.parameters, atol=1e-12)
    np.testing.assert_allclose(compiled.home, own.home, atol=1e-12)


@pytest.mark.parametrize(
    "says",
    [
        'quat="0.2 0.9 -0.3 0.4"', 'xyaxes="1 0.2 0.1 -0.3 1 0.5"', 'zaxis="0.3 -2 0.7"',
        'zaxis="0 0 -1"', 'axisangle="0.5 -1 2 40"', 'euler="20 -50 70"',
    ],
)  # fmt: skip
@pytest.mark.parametrize("order", ["xyz", "ZYX"])
def test_orientations_are_those_of_mujoco(says: str, order: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    text = (
        f'<mujoco><compiler eulerseq="{order}"/><worldbody><body name="turned" {says}>'
        '<geom size="0.1"/></body></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    own = read_scene(ET.fromstring(text), Path("robot.xml"), text, None)
    turned = own.parts["turned"].frame[:3, :3]
    np.testing.assert_allclose(turned, data.xmat[1].reshape(3, 3), atol=1e-12)


DELTA = """<mujoco model="delta"><compiler angle="radian"/><worldbody>
<body name="platform" pos="0 0 0.1">
  <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
  <joint name="z" type="slide" axis="0 0 1"/>
</body>{legs}</worldbody><equality>{loops}</equality><sensor>{sensors}</sensor></mujoco>"""


def test_rods_between_balls_are_distances(tmp_path: Path) -> None:
    delta = symkin.load_mechanism("linear_delta")
    legs, loops, sensors = [], [], []
    height = 0.1
    for leg, each in enumerate(delta.legs):
        own = each.parameters
        x, y = own["base_radius"] * np.array(
            [np.cos(own["base_azimuth"]), np.sin(own["base_azimuth"])]
        )
        up = height + np.sqrt(own["distal_length"] ** 2 - x**2 - y**2)
        legs.append(
            f'<body name="c{leg}" pos="{x!s} {y!s} {up!s}"><joint name="q{leg}" type="slide"/>'
            f'<body name="r{leg}"><joint name="ball{leg}" type="ball"/></body></body>'
        )
        loops.append(f'<connect body1="r{leg}" body2="platform" anchor="{-x!s} {-y!s} '
                     f'{height - up!s}"/>')  # fmt: skip
        sensors.append(f'<jointpos joint="q{leg}"/>')
    path = tmp_path / "delta.xml"
    path.write_text(
        DELTA.format(legs="".join(legs), loops="".join(loops), sensors="".join(sensors))
    )
    read = import_mechanism(path).mechanism
    assert read.pose_space == "translating"
    poses = symkin.sample_workspace(delta, 20, seed=1).poses
    here = delta.inverse_kinematics(poses)
    np.testing.assert_allclose(
        np.diff(read.inverse_kinematics(poses), axis=0), np.diff(here, axis=0), atol=1e-12
    )
    assert read.leg_info(0).runs_as == "[P]US"


LINKS = """<robot name="five">{links}
<joint name="x" type="prismatic"><parent link="base"/><child link="slide"/>
  <axis xyz="1 0 0"/></joint>
<joint name="y" type="prismatic"><parent link="slide"/><child link="platform"/>
  <axis xyz="0 1 0"/></joint>{joints}</robot>"""
HINGE = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>
  <origin xyz="{3} 0 0" rpy="0 0 {4}"/><axis xyz="0 0 1"/></joint>"""
LOOPS = """active = ["j1", "j2"]
home = {{ y = 0.5 }}
[[loops]]
body = "rod1"
point = [{0}, 0, 0]
other = "platform"
[[loops]]
body = "platform"
other = "rod2"
other_point = [{0}, 0, 0]
"""


def five_bar(folder: Path) -> tuple[Path, Path, float]:
    """Drawn at home, (0, 0.5) m, with cranks of 0.3 m on bases at -0.3 and 0.3 m."""
    joints, names = "", ["base", "slide", "platform"]
    for leg, (base, crank) in enumerate(((-0.3, 1.8), (0.3, np.pi - 1.8)), 1):
        elbow = np.array([base + 0.3 * np.cos(crank), 0.3 * np.sin(crank)])
        x, y = np.array([0.0, 0.5]) - elbow
        joints += HINGE.format(f"j{leg}", "base", f"crank{leg}", base, crank)
        turned = np.arctan2(y, x) - crank
        joints += HINGE.format(f"e{leg}", f"crank{leg}", f"rod{leg}", 0.3, turned)
        names += [f"crank{leg}", f"rod{leg}"]
    rod = float(np.hypot(x, y))
    model, loops = folder / "five.urdf", folder / "loops.toml"
    model.write_text(
        LINKS.format(links="".join(f'<link name="{each}"/>' for each in names), joints=joints)
    )
    loops.write_text(LOOPS.format(rod))
    return model, loops, rod


def test_loops_of_a_urdf_stand_in_a_file_beside_it(tmp_path: Path) -> None:
    model, loops, rod = five_bar(tmp_path)
    read = import_mechanism(model, loops).mechanism
    assert read.pose_space == "point"
    poses = symkin.sample_workspace(read, 10, seed=1).poses
    for base, crank, ways in zip(
        (-0.3, 0.3), (1.8, np.pi - 1.8), read.inverse_kinematics(poses).T, strict=True
    ):
        elbows = np.column_stack([np.cos(crank + ways), np.sin(crank + ways)]) * 0.3 + [base, 0]
        np.testing.assert_allclose(np.linalg.norm(poses - elbows, axis=1), rod, atol=1e-12)
    loops.write_text(loops.read_text().replace('"rod1"', '"rod3"'))
    with pytest.raises(SymkinError, match=r"loops.toml:4: loops\[1\].body: is 'rod3', no link"):
        import_mechanism(model, loops)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('["j1", "j2"]', "5", "loops.toml:1: active: is not a list"),
        ("{ y = 0.5 }", "5", "loops.toml:2: home: is not a table of values of joints"),
        ("{ y = 0.5 }", '{ y = "far" }', "loops.toml:2: home.y: "),
        ("{ y = 0.5 }", "{ z = 0.5 }", 'has home values of joint "z", which it has not'),
        ("{ y = 0.5 }", '{ y = 0.5 }\nfree = ["q"]', "free[1]: is 'q'; expected 'x' or 'y'"),
        ('other = "platform"', "", "loops.toml:3: loops[1].other: this key is missing"),
        ('other = "platform"', 'other = "platform"\ncloses = "line"', "loops[1].closes: is 'line'"),
        (", 0, 0]", ", 0]", "loops.toml:5: loops[1].point: has 2 items; expected 3"),
        (", 0, 0]", ", 0, nan]", "loops.toml:5: loops[1].point[3]: nan is not a finite number"),
    ],
)
def test_what_is_wrong_in_a_file_of_loops_is_named(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    model, loops, _ = five_bar(tmp_path)
    assert old in loops.read_text()
    loops.write_text(loops.read_text().replace(old, new, 1))
    with pytest.raises(SymkinError) as caught:
        import_mechanism(model, loops)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('type="revolute"', "", 'has <joint> "j1" without "type"'),
        ('type="revolute"', 'type="planar"', 'joint "j1" of type "planar", which is not read'),
        ('name="j1" ', "", 'has <joint> without "name"'),
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 1 0"/>', "leaves the plane of the platform"),
        ('<child link="crank1"/>', '<child link="rod1"/>', "expected one, the base"),
        ('<parent link="base"/>', '<parent link="nobody"/>', "no way from the base"),
        ("<axis", '<mimic joint="y" offset="up"/><axis', 'has "up"; expected numbers'),
    ],
)
def test_what_is_wrong_in_a_urdf_is_named(tmp_path: Path, old: str, new: str, says: str) -> None:
    model, loops, _ = five_bar(tmp_path)
    assert old in model.read_text()
    model.write_text(model.read_text().replace(old, new, 1))
    with pytest.raises(SymkinError) as caught:
        import_mechanism(model, loops)
    assert says in str(caught.value)
    assert str(model) in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('<motor joint="m1"/>', "", "no joint is read"),
        ('<motor joint="m1"/>', '<motor joint="m9"/>', 'joint "m9", which it has not'),
        ('name="e0"', 'name="e0" type="ball"', 'ball joint "e0" within a leg'),
        ("<equality>", "<equality><tendon/>", "equality <tendon>"),
        ('axis="0 0 1"', 'axis="0 0 0"', "axis 0"),
        ('pos="1.5 0 0"', 'pos="1.5 0"', 'has "1.5 0"; expected 3 numbers'),
        ('body1="b1" body2="ee"', 'body1="b1" body2="a1"', "do not hold the platform"),
        ('body1="b1" ', "", 'has <connect> without "body1"'),
        ('body1="b1" body2="ee"', 'site1="x"', "with site 'x', which it has not"),
        ('body2="ee"', 'body2="world"', 'loop "loop_1" that ends at the base'),
        ('euler="0 0 ', 'euler="0 ', "expected 3 numbers"),
        ('euler="0 0 ', 'quat="0 0 0 0" was="', "has quat 0; expected a direction"),
        ('euler="0 0 ', 'zaxis="0 0 0" was="', "has zaxis 0; expected a direction"),
        ('euler="0 0 ', 'xyaxes="1 0 0 2 0 0" was="', "has parallel xyaxes"),
        ("<worldbody>", '<compiler eulerseq="xy"/><worldbody>', 'has eulerseq "xy"'),
        ("<worldbody>", '<compiler coordinate="global"/><worldbody>', "global coordinates"),
        ('name="m2"', 'name="m2" ref="x"', 'has "x"; expected numbers'),
        ('<joint name="e1"/>', '<freejoint name="e1"/>', 'body "b1" that flies free'),
        (
            "<worldbody>",
            '<worldbody><body name="table"><joint/></body>',
            "table that do not hold",
        ),
        ("<equality>", '<equality><joint joint1="m0" joint2="e0"/>', 'follows "e0", which is not'),
        ("<equality>", '<keyframe><key qpos="0"/></keyframe><equality>', "values; expected 7"),
    ],
)
def test_what_is_not_understood_is_named(paper_model: Path, old: str, new: str, says: str) -> None:
    text = paper_model.read_text()
    assert old in text
    paper_model.write_text(text.replace(old, new, 1))
    with pytest.raises(SymkinError) as caught:
        import_mechanism(paper_model, body="ee")
    assert says in str(caught.value)
    assert str(paper_model) in str(caught.value)


def test_the_platform_is_a_body_of_the_model(paper_model: Path) -> None:
    with pytest.raises(SymkinError, match=r'no body "platform".*it has a0, b0, ee'):
        import_mechanism(paper_model)
