# SPDX-License-Identifier: MIT
"""How often the right correction of a mistake is proposed, leg by leg and where `joint` is needed.

    python benchmarks/hypotheses.py [ROBOTS] [PROCESSES] [CASE ...]

Simulates robots with errors and noise as declared, makes one mistake with each robot's data, or two
at once, and identifies. A row prints in how many of the robots the right correction was proposed
(alone, or with others that the data cannot tell from it), only wrong ones, or none, and the numbers
of the first robots of the last two and of sound ones that are doubted. What no correction explains
("other") is right if it is doubted and nothing is proposed. A case is a word of its row.
"""

import collections
import contextlib
import math
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

import symkin
from symkin.analysis.observed import Observed
from symkin.estimate.evidence.edits import in_modes
from symkin.model.settings import Frames, NoiseSettings
from symkin.model.turns import turn_of

SPATIAL = NoiseSettings(1e-4, 1e-4, 5e-4)  # m, rad, and the reading in the sensor's unit
ANCHOR = ((2.0, 1.0),)
_LISTED = 12
MOVED = {"planar": (0.3, -0.2, 0.5), "point": (0.3, -0.2, 0.5)}
MOVED_IN_SPACE = (0.3, -0.2, 0.1, 0.1, 0.0, 0.5)
FAR = {"base": (1.0, -0.5, 3.0), "target": (0.05, 0.0, 0.17)}
FAR_IN_SPACE = {
    "base": (1.0, -0.5, 0.3, 0.0, 0.0, 2.9),
    "target": (0.05, 0.0, 0.0, 0.1, 0.0, 0.17),
}


class Case(NamedTuple):
    """What is observed of a robot, and what is told of its surroundings."""

    robot: str
    what: str
    observed: Observed
    options: Mapping[str, Any] = MappingProxyType({})
    known: Frames | None = None
    poses: int = 60


FRAMES = {"frames": ["base", "target"]}
LEG_BY_LEG = ("3RRR", "5bar", "linear_delta", "hexapod_jugglebot")  # full poses, robot's frame
CASES = [
    Case("3RRR", "positions", Observed("position")),
    Case("3RRR", "tracker", Observed("pose", **FAR), FRAMES),
    Case("5bar", "distances", Observed("distance", anchors=ANCHOR), known=Frames(anchors=ANCHOR)),
    Case("5bar", "tracker", Observed("position", base=FAR["base"]), {"frames": ["base"]}),
    Case("hexapod_jugglebot", "positions", Observed("position")),
    Case("hexapod_jugglebot", "tracker", Observed("pose", **FAR_IN_SPACE), FRAMES),
    *(Case(each, "leg by leg", Observed("pose")) for each in LEG_BY_LEG),
]


class Mistake(NamedTuple):
    """A change of what was measured of a robot, and the words of its correction."""

    name: str
    make: Callable[[symkin.Mechanism, symkin.Measurements, int], symkin.Measurements]
    words: Callable[[int], str]  # parted by "|" if there are two
    needs: str = ""  # "turn" of a joint, "rad", "m", a "mode", or "frames" that nobody knows of


def of_leg(change: Callable[[Any], Any]) -> Callable[..., symkin.Measurements]:
    """A change of one leg's readings."""

    def made(_: object, measured: symkin.Measurements, leg: int) -> symkin.Measurements:
        readings = np.array(measured.readings)
        readings[:, leg] = change(readings[:, leg])
        return replace(measured, readings=readings)

    return made


def of_all(change: Callable[[Any], Any]) -> Callable[..., symkin.Measurements]:
    """A change of all readings."""
    return lambda _, measured, __: replace(measured, readings=change(measured.readings))


def swapped(_: object, measured: symkin.Measurements, leg: int) -> symkin.Measurements:
    readings = np.array(measured.readings)
    other = (leg + 1) % readings.shape[1]
    readings[:, [leg, other]] = readings[:, [other, leg]]
    return replace(measured, readings=readings)


def in_millimetres(_: object, measured: symkin.Measurements, __: int) -> symkin.Measurements:
    poses = np.array(measured.poses)
    poses[:, : measured.space.size] *= 1e3
    distances = None if measured.distances is None else 1e3 * measured.distances
    return replace(measured, poses=poses, distances=distances)


def some_turned(values: Any) -> Any:
    return values + 2 * math.pi * (np.arange(len(values)) % 7 == 0)


def normal(shape: tuple[int, ...]) -> Any:
    return np.random.default_rng(1).standard_normal(shape)


def shuffled(count: int) -> Any:
    return np.random.default_rng(0).permutation(count)


def same(_: object, measured: symkin.Measurements, __: int) -> symkin.Measurements:
    return measured


PROPOSED = ("likely cause: ", "part of what is wrong may be: ")
TURNED = " turn away "  # which needs no correction that is tried
MISTAKES = [
    Mistake("none", same, lambda _: ""),
    Mistake("a sign", of_leg(np.negative), lambda leg: f"of leg {leg + 1} have the opposite sign"),
    Mistake("all signs", of_all(np.negative), lambda _: "have the opposite sign"),
    Mistake("two legs", swapped, lambda _: "are in the columns of legs"),
    Mistake("a mode", same, lambda leg: f"leg {leg + 1} stands in working mode", "mode"),
    Mistake("all modes", same, lambda _: "set working_mode", "modes"),
    Mistake("a unit", of_leg(np.degrees), lambda leg: f"of leg {leg + 1} look like degrees", "rad"),
    Mistake("all units", of_all(np.degrees), lambda _: "look like degrees", "rad"),
    Mistake(
        "a unit", of_leg(lambda r: 1e3 * r), lambda leg: f"of leg {leg + 1} look like milli", "m"
    ),
    Mistake("lengths", in_millimetres, lambda _: "lengths that were observed are millimetres"),
    Mistake(
        "half a turn",
        of_leg(lambda r: r + math.pi),
        lambda leg: f"of leg {leg + 1} was set to zero half a turn",
        "turn",
    ),
    Mistake(
        "a turn",
        of_leg(lambda r: r + 2 * math.pi),
        lambda leg: f"leg {leg + 1}: all readings are a whole turn away",
        "turn",
    ),
    Mistake("lost turns", of_leg(some_turned), lambda leg: f"leg {leg + 1}: ", "turn"),
    Mistake("a frame", same, lambda _: "the frame of the measurements is not", "frames"),
]
MISTAKES += [  # of which none is among the corrections: right is what is doubted without a proposal
    Mistake("other: noise", of_all(lambda r: r + 0.2 * normal(r.shape)), lambda _: ""),
    Mistake("other: out of step", of_leg(lambda r: np.roll(r, 3)), lambda _: ""),
    Mistake("other: out of order", of_leg(lambda r: r[shuffled(len(r))]), lambda _: ""),
    Mistake("other: bent", of_all(lambda r: r + 0.2 * r**2), lambda _: ""),
]
SINGLE = {(each.name, each.needs): each for each in MISTAKES}


def both(one: Mistake, other: Mistake) -> Mistake:
    """Two mistakes, in the order in which they are made."""

    def made(
        robot: symkin.Mechanism, measured: symkin.Measurements, leg: int
    ) -> symkin.Measurements:
        return other.make(robot, one.make(robot, measured, leg), leg)

    return Mistake(
        f"{one.name}, {other.name}",
        made,
        lambda leg: f"{one.words(leg)}|{other.words(leg)}",
        one.needs or other.needs,
    )


A_SIGN, TWO_LEGS, LENGTHS = (SINGLE[each, ""] for each in ("a sign", "two legs", "lengths"))
MISTAKES += [
    both(A_SIGN, TWO_LEGS),
    both(A_SIGN, LENGTHS),
    both(A_SIGN, SINGLE["half a turn", "turn"]),
    both(A_SIGN, SINGLE["a mode", "mode"]),
    both(A_SIGN, SINGLE["a frame", "frames"]),
    both(SINGLE["all units", "rad"], TWO_LEGS),
]


@cache
def robot_of(case: int, flipped: tuple[int, ...]) -> tuple[symkin.Mechanism, symkin.Plan] | None:
    """The robot with some legs in other modes, and a plan; None if it has no workspace then."""
    robot = mechanism_of(CASES[case])
    if flipped:
        modes = [-m if leg in flipped else m for leg, m in enumerate(robot.working_modes)]
        robot = in_modes(robot, modes)[0]
    per_leg = max(len(robot.parameter_names), CASES[case].poses // len(robot.legs))
    sample = symkin.sample_workspace(robot, 3000, seed=1)
    for symmetric in (True, False):  # of a five-bar the images of poses may lie outside its box
        with contextlib.suppress(symkin.SymkinError):
            return robot, symkin.make_plan(robot, sample, per_leg, symmetry=symmetric)
    return None


def outcome(number: int, mistaken: int, seed: int) -> str:
    """What is proposed for one robot: right, shared, wrong, none, or a doubt without cause."""
    case, mistake = CASES[number], MISTAKES[mistaken]
    mechanism = mechanism_of(case)
    leg = seed % len(mechanism.legs)
    every = tuple(range(len(mechanism.legs)))
    flipped = {"mode": (leg,), "modes": every}.get(mistake.needs, ())
    planned = robot_of(number, flipped)
    if planned is None:
        return "not simulated"
    robot, plan = planned
    observed = case.observed
    if mistake.needs == "frames":
        moved = MOVED.get(mechanism.pose_space, MOVED_IN_SPACE)
        observed = replace(observed, base=moved)
    try:
        taken = symkin.simulate(robot, plan, 1000 + seed, observe=observed).measurements
    except symkin.SymkinError:
        return "not simulated"
    measured = mistake.make(mechanism, taken.for_all_legs(), leg)
    try:
        found = symkin.identify(
            mechanism.replace(frames=case.known), measured, max_iterations=40, **case.options
        )
    except symkin.SymkinError as error:
        words = [each[0].upper() + each[1:] for each in PROPOSED]
        said = [str(error).partition(each)[2] for each in words if each in str(error)]
    else:
        told = map(str, found.doubts)
        said = [each for each in told if each.startswith(PROPOSED) or TURNED in each]
        if mistake.name == "none":
            return "right" if not found.doubts else "wrong" if said else "doubt"
        if not found.doubts and found.converged:
            return "none"
    if not any(said):
        return "none" if mistake.words(leg) else "right"
    if not mistake.words(leg):
        return "wrong"
    right = all(words in said[0] for words in mistake.words(leg).split("|"))
    return ("shared" if " or as well: " in said[0] else "right") if right else "wrong"


def mechanism_of(case: Case) -> symkin.Mechanism:
    mechanism = symkin.load_mechanism(case.robot)
    return mechanism.replace(noise=SPATIAL) if case.robot.startswith("hexa") else mechanism


def main() -> None:
    """Print a row for each case and mistake."""
    robots = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    processes = int(sys.argv[2]) if len(sys.argv) > 2 else 2
    columns = ("right", "shared", "wrong", "none", "doubt", "not simulated")
    print(f"{robots} robots a row\n{'':42}" + "".join(f"{name:>14}" for name in columns))
    with ProcessPoolExecutor(processes) as pool:
        for case in CASES:
            mechanism = mechanism_of(case)
            turning, modes = turn_of(mechanism, 0) is not None, "[R]" in mechanism.chain
            unit = mechanism.reading_unit
            possible = {"": True, "turn": turning, "rad": unit == "rad", "m": unit == "m"}
            possible |= {"mode": modes, "modes": modes}
            possible["frames"] = case.what in ("positions", "leg by leg")
            for mistake in MISTAKES:
                row = f"{case.robot} {case.what}: {mistake.name}"
                asked = sys.argv[3:]
                if not possible[mistake.needs] or (asked and not any(a in row for a in asked)):
                    continue
                task = partial(outcome, CASES.index(case), MISTAKES.index(mistake))
                found = list(pool.map(task, range(robots)))
                counts = collections.Counter(found)
                missed = [str(i) for i, each in enumerate(found) if each in columns[2:5]]
                print(
                    f"{row:42}{''.join(f'{counts[name]:14}' for name in columns)}  "
                    f"{' '.join(missed[:_LISTED])}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
