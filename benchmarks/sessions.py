# SPDX-License-Identifier: MIT
"""Sessions that differ: whether it is noticed and named, and what it costs as an unknown.

Usage: .venv/bin/python benchmarks/sessions.py [robots]

Robots that are measured in two sessions of as many poses. First sound ones: how many alarms the
tests give at 5%, and how many robots are doubted. Then robots of which the sensors were homed
anew, the device was moved, one session was noisier, or all of that, normal in size: how many are
doubted, and of these how many by the name of what differs, by that of the other block alone, or as
"one or the other". Last, with it as an unknown, how many 95% intervals of parameters and of what
the sessions have of their own hold the truth, and chi-square over its degrees of freedom.
"""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

import symkin
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.sessions import SESSIONS, session_tests

_POSES = 40


def main() -> None:
    """Print a line for each robot and kind of difference."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    for name in ("3RRR", "5bar", "hexapod_jugglebot"):
        mechanism = symkin.load(name)
        plan = symkin.plan(mechanism, _POSES, design="mechanism", candidates=2000, seed=1)
        alarms: dict[str, list[bool]] = {"noise": [], "offsets": [], "frames": []}
        doubted = []
        for seed in range(1, robots + 1):
            taken = symkin.simulate(mechanism, plan, seed, changes={"leg1.session1": 0.0})
            found = symkin.identify(mechanism, taken.measurements, "joint")
            for test in session_tests(found):
                alarms[test.what].append(test.p_value < 0.05)
            doubted.append(any(doubt.code in SESSIONS for doubt in found.doubts))
        told = ", ".join(f"{what} {100 * np.mean(each):.1f}%" for what, each in alarms.items())
        print(f"{name}, sound: {told} at 5%; doubted {100 * np.mean(doubted):.1f}%", flush=True)
        for what, changes, own in kinds(mechanism):
            print(f"{name}, {what}: {of_kind(mechanism, plan, changes, own, robots)}", flush=True)


def kinds(
    mechanism: symkin.Mechanism,
) -> Iterator[tuple[str, dict[str, float], list[str]]]:
    """What differs, its usual sizes and how it is asked for."""
    position = 4 * mechanism.noise.position
    turn = position / mechanism.characteristic_length
    reading = turn if mechanism.reading_unit == "rad" else position
    if mechanism.reading_unit == "rad" and not mechanism.legs[0].chain.startswith("["):
        reading /= abs(float(mechanism.sensor_gains[0]))
    legs = range(1, len(mechanism.legs) + 1)
    offsets = {f"leg{leg}.session1": reading for leg in legs}
    components = mechanism.space.frame_components
    names = ("x", "y", "z", "rx", "ry", "rz") if len(components) == 6 else ("x", "y", "phi")
    frames = {f"session1.{each}": position if each in ("x", "y", "z") else turn for each in names}
    yield "offsets", offsets, ["offsets"]
    yield "frames", frames, ["frames"]
    yield "noise", {"session1.noise": 0.5}, ["noise"]
    yield "all", {**offsets, **frames, "session1.noise": 0.5}, ["offsets", "frames", "noise"]


def of_kind(
    mechanism: symkin.Mechanism,
    plan: symkin.Plan,
    sizes: dict[str, float],
    own: list[str],
    robots: int,
) -> str:
    """What becomes of robots whose sessions differ so."""
    noticed, codes, held, slopes, squares = [], [], [], [], []
    for seed in range(1, robots + 1):
        random = np.random.default_rng([seed, 7])
        changes: dict[str, Any] = {
            name: float(np.exp(size * random.normal()))
            if name.endswith("noise")
            else size * random.normal()
            for name, size in sizes.items()
        }
        taken = symkin.simulate(mechanism, plan, seed, changes=changes)
        found = symkin.identify(mechanism, taken.measurements, "joint")
        doubts = [doubt.code for doubt in found.doubts if doubt.code in SESSIONS]
        noticed.append(bool(doubts))
        codes += [doubts]
        found = symkin.identify(mechanism, taken.measurements, sessions=own)
        squares.append(found.chi_square / found.degrees_of_freedom)
        known = found.mechanism.deviations
        off = (found.mechanism.parameters - taken.actual.parameters) / known
        held += (np.abs(off[np.isfinite(off)]) < found.interval).tolist()
        slopes += list(within(found, changes))
    told = [each for each in codes if each]
    shares = {
        code: 100 * np.mean([code in each for each in told])
        for code in sorted(SESSIONS)
        if any(code in each for each in told)
    }
    names = ", ".join(f"{code} {share:.0f}%" for code, share in shares.items())
    return (
        f"doubted {100 * np.mean(noticed):.0f}%, of these {names}; as an unknown intervals hold "
        f"{100 * np.mean(held):.1f}%, of the sessions' own {100 * np.mean(slopes or [np.nan]):.1f}%"
        f", chi-square per degree {np.mean(squares):.3f}"
    )


def within(found: Estimate, changes: dict[str, Any]) -> Iterator[bool]:
    """Whether intervals of what sessions have of their own hold the truth."""
    for name, true in changes.items():
        if not name.endswith("noise"):
            own = found.params[name]
            yield abs(own.value - true) < found.interval * own.deviation


if __name__ == "__main__":
    main()
