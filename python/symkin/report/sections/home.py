# SPDX-License-Identifier: MIT
"""The home pose, and how near it is to singularities."""

from __future__ import annotations

from symkin.checks.check import CheckResult
from symkin.report.content import Group, Section, Table
from symkin.report.wording import count, quantity, share, significant

__all__ = ["home_section"]


def home_section(result: CheckResult) -> Section:
    """Show the mechanism at home and how much of the workspace box can be used."""
    mechanism, home = result.mechanism, result.home
    legs = [
        (
            f"leg {leg}",
            quantity(float(reading), mechanism.reading_unit, 6),
            significant(float(serial)),
        )
        for leg, (reading, serial) in enumerate(zip(home.readings, home.serial, strict=True), 1)
    ]
    columns = ("Leg", "Reading", "dh/dq")
    paragraphs = [
        f"At home the determinant of dg/dpose is {significant(home.parallel)} and its condition "
        f"number {significant(home.condition)}. A determinant of zero is a parallel singularity; "
        "a dh/dq of zero is a serial singularity of the leg."
    ]
    sample = result.sample
    if sample is not None:
        used = sample.drawn - sum(sample.rejected.values())
        causes = ", ".join(f"{cause} {count(number)}" for cause, number in sample.rejected.items())
        paragraphs.append(
            f"Of {count(sample.drawn)} poses drawn from the workspace box "
            f"{share(used, sample.drawn)} can be used. Rejected: {causes}."
        )
    table = Table("The legs at home", columns, [Group(legs)])
    return Section("home", "Home and workspace", paragraphs, [table])
