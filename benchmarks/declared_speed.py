# SPDX-License-Identifier: MIT
"""How long a declared leg takes that is no known chain: readings from home, and rows.

Usage: python benchmarks/declared_speed.py [FILE ...]

Of the shipped mechanisms and of tests/python/declared/h4_joints.toml, whose legs have twelve
equations, or those of files. Microseconds a pose, one core, the best of 20 passes over 300 poses:
for each reading or closure without one, and, where a leg has several, for the rows of all of them.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import symkin
from symkin import _core
from symkin.model.declared import declare, declared_chain

ROOT = Path(__file__).parents[1]
FILES = [
    *sorted((ROOT / "mechanisms" / "declared").glob("*.toml")),
    ROOT / "tests" / "python" / "declared" / "h4_joints.toml",
]
PASSES = 20


def best_of(function: Callable[[], object], count: int) -> float:
    """Microseconds for each of so many."""
    times = []
    for _ in range(PASSES):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / count


def joint_by_joint(mechanism: symkin.Mechanism) -> symkin.Mechanism:
    """The same legs, none taken as a known chain."""
    legs = []
    for leg in mechanism.legs:
        chain = declared_chain(leg.chain)
        assert chain is not None
        name = declare(dataclasses.replace(chain, recognise=False))
        legs.append(dataclasses.replace(leg, chain=name))
    return mechanism.replace(legs=legs, symmetry=None)


def times_of(path: Path) -> tuple[float, list[float]]:
    """Of readings, and of the rows of all closures of the first leg."""
    mechanism = joint_by_joint(symkin.load_mechanism(path))
    model = mechanism.core
    poses = np.ascontiguousarray(symkin.sample_workspace(mechanism, 300, seed=1).poses)
    readings = mechanism.inverse_kinematics(poses)

    def rows_of(leg: int) -> float:
        own = np.ascontiguousarray(readings[:, leg])
        return best_of(lambda: _core.linearise(model, leg, poses, own), len(poses))

    count = len(poses) * len(mechanism.legs)
    inverse = best_of(lambda: _core.inverse_kinematics(model, poses), count)
    return inverse, [rows_of(leg) for leg in mechanism.leg_readings[0]]


def main() -> None:
    """Print a line for each mechanism."""
    print(f"{'mechanism':18}{'inverse, us':>13}{'rows, us':>10}{'of the leg, us':>16}")
    for path in list(map(Path, sys.argv[1:])) or FILES:
        inverse, rows = times_of(path)
        whole = f"{sum(rows):16.2f}" if len(rows) > 1 else ""
        print(f"{path.stem:18}{inverse:13.2f}{rows[0]:10.2f}{whole}")


if __name__ == "__main__":
    main()
