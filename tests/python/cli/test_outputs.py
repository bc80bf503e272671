# SPDX-License-Identifier: MIT
"""Commands tell before they compute what they would replace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import symkin as library
from symkin import outputs

CHECK_FILES = ("check.json", "check.html")
WORKSPACE_FILES = ("workspace.json", "workspace.html")


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever begins to compute fails the test."""

    def computed(*_: object, **__: object) -> None:
        raise AssertionError("computed before the targets were checked")

    names = ("sample_workspace", "identify", "simulate", "run_protocol", "study_workspace")
    for name in names:
        monkeypatch.setattr(library, name, computed)
    monkeypatch.setattr("symkin.checks.check_mechanism", computed)


@pytest.mark.usefixtures("idle")
def test_a_target_that_exists_is_refused_before_anything_is_computed(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    plan, measured = protocol / "plan.csv", protocol / "measurements.csv"
    old = tmp_path / "old.csv"
    old.write_text("mine")
    for command, files in (
        (("check", "3RRR"), CHECK_FILES),
        (("run", "3RRR"), outputs.RUN_FILES),
        (("identify", "3RRR", measured), outputs.IDENTIFICATION_FILES),
        (("pose-count", "3RRR"), outputs.POSE_COUNT_FILES),
        (("workspace", "3RRR"), WORKSPACE_FILES),
        (("plan", "3RRR"), outputs.PLAN_FILES),
    ):
        folder = tmp_path / command[0]
        folder.mkdir()
        for name in (files[0], files[-1]):
            (folder / name).write_text("mine")
            refused(*command, "--out", folder, words=f"{name}: exists")
            (folder / name).unlink()
    new = tmp_path / "new.csv"
    refused("simulate", "3RRR", plan, "--out", old, words="exists")
    refused("simulate", "3RRR", plan, "--out", new, "--actual-out", old, words="exists")
    assert not new.exists()


@pytest.mark.usefixtures("idle")
def test_two_outputs_have_places_of_their_own(refused: Callable, tmp_path: Path) -> None:
    same = ("--out", tmp_path / "m.csv", "--actual-out", tmp_path / "m.csv")
    (tmp_path / "p.csv").write_text(
        "leg,order,role,x_m,y_m,phi_rad,psi_1_rad,psi_2_rad,psi_3_rad\n1,1,primary,0,0,0,0,0,0\n"
    )
    refused("simulate", "3RRR", tmp_path / "p.csv", *same, words="two outputs")
    assert not (tmp_path / "m.csv").exists()


def test_the_calibrated_mechanism_is_not_written_over_the_one_it_comes_from(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    nominal = tmp_path / "calibrated.toml"
    nominal.write_text((protocol / "calibrated.toml").read_text())
    measured, plan = protocol / "measurements.csv", protocol / "plan.csv"
    refused("identify", nominal, measured, "--out", tmp_path, "--overwrite", words="is an input")
    refused("simulate", "3RRR", plan, "--out", plan, "--overwrite", words="is an input")


def test_a_run_into_the_folder_of_an_earlier_run_replaces_its_files_if_told_so(
    symkin: Callable, refused: Callable, tmp_path: Path
) -> None:
    small = ("plan", "3RRR", "--pose-count", 8, "--candidates", 200, "--out", tmp_path)
    assert symkin(*small, "--seed", 1).code == 0
    first = (tmp_path / "plan.csv").read_bytes()
    refused(*small, "--seed", 2, words="--overwrite")
    assert symkin(*small, "--seed", 2, "--overwrite").code == 0
    assert (tmp_path / "plan.csv").read_bytes() != first
    assert {path.name for path in tmp_path.iterdir()} == set(outputs.PLAN_FILES)


def test_every_file_of_a_command_is_known_before(
    symkin: Callable, protocol: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda _, buffer, **__: buffer)

    def names(folder: Path) -> set[str]:
        return {path.name for path in folder.iterdir()}

    assert names(protocol) <= set(outputs.RUN_FILES)
    few = ("--candidates", 300)
    measured = protocol / "measurements.csv"
    for command, files in (
        (("check", "3RRR", "--out"), CHECK_FILES),
        (("identify", "3RRR", measured, "--out"), outputs.IDENTIFICATION_FILES),
        (("pose-count", "3RRR", *few, "--out"), outputs.POSE_COUNT_FILES),
        (("workspace", "3RRR", "--resolution", 60, "--out"), WORKSPACE_FILES),
        (("plan", "3RRR", *few, "--out"), outputs.PLAN_FILES),
    ):
        folder = tmp_path / command[0]
        assert symkin(*command, folder).code == 0
        assert names(folder) == set(files)
