# SPDX-License-Identifier: MIT
"""Identification of robots beside SciPy's `least_squares` with the same weights, on one core.

Usage: OMP_NUM_THREADS=1 taskset -c 0 .venv/bin/python benchmarks/identification_time.py [robots]

The 3-RRR of the paper, three legs with 24 poses of their own, estimator `implicit`. SciPy gets the
whitened closures and their derivatives from symkin's batched functions, and passes with fixed
weights until the parameters stay still, by its default method and by MINPACK's; both are asked for
the covariance. The last row has the estimator `joint` on all 72 poses, which is another problem
than SciPy's. Processor times, best of three runs, and the largest difference of the estimates in
standard deviations.
"""

import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import symkin
from symkin import _core
from symkin.estimate.fit import core_measurements
from symkin.model.tolerances import noise_of

Array = NDArray[np.float64]

_LONGEST = 20  # robots that SciPy gets


def by_scipy(
    mechanism: symkin.Mechanism, measured: symkin.Measurements, method: str
) -> tuple[Array, Array]:
    """Parameters and standard deviations, shape (legs, p)."""
    noise = mechanism.noise
    variances = np.array([noise.position**2, noise.position**2, noise.orientation**2])
    found = []
    for leg in range(len(mechanism.legs)):
        rows = measured.rows_of(leg)
        poses = measured.poses[rows]
        readings = np.ascontiguousarray(measured.readings[rows, leg])

        def linearised(
            parameters: Array,
            leg: int = leg,
            poses: Array = poses,
            readings: Array = readings,
        ) -> _core.ClosureRows:
            values = mechanism.parameters.copy()
            values[leg] = parameters
            return _core.linearise(mechanism.core.with_parameters(values), leg, poses, readings)

        parameters = mechanism.parameters[leg]
        for _ in range(50):
            at = linearised(parameters)
            v = at.by_pose**2 @ variances + noise.reading**2 * at.by_reading**2
            factors = 1 / np.sqrt(v)
            fit = least_squares(
                lambda p, f=factors, g=linearised: g(p).closure * f,
                parameters,
                jac=lambda p, f=factors, g=linearised: g(p).by_parameters * f[:, None],
                method=method,
                x_scale="jac",
                ftol=1e-12,
                xtol=1e-12,
                gtol=1e-12,
            )
            moved = np.abs(fit.x - parameters).max()
            parameters = fit.x
            if moved < 1e-9:
                break
        deviations = np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
        found.append((parameters, deviations))
    values, deviations = zip(*found, strict=True)
    return np.array(values), np.array(deviations)


def robots(mechanism: symkin.Mechanism, count: int) -> dict[str, symkin.Measurements]:
    plan = symkin.make_plan(mechanism, symkin.sample_workspace(mechanism), 24)
    return {
        str(seed): symkin.simulate(mechanism, plan, seed=seed).measurements for seed in range(count)
    }


def best(work: Callable[[], object], robots: int) -> float:
    """Seconds a robot."""
    times = []
    for _ in range(3):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times) / robots


def main(count: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    fleet = robots(mechanism, count)
    few = list(fleet.values())[:_LONGEST]
    scipy, minpack = (
        best(lambda: [by_scipy(mechanism, each, method) for each in few], len(few))  # noqa: B023
        for method in ("trf", "lm")
    )
    core = [core_measurements(each) for each in few]
    options = (
        _core.Estimator.implicit,
        _core.PoseUse.own,
        noise_of(mechanism.noise),
        "none",
        0.0,
        100,
    )
    calls = 50
    single = best(
        lambda: [_core.identify(mechanism.core, each, *options) for each in core * calls],
        len(core) * calls,
    )
    whole = best(lambda: [symkin.identify(mechanism, each, poses="own") for each in few], len(few))
    many = best(lambda: symkin.identify_many(mechanism, fleet, poses="own", threads=1), len(fleet))
    some = dict(list(fleet.items())[: max(count // 4, 1)])
    joint = best(lambda: symkin.identify_many(mechanism, some, "joint", threads=1), len(some))
    found = symkin.identify_many(mechanism, fleet, poses="own", threads=1)
    off = 0.0
    for row, each in enumerate(few):
        parameters, deviations = by_scipy(mechanism, each, "trf")
        off = max(off, float(np.max(np.abs(found.parameters[row] - parameters) / deviations)))
    print(f"{'':44} {'us a robot':>10} {'robots/s':>9} {'SciPy over it':>14}")
    for name, seconds in (
        ("SciPy's least_squares, same reweighting", scipy),
        ('the same with method="lm", which is MINPACK', minpack),
        ("one call of the core", single),
        ("symkin.identify, calibrated mechanism included", whole),
        (f"symkin.identify_many, {count} robots", many),
    ):
        print(f"{name:47} {1e6 * seconds:7.1f} {1 / seconds:9.0f} {scipy / seconds:14.1f}")
    print(f"{f'the same with joint on 72 poses, {len(some)} robots':47} ", end="")
    print(f"{1e6 * joint:7.1f} {1 / joint:9.0f}")
    print(f"largest difference of the estimates: {off:.1e} standard deviations")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
