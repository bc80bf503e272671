# SPDX-License-Identifier: MIT
"""The symmetry that a mechanism has, against the one that it declares or nearly has.

A mechanism nearly has the group that it would have without the errors of manufacture or rounding.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from symkin import _core
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry.groups import (
    DetectedSymmetry,
    SymmetryGroup,
    declared_about_z,
    declared_group,
    detect_symmetry,
    detect_within,
    group_title,
    subgroup_names,
)
from symkin.model.tolerances import parameter_tolerances
from symkin.options import checks
from symkin.results import Result
from symkin.values import Value, field, plain, record

SymmetryVerdict = Literal["exact", "nearly", "broken"]

_ROUNDING = _core.SymmetryTolerance()
# Two legs that are made alike differ in dozens of parameters, each by a normal error of both.
_NEARLY = 6.0  # tolerances
_GROWTH = 2**0.5
# The centre that the detection finds moves with every leg's errors, and on a small platform turns
# its legs by a multiple of them; about the origin the same group may well be near.
_DETECTED_UP_TO = 4 * _NEARLY
_LARGEST_SHARE = 0.5  # of the largest parameter, and rad: beyond, any legs are alike
_EXACT = _core.IMAGE_TOLERANCES * _ROUNDING.length  # m, rad, and of gains


@record
class ParameterDeviation(Value):
    """By how much one parameter of one leg breaks a symmetry of the structure, or of the sensors.

    Attributes
    ----------
    leg : int
        From 0.
    parameter : str
        Its name.
    deviation : float
        Of the leg, carried back to its orbit's first leg, from the median of the orbit, with the
        sign that it has where the leg stands; m, rad, or the gain's unit.
    in_tolerances : float
        The same over the parameter's manufacturing tolerance, without sign.
    standard_deviation : float
        Of the identified parameter; NaN for a mechanism that was not calibrated.
    unit : str
        Of both: "m", "rad", ...; empty for a number.
    """

    leg: int = field(number=True)
    parameter: str
    deviation: float
    in_tolerances: float
    standard_deviation: float
    unit: str


@record
class SymmetryComparison(Result):
    """What `compare_symmetry` finds.

    Attributes
    ----------
    declared : SymmetryGroup or None
        The declared group.
    found : DetectedSymmetry
        What the legs have to rounding (1e-6 m and rad).
    verdict : {"exact", "nearly", "broken"}
        "exact": the declared group, or else the one found, holds to rounding, and no larger one
        nearly does. "nearly": `reference` holds within a few manufacturing tolerances, and so does
        every single parameter. "broken": not even that.
    reference : SymmetryGroup or None
        The group that is nearly there or broken: the declared one, or the larger one that the legs
        have within their tolerances, or the nearest. None if the symmetry is exact, or if there is
        nothing to compare with.
    reference_elements : tuple of str
        Those of its elements that keep the working modes too.
    tolerance : tuple of float
        Within which `reference`, or else the exact group, maps the legs onto themselves: of
        lengths (m), of angles (rad) and of gains.
    deviations : tuple of ParameterDeviation
        What breaks `reference` in the structure, largest in tolerances first.
    sensors : {"exact", "nearly", "broken"}
        Whether gains and offsets have the structure's symmetry too, as far as it keeps the working
        modes. They are not part of the structure, and poses are carried from leg to leg without.
    sensor_deviations : tuple of ParameterDeviation
        The gains and offsets that do not, likewise.
    spatial : bool
        Whether the mechanism is spatial: then symmetries about Z alone were looked for.
    """

    declared: SymmetryGroup | None
    found: DetectedSymmetry
    verdict: SymmetryVerdict
    reference: SymmetryGroup | None
    reference_elements: tuple[str, ...]
    tolerance: tuple[float, float, float]
    deviations: tuple[ParameterDeviation, ...]
    sensors: SymmetryVerdict
    sensor_deviations: tuple[ParameterDeviation, ...]
    spatial: bool

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, in words."""
        structure = self.found.structure.title
        if self.declared is not None:
            verb = "do not have" if self.reference is self.declared else "have"
            first = f"The legs {verb} the declared symmetry {self.declared.title}."
        elif self.found.structure.size > 1:
            first = f"No symmetry is declared; the legs have {structure}."
        else:
            about = " about Z" if self.spatial else ""
            first = f"No symmetry{about} is declared, and the legs have none: {structure} is "
            first += "trivial."
        sensors = (self._sensor_sentence,) if self.sensors != "exact" else ()
        if self.reference is None:
            return (first, *sensors)
        kept = [self.reference.parse(label) for label in self.reference_elements]
        named = self.reference.title
        if len(kept) < self.reference.size:
            named += (
                f", with the working modes {group_title(*subgroup_names(self.reference, kept))}"
            )
        off = f"{self.worst:.3g} manufacturing tolerances"
        if self.verdict == "nearly":
            return first, f"Nearly {named}: within {off}.", *sensors
        return first, f"Far from the nearest, {named}: off by {off}.", *sensors

    @property
    def worst(self) -> float:
        """The largest deviation of the structure, in tolerances."""
        return self.deviations[0].in_tolerances if self.deviations else 0.0

    @property
    def only_sensors_differ(self) -> str:
        """``"only sensor_offset differs"``; empty unless the structure alone has the symmetry."""
        if self.reference is not None or self.sensors == "exact":
            return ""
        return f"only {self._differing_sensors}"

    @property
    def _differing_sensors(self) -> str:
        names = sorted({found.parameter for found in self.sensor_deviations})
        return f"{' and '.join(names)} {'differ' if len(names) > 1 else 'differs'}"

    @property
    def _sensor_sentence(self) -> str:
        if self.reference is not None:
            return f"Of the sensors, {self._differing_sensors}."
        return (
            f"{self.only_sensors_differ.capitalize()}: the structure has the symmetry, the sensors "
            "do not."
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values, legs counted from 1."""
        reference = self.reference
        return {
            "verdict": self.verdict,
            "declared_group": self.declared and self.declared.name,
            "compared_with": reference
            and {
                "name_in_the_paper": reference.paper_name,
                "name": reference.name,
                "elements_that_keep_the_working_modes": list(self.reference_elements),
                "worst_in_tolerances": self.worst,
            },
            "deviations": plain(self.deviations),
            "sensors": {"verdict": self.sensors, "deviations": plain(self.sensor_deviations)},
        }

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row a deviation; legs count from 0."""
        names = "leg", "parameter", "deviation", "unit", "in_tolerances", "standard_deviation"
        found = self.deviations + self.sensor_deviations
        return {name: [getattr(each, name) for each in found] for name in names}


@checks()
def compare_symmetry(mechanism: MechanismGiven) -> SymmetryComparison:
    """Compare the symmetry that the legs have with the one declared, or nearly there.

    A calibrated mechanism, or one whose file has rounded numbers, has no exact symmetry. What it
    would be without these errors, and which legs and parameters break it by how much, is found with
    the manufacturing tolerances.

    Parameters
    ----------
    mechanism : Mechanism
        Its tolerances are used.
    """
    mechanism = as_mechanism(mechanism)
    found = detect_symmetry(mechanism)
    about_z = declared_about_z(mechanism)
    declared = None if about_z is None else declared_group(about_z)
    lacks = (
        declared is not None
        and _tolerances_needed(mechanism, declared, _ROUNDING) > _core.IMAGE_TOLERANCES
    )
    reference = declared if lacks else _larger_group(mechanism, found.structure)
    verdict: SymmetryVerdict
    kept: tuple[str, ...] = ()
    if reference is None:
        verdict = "exact" if declared is not None or found.structure.size > 1 else "broken"
        group, tolerance = declared or found.with_modes, _ROUNDING
    else:
        needed = _tolerances_needed(mechanism, reference)
        verdict = "nearly" if needed <= _near_limit(reference) else "broken"
        group = reference
        tolerance = scaled_tolerance(mechanism, max(_near_limit(reference), 1.001 * needed))
        kept = tuple(
            element.label
            for element in group.elements
            if _core.image_of_legs(mechanism.straight, group.core, element, tolerance).keeps_modes
        )
    structure, sensors = _deviations(mechanism, group, tolerance)
    # The images of two legs share what lies between them; a single parameter may be off by more.
    if verdict == "nearly" and any(each.in_tolerances > _near_limit(group) for each in structure):
        verdict = "broken"
    of_sensors: SymmetryVerdict = "exact"
    if sensors:
        of_sensors = "nearly" if sensors[0].in_tolerances <= _near_limit(group) else "broken"
    return SymmetryComparison(
        declared=declared,
        found=found,
        verdict=verdict,
        reference=reference,
        reference_elements=kept,
        tolerance=(tolerance.length, tolerance.angle, tolerance.gain),
        deviations=structure if reference is not None else (),
        sensors=of_sensors,
        sensor_deviations=sensors,
        spatial=mechanism.space.in_space,
    )


def _deviations(
    mechanism: Mechanism, group: SymmetryGroup, tolerance: _core.SymmetryTolerance
) -> tuple[tuple[ParameterDeviation, ...], tuple[ParameterDeviation, ...]]:
    """Those above rounding: of the structure, and of the sensors."""
    values = _core.symmetry_deviations(mechanism.straight, group.core, tolerance)
    known, scales = mechanism.deviations, parameter_tolerances(mechanism)
    # What is held has no tolerance of its own, but legs may differ in it.
    made = mechanism.tolerances
    units = [mechanism.parameter_units(leg) for leg in range(len(mechanism.legs))]
    held = [[made.angle if unit == "rad" else made.length for unit in each] for each in units]
    scales = np.where(scales > 0, scales, held)
    structure: list[ParameterDeviation] = []
    sensors: list[ParameterDeviation] = []
    for leg, index in zip(*np.nonzero(np.abs(values) > _EXACT), strict=True):
        found = ParameterDeviation(
            leg=int(leg),
            parameter=mechanism.parameter_names[index],
            deviation=float(values[leg, index]),
            in_tolerances=float(abs(values[leg, index]) / scales[leg, index]),
            standard_deviation=float("nan" if known is None else known[leg, index]),
            unit=units[leg][index],
        )
        of_sensor = mechanism.parameter_roles(leg)[index].of_sensor
        (sensors if of_sensor else structure).append(found)
    return _largest_first(structure), _largest_first(sensors)


def _largest_first(deviations: list[ParameterDeviation]) -> tuple[ParameterDeviation, ...]:
    return tuple(sorted(deviations, key=lambda each: -each.in_tolerances))


def _larger_group(mechanism: Mechanism, found: SymmetryGroup) -> SymmetryGroup | None:
    """Find the largest group beyond the one that the legs have, which they nearly have.

    For a mechanism without any symmetry the nearest group, if none is near; else None.
    """
    near = nearest = None
    for multiple, tolerance in _growing(mechanism):
        if multiple > _DETECTED_UP_TO and (near or nearest or found.size > 1):
            break
        detected = detect_within(mechanism, tolerance)
        loose = detected.structure
        if loose.size > (near or found).size:
            group = _about_the_origins(mechanism, loose)
            if detected.with_modes.size > 1:  # or no leg has another to be compared with
                nearest = nearest or group
            if _tolerances_needed(mechanism, group) <= _near_limit(group):
                near = group
    return near or (nearest if found.size == 1 else None)


def _near_limit(group: SymmetryGroup) -> float:
    """Up to how many tolerances a group is near; a reflection doubles the error of an angle."""
    return 2 * _NEARLY if group.dihedral else _NEARLY


def scaled_tolerance(mechanism: Mechanism, multiple: float) -> _core.SymmetryTolerance:
    """Return what lets the images of legs be off by so many manufacturing tolerances."""
    return _manufacturing(mechanism, multiple / _core.IMAGE_TOLERANCES)


def _tolerances_needed(
    mechanism: Mechanism, group: SymmetryGroup, unit: _core.SymmetryTolerance | None = None
) -> float:
    """How many tolerances the legs' images are off at most, sensors apart; infinity if two are one.

    A tolerance is `unit`, by default the manufacturing one.
    """
    one = _manufacturing(mechanism, 1) if unit is None else unit
    worst = 0.0
    for element in group.elements:
        image = _core.image_of_legs(mechanism.straight, group.core, element, one)
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
    allowed = max(_near_limit(found), 2 * _tolerances_needed(mechanism, found))
    groups = [SymmetryGroup(name, axis) for axis in _axes(mechanism, found)]
    near = [group for group in groups if _tolerances_needed(mechanism, group) <= allowed]
    return min(near, key=lambda group: _spread(mechanism, group, allowed), default=found)


def _axes(mechanism: Mechanism, found: SymmetryGroup) -> list[float]:
    """The axis that was found, and those near it on which pairs of legs mirror each other."""
    axis = found.frame.base_axis
    if not found.dihedral:
        return [axis]
    chains = np.array(mechanism.chains)
    alike = chains[:, np.newaxis] == chains
    azimuths = np.array([_base_azimuth(mechanism, leg) for leg in range(len(chains))])
    between = (azimuths[:, np.newaxis] + azimuths)[alike] / 2 - axis
    between = between[np.isfinite(between)]
    offsets = np.remainder(between + math.pi / (2 * found.rotations), math.pi / found.rotations)
    offsets -= math.pi / (2 * found.rotations)
    return [axis, *(axis + offsets[np.abs(offsets) < 0.1]).tolist()]


def _base_azimuth(mechanism: Mechanism, leg: int) -> float:
    """Of the base point or the guide of a leg; NaN if it has none."""
    for value, (end, kind) in zip(
        mechanism.parameters[leg], mechanism.parameter_roles(leg), strict=True
    ):
        if end == "base" and kind in ("azimuth", "direction_azimuth"):
            return float(value)
    return math.nan


def _spread(mechanism: Mechanism, group: SymmetryGroup, multiple: float) -> float:
    """Sum of the roots of all deviations in tolerances: one is less than its parts."""
    tolerance = scaled_tolerance(mechanism, multiple)
    deviations = _core.symmetry_deviations(mechanism.straight, group.core, tolerance)
    units = _manufacturing(mechanism, 1)
    legs = range(len(mechanism.legs))
    structure = [[not role.of_sensor for role in mechanism.parameter_roles(leg)] for leg in legs]
    scale = [
        [units.angle if unit == "rad" else units.length for unit in mechanism.parameter_units(leg)]
        for leg in legs
    ]
    shares = np.abs(deviations / np.array(scale))[np.array(structure)]
    return float(np.sqrt(shares).round(9).sum())
