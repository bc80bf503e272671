# SPDX-License-Identifier: MIT
"""How well delta printers are calibrated from heights at which a probe touched their beds.

    python benchmarks/probing.py [ROBOTS]

Each robot differs from the shipped linear delta by its tolerances. It touches a tilted bed at 36
planned points, which scatter by 10 um, and its steppers report steps of 1/80 mm. Prints, for
parameters as loose as shipped and for a printer that was built with care: what the heights show
and how often that is within 3 deviations, the heights before and after, and the size of prints
before, after, and with one length that was measured with calipers.
"""

from __future__ import annotations

import dataclasses
import sys
from collections import Counter

import numpy as np
from numpy.typing import NDArray

import symkin
from symkin.analysis.probing import CALIPER, PrintedLength, with_printed_length
from symkin.estimate.precision import in_words
from symkin.model.settings import NoiseSettings
from symkin.planning.simulation import disturb

Array = NDArray[np.float64]

STEP = 1e-3 / 80
LENGTH = 0.1
BUILT = {"as shipped": {}, "built with care": {"angle": 1e-3, "gain": 2e-4}}


def touched(
    nominal: symkin.Mechanism, actual: symkin.Mechanism, points: Array, seed: int
) -> symkin.Measurements:
    """What the steppers report where the probe touches a bed that is tilted and off."""
    random = np.random.default_rng([seed, 1])
    c0, c1, c2 = random.normal(0, [3e-4, 3e-3, 3e-3])
    poses = np.column_stack([points, c0 + points @ [c1, c2]])
    poses[:, 2] += random.normal(0, nominal.noise.position, len(poses))
    readings = np.round(actual.inverse_kinematics(poses) / STEP) * STEP
    nothing = np.full(poses.shape, np.nan)
    return symkin.Measurements.of(
        nothing,
        readings,
        reading_unit="m",
        pose_space="translating",
        heights=np.zeros(len(poses)),
    )


def printed(believed: symkin.Mechanism, actual: symkin.Mechanism, angle: float) -> float:
    """How long a piece of 100 mm becomes if the controller believes in a mechanism."""
    end = LENGTH / 2 * np.array([np.cos(angle), np.sin(angle), 0.0])
    readings = believed.replace(frames=None).inverse_kinematics(np.array([-end, end]))
    poses, _ = actual.forward_kinematics(readings)
    return float(np.linalg.norm(poses[1] - poses[0]))


def size_errors(believed: symkin.Mechanism, actual: symkin.Mechanism) -> list[float]:
    """Errors of the printed length in six directions, m."""
    angles = np.pi * np.arange(6) / 6
    return [printed(believed, actual, angle) - LENGTH for angle in angles]


def errors_of_shown(
    found: symkin.estimate.Estimate, actual: symkin.Mechanism
) -> tuple[list[float], list[str], list[str]]:
    """Errors of what the heights show, in deviations, and the names of what is shown or not."""
    truth = dict(zip(actual.parameter_names, actual.parameters.T, strict=True))
    values = dict(zip(actual.parameter_names, found.mechanism.parameters.T, strict=True))
    covariance, errors, names, hidden = np.asarray(found.covariance), [], [], []
    for kind in found.heights.shown:
        columns = [i for i, name in enumerate(found.names) if name.endswith(f".{kind.parameter}")]
        own = covariance[np.ix_(columns, columns)]
        off = values[kind.parameter] - truth[kind.parameter]
        off = (off + np.pi) % (2 * np.pi) - np.pi if kind.parameter == "base_azimuth" else off
        mean = np.full(len(off), 1 / len(off))
        apart = np.eye(len(off)) - mean
        for known, rows, what in ((kind.common, mean[None], ""), (kind.between, apart, " between")):
            if in_words(known) == "shown":
                errors += [row @ off / np.sqrt(row @ own @ row) for row in rows]
                names.append(kind.parameter + what)
        if not kind.is_shown:
            hidden.append(kind.parameter)
    return errors, names, hidden


def rms(values: list[float]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def main() -> None:
    """Print a paragraph for each way of building."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    shipped = symkin.load_mechanism("linear_delta")
    for how, tolerances in BUILT.items():
        nominal = shipped.replace(
            noise=NoiseSettings(1e-5, 0.0, STEP / np.sqrt(12)),
            tolerances=dataclasses.replace(shipped.tolerances, **tolerances),
        )
        sample = symkin.sample_workspace(nominal, 2000, 1)
        plan = symkin.make_plan(
            nominal, sample, 36, observe="height", minimum_distance=5e-3, spares=0
        )
        size: dict[str, list[float]] = {"before": [], "after": [], "with a length": []}
        heights: dict[str, list[float]] = {"before": [], "after": []}
        promised: dict[str, list[float]] = {"before": [], "after": [], "with a length": []}
        errors: list[float] = []
        shown: Counter[str] = Counter()
        hidden: Counter[str] = Counter()
        doubted = 0
        for seed in range(robots):
            actual = disturb(nominal, seed)
            measured = touched(nominal, actual, plan.poses[:, :2], seed)
            found = symkin.identify(nominal, measured)
            random = np.random.default_rng([seed, 2])
            length = printed(nominal, actual, 0.0) + random.normal(0, CALIPER)
            with_length = symkin.identify(
                nominal, with_printed_length(nominal, measured, PrintedLength(LENGTH, length))
            )
            doubted += not (found.trustworthy and with_length.trustworthy)
            if found.heights is None:
                continue
            off, names, silent = errors_of_shown(found, actual)
            errors += off
            shown.update(names)
            hidden.update(silent)
            heights["before"].append(found.heights.before)
            heights["after"].append(found.heights.after)
            promised["before"].append(found.heights.size_before)
            promised["after"].append(found.heights.size_after)
            promised["with a length"].append(found.heights.size_with_length)
            size["before"] += size_errors(nominal, actual)
            size["after"] += size_errors(found.mechanism, actual)
            size["with a length"] += size_errors(with_length.mechanism, actual)
        within = float(np.mean(np.abs(errors) < 3)) if errors else float("nan")
        print(f"{how}, {robots} robots, {len(plan.poses)} points, {doubted} not trusted")
        print(f"  shown, within 3 deviations in {100 * within:.2f}%: {dict(shown)}")
        print(f"  named as not shown: {dict(hidden)}")
        for what, of, factor in (
            ("height, rms, um", heights, 1e6),
            ("size of 100 mm, rms error, mm", size, 1e3),
            ("the same, promised", promised, 1e2),
        ):
            told = ", ".join(f"{when} {factor * rms(each):.3g}" for when, each in of.items())
            print(f"  {what}: {told}", flush=True)


if __name__ == "__main__":
    main()
