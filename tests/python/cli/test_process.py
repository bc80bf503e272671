# SPDX-License-Identifier: MIT
"""What only a process of its own shows: start, streams, a broken pipe."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

import pytest

_SLOW = {"matplotlib", "pint", "pyarrow", "pydantic", "scipy", "tomlkit"}


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


def test_a_reader_that_stops_early_is_no_error() -> None:
    command = f"{sys.executable} -m symkin check 3RRR | head -n 1"
    shown = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert shown.stdout.startswith("3RRR: ")
    assert shown.stderr == ""
