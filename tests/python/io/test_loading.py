# SPDX-License-Identifier: MIT
"""Every result loads back: equal to what was saved, and saying the same."""

import copy
import itertools
import json
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import symkin
from symkin.errors import ResultsError
from symkin.estimate.robot_symmetry import robot_symmetry
from symkin.model.settings import ProtocolSettings
from symkin.present import kinds_told
from symkin.results import Result
from symkin.study.definition import StudyDefinition

DECLARED = Path(__file__).resolve().parents[3] / "mechanisms" / "declared"
KINDS = sorted(kind.__name__ for kind in kinds_told() if issubclass(kind, Result))


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR").replace(
        protocol=ProtocolSettings(pose_count=10, candidates=200, seed=3)
    )


@pytest.fixture(scope="module")
def ran(robot):
    return robot.run()


@pytest.fixture(scope="module")
def results(robot, ran):
    """One of every kind, and some with more in them than usual."""
    taken, made_robot = ran.simulation.measurements, ran.simulation.actual
    found = ran.identification.cross_validated(2)
    later = robot.simulate(ran.plan, 10, made_robot).measurements
    curve = symkin.pose_count_curve(robot, ran.candidates, [8, 10])
    check = robot.check()
    study = {"mechanisms": ("3RRR",), "robots": 3, "candidates": 100, "evaluation_poses": 20}
    cost = StudyDefinition(mechanisms=("3RRR",), kind="cost", legs=(3, 4), repetitions=1)
    positions = {"observe": "position", "prior": "tolerances"}
    made = [
        ran,
        ran.candidates,
        ran.plan,
        ran.plan.observability[0],
        ran.simulation,
        ran.after,
        taken,
        found,
        found.cross_validation,
        check,
        check.pairs,
        check.conditions,
        check.comparison,
        symkin.detect_symmetry(robot),
        curve,
        curve.for_accuracy(curve.position[-1]),
        symkin.study_workspace(robot, count=200, resolution=9),
        symkin.identify_many(robot, {"first": taken, "second": later}),
        robot_symmetry(found),
        symkin.accept(found, robot.simulate(robot.plan(8, seed=77), 11, made_robot), 0.001),
        symkin.compare(found, robot.identify(later)),
        symkin.align_frames(taken.poses, taken.poses, pose_space="planar"),
        symkin.run_study(StudyDefinition(**study, pose_counts=("1p", 10))),
        symkin.run_study(cost),
    ]
    named = {type(each).__name__: each for each in made}
    named["Plan for positions"] = robot.plan(12, drift=["frame"], **positions)
    named["PoseCountCurve for positions"] = symkin.pose_count_curve(
        robot, ran.candidates, [10], **positions
    )
    return named


@pytest.mark.parametrize("name", [*KINDS, "Plan for positions", "PoseCountCurve for positions"])
def test_every_result_loads_back_copies_and_pickles_equal_and_says_the_same(
    results, name, tmp_path
):
    result = results[name]
    path = result.save(tmp_path / "it.json")
    told = result.text(whole=True)
    again = symkin.read_result(path)
    assert again.text(whole=True) == told
    titles = [[each.title for each in one.page().sections] for one in (again, result)]
    assert titles[0] == titles[1]
    for other in (again, copy.deepcopy(result), pickle.loads(pickle.dumps(result))):
        assert type(other) is type(result)
        assert other == result
    assert symkin.read_result(again.save(tmp_path / "again.json")) == result
    assert symkin.read_results(path).keys() == {*result.to_dict(), "result"}


def test_a_run_loads_back_with_what_it_shares_and_its_estimate_alone(ran, tmp_path):
    ran.write(tmp_path / "out", report=False)
    again = symkin.read_result(tmp_path / "out")
    assert again == ran
    assert again.simulation.plan is again.plan
    assert type(again.nominal) is symkin.Robot
    assert symkin.read_estimate(tmp_path / "out") == ran.identification


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 2}, "has a result of version 2; expected 1: run .* or update symkin$"),
        ({"kind": "Horoscope"}, 'of kind "Horoscope"; expected Acceptance or Alignment or '),
        ({"kind": ["a"]}, "of kind"),
        ({"fields": {"position_rms": 1.0}}, "is no Evaluation: .*; run the command again"),
        ({"fields": []}, "is no Evaluation"),
        ({"more": 1}, "has no result that loads back"),
    ],
)
def test_other_kinds_and_versions_are_refused_in_one_sentence(ran, tmp_path, change, words):
    path = ran.after.save(tmp_path / "it.json")
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, "result": {**document["result"], **change}}))
    with pytest.raises(ResultsError, match=words) as error:
        symkin.read_result(path)
    assert "\n" not in str(error.value)


def test_a_damaged_array_or_a_place_that_is_not_there_is_refused(ran, tmp_path):
    path = ran.candidates.save(tmp_path / "it.json")
    document = json.loads(path.read_text())
    for poses in (
        {"shape": [1, 3], "dtype": "<f8", "base64": "!"},
        {"shape": [2, 3], "dtype": "<f8", "base64": "AAAA"},
        {"shape": [7], "values": [1.0]},
        {"same_as": "/nowhere"},
    ):
        document["result"]["fields"]["poses"] = poses
        path.write_text(json.dumps(document))
        with pytest.raises(ResultsError, match="is no WorkspaceSample"):
            symkin.read_result(path)


def test_an_estimate_is_asked_for_where_there_is_none(ran, tmp_path):
    path = ran.after.save(tmp_path / "it.json")
    with pytest.raises(ResultsError, match='kind "Evaluation"; expected Estimate or Protocol'):
        symkin.read_estimate(path)


def test_a_folder_is_read_by_the_one_result_in_it(ran, tmp_path):
    with pytest.raises(ResultsError, match="no such file"):
        symkin.read_result(tmp_path)
    ran.after.save(tmp_path / "after.json")
    assert symkin.read_result(tmp_path) == ran.after
    ran.before.save(tmp_path / "before.json")
    with pytest.raises(ResultsError, match=r"one of its files after\.json, before\.json"):
        symkin.read_result(tmp_path)


def test_a_result_is_saved_as_json_and_nothing_else(ran, tmp_path):
    for name in ("it", "it.xlsx"):
        with pytest.raises(symkin.SymkinError, match=r"expected .*\.json"):
            ran.after.save(tmp_path / name)
    for table in (ran.plan, ran.simulation.measurements):
        with pytest.raises(symkin.SymkinError, match=r"\.csv"):
            table.save(tmp_path / "it")


def test_a_result_says_the_same_where_no_file_of_its_mechanism_is(robot, tmp_path, monkeypatch):
    robot.save(tmp_path / "mine.toml")
    mine = symkin.load(tmp_path / "mine.toml")
    monkeypatch.chdir(tmp_path)
    told = {}
    for name, result in (("check", mine.check()), ("plan", mine.plan(10))):
        result.save(tmp_path / f"{name}.json")
        told[name] = result
    (tmp_path / "mine.toml").unlink()
    for name, result in told.items():
        again = symkin.read_result(tmp_path / f"{name}.json")
        assert again == result
        assert again.page().title in again.text()


def test_a_declared_leg_goes_along_to_another_process(tmp_path):
    path = symkin.detect_symmetry(DECLARED / "3RRR_four_bar.toml").save(tmp_path / "it.json")
    script = f"import symkin; print(symkin.read_result({str(path)!r}).text())"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == symkin.read_result(path).text().strip()
    assert not done.stderr


def test_no_kind_of_result_is_told_by_the_page_of_another():
    # Each has a page of its own, whichever of them was loaded first.
    pairs = itertools.permutations(kinds_told(), 2)
    assert not [(kind, other) for kind, other in pairs if issubclass(kind, other)]


def test_the_page_of_an_estimate_loads_no_page_of_a_study():
    script = (
        "import sys, symkin; robot = symkin.load('3RRR'); "
        "taken = robot.simulate(robot.plan(10, candidates=100)).measurements; "
        "robot.identify(taken).page(); print('symkin.show.study' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.split() == ["False"], done.stderr
