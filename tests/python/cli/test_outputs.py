# SPDX-License-Identifier: MIT
"""Commands tell before they compute what they would replace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import symkin as library
from symkin.errors import SymkinError
from symkin.estimate import Estimate
from symkin.files.template import mechanism_template
from symkin.pipeline import ProtocolResult
from symkin.planning.simulation import Simulation

CHECK_FILES = ("check.json", "check.html")
WORKSPACE_FILES = ("workspace.json", "workspace.html")
PLAN_FILES = ("plan.csv", "plan.json", "plan.html")
POSE_COUNT_FILES = ("pose-count.json", "pose-count.html")
EVALUATION_FILES = ("evaluation.json", "evaluation.html")


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever begins to compute fails the test."""

    def computed(*_: object, **__: object) -> None:
        raise AssertionError("computed before the targets were checked")

    names = ("sample_workspace", "identify", "simulate", "run_protocol", "study_workspace")
    for name in (*names, "evaluate"):
        monkeypatch.setattr(library, name, computed)
    monkeypatch.setattr("symkin.analysis.checks.check_mechanism", computed)


@pytest.mark.usefixtures("idle")
def test_a_target_that_exists_is_refused_before_anything_is_computed(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    plan, measured = protocol / "plan.csv", protocol / "measurements.csv"
    old = tmp_path / "old.csv"
    old.write_text("mine")
    simulate = ("simulate", "3RRR", "--plan", plan)
    for command, files in (
        (("check", "3RRR"), CHECK_FILES),
        (("run", "3RRR"), ProtocolResult.FILES),
        (("identify", "3RRR", measured), Estimate.FILES),
        (simulate, Simulation.FILES),
        (("evaluate", "3RRR", "--measurements", measured), EVALUATION_FILES),
        (("kinematics", "3RRR", plan), ("readings.csv",)),
        (("pose-count", "3RRR"), POSE_COUNT_FILES),
        (("workspace", "3RRR"), WORKSPACE_FILES),
        (("plan", "3RRR"), PLAN_FILES),
    ):
        folder = tmp_path / command[0]
        folder.mkdir()
        for name in (files[0], files[-1]):
            (folder / name).write_text("mine")
            refused(*command, "--out", folder, words=f"{name}: exists")
            (folder / name).unlink()
    assert old.read_text() == "mine"


def test_the_calibrated_mechanism_is_not_written_over_the_one_it_comes_from(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    nominal = tmp_path / "calibrated.toml"
    nominal.write_text((protocol / "calibrated.toml").read_text())
    measured = tmp_path / "measurements.csv"
    measured.write_text((protocol / "measurements.csv").read_text())
    readings = tmp_path / "readings.csv"
    readings.write_text(measured.read_text())
    into = ("--out", tmp_path, "--overwrite")
    refused("identify", nominal, measured, *into, words="is an input")
    refused("simulate", "3RRR", "--plan", measured, *into, words="is missing")
    plan = protocol / "plan.csv"
    measured.write_text(plan.read_text())
    refused("simulate", "3RRR", "--plan", measured, *into, words="is an input")
    refused("kinematics", "3RRR", readings, *into, words="is an input")


def test_the_table_of_the_sensors_is_not_replaced_either(refused: Callable, tmp_path: Path) -> None:
    table, robot = tmp_path / "plan.csv", tmp_path / "robot.toml"
    table.write_text("reading_rad,joint_rad\n-4,-4\n4,4.001\n")
    robot.write_text(mechanism_template("[R]RR", 3) + '\n[sensor_table]\nfile = "plan.csv"\n')
    mechanism = library.load_mechanism(robot)
    assert mechanism.files == (robot, table)
    refused("plan", robot, "--out", tmp_path, "--overwrite", words="plan.csv: is an input")


@pytest.mark.usefixtures("unillustrated")
def test_a_run_into_the_folder_of_an_earlier_run_replaces_its_files_if_told_so(
    symkin: Callable, refused: Callable, tmp_path: Path
) -> None:
    small = ("plan", "3RRR", "--pose-count", 8, "--candidates", 200, "--out", tmp_path)
    assert symkin(*small, "--seed", 1).code == 0
    first = (tmp_path / "plan.csv").read_bytes()
    refused(*small, "--seed", 2, words="--overwrite")
    assert symkin(*small, "--seed", 2, "--overwrite").code == 0
    assert (tmp_path / "plan.csv").read_bytes() != first
    assert {path.name for path in tmp_path.iterdir()} == set(PLAN_FILES)


@pytest.mark.usefixtures("unillustrated")
def test_no_file_of_an_earlier_run_stays_beside_those_of_another(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    measured, wrong = protocol / "measurements.csv", tmp_path / "wrong.csv"
    robot = library.load_mechanism("3RRR")
    sound = library.read_measurements(measured, robot)
    signs = [1, -1, 1]
    library.Measurements.of(sound.poses, sound.readings * signs, sound.leg_sets).save(wrong, robot)

    def names(name: str) -> set[str]:
        return {path.name for path in (tmp_path / name).iterdir()}

    def run(*command: object, into: str) -> None:
        assert symkin(*command, "--out", tmp_path / into, "--overwrite").code != 2

    run("identify", "3RRR", wrong, into="found")
    assert names("found") == {"corrected.csv", *Estimate.FILES}
    run("identify", "3RRR", measured, into="found")
    assert names("found") == set(Estimate.FILES)
    run("identify", "3RRR", measured, "--no-report", into="found")
    assert names("found") == set(Estimate.FILES) - {"report.html"}
    fleet = ("identify-batch", "3RRR", measured, "--no-report")
    run(*fleet, into="fleet")
    run(*fleet, "--table", "parquet", into="fleet")
    assert names("fleet") == {"fleet.parquet"}
    few = ("--candidates", 300, "--pose-count", 30, "--no-report")
    run("plan", "linear_delta", "--observe", "height", "--prior", "tolerances", *few, into="plan")
    assert names("plan") > {"points.csv", "points.cfg"}
    run("plan", "3RRR", *few, into="plan")
    assert names("plan") == set(PLAN_FILES) - {"plan.html"}


def test_a_result_that_is_saved_again_leaves_none_of_its_earlier_files(
    protocol: Path, tmp_path: Path
) -> None:
    found = library.identify("3RRR", protocol / "measurements.csv")
    found.write(tmp_path, report=False)
    (tmp_path / "corrected.csv").write_text("of an earlier cause")
    with pytest.raises(SymkinError, match="exists"):
        found.write(tmp_path, report=False)
    found.write(tmp_path, overwrite=True, report=False)
    assert {path.name for path in tmp_path.iterdir()} == set(Estimate.FILES) - {"report.html"}


@pytest.mark.usefixtures("unillustrated")
def test_every_file_of_a_command_is_known_before(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    def names(folder: Path) -> set[str]:
        return {path.name for path in folder.iterdir()}

    assert names(protocol) == set(ProtocolResult.FILES)
    few = ("--candidates", 300)
    measured = protocol / "measurements.csv"
    commands: tuple[tuple[tuple[object, ...], tuple[str, ...]], ...] = (
        (("identify", "3RRR", measured, "--out"), Estimate.FILES),
        (("simulate", "3RRR", "--plan", protocol / "plan.csv", "--out"), Simulation.FILES),
        (("evaluate", "3RRR", "--measurements", measured, "--out"), EVALUATION_FILES),
        (("kinematics", "3RRR", measured, "--out"), ("readings.csv",)),
        (("kinematics", "3RRR", measured, "--forward", "--out"), ("poses.csv",)),
        (("check", "3RRR", "--out"), CHECK_FILES),
        (("pose-count", "3RRR", *few, "--out"), POSE_COUNT_FILES),
        (("workspace", "3RRR", "--resolution", 60, "--out"), WORKSPACE_FILES),
        (("plan", "3RRR", *few, "--out"), PLAN_FILES),
    )
    for number, (command, files) in enumerate(commands):
        folder = tmp_path / str(number)
        assert symkin(*command, folder).code == 0
        assert names(folder) == set(files)
