# SPDX-License-Identifier: MIT
"""Mistakes of measuring and of typing, recognised in the measurements and in the estimate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError, named_legs
from symkin.identification.corrections import (
    better_readings,
    chi_square_of,
    continuous,
    turn_of,
    turns_in_words,
    with_modes,
    wrapped,
)

if TYPE_CHECKING:
    from symkin.identification.estimate import Identification

__all__ = ["coarse_readings", "likely_causes", "signs_of_mistakes"]

Array = NDArray[np.float64]

# Two measurements of one pose differ by the noise; nearer than this share of it they are copies.
_COPIED = 1e-3
# Chi-square per degree of freedom from which outliers are looked for by a robust loss.
_GROSS = 9.0


def signs_of_mistakes(found: Identification) -> list[str]:
    """Name what speaks against the measurements, whatever the residuals are."""
    return [
        *_other_modes(found),
        *_out_of_reach(found),
        *_lost_turns(found),
        *_copies(found),
    ]


def likely_causes(found: Identification) -> list[str]:
    """Name corrections that explain the measurements of a doubtful estimate better."""
    causes = better_readings(found.nominal, found.measurements, found) or _gross_errors(found)
    return [f"likely cause: {cause}" for cause in causes]


def _gross_errors(found: Identification) -> list[str]:
    """Poses without which everything fits."""
    from symkin.identification.estimate import identify_once

    worst = max((fit.per_degree for fit in found.goodness if fit.unexplained), default=0.0)
    if found.options["loss"] != "none" or worst < _GROSS:
        return []
    try:
        tried = identify_once(
            found.nominal,
            found.measurements,
            "joint" if found.estimator == "joint" else "implicit",
            poses=found.options["poses"],
            loss="cauchy",
            noise=found.noise,
        )
    except SymkinError:
        return []
    rows = sorted({int(row) for leg in tried.legs for row in leg.rejected})
    if not tried.converged or not rows or any(fit.unexplained for fit in tried.goodness):
        return []
    numbers = found.measurements.row_numbers[rows]
    listed = ", ".join(map(str, numbers[:8])) + (" ..." if len(numbers) > 8 else "")
    return [
        f"gross errors in rows {listed}: a robust loss (cauchy) rejects {len(rows)} of "
        f"{len(found.measurements.poses)} poses, and chi-square of the others is "
        f"{chi_square_of(tried):.3g} per degree of freedom"
    ]


def _used(found: Identification, leg: int) -> NDArray[np.intp]:
    fit = found.legs[leg]
    return np.setdiff1d(fit.rows, fit.rejected)


def _other_modes(found: Identification) -> Iterator[str]:
    """Readings that belong to the other root of the closure at the estimate."""
    calibrated, measurements = found.mechanism, found.measurements
    flipped = with_modes(calibrated, [-mode for mode in calibrated.working_modes])
    own = calibrated.inverse_kinematics(measurements.poses)
    other = flipped.inverse_kinematics(measurements.poses)
    all_wrong: dict[int, list[int]] = {}
    for leg, mode in enumerate(calibrated.working_modes):
        rows = _used(found, leg)
        turn = turn_of(calibrated, leg)
        readings = measurements.readings[rows, leg]
        to_own = np.abs(wrapped(readings - own[rows, leg], turn))
        to_other = np.abs(wrapped(readings - other[rows, leg], turn))
        wrong = to_other < to_own
        if wrong.sum() > len(rows) // 2:
            all_wrong.setdefault(mode, []).append(leg)
        elif wrong.any():
            first = measurements.row_numbers[rows[np.argmax(wrong)]]
            yield (
                f"leg {leg + 1}: {wrong.sum()} of {len(rows)} readings (the first in row {first}) "
                f"are those of the other working mode ({-mode:+d})"
            )
    for mode, legs in all_wrong.items():
        yield (
            f"{named_legs(legs)}: the readings are those of working mode {-mode:+d}, but the "
            f"mechanism has {mode:+d}: set working_mode = {-mode}"
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
    """Readings that are turns away from each other, or from where the model has them."""
    measurements = found.measurements
    roots = found.mechanism.inverse_kinematics(measurements.poses)
    for leg in range(len(found.legs)):
        turn = turn_of(found.nominal, leg)
        rows = _used(found, leg)
        readings = measurements.readings[rows, leg]
        if turn is None or len(rows) < 2:
            continue
        by_model = roots[rows, leg] + wrapped(readings - roots[rows, leg], turn)
        away = np.round((readings - roots[rows, leg]) / turn)
        if away[0] and (away == away[0]).all():
            yield (
                f"leg {leg + 1}: all readings are {turns_in_words(away[0])} away from the sensor's "
                "zero that the mechanism has, which the gain and the offset then have to explain"
            )
        for unbroken in (continuous(readings, turn), by_model):
            if not np.isfinite(unbroken).all():
                continue
            turns = np.round((readings - unbroken) / turn)
            turns -= np.median(turns)
            if turns.any() and _largest_gap(readings) > 1.5 * _largest_gap(unbroken):
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


def coarse_readings(found: Identification) -> list[str]:
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
