# SPDX-License-Identifier: MIT
"""Ctrl-C ends long computations."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

START = """
import numpy, symkin
rows = numpy.random.default_rng(1).normal(size=(3000, 24))
paper = symkin.load_mechanism("3RRR")
print("begun", flush=True)
"""
LONG = {
    "proof": "symkin.select_poses(rows, 60, method='exhaustive', time_limit=1e6, threads=1)",
    "exchange": "symkin.select_poses(numpy.tile(rows, (100, 1)), 500, criterion='O3')",
    "active calibration": (
        "symkin.select_poses(numpy.tile(rows, (20, 1)), 1500, method='sun_hollerbach')"
    ),
    "sampling": "symkin.sample_workspace(paper, 10_000_000)",
    "forward kinematics": (
        "p = numpy.tile(symkin.sample_workspace(paper, 1000).poses, (5000, 1));"
        "paper.forward_kinematics(paper.inverse_kinematics(p) + 0.01, p)"
    ),
}
COMMAND = "['plan', '3RRR', '--out', sys.argv[1], '--candidates', '10000000']"


@pytest.mark.parametrize("code", LONG.values(), ids=LONG.keys())
def test_a_long_call_is_interrupted(code: str) -> None:
    _, errors = _interrupted(["-c", START + code])
    assert errors.rstrip().endswith("KeyboardInterrupt")


def test_an_interrupted_command_ends_with_code_130(tmp_path: Path) -> None:
    begun = "from symkin.cli import main; print('begun', flush=True)"
    code = f"{begun}; sys.exit(main({COMMAND}))"
    returncode, errors = _interrupted(["-c", f"import sys; {code}", str(tmp_path / "planned")])
    assert returncode == 130
    assert "Traceback" not in errors


def test_workers_that_have_not_begun_are_not_interrupted_in_their_own_words(tmp_path: Path) -> None:
    # As main, since the workers import it.
    script = tmp_path / "many.py"
    script.write_text(
        "import time\n"
        "from symkin.cluster import dask_client, spread\n"
        "if __name__ == '__main__':\n"
        "    import distributed\n"
        "    print('begun', flush=True)\n"
        "    try:\n"
        "        with dask_client(1) as client:\n"
        "            list(spread(client, time.sleep, ((0.1,) for _ in range(10_000))))\n"
        "    except KeyboardInterrupt:\n"
        "        raise SystemExit(130) from None\n"
    )
    assert _interrupted([str(script)], after=0.2, everybody=True) == (130, "")


def _interrupted(
    arguments: list[str], *, after: float = 1.5, everybody: bool = False
) -> tuple[int, str]:
    """Exit code and errors of a process that gets SIGINT a while after it has begun.

    With those that it has started, as from a terminal, if that is for everybody.
    """
    # Whoever runs the tests in the background may have told all processes to ignore interrupts.
    with subprocess.Popen(
        [sys.executable, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
        start_new_session=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "begun\n"
            time.sleep(after)
            assert process.poll() is None, "it ended before it could be interrupted"
            (os.killpg if everybody else os.kill)(process.pid, signal.SIGINT)
            _, errors = process.communicate(timeout=60)
        finally:
            process.kill()
        return process.returncode, errors
