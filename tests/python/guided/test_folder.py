# SPDX-License-Identifier: MIT
"""The folder of a session under hostile hands: other processes, spreadsheets, full disks, kills."""

import csv
import datetime as dt
import json
import os
import re
import subprocess
import sys

import pytest

import symkin
from symkin.errors import SymkinError
from symkin.guided import SimulatedDevice, session
from symkin.show.guided import end_text

FEW = {"candidates": 60, "seed": 1}
ACCURACY = 1e-4


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


@pytest.fixture
def folder(robot, tmp_path):
    """Of a session of five rows, one of which is a repeat, and one that is taken back."""
    session = begun(robot, tmp_path / "session")
    device = SimulatedDevice(robot, seed=2)
    for number in range(5):
        session.add(device(session.next()))
        if number == 2:
            session.repeat(1)
    session.undo()
    return tmp_path / "session"


def begun(robot, folder, accuracy=ACCURACY):
    return robot.measure(accuracy, folder, **FEW)


def saved(folder, change, **how):
    """Save the table as a spreadsheet would, after a change of its lines."""
    path = folder / "measured.csv"
    with path.open(newline="") as file:
        lines = list(csv.reader(file))
    encoding = how.pop("encoding", "utf-8")
    with path.open("w", newline="", encoding=encoding) as file:
        csv.writer(file, **how).writerows(change(lines))


def shown(session):
    asked = session.next()
    return asked.row, asked.pose.tolist(), session.progress


def with_commas(lines):
    number = re.compile(r"-?\d+\.\d+(e-\d+)?").fullmatch
    return [[cell.replace(".", ",") if number(cell) else cell for cell in line] for line in lines]


def by_x(lines):
    at = lines[0].index("x_m")
    return [lines[0], *sorted(lines[1:], key=lambda line: line[at])]


def columns_reversed(lines):
    return [line[::-1] for line in lines]


@pytest.mark.parametrize(
    ("change", "how"),
    [
        (list, {"encoding": "utf-8-sig"}),
        (list, {"lineterminator": "\r\n"}),
        (list, {"delimiter": "\t"}),
        (with_commas, {"delimiter": ";", "encoding": "utf-8-sig"}),
        (by_x, {}),
        (columns_reversed, {"lineterminator": "\r\n"}),
        (lambda lines: by_x(with_commas(lines)), {"delimiter": ";"}),
    ],
)
def test_a_table_that_a_spreadsheet_saved_goes_on_as_it_was(robot, folder, change, how):
    path = folder / "measured.csv"
    open_one = begun(robot, folder)
    before, as_written = shown(open_one), path.read_bytes()
    saved(folder, change, **how)
    changed = path.read_bytes()
    assert shown(begun(robot, folder)) == before
    assert shown(open_one) == before
    kept = folder / "measured.csv.edited"
    if kept.exists():  # and put right
        assert (path.read_bytes(), kept.read_bytes()) == (as_written, changed)
    else:  # in a form that is as good
        assert path.read_bytes() == changed
    session = begun(robot, folder)
    session.add(SimulatedDevice(robot, seed=5)(session.next()))
    assert open_one.next().row == session.next().row
    found = symkin.identify(folder / "robot.toml", path)
    assert len(found.measurements.poses) == 5


def test_a_value_that_was_changed_meanwhile_counts_as_it_is_now(robot, folder):
    session = begun(robot, folder)
    before = session.measurements.poses[1, 0]

    def shifted(lines):
        at = lines[0].index("x_m")
        lines[2][at] = repr(float(lines[2][at]) + 1e-4)
        return lines

    saved(folder, shifted)
    assert session.refresh()
    assert session.measurements.poses[1, 0] == pytest.approx(before + 1e-4)


def test_a_row_that_was_taken_out_leaves_the_others_their_numbers(robot, folder):
    saved(folder, lambda lines: [*lines[:2], *lines[3:]])
    session = begun(robot, folder)
    assert session.progress.rows == 3
    session.add(SimulatedDevice(robot, seed=2)(session.next()))
    with (folder / "measured.csv").open() as file:
        assert [line["row"] for line in csv.DictReader(file)] == ["1", "3", "4", "5", "5", "6"]


def renamed(lines):
    lines[0][lines[0].index("x_m")] = "x"
    return lines


def of(row, column, text):
    def change(lines):
        lines[row][lines[0].index(column)] = text
        return lines

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (renamed, '"x" is none of its columns and "x_m" is missing; expected the columns as they'),
        (of(2, "x_m", "12 mm"), 'row 3 has "12 mm" for x_m; expected a number'),
        (of(2, "status", "OK"), 'row 3 has the status "OK"; expected none, or ok, repeat'),
        (of(2, "row", "1"), "row 3 has the number 1 of another one"),
        (of(2, "row", "one"), 'row 3 has the number "one"; expected one as 12'),
        (lambda lines: [lines[0], *lines[2:]], "tells of row 1, which is not there"),
        (lambda lines: [line[:-1] for line in by_x(lines)], '"remark" is missing'),
        (
            lambda lines: by_x([*lines[:2], ["", "", "", *lines[2][3:]], *lines[3:]]),
            "sort them by row",
        ),
    ],
)
def test_what_nobody_can_have_meant_is_refused_by_row_and_the_table_stays(
    robot, folder, change, words
):
    session = begun(robot, folder)
    before = (folder / "measured.csv").read_bytes()
    saved(folder, change)
    spoilt = (folder / "measured.csv").read_bytes()
    for again in (lambda: begun(robot, folder), session.next):
        with pytest.raises(SymkinError) as error:
            again()
        assert words in str(error.value)
    assert (folder / "measured.csv").read_bytes() == spoilt
    (folder / "measured.csv").write_bytes(before)
    assert session.next().row == begun(robot, folder).next().row == 7


def test_another_process_is_kept_out_and_cuts_nothing(robot, folder):
    session = begun(robot, folder)
    table = folder / "measured.csv"
    with table.open("ab") as file:
        file.write(b",,,,,0.1")  # being written
    whole = table.read_bytes()
    code = (
        "import sys, symkin\n"
        "try: symkin.load('3RRR').measure(1e-4, sys.argv[1], candidates=60, seed=1)\n"
        "except symkin.SymkinError as error: print(error)\n"
    )
    asked = [sys.executable, "-c", code, str(folder)]
    said = subprocess.run(asked, capture_output=True, text=True, check=True)
    assert "another symkin measures there; end it first" in said.stdout
    assert table.read_bytes() == whole
    del session
    said = subprocess.run(asked, capture_output=True, text=True, check=True)
    assert said.stdout == ""
    assert whole.startswith(table.read_bytes())
    assert (folder / "measured.csv.partial").read_bytes() == b",,,,,0.1\n"


def test_rows_that_others_append_while_one_is_entered_have_numbers_of_their_own(robot, folder):
    session, device = begun(robot, folder), SimulatedDevice(robot, seed=2)
    ask = session.next()
    found = device(ask)
    with (folder / "measured.csv").open() as file:
        header = next(csv.reader(file))
    with (folder / "measured.csv").open("a") as file:
        file.write(",".join(str(found.get(name, "")) for name in header) + "\n")
    session.add(device(ask))
    with (folder / "measured.csv").open() as file:
        rows = [line["row"] for line in csv.DictReader(file)]
    assert rows[-2:] == ["", "8"]
    assert begun(robot, folder).next().row == 9


def test_an_end_without_a_line_end_is_set_aside_before_a_row_is_written(robot, folder):
    session = begun(robot, folder)
    with (folder / "measured.csv").open("ab") as file:
        file.write(b",,,,,0.1")
    session.add(SimulatedDevice(robot, seed=2)(session.next()))
    assert begun(robot, folder).progress == session.progress
    assert (folder / "measured.csv.partial").read_bytes() == b",,,,,0.1\n"


@pytest.mark.parametrize("size", range(0, 240, 40))
def test_a_header_that_was_torn_is_written_again(robot, tmp_path, size):
    begun(robot, tmp_path)
    header = (tmp_path / "measured.csv").read_bytes()
    (tmp_path / "measured.csv").write_bytes(header[:size])
    assert begun(robot, tmp_path).next().row == 1
    assert (tmp_path / "measured.csv").read_bytes() == header


@pytest.mark.parametrize("left", ["", "robot.toml", ".robot.toml", ".session.json"])
def test_a_session_that_was_killed_while_it_began_begins(robot, tmp_path, left):
    if left:
        (tmp_path / left).write_text("half")
    assert begun(robot, tmp_path).next().row == 1
    assert sorted(path.name for path in tmp_path.iterdir() if path.name[0] != ".") == [
        *("lock", "measured.csv", "robot.toml", "session.json"),
    ]


def test_a_robot_file_that_was_not_written_any_more_is_when_it_goes_on(robot, folder):
    begun(robot, folder).slip(3)
    right = (folder / "robot.toml").read_bytes()
    assert b"step" in right
    (folder / "robot.toml").unlink()
    begun(robot, folder)
    assert (folder / "robot.toml").read_bytes() == right


@pytest.mark.parametrize("text", ["", "{", "[]", "[" * 100_000])
def test_settings_that_cannot_be_read_are_refused(robot, folder, text):
    (folder / "session.json").write_text(text)
    with pytest.raises(SymkinError, match=r"cannot be read, and says what measured\.csv is of"):
        begun(robot, folder)


def test_what_another_session_was_of_is_told(robot, folder):
    with pytest.raises(SymkinError, match=r"another accuracy \(accuracy 0.0001 m\); expected"):
        begun(robot, folder, 2e-4)
    longer = robot.with_parameters(robot.parameters * 1.001, symmetry=None)
    with pytest.raises(SymkinError, match=r"another drawing or unknowns; expected"):
        begun(longer, folder)
    told = json.loads((folder / "session.json").read_text())
    assert told["accuracy"] == {"position": ACCURACY}


def test_a_row_that_does_not_get_to_the_disk_is_not_entered_and_can_be_again(
    robot, folder, monkeypatch
):
    session, before = begun(robot, folder), (folder / "measured.csv").read_bytes()
    ask = session.next()
    found = SimulatedDevice(robot, seed=2)(ask)

    def full(_):
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(SymkinError, match=r"No space left.*; nothing was entered"):
            session.add(found)
    assert (folder / "measured.csv").read_bytes() == before
    assert session.next().pose == pytest.approx(ask.pose)
    session.add(found)
    assert session.next().row == ask.row + 1


def test_a_robot_that_does_not_get_to_the_disk_is_told_and_written_when_the_session_goes_on(
    robot, folder, monkeypatch
):
    running, device = begun(robot, folder), SimulatedDevice(robot, seed=2)
    robot_file, before = folder / "robot.toml", (folder / "robot.toml").read_text()

    def full(*_, **__):
        raise SymkinError("No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(session, "save_mechanism", full)
        running.add(device(running.next()))
        running.slip(running.progress.rows)
    assert robot_file.read_text() == before
    assert "robot.toml could not be written" in end_text(running, running.progress)
    del running
    again = begun(robot, folder)
    assert "step" in robot_file.read_text()
    assert "robot.toml could not be written" not in end_text(again, again.progress)


def test_the_seconds_of_rows_never_run_backwards(robot, folder, monkeypatch):
    class Clock(dt.datetime):
        @classmethod
        def now(cls, tz=None):
            return super().now(tz) - dt.timedelta(hours=3)

    device, session_of = SimulatedDevice(robot, seed=2), begun(robot, folder)
    monkeypatch.setattr(session.dt, "datetime", Clock)
    session_of.add(device(session_of.next()))
    monkeypatch.undo()
    session_of.add(device(session_of.next()))
    with (folder / "measured.csv").open() as file:
        times = [float(line["time_s"]) for line in csv.DictReader(file)]
    assert times == sorted(times)


def test_what_a_device_says_of_a_row_stays_in_its_line(robot, folder):
    session_of = begun(robot, folder)
    row = SimulatedDevice(robot, seed=2)(session_of.next())
    session_of.add(row, device="tracker\nA12", remark="warm,\r\nand wet")
    assert (
        (folder / "measured.csv")
        .read_text()
        .splitlines()[-1]
        .endswith(',tracker A12,"warm, and wet"')
    )


def test_why_a_pose_failed_is_one_of_the_words_for_that(robot, folder):
    with pytest.raises(SymkinError, match="why is 'foggy'; expected"):
        begun(robot, folder).fail("foggy")
