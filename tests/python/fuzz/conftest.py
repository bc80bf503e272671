# SPDX-License-Identifier: MIT
"""Running many hostile command lines in this process: a sixth of them, always the same.

With SYMKIN_FUZZ_SECONDS all of them, as many as fit into so long.
"""

from __future__ import annotations

import math
import os
import random
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Protocol

import pytest

from symkin.cli import main

_SECONDS = float(os.environ.get("SYMKIN_FUZZ_SECONDS", "0"))
_KINDS = 4
_SHARE = 6
_CODES = {0, 1, 2, 130, 141}
_LONGEST = 500


class Case(Protocol):
    """A command line, and the files that it finds in its folder."""

    arguments: tuple[str, ...]
    files: Mapping[str, bytes]


def _fault_of(case: Case) -> str:
    """Run a case and say what is wrong with how it ended, or nothing."""
    for name, content in case.files.items():
        Path(name).write_bytes(content)
    out, err = StringIO(), StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(err):
            code = main(case.arguments)
    except BaseException as error:  # the fault that is looked for
        return f"{type(error).__name__}: {error}"
    message = err.getvalue()
    if code not in _CODES:
        return f"exit code {code}"
    if "Traceback" in message or "unforeseen" in message:
        return message
    told = message.partition(": measurements = {")[0]  # what is to be copied is told whole
    if len(told) > (2 if "Likely cause: " in message else 1) * _LONGEST + 1:
        return f"a message of {len(told)} characters"
    # Beside a file on the standard output, notes are on the other.
    if code == 0 and case.arguments[0] == "export":
        message = ""
    start = {0: "", 1: ("Not converged: ", "out of reach: "), 2: "Error: "}.get(code, "")
    if not message.startswith(start) or message.count("\n") != bool(start):
        return f"exit code {code} with {message!r}"
    if not message.rstrip("\n").isprintable():
        return f"a message with control characters: {message!r}"
    strange = [char for char in out.getvalue() if not char.isprintable() and char != "\n"]
    return f"printed {strange[0]!r}" if strange else ""


@pytest.fixture
def survive(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    record_property: Callable[[str, object], None],
) -> Callable[[Sequence[Case]], None]:
    """Runs cases in an order that is always the same."""

    def survive(cases: Sequence[Case]) -> None:
        monkeypatch.chdir(tmp_path)
        order = list(cases)
        random.Random(1).shuffle(order)
        if not _SECONDS:
            order = order[: len(order) // _SHARE]
        end = time.monotonic() + (_SECONDS / _KINDS or math.inf)
        faults, count = [], 0
        for case in order:
            if time.monotonic() > end:
                break
            count += 1
            if fault := _fault_of(case):
                faults.append(f"{' '.join(case.arguments)!r}: {fault}\n    {_changed(case)}")
        record_property("cases", count)
        # What libraries write reaches the file descriptor alone.
        assert capfd.readouterr().err == ""
        print(f"{count} of {len(order)} cases")
        assert not faults, f"{len(faults)} of {count} cases:\n" + "\n".join(faults[:20])

    return survive


def _changed(case: Case) -> str:
    return "; ".join(f"{name}: {content[:4000]!r}" for name, content in case.files.items())
