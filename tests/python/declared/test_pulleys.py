# SPDX-License-Identifier: MIT
"""Cables over pulleys whose axes point anywhere, with the swivel's angle as a second sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.files.declared_parts import rotation_of
from symkin.model.poses import transforms
from symkin.planning.simulation import disturb

FILE = Path(__file__).parents[3] / "mechanisms" / "declared" / "cables8_pulleys.toml"
RADIUS = 0.02


@pytest.fixture(scope="module")
def robot() -> symkin.Mechanism:
    return symkin.load_mechanism(FILE)


def joints(parameters: dict[str, float], poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Swivel and length by the closed form of a cable over a pulley, in the axis' own frame."""

    def place(end: str) -> np.ndarray:
        own = np.array([parameters[f"{end}_{axis}"] for axis in "xyz"])
        return rotation_of("z", parameters[f"{end}_azimuth"]) @ own

    axis = rotation_of("z", parameters["base_azimuth"]) @ rotation_of("y", parameters["base_pitch"])
    small = np.array([parameters["base_rx"], parameters["base_ry"], 0.0])
    angle = np.linalg.norm(small)
    x, y, z = small / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    axis = axis @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)

    platform = transforms("spatial", poses)
    ends = platform.translation + platform.rotation @ place("platform")
    w = (ends - place("base")) @ axis
    out, up = np.hypot(w[:, 0], w[:, 1]), w[:, 2]
    tangent = np.sqrt((out - RADIUS) ** 2 + up**2 - RADIUS**2)
    departs = np.arctan2(up, out - RADIUS) + np.arctan2(tangent, RADIUS)
    return np.arctan2(w[:, 1], w[:, 0]), RADIUS * (np.pi - departs) + tangent


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


def test_tilts_of_the_axes_are_identified(robot: symkin.Mechanism) -> None:
    plan = symkin.plan(robot, 24, design="mechanism", method="random", candidates=60, seed=1)
    simulation = symkin.simulate(robot, plan, 1)
    found = symkin.identify(robot, simulation.measurements)
    assert found.converged
    assert not found.unexplained
    off = (found.mechanism.parameters - simulation.actual.parameters) / found.deviations
    assert np.nanmax(np.abs(off)) < 4.5
    tilt = robot.parameter_names.index("base_rx")
    assert (found.deviations[:8, tilt] < robot.tolerances.angle).all()


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
