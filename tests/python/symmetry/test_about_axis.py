# SPDX-License-Identifier: MIT
"""Files declare groups about any axis and centre, and one leg generates the others."""

import dataclasses
import math

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.measurable import measurable_symmetry
from symkin.errors import SymkinError
from symkin.model.settings import DeclaredSymmetry
from symkin.model.symmetry import generate_legs, generate_orbits, symmetry_pairs
from symkin.model.symmetry.about_axis import declared_pairs, images_about_axis
from symkin.model.symmetry.groups import declared_group

ORTHOGLIDE = """
schema = 1
name = "orthoglide"
chain = "[P]US"
platform = "translating"
reading_unit = "m"

[symmetry]
group = "C3v"
axis = [1, 1, 1]
centre = {centre}
legs = 3

[reference_leg]
working_mode = -1
distal_length = "310 mm"
base_radius = "{radius}"
base_azimuth = "{azimuth}"
base_height = 0
guide_azimuth = 0
guide_elevation = 0
guide_swing = 0
sensor_gain = 1
sensor_offset = 0

[workspace]
x = {x}
y = {y}
z = ["-70 mm", "70 mm"]
home = [{home}, 0]

[noise]
position = "0.05 mm"
orientation = 0
reading = "0.005 mm"

[tolerances]
length = "0.5 mm"
angle = "2 mrad"
gain = 1e-3
"""
ABOUT_ORIGIN = {
    "centre": "[0, 0, 0]",
    "radius": "500 mm",
    "azimuth": "180 deg",
    "x": '["-70 mm", "70 mm"]',
    "y": '["-70 mm", "70 mm"]',
    "home": "0, 0",
}
# The same with the origin off the guides, their centre at x = 0.2 m, y = 0.1 m.
OFF_GUIDES = {
    "centre": '["200 mm", "100 mm", 0]',
    "radius": "sqrt(0.1) m",
    "azimuth": "161.56505117707798 deg",
    "x": '["130 mm", "270 mm"]',
    "y": '["30 mm", "170 mm"]',
    "home": '"200 mm", "100 mm"',
}


def load(folder, **changes):
    path = folder / "robot.toml"
    path.write_text(ORTHOGLIDE.format(**(ABOUT_ORIGIN | changes)))
    return symkin.load_mechanism(path)


def test_one_leg_and_an_axis_generate_an_orthoglide(tmp_path):
    made = load(tmp_path)
    guides = [leg.parameters["guide_elevation"] for leg in made.legs]
    np.testing.assert_allclose(guides, [0, 0, math.pi / 2], atol=1e-12)
    assert made.legs[2].parameters["base_radius"] == 0
    readings = made.inverse_kinematics(np.array([[0.01, 0.02, 0.03], [0.03, 0.01, 0.02]]))
    np.testing.assert_allclose(readings[1], readings[0][[2, 0, 1]], atol=1e-12)
    found = symmetry_pairs(made)
    assert found.group_of(found.keep_modes_and_home) == "C_3v"


def test_a_mechanism_about_an_axis_is_written_and_read_back(tmp_path):
    made = load(tmp_path, **OFF_GUIDES)
    path = tmp_path / "written.toml"
    symkin.save_mechanism(made, path)
    assert symkin.load_mechanism(path) == made
    assert "axis = [1.0, 1.0, 1.0]" in path.read_text()
    assert "[reference_leg]" in path.read_text()


def test_with_its_origin_off_the_guides_an_orthoglide_is_planned_and_identified(tmp_path):
    nominal = load(tmp_path, **OFF_GUIDES)
    assert symkin.check_mechanism(nominal).undefined == ()
    planned = symkin.plan(nominal, design="orbits", pose_count=24, candidates=1000)
    simulated = symkin.simulate(nominal, planned, seed=3)
    found = symkin.identify(nominal, simulated.measurements)
    assert found.trustworthy
    apart = found.mechanism.inverse_kinematics(planned.poses)
    apart = apart - simulated.actual.inverse_kinematics(planned.poses)
    before = nominal.inverse_kinematics(planned.poses)
    before = before - simulated.actual.inverse_kinematics(planned.poses)
    assert np.abs(apart).max() < 0.2 * np.abs(before).max()


@pytest.mark.parametrize(
    "name", ["linear_delta", "rotary_delta", "hexapod_jugglebot", "hexaglide", "agile_eye"]
)
def test_a_group_that_is_turned_generates_the_turned_mechanism(name):
    upright = symkin.load_mechanism(name)
    declared = upright.symmetry
    turn = symkin_turn((0.6, -0.3, 0.2))
    whole = _core.SymmetryPair(
        _core.Isometry(turn, np.zeros(3)), _core.Isometry(turn, np.zeros(3)), False
    )
    mirror = turn @ [math.cos(declared.axis), math.sin(declared.axis), 0]
    tilted = DeclaredSymmetry(
        declared.group,
        elements=declared.elements,
        direction=tuple(turn[:, 2].tolist()),
        mirror=tuple(mirror.tolist()) if declared.group[0] == "D" else None,
    )
    (first,) = images_about_axis(upright.legs[0], upright.platform, {"q": whole}, ["q"])
    legs = generate_legs(first, tilted, len(upright.legs))
    made = symkin.Mechanism(name, legs, platform=upright.platform)
    poses = symkin.sample_workspace(upright, 10, seed=1).poses
    found = made.inverse_kinematics(whole.transform_poses(upright.core, poses))
    expected = upright.inverse_kinematics(poses)
    if upright.reading_unit == "rad":
        found, expected = np.exp(1j * found), np.exp(1j * expected)
    np.testing.assert_allclose(found, expected, atol=1e-9)


def symkin_turn(vector):
    angle = np.linalg.norm(vector)
    x, y, z = np.array(vector) / angle
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * skew + (1 - math.cos(angle)) * skew @ skew


def test_about_z_the_elements_are_those_of_the_usual_group():
    usual = DeclaredSymmetry("D3", math.radians(40))
    group = declared_group(usual)
    pairs = declared_pairs(dataclasses.replace(usual, direction=(0, 0, 2.0)))
    for element in group.elements:
        apart = _core.apart(pairs[element.label], _core.pair_of(group.core, element), 1.0)
        assert apart < 1e-12


def test_a_leg_on_a_mirror_is_not_doubled(tmp_path):
    made = load(tmp_path)
    assert len(generate_orbits([made.legs[0]], made.symmetry, "translating")) == 3


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("axis = [1, 1, 1]", "axis = [0, 0, 0]", "expected a direction that is not zero"),
        ("axis = [1, 1, 1]", "axis = [1, 1]", "has 2 values; expected 3"),
        ("axis = [1, 1, 1]", "axis = [1, 1, 1]\nmirror = [2, 2, 2]", "mirror is along axis"),
        ("axis = [1, 1, 1]", "axis = [1, 1, 1]\nlegs = 4", "legs"),
        ('"C3v"', '"C3h"', "expected C (rotations) or D"),
    ],
)
def test_what_is_no_group_about_an_axis_is_refused(tmp_path, old, new, why):
    text = ORTHOGLIDE.format(**ABOUT_ORIGIN)
    path = tmp_path / "robot.toml"
    changed = text.replace(old, new)
    path.write_text(changed.replace("legs = 3\n", "") if "legs = 4" in new else changed)
    with pytest.raises(SymkinError) as refused:
        symkin.load_mechanism(path)
    assert why in str(refused.value)


def test_listed_legs_that_lack_the_symmetry_are_refused_by_name(tmp_path):
    made = load(tmp_path)
    legs = list(made.legs)
    legs[1] = dataclasses.replace(legs[1], parameters=legs[1].parameters | {"distal_length": 0.312})
    path = tmp_path / "listed.toml"
    with pytest.raises(SymkinError, match=r"r1, turn by 120° about \(1, 1, 1\).*distal_length"):
        symkin.save_mechanism(made.replace(legs=tuple(legs)), path)


def test_in_the_plane_there_is_no_axis_to_choose(tmp_path):
    path = tmp_path / "robot.toml"
    symkin.save_mechanism(symkin.load_mechanism("3RRR"), path)
    text = path.read_text()
    path.write_text(text.replace("[symmetry]", "[symmetry]\naxis = [0, 0, 1]"))
    with pytest.raises(SymkinError, match="in the plane all symmetries are about Z"):
        symkin.load_mechanism(path)


def test_carried_poses_are_worth_less_the_more_noise_differs_between_directions(tmp_path):
    # The third guide is through the origin, where the azimuth of its leg means nothing.
    robot = load(tmp_path)
    poses = symkin.sample_workspace(robot, 300, seed=1).poses
    worth = []
    for times in (1, 2, 3, 10):
        along = times * robot.noise.position
        noise = dataclasses.replace(robot.noise, along=along, direction="z")
        worth.append(measurable_symmetry(robot.replace(noise=noise), poses).efficiency)
    assert worth[0] == pytest.approx(1)
    assert np.all(np.diff(worth) < 0)
    assert worth[1] > 0.95
    assert 0.3 < worth[3] < 0.6
    robot = load(tmp_path, **OFF_GUIDES).replace(noise=noise)
    words = "The noise is not the same at the images of a pose"
    assert any(each.startswith(words) for each in symkin.check_mechanism(robot).page().notes)
    planned = symkin.plan(robot, 12, candidates=300)
    assert planned.basis.design == "mechanism"
    assert any(each.startswith(words) for each in planned.page().notes)
