# SPDX-License-Identifier: MIT
"""What the page of real robots shows is what its commands print, where the tables are at hand."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from symkin.cli import main

PAGE = Path(__file__).parents[2] / "docs" / "tutorial-real-data.md"
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
TABLES = {
    "108_calibration_poses.csv": "jugglebot",
    "samples.csv": "hangprinter",
    "at960_em8000.csv": "motion_lab",
}
FIGURES = ("Position", "Orientation", "Closure", "Chi-square", "measured poses taken")


def screens() -> list[tuple[list[str], list[str]]]:
    """Commands of one table each without what they write, and lines with figures that follow."""
    found = []
    text = PAGE.read_text(encoding="utf-8").replace("\\\n", " ")
    for block in re.findall(r"^```console\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for screen in re.split(r"^\$ symkin ", block, flags=re.MULTILINE)[1:]:
            command, *lines = screen.splitlines()
            arguments = shlex.split(command.split(" --out ")[0])
            known = not {"--verbose", "calibrated/calibrated.toml"}.intersection(arguments)
            lines = [line for line in lines if line.startswith(FIGURES)]
            if known and lines and not {*TABLES}.isdisjoint(arguments):
                found.append((arguments, lines))
    return found


def exit_code_on_the_page(arguments: list[str]) -> int:
    """That of the row of its table whose command has these arguments; 0 of any other."""
    row = r"^\| \[.*\| `([^`]+)` \|.*\| (\d) \|$"
    for command, code in re.findall(row, PAGE.read_text(encoding="utf-8"), re.MULTILINE):
        if {*command.split()} <= {*arguments}:
            return int(code)
    return 0


def test_the_page_has_a_command_for_every_table():
    assert {*TABLES} == {each for arguments, _ in screens() for each in arguments} & {*TABLES}


@pytest.mark.parametrize(("arguments", "lines"), screens(), ids=lambda each: each[0][:24])
def test_a_command_of_the_page_prints_its_figures(arguments, lines, tmp_path, monkeypatch, capsys):
    for name, folder in TABLES.items():
        if not (DATA / folder / name).exists():
            pytest.skip(f"{name} is not at hand")
        shutil.copy(DATA / folder / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == exit_code_on_the_page(arguments)
    printed = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert [" ".join(line.split()) for line in lines if " ".join(line.split()) not in printed] == []
