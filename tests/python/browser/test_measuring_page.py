# SPDX-License-Identifier: MIT
"""The page of a guided session on a phone: entered, disconnected, and begun again."""

import signal
import socket
import subprocess
import sys
import time

import pytest

import symkin
from symkin.guided import SimulatedDevice

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

_PATIENCE = 90  # s, for a machine that is busy


class Served:
    """The command that serves a session, to be killed and begun again."""

    def __init__(self, folder):
        self._folder = folder
        with socket.create_server(("127.0.0.1", 0)) as free:
            self._port = free.getsockname()[1]
        self.address = f"http://127.0.0.1:{self._port}/"
        self._process = None

    def begin(self):
        few = ("--candidates", "200", "--seed", "1", "--serve", "--port", str(self._port))
        asked = ("measure", "3RRR", "--accuracy", "0.15mm", "--out", str(self._folder), *few)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "symkin", *asked], stderr=subprocess.PIPE, text=True
        )
        assert self._process.stderr.readline().strip() == self.address

    def end(self, number=signal.SIGKILL):
        self._process.send_signal(number)
        self._process.communicate(timeout=_PATIENCE)
        return self._process.returncode

    def as_uri(self):
        """As the browser opens it."""
        return self.address


@pytest.fixture
def served(tmp_path):
    found = Served(tmp_path / "session")
    found.begin()
    yield found
    found.end()


def until(browser, condition):
    deadline = time.monotonic() + _PATIENCE
    while not browser.run(condition):
        assert time.monotonic() < deadline, condition
        time.sleep(0.05)


def enter(browser, row):
    for column, text in row.items():
        browser.run(f"document.querySelector('[name={column}]').value = '{text}'")
    browser.run("document.querySelector('#row .first').click()")


def rows_of(folder):
    lines = (folder / "measured.csv").read_text().splitlines()[1:]
    return [line.partition(",")[0] for line in lines]


def test_rows_are_entered_at_a_phone_and_one_that_was_sent_while_nobody_answered_is_entered_once(
    browser, served, tmp_path
):
    folder, device = tmp_path / "session", SimulatedDevice(symkin.load("3RRR"), seed=2)
    robot = symkin.load("3RRR")

    def row():
        session = robot.measure(1.5e-4, tmp_path / "copy", candidates=200, seed=1)
        found = device(session.next())
        session.add(found)
        return {
            "x_m": f"{1e3 * found['x_m']:.4f}",
            "y_m": f"{1e3 * found['y_m']:.4f}".replace(".", ","),
            "phi_rad": f"{found['phi_rad'] * 57.29577951308232:.5f}",
        }

    browser.open(served, width=400)
    until(browser, "document.querySelectorAll('#measured input').length === 3")
    assert browser.run("document.documentElement.scrollWidth") <= 400
    assert browser.run("document.querySelector('#drawing svg polyline').getBBox().width") > 10
    for height in browser.run(
        "[...document.querySelectorAll('main .first, #keys button, #measured input')]"
        ".map((each) => each.getBoundingClientRect().height)"
    ):
        assert height >= 44  # a thumb
    enter(browser, row())
    until(browser, "document.querySelector('#heading').textContent === '2'")
    assert "row 1" in browser.run("document.querySelector('#last').textContent")
    assert browser.complaints == []

    served.end()
    until(browser, "!document.querySelector('#lost').hidden")
    enter(browser, row())
    assert rows_of(folder) == ["1"]
    served.begin()
    until(browser, "document.querySelector('#heading').textContent === '3'")
    assert browser.run("document.querySelector('#lost').hidden")
    assert rows_of(folder) == ["1", "2"]

    browser.run("[...document.querySelectorAll('#keys button')][0].click()")
    until(browser, "document.querySelector('#heading').textContent === '4'")
    assert rows_of(folder) == ["1", "2", "3"]
    enter(browser, {"x_m": "12", "y_m": "", "phi_rad": "1"})
    until(browser, "!document.querySelector('#error').hidden")
    said = browser.run("document.querySelector('#error').textContent")
    assert said.startswith("y[mm] is empty; expected a number")
    assert served.end(signal.SIGINT) == 1  # not yet enough


def test_what_was_typed_is_there_when_the_page_is_opened_again(browser, served):
    browser.open(served, width=400)
    until(browser, "document.querySelectorAll('#measured input').length === 3")
    browser.run(
        "(() => { const x = document.querySelector('[name=x_m]'); x.value = '12.5';"
        " x.dispatchEvent(new Event('input')); x.nextElementSibling.click(); })()"
    )
    browser.open(served, width=400)
    until(browser, "document.querySelector('[name=x_m]')?.value === '-12.5'")
