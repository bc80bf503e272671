# SPDX-License-Identifier: MIT
"""``symkin measure`` by hand, by a pipe and by a device."""

import contextlib
import io
import json
import sys

import pytest

import symkin as package
from symkin.estimate import precision
from symkin.guided.device import Device

FEW = ("--candidates", 150, "--seed", 1)
DEVICE = f'"{sys.executable}" -c "{{}}"'


@pytest.fixture(autouse=True)
def few_poses(monkeypatch):
    """Bounds over few poses of the workspace, which take the time of a session."""
    monkeypatch.setattr(precision, "_SAMPLES", 200)


@pytest.fixture
def typed(monkeypatch):
    """What is piped into a command."""

    def given(*lines):
        monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{line}\n" for line in lines)))

    return given


def test_a_device_is_asked_until_the_accuracy_is_reached(symkin, tmp_path):
    device = "symkin simulate-device 3RRR --seed 2 --lost 0.1"
    given = ("measure", "3RRR", "--accuracy", "0.3mm", "--out", tmp_path, *FEW)
    done = symkin(*given, "--device", device)
    assert done.code == 0, done.err
    assert "Enough:" in done.out
    assert max(map(len, done.out.splitlines()[:-1])) <= 80
    again = symkin(*given)
    assert (again.code, again.out.splitlines()[-4:]) == (0, done.out.splitlines()[-4:])


def test_who_asks_is_told_the_keys_and_who_leaves_how_it_goes_on(symkin, tmp_path, typed):
    typed("-362.1 -126.2 6.1", "?", "help", "quit", "10.5 20.5 3")
    done = symkin("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path, *FEW)
    assert done.code == 1
    assert done.out.count("Enter the row; s skip") == 3
    assert "Not yet: 1 row" in done.out
    assert "Every row is saved; the same command goes on." in done.out


def test_ctrl_c_says_how_it_goes_on(symkin, tmp_path, monkeypatch):
    class Interrupted:
        def readline(self):
            raise KeyboardInterrupt

    monkeypatch.setattr(sys, "stdin", Interrupted())
    done = symkin("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path, *FEW)
    assert done.code == 130
    assert "Every row is saved; the same command goes on." in done.out


def test_rows_are_typed_in_the_units_of_the_prompt(symkin, tmp_path, typed):
    typed("-362.1 -126.2 6.1", "s", "bad", "1,2", "o", "10.5;20,5;3 1 2 3", "u", "q")
    done = symkin("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path, *FEW)
    assert done.code == 1
    assert "Not yet: 1 row" in done.out
    assert "2 values entered; expected 3 or 6: x mm, y mm" in done.words
    assert (
        '"bad" is no key and no row; expected s, o, a, r, u, t, d, k, q, or numbers' in done.words
    )
    assert "Row 4 is taken back." in done.out
    lines = (tmp_path / "measured.csv").read_text().splitlines()
    assert [line.split(",")[3] for line in lines[1:]] == [
        "ok",
        "skipped",
        "occluded",
        "ok",
        "undone",
    ]
    assert float(lines[1].split(",")[8]) == pytest.approx(-0.3621)
    assert float(lines[4].split(",")[9]) == pytest.approx(0.0205)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("print(5, flush=True)", "expected a line of JSON"),
        ("pass", "has ended"),
        ("print('{\\'symkin\\': 2}'.replace(chr(39), chr(34)))", "in its first line"),
        (
            "print('{\\'symkin\\': 1, \\'timeout_s\\': \\'long\\'}'.replace(chr(39), chr(34)))",
            '"timeout_s" above zero',
        ),
    ],
)
def test_a_device_that_talks_nonsense_ends_the_session(symkin, tmp_path, answer, words):
    done = symkin(
        *("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path, *FEW),
        *("--device", DEVICE.format(answer)),
    )
    assert done.code == 2
    assert words in done.err
    assert (tmp_path / "measured.csv").read_text().count("\n") == 1


_ANSWERS = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    answer = '"symkin": 1' if "hello" in asked else f'"id": {asked["id"]}, ' + sys.argv[1]
    print('{' + answer + '}', flush=True)
"""


@pytest.mark.parametrize("value", ["1" + "0" * 400, "true", "NaN", "1e999", '"0.1"', "[0.1]"])
def test_what_a_device_measured_is_finite_numbers_or_null(symkin, tmp_path, value):
    program = tmp_path / "device.py"
    program.write_text(_ANSWERS)
    measured = f'"measured": {{"x_m": {value}, "y_m": 0.1, "phi_rad": 0}}'
    done = symkin(
        *("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path / "session", *FEW),
        *("--device", f'"{sys.executable}" "{program}" \'{measured}\''),
    )
    assert done.code == 2
    assert "expected finite numbers or null" in done.err
    assert (tmp_path / "session" / "measured.csv").read_text().count("\n") == 1


_SAME = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    answer = dict(symkin=1, timeout_s=1e300)
    if "measure" in asked:
        answer = dict(id=asked["id"], measured=dict(x_m=0.1, y_m=1.0, phi_rad=0))
    print(json.dumps(answer), flush=True)
"""


def test_a_device_that_always_says_the_same_does_not_measure_for_ever(symkin, tmp_path):
    program = tmp_path / "device.py"
    program.write_text(_SAME)
    done = symkin(
        *("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path / "session", *FEW),
        *("--device", f'"{sys.executable}" "{program}"'),
    )
    assert done.code == 2
    assert "the last 6 rows fit no robot like the drawing; compare the units" in done.err
    lines = (tmp_path / "session" / "measured.csv").read_text().splitlines()
    assert sum(line.split(",")[3] in ("ok", "repeat") for line in lines) < 20


_LOGGED = """
import json, sys
answers = json.loads(sys.argv[2])
for line in sys.stdin:
    print(line, end="", file=open(sys.argv[1], "a"))
    asked = json.loads(line)
    if "hello" in asked:
        print(json.dumps(dict(symkin=1, timeout_s=float(sys.argv[3]))), flush=True)
    elif "measure" in asked and answers:
        print(json.dumps(dict(id=asked["id"]) | answers.pop(0)), flush=True)
"""


@pytest.fixture
def device(tmp_path):
    """A device that gives these answers, and keeps what it was told in a file."""
    program, log = tmp_path / "device.py", tmp_path / "told.jsonl"
    program.write_text(_LOGGED)

    def made(*answers, patience=60):
        said = json.dumps(answers).replace('"', '\\"')
        return f'"{sys.executable}" "{program}" "{log}" "{said}" {patience}'

    return made, log


_THERE = {"measured": {"x_m": 0.1, "y_m": 0.1, "phi_rad": 0.0}}


@pytest.mark.parametrize(
    ("answers", "status"),
    [
        (({"error": "lost", "retry": True}, _THERE), "ok"),
        (({"error": "busy", "retry": True}, _THERE), "ok"),
        (({"error": "busy", "retry": True}, {"error": "busy", "retry": True}), "unreachable"),
        (({"error": "lost"},), "lost"),
        (({"error": "occluded", "retry": True},), "occluded"),
    ],
)
def test_what_a_device_lost_is_tried_once_more_if_it_says_so(tmp_path, device, answers, status):
    program, log = device
    session = package.measure("3RRR", 1e-4, tmp_path / "session", candidates=150, seed=1)
    with Device(program(*answers), session) as running:
        found = running.measure(session.next())
    assert getattr(found, "why", "ok") == status
    assert log.read_text().count('"measure"') == len(answers)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ({"error": "on fire", "message": "in the arm"}, 'reports a fault: "on fire" in the arm'),
        ({"id": 5} | _THERE, 'expected "id": 1'),
        ({"measured": 5}, '"measured" by column, and 3 "readings" or none'),
        (_THERE | {"readings": [1.0]}, '"measured" by column, and 3 "readings" or none'),
        (None, "the device says nothing for 0.5 s"),
    ],
)
def test_an_answer_that_is_none_says_what_was_expected(symkin, tmp_path, device, answer, words):
    program, _ = device
    given = ("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path / "session", *FEW)
    answers = () if answer is None else (answer,)
    done = symkin(*given, "--device", program(*answers, patience=60 if answers else 0.5))
    assert done.code == 2
    assert words in done.err
    assert (tmp_path / "session" / "measured.csv").read_text().count("\n") == 1


def test_a_device_that_cannot_be_started_is_named(symkin, tmp_path):
    given = ("measure", "3RRR", "--accuracy", "0.1mm", "--out", tmp_path, *FEW)
    done = symkin(*given, "--device", "no-such-tracker --fast")
    assert done.code == 2
    assert "the device `no-such-tracker --fast` cannot be started" in done.err


def test_ctrl_c_tells_the_device_to_stop_where_it_is(tmp_path, device):
    program, log = device
    session = package.measure("3RRR", 1e-4, tmp_path / "session", candidates=150, seed=1)
    running = Device(program(_THERE), session)
    with contextlib.suppress(KeyboardInterrupt), running:
        running.measure(session.next())
        raise KeyboardInterrupt
    assert json.loads(log.read_text().splitlines()[-1]) == {"id": 1, "abort": True}
