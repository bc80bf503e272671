# SPDX-License-Identifier: MIT
"""The paper's conditions for symmetrical workspaces and symmetrical observability, with figures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from symkin import _core
from symkin.analysis.workspace import sample_workspace
from symkin.analysis.workspace.study import READING_ROUNDING, ElementCheck, check_elements
from symkin.model.chains import legs_in_words, shortest
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry import (
    NamedGroup,
    SymmetryComparison,
    SymmetryElement,
    SymmetryGroup,
    SymmetryPair,
    compare_symmetry,
    leg_carriers,
    symmetry_pairs,
)
from symkin.model.symmetry.groups import mechanism_groups, named_group
from symkin.model.turns import turn_of
from symkin.results import Result
from symkin.values import Value, field, record

__all__ = ["Condition", "Conditions", "check_conditions"]

_ROUNDING = 1e-9  # m, and of gains
_BY_CONSTRUCTION = "by construction"  # of every mechanism of such chains
# Kinds of coordinates of which a rotation about Z changes the azimuths alone.
_POLAR = {
    *("radius", "azimuth", "height", "polar_angle", "direction_distance", "direction_azimuth"),
}


@record
class Condition(Value):
    """One condition of the paper.

    Attributes
    ----------
    section : int
        4 (symmetrical active-joint workspace) or 5 (symmetrical observability).
    number : int
        Its number there.
    text : str
        What it asks for.
    holds : bool
        The verdict.
    figure : str
        What the verdict rests on.
    tolerance : str
        What is allowed; empty where there is nothing to allow.
    """

    section: int
    number: int
    text: str
    holds: bool
    figure: str
    tolerance: str = ""


@record
class Conditions(Result):
    """The groups of a mechanism and the conditions that they meet.

    Attributes
    ----------
    structure : str
        G_M in the paper's notation: of the structure, working modes aside.
    with_modes : str
        Its subgroup that keeps the working modes; verified as G_W and G_Q where the conditions on
        the workspace and the readings hold.
    carriers : tuple of str
        G_C: for each leg ``"leg 1 by r1"``, where it comes from.
    conditions : tuple of Condition
        Those of section 4, then of section 5.
    tested : int
        Poses on which workspace and readings were compared, for each element.
    reading_unit : {"rad", "m"}
        Of the deviations of the readings.
    group : SymmetryGroup
        Whose elements were tested: the structure's, or the larger one that the legs nearly have.
    elements : tuple of ElementCheck
        What the poses say of each.
    groups : tuple of NamedGroup
        G_M, G_W and G_Q, as the poses bore them out, and G_C; of G_M and G_W the subgroup with the
        working modes too.
    """

    structure: str
    with_modes: str
    carriers: tuple[str, ...]
    conditions: tuple[Condition, ...]
    tested: int
    reading_unit: str
    group: SymmetryGroup = field(private=True)
    elements: tuple[ElementCheck, ...]
    groups: tuple[NamedGroup, ...] = field(private=True)
    derived = ("tested_group",)

    @property
    def tested_group(self) -> str:
        """The group's name in the paper."""
        return self.group.paper_name

    def columns(self) -> Mapping[str, Sequence[Any]]:
        """Return a row a condition."""
        names = "section", "number", "text", "holds", "figure", "tolerance"
        return {name: [getattr(each, name) for each in self.conditions] for name in names}


def check_conditions(
    mechanism: Mechanism, count: int = 20_000, seed: int | None = None
) -> Conditions:
    """Test the conditions (1)-(5) of section 4 and (1)-(7) of section 5 of the paper.

    Those on the structure, 4(4), 5(1) and 5(2), do not ask for gains and offsets; those on the
    sensors, 4(5), 5(6) and 5(7), do, of the elements that keep the working modes. 5(3) to 5(5) hold
    by construction of chains with one closure whose points are in polar or cylindrical coordinates.

    A mechanism with more legs than degrees of freedom fails condition 4(1) alone, which does not
    stop the protocol. Of a mechanism that is nearly symmetric, such as a calibrated one, the larger
    group is tested, so that the figures tell how far it is off.

    Parameters
    ----------
    mechanism : Mechanism
        With workspace settings.
    count : int
        Poses on which each group element is tested.
    seed : int, optional
        Of the poses, by default the protocol's.

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, or hardly any pose of its box is in it.
    """
    seed = mechanism.protocol.seed if seed is None else seed
    comparison = compare_symmetry(mechanism)
    found = comparison.found
    group, tolerance = _group_to_test(comparison)
    elements = check_elements(mechanism, group, count, seed, tolerance)
    *structure, observability = mechanism_groups(mechanism, found)
    measured = _measure(mechanism, comparison, structure, elements, count, seed)
    return Conditions(
        structure=structure[0].paper_name,
        with_modes=structure[1].paper_name,
        carriers=tuple(
            f"leg {reference + 1} by {element.label}"
            for reference, element in leg_carriers(mechanism)
        ),
        conditions=(*_section_4(mechanism, measured), *_section_5(mechanism, measured)),
        tested=count,
        reading_unit=mechanism.reading_unit,
        group=group,
        elements=elements,
        groups=(*structure, *_tested_groups(group, elements, structure), observability),
    )


def _tested_groups(
    group: SymmetryGroup, checks: Sequence[ElementCheck], structure: Sequence[NamedGroup]
) -> tuple[NamedGroup, ...]:
    """G_W and G_Q: the elements for which poses bore out Eq. 2, and Eq. 5 too.

    Elements that flip the working modes carry the workspace onto that of the other modes: they
    belong to G_W of both together, and neither to that of one nor to its G_Q.
    """
    both = [check.mismatches == 0 for check in checks]
    workspace = [holds and check.keeps_aspect for holds, check in zip(both, checks, strict=True)]
    joints = [
        holds and check.reading_deviation <= READING_ROUNDING
        for holds, check in zip(workspace, checks, strict=True)
    ]

    def chosen(holds: Sequence[bool]) -> list[SymmetryElement]:
        return [element for element, yes in zip(group.elements, holds, strict=True) if yes]

    # Others, about other axes or with another turn of the platform, are known from the legs alone.
    pairs = any(each.elements[0] == "p0" for each in structure)
    alone = " (of those tested)" if pairs else ""
    return (
        named_group("G_W", f"workspace{alone}", group, chosen(both)),
        named_group("G_W", f"with the working modes{alone}", group, chosen(workspace)),
        named_group("G_Q", f"active joints{alone}", group, chosen(joints)),
    )


@record
class _Figures:
    """Figures on which several conditions rest."""

    comparison: SymmetryComparison
    named: NamedGroup  # G_M
    with_modes: int  # how many of its elements keep the working modes
    permuting: bool | None  # whether these permute readings; None if they are about Z, and tested
    group: SymmetryGroup  # that was tested
    exact: bool  # whether the legs have it to rounding
    tested: int  # poses whose images were looked at
    mismatches: int  # those in the workspace with images outside, or the reverse
    deviation: float  # largest of the readings at images, of what keeps the modes; NaN for none
    closure: float  # largest of a leg at its inverse kinematics, m or rad
    home: float  # largest of home readings from images of each other; NaN if no leg is an image
    gains: float  # largest relative difference

    @property
    def symmetric(self) -> bool:
        """Whether the structure has a symmetry, to rounding."""
        return self.comparison.found.structure.size > 1 or len(self.named.elements) > 1

    @property
    def untested(self) -> str:
        """Of elements whose images of poses were not looked at, what is known."""
        if self.permuting is None:
            return "no element but the identity to test"
        return f"from the legs, {len(self.named.elements)} elements; none is about Z to be tested"

    @property
    def unread(self) -> str:
        """The same of the readings at images."""
        if self.permuting is None:
            return "no element but the identity keeps the working modes"
        agree = "agree" if self.permuting else "do not agree"
        return f"from the legs, {self.with_modes} elements keep the modes; their sensors {agree}"

    @property
    def structure(self) -> tuple[str, str]:
        """The figure of G_M, with what the legs nearly have, and its tolerance."""
        size = len(self.named.elements)
        elements = "1 element" if size == 1 else f"{size} elements"
        nearly = "" if self.exact else f"; nearly {self.group.paper_name}"
        return f"G_M = {self.named.paper_name}, {elements}{nearly}", "1e-06 m, rad"

    def of_readings(self, deviation: float, unit: str) -> str:
        """A deviation of readings: of which group, and whether it is the sensors' alone."""
        only = self.comparison.only_sensors_differ if deviation > READING_ROUNDING else ""
        return f"readings deviate by {deviation:.1e} {unit}{self.under}" + (only and f"; {only}")

    @property
    def under(self) -> str:
        """Which group the figures are of, where that needs saying."""
        return "" if self.exact else f" under {self.group.paper_name}"


def _group_to_test(
    comparison: SymmetryComparison,
) -> tuple[SymmetryGroup, tuple[float, float, float] | None]:
    """The group to test, and within which tolerance it maps the legs.

    It is the structure's; but the one declared, or the one nearly there where there is none, if the
    legs miss it by no more than their tolerances.
    """
    reference, found = comparison.reference, comparison.found.structure
    wanted = reference is comparison.declared or found.size == 1
    if comparison.verdict == "nearly" and reference is not None and wanted:
        return reference, comparison.tolerance
    return found, None


def _measure(
    mechanism: Mechanism,
    comparison: SymmetryComparison,
    structure: Sequence[NamedGroup],
    elements: tuple[ElementCheck, ...],
    count: int,
    seed: int,
) -> _Figures:
    group, tolerance = _group_to_test(comparison)
    sample = sample_workspace(mechanism, min(count, 1000), seed)
    closures = [mechanism.closure(leg, sample, each) for leg, each in enumerate(sample.readings.T)]
    chains = np.array(mechanism.chains)
    gains = [mechanism.sensor_gains[chains == chain] for chain in dict.fromkeys(mechanism.chains)]
    limits = _core.SymmetryTolerance(*(tolerance or ()))
    return _Figures(
        comparison=comparison,
        named=structure[0],
        with_modes=len(structure[1].elements),
        permuting=_permuting(mechanism, group, structure),
        group=group,
        exact=group is comparison.found.structure,
        tested=count * (group.size - 1),
        mismatches=sum(check.mismatches for check in elements),
        deviation=max(
            (check.reading_deviation for check in elements[1:] if check.keeps_modes),
            default=math.nan,
        ),
        closure=float(np.max(np.abs(closures))),
        home=max(_home_deviations(mechanism, group.core, limits), default=math.nan),
        gains=max(float(np.ptp(each) / np.abs(each).max()) for each in gains),
    )


def _permuting(
    mechanism: Mechanism, group: SymmetryGroup, structure: Sequence[NamedGroup]
) -> bool | None:
    """Whether sensors agree under pairs that keep the modes, where none about Z could be tested."""
    if group.size > 1 or len(structure[0].elements) == 1:
        return None
    kept = symmetry_pairs(mechanism).keep_modes_and_home
    return len(kept) > 1 and all(each.permutes_readings for each in kept)


def _home_deviations(
    mechanism: Mechanism, group: _core.SymmetryGroup, tolerance: _core.SymmetryTolerance
) -> Iterator[float]:
    """How far the home readings are from the images of the readings of each leg's reference."""
    home = mechanism.home[None, :]
    readings = mechanism.inverse_kinematics(home)[0]
    carriers = leg_carriers(mechanism)
    if any(isinstance(element, SymmetryPair) for _, element in carriers):
        for leg, (reference, element) in enumerate(carriers):
            if isinstance(element, SymmetryPair) and reference != leg:  # which fix home
                expected = element.joints[reference].sign * readings[reference]
                apart = np.array([readings[leg] - expected])
                yield float(np.abs(shortest(apart, turn_of(mechanism, leg))).max())
        return
    for leg, carrier in enumerate(_core.leg_carriers(mechanism.straight, group, tolerance)):
        if carrier.reference == leg:
            continue
        moved = _core.transform_poses(group, carrier.element, mechanism.straight, home)
        sign = _core.reading_sign(carrier.element, mechanism.straight)
        found = np.array([readings[leg], mechanism.inverse_kinematics(moved)[0, leg]])
        differences = found - sign * readings[carrier.reference]
        yield float(np.abs(shortest(differences, turn_of(mechanism, leg))).max())


def _section_4(mechanism: Mechanism, measured: _Figures) -> Iterator[Condition]:
    legs, dof, unit = len(mechanism.legs), mechanism.straight.mobility, mechanism.reading_unit
    degrees = f"{legs} legs, {dof} degrees of freedom"
    yield Condition(4, 1, "as many legs as degrees of freedom", legs == dof, degrees)
    chain = legs_in_words(mechanism.legs)
    chain += "" if mechanism.mixed else f", {_BY_CONSTRUCTION}"
    yield Condition(4, 2, "all legs have the same structure", not mechanism.mixed, chain)
    closes, of = measured.closure <= _ROUNDING, mechanism.space.closure_unit
    closure, limit = f"largest closure {measured.closure:.1e} {of}", f"{_ROUNDING:.0e} {of}"
    yield Condition(4, 3, "each leg closes as g - q = 0", closes, closure, limit)
    text = "the structure has a symmetry group"
    yield Condition(4, 4, text, measured.symmetric, *measured.structure)
    yield Condition(
        4,
        5,
        "the active joints are symmetric in the symmetric configuration",
        measured.home <= READING_ROUNDING and measured.with_modes > 1,
        "no leg is the image of another"
        if math.isnan(measured.home)
        else f"home {measured.of_readings(measured.home, unit)}",
        f"{READING_ROUNDING:.0e} {unit}",
    )


def _section_5(mechanism: Mechanism, measured: _Figures) -> Iterator[Condition]:
    names, unit = mechanism.parameter_names, mechanism.reading_unit
    symmetric = measured.symmetric and measured.exact
    text = "the structure's symmetry is a group G_M"
    yield Condition(5, 1, text, measured.symmetric, *measured.structure)
    yield Condition(
        5,
        2,
        "the workspace has the symmetry (Eq. 2)",
        symmetric and measured.mismatches == 0,
        measured.untested
        if measured.group.size == 1
        else f"{measured.mismatches} of {measured.tested} poses are in it and their images are "
        f"not, or the reverse{measured.under}",
        "0",
    )
    closures = mechanism.closures
    yield Condition(
        5,
        3,
        "geometric model, perfect joints",
        closures == 1,
        f"one closure a leg, {_BY_CONSTRUCTION}" if closures == 1 else f"{closures} closures a leg",
    )
    for number, end in (4, "base"), (5, "platform"):
        yield _in_polar_coordinates(mechanism, number, end)
    gain = names[mechanism.parameter_roles(0).index(("none", "gain"))]
    gains = f"{gain} differs by {measured.gains:.1e} of its size"
    equal = measured.gains <= _ROUNDING
    yield Condition(5, 6, "equal nominal gains", equal, gains, f"{_ROUNDING:.0e}")
    yield Condition(
        5,
        7,
        "the active-joint workspace has the symmetry (Eq. 5)",
        symmetric and (measured.deviation <= READING_ROUNDING or measured.permuting is True),
        measured.unread
        if math.isnan(measured.deviation)
        else measured.of_readings(measured.deviation, unit),
        f"{READING_ROUNDING:.0e} {unit}",
    )


def _in_polar_coordinates(mechanism: Mechanism, number: int, end: str) -> Condition:
    """Whether a rotation about Z changes the azimuth of a leg's points and nothing else of them."""
    points = {
        name: role.kind
        for leg in range(len(mechanism.legs))
        for name, role in zip(
            mechanism.parameter_names, mechanism.parameter_roles(leg), strict=True
        )
        # Transforms of declared legs have names of their own.
        if role.end == end and (mechanism.leg_info(leg).declared or name.startswith(f"{end}_"))
    }
    kinds = set(points.values())
    system = "cylindrical" if "height" in kinds else "polar"
    polar = kinds <= _POLAR
    ends = "points" if mechanism.space.moves else "axes"
    figure = ", ".join(points) or f"none: the {end} is a point"
    figure += f", {_BY_CONSTRUCTION}" if polar else ": in a frame of the leg's own"
    text = f"{end} {ends} in {system} coordinates"
    return Condition(5, number, text, polar, figure)
