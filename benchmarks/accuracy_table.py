# SPDX-License-Identifier: MIT
"""Accuracy after identification of the paper's 3-RRR: first-order prediction and Monte Carlo.

Usage: .venv/bin/python benchmarks/accuracy_table.py [robots]

Each row is one way to spend measurements: the design, the rows and the criterion that choose the
poses, which of them a leg uses, and the estimator. The prediction needs no robot; the Monte Carlo
disturbs the parameters of every robot with the standard deviations 1e-3 (m, rad, gain), measures
with 1e-4 (m, rad), identifies, and takes the root mean square over robots and 2000 poses of the
workspace. `one length` is the error of both together, a rotation counted as the way of a point at
the characteristic length from the centre: what the criterion expected_error makes small.
"""

import sys
from typing import NamedTuple

import numpy as np

import symkin


class Case(NamedTuple):
    """One way to spend measurements."""

    design: str
    rows: str
    criterion: str
    estimator: str
    poses: str


CASES = [
    Case("legs", "paper", "O1", "paper", "own"),
    Case("legs", "paper", "O1", "implicit", "own"),
    Case("legs", "noise_aware", "O1", "implicit", "own"),
    Case("legs", "noise_aware", "O1", "implicit", "all"),
    Case("legs", "noise_aware", "O1", "joint", "all"),
    Case("mechanism", "paper", "O1", "inverse", "all"),
    Case("mechanism", "noise_aware", "O1", "joint", "all"),
    Case("orbits", "noise_aware", "O1", "implicit", "all"),
    Case("orbits", "noise_aware", "O1", "joint", "all"),
    Case("legs", "noise_aware", "expected_error", "implicit", "own"),
    Case("mechanism", "noise_aware", "expected_error", "joint", "all"),
]


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def one_length(mechanism: symkin.Mechanism, position: float, orientation: float) -> float:
    return float(np.hypot(position, mechanism.characteristic_length * orientation))


def main(robots: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    candidates = symkin.sample_workspace(mechanism, seed=1).poses
    poses = candidates[:2000]
    print(f"{robots} robots; position and one length in 1e-5 m, orientation in 1e-5 rad, rms")
    print(
        f"{'design':10}{'rows':12}{'criterion':15}{'estimator':10}{'use':5}poses"
        f"{'predicted':>13}{'length':>13}{'Monte Carlo':>15}{'length':>11}{'ratio':>8}"
        f"{'in 95%':>8}{'replaced':>9}{'failed':>7}"
    )
    for case in CASES:
        plan = symkin.make_plan(
            mechanism,
            candidates,
            seed=1,
            design=case.design,
            rows=case.rows,
            criterion=case.criterion,
        )
        promised = symkin.predict_accuracy(mechanism, plan, poses, case.estimator, poses=case.poses)
        achieved, inside, replaced, failed = [], [], 0, 0
        for seed in range(robots):
            try:
                simulation = symkin.simulate(mechanism, plan, seed)
            except symkin.SymkinError:  # more poses out of reach than there are spares
                failed += 1
                continue
            found = symkin.identify(
                mechanism, simulation.measurements, case.estimator, poses=case.poses
            )
            failed += not found.converged
            after = symkin.evaluate(found.mechanism, actual=simulation.actual, poses=poses)
            achieved.append((after.position_rms, after.orientation_rms))
            errors = found.mechanism.parameters - simulation.actual.parameters
            deviations = np.sqrt(np.diag(found.covariance)).reshape(errors.shape)
            inside.append(np.mean(np.abs(errors) < 1.96 * deviations))
            replaced += sum(simulation.replaced)
        reached = [rms([pair[part] for pair in achieved]) for part in (0, 1)]
        lengths = [
            one_length(mechanism, *pair)
            for pair in ((promised.position, promised.orientation), reached)
        ]
        print(
            f"{case.design:10}{case.rows:12}{case.criterion:15}{case.estimator:10}{case.poses:5}"
            f"{np.count_nonzero(~plan.spare):5}"
            f"{1e5 * promised.position:7.2f}{1e5 * promised.orientation:6.2f}"
            f"{1e5 * lengths[0]:13.2f}"
            f"{1e5 * reached[0]:9.2f}{1e5 * reached[1]:6.2f}{1e5 * lengths[1]:11.2f}"
            f"{lengths[1] / lengths[0]:8.3f}{np.mean(inside):8.1%}{replaced:9}{failed:7}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
