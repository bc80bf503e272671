# SPDX-License-Identifier: MIT
"""Platforms that their legs bind: 3-RPS and 3-PRS, three degrees of freedom among six."""

import numpy as np
import pytest

import symkin
from symkin import _core
from symkin.analysis.observability import mechanism_rows, observability_rows
from symkin.analysis.workspace import inside_box, workspace_coordinates
from symkin.analysis.workspace.study import study_workspace
from symkin.errors import MechanismFileError, SymkinError
from symkin.files.template import mechanism_template
from symkin.model.settings import NoiseSettings, ProtocolSettings

HELD = {"3RPS": "base_height", "3PRS": "base_radius"}


@pytest.fixture(params=sorted(HELD))
def bound(request):
    return symkin.load_mechanism(request.param)


@pytest.fixture
def made(bound):
    """A robot with errors, whose x, y and rz are zero nowhere."""
    tolerances = np.array(
        [_core.Tolerances(1e-3, 2e-3, 1e-3).deviations(bound.core, leg) for leg in range(3)]
    )
    errors = np.random.default_rng(5).normal(size=tolerances.shape) * tolerances
    return bound.with_parameters(bound.parameters + errors)


def test_three_degrees_of_freedom_are_left(bound):
    assert bound.core.dof == 6
    assert bound.core.mobility == 3
    assert bound.bound
    assert not bound.core.redundant
    condition = next(
        each
        for each in symkin.check_mechanism(bound).conditions.conditions
        if (each.section, each.number) == (4, 1)
    )
    assert condition.holds
    assert "3 legs, 3 degrees of freedom" in condition.figure


def test_height_and_tilts_say_where_the_platform_is(made):
    asked = np.array([[0, 0, made.home[2], 0.2, -0.1, 0], [0, 0, made.home[2] + 0.03, 0, 0.15, 0]])
    poses = made.poses_at(asked)
    found = workspace_coordinates(made, poses)
    np.testing.assert_allclose(found[:, 2:5], asked[:, 2:5], atol=1e-12)
    assert (np.abs(found[:, [0, 1, 5]]) > 1e-5).all()
    readings = made.inverse_kinematics(poses)
    for leg in range(3):
        assert np.abs(made.closure(leg, poses, readings[:, leg])).max() < 1e-12
    taken, converged = made.forward_kinematics(readings)
    assert converged.all()
    np.testing.assert_allclose(taken, poses, atol=1e-11)


def test_the_workspace_is_sampled_where_the_legs_allow_it(made):
    sample = symkin.sample_workspace(made, 300)
    np.testing.assert_allclose(
        made.poses_at(workspace_coordinates(made, sample.poses)), sample.poses, atol=1e-11
    )
    assert inside_box(made, sample.poses).all()


def test_a_file_gives_height_and_tilts_alone(bound, tmp_path):
    bound.save(tmp_path / "copy.toml")
    assert symkin.load_mechanism(tmp_path / "copy.toml") == bound
    text = (tmp_path / "copy.toml").read_text()
    assert "\nz = " in text
    assert "\nx = " not in text
    (tmp_path / "wrong.toml").write_text(text.replace("\nz = ", "\nx = [0, 0]\nz = "))
    with pytest.raises(MechanismFileError, match=r"workspace\.x: unknown key"):
        symkin.load_mechanism(tmp_path / "wrong.toml")


@pytest.mark.parametrize("chain", ["R[P]S", "[P]RS"])
def test_the_file_to_begin_with_works(chain, tmp_path):
    path = tmp_path / "new.toml"
    path.write_text(mechanism_template(chain))
    mechanism = symkin.load_mechanism(path)
    assert len(mechanism.legs) == 3
    assert mechanism.protocol.pose_count == 3 * max(mechanism.estimated_counts)
    found = symkin.check_mechanism(mechanism)
    assert not found.blind
    assert found.orbits == ((0, 1, 2),)
    with pytest.raises(SymkinError, match="expected 3"):
        mechanism_template(chain, legs=4)


def test_no_other_number_of_legs_is_taken(bound):
    with pytest.raises(SymkinError, match="expected 3, since each binds the platform to a plane"):
        bound.replace(legs=[*bound.legs, bound.legs[0]], symmetry=None)


def test_what_the_offset_says_too_is_held_and_named(bound):
    assert bound.held == ((HELD[bound.name],),) * 3
    assert HELD[bound.name] in symkin.check_mechanism(bound).text(whole=True)


def test_slices_span_the_tilts_at_heights(bound):
    study = study_workspace(bound, count=2000, resolution=11)
    box = bound.workspace
    heights = [found.orientation for found in study.slices]
    assert heights == pytest.approx([box.lower[2], box.home[2], box.upper[2]])
    for found in study.slices:
        assert found.x[5] == pytest.approx(0, abs=1e-12)
        assert found.x[-1] == pytest.approx(1.2 * box.upper[3] * 10 / 11)
        assert found.usable.any()
    assert study.workspace_group == ("r0", "r1", "r2", "s0", "s1", "s2")
    assert study.text(whole=True)
    with pytest.raises(SymkinError, match="over two coordinates that they leave it"):
        study_workspace(bound, orientations=[0.1], count=100, resolution=5)


def test_a_leg_brings_two_rows_a_pose_that_the_whole_mechanism_brings_too(bound):
    poses = symkin.sample_workspace(bound, 40).poses
    rows = observability_rows(bound, 0, poses, "noise_aware")
    assert rows.shape == (80, bound.estimated_counts[0])
    together = mechanism_rows(bound, poses, "noise_aware")
    assert together.shape == (40, 6, 3 * bound.estimated_counts[0])
    # Whitened together, the first leg's rows come first and are its own.
    np.testing.assert_allclose(
        together[:, :2, : bound.estimated_counts[0]].reshape(rows.shape), rows
    )


@pytest.mark.parametrize("estimator", ["implicit", "joint"])
def test_measurements_off_the_planes_identify_the_robot_within_their_deviations(
    bound, made, estimator
):
    quiet = bound.replace(noise=NoiseSettings(2e-6, 2e-6, 1e-6))
    random = np.random.default_rng(8)
    poses = symkin.sample_workspace(made, 80).poses
    readings = made.inverse_kinematics(poses) + 1e-6 * random.normal(size=(80, 3))
    measured = poses + 0.0
    measured[:, :3] += 2e-6 * random.normal(size=(80, 3))
    measured[:, 3:6] += 1e-6 * random.normal(size=(80, 3))  # half an angle, near no rotation
    measured[:, 3:] /= np.linalg.norm(measured[:, 3:], axis=1, keepdims=True)
    found = symkin.identify(quiet, symkin.Measurements.of(measured, readings), estimator)
    assert found.converged
    assert found.chi_square_ratio == pytest.approx(1, abs=0.3)
    own = bound.is_estimated
    errors = (found.mechanism.parameters - made.parameters)[own] / found.deviations[own]
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(1, abs=0.5)
    assert np.abs(errors).max() < 5
    after = symkin.evaluate(found.mechanism, actual=made, poses=poses)
    assert after.failed == 0
    assert after.position_rms < 2e-6


def test_pages_show_it_all(bound, tmp_path):
    settings = ProtocolSettings(bound.protocol.pose_count, candidates=1000, seed=1)
    result = symkin.run_protocol(bound.replace(protocol=settings))
    # The paper's estimator is not among those that are compared.
    assert [each.estimator for each in result.comparison] == ["implicit", "implicit", "joint"]
    assert all(each.converged for each in result.comparison)
    result.write(tmp_path / "run")
    again = symkin.identify(
        symkin.load_mechanism(bound.name), result.simulation.measurements, loss="huber"
    )
    again.report(tmp_path / "identification.html")
    symkin.check_mechanism(bound).report(tmp_path / "check.html")
    study_workspace(bound, count=500, resolution=7).report(tmp_path / "workspace.html")
    for page in ("run/report", "identification", "check", "workspace"):
        assert "<svg" in (tmp_path / f"{page}.html").read_text()


def test_what_was_observed_in_part_identifies_the_robot_too(bound, made):
    # Positions alone, with the readings: the closures bind the rest of the latent poses.
    poses = symkin.sample_workspace(made, 60).poses
    readings = made.inverse_kinematics(poses)
    seen = poses.copy()
    seen[:, 3:] = np.nan
    found = symkin.identify(
        bound, symkin.Measurements.of(seen, readings, pose_space="spatial"), prior="tolerances"
    )
    assert found.converged
    before = symkin.evaluate(bound, actual=made, poses=poses)
    after = symkin.evaluate(found.mechanism, actual=made, poses=poses)
    assert after.position_rms < before.position_rms / 5


@pytest.mark.parametrize("estimator", ["paper", "inverse"])
def test_estimators_that_know_readings_alone_are_refused(bound, estimator):
    sample = symkin.sample_workspace(bound, 60)
    measurements = symkin.Measurements.of(sample.poses, sample.readings)
    with pytest.raises(SymkinError, match='2 closures: use "implicit" or "joint"'):
        symkin.identify(bound, measurements, estimator)


def test_errors_are_those_from_where_the_model_says_that_the_platform_is(bound, made):
    # The drawing's poses are not those of a calibrated robot: it is commanded by height and tilts.
    poses = symkin.sample_workspace(bound, 50).poses
    exact = symkin.evaluate(made, actual=made, poses=poses)
    assert exact.failed == 0
    assert exact.position_max < 1e-11
    assert symkin.evaluate(bound, actual=made, poses=poses).position_rms > 1e-4


def test_home_moves_with_a_base_whose_height_is_held():
    nominal = symkin.load_mechanism("3RPS")
    sample = symkin.sample_workspace(nominal, 60)
    lifted = sample.poses + np.array([0, 0, 0.02, 0, 0, 0, 0])
    found = symkin.identify(nominal, symkin.Measurements.of(lifted, sample.readings)).mechanism
    assert found.home[2] == pytest.approx(nominal.home[2] + 0.02, abs=1e-4)
    assert found.inverse_kinematics(found.home)[0] == pytest.approx([1.75] * 3, abs=1e-4)
