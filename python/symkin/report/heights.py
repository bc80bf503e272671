# SPDX-License-Identifier: MIT
"""What heights that a probe touched show, as a printer's owner reads it."""

from __future__ import annotations

from collections.abc import Iterator

from symkin.identification.heights import Heights, in_words
from symkin.report.content import Group, Headline, Section, Table
from symkin.report.wording import milli, plural, ratio, significant

__all__ = ["heights_headlines", "heights_section"]

_ARROW = " \N{RIGHTWARDS ARROW} "


def heights_headlines(heights: Heights) -> Iterator[Headline]:
    """Heights before and after, and the size of what is printed."""
    values = [milli(each, "m") for each in (heights.before, heights.after)]
    remark = f"{ratio(heights.before, heights.after)}; after, at points that were not used"
    yield "Height, root mean square", _ARROW.join(values), remark
    values = [_per_100(each) for each in (heights.size_before, heights.size_after)]
    remark = "standard deviation of 100 mm in the plane, by the tolerances and as identified"
    yield "Size of what is printed, of 100 mm", _ARROW.join(values), remark


def heights_section(heights: Heights | None) -> list[Section]:
    """What the heights show and what they do not, in words; none without heights."""
    if heights is None:
        return []
    paragraphs = [
        f"The heights that the nominal robot would have differ from those measured by "
        f"{milli(heights.before, 'm')} (root mean square, about the plane that fits best). The "
        f"identified one predicts them to {milli(heights.after, 'm')} at points that it did not "
        f"use, in {plural(heights.folds, 'part')}.",
        *heights.notes,
    ]
    rows = [
        (
            each.plainly,
            each.parameter,
            _with_share(each.common),
            _with_share(each.between),
        )
        for each in heights.shown
    ]
    columns = ("", "Parameter", "All legs alike", "Between the legs")
    caption = "What the heights show (in brackets: left of the tolerance)"
    table = Table(caption, columns, [Group(rows)], wordy=True, brief=True)
    return [Section("heights", "Heights and the size of prints", paragraphs, [table])]


def _with_share(known: float) -> str:
    words = in_words(known)
    return words if words == "-" else f"{words} ({significant(100 * known, 2)} %)"


def _per_100(share: float) -> str:
    return milli(0.1 * share, "m")
