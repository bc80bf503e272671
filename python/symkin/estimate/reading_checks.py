# SPDX-License-Identifier: MIT
"""Mistakes that measurements and an estimate show by themselves, whatever they are of.

Readings of the other working mode, lost turns, copies, poses out of reach, coarse readings. Others
need a correction that is tried: `hypotheses`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import named_legs
from symkin.estimate.found import Found
from symkin.model.chains import shortest
from symkin.model.mechanism import Mechanism
from symkin.model.turns import turn_of, turned_home

__all__ = [
    "Taken",
    "coarse_readings",
    "lost_turns",
    "nearer_other_root",
    "other_modes",
    "signs_of_mistakes",
    "turns_in_words",
    "with_modes",
]

Array = NDArray[np.float64]

# Two measurements of one pose differ by the noise; nearer than this share of it they are copies.
_COPIED = 1e-3


class Taken(NamedTuple):
    """Readings at poses in the robot's own frame; NaN where an estimate does not use them."""

    nominal: Mechanism
    calibrated: Mechanism
    poses: Array
    readings: Array
    row_numbers: NDArray[np.intp]

    def rows(self, leg: int) -> NDArray[np.intp]:
        """Rows, from 0, whose reading of a leg is used."""
        poses = np.isfinite(self.poses).all(axis=1)
        return np.flatnonzero(poses & np.isfinite(self.readings[:, leg]))


def signs_of_mistakes(found: Found) -> list[str]:
    """Name what speaks against the measurements, whatever the residuals are."""
    taken = _taken(found)
    return [
        *other_modes(taken),
        *_out_of_reach(found),
        *lost_turns(taken),
        *_copies(found),
    ]


def _used(found: Found, leg: int) -> NDArray[np.intp]:
    fit = found.legs[leg]
    return np.setdiff1d(fit.rows, fit.rejected)


def _taken(found: Found) -> Taken:
    measurements = found.measurements
    readings = np.full(measurements.readings.shape, np.nan)
    for leg in range(len(found.legs)):
        rows = _used(found, leg)
        readings[rows, leg] = measurements.readings[rows, leg]
    numbers = measurements.row_numbers
    return Taken(found.nominal, found.mechanism, measurements.poses, readings, numbers)


def other_modes(taken: Taken) -> Iterator[str]:
    """Readings that belong to the other root of the closure at the estimate."""
    calibrated = taken.calibrated
    all_wrong: dict[int, list[int]] = {}
    of_other_root = nearer_other_root(taken)
    for leg, mode in enumerate(calibrated.working_modes):
        rows = taken.rows(leg)
        wrong = of_other_root[rows, leg]
        if wrong.sum() > len(rows) // 2:
            all_wrong.setdefault(mode, []).append(leg)
        elif wrong.any():
            first = taken.row_numbers[rows[np.argmax(wrong)]]
            yield (
                f"leg {leg + 1}: {wrong.sum()} of {len(rows)} readings (the first in row {first}) "
                f"are those of the other working mode ({-mode:+d})"
            )
    for mode, legs in all_wrong.items():
        yield (
            f"{named_legs(legs)}: the readings are those of working mode {-mode:+d}, but the "
            f"mechanism has {mode:+d}: set working_mode = {-mode}"
        )


def nearer_other_root(taken: Taken) -> NDArray[np.bool_]:
    """Which readings, shape (N, legs), are nearer to the root of the other working mode."""
    calibrated = taken.calibrated
    flipped = with_modes(calibrated, [-mode for mode in calibrated.working_modes])
    turns = [turn_of(calibrated, leg) for leg in range(len(calibrated.legs))]
    own, other = (
        np.column_stack([np.abs(shortest(*each)) for each in zip(away.T, turns, strict=True)])
        for away in (
            taken.readings - robot.inverse_kinematics(taken.poses)
            for robot in (calibrated, flipped)
        )
    )
    return np.asarray(other < own)


def _out_of_reach(found: Found) -> Iterator[str]:
    """Measured poses that the calibrated model cannot take."""
    calibrated, measurements = found.mechanism, found.measurements
    margins = _core.reach_margin(calibrated.core, measurements.poses)
    noise = found.noise
    moves = calibrated.space.moves
    length = calibrated.characteristic_length if moves else 1.0
    allowed = 6 * max(noise.position if moves else 0.0, noise.orientation * length)
    closures = float(np.sqrt(np.mean(np.concatenate([leg.residuals for leg in found.legs]) ** 2)))
    for leg in range(len(calibrated.legs)):
        rows = _used(found, leg)
        beyond = rows[margins[rows, leg] < -max(allowed, 6 * closures)]
        if len(beyond):
            worst = beyond[np.argmin(margins[beyond, leg])]
            yield (
                f"leg {leg + 1}: the calibrated model cannot take {len(beyond)} of {len(rows)} "
                f"measured poses; that of row {measurements.row_numbers[worst]} is "
                f"{-margins[worst, leg] * 1e3:.3g} m{calibrated.space.closure_unit} beyond its "
                "reach"
            )


def lost_turns(taken: Taken) -> Iterator[str]:
    """Readings that are turns away from each other, or from where the model has them."""
    # Counted from the nominal robot's home, lest both be half a turn from the sensor's zero.
    roots = turned_home(taken.nominal, taken.calibrated.inverse_kinematics(taken.poses))
    for leg in range(taken.readings.shape[1]):
        turn = turn_of(taken.nominal, leg)
        rows = taken.rows(leg)
        readings = taken.readings[rows, leg]
        if turn is None or len(rows) < 2:
            continue
        by_model = roots[rows, leg] + shortest(readings - roots[rows, leg], turn)
        away = np.round((readings - roots[rows, leg]) / turn)
        if away[0] and (away == away[0]).all():
            yield (
                f"leg {leg + 1}: all readings are {turns_in_words(away[0])} away from the "
                "sensor's zero that the mechanism has, which the gain and the offset then have to "
                "explain"
            )
        for unbroken in (_continuous(readings, turn), by_model):
            if not np.isfinite(unbroken).all():
                continue
            turns = np.round((readings - unbroken) / turn)
            turns -= np.median(turns)
            if turns.any() and _largest_gap(readings) > 1.5 * _largest_gap(unbroken):
                numbers = taken.row_numbers[rows[turns != 0]]
                listed = ", ".join(map(str, numbers[:5])) + (" ..." if len(numbers) > 5 else "")
                yield (
                    f"leg {leg + 1}: {len(numbers)} of {len(rows)} readings are a turn away from "
                    f"the others (rows {listed}): the sensor wrapped or was reset; add the turn, "
                    "since the gain would have to explain it"
                )
                break


def _largest_gap(values: Array) -> float:
    return float(np.diff(np.sort(values)).max())


def _copies(found: Found) -> Iterator[str]:
    """Poses that agree better than the noise of measuring them allows."""
    measurements, noise = found.measurements, found.noise
    position = found.nominal.space.size
    scale = np.full(measurements.poses.shape[1], noise.position)
    scale[position:] = noise.orientation
    noisy = scale > 0
    if not noisy.any() or len(measurements.poses) < 2:
        return
    cells = measurements.poses[:, noisy] / (scale[noisy] * _COPIED)
    pairs: set[int] = set()
    for shift in (0.0, 0.5):  # a pair may lie on both sides of a cell's border once
        _, first, inverse = np.unique(
            np.floor(cells + shift), axis=0, return_index=True, return_inverse=True
        )
        pairs |= set(np.flatnonzero(first[inverse.ravel()] != np.arange(len(cells))).tolist())
    if pairs:
        rows = measurements.row_numbers[sorted(pairs)]
        yield (
            f"{len(pairs)} of {len(cells)} poses are copies of others (first: row {rows[0]}): they "
            "agree a thousand times better than the declared noise of measuring them allows, so "
            "they add no information; the standard deviations are too small"
        )


def coarse_readings(found: Found) -> list[str]:
    """Name sensors whose readings take few values."""
    coarse = {}
    for leg in range(len(found.legs)):
        values, counts = np.unique(
            found.measurements.readings[_used(found, leg), leg], return_counts=True
        )
        if 1 < len(values) < 0.7 * counts.sum():
            coarse[leg] = len(values), float(np.diff(values).min())
    if not coarse:
        return []
    fewest = min(count for count, _ in coarse.values())
    step = min(step for _, step in coarse.values())
    return [
        f"the readings of {named_legs(coarse)} take only {fewest} values in steps of "
        f"{step:.3g} {found.nominal.reading_unit}: rounded, repeated, or of a coarse sensor"
    ]


def with_modes(mechanism: Mechanism, modes: list[int]) -> Mechanism:
    """The mechanism in other working modes."""
    legs = [
        replace(leg, working_mode=mode) for leg, mode in zip(mechanism.legs, modes, strict=True)
    ]
    return mechanism.replace(legs=legs, symmetry=None)


def _continuous(values: Array, turn: float | None) -> Array:
    """Angles about their mean direction, so that none jumps."""
    if turn is None:
        return values
    centre = float(np.angle(np.mean(np.exp(2j * np.pi * values / turn)))) / (2 * np.pi) * turn
    return centre + shortest(values - centre, turn)


def turns_in_words(turns: float) -> str:
    """So many turns, such as ``"half a turn"``."""
    if abs(turns) == 0.5:
        return "half a turn"
    return "a whole turn" if abs(turns) == 1 else f"{abs(turns):g} turns"
