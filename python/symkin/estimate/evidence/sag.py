# SPDX-License-Identifier: MIT
"""A test for positions that are off with the square of the distance from the middle of all.

So is a platform that sags the more the further out it is, and what a distorted device measures. A
test of one term sees it where that of all coordinates and their squares does not, and so much of it
looks like other parameters that a robot is worse for it long before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import is_noise, thousandths
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.found import Found
from symkin.model.framing import unframed
from symkin.values import Array

SAG_ALARMS = ALARMS / 5
_SEEN = 1e-3  # of a column, at least, that other unknowns leave


def doubts_of_sag(
    found: Found, apart: Sequence[int] = (), *, whole: bool = False
) -> Iterator[Doubt]:
    """Say it of the coordinate that shows it most, without the poses that are outliers.

    If it explains what is too much, or most of it unless that is not enough (`whole`). All
    coordinates together alarm for one of 10 000 sound robots: all doubts are one of a hundred.
    """
    try:
        rows = linear_rows(found, tuple(apart))
    except SymkinError:
        return
    if rows is None or rows.spare < 1:
        return
    columns = columns_of_sag(found, rows)
    if not columns:
        return
    square, drop = rows.square, rows.explained([*columns.values()]).drop
    spare = rows.spare - len(columns)
    scale = np.sqrt(max((square - drop) / max(spare, 1), 1.0))
    scores = {name: rows.score(column) / scale for name, column in columns.items()}
    worst = max(scores, key=lambda name: abs(scores[name]))
    p_value = float(_core.chi_square_tail(scores[worst] ** 2, 1))
    most = not whole and drop > (square - rows.spare) / 2
    accounted = most or is_noise(square - drop, spare)
    if p_value >= SAG_ALARMS / len(columns) or not accounted:
        return
    deviation = float(scale / rows.length(columns[worst]))
    size = scores[worst] * deviation
    figures = {
        "component": worst,
        "amount": thousandths(size, deviation, "m"),
        "evidence": f" ({abs(scores[worst]):.1f} standard deviations, p {p_value:.1g})",
    }
    yield Doubt("sags", size=size, p=p_value, figures=figures)


def places_of(found: Found, rows: LinearRows) -> Array:
    """Where the platform was in each of the rows, in the robot's own frame, shape (n, size)."""
    if found.legs:
        poses = unframed(found.mechanism.replace(frames=None), found.measurements.poses)
    else:
        poses = found.latent_poses
    return np.asarray(poses[rows.order, : found.nominal.space.size])


def columns_of_sag(found: Found, rows: LinearRows) -> dict[str, Array]:
    """What a metre at the outermost pose does to the rows, where unknowns do not explain it all."""
    places = places_of(found, rows)
    squares = np.square(places - places.mean(axis=0)).sum(axis=1)
    if not squares.size or not 0 < squares.max() < np.inf:
        return {}
    columns = {}
    for name in found.nominal.space.position:
        if name not in rows.components:
            continue
        column = rows.by_base[..., rows.components.index(name)] * (squares / squares.max())[:, None]
        if rows.length(column) > _SEEN * np.linalg.norm(column) > 0:
            columns[name] = column
    return columns
