# SPDX-License-Identifier: MIT
"""Robots that follow a straightedge whose place nobody knows."""

import dataclasses

import numpy as np
import pytest

import symkin
from symkin.cli import main
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.model.settings import Frames
from symkin.planning.simulation import disturb

FLATNESS = 5e-6  # m


@pytest.fixture(scope="module")
def robot():
    return symkin.load_mechanism("3RRR")


@pytest.fixture(scope="module")
def followed(robot):
    """A robot as made, and its readings where it touches an edge that is laid three times."""
    actual, random = disturb(robot, 1), np.random.default_rng(51)
    places = symkin.sample_workspace(robot, 90, seed=1).poses.reshape(3, 30, 3).copy()
    share = np.linspace(0.0, 1.0, 30)[:, None]
    for each in places:  # from the first pose of each to the second
        each[:, :2] = each[0, :2] + share * (each[1, :2] - each[0, :2])
    touched = places.reshape(-1, 3)
    touched[:, :2] += random.normal(0.0, FLATNESS, (90, 2))
    readings = actual.inverse_kinematics(touched)
    taken = symkin.Measurements.of(np.tile([np.nan, 0.0, np.nan], (90, 1)), readings)
    deviations = np.tile([np.nan, FLATNESS, np.nan], (90, 1))
    sessions = np.repeat([1, 2, 3], 30)
    taken = dataclasses.replace(taken, pose_deviations=deviations, sessions=sessions)
    return actual, taken[np.flatnonzero(np.isfinite(readings).all(axis=1))]


ASKED = {"frames": ["base"], "sessions": ["frames"], "prior": "tolerances"}


def test_an_edge_that_is_touched_wherever_it_lies_shows_the_robot(robot, followed):
    actual, taken = followed
    found = symkin.identify(robot, taken, **ASKED)
    assert found.converged
    assert found.doubts == ()
    off = (found.mechanism.parameters - actual.parameters) / found.deviations
    assert np.nanmax(np.abs(off)) < 4
    told = [each for each in found.unknowns if each.name.startswith("leg")]
    assert min(each.deviation / each.tolerance for each in told if each.column >= 0) < 0.3
    assert not {"base.x", "session1.x", "session2.x"} & {*found.names}


def test_a_mistake_in_the_readings_along_an_edge_is_doubted(robot, followed):
    wrong = dataclasses.replace(followed[1], readings=followed[1].readings[:, [1, 0, 2]])
    assert symkin.identify(robot, wrong, **ASKED).doubts


def test_too_few_offsets_do_not_say_where_the_edge_is(robot, followed):
    with pytest.raises(NotIdentifiableError, match="needs at least 2 offsets"):
        symkin.identify(robot, followed[1][:1], frames=["base"], prior="tolerances")


def test_a_plan_follows_the_edge_that_is_drawn_and_the_command_identifies(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ["--frames", "base", "--prior", "tolerances"]
    observed = ["--observe", "straightness", "--base", "0, 50 mm, 10 deg"]
    few = ["--pose-count", "12", "--candidates", "300"]
    assert not main(["plan", "3RRR", *observed, *asked, *few, "--out", "p", "--no-report"])
    poses = symkin.read_plan("p/plan.csv", "3RRR").poses
    np.testing.assert_allclose(
        0.05 + poses[:, :2] @ [np.sin(np.radians(10)), np.cos(np.radians(10))], 0, atol=1e-9
    )
    assert not main(["simulate", "3RRR", "--plan", "p/plan.csv", *observed, "--out", "p"])
    taken = symkin.read_measurements("p/measurements.csv", "3RRR")
    assert np.isfinite(taken.poses[:, 1]).all()
    assert np.isnan(taken.poses[:, [0, 2]]).all()
    assert not main(["identify", "3RRR", "p/measurements.csv", *asked, "--out", "p", "--no-report"])
    found = symkin.read_estimate("p")
    assert found.converged
    assert {"base.y", "base.phi"} <= {*found.names}


def test_an_edge_beside_the_workspace_is_refused(robot):
    away = robot.replace(frames=Frames(base=(0.0, 5.0, 0.0)))
    with pytest.raises(SymkinError, match="does not go through the workspace"):
        symkin.plan(away, 10, candidates=50, observe="straightness", frames=["base"])
