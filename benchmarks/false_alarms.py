# SPDX-License-Identifier: MIT
"""How often sound robots are doubted, however one asks, by the code of the doubt.

    python benchmarks/false_alarms.py [ROBOTS] [MECHANISM ...]

Simulates robots with errors and noise as declared, identifies them in every way of `WAYS`, from
planned poses and from random ones, and prints for each code which share of robots it is raised for.
All together must stay below 1%. Of mechanisms in space 300 robots will do.
"""

import collections
import sys
from typing import Any

import numpy as np

import symkin
from symkin.planning.made import disturb

WAYS: dict[str, dict[str, Any]] = {
    "implicit": {},
    "joint": {"estimator": "joint"},
    "prior": {"prior": "tolerances"},
    "frames": {"frames": ["base", "target"]},
    "curved": {"sensor": "quadratic"},
    "positions": {},
    "fixed": {"fixed": ["sensor_gain"]},
    "shared": {"shared": ["sensor_gain"]},
    "robust": {"loss": "huber", "prior": "tolerances"},
}
_RANDOM = 60  # poses
_SPARES = 12  # for those beyond the reach of a robot


def main() -> None:
    """Print a line for each mechanism, kind of poses and way of asking."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    for name in sys.argv[2:] or ["3RRR", "5bar", "3PRR"]:
        mechanism = symkin.load_mechanism(name)
        sample = symkin.sample_workspace(mechanism, 6000, 1)
        planned = symkin.make_plan(mechanism, sample, seed=1)
        at_random = plan_of(mechanism, sample.poses[: _RANDOM + _SPARES], _SPARES)
        for kind, plan in {"planned": planned, "random": at_random}.items():
            alarms: dict[str, collections.Counter[str]] = {
                way: collections.Counter() for way in WAYS
            }
            for seed in range(robots):
                for way, counts in alarms.items():
                    counts.update(codes(mechanism, plan, seed, way))
            for way, counts in alarms.items():
                shares = ", ".join(
                    f"{code} {100 * count / robots:.2f}%" for code, count in sorted(counts.items())
                )
                print(f"{name}, {kind}, {way}, {robots} robots: {shares or 'none'}", flush=True)


def plan_of(mechanism: symkin.Mechanism, poses: np.ndarray, spares: int = 0) -> symkin.Plan:
    """A user's own poses, for all legs, the last of them to spare."""
    count = len(poses)
    spare = np.arange(count) >= count - spares
    legs, readings = np.full(count, -1), mechanism.inverse_kinematics(poses)
    return symkin.Plan(mechanism, legs, np.arange(count), spare, poses, readings)


def asked(mechanism: symkin.Mechanism, way: str) -> dict[str, Any]:
    """Arguments of `identify`; a target on a platform that never turns is the base's frame."""
    options = dict(WAYS[way])
    if "frames" in options and not mechanism.space.turns:
        options["frames"] = ["base"]
    return options


def made(mechanism: symkin.Mechanism, way: str, seed: int) -> symkin.Mechanism:
    """The robot as made: gains that are asked for as held or shared are so."""
    actual = disturb(mechanism, seed)
    if way not in ("fixed", "shared"):
        return actual
    gain, parameters = mechanism.parameter_names.index("sensor_gain"), actual.parameters.copy()
    drawn = mechanism.parameters[:, gain]
    times = np.mean(parameters[:, gain] / drawn) if way == "shared" else 1.0
    parameters[:, gain] = times * drawn
    return actual.with_parameters(parameters)


def codes(mechanism: symkin.Mechanism, plan: symkin.Plan, seed: int, way: str) -> set[str]:
    """What is said of one robot, and "any" if it is anything."""
    observed = "position" if way == "positions" else "pose"
    actual = made(mechanism, way, seed)
    simulated = symkin.simulate(mechanism, plan, seed, actual, observe=observed)
    taken = simulated.measurements.for_all_legs()
    try:
        found = symkin.identify(mechanism, taken, **asked(mechanism, way))
    except symkin.SymkinError:
        return {"refused", "any"}
    said = {doubt.code for doubt in found.doubts}
    said |= set() if found.converged else {"not converged"}
    return said | ({"any"} if said else set())


if __name__ == "__main__":
    main()
