# SPDX-License-Identifier: MIT
"""Robots whose calibrated sensors are curved, from workspaces to what is identified of them."""

from __future__ import annotations

import numpy as np
import pytest

import symkin
from symkin.analysis.observed import NO_NOISE
from symkin.errors import SymkinError
from symkin.model.settings import JointLimits

# Quadratic, cosine and sine.
TERMS = {
    "3RRR": (0.02, 0.02, -0.01),
    "rotary_delta": (0.02, 0.01, 0.01),
    "3RPS": (0.03, 0.0, 0.0),
    "hexapod_jugglebot": (1e-6, 0.0, 0.0),
}


def bent(name, noise=True):
    mechanism = symkin.load_mechanism(name)
    factors = 1 + 0.3 * np.random.default_rng(1).standard_normal((len(mechanism.legs), 1))
    robot = mechanism.replace(curvature=factors * TERMS[name])
    return robot if noise else robot.replace(noise=NO_NOISE)


@pytest.mark.parametrize("name", TERMS)
def test_closures_are_linearised_where_curved_sensors_show_them(name):
    robot, step = bent(name), 1e-6
    poses = symkin.sample_workspace(robot, 20, seed=1).poses
    readings = robot.inverse_kinematics(poses)
    gain = robot.parameter_names.index("sensor_gain")
    for leg, psi in enumerate(readings.T):
        made = robot.linearised(leg, poses, psi)
        ends = (robot.closure(leg, poses, psi + side * step).ravel() for side in (1, -1))
        numeric = np.subtract(*ends) / (2 * step)
        assert made.by_reading.ravel() == pytest.approx(numeric, rel=1e-5, abs=1e-7)
        robots = []
        for side in (1, -1):
            parameters = robot.parameters.copy()
            parameters[leg, gain] += side * step
            robots.append(robot.with_parameters(parameters, symmetry=None))
        numeric = np.subtract(*(each.closure(leg, poses, psi).ravel() for each in robots))
        by_gain = made.by_parameters[:, gain]
        assert by_gain == pytest.approx(numeric / (2 * step), rel=1e-4, abs=1e-7)
        numeric = np.subtract(*(each.inverse_kinematics(poses)[:, leg] for each in robots))
        by_gain = robot.parameter_jacobian(leg, poses)[:, gain]
        assert by_gain == pytest.approx(numeric / (2 * step), rel=1e-4, abs=1e-6)


def test_joint_limits_are_of_readings_as_they_are_shown(paper):
    robot = paper.replace(curvature=[[0.1, 0.0, 0.0]] * 3)
    readings = symkin.sample_workspace(robot, 300, seed=1).readings
    upper = float(np.quantile(readings, 0.7))
    limited = robot.replace(joint_limits=JointLimits(upper=upper))
    sample = symkin.sample_workspace(limited, 300, seed=1)
    assert sample.readings == pytest.approx(robot.inverse_kinematics(sample.poses))
    assert limited.within_limits(sample.readings).all()
    assert sample.readings.max() > upper - 0.05
    assert sample.rejected["limits"]


@pytest.mark.parametrize("name", TERMS)
def test_a_simulated_robot_is_where_its_curved_sensors_say(name):
    robot = bent(name, noise=False)
    candidates = symkin.sample_workspace(bent(name), 200, seed=1)
    plan = symkin.make_plan(bent(name), candidates, 20, seed=1, design="mechanism", spares=8)
    assert plan.readings == pytest.approx(robot.inverse_kinematics(plan.poses), abs=1e-9)
    as_drawn = symkin.simulate(robot, plan, seed=1, actual=robot).measurements
    assert as_drawn.readings == pytest.approx(robot.inverse_kinematics(as_drawn.poses), abs=1e-9)
    assert as_drawn.poses == pytest.approx(plan.poses[: len(as_drawn.poses)], abs=1e-9)
    made = symkin.simulate(robot, plan, seed=1)
    found = made.actual.inverse_kinematics(made.measurements.poses)
    assert made.measurements.readings == pytest.approx(found, abs=1e-9)
    # Its sensors are told what the drawing has them show, as a controller with these terms does.
    wanted = robot.inverse_kinematics(plan.poses[~plan.spare])[: len(found)]
    if not made.replaced_by_set["all legs"] and len(robot.legs) <= robot.space.dof:
        assert made.measurements.readings == pytest.approx(wanted, abs=1e-9)


def test_a_robot_with_curved_sensors_errs_by_what_its_estimate_expects():
    robot = bent("rotary_delta")
    candidates = symkin.sample_workspace(robot, 300, seed=1)
    plan = symkin.make_plan(robot, candidates, 30, seed=1, design="mechanism", spares=10)
    ratios = []
    for seed in range(12):
        made = symkin.simulate(robot, plan, seed=seed)
        found = symkin.identify(robot, made.measurements)
        error = symkin.evaluate(found.mechanism, actual=made.actual, poses=plan.poses)
        ratios.append(error.position_rms / found.expected_accuracy(plan.poses).position)
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.4


def test_sensors_that_turn_back_within_the_workspace_are_refused_in_words(paper):
    robot = paper.replace(curvature=[[-0.4, 0.0, 0.0]] * 3)
    with pytest.raises(SymkinError, match="so curved that they turn back"):
        symkin.sample_workspace(robot, 300, seed=1)


def test_straight_and_curved_readings_are_each_other_s_inverse(paper):
    robot = bent("3RRR")
    readings = symkin.sample_workspace(robot, 50, seed=1).readings
    assert robot.curved(robot.straightened(readings)) == pytest.approx(readings, abs=1e-12)
    assert paper.curved(readings) == pytest.approx(readings, abs=0)
