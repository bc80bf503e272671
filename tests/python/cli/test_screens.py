# SPDX-License-Identifier: MIT
"""What a command prints first: all that matters, on one screen, in the units that are asked for."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import symkin as library
from symkin.present import Group, Page, Section, Table, page_text
from symkin.show.units import in_units

SMALL = ("--candidates", 400)


def commands(protocol: Path, out: Path) -> dict[str, tuple[object, ...]]:
    """Each command that has a first screen, with its files."""
    measured, calibrated = protocol / "measurements.csv", protocol / "calibrated.toml"
    quick = ("--out", out, "--no-report")
    return {
        "check": ("check", "hexapod_jugglebot", *SMALL, *quick),
        "plan": ("plan", "linear_delta", "--observe", "height", *SMALL, *quick),
        "identify": ("identify", "3RRR", measured, *quick),
        "evaluate": ("evaluate", calibrated, "--measurements", measured, *quick),
        "run": ("run", "3RRR", *SMALL, *quick),
        "pose-count": ("pose-count", "3RRR", *SMALL, *quick),
        "simulate": ("simulate", "3RRR", "--plan", protocol / "plan.csv", "--out", out),
        "identify-batch": ("identify-batch", "3RRR", measured, protocol / "none.csv", *quick),
        "compare": ("compare", protocol, protocol, *quick),
        "accept": ("accept", calibrated, measured, "--tolerance", "0.2mm", *quick),
    }


@pytest.mark.parametrize("name", commands(Path(), Path()))
def test_a_first_screen_has_at_most_25_lines_of_80_columns(
    symkin: Callable, protocol: Path, tmp_path: Path, name: str
) -> None:
    lines = symkin(*commands(protocol, tmp_path)[name]).out.splitlines()
    assert len(lines) <= 25
    pasted = ("  symkin ", "Next: symkin ", "/")  # commands and paths stay on one line
    assert [line for line in lines if len(line) > 80 and not line.startswith(pasted)] == []


def test_the_number_of_poses_that_is_enough_is_among_those_shown(symkin: Callable) -> None:
    shown = symkin("pose-count", "3RRR", *SMALL, "--no-report").out
    enough = re.search(r"^Enough +(\d+) ", shown, re.MULTILINE)
    assert enough
    counts = [int(line.split()[0]) for line in shown.splitlines() if re.match(r"\d+ +\d+ ", line)]
    assert int(enough[1]) in counts
    assert counts == sorted(counts)
    assert counts[0] == 8
    assert max(counts) == 80
    assert re.search(r"^and \d+ between$", shown, re.MULTILINE)


def test_rows_of_another_robot_are_doubted_rather_than_the_robot_alone(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    other = ("simulate", "3RRR", "--plan", protocol / "plan.csv", "--seed", 5, "--out", tmp_path)
    assert symkin(*other).code == 0
    tested = ("accept", protocol, tmp_path / "measurements.csv", "--tolerance", "0.1mm")
    told = symkin(*tested)
    assert told.code == 1
    assert "they may be of another robot of this drawing" in told.words
    own = ("--actual", protocol / "actual.toml", "--overwrite")
    assert symkin(*other, *own).code == 0
    assert "another robot" not in symkin(*tested).words


def test_a_comparison_of_two_robots_does_not_say_that_noise_never_does_that(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    other = ("simulate", "3RRR", "--plan", protocol / "plan.csv", "--seed", 5, "--out", tmp_path)
    assert symkin(*other).code == 0
    quick = ("--no-report", "--out", tmp_path / "other")
    assert symkin("identify", "3RRR", tmp_path / "measurements.csv", *quick).code == 0
    told = symkin("compare", protocol, tmp_path / "other").out
    assert re.search(r"^Frames aside +p < 0\.000001 ", told, re.MULTILINE)
    assert "What changed most" in told


def test_a_comparison_says_which_rows_both_calibrations_have(
    symkin: Callable, protocol: Path
) -> None:
    told = symkin("compare", protocol, protocol).words
    assert "Doubt: 30 of 30 rows of the second calibration are those of the first" in told
    assert "What changed most" not in told


def test_run_identify_and_evaluate_tell_errors_in_the_same_columns(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    told = {}
    for name in ("run", "identify", "evaluate"):
        shown = symkin(*commands(protocol, tmp_path / name)[name]).out
        heading, position, orientation = re.search(  # type: ignore[union-attr]
            r"^(End effector, rms .*)\n(Position, mm .*)\n(Orientation, ° .*)$", shown, re.MULTILINE
        ).groups()
        told[name] = heading.split("  ")[1:]
        ends = [found.end() for found in re.finditer(r"\S+(?: \S+)*", heading)][1:]
        for row in (position, orientation):
            assert [row[end - 1] != " " for end in ends] == [True] * len(ends)
    for name, words in {
        "run": ["before", "after", "expected", "95 % within", "instrument"],
        "identify": ["before", "expected", "95 % within", "as measured", "instrument"],
        "evaluate": ["error", "aligned", "largest", "instrument"],
    }.items():
        assert [word.strip() for word in told[name] if word.strip()] == words


def test_results_are_told_in_the_units_that_are_asked_for(
    symkin: Callable, protocol: Path, tmp_path: Path
) -> None:
    command = commands(protocol, tmp_path)["identify"]
    shown = symkin(*command, "--units", "m,rad", "--verbose").out
    # Elements of a group are called by their angles.
    told = re.sub(
        "(rotation|turn) by .*", "", shown.partition("Next:")[0]
    )  # what elements are called
    assert not re.search(r"\bmm\b|°|mrad", told)
    found = library.read_results(tmp_path / "results.json")["identification"]
    promised = found["expected_accuracy"]["position_bound_rms_m"]
    assert f"  {promised:.7f} " in shown
    refused = symkin(*command, "--units", "mm,m")
    assert refused.code == 2
    assert 'units are "mm,m"; expected one of lengths, one of angles or both' in refused.err


def test_tables_are_written_in_the_units_that_are_asked_for_and_read_back(
    symkin: Callable, tmp_path: Path
) -> None:
    plan = ("plan", "3RRR", "--candidates", "500", "--pose-count", "8", "--no-report", "--out")
    for folder, units in (("si", ()), ("told", ("--units", "mm,deg"))):
        symkin(*plan, str(tmp_path / folder), *units)
    table = (tmp_path / "told" / "plan.csv").read_text().split("\n")
    assert table[0] == "leg,order,role,x_mm,y_mm,phi_deg,psi_1_deg,psi_2_deg,psi_3_deg"
    assert max(map(len, table[1].split(","))) <= len("-123.12345678")
    exact, told = (
        library.read_plan(tmp_path / folder / "plan.csv", "3RRR") for folder in ("si", "told")
    )
    assert abs(exact.poses - told.poses).max() < 1e-9
    assert abs(exact.readings - told.readings).max() < 1e-9


def test_units_end_with_what_they_are_asked_for() -> None:
    evaluation = library.evaluate("5bar", actual="5bar")
    before = evaluation.text()
    with in_units("um"):
        assert "Position, µm" in evaluation.text()
    assert evaluation.text() == before


def test_what_has_no_room_on_a_first_screen_is_counted() -> None:
    table = Table("Robots", ("Robot", "Why"), [Group([["one", "w"]] * 9)], wordy=True, brief=True)
    page = Page(
        "Title",
        doubts=["first " * 40, "second " * 40],
        notes=["note " * 60, "more " * 60],
        sections=[Section("all", "All", (), [table, table])],
        next_command="symkin check 3RRR",
    )
    text = page_text(page)
    assert text.count("\n") < 25
    assert "first first" in text
    assert re.search(r"^--verbose has .*\b2 notes more$", text, re.MULTILINE)
    assert text.endswith("Next: symkin check 3RRR")
    whole = page_text(page, whole=True)
    assert all(word in whole for word in ("second second", "note note", "more more"))
