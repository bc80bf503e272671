# SPDX-License-Identifier: MIT
"""Identification of robots beside SciPy and hand-written NumPy with the same weights, on one core.

Usage: OMP_NUM_THREADS=1 taskset -c 0 .venv/bin/python benchmarks/identification_time.py [robots]

The 3-RRR of the paper, three legs with 24 poses of their own, estimator `implicit`. SciPy gets the
whitened closures and their derivatives from symkin's batched functions, and passes with fixed
weights until the parameters stay still, by its default method and by MINPACK's; both are asked for
the covariance. `batched_numpy` has all robots in arrays beside each other and derivatives written
out. The last rows have Huber's loss at 30 poses a leg, the fewest that guard each other, which has
no peer, and the estimator `joint` on all 72 poses, whose peer is `batched_numpy`'s. `identify_many`
examines the first 20 robots that it doubts one by one, as `identify` does; what that takes is told
by itself, and its rows are of the others. Processor times, best of five runs, and the largest
differences of the estimates in standard deviations.
"""

import sys
import time
from collections.abc import Callable
from typing import Any

import batched_numpy
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import symkin
from symkin import _core
from symkin.estimate.fit import core_measurements
from symkin.model.tolerances import noise_of
from symkin.options import Estimator, Loss

Array = NDArray[np.float64]

_LONGEST = 20  # robots that SciPy gets
_TOGETHER = 300  # legs that NumPy is fastest with
_FEW_TOGETHER = 20  # robots of `joint`


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


def by_numpy(mechanism: symkin.Mechanism, fleet: list[symkin.Measurements]) -> Array:
    """Parameters, shape (robots, legs, p)."""
    legs = range(len(mechanism.legs))
    rows = [[measured.rows_of(leg) for leg in legs] for measured in fleet]
    poses = np.array([each.poses[row] for each, of in zip(fleet, rows, strict=True) for row in of])
    readings = np.array(
        [
            each.readings[row, leg]
            for each, of in zip(fleet, rows, strict=True)
            for leg, row in enumerate(of)
        ]
    )
    start = np.tile(mechanism.parameters, (len(fleet), 1))
    noise = mechanism.noise
    sizes = noise.position, noise.orientation, noise.reading
    found = [
        batched_numpy.identified(start[some], poses[some], readings[some], sizes)[0]
        for some in np.split(np.arange(len(start)), range(_TOGETHER, len(start), _TOGETHER))
    ]
    return np.concatenate(found).reshape(len(fleet), *mechanism.parameters.shape)


def by_numpy_jointly(mechanism: symkin.Mechanism, fleet: list[symkin.Measurements]) -> Array:
    """The same by `joint`, with all poses for all legs."""
    noise = mechanism.noise
    found = []
    for first in range(0, len(fleet), _FEW_TOGETHER):
        some = fleet[first : first + _FEW_TOGETHER]
        start = np.tile(mechanism.parameters, (len(some), 1, 1))
        poses = np.array([each.poses for each in some])
        readings = np.array([each.readings for each in some])
        sizes = noise.position, noise.orientation, noise.reading
        found.append(batched_numpy.identified_jointly(start, poses, readings, sizes)[0])
    return np.concatenate(found)


def robots(
    mechanism: symkin.Mechanism, count: int, poses: int = 24
) -> dict[str, symkin.Measurements]:
    plan = symkin.make_plan(mechanism, symkin.sample_workspace(mechanism), poses)
    return {
        str(seed): symkin.simulate(mechanism, plan, seed=seed).measurements for seed in range(count)
    }


def best(work: Callable[[], object], robots: int) -> float:
    """Seconds a robot."""
    times = []
    for _ in range(5):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times) / robots


def of_fleet(
    mechanism: symkin.Mechanism,
    fleet: dict[str, symkin.Measurements],
    estimator: Estimator = "implicit",
    loss: Loss = "none",
) -> tuple[float, float]:
    """Seconds a robot of the core, whose results have their verdicts, and of Python around it.

    Of the robots that nothing speaks against; prints how many others there are.
    """
    how_asked: dict[str, Any] = {
        "poses": "all" if estimator == "joint" else "own",
        "loss": loss,
        "threads": 1,
    }
    start = time.process_time()
    doubts = symkin.identify_many(mechanism, fleet, estimator, **how_asked).doubts
    taken = time.process_time() - start
    sound = {
        name: each for (name, each), doubt in zip(fleet.items(), doubts, strict=True) if not doubt
    }
    robots = list(sound.values())
    poses, readings = [each.poses for each in robots], [each.readings for each in robots]
    leg_sets = [each.leg_sets.astype(np.int64) for each in robots]
    noise = noise_of(mechanism.noise)
    which = _core.Estimator.__members__[estimator]
    how = _core.PoseUse.__members__[how_asked["poses"]]
    core = best(
        lambda: _core.identify_many(
            mechanism.core, poses, readings, leg_sets, which, how, noise, loss, 0.0, 100, 1
        ),
        len(robots),
    )
    whole = best(
        lambda: symkin.identify_many(mechanism, sound, estimator, **how_asked), len(robots)
    )
    doubted = len(fleet) - len(sound)
    print(f"{estimator}, loss {loss}: {doubted} of {len(fleet)} robots doubted", end="")
    print(f", {(taken - whole * len(fleet)) / doubted:.2f} s each" if doubted else "")
    return core, whole


def main(count: int) -> None:
    mechanism = symkin.load_mechanism("3RRR")
    fleet = robots(mechanism, count)
    every = list(fleet.values())
    few = every[:_LONGEST]
    scipy, minpack = (
        best(lambda: [by_scipy(mechanism, each, method) for each in few], len(few))  # noqa: B023
        for method in ("trf", "lm")
    )
    core = [core_measurements(each) for each in few] * 50
    own = _core.Estimator.implicit, _core.PoseUse.own, noise_of(mechanism.noise), "none", 0.0, 100
    single = best(lambda: [_core.identify(mechanism.core, each, *own) for each in core], len(core))
    whole = best(lambda: [symkin.identify(mechanism, each, poses="own") for each in few], len(few))
    numpy = best(lambda: by_numpy(mechanism, every), count)
    least_squares = of_fleet(mechanism, fleet)
    huber = of_fleet(mechanism, robots(mechanism, count, 30), loss="huber")
    joint = of_fleet(mechanism, fleet, "joint")
    numpy_joint = best(lambda: by_numpy_jointly(mechanism, every), count)

    found = symkin.identify_many(mechanism, fleet, poses="own", threads=1)
    off = 0.0
    for row, each in enumerate(few):
        parameters, deviations = by_scipy(mechanism, each, "trf")
        off = max(off, float(np.max(np.abs(found.parameters[row] - parameters) / deviations)))
    off_numpy = np.max(np.abs(found.parameters - by_numpy(mechanism, every)) / found.deviations)
    jointly = symkin.identify_many(mechanism, fleet, "joint", poses="all", threads=1)
    off_joint = np.max(
        np.abs(jointly.parameters - by_numpy_jointly(mechanism, every)) / jointly.deviations
    )
    print(f"{'':47} {'us a robot':>10} {'robots/s':>9} {'SciPy/it':>9} {'NumPy/it':>9}")
    nothing = float("nan")
    for name, seconds, by_scipy_takes, by_numpy_takes in (
        ("SciPy's least_squares, same reweighting", scipy, scipy, numpy),
        ('the same with method="lm", which is MINPACK', minpack, scipy, numpy),
        (f"NumPy, {count} robots in arrays", numpy, scipy, numpy),
        ("one call of the core", single, scipy, numpy),
        ("symkin.identify, calibrated mechanism included", whole, scipy, numpy),
        (f"one call of the core, {count} robots", least_squares[0], scipy, numpy),
        (f"symkin.identify_many, {count} robots", least_squares[1], scipy, numpy),
        ("Huber's loss, 30 poses a leg, the core", huber[0], nothing, nothing),
        ("Huber's loss, 30 poses a leg, identify_many", huber[1], nothing, nothing),
        ("joint, 72 poses, NumPy", numpy_joint, nothing, numpy_joint),
        ("joint, 72 poses, the core", joint[0], nothing, numpy_joint),
        ("joint, 72 poses, identify_many", joint[1], nothing, numpy_joint),
    ):
        print(
            f"{name:47} {1e6 * seconds:10.1f} {1 / seconds:9.0f} {by_scipy_takes / seconds:9.1f} "
            f"{by_numpy_takes / seconds:9.2f}"
        )
    print(
        f"largest difference from SciPy {off:.1e}, from NumPy {off_numpy:.1e}, of joint "
        f"{off_joint:.1e} deviations"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
