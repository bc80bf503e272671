# SPDX-License-Identifier: MIT
"""Whatever happens inside a command, it ends with an exit code and at most one sentence."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from symkin.cli.console import exit_code_of
from symkin.errors import MeasurementError


def _raise(error: BaseException) -> Callable[[], None]:
    def program() -> None:
        raise error

    return program


@pytest.mark.parametrize(
    "error", [RuntimeError("odd"), RecursionError(), KeyError("x"), AssertionError(), TypeError()]
)
def test_the_unforeseen_is_one_sentence_and_a_trace_on_demand(
    capsys: pytest.CaptureFixture[str], error: Exception
) -> None:
    assert exit_code_of(_raise(error)) == 2
    message = capsys.readouterr().err
    assert message.startswith(f"Error: unforeseen {type(error).__name__}: ")
    assert message.count("\n") == 1
    assert exit_code_of(_raise(error), debug=True) == 2
    message = capsys.readouterr().err
    assert message.startswith("Traceback")
    assert "Error: unforeseen" in message.splitlines()[-1]


def test_a_message_is_bounded_and_printed_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code_of(_raise(MeasurementError("\x1b[31m" + "a" * 9999 + "the end"))) == 2
    message = capsys.readouterr().err
    assert message.startswith("Error: \\x1b[31ma")
    assert message.endswith("the end\n")
    assert len(message) <= 501


def test_debug_may_stand_anywhere(symkin: Callable) -> None:
    for arguments in (["--debug", "check", "nosuch"], ["check", "nosuch", "--debug"]):
        shown = symkin(*arguments)
        assert shown.code == 2
        assert "Traceback" in shown.err
    assert "--debug" in symkin("--help").out


@pytest.mark.parametrize("last", [["--out", ""], ["--out="]])
def test_an_empty_argument_is_not_the_folder_that_one_is_in(
    refused: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, last: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    refused("check", "3RRR", *last, words="an argument is empty")
    assert not list(tmp_path.iterdir())


def test_pipes_devices_and_loops_are_refused(refused: Callable, tmp_path: Path) -> None:
    pipe, loop = tmp_path / "pipe", tmp_path / "loop.toml"
    os.mkfifo(pipe)
    loop.symlink_to(loop)
    for path in (pipe, Path("/dev/zero")):
        refused("check", path, words="is a device or a pipe")
        refused("identify", "3RRR", path, words="is a device or a pipe")
        refused("identify", "3RRR", path, "--columns", path, words="is a device or a pipe")
    refused("check", loop, words="symbolic links")
    refused("check", "x" * 300, words="neither a file nor a shipped mechanism")


def test_poses_without_all_readings_are_counted(
    symkin: Callable, refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    rows = [row.split(",") for row in (protocol / "measurements.csv").read_text().splitlines()]
    first = rows[0].index("psi_1_rad")
    for row in rows[3:6]:
        row[first] = ""
    path = tmp_path / "measurements.csv"
    path.write_text("\n".join(map(",".join, rows)) + "\n")
    shown = symkin("evaluate", "3RRR", "--measurements", path)
    assert f"end-effector error over {len(rows) - 4} poses" in shown.out
    assert "left out, since not all legs were read there: 3 poses" in shown.out
    for estimator in ("implicit", "paper", "inverse", "joint"):
        options = ["--estimator", estimator, "--cross-validate", 3]
        identified = symkin("identify", "3RRR", path, *options, "--json")
        assert identified.code == 0
        used = [leg["poses"] for leg in identified.json["identification"]["legs"]]
        assert used == [len(rows) - 4, len(rows) - 1, len(rows) - 1]
    for row in rows[1:]:
        row[first + 1] = "" if row[first] else row[first + 1]
    path.write_text("\n".join(map(",".join, rows)) + "\n")
    refused("evaluate", "3RRR", "--measurements", path, words="no pose has readings of all legs")
