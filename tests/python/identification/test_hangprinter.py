# SPDX-License-Identifier: MIT
"""A cable robot that calibrates itself: 44 poses, of which nine positions are known."""

import csv
from pathlib import Path

import numpy as np
import pytest

import symkin

SAMPLES = Path(__file__).resolve().parents[4] / "shared" / "data" / "hangprinter" / "samples.csv"
LINE = 1e-3  # m, standard deviation of a line's length


@pytest.fixture(scope="module")
def robot() -> symkin.Mechanism:
    return symkin.load_mechanism(Path(__file__).with_name("hangprinter.toml"))


@pytest.fixture(scope="module")
def measured(robot: symkin.Mechanism) -> symkin.Measurements:
    """Motor angles that are worth a millimetre of line each, whatever the spool."""
    if not SAMPLES.exists():
        pytest.skip("the poses of the Hangprinter are not at hand")
    with SAMPLES.open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = {
        name: np.array([float(row[name]) if row[name] else np.nan for row in rows])
        for name in rows[0]
    }
    for leg in range(1, 5):
        gain = robot.legs[leg - 1].parameters["sensor_gain"]
        table[f"psi_{leg}_sd_rad"] = np.full(len(rows), LINE / gain)
    return symkin.read_measurements(table, robot)


def line_rms(found) -> float:
    """Root mean square of the lines' estimated errors, m."""
    gains = found.mechanism.parameters[:, found.mechanism.parameter_names.index("sensor_gain")]
    return float(np.sqrt(np.mean((found.reading_errors * gains) ** 2)))


PRIORS = {"sensor_offset": 0.01, "sensor_gain": 3e-5}


def test_straight_spools_leave_a_millimetre_and_are_doubted(robot, measured):
    found = symkin.identify(robot, measured, prior=PRIORS, gauge="nominal")
    assert found.converged
    assert not found.trustworthy
    assert found.doubts[0].options == {"sensor": "quadratic"}
    assert line_rms(found) == pytest.approx(1.10e-3, rel=0.05)


def test_spools_whose_radius_changes_leave_a_third_of_it(robot, measured):
    found = symkin.identify(robot, measured, prior=PRIORS, gauge="nominal", sensor="quadratic")
    assert found.converged
    assert not any("sensor" in doubt.options for doubt in found.doubts)
    assert line_rms(found) == pytest.approx(0.37e-3, rel=0.05)
