# SPDX-License-Identifier: MIT
"""Bad input gets one sentence on stderr, exit code 2, and never a traceback."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

PLOTTER = """
schema = 1
chain = "[R]RR"
platform = "point"
reading_unit = "rad"
[symmetry]
group = "D1"
legs = 2
axis = "90 deg"
[reference_leg]
working_mode = 1
proximal_length = "150 mm"
distal_length = "200 mm"
base_radius = "50 mm"
base_angle = "180 deg"
sensor_gain = 1
sensor_offset = 0
[workspace]
x = ["-100 mm", "100 mm"]
y = ["180 mm", "290 mm"]
"""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"[R]RR"', '"[R]RX"', 'unknown chain "[R]RX"'),
        ("proximal_length", "proximl_length", 'did you mean "proximal_length"?'),
        ('proximal_length = "1.5 m"', 'proximal_length = "-1.5 m"', "is -1.5 m"),
        ('proximal_length = "1.5 m"', 'proximal_length = "1.5 rad"', "is an angle"),
        ("legs = 3", "legs = 4", "group C3 carries one leg to 3 legs"),
        ('home = ["0 m"', 'home = ["9 m"', "beyond the reach of legs 1, 2, 3"),
    ],
)
def test_a_wrong_mechanism_file_is_refused(
    changed: Callable[[str, str], Path],
    refused: Callable,
    old: str,
    new: str,
    words: str,
    tmp_path: Path,
) -> None:
    path = changed(old, new)
    refused("check", path, words=words)
    refused("run", path, "--out", tmp_path / "out", words=words)
    assert not (tmp_path / "out").exists()


def test_for_a_home_that_was_left_out_and_is_beyond_reach_the_middle_of_the_box_is_told(
    refused: Callable, symkin: Callable, tmp_path: Path
) -> None:
    path = tmp_path / "plotter.toml"
    path.write_text(PLOTTER)
    refused("check", path, words="legs 1, 2; the middle of the box is not: write home = [0, 0.235]")
    path.write_text(PLOTTER + "home = [0, 0.235]\n")
    assert symkin("check", path).code == 0


@pytest.fixture
def undeclarable(protocol: Path, tmp_path: Path) -> Path:
    """A file that lists the legs of a simulated robot, and declares the nominal symmetry."""
    path = tmp_path / "listed.toml"
    text = (protocol / "actual.toml").read_text()
    path.write_text(text + '\n[symmetry]\ngroup = "C3"\nlegs = 3\n')
    return path


def test_a_group_that_the_listed_legs_do_not_have_is_refused(
    refused: Callable, undeclarable: Path, tmp_path: Path
) -> None:
    refused("plan", undeclarable, "--out", tmp_path, words="symmetry")


def test_check_shows_what_breaks_a_declared_group_before_it_refuses_it(
    symkin: Callable, undeclarable: Path, tmp_path: Path
) -> None:
    shown = symkin("check", undeclarable, "--out", tmp_path / "checked")
    assert shown.code == 2
    verdict = shown.out.splitlines()[2]
    assert re.match(r"The file says that the legs are alike, but leg \d differs most, ", verdict)
    assert "Next: correct the legs" in shown.out
    whole = symkin("check", undeclarable, "--verbose").out
    assert len(re.findall(r"^leg \d, \w+ +-?\d", whole, re.MULTILINE)) >= 5
    assert "do not have the declared symmetry C_3" in whole
    assert "Nearly C_3: within" in whole
    assert shown.err.startswith(f"Error: {undeclarable}:")
    assert shown.err.count("\n") == 1
    assert (tmp_path / "checked" / "check.html").exists()


def _cells(text: str) -> list[list[str]]:
    return [line.split(",") for line in text.splitlines()]


def _empty(_text: str) -> str:
    return ""


def _without_rows(text: str) -> str:
    return text.splitlines()[0] + "\n"


def _without_a_column(text: str) -> str:
    return text.replace("phi_rad", "Phi_rad", 1)


def _with_nan(text: str) -> str:
    rows = _cells(text)
    rows[2][1] = "nan"
    return "\n".join(map(",".join, rows)) + "\n"


def _with_a_repeated_row(text: str) -> str:
    return text + text.splitlines()[-1] + "\n"


def _in_degrees(text: str) -> str:
    header, *rows = _cells(text)
    rows = [row[:4] + [repr(math.degrees(float(cell))) for cell in row[4:]] for row in rows]
    return "\n".join(map(",".join, [header, *rows])) + "\n"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (_empty, "the file is empty"),
        (_without_rows, "no rows below the header"),
        (_without_a_column, 'column "phi_rad"'),
        (_with_nan, 'row 3 has nan in column "x_m"'),
        (_with_a_repeated_row, "row 32 repeats row 31"),
        (_in_degrees, "stated in rad but fit in deg"),
    ],
)
def test_wrong_measurements_are_refused(
    refused: Callable, protocol: Path, tmp_path: Path, spoil: Callable[[str], str], words: str
) -> None:
    path = tmp_path / "measurements.csv"
    path.write_text(spoil((protocol / "measurements.csv").read_text()))
    refused("identify", "3RRR", path, "--out", tmp_path / "out", words=words)
    refused("evaluate", "3RRR", "--measurements", path, words=words)
    assert not (tmp_path / "out").exists()


def test_a_file_of_another_kind_is_named_and_what_was_expected(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    table, robot, page = (protocol / f"{each}" for each in (
        "measurements.csv", "calibrated.toml", "report.html"
    ))  # fmt: skip
    mechanism = "expected a mechanism file, such as robot.toml"
    refused("identify", table, "3RRR", words=f"measurements.csv: is a table; {mechanism}")
    refused("check", page, words=f"report.html: is a page; {mechanism}")
    refused(
        "check", protocol, words=f'is a folder; expected a mechanism file; did you mean "{robot}"'
    )
    for measured in (robot, page, protocol / "results.json"):
        refused("identify", "3RRR", measured, words="; expected a table, such as measured.csv")
    told = f'with --out, or the JSON file in it; did you mean "{protocol}"?'
    refused("show", robot, words=told)
    refused("compare", protocol, table, words=told)
    into = ("--out", tmp_path / "imported")
    refused("import", table, *into, words="measurements.csv: is a table; expected a printer.cfg")
    for noise, words in {
        "position=-1mm": "position is -1mm; expected a value that is not negative",
        "direction=up": "direction is 'up'; expected 'beam' or 'x'",
        "heading=1mm": 'expected "estimate", or position, orientation, reading,',
    }.items():
        refused("identify", "3RRR", table, "--noise", noise, words=words)
    text = tmp_path / "notes.txt"
    text.write_text("measured on Monday\n")
    refused("import", text, *into, words="; expected a printer.cfg, a model (URDF, SDF or MJCF)")
    seen = ("plan", "3RRR", "--observe", "points")
    refused(*seen, *into, words='--device-kind "laser tracker, 3 reflectors" or "CMM"')


def test_fewer_poses_than_parameters_are_refused(
    refused: Callable, protocol: Path, tmp_path: Path
) -> None:
    path = tmp_path / "measurements.csv"
    path.write_text("\n".join((protocol / "measurements.csv").read_text().splitlines()[:5]) + "\n")
    refused("identify", "3RRR", path, words="its 8 parameters need at least 8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "nosuch"], "neither a file nor a shipped mechanism"),
        (["check", "nosuch.toml"], "no such file"),
        (["check"], "MECHANISM is missing; expected symkin check MECHANISM"),
        (["check", "3RRR", "more"], '"more" is too much; expected symkin check MECHANISM (see'),
        (["check", "3RRR", "--bogus"], "check has no option --bogus"),
        (["check", "3RRR", "--accuracy", "1um"], "check has no option --accuracy; pose-count"),
        (["check", "3RRR", "--out"], "--out needs a value behind it"),
        (["check", "3RRR", "--json=1"], "--json takes no value"),
        (
            ["plan", "3RRR", "--pose-count", "x"],
            "--pose-count: expected a whole number",
        ),
        (["plan", "3RRR", "--seed", "-1"], "expected at least 0"),
        (["plan", "3RRR", "--design", "x"], '--design is "x"; expected one of legs, orbits'),
        (["bogus"], 'there is no command "bogus"'),
        (["plan", "3RRR"], "--out is missing; expected --out"),
        (["plan", "3RRR", "--out", "p", "--pose-count", "0"], "--pose-count"),
        (["plan", "3RRR", "--out", "p", "--pose-count", "many"], "--pose-count"),
        (["plan", "3RRR", "--out", "p", "--seed", "-1"], "--seed"),
        (["plan", "3RRR", "--out", "p", "--rows", "best"], "paper, noise_aware"),
        (["plan", "3RRR", "--out", "p", "--pose-count", "5"], "at least 8"),
        (["plan", "3RRR", "--out", "p", "--avoid", "x"], "such as x=0.1:0.3"),
        (["plan", "3RRR", "--out", "p", "--avoid", "x=1 kg:2"], "kg"),
        (["plan", "3RRR", "--out", "p", "--avoid", "z=1:2"], "coordinates of the poses"),
        (["plan", "3RRR", "--out", "p", "--avoid", "x=1:2,x=3:4"], "limits x twice"),
        (["plan", "3RRR", "--out", "p", "--avoid", "phi=30:60"], 'write "30 deg"'),
        (["plan", "3RRR", "--out", "p", "--threads", "2147483648"], "--threads"),
        (["plan", "3RRR", "--out", "p", "--seed", "18446744073709551616"], "--seed"),
        (["workspace", "3RRR", "--out", "w", "--orientations", "0,0,0"], "has an angle twice"),
        (["workspace", "3RRR", "--out", "w", "--orientations", "0,x"], "unknown unit"),
        (["identify", "3RRR", "m.csv", "--columns", "3RRR"], "no such file"),
        (["plan", "3RRR", "--out", "p", "--minimum-distance", "-1"], "is negative"),
        (["plan", "3RRR", "--out", "p", "--required", "no.csv"], "no.csv"),
        (["plan", "3RRR_asymmetric", "--out", "p", "--design", "orbits"], "images of leg 1"),
        (["pose-count", "3RRR", "--least-gain", "2"], "--least-gain"),
        (["pose-count", "3RRR", "--accuracy", "0.05"], "with a unit; expected such as 0.05mm"),
        (["pose-count", "3RRR", "--accuracy", "50"], "with a unit; expected such as 0.05mm"),
        (["pose-count", "3RRR", "--accuracy", "5kg"], "with a unit; expected such as 0.05mm"),
        (["pose-count", "3RRR", "--accuracy", "-5um"], "is not positive"),
        (["pose-count", "3RRR", "--accuracy", "5um", "--accuracy", "1mm"], "a second error"),
        (["pose-count", "5bar", "--accuracy", "1mrad"], "the platform of 5bar never turns"),
        (["plan", "3RRR", "--out", "p", "--candidates", "20"], "20 candidates"),
        (["run", "3RRR", "--out", "out", "--pose-count", "4"], "at least 8"),
        (["simulate", "3RRR", "--plan", "nosuch.csv", "--out", "out"], "nosuch.csv"),
        (["identify", "3RRR", "nosuch.csv"], "no such file"),
        (["kinematics", "3RRR", "nosuch.csv"], "no such file"),
        (["evaluate", "3RRR"], "either --actual or --measurements"),
        (["evaluate", "3RRR", "--actual", "hexapod_jugglebot"], "expected the same"),
        (["evaluate", "3RRR", "--measurements", "m.csv", "--candidates", "9"], "with --actual"),
    ],
)
def test_a_wrong_command_line_is_refused(
    refused: Callable,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(*arguments, words=words)
    assert not list(tmp_path.rglob("*.*"))


@pytest.mark.parametrize("json", [[], ["--json"]])
def test_a_place_that_cannot_be_written_is_refused(
    refused: Callable, tmp_path: Path, json: list[str]
) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    small = ["--candidates", "200", *json]
    refused("plan", "3RRR", "--out", file / "planned", *small, words=str(file))
    refused("plan", "3RRR", "--out", file, *small, words="is not a folder")
    refused("run", "3RRR", "--out", file, *small, words="is not a folder")
    refused("run", "3RRR", "--out", "/proc/nowhere", *small, words="/proc/nowhere")
    assert file.read_text() == "mine"


def test_cross_validation_in_too_many_parts_is_refused(refused: Callable, protocol: Path) -> None:
    measured = protocol / "measurements.csv"
    refused("identify", "3RRR", measured, "--cross-validate", 99, words="from 2 to 30")
    refused("identify", "3RRR", measured, "--cross-validate", 1, words="--cross-validate")
