# SPDX-License-Identifier: MIT
"""Do robots that calibrate themselves scatter as they say? Readings alone, robots as made.

    python benchmarks/self_calibration.py [robots] [poses]

Robots are made within the tolerances, which are priors too. Of every unknown the error over its
deviation: the root of its mean square, and how often it is within the interval of 95%; chi-square
of all of them over its degrees of freedom.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import symkin
from symkin.planning.simulation import disturb

FILE = Path(__file__).parents[1] / "mechanisms" / "declared" / "3RRR_encoders.toml"
WITHIN = 1.959963984540054


def main(robots: int, poses: int) -> None:
    """Print a line."""
    mechanism = symkin.load_mechanism(FILE)
    plan = symkin.plan(mechanism, poses, observe="readings")
    standard, chi_square, converged = [], [], 0
    for seed in range(robots):
        actual = disturb(mechanism, seed)
        taken = symkin.simulate(mechanism, plan, seed, actual=actual, observe="readings")
        found = symkin.identify(mechanism, taken.measurements)
        converged += found.converged
        columns = {each.name: each for each in found.unknowns if each.column >= 0}
        free = sorted(columns.values(), key=lambda each: each.column)
        errors = np.array([each.value - _made(actual, each.name) for each in free])
        deviations = np.array([each.deviation for each in free])
        standard.append(errors / deviations)
        scaled = found.covariance / np.outer(deviations, deviations)
        chi_square.append(standard[-1] @ np.linalg.solve(scaled, standard[-1]) / len(free))
    all_of_them = np.concatenate(standard)
    print(
        f"{robots} robots, {poses} poses: {converged} converged, error over deviation "
        f"{np.sqrt(np.mean(all_of_them**2)):.3f}, within 95%: "
        f"{100 * np.mean(np.abs(all_of_them) < WITHIN):.1f}%, chi-square "
        f"{np.mean(chi_square):.3f}"
    )


def _made(actual: symkin.Mechanism, name: str) -> float:
    block, _, own = name.partition(".")
    return float(actual.legs[int(block[3:]) - 1].parameters[own])


if __name__ == "__main__":
    numbers = [int(each) for each in sys.argv[1:]]
    main(*(numbers + [100, 40][len(numbers) :]))
