# SPDX-License-Identifier: MIT
"""Sessions: offsets, frames and noise of their own, noticed, named and estimated as unknowns."""

import dataclasses
import json
import re

import numpy as np
import pytest

import symkin
from symkin.cli import main
from symkin.data.joining import joined
from symkin.errors import SymkinError
from symkin.estimate.evidence.sessions import session_tests
from symkin.model.settings import NoiseSettings

SHIFTS = {
    "a sensor was homed anew": ({"leg2.session1": "1 mrad"}, ["offsets"], "sessions-offsets"),
    "the device was moved": (
        {"session1.x": "0.5 mm", "session1.phi": "2 mrad"}, ["frames"], "sessions-frames",
    ),
    "the device stood elsewhere": (
        {"session1.x": "5 cm", "session1.phi": "0.1 rad"}, ["frames"], "sessions-frames",
    ),
    "one was noisier": ({"session1.noise": 3}, ["noise"], "sessions-noise"),
}  # fmt: skip


@pytest.fixture(scope="module")
def plan(paper):
    return symkin.plan(paper, 40, design="mechanism", candidates=2000, seed=1)


@pytest.fixture(scope="module")
def sound(paper, plan):
    return symkin.simulate(paper, plan, 1, changes={"leg1.session1": 0.0})


@pytest.fixture(scope="module", params=list(SHIFTS))
def shifted(request, paper, plan):
    changes, options, code = SHIFTS[request.param]
    return symkin.simulate(paper, plan, 1, changes=changes), changes, options, code


def test_what_differs_is_noticed_named_and_told_how_to_be_asked_for(paper, shifted):
    simulation, _, options, code = shifted
    for estimator in ("implicit", "joint"):
        found = symkin.identify(paper, simulation.measurements, estimator)
        assert [doubt.code for doubt in found.doubts] == [code]
        assert found.doubts[0].options == {"sessions": options}


def test_as_an_unknown_it_is_found_and_the_robot_is_right(paper, shifted):
    simulation, changes, options, _ = shifted
    found = symkin.identify(paper, simulation.measurements, sessions=options)
    assert found.trustworthy
    assert found.residual_rms < (0.5e-3 if options == ["noise"] else 0.25e-3)
    true = {"session1.x": 5e-4, "session1.phi": 2e-3, "leg2.session1": 1e-3}
    if changes.get("session1.x") == "5 cm":
        true |= {"session1.x": 0.05, "session1.phi": 0.1}
    for name in changes:
        if name.endswith("noise"):
            np.testing.assert_allclose(found.session_noise, [3, 1], rtol=0.3)
        else:
            own = found.params[name]
            assert abs(own.value - true[name]) < 4 * own.deviation < 2e-4
    errors = (found.mechanism.parameters - simulation.actual.parameters) / found.deviations
    assert np.nanmax(np.abs(errors)) < 3.5


def test_sound_sessions_are_not_doubted_and_what_they_do_not_have_is_none(paper, sound):
    found = symkin.identify(paper, sound.measurements)
    assert found.doubts == ()
    assert len(session_tests(found)) == 3
    free = symkin.identify(paper, sound.measurements, sessions=["offsets", "frames", "noise"])
    own = [each for each in free.unknowns if "session" in each.name]
    assert len(own) == 3 + 3
    assert all(abs(each.value) < 3.5 * each.deviation for each in own)
    np.testing.assert_allclose(free.session_noise, 1, rtol=0.3)
    said = free.text(whole=True)
    assert "session 1 less the last" in said
    assert "Times the declared noise" in said


def test_shifts_under_another_noise_are_told_from_it(paper, plan):
    changes = {"leg1.session1": "2 mrad", "session1.noise": 3}
    found = symkin.identify(paper, symkin.simulate(paper, plan, 1, changes=changes).measurements)
    assert [doubt.code for doubt in found.doubts] == ["sessions-noise", "sessions-offsets"]
    assert found.doubts[1].options == {"sessions": ["noise", "offsets"]}


def test_what_cannot_be_told_apart_is_said_to_be_either():
    robot = symkin.load_mechanism("5bar")  # whose turned base is nearly an offset of both cranks
    plan = symkin.plan(robot, 30, design="mechanism", candidates=2000, seed=1)
    for changes in ({"session1.phi": "0.3 mrad"}, {"session1": "0.3 mrad"}):
        taken = symkin.simulate(robot, plan, 4, changes=changes).measurements
        (doubt,) = symkin.identify(robot, taken).doubts
        assert doubt.code == "sessions-moved"
        assert "offsets of the sensors or the frame" in str(doubt)


@pytest.mark.parametrize("noise", [None, "estimate"])
def test_a_sign_is_named_though_sessions_would_give_the_solver_another_way_to_it(paper, noise):
    poses = symkin.sample_workspace(paper, 2000, seed=1).poses
    poses = poses[np.random.default_rng(0).permutation(2000)[:52]]
    every, readings = np.arange(52), paper.inverse_kinematics(poses)
    own = symkin.Plan(paper, np.full(52, -1), every, every >= 40, poses, readings)
    taken = symkin.simulate(paper, own, 0).measurements.for_all_legs()
    signs, sessions = np.array([-1, 1, 1]), np.repeat([1, 2], 20)
    wrong = dataclasses.replace(taken, readings=taken.readings * signs, sessions=sessions)
    # Whether an estimate of the noise ends beside such readings is a matter of rounding.
    try:
        (told, *_) = symkin.identify(paper, wrong, noise=noise).doubts
    except symkin.SymkinError as error:
        told = error.likely_cause
    assert (told.code, told.legs) == ("opposite-sign", (0,))


def test_a_drift_is_not_taken_for_sessions(paper, plan):
    taken = symkin.simulate(
        paper, plan, 1, changes={"leg2.drift": "1 mrad", "leg1.session1": 0.0}
    ).measurements
    assert [doubt.code for doubt in symkin.identify(paper, taken).doubts] == ["drifts"]


def test_files_are_a_session_each(paper, sound, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    whole = sound.measurements
    parts = [dataclasses.replace(whole[whole.sessions == k], sessions=None) for k in (1, 2)]
    again = joined(parts)
    np.testing.assert_array_equal(again.sessions, whole.sessions)
    assert len(np.unique(again.row_numbers)) == len(whole)
    for name, part in zip("ab", parts, strict=True):
        part.save(f"{name}.csv", paper)
    one = symkin.identify(paper, ["a.csv", "b.csv"], sessions=["frames"])
    other = symkin.identify(paper, whole, sessions=["frames"])
    assert one.chi_square == pytest.approx(other.chi_square, rel=1e-9)
    assert not main(["identify", "3RRR", "a.csv", "b.csv", "--sessions", "offsets,noise"])
    assert "times the declared one in the sessions" in " ".join(capsys.readouterr().out.split())
    text = symkin.load_mechanism("3RRR").source.read_text(encoding="utf-8")
    said = '\n[identification]\nsessions = ["frames"]\n'
    (tmp_path / "mine.toml").write_text(text + said, encoding="utf-8")
    whole.save("whole.csv", paper)
    assert not main(["identify", "mine.toml", "whole.csv", "--out", "by_file", "--no-report"])
    back = symkin.read_estimate("by_file")
    assert back.names == other.names
    assert back.options.sessions == ("frames",)


def test_files_that_do_not_belong_together_are_refused(sound):
    first = dataclasses.replace(sound.measurements, sessions=None)
    with pytest.raises(SymkinError, match="file 1 has a column session of its own"):
        joined([sound.measurements, first])
    warm = dataclasses.replace(first, temperatures=np.full(len(first), 20.0))
    with pytest.raises(SymkinError, match="file 2 says nothing of the temperature"):
        joined([warm, first])
    timed = dataclasses.replace(first, times=np.arange(len(first)) * 10.0)
    times = joined([timed, timed]).times
    assert (np.diff(times) == 10).all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"sessions": "tables"}, 'expected "offsets", "frames" or "noise"'),
        ({"sessions": ["noise"], "noise": "estimate"}, "expected one of both"),
    ],
)
def test_what_sessions_cannot_have_is_refused(paper, sound, options, said):
    with pytest.raises(SymkinError, match=re.escape(said)):
        symkin.identify(paper, sound.measurements, **options)


def test_one_session_is_none(paper, sound):
    alone = sound.measurements[sound.measurements.sessions == 1]
    with pytest.raises(SymkinError, match="all rows are of session 1"):
        symkin.identify(paper, alone, sessions=["offsets"])
    table = dict(sound.measurements.columns(paper))
    with pytest.raises(SymkinError, match="session"):
        symkin.read_measurements({**table, "session": np.full(len(alone) * 2, 1.5)}, paper)


def test_unseen_poses_are_predicted_in_their_own_session(paper, plan):
    changes = {"session1.x": "50 cm", "session1.phi": "60 deg", "leg2.session1": "5 mrad"}
    taken = symkin.simulate(paper, plan, 1, changes=changes).measurements
    check = symkin.cross_validate(paper, taken, sessions=["offsets", "frames"])
    assert check.residual_rms < 0.3e-3


def test_a_plan_says_that_it_does_not_count_them(paper):
    made = symkin.plan(paper, 20, candidates=1000, seed=1, sessions=["offsets"])
    assert made.basis.survey.sessions == ("offsets",)
    assert "offsets of single sessions are not planned for" in made.text()


@pytest.fixture
def case(request, shared_reference):
    text = (shared_reference / "observations.json").read_text(encoding="utf-8")
    (found,) = (each for each in json.loads(text)["cases"] if each["name"] == request.param)
    return found


def compared(case, found, parts):
    """Hold values and deviations, whose parts are unknowns with signs, to the reference's."""
    expected = case["expected"]
    assert found.chi_square == pytest.approx(expected["chi_square"], rel=1e-8)
    assert found.degrees_of_freedom == expected["degrees_of_freedom"]
    columns = list(found.names)
    for scalar, value, sd in zip(case["free"], expected["estimate"], expected["sd"], strict=True):
        terms = parts(scalar)
        if terms is None:
            continue
        row = np.zeros(len(columns))
        for name, sign in terms.items():
            row[columns.index(name)] = sign
        mine = sum(sign * found.params[name].value for name, sign in terms.items())
        assert mine == pytest.approx(value, abs=1e-5 * sd)
        deviation = np.sqrt(row @ found.model_covariance @ row)
        assert deviation == pytest.approx(sd, rel=1e-6)


@pytest.mark.parametrize("case", ["five_bar_three_sessions"], indirect=True)
def test_three_sessions_of_a_five_bar_are_as_by_explicit_least_squares(case):
    drawn, taken = symkin.load_mechanism("5bar"), case["measurements"]
    legs = tuple(
        dataclasses.replace(
            leg,
            parameters={
                name: case["scalars"].get(f"{name}_{k}", 0.0) for name in drawn.parameter_names
            },
            working_mode=mode,
        )
        for k, (leg, mode) in enumerate(zip(drawn.legs, case["working_modes"], strict=True), 1)
    )
    home = dataclasses.replace(drawn.workspace, home=tuple(case["start_poses"][0]))
    robot = drawn.replace(legs=legs, symmetry=None, workspace=home)
    measured = symkin.Measurements.of(
        taken["position"],
        taken["readings"],
        reading_unit="rad",
        pose_space="point",
        pose_deviations=np.array(taken["position_sd"]),
        reading_deviations=np.array(taken["reading_sd"]),
        sessions=np.array(case["session"], dtype=int),
    )
    found = symkin.identify(
        robot,
        measured,
        free=["*_length", "sensor_offset"],
        frames=["base"],
        sessions=["offsets", "frames"],
        gauge="nominal",
    )

    def parts(scalar):
        first, _, session = scalar.partition("@")
        name, _, leg = first.rpartition("_")
        if name == "base_frame":
            own = {f"session{session}.{leg}": 1} if session != "3" else {}
            return {f"base.{leg}": 1, **own}
        own = {f"leg{leg}.session{session}": -1} if session in ("1", "2") else {}
        return {f"leg{leg}.{name}": 1, **own}

    compared(case, found, parts)


@pytest.mark.parametrize("case", ["hexapod_two_sessions_rehomed"], indirect=True)
def test_a_hexapod_that_was_homed_anew_is_as_by_explicit_least_squares(case):
    drawn, taken = symkin.load_mechanism("hexapod_jugglebot"), case["measurements"]
    legs = tuple(
        dataclasses.replace(
            leg,
            parameters={
                name: case["scalars"].get(f"{name}_{k}", 0.0) for name in drawn.parameter_names
            },
        )
        for k, leg in enumerate(drawn.legs, 1)
    )
    noise = NoiseSettings(reading=taken["reading_sd"])
    home = dataclasses.replace(drawn.workspace, home=(0, 0, 0.43, 0, 0, 0))
    robot = drawn.replace(legs=legs, symmetry=None, noise=noise, reading_unit="m", workspace=home)
    turns = symkin.model.poses.quaternions_from_rotation_vectors(
        symkin.model.poses.vectors_from_rotations(np.array(taken["rotation_matrix"]))
    )
    measured = symkin.Measurements.of(
        np.hstack([taken["position"], turns]),
        taken["readings"],
        reading_unit="m",
        pose_deviations=np.hstack(
            [taken["position_sd"], np.tile(taken["rotation_sd"], (len(turns), 1))]
        ),
        sessions=np.array(case["session"], dtype=int),
    )
    found = symkin.identify(
        robot,
        measured,
        free=["leg?", "session2.*"],
        fixed=["sensor_gain", "session1.*"],
        prior={
            "base_radius": 3e-4,
            "platform_radius": 3e-4,
            "*_angle": 1e-3,
            "*_azimuth": 1e-3,
            "sensor_offset": 5e-4,
            "leg*.session*": 2e-4,
        },
        frames=["target"],
        sessions=["offsets", "frames"],
    )

    def parts(scalar):
        first, _, session = scalar.partition("@")
        name, _, leg = first.rpartition("_")
        if name in ("base_frame", "target_frame"):  # rotations are about another start
            block = "target" if name == "target_frame" else f"session{session}"
            return None if leg.startswith("r") else {f"{block}.{leg}": 1}
        if name == "mean_offset":
            return {f"leg{leg}.sensor_offset": 1}
        own = {f"leg{leg}.session{session}": -1} if session else {}
        return {f"leg{leg}.{name}": 1, **own}

    compared(case, found, parts)
