# SPDX-License-Identifier: MIT
"""Accuracy after identification of the paper's 3-RRR: first-order prediction and Monte Carlo.

Usage: .venv/bin/python benchmarks/accuracy_table.py [robots]

Each row is one way to spend measurements: the rows that choose the poses, which poses a leg uses,
and the estimator. The prediction needs no robot; the Monte Carlo disturbs the parameters of every
robot with the standard deviations 1e-3 (m, rad, gain), measures with 1e-4 (m, rad), identifies, and
takes the root mean square over robots and 2000 poses of the workspace.
"""

import sys

import numpy as np

import symkin

CASES = [
    ("paper", "paper", "own"),
    ("paper", "implicit", "own"),
    ("noise_aware", "implicit", "own"),
    ("noise_aware", "implicit", "all"),
    ("noise_aware", "joint", "all"),
]


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def main(robots: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    candidates = symkin.sample_workspace(mechanism, seed=1).poses
    poses = candidates[:2000]
    print(f"{robots} robots; RMS position error in 1e-5 m, orientation error in 1e-5 rad")
    print(
        "selection    estimator poses   predicted      Monte Carlo    inside 95%  replaced  failed"
    )
    for rows, estimator, use in CASES:
        plan = symkin.make_plan(mechanism, candidates, seed=1, rows=rows)
        achieved, predicted, inside, replaced, failed = [], [], [], 0, 0
        for seed in range(robots):
            simulation = symkin.simulate(mechanism, plan, seed)
            found = symkin.identify(mechanism, simulation.measurements, estimator, poses=use)
            failed += not found.converged
            after = symkin.evaluate(found.mechanism, actual=simulation.actual, poses=poses)
            achieved.append((after.position_rms, after.orientation_rms))
            expected = symkin.expected_accuracy(mechanism, poses[:200], found.covariance)
            predicted.append((expected.position, expected.orientation))
            errors = found.mechanism.parameters - simulation.actual.parameters
            deviations = np.sqrt(np.diag(found.covariance)).reshape(errors.shape)
            inside.append(np.mean(np.abs(errors) < 1.96 * deviations))
            replaced += sum(simulation.replaced)
        figures = [
            1e5 * rms([pair[part] for pair in figures])
            for figures in (predicted, achieved)
            for part in (0, 1)
        ]
        print(
            f"{rows:12} {estimator:9} {use:5} {figures[0]:6.2f} {figures[1]:6.2f}  "
            f"{figures[2]:6.2f} {figures[3]:6.2f}  {np.mean(inside):10.1%}  {replaced:8} {failed:7}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
