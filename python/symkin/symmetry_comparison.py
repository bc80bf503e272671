# SPDX-License-Identifier: MIT
"""The symmetry that a mechanism has, against the one that it declares or nearly has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from symkin import _core
from symkin.groups import group_title, subgroup_names
from symkin.mechanism import Mechanism
from symkin.observability import tolerances_of
from symkin.symmetry import DetectedSymmetry, SymmetryGroup, declared_group, detect_symmetry

__all__ = [
    "ParameterDeviation",
    "SymmetryComparison",
    "SymmetryVerdict",
    "compare_symmetry",
    "scaled_tolerance",
]

SymmetryVerdict = Literal["exact", "nearly", "broken"]

# Two legs that are made alike differ in dozens of parameters, each by a normal error of both.
_NEARLY = 6.0  # tolerances
_GROWTH = 2**0.5
_LARGEST_SHARE = 0.5  # of the largest parameter, and rad: beyond, any legs are alike


@dataclass(frozen=True)
class ParameterDeviation:
    """By how much one parameter of one leg breaks a symmetry.

    Attributes
    ----------
    leg : int
        From 0.
    parameter : str
        Its name.
    deviation : float
        Of the leg, carried back to its orbit's first leg, from the median of the orbit; m, rad, or
        the gain's unit.
    in_tolerances : float
        The same over the parameter's manufacturing tolerance, without sign.
    standard_deviation : float
        Of the identified parameter; NaN for a mechanism that was not calibrated.
    """

    leg: int
    parameter: str
    deviation: float
    in_tolerances: float
    standard_deviation: float


@dataclass(frozen=True)
class SymmetryComparison:
    """What `compare_symmetry` finds.

    Attributes
    ----------
    declared : SymmetryGroup or None
        The declared group.
    found : DetectedSymmetry
        What the legs have to rounding (1e-6 m and rad).
    verdict : {"exact", "nearly", "broken"}
        "exact": the declared group, or else the one found, holds to rounding, and no larger one
        nearly does. "nearly": `reference` holds within a few manufacturing tolerances. "broken":
        not even that.
    reference : SymmetryGroup or None
        The group that is nearly there or broken: the declared one, or the larger one that the legs
        have within their tolerances, or the nearest. None if the symmetry is exact, or if there is
        nothing to compare with.
    reference_elements : tuple of str
        Those of its elements that keep the working modes too.
    tolerance : SymmetryTolerance
        Within which `reference` maps the legs onto themselves.
    deviations : tuple of ParameterDeviation
        What breaks `reference`, largest in tolerances first.
    """

    declared: SymmetryGroup | None
    found: DetectedSymmetry
    verdict: SymmetryVerdict
    reference: SymmetryGroup | None
    reference_elements: tuple[str, ...]
    tolerance: _core.SymmetryTolerance
    deviations: tuple[ParameterDeviation, ...]

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, in words."""
        structure = _title(self.found.structure)
        if self.declared is not None:
            verb = "do not have" if self.reference is self.declared else "have"
            first = f"The legs {verb} the declared symmetry {_title(self.declared)}."
        elif self.found.structure.size > 1:
            first = f"No symmetry is declared; the legs have {structure}."
        else:
            first = f"No symmetry is declared, and the legs have none: {structure} is trivial."
        if self.reference is None:
            return (first,)
        kept = [self.reference.parse(label) for label in self.reference_elements]
        named = _title(self.reference)
        if len(kept) < self.reference.size:
            named += (
                f", with the working modes {group_title(*subgroup_names(self.reference, kept))}"
            )
        off = f"{self.worst:.3g} manufacturing tolerances"
        if self.verdict == "nearly":
            return first, f"Nearly {named}: within {off}."
        return first, f"Far from the nearest, {named}: off by {off}."

    @property
    def worst(self) -> float:
        """The largest deviation, in tolerances."""
        return self.deviations[0].in_tolerances if self.deviations else 0.0


def compare_symmetry(mechanism: Mechanism) -> SymmetryComparison:
    """Compare the symmetry that the legs have with the one declared, or nearly there.

    A calibrated mechanism, or one whose file has rounded numbers, has no exact symmetry. What it
    would be without these errors, and which legs and parameters break it by how much, is found with
    the manufacturing tolerances.

    Parameters
    ----------
    mechanism : Mechanism
        Its tolerances are used.

    Returns
    -------
    SymmetryComparison
    """
    found = detect_symmetry(mechanism)
    declared = None if mechanism.symmetry is None else declared_group(mechanism.symmetry)
    reference = _reference(mechanism, found, declared)
    if reference is None:
        holds = declared is not None or found.structure.size > 1
        return SymmetryComparison(
            declared,
            found,
            "exact" if holds else "broken",
            None,
            (),
            _core.SymmetryTolerance(),
            (),
        )
    needed = _needed(mechanism, reference)
    tolerance = scaled_tolerance(mechanism, max(_NEARLY, 1.001 * needed))
    kept = (
        element.label
        for element in reference.elements
        if _core.image_of_legs(mechanism.core, reference, element, tolerance).keeps_modes
    )
    return SymmetryComparison(
        declared,
        found,
        "nearly" if needed <= _limit(reference) else "broken",
        reference,
        tuple(kept),
        tolerance,
        _deviations(mechanism, reference, tolerance),
    )


def scaled_tolerance(mechanism: Mechanism, multiple: float) -> _core.SymmetryTolerance:
    """Return a multiple of the manufacturing tolerances, as the detection takes it."""
    tolerances, gains = mechanism.tolerances, mechanism.parameters[:, -2]
    return _core.SymmetryTolerance(
        multiple * tolerances.length,
        multiple * tolerances.angle,
        multiple * tolerances.gain * float(np.abs(gains).max()),
    )


def _reference(
    mechanism: Mechanism, found: DetectedSymmetry, declared: SymmetryGroup | None
) -> SymmetryGroup | None:
    """The group that the legs lack although they should, or nearly, have it."""
    if declared is not None and not _has(mechanism, declared, _core.SymmetryTolerance()):
        return declared
    for tolerance in _growing(mechanism):
        loose = _core.detect_symmetry(mechanism.core, tolerance).structure
        if loose.size > found.structure.size:
            return _about_the_origin(mechanism, loose)
        if found.structure.size > 1:  # with a symmetry of its own, only what is near counts
            return None
    return None


def _about_the_origin(mechanism: Mechanism, found: SymmetryGroup) -> SymmetryGroup:
    """The same group about the frames' origins, if the legs have that nearly as well.

    A centre that is found from all legs moves with each error of one, and so would spread it over
    the others.
    """
    group = SymmetryGroup(found.name.replace("_", ""), found.frame.base_axis)
    allowed = max(_limit(group), 2 * _needed(mechanism, found))
    return group if _needed(mechanism, group) <= allowed else found


def _limit(group: SymmetryGroup) -> float:
    """Up to how many tolerances a group is near; a reflection doubles the error of an angle."""
    return 2 * _NEARLY if group.dihedral else _NEARLY


def _growing(mechanism: Mechanism) -> Iterator[_core.SymmetryTolerance]:
    """Tolerances from a few manufacturing ones to where legs are hardly told apart."""
    sizes = np.abs(mechanism.parameters).max()
    length, gain = (
        _LARGEST_SHARE * float(sizes),
        _LARGEST_SHARE * float(np.abs(mechanism.parameters[:, -2]).max()),
    )
    multiple = _NEARLY
    yield scaled_tolerance(mechanism, multiple)
    tolerance = _core.SymmetryTolerance(0, 0, 0)
    while tolerance.length < length or tolerance.angle < _LARGEST_SHARE or tolerance.gain < gain:
        multiple *= _GROWTH
        full = scaled_tolerance(mechanism, multiple)
        tolerance = _core.SymmetryTolerance(
            min(full.length, length), min(full.angle, _LARGEST_SHARE), min(full.gain, gain)
        )
        yield tolerance


def _has(mechanism: Mechanism, group: SymmetryGroup, tolerance: _core.SymmetryTolerance) -> bool:
    return all(
        _core.image_of_legs(mechanism.core, group, element, tolerance).keeps_structure
        for element in group.elements
    )


def _needed(mechanism: Mechanism, group: SymmetryGroup) -> float:
    """How many manufacturing tolerances the legs' images are off, at most."""
    one = scaled_tolerance(mechanism, 1)
    return max(
        deviation.in_tolerances
        for element in group.elements
        for deviation in _core.image_of_legs(mechanism.core, group, element, one).deviations
    )


def _deviations(
    mechanism: Mechanism, group: SymmetryGroup, tolerance: _core.SymmetryTolerance
) -> tuple[ParameterDeviation, ...]:
    """Those above rounding."""
    values = _core.symmetry_deviations(mechanism.core, group, tolerance)
    rounding = _core.SymmetryTolerance()
    known = mechanism.deviations
    deviations = []
    for leg, name_index in zip(*np.nonzero(np.abs(values) > rounding.length), strict=True):
        scale = tolerances_of(mechanism.tolerances).deviations(mechanism.core, int(leg))
        deviations.append(
            ParameterDeviation(
                leg=int(leg),
                parameter=mechanism.parameter_names[name_index],
                deviation=float(values[leg, name_index]),
                in_tolerances=float(abs(values[leg, name_index]) / scale[name_index]),
                standard_deviation=float("nan" if known is None else known[leg, name_index]),
            )
        )
    return tuple(sorted(deviations, key=lambda each: -each.in_tolerances))


def _title(group: SymmetryGroup) -> str:
    return group_title(group.paper_name, group.name)
