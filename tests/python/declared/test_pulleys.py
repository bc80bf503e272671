# SPDX-License-Identifier: MIT
"""Cables over pulleys whose axes point anywhere, with the swivel's angle as a second sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.conventions import rotations_from_angles
from symkin.errors import MechanismFileError
from symkin.model.poses import transforms
from symkin.planning.simulation import disturb

FILE = Path(__file__).parents[3] / "mechanisms" / "declared" / "cables8_pulleys.toml"


@pytest.fixture(scope="module")
def robot() -> symkin.Mechanism:
    return symkin.load_mechanism(FILE)


def joints(parameters: dict[str, float], poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Swivel and length by the closed form of a cable over a pulley, in the axis' own frame."""

    def turn(pitch: float, yaw: float) -> np.ndarray:
        return rotations_from_angles(np.array([[0.0, pitch, yaw]]), "xyz")[0]

    def place(end: str) -> np.ndarray:
        own = np.array([parameters[f"{end}_{axis}"] for axis in "xyz"])
        return turn(0.0, parameters[f"{end}_azimuth"]) @ own

    radius = parameters["pulley_x"]
    axis = turn(parameters["base_pitch"], parameters["base_azimuth"])
    small = np.array([parameters["base_rx"], parameters["base_ry"], 0.0])
    angle = np.linalg.norm(small)
    x, y, z = small / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    axis = axis @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)

    platform = transforms("spatial", poses)
    ends = platform.translation + platform.rotation @ place("platform")
    w = (ends - place("base")) @ axis
    out, up = np.hypot(w[:, 0], w[:, 1]), w[:, 2]
    tangent = np.sqrt((out - radius) ** 2 + up**2 - radius**2)
    departs = np.arctan2(up, out - radius) + np.arctan2(tangent, radius)
    return np.arctan2(w[:, 1], w[:, 0]), radius * (np.pi - departs) + tangent


def test_readings_are_those_of_the_closed_form_about_each_axis(robot: symkin.Mechanism) -> None:
    made = disturb(robot, seed=2)
    poses = symkin.sample_workspace(robot, 20, seed=1).poses
    readings = made.inverse_kinematics(poses)
    for leg in range(8):
        swivel, length = made.legs[leg], made.legs[leg + 8]
        by_hand = joints(dict(swivel.parameters), poses)
        for one, column, expected in zip((swivel, length), (leg, leg + 8), by_hand, strict=True):
            p = one.parameters
            shown = p["sensor_gain"] * readings[:, column] + p["sensor_offset"] - expected
            turns = 2 * np.pi * np.round(shown / (2 * np.pi))
            np.testing.assert_allclose(shown - turns, 0, atol=1e-11)


def test_tilts_and_radii_are_identified_and_saved(robot: symkin.Mechanism, tmp_path: Path) -> None:
    tilt, radius = map(robot.parameter_names.index, ("base_rx", "pulley_x"))
    plan = symkin.plan(robot, 24, design="mechanism", method="random", candidates=60, seed=1)
    values = disturb(robot, seed=1).parameters.copy()
    values[:, radius] += 0.01
    actual = robot.with_parameters(values)
    simulation = symkin.simulate(robot, plan, 1, actual)
    found = symkin.identify(robot, simulation.measurements)
    assert found.converged
    assert not found.unexplained
    off = (found.mechanism.parameters - actual.parameters) / found.deviations
    assert np.nanmax(np.abs(off)) < 4.5
    assert (found.deviations[:8, tilt] < robot.tolerances.angle).all()
    assert (found.deviations[:4, radius] < robot.tolerances.length).all()
    path = tmp_path / "calibrated.toml"
    found.mechanism.save(path)
    again = symkin.load_mechanism(path)
    np.testing.assert_array_equal(again.parameters, found.mechanism.parameters)
    readings = found.mechanism.inverse_kinematics(plan.poses)
    np.testing.assert_array_equal(again.inverse_kinematics(plan.poses), readings)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("-pulley_x wrap", "-puley_x wrap", r"path\[7\]: names puley_x.*mean \"pulley_x\""),
        ('"-pulley_x"', '"-puley_x"', r"path\[5\].x: names puley_x.*mean \"pulley_x\""),
        ("-pulley_x wrap", "-base_x wrap", "base_x belongs to the base"),
        ('x = "0.2 m"', 'x = "10 pulley_x"', "platform_x belongs to the platform"),
        ("P z = -pulley_x", "R z = -pulley_x", "a length, for its ratio"),
        ('"-pulley_x" }', '"-pulley_x", exact = ["x"] }', "names another number"),
        ('"-pulley_x" }', '"-pulley_x", errors = ["x"] }', "names another number"),
    ],
)
def test_a_number_that_cannot_be_named_is_refused(
    old: str, new: str, told: str, tmp_path: Path
) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(FILE.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(MechanismFileError, match=told):
        symkin.load_mechanism(path)


def test_without_encoders_on_the_swivels_the_lengths_are_the_same(
    robot: symkin.Mechanism, tmp_path: Path
) -> None:
    text = FILE.read_text(encoding="utf-8").replace("swivel: [R]", "swivel: R")
    path = tmp_path / "lengths.toml"
    path.write_text(text.replace('{ length = "50 mm/rad" }', '"50 mm/rad"'), encoding="utf-8")
    lengths = symkin.load_mechanism(path)
    poses = symkin.sample_workspace(robot, 5, seed=1).poses
    both = robot.inverse_kinematics(poses)
    np.testing.assert_allclose(lengths.inverse_kinematics(poses), both[:, 8:], atol=1e-9)
