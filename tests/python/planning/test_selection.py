# SPDX-License-Identifier: MIT
"""Selection of poses: memory, rows made on demand, criteria and refusals."""

import numpy as np
import pytest

import symkin
from symkin.analysis.observability import observability_rows
from symkin.errors import NotIdentifiableError
from symkin.model.symmetry import map_poses
from symkin.planning.selection import LegRows

ROTATIONS = ("r0", "r1", "r2")


@pytest.fixture(scope="module")
def candidates(paper):
    return symkin.sample_workspace(paper, 3000, seed=5).poses


@pytest.fixture(scope="module")
def rows(paper, candidates):
    return observability_rows(paper, 0, candidates)


def same(a, b):
    """Whether two selections agree to the last bit."""
    return a.indices.tolist() == b.indices.tolist() and a.log_det == b.log_det


@pytest.mark.parametrize("kind", ["paper", "noise_aware"])
@pytest.mark.parametrize("memory_limit", [0, 768 << 20])
@pytest.mark.parametrize("threads", [1, 2])
def test_rows_made_on_demand_give_the_selection_of_an_array(
    paper, candidates, kind, memory_limit, threads
):
    array = observability_rows(paper, 1, candidates, kind)
    made = LegRows(paper, 1, candidates, kind)
    assert made.shape == (3000, 1, 8)
    found = symkin.select_poses(made, 24, memory_limit=memory_limit, threads=threads)
    assert same(found, symkin.select_poses(array, 24))


@pytest.mark.parametrize("memory_limit", [0, 768 << 20])
def test_orbits_made_on_demand_give_the_selection_of_a_three_dimensional_array(
    paper, candidates, memory_limit
):
    carried = [map_poses(paper, element, candidates) for element in ROTATIONS]
    array = np.stack([observability_rows(paper, 0, poses) for poses in carried], axis=1)
    made = LegRows(paper, 0, candidates, orbit=ROTATIONS)
    assert made.shape == array.shape
    for threads in (1, 2):
        found = symkin.select_poses(made, 8, memory_limit=memory_limit, threads=threads)
        assert same(found, symkin.select_poses(array, 8))


def test_rows_made_on_demand_keep_their_poses_and_their_mechanism_alive(paper, candidates):
    made = LegRows(symkin.load_mechanism("3RRR"), 0, (candidates + 0.0).tolist())
    rows = observability_rows(paper, 0, candidates)
    assert same(symkin.select_poses(made, 24), symkin.select_poses(rows, 24))


def test_a_candidate_out_of_reach_is_refused_by_its_index_unless_it_is_forbidden(paper, candidates):
    poses = candidates.copy()
    poses[1234] = 10.0
    for made in (LegRows(paper, 0, poses), observability_rows(paper, 0, poses)):
        with pytest.raises(symkin.SymkinError, match="candidate 1234 has a row that is not finite"):
            symkin.select_poses(made, 24)
        found = symkin.select_poses(made, 24, forbidden=np.arange(3000) == 1234)
        assert 1234 not in found.indices


def test_threads_do_not_change_the_selection(rows):
    many = np.tile(rows, (70, 1)) * np.random.default_rng(1).uniform(0.9, 1, (70 * 3000, 1))
    one, two, three = (symkin.select_poses(many, 24, threads=threads) for threads in (1, 2, 3))
    assert same(one, two)
    assert same(one, three)
    assert one.certificate == two.certificate == three.certificate


def test_every_seed_finds_the_best_set(rows):
    found = [symkin.select_poses(rows, 24, seed=seed).log_det for seed in range(1, 21)]
    assert max(found) - min(found) < 1e-9


def criterion_of(name, rows, indices, weight):
    chosen = rows[indices]
    singular = np.linalg.svd(chosen, compute_uv=False)
    if name == "expected_error":
        return -np.trace(np.linalg.solve(chosen.T @ chosen, weight))
    values = {
        "O2": singular[-1] / singular[0],
        "O3": singular[-1],
        "O4": singular[-1] ** 2 / singular[0],
        "O5": 1 / np.sum(1 / singular),
    }
    return values[name]


@pytest.mark.parametrize("name", ["O2", "O3", "O4", "O5", "expected_error"])
def test_other_criteria_beat_random_sets_and_no_single_exchange_improves_them(rows, name):
    some = rows[:150]
    weight = np.diag(1.0 / np.arange(1, 9))
    found = symkin.select_poses(some, 12, criterion=name, error_weight=weight)
    best = criterion_of(name, some, found.indices, weight)
    assert abs(best) == pytest.approx(found.criterion_value, rel=1e-9)
    generator = np.random.default_rng(3)
    for _ in range(500):
        drawn = generator.choice(len(some), 12, replace=False)
        assert criterion_of(name, some, drawn, weight) < best
    for place in range(12):
        for other in np.setdiff1d(np.arange(len(some)), found.indices):
            exchanged = found.indices.copy()
            exchanged[place] = other
            assert criterion_of(name, some, exchanged, weight) <= best + 1e-7 * abs(best)


@pytest.mark.parametrize("name", ["O2", "O3", "O4", "O5", "expected_error"])
def test_the_certificate_speaks_of_the_criterion(rows, name):
    found = symkin.select_poses(rows, 24, criterion=name, error_weight=np.eye(8))
    certificate = found.certificate
    assert 0.95 < certificate.efficiency < 1
    assert 0 < certificate.o1_efficiency < 1
    assert certificate.efficiency != certificate.o1_efficiency
    assert not certificate.proven_optimal


@pytest.mark.parametrize("name", ["O2", "O3", "O4", "O5", "expected_error"])
def test_every_method_gets_the_certificate_of_the_criterion(rows, name):
    some, weight = rows[:500], np.eye(8)
    best = symkin.select_poses(some, 12, criterion=name, error_weight=weight)
    poor = symkin.select_poses(some, 12, criterion=name, error_weight=weight, method="random")
    assert poor.certificate.efficiency < best.certificate.efficiency < 1
    # Both compare with a bound on the same optimum, which the better one does not exceed.
    sign = -1 if name == "expected_error" else 1
    bound = poor.criterion_value / poor.certificate.efficiency**sign
    assert sign * best.criterion_value <= sign * bound
    everything = symkin.select_poses(some[:12], 12, criterion=name, error_weight=weight).certificate
    assert everything.efficiency == 1
    assert everything.proven_optimal


def test_the_certificate_of_o1_is_that_of_the_determinant(rows):
    certificate = symkin.select_poses(rows[:200], 12).certificate
    assert certificate.efficiency == certificate.o1_efficiency


def test_too_few_poses_for_the_parameters_are_refused(paper, rows):
    words = "5 poses of 1 row cannot show 8 parameters; expected at least 8 poses"
    with pytest.raises(symkin.SymkinError, match=words):
        symkin.select_poses(rows, 5, parameter_names=paper.parameter_names)


def guided():
    """A leg with a guide, with candidates at one orientation: its base and platform look alike."""
    mechanism = symkin.load_mechanism("3PRR")
    poses = symkin.sample_workspace(mechanism, 500, seed=1).poses.copy()
    poses[:, 2] = 0.1
    rows = observability_rows(mechanism, 0, poses)
    return mechanism, rows[np.isfinite(rows).all(axis=1)]


def test_combinations_that_no_candidate_shows_are_named():
    mechanism, rows = guided()
    with pytest.raises(NotIdentifiableError) as refusal:
        symkin.select_poses(rows, 24, parameter_names=mechanism.parameter_names)
    message = str(refusal.value)
    assert "only 5 independent combinations of the 7 parameters" in message
    # The guide's foot and the platform's point move together along the guide's normal.
    assert "base_radius" in message
    assert "platform_radius" in message
    assert "distal_length" not in message
    directions = np.asarray(refusal.value.null_directions)
    assert directions.shape == (7, 2)
    assert np.abs(rows @ directions).max() < 1e-9


def test_a_prior_that_shows_what_the_candidates_do_not_makes_a_selection_possible():
    mechanism, rows = guided()
    free = observability_rows(mechanism, 0, symkin.sample_workspace(mechanism, 10, seed=2).poses)
    found = symkin.select_poses(rows, 24, prior=free.T @ free)
    assert np.isfinite(found.log_det)


def test_candidates_that_are_all_alike_are_refused_with_every_combination(paper, rows):
    with pytest.raises(NotIdentifiableError) as refusal:
        symkin.select_poses(
            np.repeat(rows[:1], 50, axis=0), 24, parameter_names=paper.parameter_names
        )
    message = str(refusal.value)
    assert "only 1 independent combination of the 8 parameters" in message
    assert message.count(";") == 7
    assert all(name in message for name in paper.parameter_names)


def test_poses_too_few_for_what_each_shows_are_refused_with_the_combinations():
    # Each candidate shows one of eight parameters, twice.
    rows = np.zeros((16, 2, 8))
    rows[np.arange(16), :, np.arange(16) % 8] = [1.0, 2.0]
    names = tuple("abcdefgh")
    with pytest.raises(NotIdentifiableError) as refusal:
        symkin.select_poses(rows, 4, parameter_names=names)
    assert "the choice of 4 poses does not show 4 combinations of the 8 parameters" in str(
        refusal.value
    )
    assert "select more poses (not shown: 1 " in str(refusal.value)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"required": [7], "forbidden": np.arange(3000) == 7}, "candidate 7 is required and forb"),
        ({"required": [7, 7]}, "candidate 7 is required twice"),
        ({"required": [3000]}, "the required candidate 3000 does not exist"),
        ({"required": range(25)}, "required poses is 25, more than the count 24"),
        (
            {"required": [1, 2], "coordinates": np.zeros((3000, 2)), "minimum_distance": 0.1},
            "the required candidates 1 and 2 are",
        ),
        (
            {"method": "all", "coordinates": np.zeros((3000, 2)), "minimum_distance": 0.1},
            "takes every candidate, however near",
        ),
        ({"prior": np.eye(7)}, "the prior information is 7 x 7, expected 8 x 8"),
        ({"prior": -np.eye(8)}, "not positive semidefinite"),
        ({"prior": np.triu(np.ones((8, 8)))}, "the prior information is not symmetric"),
        ({"forbidden": np.arange(3000) > 20}, "24 poses are to be selected, but only 21 "),
    ],
)
def test_options_that_contradict_each_other_are_refused(rows, options, words):
    with pytest.raises(symkin.SymkinError, match=words):
        symkin.select_poses(rows, 24, **options)
