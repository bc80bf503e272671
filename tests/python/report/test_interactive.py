# SPDX-License-Identifier: MIT
"""The view to be turned by hand: what stands where, and what the slider moves."""

import sys

import numpy as np
import plotly.graph_objects as go
import pytest

import symkin
from symkin import plot
from symkin.errors import SymkinError


def planned(name):
    mechanism = symkin.load_mechanism(name)
    return mechanism, symkin.make_plan(mechanism, mechanism.sample_workspace(300))


@pytest.mark.parametrize("name", ["3RRR", "5bar", "linear_delta", "hexapod_jugglebot"])
def test_the_slider_takes_the_legs_to_every_chosen_pose(name):
    mechanism, plan = planned(name)
    figure = plot.explore(mechanism, plan)
    (slider,) = figure.layout.sliders
    rows = np.flatnonzero(~plan.spare)
    assert [step.label for step in slider.steps] == ["home", *(f"row {row + 1}" for row in rows)]
    moved, traces = slider.steps[-1].args
    names = [figure.data[trace].name for trace in traces]
    pose, readings = plan.poses[rows[-1]], plan.readings[rows[-1]]
    for leg in range(len(mechanism.legs)):
        at = names.index(f"leg {leg + 1}")
        centres = mechanism.core.joint_centres(leg, pose, readings[leg])
        for axis, coordinates in zip("xyz", centres.T, strict=False):
            drawn = moved[axis][at]
            np.testing.assert_allclose([drawn[0], drawn[-1]], coordinates[[0, -1]], atol=1e-12)


def test_chosen_poses_spares_and_workspace_are_points_of_their_own():
    mechanism, plan = planned("3RRR")
    figure = plot.explore(mechanism, plan)
    points = {trace.name: len(trace.x) for trace in figure.data}
    assert points["workspace"] == 300
    assert points["spares"] == plan.spare.sum()
    for leg in range(3):
        assert points[f"chosen for leg {leg + 1}"] == len(plan.rows_of_set(leg))


def test_without_poses_the_workspace_is_drawn_and_single_poses_are_enough():
    mechanism = symkin.load_mechanism("3RRR")
    assert isinstance(plot.explore(mechanism), go.Figure)
    alone = plot.explore(mechanism, mechanism.home, candidates=mechanism.sample_workspace(10))
    assert [len(trace.x) for trace in alone.data[:2]] == [10, 1]


def test_a_pose_out_of_reach_is_refused():
    mechanism = symkin.load_mechanism("3RRR")
    with pytest.raises(SymkinError, match="does not reach the pose of row 2"):
        plot.explore(mechanism, [mechanism.home, [9, 0, 0]], candidates=[mechanism.home])


def test_without_plotly_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(ImportError, match=r"symkin\[interactive\]"):
        plot.explore(symkin.load_mechanism("3RRR"))
