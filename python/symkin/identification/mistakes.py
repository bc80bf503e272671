# SPDX-License-Identifier: MIT
"""Mistakes of measuring and of typing, recognised in the measurements and in the estimate.

Either the estimate shows them (readings of the other working mode, lost turns, copies), or the
measurements fit the drawing once they are corrected (order, sign, zero, unit, mirror image).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.chains import shortest, turn_of
from symkin.errors import FailedFitError, SymkinError, named_legs
from symkin.identification.fit import FALSE_ALARMS, Fit, FitOptions
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import parameter_tolerances

__all__ = [
    "FACTORS",
    "MUCH_BETTER",
    "Taken",
    "cause",
    "coarse_readings",
    "conventions",
    "explained",
    "explains",
    "left_in_words",
    "likely_cause",
    "lost_turns",
    "nearer_other_root",
    "other_modes",
    "signs_of_mistakes",
    "turns_in_words",
    "with_modes",
]

Array = NDArray[np.float64]

# What a correction must leave less of chi-square than what is stated does, per degree of freedom.
MUCH_BETTER = 9.0
_HUGE = 1000.0  # so much better suffices even if something else is wrong besides
# Two measurements of one pose differ by the noise; nearer than this share of it they are copies.
_COPIED = 1e-3
# How near a slope must be to a unit's factor, and to 1.
_NEAR_FACTOR = 0.1
# Times the tolerance of a length: further off, a sensor of lengths was set to zero elsewhere.
_ZERO_OFF = 20
FACTORS = {
    180 / math.pi: "degrees that were stated as radians",
    math.pi / 180: "radians that were stated as degrees",
    2 * math.pi: "radians that were stated as turns",
    1 / (2 * math.pi): "turns that were stated as radians",
    1e-3: "metres that were stated as millimetres",
    1e3: "millimetres that were stated as metres",
}


def explains(after: float, before: float) -> bool:
    """Whether a correction explains what is not explained as it is stated.

    Both are chi-square with the tolerances, per degree of freedom: of the corrected fit, and of
    what is stated at the best that its solver reaches from any start, converged or not; infinite
    where there is no fit at all.
    """
    tolerated = max(MUCH_BETTER, before / _HUGE) if math.isfinite(before) else MUCH_BETTER
    return after * MUCH_BETTER < before and after < tolerated


def cause(what: str, *, whole: bool) -> str:
    """A proposal in words; a doubt unless the `whole` of what was measured is explained by it."""
    return f"{'likely cause' if whole else 'part of what is wrong may be'}: {what}"


def left_in_words(after: float, before: float, *, whole: bool) -> str:
    """What speaks for a proposal, with the arguments of `explains`."""
    words = f"so corrected, chi-square with the tolerances is {after:.3g} per degree of freedom"
    words += f", before {before:.3g}" if math.isfinite(before) else ", before none was found"
    return words if whole else f"{words}; that is more than the noise explains"


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


@contextmanager
def explained(
    mechanism: Mechanism, measurements: Measurements, options: FitOptions
) -> Iterator[None]:
    """Say of measurements that allow no estimate what may be wrong with them."""
    try:
        yield
    except FailedFitError as error:
        words = _better_readings(mechanism, measurements, options)
        if not words:
            raise
        raise FailedFitError(f"{error}. {words[0].upper()}{words[1:]}") from error


def signs_of_mistakes(found: Fit) -> list[str]:
    """Name what speaks against the measurements, whatever the residuals are."""
    taken = _taken(found)
    return [
        *other_modes(taken),
        *_out_of_reach(found),
        *lost_turns(taken),
        *_copies(found),
    ]


def likely_cause(found: Fit) -> str:
    """Name corrections that explain the measurements of a doubtful estimate; empty if none do."""
    return _better_readings(found.nominal, found.measurements, found.options, found)


def _used(found: Fit, leg: int) -> NDArray[np.intp]:
    fit = found.legs[leg]
    return np.setdiff1d(fit.rows, fit.rejected)


def _taken(found: Fit) -> Taken:
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


def _out_of_reach(found: Fit) -> Iterator[str]:
    """Measured poses that the calibrated model cannot take."""
    calibrated, measurements = found.mechanism, found.measurements
    margins = _core.reach_margin(calibrated.core, measurements.poses)
    noise = found.noise
    moves = calibrated.space.moves
    length = calibrated.characteristic_length if moves else 1.0
    allowed = 6 * max(noise.position if moves else 0.0, noise.orientation * length)
    for leg in range(len(calibrated.legs)):
        rows = _used(found, leg)
        beyond = rows[margins[rows, leg] < -max(allowed, 6 * found.residual_rms)]
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
    roots = taken.calibrated.inverse_kinematics(taken.poses)
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


def _copies(found: Fit) -> Iterator[str]:
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


def coarse_readings(found: Fit) -> list[str]:
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


@dataclass(frozen=True)
class _Match:
    """The readings, of some column, that fit a leg's inverse kinematics best."""

    column: int
    mode: int
    slope: float
    shift: float  # of the readings against the drawing's, in the sensor's unit
    left: float  # share of the variance that a straight line leaves


def _better_readings(
    nominal: Mechanism,
    measurements: Measurements,
    options: FitOptions,
    found: Fit | None = None,
) -> str:
    """Corrections of the readings or poses that explain the measurements, in words; or none.

    Orders, signs, zeros, working modes, units and mirror images are those with which the readings
    follow the drawing's inverse kinematics. They are tried: none is named unless the corrected
    measurements are explained and those of `found`, or from which there is no estimate, are not.
    """
    complete = np.isfinite(measurements.readings).all(axis=1)
    if complete.sum() < max(nominal.estimated_counts):
        return ""
    readings = measurements.readings[complete]
    trials: list[tuple[str, Array, list[_Match]]] = []
    for name, poses in conventions(nominal, measurements.poses):
        matches = _matches(nominal, poses[complete], readings)
        if matches is not None:
            trials.append((name, poses, matches))
    if not trials:
        return ""
    best = min(trials, key=lambda trial: _left(trial[2]))
    stated = next((trial for trial in trials if not trial[0]), None)
    if stated is not None and _left(stated[2]) <= MUCH_BETTER * _left(best[2]):
        best = stated
    name, poses, matches = best
    words = [f"in the measured poses {name}"] if name else []
    words += _corrections(nominal, matches)
    if not words:
        return ""
    made = replace(measurements, poses=poses, readings=_as_drawn(nominal, measurements, matches))
    corrected = _fitted(with_modes(nominal, [match.mode for match in matches]), made, options)
    if corrected is None or not corrected.converged:
        return ""
    after, tail = _disagreement(corrected, nominal)
    before = _best_as_stated(corrected, nominal, found, measurements)
    if not explains(after, before):
        return ""
    whole = tail >= FALSE_ALARMS
    evidence = left_in_words(after, before, whole=whole)
    return f"{cause('; '.join(words), whole=whole)} ({evidence})"


def _as_drawn(nominal: Mechanism, measurements: Measurements, matches: list[_Match]) -> Array:
    """The readings of each leg from its column, with the drawing's sign and unit, and its zero."""
    return np.column_stack(
        [
            (measurements.readings[:, match.column] - _zero(nominal, leg, match))
            / _factor(match.slope)
            for leg, match in enumerate(matches)
        ]
    )


def _fitted(start: Mechanism, measurements: Measurements, options: FitOptions) -> Fit | None:
    try:
        return Fit.of(start, measurements, options)
    except SymkinError:
        return None


def _best_as_stated(
    corrected: Fit, nominal: Mechanism, found: Fit | None, measurements: Measurements
) -> float:
    """What is left of the measurements as stated, at best; infinite where they have no fit.

    Of the estimate that was found, converged or not, and of that which starts from the corrected
    one's parameters: an estimator that fails from the drawing may do so because the robot is far
    from it, which is no mistake. A robot in other working modes is another than what is stated.
    """
    fits = [found]
    if corrected.nominal.working_modes == nominal.working_modes:
        start = nominal.with_parameters(corrected.mechanism.parameters, symmetry=None)
        fits.append(_fitted(start, measurements, corrected.options))
    return min(math.inf if fit is None else _disagreement(fit, nominal)[0] for fit in fits)


def _disagreement(fit: Fit, nominal: Mechanism) -> tuple[float, float]:
    """Chi-square per degree of freedom with the tolerances as priors, and how likely more of it is.

    Its least value, to first order: that of the measurements, and of the estimate's distance from
    the drawing by the tolerances and its own covariance. Infinite if there is none.
    """
    own = nominal.is_estimated
    moved = (fit.mechanism.parameters - nominal.parameters)[own]
    known = np.flatnonzero(own)
    spread = np.nan_to_num(fit.covariance[np.ix_(known, known)])
    spread += np.diag(parameter_tolerances(nominal)[own] ** 2)
    scale = np.sqrt(np.diag(spread))
    inverse = np.linalg.pinv(spread / np.outer(scale, scale), hermitian=True)
    distances = moved / scale
    squares = sum(each.chi_square for each in fit.goodness) + distances @ inverse @ distances
    count = sum(max(each.degrees_of_freedom, 0) for each in fit.goodness) + moved.size
    if not math.isfinite(squares):
        return math.inf, 0.0
    return float(squares / count), _core.chi_square_tail(squares, count)


def _left(matches: list[_Match]) -> float:
    return math.exp(sum(math.log(match.left + 1e-15) for match in matches) / len(matches))


def _corrections(nominal: Mechanism, matches: list[_Match]) -> list[str]:
    words = []
    swapped = [leg for leg, match in enumerate(matches) if match.column != leg]
    if swapped:
        columns = ", ".join(str(matches[leg].column + 1) for leg in swapped)
        words.append(f"the readings of {named_legs(swapped)} are in the columns of legs {columns}")
    for mode in (-1, 1):
        modes = zip(matches, nominal.working_modes, strict=True)
        legs = [leg for leg, (match, own) in enumerate(modes) if match.mode == mode != own]
        if legs:
            stand = "stands" if len(legs) == 1 else "stand"
            words.append(f"{named_legs(legs)} {stand} in working mode {mode:+d}")
    flipped = [leg for leg, match in enumerate(matches) if match.slope < 0]
    if flipped:
        words.append(f"the readings of {named_legs(flipped)} have the opposite sign")
    units: dict[str, list[int]] = {}
    for leg, match in enumerate(matches):
        factor = abs(_factor(match.slope))
        if factor in FACTORS:
            units.setdefault(FACTORS[factor], []).append(leg)
        elif abs(math.log(abs(match.slope))) > _NEAR_FACTOR:
            words.append(
                f"the readings of leg {leg + 1} grow {abs(match.slope):.3g} times as fast as the "
                "drawing's: its sensor_gain or its unit is wrong"
            )
    words += [
        f"the readings of {named_legs(legs)} look like {unit}" for unit, legs in units.items()
    ]
    for leg, match in enumerate(matches):
        zero = _zero(nominal, leg, match) / _factor(match.slope)
        if zero:
            turn = turn_of(nominal, leg)
            off = f"{zero:+.3g} {nominal.reading_unit}"
            if turn is not None:
                off += f", {turns_in_words(round(2 * zero / turn) / 2)},"
            words.append(
                f"the sensor of leg {leg + 1} was set to zero {off} off the drawing's zero"
            )
    return words


def _factor(slope: float) -> float:
    """The change of sign and unit that a slope speaks of; 1 if it is near that."""
    for factor in FACTORS:
        if abs(math.log(abs(slope) / factor)) < _NEAR_FACTOR:
            return math.copysign(factor, slope)
    return math.copysign(1.0, slope)


def _zero(nominal: Mechanism, leg: int, match: _Match) -> float:
    """What to take from the readings of a leg whose zero was evidently set elsewhere, else 0.

    A turn of half or more for an angle; for a length, what its tolerance could never explain.
    """
    turn = turn_of(nominal, leg)
    factor = _factor(match.slope)
    if turn is not None:
        halves = round(2 * match.shift / factor / turn)
        near = abs(match.shift / factor - halves * turn / 2) < turn / 20
        return halves * turn / 2 * factor if near else 0.0
    gain = float(nominal.sensor_gains[leg])
    far = abs(match.shift / factor * gain) > _ZERO_OFF * nominal.tolerances.length
    return match.shift if far else 0.0


def conventions(nominal: Mechanism, poses: Array) -> Iterator[tuple[str, Array]]:
    """Ways in which poses may have been written down."""
    yield "", poses
    position = nominal.space.size
    for factor, words in (
        (1e-3, "positions are millimetres, not metres"),
        (1e3, "positions are a thousandth of what they should be"),
    ):
        if not position:
            break
        scaled = poses.copy()
        scaled[:, :position] *= factor
        yield words, scaled
    # A mirrored rotation keeps the component of its axis along the mirror's normal.
    rotations: dict[str, tuple[int, ...]] = {
        "x is mirrored": (1, -1, -1, 1),
        "y is mirrored": (-1, 1, -1, 1),
        "z is mirrored": (-1, -1, 1, 1),
        "the quaternions turn the other way (base to platform)": (-1, -1, -1, 1),
    }
    conventions: dict[str, dict[str, tuple[int, ...]]] = {
        "planar": {"y is mirrored": (1, -1, -1), "x is mirrored": (-1, 1, -1)},
        "point": {"y is mirrored": (1, -1), "x is mirrored": (-1, 1)},
        "translating": {
            "x is mirrored": (-1, 1, 1),
            "y is mirrored": (1, -1, 1),
            "z is mirrored": (1, 1, -1),
        },
        "spherical": rotations,
    }
    positions = conventions["translating"]
    conventions["spatial"] = {
        words: positions.get(words, (1, 1, 1)) + signs for words, signs in rotations.items()
    }
    for words, factors in conventions[nominal.pose_space].items():
        yield words, poses * np.array(factors, dtype=float)
    if nominal.pose_space == "planar":
        yield "the angle has the opposite sign", poses * np.array([1.0, 1.0, -1.0])
        yield "angles are degrees, not radians", poses * np.array([1.0, 1.0, math.pi / 180])
    if nominal.space.has_quaternion:
        scalar_last = np.hstack([poses[:, :position], np.roll(poses[:, position:], -1, axis=1)])
        yield "the quaternions are in the order w, x, y, z", scalar_last


def _matches(nominal: Mechanism, poses: Array, readings: Array) -> list[_Match] | None:
    """For each leg the column and mode that fit best, every column once; None where none fits."""
    count = len(nominal.legs)
    table = np.full((count, count), np.inf)
    best: dict[tuple[int, int], _Match] = {}
    modes = sorted({-1, 1}, key=lambda mode: mode != nominal.working_modes[0])
    for mode in modes:
        with_mode = with_modes(nominal, [mode] * count)
        expected = with_mode.inverse_kinematics(poses)
        for leg in range(count):
            reached = np.isfinite(expected[:, leg])
            if reached.sum() < max(4, len(poses) // 2):
                continue
            wanted = _continuous(expected[reached, leg], turn_of(nominal, leg))
            for column in range(count):
                slope, shift, left = _line(wanted, readings[reached, column])
                stated = column == leg and mode == nominal.working_modes[leg]
                # What the file says stays unless another reading of it is much better.
                score = left / (MUCH_BETTER if stated else 1)
                if score < table[leg, column]:
                    table[leg, column] = score
                    best[leg, column] = _Match(column, mode, slope, shift, left)
    if count > 6 or not np.isfinite(table).any(axis=1).all():
        order = tuple(range(count))
    else:
        logarithms = np.log(table + 1e-15)
        order = min(
            itertools.permutations(range(count)),
            key=lambda columns: sum(logarithms[leg, columns[leg]] for leg in range(count)),
        )
    if not all(place in best for place in enumerate(order)):
        return None
    return [best[place] for place in enumerate(order)]


def _line(wanted: Array, readings: Array) -> tuple[float, float, float]:
    """Slope of readings over what was wanted, their shift, and the variance share that is left."""
    x, y = wanted, readings
    slope = shift = 0.0
    # Readings that are outliers must not hide what the others show.
    for _ in range(4):
        centred = x - x.mean()
        spread = float(centred @ centred)
        if spread == 0:
            return 1.0, 0.0, 1.0
        slope = float(centred @ y) / spread
        shift = float(np.mean(y - slope * x))
        errors = np.abs(y - slope * x - shift)
        keep = errors <= 5 * np.median(errors) + 1e-12
        if keep.all() or keep.sum() < 4:
            break
        x, y = x[keep], y[keep]
    total = float(np.sum((y - y.mean()) ** 2))
    if total == 0 or slope == 0 or not np.isfinite(slope):
        return 1.0, 0.0, 1.0
    # The shift in the middle of the readings, where the slope's own error does not matter.
    middle = float(np.mean(y) - _factor(slope) * np.mean(x))
    return slope, middle, float(np.sum((y - slope * x - shift) ** 2)) / total


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
