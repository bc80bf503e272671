# SPDX-License-Identifier: MIT
"""Processor time of commands as a user runs them, and sizes of their pages.

Usage: .venv/bin/python benchmarks/command_times.py [runs]

The hexapod `hexapod_jugglebot`, 108 poses planned for the whole mechanism and simulated, is
identified with its page, with all figures and without; importing symkin is beside importing NumPy,
which it needs. Of each the least processor time (user and system) of 5 runs.
"""

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROBOT = "hexapod_jugglebot"


def processor_time(command: list[str], runs: int) -> float:
    """Least processor time of a command, s."""
    times = []
    for _ in range(runs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(times)


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
        for said, command in {
            "import numpy": [python, "-c", "import numpy"],
            "import symkin": [python, "-c", "import symkin"],
            "symkin --version": [*symkin, "--version"],
            "symkin identify": identify,
            "symkin identify --all-figures": [*identify, "--all-figures"],
            "symkin identify --no-report": [*identify, "--no-report"],
        }.items():
            page.unlink(missing_ok=True)
            time = processor_time(command, runs)
            size = f"  page {page.stat().st_size / 1000:.0f} kB" if page.exists() else ""
            print(f"{said:31}{time:6.2f} s{size}", flush=True)
        drawn = folder / "plan" / "plan.html"
        print(f"{'symkin plan':31}{'':8}  page {drawn.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
