# SPDX-License-Identifier: MIT
"""What symmetry saves: planning for one leg and carrying its poses, against planning for each leg.

Usage: .venv/bin/python benchmarks/symmetry_time.py [repetitions]

The paper's claim (section 7) is that selection costs 1/n with n legs. Both ways choose the same
number of poses from the same candidates in the same run, alternately; printed are the medians of
the times of the selections alone, of whole plans (with spares and carried poses), and their
ratios.
"""

import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

import symkin
from symkin.planning.selection import LegRows

MECHANISMS = ("5bar", "3RRR", "4RRR", "6RRR", "hexapod_jugglebot")
CANDIDATES = 30_000


def seconds(task: Callable[[], object]) -> float:
    begin = time.perf_counter()
    task()
    return time.perf_counter() - begin


def times_of(mechanism: symkin.Mechanism, poses: np.ndarray) -> tuple[float, ...]:
    """Selection for one leg, for each leg; plan with symmetry, without; s."""

    def select(leg: int) -> None:
        symkin.select_poses(LegRows(mechanism, leg, poses, "noise_aware"), 24, threads=1)

    def plan(*, symmetry: bool) -> None:
        symkin.make_plan(mechanism, poses, 24, symmetry=symmetry, threads=1)

    legs = range(len(mechanism.legs))
    return (
        seconds(lambda: select(0)),
        seconds(lambda: [select(leg) for leg in legs]),
        seconds(lambda: plan(symmetry=True)),
        seconds(lambda: plan(symmetry=False)),
    )


def main(repetitions: int) -> None:
    print(f"{CANDIDATES} candidates, 24 poses a leg; milliseconds, median of {repetitions}")
    print(
        f"{'mechanism':20}{'legs':>5}{'selection':>11}{'each leg':>10}{'ratio':>8}"
        f"{'plan':>9}{'each leg':>10}{'ratio':>8}"
    )
    for name in MECHANISMS:
        mechanism = symkin.load_mechanism(name)
        poses = symkin.sample_workspace(mechanism, CANDIDATES).poses
        legs = range(len(mechanism.legs))
        times = [times_of(mechanism, poses) for _ in range(repetitions)]
        one, each, carried, apart = (
            1e3 * statistics.median(column) for column in zip(*times, strict=True)
        )
        print(
            f"{name:20}{len(legs):5}{one:11.1f}{each:10.1f}{each / one:8.2f}"
            f"{carried:9.1f}{apart:10.1f}{apart / carried:8.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 9)
