# SPDX-License-Identifier: MIT
"""What the names of scalars say: which a pattern means, their units, sorts and tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np

from symkin.errors import SymkinError, did_you_mean
from symkin.model.chains import ABSENT, CURVATURE_TERMS
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array

CONSTANT = "a constant of the description"
REDUNDANT = "since the sensor's offset does the same"
BOW = "plane.bow"
CLOCK = "clock"  # of the slopes that a clock's offset is


class Names:
    """Names of scalars, and what patterns match of them.

    Terms of curvature that the sensors are not said to have are matched by their full names alone;
    what is never free is not matched at all.
    """

    def __init__(
        self,
        scalars: Sequence[str],
        terms: Sequence[str],
        always_held: Sequence[str],
        given: Sequence[str] = (),
    ) -> None:
        self.scalars = scalars
        self.always_held = always_held
        self.silent = ({*CURVATURE_TERMS} - {*terms}) | {BOW.rpartition(".")[2]}
        self.index = {name: i for i, name in enumerate(scalars) if name}
        self.of_legs = {
            i
            for name, i in self.index.items()
            if name.startswith("leg")
            and name.partition(".")[2] not in (*CURVATURE_TERMS, *given)
            and not always_held[i]
        }

    def matching(
        self, option: str, patterns: Sequence[str], others: Sequence[str] = ()
    ) -> set[int]:
        """Scalars that match any of the patterns; each must match one.

        Without a dot a pattern is of a parameter in any leg, or of a whole block. `others` are
        further words that may be meant.
        """
        if isinstance(patterns, str):
            patterns = [patterns]
        found: set[int] = set()
        for pattern in patterns:
            matched = {
                i
                for name, i in self.index.items()
                if matches_name(name, pattern)
                and (name.rpartition(".")[2] not in self.silent - {pattern.rpartition(".")[2]})
            }
            if not matched:
                parts = dict.fromkeys(
                    part
                    for name in self.index
                    for part in ((*name.split("."), name) if name[:3] == "leg" else (name,))
                )
                raise SymkinError(
                    f'{option} "{pattern}" matches no unknown of this mechanism'
                    f"{did_you_mean(pattern, [*parts, *others])}"
                )
            may_be_free = {i for i in matched if not self.always_held[i]}
            if not may_be_free and option != "fixed":
                name, reason = (each[min(matched)] for each in (self.scalars, self.always_held))
                raise SymkinError(f'{option} "{pattern}": {name} is held, {reason}')
            found |= may_be_free
        return found


def matches_name(name: str, pattern: str) -> bool:
    """Whether a scalar has such a name; without a dot, of a block or in any leg."""
    if "." in pattern:
        return fnmatchcase(name, pattern)
    block, _, own = name.partition(".")
    return fnmatchcase(block, pattern) or (block[:3] == "leg" and fnmatchcase(own, pattern))


def sorts_of(
    mechanism: Mechanism, scalars: Sequence[str], units: Sequence[str]
) -> tuple[tuple[object, ...], ...]:
    """What scalars have in common that can be shared: name and unit, and what the name means."""
    sorts: list[tuple[object, ...]] = []
    # A radius beside a height is another one than beside a polar angle.
    kinds: dict[tuple[int | None, str], set[str]] = {}
    for number in range(len(mechanism.legs)):
        for each in mechanism.leg_info(number).parameter_roles.values():
            kinds.setdefault((number, each.end), set()).add(each.kind)
    for name, unit in zip(scalars, units, strict=True):
        block, _, own = name.partition(".")
        leg = int(block[3:]) - 1 if block.startswith("leg") else None
        roles = {} if leg is None else mechanism.leg_info(leg).parameter_roles
        role = roles.get(own, ABSENT)
        beside = frozenset(kinds.get((leg, role.end), ()) if role.end != "none" else ())
        own = CLOCK if block == f"{CLOCK}_{own}" else own
        sorts.append((own, unit, role, beside))
    return tuple(sorts)


def slope_units(
    mechanism: Mechanism, names: Sequence[str], per: Mapping[str, str]
) -> tuple[str, ...]:
    """Units of slopes, or of frames, by their names; `per` are those of their covariates."""

    def unit(name: str) -> str:
        block, _, own = name.partition(".")
        if own == "growth":
            return f"1/{per[own]}" if per[own] else ""
        if CLOCK in (block.partition("_")[0], own):
            return "s"
        if block.startswith("leg"):
            return mechanism.reading_unit
        return "rad" if own in ("phi", "rx", "ry", "rz") else "m"

    return tuple(map(unit, names))


def units_of(
    mechanism: Mechanism, scalars: Sequence[str], per: Mapping[str, str]
) -> tuple[str, ...]:
    """Unit of each scalar; `per` as `slope_units` has it."""
    of_legs = []
    for leg in range(len(mechanism.legs)):
        own = dict(zip(mechanism.parameter_names, mechanism.parameter_units(leg), strict=True))
        joint = own["sensor_offset"]
        own |= {
            "sensor_quadratic": f"{joint}/{mechanism.reading_unit}\u00b2",
            "sensor_cosine": joint,
            "sensor_sine": joint,
        }
        of_legs.append(own)

    def unit(name: str) -> str:
        block, _, own = name.partition(".")
        if block.startswith("leg") and not per.keys() & {block, own}:
            return of_legs[int(block[3:]) - 1][own]
        if block == "plane":
            return "m" if own in ("c0", "bow") else ""
        return slope_units(mechanism, [name], per)[0]

    return tuple(map(unit, scalars))


def reasons_held(mechanism: Mechanism, scalars: Sequence[str]) -> tuple[str, ...]:
    """Why each scalar is never free, "" of those that may be."""
    columns = {name: i for i, name in enumerate(mechanism.parameter_names)}
    roles = [mechanism.parameter_roles(leg) for leg in range(len(mechanism.legs))]
    estimated = mechanism.is_estimated
    reasons = []
    for name in scalars:
        block, _, own = name.partition(".")
        reason = ""
        if block.startswith("leg") and own in columns:
            leg, column = int(block[3:]) - 1, columns[own]
            if roles[leg][column].is_constant:
                reason = CONSTANT
            elif not (estimated[leg, column] or roles[leg][column].is_given):
                reason = REDUNDANT
        reasons.append(reason)
    return tuple(reasons)


def tolerances_of(
    mechanism: Mechanism, scalars: Sequence[str], largest_readings: Sequence[float]
) -> Array:
    """Tolerance of every scalar; none of what no drawing shows: frames, points without a place."""
    by_leg = []
    for leg, row in enumerate(parameter_tolerances(mechanism).tolist()):
        angular = mechanism.leg_info(leg).reading_unit == "rad"
        joint = mechanism.tolerances.angle if angular else mechanism.tolerances.length
        curved = dict.fromkeys(CURVATURE_TERMS, joint) | {
            "sensor_quadratic": joint / max(largest_readings[leg], 1e-9) ** 2
        }
        by_leg.append(dict(zip(mechanism.parameter_names, row, strict=True)) | curved)
    points = mechanism.frames.points if mechanism.frames else ()
    values = np.zeros(len(scalars))
    for i, name in enumerate(scalars):
        block, _, own = name.partition(".")
        if block.startswith("leg"):
            values[i] = by_leg[int(block[3:]) - 1].get(own, 0.0)
        elif block.startswith("point") and points[int(block[5:]) - 1]:
            values[i] = mechanism.tolerances.length
    return values
