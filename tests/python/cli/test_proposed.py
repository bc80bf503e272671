# SPDX-License-Identifier: MIT
"""Commands that a screen proposes run as they are printed, with all that the rows need."""

import csv
import itertools
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

import symkin as library
from symkin.model.settings import Frames
from symkin.planning.simulation import disturb

NEXT = re.compile(r"Next: .*?\n  symkin (.*)", re.DOTALL)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory) -> Path:
    """Tables of three robots, named in a column, with columns that nothing is read from."""
    folder = tmp_path_factory.mktemp("fleet")
    robot = library.load("3RRR")
    plan = robot.plan(12, candidates=400, seed=1)
    rows: list[list[str]] = []
    for number in range(3):
        made = robot.simulate(plan, number + 3, disturb(robot, number + 3)).measurements
        made.save(folder / "one.csv", robot, overwrite=True)
        head, *own = csv.reader((folder / "one.csv").read_text().splitlines())
        rows += [[f"A {number}", *row] for row in own]
    for file, name, strange in (
        ("fleet.csv", "robot", ["phi_2_deg", "my note"]),
        ("serials.csv", "serial", []),
        ("noted.csv", "serial", ["my note"]),
    ):
        lines = [[name, *strange, *head]]
        lines += [[each, *["1"] * len(strange), *row] for each, *row in rows]
        with (folder / file).open("w", newline="") as out:
            csv.writer(out).writerows(lines)
    return folder


def proposed(shown: str) -> list[str]:
    (command,) = NEXT.findall(shown)
    return shlex.split(command.partition("\n")[0])


@pytest.mark.parametrize(
    "options",
    [
        ("--robot", "A 1", "--ignore", "my note"),
        ("--robot", "A 1", "--ignore", "my note", "--ignore", "phi_2_deg"),
        ("--robot", "A 1", "--ignore", "my note", "--prior", "tolerances", "--of", "x"),
    ],
    ids=["ignore", "twice", "of"],
)
def test_what_follows_an_estimate_has_the_options_that_its_rows_need(
    symkin: Callable, fleet: Path, tmp_path: Path, options: tuple[str, ...]
) -> None:
    shown = symkin("identify", "3RRR", fleet / "fleet.csv", *options, "--no-report")
    assert shown.code == 0
    command = proposed(shown.out)
    for one, other in zip(options[::2], options[1::2], strict=True):
        assert any(pair == (one, other) for pair in itertools.pairwise(command))
    again = symkin(*command[:-1], tmp_path / "out", "--no-report")
    assert again.code == 0
    assert library.read_estimate(tmp_path / "out").measurements.ignored == tuple(
        other for one, other in zip(options[::2], options[1::2], strict=True) if one == "--ignore"
    )


@pytest.mark.parametrize("exchanged", [False, True])
def test_what_follows_an_estimate_has_the_table_of_its_sensors(
    symkin: Callable, fleet: Path, tmp_path: Path, exchanged: bool
) -> None:
    certificate, table = tmp_path / "my encoders.csv", tmp_path / "one.csv"
    certificate.write_text("reading_deg,joint_deg\n-180,-180\n180,180\n")
    head, *rows = csv.reader((fleet / "fleet.csv").read_text().splitlines())
    with table.open("w", newline="") as out:
        for row in [head, *(row for row in rows if row[0] == "A 1")]:
            if exchanged and row is not head:
                row[-1], row[-2] = row[-2], row[-1]
            csv.writer(out).writerow(row[3:])
    shown = symkin(
        *("identify", "3RRR", table, "--sensor-table", certificate, "--no-report"),
        *("--out", tmp_path / "first"),
    )
    command = proposed(shown.out)
    assert command[:4] == ["identify", "3RRR", "--sensor-table", str(certificate)]
    assert ("first/corrected.csv" in command[4]) is exchanged
    again = symkin(*command[:-1], tmp_path / "out", "--no-report")
    assert again.code == 0
    assert library.read_estimate(tmp_path / "out").measurements.sensor_table is not None


def test_a_robot_that_a_fleet_doubts_is_looked_at_without_the_columns_that_were_left_out(
    symkin: Callable, fleet: Path, tmp_path: Path
) -> None:
    head, *rows = csv.reader((fleet / "fleet.csv").read_text().splitlines())
    for row in rows:
        if row[0] == "A 1":
            row[-1], row[-2] = row[-2], row[-1]  # exchanged legs
    table = tmp_path / "broken.csv"
    with table.open("w", newline="") as out:
        csv.writer(out).writerows([head, *rows])
    left_out = "--ignore", "my note", "--ignore", "phi_2_deg"
    shown = symkin("identify-batch", "3RRR", table, *left_out, "--of", "x")
    (command,) = re.findall(r"^  symkin (identify .*)$", shown.out, re.MULTILINE)
    words = shlex.split(command)
    assert [*words[3:11]] == ["--robot", "A 1", *left_out, "--of", "x"]
    if "--out" in words:
        words[words.index("--out") + 1] = str(tmp_path / "out")
    looked = symkin(*words, "--no-report")
    assert looked.code in (0, 1)
    assert "nothing was read" not in looked.out


def test_a_column_that_looks_like_robots_is_mapped_by_the_line_that_is_proposed(
    symkin: Callable, fleet: Path, tmp_path: Path
) -> None:
    refused = symkin("identify", "3RRR", fleet / "serials.csv").err
    line = refused.partition("(FILE)): ")[2]
    columns = tmp_path / "columns.toml"
    columns.write_text(line)
    table = "identify-batch", "3RRR", fleet / "serials.csv", "--columns", columns
    shown = symkin(*table)
    assert shown.code == 0
    assert "3 of 3 robots fit" in shown.out
    assert "nothing was read" not in shown.out
    # By a mapping what it does not name would be lost: then the column has to be renamed.
    other = symkin("identify", "3RRR", fleet / "noted.csv", "--ignore", "my note").err
    assert "(FILE)): " not in other
    assert 'if it is called "robot" (or in a mapping robot = "serial")' in other


def test_points_of_many_robots_are_mapped_by_the_line_that_is_proposed(
    symkin: Callable, tmp_path: Path
) -> None:
    places = ((0.1, 0.0, 0.05), (-0.05, 0.09, 0.05), (-0.05, -0.09, 0.05))
    robot = library.load("3RPS").replace(frames=Frames(points=places))
    robot.save(tmp_path / "tracked.toml")
    plan = robot.plan(14, candidates=300, seed=1, observe="points")
    rows: list[list[str]] = []
    for seed in (1, 2):
        table = tmp_path / f"{seed}.csv"
        made = robot.simulate(plan, seed, disturb(robot, seed), observe="points")
        made.measurements.save(table, robot)
        head, *own = csv.reader(table.read_text().splitlines())
        rows += [[f"A {seed}", *row] for row in own]
    with (tmp_path / "all.csv").open("w", newline="") as out:
        csv.writer(out).writerows([["serial", *head], *rows])
    files = tmp_path / "tracked.toml", tmp_path / "all.csv"
    line = symkin("identify", *files).err.partition("(FILE)): ")[2]
    assert 'p3_z_m = "p3_z_m"' in line
    (tmp_path / "columns.toml").write_text(line)
    shown = symkin("identify-batch", *files, "--columns", tmp_path / "columns.toml")
    assert shown.code == 0
    assert "2 of 2 robots fit" in shown.out


def test_frames_are_aligned_with_one_robot_of_many(symkin: Callable, fleet: Path) -> None:
    table = "align", fleet / "fleet.csv", "--mechanism", "3RRR"
    refused = symkin(*table)
    assert refused.code == 2
    assert "one of them is taken with --robot 'A 0'" in refused.err
    shown = symkin(*table, "--robot", "A 0", "--ignore", "my note")
    assert shown.code == 0
    assert "over 36 poses" in shown.out
