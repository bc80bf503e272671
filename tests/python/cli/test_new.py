# SPDX-License-Identifier: MIT
"""Mechanism files to begin with: those that come with symkin, and new ones."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import symkin as library

Run = Callable[..., Any]


def test_list_names_every_shipped_mechanism_and_says_what_it_is(symkin: Run) -> None:
    listed = symkin("list")
    assert listed.code == 0
    assert "3RRR: 3 legs [R]RR, planar, C3\n    The planar 3-RRR of Durango et al. (2010)," in (
        listed.out
    )
    document = symkin("list", "--json").json
    rows = {row["name"]: row for row in document["mechanisms"]}
    assert sorted(rows) == library.shipped_mechanisms()
    assert rows["5bar"]["platform"] == "point"
    assert rows["3RRR_asymmetric"]["symmetry"] is None
    assert "tricept: 4 legs with 3 readings, 3 strut + 1 middle without a reading" in listed.out
    for row in rows.values():
        assert row["description"].endswith(".")
        assert Path(row["file"]).is_file()


def test_what_new_prints_is_a_file_that_commands_take(symkin: Run, tmp_path: Path) -> None:
    made = symkin("new", "--chain", "[R]RR", "--legs", 2, "--platform", "point")
    assert (made.code, made.err) == (0, "")
    path = tmp_path / "robot.toml"
    path.write_text(made.out, encoding="utf-8")
    checked = symkin("check", path, "--json")
    assert checked.code == 0
    assert checked.json["mechanism"] == "robot"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--chain", "[R]RX"], 'unknown chain "[R]RX"; the nearest known one is "[R]RR"'),
        (["--chain", "[R]RR", "--legs", 2], "2 legs for a planar platform; expected 3 to 64"),
        ([], "--chain is missing; expected --chain"),
    ],
)
def test_a_chain_that_cannot_be_is_answered(
    refused: Callable[..., None], arguments: list[Any], words: str
) -> None:
    refused("new", *arguments, words=words)


@pytest.mark.parametrize(
    ("typed", "completions"),
    [
        ("symkin check 3RR", {"3RRP", "3RRR", "3RRR_asymmetric", "3RRR_encoders", "3RRR_four_bar"}),
        ("symkin ide", {"identify", "identify-batch"}),
        ("symkin new --chain [R]P", {"[R]PR"}),
    ],
)
def test_the_shell_completes_commands_and_names(typed: str, completions: set[str]) -> None:
    surroundings = {
        "_SYMKIN_COMPLETE": "complete_bash",
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(typed.split()) - 1),
    }
    shown = subprocess.run(
        [sys.executable, "-m", "symkin"],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | surroundings,
    )
    assert set(shown.stdout.split()) == completions
