# SPDX-License-Identifier: MIT
"""The pages about a plan, and about the number of poses."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import ExpectedAccuracy
from symkin.planning import Plan, PoseCountCurve
from symkin.plot import pose_count_figure
from symkin.report.content import Group, Page, Section, Table, image
from symkin.report.html import write_page
from symkin.report.mechanism import mechanism_section
from symkin.report.sections.observability import observability_section
from symkin.report.sections.plan import plan_section
from symkin.report.wording import milli, plural
from symkin.report.workspace import workspace_section
from symkin.workspace.sample import WorkspaceSample

__all__ = ["write_plan_report", "write_pose_count_report"]

_PERCENT = "\N{NO-BREAK SPACE}%"


def write_plan_report(
    mechanism: Mechanism,
    candidates: WorkspaceSample,
    plan: Plan,
    expected: ExpectedAccuracy | None,
    folder: Path,
    measured: Measurements | None = None,
) -> Path:
    """Write ``plan.html`` and the PNG files of its figures; returns the page.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    candidates : WorkspaceSample
        What the poses were chosen from.
    plan : Plan
        Of `make_plan`.
    expected : ExpectedAccuracy or None
        Of `predict_accuracy`; None if it cannot be predicted.
    folder : Path
        Made if it does not exist.
    measured : Measurements, optional
        To which the plan adds poses.
    """
    sets = plan.leg_poses(measured)
    symmetric = plan.basis is not None and plan.basis.symmetrical
    sections = [
        plan_section(mechanism, plan),
        workspace_section(mechanism, candidates, plan),
        observability_section(mechanism, sets, symmetric=symmetric, rows=plan.row_kind),
        mechanism_section(mechanism, candidates.poses[:1]),
    ]
    return write_page(
        dataclasses.replace(_plan_summary(mechanism, plan, expected), sections=sections),
        folder / "plan.html",
    )


def write_pose_count_report(mechanism: Mechanism, curve: PoseCountCurve, folder: Path) -> Path:
    """Write ``pose-count.html`` and the PNG file of its figure; returns the page."""
    turns = mechanism.pose_space != "point"
    figure = image(
        pose_count_figure(curve, turns=turns),
        "pose_count",
        alternative="Expected errors and efficiency against the number of poses.",
        caption="Expected error after identification, and efficiency of the selection, against "
        "the number of poses that each leg is identified from. The dashed line is where another "
        "pose begins to gain too little.",
    )
    rows = []
    for at, number in enumerate(curve.counts.tolist()):
        row = [str(number), str(curve.measured[at]), milli(curve.position[at], "m")]
        row += [milli(curve.orientation[at], "rad")] if turns else []
        rows.append([*row, f"{100 * curve.efficiency[at]:.2f}{_PERCENT}"])
    columns = ["Poses a leg", "Poses in all", "Position error, rms"]
    columns += ["Orientation error, rms"] if turns else []
    table = Table("What more poses bring", [*columns, "Efficiency"], [Group(rows)])
    section = Section("curve", "Number of poses", [], [figure, table])
    return write_page(
        dataclasses.replace(_curve_summary(mechanism, curve), sections=[section]),
        folder / "pose-count.html",
    )


def _plan_summary(mechanism: Mechanism, plan: Plan, expected: ExpectedAccuracy | None) -> Page:
    wanted = int((~plan.spare).sum())
    spares = plural(int(plan.spare.sum()), "spare")
    figures = [("Poses", str(wanted), f"and {spares}")]
    judgement, proven = "Poses are chosen", False
    if plan.basis is not None:
        certificates = [choice.selection.certificate for choice in plan.basis.choices]
        least = min(certificate.efficiency for certificate in certificates)
        proven = all(certificate.proven_optimal for certificate in certificates)
        remark = "proven optimal" if proven else "of a bound that no set of poses exceeds"
        figures.append(("Efficiency", f"{100 * least:.2f}{_PERCENT}", remark))
        judgement = (
            "The poses are proven optimal" if proven else "The poses come with a certificate"
        )
    if expected is not None:
        figures.append(("Position error", milli(expected.position, "m"), "expected, rms"))
        if mechanism.pose_space != "point":
            figures.append(
                ("Orientation error", milli(expected.orientation, "rad"), "expected, rms")
            )
    return Page(
        title=f"{mechanism.name}: plan",
        subtitle=f"{plural(len(mechanism.legs), 'leg')} {mechanism.chain}",
        headlines=figures,
        verdict="good",
        judgement=judgement,
        doubts=[],
        paragraphs=[
            "Expected errors are those of the end effector over the workspace after "
            "identification with all poses, for the declared noise."
        ]
        if expected is not None
        else [],
    )


def _curve_summary(mechanism: Mechanism, curve: PoseCountCurve) -> Page:
    gain = f"{100 * curve.least_gain:g}{_PERCENT}"
    enough = (
        f"From {plural(curve.enough, 'pose')} a leg on, another one saves less than {gain} of the "
        "position error."
        if curve.enough is not None
        else f"Every further pose of the curve saves at least {gain} of the position error."
    )
    return Page(
        title=f"{mechanism.name}: number of poses",
        subtitle=f"{plural(len(mechanism.legs), 'leg')} {mechanism.chain}",
        headlines=[
            ("Enough", str(curve.enough or "more"), "poses a leg"),
            ("Fewest", milli(curve.position[0], "m"), f"{plural(int(curve.counts[0]), 'pose')}"),
            ("Most", milli(curve.position[-1], "m"), f"{plural(int(curve.counts[-1]), 'pose')}"),
        ],
        verdict="good",
        judgement="Predicted to first order from the declared noise",
        doubts=[],
        paragraphs=[enough],
    )
