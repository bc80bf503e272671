# SPDX-License-Identifier: MIT
"""What speaks against the drawing's tolerances, and what intervals make of it."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.estimate.conflict import LIMIT, after_priors, conflict_of, widened_by
from symkin.estimate.workshop import workshop_tolerances
from symkin.model.settings import Frames

PRIORS = {"prior": "tolerances", "frames": ["base", "target"], "fixed": ["target.phi"]}


@pytest.fixture(scope="module")
def robot():
    """A 3-RRR of which positions are measured, with both frames unknown."""
    return symkin.load("3RRR").replace(frames=Frames(base=(0.3, -0.2, 0.4), target=(0.1, 0.05, 0)))


@pytest.fixture(scope="module")
def poses(robot):
    sample = symkin.sample_workspace(robot, 1500, seed=1)
    return symkin.make_plan(robot, sample, 60, design="mechanism", spares=0, margin_sigmas=12)


def made_at(robot, plan, factor, seed):
    """Estimate from positions of a robot that was made at so many tolerances."""
    tolerances = robot.tolerances
    wide = {
        each.name: factor * getattr(tolerances, each.name)
        for each in dataclasses.fields(tolerances)
        if isinstance(getattr(tolerances, each.name), float)
    }
    other = robot.replace(tolerances=dataclasses.replace(tolerances, **wide))
    taken = symkin.simulate(other, plan, seed, observe="position").measurements
    return symkin.identify(robot, taken, **PRIORS)


def test_a_sound_robot_fits_its_drawing_and_is_hardly_widened(robot, poses):
    found = [made_at(robot, poses, 1.0, seed) for seed in range(6)]
    assert all(LIMIT < each.conflict.p_large < 1 for each in found)
    assert not any("drawing" in doubt.code for each in found for doubt in each.doubts)
    factors = [each.conflict_factor for each in found]
    assert min(factors) == 1
    assert max(factors) < 3


def test_a_robot_at_three_tolerances_is_doubted_and_its_intervals_are_wider(robot, poses):
    found = [made_at(robot, poses, 3.0, seed) for seed in range(4)]
    assert all(each.conflict.p_large < LIMIT and not each.trustworthy for each in found)
    # Where a cause is named, it stands alone.
    told = ["far-from-drawing" in {one.code for one in each.doubts} for each in found]
    assert sum(told) >= 3
    factors = np.array([each.conflict.factor for each in found])
    assert np.exp(np.log(factors).mean()) == pytest.approx(3.0, rel=0.35)
    for each in found:
        assert each.conflict_factor == pytest.approx(1.5 * (each.conflict.ratio**2 - 1))
        assert each.conflict_factor > 3
        by_priors = each.prior_rows @ each.model_covariance
        apart = (each.conflict_factor - each.noise_factor) * by_priors.T @ by_priors
        assert each.covariance == pytest.approx(each.noise_factor * each.model_covariance + apart)


def test_a_robot_made_better_than_its_tolerances_is_trusted_and_they_are_called_too_wide(robot):
    plain = robot.replace(frames=None)
    plan = plain.plan(20, seed=1, candidates=400)
    found = []
    for seed in range(3):
        own = plain.simulate(plan, seed).actual.parameters
        better = plain.with_parameters(plain.parameters + 0.4 * (own - plain.parameters))
        taken = plain.simulate(plan, seed, better).measurements
        found.append(symkin.identify(plain, taken))
    assert all(each.trustworthy for each in found)
    told = [note for each in found for note in each.notes if note.code == "tolerances-wide"]
    assert len(told) == len(found)
    assert np.mean([note.figures["factor"] for note in told]) == pytest.approx(0.4, rel=0.3)


def test_wider_priors_leave_what_the_noise_brings_as_it_is():
    random = np.random.default_rng(5)
    rows, priors = random.normal(size=(6, 4)), np.diag([0.5, 2.0, 1.0, 4.0])
    covariance = np.linalg.inv(rows.T @ rows + priors.T @ priors)
    truth = 3 * random.normal(size=(40_000, 4)) / np.diag(priors)
    seen = truth @ rows.T + 2 * random.normal(size=(len(truth), 6))
    errors = seen @ rows @ covariance - truth
    expected = widened_by(covariance, priors, noise=4.0, priors=9.0)
    assert np.cov(errors.T) == pytest.approx(expected, rel=0.05, abs=0.02)
    before = np.diag(np.diag(priors) ** -2.0)
    assert widened_by(before, priors, noise=1.0, priors=9.0) == pytest.approx(9 * before)


def test_a_robot_computed_from_its_drawing_with_noise_is_named(robot, poses):
    (doubt,) = made_at(robot, poses, 1e-9, 1).doubts
    assert doubt.code == "near-drawing"
    assert "computed from the drawing" in str(doubt)


@pytest.mark.parametrize("options", [{}, {"prior": "tolerances", "estimator": "joint"}])
def test_numbers_without_noise_are_computed_from_the_drawing(robot, poses, options):
    plain = robot.replace(frames=None)
    exact = symkin.identify(plain, poses_as_measured(plain, poses), **options)
    assert "computed-from-drawing" in {doubt.code for doubt in exact.doubts}


def poses_as_measured(robot, plan):
    return symkin.Measurements.of(
        plan.poses, plan.readings, pose_space=robot.pose_space, reading_unit=robot.reading_unit
    )


def test_tolerances_without_priors_are_compared_but_widen_nothing(robot, poses):
    plain = robot.replace(frames=None)
    taken = symkin.simulate(plain, poses, 3).measurements
    found = symkin.identify(plain, taken, estimator="joint")
    assert found.conflict.directions > 10
    assert found.conflict_factor == 1


def test_priors_afterwards_are_those_from_the_beginning():
    random = np.random.default_rng(4)
    rows, tolerances = random.normal(size=(20, 5)), np.array([0.1, 0.3, 0.2, np.inf, 0.5])
    information, told = rows.T @ rows, rows.T @ random.normal(size=20)
    known = information + np.diag(tolerances**-2.0)
    nothing = np.full(5, np.inf)
    change, covariance, priors = after_priors(
        np.linalg.solve(information, told),
        np.linalg.inv(information),
        nothing,
        np.where(np.isfinite(tolerances), tolerances, 0.0),
    )
    assert np.array_equal(priors, tolerances)
    assert covariance == pytest.approx(np.linalg.inv(known))
    assert change == pytest.approx(np.linalg.solve(known, told))


def test_nothing_is_said_where_nothing_is_shown():
    assert conflict_of(np.zeros(2), 0.01 * np.eye(2), np.full(2, 0.1)) is None
    assert conflict_of(np.zeros(2), np.eye(2), np.full(2, np.inf)) is None


@pytest.fixture(scope="module")
def fleet(robot):
    """Robots whose angles are made worse than the file says, and lengths better."""
    plain = robot.replace(frames=None)
    made = plain.replace(
        tolerances=dataclasses.replace(
            plain.tolerances,
            angle=1.6 * plain.tolerances.angle,
            length=0.7 * plain.tolerances.length,
        )
    )
    plan = symkin.make_plan(plain, symkin.sample_workspace(plain, 1000, seed=1), 24)
    return plain, [symkin.simulate(made, plan, seed).measurements for seed in range(40)]


@pytest.mark.parametrize("options", [{}, {"estimator": "joint", "prior": "tolerances"}])
def test_a_fleet_tells_how_its_workshop_makes_robots(fleet, options):
    plain, measured = fleet
    found = workshop_tolerances([symkin.identify(plain, each, **options) for each in measured])
    by_name = {each.what: each for each in found}
    for what, true in (("angles", 1.6), ("lengths", 0.7), ("base_angle", 1.6)):
        assert by_name[what].low < true < by_name[what].high
        assert by_name[what].high < 1.6 * by_name[what].low
    assert {"sensor_gain", "proximal_length"} <= by_name.keys()


def test_no_robot_tells_nothing():
    with pytest.raises(symkin.SymkinError, match="no robot was identified"):
        workshop_tolerances([])


@pytest.mark.parametrize("estimator", [None, "joint"])
def test_a_fleet_has_a_table_of_what_the_workshop_makes(fleet, estimator):
    plain, measured = fleet
    found = symkin.identify_many(plain, measured[:15], estimator, tolerances="estimate")
    by_name = {each.what: each for each in found.made_within}
    assert by_name["angles"].low > 1.2
    assert "What the workshop makes" in found.text(whole=True)
    assert symkin.identify_many(plain, measured[:2]).made_within == ()
