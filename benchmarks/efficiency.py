# SPDX-License-Identifier: MIT
"""Estimates from partial observations against the Cramer-Rao bound, by simulated robots.

Usage: .venv/bin/python benchmarks/efficiency.py [robots [row ...]]

Every robot's parameters are disturbed by the tolerances, which are the priors where the
observations do not show everything. A row prints the mean chi-square over its degrees of freedom;
the mean square of the errors in the inverse of their predicted covariance over the number of
estimates, 1 at the bound; what chi-square has less at the estimate than at the truth, over the same
number; how many of the 95% intervals of the legs' parameters hold the truth; how many of the first
40 robots were not trusted; how many failed. Rows are counted from 1.

The two ratios agree where the unknowns are nearly straight over their own uncertainty. Where the
observations leave a turn of the robot to the tolerances, the truth lies on an arc that a covariance
draws as its tangent: only the second, which knows no coordinates, is 1 there.
"""

import dataclasses
import sys
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

import symkin
from symkin.analysis.observed import Observed
from symkin.estimate import Estimate
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem
from symkin.model.settings import Frames, NoiseSettings
from symkin.planning.simulation import Simulation


class Case(NamedTuple):
    """What is observed of a robot, and what is told of its surroundings."""

    robot: str
    observed: Observed
    options: Mapping[str, Any] = MappingProxyType({})
    known: Frames = Frames()
    poses: int = 60


SPATIAL = NoiseSettings(1e-4, 1e-4, 5e-4)  # m, rad, and the reading in the sensor's unit
# All is held, in effect, where it is said to be.
HELD = EstimateOptions(free=("leg1.sensor_offset",), prior={"leg1.sensor_offset": 1e-12})
ANCHOR = ((2.0, 1.0),)
ANCHOR_IN_SPACE = ((2.0, 1.0, 0.5),)
TRUSTED = 40  # robots whose verdicts are asked for, which takes longer than the estimate
FAR = {"base": (1.0, -0.5, 3.0), "target": (0.05, 0.0, 0.17)}
FAR_IN_SPACE = {
    "base": (1.0, -0.5, 0.3, 0.0, 0.0, 2.9),
    "target": (0.05, 0.0, 0.0, 0.1, 0.0, 0.17),
}
FRAMES = {"frames": ["base", "target"]}

CASES = [
    Case("3RRR", Observed("position")),
    Case("3RRR", Observed("position", missing=0.2)),
    Case("3RRR", Observed("distance", anchors=ANCHOR), known=Frames(anchors=ANCHOR)),
    Case("3RRR", Observed("pose", missing=0.2)),
    Case("3RRR", Observed("pose", **FAR), FRAMES),
    Case("5bar", Observed("distance", anchors=ANCHOR), known=Frames(anchors=ANCHOR)),
    Case("5bar", Observed("position", missing=0.2)),
    Case("5bar", Observed("position", base=FAR["base"]), {"frames": ["base"]}),
    Case("4RRR", Observed("readings"), poses=120),
    Case("hexapod_jugglebot", Observed("position")),
    Case(
        "hexapod_jugglebot",
        Observed("distance", anchors=ANCHOR_IN_SPACE),
        known=Frames(anchors=ANCHOR_IN_SPACE),
        poses=120,
    ),
    Case("hexapod_jugglebot", Observed("height"), {"frames": ["plane"]}, poses=120),
    Case("hexapod_jugglebot", Observed("pose", missing=0.2)),
    Case("hexapod_jugglebot", Observed("pose", **FAR_IN_SPACE), FRAMES),
    Case(
        "linear_delta",
        Observed("distance", anchors=ANCHOR_IN_SPACE),
        known=Frames(anchors=ANCHOR_IN_SPACE),
    ),
    Case("linear_delta", Observed("height"), {"frames": ["plane"]}),
    Case("linear_delta", Observed("position", missing=0.2)),
    Case(
        "linear_delta",
        Observed("position", base=FAR_IN_SPACE["base"]),
        {"frames": ["base"]},
    ),
]


def run(case: Case, robots: int) -> str:
    """Simulate and identify, and return the row."""
    mechanism = symkin.load_mechanism(case.robot)
    if mechanism.pose_space == "spatial":
        mechanism = mechanism.replace(noise=SPATIAL)
    elif case.robot == "4RRR":
        mechanism = mechanism.replace(noise=NoiseSettings(1e-4, 1e-4, 1e-4))
    per_leg = max(len(mechanism.parameter_names), case.poses // len(mechanism.legs))
    plan = symkin.make_plan(mechanism, symkin.sample_workspace(mechanism, 3000, seed=1), per_leg)
    chi_squares, degrees, squares, ratios, inside = [], [], [], [], []
    untrusted = failed = 0
    for seed in range(robots):
        try:
            simulated = symkin.simulate(mechanism, plan, 1000 + seed, observe=case.observed)
            found = symkin.identify(
                mechanism.replace(frames=case.known),
                simulated.measurements.for_all_legs(),
                "joint",
                gauge="prior",
                **case.options,
            )
        except symkin.SymkinError:
            failed += 1
            continue
        untrusted += seed < TRUSTED and not found.trustworthy
        chi_squares.append(found.chi_square)
        degrees.append(found.degrees_of_freedom)
        legs = [i for i, name in enumerate(found.names) if name.startswith("leg")]
        values = {each.name: each.value for each in found.unknowns}
        truth = truth_of(simulated)
        errors = np.array([values[found.names[i]] - truth[found.names[i]] for i in legs])
        covariance = found.covariance[np.ix_(legs, legs)]
        squares.append(errors @ np.linalg.solve(covariance, errors) / len(legs))
        more = chi_square_of(case, simulated, found, truth) - found.chi_square
        ratios.append(more / len(found.names))
        inside.append(np.mean(np.abs(errors) < 1.96 * np.sqrt(np.diag(covariance))))
    what = "+".join(case.observed.kinds) + (
        f", {case.observed.missing:.0%} of readings missing" if case.observed.missing else ""
    )
    frames = ", frames unknown" if case.options.get("frames") else ""
    return (
        f"{case.robot:18}{what + frames:42}{np.mean(degrees):7.0f}"
        f"{np.sum(chi_squares) / np.sum(degrees):12.3f}"
        f"{np.mean(squares):13.3f}{np.mean(ratios):12.3f}{np.mean(inside):8.1%}{untrusted:10}{failed:8}"
    )


def truth_of(simulated: Simulation) -> dict[str, float]:
    """The parameters of the robot as made, by their names."""
    return {
        f"leg{leg}.{name}": value
        for leg, row in enumerate(simulated.actual.parameters.tolist(), 1)
        for name, value in zip(simulated.nominal.parameter_names, row, strict=True)
    }


def chi_square_of(
    case: Case, simulated: Simulation, found: Estimate, truth: dict[str, float]
) -> float:
    """Chi-square of observations and priors with everything but the latent poses at the truth."""
    observed = case.observed
    frames = dataclasses.replace(
        case.known,
        base=observed.base or (),
        target=observed.target or (),
        plane=observed.plane if "height" in observed.kinds else (),
    )
    actual = simulated.actual.replace(frames=frames)
    fit = Problem.of(actual, found.measurements, HELD).fit()
    priors = sum(
        ((truth[each.name] - each.nominal) / each.prior) ** 2
        for each in found.unknowns
        if np.isfinite(each.prior)
    )
    return fit.goodness.chi_square + priors


def main(robots: int, rows: list[int]) -> None:
    print(f"{robots} robots a row")
    print(
        f"{'robot':18}{'observed':42}{'degrees':>7}{'chi2/degree':>12}{'error/bound':>13}{'likelihood':>12}"
        f"{'in 95%':>8}{'untrusted':>10}{'failed':>8}"
    )
    for row in rows or range(1, len(CASES) + 1):
        print(run(CASES[row - 1], robots), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300, list(map(int, sys.argv[2:])))
