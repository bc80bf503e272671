# SPDX-License-Identifier: MIT
"""The poses that were planned, how good they are, and those that spares had to replace."""

from __future__ import annotations

import numpy as np

from symkin.mechanism import Mechanism
from symkin.planning import ChosenPoses, Plan, PlanBasis, travel_length
from symkin.report.content import Group, Section, Table
from symkin.report.wording import count, plural, quantity, significant
from symkin.simulation import Simulation

__all__ = ["CRITERIA", "plan_section"]

CRITERIA = {
    "O1": "O1 (D-optimality)",
    "O2": "O2",
    "O3": "O3 (E-optimality)",
    "O4": "O4",
    "O5": "O5",
    "expected_error": "expected end-effector error (I-optimality)",
}
_DESIGNS = {
    "legs": "a set of poses for each leg",
    "orbits": "whole orbits of poses, which every leg uses",
    "mechanism": "one set of poses for the parameters of all legs at once",
}
_PERCENT = "\N{NO-BREAK SPACE}%"


def plan_section(mechanism: Mechanism, plan: Plan, simulation: Simulation | None = None) -> Section:
    """Count planned and spare poses of every set, and those that a simulated robot replaced."""
    sets = np.unique(plan.leg_sets).tolist()
    replaced = simulation.replaced if simulation else ()
    rows = []
    for at, number in enumerate(sets):
        figures = [len(plan.rows_of_set(number, spare=spare)) for spare in (False, True)]
        figures += [replaced[at]] if simulation else []
        rows.append((f"leg {number}" if number else "all legs", *map(str, figures)))
    columns = ("Set of", "Poses", "Spares", *(("Replaced by spares",) if simulation else ()))
    parts = [Table("Planned poses", columns, [Group(rows)])]
    if plan.basis is not None:
        parts.append(_selections(plan.basis))
    return Section("plan", "Plan", _paragraphs(mechanism, plan, simulation), parts)


def _selections(basis: PlanBasis) -> Table:
    """What was chosen for which legs, and how far it can be from the best."""
    return Table(
        "Selections and their certificates",
        (
            "For",
            f"Value of {basis.criterion}",
            "Efficiency",
            "Of the determinant",
            "With repeats",
            "Proven optimal",
        ),
        [Group([_selection(basis, choice) for choice in basis.choices])],
    )


def _selection(basis: PlanBasis, choice: ChosenPoses) -> tuple[str, ...]:
    selection, certificate = choice.selection, choice.selection.certificate
    value = selection.criterion_value
    legs = f"leg{'s' * (len(choice.legs) > 1)} {', '.join(map(str, choice.legs))}"
    return (
        legs,
        quantity(1e3 * value**0.5, "mm")
        if basis.criterion == "expected_error"
        else significant(value, 4),
        *(
            f"{100 * share:.2f}{_PERCENT}"
            for share in (
                certificate.efficiency,
                certificate.o1_efficiency,
                certificate.efficiency_repeats,
            )
        ),
        "yes" if certificate.proven_optimal else "no",
    )


def _paragraphs(mechanism: Mechanism, plan: Plan, simulation: Simulation | None) -> list[str]:
    wanted = np.flatnonzero(~plan.spare)
    way = travel_length(mechanism, plan.poses[wanted])
    text = f"{plural(len(wanted), 'pose')} to measure; the way through them, from home, is "
    paragraphs = [f"{text}{quantity(way, 'm')}."]
    if plan.basis is not None:
        paragraphs += _made(plan.basis)
    if simulation is not None:
        replaced = sum(simulation.replaced)
        paragraphs.append(
            f"The robot could not take {count(replaced)} of them, which spares replaced."
            if replaced
            else "The robot could take all of them."
        )
    return paragraphs


def _made(basis: PlanBasis) -> list[str]:
    rows = "noise-aware rows" if basis.rows == "noise_aware" else "the paper's rows"
    left = basis.candidates - basis.excluded
    text = (
        f"The design is {_DESIGNS[basis.design]}, chosen from {plural(left, 'candidate')} by "
        f"{CRITERIA[basis.criterion]} with {rows}, method {basis.method}."
    )
    if basis.excluded:
        text += f" {plural(basis.excluded, 'candidate was', 'candidates were')} left out by limits."
    if any(len(choice.elements) > 1 for choice in basis.choices):
        text += " The symmetry carries what was chosen for one leg to the others."
    certificate = (
        "The efficiency is the share of a bound that no set of so many poses exceeds: of the p-th "
        "root of the determinant for O1, of the value for O2 to O5, of the expected squared error "
        "for that criterion. The bound with repeats lets a pose be measured more than once."
    )
    return [text, certificate]
