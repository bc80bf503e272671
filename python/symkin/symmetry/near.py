# SPDX-License-Identifier: MIT
"""The group that a mechanism would have without the errors of manufacture or of rounding."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from symkin import _core
from symkin.mechanism import Mechanism
from symkin.symmetry.group import SymmetryGroup

__all__ = ["larger_group", "near_limit", "scaled_tolerance", "tolerances_needed"]

# Two legs that are made alike differ in dozens of parameters, each by a normal error of both.
_NEARLY = 6.0  # tolerances
_GROWTH = 2**0.5
# The centre that the detection finds moves with every leg's errors, and on a small platform turns
# its legs by a multiple of them; about the origin the same group may well be near.
_DETECTED_UP_TO = 4 * _NEARLY
_LARGEST_SHARE = 0.5  # of the largest parameter, and rad: beyond, any legs are alike


def larger_group(mechanism: Mechanism, found: SymmetryGroup) -> SymmetryGroup | None:
    """Find the largest group beyond the one that the legs have, which they nearly have.

    Parameters
    ----------
    mechanism : Mechanism
        Its tolerances say what is near.
    found : SymmetryGroup
        What the legs have.

    Returns
    -------
    SymmetryGroup or None
        For a mechanism without any symmetry the nearest group, if none is near.
    """
    near = nearest = None
    for multiple, tolerance in _growing(mechanism):
        if multiple > _DETECTED_UP_TO and (near or nearest or found.size > 1):
            break
        detected = _core.detect_symmetry(mechanism.core, tolerance)
        loose = detected.structure
        if loose.size > (near or found).size:
            group = _about_the_origins(mechanism, loose)
            if detected.with_modes.size > 1:  # or no leg has another to be compared with
                nearest = nearest or group
            if tolerances_needed(mechanism, group) <= near_limit(group):
                near = group
    return near or (nearest if found.size == 1 else None)


def near_limit(group: SymmetryGroup) -> float:
    """Up to how many tolerances a group is near; a reflection doubles the error of an angle."""
    return 2 * _NEARLY if group.dihedral else _NEARLY


def scaled_tolerance(mechanism: Mechanism, multiple: float) -> _core.SymmetryTolerance:
    """Return what lets the images of legs be off by so many manufacturing tolerances."""
    return _manufacturing(mechanism, multiple / _core.IMAGE_TOLERANCES)


def tolerances_needed(
    mechanism: Mechanism, group: SymmetryGroup, unit: _core.SymmetryTolerance | None = None
) -> float:
    """How many tolerances the legs' images are off at most, sensors apart; infinity if two are one.

    Parameters
    ----------
    mechanism : Mechanism
        Whose legs are carried.
    group : SymmetryGroup
        By each of its elements.
    unit : SymmetryTolerance, optional
        What is counted in, by default the manufacturing tolerances.
    """
    one = _manufacturing(mechanism, 1) if unit is None else unit
    worst = 0.0
    for element in group.elements:
        image = _core.image_of_legs(mechanism.core, group, element, one)
        if len(set(image.permutation)) < len(image.permutation):
            return math.inf
        worst = max(worst, *(deviation.in_tolerances for deviation in image.deviations))
    return worst


def _manufacturing(mechanism: Mechanism, multiple: float) -> _core.SymmetryTolerance:
    tolerances, gains = mechanism.tolerances, mechanism.sensor_gains
    return _core.SymmetryTolerance(
        multiple * tolerances.length,
        multiple * tolerances.angle,
        multiple * tolerances.gain * float(np.abs(gains).max()),
    )


def _growing(mechanism: Mechanism) -> Iterator[tuple[float, _core.SymmetryTolerance]]:
    """Tolerances from a few manufacturing ones to where legs are hardly told apart."""
    length = _LARGEST_SHARE * float(np.abs(mechanism.parameters).max()) / _core.IMAGE_TOLERANCES
    angle = _LARGEST_SHARE / _core.IMAGE_TOLERANCES
    multiple = _NEARLY
    while True:
        full = scaled_tolerance(mechanism, multiple)
        smaller = min(full.length, length), min(full.angle, angle)
        yield multiple, _core.SymmetryTolerance(*smaller, full.gain)
        if full.length > length and full.angle > angle:
            return
        multiple *= _GROWTH


def _about_the_origins(mechanism: Mechanism, found: SymmetryGroup) -> SymmetryGroup:
    """The same group about the frames' origins, if the legs have that nearly as well.

    A centre and an axis that are found from all legs move with each error of one, and so would
    spread it over the others. Of several axes the one is taken that leaves fewest to explain.
    """
    name = found.name.replace("_", "")
    allowed = max(near_limit(found), 2 * tolerances_needed(mechanism, found))
    groups = [SymmetryGroup(name, axis) for axis in _axes(mechanism, found)]
    near = [group for group in groups if tolerances_needed(mechanism, group) <= allowed]
    return min(near, key=lambda group: _spread(mechanism, group, allowed), default=found)


def _axes(mechanism: Mechanism, found: SymmetryGroup) -> list[float]:
    """The axis that was found, and those near it on which pairs of legs mirror each other."""
    axis = found.frame.base_axis
    turning = [
        index
        for index, (end, kind) in enumerate(mechanism.parameter_roles)
        if end == "base" and kind in ("azimuth", "direction_azimuth")
    ]
    if not found.dihedral or not turning:
        return [axis]
    azimuths = mechanism.parameters[:, turning[0]]
    between = (azimuths[:, np.newaxis] + azimuths).ravel() / 2 - axis
    offsets = np.remainder(between + math.pi / (2 * found.rotations), math.pi / found.rotations)
    offsets -= math.pi / (2 * found.rotations)
    return [axis, *(axis + offsets[np.abs(offsets) < 0.1]).tolist()]


def _spread(mechanism: Mechanism, group: SymmetryGroup, multiple: float) -> float:
    """Sum of the roots of all deviations in tolerances: one is less than its parts."""
    tolerance = scaled_tolerance(mechanism, multiple)
    deviations = _core.symmetry_deviations(mechanism.core, group, tolerance)
    units = _manufacturing(mechanism, 1)
    structure = [not role.of_sensor for role in mechanism.parameter_roles]
    scale = [units.angle if unit == "rad" else units.length for unit in mechanism.parameter_units]
    shares = np.abs(deviations / scale)[:, structure]
    return float(np.sqrt(shares).round(9).sum())
