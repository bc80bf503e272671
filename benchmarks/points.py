# SPDX-License-Identifier: MIT
"""How well hexapods are identified from reflectors whose places nobody knows.

    python benchmarks/points.py [ROBOTS] [CASES]

Each robot differs from the shipped hexapod by its tolerances, here 0.3 mm and 1 mrad. A laser
tracker stands 2.5 m away, turned by 65 degrees, and sees reflectors to 15 um at 40 poses; struts
are read to 5 um. Nothing else is known. Prints for one to four reflectors, for tolerances ten times
as large, with a third of the reflectors hidden, and with one place known: how many robots are
identified, chi-square, the error of the end effector over the workspace with frames aligned
(position and orientation) over the bound, which is what the declared noise and the priors leave,
and over what the estimate expects; single robots within 20% of that; on 20 rows held out, by how
much chi-square rises a degree of freedom when they join; and the share of parameters that their 95%
intervals hold. CASES are how many lines are printed, by default all.
"""

from __future__ import annotations

import dataclasses
import sys

import numpy as np

import symkin
from symkin.analysis.observed import Observed
from symkin.estimate.precision import Expected
from symkin.model.settings import Frames
from symkin.planning.simulation import disturb

POSES, HELD_OUT = 40, 20
WITHIN = 1.959963984540054
PLACES = ((0.12, 0.0, 0.03), (-0.06, 0.1, 0.03), (-0.05, -0.11, 0.05), (0.02, 0.05, 0.09))
TURN = np.radians(65) * np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
BASE = (2.0, 1.5, -0.4, *TURN.tolist())

# Reflectors, tolerances, share of them that is hidden, how many places are known.
CASES = (
    *((number, 1.0, 0.0, 0) for number in (3, 1, 2, 4)),
    *((number, 10.0, 0.0, 0) for number in (3, 1, 2)),
    (4, 1.0, 1 / 3, 0),
    (3, 10.0, 1 / 3, 0),
    (3, 1.0, 0.0, 1),
)


def hexapod(times: float = 1.0) -> symkin.Mechanism:
    """The shipped hexapod, made within so many times 0.3 mm and 1 mrad."""
    nominal = symkin.load_mechanism("hexapod_jugglebot")
    spool = float(np.abs(nominal.parameters[0, nominal.parameter_names.index("sensor_gain")]))
    noise = dataclasses.replace(nominal.noise, position=15e-6, reading=5e-6 / spool)
    made = dataclasses.replace(
        nominal.tolerances, length=times * 3e-4, angle=times * 1e-3, gain=times * 1e-4
    )
    return nominal.replace(noise=noise, tolerances=made)


def seen(
    nominal: symkin.Mechanism, actual: symkin.Mechanism, points: int, hidden: float, seed: int
) -> symkin.Measurements:
    """What the tracker sees of a robot at poses all over its workspace."""
    poses = symkin.sample_workspace(nominal, POSES + HELD_OUT, seed=1).poses
    exact = symkin.Measurements.of(
        poses, actual.inverse_kinematics(poses), reading_unit="rad", pose_space="spatial"
    )
    tracker = Observed("points", base=BASE, points=PLACES[:points])
    taken = tracker.measure(exact, nominal.noise, seed)
    gone = np.random.default_rng([seed, 2]).random(taken.points.shape[:2]) < hidden
    return dataclasses.replace(taken, points=np.where(gone[:, :, None], np.nan, taken.points))


def case(robots: int, points: int, times: float, hidden: float, known: int) -> dict[str, list]:
    """Figures of robots, one each."""
    nominal = hexapod(times)
    given = nominal.replace(frames=Frames(points=PLACES[:known])) if known else nominal
    names = ("chi", "true", "expected", "bound", "rise", "inside")
    told: dict[str, list] = {name: [] for name in names}
    for seed in range(robots):
        actual = disturb(nominal, seed)
        taken = seen(nominal, actual, points, hidden, seed)
        found = symkin.identify(given, taken[:POSES])
        if not found.converged or found.unexplained:
            continue
        joined = symkin.identify(given, taken)
        degrees = joined.degrees_of_freedom - found.degrees_of_freedom
        told["rise"].append((joined.chi_square - found.chi_square) / degrees)
        told["chi"].append(found.chi_square / found.degrees_of_freedom)
        left = symkin.evaluate(found.mechanism.replace(frames=None), actual=actual).aligned
        told["true"].append((left.position_rms, left.orientation_rms))
        expected = np.array((found.expected.position, found.expected.orientation))
        told["expected"].append(expected)
        bound = Expected.by(dataclasses.replace(found, covariance=found.model_covariance))
        told["bound"].append((bound.position, bound.orientation))
        off = np.abs(found.mechanism.parameters - actual.parameters)
        unknown = found.deviations > 0
        told["inside"].append(np.mean(off[unknown] < WITHIN * found.deviations[unknown]))
    return told


def main() -> None:
    """Print a line a case."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    cases = int(sys.argv[2]) if len(sys.argv) > 2 else None
    print(
        "reflectors  tolerances  hidden  known   identified  chi2/dof   um rms   over bound"
        "  over promise  within 20%  held out  in 95%"
    )
    for points, times, hidden, known in CASES[:cases]:
        told = case(robots, points, times, hidden, known)
        true, expected, bound = (np.array(told[name]) for name in ("true", "expected", "bound"))
        error, *others = (np.sqrt(np.mean(each**2, axis=0)) for each in (true, expected, bound))
        promised, least = (error / each for each in others)
        close = np.mean(np.abs(true[:, 0] / expected[:, 0] - 1) < 0.2)
        print(
            f"{points:10d}  {times:9g}x  {hidden:6.0%}  {known:5d}  {len(true):4d} of {robots:<4d}"
            f"  {np.mean(told['chi']):8.3f}  {1e6 * error[0]:7.2f}  {least[0]:.3f} {least[1]:.3f}"
            f"  {promised[0]:.3f} {promised[1]:.3f}  {close:10.0%}  {np.mean(told['rise']):8.3f}"
            f"  {np.mean(told['inside']):6.1%}",
            flush=True,
        )


if __name__ == "__main__":
    main()
