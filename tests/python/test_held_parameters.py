# SPDX-License-Identifier: MIT
"""What is redundant, or constant, is held, named and never shown as if it were found."""

from dataclasses import replace

import numpy as np
import pytest

import symkin
from symkin.analysis.alignment import poses_of_mechanism
from symkin.analysis.observability import analyse_observability, observability_rows
from symkin.analysis.observed import Observed
from symkin.data.measurements import Measurements
from symkin.errors import MeasurementError, NotIdentifiableError, SymkinError
from symkin.model.settings import NoiseSettings
from symkin.planning import make_plan
from symkin.planning.simulation import simulate

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
    assert delta.estimated_counts == (7, 7, 7)
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
    assert len(found.names) == len(found.correlation) == np.sum(~held)
    assert not found.parameter_covariance[:, held.ravel()].any()


@pytest.mark.parametrize("estimator", ["implicit", "joint"])
def test_what_is_held_is_asked_of_the_drawing_and_not_of_what_is_found(estimator):
    robot = symkin.load_mechanism("3RPS")
    circles = robot.parameters.copy()
    circles[:, robot.parameter_names.index("platform_radius")] = 0.4501  # and the base's is 0.5
    drawn = robot.with_parameters(circles, symmetry=None)
    assert drawn.held == (("base_height",),) * 3
    taken = simulate(drawn, make_plan(drawn, symkin.sample_workspace(drawn, 500)), seed=3)
    assert taken.actual.held != drawn.held  # of circles that are less alike than drawn
    found = symkin.identify(drawn, taken.measurements, estimator)
    assert found.mechanism.held != drawn.held
    np.testing.assert_array_equal(np.isfinite(found.deviations), drawn.is_estimated)
    assert found.trustworthy, found.doubts


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
    assert rows["base_height"][-1].startswith("held")
    assert rows["base_radius"][-1] == "free"


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


@pytest.fixture(scope="module")
def touched(delta):
    """What a probe says that touches an unknown plane."""
    sample = symkin.sample_workspace(delta, 500)
    plane = Observed("height", plane=(0.01, 0.02, -0.03))
    return simulate(delta, make_plan(delta, sample), seed=4, observe=plane)


def test_a_delta_is_identified_from_where_it_touches_an_unknown_plane(delta, touched):
    assert np.isnan(touched.measurements.poses).all()
    found = symkin.identify(delta, touched.measurements, prior="tolerances", frames=["plane"])
    assert found.trustworthy, found.doubts
    apart = found.mechanism.parameters - touched.actual.parameters
    own = delta.is_estimated
    assert (np.abs(apart[own] / found.mechanism.deviations[own]) < 4).all()
    np.testing.assert_array_equal(found.mechanism.parameters[~own], delta.parameters[~own])
    status = {each.name: each.status for each in found.unknowns}
    assert status["leg2.base_height"] == "held, since the sensor's offset does the same"
    assert status["leg2.guide_azimuth"] == "held, a constant of the description"


def test_what_is_held_cannot_be_freed_shared_or_given_a_prior(delta, touched):
    def identify(**options):
        return symkin.identify(delta, touched.measurements, **options)

    for options in ({"free": ["base_height"]}, {"shared": ["*.base_height"]}):
        with pytest.raises(SymkinError, match="is held, since the sensor's offset does the same"):
            identify(**options)
    with pytest.raises(SymkinError, match="is held, a constant of the description"):
        identify(prior={"leg1.guide_azimuth": 1e-3})
    found = identify(free=["base_*"], prior={"base_*": 1e-3})
    own = {f"leg{leg}.{name}" for leg in (1, 2, 3) for name in ("base_radius", "base_azimuth")}
    assert set(found.names) == own


def test_coordinates_of_a_delta_that_were_not_measured_are_empty_cells(delta, measured, tmp_path):
    poses = measured.measurements.poses.copy()
    poses[::3, 0] = poses[1::3, 2] = np.nan
    partial = replace(measured.measurements, poses=poses)
    again = symkin.read_measurements(partial.save(tmp_path / "partial.csv"), delta)
    np.testing.assert_array_equal(again.poses, poses)
    assert again.incomplete_because.endswith("has no measured x")
    found = symkin.identify(delta, again)
    assert found.trustworthy, found.doubts
    errors = found.mechanism.parameters - measured.actual.parameters
    own = delta.is_estimated
    assert (np.abs(errors[own] / found.mechanism.deviations[own]) < 4).all()


def test_robots_of_a_fleet_are_identified_as_each_alone(delta, measured):
    fleet = symkin.identify_many(delta, {"one": measured.measurements})
    alone = symkin.identify(delta, measured.measurements)
    assert not fleet.doubts[0]
    np.testing.assert_allclose(fleet.parameters[0], alone.mechanism.parameters, atol=1e-12)
    np.testing.assert_allclose(fleet.deviations[0], alone.deviations, rtol=1e-9)


def test_the_frame_of_a_delta_is_found_and_its_target_counts_as_the_platform(delta, tmp_path):
    base = (0.3, -0.2, 0.1, 0.1, 0.2, 2.0)
    sample = symkin.sample_workspace(delta, 500)
    tracker = Observed("pose", base=base)
    taken = simulate(delta, make_plan(delta, sample), seed=4, observe=tracker).measurements
    table = taken.save(tmp_path / "tracked.csv")
    aligned = symkin.align_frames(*poses_of_mechanism(delta, table), pose_space="translating")
    assert aligned.trustworthy, aligned.doubts
    np.testing.assert_allclose(aligned.frames.base, base, atol=0.02)
    np.testing.assert_array_equal(aligned.frames.target, 0)
    assert list(aligned.columns()) == ["x_m", "y_m", "z_m"]
    found = symkin.identify(delta, taken, frames=["base"], prior="tolerances")
    assert found.trustworthy, found.doubts


def test_what_sorted_poses_leave_open_is_named_where_parameters_are_held():
    robot = symkin.load_mechanism("3RPS")
    assert not robot.is_estimated.all()
    plan = symkin.make_plan(robot, symkin.sample_workspace(robot, 2000))
    measured = symkin.simulate(robot, plan, seed=1).measurements
    poses = measured.poses[np.argsort(measured.poses[:, 0])]
    with pytest.raises(NotIdentifiableError, match=r"not shown: .* of leg \d") as told:
        symkin.identify(robot, replace(measured, poses=poses), "joint")
    assert str(told.value).count("not shown") == 1
