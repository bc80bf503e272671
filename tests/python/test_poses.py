# SPDX-License-Identifier: MIT
"""Rotations and motions as numbers, and back."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from symkin.analysis.conventions import rotations_from_angles
from symkin.model.poses import (
    POSE_SPACES,
    STAYS,
    Transform,
    between,
    poses_of,
    roll_pitch_yaw,
    rotations_from_quaternions,
    stepped,
    transforms,
)

TURNS = st.floats(-np.pi, np.pi)
# How far from upright: at it, where roll and yaw share a line, and a little beside it.
FROM_UPRIGHT = st.one_of(st.just(0.0), st.floats(-17, 0).map(lambda power: 10**power))


@given(TURNS, FROM_UPRIGHT, st.sampled_from([-1, 1]), TURNS)
@example(0.7, 1e-9, 1, -2.0)
def test_roll_pitch_and_yaw_make_the_rotation_again(roll, away, side, yaw):
    turn = rotations_from_angles(np.array([[roll, side * (np.pi / 2 - away), yaw]]), "xyz")
    found = roll_pitch_yaw(turn)
    assert np.abs(found[:, 1]).max() <= np.pi / 2
    np.testing.assert_allclose(rotations_from_angles(found, "xyz"), turn, atol=2e-12)


@given(st.lists(TURNS, min_size=4, max_size=4).filter(lambda row: np.linalg.norm(row) > 1e-3))
def test_roll_pitch_and_yaw_of_quaternions_make_the_rotation_again(row):
    turn = rotations_from_quaternions(np.array([row]) / np.linalg.norm(row))
    np.testing.assert_allclose(rotations_from_angles(roll_pitch_yaw(turn), "xyz"), turn, atol=2e-12)


def test_upright_all_of_the_turn_is_roll():
    turn = rotations_from_angles(np.array([[0.3, np.pi / 2, 0.5]]), "xyz")
    np.testing.assert_allclose(roll_pitch_yaw(turn), [[-0.2, np.pi / 2, 0.0]], atol=1e-12)


@st.composite
def motions(draw):
    """A few motions anywhere."""
    rows = draw(st.lists(st.tuples(*[TURNS] * 6), min_size=1, max_size=3))
    return stepped(STAYS, np.array(rows))


TANGENTS = st.tuples(*[st.floats(-1.5, 1.5)] * 6).map(np.array)


@given(motions(), TANGENTS)
def test_a_motion_is_moved_by_what_lies_between(start, tangent):
    moved = stepped(start, np.tile(tangent, (len(start.translation), 1)))
    np.testing.assert_allclose(between(start, moved), np.tile(tangent, (len(moved.translation), 1)),
                               atol=1e-12)  # fmt: skip
    single = Transform(start.rotation[0], start.translation[0])
    there = stepped(single, tangent)
    np.testing.assert_array_equal(there.rotation, moved.rotation[0])
    np.testing.assert_allclose(between(single, there), tangent, atol=1e-12)
    np.testing.assert_array_equal(there.tangent, moved.tangent[0])


@given(st.sampled_from(sorted(POSE_SPACES)), motions())
def test_a_pose_is_off_its_motion_by_nothing_in_its_own_coordinates(name, found):
    # A base that is tilted takes a platform that turns about z out of what poses of it tell.
    poses = poses_of(name, found)
    assert poses.shape == (len(found.translation), POSE_SPACES[name].coordinates)
    off = between(transforms(name, poses), found)[:, POSE_SPACES[name].components]
    np.testing.assert_allclose(off, 0.0, atol=1e-7)
