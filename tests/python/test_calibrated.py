# SPDX-License-Identifier: MIT
"""What is identified is a mechanism that can be written, read and used."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import symkin
from symkin import _core
from symkin.calibrated import canonical, with_usable_home
from symkin.frames import with_moved_workspace
from symkin.workspace import inside_box

Array = NDArray[np.float64]

CHAINS = [(chain, platform) for platform in ("rigid", "point") for chain in symkin.chains(platform)]


def _poses(pose_space: str, count: int, random: np.random.Generator) -> Array:
    poses = random.normal(size=(count, {"planar": 3, "point": 2, "spatial": 7}[pose_space]))
    if pose_space == "spatial":
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
    return poses


@pytest.mark.parametrize(("chain", "platform"), CHAINS)
def test_points_are_written_otherwise_without_changing_any_closure(
    chain: str, platform: str
) -> None:
    random = np.random.default_rng(1)
    names = symkin.chain_info(chain, platform).parameter_names
    count = {"planar": 3, "point": 2, "spatial": 6}[symkin.chain_info(chain, platform).pose_space]
    near = random.uniform(0.5, 2, (count, len(names)))
    values = near * random.choice([1, 1.1], near.shape)
    for index, name in enumerate(names):
        if name.endswith("_radius"):
            values[:, index] *= random.choice([-1, 1], count)
        if name.endswith(("_angle", "_azimuth")):
            values[:, index] += random.uniform(-20, 20, count)

    def made(parameters: Array) -> symkin.Mechanism:
        legs = [
            symkin.Leg(chain, dict(zip(names, row, strict=True)), 1) for row in parameters.tolist()
        ]
        return symkin.Mechanism("any", legs, platform=platform)

    written, signs = canonical(made(near), values)
    before, after = made(values), made(written)
    poses = _poses(before.pose_space, 20, random)
    readings = random.normal(size=20)
    signs = signs.reshape(values.shape)
    for leg in range(count):
        rows = [_core.linearise(each.core, leg, poses, readings) for each in (before, after)]
        assert after.closure(leg, poses, readings) == pytest.approx(
            before.closure(leg, poses, readings), abs=1e-12
        )
        assert rows[1].by_parameters * signs[leg] == pytest.approx(
            rows[0].by_parameters, abs=1e-12
        )
    assert after.inverse_kinematics(poses) == pytest.approx(
        before.inverse_kinematics(poses), abs=1e-9, nan_ok=True
    )
    for index, name in enumerate(names):
        joints = chain.replace("[", "").replace("]", "")
        if name.endswith("_radius") and joints[0 if name[0] == "b" else -1] != "P":
            assert (written[:, index] >= 0).all()
        if name.endswith(("_angle", "_azimuth")):
            assert np.abs(written[:, index] - near[:, index]).max() <= np.pi + 1e-12


def test_parameters_near_the_nominal_ones_are_left_as_they_are(hexapod: symkin.Mechanism) -> None:
    values = hexapod.parameters * 1.001
    written, signs = canonical(hexapod, values)
    assert np.array_equal(written, values)
    assert (signs == 1).all()


def _moved(mechanism: symkin.Mechanism, poses: Array, base: Array, tool: Array) -> Array:
    """Poses seen from a base frame and on a platform frame that are displaced: x, y, turn, z."""
    dx, dy, turn, dz = base
    if mechanism.pose_space == "spatial":
        turned = Rotation.from_euler("z", turn)
        orientation = turned * Rotation.from_quat(poses[:, 3:].copy())
        orientation *= Rotation.from_euler("z", tool[2]).inv()
        lever = orientation.apply([tool[0], tool[1], tool[3]])
        positions = turned.apply(poses[:, :3].copy()) + [dx, dy, dz] - lever
        return np.hstack([positions, orientation.as_quat()])
    cosine, sine = np.cos(turn), np.sin(turn)
    positions = poses[:, :2] @ np.array([[cosine, sine], [-sine, cosine]]) + [dx, dy]
    if mechanism.pose_space == "point":
        return positions
    angles = poses[:, 2] + turn - tool[2]
    positions -= np.stack(
        [
            np.cos(angles) * tool[0] - np.sin(angles) * tool[1],
            np.sin(angles) * tool[0] + np.cos(angles) * tool[1],
        ],
        axis=1,
    )
    return np.column_stack([positions, angles])


def _size(mechanism: symkin.Mechanism) -> float:
    lengths = [i for i, name in enumerate(mechanism.parameter_names) if name == "base_radius"]
    return float(np.abs(mechanism.parameters[:, lengths]).max()) if lengths else 0.3


def _seen(
    mechanism: symkin.Mechanism, count: int, base: Array, tool: Array
) -> symkin.Measurements:
    """Exact measurements in displaced frames."""
    sample = symkin.sample_workspace(mechanism, count, 1)
    return symkin.Measurements.of(_moved(mechanism, sample.poses, base, tool), sample.readings)


@pytest.mark.parametrize("name", symkin.shipped_mechanisms())
@pytest.mark.parametrize("steps", [0, 1, 6])
def test_home_and_workspace_move_with_the_frames(name: str, steps: int) -> None:
    """The same place of the platform over the base, wherever the frames are."""
    nominal = made = symkin.load_mechanism(name)
    base = _size(nominal) * np.array([0.12, -0.06, 0, 0.05])
    tool = _size(nominal) * np.array([0.08, 0.05, 0, -0.04])
    for step in range(steps + 1):
        base[2], tool[2] = 0.5 * step, 0.2 * step
        made = symkin.identify(made, _seen(nominal, 60, base, tool)).mechanism
    moved = with_moved_workspace(nominal, made)
    assert moved.workspace != nominal.workspace
    assert moved.inverse_kinematics(moved.home) == pytest.approx(
        nominal.inverse_kinematics(nominal.home), abs=1e-5
    )
    unseen = _seen(nominal, 500, base, tool)
    assert made.inverse_kinematics(unseen.poses) == pytest.approx(unseen.readings, abs=1e-5)
    inside = inside_box(moved, unseen.poses).mean()
    assert inside > 0.99
