# SPDX-License-Identifier: MIT
"""The poses that were planned, and those that spares had to replace."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.mechanism import Mechanism
from symkin.planning import Plan
from symkin.report.content import Group, Section, Table
from symkin.report.wording import count, plural
from symkin.simulation import Simulation
from symkin.symmetry import leg_carriers

__all__ = ["plan_section"]


def plan_section(mechanism: Mechanism, plan: Plan, simulation: Simulation) -> Section:
    """Count planned, spare and replaced poses of every leg."""
    outside = outside_box(mechanism, plan.poses)
    sets = np.unique(plan.leg_sets).tolist()
    rows = []
    for leg, replaced in zip(sets, simulation.replaced, strict=True):
        wanted, spare = (plan.rows_of(leg - 1, spare=is_spare) for is_spare in (False, True))
        figures = (len(wanted), len(spare), replaced, int(outside[wanted].sum()))
        rows.append((f"leg {leg}" if leg else "all legs", *map(str, figures)))
    table = Table(
        "Planned poses",
        ("Set of", "Poses", "Spares", "Replaced by spares", "Outside the workspace's box"),
        [Group(rows)],
    )
    chosen = np.flatnonzero(~plan.spare)
    return Section("plan", "Plan", _paragraphs(mechanism, chosen, outside, simulation), [table])


def outside_box(mechanism: Mechanism, poses: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether the position of a pose, or the angle of a planar one, lies outside the box."""
    if mechanism.workspace is None:
        return np.zeros(len(poses), dtype=np.bool_)
    compared = {"planar": 3, "point": 2, "spatial": 3}[mechanism.pose_space]
    lower, upper = mechanism.workspace.lower[:compared], mechanism.workspace.upper[:compared]
    slack = 1e-9  # of an image that rounding has put on the other side
    coordinates = poses[:, :compared]
    inside = (coordinates >= np.array(lower) - slack) & (coordinates <= np.array(upper) + slack)
    return np.asarray(~inside.all(axis=1))


def _paragraphs(
    mechanism: Mechanism,
    chosen: NDArray[np.intp],
    outside: NDArray[np.bool_],
    simulation: Simulation,
) -> list[str]:
    references = sorted({reference + 1 for reference, _ in leg_carriers(mechanism)})
    legs = ", ".join(map(str, references))
    text = (
        f"{plural(len(chosen), 'pose')} to measure, chosen for leg{'s' * (len(references) > 1)} "
        f"{legs} and carried to the others by symmetry."
        if len(references) < len(mechanism.legs)
        else f"{plural(len(chosen), 'pose')} to measure, chosen for every leg by itself."
    )
    replaced = sum(simulation.replaced)
    text += (
        f" The robot could not take {count(replaced)} of them, which spares replaced."
        if replaced
        else " The robot could take all of them."
    )
    beyond = int(outside[chosen].sum())
    if not beyond:
        return [text]
    return [
        text,
        f"{plural(beyond, 'pose lies', 'poses lie')} outside the workspace's box, because the box "
        "does not have the mechanism's symmetry and images of its poses leave it. Check that the "
        "robot may go there.",
    ]
