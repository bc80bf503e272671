# SPDX-License-Identifier: MIT
"""What a page's script draws a mechanism from is what the core says, and small."""

import json
from pathlib import Path

import numpy as np
import pytest

import symkin
from symkin.analysis.workspace import inside_workspace
from symkin.model.poses import poses_from_bounds, rotations_from_quaternions
from symkin.model.settings import WorkspaceSettings
from symkin.show.mechanism import movable

ALPHABET = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
MECHANISMS = sorted(path.stem for path in (Path(__file__).parents[3] / "mechanisms").glob("*.toml"))


def made(chain):
    """Three legs of a chain, with a box about a home that they reach."""
    info = symkin.chain_info(chain)
    values = {"proximal_length": 0.3, "distal_length": 0.35, "guide_offset": 0.03}
    values |= {"base_radius": 0.4, "platform_radius": 0.1, "sensor_gain": 1.0}
    legs = []
    for leg in range(3):
        azimuth = 2 * np.pi * leg / 3
        angles = {"base_angle": azimuth, "platform_angle": azimuth + 0.9, "sensor_offset": 0.1}
        given = {name: (values | angles)[name] for name in info.parameter_names}
        legs.append(symkin.Leg(chain, given))
    lower, upper = (-0.1, -0.1, -0.2), (0.1, 0.1, 0.3)
    box = WorkspaceSettings(lower=lower, upper=upper, home=(0.01, 0.0, 0.05))
    return symkin.Mechanism(chain, legs, workspace=box)


PLANAR = [chain for chain in symkin.chains() if symkin.chain_info(chain).pose_space == "planar"]


def decoded(data):
    """Of every node: state, condition, inner joints of each leg, coordinates that the legs bind."""
    text = np.array([ALPHABET.index(each) for each in data["nodes"]])
    dimensions = data["dimensions"]
    joints = dimensions * sum(data["inner"])
    rows = text.reshape(-1, 3 + 2 * (joints + len(data["bound"])))
    pairs = rows[:, 1::2] * 64 + rows[:, 2::2]
    numbers = np.where(pairs == 4095, np.nan, pairs)
    inner = numbers[:, 1 : 1 + joints].reshape(len(rows), sum(data["inner"]), dimensions)
    inner = np.array(data["offset"]) + data["step"] * inner
    least, step = np.array(data["bound"])[:, 1:].T if data["bound"] else (0.0, 1.0)
    bound = least + step * numbers[:, 1 + joints :]
    states = np.array(data["states"])[rows[:, 0]]
    of_legs = np.split(inner, np.cumsum(data["inner"])[:-1], axis=1)
    return states, numbers[:, 0], of_legs, bound


@pytest.mark.parametrize("name", [*MECHANISMS, *PLANAR])
def test_what_is_drawn_is_what_the_core_says(name):
    mechanism = made(name) if name in PLANAR else symkin.load_mechanism(name)
    data = movable(mechanism)[0].data()
    assert len(json.dumps(data)) < 200_000
    axes = [np.array(axis["values"]) for axis in data["axes"]]
    home = [axis[place] for axis, place in zip(axes, data["home"], strict=True)]
    free = list(data["free"])
    np.testing.assert_allclose(
        home, np.array(mechanism.workspace.home)[free] if mechanism.workspace.home else 0
    )
    states, conditions, inner, bound = decoded(data)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    assert len(grid) == len(states)
    tried = np.random.default_rng(0).choice(len(grid), 200)
    values = np.zeros((len(tried), mechanism.space.dof))
    values[:, free] = grid[tried]
    poses = mechanism.poses_at(values)
    if data["bound"]:  # shown as rounded as they are written
        places = [place for place, _, _ in data["bound"]]
        values[:, places] = bound[tried]
        shown = poses_from_bounds(mechanism.pose_space, values)
        possible = np.isfinite(poses).all(axis=1)
        np.testing.assert_array_equal(np.isfinite(shown).all(axis=1), possible)
        np.testing.assert_allclose(shown[possible], poses[possible], atol=1e-5)
    np.testing.assert_array_equal(states[tried] == "inside", inside_workspace(mechanism, poses))
    exact = np.log10(mechanism.singularity_measures(poses)[2]) * 4094 / data["decades"]
    known = np.isfinite(exact) & (exact < 4094)
    np.testing.assert_allclose(conditions[tried][known], exact[known], atol=0.51)
    readings = mechanism.inverse_kinematics(poses)
    seen = 0
    for row, pose in enumerate(poses):
        beyond = ~np.isfinite(readings[row])
        assert (states[tried[row]] == "reach") == beyond.any()
        for leg in np.flatnonzero(~beyond):
            centres = mechanism.core.joint_centres(leg, pose, readings[row, leg])
            if not mechanism.space.moves:  # axes, drawn from outside inwards
                centres = centres * [[1], [0.875], [0.75]]
            np.testing.assert_allclose(centres[0], data["base"][leg], atol=2e-6)
            np.testing.assert_allclose(
                centres[-1], on_platform(mechanism, data["platform"][leg], pose), atol=2e-6
            )
            shown = inner[leg][tried[row]]
            seen += data["inner"][leg] == 0
            if len(shown) and np.isfinite(shown).all():
                np.testing.assert_allclose(shown, centres[1:-1], atol=0.51 * data["step"])
                seen += 1
    assert seen > 20


def on_platform(mechanism, point, pose):
    point = np.array(point)
    if mechanism.pose_space == "planar":
        cosine, sine = np.cos(pose[2]), np.sin(pose[2])
        return pose[:2] + np.array([[cosine, -sine], [sine, cosine]]) @ point
    if mechanism.pose_space == "spatial":
        return pose[:3] + rotations_from_quaternions(pose[None, 3:])[0] @ point
    if mechanism.pose_space == "spherical":
        return rotations_from_quaternions(pose[None])[0] @ point
    return pose + point


def test_a_mechanism_without_a_box_is_not_moved(paper):
    assert movable(paper.replace(workspace=None)) == ()
