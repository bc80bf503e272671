# SPDX-License-Identifier: MIT
"""Closures as an evaluation against measurements gives them."""

from __future__ import annotations

import numpy as np
import pytest

import symkin


def test_an_evaluation_against_measurements_has_the_closures_of_every_leg(
    paper: symkin.Mechanism,
) -> None:
    sample = symkin.sample_workspace(paper, 20, 1)
    readings = sample.readings.copy()
    readings[5:10, 0] = np.nan
    readings[:, 2] = sample.readings[:, 2] + 0.01
    found = symkin.evaluate(paper, measurements=symkin.Measurements.of(sample.poses, readings))
    assert found.closures is not None
    assert found.closures.shape == (20, 3)
    assert np.isnan(found.closures).sum() == 5
    assert found.closure_rms is not None
    rms, legs = found.closure_rms
    expected = paper.closure(2, sample.poses, readings[:, 2])
    assert legs[:2] == pytest.approx(0, abs=1e-12)
    assert legs[2] == pytest.approx(np.sqrt(np.mean(expected**2)))
    assert legs[2] > 1e-3
    assert rms == pytest.approx(legs[2] * np.sqrt(20 / 55))


def test_an_evaluation_against_a_robot_has_no_closures(paper: symkin.Mechanism) -> None:
    poses = symkin.sample_workspace(paper, 20, 1).poses
    found = symkin.evaluate(paper, actual=paper, poses=poses)
    assert found.closures is None
    assert found.closure_rms is None
