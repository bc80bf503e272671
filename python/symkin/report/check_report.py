# SPDX-License-Identifier: MIT
"""The page about a mechanism before anything is measured."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from symkin.checks.check import CheckResult
from symkin.plot import DrawnSymmetry
from symkin.report.content import Page, Section
from symkin.report.html import write_page
from symkin.report.observability import observability_section, singular_values_table
from symkin.report.sections.conditions import conditions_section
from symkin.report.sections.groups import groups_section
from symkin.report.sections.home import home_section
from symkin.report.sections.mechanism import mechanism_section
from symkin.report.wording import NONE, plural

__all__ = ["write_check_report"]


def write_check_report(result: CheckResult, folder: Path) -> Path:
    """Write ``report.html`` and the PNG files of its figures; returns the page.

    Parameters
    ----------
    result : CheckResult
        Of `check_mechanism`.
    folder : Path
        Made if it does not exist.

    Returns
    -------
    Path
        The HTML file.
    """
    mechanism, sample = result.mechanism, result.sample
    poses = mechanism.home[None, :] if sample is None else sample.poses[:1]
    sections = [
        mechanism_section(mechanism, poses, _drawn(result)),
        groups_section(result),
        conditions_section(result),
        home_section(result),
        _identifiability(result),
    ]
    return write_page(
        dataclasses.replace(_summary(result), sections=sections), folder / "report.html"
    )


def _drawn(result: CheckResult) -> DrawnSymmetry:
    """What the drawing shows: the structure's symmetry, or the one that is nearly there."""
    comparison = result.comparison
    if comparison.verdict == "nearly" and comparison.reference is not None:
        return DrawnSymmetry(comparison.reference, comparison.reference_elements, nearly=True)
    found = comparison.found
    kept = [label for label, keeps in found.keeps_modes.items() if keeps]
    return DrawnSymmetry(found.structure, kept)


def _identifiability(result: CheckResult) -> Section:
    if result.sample is None:
        text = f"There are no poses to look at: {result.untested}."
        return Section("observability", "Identifiability", [text])
    section = observability_section(result.mechanism, result.leg_poses, symmetric=True)
    poses = plural(len(result.sample.poses), "pose")
    where = f"Each reference leg at {poses} of the workspace, and its images at their images."
    return Section(
        section.anchor,
        "Identifiability",
        [where, *section.paragraphs],
        [*section.parts, singular_values_table(result.observability)],
    )


def _summary(result: CheckResult) -> Page:
    mechanism, comparison = result.mechanism, result.comparison
    doubts = _doubts(result)
    blind = any(leg.unseen for leg in result.observability)
    absent = comparison.declared is not None and comparison.reference is comparison.declared
    bad = blind or absent or result.unusable is not None
    return Page(
        title=f"{mechanism.name}: check",
        subtitle=f"{plural(len(mechanism.legs), 'leg')}, chain {mechanism.chain}",
        headlines=_figures(result),
        verdict="bad" if bad else "doubtful" if doubts else "good",
        judgement=_judgement(result, blind),
        doubts=doubts,
        paragraphs=comparison.sentences,
    )


def _judgement(result: CheckResult, blind: bool) -> str:
    if blind:
        return "Some combinations of parameters are shown by no pose of the workspace"
    if result.conditions is None:
        if result.unusable is not None:
            return "No pose of the workspace can be drawn: conditions and the rest are not tested"
        return "Without a workspace in the file, conditions and identifiability are not tested"
    if all(condition.holds for condition in result.conditions.conditions):
        return "The paper's conditions hold, and every parameter can be identified"
    return "Every parameter can be identified; not all of the paper's conditions hold"


def _doubts(result: CheckResult) -> list[str]:
    doubts = [
        f"leg {leg}: no pose shows {combination}"
        for leg, shown in enumerate(result.observability, 1)
        for combination in shown.unseen
    ]
    doubts += result.undefined
    if result.unusable is not None:
        doubts.append(str(result.unusable))
    if result.conditions is not None:
        doubts += [
            f"{condition.section}({condition.number}) {condition.text}: {condition.figure}"
            for condition in result.conditions.conditions
            if not condition.holds
        ]
    return doubts


def _figures(result: CheckResult) -> Sequence[tuple[str, str, str]]:
    structure, kept, *_ = result.groups
    figures = [
        ("Structure, G_M", structure.title, plural(len(structure.elements), "element")),
        ("With the working modes", kept.title, plural(len(kept.elements), "element")),
    ]
    if result.conditions is None:
        why = "no workspace in the file" if result.unusable is None else "workspace not sampled"
        return [*figures, ("Conditions", NONE, why)]
    conditions = result.conditions.conditions
    holding = sum(condition.holds for condition in conditions)
    names = len(result.mechanism.parameter_names)
    least = min(leg.rank for leg in result.observability)
    return [
        *figures,
        ("The paper's conditions", f"{holding} of {len(conditions)}", "hold"),
        ("Identifiable", f"{least} of {names}", "parameters of every leg"),
    ]
