# SPDX-License-Identifier: MIT
"""What is said of wrong measurements, mistake by mistake, however one asks.

    python benchmarks/corruptions.py [ROBOTS] [MECHANISM ...] [--edits] [--only WORDS] [--way WAY]
        [--planned]

Simulates robots with errors and noise as declared, spoils the table of each in one of the ways of
`CORRUPTIONS`, asks in every way of `WAYS` (or one), and prints of how many robots the mistake was
named by its code, something else was ("wrong name"), it was doubted or refused without a cause, or
trusted; and of the trusted how many are worse than 1.5 times the same robot identified from sound
measurements, over the workspace, and whether a note says that this was taken as exact. The last
lines of a mechanism sum up, and say how long a verdict took. Poses are chosen at random, for all
legs, or planned, with a set for each leg.
"""

import argparse
import collections
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from false_alarms import WAYS, asked, made, plan_of

import symkin
from symkin.analysis.conventions import taken_as
from symkin.model.poses import (
    poses_of,
    quaternions_from_rotation_vectors,
    rotations_from_quaternions,
    rotations_from_vectors,
    vectors_from_quaternions,
    vectors_from_rotations,
)

_WORSE = 1.5
_POSES = 40
_SPARES = 12  # for those beyond the reach of a robot

Table = symkin.Measurements
Spoil = Callable[[symkin.Mechanism, Table, np.random.Generator], Table]


class Corruption(NamedTuple):
    """A change of what was measured, and the codes that name it; none if only doubt is right.

    `assumed` is what no test can see, so that a note must name it; `drawn` changes the drawing.
    """

    change: Spoil
    codes: tuple[str, ...] = ()
    where: Callable[[symkin.Mechanism], bool] = lambda _: True
    assumed: str = ""
    drawn: Callable[[symkin.Mechanism], symkin.Mechanism] = lambda robot: robot


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


def target_off(by: float) -> Spoil:
    """The target, off by so much along x of the platform."""

    def change(robot: symkin.Mechanism, values: Any, _: object) -> Any:
        size = robot.space.size
        if robot.pose_space == "planar":
            turned = np.column_stack([np.cos(values[:, 2]), np.sin(values[:, 2])])
        elif robot.space.has_quaternion:
            turned = rotations_from_quaternions(values[:, size:])[:, :, 0]
        else:
            turned = np.eye(size)[:1]
        values[:, :size] += by * turned
        return values

    return poses(change)


def scaled(share: float) -> Spoil:
    """The device's scale, off by so much."""

    def change(robot: symkin.Mechanism, values: Any, _: object) -> Any:
        values[:, : robot.space.size] *= 1 + share
        return values

    return poses(change)


def sagging(robot: symkin.Mechanism, values: Any, _: object) -> Any:
    """Half a millimetre, with the square of the distance from home."""
    away = values[:, : robot.space.size] - robot.home[: robot.space.size]
    size = np.linalg.norm(away, axis=1)
    values[:, robot.space.size - 1] -= 5e-4 * (size / size.max()) ** 2
    return values


def stretched(_: object, values: Any, __: object) -> Any:
    """As pixels do that are not square."""
    values[:, 0] += 0.01 * (values[:, 0] - values[:, 0].mean())
    return values


def sheared(_: object, values: Any, __: object) -> Any:
    """As axes measure that are 2 mrad from square."""
    values[:, 0] += 2e-3 * (values[:, 1] - values[:, 1].mean())
    return values


def bent(robot: symkin.Mechanism, values: Any, _: object) -> Any:
    """Outwards with the cube of the distance from the middle, 1% at the outermost pose."""
    places = values[:, : robot.space.size]
    away = places - places.mean(axis=0)
    squares = np.square(away).sum(axis=1, keepdims=True)
    values[:, : robot.space.size] += 0.01 * away * squares / squares.max()
    return values


def loose(robot: symkin.Mechanism, values: Any, random: np.random.Generator) -> Any:
    """A joint of the first leg that plays by 0.3 mm to either side."""
    length = robot.characteristic_length if robot.reading_unit == "rad" else 1.0
    values[:, 0] += 3e-4 / length * random.choice([-1, 1], len(values))
    return values


def drifting(_: symkin.Mechanism, values: Any, __: object) -> Any:
    """The zero of leg 1, all the way."""
    values[:, 0] += np.linspace(0, 2e-3, len(values))
    return values


def tracker_late(robot: symkin.Mechanism, values: Any, _: object) -> Any:
    """Positions that lag behind by a hundredth of the last move."""
    size = robot.space.size
    values[1:, :size] -= 0.01 * np.diff(values[:, :size], axis=0)
    return values


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


def halves(robot: symkin.Mechanism, taken: Table, random: np.random.Generator) -> Table:
    """The second half of the rows of another robot."""
    half = len(taken.poses) // 2
    later = plan_of(robot, taken.poses[half:])
    while True:  # until one takes all poses
        seed = int(random.integers(1 << 30))
        try:
            seen = symkin.simulate(robot, later, seed).measurements.for_all_legs()
            break
        except symkin.SymkinError:
            continue
    count = half + len(seen.poses)
    readings = np.concatenate([taken.readings[:half], seen.readings])
    readings[np.isnan(taken.readings[:count])] = np.nan
    measured = np.concatenate([taken.poses[:half], seen.poses])
    return replace(taken.subset(np.arange(count)), poses=measured, readings=readings)


def noisy(robot: symkin.Mechanism, values: Any, random: np.random.Generator) -> Any:
    """Noise of positions 3.2 times as large as declared."""
    size = robot.space.size
    more = math.sqrt(3.2**2 - 1) * robot.noise.position
    values[:, :size] += more * random.standard_normal((len(values), size))
    return values


def noisier(robot: symkin.Mechanism, taken: Table, random: np.random.Generator) -> Table:
    """Noise of the device five times as large, in the last two fifths of the rows."""
    size, values = robot.space.size, np.array(taken.poses)
    begin = 3 * len(values) // 5
    places = values[begin:, :size]
    places += math.sqrt(24) * robot.noise.position * random.standard_normal(places.shape)
    later = values[begin:, size:]
    turns = math.sqrt(24) * robot.noise.orientation * random.standard_normal((len(later), 3))
    if robot.space.has_quaternion:
        turned = rotations_from_vectors(turns) @ rotations_from_quaternions(later)
        later[:] = quaternions_from_rotation_vectors(vectors_from_rotations(turned))
    else:
        later += turns[:, : later.shape[1]]
    return replace(taken, poses=values)


def failing(robot: symkin.Mechanism, values: Any, random: np.random.Generator) -> Any:
    """A sensor of the first leg that is noisy in the last two fifths of the rows."""
    length = robot.characteristic_length if robot.reading_unit == "rad" else 1.0
    begin = 3 * len(values) // 5
    values[begin:, 0] += 6e-4 / length * random.standard_normal(len(values) - begin)
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


def oriented(change: Callable[[Any], Any]) -> Spoil:
    """Of the quaternions."""

    def changed(robot: symkin.Mechanism, values: Any, _: object) -> Any:
        values[:, robot.space.size :] = change(values[:, robot.space.size :])
        return values

    return poses(changed)


def roll_pitch_yaw(quaternions: Any) -> Any:
    """Angles about fixed x, y and z."""
    matrices = rotations_from_quaternions(quaternions)
    return np.column_stack(
        [
            np.arctan2(matrices[:, 2, 1], matrices[:, 2, 2]),
            -np.arcsin(matrices[:, 2, 0]),
            np.arctan2(matrices[:, 1, 0], matrices[:, 0, 0]),
        ]
    )


def turned(angles: Any, order: tuple[int, ...]) -> Any:
    """Quaternions of angles about fixed axes, in some order."""
    motion = np.eye(3)[None]
    for axis in order:
        motion = rotations_from_vectors(angles[:, [axis]] * np.eye(3)[axis]) @ motion
    return quaternions_from_rotation_vectors(vectors_from_rotations(motion))


def of_other_end(robot: symkin.Mechanism, values: Any, _: object) -> Any:
    """The base as the platform sees it."""
    space = robot.pose_space
    return poses_of(space, taken_as("inverse", values, space))


def spatial(robot: symkin.Mechanism) -> bool:
    return robot.space.has_quaternion


def angular(robot: symkin.Mechanism) -> bool:
    return bool(robot.reading_unit == "rad")


def translating(robot: symkin.Mechanism) -> bool:
    return robot.space.size > 1


def mistyped(robot: symkin.Mechanism, values: Any, random: np.random.Generator) -> Any:
    """One position of one row without its decimal point."""
    values[random.integers(len(values)), random.integers(robot.space.size)] *= 1e3
    return values


def lost(_: symkin.Mechanism, taken: Table, random: np.random.Generator) -> Table:
    """The readings of one row, so that those after it stand a row early."""
    begin = int(random.integers(10, len(taken.poses) - 10))
    values = np.delete(taken.readings, begin, axis=0)
    return replace(taken.subset(np.arange(len(values))), readings=values)


def exchanged_legs(_: symkin.Mechanism, values: Any, __: object) -> Any:
    """The columns of legs 1 and 2."""
    values[:, [0, 1]] = values[:, [1, 0]]
    return values


def longer(times: float) -> Callable[[symkin.Mechanism], symkin.Mechanism]:
    """Draw the last length or radius that all legs have so many times as long in all of them."""

    def drawn(robot: symkin.Mechanism) -> symkin.Mechanism:
        parameters = robot.parameters.copy()
        parameters[:, lengths(robot)[-1]] *= times
        return robot.with_parameters(parameters, symmetry=None)

    return drawn


def lengths(robot: symkin.Mechanism) -> list[int]:
    """Parameters that are lengths or radii, identified in all legs."""
    legs = range(len(robot.legs))
    return [
        place
        for place in range(len(robot.parameter_names))
        if all(robot.parameter_roles(leg)[place].kind in ("length", "radius") for leg in legs)
        and robot.is_estimated[:, place].all()
    ]


def as_measured(_: symkin.Mechanism, taken: Table, __: np.random.Generator) -> Table:
    return taken


FRAME = ("frame-not-as-drawn", "moved-together")
DISTORTED = "device-distorted"
CONVENTION = ("convention-of-poses",)
# Those of the table: an edit puts them right.
EDITS: Mapping[str, Corruption] = {
    "all legs a row late": Corruption(late(None, 1), ("rows-shifted",)),
    "one leg a row late": Corruption(late(1, 1), ("rows-shifted",)),
    "two legs a row late": Corruption(late(2, 1), ("rows-shifted",)),
    "all legs three rows late": Corruption(late(None, 3), ("rows-shifted",)),
    "a sign": Corruption(first(np.negative), ("opposite-sign",)),
    "two legs exchanged": Corruption(readings(exchanged_legs), ("columns-exchanged",)),
    "a leg in degrees": Corruption(first(np.degrees), ("unit-of-readings",), angular),
    "a leg in millimetres": Corruption(
        first(lambda r: 1e3 * r), ("unit-of-readings",), lambda robot: not angular(robot)
    ),
    "positions in millimetres": Corruption(scaled(999), ("unit-of-lengths",), translating),
    "positions in centimetres": Corruption(scaled(99), ("unit-of-lengths",), translating),
    "millimetres in half the rows": Corruption(rows_of(1e3), ("rows-in-another-unit",)),
    "y negated, orientation kept": Corruption(signs(1), CONVENTION),
    "x and y exchanged": Corruption(poses(exchanged), CONVENTION),
    "poses sorted": Corruption(by_x, ("rows-out-of-order",)),
    "a leg's column sorted": Corruption(first(np.sort), ("rows-out-of-order",)),
    "the angle negated": Corruption(signs(2), CONVENTION, lambda r: r.pose_space == "planar"),
    "quaternions w first": Corruption(
        oriented(lambda q: np.roll(q, 1, axis=1)), CONVENTION, spatial
    ),
    "quaternions of the inverse": Corruption(
        oriented(lambda q: q * [-1, -1, -1, 1]), CONVENTION, spatial
    ),
    "roll, pitch, yaw as rotation vectors": Corruption(
        oriented(lambda q: quaternions_from_rotation_vectors(roll_pitch_yaw(q))),
        CONVENTION,
        spatial,
    ),
    "rotation vectors as roll, pitch, yaw": Corruption(
        oriented(lambda q: turned(vectors_from_quaternions(q), (0, 1, 2))), CONVENTION, spatial
    ),
    "roll, pitch, yaw in reversed order": Corruption(
        oriented(lambda q: turned(roll_pitch_yaw(q), (2, 1, 0))), CONVENTION, spatial
    ),
    "the readings of a row lost": Corruption(lost, ("rows-shifted",)),
    "a position mistyped": Corruption(
        poses(mistyped), ("rows-far-off", "gross-errors", "rows-in-another-unit"), translating
    ),
    "poses of the other end": Corruption(
        poses(of_other_end), CONVENTION, lambda r: r.space.moves and r.space.turns
    ),
}
CORRUPTIONS: Mapping[str, Corruption] = {
    **EDITS,
    "a leg's column copied": Corruption(
        readings(lambda _, r, __: r[:, [0, 0, *range(2, r.shape[1])]]), ("columns-copied",)
    ),
    "a sensor not read": Corruption(first(lambda r: np.full_like(r, r[0])), ("stands-still",)),
    "a sensor not read in four rows": Corruption(
        first(lambda r: np.concatenate([r[:9], np.full(4, r[9]), r[13:]])), ("stands-still",)
    ),
    "half the file twice": Corruption(twice, ("rows-copied",)),
    "half the rows of another robot": Corruption(halves, ("rows-of-another-robot",)),
    "a leg read twice as far": Corruption(first(lambda r: 2 * r), ("gain",)),
    "the target 20 mm off": Corruption(target_off(0.02), FRAME),
    "the target 0.5 mm off": Corruption(target_off(5e-4), FRAME, assumed="target"),
    "device scale 2000 ppm": Corruption(scaled(2e-3), (*FRAME, DISTORTED), assumed="scale"),
    "device scale 200 ppm": Corruption(scaled(2e-4), (*FRAME, DISTORTED), assumed="scale"),
    "device 1% longer along x": Corruption(
        poses(stretched), (DISTORTED,), translating, assumed="a measuring device"
    ),
    "device 2 mrad from square": Corruption(
        poses(sheared), (DISTORTED,), translating, assumed="a measuring device"
    ),
    "device bent as by a lens, 1%": Corruption(
        poses(bent), (DISTORTED,), translating, assumed="a measuring device"
    ),
    "backlash 0.5 mm": Corruption(backlash(5e-4), ("has-backlash",)),
    "backlash 0.1 mm": Corruption(backlash(1e-4), ("has-backlash",), assumed="backlash"),
    # On average over the rows a longer metre.
    "growth 500 ppm": Corruption(growing(5e-4), ("grows",), assumed="scale"),
    "growth 50 ppm": Corruption(growing(5e-5), ("grows",), assumed="scale"),
    "sag": Corruption(poses(sagging), ("sags",), assumed="sag"),
    "a loose joint": Corruption(readings(loose), ("readings-scatter",), assumed="play"),
    "a sensor noisier from a row on": Corruption(readings(failing), ("readings-scatter",)),
    "the device noisier from a row on": Corruption(noisier, ("rows-scatter",)),
    "coarse readings": Corruption(
        readings(lambda _, r, __: np.round(r / np.ptp(r, axis=0) * 64) * np.ptp(r, axis=0) / 64),
        ("readings-coarse",),
    ),
    "the tracker late": Corruption(poses(tracker_late), ("lags",)),
    "the zero slips by 2 mrad or mm": Corruption(readings(slipping), ("steps",)),
    "the zero drifts by 2 mrad or mm": Corruption(readings(drifting), ("drifts",)),
    "a length drawn a tenth too long": Corruption(
        as_measured, ("drawn-wrong",), lambda robot: bool(lengths(robot)), drawn=longer(1.1)
    ),
    "a length drawn in inches": Corruption(
        as_measured, ("drawn-wrong",), lambda robot: bool(lengths(robot)), drawn=longer(1 / 25.4)
    ),
    "noise 3.2 times": Corruption(poses(noisy), ("residuals-large",)),
}
# Mistakes that positions alone do not have.
_ORIENTED = ("quaternions", "roll,", "rotation vectors", "the angle", "poses of the other end")
OF_ORIENTATIONS = {what for what in EDITS if what.startswith(_ORIENTED)}
# Nothing that an edit puts right: no mistake of the table is to be named.
NAMES = {code for each in EDITS.values() for code in each.codes}


def main() -> None:
    """Print a line for each mechanism, mistake and way of asking."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("robots", nargs="?", type=int, default=20)
    parser.add_argument("mechanisms", nargs="*", default=["3RRR", "rotary_delta"])
    parser.add_argument("--edits", action="store_true", help="mistakes of the table alone")
    parser.add_argument("--only", default="", help="words of the mistakes")
    parser.add_argument("--way", choices=list(WAYS), help="of asking")
    parser.add_argument("--planned", action="store_true", help="poses, with a set for each leg")
    asked_for = parser.parse_args()
    for name in asked_for.mechanisms:
        robot = symkin.load_mechanism(name)
        sample = symkin.sample_workspace(robot, 2000, seed=1)
        plan = symkin.make_plan(robot, sample, seed=1) if asked_for.planned else None
        pooled: collections.Counter[str] = collections.Counter()
        total: collections.Counter[str] = collections.Counter()
        spent: list[float] = []
        for what, corruption in CORRUPTIONS.items():
            left_out = asked_for.edits and what not in EDITS
            if left_out or asked_for.only not in what or not corruption.where(robot):
                continue
            for way in [asked_for.way] if asked_for.way else WAYS:
                if way == "positions" and what in OF_ORIENTATIONS:
                    continue
                counts: collections.Counter[str] = collections.Counter()
                for seed in range(asked_for.robots):
                    began = time.process_time()
                    said = verdict(robot, sample.poses, corruption, seed, way, plan)
                    spent.append(time.process_time() - began)
                    counts[said] += 1
                print(f"{name}, {what}, {way}: {listed(counts)}", flush=True)
                total += counts
                if what in EDITS:
                    pooled += counts
        right, every = pooled["named"], sum(pooled.values())
        if every:
            print(
                f"{name}: of mistakes of the table {right} of {every} named, "
                f"{pooled['wrong name']} by a wrong name"
            )
        if not spent:
            continue
        print(f"{name}, all: {listed(total)}")
        print(
            f"{name}: a verdict takes {np.median(spent):.2f} s of processor, at most "
            f"{max(spent):.2f} s",
            flush=True,
        )


def listed(counts: Mapping[str, int]) -> str:
    """How many robots each was said of."""
    return ", ".join(f"{word} {count}" for word, count in sorted(counts.items()))


def verdict(
    robot: symkin.Mechanism,
    sample: Any,
    corruption: Corruption,
    seed: int,
    way: str,
    plan: symkin.Plan | None = None,
) -> str:
    """What is said of one robot."""
    random = np.random.default_rng(seed)
    chosen = sample[random.permutation(len(sample))[: _POSES + _SPARES]]
    actual = made(robot, way, seed)
    own = plan_of(robot, chosen, _SPARES) if plan is None else plan
    sound = symkin.simulate(robot, own, seed, actual).measurements
    sound = sound.for_all_legs() if plan is None else sound
    wrong = corruption.change(robot, sound, random)
    options = asked(robot, way)
    if way == "positions":
        kept = np.where(np.arange(sound.poses.shape[1]) < robot.space.size, 1.0, np.nan)
        sound, wrong = (replace(each, poses=each.poses * kept) for each in (sound, wrong))
    try:
        found = symkin.identify(corruption.drawn(robot), wrong, **options)
    except symkin.SymkinError as error:
        cause = error.likely_cause
        return named((cause,) if cause else (), corruption) or "refused"
    if not found.trustworthy:
        return named(found.doubts, corruption) or "doubted"
    errors = [
        symkin.evaluate(each.mechanism.replace(frames=None, curvature=None), actual=actual,
                        poses=sample[:200]).position_rms
        for each in (found, symkin.identify(robot, sound, **options))
    ]  # fmt: skip
    if errors[0] <= _WORSE * errors[1]:
        return "trusted"
    codes = ("held-as-exact", "unseen")
    noted = any(corruption.assumed in note.cause for note in found.notes if note.code in codes)
    return "trusted, worse, as noted" if corruption.assumed and noted else "trusted, worse"


def named(doubts: tuple[Any, ...], corruption: Corruption) -> str:
    """Whether the mistake is named by its code, or a mistake of the table that there is not."""
    codes = {each.code for doubt in doubts for each in (doubt, *doubt.others)}
    if codes & set(corruption.codes):
        return "named"
    return "wrong name" if codes & NAMES or any(doubt.is_cause for doubt in doubts) else ""


if __name__ == "__main__":
    main()
