# SPDX-License-Identifier: MIT
"""What is still to be measured: gains that are kept while members are added."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from symkin.planning.completion import Completing


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**16), rows=st.integers(1, 6), wide=st.sampled_from([1.0, 1e3]))
def test_every_member_is_the_best_of_the_candidates_as_computed_anew(seed, rows, wide):
    random = np.random.default_rng(seed)
    candidates = random.normal(size=(300, rows, 15)) * np.logspace(1, -0.5, 15)
    errors = random.normal(size=(40, 15))
    information = np.diag(np.where(np.arange(15) < 7, 1.0, wide**-2))
    completing = Completing(candidates, errors.T @ errors, information, np.ones(300))
    added: list[int] = []

    def reached(covariance):
        """Ask of the members so far, of which each must have been the best when it was added."""
        worth = completing.worth(completing.covariance(added))
        worth[added] = 0
        best = int(np.argmax(worth))
        known = completing.covariance([*added, best])
        if np.allclose(known, covariance, rtol=1e-6, atol=0):
            added.append(best)
        return False

    completing.completion([], reached, 25)
    assert len(added) >= 24


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**16), rows=st.integers(1, 6))
def test_the_member_that_is_left_out_is_the_one_that_takes_off_least(seed, rows):
    random = np.random.default_rng(seed)
    candidates = random.normal(size=(12, rows, 15)) * np.logspace(1, -0.5, 15)
    errors = random.normal(size=(40, 15))
    form, members = errors.T @ errors, list(range(12))
    completing = Completing(candidates, form, np.eye(15), np.ones(12))
    left = [
        np.sum(form * completing.covariance([each for each in members if each != out]))
        for out in members
    ]
    kept = completing._without_least(members)
    assert kept == [each for each in members if each != int(np.argmin(left))]
