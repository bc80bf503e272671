# SPDX-License-Identifier: MIT
"""Do fits end that start at their solution: robots as drawn, the place of the device unknown?

Usage: .venv/bin/python benchmarks/as_drawn.py [robots [mechanism ...]]

As `symkin identify --free base --frames base` on simulated measurements of the drawing itself, from
one plan with noise from one seed a robot: what is unknown starts where it ends. A row says how many
fits converged, and why the others did not.
"""

import sys
import time
from collections import Counter

import symkin

MECHANISMS = ("3RRR", "5bar", "hexapod_jugglebot", "linear_delta", "rotary_delta")


def main(count: int, names: tuple[str, ...]) -> None:
    """Print a row for each mechanism."""
    for name in names:
        mechanism = symkin.load_mechanism(name)
        candidates = symkin.sample_workspace(mechanism, 1000, seed=1)
        plan = symkin.make_plan(mechanism, candidates, len(mechanism.parameter_names))
        failures: Counter[str] = Counter()
        start = time.process_time()
        for seed in range(count):
            data = symkin.simulate(mechanism, plan, seed, actual=mechanism).measurements
            try:
                found = symkin.identify(mechanism, data, free=["base"], frames=["base"])
            except symkin.Error as error:
                failures[str(error)] += 1
                continue
            if not found.converged:
                failures["; ".join(str(doubt) for doubt in found.doubts)] += 1
        spent = 1e3 * (time.process_time() - start) / count
        print(
            f"{name:18} {count - failures.total()} of {count} converge, {spent:.1f} ms a robot",
            *(f"    {times} times: {why}" for why, times in failures.items()),
            sep="\n",
            flush=True,
        )


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 400,
        tuple(sys.argv[2:]) or MECHANISMS,
    )
