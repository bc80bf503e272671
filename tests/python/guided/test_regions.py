# SPDX-License-Identifier: MIT
"""Which poses a device is likely to refuse, by what became of others."""

import numpy as np
import pytest

from symkin.guided.regions import Regions

POSITIONS = 3


@pytest.fixture(scope="module")
def poses():
    return np.random.default_rng(1).normal(size=(1000, 6))


@pytest.mark.parametrize("part", [slice(0, 3), slice(3, 6)], ids=["positions", "orientations"])
def test_a_hidden_half_space_is_told_by_few_failures_among_six_coordinates(poses, part):
    own = poses[:, part] @ [1.0, -0.5, 0.3]
    hidden = own > np.quantile(own, 0.85)
    tried = range(40)
    failed = np.flatnonzero(hidden[:40])
    assert 4 <= len(failed) <= 8
    chance = Regions(poses, POSITIONS, seed=1).chance(tried, failed)
    others = np.arange(1000) >= 40
    assert chance[hidden & others].mean() < 0.5
    assert chance[~hidden & others].mean() > 0.9


def test_failures_at_random_are_no_region(poses):
    failed = np.flatnonzero(np.random.default_rng(3).random(60) < 0.1)
    assert len(failed) >= 4
    chance = Regions(poses, POSITIONS, seed=1).chance(range(60), failed)
    assert chance.min() > 0.75
    assert chance.mean() == pytest.approx(1 - (1 + len(failed)) / (10 + 60), abs=0.02)


def test_before_any_try_all_poses_are_about_as_likely(poses):
    positions_alone = Regions(poses[:, :3], POSITIONS, seed=1)
    assert np.ptp(positions_alone.chance([], [])) < 0.2
