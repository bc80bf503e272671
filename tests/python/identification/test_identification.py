# SPDX-License-Identifier: MIT
"""Identification on simulated robots and on a real hexapod."""

import numpy as np
import pandas as pd
import pytest

import symkin
from symkin.analysis.observability import expected_accuracy
from symkin.errors import MechanismError, NotIdentifiableError
from symkin.model.settings import NoiseSettings


def errors_after(mechanism, plan, poses, robots, estimator, pose_use):
    """RMS over the robots of the position error after identification, and that predicted."""
    achieved, predicted = [], []
    for seed in range(robots):
        simulation = symkin.simulate(mechanism, plan, seed)
        found = symkin.identify(mechanism, simulation.measurements, estimator, poses=pose_use)
        assert found.converged
        after = symkin.evaluate(found.mechanism, actual=simulation.actual, poses=poses)
        achieved.append(after.position_rms)
        predicted.append(expected_accuracy(mechanism, poses, found.covariance).position)
    return np.sqrt(np.mean(np.square(achieved))), np.sqrt(np.mean(np.square(predicted)))


@pytest.fixture(scope="module")
def planned(paper):
    candidates = symkin.sample_workspace(paper, 6000, seed=1).poses
    return symkin.make_plan(paper, candidates, seed=1, rows="paper"), candidates[:400]


def test_the_error_after_identification_is_the_predicted_one_and_implicit_is_better(paper, planned):
    plan, poses = planned
    by_paper, predicted = errors_after(paper, plan, poses, 60, "paper", "own")
    assert by_paper == pytest.approx(predicted, rel=0.15)
    by_implicit, _ = errors_after(paper, plan, poses, 60, "implicit", "all")
    by_joint, predicted_joint = errors_after(paper, plan, poses, 60, "joint", "all")
    assert by_implicit < 0.7 * by_paper
    assert by_joint < by_implicit
    assert by_joint == pytest.approx(predicted_joint, rel=0.15)


def test_the_paper_protocol_predicts_the_published_first_order_accuracy(paper, planned):
    # 8.2e-5 m and 15.4e-5 rad for 24 poses a leg; the candidate set moves it by some percent.
    plan, poses = planned
    found = symkin.identify(
        paper, symkin.simulate(paper, plan, 1, actual=paper).measurements, "paper", poses="own"
    )
    expected = expected_accuracy(paper, poses, found.covariance)
    assert expected.position == pytest.approx(8.2e-5, rel=0.1)
    assert expected.orientation == pytest.approx(15.4e-5, rel=0.1)


def test_a_real_hexapod_is_identified(hexapod, hexapod_table):
    measurements = symkin.read_measurements(hexapod_table, hexapod)
    assert measurements.poses.shape == (108, 7)
    closures = [
        hexapod.closure(leg, measurements.poses, measurements.readings[:, leg]) for leg in range(6)
    ]
    assert np.sqrt(np.mean(np.square(closures))) == pytest.approx(50.5e-3, abs=0.1e-3)
    found = symkin.identify(hexapod, measurements)
    assert found.converged
    assert found.residual_rms == pytest.approx(0.409e-3, abs=0.005e-3)
    # 187 without weights; the whitening by the declared noise moves it a little.
    assert max(leg.condition for leg in found.legs) == pytest.approx(187, rel=0.1)
    after = symkin.evaluate(found.mechanism, measurements=measurements)
    assert after.position_rms == pytest.approx(0.953e-3, rel=0.02)
    assert after.failed == 0


def test_doubts_are_stated_apart_from_convergence(paper, planned):
    plan, _ = planned
    measurements = symkin.simulate(paper, plan, 1).measurements
    good = symkin.identify(paper, measurements)
    assert good.converged
    assert good.trustworthy
    small = NoiseSettings(position=1e-6, orientation=1e-6)
    doubtful = symkin.identify(paper, measurements, noise=small)
    assert doubtful.converged
    assert not doubtful.trustworthy
    assert "residuals-large" in [doubt.code for doubt in doubtful.doubts]


def test_fewer_poses_than_parameters_are_refused(paper, planned):
    plan, _ = planned
    measurements = symkin.simulate(paper, plan, 1).measurements
    with pytest.raises(NotIdentifiableError, match="leg 1 has 7"):
        symkin.identify(paper, measurements.subset(np.arange(7)))


def test_an_unmeasured_leg_is_refused_by_number(paper, planned):
    plan, _ = planned
    measurements = symkin.simulate(paper, plan, 1).measurements
    readings = measurements.readings.copy()
    readings[:, 1] = np.nan
    partial = symkin.Measurements.of(measurements.poses, readings)
    with pytest.raises(NotIdentifiableError, match="of leg 2: its parameters"):
        symkin.identify(paper, partial)
    readings[:, 2] = np.nan
    partial = symkin.Measurements.of(measurements.poses, readings)
    with pytest.raises(NotIdentifiableError, match="of legs 2, 3: their parameters"):
        symkin.identify(paper, partial)


def test_a_robot_of_another_kind_than_its_model_is_refused(paper, planned):
    plan, poses = planned
    for other in ("5bar", "3RPR", "4RRR"):
        robot = symkin.load_mechanism(other)
        with pytest.raises(MechanismError, match=f'robot "{other}" has .* "3RRR" 3 legs'):
            symkin.evaluate(paper, actual=robot, poses=poses)
        with pytest.raises(MechanismError, match=r"3 legs \[R\]RR, planar; expected the same"):
            symkin.simulate(paper, plan, 1, actual=robot)


def test_a_joint_at_the_origin_is_refused_as_an_angle_that_is_none(paper, planned):
    plan, _ = planned
    measurements = symkin.simulate(paper, plan, 1).measurements
    parameters = paper.parameters.copy()
    parameters[0, paper.parameter_names.index("base_radius")] = 0
    moved = paper.replace(symmetry=None).with_parameters(parameters)
    with pytest.raises(NotIdentifiableError, match=r"base_angle is undefined; shift"):
        symkin.identify(moved, measurements)


def test_measurements_are_taken_as_people_have_them(paper, tmp_path) -> None:
    made = paper.simulate(paper.plan(12), seed=1)
    made.measurements.save(tmp_path / "measured.csv")
    expected = paper.identify(made.measurements).changes
    table = pd.read_csv(tmp_path / "measured.csv")
    for given in (made, tmp_path / "measured.csv", str(tmp_path / "measured.csv"), table):
        assert np.allclose(paper.identify(given).changes, expected, rtol=0, atol=1e-9)
        assert paper.evaluate(measurements=given).position_rms > 0


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda robot, data: symkin.identify(data, robot),
            "mechanism is a Measurements; exp",
        ),
        (lambda robot, _: robot.identify(robot), "Robot is given as measurements"),
        (lambda robot, _: robot.identify(3), "int is given as measurements"),
        (lambda robot, data: robot.identify(data, noise=1.0), "noise is 1.0; expected a NoiseS"),
        (lambda robot, data: robot.identify(data, noise={"reading": 1}, prior="tolerances"), "noi"),
        (lambda robot, data: robot.identify(data, free=[]), "free is empty"),
        (
            lambda robot, data: robot.identify(data).cross_validated(2.5),
            "2.5 folds; expected a whole number",
        ),
    ],
)
def test_what_is_no_option_is_refused_in_one_sentence(paper, call, sentence) -> None:
    data = paper.simulate(paper.plan(12), seed=1).measurements
    with pytest.raises(symkin.SymkinError, match=sentence):
        call(paper, data)
