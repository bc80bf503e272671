# SPDX-License-Identifier: MIT
"""What was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symkin.measurements import Measurements
from symkin.planning.plan import set_name
from symkin.report.content import Group, Image, Page, Section, Table, plotted
from symkin.report.wording import count

if TYPE_CHECKING:
    pass

__all__ = ["measurements_page"]


def measurements_page(taken: Measurements) -> Page:
    """Count poses and readings, and show where the poses lie."""
    legs = range(taken.readings.shape[1])
    sets = np.unique(taken.leg_sets).tolist()
    read = np.isfinite(taken.readings)
    rows = [
        (f"leg {leg + 1}", count(int(read[:, leg].sum())), count(len(taken.rows_of(leg))))
        for leg in legs
    ]
    columns = ("Leg", "Readings", "Of them in its set")
    table = Table("Readings of every leg", columns, [Group(rows)], brief=True)
    poses = Image(
        "poses",
        "Scatter plots of the measured poses.",
        "The measured poses.",
        plotted("poses", taken),
    )
    return Page(
        title=f"Measurements{' of ' + taken.source_name if taken.source else ''}",
        subtitle=f"{taken.pose_space} poses",
        headlines=[
            ("Poses", count(len(taken.poses)), f"sets: {', '.join(map(set_name, sets))}"),
            ("Readings", count(int(read.sum())), f"of {count(len(legs))} legs"),
        ],
        sections=[Section("poses", "Measured poses", [], [table, poses] if len(read) else [table])],
    )
