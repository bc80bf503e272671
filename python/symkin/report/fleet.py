# SPDX-License-Identifier: MIT
"""What there is to say of many robots."""

from __future__ import annotations

from symkin.identification.fleet import Fleet
from symkin.report.content import Group, Page, Section, Table, Verdict
from symkin.report.wording import count, plural, quantity

__all__ = ["fleet_page"]

_SHOWN = 20


def fleet_page(fleet: Fleet) -> Page:
    """Count the robots that fit, and say what is wrong with the others."""
    counts = {word: fleet.verdicts.count(word) for word in ("fits", "doubtful", "failed")}
    total = len(fleet.robots)
    verdict: Verdict = "bad" if counts["failed"] else "doubtful" if counts["doubtful"] else "good"
    rows = [
        (robot, verdict, failure or doubt)
        for wanted in ("failed", "doubtful")
        for robot, verdict, failure, doubt in zip(
            fleet.robots, fleet.verdicts, fleet.failures, fleet.doubts, strict=True
        )
        if verdict == wanted
    ]
    caption = "Robots that failed, and those that something speaks against"
    table = Table(
        caption,
        ("Robot", "Verdict", "Why"),
        [Group(rows)],
        wordy=True,
        brief=True,
        brief_rows=_SHOWN,
    )
    judgement = (
        f"{count(counts['fits'])} of {plural(total, 'robot')} fit the declared noise and the "
        "tolerances"
    )
    if counts["doubtful"]:
        judgement += f", {count(counts['doubtful'])} are doubtful"
    if counts["failed"]:
        judgement += f", {count(counts['failed'])} failed"
    return Page(
        title=f"{fleet.nominal.name}: {plural(total, 'robot')}",
        subtitle=f"estimator {fleet.options.estimator}",
        headlines=[
            ("Fit", count(counts["fits"]), f"of {count(total)}"),
            ("Doubtful", count(counts["doubtful"]), "see the table"),
            ("Failed", count(counts["failed"]), "see the table"),
            (
                "Throughput",
                f"{quantity(fleet.robots_per_second, '')}".strip(),
                f"robots a second, {quantity(fleet.seconds, 's')}",
            ),
        ],
        verdict=verdict,
        judgement=judgement,
        notes=[
            "A robot that fits passed the tests of noise and tolerance; symkin identify makes more "
            "of a single one."
        ],
        sections=[Section("robots", "Robots to look at", [], [table])] if rows else [],
    )
