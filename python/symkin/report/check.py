# SPDX-License-Identifier: MIT
"""The page about a mechanism before anything is measured: what it means first, theory last."""

from __future__ import annotations

import dataclasses

from symkin.checks import CheckResult
from symkin.legs import legs_in_words
from symkin.mechanism import Mechanism
from symkin.points import axis_of_drawing
from symkin.report.content import Headline, Page, Section
from symkin.report.mechanism import held_parameters, legs_table, mechanism_section
from symkin.report.observability import observability_section, singular_values_table
from symkin.report.symmetry import (
    conditions_section,
    deviations_table,
    symmetry_section,
)
from symkin.report.wording import NONE, plural, setting, significant
from symkin.report.workspace import sampling_table

__all__ = ["check_page", "check_summary"]

_DESIGNS = {
    "orbits": "each pose, with its images under the symmetry, serves all legs",
    "mechanism": "poses are chosen for all legs at once, and serve all",
    "legs": "poses are chosen for each leg",
}


def check_page(result: CheckResult) -> Page:
    """Describe all that a check found."""
    mechanism, comparison = result.mechanism, result.comparison
    symmetry = symmetry_section(mechanism, comparison, result.groups)
    sections = [
        *([_differences(result)] if comparison.columns()["leg"] else []),
        _legs(result),
        _mechanism(result),
        _home(result),
        _identifiability(result),
        *(dataclasses.replace(each, details=True) for each in (symmetry, _conditions(result))),
    ]
    return dataclasses.replace(check_summary(result), sections=sections)


def check_summary(result: CheckResult) -> Page:
    """Describe whether the legs are alike, and what it means for measuring."""
    mechanism, comparison = result.mechanism, result.comparison
    doubts = _doubts(result)
    exact = comparison.verdict == comparison.sensors == "exact"
    bad = result.blind or result.missing or result.unusable is not None
    source = mechanism.source
    return Page(
        title=f"{mechanism.name}: check",
        subtitle=f"{legs_in_words(mechanism.legs)}, {mechanism.pose_space}",
        headlines=_headlines(result),
        verdict="bad" if bad else "doubtful" if doubts or not exact else "good",
        judgement=result.verdict,
        doubts=doubts,
        notes=_notes(result),
        next_step=result.next_step,
        inputs=[] if source is None else [(source.name, source)],
    )


def _headlines(result: CheckResult) -> list[Headline]:
    mechanism, home = result.mechanism, result.home
    settings, counts = mechanism.workspace, mechanism.estimated_counts
    limit = "" if settings is None else f"at most {settings.conditioning_limit:g}; "
    condition = ("Condition number at home", significant(home.condition), f"{limit}1 is best")
    if result.sample is None:
        return [("Parameters that poses show", NONE, "not tested"), condition]
    ranks = [leg.rank for leg in result.observability]
    # Of the leg that misses most.
    worst = max(range(len(counts)), key=lambda leg: counts[leg] - ranks[leg])
    all_shown = "all " + " or ".join(map(str, sorted(set(counts))))
    return [
        (
            "Parameters that poses show",
            all_shown if ranks[worst] == counts[worst] else f"{ranks[worst]} of {counts[worst]}",
            "of every leg",
        ),
        (
            "Poses",
            f"at least {result.least_poses}",
            f"{mechanism.protocol.pose_count} by default; symkin pose-count tells what more are "
            "worth",
        ),
        ("Design", result.design, _DESIGNS[result.design]),
        ("Workspace", f"{100 * result.share:.1f}%", "of its box can be used"),
        condition,
    ]


def _doubts(result: CheckResult) -> list[str]:
    doubts = [
        f"leg {leg}: no pose shows {combination}"
        for leg, shown in enumerate(result.observability, 1)
        for combination in shown.unseen
    ]
    doubts += result.undefined
    if result.untested:
        doubts.append(f"conditions and identifiability are not tested: {result.untested}")
    return doubts


def _notes(result: CheckResult) -> list[str]:
    notes = [result.comparison.sentences[-1]] if result.comparison.sensors != "exact" else []
    notes += held_parameters(result.mechanism)
    notes += _own_frames(result.mechanism)
    notes += _drawn_sideways(result.mechanism)
    conditions = () if result.conditions is None else result.conditions.conditions
    failing = [each for each in conditions if not each.holds]
    if failing:
        names = ", ".join(f"{each.section}({each.number})" for each in failing)
        if len(failing) == 1:
            names += f", {failing[0].text}"
        notes.append(
            f"{len(failing)} of the paper's {len(conditions)} conditions on symmetry "
            f"({names}) {'does' if len(failing) == 1 else 'do'} not hold, which does "
            "not stop the protocol."
        )
    return notes


def _drawn_sideways(mechanism: Mechanism) -> list[str]:
    """That the drawing has its symmetry about another axis than Z."""
    axis = axis_of_drawing(mechanism)
    if not axis:
        return []
    order = {"x": "y, z, x", "y": "z, x, y"}[axis]
    return [
        f"The points have more symmetry about the drawing's {axis} axis than about z, the only one "
        f"that counts: type all points, home and bounds as {order} to use it"
    ]


def _own_frames(mechanism: Mechanism) -> list[str]:
    """Where the robot's own frames are, if they are others than those of its file."""
    points = mechanism.points
    if points is None or not points.moved:
        return []
    places = [
        f"({', '.join(significant(value) for value in getattr(points, end))}) m of the file's "
        f"{end} frame"
        for end in points.ends
        if any(getattr(points, end))
    ]
    return [
        f"Parameters and poses are about {' and '.join(places)}, here and in Python; in files, "
        "plans and tables poses are in the file's frames"
    ]


def _differences(result: CheckResult) -> Section:
    text = (
        "Each leg is carried back to the first of those that are, or should be, alike, and "
        "compared with their median; tolerances are those of manufacture."
    )
    return Section("differences", "Differences", [text], [deviations_table(result.comparison)])


def _legs(result: CheckResult) -> Section:
    mechanism, home = result.mechanism, result.home
    before = [("image of", *(f"leg {leg.reference + 1}" for leg in result.origins))]
    readings = (setting(value, digits=6) for value in home.readings.round(12) + 0.0)
    after = [(f"reading at home, {mechanism.reading_unit}", *readings)]
    return Section("legs", "Legs", (), [legs_table(mechanism, before, after)])


def _mechanism(result: CheckResult) -> Section:
    """Draw the structure's symmetry, or the one that is nearly there."""
    mechanism, comparison, found = result.mechanism, result.comparison, result.comparison.found
    poses = mechanism.home[None, :] if result.sample is None else result.sample.poses[:1]
    group, kept = found.structure, [label for label, keeps in found.keeps_modes.items() if keeps]
    nearly = comparison.verdict == "nearly"
    if nearly and comparison.reference is not None:
        group, kept = comparison.reference, [*comparison.reference_elements]
    return mechanism_section(mechanism, poses, group, keeps_modes=kept, nearly=nearly)


def _home(result: CheckResult) -> Section:
    home, sample = result.home, result.sample
    serial = ", ".join(significant(float(value)) for value in home.serial)
    paragraph = (
        f"At home the determinant of dg/dpose is {significant(home.parallel)} and its condition "
        f"number {significant(home.condition)}; dh/dq of the legs is {serial}. A determinant of "
        "zero is a parallel singularity, a dh/dq of zero a serial singularity of the leg."
    )
    parts = [] if sample is None else [sampling_table(sample)]
    return Section("home", "Home and workspace", [paragraph], parts)


def _identifiability(result: CheckResult) -> Section:
    if result.sample is None:
        text = f"There are no poses to look at: {result.untested}."
        return Section("observability", "Identifiability", [text])
    section = observability_section(result.mechanism, result.leg_poses, symmetric=True)
    poses = plural(len(result.sample), "pose")
    where = f"Each reference leg at {poses} of the workspace, and its images at their images."
    return Section(
        section.anchor,
        "Identifiability",
        [where, *section.paragraphs],
        [*section.parts, singular_values_table(result.observability)],
    )


def _conditions(result: CheckResult) -> Section:
    if result.conditions is None:
        text = f"The conditions are not tested: {result.untested}."
        return Section("conditions", "Conditions", [text])
    return conditions_section(result.conditions)
