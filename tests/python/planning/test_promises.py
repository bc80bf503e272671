# SPDX-License-Identifier: MIT
"""What is promised is kept by the share of robots that it is promised of."""

import numpy as np
import pytest
from typer.testing import CliRunner

import symkin
from symkin.analysis.promises import (
    _inverses,
    anywhere,
    parameter_effects,
    promised,
    sampled_bound,
)
from symkin.cli import app
from symkin.cli.options import share_of
from symkin.errors import SymkinError
from symkin.estimate.fit import as_mechanism
from symkin.model.settings import IdentificationSettings, Tolerances
from symkin.planning.made import disturb, poses_taken

ROBOTS = 4000
ROBOT = 2**62  # the first of those that a promise is made of


@pytest.fixture(scope="module")
def case(paper):
    """Effects at some poses, and a covariance of the parameters as noisy poses leave it."""
    poses = symkin.sample_workspace(paper, 400, seed=3).poses
    plan = symkin.make_plan(paper, poses, 24, spares=0)
    found = symkin.identify(paper, symkin.simulate(paper, plan, 5))
    effects, _ = parameter_effects(paper, poses)
    moves = effects[..., : len(paper.parameter_names)].reshape(len(effects), 6, -1)
    return moves, found.parameter_covariance


def forms_of(moves):
    return tuple(
        np.einsum("nij,nik->jk", part, part) / len(part) for part in (moves[:, :3], moves[:, 3:])
    )


def errors_of_robots(case, scale=1.0):
    """Position errors of robots at the poses, shape (robots, poses)."""
    moves, covariance = case
    values, vectors = np.linalg.eigh(covariance)
    half = vectors * np.sqrt(np.maximum(values, 0))
    drawn = np.random.default_rng(1).normal(size=(ROBOTS, len(half))) @ half.T
    scale = np.broadcast_to(scale, ROBOTS)[:, None]
    return np.linalg.norm(np.einsum("nij,rj->rni", moves[:, :3], scale * drawn), axis=2)


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.95, 0.99])
def test_so_many_robots_are_within_the_bound(case, confidence):
    moves, covariance = case
    found = promised(forms_of(moves), covariance, (len(moves), 0), confidence)
    rms = np.sqrt(np.mean(errors_of_robots(case) ** 2, axis=1))
    error = 4 * np.sqrt(confidence * (1 - confidence) / ROBOTS)
    assert np.mean(rms < found.position_bound) == pytest.approx(confidence, abs=error)
    assert np.sqrt(np.mean(rms**2)) == pytest.approx(found.position, rel=0.02)


def test_so_many_robots_are_within_the_bound_where_the_noise_was_estimated(case):
    moves, covariance = case
    found = promised(forms_of(moves), covariance, (len(moves), 0), 0.95, 6.0)
    spread = np.sqrt(np.random.default_rng(2).chisquare(6.0, ROBOTS) / 6.0)
    rms = np.sqrt(np.mean(errors_of_robots(case) ** 2, axis=1))
    assert np.mean(rms < found.position_bound * spread) == pytest.approx(0.95, abs=0.014)


def test_so_many_robots_are_within_the_bound_at_every_pose(case):
    largest, _ = anywhere(*case, 0.95)
    assert np.mean(errors_of_robots(case).max(axis=1) < largest) == pytest.approx(0.95, abs=0.014)
    spread = np.sqrt(np.random.default_rng(2).chisquare(6.0, ROBOTS) / 6.0)
    estimated, _ = anywhere(*case, 0.95, 6.0)
    kept = errors_of_robots(case).max(axis=1) < estimated * spread
    assert np.mean(kept) == pytest.approx(0.95, abs=0.014)


def test_half_of_the_robots_exceed_what_they_have_on_average(case):
    moves, covariance = case
    found = promised(forms_of(moves), covariance, (len(moves), 0), 0.5)
    assert 0.9 < found.position_bound / found.position < 1


def test_more_confidence_needs_more_poses(paper):
    sample = symkin.sample_workspace(paper, 800, seed=1)
    counts = [
        symkin.pose_count_curve(paper, sample, [12, 24, 48], confidence=confidence)
        .for_accuracy(9e-5)
        .count
        for confidence in (0.5, 0.95, 0.99)
    ]
    assert counts[0] < counts[1] < counts[2]


def test_estimated_noise_makes_the_promise_larger(paper):
    simulation = symkin.simulate(paper, symkin.plan(paper, 10, candidates=800, seed=1), 5)
    known = symkin.identify(paper, simulation, estimator="joint")
    unknown = symkin.identify(paper, simulation, estimator="joint", noise="estimate")
    assert unknown.noise_degrees == unknown.degrees_of_freedom
    assert unknown.interval > known.interval == pytest.approx(1.96, abs=1e-3)
    ratios = [
        each.expected_accuracy().position_bound / each.expected_accuracy().position
        for each in (known, unknown)
    ]
    assert ratios[1] > ratios[0]


def test_an_estimate_says_what_may_be_relied_on(paper):
    simulation = symkin.simulate(paper, symkin.plan(paper, 24, candidates=800, seed=1), 5)
    found = symkin.identify(paper, simulation)
    expected = found.expected
    assert expected.position < expected.position_bound < expected.position_anywhere
    assert expected.confidence == 0.95
    told = " ".join(found.page().paragraphs)
    assert "95\N{NO-BREAK SPACE}% of such robots are within" in told
    assert "anywhere in the workspace" in told
    assert "95 % within" in found.text().replace("\N{NO-BREAK SPACE}", " ")


def test_a_share_may_be_typed_in_percent():
    assert share_of("95%", "confidence") == share_of(" 0.95 ", "confidence") == 0.95


@pytest.mark.parametrize("text", ["95", "0%", "95 % of them", "0.3", "much"])
def test_a_confidence_that_is_none_is_refused(text):
    told = CliRunner().invoke(app, ["pose-count", "3RRR", "--confidence", text])
    assert told.exit_code == 2


def test_a_confidence_that_is_none_is_refused_in_python(paper):
    with pytest.raises(SymkinError, match=r"confidence is 95; expected a number from 0\.5"):
        symkin.pose_count_curve(paper, paper.home[None], confidence=95)


@pytest.mark.parametrize(
    ("name", "estimator"), [("3RRR", "implicit"), ("linear_delta", "joint"), ("hexa", "joint")]
)
def test_so_many_simulated_robots_keep_what_a_plan_promises(name, estimator):
    # As `benchmarks/promises_kept.py`, with fewer robots.
    mechanism, robots = symkin.load(name), 150
    sample = symkin.sample_workspace(mechanism, 1500, seed=1)
    plan, poses = symkin.make_plan(mechanism, sample, 24), sample.poses[::5]
    promise = symkin.predict_accuracy(mechanism, plan, poses, estimator)
    made = {str(seed): symkin.simulate(mechanism, plan, seed) for seed in range(robots)}
    measured = {seed: each.measurements for seed, each in made.items()}
    fleet = symkin.identify_many(mechanism, measured, estimator)
    errors = [
        symkin.evaluate(
            as_mechanism(mechanism, parameters, np.zeros_like(parameters)),
            actual=each.actual,
            poses=poses,
        ).position_rms
        for parameters, each in zip(fleet.parameters, made.values(), strict=True)
    ]
    assert 0.89 <= np.mean(np.array(errors) <= promise.position_bound) <= 0.995
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(promise.position, rel=0.05)


def test_a_plan_is_judged_where_robots_are_that_are_told_its_poses():
    hexa = symkin.load("hexa")
    told = symkin.sample_workspace(hexa, 12, seed=1).poses
    taken = poses_taken(hexa, told)
    assert all(np.array_equal(*pair) for pair in zip(taken, poses_taken(hexa, told), strict=True))
    robot = disturb(hexa, ROBOT)
    np.testing.assert_allclose(
        taken[0], robot.forward_kinematics(hexa.inverse_kinematics(told), told)[0], atol=1e-9
    )
    assert not np.allclose(taken[0][:, :3], taken[1][:, :3], atol=1e-4)


def test_a_pose_that_a_robot_cannot_take_is_judged_as_it_was_told():
    hexa = symkin.load("hexa")
    told = np.array(symkin.sample_workspace(hexa, 4, seed=1).poses)
    told[0, :3] += [0, 0, 1]  # beyond all legs
    assert all(np.array_equal(taken[0], told[0]) for taken in poses_taken(hexa, told))


@pytest.mark.parametrize("asked", [{}, {"assume": {"scale": 1e-7}}])
def test_legs_that_guide_the_platform_are_promised_what_they_keep(asked):
    # No pose that such a robot takes is one of its drawing.
    mechanism = symkin.load("3PRS")
    sample = symkin.sample_workspace(mechanism, 400, seed=1)
    plan = symkin.make_plan(mechanism, sample, 24)
    limits = {name: 1e-3 * value for name, value in vars(mechanism.tolerances).items()}
    as_drawn = mechanism.replace(tolerances=Tolerances(**limits))
    made, exact = (
        symkin.predict_accuracy(each, plan, sample, "joint", **asked)
        for each in (mechanism, as_drawn)
    )
    assert made.position == pytest.approx(exact.position, rel=0.03)


@pytest.mark.parametrize("asked", [{}, {"assume": {"scale": 1e-7}}])
def test_a_plan_of_robots_that_are_far_from_the_drawing_promises_less(asked):
    # At the drawing the best poses are best; robots with errors are not there.
    promised = []
    for share in (1e-3, 1.0):
        hexa = symkin.load("hexa")
        limits = {name: share * value for name, value in vars(hexa.tolerances).items()}
        hexa = hexa.replace(tolerances=Tolerances(**limits))
        sample = symkin.sample_workspace(hexa, 600, seed=1)
        plan = symkin.make_plan(symkin.load("hexa"), sample, 19)
        anywhere = None if asked else sample
        promised.append(
            symkin.predict_accuracy(hexa, plan, sample, "joint", anywhere=anywhere, **asked)
        )
    exact, made = promised
    assert 1.02 < made.position / exact.position < 1.1
    assert 1.04 < made.position_bound / exact.position_bound < 1.12
    if not asked:
        assert 1.02 < made.position_anywhere / exact.position_anywhere < 1.3


@pytest.mark.parametrize("name", ["rotary_delta", "linear_delta"])
def test_legs_with_held_parameters_are_promised_too(name):
    mechanism = symkin.load(name)
    sample = symkin.sample_workspace(mechanism, 300, seed=1)
    plan = symkin.make_plan(mechanism, sample, 12)
    found = symkin.predict_accuracy(mechanism, plan, sample, anywhere=sample)
    assert found.position < found.position_bound < found.position_anywhere


@pytest.mark.parametrize("count", [20, 60])
def test_a_sample_of_poses_bounds_the_error_over_all_of_them(paper, count):
    plan = symkin.plan(paper, 24, candidates=2000, seed=1)
    made = symkin.simulate(paper, plan, 3)
    fitted = symkin.identify(paper, made).mechanism
    every = symkin.evaluate(fitted, actual=made.actual, poses=plan.candidates).errors[0]
    rng, kept, inside = np.random.default_rng(1), [], []
    for _ in range(1000):
        some = rng.choice(every, count)
        kept.append(sampled_bound(some) > np.sqrt(np.mean(every**2)))
        inside.append(np.mean(every <= some.max()) >= 0.05 ** (1 / count))
    assert 0.92 < np.mean(kept) < 0.975
    assert np.mean(inside) > 0.93


def test_an_evaluation_says_what_its_poses_promise(paper):
    plan = symkin.plan(paper, 24, candidates=800, seed=1)
    made = symkin.simulate(paper, plan, 5)
    found = symkin.evaluate(paper, actual=made.actual, poses=plan.poses, confidence=0.9)
    promise = found.promise
    assert promise.position_bound > found.position_rms
    assert promise.inside == pytest.approx(0.1 ** (1 / found.evaluated))
    assert "with 90\N{NO-BREAK SPACE}% confidence" in " ".join(found.page().paragraphs)
    assert found.to_dict()["promise"]["position_bound_rms_m"] == promise.position_bound
    one = symkin.evaluate(paper, actual=made.actual, poses=plan.poses[:1])
    assert np.isnan(one.promise.position_bound)
    assert not one.page().paragraphs


def test_plans_and_estimates_promise_with_the_confidence_that_was_asked_for(paper):
    plans = [symkin.plan(paper, 24, candidates=400, seed=1, confidence=c) for c in (0.5, 0.99)]
    made = symkin.simulate(paper, plans[0], 5)
    found = [symkin.identify(paper, made, confidence=c) for c in (0.5, 0.99)]
    for low, high in (plans, found):
        assert (low.expected.confidence, high.expected.confidence) == (0.5, 0.99)
        assert low.expected.position == high.expected.position
        assert low.expected.position_bound < high.expected.position_bound
    with pytest.raises(SymkinError, match=r"confidence is 2; expected a number from 0\.5"):
        symkin.identify(paper, made, confidence=2)


def test_the_robust_loss_is_cauchy_s(paper):
    made = symkin.simulate(paper, symkin.plan(paper, 48, candidates=400, seed=1), 5)
    assert symkin.identify(paper, made, loss="robust") == symkin.identify(
        paper, made, loss="cauchy"
    )


ASSUMED = {"scale": 1e-4, "target": "0.2 mm"}


def test_a_plan_promises_what_an_estimate_from_it_does_with_what_is_assumed(paper):
    sample = symkin.sample_workspace(paper, 1500, seed=3)
    plan = symkin.make_plan(paper, sample, 40, assume=ASSUMED)
    found = symkin.identify(paper, symkin.simulate(paper, plan, 1), assume=ASSUMED)
    assert plan.expected.position == pytest.approx(found.expected.position, rel=0.02)
    assert plan.expected.position_bound == pytest.approx(found.expected.position_bound, rel=0.02)
    for planned, own in zip(plan.unknowns, found.first_unknowns, strict=True):
        assert planned.name == own.name
        assert planned.deviation == pytest.approx(own.deviation, rel=0.15)
    file = paper.replace(identification=IdentificationSettings(assume=ASSUMED))
    assert symkin.make_plan(file, sample, 40).expected == plan.expected
    exact = symkin.make_plan(file, sample, 40, assume={}).expected
    assert plan.expected.position > np.sqrt(2) * 2e-4 > 3 * exact.position


def test_poses_that_cannot_be_enough_are_told_what_is_assumed(paper):
    sample = symkin.sample_workspace(paper, 600, seed=3)
    curve = symkin.pose_count_curve(paper, sample, [40, 400], assume=ASSUMED)
    needed = curve.for_accuracy(position=1e-4)
    assert needed.count is None
    best = needed.remedies[0]
    assert best.change == "target known, of which 0.2 mm is assumed"
    assert best.enough
    assert "is not due to what is assumed" in needed.text()


def test_a_bow_is_promised_of_a_bed_that_is_probed_alone(paper):
    delta = symkin.load_mechanism("linear_delta")
    sample = symkin.sample_workspace(delta, 500, seed=1)
    flat, bowed = (
        symkin.make_plan(delta, sample, 40, observe="height", assume=assume).expected.position
        for assume in (None, {"bed": "0.2 mm"})
    )
    assert bowed > 1.02 * flat
    poses = symkin.sample_workspace(paper, 500, seed=3).poses
    plan = symkin.make_plan(paper, poses, 24)
    with pytest.raises(SymkinError, match="no height was observed"):
        symkin.predict_accuracy(paper, plan, poses, assume={"bed": "1 mm"})


def test_matrices_that_are_singular_exactly_or_almost_are_not_inverted():
    sound = np.random.default_rng(2).normal(size=(5, 3, 3))
    almost, wholly = sound[0].copy(), sound[1].copy()
    almost[2] = almost[0] + 1e-13 * almost[1]
    wholly[2] = 0.0
    given = np.concatenate([sound, [almost], np.full((1, 3, 3), np.nan)])
    some = np.isfinite(given).all(axis=(1, 2))
    for matrices, reached in ((given, some), (np.append(given, [wholly], axis=0), [*some, True])):
        good, inverse = _inverses(matrices, np.array(reached))
        assert good.tolist() == [True] * 5 + [False] * (len(matrices) - 5)
        assert inverse == pytest.approx(np.linalg.inv(sound), rel=1e-9)
