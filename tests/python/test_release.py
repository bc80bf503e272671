# SPDX-License-Identifier: MIT
"""What is packed and released says the same everywhere."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def found(pattern: str, file: str) -> list[str]:
    return re.findall(pattern, (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_file_has_the_version_of_the_build() -> None:
    version = found(r"^  VERSION ([0-9.]+)$", "CMakeLists.txt")
    assert len(version) == 1
    assert found(r"^version: (.*)$", "CITATION.cff") == version
    assert found(r'^  version: "(.*)"$', "conda/recipe.yaml") == version


def test_conda_installs_what_pip_installs() -> None:
    run = (ROOT / "conda/recipe.yaml").read_text(encoding="utf-8")
    run = run.partition("  run:\n")[2].partition("\n  #")[0]
    packages = [line.strip("- ") for line in run.split("\n")]
    wanted = [
        re.sub(r"(?=[<>=])", " ", name, count=1) for name in PROJECT["project"]["dependencies"]
    ]
    assert packages == ["python", *wanted]


def test_wheels_are_built_for_every_python_that_is_claimed() -> None:
    prefix = "Programming Language :: Python :: 3."
    claimed = [c.removeprefix(prefix) for c in PROJECT["project"]["classifiers"] if prefix in c]
    built = PROJECT["tool"]["cibuildwheel"]["build"]
    assert built.split() == [f"cp3{minor}-*" for minor in claimed]
    assert PROJECT["project"]["requires-python"] == f">=3.{claimed[0]}"


def test_release_notes_are_a_section_of_the_changelog() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    first = re.findall(r"^## (\S+)", changelog, re.MULTILINE)[0].rstrip(",")
    notes = subprocess.check_output([ROOT / "scripts/release-notes", first], text=True)
    assert notes.strip()
    assert notes.strip() in changelog
    assert "\n## " not in notes


def test_release_notes_of_an_unknown_version_are_refused_with_those_that_are_there() -> None:
    command = [ROOT / "scripts/release-notes", "99.0"]
    with pytest.raises(subprocess.CalledProcessError) as refused:
        subprocess.run(command, check=True, capture_output=True, text=True)
    assert "Unreleased" in refused.value.stderr or re.search(r"it has: \d", refused.value.stderr)
