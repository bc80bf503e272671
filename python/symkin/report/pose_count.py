# SPDX-License-Identifier: MIT
"""What more poses bring, and how many a wanted accuracy needs."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from symkin.legs import legs_in_words
from symkin.planning import NeededPoses, PoseCountCurve
from symkin.report.content import Group, Headline, Image, Page, Section, Table, plotted
from symkin.report.plan import expected_headlines, survey_text
from symkin.report.wording import milli, plural, setting, significant

if TYPE_CHECKING:
    pass

__all__ = ["needed_poses_page", "pose_count_page"]

_PERCENT = "\N{NO-BREAK SPACE}%"


def pose_count_page(curve: PoseCountCurve) -> Page:
    """Describe what more poses bring."""
    mechanism, gain = curve.mechanism, f"{100 * curve.least_gain:g}{_PERCENT}"
    (kind, unit), *_ = mechanism.space.errors
    errors = getattr(curve, kind)
    enough = (
        f"From {plural(curve.enough, 'pose')} a leg on, another one saves less than {gain} of the "
        f"{kind} error"
        if curve.enough is not None
        else f"Every further pose saves at least {gain} of the {kind} error"
    )
    ends: list[Headline] = [
        (name, milli(errors[at], unit), f"{plural(int(curve.counts[at]), 'pose')} a leg")
        for name, at in (("Fewest", 0), ("Most", -1))
    ]
    return Page(
        title=f"{mechanism.name}: number of poses",
        subtitle=legs_in_words(mechanism.legs),
        headlines=[("Enough", str(curve.enough or "more"), "poses a leg"), *ends],
        verdict="good",
        judgement=enough,
        paragraphs=[_basis(curve)],
        next_step=_plan(curve, curve.enough or int(curve.counts[-1])),
        sections=[_curve_section(curve)],
    )


def _basis(curve: PoseCountCurve) -> str:
    text = "Errors are predicted to first order from the declared noise"
    survey = curve.survey
    return f"{text}." if survey is None else f"{text}. {survey_text(survey)}"


def needed_poses_page(needed: NeededPoses) -> Page:
    """Describe how many poses a wanted accuracy needs, and what else would help."""
    curve, expected = needed.curve, needed.expected
    mechanism, reached = curve.mechanism, needed.count is not None
    wanted = " and ".join(
        setting(1e3 * value, unit)
        for value, unit in ((needed.position, "mm"), (needed.orientation, "mrad"))
        if value is not None
    )
    poses = f"{plural(needed.tried, 'pose')} a leg, {needed.measured} in all"
    judgement = (
        f"{poses}, are enough for {wanted}" if reached else f"{poses}, are too few for {wanted}"
    )
    doubts = (
        []
        if reached
        else [
            f"the noise would have to be {significant(needed.excess, 2)} times smaller, or the "
            "accuracy that much coarser"
        ]
    )
    headlines = [
        ("Needed" if reached else "Tried", str(needed.tried), "poses a leg"),
        *expected_headlines(mechanism, expected.position, expected.orientation, "expected, rms"),
    ]
    remedies = Section("remedies", "What else would help", [], [_remedies(needed)])
    return dataclasses.replace(
        pose_count_page(curve),
        headlines=headlines,
        verdict="good" if reached else "bad",
        judgement=judgement,
        doubts=doubts,
        next_step=_plan(curve, needed.tried) if reached else "",
        sections=[*([remedies] if needed.remedies else []), _curve_section(curve)],
    )


def _plan(curve: PoseCountCurve, count: int) -> str:
    same = "" if curve.survey is None else ", with the same options"
    return f"symkin plan MECHANISM --pose-count {count} --out DIR{same}"


def _remedies(needed: NeededPoses) -> Table:
    kinds = needed.curve.mechanism.space.errors
    rows = [
        (
            remedy.change,
            *(milli(getattr(remedy.expected, kind), unit) for kind, unit in kinds),
            "yes" if remedy.enough else "no",
        )
        for remedy in needed.remedies
    ]
    columns = ["Change", *(f"{kind.capitalize()} error, rms" for kind, _ in kinds)]
    caption = "What else would help, at the same poses"
    return Table(caption, [*columns, "Enough"], [Group(rows)], brief=True)


def _curve_section(curve: PoseCountCurve) -> Section:
    kinds = curve.mechanism.space.errors
    figure = Image(
        "pose_count",
        "Expected errors and efficiency against the number of poses.",
        "Expected error after identification, and efficiency of the selection, against the number "
        "of poses that each leg is identified from. The dashed line is where another pose begins "
        "to gain too little.",
        plotted("pose_count", curve),
    )
    rows = []
    for at, number in enumerate(curve.counts.tolist()):
        row = [str(number), str(curve.measured[at])]
        row += [milli(getattr(curve, kind)[at], unit) for kind, unit in kinds]
        rows.append([*row, f"{100 * curve.efficiency[at]:.2f}{_PERCENT}"])
    columns = ["Poses a leg", "Poses in all"]
    columns += [f"{kind.capitalize()} error, rms" for kind, _ in kinds]
    table = Table("What more poses bring", [*columns, "Efficiency"], [Group(rows)], brief=True)
    return Section("curve", "Number of poses", [], [figure, table])
