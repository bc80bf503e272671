# SPDX-License-Identifier: MIT
"""Whether guided measuring pays: sessions on simulated robots, with what goes wrong in one.

    .venv/bin/python benchmarks/guided.py --sessions 40

Each session is a robot of its own, made within the tolerances, and decides by itself (`resolve`).
Met is the share of the sessions whose robot really keeps the accuracy, over the workspace; alarmed
that in which a row or a slip was doubted; found after: rows from a slip until it was found.
"""

import argparse
import time

import numpy as np

import symkin
from symkin.guided import SimulatedDevice
from symkin.model.settings import Tolerances
from symkin.planning.simulation import disturb

MOST = 120  # tries
SLIPS_AT = 14
KINDS = ("sound", "failures", "region", "tolerances", "slip")


def session_of(kind: str, robot, seed: int, accuracy: float, candidates: int) -> dict[str, float]:
    """One session; what came of it."""
    tolerances = vars(robot.tolerances)
    drawn = robot
    if kind == "tolerances":
        drawn = robot.replace(tolerances=Tolerances(**{k: 3 * v for k, v in tolerances.items()}))
    actual = disturb(drawn, seed)
    device = SimulatedDevice(robot, seed, actual, lost=0.1 if kind == "failures" else 0.0)
    session = robot.measure(accuracy, candidates=candidates, seed=seed)
    sample = robot.sample_workspace(1000, seed=1).poses
    direction = np.random.default_rng(seed).normal(size=robot.space.size)
    along = sample[:, : robot.space.size] @ direction
    hidden = np.quantile(along, 0.85) if kind == "region" else np.inf
    slip = 5 * max(robot.noise.reading, robot.noise.orientation)
    column = next(name for name in session.columns if name.startswith("psi_2"))
    counts = {"tries": 0, "alarms": 0, "found": np.nan, "asked": 0}
    waited = []
    for ask in session:
        counts["tries"] += 1
        if counts["tries"] > MOST:
            break
        counts["asked"] += 1
        found = device(ask)
        if ask.pose[: robot.space.size] @ direction > hidden:
            found = "occluded"
        begin = time.perf_counter()
        if isinstance(found, str):
            session.fail(found)
            if session.suggests_avoiding:
                session.avoid()
        else:
            slipped = kind == "slip" and session.progress.rows + 1 >= SLIPS_AT
            session.add(found | {column: found[column] + slip * slipped})
            verdict = session.resolve()
            counts["alarms"] += not verdict.fine
            if verdict.slipped is not None and np.isnan(counts["found"]):
                counts["found"] = session.progress.rows - SLIPS_AT + 1
        waited.append(time.perf_counter() - begin)
    if kind == "slip":  # which the robot keeps: what its sensors show now
        parameters = np.array(actual.parameters)
        names = actual.parameter_names
        gain = parameters[1, names.index("sensor_gain")]
        parameters[1, names.index("sensor_offset")] -= gain * slip
        actual = actual.with_parameters(parameters, symmetry=None)
    met = False
    if session.estimate is not None and session.progress.reached:
        error = symkin.evaluate(session.estimate.mechanism, actual=actual, poses=sample)
        met = error.position_rms <= accuracy
    return counts | {
        "rows": session.progress.rows,
        "met": met,
        "reached": session.progress.reached,
        "alarmed": counts["alarms"] > 0,
        "seconds": float(np.median(waited)),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="3RRR")
    parser.add_argument("--accuracy", type=float, default=1e-4, help="m")
    parser.add_argument("--sessions", type=int, default=40)
    parser.add_argument("--candidates", type=int, default=500)
    parser.add_argument("--kinds", nargs="*", default=KINDS, choices=KINDS)
    given = parser.parse_args()
    robot = symkin.load(given.robot)
    print(f"{given.robot}, {given.sessions} sessions each, accuracy {1e3 * given.accuracy:g} mm")
    print("                  rows  tries  reached    met  alarmed  found after  seconds a row")
    for kind in given.kinds:
        found = [
            session_of(kind, robot, seed, given.accuracy, given.candidates)
            for seed in range(1, given.sessions + 1)
        ]
        mean = {name: np.nanmean([each[name] for each in found]) for name in found[0]
                if name != "found"}  # fmt: skip
        delays = [each["found"] for each in found if np.isfinite(each["found"])]
        after = f"{np.median(delays):.0f} ({len(delays)})" if delays else "-"
        print(
            f"{kind:15s} {mean['rows']:6.1f} {mean['tries']:6.1f} {mean['reached']:8.0%} "
            f"{mean['met']:6.0%} {mean['alarmed']:8.0%} {after:>12s} {mean['seconds']:14.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
