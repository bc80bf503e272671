# SPDX-License-Identifier: MIT
"""Rows from some row on that are of another robot than those before."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.evidence.changes import is_noise
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.evidence.sag import columns_of_sag
from symkin.estimate.found import Found
from symkin.values import Array

_ROWS = 200  # at which a part may begin
_SEEN = 1e-6  # of an unknown: what a part shows
_LEAST = 5  # conditions to spare in a part


def of_another_robot(found: Found, fitted: Callable[..., Found | None]) -> Doubt | None:
    """Say from which row on they are, if each part fits by itself.

    Not where zeros that were set anew and a device that was moved would explain it, a step of each,
    or a sag.
    """
    try:
        rows = linear_rows(found, ())
    except SymkinError:
        return None
    if rows is None or rows.spare < 1 or found.noise_is_estimated or found.options.loss != "none":
        return None
    begin = _begin(rows)
    sag = columns_of_sag(found, rows).values()
    if begin is None or _has_stepped(rows, begin) or _leave_noise(rows, sag):
        return None
    whole = np.sort(rows.order[begin:])
    parts: list[Any] = []
    for own in (np.setdiff1d(rows.order, whole), whole):
        part = fitted(found.nominal, found.measurements.subset(own), found.options)
        if part is None or part.unexplained or part.degrees_of_freedom < _LEAST:
            return None
        parts.append(part)
    square = sum(each.chi_square for each in parts)
    degrees = sum(each.degrees_of_freedom for each in parts)
    fewer = found.degrees_of_freedom - degrees
    p_value = float(_core.chi_square_tail(max(found.chi_square - square, 0.0), max(fewer, 1)))
    if p_value >= ALARMS / len(rows.order) or not is_noise(square, degrees):
        return None
    numbers = found.measurements.row_numbers
    row = int(numbers[rows.order[begin]])
    doubt = Doubt("rows-of-another-robot", rows=(row,), p=p_value, figures={"row": row})
    return doubt.as_cause((), found.chi_square_ratio, square / degrees, whole=True)


def _begin(rows: LinearRows) -> int | None:
    """Where a second part begins whose own unknowns explain most, by one step from the estimate."""
    count = len(rows.residual)
    stride = max(1, count // _ROWS)
    starts = np.arange(0, count, stride)
    grams = np.add.reduceat(np.einsum("nrk,nrl->nkl", rows.basis, rows.basis), starts, axis=0)
    alongs = np.add.reduceat(np.einsum("nrk,nr->nk", rows.basis, rows.residual), starts, axis=0)
    best, begin = 0.0, None
    gram, along = np.zeros_like(grams[0]), np.zeros_like(alongs[0])
    for start, more, shown in zip(starts[:0:-1], grams[:0:-1], alongs[:0:-1], strict=True):
        gram, along = gram + more, along + shown
        share, axes = np.linalg.eigh(gram)
        left = share * (1 - share)  # of a step of each unknown, what the unknowns leave
        seen = left > _SEEN
        drop = float((np.square(axes.T @ along)[seen] / left[seen]).sum())
        if drop > best:
            best, begin = drop, int(start)
    return begin


def _has_stepped(rows: LinearRows, begin: int) -> bool:
    """Whether steps of the sensors and of the base there leave noise."""
    later = (np.arange(len(rows.residual)) >= begin)[:, None]
    legs = [later * rows.by_leg[..., leg] for leg in range(rows.by_leg.shape[2])]
    base = [later * rows.by_base[..., each] for each in range(len(rows.components))]
    return _leave_noise(rows, (*legs, *base))


def _leave_noise(rows: LinearRows, columns: Iterable[Array]) -> bool:
    """Whether these do, if any are seen."""
    seen = [each for each in columns if rows.length(each) > _SEEN * np.linalg.norm(each)]
    if not seen:
        return False
    return is_noise(rows.square - rows.explained(seen).drop, rows.spare - len(seen))
