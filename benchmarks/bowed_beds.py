# SPDX-License-Identifier: MIT
"""What becomes of delta printers whose probed bed is not flat, with a bow unknown and without.

Usage: .venv/bin/python benchmarks/bowed_beds.py [printers]

Each printer differs from the linear delta, built with care, by its tolerances and touches its bed
at 36 planned points. Prints for each bow the position error over the workspace and how uneven what
is printed is about the best plane, root mean square over the printers; the share of printers whose
error is within their bound, and of those that nothing is said against.
"""

import dataclasses
import sys

import numpy as np

import symkin
from symkin.analysis.observed import Observed

PLANE = (3e-4, 2e-3, -1e-3)
GRID = np.linspace(-0.06, 0.06, 9)


def unevenness(believed: symkin.Mechanism, actual: symkin.Mechanism) -> float:
    """How far what is printed flat is off a plane, root mean square."""
    x, y = (each.ravel() for each in np.meshgrid(GRID, GRID))
    flat = np.column_stack([np.ones_like(x), x, y])
    readings = believed.inverse_kinematics(np.column_stack([x, y, 0 * x]))
    heights = actual.forward_kinematics(readings)[0][:, 2]
    return float(np.std(heights - flat @ np.linalg.lstsq(flat, heights, rcond=None)[0]))


def main() -> None:
    """Print a line a bow and way of identifying."""
    printers = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    drawn = symkin.load("linear_delta")
    built = dataclasses.replace(drawn.tolerances, angle=1e-3, gain=2e-4, length=5e-4)
    drawn = drawn.replace(tolerances=built, noise=dataclasses.replace(drawn.noise, position=1e-5))
    sample = symkin.sample_workspace(drawn, 3000, seed=1)
    plan = symkin.make_plan(drawn, sample, 36, observe="height")
    rim = float(np.hypot(*plan.poses[:, :2].T).max())
    print("bow, mm            error  uneven, mm   within   trusted")
    for bow in (0.0, 2e-4, 4e-4):
        seen = Observed(("height",), plane=(*PLANE, bow, rim))
        for asked in (None, "0.3 mm"):
            figures = []
            for seed in range(1, printers + 1):
                sim = symkin.simulate(drawn, plan, seed, observe=seen)
                found = symkin.identify(drawn, sim.measurements, bow=asked)
                believed = found.mechanism.replace(frames=None)
                error = symkin.evaluate(
                    believed, actual=sim.actual, poses=sample.poses[:300]
                ).position_rms
                assert found.expected is not None
                within = error < found.expected.position_bound
                uneven = unevenness(believed, sim.actual)
                figures.append((error**2, uneven**2, within, not found.doubts))
            error, uneven, within, trusted = np.mean(figures, axis=0)
            print(
                f"{1e3 * bow:.1f} {'with --bow' if asked else 'taken as flat':14s} "
                f"{1e3 * np.sqrt(error):7.3f} {1e3 * np.sqrt(uneven):11.4f} "
                f"{100 * within:7.0f}% {100 * trusted:8.0f}%",
                flush=True,
            )


if __name__ == "__main__":
    main()
