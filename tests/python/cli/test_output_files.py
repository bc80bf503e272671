# SPDX-License-Identifier: MIT
"""Nothing is lost: neither an input nor what symkin did not write."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from symkin.cli.output_files import OutputFiles
from symkin.errors import SymkinError


def _write(path: Path, text: str, command: str = "plan", **options: bool) -> None:
    with OutputFiles(command, [], **options) as outputs:
        outputs.file(path).write_text(text)


def test_what_the_same_command_wrote_is_replaced(tmp_path: Path) -> None:
    _write(tmp_path / "plan.csv", "one")
    _write(tmp_path / "plan.csv", "two")
    assert (tmp_path / "plan.csv").read_text() == "two"


def test_a_file_of_somebody_else_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    path.write_text("mine")
    with pytest.raises(SymkinError, match="not as `symkin plan` wrote it"):
        _write(path, "two")
    assert path.read_text() == "mine"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["plan.csv"]
    _write(path, "two", overwrite=True)
    assert path.read_text() == "two"


def test_a_file_that_was_changed_since_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    _write(path, "one")
    path.write_text("one, corrected")
    with pytest.raises(SymkinError, match="--overwrite"):
        _write(path, "two")
    assert path.read_text() == "one, corrected"


def test_a_file_of_another_command_is_kept(tmp_path: Path) -> None:
    _write(tmp_path / "file.csv", "one", "simulate")
    with pytest.raises(SymkinError, match="symkin plan"):
        _write(tmp_path / "file.csv", "two", "plan")


def test_the_same_content_may_be_written_again(tmp_path: Path) -> None:
    (tmp_path / "plan.csv").write_text("same")
    _write(tmp_path / "plan.csv", "same")


def test_either_all_files_are_written_or_none(tmp_path: Path) -> None:
    (tmp_path / "second").write_text("mine")
    outputs = OutputFiles("run", [])
    folder = outputs.folder(tmp_path)
    (folder / "first").write_text("one")
    (folder / "second").write_text("two")
    with pytest.raises(SymkinError, match="second"):
        outputs.__exit__(None, None, None)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["second"]


def test_a_failed_command_leaves_nothing(tmp_path: Path) -> None:
    outputs = OutputFiles("plan", [])
    outputs.file(tmp_path / "plan.csv").write_text("half")
    outputs.__exit__(ZeroDivisionError, ZeroDivisionError(), None)
    assert list(tmp_path.iterdir()) == []


def test_an_input_is_never_replaced(tmp_path: Path) -> None:
    path = tmp_path / "input.csv"
    path.write_text("mine")
    (tmp_path / "link.csv").symlink_to(path)
    for name in ("input.csv", "link.csv"):
        with (
            pytest.raises(SymkinError, match="is an input"),
            OutputFiles("plan", [path], overwrite=True) as outputs,
        ):
            outputs.file(tmp_path / name)
    with (
        pytest.raises(SymkinError, match="is an input"),
        OutputFiles("run", [path], overwrite=True) as outputs,
    ):
        (outputs.folder(tmp_path) / "input.csv").write_text("two")
    assert path.read_text() == "mine"


def test_a_device_is_not_replaced() -> None:
    with pytest.raises(SymkinError, match="not a regular file"):
        _write(Path("/dev/null"), "one", overwrite=True)


def test_the_calibrated_mechanism_is_not_written_over_the_one_it_comes_from(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    nominal = tmp_path / "calibrated.toml"
    nominal.write_text((protocol / "calibrated.toml").read_text())
    measured = protocol / "measurements.csv"
    refused("identify", nominal, measured, "--out", tmp_path, "--overwrite", words="is an input")
    refused(
        "simulate", "3RRR", protocol / "plan.csv", "--out", protocol / "plan.csv", words="input"
    )


def test_a_run_into_the_folder_of_an_earlier_run_replaces_its_files(
    symkin: Callable, tmp_path: Path
) -> None:
    small = ("plan", "3RRR", "--poses", 8, "--candidates", 200, "--out", tmp_path / "plan.csv")
    assert symkin(*small, "--seed", 1).code == 0
    first = (tmp_path / "plan.csv").read_bytes()
    assert symkin(*small, "--seed", 2).code == 0
    assert (tmp_path / "plan.csv").read_bytes() != first
