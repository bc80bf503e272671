# SPDX-License-Identifier: MIT
"""What was measured."""

from __future__ import annotations

import numpy as np

from symkin.measurements import Measurements
from symkin.planning.plan import set_name
from symkin.report.content import Group, Image, Page, Section, Table, plotted
from symkin.report.wording import count

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
    whole = taken.poses[np.isfinite(taken.poses).all(axis=1)]
    poses = Image(
        "poses",
        "Scatter plots of the measured poses.",
        "The measured poses." if len(whole) == len(read) else "The poses measured in full.",
        plotted("poses", whole, pose_space=taken.pose_space),
    )
    headlines = [
        ("Poses", count(len(taken.poses)), f"sets: {', '.join(map(set_name, sets))}"),
        ("Readings", count(int(read.sum())), f"of {count(len(legs))} legs"),
    ]
    for name, values in (
        ("Poses measured in full", None if len(whole) == len(read) else whole),
        ("Target points", taken.points),
        ("Distances", taken.distances),
        ("Heights", taken.heights),
        ("Reported poses", taken.reported),
    ):
        if values is not None:
            size = 1 if name in ("Distances", "Heights") else values.shape[-1]
            seen = np.isfinite(values.reshape(-1, size)).any(axis=1)
            headlines.append((name, count(int(seen.sum())), ""))
    return Page(
        title=f"Measurements{' of ' + taken.source_name if taken.source else ''}",
        subtitle=f"{taken.pose_space} poses",
        headlines=headlines,
        sections=[
            Section("poses", "Measured poses", [], [table, poses] if len(whole) else [table])
        ],
    )
