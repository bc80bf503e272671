# SPDX-License-Identifier: MIT
"""Rows of a calibration are known however little they are altered; honest repeats are not."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.acceptance.alike import rows_alike
from symkin.errors import SymkinError
from symkin.model.poses import poses_from_bounds
from symkin.planning.simulation import disturb

ROBOTS = ["3RRR", "linear_delta", "hexapod_jugglebot"]


def seen_at(robot, poses, seed, share=1.0):
    """Poses with fresh noise of the size that is declared, or a share of it."""
    random, noise, space = np.random.default_rng(seed), robot.noise, robot.space
    sizes = np.repeat([noise.position, noise.orientation], [space.size, len(space.rotation)])
    off = share * sizes * random.normal(size=(len(poses), space.dof))
    if not space.has_quaternion:
        return poses + off
    made = poses + np.pad(off[:, :3], ((0, 0), (0, 4)))
    turned = poses_from_bounds(robot.pose_space, off)[:, 3:]
    made[:, 3:] = _product(turned, poses[:, 3:])
    return made


def _product(one, other):
    """Of quaternions x, y, z, w."""
    vector = (
        one[:, 3:] * other[:, :3] + other[:, 3:] * one[:, :3] + np.cross(one[:, :3], other[:, :3])
    )
    scalar = one[:, 3:] * other[:, 3:] - np.sum(one[:, :3] * other[:, :3], axis=1, keepdims=True)
    return np.hstack([vector, scalar])


def rows(robot, poses, readings):
    return symkin.Measurements.of(
        poses, readings, reading_unit=robot.reading_unit, pose_space=robot.pose_space
    )


def tables(robot, count, visits, first, second, share=1.0):
    """A table, and one of the same commands and readings, with noise of its own."""
    poses = np.repeat(symkin.sample_workspace(robot, count, 5).poses, visits, axis=0)
    readings = robot.inverse_kinematics(poses)
    known = seen_at(robot, poses, first)
    again = seen_at(robot, poses if share == 1.0 else known, second, share)
    return rows(robot, known, readings), rows(robot, again, readings)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(("count", "visits"), [(30, 1), (6, 1), (5, 6), (1, 30)])
def test_repeats_of_the_same_commands_are_no_copies(name, count, visits):
    robot = symkin.load(name)
    for seed in range(1, 201):
        known, again = tables(robot, count, visits, seed, 1000 + seed)
        assert not rows_alike(known, again, robot.noise).any()


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(("count", "share"), [(30, 0.3), (12, 0.1), (6, 0.02)])
def test_rows_that_are_altered_by_less_than_noise_are_copies(name, count, share):
    robot = symkin.load(name)
    for seed in range(1, 21):
        known, again = tables(robot, count, 1, seed, 1000 + seed, share)
        order = np.random.default_rng(seed).permutation(count)
        assert rows_alike(known, again[order], robot.noise).mean() > 0.5


def test_some_altered_rows_among_new_ones_are_those_that_are_named():
    robot = symkin.load("3RRR")
    known, altered = tables(robot, 40, 1, 1, 2, 0.02)
    _, new = tables(robot, 40, 1, 1, 3)
    copied = np.arange(40) < 8
    poses = np.where(copied[:, None], altered.poses, new.poses)
    found = rows_alike(known, dataclasses.replace(new, poses=poses), robot.noise)
    assert found[copied].sum() >= 7
    assert not found[~copied].any()


def test_a_device_that_shows_steps_as_large_as_its_noise_repeats_them_by_chance():
    robot = symkin.load("linear_delta")
    step, size = robot.noise.position, robot.space.size
    for seed in range(1, 101):
        pair = (
            dataclasses.replace(each, poses=step * np.round(each.poses[:, :size] / step))
            for each in tables(robot, 20, 1, seed, 1000 + seed)
        )
        assert not rows_alike(*pair, robot.noise).any()


def test_what_is_altered_is_refused_and_a_device_may_be_more_exact():
    robot = symkin.load("3RRR")
    plan, actual = robot.plan(12, candidates=400, seed=1), disturb(robot, seed=3)
    first = robot.simulate(plan, 3, actual).measurements
    found = robot.identify(first)
    random = np.random.default_rng(1)
    altered = dataclasses.replace(first, poses=first.poses + 1e-6 * random.normal(size=(36, 3)))
    with pytest.raises(SymkinError, match=r"36 rows .* altered; .* \(uncertainty=\)"):
        symkin.accept(found, altered, 1e-3)
    told = symkin.accept(found, altered, 1e-3, uncertainty=1e-6, orientation_uncertainty=1e-6)
    assert told.held_out is True
    turned = altered.poses.copy()  # as a device would see them that was set up anew
    turned[:, :2] = altered.poses[:, :2] @ [[0.8, -0.6], [0.6, 0.8]] + [0.3, -0.2]
    with pytest.raises(SymkinError, match="altered"):
        symkin.accept(found, dataclasses.replace(altered, poses=turned), 1e-3, frames=["base"])
    (doubt,) = symkin.compare(found, robot.identify(altered)).doubts
    assert "rows of the second calibration are those of the first" in doubt


def test_the_same_commands_with_new_noise_pass_also_where_the_device_was_set_up_anew():
    robot = symkin.load("3RRR")
    plan, actual = robot.plan(12, candidates=400, seed=1), disturb(robot, seed=3)
    found = robot.identify(robot.simulate(plan, 3, actual).measurements)
    for seed in range(10, 30):
        later = robot.simulate(plan, seed, actual).measurements
        assert symkin.accept(found, later, 1e-3).verdict == "pass"
        turned = later.poses.copy()
        turned[:, :2] = later.poses[:, :2] @ [[0.8, -0.6], [0.6, 0.8]] + [0.3, -0.2]
        moved = dataclasses.replace(later, poses=turned)
        assert symkin.accept(found, moved, 1e-3, frames=["base"]).held_out is True
