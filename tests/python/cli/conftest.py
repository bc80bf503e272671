# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from symkin.cli import main

MECHANISMS = Path(__file__).parents[3] / "mechanisms"


@dataclass(frozen=True)
class Finished:
    """A command that has run in this process."""

    code: int
    out: str
    err: str

    @property
    def words(self) -> str:
        """What is printed as one line, wherever lines were filled."""
        return " ".join(self.out.split())

    @property
    def json(self) -> Any:
        return json.loads(self.out)


def _run(*arguments: str | Path | int) -> Finished:
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main([str(argument) for argument in arguments])
    return Finished(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="session")
def symkin() -> Callable[..., Finished]:
    """Runs a command line."""
    return _run


@pytest.fixture(scope="session")
def protocol(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of a small run of the whole protocol."""
    folder = tmp_path_factory.mktemp("protocol")
    made = _run("run", "3RRR", "--out", folder, "--pose-count", 10, "--candidates", 300)
    assert made.code == 0, made.err
    assert made.out.splitlines()[-1] == str(folder / "report.html")
    return folder


@pytest.fixture
def refused() -> Callable[..., None]:
    """Runs a command line that must be refused in one sentence with some words in it."""

    def refused(*arguments: str | Path | int, words: str) -> None:
        finished = _run(*arguments)
        assert finished.code == 2
        assert finished.out == ""
        assert finished.err.startswith("Error: ")
        assert finished.err.count("\n") == 1
        assert "Traceback" not in finished.err
        assert words in finished.err

    return refused


@pytest.fixture
def changed(tmp_path: Path) -> Callable[[str, str], Path]:
    """Writes the paper's mechanism file with a text in it replaced."""

    def changed(old: str, new: str) -> Path:
        text = (MECHANISMS / "3RRR.toml").read_text(encoding="utf-8")
        assert old in text
        path = tmp_path / "changed.toml"
        path.write_text(text.replace(old, new), encoding="utf-8")
        return path

    return changed
