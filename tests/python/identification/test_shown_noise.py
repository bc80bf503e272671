# SPDX-License-Identifier: MIT
"""Noise that is not as it was declared, of one kind or along one direction, is told as that."""

import dataclasses
import re

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import Observed
from symkin.model.settings import NoiseSettings
from symkin.planning.simulation import disturb

BASE = (2.0, 1.5, -0.4, 0.4, 0.9, -0.2)
POINTS = ((0.12, 0.0, 0.03), (-0.06, 0.1, 0.03), (-0.05, -0.11, 0.05))


def measured(name, kinds, noise, seed, curvature=0.0):
    robot = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(robot, 60, seed=3).poses
    readings = disturb(robot, seed).inverse_kinematics(poses)
    readings[:, 0] += curvature * readings[:, 0] ** 2
    space, unit = robot.pose_space, robot.reading_unit
    exact = symkin.Measurements.of(poses, readings, reading_unit=unit, pose_space=space)
    flat = space == "planar"
    base = (BASE[0], BASE[1], 0.7) if flat else BASE
    points = tuple(each[: 2 if flat else 3] for each in POINTS) if kinds == ("points",) else ()
    return robot, Observed(kinds, base=base, points=points).measure(exact, noise, seed)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("name", ["3RRR", "hexapod_jugglebot"])
def test_positions_far_more_exact_than_declared_are_that_and_no_curved_sensors(name, seed):
    reading = 1e-4 if name == "hexapod_jugglebot" else 1e-5
    robot, taken = measured(name, ("points",), NoiseSettings(15e-6, 0, reading), seed)
    robot = robot.replace(noise=NoiseSettings(15e-5, 0, reading))
    (doubt,) = symkin.identify(robot, taken).doubts
    assert (doubt.code, doubt.options) == ("residuals-small", {"noise": "estimate"})
    assert re.search(r"of position 0\.(1|09)", doubt.cause)
    again = symkin.identify(robot, taken, **doubt.options)
    assert again.trustworthy
    assert again.noise.position == pytest.approx(15e-6, rel=0.15)


@pytest.mark.parametrize(
    ("name", "share", "curvature", "seed"),
    [("3RRR", 0.1, 1e-3, 1), ("3RPS", 0.3, 5e-4, 1), ("3RPS", 0.3, 5e-4, 4)],
)
def test_a_curved_sensor_is_named_where_positions_are_more_exact_than_declared(
    name, share, curvature, seed
):
    robot = symkin.load_mechanism(name)
    declared = NoiseSettings(robot.noise.position, 0, robot.noise.reading or 1e-5)
    noise = dataclasses.replace(declared, position=share * declared.position)
    robot, taken = measured(name, ("points",), noise, seed, curvature)
    found = symkin.identify(robot.replace(noise=declared), taken)
    assert "sensor-curved" in {each.code for each in found.doubts}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("axis", ["x", "z"])
def test_noise_along_an_axis_of_the_device_is_told_and_sound_once_it_is_declared(seed, axis):
    noise = NoiseSettings(1e-4, 0, 5e-5, along=5e-4, direction=axis)
    robot, taken = measured("rotary_delta", ("position",), noise, seed)
    robot = robot.replace(noise=NoiseSettings(1e-4, 0, 5e-5))
    (doubt,) = symkin.identify(robot, taken, frames=["base"]).doubts
    assert (doubt.code, doubt.options["noise"].direction) == ("noise-along", axis)
    assert doubt.size == pytest.approx(5, rel=0.3)
    assert "--noise" in doubt.remedy or "NoiseSettings" in doubt.remedy
    again = symkin.identify(robot, taken, frames=["base"], **doubt.options)
    assert again.trustworthy


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_that_is_declared_along_an_axis_is_not_told_of_legs_together(seed):
    noise = NoiseSettings(1e-4, 0, 5e-5, along=1e-3, direction="z")
    robot, taken = measured("rotary_delta", ("position",), noise, seed)
    assert symkin.identify(robot.replace(noise=noise), taken, frames=["base"]).trustworthy


def test_rows_with_deviations_of_their_own_are_not_told_of_legs_together():
    noise = NoiseSettings(1e-4, 0, 5e-5, along=1e-3, direction="z")
    robot, taken = measured("rotary_delta", ("position",), noise, 1)
    rows = np.tile([1e-4, 1e-4, 1e-3], (60, 1))
    own = dataclasses.replace(taken, pose_deviations=rows)
    plain = robot.replace(noise=NoiseSettings(1e-4, 0, 5e-5))
    assert symkin.identify(plain, own, frames=["base"]).trustworthy


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_noise_that_other_noise_hides_along_an_axis_is_not_told_of_it(seed):
    noise = NoiseSettings(2e-3, 0, 5e-5, along=1e-9, direction="z")
    robot, taken = measured("rotary_delta", ("position",), noise, seed)
    found = symkin.identify(robot, taken, frames=["base"])
    assert found.doubts
    assert all(each.code != "noise-along" or each.size > 0 for each in found.doubts)
