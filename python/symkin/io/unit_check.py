# SPDX-License-Identifier: MIT
"""Measurements whose units are evidently others than stated."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.errors import MeasurementError
from symkin.io.columns import PoseValues, StatedUnit
from symkin.io.quantities import unit_factor

if TYPE_CHECKING:
    from symkin.measurements import Measurements
    from symkin.mechanism import Mechanism

__all__ = ["check_units"]

# A wrong unit leaves closures as large as the legs; an uncalibrated mechanism, a few percent.
_POOR_FIT = 0.05
_MUCH_BETTER = 10.0
# Small enough units make every pose and reading nearly zero, which fits a mechanism whose home is
# there: a fit is one only if the readings of other poses would not do as well.
_BETTER_THAN_MIXED_UP = 5.0
_MISTAKEN_FOR_EACH_OTHER = {"rad": ("rad", "deg", "rev"), "m": ("m", "mm", "cm", "inch")}


def check_units(
    values: PoseValues,
    measurements: Measurements,
    mechanism: Mechanism,
    stated_units: Sequence[StatedUnit],
) -> None:
    """Refuse measurements that fit the nominal mechanism far better in other units.

    Fits are told by medians over the finite closures, which outliers do not move.

    Raises
    ------
    MeasurementError
        If the median closure of all legs is above 5% of the mean leg dimension, and other units of
        one or more groups of columns make it ten times smaller. Names the columns, their stated
        units and the likely ones.
    """
    as_stated = _median_closure(measurements, mechanism)
    if not as_stated > _POOR_FIT * _leg_dimension(measurements, mechanism):
        return
    with np.errstate(over="ignore", invalid="ignore"):
        trials = [
            (_median_closure(changed, mechanism), units, changed)
            for units, changed in _in_other_units(values, measurements, stated_units)
        ]
    closure, units, likely = min(trials, key=lambda trial: trial[0])
    mixed_up = _median_closure(_mixed_up(likely), mechanism)
    if closure * _MUCH_BETTER <= as_stated and closure * _BETTER_THAN_MIXED_UP < mixed_up:
        wrong = ", and ".join(
            f'the {stated.values} (column "{stated.column}") are stated in {stated.unit} but fit '
            f"in {unit}"
            for stated, unit in zip(stated_units, units, strict=True)
            if unit != stated.unit
        )
        raise MeasurementError(
            f"{measurements.source}: {wrong}: at the nominal parameters, the legs would close to "
            f"{closure:.3g} m in the median instead of {as_stated:.3g} m"
        )


def _in_other_units(
    values: PoseValues, measurements: Measurements, stated_units: Sequence[StatedUnit]
) -> Iterator[tuple[tuple[str, ...], Measurements]]:
    """Every other combination of units, and the measurements in it."""
    stated = tuple(group.unit for group in stated_units)
    choices = [
        dict.fromkeys((group.unit, *_MISTAKEN_FOR_EACH_OTHER[group.si_unit]))
        for group in stated_units
    ]
    for units in itertools.product(*choices):
        if units == stated:
            continue
        factors = {
            group.values: unit_factor(unit, group.si_unit) / unit_factor(group.unit, group.si_unit)
            for group, unit in zip(stated_units, units, strict=True)
        }
        poses = values.poses(factors["positions"], factors.get("angles", 1.0))
        readings = measurements.readings * factors["readings"]
        yield units, replace(measurements, poses=poses, readings=readings)


def _mixed_up(measurements: Measurements) -> Measurements:
    """Each pose with the readings of another pose of its set."""
    readings = measurements.readings.copy()
    for leg in measurements.measured_legs:
        rows = measurements.rows_of(leg)
        readings[rows, leg] = np.roll(readings[rows, leg], max(1, len(rows) // 2))
    return replace(measurements, readings=readings)


def _median_closure(measurements: Measurements, mechanism: Mechanism) -> float:
    """Infinite if no closure is finite."""
    closures: list[NDArray[np.float64]] = []
    for leg in measurements.measured_legs:
        rows = measurements.rows_of(leg)
        readings = measurements.readings[rows, leg]
        closures.append(mechanism.closure(leg, measurements.poses[rows], readings))
    sizes = np.abs(np.concatenate(closures)) if closures else np.empty(0)
    finite = sizes[np.isfinite(sizes)]
    return float(np.median(finite)) if len(finite) else np.inf


def _leg_dimension(measurements: Measurements, mechanism: Mechanism) -> float:
    """Mean size of the legs' lengths and radii; of the positions for a chain that has neither."""
    lengths = [
        abs(value)
        for leg in mechanism.legs
        for name, value in leg.parameters.items()
        if name.endswith(("_length", "_radius")) and value
    ]
    if lengths:
        return float(np.mean(lengths))
    return float(np.median(np.abs(measurements.poses[:, :2])))
