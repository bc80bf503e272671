# SPDX-License-Identifier: MIT
"""Constant frames are found, and nothing else is taken for them."""

import numpy as np
import pytest
import scipy.optimize
from scipy.spatial.transform import Rotation

from symkin.analysis.frame_fit import align
from symkin.model.poses import Transform, moved, rotations_from_vectors, vectors_from_rotations

LENGTH = 0.2
SPACES = ("planar", "point", "spatial")
# Largest position (m) and rotation (rad) of the poses: ordinary, hardly turning, hardly moving.
RANGES = ((0.3, 0.3), (0.3, 0.01), (0.005, 0.4))
# Components of the poses' tangents, and of the errors'; of the base; of the tool.
FREE = {
    "planar": ([0, 1, 5], [0, 1, 5], [0, 1, 5]),
    "point": ([0, 1], [0, 1, 5], []),
    "spatial": (range(6), range(6), range(6)),
}


def restricted(tangents, free):
    kept = np.zeros_like(tangents)
    kept[:, list(free)] = tangents[:, list(free)]
    return Transform(rotations_from_vectors(kept[:, 3:]), kept[:, :3])


def example(space, ranges=RANGES[0], seed=1, count=60, noise=0.0):
    """Poses, and the same seen in another base frame and at another tool, with noise."""
    random = np.random.default_rng(seed)
    scale = np.repeat(ranges, 3)
    pose_free, base_free, tool_free = FREE[space]
    poses = restricted(random.uniform(-scale, scale, (count, 6)), pose_free)
    base = restricted(random.uniform(-1.7, 1.7, (1, 6)), base_free)
    tool = restricted(random.uniform(-1.7, 1.7, (1, 6)) * np.repeat([0.1, 1], 3), tool_free)
    wanted = base @ poses @ tool
    if space == "point":
        wanted = wanted._replace(rotation=poses.rotation)
    errors = restricted(noise * random.normal(size=(count, 6)), pose_free)
    turned, translated = errors.rotation @ wanted.rotation, errors.translation + wanted.translation
    return poses, Transform(turned, translated)


def errors_of(space, base, poses, tool, wanted):
    """Errors (N, 6), with rotations as lengths; a point has none."""
    scale = np.repeat([1.0, 0.0 if space == "point" else LENGTH], 3)
    return moved(base, poses, tool, wanted) * scale


@pytest.mark.parametrize("ranges", RANGES)
@pytest.mark.parametrize("space", SPACES)
def test_any_frames_are_found(space, ranges):
    for seed in range(5):
        poses, wanted = example(space, ranges, seed)
        base, tool = align(poses, wanted, LENGTH, space)
        np.testing.assert_allclose(errors_of(space, base, poses, tool, wanted), 0, atol=1e-9)


@pytest.mark.parametrize("space", SPACES)
def test_no_other_frames_are_nearer(space):
    poses, wanted = example(space, noise=0.05)
    base, tool = align(poses, wanted, LENGTH, space)
    _, base_free, tool_free = FREE[space]

    def cost(step):
        steps = np.zeros((2, 6))
        steps[0, list(base_free)] = step[: len(base_free)]
        steps[1, list(tool_free)] = step[len(base_free) :]
        turns = rotations_from_vectors(steps[:, 3:])
        near_base = Transform(turns[0], steps[0, :3]) @ base
        near_tool = tool @ Transform(turns[1], steps[1, :3])
        return np.sum(errors_of(space, near_base, poses, near_tool, wanted) ** 2)

    start = np.zeros(len(base_free) + len(tool_free))
    found = scipy.optimize.minimize(cost, start, options={"gtol": 1e-9})
    assert cost(start) <= found.fun * (1 + 1e-9)
    assert np.abs(found.x).max() < 1e-5
    assert cost(start) > 0.1


def test_poses_that_do_not_turn_are_aligned_all_the_same():
    poses, wanted = example("spatial", (0.3, 0.0), noise=1e-3)
    base, tool = align(poses, wanted, LENGTH, "spatial")
    errors = moved(base, poses, tool, wanted)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1e-3, rel=0.1)


@pytest.mark.parametrize(("space", "count"), [("planar", 2), ("point", 1), ("spatial", 2)])
def test_poses_that_would_always_fit_are_not_aligned(space, count):
    assert align(*example(space, count=count), LENGTH, space) is None
    assert align(*example(space, count=count + 1), LENGTH, space) is not None


def test_rotation_vectors_and_matrices_are_each_others_inverse():
    random = np.random.default_rng(1)
    axes = random.normal(size=(50, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    for angle in (0, 1e-12, 1e-5, 1, 3, np.pi - 1e-5, np.pi - 1e-9, np.pi):
        vectors = angle * axes
        matrices = Rotation.from_rotvec(vectors).as_matrix()
        np.testing.assert_allclose(rotations_from_vectors(vectors), matrices, atol=1e-14)
        found = vectors_from_rotations(matrices)
        np.testing.assert_allclose(rotations_from_vectors(found), matrices, atol=1e-8)
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), angle, atol=1e-7)
