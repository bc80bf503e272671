# SPDX-License-Identifier: MIT
"""The example mechanisms against loop closures that are written here, joint by joint."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import symkin
from symkin.planning.simulation import disturb

Array = NDArray[np.float64]
Closure = Callable[[Mapping[str, float], float, Array, Array], Array]
FOLDER = Path(__file__).parents[3] / "mechanisms" / "declared"


def turn(axis: str, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    rows = {
        "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
        "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
        "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
    }
    matrix = np.eye(4)
    matrix[:3, :3] = rows[axis]
    return matrix


def move(*by: float) -> Array:
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return matrix


def small(vector: Array) -> Array:
    """A rotation vector's matrix by its series."""
    x, y, z = vector
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix, term = np.eye(4), np.eye(3)
    for order in range(1, 25):
        term = term @ skew / order
        matrix[:3, :3] += term
    return matrix


def fixed(p: Mapping[str, float], name: str) -> Array:
    """A transform by its numbers, zero where there are none."""

    def number(key: str) -> float:
        return float(p.get(f"{name}_{key}", 0.0))

    return (
        turn("z", number("azimuth"))
        @ move(number("x"), number("y"), number("z"))
        @ turn("z", number("yaw"))
        @ turn("y", number("pitch"))
        @ turn("x", number("roll"))
        @ small(np.array([number("rx"), number("ry"), number("rz")]))
    )


def frames_apart(left: Array, right: Array) -> Array:
    between = left[:3, :3] @ right[:3, :3].T
    skew = [between[2, 1] - between[1, 2], between[0, 2] - between[2, 0]]
    return np.array([*(left - right)[:3, 3], *skew, between[1, 0] - between[0, 1]])


def pose_matrix(pose: Array) -> Array:
    if len(pose) == 4:
        return move(*pose[:3]) @ turn("z", pose[3])
    if len(pose) == 3:
        return move(*pose)
    x, y, z, w = pose[3:]
    angle = 2 * np.arctan2(np.linalg.norm(pose[3:6]), w)
    length = np.linalg.norm(pose[3:6])
    vector = np.array([x, y, z]) * (angle / length if length > 0 else 2.0)
    return move(*pose[:3]) @ small(vector)


def upu(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:
    a, b, c, d = passive
    left = fixed(p, "base") @ turn("x", a) @ turn("y", b) @ fixed(p, "foot") @ move(0, 0, q)
    left = left @ fixed(p, "head") @ turn("y", c) @ turn("x", d)
    return frames_apart(left, pose_matrix(pose) @ fixed(p, "platform"))


def orthoglide(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:
    first, a, _ = passive
    left = fixed(p, "turn") @ fixed(p, "base") @ move(q, 0, 0) @ turn("y", first) @ turn("z", a)
    left = left @ fixed(p, "rod") @ turn("z", -a) @ fixed(p, "end")
    right = pose_matrix(pose) @ fixed(p, "platform_turn") @ fixed(p, "platform")
    return np.asarray((left - right)[:3, 3])


def tripteron(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:
    left = fixed(p, "turn") @ fixed(p, "base") @ move(q, 0, 0) @ turn("x", passive[0])
    left = left @ fixed(p, "proximal") @ turn("x", passive[1]) @ fixed(p, "distal")
    right = pose_matrix(pose) @ fixed(p, "platform_turn") @ fixed(p, "platform")
    return np.asarray((left - right)[:3, 3])


def orthoglide_rods(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:  # noqa: ARG001
    guide = fixed(p, "turn") @ fixed(p, "base") @ move(q, 0, 0)
    platform = pose_matrix(pose) @ fixed(p, "platform_turn")
    return np.array([
        np.linalg.norm((guide @ fixed(p, f"{rod}_at") - platform @ fixed(p, f"{rod}_end"))[:3, 3])
        - p[f"{rod}_length"]
        for rod in ("left", "right")
    ])  # fmt: skip


def four_bar(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:
    rocker, elbow, end, coupler = passive
    base = fixed(p, "base")
    left = base @ turn("z", rocker) @ fixed(p, "proximal") @ turn("z", elbow) @ fixed(p, "distal")
    platform = move(pose[0], pose[1], 0) @ turn("z", pose[2]) @ fixed(p, "platform")
    crank = base @ fixed(p, "motor") @ turn("z", q) @ fixed(p, "crank") @ turn("z", coupler)
    lug = base @ turn("z", rocker) @ fixed(p, "lug")
    ends = (crank @ fixed(p, "coupler") - lug)[:2, 3]
    whole = frames_apart(left @ turn("z", end), platform)
    return np.array([*whole[:2], whole[5], *ends])


def gough(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:
    left = fixed(p, "base") @ turn("x", passive[0]) @ fixed(p, "cross") @ turn("y", passive[1])
    left = left @ fixed(p, "strut") @ move(0, 0, q) @ fixed(p, "rod")
    return np.asarray((left - pose_matrix(pose) @ fixed(p, "platform"))[:3, 3])


def h4(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:
    left = fixed(p, "base") @ turn("y", q) @ fixed(p, "crank")
    left = left @ turn("z", passive[0]) @ turn("y", passive[1]) @ fixed(p, "rod")
    right = pose_matrix(pose) @ fixed(p, "bar") @ turn("z", -pose[3]) @ fixed(p, "plate")
    return np.asarray((left - right)[:3, 3])


def cable(p: Mapping[str, float], q: float, passive: Array, pose: Array) -> Array:  # noqa: ARG001
    apart = fixed(p, "cable_at") - pose_matrix(pose) @ fixed(p, "cable_end")
    return np.array([np.linalg.norm(apart[:3, 3]) - q])


def least_residual(closure: Callable[[Array], Array], passive: Array) -> float:
    """How near passive joints come to closing a leg, by Gauss-Newton with differences."""
    if not len(passive):
        return float(np.abs(closure(passive)).max())
    for _ in range(40):
        at = closure(passive)
        if np.abs(at).max() < 1e-13:
            break
        steps = np.eye(len(passive)) * 1e-6
        columns = [(closure(passive + e) - closure(passive - e)) / 2e-6 for e in steps]
        step = np.linalg.lstsq(np.stack(columns, axis=1), at, rcond=1e-6)[0]
        passive = passive - step * min(1, 0.5 / max(np.abs(step).max(), 1e-9))
    return float(np.abs(closure(passive)).max())


CASES: dict[str, tuple[Closure, list[float]]] = {
    "3UPU": (upu, [0.0, 0.0, 0.0, 0.0]),
    "orthoglide": (orthoglide, [0.0, 0.0, 0.0]),
    "orthoglide_rods": (orthoglide_rods, []),
    "tripteron": (tripteron, [1.5, -1.7]),
    "3RRR_four_bar": (four_bar, [2.6, 1.05, -1.05, 1.0]),
    "gough_imperfect": (gough, [0.0, 0.0]),
    "h4": (h4, [0.0, 0.5]),
    "cables4": (cable, []),
}


@pytest.mark.parametrize("name", sorted(CASES))
def test_readings_close_a_loop_that_is_written_independently(name: str) -> None:
    closure, start = CASES[name]
    mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
    poses = symkin.sample_workspace(mechanism, 3, seed=1).poses
    robot = disturb(mechanism, seed=6)
    if mechanism.closures > 1:  # poses that the disturbed legs allow
        readings = mechanism.inverse_kinematics(poses)
        poses, _ = robot.forward_kinematics(readings, mechanism.home)
    readings = robot.inverse_kinematics(poses)
    for leg in range(len(robot.legs)):
        p = dict(zip(robot.parameter_names, robot.parameters[leg], strict=True))
        for pose, reading in zip(poses, readings[:, leg], strict=True):
            q = p["sensor_gain"] * reading + p["sensor_offset"]
            sign = p["hand"]
            starts = np.array(start) * (
                np.array([-1, 1]) if sign < 0 and name == "gough_imperfect" else 1
            )
            found = min(
                least_residual(
                    lambda passive, p=p, q=q, pose=pose: closure(p, q, passive, pose), first
                )
                for first in (starts, starts + 0.3, starts - 0.3)
            )
            assert found < 1e-12
