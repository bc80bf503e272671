# SPDX-License-Identifier: MIT
"""What the poses of every leg show of its parameters."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from symkin.analysis.observability import (
    Observability,
    RowKind,
    analyse_observability,
    observability_rows,
)
from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry import SymmetryPair, observability_group
from symkin.present import Group, Image, Page, Section, Table, page_of
from symkin.show.images import plotted
from symkin.show.wording import NONE, leg_columns, plural, significant
from symkin.values import Array

_R = "|R_ii|"
_INDICES = {
    "O1": "O1, all parameters (D-optimality)",
    "O2": "O2, least over most visible",
    "O3": "O3, least visible direction",
    "O4": "O4, product of O2 and O3",
    "O5": "O5, all directions, the least counting most",
}


@page_of.register(Observability)
def observability_page(shown: Observability) -> Page:
    """Describe what poses show of one leg."""
    count = len(shown.parameter_names)
    seen = shown.rank == count
    rows = [(name, significant(shown.indices[name])) for name in _INDICES]
    diagonal = list(zip(shown.parameter_names, map(significant, shown.r_diagonal), strict=True))
    groups = [Group(diagonal, f"{_R}, SI units"), Group(rows, "Indices")]
    table = Table(f"Observability of leg {shown.leg + 1}", ("", "Value"), groups, brief=True)
    return Page(
        title=f"Observability of leg {shown.leg + 1}",
        headlines=[
            ("Rank", f"{shown.rank} of {count}", "parameters shown"),
            ("Condition number", significant(shown.condition), "free of units"),
            ("O1", significant(shown.indices["O1"]), "parameters in tolerances"),
        ],
        verdict="good" if seen else "bad",
        judgement="The poses show all parameters" if seen else "The poses leave parameters unseen",
        doubts=[f"no pose shows {each}" for each in shown.unseen],
        sections=[
            Section("observability", "Observability", [_EXPLANATION], [table]),
            Section("values", "Singular values", [], [singular_values_table([shown])]),
        ],
    )


# C_j D = C_i with D that is no diagonal (theory: Eq. 10 away from Z).
_CARRIED = (
    "The legs are carried onto each other about another axis than Z, which mixes their "
    "coordinates; so each leg is seen in coordinates that are carried with it, those of the leg "
    "that it comes from."
)


def observability_section(
    mechanism: Mechanism,
    sets: Sequence[Array],
    *,
    symmetric: bool,
    rows: RowKind = "paper",
) -> Section:
    """Compare the observability of all legs, each at its own poses.

    Poses that a leg cannot reach are left out, and said so. `symmetric` says that the sets were
    made to be images of each other; the indices are of the rows that poses were chosen by.
    """
    reached = [_within_reach(mechanism, leg, poses) for leg, poses in enumerate(sets)]
    try:
        legs = [analyse_observability(mechanism, leg, poses) for leg, poses in enumerate(reached)]
    except SymkinError as error:
        return Section("observability", "Observability", [f"Not analysed: {error}."])
    shown = {name for leg in legs for name in leg.parameter_names}
    names = [name for name in mechanism.parameter_names if name in shown]
    values = [dict(zip(leg.parameter_names, leg.r_diagonal, strict=True)) for leg in legs]
    diagonals = np.array([[leg.get(name, math.nan) for name in names] for leg in values])
    deviations = _largest_deviations(diagonals, mechanism.chains)
    indices = [
        analyse_observability(mechanism, leg, poses, rows).indices
        for leg, poses in enumerate(reached)
    ]
    left_out = sum(map(len, sets)) - sum(map(len, reached))
    paragraphs = [_EXPLANATION]
    elements = observability_group(mechanism) if symmetric else None
    if elements is not None:
        tilted = any(isinstance(each, SymmetryPair) and each.tilts for each in elements)
        paragraphs += [_CARRIED] if tilted else []
        paragraphs.append(_symmetrical(names, deviations))
    if left_out:
        paragraphs.append(f"Left out: {plural(left_out, 'pose')} beyond a leg's nominal reach.")

    bars = Image(
        "observability",
        f"Bars of {_R} for every parameter, all legs side by side.",
        f"{_R} of every parameter, all legs at their own poses.",
        plotted("observability", names, diagonals),
    )
    visible = [
        (name, *map(significant, diagonals[:, i]), significant(deviations[i], 2))
        for i, name in enumerate(names)
    ]
    shares = [
        (label, *(significant(leg[key]) for leg in indices), "") for key, label in _INDICES.items()
    ]
    ranks = [
        ("condition number, free of units", *(significant(leg.condition) for leg in legs), ""),
        ("rank", *(f"{leg.rank} of {len(leg.parameter_names)}" for leg in legs), ""),
        ("not shown at all", *("; ".join(leg.unseen) or "nothing" for leg in legs), ""),
    ]
    # Whose indices they are: those that a plan's selection made large.
    of = "Indices" if rows == "paper" else "Indices, of the noise-aware rows"
    groups = [Group(visible, f"{_R}, SI units"), Group(shares, of), Group(ranks, "Identifiability")]
    columns = ("", *leg_columns(range(len(legs))), "Largest relative deviation")
    title = "Observability of every leg at its own poses"
    table = Table(title, columns, groups)
    return Section("observability", "Observability", paragraphs, [bars, table])


def singular_values_table(legs: Sequence[Observability]) -> Table:
    """Show the singular values of every leg's rows, columns scaled to length one."""
    all_values = itertools.zip_longest(*(leg.singular_values for leg in legs))
    rows = [
        (f"s_{number}", *(NONE if value is None else significant(value) for value in values))
        for number, values in enumerate(all_values, 1)
    ]
    columns = ("", *leg_columns(range(len(legs))))
    return Table("Singular values, columns scaled to length one", columns, [Group(rows)])


_EXPLANATION = (
    f"{_R} is the diagonal of the QR decomposition of a leg's identification matrix (Eqs. 9, 10): "
    "the larger, the better the leg's poses show the parameter. It depends on units; the condition "
    "number and the indices, with every parameter in units of its tolerance, do not."
)


def _symmetrical(names: Sequence[str], deviations: Array) -> str:
    worst = int(np.nanargmax(deviations))
    if deviations[worst] == 0:
        return "All legs have exactly the same values: their observability is symmetrical."
    verdict = (
        "which is rounding: their observability is symmetrical."
        if deviations[worst] < 1e-9
        else "more than rounding: the legs are not equally observable."
    )
    return (
        f"The legs differ from leg 1 by at most {significant(deviations[worst], 2)} of the value "
        f"({names[worst]}), {verdict}"
    )


def _within_reach(mechanism: Mechanism, leg: int, poses: Array) -> Array:
    if not len(poses):
        return poses
    rows = observability_rows(mechanism, leg, poses).reshape(len(poses), -1)
    return np.asarray(poses[np.isfinite(rows).all(axis=1)])


def _largest_deviations(diagonals: Array, chains: Sequence[str]) -> Array:
    """Of each parameter between any leg and the first of its chain, relative to that."""
    of_chain = np.array(chains)
    largest = np.full(diagonals.shape[1], np.nan)
    for chain in dict.fromkeys(chains):
        own = diagonals[of_chain == chain]
        scale = np.where(own[0] > 0, own[0], 1.0)
        largest = np.fmax(largest, np.abs(own - own[0]).max(axis=0) / scale)
    return largest
