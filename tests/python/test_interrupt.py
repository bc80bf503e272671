# SPDX-License-Identifier: MIT
"""Ctrl-C ends long computations."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

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
    "active calibration": "symkin.select_poses(rows, 1500, method='sun_hollerbach')",
    "sampling": "symkin.sample_workspace(paper, 20_000_000)",
    "forward kinematics": (
        "p = numpy.tile(symkin.sample_workspace(paper, 1000).poses, (5000, 1));"
        "paper.forward_kinematics(paper.inverse_kinematics(p) + 0.01, p)"
    ),
}


@pytest.mark.parametrize("code", LONG.values(), ids=LONG.keys())
def test_a_long_call_is_interrupted(code: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", START + code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    _interrupt(process)
    assert process.stderr is not None
    assert process.stderr.read().rstrip().endswith("KeyboardInterrupt")


def test_an_interrupted_command_ends_with_code_130() -> None:
    arguments = ["workspace", "3RRR", "--candidates", "100000000"]
    process = subprocess.Popen(
        [sys.executable, "-m", "symkin", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    time.sleep(2)
    _interrupt(process)
    assert process.returncode == 130
    assert process.stderr is not None
    assert "Traceback" not in process.stderr.read()


def _interrupt(process: subprocess.Popen[str]) -> None:
    time.sleep(0.7)
    assert process.poll() is None, "it ended before it could be interrupted"
    process.send_signal(signal.SIGINT)
    try:
        process.wait(timeout=10)
    finally:
        process.kill()
