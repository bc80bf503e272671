# SPDX-License-Identifier: MIT
"""Candidates of the workspace, or the poses that were measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.planning import Plan
from symkin.planning.plan import set_name
from symkin.plot import poses_figure
from symkin.report.content import Group, Section, Table, image
from symkin.report.wording import count, plural, share
from symkin.workspace.sample import WorkspaceSample

__all__ = ["measured_poses_section", "workspace_section"]

_CAUSES = {
    "reach": "out of a leg's reach, or too near its limits",
    "limits": "beyond the limits of a joint",
    "aspect": "behind a singularity, seen from home",
    "conditioning": "too near a singularity (condition number)",
}


def workspace_section(mechanism: Mechanism, candidates: WorkspaceSample, plan: Plan) -> Section:
    """Count the poses drawn and kept, and show them with the chosen ones."""
    kept, drawn = len(candidates.poses), candidates.drawn
    surplus = drawn - kept - sum(candidates.rejected.values())
    rows = [("drawn from the box", count(drawn), share(drawn, drawn))]
    rows += [
        (f"rejected: {_CAUSES.get(cause, cause)}", count(number), share(number, drawn))
        for cause, number in candidates.rejected.items()
    ]
    if surplus > 0:
        rows.append(("more than needed", count(surplus), share(surplus, drawn)))
    rows.append(("candidates", count(kept), share(kept, drawn)))
    table = Table("Sampling of the workspace", ("Poses", "Number", "Share"), [Group(rows)])
    legs = sorted(np.unique(plan.leg_sets).tolist(), key=lambda leg: np.inf if leg < 0 else leg)
    sets = [plan.poses[plan.rows_of_set(leg)] for leg in legs]
    labels = [set_name(leg) for leg in legs]
    poses = image(
        poses_figure(mechanism.pose_space, candidates.poses, sets, labels),
        "workspace",
        alternative="Scatter plots of the candidate poses and of the chosen poses.",
        caption=(
            "Candidates (small dots"
            + ("" if mechanism.pose_space == "point" else ", coloured by orientation")
            + ") and the chosen poses (large markers)."
        ),
    )
    paragraph = (
        f"{plural(kept, 'pose')} that every leg reaches, in the aspect of home and away from "
        "singularities, are the candidates for measurement, and the poses over which errors are "
        "averaged."
    )
    return Section("workspace", "Workspace", [paragraph], [table, poses])


def measured_poses_section(mechanism: Mechanism, measurements: Measurements) -> Section:
    """Show where the measured poses lie."""
    sets: list[NDArray[np.float64]] = []
    if (measurements.leg_sets >= 0).any():
        legs = range(len(mechanism.legs))
        sets = [measurements.poses[measurements.leg_sets == leg] for leg in legs]
    poses = image(
        poses_figure(mechanism.pose_space, measurements.poses, sets),
        "poses",
        alternative="Scatter plots of the measured poses.",
        caption="The measured poses.",
    )
    file = f" from {measurements.source_name}" if measurements.source else ""
    paragraph = f"{plural(len(measurements.poses), 'measured pose')}{file}."
    return Section("poses", "Measured poses", [paragraph], [poses])
