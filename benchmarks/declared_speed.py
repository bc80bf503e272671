# SPDX-License-Identifier: MIT
"""How long a declared leg takes that is no known chain: readings from home, and rows.

Usage: python benchmarks/declared_speed.py [FILE ...]

Of the shipped mechanisms, or those of files, such as tests/python/declared/h4_joints.toml, whose
legs have twelve equations. Microseconds a pose and leg, one core, the best of 20 passes over 300
poses.
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

FOLDER = Path(__file__).parents[1] / "mechanisms" / "declared"
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


def times_of(path: Path) -> tuple[float, float]:
    """Of readings, and of the rows of the first leg."""
    mechanism = joint_by_joint(symkin.load_mechanism(path))
    model = mechanism.core
    poses = np.ascontiguousarray(symkin.sample_workspace(mechanism, 300, seed=1).poses)
    own = np.ascontiguousarray(mechanism.inverse_kinematics(poses)[:, 0])
    count = len(poses) * len(mechanism.legs)
    return (
        best_of(lambda: _core.inverse_kinematics(model, poses), count),
        best_of(lambda: _core.linearise(model, 0, poses, own), len(poses)),
    )


def main() -> None:
    """Print a line for each mechanism."""
    print(f"{'mechanism':18}{'inverse, us':>13}{'rows, us':>10}")
    for path in list(map(Path, sys.argv[1:])) or sorted(FOLDER.glob("*.toml")):
        inverse, rows = times_of(path)
        print(f"{path.stem:18}{inverse:13.2f}{rows:10.2f}")


if __name__ == "__main__":
    main()
