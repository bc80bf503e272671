# SPDX-License-Identifier: MIT
"""Cables over pulleys of given radius: the whole protocol, and the radius freed by name."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.errors import MechanismFileError
from symkin.files.template import mechanism_template
from symkin.show.skeleton import joints_of

CHAIN = "U[P]S pulley"


@pytest.fixture(scope="module", params=["translating", "rigid"])
def robot(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("pulley") / "robot.toml"
    path.write_text(mechanism_template(CHAIN, platform=request.param))
    made = symkin.load_mechanism(path)
    return made.replace(protocol=dataclasses.replace(made.protocol, candidates=2000))


@pytest.fixture(scope="module")
def taken(robot):
    return robot.simulate(robot.plan(60), seed=3).measurements.for_all_legs()


def radii(mechanism):
    return mechanism.parameters[:, mechanism.parameter_names.index("pulley_radius")]


def test_a_robot_is_identified_with_its_radius_as_given(robot, taken):
    assert "pulley_radius" not in robot.estimated_names(0)
    assert robot.held == ((),) * len(robot.legs)
    found = symkin.identify(robot, taken)
    assert not found.doubts
    assert (radii(found.mechanism) == 0.02).all()
    without = robot.with_parameters(np.where(robot.parameters == 0.02, 0.0, robot.parameters))
    assert symkin.identify(without, taken).doubts


def test_the_radius_can_be_freed_by_name_and_is_written_with_its_deviation(robot, taken, tmp_path):
    free = ["base_*", "platform_*", "sensor_*", "pulley_radius"]
    free = [each for each in free if robot.platform == "rigid" or each != "platform_*"]
    found = symkin.identify(robot, taken, free=free)
    own = [each for each in found.unknowns if each.name.endswith("pulley_radius")]
    assert all(each.status == "free" for each in own)
    deviations = np.array([each.deviation for each in own])
    assert (np.abs(radii(found.mechanism) - 0.02) < 4 * deviations).all()
    assert (deviations < 0.02).all()
    found.write(tmp_path / "out")
    read = symkin.load_mechanism(tmp_path / "out" / "calibrated.toml")
    assert read == found.mechanism
    column = read.parameter_names.index("pulley_radius")
    assert read.deviations[:, column] == pytest.approx(deviations)


def test_a_drawing_has_the_joints_of_a_cable(robot):
    assert [(each.kind, each.actuated) for each in joints_of(robot.chain)] == [
        ("U", False),
        ("P", True),
        ("S", False),
    ]


def test_a_negative_radius_is_refused(tmp_path):
    path = tmp_path / "robot.toml"
    text = mechanism_template(CHAIN, platform="translating")
    path.write_text(text.replace('pulley_radius = "20 mm"', "pulley_radius = -0.02"))
    with pytest.raises(MechanismFileError, match=r"pulley_radius.*not negative"):
        symkin.load_mechanism(path)
