# SPDX-License-Identifier: MIT
"""Rotations and motions as numbers, and back."""

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from symkin.analysis.conventions import rotations_from_angles
from symkin.model.poses import roll_pitch_yaw, rotations_from_quaternions

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
