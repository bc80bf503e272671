# SPDX-License-Identifier: MIT
"""Mistakes of measuring and of typing, recognised in the measurements and in the estimate."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.chains import chain_info
from symkin.errors import named_legs
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism

if TYPE_CHECKING:
    from symkin.identification import Identification

__all__ = ["likely_mistakes", "signs_of_mistakes"]

Array = NDArray[np.float64]

# Two measurements of one pose differ by the noise; nearer than this share of it they are copies.
_COPIED = 1e-3
# What explains readings must leave this much less unexplained than what the file says.
_MUCH_BETTER = 9.0
# How near a slope must be to a unit's factor, and to 1.
_NEAR_FACTOR = 0.1
# Share of the movement of points that a rigid motion must explain to be called one.
_ALIKE = 0.9
_FACTORS = {
    math.pi / 180: "radians that are degrees",
    180 / math.pi: "degrees that are radians",
    2 * math.pi: "radians that are turns",
    1 / (2 * math.pi): "turns that are radians",
    1e-3: "metres that are millimetres",
    1e3: "millimetres that are metres",
}


def signs_of_mistakes(found: Identification) -> list[str]:
    """Name what speaks against the measurements, whatever the residuals are."""
    return [
        *_other_modes(found),
        *_out_of_reach(found),
        *_lost_turns(found),
        *_copies(found),
    ]


def likely_mistakes(found: Identification) -> list[str]:
    """Name what may be behind the doubts about an estimate."""
    causes = [
        *_coarse_readings(found),
        *_moved_alike(found),
        *_scaled(found),
        *_offset_steps(found),
        *_better_readings(found.nominal, found.measurements),
    ]
    return [f"likely cause: {cause}" for cause in causes]


def _used(found: Identification, leg: int) -> NDArray[np.intp]:
    fit = found.legs[leg]
    return np.setdiff1d(fit.rows, fit.rejected)


def _turn(mechanism: Mechanism, leg: int) -> float | None:
    """One turn of an angular joint in the sensor's unit; None for a length."""
    if chain_info(mechanism.chain, mechanism.platform).reading_unit != "rad":
        return None
    return abs(2 * math.pi / float(mechanism.parameters[leg, -2]))


def _wrapped(differences: Array, turn: float | None) -> Array:
    if turn is None:
        return differences
    return differences - turn * np.round(differences / turn)


def _with_modes(mechanism: Mechanism, modes: list[int]) -> Mechanism:
    legs = [
        replace(leg, working_mode=mode) for leg, mode in zip(mechanism.legs, modes, strict=True)
    ]
    return mechanism.replace(legs=legs, symmetry=None)


def _other_modes(found: Identification) -> Iterator[str]:
    """Readings that belong to the other root of the closure at the estimate."""
    calibrated, measurements = found.mechanism, found.measurements
    flipped = _with_modes(calibrated, [-mode for mode in calibrated.working_modes])
    own = calibrated.inverse_kinematics(measurements.poses)
    other = flipped.inverse_kinematics(measurements.poses)
    for leg, mode in enumerate(calibrated.working_modes):
        rows = _used(found, leg)
        turn = _turn(calibrated, leg)
        readings = measurements.readings[rows, leg]
        to_own = np.abs(_wrapped(readings - own[rows, leg], turn))
        to_other = np.abs(_wrapped(readings - other[rows, leg], turn))
        wrong = int(np.sum(to_other < to_own))
        if wrong > len(rows) // 2:
            yield (
                f"leg {leg + 1}: {wrong} of {len(rows)} readings are those of working mode "
                f"{-mode:+d}, but the mechanism has {mode:+d}: set working_mode = {-mode}"
            )
        elif wrong:
            first = measurements.row_numbers[rows[np.argmax(to_other < to_own)]]
            yield (
                f"leg {leg + 1}: {wrong} of {len(rows)} readings (the first in row {first}) are "
                f"those of the other working mode ({-mode:+d})"
            )


def _out_of_reach(found: Identification) -> Iterator[str]:
    """Measured poses that the calibrated model cannot take."""
    calibrated, measurements = found.mechanism, found.measurements
    margins = _core.reach_margin(calibrated.core, measurements.poses)
    noise = found.noise
    allowed = 6 * max(noise.position, noise.orientation * calibrated.characteristic_length)
    for leg in range(len(calibrated.legs)):
        rows = _used(found, leg)
        beyond = rows[margins[rows, leg] < -max(allowed, 6 * found.residual_rms)]
        if len(beyond):
            worst = beyond[np.argmin(margins[beyond, leg])]
            yield (
                f"leg {leg + 1}: the calibrated model cannot take {len(beyond)} of {len(rows)} "
                f"measured poses; that of row {measurements.row_numbers[worst]} is "
                f"{-margins[worst, leg] * 1e3:.3g} mm beyond its reach"
            )


def _lost_turns(found: Identification) -> Iterator[str]:
    """Readings of which some are a turn away from the others."""
    measurements = found.measurements
    roots = found.mechanism.inverse_kinematics(measurements.poses)
    for leg in range(len(found.legs)):
        turn = _turn(found.nominal, leg)
        rows = _used(found, leg)
        readings = measurements.readings[rows, leg]
        if turn is None or len(rows) < 2:
            continue
        centre = float(np.angle(np.mean(np.exp(2j * np.pi * readings / turn)))) / (2 * np.pi) * turn
        about_centre = centre + _wrapped(readings - centre, turn)
        by_model = roots[rows, leg] + _wrapped(readings - roots[rows, leg], turn)
        for continuous in (about_centre, by_model):
            if not np.isfinite(continuous).all():
                continue
            turns = np.round((readings - continuous) / turn)
            turns -= np.median(turns)
            if turns.any() and _largest_gap(readings) > 1.5 * _largest_gap(continuous):
                numbers = measurements.row_numbers[rows[turns != 0]]
                listed = ", ".join(map(str, numbers[:5])) + (" ..." if len(numbers) > 5 else "")
                yield (
                    f"leg {leg + 1}: {len(numbers)} of {len(rows)} readings are a turn away from "
                    f"the others (rows {listed}): the sensor wrapped or was reset; add the turn, "
                    "since the gain would have to explain it"
                )
                break


def _largest_gap(values: Array) -> float:
    return float(np.diff(np.sort(values)).max())


def _copies(found: Identification) -> Iterator[str]:
    """Poses that agree better than the noise of measuring them allows."""
    measurements, noise = found.measurements, found.noise
    position = {"planar": 2, "point": 2, "spatial": 3}[found.nominal.pose_space]
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


def _coarse_readings(found: Identification) -> Iterator[str]:
    for leg in range(len(found.legs)):
        values, counts = np.unique(
            found.measurements.readings[_used(found, leg), leg], return_counts=True
        )
        if 1 < len(values) < 0.7 * counts.sum():
            step = float(np.diff(values).min())
            yield (
                f"the readings of leg {leg + 1} take only {len(values)} values in steps of "
                f"{step:.3g} {found.nominal.reading_unit}: rounded, or the sensor is coarse"
            )


def _points(mechanism: Mechanism, end: str) -> Array | None:
    """Base or platform points of the legs, legs x 2 or 3; None for a chain without them."""
    names = mechanism.parameter_names
    values = dict(zip(names, mechanism.parameters.T, strict=True))
    if f"{end}_azimuth" in names:
        radius, polar = values[f"{end}_radius"], values[f"{end}_polar_angle"]
        azimuth = values[f"{end}_azimuth"]
        return np.column_stack(
            [
                radius * np.sin(polar) * np.cos(azimuth),
                radius * np.sin(polar) * np.sin(azimuth),
                radius * np.cos(polar),
            ]
        )
    if f"{end}_radius" in names and f"{end}_angle" in names:
        radius, angle = values[f"{end}_radius"], values[f"{end}_angle"]
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return None


def _moved_alike(found: Identification) -> Iterator[str]:
    """Points of all legs that moved like a rigid body: a frame that is not the drawing's."""
    for end, frame, where in (
        ("base", "frame of the measured poses", "the drawing's base frame"),
        ("platform", "measured target", "the drawing's platform frame"),
    ):
        nominal, calibrated = _points(found.nominal, end), _points(found.mechanism, end)
        if nominal is None or calibrated is None:
            continue
        rotation, shift, left = _rigid_motion(nominal, calibrated)
        moved = float(np.sqrt(np.mean((calibrated - nominal) ** 2)))
        tolerance = found.nominal.tolerances.length
        if moved < 3 * tolerance or left > (1 - _ALIKE) * moved + tolerance:
            continue
        angle = math.degrees(_angle(rotation))
        vector = ", ".join(f"{1e3 * value:.3g}" for value in shift)
        yield (
            f"the {end} points of all legs moved alike: the {frame} is turned by {angle:.3g} "
            f"degrees and shifted by ({vector}) mm against {where}"
        )


def _rigid_motion(before: Array, after: Array) -> tuple[Array, Array, float]:
    """Rotation, shift and what they leave (rms) of the movement of points."""
    centre_before, centre_after = before.mean(axis=0), after.mean(axis=0)
    u, _, vt = np.linalg.svd((before - centre_before).T @ (after - centre_after))
    signs = np.ones(before.shape[1])
    signs[-1] = np.sign(np.linalg.det(vt.T @ u.T)) or 1.0
    rotation = vt.T @ np.diag(signs) @ u.T
    shift = centre_after - rotation @ centre_before
    left = after - (before @ rotation.T + shift)
    return rotation, shift, float(np.sqrt(np.mean(left**2)))


def _angle(rotation: Array) -> float:
    if len(rotation) == 2:
        return math.atan2(rotation[1, 0], rotation[0, 0])
    return math.acos(min(1.0, max(-1.0, (float(np.trace(rotation)) - 1) / 2)))


def _scaled(found: Identification) -> Iterator[str]:
    """All lengths larger or smaller by one factor."""
    columns = [
        index
        for index, name in enumerate(found.nominal.parameter_names)
        if name.endswith(("_length", "_radius"))
    ]
    nominal = found.nominal.parameters[:, columns].ravel()
    calibrated = found.mechanism.parameters[:, columns].ravel()
    tolerance = found.nominal.tolerances.length
    large = np.abs(nominal) > 10 * tolerance
    if large.sum() < 3:
        return
    weights = nominal[large] ** 2
    factor = float(np.sum(nominal[large] * calibrated[large]) / np.sum(weights))
    left = float(np.sqrt(np.mean((calibrated[large] - factor * nominal[large]) ** 2)))
    moved = float(np.sqrt(np.mean((calibrated[large] - nominal[large]) ** 2)))
    if moved > 3 * tolerance and left < (1 - _ALIKE) * moved + tolerance:
        yield (
            f"all lengths are {100 * (factor - 1):+.3g} % off the drawing: the measured positions "
            "are in another scale or unit"
        )


def _offset_steps(found: Identification) -> Iterator[str]:
    """Sensor offsets that moved by half turns."""
    nominal, calibrated = found.nominal, found.mechanism
    if chain_info(nominal.chain, nominal.platform).reading_unit != "rad":
        return
    moved = calibrated.parameters[:, -1] - nominal.parameters[:, -1]
    halves = np.round(moved / math.pi)
    near = np.abs(moved - halves * math.pi) < 10 * nominal.tolerances.angle
    for leg in np.flatnonzero((halves != 0) & near):
        words = "a whole turn" if abs(halves[leg]) == 2 else "half a turn"
        if abs(halves[leg]) > 2:
            words = f"{abs(halves[leg]) / 2:g} turns"
        yield f"the sensor of leg {leg + 1} was set to zero {words} away from the drawing's zero"


@dataclass(frozen=True)
class _Match:
    """The readings, of some column, that fit a leg's inverse kinematics best."""

    column: int
    mode: int
    slope: float
    left: float  # share of the variance that a straight line leaves


def _better_readings(nominal: Mechanism, measurements: Measurements) -> Iterator[str]:
    """Orders, signs, working modes, units and mirror images that fit the drawing much better."""
    complete = np.isfinite(measurements.readings).all(axis=1)
    if complete.sum() < len(nominal.parameter_names):
        return
    readings = measurements.readings[complete]
    trials: list[tuple[str, list[_Match]]] = []
    for name, poses in _conventions(nominal, measurements.poses[complete]):
        matches = _matches(nominal, poses, readings)
        if matches is not None:
            trials.append((name, matches))
    if not trials:
        return
    name, best = min(trials, key=lambda trial: _left(trial[1]))
    stated = next((matches for name, matches in trials if not name), None)
    if stated is not None and _left(stated) <= _MUCH_BETTER * _left(best):
        name, best = "", stated
    if name:
        yield f"{name} (the readings then follow the drawing's inverse kinematics)"
    yield from _corrections(nominal, best)


def _left(matches: list[_Match]) -> float:
    return math.exp(sum(math.log(match.left + 1e-15) for match in matches) / len(matches))


def _corrections(nominal: Mechanism, matches: list[_Match]) -> Iterator[str]:
    swapped = [leg for leg, match in enumerate(matches) if match.column != leg]
    if swapped:
        columns = ", ".join(str(matches[leg].column + 1) for leg in swapped)
        yield f"the readings of {named_legs(swapped)} are in the columns of legs {columns}"
    for leg, match in enumerate(matches):
        if match.mode != nominal.working_modes[leg]:
            yield f"leg {leg + 1} stands in working mode {match.mode:+d}"
    flipped = [leg for leg, match in enumerate(matches) if match.slope < 0]
    if flipped:
        yield f"the readings of {named_legs(flipped)} have the opposite sign"
    by_factor: dict[str, list[int]] = {}
    for leg, match in enumerate(matches):
        for factor, words in _FACTORS.items():
            if abs(math.log(abs(match.slope) / factor)) < _NEAR_FACTOR:
                by_factor.setdefault(words, []).append(leg)
        if _NEAR_FACTOR < abs(math.log(abs(match.slope))) < 1:
            yield (
                f"the readings of leg {leg + 1} grow {abs(match.slope):.3g} times as fast as the "
                "drawing's: its sensor_gain or its unit is wrong"
            )
    for words, legs in by_factor.items():
        yield f"the readings of {named_legs(legs)} look like {words}"


def _conventions(nominal: Mechanism, poses: Array) -> Iterator[tuple[str, Array]]:
    """Ways in which poses may have been written down."""
    yield "", poses
    conventions: dict[str, dict[str, tuple[int, ...]]] = {
        "planar": {"y is mirrored": (1, -1, -1), "x is mirrored": (-1, 1, -1)},
        "point": {"y is mirrored": (1, -1), "x is mirrored": (-1, 1)},
        # A mirrored rotation keeps the component of its axis along the mirror's normal.
        "spatial": {
            "x is mirrored": (-1, 1, 1, 1, -1, -1, 1),
            "y is mirrored": (1, -1, 1, -1, 1, -1, 1),
            "z is mirrored": (1, 1, -1, -1, -1, 1, 1),
            "the quaternions turn the other way (base to platform)": (1, 1, 1, -1, -1, -1, 1),
        },
    }
    for words, factors in conventions[nominal.pose_space].items():
        yield f"in the measured poses {words}", poses * np.array(factors, dtype=float)
    if nominal.pose_space == "planar":
        yield "the measured angle has the opposite sign", poses * np.array([1.0, 1.0, -1.0])
    if nominal.pose_space == "spatial":
        order = [0, 1, 2, 4, 5, 6, 3]
        yield "the quaternions are in the order w, x, y, z", poses[:, order]


def _matches(nominal: Mechanism, poses: Array, readings: Array) -> list[_Match] | None:
    """For each leg the column and mode that fit best, every column once; None where none fits."""
    count = len(nominal.legs)
    table = np.full((count, count), np.inf)
    best: dict[tuple[int, int], _Match] = {}
    modes = sorted({-1, 1}, key=lambda mode: mode != nominal.working_modes[0])
    for mode in modes:
        with_mode = _with_modes(nominal, [mode] * count)
        expected = with_mode.inverse_kinematics(poses)
        for leg in range(count):
            reached = np.isfinite(expected[:, leg])
            if reached.sum() < max(4, len(poses) // 2):
                continue
            wanted = _continuous(expected[reached, leg], _turn(nominal, leg))
            for column in range(count):
                slope, left = _line(wanted, readings[reached, column])
                stated = column == leg and mode == nominal.working_modes[leg]
                # What the file says stays unless another reading of it is much better.
                score = left / (_MUCH_BETTER if stated else 1)
                if score < table[leg, column]:
                    table[leg, column] = score
                    best[leg, column] = _Match(column, mode, slope, left)
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


def _continuous(values: Array, turn: float | None) -> Array:
    """Angles about their mean direction, so that none jumps."""
    if turn is None:
        return values
    centre = float(np.angle(np.mean(np.exp(2j * np.pi * values / turn)))) / (2 * np.pi) * turn
    return centre + _wrapped(values - centre, turn)


def _line(wanted: Array, readings: Array) -> tuple[float, float]:
    """Slope of readings over what was wanted, and the share of variance that the line leaves."""
    x, y = wanted - np.median(wanted), readings - np.median(readings)
    # Readings that are outliers must not hide what the others show.
    for _ in range(3):
        slope = float(x @ y / (x @ x)) if x.any() else 1.0
        errors = np.abs(y - slope * x)
        keep = errors <= 5 * np.median(errors) + 1e-12
        if keep.sum() < 4:
            break
        x, y = x[keep] - x[keep].mean(), y[keep] - y[keep].mean()
    total = float(y @ y)
    if total == 0 or not np.isfinite(slope) or slope == 0:
        return 1.0, 1.0
    return slope, float(np.sum((y - slope * x) ** 2) / total)
