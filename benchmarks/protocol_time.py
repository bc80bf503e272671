# SPDX-License-Identifier: MIT
"""Where the time of the whole protocol goes, on one core, after import.

Usage: OMP_NUM_THREADS=1 taskset -c 0 .venv/bin/python benchmarks/protocol_time.py [repetitions]

Prints the best processor time and wall time of the stages over the repetitions: 30 000 candidates,
24 poses of 3 legs, evaluation over the 30 000 poses before and after.
"""

import sys
import time
from itertools import pairwise

import symkin


class Marks:
    """When each stage began: wall time and processor time."""

    def __init__(self) -> None:
        self.all: list[tuple[str, float, float]] = []

    def add(self, stage: str) -> None:
        self.all.append((stage, time.perf_counter(), time.process_time()))


def main(repetitions: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    stages: dict[str, list[tuple[float, float]]] = {}
    for _ in range(repetitions):
        marks = Marks()
        symkin.run_protocol(mechanism, progress=marks.add)
        marks.add("end")
        for (stage, wall, cpu), (_, next_wall, next_cpu) in pairwise(marks.all):
            stages.setdefault(stage, []).append((next_wall - wall, next_cpu - cpu))
        stages.setdefault("whole protocol", []).append(
            (marks.all[-1][1] - marks.all[0][1], marks.all[-1][2] - marks.all[0][2])
        )
    print(f"{'stage':40} {'wall, ms':>9} {'cpu, ms':>9}   (best of {repetitions})")
    for stage, times in stages.items():
        wall, cpu = (1e3 * min(column) for column in zip(*times, strict=True))
        print(f"{stage:40} {wall:9.1f} {cpu:9.1f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
