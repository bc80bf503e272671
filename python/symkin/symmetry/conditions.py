# SPDX-License-Identifier: MIT
"""The paper's conditions for symmetrical workspaces and symmetrical observability, with figures."""

from __future__ import annotations

import math
from dataclasses import dataclass

from symkin.mechanism import Mechanism
from symkin.symmetry.comparison import compare_symmetry
from symkin.symmetry.condition_figures import ConditionFigures, condition_figures, tested_group
from symkin.symmetry.group import SymmetryGroup, leg_carriers
from symkin.symmetry.named import READING_ROUNDING, NamedGroup, mechanism_groups, tested_groups
from symkin.symmetry.verification import ElementCheck, check_elements

__all__ = ["Condition", "Conditions", "check_conditions"]

_ROUNDING = 1e-9  # m, and of gains
_BY_CONSTRUCTION = "by construction"  # of every mechanism that symkin can describe


@dataclass(frozen=True)
class Condition:
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


@dataclass(frozen=True)
class Conditions:
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
    group: SymmetryGroup
    elements: tuple[ElementCheck, ...]
    groups: tuple[NamedGroup, ...]


def check_conditions(
    mechanism: Mechanism, count: int = 20_000, seed: int | None = None
) -> Conditions:
    """Test the conditions (1)-(5) of section 4 and (1)-(7) of section 5 of the paper.

    Those on the structure, 4(4), 5(1) and 5(2), do not ask for gains and offsets; those on the
    sensors, 4(5), 5(6) and 5(7), do, of the elements that keep the working modes. 4(2) and 5(3) to
    5(5) hold by construction: no mechanism can be described for which they fail.

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

    Returns
    -------
    Conditions

    Raises
    ------
    SymkinError
        If the mechanism has no workspace, or hardly any pose of its box is in it.
    """
    seed = mechanism.protocol.seed if seed is None else seed
    comparison = compare_symmetry(mechanism)
    found = comparison.found
    group, tolerance = tested_group(comparison)
    elements = check_elements(mechanism, group, count, seed, tolerance)
    measured = condition_figures(mechanism, comparison, elements, count, seed)
    *structure, observability = mechanism_groups(mechanism, found)
    return Conditions(
        structure=found.structure.paper_name,
        with_modes=found.with_modes.paper_name,
        carriers=tuple(
            f"leg {reference + 1} by {element.label}"
            for reference, element in leg_carriers(mechanism)
        ),
        conditions=(*_section_4(mechanism, measured), *_section_5(mechanism, measured)),
        tested=count,
        group=group,
        elements=elements,
        groups=(*structure, *tested_groups(group, elements), observability),
    )


def _section_4(mechanism: Mechanism, measured: ConditionFigures) -> list[Condition]:
    legs, dof = len(mechanism.legs), mechanism.core.dof
    found = measured.comparison.found
    return [
        Condition(
            4,
            1,
            "as many legs as degrees of freedom",
            legs == dof,
            f"{legs} legs, {dof} degrees of freedom",
        ),
        Condition(
            4,
            2,
            "all legs have the same structure",
            True,
            f"{legs} legs {mechanism.chain}, {_BY_CONSTRUCTION}",
        ),
        Condition(
            4,
            3,
            "each leg closes as g - q = 0",
            measured.closure <= _ROUNDING,
            f"largest closure {measured.closure:.1e} m",
            f"{_ROUNDING:.0e} m",
        ),
        Condition(
            4, 4, "the structure has a symmetry group", measured.symmetric, *_structure(measured)
        ),
        Condition(
            4,
            5,
            "the active joints are symmetric in the symmetric configuration",
            measured.home <= READING_ROUNDING and found.with_modes.size > 1,
            "no leg is the image of another"
            if math.isnan(measured.home)
            else f"home readings deviate by {measured.home:.1e} {mechanism.reading_unit}"
            + measured.under
            + measured.sensors(measured.home > READING_ROUNDING),
            f"{READING_ROUNDING:.0e} {mechanism.reading_unit}",
        ),
    ]


def _section_5(mechanism: Mechanism, measured: ConditionFigures) -> list[Condition]:
    names, unit = mechanism.parameter_names, mechanism.reading_unit
    gain = names[mechanism.parameter_roles.index(("none", "gain"))]
    symmetric = measured.symmetric and measured.exact
    nothing = "no element but the identity to test"
    return [
        Condition(
            5,
            1,
            "the structure's symmetry is a group G_M",
            measured.symmetric,
            *_structure(measured),
        ),
        Condition(
            5,
            2,
            "the workspace has the symmetry (Eq. 2)",
            symmetric and measured.mismatches == 0,
            nothing
            if measured.trivial
            else f"{measured.mismatches} of {measured.tested} poses are in it and their images are "
            f"not, or the reverse{measured.under}",
            "0",
        ),
        Condition(
            5, 3, "geometric model, perfect joints", True, f"one closure a leg, {_BY_CONSTRUCTION}"
        ),
        Condition(5, 4, "base points in polar coordinates", True, _polar(names, "base")),
        Condition(5, 5, "platform points in polar coordinates", True, _polar(names, "platform")),
        Condition(
            5,
            6,
            "equal nominal gains",
            measured.gains <= _ROUNDING,
            f"{gain} differs by {measured.gains:.1e} of its size",
            f"{_ROUNDING:.0e}",
        ),
        Condition(
            5,
            7,
            "the active-joint workspace has the symmetry (Eq. 5)",
            symmetric and measured.deviation <= READING_ROUNDING,
            "no element but the identity keeps the working modes"
            if math.isnan(measured.deviation)
            else f"readings deviate by {measured.deviation:.1e} {unit}{measured.under}"
            + measured.sensors(measured.deviation > READING_ROUNDING),
            f"{READING_ROUNDING:.0e} {unit}",
        ),
    ]


def _structure(measured: ConditionFigures) -> tuple[str, str]:
    """The figure of G_M, with what the legs nearly have, and its tolerance."""
    structure = measured.comparison.found.structure
    elements = "1 element" if structure.size == 1 else f"{structure.size} elements"
    figure = f"G_M = {structure.paper_name}, {elements}"
    if not measured.exact:
        figure += f"; nearly {measured.group}"
    return figure, "1e-06 m, rad"


def _polar(names: tuple[str, ...], end: str) -> str:
    """Which polar coordinates the chain has at an end."""
    given = [name for name in names if name.startswith(f"{end}_")]
    return f"{', '.join(given) or f'none: the {end} is a point'}, {_BY_CONSTRUCTION}"
