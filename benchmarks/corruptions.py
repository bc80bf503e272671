# SPDX-License-Identifier: MIT
"""What is said of wrong measurements, mistake by mistake, however one asks.

    python benchmarks/corruptions.py [ROBOTS] [MECHANISM ...]

Simulates robots with errors and noise as declared, spoils the table of each in one of the ways of
`CORRUPTIONS`, asks in every way of `WAYS`, and prints how many robots had the mistake named by its
code, were doubted (or refused) for another reason, or were trusted; and of the trusted how many
are worse than 1.5 times the same robot identified from sound measurements, over the workspace.
"""

import collections
import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from false_alarms import WAYS, asked, plan_of

import symkin
from symkin.model.poses import quaternions_from_rotation_vectors

_WORSE = 1.5
_POSES = 40

Table = symkin.Measurements
Spoil = Callable[[symkin.Mechanism, Table, np.random.Generator], Table]


class Corruption(NamedTuple):
    """A change of what was measured, and the codes that name it; none if only doubt is right."""

    change: Spoil
    codes: tuple[str, ...] = ()


def readings(change: Callable[..., Any]) -> Spoil:
    """Of the readings alone."""

    def changed(robot: symkin.Mechanism, taken: Table, random: np.random.Generator) -> Table:
        return replace(taken, readings=change(robot, np.array(taken.readings), random))

    return changed


def poses(change: Callable[..., Any]) -> Spoil:
    """Of the poses alone."""

    def changed(robot: symkin.Mechanism, taken: Table, random: np.random.Generator) -> Table:
        return replace(taken, poses=change(robot, np.array(taken.poses), random))

    return changed


def late(legs: int | None, rows: int) -> Spoil:
    """Readings of the first legs, or of all, that stand some rows late."""

    def changed(_: symkin.Mechanism, taken: Table, __: np.random.Generator) -> Table:
        values = np.array(taken.readings)
        values[:, :legs] = np.roll(values[:, :legs], rows, axis=0)
        return replace(taken, readings=values).subset(np.arange(rows, len(values)))

    return changed


def backlash(size: float) -> Spoil:
    """Half of it to either side, by the last move."""

    def change(robot: symkin.Mechanism, values: Any, _: object) -> Any:
        side = np.sign(np.diff(values, axis=0, prepend=values[:1]))
        gains = robot.sensor_gains if robot.reading_unit == "rad" else 1.0
        length = robot.characteristic_length if robot.reading_unit == "rad" else 1.0
        return values + 0.5 * size / length * side / np.abs(gains)

    return readings(change)


def growing(share: float) -> Spoil:
    """Positions that grow from the first row to the last."""

    def change(robot: symkin.Mechanism, values: Any, _: object) -> Any:
        size = robot.space.size
        values[:, :size] *= 1 + share * np.linspace(0, 1, len(values))[:, None]
        return values

    return poses(change)


def rows_of(factor: float) -> Spoil:
    """Positions of every second row, in another unit."""

    def change(robot: symkin.Mechanism, values: Any, _: object) -> Any:
        values[::2, : robot.space.size] *= factor
        return values

    return poses(change)


def moved(by: float) -> Spoil:
    """The target, off by so much along x of the platform, as far as it is told from the base."""

    def change(_: symkin.Mechanism, values: Any, __: object) -> Any:
        values[:, 0] += by
        return values

    return poses(change)


def signs(*columns: int) -> Spoil:
    """The opposite sign of some columns of the poses."""

    def change(_: symkin.Mechanism, values: Any, __: object) -> Any:
        values[:, columns] *= -1
        return values

    return poses(change)


def exchanged(_: symkin.Mechanism, values: Any, __: object) -> Any:
    """The columns of x and y."""
    values[:, [0, 1]] = values[:, [1, 0]]
    return values


def by_x(_: symkin.Mechanism, taken: Table, __: np.random.Generator) -> Table:
    """Poses sorted by x, and readings not."""
    return replace(taken, poses=taken.poses[np.argsort(taken.poses[:, 0])])


def twice(_: symkin.Mechanism, taken: Table, __: np.random.Generator) -> Table:
    """The first half of the rows two times."""
    half = len(taken.poses) // 2
    return taken.subset(np.tile(np.arange(half), 2))


def noisy(robot: symkin.Mechanism, values: Any, random: np.random.Generator) -> Any:
    """Noise of positions 3.2 times as large as declared."""
    size = robot.space.size
    more = math.sqrt(3.2**2 - 1) * robot.noise.position
    values[:, :size] += more * random.standard_normal((len(values), size))
    return values


def slipping(_: symkin.Mechanism, values: Any, __: object) -> Any:
    """The zero of leg 1, from the middle on."""
    values[len(values) // 2 :, 0] += 2e-3
    return values


def first(change: Callable[[Any], Any]) -> Spoil:
    """Of the first leg's readings."""

    def of_all(_: symkin.Mechanism, values: Any, __: object) -> Any:
        values[:, 0] = change(values[:, 0])
        return values

    return readings(of_all)


def rotation_vectors(_: symkin.Mechanism, values: Any, __: object) -> Any:
    """Quaternions made of their own vector part, as of rotation vectors."""
    values[:, 3:] = quaternions_from_rotation_vectors(values[:, 3:6])
    return values


CORRUPTIONS: Mapping[str, Corruption] = {
    "all legs a row late": Corruption(late(None, 1), ("rows-shifted",)),
    "one leg a row late": Corruption(late(1, 1), ("rows-shifted",)),
    "two legs a row late": Corruption(late(2, 1), ("rows-shifted",)),
    "backlash 0.5 mm": Corruption(backlash(5e-4)),
    "growth 500 ppm": Corruption(growing(5e-4)),
    "coarse readings": Corruption(
        readings(lambda _, r, __: np.round(r / (np.ptp(r) / 64)) * (np.ptp(r) / 64)),
        ("readings-coarse",),
    ),
    "a leg read twice as far": Corruption(first(lambda r: 2 * r), ("gain",)),
    "target or base 20 mm off": Corruption(moved(0.02), ("frame-not-as-drawn", "moved-together")),
    "y negated, orientation kept": Corruption(signs(1), ("convention-of-poses",)),
    "x and y exchanged": Corruption(poses(exchanged), ("convention-of-poses",)),
    "poses sorted": Corruption(by_x),
    "one column sorted": Corruption(first(np.sort)),
    "half the file twice": Corruption(twice, ("rows-copied",)),
    "millimetres in half the rows": Corruption(rows_of(1e3), ("rows-in-another-unit",)),
    "one leg in degrees": Corruption(first(np.degrees), ("unit-of-readings",)),
    "quaternions as rotation vectors": Corruption(poses(rotation_vectors)),
    "the zero slips by 2 mrad or mm": Corruption(readings(slipping)),
    "noise 3.2 times": Corruption(poses(noisy), ("residuals-large",)),
}


def main() -> None:
    """Print a line for each mechanism, mistake and way of asking."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    for name in sys.argv[2:] or ["3RRR", "rotary_delta"]:
        robot = symkin.load_mechanism(name)
        sample = symkin.sample_workspace(robot, 2000, seed=1)
        for what, corruption in CORRUPTIONS.items():
            if what == "one leg in degrees" and robot.reading_unit != "rad":
                continue
            if "quaternion" in what and not robot.space.has_quaternion:
                continue
            for way in WAYS:
                counts: collections.Counter[str] = collections.Counter()
                for seed in range(robots):
                    counts[verdict(robot, sample.poses, corruption, seed, way)] += 1
                told = ", ".join(f"{word} {count}" for word, count in sorted(counts.items()))
                print(f"{name}, {what}, {way}: {told}", flush=True)


def verdict(
    robot: symkin.Mechanism, sample: Any, corruption: Corruption, seed: int, way: str
) -> str:
    """What is said of one robot."""
    random = np.random.default_rng(seed)
    chosen = sample[random.permutation(len(sample))[:_POSES]]
    made = symkin.simulate(robot, plan_of(robot, chosen), seed)
    sound = made.measurements.for_all_legs()
    wrong = corruption.change(robot, sound, random)
    options = asked(robot, way)
    if way == "positions":
        kept = np.where(np.arange(sound.poses.shape[1]) < robot.space.size, 1.0, np.nan)
        sound, wrong = (replace(each, poses=each.poses * kept) for each in (sound, wrong))
    try:
        found = symkin.identify(robot, wrong, **options)
    except symkin.SymkinError as error:
        code = getattr(error.likely_cause, "code", "")
        return "named" if code in corruption.codes else "refused"
    if not found.trustworthy:
        codes = {doubt.code for doubt in found.doubts}
        return "named" if codes & set(corruption.codes) else "doubted"
    errors = [
        symkin.evaluate(each.mechanism.replace(frames=None, curvature=None), actual=made.actual,
                        poses=sample[:200]).position_rms
        for each in (found, symkin.identify(robot, sound, **options))
    ]  # fmt: skip
    return "trusted, worse" if errors[0] > _WORSE * errors[1] else "trusted"


if __name__ == "__main__":
    main()
