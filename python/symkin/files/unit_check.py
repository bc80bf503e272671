# SPDX-License-Identifier: MIT
"""Measurements whose unit is evidently another than stated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from symkin.errors import MeasurementError
from symkin.files.quantities import unit_factor

if TYPE_CHECKING:
    from symkin.measurements import Measurements
    from symkin.mechanism import Mechanism

__all__ = ["StatedUnit", "check_units"]

# A wrong unit leaves closures as large as the legs; an uncalibrated mechanism, a few percent.
_POOR_FIT = 0.05
_MUCH_BETTER = 10.0
# Columns of a pose array, by the values and its number of coordinates.
_COLUMNS = {
    ("positions", 2): slice(0, 2),
    ("positions", 3): slice(0, 2),
    ("positions", 7): slice(0, 3),
    ("angles", 3): slice(2, 3),
}
_MISTAKEN_FOR_EACH_OTHER = {"rad": ("rad", "deg", "rev"), "m": ("m", "mm")}


@dataclass(frozen=True)
class StatedUnit:
    """The unit that the file states for some of the values.

    Attributes
    ----------
    values : {"readings", "positions", "angles"}
        Which values; "angles" are those of a planar platform.
    column : str
        The first of the columns that hold them.
    unit, si_unit : str
        The unit stated, and the one that the values are in now.
    """

    values: str
    column: str
    unit: str
    si_unit: str


def check_units(
    measurements: Measurements, mechanism: Mechanism, stated_units: Sequence[StatedUnit]
) -> None:
    """Refuse measurements that fit the nominal mechanism far better in another unit.

    Raises
    ------
    MeasurementError
        If the root mean square closure of all legs is above 5% of the mean leg dimension, and
        another unit of one group of columns makes it ten times smaller. Names the column, its
        stated unit and the likely one.
    """
    as_stated = _closure_rms(measurements, mechanism)
    if as_stated <= _POOR_FIT * _leg_dimension(measurements, mechanism):
        return
    trials = [
        (_closure_rms(changed, mechanism), stated, unit)
        for stated in stated_units
        for unit, changed in _in_other_units(measurements, stated)
    ]
    closure, stated, unit = min(trials, key=lambda trial: trial[0])
    if closure * _MUCH_BETTER <= as_stated:
        raise MeasurementError(
            f'{measurements.source}: the {stated.values} (column "{stated.column}") are stated in '
            f"{stated.unit} but fit in {unit}: at the nominal parameters the legs close to "
            f"{as_stated:.3g} m rms in {stated.unit}, to {closure:.3g} m in {unit}"
        )


def _in_other_units(
    measurements: Measurements, stated: StatedUnit
) -> Iterator[tuple[str, Measurements]]:
    for unit in _MISTAKEN_FOR_EACH_OTHER[stated.si_unit]:
        if unit == stated.unit:
            continue
        factor = unit_factor(unit, stated.si_unit) / unit_factor(stated.unit, stated.si_unit)
        if stated.values == "readings":
            yield unit, replace(measurements, readings=measurements.readings * factor)
        else:
            poses = measurements.poses.copy()
            poses[:, _COLUMNS[stated.values, poses.shape[1]]] *= factor
            yield unit, replace(measurements, poses=poses)


def _closure_rms(measurements: Measurements, mechanism: Mechanism) -> float:
    closures = []
    for leg in measurements.measured_legs:
        rows = measurements.rows_of(leg)
        readings = measurements.readings[rows, leg]
        closures.append(mechanism.closure(leg, measurements.poses[rows], readings))
    return float(np.sqrt(np.mean(np.concatenate(closures) ** 2)))


def _leg_dimension(measurements: Measurements, mechanism: Mechanism) -> float:
    """Mean size of the legs' lengths and radii; of the positions for a chain that has neither."""
    lengths = [
        abs(value)
        for leg in mechanism.legs
        for name, value in leg.parameters.items()
        if name.endswith(("_length", "_radius")) and value
    ]
    return float(np.mean(lengths or np.abs(measurements.poses[:, :2])))
