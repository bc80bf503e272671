# SPDX-License-Identifier: MIT
"""Robust fits of simulated robots with and without gross errors: do they end, and mean something?

Usage: .venv/bin/python benchmarks/robust.py [robots [poses [word ...]]]

A row is a cell: a robot, an estimator, a loss, the share of poses that have one coordinate off, and
by how many standard deviations. It prints how many robots were refused, because a spoiled pose has
a leverage beyond 0.5; how many did not converge; how many of the 95%
intervals (Student's t) hold the true parameter; the root mean square of the errors over that of
least squares on the same robots without gross errors; chi-square per degree of freedom; and
milliseconds a robot of processor time. Only rows that have every `word` in them run. There are as
many `poses` as are asked for, or more until no leverage is beyond 0.5, up to which a loss keeps its
promise. The last line counts the cells.
"""

import itertools
import sys
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import symkin
from symkin import _core
from symkin.model.tolerances import noise_of

Array = NDArray[np.float64]

ROBOTS = ("3RRR", "rotary_delta", "hexapod_jugglebot")
ESTIMATORS = ("inverse", "implicit", "joint")
LOSSES = ("huber", "cauchy", "tukey")
GROSS = ((0.0, 0.0), *itertools.product((0.05, 0.1), (5.0, 20.0, 100.0)))  # share, deviations
HELD = 0.935, 0.965  # of 95% intervals
CHI_SQUARE = 0.98, 1.03


class Robots(NamedTuple):
    """Robots of one drawing as they are made, and what was measured of each."""

    mechanism: symkin.Mechanism
    actual: Array  # robots x (legs p)
    poses: list[Array]
    readings: list[Array]


class Result(NamedTuple):
    """What a cell says."""

    refused: int
    failed: int
    held: float
    rms: float
    chi_square: float
    milliseconds: float

    def words(self) -> str:
        """Return the row."""
        return (
            f"refused {self.refused:2}  failed {self.failed:2}  held {self.held:6.1%}  "
            f"rms {self.rms:5.2f}  chi-square {self.chi_square:5.3f}  {self.milliseconds:7.2f} ms"
        )


def made(name: str, count: int, least: int) -> Robots:
    """Robots within the tolerances at poses that no single one of which decides the fit."""
    mechanism = symkin.load_mechanism(name)
    noise = noise_of(mechanism.noise)
    candidates = symkin.sample_workspace(mechanism, 4000, seed=1)
    legs, needed = len(mechanism.legs), len(mechanism.parameter_names)
    for poses in range(max(least, legs * needed), 200, legs):
        plan = symkin.make_plan(mechanism, candidates, -(-poses // legs))
        simulated = [symkin.simulate(mechanism, plan, seed) for seed in range(count)]
        taken = [each.measurements.for_all_legs() for each in simulated]
        robots = Robots(
            mechanism,
            np.array([each.actual.parameters.ravel() for each in simulated]),
            [each.poses for each in taken],
            [each.readings for each in taken],
        )
        if any(refused(fitted(robots, each, "huber", noise)).any() for each in ESTIMATORS):
            continue
        print(f"{name}: {len(taken[0].poses)} poses", flush=True)
        return robots
    raise AssertionError(name)


def fitted(robots: Robots, estimator: str, loss: str, noise: _core.MeasurementNoise) -> _core.Fleet:
    """Every robot by itself."""
    return _core.identify_many(
        robots.mechanism.core,
        robots.poses,
        robots.readings,
        [np.full(len(each), -1) for each in robots.poses],
        _core.Estimator.__members__[estimator],
        _core.PoseUse.all,
        noise,
        loss,
        0.0,
        100,
        1,
    )


def refused(found: _core.Fleet) -> NDArray[np.bool_]:
    """Robots that the loss would promise nothing for."""
    return np.array(["leverage" in each for each in found.failures])


def spoiled(robots: Robots, share: float, deviations: float) -> Robots:
    """The same with one coordinate off at a share of the poses."""
    space, noise = robots.mechanism.space, robots.mechanism.noise
    positions = len(space.position)
    dof = positions + len(space.rotation)
    poses = []
    for seed, each in enumerate(robots.poses):
        random = np.random.default_rng(1000 + seed)
        changed = each.copy()
        for row in random.choice(len(each), round(share * len(each)), replace=False):
            which, size = random.integers(dof), deviations * random.choice([-1.0, 1.0])
            if which < positions:
                changed[row, which] += size * noise.position
            elif space.has_quaternion:
                turn = size * noise.orientation * np.eye(3)[which - positions]
                turned = Rotation.from_rotvec(turn) * Rotation.from_quat(changed[row, positions:])
                changed[row, positions:] = turned.as_quat()
            else:
                changed[row, which] += size * noise.orientation
        poses.append(changed)
    return robots._replace(poses=poses)


def cell(robots: Robots, estimator: str, loss: str, plain: Array) -> Result:
    """Fit the robots and compare them with what they are; `plain`: errors of least squares."""
    noise = noise_of(robots.mechanism.noise)
    start = time.process_time()
    found = fitted(robots, estimator, loss, noise)
    spent = time.process_time() - start
    good = np.array([not each for each in found.failures])
    errors = (found.parameters - robots.actual)[good]
    deviations = found.deviations[good]
    estimated = deviations > 0
    legs = found.student_degrees.shape[1]
    degrees = np.repeat(found.student_degrees[good], errors.shape[1] // legs, axis=1)
    limits = {each: _core.student_limit(0.05, each) for each in np.unique(degrees)}
    interval = np.vectorize(limits.get)(degrees)
    unit = np.sqrt(np.mean(plain**2, axis=0))
    used = unit > 0
    return Result(
        int(np.sum(refused(found))),
        int(np.sum(~good & ~refused(found))),
        float(np.mean(np.abs(errors)[estimated] <= (interval * deviations)[estimated])),
        float(np.sqrt(np.mean((errors[:, used] / unit[used]) ** 2))),
        float(np.mean(found.chi_square[good] / found.degrees_of_freedom[good])),
        1e3 * spent / len(good),
    )


def main(count: int, poses: int, words: list[str]) -> None:
    """Print the table."""
    results = []
    for name in ROBOTS:
        labels = {
            (
                estimator,
                loss,
                *gross,
            ): f"{name:18} {estimator:8} {loss:6} {gross[0]:4.0%} of {gross[1]:3.0f} sd"
            for estimator, loss, gross in itertools.product(ESTIMATORS, LOSSES, GROSS)
        }
        wanted = {key for key, label in labels.items() if all(word in label for word in words)}
        if not wanted:
            continue
        robots = made(name, count, poses)
        plain = {
            estimator: fitted(
                robots, estimator, "none", noise_of(robots.mechanism.noise)
            ).parameters
            - robots.actual
            for estimator in ESTIMATORS
        }
        for key in labels:
            if key in wanted:
                estimator, loss, share, size = key
                result = cell(spoiled(robots, share, size), estimator, loss, plain[estimator])
                results.append((share, result))
                print(f"{labels[key]}  {result.words()}", flush=True)
    # A gross error of 5 deviations is kept more often than not, and chi-square shows it.
    cells = [result for _, result in results]
    clean = [result for share, result in results if share == 0]
    failed = sum(each.failed for each in cells)
    held = sum(HELD[0] <= each.held <= HELD[1] for each in cells)
    sound = sum(CHI_SQUARE[0] <= each.chi_square <= CHI_SQUARE[1] for each in clean)
    largest = max((each.rms for each in clean), default=float("nan"))
    print(
        f"{len(cells)} cells of {count} robots: {failed} fits failed; {held} hold {HELD[0]:.1%} to "
        f"{HELD[1]:.1%}; of {len(clean)} with clean data {sound} have a chi-square of "
        f"{CHI_SQUARE[0]} to {CHI_SQUARE[1]}, rms at most {largest:.3f}"
    )


if __name__ == "__main__":
    numbers = [int(each) for each in sys.argv[1:3]]
    main(*(numbers + [300, 24][len(numbers) :]), sys.argv[3:])
