# SPDX-License-Identifier: MIT
"""What is redundant, or constant, is held, named and never shown as if it were found."""

from dataclasses import replace

import numpy as np
import pytest

import symkin
from symkin.errors import MeasurementError, NotIdentifiableError
from symkin.measurements import Measurements
from symkin.observability import analyse_observability, observability_rows
from symkin.planning import make_plan
from symkin.settings import NoiseSettings
from symkin.simulation import simulate

FINE = NoiseSettings(position=1e-6, orientation=0.0, reading=1e-6)


@pytest.fixture(scope="module")
def delta():
    return symkin.load_mechanism("linear_delta").replace(noise=FINE)


@pytest.fixture(scope="module")
def measured(delta):
    sample = symkin.sample_workspace(delta, 500)
    return simulate(delta, make_plan(delta, sample), seed=4)


def test_the_constant_azimuth_of_a_guide_is_that_of_the_base_point_unless_it_is_given(delta):
    leg = delta.legs[0]
    without = {name: leg.parameters[name] for name in leg.parameters if name != "guide_azimuth"}
    given = [symkin.Leg(leg.chain, without, -1)] * 3
    made = symkin.Mechanism("made", given, platform="translating")
    assert made.legs[0].parameters["guide_azimuth"] == leg.parameters["base_azimuth"]
    other = symkin.Leg(leg.chain, without | {"guide_azimuth": 0.25}, -1)
    made = symkin.Mechanism("made", [other] * 3, platform="translating")
    assert made.legs[0].parameters["guide_azimuth"] == 0.25


def test_the_height_of_vertical_guides_is_held_and_all_else_but_the_constant_is_identified(delta):
    assert delta.held == (("base_height",),) * 3
    assert delta.estimated_count == 7
    names = set(delta.parameter_names) - {"base_height", "guide_azimuth"}
    assert set(delta.estimated_names(0)) == names
    poses = symkin.sample_workspace(delta, 30)
    assert observability_rows(delta, 0, poses).shape == (30, 7)
    shown = analyse_observability(delta, 0, poses)
    assert (shown.rank, len(shown.parameter_names)) == (7, 7)


@pytest.mark.parametrize("name", ["3RRR", "5bar", "hexapod_jugglebot", "rotary_delta"])
def test_other_mechanisms_hold_nothing(name):
    assert not any(symkin.load_mechanism(name).held)


def test_legs_whose_guides_run_in_different_directions_hold_different_coordinates(delta):
    radial = symkin.Leg("[P]US", dict(delta.legs[2].parameters) | {"guide_elevation": 0.2}, -1)
    mixed = symkin.Mechanism("mixed", [*delta.legs[:2], radial], platform="translating")
    assert mixed.held == (("base_height",), ("base_height",), ("base_radius",))


@pytest.mark.parametrize("estimator", ["paper", "inverse", "implicit", "joint"])
def test_every_estimator_finds_the_others_and_keeps_what_is_held(delta, measured, estimator):
    found = symkin.identify(delta, measured.measurements, estimator, poses="all")
    assert found.converged
    held = ~delta.is_estimated
    np.testing.assert_array_equal(found.changes[held], 0)
    assert np.isnan(found.deviations[held]).all()
    assert np.isfinite(found.deviations[~held]).all()
    errors = found.mechanism.parameters - measured.actual.parameters
    assert (np.abs(errors / found.deviations)[~held] < 4).all()
    assert np.isnan(found.correlation[:, held.ravel()]).all()


def test_the_calibrated_file_has_no_deviation_for_what_is_held(delta, measured, tmp_path):
    found = symkin.identify(delta, measured.measurements)
    found.save_calibrated(tmp_path / "calibrated.toml")
    calibrated = symkin.load_mechanism(tmp_path / "calibrated.toml")
    np.testing.assert_array_equal(calibrated.parameters, found.mechanism.parameters)
    np.testing.assert_array_equal(np.isnan(calibrated.deviations), ~delta.is_estimated)
    (table,) = (
        part
        for section in found.page().sections
        for part in section.parts
        if getattr(part, "caption", "") == "Identified parameters"
    )
    rows = {row[0]: row for row in table.groups[0].rows}
    assert rows["base_height"][-1] == "held"
    assert rows["base_radius"][-1] != "held"


def test_check_names_what_is_held(delta):
    result = symkin.check_mechanism(delta)
    assert result.to_dict()["identifiability"][0]["held"] == ["base_height"]
    assert any("base_height" in note for note in result.page().notes)


def test_fewer_poses_than_identified_parameters_are_refused(delta, measured):
    few = measured.measurements.for_all_legs().subset(np.arange(6))
    with pytest.raises(NotIdentifiableError, match="7 parameters need at least 7"):
        symkin.identify(delta, few)


def test_three_coordinates_are_planar_unless_the_measurements_say_otherwise(measured):
    taken = measured.measurements
    assert taken.pose_space == "translating"
    assert taken.subset(np.arange(5)).pose_space == "translating"
    assert Measurements.of(taken.poses, taken.readings).pose_space == "planar"
    with pytest.raises(MeasurementError, match="a spatial pose has 7"):
        replace(taken, pose_space="spatial")


def test_measurements_of_a_delta_are_written_and_read_as_x_y_z(delta, measured, tmp_path):
    path = measured.measurements.save(tmp_path / "measured.csv")
    assert path.read_text().splitlines()[0].startswith("leg,x_m,y_m,z_m,psi_1_m")
    again = symkin.read_measurements(path, delta)
    assert again.pose_space == "translating"
    np.testing.assert_array_equal(again.poses, measured.measurements.poses)
