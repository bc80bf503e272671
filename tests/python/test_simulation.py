# SPDX-License-Identifier: MIT
"""Simulated measurements of every kind mean what the estimation takes them for."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observed import Observed
from symkin.errors import SymkinError
from symkin.model.settings import NoiseSettings
from symkin.planning import Plan

COUNT = 60
NOISE = NoiseSettings(1e-4, 2e-4, 5e-5)


@functools.cache
def robot(name: str) -> symkin.Mechanism:
    return symkin.load_mechanism(name).replace(noise=NOISE)


@functools.cache
def plan(name: str) -> Plan:
    poses = robot(name).sample_workspace(2 * COUNT, seed=1).poses[:COUNT]
    rows = len(poses)
    return Plan(
        mechanism=robot(name),
        leg_sets=np.full(rows, -1),
        order=np.arange(1, rows + 1),
        spare=np.zeros(rows, dtype=bool),
        poses=poses,
        readings=robot(name).inverse_kinematics(poses),
    )


def measured(name: str, seed: int = 1, **observed: Any) -> symkin.Measurements:
    """What is observed of a robot that is made as drawn."""
    made = robot(name)
    return symkin.simulate(made, plan(name), seed, made, observe=Observed(**observed)).measurements


FRAMES = {
    "3RRR": {"base": (1.0, -0.2, 2.9), "target": (0.05, 0.02, 0.2)},
    "5bar": {"base": (1.0, -0.2, 2.9)},
    "hexapod_jugglebot": {
        "base": (1.0, 0.3, -0.5, 0.4, 1.5, -2.4),
        "target": (0.05, 0.01, -0.1, 0.2, 0.1, 0.3),
    },
}
PLANE = (0.01, 0.05, -0.1)


def frame(name: str, which: str) -> Any:
    values = np.array(FRAMES.get(name, {}).get(which, (0.0,) * 6), dtype=float)
    if len(values) == 3:
        values = np.array([values[0], values[1], 0, 0, 0, values[2]])
    rotation = symkin.model.poses.rotations_from_vectors(values[None, 3:])[0]
    return _core.Frame(values[:3], rotation)


def fitted(name: str, data: symkin.Measurements, observed: dict[str, Any]) -> Any:
    """The fit of the first leg's sensor offset, with all else held at the truth."""
    made = robot(name)

    def in_space(values: Any) -> np.ndarray:
        found = np.zeros((len(values), 3))
        for row, given in zip(found, values, strict=True):
            row[: len(given)] = given
        return found

    setup = _core.Setup(
        made.core,
        np.zeros((len(made.legs), 3)),
        frame(name, "base"),
        frame(name, "target"),
        in_space(observed.get("points", ())),
        in_space(observed.get("anchors", ())),
        np.array(observed.get("plane", (0.0, 0.0, 0.0))),
    )
    names = _core.unknown_names(made.core, setup)
    column = [0 if each == "leg1.sensor_offset" else -1 for each in names]
    return _core.fit_jointly(
        made.core, setup, data.observations(NOISE), column, np.array([np.inf]),
        "none", 0.0, 1.0, 100, False, np.array([1e-3]), plan(name).poses,
    )  # fmt: skip


CASES: list[tuple[str, dict[str, Any]]] = [
    ("3RRR", {"kinds": "pose"}),
    ("3RRR", {"kinds": "position", "missing": 0.2}),
    ("3RRR", {"kinds": "orientation"}),
    ("3RRR", {"kinds": "distance", "anchors": ((0.3, -2.0),)}),
    ("3RRR", {"kinds": ("position", "points"), "points": ((0.1, 0.2), (-0.3, 0.0)), "spread": 1.0}),
    ("4RRR", {"kinds": "readings"}),
    ("5bar", {"kinds": ("pose", "distance"), "anchors": ((1.0, 1.0),)}),
    ("hexapod_jugglebot", {"kinds": "pose", "missing": 0.1, "spread": 0.5}),
    ("hexapod_jugglebot", {"kinds": "position"}),
    ("hexapod_jugglebot", {"kinds": "height", "plane": PLANE}),
    ("hexapod_jugglebot", {"kinds": ("points", "height"), "points": ((0.1, 0, 0), (0, 0, 0.1))}),
    ("hexapod_jugglebot", {"kinds": "distance", "anchors": ((1.0, 2.0, 0.5), (0.0, 0.0, 3.0))}),
]


@pytest.mark.parametrize(("name", "observed"), CASES)
def test_what_is_simulated_is_what_the_estimator_expects(
    name: str, observed: dict[str, Any]
) -> None:
    total = degrees = 0.0
    for seed in (1, 2, 3):
        data = measured(name, seed, **observed, **FRAMES.get(name, {}))
        fit = fitted(name, data, observed)
        assert fit.converged, fit.failure
        assert abs(fit.change[0]) < 5 * np.sqrt(fit.covariance[0, 0])
        total += fit.chi_square_data
        degrees += sum(fit.conditions) - 1
    assert abs(total - degrees) < 4 * np.sqrt(2 * degrees)


@pytest.mark.parametrize("missing", [0.2, 0.99])
def test_readings_are_missing_as_often_as_said_but_never_all_of_a_row(missing: float) -> None:
    data = measured("hexapod_jugglebot", missing=missing)
    absent = np.isnan(data.readings)
    expected = min(missing, 5 / 6)
    assert absent.mean() == pytest.approx(expected, abs=0.08)
    assert not absent.all(axis=1).any()


def test_noise_that_differs_from_row_to_row_is_said_and_true() -> None:
    data = measured("3RRR", spread=1.0)
    assert data.pose_deviations is not None
    exact = measured("3RRR", missing=1e-9)  # drawn apart from the protocol's noise, without spread
    assert exact.pose_deviations is None
    ratio = data.pose_deviations / [NOISE.position, NOISE.position, NOISE.orientation]
    assert 0.6 < np.std(np.log(ratio[:, 0])) < 1.4
    assert np.array_equal(ratio[:, 0], ratio[:, 1])
    commanded = plan("3RRR").poses  # which a robot that is as drawn takes
    sizes = (data.poses - commanded) / data.pose_deviations
    assert np.std(sizes) == pytest.approx(1.0, abs=0.15)


def test_full_poses_in_the_robots_own_frame_are_those_of_the_protocol() -> None:
    made = robot("3RRR")
    assert measured("3RRR") == symkin.simulate(made, plan("3RRR"), 1, made).measurements
    assert measured("3RRR").complete
    assert not measured("3RRR", kinds="position").complete


@pytest.mark.parametrize(
    ("observed", "words"),
    [
        ({"kinds": "hight"}, "observe is 'hight'; expected \"pose\""),
        ({"kinds": ()}, "observe is nothing"),
        ({"kinds": ("pose", "position")}, "one of pose, position, orientation"),
        ({"kinds": ("readings", "height")}, "means nothing else"),
        ({"kinds": "distance"}, 'anchors are not given, but "distance" is observed'),
        ({"points": ((0.0, 0.0),)}, 'points are given, but "points" is not observed'),
        ({"missing": 1.0}, "missing is 1; expected a fraction"),
        ({"spread": -1.0}, "spread is -1; expected 0 to 3"),
        ({"base": (1.0, 2.0)}, "expected x, y, phi in m and rad"),
        ({"kinds": "points", "points": ((1.0, 2.0, 3.0),)}, "expected 2 coordinates"),
        ({"kinds": "height"}, "this robot is planar"),
    ],
)
def test_what_cannot_be_observed_is_refused(observed: dict[str, Any], words: str) -> None:
    with pytest.raises(SymkinError, match=words):
        measured("3RRR", **observed)


@pytest.mark.parametrize(("name", "observed"), [CASES[4], CASES[9]])
def test_what_was_simulated_is_written_and_read(
    name: str, observed: dict[str, Any], tmp_path: Path
) -> None:
    made = robot(name)
    given = Observed(**observed, **FRAMES[name])
    simulation = symkin.simulate(made, plan(name), 1, made, observe=given)
    simulation.write(tmp_path)
    read = symkin.read_measurements(tmp_path / "measurements.csv", made)
    assert replace(read, source=None) == simulation.measurements
    assert "Measurements" in read.text()


def test_poses_that_a_controller_reports_tell_where_the_device_stands(tmp_path: Path) -> None:
    made = robot("3RRR")
    base, target = (1.0, -0.5, 3.0), (0.05, 0.0, 0.17)
    given = Observed(("pose", "reported"), base=base, target=target)
    simulation = symkin.simulate(made, plan("3RRR"), 1, observe=given)
    simulation.write(tmp_path)
    taken = simulation.measurements
    assert taken.reported is not None
    readings = simulation.actual.inverse_kinematics(taken.reported)
    assert np.abs(readings - taken.readings).max() < 0.01
    measured, reported, _ = symkin.analysis.alignment.poses_of_mechanism(
        made, tmp_path / "measurements.csv"
    )
    assert reported == pytest.approx(taken.reported)
    frames = symkin.align_frames(measured, reported, convention="as measured").frames
    assert frames.base == pytest.approx(base, abs=1e-3)
    assert frames.target == pytest.approx(target, abs=1e-3)
