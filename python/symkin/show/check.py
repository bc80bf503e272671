# SPDX-License-Identifier: MIT
"""The pages about a mechanism before anything is measured: what it means first, theory last."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from symkin.analysis.checks import CheckResult
from symkin.analysis.conditions import Condition, Conditions
from symkin.analysis.measurable import MeasurableSymmetry
from symkin.analysis.promises import left_to_gravity
from symkin.model.chains import legs_in_words
from symkin.model.file_frames import axis_of_drawing
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry import (
    DetectedSymmetry,
    NamedGroup,
    SymmetryComparison,
    SymmetryPairs,
    compare_symmetry,
    leg_carriers,
    symmetry_pairs,
)
from symkin.model.symmetry.groups import carrier_words
from symkin.present import Group, Headline, Page, Section, Table, page_of
from symkin.show.mechanism import held_parameters, legs_table, mechanism_section
from symkin.show.observability import observability_section, singular_values_table
from symkin.show.symmetry import pairs_table
from symkin.show.units import on_paper
from symkin.show.wording import (
    NONE,
    count,
    milli,
    plural,
    setting,
    significant,
    sources,
)
from symkin.show.workspace import elements_table, sampling_table
from symkin.values import places_of

_TITLES = {
    4: "Section 4: symmetrical active-joint workspace",
    5: "Section 5: symmetrical observability",
}
_ROUNDING = 1e-9  # m
_ALWAYS_SHOWN = 10  # deviations
_AS_GOOD = 0.98  # efficiency of carried poses that needs no word
_SOUND = 10  # condition number at home that needs no word


@page_of.register(CheckResult)
def check_page(result: CheckResult) -> Page:
    """Describe whether the legs are alike, and what it means for measuring."""
    mechanism, comparison = result.mechanism, result.comparison
    symmetry = symmetry_section(
        mechanism, comparison, result.groups, result.pairs, result.measurable
    )
    untested = [f"The conditions are not tested: {result.untested}."]
    conditions = Section("conditions", "Conditions", untested)
    if result.conditions is not None:
        conditions = _conditions_section(result.conditions)
    text = (
        "Each leg is carried back to the first of those that are, or should be, alike, and "
        "compared with their median; tolerances are those of manufacture."
    )
    sections = [
        *_differences(comparison, "Differences", [text]),
        _legs(result),
        _mechanism(result),
        _home(result),
        _identifiability(result),
        *(dataclasses.replace(each, details=True) for each in (symmetry, conditions)),
    ]
    doubts = _doubts(result)
    exact = comparison.verdict == comparison.sensors == "exact"
    bad = result.blind or result.missing or result.unusable is not None
    return Page(
        title=f"{mechanism.name}: check",
        subtitle=f"{legs_in_words(mechanism.legs)}, {mechanism.pose_space}",
        headlines=_headlines(result),
        verdict="bad" if bad else "doubtful" if doubts or not exact else "good",
        judgement=result.verdict,
        doubts=doubts,
        notes=_notes(result),
        next_step="" if result.next_command else result.next_step,
        next_command=result.next_command,
        sections=sections,
        inputs=sources(mechanism.source),
    )


def _design_words(result: CheckResult) -> str:
    """What the plan's default measures, and what would be less."""
    if result.design == "mechanism":
        return "poses for all legs at once"
    shortest = result.shortest_design
    whole = f"{result.mechanism.protocol.pose_count * len(result.origins)} poses"
    return whole if shortest == "legs" else f"{whole}; fewer by --design {shortest}"


def _headlines(result: CheckResult) -> list[Headline]:
    mechanism, home = result.mechanism, result.home
    settings = mechanism.workspace
    counts = [len(leg.parameter_names) for leg in result.observability]
    limit = "" if settings is None else f"at most {settings.conditioning_limit:g}; "
    condition = ("Condition number at home", significant(home.condition), f"{limit}1 is best")
    if result.sample is None:
        return [("Parameters that poses show", NONE, "not tested"), condition]
    ranks = [leg.rank for leg in result.observability]
    # Of the leg that misses most.
    worst = max(range(len(counts)), key=lambda leg: counts[leg] - ranks[leg])
    shown = f"{ranks[worst]} of {counts[worst]}"
    if ranks[worst] == counts[worst]:
        shown = "all " + " or ".join(map(str, sorted(set(counts))))
    weak = len(result.weak)
    remark = "of every leg" if len(mechanism.leg_readings) > 1 else "of the one leg"
    remark += f", {weak} worse than the drawing" if weak else ""
    more = "by default; symkin pose-count"
    headlines = [
        ("Parameters that poses show", shown, remark),
        ("Poses", f"at least {result.least_poses}", f"{mechanism.protocol.pose_count} {more}"),
        ("Design", result.design, _design_words(result)),
        ("Workspace", f"{100 * result.share:.1f}%", "of its box can be used"),
    ]
    alone = result.readings_alone
    if alone is not None:
        count = f"{alone.shown} of {alone.parameters}"
        without = f"parameters, with no device; not {alone.datum}"
        headlines.append(("Readings alone show", count, without))
    return headlines if home.condition <= _SOUND else [*headlines, condition]


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
    if result.mechanism.open_coordinates:
        told = left_to_gravity(result.mechanism)
        notes.append(f"{told[0].upper()}{told[1:]}.")
    notes += _measurable(result)
    notes += held_parameters(result.mechanism)
    notes += _weak(result)
    notes += _negative(result)
    notes += _own_frames(result.mechanism)
    notes += _drawn_sideways(result.mechanism) if len(result.orbits) > 1 else []
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


def _measurable(result: CheckResult) -> list[str]:
    """Warn where limits or noise have less symmetry than the robot, which poses are carried by."""
    found = result.measurable
    if found is None:
        return []
    told = [found.carried] if found.efficiency < _AS_GOOD else []
    if any("joint limits" in each.broken for each in found.elements):
        told.append(
            f"Joint limits tell legs apart: {100 * found.with_images:.0f}% of the poses have all "
            "their images within limits and box; only these serve all legs."
        )
    return told


def _weak(result: CheckResult) -> list[str]:
    """Name what measurements will hardly say, and what to do about it."""
    weak = result.weak
    if not weak:
        return []
    told = [f"{name} {significant(times, 2)}" for name, times in weak.items()]
    worst = max(weak, key=lambda name: weak[name])
    return [
        f"The drawing will know {', '.join(weak)} better than "
        f"{result.mechanism.protocol.pose_count} measured poses do (standard deviations in "
        f"tolerances: {', '.join(told)}). What they do to the platform is shown: identify with "
        f"--prior tolerances, or hold one of them, as by --fixed {worst}"
    ]


def _negative(result: CheckResult) -> list[str]:
    """Warn of ways that a carriage or strut stands before its zero at home, as by a wrong sign."""
    mechanism, readings = result.mechanism, result.home.readings
    lower, upper = mechanism.reading_limits
    expected = (np.isfinite(lower) & (lower < 0)) | (upper <= 0)
    wrong = np.flatnonzero((readings < -_ROUNDING) & ~expected)
    if mechanism.reading_unit != "m" or not len(wrong):
        return []
    shown = ", ".join(milli(float(readings[leg]), "m") for leg in wrong)
    return [
        f"{mechanism.named_legs(wrong)} read less than zero at home ({shown}): mind the sign and "
        "the offset of the sensor, or say by [joint_limits] that this is meant"
    ]


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


def _legs(result: CheckResult) -> Section:
    mechanism, home = result.mechanism, result.home
    before = [("image of", *(f"leg {leg.reference + 1}" for leg in result.origins))]
    factor, unit = on_paper(mechanism.reading_unit)
    readings = [setting(factor * value, digits=6) for value in home.readings.round(12) + 0.0]
    readings[mechanism.reading_count :] = [NONE] * int((~mechanism.is_read).sum())
    after = [(f"reading at home, {unit}", *readings)]
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


def symmetry_section(
    mechanism: Mechanism,
    comparison: SymmetryComparison | None = None,
    groups: Sequence[NamedGroup] = (),
    pairs: SymmetryPairs | None = None,
    measurable: MeasurableSymmetry | None = None,
) -> Section:
    """State the symmetry that there is, and how every leg comes from its reference leg."""
    comparison = comparison or compare_symmetry(mechanism)
    pairs = pairs or symmetry_pairs(mechanism)
    parts = [_groups_table(groups), pairs_table(pairs)] if groups else []
    told = measurable.sentences if measurable is not None else ()
    if measurable is not None:
        parts.append(_measurable_table(measurable))
    return Section(
        "symmetry",
        "Symmetry",
        [*comparison.sentences, *pairs.sentences, *told, _orbits(mechanism)],
        [*parts, _carriers_table(mechanism)],
    )


def _measurable_table(found: MeasurableSymmetry) -> Table:
    """Show what of box, joint limits and noise each symmetry keeps."""
    rows = [
        (
            each.label,
            each.words,
            f"{100 * each.box:.0f} %",
            f"{100 * each.limits:.0f} %",
            significant(each.noise),
        )
        for each in found.elements
    ]
    columns = ("Element", "Of the base", "In the box", "Within limits", "Noise differs by")
    caption = f"What can be measured: images of {plural(found.poses, 'pose')}"
    return Table(caption, columns, [Group(rows)], wordy=True)


def _carriers_table(mechanism: Mechanism) -> Table:
    """Show which element carries which leg to every leg."""
    rows = [
        (
            f"leg {leg}",
            f"leg {reference + 1}",
            element.label,
            carrier_words(mechanism, element),
        )
        for leg, (reference, element) in enumerate(leg_carriers(mechanism), 1)
    ]
    caption = "Where the legs and their poses come from (Eqs. 7, 21)"
    return Table(caption, ("Leg", "Image of", "Element", "Which is"), [Group(rows)], wordy=True)


def _groups_table(groups: Sequence[NamedGroup]) -> Table:
    """Show groups by their names and elements."""
    rows = [
        (
            f"{group.symbol}, {group.meaning}",
            group.paper_name or "no group",
            group.name or "no group",
            str(len(group.elements)),
            "; ".join(
                f"{label}: {words}"
                for label, words in zip(group.elements, group.described, strict=True)
            ),
        )
        for group in groups
    ]
    columns = ("Group", "In the paper", "Usually", "Size", "Elements")
    return Table("Groups", columns, [Group(rows)], wordy=True)


def _differences(
    comparison: SymmetryComparison, title: str, paragraphs: Sequence[str] = ()
) -> list[Section]:
    """Show what breaks a symmetry, largest first; nothing if nothing does."""
    rows = [
        (
            f"leg {found.leg + 1}, {found.parameter}",
            milli(found.deviation, found.unit),
            significant(found.in_tolerances),
            milli(found.standard_deviation, found.unit),
        )
        for found in comparison.deviations + comparison.sensor_deviations
    ]
    columns = ("Parameter", "Deviation", "In tolerances", "Standard deviation")
    shown: dict[str, Any] = {"brief": True, "brief_rows": _ALWAYS_SHOWN, "others": "smaller"}
    table = Table("Where the legs differ", columns, [Group(rows)], **shown)
    return [Section("differences", title, paragraphs, [table])] if rows else []


def _conditions_section(conditions: Conditions) -> Section:
    """List the conditions (1)-(5) of section 4 and (1)-(7) of section 5."""
    paragraph = (
        f"Each element of {conditions.tested_group} was tested on {count(conditions.tested)} "
        "poses of the workspace box: a pose is in the workspace exactly if its image is (Eq. 2), "
        "and the readings at the image are the image of the readings (Eq. 5). One that does not "
        "keep the working modes is tested against the workspace of the other modes."
    )
    groups = [
        Group([_row(found) for found in conditions.conditions if found.section == section], title)
        for section, title in _TITLES.items()
    ]
    columns = ("Condition", "Verdict", "Figure", "Allowed")
    parts = [
        Table("The paper's conditions", columns, groups, wordy=True),
        elements_table("Workspace and readings", conditions.elements, conditions.reading_unit),
    ]
    return Section("conditions", "Conditions", [paragraph], parts)


def _row(condition: Condition) -> tuple[str, ...]:
    return (
        f"({condition.number}) {condition.text}",
        "holds" if condition.holds else "fails",
        condition.figure,
        condition.tolerance or NONE,
    )


@page_of.register(DetectedSymmetry)
def detection_page(found: DetectedSymmetry) -> Page:
    """Say which symmetry the legs have."""
    return Page(
        title="Symmetry of the legs",
        headlines=[
            ("Structure", found.structure.title, plural(found.structure.size, "element")),
            ("With the working modes", found.with_modes.title, ""),
        ],
    )


@page_of.register(SymmetryComparison)
def comparison_page(comparison: SymmetryComparison) -> Page:
    """Say how near the legs are to a symmetry, and what breaks it."""
    first, *others = comparison.sentences
    return Page(
        title="Symmetry of the legs",
        headlines=[("Structure", comparison.found.structure.title, comparison.verdict)],
        verdict="good" if comparison.verdict == comparison.sensors == "exact" else "doubtful",
        judgement=first,
        notes=others,
        sections=_differences(comparison, "What breaks the symmetry"),
    )


@page_of.register(Conditions)
def conditions_page(conditions: Conditions) -> Page:
    """Say which of the paper's conditions hold."""
    failing = [each for each in conditions.conditions if not each.holds]
    total = len(conditions.conditions)
    return Page(
        title="The paper's conditions",
        headlines=[
            ("Conditions", f"{total - len(failing)} of {total}", "hold"),
            ("Structure, G_M", conditions.structure, ""),
            ("With the working modes", conditions.with_modes, ""),
        ],
        verdict="doubtful" if failing else "good",
        judgement="Not all conditions hold" if failing else "All conditions hold",
        doubts=[f"{each.section}({each.number}) {each.text}: {each.figure}" for each in failing],
        sections=[
            Section("groups", "Groups", (), [_groups_table(conditions.groups)]),
            _conditions_section(conditions),
        ],
    )


def _orbits(mechanism: Mechanism) -> str:
    """Which legs are images of each other."""
    orbits = places_of(reference for reference, _ in leg_carriers(mechanism))
    if len(orbits) == 1:
        return (
            "All legs are images of leg 1. The elements G_C of the table carry it, and the poses "
            "chosen for it, to the others: poses need to be chosen for one leg only."
        )
    if len(orbits) == len(mechanism.legs):
        return "No leg is the image of another: poses are chosen for each."
    listed = "; ".join(", ".join(str(leg + 1) for leg in orbit) for orbit in orbits.values())
    return f"Legs that are images of each other: {listed}. Poses are chosen for one of each."
