# SPDX-License-Identifier: MIT
"""Readings of angles count on from home, wherever the sensors' zeros are."""

import numpy as np
import pytest

import symkin
from symkin.model.turns import turn_of


def with_zero_moved(mechanism, angle):
    """The same robot, whose sensors show `angle` less (in rad of the joint)."""
    moved = np.array(mechanism.parameters)
    moved[:, mechanism.parameter_names.index("sensor_offset")] += angle
    return mechanism.with_parameters(moved)


@pytest.mark.parametrize("angle", [3.66, -3.0, 1.0])
@pytest.mark.parametrize("name", ["3RRR", "rotary_delta", "agile_eye"])
def test_a_sensors_zero_moves_all_readings_alike(name, angle):
    mechanism = symkin.load_mechanism(name)
    poses = symkin.sample_workspace(mechanism, 300).poses
    gains = mechanism.parameters[:, mechanism.parameter_names.index("sensor_gain")]
    moved = with_zero_moved(mechanism, angle).inverse_kinematics(poses)
    apart = (moved - mechanism.inverse_kinematics(poses)) * gains + angle
    assert np.ptp(apart, axis=0).max() < 1e-12  # by the same turns at every pose
    np.testing.assert_allclose(np.mod(apart + 1, 2 * np.pi), 1, atol=1e-12)


def test_a_plan_expects_the_same_wherever_the_zeros_are(paper):
    robots = (paper, with_zero_moved(paper, 3.66))
    plans = [symkin.make_plan(each, symkin.sample_workspace(each, 2000), 24) for each in robots]
    for plan in plans:
        assert np.ptp(plan.readings, axis=0).max() < 2  # not on both sides of a cut
    one, other = (
        symkin.identify(each, symkin.simulate(each, plan, seed=4), "implicit")
        for each, plan in zip(robots, plans, strict=True)
    )
    gain = paper.parameter_names.index("sensor_gain")
    expected = one.mechanism.deviations[:, gain]
    np.testing.assert_allclose(other.mechanism.deviations[:, gain], expected, rtol=0.1)
    assert other.trustworthy


def test_sensors_that_wrap_are_read_as_those_that_count_on(paper):
    counting = with_zero_moved(paper, 3.66)
    wrapping = counting.replace(reading_wraps=True)
    plan = symkin.make_plan(counting, symkin.sample_workspace(counting, 2000), 24)
    measured = symkin.simulate(counting, plan, seed=4).measurements
    turn = turn_of(counting, 0)
    wrapped = turn / 2 - np.mod(turn / 2 - measured.readings, turn)
    assert not np.allclose(wrapped, measured.readings)
    table = {f"psi_{leg + 1}_rad": wrapped[:, leg] for leg in range(3)}
    table |= dict(zip(("x_m", "y_m", "phi_rad"), measured.poses.T, strict=True))
    read = symkin.read_measurements(table, wrapping)
    np.testing.assert_allclose(read.readings, measured.readings, atol=1e-12)
    found = symkin.identify(wrapping, table)
    assert found.trustworthy, found.doubts


def test_a_file_says_that_sensors_wrap_and_keeps_it(paper, tmp_path):
    path = tmp_path / "wraps.toml"
    paper.replace(reading_wraps=True).save(path)
    assert "reading_wraps = true" in path.read_text()
    again = symkin.load_mechanism(path)
    assert again.reading_wraps
    path.write_text(path.read_text().replace("reading_wraps = true", "reading_wraps = 1"))
    with pytest.raises(symkin.SymkinError, match=r"reading_wraps.*expected true or false"):
        symkin.load_mechanism(path)
