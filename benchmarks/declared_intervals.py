# SPDX-License-Identifier: MIT
"""How often intervals of robots with declared legs hold, and how their errors scatter.

Usage: python benchmarks/declared_intervals.py ROBOTS [NAME ...]

Of each mechanism of `mechanisms/declared`, or of those that are named, so many robots are made
within the tolerances, measured at 24 poses and identified. Printed are the share of the parameters
that are within their 95% interval, errors over standard deviations, root mean square, and
chi-square of the errors for each parameter.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import symkin
from symkin.planning.simulation import disturb

FOLDER = Path(__file__).parents[1] / "mechanisms" / "declared"
LEFT_OUT = ("3RRR_encoders", "cables8_pulleys")  # of which poses show some numbers hardly at all


def judged(name: str, robots: int) -> str:
    """A line about a mechanism."""
    mechanism = symkin.load_mechanism(FOLDER / f"{name}.toml")
    plan = symkin.plan(mechanism, 24, candidates=300)
    shown = own = mechanism.is_estimated
    for _, *others in mechanism.leg_readings:  # whose geometry is that of the first
        of_sensor = [[role.of_sensor for role in mechanism.parameter_roles(leg)] for leg in others]
        own = own.copy()
        own[others] &= np.reshape(of_sensor, own[others].shape).astype(bool)
    standard, squares = [], []
    for seed in range(robots):
        drawn = disturb(mechanism, seed=seed).parameters
        actual = mechanism.with_parameters(np.where(shown, drawn, mechanism.parameters))
        measured = symkin.simulate(mechanism, plan, seed, actual=actual).measurements
        found = symkin.identify(mechanism, measured, "joint")
        errors = (found.mechanism.parameters - actual.parameters)[own]
        standard.append(errors / np.sqrt(np.diag(found.covariance)))
        squares.append(errors @ np.linalg.solve(found.covariance, errors) / len(errors))
    every = np.array(standard)
    inside, scatter = (np.abs(every) < 1.96).mean(), np.sqrt(np.square(every).mean())
    return f"{name:18} {100 * inside:6.1f}% {scatter:8.3f} {np.mean(squares):8.3f}"


def main() -> None:
    """Print the table."""
    robots, *names = sys.argv[1:]
    print(f"{'mechanism':18} {'inside':>7} {'scatter':>8} {'chi^2':>8}")
    for name in names or sorted(each.stem for each in FOLDER.glob("*.toml")):
        if name not in LEFT_OUT:
            print(judged(name, int(robots)), flush=True)


if __name__ == "__main__":
    main()
