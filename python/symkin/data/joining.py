# SPDX-License-Identifier: MIT
"""Measurements of one robot that were taken in several sessions, as one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from symkin.data.measurements import Measurements
from symkin.data.observables import CIRCUMSTANCES
from symkin.errors import MeasurementError


def joined(parts: Sequence[Measurements]) -> Measurements:
    """Put measurements one behind the other, each as a session, from 1.

    Rows of the later ones are numbered on from the last of those before, and their times begin
    after those. What one of them lacks of what was observed is NaN there.

    Raises
    ------
    MeasurementError
        For measurements with sessions of their own, of other legs or poses, with another number of
        points, or of which some have a circumstance, such as the time, and others have not.
    """
    first = parts[0]
    if len(parts) == 1:
        return first
    for number, each in enumerate(parts, 1):
        if each.sessions is not None:
            raise MeasurementError(
                f"file {number} has a column session of its own; expected one table with such a "
                "column, or files that are a session each"
            )
        alike = ("pose_space", "reading_unit", "sensor_table")
        if any(getattr(each, name) != getattr(first, name) for name in alike):
            raise MeasurementError(f"file {number} is of another robot than file 1")
    arrays: dict[str, Any] = {}
    for name in (each.name for each in fields(first)):
        found = [getattr(part, name) for part in parts]
        if any(isinstance(value, np.ndarray) for value in found):
            arrays[name] = _stacked(name, found, parts)
    ends = np.cumsum([0, *(int(part.row_numbers.max(initial=0)) for part in parts)])
    if "partners" in arrays:
        arrays["partners"] = np.concatenate([
            np.where(part.partners > 0, part.partners + end, 0)
            if part.partners is not None
            else np.zeros((len(part), arrays["partners"].shape[1]), dtype=np.intp)
            for part, end in zip(parts, ends, strict=False)
        ])  # fmt: skip
    arrays["row_numbers"] = np.concatenate(
        [part.row_numbers + end for part, end in zip(parts, ends, strict=False)]
    )
    if "times" in arrays:
        arrays["times"] = _one_after_the_other([part.times for part in parts])
    unread = tuple(dict.fromkeys(name for part in parts for name in part.unread))
    sessions = np.repeat(np.arange(1, len(parts) + 1), [len(part) for part in parts])
    return replace(first, **arrays, sessions=sessions, source=None, unread=unread)


def _stacked(name: str, found: Sequence[Any], parts: Sequence[Measurements]) -> Any:
    known = next(value for value in found if value is not None)
    missing = [number for number, value in enumerate(found, 1) if value is None]
    if missing and name in CIRCUMSTANCES:
        raise MeasurementError(
            f"file {missing[0]} says nothing of the {CIRCUMSTANCES[name].kind}, and others do; "
            "expected it in all of them, or in none"
        )
    for number, value in enumerate(found, 1):
        if value is not None and value.shape[1:] != known.shape[1:]:
            raise MeasurementError(
                f"file {number} has {name} of shape {value.shape}; expected (N, "
                f"{', '.join(map(str, known.shape[1:]))}) as in the others"
            )
    return np.concatenate([
        np.full((len(part), *known.shape[1:]), np.nan) if value is None else value
        for part, value in zip(parts, found, strict=True)
    ])  # fmt: skip


def _one_after_the_other(times: Sequence[Any]) -> Any:
    """Times of which each begins after the one before, by its usual step."""
    placed = [times[0]]
    for own in times[1:]:
        end = placed[-1].max(initial=0.0)
        step = float(np.median(np.diff(np.sort(own)))) if len(own) > 1 else 1.0
        late = own.min(initial=np.inf) > end
        placed.append(own if late else own - own.min(initial=0.0) + end + (step or 1.0))
    return np.concatenate(placed)
