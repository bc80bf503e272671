# SPDX-License-Identifier: MIT
"""A headless Chromium, driven over a pipe by its own protocol, and the pages that it is shown."""

import fcntl
import itertools
import json
import os
import select
import shutil
import subprocess
import time
from contextlib import suppress

import pytest

import symkin
from symkin.model.settings import ProtocolSettings

_PATIENCE = 60  # s, for a machine that is busy
_NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


class Browser:
    """One page at a time; what it complains about and what it loads is kept."""

    def __init__(self, program, profile):
        (inwards, self._to), (self._from, outwards) = os.pipe(), os.pipe()
        given = [fcntl.fcntl(each, fcntl.F_DUPFD, 10) for each in (inwards, outwards)]
        self._process = subprocess.Popen(
            [
                *("bash", "-c", 'exec "$@" 3<&{} 4>&{}'.format(*given), "bash", program),
                *("--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"),
                *("--no-first-run", "--hide-scrollbars", f"--user-data-dir={profile}"),
                "about:blank",
            ],
            pass_fds=given,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for each in (inwards, outwards, *given):
            os.close(each)
        self._numbers = itertools.count(1)
        self._received = b""
        self._session = None
        self.complaints, self.requests = [], []
        page = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=page, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **parameters):
        """Call a method of the protocol; returns what it returns."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer
                return answer["result"]

    def _next(self):
        """The next message, of which events are noted."""
        deadline = time.monotonic() + _PATIENCE
        while b"\0" not in self._received:
            ready, _, _ = select.select([self._from], [], [], deadline - time.monotonic())
            read = os.read(self._from, 1 << 20) if ready else b""
            assert read, "the browser does not answer"
            self._received += read
        message, self._received = self._received.split(b"\0", 1)
        message = json.loads(message)
        told = message.get("params", {})
        match message.get("method"):
            case "Runtime.exceptionThrown":
                self.complaints.append(told["exceptionDetails"])
            case "Runtime.consoleAPICalled" if told["type"] in ("error", "warning"):
                self.complaints.append(told["args"])
            case "Log.entryAdded" if told["entry"]["level"] in ("error", "warning"):
                self.complaints.append(told["entry"])
            case "Network.requestWillBeSent":
                self.requests.append(told["request"]["url"])
        return message

    def open(self, path, width=1200, scheme="light", height=900):
        """Show a file in a window of this width, in light or dark."""
        self._go("about:blank")  # or the page before, which may still ask its server, complains
        self.complaints.clear()
        self.requests.clear()
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        features = [{"name": "prefers-color-scheme", "value": scheme}]
        self.call("Emulation.setEmulatedMedia", media="screen", features=features)
        self._go(path.as_uri())

    def _go(self, address):
        self.call("Page.navigate", url=address)
        deadline = time.monotonic() + _PATIENCE
        while self.run("document.readyState + location.href") != "complete" + address:
            assert time.monotonic() < deadline, "the page is not complete"
            time.sleep(0.02)

    def run(self, script):
        """The value of an expression in the page."""
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def point(self, x, y, kind="mouseMoved", **more):
        """Move the pointer, or press and release it, there in the window."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def picture(self, path):
        """Write the whole page as a PNG."""
        import base64

        taken = self.call("Page.captureScreenshot", captureBeyondViewport=True, format="png")
        path.write_bytes(base64.b64decode(taken["data"]))

    def close(self):
        """End it."""
        self._session = None
        with suppress(OSError, AssertionError):
            self.call("Browser.close")
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._to)
        os.close(self._from)


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    program = next(filter(None, map(shutil.which, _NAMES)), None)
    if program is None:
        pytest.skip(f"no browser: none of {', '.join(_NAMES)} is installed")
    browser = Browser(program, tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def mechanism():
    """The paper's, with a protocol that is soon done."""
    settings = ProtocolSettings(pose_count=16, candidates=400, seed=3)
    return symkin.load_mechanism("3RRR").replace(protocol=settings)
