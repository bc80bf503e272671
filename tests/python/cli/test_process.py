# SPDX-License-Identifier: MIT
"""What only a process of its own shows: start, streams, a broken pipe."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

MECHANISMS = Path(__file__).parents[3] / "mechanisms"
_SLOW = {"matplotlib", "pandas", "pyarrow", "scipy"}


def _python(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


def test_the_module_is_the_command() -> None:
    shown = _python("-m", "symkin", "--help")
    assert shown.returncode == 0
    assert shown.stdout.startswith("Usage: symkin")
    assert shown.stderr == ""


def test_an_error_ends_the_process_with_code_2() -> None:
    shown = _python("-m", "symkin", "check", "nosuch")
    assert (shown.returncode, shown.stdout) == (2, "")
    assert shown.stderr.startswith("Error: nosuch: ")
    assert shown.stderr.count("\n") == 1


@pytest.mark.parametrize("arguments", [["--help"], []])
def test_help_imports_nothing_slow(arguments: Sequence[str]) -> None:
    code = (
        "import sys; from symkin.cli import main; "
        f"main({list(arguments)}); sys.exit(' '.join({_SLOW} & set(sys.modules)))"
    )
    shown = _python("-c", code)
    assert shown.stderr.strip() == ""


@pytest.mark.parametrize(
    ("environment", "redirection"),
    [
        ({"MPLBACKEND": "nosuch"}, ""),
        ({"MPLCONFIGDIR": "/proc/nowhere", "HOME": "/proc/nowhere"}, ""),
        ({"PYTHONIOENCODING": "ascii"}, ""),
        ({}, ">&-"),
    ],
)
def test_the_surroundings_leave_a_command_and_its_stderr_alone(
    tmp_path: Path, environment: dict[str, str], redirection: str
) -> None:
    command = f"{sys.executable} -m symkin check 3RRR --out out"
    shown = subprocess.run(
        f"{command} {redirection}",
        shell=True,
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env=os.environ | environment,
    )
    assert (shown.returncode, shown.stderr) == (0, "")
    assert shown.stdout.endswith("out/check.html\n") or redirection
    assert (tmp_path / "out" / "check.html").exists()


def test_a_full_disk_behind_stdout_is_told_in_one_sentence() -> None:
    command = f"{sys.executable} -m symkin --help > /dev/full"
    shown = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert shown.returncode == 2
    assert shown.stderr == "Error: [Errno 28] No space left on device\n"


@pytest.mark.parametrize("arguments", ["check 3RRR", "list", "--help", "study --show paper"])
def test_a_closed_pipe_is_not_told_as_a_result_that_did_not_converge(arguments: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "symkin", *arguments.split()]
    ended = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (ended.returncode, ended.stderr) == (141, b"")


def test_a_closed_stderr_leaves_the_exit_code() -> None:
    command = f"{sys.executable} -m symkin check nosuch 2>&-"
    assert subprocess.run(command, shell=True, check=False).returncode == 2


def test_a_file_whose_name_is_no_text_is_read_and_told(tmp_path: Path) -> None:
    name = os.fsdecode(b"robot\xff.toml")
    shown = _python("-m", "symkin", "check", name, cwd=tmp_path)
    assert (shown.returncode, shown.stdout) == (2, "")
    assert shown.stderr == "Error: robot\\udcff.toml: no such file\n"
    text = (MECHANISMS / "3RRR.toml").read_text().replace('name = "3RRR"', "")
    (tmp_path / name).write_text(text)
    shown = _python("-m", "symkin", "check", name, "--json", "--out", "out", cwd=tmp_path)
    assert (shown.returncode, shown.stderr) == (0, "")
    assert json.loads(shown.stdout)["mechanism"] == "robot\\udcff"


def test_a_reader_that_stops_early_is_no_error() -> None:
    command = f"{sys.executable} -m symkin check 3RRR | head -n 1"
    shown = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert shown.stdout.startswith("3RRR: ")
    assert shown.stderr == ""
