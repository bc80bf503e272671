# SPDX-License-Identifier: MIT
"""Processor time of commands as a user runs them, and sizes of their pages.

Usage: .venv/bin/python benchmarks/command_times.py [runs]

The hexapod `hexapod_jugglebot`, 108 poses planned for the whole mechanism and simulated, is
identified with its page, with all figures and without; importing symkin is beside importing NumPy,
which it needs. Of each the least processor time (user and system) of 5 runs, one after another, and
how many times that of importing NumPy it is, which says more where others are at work.
"""

import math
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROBOT = "hexapod_jugglebot"


def processor_time(command: list[str]) -> float:
    """Processor time of a command, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print a line for each command."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    python = sys.executable
    symkin = [python, "-m", "symkin"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plan = [*symkin, "plan", ROBOT, "--pose-count", "108", "--design", "mechanism"]
        simulate = [*symkin, "simulate", ROBOT, "--plan", str(folder / "plan" / "plan.csv")]
        for making in ([*plan, "--out", str(folder / "plan")], [*simulate, "--out", name]):
            subprocess.run(making, check=True, stdout=subprocess.DEVNULL)
        page = folder / "identified" / "report.html"
        identify = [*symkin, "identify", ROBOT, str(folder / "measurements.csv"), "--overwrite"]
        identify += ["--out", str(page.parent)]
        commands = {
            "import numpy": [python, "-c", "import numpy"],
            "import symkin": [python, "-c", "import symkin"],
            "symkin --version": [*symkin, "--version"],
            "symkin identify": identify,
            "symkin identify --all-figures": [*identify, "--all-figures"],
            "symkin identify --no-report": [*identify, "--no-report"],
        }
        times, sizes = dict.fromkeys(commands, math.inf), dict.fromkeys(commands, "")
        for _ in range(runs):
            for said, command in commands.items():
                page.unlink(missing_ok=True)
                times[said] = min(times[said], processor_time(command))
                if page.exists():
                    sizes[said] = f"  page {page.stat().st_size / 1000:.0f} kB"
        for said, time in times.items():
            ratio = time / times["import numpy"]
            print(f"{said:31}{time:6.2f} s {ratio:5.1f} x NumPy{sizes[said]}")
        drawn = folder / "plan" / "plan.html"
        print(f"{'symkin plan':31}{'':22}  page {drawn.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
