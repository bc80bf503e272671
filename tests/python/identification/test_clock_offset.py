# SPDX-License-Identifier: MIT
"""Samples that were taken while the robot moved, by a device whose clock is off."""

import dataclasses
import re

import numpy as np
import pytest

import symkin
from symkin.cli import main
from symkin.data.reading import write_measurements
from symkin.errors import SymkinError
from symkin.planning.simulation import disturb

LATE = 4e-3  # s
STEP = 1e-4


@pytest.fixture(scope="module")
def robot():
    return symkin.load_mechanism("3RRR")


def moved(robot, late):
    """Readings of a moving robot, where a device saw it a little earlier, and how fast it was."""
    actual, random = disturb(robot, 4), np.random.default_rng(2)
    middle = symkin.sample_workspace(robot, 60, seed=3).poses
    velocity = random.normal(0, [0.1, 0.1, 0.2], middle.shape)
    now, before, after = (
        actual.inverse_kinematics(middle + step * velocity) for step in (0.0, -STEP, STEP)
    )
    kept = np.isfinite(now + before + after).all(axis=1)
    seen = middle - late * velocity
    noise = robot.noise
    position, angle = noise.position, noise.orientation
    taken = symkin.Measurements.of(
        (seen + random.normal(0, [position, position, angle], seen.shape))[kept],
        (now + random.normal(0, noise.reading, now.shape))[kept],
        reading_unit="rad",
        speeds=((after - before) / (2 * STEP))[kept],
    )
    return taken, velocity[kept, :2]


@pytest.fixture(scope="module")
def moving(robot):
    return moved(robot, LATE)[0]


def test_the_offset_of_a_clock_is_found_by_the_speeds_of_the_readings(robot, moving):
    found = symkin.identify(robot, moving, clock_offset=True)
    clock = found.params["leg1.clock"]
    assert (clock.unit, clock.deviation < LATE / 20) == ("s", True)
    assert abs(clock.value - LATE) < 4 * clock.deviation
    # To first order in the offset, of which the second is a millimetre in a hundred.
    assert 0.5 < found.chi_square / found.degrees_of_freedom < 1.5
    assert re.search(r"clock +s .* \+[34]\.\d+ ms ", found.text(whole=True))


@pytest.mark.parametrize("late", [0.0, LATE, 0.1])
def test_the_offset_of_a_clock_is_proposed_with_its_size_if_it_is_off(robot, late):
    taken, velocities = moved(robot, late)
    poses = taken.poses.copy()
    poses[:, 2] = np.nan
    positions = dataclasses.replace(taken, poses=poses, speeds=None, velocities=velocities)
    for each, estimator in ((taken, "implicit"), (taken, "joint"), (positions, "joint")):
        doubts = symkin.identify(robot, each, estimator).doubts
        if not late:
            assert doubts == ()
            continue
        (doubt,) = doubts
        assert (doubt.code, doubt.options) == ("clock-late", {"clock_offset": True})
        assert doubt.size == pytest.approx(late, rel=0.05)


def test_speeds_and_velocities_are_written_and_read_by_the_command(robot, moving, tmp_path, capsys):
    table = tmp_path / "moving.csv"
    write_measurements(moving, table, robot)
    assert "speed_1_rad_s" in table.read_text(encoding="utf-8").splitlines()[0]
    again = symkin.read_measurements(table, robot)
    np.testing.assert_array_equal(again.speeds, moving.speeds)
    out = str(tmp_path / "out")
    assert main(["identify", "3RRR", str(table)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert re.search(r"shows where the robot was \+4\.\d+ \+- 0\.\d+ ms before", said)
    assert "identify with --clock-offset" in said
    assert main(["identify", "3RRR", str(table), "--clock-offset", "--out", out]) == 0
    assert "leg1.clock" in symkin.read_estimate(out).params
    capsys.readouterr()


def test_a_clock_offset_without_speeds_is_refused_with_the_columns_that_say_them(robot, moving):
    still = symkin.Measurements.of(moving.poses, moving.readings, reading_unit="rad")
    with pytest.raises(SymkinError, match=r"velocity_x_m_s, .* or speed_1_rad_s"):
        symkin.identify(robot, still, clock_offset=True)
    turning = symkin.Measurements.of(
        moving.poses,
        moving.readings,
        reading_unit="rad",
        velocities=np.ones((len(moving), 2)),
    )
    with pytest.raises(SymkinError, match="does to orientations"):
        symkin.identify(robot, turning, clock_offset=True)
