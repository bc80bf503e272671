# SPDX-License-Identifier: MIT
"""The protocol as a whole."""

import numpy as np
import pytest

import symkin
from symkin.analysis.observability import expected_accuracy
from symkin.model.settings import ProtocolSettings, Tolerances
from symkin.model.symmetry import leg_carriers, map_poses


@pytest.fixture(scope="module")
def small(paper):
    settings = ProtocolSettings(pose_count=24, candidates=2000, seed=5)
    return paper.replace(protocol=settings)


def test_the_protocol_improves_the_robot_and_knows_how_well(small):
    result = symkin.run_protocol(small)
    assert result.identification.trustworthy
    assert result.after.position_rms < result.before.position_rms / 5
    expected = expected_accuracy(small, result.candidates.poses, result.identification.covariance)
    assert result.after.position_rms < 3 * expected.position
    assert result.plan.poses.shape[0] == 3 * (24 + 12)


def test_the_same_seed_gives_the_same_bytes(small):
    first, second = (symkin.run_protocol(small, seed=9) for _ in range(2))
    for path in ("plan.poses", "simulation.measurements.poses", "identification.covariance"):
        values = []
        for result in (first, second):
            value = result
            for name in path.split("."):
                value = getattr(value, name)
            values.append(value)
        np.testing.assert_array_equal(*values)


def test_the_poses_of_the_other_legs_are_images_of_the_reference_legs(small):
    plan = symkin.run_protocol(small).plan
    reference = plan.poses[plan.rows_of(0)]
    for leg, (_, element) in enumerate(leg_carriers(small)):
        np.testing.assert_array_equal(
            plan.poses[plan.rows_of(leg)], map_poses(small, element, reference)
        )


def test_without_sigmas_of_margin_every_candidate_may_be_measured(small):
    basis = symkin.run_protocol(small, margin_sigmas=0).plan.basis
    assert basis.excluded == 0
    assert basis.clearance.conditioning_limit == small.workspace.conditioning_limit
    assert symkin.run_protocol(small).plan.basis.excluded > 0


def test_progress_names_the_stages_in_order(small):
    stages = []
    symkin.run_protocol(small, progress=stages.append)
    assert [stage.split()[0] for stage in stages] == [
        "sampling",
        "selecting",
        "simulating",
        "identifying",
        "evaluating",
    ]


def test_poses_that_the_robot_cannot_take_are_replaced_and_counted(small):
    # The best poses lie at the rim, and a robot made three times as coarsely misses some of them.
    coarse = small.replace(tolerances=Tolerances(length=3e-3, angle=3e-3, gain=1e-3))
    candidates = symkin.sample_workspace(coarse, 3000).poses
    plan = symkin.make_plan(coarse, candidates, margin_sigmas=0)
    replaced = 0
    for seed in range(10):
        simulation = symkin.simulate(coarse, plan, seed)
        assert np.isfinite(simulation.measurements.poses).all()
        assert len(simulation.measurements.poses) == 72
        replaced += sum(simulation.replaced)
    assert replaced > 0


def test_a_mechanism_without_workspace_says_what_is_missing(small):
    with pytest.raises(symkin.SymkinError, match="workspace"):
        symkin.run_protocol(small.replace(workspace=None))
