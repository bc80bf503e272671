# SPDX-License-Identifier: MIT
"""What an estimate rests on without having estimated it: declared, it widens the answer."""

import dataclasses
import re

import numpy as np
import pytest

import symkin
from symkin.errors import SymkinError
from symkin.model.settings import Frames

FRAMES = Frames(base=(0.3, -0.2, 0.4), target=(0.1, 0.05, 0.0))
GAINS = {"fixed": ["sensor_gain"]}


def planned(mechanism, count, seed=1, **observe):
    sample = symkin.sample_workspace(mechanism, 1000, seed=1)
    return symkin.make_plan(mechanism, sample, count, design="mechanism", seed=seed, **observe)


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


@pytest.fixture(scope="module")
def measured(robot):
    return symkin.simulate(robot, planned(robot, 30), 1).measurements


@pytest.fixture(scope="module")
def assumed(robot, measured):
    declared = {"scale": 1e-4, "target": "1 mm", "sensor_gain": 1e-3}
    return symkin.identify(robot, measured, assume=declared, **GAINS)


def change_of(found, again, step):
    """How far the columns move from one estimate to another, for a unit of what has changed."""
    values = [{each.name: each.value for each in one.unknowns} for one in (found, again)]
    return np.array([(values[1][name] - values[0][name]) / step for name in found.names])


def agrees(moves, seen):
    """To first order: within a hundredth of the largest."""
    np.testing.assert_allclose(moves, seen, atol=0.01 * np.abs(seen).max())


def moves_of(found):
    return {each.name: each.moves for each in found.assumed}


def test_a_device_with_a_longer_metre_moves_the_estimate_as_it_is_told(robot, measured, assumed):
    longer = measured.poses * [1 + 1e-4, 1 + 1e-4, 1]
    again = symkin.identify(
        robot, dataclasses.replace(measured, poses=longer), assume={"scale": 1e-4}, **GAINS
    )
    agrees(moves_of(assumed)["scale"], change_of(assumed, again, 1e-4))


@pytest.mark.parametrize("name", ["3PRR", "linear_delta", "hexapod_jugglebot"])
def test_a_longer_metre_is_a_larger_robot_of_any_chain(name):
    robot = symkin.load(name)
    measured = symkin.simulate(robot, planned(robot, 30), 1).measurements
    how = {"assume": {"scale": 1e-4}, "prior": "tolerances"}
    longer = measured.poses.copy()
    longer[:, : robot.space.size] *= 1 + 1e-4
    found, again = (
        symkin.identify(robot, dataclasses.replace(measured, poses=poses), **how)
        for poses in (measured.poses, longer)
    )
    agrees(found.assumed[0].moves, change_of(found, again, 1e-4))


def test_a_held_parameter_that_is_another_moves_the_estimate_as_it_is_told(
    robot, measured, assumed
):
    parameters = robot.parameters.copy()
    parameters[1, robot.parameter_names.index("sensor_gain")] -= 1e-4
    other = robot.replace(symmetry=None).with_parameters(parameters)
    again = symkin.identify(other, measured, assume={"scale": 1e-4}, **GAINS)
    agrees(moves_of(assumed)["leg2.sensor_gain"], change_of(assumed, again, 1e-4))


def test_a_target_that_sits_elsewhere_moves_the_estimate_as_it_is_told(robot, measured, assumed):
    nearer = robot.replace(frames=Frames(target=(-1e-4, 0.0, 0.0)))
    again = symkin.identify(nearer, measured, assume={"scale": 1e-4}, **GAINS)
    agrees(moves_of(assumed)["target.x"], change_of(assumed, again, 1e-4))


def test_a_bed_that_is_bowed_moves_the_estimate_as_it_is_told():
    robot = symkin.load("linear_delta")
    probe = planned(robot, 40, observe="height")
    measured = symkin.simulate(robot, probe, 1, observe="height").measurements
    found = symkin.identify(robot, measured, assume={"bed": "0.2 mm"})
    places = found.latent_poses[:, :2]
    squares = np.sum(places**2, axis=1)
    bowed = measured.heights - 1e-4 * squares / squares.max()
    again = symkin.identify(robot, dataclasses.replace(measured, heights=bowed))
    agrees(found.assumed[0].moves, change_of(found, again, 1e-4))
    observations, bed = found.expected.budget
    assert bed.share > 0.1
    assert bed.share + observations.share == pytest.approx(1)


@pytest.mark.parametrize("name", ["3RRR", "linear_delta", "hexapod_jugglebot"])
def test_a_robot_that_sags_moves_the_estimate_as_it_is_told(name):
    robot = symkin.load(name)
    measured = symkin.simulate(robot, planned(robot, 30), 1).measurements
    how = {"prior": "tolerances", "estimator": "joint"}
    found = symkin.identify(robot, measured, assume={"sag": "0.1 mm"}, **how)
    places = found.latent_poses[:, : robot.space.size]
    squares = np.square(places - places.mean(axis=0)).sum(axis=1)
    lower = measured.poses.copy()
    lower[:, robot.space.size - 1] -= 1e-4 * squares / squares.max()
    again = symkin.identify(robot, dataclasses.replace(measured, poses=lower), **how)
    agrees(found.assumed[0].moves, change_of(found, again, 1e-4))
    observations, sag = found.expected.budget
    assert sag.source == "sag"
    assert sag.share > 0.01
    assert sag.share + observations.share == pytest.approx(1)


def test_a_sag_of_positions_that_nobody_measured_is_refused():
    robot = symkin.load("linear_delta")
    probe = planned(robot, 40, observe="height")
    heights = symkin.simulate(robot, probe, 1, observe="height").measurements
    with pytest.raises(SymkinError, match='assume "sag" is of positions that were measured'):
        symkin.identify(robot, heights, assume={"sag": "0.1 mm"})


def test_the_budget_says_where_the_error_comes_from(assumed):
    """Figures of the 3-RRR are those that another program found."""
    lines = {line.source: line for line in assumed.expected.budget}
    assert list(lines)[:2] == ["observations", "scale"]
    assert lines["scale"].position == pytest.approx(0.029e-3, rel=0.1)
    assert lines["target.x"].position == pytest.approx(1e-3, rel=1e-6)
    assert lines["leg3.sensor_gain"].position == pytest.approx(0.016e-3, rel=0.1)
    assert sum(line.share for line in lines.values()) == pytest.approx(1)
    total = np.sqrt(sum(line.position**2 for line in lines.values()))
    assert assumed.expected.position == pytest.approx(total)
    assert assumed.expected.position_bound > total
    assert assumed.expected_accuracy().position == pytest.approx(total, rel=0.01)


def test_deviations_contain_what_was_assumed_and_the_model_s_covariance_does_not(
    robot, measured, assumed
):
    plain = symkin.identify(robot, measured, "joint", **GAINS)
    np.testing.assert_allclose(assumed.model_covariance, plain.model_covariance)
    np.testing.assert_allclose(assumed.observed_covariance, plain.covariance, rtol=1e-9)
    assert (np.diag(assumed.covariance) > np.diag(plain.covariance)).all()
    np.testing.assert_allclose(
        [assumed.params[name].deviation for name in assumed.names],
        np.sqrt(np.diag(assumed.covariance)),
    )
    assert plain.expected.budget == ()


def test_intervals_hold_the_truth_of_robots_whose_gains_are_not_as_assumed(robot):
    plan, inside = planned(robot, 30), []
    held = robot.parameter_names.index("sensor_gain")
    for seed in range(1, 21):
        made = symkin.simulate(robot, plan, seed)  # gains within the tolerance
        found = symkin.identify(
            robot, made.measurements, assume={"sensor_gain": robot.tolerances.gain}, **GAINS
        )
        errors = np.abs(found.mechanism.parameters - made.actual.parameters)
        others = np.delete(errors / found.deviations, held, axis=1)
        inside.append(others < 1.96)
    assert 0.9 < np.mean(inside) < 0.99


def test_what_is_held_without_a_word_is_noted(robot, measured, assumed):
    held = symkin.identify(robot, measured, **GAINS)
    (note,) = (each for each in held.notes if each.code == "held-as-exact")
    assert "sensor_gain of legs 1, 2, 3, scale (of " in str(note)
    (note,) = (each for each in assumed.notes if each.code == "held-as-exact")
    assert str(note).startswith("sag is held and taken as exact")
    declared = {"scale": 1e-4, "target": "1 mm", "sensor_gain": 1e-3, "sag": "0.1 mm"}
    found = symkin.identify(robot, measured, assume=declared, **GAINS)
    assert "held-as-exact" not in {each.code for each in found.notes}


def test_the_tolerances_may_be_assumed_of_whatever_is_held(robot, measured):
    twice = symkin.identify(robot, measured, assume={"tolerances": 2}, **GAINS)
    told = symkin.identify(
        robot, measured, assume={"sensor_gain": 2 * robot.tolerances.gain}, **GAINS
    )
    assert twice.assumed == told.assumed
    np.testing.assert_array_equal(twice.covariance, told.covariance)
    assert symkin.identify(robot, measured, assume={"tolerances": 0}, **GAINS).assumed == ()
    with pytest.raises(SymkinError, match='assumption of "tolerances" is -1'):
        symkin.identify(robot, measured, assume={"tolerances": -1}, **GAINS)


def test_legs_that_share_a_length_and_differ_move_the_estimate_as_it_is_told(robot, measured):
    how, plain = {"shared": ["distal_length"]}, robot.replace(symmetry=None)
    found = symkin.identify(plain, measured, assume={"distal_length": "0.1 mm"}, **how)
    parameters = robot.parameters.copy()
    parameters[1, robot.parameter_names.index("distal_length")] -= 1e-5
    again = symkin.identify(plain.with_parameters(parameters), measured, **how)
    moves = dict(zip(found.names, moves_of(found)["leg2.distal_length"], strict=True))
    told = [
        [
            moves.get(name, moves.get(f"leg{leg}.{name}", 0.0))
            - (leg == 2) * (name in how["shared"])
            for name in robot.parameter_names
        ]
        for leg in (1, 2, 3)
    ]
    agrees(np.array(told), (again.mechanism.parameters - found.mechanism.parameters) / 1e-5)


def test_an_estimate_with_assumptions_loads_back(assumed, tmp_path):
    assumed.save(tmp_path / "results.json")
    loaded = symkin.read_estimate(tmp_path / "results.json")
    assert loaded == assumed
    assert loaded.expected.budget == assumed.expected.budget


def test_the_file_says_what_is_assumed(robot, measured, assumed, tmp_path):
    declared = "\n[assumed]\nscale = 1e-4\ntarget = '1 mm'\nsensor_gain = 1e-3\n"
    file = tmp_path / "robot.toml"
    robot.save(file)
    file.write_text(file.read_text() + declared)
    read = symkin.load(file)
    found = symkin.identify(read, measured, **GAINS)
    np.testing.assert_array_equal(found.covariance, assumed.covariance)
    read.save(tmp_path / "again.toml")
    assert symkin.load(tmp_path / "again.toml").identification == read.identification


@pytest.mark.parametrize(
    ("declared", "said"),
    [
        ({"scael": 1e-4}, 'assume "scael" matches no unknown.*did you mean "scale"'),
        ({"distal_length": "1 mm"}, "leg1.distal_length, which is estimated; a prior"),
        ({"target": 1e-3}, "scalars in m and rad; expected a unit, such as 1 mm"),
        ({"target": "1 mmm"}, 'the assumption of "target" .* unknown unit'),
        ({"target.x": "-1 mm"}, 'assumption of "target.x" is -1 mm; expected a positive'),
        ({"scale": "1 mm"}, 'the assumption of "scale"'),
        ({"bed": "0.1 mm"}, "no height was observed"),
        ({"sag": 1e-3, "scale": "1 mm"}, 'the assumption of "scale"'),
    ],
)
def test_an_assumption_that_means_nothing_is_refused(robot, measured, declared, said):
    with pytest.raises(SymkinError, match=said):
        symkin.identify(robot, measured, assume=declared)


def test_an_estimator_of_single_legs_is_refused(robot, measured):
    with pytest.raises(SymkinError, match='expected "joint" here, since assume was given'):
        symkin.identify(robot, measured, "implicit", assume={"scale": 1e-4})


def test_what_the_device_is_taken_to_know_is_noted_until_it_is_declared(robot, measured):
    """No residual shows a longer metre or another target: a sound robot explains both."""
    scale, target = "scale (of the measuring device)", "target (its place on the platform)"
    sag = "sag"
    ways = [
        ({}, (scale, target, sag)),
        ({"assume": {"scale": 1e-4}}, (target, sag)),
        ({"frames": ["target"], "prior": "tolerances"}, (scale, sag)),
        ({"assume": {"scale": 1e-4, "target": "1 mm", "sag": "1 mm"}}, ()),
    ]
    for asked, names in ways:
        notes = symkin.identify(robot, measured, **asked).notes
        said = [str(note) for note in notes if note.code == "held-as-exact"]
        assert bool(said) == bool(names)
        assert [name in said[0] for name in names] == [True] * len(names)
    unseen = measured.poses * [np.nan, np.nan, 1]
    angles = dataclasses.replace(measured, poses=unseen)
    notes = symkin.identify(robot, angles, prior="tolerances").notes
    assert "held-as-exact" not in {note.code for note in notes}


def test_what_is_missed_is_told_with_what_it_does_to_the_robot(robot, measured):
    found = symkin.identify(robot, measured)
    (note,) = (each for each in found.notes if each.code == "unseen")
    told = re.search(r"a sag of (\S+) m at the outermost pose \((\S+) times\)", str(note))
    size, times = float(told[1]), float(told[2])
    away = np.sum((measured.poses[:, :2] - measured.poses[:, :2].mean(axis=0)) ** 2, axis=1)
    poses = np.array(measured.poses)
    poses[:, 1] -= size * away / away.max()
    sagging = symkin.identify(robot, dataclasses.replace(measured, poses=poses))
    moved = symkin.evaluate(sagging.mechanism, actual=found.mechanism, poses=measured.poses)
    expected = found.expected_at_poses.position
    assert moved.position_rms / expected == pytest.approx(times, rel=0.15)
    assert moved.position_rms > expected
    known = symkin.identify(robot, measured, **note.options)
    still = " ".join(str(each) for each in known.notes if each.code == "unseen")
    assert "sag" not in still
    assert known.expected_at_poses.position > moved.position_rms
