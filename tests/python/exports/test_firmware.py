# SPDX-License-Identifier: MIT
"""Firmware that is told what was written commands the robot as well as it says.

The consumers are the firmwares' own formulas: Klipper's klippy/kinematics/delta.py and
rotary_delta.py, Marlin's src/module/delta.cpp, RepRapFirmware's LinearDeltaKinematics.cpp,
LinuxCNC's lineardeltakins and genhexkins.
"""

from __future__ import annotations

import configparser
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

import symkin
from symkin.errors import SymkinError
from symkin.model.poses import rotations_from_quaternions

Array = NDArray[np.float64]

END = 0.42  # reading at the endstops, m
LINEAR = ("klipper", "marlin", "reprapfirmware", "linuxcnc")


@dataclass
class Firmware:
    """Towers (mm, degrees) and carriages as the firmwares compute with them."""

    radius: float
    angles: Array
    rods: Array
    stops: Array  # height of each carriage at its endstop
    gains: Array  # by which the drive's way is multiplied, as the notes say
    order: tuple[int, ...] = (0, 1, 2)  # leg of each tower

    def carriages(self, points: Array) -> Array:
        angles = np.radians(self.angles)
        towers = self.radius * np.column_stack([np.cos(angles), np.sin(angles)])
        away = ((points[:, None, :2] - towers) ** 2).sum(axis=2)
        return points[:, 2:] + np.sqrt(self.rods**2 - away)

    def readings(self, poses: Array) -> Array:
        """What our sensors show, m, when the firmware goes to poses, m."""
        ways = (self.carriages(poses * 1e3) - self.stops) * 1e-3 / self.gains
        found = np.empty_like(ways)
        found[:, list(self.order)] = ways + END
        return found


def klipper(text: str) -> Firmware:
    config = configparser.ConfigParser()
    config.read_string(text)
    radius = float(config["printer"]["delta_radius"])
    towers = [config[f"stepper_{tower}"] for tower in "abc"]
    angles, rods, heights = (
        np.array([float(tower[name]) for tower in towers])
        for name in ("angle", "arm_length", "position_endstop")
    )
    stops = heights + np.sqrt(rods**2 - radius**2)
    return Firmware(
        radius, angles, rods, stops, told(text, r"stepper_(\w): multiply \w+ by", "abc")
    )


def words(text: str, command: str) -> dict[str, str]:
    line = re.search(rf"^{command} (.*)$", text, re.MULTILINE)
    assert line
    return {word[0]: word[1:] for word in line[1].split()}


def told(text: str, pattern: str, names: str) -> Array:
    """Factors that the notes name."""
    found = {name: float(value) for name, value in re.findall(rf"{pattern} ([\d.]+)", text)}
    return np.array([found.get(name, 1.0) for name in names])


def marlin(text: str) -> Firmware:
    shape, stops = words(text, "M665"), words(text, "M666")
    radius, height = float(shape["R"]), float(shape["H"])
    rods = float(shape["L"]) + np.array([float(shape.get(trim, 0)) for trim in "ABC"])
    angles = np.array([210, 330, 90]) + [float(shape[trim]) for trim in "XYZ"]
    # After homing the carriages come down by the correction, and then the nozzle is at H.
    corrections = np.array([float(stops[axis]) for axis in "XYZ"])
    assert (corrections <= 0).all()  # or Marlin refuses it
    homed = height + np.sqrt(rods**2 - radius**2) - corrections
    gains = told(text, r"([XYZ]): divide its steps per mm \(M92\) by", "XYZ")
    return Firmware(radius, angles, rods, homed, gains)


def reprapfirmware(text: str) -> Firmware:
    shape, stops = words(text, "M665"), words(text, "M666")
    radius, height = float(shape["R"]), float(shape["H"])
    rods = np.array([float(rod) for rod in shape["L"].split(":")])
    a, b, c = (np.radians(float(shape[trim])) for trim in "XYZ")
    thirty = np.radians(30)
    x = [-np.cos(thirty + a), np.cos(thirty - b), -np.sin(c)]
    y = [-np.sin(thirty + a), -np.sin(thirty - b), np.cos(c)]
    corrections = np.array([float(stops[axis]) for axis in "XYZ"])
    assert corrections.mean() == pytest.approx(0, abs=1e-5)
    homed = height + np.sqrt(rods**2 - radius**2) + corrections
    gains = told(text, r"([XYZ]): divide its steps per mm \(M92\) by", "XYZ")
    return Firmware(radius, np.degrees(np.arctan2(y, x)), rods, homed, gains)


def linuxcnc(text: str) -> Firmware:
    radius, rod = (
        float(re.search(rf"setp lineardeltakins.{name} (\S+)", text)[1]) for name in "RL"
    )
    homed = np.array([float(each) for each in re.findall(r"HOME_OFFSET = (\S+)", text)])
    legs = tuple(int(leg) - 1 for leg in re.findall(r"Joint \d is leg (\d)", text))
    gains = told(text, r"Joint (\d): divide its SCALE by", "012")
    return Firmware(radius, np.array([90.0, 210, 330]), np.full(3, rod), homed, gains, legs)


CONSUMERS = {
    "klipper": klipper,
    "marlin": marlin,
    "reprapfirmware": reprapfirmware,
    "linuxcnc": linuxcnc,
}


@pytest.mark.parametrize("to", LINEAR)
def test_firmware_commands_the_drawn_robot_as_our_inverse_kinematics_does(to: str) -> None:
    robot = symkin.load_mechanism("linear_delta")
    made = symkin.export(robot, to, endstops=END)
    sample = symkin.sample_workspace(robot, 500)
    found = CONSUMERS[to](made.text).readings(sample.poses)
    np.testing.assert_allclose(found, sample.readings, rtol=0, atol=2e-9)
    assert made.loss is not None
    assert made.loss.position_max < 2e-9


@pytest.mark.parametrize("to", LINEAR)
def test_a_robot_that_firmware_cannot_express_errs_as_much_as_is_said(
    to: str, made: Callable
) -> None:
    robot = made("linear_delta")
    written = symkin.export(robot, to, endstops=END)
    poses = symkin.sample_workspace(robot, 2000, seed=5).poses
    taken, converged = robot.forward_kinematics(CONSUMERS[to](written.text).readings(poses), poses)
    assert converged.all()
    errors = np.linalg.norm(taken - poses, axis=1)
    assert written.loss is not None
    # The corners of the workspace are among the poses that the figures are of.
    assert 0.7 * written.loss.position_max < errors.max() <= 1.01 * written.loss.position_max
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(written.loss.position_rms, rel=0.05)


def test_a_format_with_fewer_values_loses_more(made: Callable) -> None:
    losses = {to: symkin.export(made("linear_delta"), to, endstops=END).loss for to in LINEAR}
    assert losses["klipper"] == losses["marlin"] == losses["reprapfirmware"]
    assert losses["linuxcnc"].position_rms > 1.2 * losses["klipper"].position_rms


def test_the_values_are_the_nearest(made: Callable) -> None:
    """Whatever else is told errs more, in the mean of the squares."""
    robot = made("linear_delta")
    firmware = klipper(symkin.export(robot, "klipper", endstops=END).text)
    poses = symkin.sample_workspace(robot, 2000, seed=1).poses

    def rms(changed: Firmware) -> float:
        taken, _ = robot.forward_kinematics(changed.readings(poses), poses)
        return float(np.sqrt(np.mean((taken - poses) ** 2)))

    least = rms(firmware)
    for name in ("radius", "angles", "rods", "stops"):
        for step in (-0.2, 0.2):
            values = {**vars(firmware), name: getattr(firmware, name) + step}
            assert rms(Firmware(**values)) > 1.01 * least


def test_own_rods_angles_and_endstops_are_no_loss_and_one_radius_is() -> None:
    robot = symkin.load_mechanism("linear_delta")
    values = robot.parameters.copy()
    names = robot.parameter_names
    values[:, names.index("distal_length")] += [1e-3, -5e-4, 0]
    values[:, names.index("base_azimuth")] += [5e-3, -1e-2, 2e-3]
    values[:, names.index("sensor_offset")] += [3e-3, 0, -2e-3]
    values[:, names.index("sensor_gain")] *= [1.01, 0.99, 1]
    robot = robot.replace(symmetry=None).with_parameters(values)
    for to in ("klipper", "marlin", "reprapfirmware"):
        assert symkin.export(robot, to, endstops=END).loss.position_max < 5e-9
    assert symkin.export(robot, "linuxcnc", endstops=END).loss.position_max > 1e-4
    values[:, names.index("base_radius")] += [1e-3, 0, 0]
    robot = robot.with_parameters(values)
    assert symkin.export(robot, "klipper", endstops=END).loss.position_max > 1e-4


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2)])
def test_legs_in_any_order_stand_where_they_stand(order: tuple[int, ...]) -> None:
    robot = symkin.load_mechanism("linear_delta")
    robot = robot.replace(legs=[robot.legs[leg] for leg in order], symmetry=None)
    sample = symkin.sample_workspace(robot, 50)
    for to in LINEAR:
        found = CONSUMERS[to](symkin.export(robot, to, endstops=END).text)
        np.testing.assert_allclose(found.readings(sample.poses), sample.readings, atol=2e-9)


def rotary(text: str) -> tuple[Array, ...]:
    """Shoulder radius and height, angles, both arms, heights at the endstops; mm, rad."""
    config = configparser.ConfigParser()
    config.read_string(text)
    shoulder = [float(config["printer"][f"shoulder_{each}"]) for each in ("radius", "height")]
    names = ("angle", "upper_arm_length", "lower_arm_length", "position_endstop")
    columns = [[float(config[f"stepper_{tower}"][name]) for tower in "abc"] for name in names]
    return (np.array(shoulder), np.radians(columns[0]), *map(np.array, columns[1:]))


def elbows(raised: Array, shoulder: Array, angles: Array, upper: Array) -> Array:
    """Shape (N, 3 arms, 3), mm, of arms raised by these angles."""
    out = shoulder[0] + upper * np.cos(raised)
    height = shoulder[1] + upper * np.sin(raised)
    return np.stack([out * np.cos(angles), out * np.sin(angles), height], axis=-1)


def test_klipper_finds_the_elbows_of_a_rotary_delta_an_arm_away_from_its_nozzle() -> None:
    robot = symkin.load_mechanism("rotary_delta")
    written = symkin.export(robot, "klipper", endstops=-0.5)
    shoulder, angles, upper, lower, heights = rotary(written.text)
    sample = symkin.sample_workspace(robot, 200)
    shift = float(re.search(r"z here \+ (\S+) mm", written.text)[1])
    points = sample.poses * 1e3 + [0, 0, shift]
    # A crank of ours turns down with a rising reading, one of Klipper's up.
    ends = elbows(-sample.readings, shoulder, angles, upper)
    rods = np.linalg.norm(ends - points[:, None, :], axis=2)
    np.testing.assert_allclose(rods, np.tile(lower, (200, 1)), atol=5e-6)
    at_stop = elbows(np.full((1, 3), 0.5), shoulder, angles, upper)[0]
    nozzles = np.stack([np.zeros(3), np.zeros(3), heights], axis=1)
    np.testing.assert_allclose(np.linalg.norm(at_stop - nozzles, axis=1), lower, atol=5e-6)
    assert (heights < at_stop[:, 2]).all()


def test_a_rotary_delta_that_klipper_commands_errs_as_much_as_is_said(made: Callable) -> None:
    robot = made("rotary_delta")
    written = symkin.export(robot, "klipper", endstops=-0.5)
    shoulder, angles, upper, lower, heights = rotary(written.text)
    shift = float(re.search(r"z here \+ (\S+) mm", written.text)[1])
    gains = told(written.text, r"stepper_(\w): divide its gear_ratio by", "abc")

    def raised(points: Array) -> Array:
        """Angles of the arms at points, mm: elbows outwards, in the plane of each arm."""
        along = points[:, :1] * np.cos(angles) + points[:, 1:2] * np.sin(angles) - shoulder[0]
        across = points[:, 1:2] * np.cos(angles) - points[:, :1] * np.sin(angles)
        up = points[:, 2:] - shoulder[1]
        far = np.hypot(along, up)
        cosine = (upper**2 + far**2 - lower**2 + across**2) / (2 * upper * far)
        return np.arctan2(up, along) + np.arccos(cosine)

    homed = np.array(
        [raised(np.array([[0, 0, height]]))[0, arm] for arm, height in enumerate(heights)]
    )
    poses = symkin.sample_workspace(robot, 2000, seed=5).poses
    # A crank of ours turns down with a rising reading.
    readings = -0.5 - (raised(poses * 1e3 + [0, 0, shift]) - homed) / gains
    taken, converged = robot.forward_kinematics(readings, poses)
    assert converged.all()
    errors = np.linalg.norm(taken - poses, axis=1)
    assert written.loss is not None
    assert 0.7 * written.loss.position_max < errors.max() <= 1.01 * written.loss.position_max
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(written.loss.position_rms, rel=0.05)
    # Less than a sixth of what the drawing's parameters leave.
    drawn = symkin.evaluate(symkin.load_mechanism("rotary_delta"), actual=robot, poses=poses)
    assert written.loss.position_rms < drawn.position_rms / 6


def test_genhexkins_has_the_strut_lengths_of_a_hexapod(made: Callable) -> None:
    robot = made("hexapod_jugglebot")
    written = symkin.export(robot, "linuxcnc")
    assert written.loss is None
    pins = dict(re.findall(r"^setp genhexkins\.(\S+) (\S+)$", written.text, re.MULTILINE))
    base, platform = (
        np.array([[float(pins[f"{end}.{strut}.{axis}"]) for axis in "xyz"] for strut in range(6)])
        for end in ("base", "platform")
    )
    sample = symkin.sample_workspace(robot, 100)
    turns = rotations_from_quaternions(sample.poses[:, 3:])
    ends = sample.poses[:, None, :3] * 1e3 + np.einsum("nij,kj->nki", turns, platform)
    lengths = np.linalg.norm(ends - base, axis=2)
    lines = re.findall(r"JOINT_\d\] mm = (\S+) \* reading in rad \+ (\S+)", written.text)
    gain, offset = np.array(lines, dtype=float).T
    np.testing.assert_allclose(gain * sample.readings + offset, lengths, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "to", "words"),
    [
        ("3RRR", "klipper", '"3RRR" has 3 legs [R]RR, planar'),
        ("5bar", "marlin", "linear deltas, 3 legs [P]US"),
        ("hexaglide", "reprapfirmware", "has 6 legs [P]US, spatial"),
        ("rotary_delta", "marlin", "has 3 legs [R]US, translating"),
        ("hexa", "klipper", "rotary deltas, 3 legs [R]US with a translating platform"),
        ("3RRR", "linuxcnc", "hexapods, 6 legs U[P]S"),
        ("linear_delta", "klipper", 'endstops of "linear_delta" are is not known'),
    ],
)
def test_a_robot_that_does_not_fit_is_refused_in_words(name: str, to: str, words: str) -> None:
    with pytest.raises(SymkinError, match=re.escape(words)):
        symkin.export(symkin.load_mechanism(name), to)


def changed(name: str, value: float, leg: int = 1) -> symkin.Mechanism:
    robot = symkin.load_mechanism("linear_delta").replace(symmetry=None)
    values = robot.parameters.copy()
    values[leg, robot.parameter_names.index(name)] = value
    return robot.with_parameters(values)


def test_a_delta_that_firmware_does_not_know_is_refused_in_words() -> None:
    with pytest.raises(SymkinError, match="upright towers"):
        symkin.export(changed("guide_elevation", 1.2), "klipper", endstops=END)
    with pytest.raises(SymkinError, match="leg 2 has sensor_gain -1; expected a positive"):
        symkin.export(changed("sensor_gain", -1.0), "marlin", endstops=END)
    with pytest.raises(SymkinError, match=r"endstop of leg 1 is at 420 m, .* Say its unit"):
        symkin.export(changed("sensor_gain", 1.001), "marlin", endstops=1e3 * END)
    with pytest.raises(SymkinError, match=r"endstop of leg 2 is at -0.42 m, .* near the upper end"):
        symkin.export(changed("sensor_gain", 1.001), "marlin", endstops=[END, -END, END])
    crank = symkin.load_mechanism("rotary_delta")
    with pytest.raises(SymkinError, match=r"endstop of leg 1 is at -30 rad, .* near the lower end"):
        symkin.export(crank, "klipper", endstops=-30)
    with pytest.raises(SymkinError, match="2 endstops; expected one for all legs, or 3"):
        symkin.export(changed("sensor_gain", 1.001), "marlin", endstops=[0.4, 0.4])
    turned = symkin.load_mechanism("linear_delta").replace(symmetry=None)
    values = turned.parameters.copy()
    values[:, turned.parameter_names.index("base_azimuth")] += 1
    with pytest.raises(SymkinError, match="stand at 90, 210 and 330 degrees"):
        symkin.export(turned.with_parameters(values), "linuxcnc", endstops=END)
    with pytest.raises(SymkinError, match="has no workspace"):
        symkin.export(turned.replace(workspace=None), "klipper", endstops=END)


def test_the_joint_limit_is_the_endstop_if_nothing_else_is_said() -> None:
    robot = symkin.load_mechanism("linear_delta")
    limits = symkin.model.settings.JointLimits(upper=0.42)
    written = symkin.export(robot.replace(joint_limits=limits), "klipper")
    assert written.text == symkin.export(robot, "klipper", endstops=[0.42] * 3).text
