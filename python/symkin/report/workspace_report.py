# SPDX-License-Identifier: MIT
"""The page about a workspace."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

from symkin.plot.workspace_study import active_joint_figure, constant_orientation_figure
from symkin.report.content import Group, Image, Page, Section, Table, image
from symkin.report.html import write_page
from symkin.report.wording import count, plural
from symkin.symmetry.named import group_title
from symkin.symmetry.verification import ElementCheck
from symkin.workspace.slices import ConstantOrientation, ModeSlices
from symkin.workspace.study import WorkspaceStudy

__all__ = ["write_workspace_report"]

_ROUNDING = 1e-9  # rad or m, far above what the readings inside a workspace differ by


def write_workspace_report(study: WorkspaceStudy, folder: Path) -> Path:
    """Write ``workspace.html`` and the PNG files of its figures; returns the page."""
    sections = [_symmetry_section(study), _slices_section(study), _joints_section(study)]
    return write_page(
        dataclasses.replace(_summary(study), sections=sections), folder / "workspace.html"
    )


def _summary(study: WorkspaceStudy) -> Page:
    mechanism, structure = study.mechanism, study.symmetry.structure
    doubts = [
        f"{check.element}: {check.mismatches} mismatches, readings differ by "
        f"{_reading(study, check)}"
        for check in study.elements
        if not _holds(check)
    ]
    worst = max(study.elements, key=lambda check: check.reading_deviation)
    return Page(
        title=f"{mechanism.name}: workspace",
        subtitle=f"{len(mechanism.legs)} legs {mechanism.chain}",
        headlines=[
            (
                "Structure, G_M",
                group_title(structure.paper_name, structure.name),
                plural(structure.size, "element"),
            ),
            ("Workspace", f"{study.share:.1%}", "of its box"),
            ("Mismatches", count(sum(check.mismatches for check in study.elements)), "theorem"),
            ("Largest deviation", _reading(study, worst), "conjecture"),
        ],
        verdict="doubtful" if doubts else "good",
        judgement=(
            "The workspace does not have the symmetry of the structure"
            if doubts
            else "The workspace theorem (Eq. 2) and the active-joint conjecture (Eq. 5) hold"
        ),
        doubts=doubts,
        paragraphs=[
            f"The workspace, in its working modes and its aspect, is carried onto itself by "
            f"{', '.join(study.workspace_group)}."
        ],
    )


def _holds(check: ElementCheck) -> bool:
    return check.mismatches == 0 and check.reading_deviation < _ROUNDING


def _reading(study: WorkspaceStudy, check: ElementCheck) -> str:
    return f"{check.reading_deviation:.2g} {study.mechanism.reading_unit}"


def _symmetry_section(study: WorkspaceStudy) -> Section:
    rows = [
        (
            check.element,
            "yes" if check.keeps_modes else "no",
            "yes" if check.keeps_aspect else "no",
            count(check.tested),
            count(check.inside),
            count(check.mismatches),
            _reading(study, check),
        )
        for check in study.elements
    ]
    columns = ("Element", "Keeps modes", "Keeps aspect", "Tested", "Inside", "Mismatches")
    table = Table("Elements of the structure", (*columns, "Largest deviation"), [Group(rows)])
    paragraph = (
        "A pose is in the workspace exactly if its image is (Eq. 2), and the readings at the image "
        "are the image of the readings (Eq. 5): tested on poses of the box. An element that flips "
        "the working modes is tested against the workspace of the flipped modes."
    )
    return Section("symmetry", "Symmetry of the workspace", [paragraph], [table])


def _slices_section(study: WorkspaceStudy) -> Section:
    groups = [Group([_slice_row(found) for found in row.slices], row.title) for row in study.modes]
    columns = ("Orientation, rad", "Workspace, m\N{SUPERSCRIPT TWO}", "Home's side", "Other side")
    table = Table("Areas", (*columns, "Aspects"), groups)
    figure = image(
        constant_orientation_figure(study.modes),
        "constant_orientations",
        alternative="Maps of the poses that the legs reach at each orientation.",
        caption="Constant-orientation workspaces. Numbers are those of the aspects.",
    )
    texts = (singular_orientations_text(row) for row in study.modes)
    paragraphs = [text[0].upper() + text[1:] for text in texts if text]
    return Section("orientations", "Constant orientations", paragraphs, [table, figure])


def _slice_row(found: ConstantOrientation) -> Sequence[str]:
    return (
        "any" if math.isnan(found.orientation) else f"{found.orientation:.3g}",
        f"{found.usable_area:.4g}",
        f"{found.area_of_side(1):.4g}",
        f"{found.area_of_side(-1):.4g}",
        str(len(found.aspect_areas)),
    )


def singular_orientations_text(row: ModeSlices) -> str:
    """Say where a turning platform meets parallel singularities; empty if nowhere."""
    if row.singular_orientations.size == 0:
        return ""
    angles = ", ".join(f"{angle:.4g}" for angle in row.singular_orientations)
    return f"{row.title}: parallel singularities at home's position at {angles} rad."


def _joints_section(study: WorkspaceStudy) -> Section:
    figure: Image = image(
        active_joint_figure(study),
        "active_joints",
        alternative="Clouds of the readings at the poses of the workspace.",
        caption=f"The active-joint workspace, {plural(len(study.sample.poses), 'pose')}. "
        "Symmetry carries the colours onto each other.",
    )
    return Section("joints", "Active-joint workspace", [], [figure])
