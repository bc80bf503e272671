# SPDX-License-Identifier: MIT
"""Tolerances as priors, with their scale and the legs' common share fitted."""

import itertools
import json

import numpy as np
import pytest

import symkin
from symkin.estimate.conflict import widened_by
from symkin.estimate.fitted_prior import _alike, fitted_prior
from symkin.estimate.robot_symmetry import _Legs
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.model.settings import IdentificationSettings
from symkin.model.symmetry import symmetry_pairs
from symkin.model.tolerances import parameter_tolerances


@pytest.fixture(scope="module")
def plan(paper):
    return symkin.plan(paper, 8, design="mechanism")


def identified(paper, plan, share, scale, seed=3, **options):
    """A robot with errors of which the legs have a share of the variance in common."""
    rng = np.random.default_rng(seed)
    tolerances = np.asarray(parameter_tolerances(paper))
    common, own = rng.standard_normal(tolerances.shape[1]), rng.standard_normal(tolerances.shape)
    errors = scale * (np.sqrt(share) * common + np.sqrt(1 - share) * own) * tolerances
    actual = paper.with_parameters(paper.parameters + errors)
    taken = symkin.simulate(paper, plan, seed=seed, actual=actual).measurements
    return actual, symkin.identify(paper, taken, **({"prior": "fitted"} | options))


@pytest.fixture(scope="module")
def alike(paper, plan):
    return identified(paper, plan, 0.9, 0.5)


def test_what_legs_have_in_common_is_what_the_groups_mean_action_leaves(paper, hexapod):
    for mechanism in (paper, hexapod):
        legs = _Legs(mechanism)
        elements = symmetry_pairs(mechanism).keep_modes_and_home
        common = np.mean([legs.action(each) for each in elements], axis=0)
        names = [
            f"leg{leg + 1}.{mechanism.parameter_names[place]}"
            for leg, own in enumerate(legs.estimated)
            for place in own
        ]
        kinds, found = _alike(mechanism, names)
        assert kinds.tolist() == legs.kinds.tolist()
        np.testing.assert_allclose(found, common * len(elements), atol=1e-5)


def test_a_joint_prior_says_what_its_covariance_does(paper):
    layout = Layout.of(paper, core_setup(paper), prior="fitted", frames=["base"])
    legs = tuple(i for i, name in enumerate(layout.scalars) if name.endswith("base_radius"))
    covariance = 1e-6 * (0.1 * np.eye(3) + 0.9)
    made = layout.with_joint_prior(legs, covariance)
    columns = made.column[list(legs)]
    wanted = layout.prior_information
    wanted[np.ix_(columns, columns)] = np.linalg.inv(covariance)
    np.testing.assert_allclose(made.prior_information, wanted, rtol=1e-9)
    rows = made.prior_rows
    np.testing.assert_allclose(rows.T @ rows, wanted, rtol=1e-9, atol=1e-3)
    assert {made.prior_of(each) for each in legs} == {1e-3}
    fewer = made.without([columns[1]])
    left = fewer.column[[legs[0], legs[2]]]
    np.testing.assert_allclose(
        fewer.prior_information[np.ix_(left, left)],
        np.linalg.inv(covariance[np.ix_([0, 2], [0, 2])]),
        rtol=1e-9,
    )


def test_weights_and_covariance_are_those_of_normal_errors(paper):
    layout = Layout.of(paper, core_setup(paper), prior="fitted", fixed=["*_angle", "sensor_*"])
    count = len(layout.names)
    rng = np.random.default_rng(1)
    rows = rng.standard_normal((2 * count, count)) * 2e3
    information = rows.T @ rows
    tolerances = layout.column_tolerances
    covariance = np.linalg.inv(information + np.diag(tolerances**-2.0))
    seen = rng.multivariate_normal(
        np.zeros(count), np.linalg.inv(information) + 1e-6 * np.eye(count)
    )
    found = fitted_prior(paper, layout, covariance @ information @ seen, covariance)
    _, alike = _alike(paper, list(layout.names))
    (common,) = found.common
    assert common.kind == "length"
    evidence, drawn = {}, {}
    for (i, scale), (j, share) in itertools.product(
        enumerate(found.scales), enumerate(common.shares)
    ):
        prior = scale**2 * np.outer(tolerances, tolerances)
        prior = prior * (share * alike + (1 - share) * np.eye(count))
        spread = prior + np.linalg.inv(information)
        log = -(seen @ np.linalg.solve(spread, seen) + np.linalg.slogdet(spread)[1]) / 2
        evidence[i, j] = log - (np.log(scale) / np.log(2)) ** 2 / 2
        drawn[i, j] = prior
    weights = np.exp(np.array(list(evidence.values())) - max(evidence.values()))
    weights = (weights / weights.sum()).reshape(len(found.scales), -1)
    np.testing.assert_allclose(found.weights, weights.sum(axis=1), rtol=1e-6)
    np.testing.assert_allclose(common.weights, weights.sum(axis=0), rtol=1e-6)
    mean = sum(weights[each] * prior for each, prior in drawn.items())
    np.testing.assert_allclose(found.covariance, mean, rtol=1e-6)
    of_mean = np.linalg.solve(np.linalg.inv(mean) + information, information @ seen)
    spread = sum(
        weights[each]
        * np.outer(
            *2 * [np.linalg.solve(np.linalg.inv(prior) + information, information @ seen) - of_mean]
        )
        for each, prior in drawn.items()
    )
    np.testing.assert_allclose(found.spread, spread, rtol=1e-5, atol=1e-6 * np.abs(spread).max())


def test_what_measurements_say_of_the_tolerances_is_found_and_told(alike, tmp_path):
    _, found = alike
    prior = found.fitted_prior
    assert 0.3 < prior.scale < 0.8
    assert [each.kind for each in prior.common] == ["length", "angle", "sensor"]
    assert all(each.share > 0.5 for each in prior.common)
    told = found.text(whole=True)
    assert "Tolerances, fitted" in told
    assert "common share of lengths" in told
    said = json.loads(found.save(tmp_path / "it.json").read_text())["identification"][
        "fitted_prior"
    ]
    assert said["scale"] == pytest.approx(prior.scale)
    again = symkin.read_result(tmp_path / "it.json")
    assert again == found
    assert again.text(whole=True) == told


def test_the_covariance_contains_the_prior_and_what_averaging_leaves_open(alike):
    _, found = alike
    prior = found.fitted_prior
    factors = found.noise_factor, found.conflict_factor
    known = widened_by(found.model_covariance, found.prior_rows, *factors)
    np.testing.assert_allclose(found.covariance - known, prior.spread, rtol=1e-6)
    assert (
        np.linalg.eigvalsh(prior.spread / np.outer(*2 * [np.sqrt(np.diag(found.covariance))]))[0]
        > -1e-9
    )
    own = [found.names.index(each) for each in prior.names]
    information = (found.prior_rows.T @ found.prior_rows)[np.ix_(own, own)]
    np.testing.assert_allclose(information @ prior.covariance, np.eye(len(own)), atol=1e-8)
    deviations = np.sqrt(np.diag(prior.covariance))
    assert [found.params[each].prior for each in prior.names] == pytest.approx(deviations)


def test_robots_whose_legs_are_alike_are_found_better(paper, plan, alike):
    made = [alike, *(identified(paper, plan, 0.9, 0.5, seed) for seed in (4, 5, 6))]
    errors = np.array([
        [
            symkin.evaluate(each.mechanism, actual=actual).position_rms
            for each in (found, symkin.identify(paper, found.measurements, prior="tolerances"))
        ]
        for actual, found in made
    ])  # fmt: skip
    fitted, stated = np.sqrt(np.mean(errors**2, axis=0))
    assert fitted < 0.9 * stated


def test_without_a_symmetry_the_scale_alone_is_fitted():
    other = symkin.load_mechanism("3RRR_asymmetric")
    taken = symkin.simulate(other, symkin.plan(other, 12, design="mechanism"), seed=1).measurements
    found = symkin.identify(other, taken, prior="fitted")
    assert found.fitted_prior.common == ()
    assert 0.5 < found.fitted_prior.scale < 2
    assert "no leg is another's image" in found.text()


def test_a_file_may_ask_for_it_and_other_words_are_refused(paper, alike):
    asked = paper.replace(identification=IdentificationSettings(prior="fitted"))
    found = symkin.identify(asked, alike[1].measurements)
    assert found.fitted_prior == alike[1].fitted_prior
    with pytest.raises(symkin.SymkinError, match='expected "tolerances" or "fitted"'):
        symkin.identify(paper, alike[1].measurements, prior="fited")
