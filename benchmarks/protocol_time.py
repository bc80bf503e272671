# SPDX-License-Identifier: MIT
"""Where the time of the whole protocol goes, on one core, after import.

Usage: OMP_NUM_THREADS=1 taskset -c 0 .venv/bin/python benchmarks/protocol_time.py [repetitions]

Prints the best processor time and wall time of the stages over the repetitions: 30 000 candidates,
24 poses of 3 legs, evaluation over the 30 000 poses before and after.
"""

import sys
import time

import symkin


def main(repetitions: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    stages: dict[str, list[tuple[float, float]]] = {}
    for _ in range(repetitions):
        marks: list[tuple[str, float, float]] = []

        def mark(stage: str) -> None:
            marks.append((stage, time.perf_counter(), time.process_time()))

        symkin.run_protocol(mechanism, progress=mark)
        mark("end")
        for (stage, wall, cpu), (_, next_wall, next_cpu) in zip(marks, marks[1:], strict=False):
            stages.setdefault(stage, []).append((next_wall - wall, next_cpu - cpu))
        stages.setdefault("whole protocol", []).append(
            (marks[-1][1] - marks[0][1], marks[-1][2] - marks[0][2])
        )
    print(f"{'stage':40} {'wall, ms':>9} {'cpu, ms':>9}   (best of {repetitions})")
    for stage, times in stages.items():
        wall, cpu = (1e3 * min(column) for column in zip(*times, strict=True))
        print(f"{stage:40} {wall:9.1f} {cpu:9.1f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
