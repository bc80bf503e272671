# SPDX-License-Identifier: MIT
"""Whether the accuracy that is promised with a confidence is kept by as many simulated robots.

Usage: .venv/bin/python benchmarks/promises_kept.py [robots] [confidence] [first seed]

For each case as many poses are planned as `symkin pose-count --accuracy` finds. Robots are made
within the tolerances, measured at these poses and identified; the share of them of which the
position error over the workspace, root mean square, is within the target should be the confidence.
Beside it the share with the poses that are enough for the mean alone.
"""

import sys
import time

import numpy as np

import symkin
from symkin.estimate.fit import as_mechanism

CASES = (
    ("3RRR", "implicit", 40e-6),
    ("rotary_delta", "implicit", 40e-6),
    ("linear_delta", "joint", 30e-6),
    ("2RRR_PRP", "joint", 15e-6),
    ("hexa", "joint", 6e-6),
)
_POSES = 300  # over which an error is averaged
_MEAN = 0.5  # the confidence that is nearest to it


def share_within(
    mechanism: symkin.Mechanism, plan: symkin.Plan, estimator: str, target: float, seeds: range
) -> float:
    """Share of robots of which the position error is within the target."""
    cloud = np.asarray(plan.candidates.poses)
    poses = cloud[:: -(-len(cloud) // _POSES)]
    made = {str(seed): symkin.simulate(mechanism, plan, seed) for seed in seeds}
    measured = {name: each.measurements for name, each in made.items()}
    fleet = symkin.identify_many(mechanism, measured, estimator)
    errors = np.full(len(seeds), np.inf)
    for robot, (parameters, each) in enumerate(zip(fleet.parameters, made.values(), strict=True)):
        if np.isfinite(parameters).all():
            model = as_mechanism(mechanism, parameters, np.zeros_like(parameters))
            errors[robot] = symkin.evaluate(model, actual=each.actual, poses=poses).position_rms
    return float(np.mean(errors <= target))


def main() -> None:
    """Print a line a case."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    confidence = float(sys.argv[2]) if len(sys.argv) > 2 else 0.95
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    for name, estimator, target in CASES:
        start = time.perf_counter()
        mechanism = symkin.load(name)
        sample = symkin.sample_workspace(mechanism, 3000, seed=1)
        told = []
        for share in (confidence, _MEAN):
            curve = symkin.pose_count_curve(
                mechanism, sample, [24], estimator=estimator, confidence=share
            )
            needed = curve.for_accuracy(target)
            plan = symkin.make_plan(mechanism, sample, needed.tried)
            kept = share_within(mechanism, plan, estimator, target, range(first, first + robots))
            told.append(f"{needed.tried:4d} poses a leg {100 * kept:5.1f}%")
        seconds = time.perf_counter() - start
        print(
            f"{name:13s} {estimator:8s} {1e6 * target:3.0f} um: {' | '.join(told)}  "
            f"{seconds:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()
