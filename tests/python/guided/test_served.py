# SPDX-License-Identifier: MIT
"""The page of a session: what it shows and takes is what the terminal does, and once."""

import asyncio
import csv

import pytest

import symkin
from symkin.cli import main
from symkin.errors import SymkinError
from symkin.guided import SimulatedDevice
from symkin.show import served
from symkin.show.entering import entries_of, obeyed
from symkin.show.guided import ask_text
from symkin.show.units import in_units

httpx = pytest.importorskip("httpx")
pytest.importorskip("starlette")

FEW = {"candidates": 200, "seed": 1}
ACCURACY = 1.5e-4


@pytest.fixture(scope="module")
def robot():
    return symkin.load("3RRR")


class Client:
    """Asks an application, without a network."""

    def __init__(self, app):
        self._app = app

    def get(self, path, **more):
        return asyncio.run(self._asked("GET", path, **more))

    def post(self, path, **more):
        return asyncio.run(self._asked("POST", path, **more))

    async def _asked(self, method, path, **more):
        transport = httpx.ASGITransport(app=self._app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost:8000") as it:
            return await it.request(method, path, **more)


def client_of(session, token=""):
    return Client(served.session_app(session, token=token))


def typed(session, found, factor=1.0):
    """A row as a person types it, by column."""
    return {
        each.column: f"{factor * found[each.column] / each.factor:.6f}"
        for each in entries_of(session.columns)
        if not each.is_reading
    }


def told(client, **what):
    tries = client.get("/state").json()["tries"]
    return client.post("/tell", json={"tries": tries, **what})


def rows_of(session):
    with (session.folder / "measured.csv").open(newline="") as file:
        return [
            {name: cell for name, cell in row.items() if not name.startswith("time")}
            for row in csv.DictReader(file)
        ]


def test_the_page_and_the_terminal_make_the_same_table_and_say_the_same(robot, tmp_path):
    page = robot.measure(ACCURACY, tmp_path / "page", **FEW)
    terminal = robot.measure(ACCURACY, tmp_path / "terminal", **FEW)
    client, device = client_of(page), SimulatedDevice(robot, seed=2)
    for number in range(6):
        state, ask = client.get("/state").json(), terminal.next()
        for name, value, unit in state["ask"]["pose"]:
            assert f"{name} {value}" in ask_text(terminal, ask)
            assert unit in ("mm", "\N{DEGREE SIGN}")
        if number == 3:
            assert told(client, key="s").status_code == 200
            obeyed(terminal, "s")
            continue
        row = typed(page, device(ask))
        answer = told(client, row=row)
        assert answer.status_code == 200
        said = obeyed(terminal, " ".join(row.values()))
        last = answer.json()["last"]
        assert last.split() == (said or f"row {ask.row} is saved").split()
    assert rows_of(page) == rows_of(terminal)
    assert page.progress == terminal.progress


def test_what_is_sent_again_since_no_answer_came_is_entered_once(robot, tmp_path):
    session = robot.measure(ACCURACY, tmp_path / "session", **FEW)
    client = client_of(session)
    row = typed(session, SimulatedDevice(robot, seed=2)(session.next()))
    sent = {"tries": 0, "row": row}
    first, again = (client.post("/tell", json=sent) for _ in range(2))
    assert (first.status_code, again.status_code) == (200, 200)
    assert first.json() == again.json()
    other = client.post("/tell", json={"tries": 0, "key": "s"})
    assert other.status_code == 409
    assert "nothing was entered now" in other.json()["error"]
    assert other.json()["ask"]["row"] == 2
    # Of a page that was open while the program was killed and begun again.
    client = client_of(robot.measure(ACCURACY, tmp_path / "session", **FEW))
    assert client.post("/tell", json=sent).status_code == 409
    assert len(rows_of(session)) == 1


def test_a_session_that_was_killed_goes_on_with_the_same_pose(robot, tmp_path):
    session = robot.measure(ACCURACY, tmp_path, **FEW)
    client, device = client_of(session), SimulatedDevice(robot, seed=2)
    for _ in range(3):
        told(client, row=typed(session, device(session.next())))
    again = client_of(robot.measure(ACCURACY, tmp_path, **FEW))
    shown, before = again.get("/state").json(), client.get("/state").json()
    assert shown["ask"] == before["ask"]
    assert shown["progress"] == before["progress"]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"y_m": ""}, "y[mm] is empty; expected a number, or - if it was not seen"),
        ({"y_m": "12,3.4"}, '"12,3.4" is no number (y mm)'),
        ({"psi_2_rad": "x"}, '"x" is no number (psi_2 \N{DEGREE SIGN})'),
    ],
)
def test_a_field_that_is_empty_or_no_number_is_named_and_nothing_is_entered(robot, fields, words):
    session = robot.measure(ACCURACY, **FEW)
    row = typed(session, SimulatedDevice(robot, seed=2)(session.next())) | fields
    answer = told(client_of(session), row=row)
    assert answer.status_code == 422
    assert words in answer.json()["error"]
    assert session.tries == 0


def test_a_coordinate_that_was_not_seen_is_a_dash(robot, tmp_path):
    session = robot.measure(ACCURACY, tmp_path, **FEW)
    row = typed(session, SimulatedDevice(robot, seed=2)(session.next())) | {"phi_rad": "-"}
    assert told(client_of(session), row=row).status_code == 200
    assert rows_of(session)[0]["phi_rad"] == ""


def test_a_row_in_another_unit_is_put_right_by_a_button(robot, tmp_path):
    session = robot.measure(ACCURACY / 2, tmp_path, **FEW)
    client, device = client_of(session), SimulatedDevice(robot, seed=2)
    for _ in range(8):
        told(client, row=typed(session, device(session.next())))
    found = typed(session, device(session.next()))
    state = told(client, row=found | {"x_m": str(1e3 * float(found["x_m"]))}).json()
    assert "Row 9 does not fit" in state["last"]
    assert state["decisions"]["t"] == "take it so"
    state = told(client, key="t").json()
    assert state["decisions"] == {}
    assert [row["status"] for row in rows_of(session)[-2:]] == ["dropped", "ok"]


def test_rows_that_other_programs_append_are_seen(robot, tmp_path):
    session = robot.measure(ACCURACY, tmp_path, **FEW)
    client = client_of(session)
    assert client.get("/state").json()["ask"]["row"] == 1
    ask, columns = session.next(), session.columns
    found = SimulatedDevice(robot, seed=2)(ask)
    header = (tmp_path / "measured.csv").read_text().splitlines()[0].split(",")
    cells = [repr(float(found[name])) if name in columns else "" for name in header]
    with (tmp_path / "measured.csv").open("a") as file:
        file.write(",".join(cells) + "\n")
    assert client.get("/state").json()["ask"]["row"] == 2


def test_only_who_has_the_token_is_answered(robot):
    client = client_of(robot.measure(ACCURACY, **FEW), token="secret")
    assert client.get("/state").status_code == 403
    assert client.get("/state", headers={"X-Token": "secre"}).status_code == 403
    assert client.post("/tell", json={"tries": 0, "key": "s"}).status_code == 403
    assert client.get("/?token=secret").status_code == 200
    assert client.get("/state", headers={"X-Token": "secret"}).json()["tries"] == 0


def test_other_sites_in_the_same_browser_are_not_answered(robot):
    session = robot.measure(ACCURACY, **FEW)
    client = client_of(session)
    form = {"Content-Type": "text/plain"}
    sent = client.post("/tell", content=b'{"tries": 0, "key": "s"}', headers=form)
    assert sent.status_code == 400
    assert client.get("/state", headers={"Host": "elsewhere.example"}).status_code == 400
    for wrong in (b"[]", b"{", b'{"key":"' + b"s" * 200_000 + b'"}'):
        headers = {"Content-Type": "application/json"}
        assert client.post("/tell", content=wrong, headers=headers).status_code == 400
    assert told(client, key="q").status_code == 422
    assert session.tries == 0


def test_the_page_is_told_in_the_units_that_it_was_begun_in(robot):
    with in_units("m,rad"):
        client = client_of(robot.measure(ACCURACY, **FEW))
    assert [unit for *_, unit in client.get("/state").json()["ask"]["pose"]] == ["m", "m", "rad"]


def test_a_session_that_is_enough_says_so_and_asks_no_more(robot, tmp_path):
    session = robot.measure(1e-3, tmp_path, **FEW)
    client, device = client_of(session), SimulatedDevice(robot, seed=2)
    while (ask := session.next()) is not None:
        session.add(device(ask))
    state = client.get("/state").json()
    assert state["ask"] is None
    assert state["end"].startswith("Enough: ")
    assert "symkin identify" in state["end"]


def test_other_hosts_need_a_token(robot):
    session = robot.measure(ACCURACY, **FEW)
    with pytest.raises(SymkinError, match="expected a token"):
        served.serve(session, host="0.0.0.0")
    with pytest.raises(SymkinError, match="cannot be listened at"):
        served.serve(session, host="192.0.2.1", token="secret")


def test_without_the_extra_it_is_said_how_to_install_it(robot, monkeypatch):
    monkeypatch.setattr(served, "find_spec", lambda _: None)
    session = robot.measure(ACCURACY, **FEW)
    with pytest.raises(SymkinError, match=r'pip install "symkin\[serve\]"'):
        served.serve(session)


@pytest.mark.parametrize("given", [["--port", "1"], ["--serve", "--device", "true"]])
def test_options_that_would_be_passed_over_are_refused(given, tmp_path, capsys):
    out = str(tmp_path / "out")
    assert main(["measure", "3RRR", "--accuracy", "1mm", "--out", out, *given]) == 2
    assert "--serve" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
