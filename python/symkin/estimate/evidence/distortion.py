# SPDX-License-Identifier: MIT
"""A test for a measuring device that is distorted: not square, of unequal scales, or as a lens is.

What it does to positions is a field that no robot has: linear in the place, or with the cube of the
distance from the middle. It has to explain all that noise does not, since a part of such a field
resembles what sensors and joints do. Outliers are not left out: the outermost poses look like some.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from statistics import NormalDist

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import is_noise
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.sag import SAG_ALARMS, places_of
from symkin.estimate.found import Found
from symkin.values import Array

_SEEN = 1e-3  # of a field, at least, that other unknowns leave
_HELD = 0.02  # of a scale, if what is held does: lengths leave thousandths, away from the truth
_CLEAR = 4.0  # standard deviations of a term that is named
_MOST, _HALVINGS = 100.0, 30  # of standard deviations in which what is seen is looked for


def distortion_that_explains(found: Found) -> Doubt | None:
    """Say what distortion explains what the declared noise does not; None if none does.

    One step from the estimate says how large it is, to 3% of the distances and beyond.
    """
    if not found.converged:
        return None
    try:
        rows = linear_rows(found, ())
    except SymkinError:
        return None
    if rows is None or rows.spare < 1:
        return None
    columns, reach = columns_of_distortion(found, rows)
    if not columns:
        return None
    stacked = with_frames(rows, columns)
    sizes, covariance, drop = rows.explained(stacked)
    count, square, spare = len(stacked), rows.square, rows.spare - len(stacked)
    if not is_noise(square - drop, spare):
        return None
    scale = max((square - drop) / spare, 1.0)
    statistic = drop / count / scale
    p_value = float(_core.f_tail(statistic, count, spare))
    clear = _CLEAR * np.sqrt(scale * np.diag(covariance))
    named = [
        words_of(name, size, reach)
        for name, size, least in zip(columns, sizes, clear, strict=False)
        if abs(size) > least
    ]
    if p_value >= SAG_ALARMS or not named:
        return None
    evidence = f" (F({count}, {spare}) = {statistic:.3g})"
    figures = {"terms": ", ".join(named), "evidence": evidence, "most": True}
    return Doubt("device-distorted", p=p_value, figures=figures)


def columns_of_distortion(found: Found, rows: LinearRows) -> tuple[dict[str, Array], float]:
    """What a metre at the outermost pose does to the rows, and how far from the middle that is.

    Where unknowns do not explain it all.
    """
    places = places_of(found, rows)
    reach = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max(initial=0.0))
    if not 0 < reach < np.inf:
        return {}, reach
    axes = found.nominal.space.position
    by_name = _fields(places, reach, axes)
    columns = {name: _column(rows, axes, displaced) for name, displaced in by_name}
    if not len(found.prior_rows) and not _is_seen(rows, columns["scale"], _HELD):
        del columns["scale"]
    return {name: each for name, each in columns.items() if _is_seen(rows, each)}, reach


def with_frames(rows: LinearRows, columns: Mapping[str, Array]) -> list[Array]:
    """And those of a frame: where a distortion has no effect nobody knows."""
    frames = (rows.by_base[..., i] for i in range(len(rows.components)))
    return [*columns.values(), *(each for each in frames if _is_seen(rows, each))]


def seen_from(rows: LinearRows, columns: Mapping[str, Array], power: float) -> dict[str, float]:
    """Of each distortion the size that is named in so many of the robots that have it alone."""
    stacked = with_frames(rows, columns)
    count, spare = len(stacked), rows.spare - len(stacked)
    if not columns or spare < 1:
        return {}
    beyond = NormalDist().inv_cdf(power)
    deviations = np.sqrt(np.diag(rows.explained(stacked).covariance))

    def drop(size: float) -> float:  # what so many exceed, of a column that shows by that much
        square = size**2
        return square + count - beyond * math.sqrt(2 * count + 4 * square)

    low, high = 0.0, _MOST
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if _core.f_tail(max(drop(middle), 0.0) / count, count, spare) < SAG_ALARMS:
            high = middle
        else:
            low = middle
    return {
        name: max(high / rows.length(column), (_CLEAR + beyond) * float(deviation))
        for (name, column), deviation in zip(columns.items(), deviations, strict=False)
    }


def _fields(places: Array, reach: float, axes: Sequence[str]) -> Iterator[tuple[str, Array]]:
    """Displacements of positions, shape (n, size), of a metre at the outermost place at most.

    A scale alone is what the lengths of a robot do, unless something says how long they are, as
    tolerances or gains that are held.
    """
    away = (places - places.mean(axis=0)) / reach
    for i, j in itertools.combinations(range(len(axes)), 2):
        stretch, shear = np.zeros_like(away), np.zeros_like(away)
        stretch[:, i], stretch[:, j] = away[:, i], -away[:, j]
        shear[:, i], shear[:, j] = away[:, j], away[:, i]
        if i == 0:  # the others follow
            yield f"stretch {axes[i]}{axes[j]}", stretch
        yield f"shear {axes[i]}{axes[j]}", shear
    yield "lens", away * np.square(away).sum(axis=1, keepdims=True)
    yield "scale", places / reach


def _column(rows: LinearRows, axes: Sequence[str], displaced: Array) -> Array:
    """What displacements do to the rows; nothing if a coordinate of them was not measured."""
    column = np.zeros_like(rows.residual)
    for name, moved in zip(axes, displaced.T, strict=True):
        if not moved.any():
            continue
        own = rows.by_base[..., [each == name for each in rows.components]].sum(axis=-1)
        if not own.any():
            return np.zeros_like(column)
        column += own * moved[:, None]
    return column


def _is_seen(rows: LinearRows, column: Array, least: float = _SEEN) -> bool:
    """Whether the unknowns leave something of it."""
    return rows.length(column) > least * float(np.linalg.norm(column)) > 0


def words_of(name: str, size: float, reach: float) -> str:
    """A distortion of so many metres at the outermost pose."""
    kind, _, axes = name.partition(" ")
    if kind == "stretch":
        longer, shorter = (*axes,) if size > 0 else (*axes[::-1],)
        amount = f"{200 * abs(size) / reach:.2g} %"
        return f"longer along {longer} than along {shorter} by {amount}"
    if kind == "shear":
        return f"{axes[0]} and {axes[1]} from square by {2 * abs(size) / reach:.2g} rad"
    if kind == "lens":
        way = "outwards" if size > 0 else "inwards"
        return f"{1e3 * abs(size):.2g} mm {way} at the outermost pose, as by a lens"
    return f"too {'large' if size > 0 else 'small'} by {100 * abs(size) / reach:.2g} %"
