# SPDX-License-Identifier: MIT
"""The workspace: what a sample, a study and measured poses say of it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from symkin.analysis.workspace import WorkspaceSample
from symkin.analysis.workspace.study import (
    READING_ROUNDING,
    ConstantOrientation,
    ElementCheck,
    ModeSlices,
    WorkspaceStudy,
    slice_coordinates,
)
from symkin.model.chains import legs_in_words
from symkin.model.mechanism import Mechanism
from symkin.planning import Plan
from symkin.planning.accuracy import set_name
from symkin.present import Group, Image, Page, Section, Table, page_of
from symkin.show.images import plotted
from symkin.show.units import on_paper
from symkin.show.wording import count, given, milli, plural, share, significant, sources

_CAUSES = {
    "reach": "out of a leg's reach, or too near its limits",
    "limits": "beyond the limits of a joint",
    "aspect": "behind a singularity, seen from home",
    "conditioning": "too near a singularity (condition number)",
}


def workspace_section(mechanism: Mechanism, candidates: WorkspaceSample, plan: Plan) -> Section:
    """Count the poses drawn and kept, and show them with the chosen ones."""
    legs = sorted(np.unique(plan.leg_sets).tolist(), key=lambda leg: np.inf if leg < 0 else leg)
    sets = [plan.poses[plan.rows_of_set(leg)] for leg in legs]
    labels = [set_name(leg) for leg in legs]
    turns = ", coloured by orientation" if mechanism.space.turns else ""
    poses = Image(
        "workspace",
        "Scatter plots of the candidate poses and of the chosen poses.",
        f"Candidates (small dots{turns}) and the chosen poses (large markers).",
        plotted("poses", candidates, sets, labels),
    )
    number = len(candidates) if plan.basis is None else plan.basis.candidates
    paragraph = (
        f"{plural(number, 'pose')} that every leg reaches, in the aspect of home and away "
        "from singularities, are the candidates for measurement, and the poses over which errors "
        "are averaged."
    )
    table = sampling_table(candidates, number)
    return Section("workspace", "Workspace", [paragraph], [table, poses])


def sampling_table(sample: WorkspaceSample, kept: int | None = None) -> Table:
    """Poses drawn, rejected and kept, of which the sample may hold some."""
    kept, drawn = len(sample) if kept is None else kept, sample.drawn
    surplus = drawn - kept - sum(sample.rejected.values())
    rows = [("drawn from the box", count(drawn), share(drawn, drawn))]
    rows += [
        (f"rejected: {_CAUSES.get(cause, cause)}", count(number), share(number, drawn))
        for cause, number in sample.rejected.items()
    ]
    if surplus > 0:
        rows.append(("more than needed", count(surplus), share(surplus, drawn)))
    rows.append(("candidates", count(kept), share(kept, drawn)))
    return Table("Sampling of the workspace", ("Poses", "Number", "Share"), [Group(rows)])


def elements_table(
    caption: str, elements: Sequence[ElementCheck], unit: str, *, brief: bool = False
) -> Table:
    """Show what poses say of each element of a group."""
    rows = [
        (
            found.element,
            "yes" if found.keeps_modes else "no",
            "yes" if found.keeps_aspect else "no",
            count(found.tested),
            count(found.inside),
            count(found.mismatches),
            milli(found.reading_deviation, unit),
        )
        for found in elements
    ]
    columns = ("Element", "Keeps modes", "Keeps aspect", "Tested", "Inside", "Mismatches")
    return Table(caption, (*columns, "Largest deviation"), [Group(rows)], brief=brief)


@page_of.register(WorkspaceSample)
def sample_page(sample: WorkspaceSample) -> Page:
    """Say how many poses were kept, and why the others were not."""
    image = Image(
        "poses",
        "Scatter plots of the poses.",
        "The poses.",
        plotted("poses", sample),
    )
    return Page(
        title=f"{plural(len(sample), 'pose')} of a workspace",
        headlines=[
            ("Workspace", f"{100 * sample.share:.1f}%", "of its box"),
            ("Legs", str(sample.readings.shape[1]), "each with a reading"),
            ("Condition number", significant(float(np.median(sample.conditions))), "median"),
        ],
        sections=[Section("sampling", "Sampling", (), [sampling_table(sample), image])],
    )


@page_of.register(WorkspaceStudy)
def workspace_page(study: WorkspaceStudy) -> Page:
    """Say whether a workspace has the symmetry of the legs, and what it looks like."""
    mechanism, structure = study.mechanism, study.symmetry.structure
    unit = mechanism.reading_unit
    doubts = [
        f"{check.element}: {check.mismatches} mismatches, readings differ by "
        f"{milli(check.reading_deviation, unit)}"
        for check in study.elements
        if check.mismatches or check.reading_deviation >= READING_ROUNDING
    ]
    worst = max(check.reading_deviation for check in study.elements)
    return Page(
        title=f"{mechanism.name}: workspace",
        subtitle=f"{legs_in_words(mechanism.legs)}, structure "
        f"{structure.title}, with its working modes {study.symmetry.with_modes.title}",
        headlines=[
            ("Workspace", f"{100 * study.share:.1f}%", "of its box"),
            ("Carried onto itself by", ", ".join(study.workspace_group), "in its modes and aspect"),
            ("Mismatches", count(sum(each.mismatches for each in study.elements)), "theorem"),
            ("Largest deviation", milli(worst, unit), "conjecture"),
        ],
        verdict="doubtful" if doubts else "good",
        judgement=(
            "The workspace does not have the symmetry of the structure"
            if doubts
            else "The workspace theorem (Eq. 2) and the active-joint conjecture (Eq. 5) hold"
        ),
        doubts=doubts,
        notes=[text for row in study.modes if (text := _singular_orientations(row))],
        sections=[_slices_section(study), _joints_section(study), _symmetry_section(study)],
        inputs=sources(mechanism.source),
    )


def _symmetry_section(study: WorkspaceStudy) -> Section:
    paragraph = (
        "A pose is in the workspace exactly if its image is (Eq. 2), and the readings at the image "
        "are the image of the readings (Eq. 5): tested on poses of the box. An element that flips "
        "the working modes is tested against the workspace of the flipped modes."
    )
    unit = study.mechanism.reading_unit
    table = elements_table("Elements of the structure", study.elements, unit, brief=True)
    return Section("symmetry", "Symmetry of the workspace", [paragraph], [table])


def _slices_section(study: WorkspaceStudy) -> Section:
    groups = [Group([_slice_row(found) for found in row.slices], row.title) for row in study.modes]
    mechanism = study.mechanism
    at, across = (on_paper(unit)[1] for unit in study.modes[0].slices[0].units)
    first, title, what = "Orientation", "Constant orientations", "Constant-orientation workspaces"
    if not mechanism.space.moves:
        first, title, what = "rz", "Slices", "Slices of the workspace at constant rz"
    if mechanism.bound:
        names = [*mechanism.space.units]
        (x, y), along = slice_coordinates(mechanism)
        first, title = names[along], "Slices"
        what = f"Slices of the workspace at constant {first}, over {names[x]} and {names[y]}"
    area = f"Workspace, {across}\N{SUPERSCRIPT TWO}"
    columns = (f"{first}, {at}", area, "Home's side", "Other side", "Aspects")
    table = Table("Areas", columns, groups, brief=True)
    figure = Image(
        "constant_orientations",
        "Maps of the poses that the legs reach at each orientation.",
        f"{what}. Numbers are those of the aspects.",
        plotted("workspace", study),
    )
    return Section("orientations", title, (), [figure, table])


def _slice_row(found: ConstantOrientation) -> Sequence[str]:
    at, across = (on_paper(unit)[0] for unit in found.units)
    areas = (found.usable_area, found.area_of_side(1), found.area_of_side(-1))
    return (
        "any" if math.isnan(found.orientation) else significant(at * found.orientation, 4),
        *(significant(across**2 * area, 4) for area in areas),
        str(len(found.aspect_areas)),
    )


def _singular_orientations(row: ModeSlices) -> str:
    """Where a turning platform meets parallel singularities; empty if nowhere."""
    if row.singular_orientations.size == 0:
        return ""
    angles = ", ".join(given(angle, "rad") for angle in row.singular_orientations.tolist())
    title = row.title[0].upper() + row.title[1:]
    where = "home's position" if row.mechanism.space.moves else "home with other rz,"
    return f"{title}: parallel singularities at {where} at {angles}."


def _joints_section(study: WorkspaceStudy) -> Section:
    figure = Image(
        "active_joints",
        "Clouds of the readings at the poses of the workspace.",
        f"The active-joint workspace, {plural(len(study.sample), 'pose')}. "
        "Symmetry carries the colours onto each other.",
        plotted("active_joints", study),
    )
    return Section("joints", "Active-joint workspace", [], [figure])
