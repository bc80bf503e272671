# SPDX-License-Identifier: MIT
"""A measuring device as a program that answers a line of JSON with a line of JSON.

Lengths are in m, angles in rad, and null is what was not seen. Its standard error is its log, and
it ends when its standard input does.
"""

from __future__ import annotations

import contextlib
import json
import math
import queue
import subprocess
import sys
import threading
from collections.abc import Mapping
from typing import Any, Self, TypeGuard, get_args

from symkin.data.columns import pose_column_names
from symkin.errors import SymkinError
from symkin.guided.session import Ask, Failure, Session
from symkin.model.file_frames import as_drawn
from symkin.shell import words_of
from symkin.values import record

VERSION = 1
_PATIENCE = 60.0  # s, unless the device says another
_PARTING = 5.0  # s, until a program that was told to end is ended
_FAILURES = get_args(Failure)


class DeviceError(SymkinError):
    """What a device said, or did not say, so that nothing can be measured with it."""


@record
class Measured:
    """What a device measured: values by column, m and rad; and who says so."""

    row: Mapping[str, float]
    remark: str = ""


@record
class Failed:
    """Why a pose could not be measured."""

    why: Failure
    remark: str = ""


class Device:
    """A running program, asked for one pose at a time.

    Parameters
    ----------
    command : str
        As on a command line.
    session : Session
        Whose robot and columns it is told of.

    Raises
    ------
    DeviceError
        If it cannot be started, or answers with something else than the protocol has.
    """

    def __init__(self, command: str, session: Session) -> None:
        self.command, self._session = command, session
        try:
            self._program = subprocess.Popen(
                _words(command),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                errors="replace",
            )
        except (OSError, ValueError) as error:
            raise DeviceError(f"the device `{command}` cannot be started: {error}") from error
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._patience, self._id = _PATIENCE, 0
        try:
            hello = self._greeted()
        except DeviceError:
            self.close()
            raise
        self.name = " ".join(str(hello[key]) for key in ("device", "serial") if hello.get(key))
        self._patience = min(float(hello.get("timeout_s", _PATIENCE)), threading.TIMEOUT_MAX)

    def _greeted(self) -> dict[str, Any]:
        robot = self._session.robot
        hello = {"robot": robot.name, "legs": len(robot.legs), "want": self._session.columns}
        self._send({"symkin": VERSION, "hello": hello})
        answer = self._answer()
        if answer.get("symkin") != VERSION:
            raise self._wrong(answer, f'"symkin": {VERSION} in its first line')
        if not (_is_number(patience := answer.get("timeout_s", _PATIENCE)) and patience > 0):
            raise self._wrong(answer, '"timeout_s" above zero')
        return answer

    def measure(self, ask: Ask) -> Measured | Failed:
        """Measure a pose; what was lost is tried a second time if the device thinks it helps.

        Raises
        ------
        DeviceError
            For a fault, silence, or an answer that is none; nothing was measured then.
        """
        again = True
        while True:
            answer = self._asked(ask)
            error = answer.get("error")
            if error is None:
                return self._measured(answer)
            remark = str(answer.get("message", ""))
            if error not in (*_FAILURES, "busy"):
                raise DeviceError(f'the device reports a fault: "{error}" {remark}'.rstrip())
            if answer.get("retry") and again and error in ("lost", "busy"):
                again = False
                continue
            return Failed(error if error in _FAILURES else "unreachable", remark)

    def close(self) -> None:
        """End it."""
        with contextlib.suppress(OSError):
            assert self._program.stdin is not None
            self._program.stdin.close()
        try:
            self._program.wait(_PARTING)
        except subprocess.TimeoutExpired:
            self._program.kill()
            self._program.wait()
        self._listener.join(_PARTING)  # a program of its own may still hold its output

    def abort(self) -> None:
        """Tell it to stop where it is, and end it."""
        self._send({"id": self._id, "abort": True})
        self.close()

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """End, or abort what it was doing."""
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            self.abort()
        else:
            self.close()

    def _asked(self, ask: Ask) -> dict[str, Any]:
        self._id += 1
        robot = self._session.robot
        names = pose_column_names(robot.pose_space)
        pose = as_drawn(robot, ask.pose[None])[0].tolist()
        request = {
            "pose": dict(zip(names, pose, strict=True)),
            "readings": ask.readings.tolist(),
            "repeat_of": ask.repeat_of,
            "partner": ask.partner,
        }
        self._send({"id": self._id, "measure": request})
        while True:
            answer = self._answer()
            if answer.get("id") not in range(1, self._id + 1):
                raise self._wrong(answer, f'"id": {self._id}')
            late = answer["id"] < self._id  # of what was given up before
            if not late and "status" not in answer:
                return answer

    def _measured(self, answer: Mapping[str, Any]) -> Measured:
        measured, readings = answer.get("measured"), answer.get("readings") or []
        legs = len(self._session.robot.legs)
        several = isinstance(readings, list) and len(readings) in (0, legs)
        if not (isinstance(measured, dict) and several):
            raise self._wrong(answer, f'"measured" by column, and {legs} "readings" or none')
        unit = self._session.robot.reading_unit
        row = {f"psi_{leg}_{unit}": value for leg, value in enumerate(readings, 1)} | measured
        if not all(each is None or _is_number(each) for each in row.values()):
            raise self._wrong(answer, "finite numbers or null")
        values = {name: math.nan if each is None else float(each) for name, each in row.items()}
        spread = answer.get("spread_m")
        return Measured(values, f"spread {spread:g} m" if _is_number(spread) else "")

    def _send(self, message: Mapping[str, Any]) -> None:
        # What a program that has ended said last is what is wrong with it: `_answer` tells.
        with contextlib.suppress(OSError):
            assert self._program.stdin is not None
            self._program.stdin.write(json.dumps(message) + "\n")
            self._program.stdin.flush()

    def _listen(self) -> None:
        assert self._program.stdout is not None
        with self._program.stdout as answers:
            for line in answers:
                self._lines.put(line)
        self._lines.put(None)

    def _answer(self) -> dict[str, Any]:
        try:
            line = self._lines.get(timeout=self._patience)
        except queue.Empty:
            raise DeviceError(
                f"the device says nothing for {self._patience:g} s; expected an answer, or "
                '{"id": ..., "status": "moving"} while it moves'
            ) from None
        if line is None:
            self._lines.put(None)
            raise DeviceError(f"the device `{self.command}` has ended")
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict):
            raise DeviceError(f"the device says {line.strip()[:100]!r}; expected a line of JSON")
        return answer

    def _wrong(self, answer: Mapping[str, Any], expected: str) -> DeviceError:
        said = json.dumps(answer)
        return DeviceError(f"the device says {said[:150]}; expected {expected}")


def _is_number(value: object) -> TypeGuard[float]:
    """Whether it is one of JSON's that is finite as a float."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # of whole numbers, which may have any length
        return False


def _words(command: str) -> list[str]:
    """The words of a command line; symkin's own commands are those of this installation."""
    words = words_of(command)
    own = [sys.executable, "-m", "symkin"]
    return own + words[1:] if words[:1] == ["symkin"] else words
