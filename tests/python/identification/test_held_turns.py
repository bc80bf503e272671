# SPDX-License-Identifier: MIT
"""A frame whose rotation is held in part."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observed import Observed
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem
from symkin.model.core_setup import setup_with
from symkin.model.poses import frame, rotations_from_vectors, vectors_from_rotations
from symkin.model.settings import Frames

DRAWN = (0.0, 0.0, 0.0, 0.4, -0.5, 0.6)
TURNED = np.array([0.3, -0.2, 0.0])  # since the drawing; z is held


@pytest.fixture(scope="module")
def robot():
    drawn = symkin.load_mechanism("hexapod_jugglebot")
    return drawn.replace(frames=Frames(base=DRAWN))


@pytest.fixture(scope="module")
def seen(robot):
    poses = symkin.sample_workspace(robot, 25, seed=3).poses
    exact = symkin.Measurements.of(
        poses,
        robot.inverse_kinematics(poses),
        reading_unit=robot.reading_unit,
        pose_space=robot.pose_space,
    )
    turned = rotations_from_vectors(TURNED[None])[0] @ frame("spatial", DRAWN).rotation
    base = (0.1, 0.0, 0.2, *vectors_from_rotations(turned[None])[0].tolist())
    return Observed(("pose",), base=base).measure(exact, robot.noise, 1)


def since_the_drawing(setup):
    turn = np.asarray(setup.base.rotation) @ frame("spatial", DRAWN).rotation.T
    return vectors_from_rotations(turn[None])[0]


def test_what_is_held_stays_as_drawn_and_the_rest_is_the_same_from_every_start(robot, seen):
    options = EstimateOptions(
        frames=("base",), fixed=("base.rz", "base.y"), prior="tolerances", estimator="joint"
    )
    problem = Problem.of(robot, seen, options)
    fits = []
    for free in (TURNED[:2], [0.0, 0.0], [0.6, 0.3], [0.1, -0.6]):
        start = (
            rotations_from_vectors(np.array([[*free, 0.0]]))[0] @ frame("spatial", DRAWN).rotation
        )
        base = _core.Frame(np.array([0.1, 0.0, 0.1]), start)
        setup = setup_with(problem.setup, robot.straight, base=base)
        fits.append(dataclasses.replace(problem, setup=setup).fit())
    for fit in fits:
        turned = since_the_drawing(fit.setup)
        assert turned[2] == pytest.approx(0, abs=1e-12)
        assert fit.setup.base.position[1] == 0
        np.testing.assert_allclose(turned, since_the_drawing(fits[0].setup), atol=1e-10)
        assert fit.goodness.chi_square == pytest.approx(fits[0].goodness.chi_square, rel=1e-9)
        np.testing.assert_allclose(fit.model_covariance, fits[0].model_covariance, rtol=1e-5)
    # And it is that which the device saw: a claim that is true is no error.
    assert fits[0].goodness.chi_square < fits[0].goodness.limit
    np.testing.assert_allclose(since_the_drawing(fits[0].setup)[:2], TURNED[:2], atol=0.02)
