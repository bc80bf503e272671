# SPDX-License-Identifier: MIT
"""The symmetry that a mechanism has, against the one that it declares or nearly has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from symkin import _core
from symkin.groups import group_title, subgroup_names
from symkin.mechanism import Mechanism
from symkin.near_symmetry import (
    larger_group,
    near_limit,
    scaled_tolerance,
    tolerances_needed,
)
from symkin.observability import tolerances_of
from symkin.symmetry import DetectedSymmetry, SymmetryGroup, declared_group, detect_symmetry

__all__ = [
    "ParameterDeviation",
    "SymmetryComparison",
    "SymmetryVerdict",
    "compare_symmetry",
]

SymmetryVerdict = Literal["exact", "nearly", "broken"]

_ROUNDING = _core.SymmetryTolerance()


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
        Of the leg, carried back to its orbit's first leg, from the median of the orbit, with the
        sign that it has where the leg stands; m, rad, or the gain's unit.
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
    lacks = declared is not None and tolerances_needed(mechanism, declared, _ROUNDING) > 1
    reference = declared if lacks else larger_group(mechanism, found.structure)
    if reference is None:
        holds = declared is not None or found.structure.size > 1
        return SymmetryComparison(
            declared,
            found,
            "exact" if holds else "broken",
            None,
            (),
            _ROUNDING,
            (),
        )
    needed = tolerances_needed(mechanism, reference)
    tolerance = scaled_tolerance(mechanism, max(near_limit(reference), 1.001 * needed))
    kept = (
        element.label
        for element in reference.elements
        if _core.image_of_legs(mechanism.core, reference, element, tolerance).keeps_modes
    )
    return SymmetryComparison(
        declared,
        found,
        "nearly" if needed <= near_limit(reference) else "broken",
        reference,
        tuple(kept),
        tolerance,
        _deviations(mechanism, reference, tolerance),
    )


def _deviations(
    mechanism: Mechanism, group: SymmetryGroup, tolerance: _core.SymmetryTolerance
) -> tuple[ParameterDeviation, ...]:
    """Those above rounding."""
    values = _core.symmetry_deviations(mechanism.core, group, tolerance)
    known = mechanism.deviations
    deviations = []
    for leg, name_index in zip(*np.nonzero(np.abs(values) > _ROUNDING.length), strict=True):
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
