# SPDX-License-Identifier: MIT
"""How often sound robots are doubted, test by test.

    python benchmarks/false_alarms.py [ROBOTS] [MECHANISM ...]

Simulates robots with errors and noise as declared, identifies them with `implicit` and `joint` on
all poses, and prints for each kind of test which share of robots it alarms for. All together must
stay below 1%. Of mechanisms in space 300 robots will do.
"""

import collections
import sys

import symkin


def main() -> None:
    """Print a line for each mechanism and estimator."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    for name in sys.argv[2:] or ["3RRR", "5bar", "3PRR"]:
        mechanism = symkin.load_mechanism(name)
        plan = symkin.make_plan(mechanism, symkin.sample_workspace(mechanism, 6000, 1), seed=1)
        alarms: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
        for seed in range(robots):
            measurements = symkin.simulate(mechanism, plan, seed).measurements
            for estimator in ("implicit", "joint"):
                found = symkin.identify(mechanism, measurements, estimator)
                kinds = {test.suspect for test in found.tests if test.alarms}
                kinds |= {"outliers"} if found.outliers else set()
                kinds |= {"chi-square"} if any(fit.unexplained for fit in found.goodness) else set()
                kinds |= {"any"} if found.doubts else set()
                alarms[estimator].update(kinds)
        for estimator, counts in alarms.items():
            shares = ", ".join(
                f"{kind} {100 * count / robots:.2f}%" for kind, count in sorted(counts.items())
            )
            print(f"{name}, {estimator}, {robots} robots: {shares or 'none'}", flush=True)


if __name__ == "__main__":
    main()
