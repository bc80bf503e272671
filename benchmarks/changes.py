# SPDX-License-Identifier: MIT
"""What changes while a robot is measured: whether it is noticed, and what it costs as an unknown.

Usage: .venv/bin/python benchmarks/changes.py [robots] [mechanism ...] [what ...]

First the share of a drift that poses show in three orders of visiting, and the way through them.
Then robots of which something changes, normal in its size, by four standard deviations of what it
changes: how many are doubted for it, and how many of these by its name; then with it as an unknown
how many 95% intervals of parameters and of slopes hold the truth, and the end-effector error over
that of the same robots without a change, and what both expect. Last sound robots: how many are
doubted by these tests.
"""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

import symkin
from symkin import _core
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.changes import CHANGES
from symkin.planning.plan import Plan
from symkin.planning.simulation import Simulation

_POSES = 60
_SIZE = 4.0  # standard deviations of the noise
_EVALUATED = 300
_ESTIMATOR = {"estimator": "joint"}
_MECHANISMS = ("3RRR", "rotary_delta", "hexapod_jugglebot")


def main() -> None:
    """Print a line for each order, and one for each kind of change."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    asked = sys.argv[2:]
    for name in [each for each in _MECHANISMS if each in asked] or _MECHANISMS:
        mechanism = symkin.load(name)
        sample = symkin.sample_workspace(mechanism, 3000, seed=1)
        plans = {
            visit: symkin.make_plan(
                mechanism, sample, _POSES, 1, design="mechanism", visit=visit, spares=20
            )
            for visit in ("travel", "there_and_back", "sets")
        }
        for visit, plan in plans.items():
            way = plan.travel / plans["travel"].travel
            print(f"{name}, {visit}: way {way:.2f}, drift shown {plan.drift_shown:.2f}", flush=True)
        plan = plans["there_and_back"]
        cloud = sample.poses[:: -(-len(sample.poses) // _EVALUATED)]
        wanted = [each for each in asked if each not in _MECHANISMS]
        doubted, plain = [], []
        for seed in range(1, robots + 1):
            # A change of nothing, so that the noise is the same as with one.
            taken = symkin.simulate(mechanism, plan, seed, changes={"leg1.drift": 0.0})
            found = symkin.identify(mechanism, taken.measurements, **_ESTIMATOR)
            if not wanted:
                doubted.append(any(doubt.code in CHANGES for doubt in found.doubts))
            plain.append((error(found, taken, cloud), found.expected_accuracy(cloud).position))
        if not wanted:
            print(f"{name}, sound: doubted {100 * np.mean(doubted):.1f}%", flush=True)
        for what, names, option, code in kinds(mechanism):
            if wanted and what not in wanted:
                continue
            print(
                f"{name}, {what}: {of_kind(mechanism, plan, cloud, names, option, code, plain)}",
                flush=True,
            )


def kinds(
    mechanism: symkin.Mechanism,
) -> Iterator[tuple[str, dict[str, float], dict[str, Any], str]]:
    """Names of slopes with their usual sizes, how they are asked for, and the doubt."""
    reading = _SIZE * mechanism.noise.reading + reading_of_pose(mechanism)
    legs = range(1, len(mechanism.legs) + 1)
    half = _POSES // 2 + 2
    yield "drift of a leg", {"leg2.drift": reading}, {"drift": ["leg"]}, "drifts"
    yield (
        "drift of the frame", {"drift.x": _SIZE * mechanism.noise.position},
        {"drift": ["frame"]}, "drifts",
    )  # fmt: skip
    yield "step of a leg", {f"leg1.step{half}": reading}, {"step": [half]}, "steps"
    yield (
        "backlash of all legs", {f"leg{leg}.backlash": reading for leg in legs},
        {"backlash": True}, "has-backlash",
    )  # fmt: skip
    yield "growth", {"growth": 5e-4}, {"growth": True}, "grows"


def reading_of_pose(mechanism: symkin.Mechanism) -> float:
    """Four standard deviations of what the noise of a pose makes of a reading, in the mean."""
    poses = symkin.sample_workspace(mechanism, 50, seed=2).poses
    found = []
    deviations = np.array(
        [mechanism.noise.position] * mechanism.space.size
        + [mechanism.noise.orientation] * len(mechanism.space.rotation)
    )
    for leg, readings in enumerate(mechanism.inverse_kinematics(poses).T):
        rows = _core.linearise(mechanism.core, leg, poses, np.ascontiguousarray(readings))
        along = rows.by_pose * deviations / rows.by_reading[:, None]
        found.append(np.sqrt(np.median(np.square(along).sum(axis=1))))
    return _SIZE * float(np.mean(found))


def of_kind(
    mechanism: symkin.Mechanism,
    plan: Plan,
    cloud: np.ndarray,
    names: dict[str, float],
    option: dict[str, Any],
    code: str,
    plain: list[tuple[float, float]],
) -> str:
    """What becomes of robots of which this changes."""
    noticed, named, held, slopes, errors = [], [], [], [], []
    for seed in range(1, len(plain) + 1):
        sizes = np.random.default_rng([seed, 7]).normal(size=len(names)) * [*names.values()]
        changes = dict(zip(names, sizes.tolist(), strict=True))
        taken = symkin.simulate(mechanism, plan, seed, changes=changes)
        found = symkin.identify(mechanism, taken.measurements, **_ESTIMATOR)
        codes = [doubt.code for doubt in found.doubts]
        noticed.append(any(each in CHANGES for each in codes))
        named.append(code in codes)
        found = symkin.identify(mechanism, taken.measurements, **option)
        known = found.mechanism.deviations
        off = (found.mechanism.parameters - taken.actual.parameters) / known
        held.append(np.mean(np.abs(off[np.isfinite(off)]) < found.interval))
        for name, true in changes.items():
            own = found.params["leg1.growth" if name == "growth" else name]
            slopes.append(abs(own.value - true) < found.interval * own.deviation)
        errors.append((error(found, taken, cloud), found.expected_accuracy(cloud).position))
    ratio, expected = np.sqrt(
        np.square(errors).mean(axis=0) / np.square(plain).mean(axis=0)
    ).tolist()
    right = 100 * np.sum(named) / max(np.sum(noticed), 1)
    return (
        f"doubted {100 * np.mean(noticed):.0f}%, of these by name {right:.0f}%; as an unknown "
        f"intervals hold {100 * np.mean(held):.1f}%, of slopes {100 * np.mean(slopes):.1f}%, "
        f"error {ratio:.2f} of that without, {expected:.2f} expected"
    )


def error(found: Estimate, taken: Simulation, cloud: np.ndarray) -> float:
    """Root mean square position error over poses."""
    return symkin.evaluate(found.mechanism, actual=taken.actual, poses=cloud).position_rms


if __name__ == "__main__":
    main()
