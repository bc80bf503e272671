# SPDX-License-Identifier: MIT
"""The calibration of a robot, found beside its model, and the rows that it was fitted to."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.estimate import Estimate
from symkin.model.given import as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.pipeline import saved_estimate
from symkin.values import Array

_RESULTS = "results.json"
_UNITS = (1.0, np.pi / 180, 0.0254)  # of a column, which decimal prefixes do not change
_DIGITS, _EXACT = 9, 1e-9


def calibrated_of(given: Any) -> tuple[Estimate | None, Mechanism, list[Path]]:
    """An estimate if there is one: of a folder, a results file, or beside the mechanism's file."""
    if isinstance(given, Estimate):
        return given, given.mechanism, []
    if not isinstance(given, str | os.PathLike):
        return None, as_mechanism(given, "calibrated"), []
    path = Path(given)
    if path.is_dir() or path.suffix == ".json":
        results = path / _RESULTS if path.is_dir() else path
        found = saved_estimate(results)
        return found, found.mechanism, [results]
    model, beside = as_mechanism(given, "calibrated"), path.parent / _RESULTS
    paths = [*model.files]
    if path.suffix == ".toml" and beside.is_file():
        try:
            found = saved_estimate(beside)
        except SymkinError:  # of another command, or of another version
            return None, model, paths
        if np.allclose(found.mechanism.parameters, model.parameters, rtol=1e-9, atol=1e-12):
            return found, model, [*paths, beside]
    return None, model, paths


def rows_seen(found: Estimate, table: Measurements) -> list[str]:
    """The numbers of those rows of a table that a calibration was fitted to.

    Also if the table has them rounded, as programs export them: then most of its rows are.
    """
    known = set(row_digests(found.measurements))
    again = np.array([digest in known for digest in row_digests(table)], dtype=bool)
    if not again.any():
        rounded = _rounded_of(found, table)
        again = rounded if rounded.sum() > len(rounded) / 2 else again
    return [str(row) for row in table.row_numbers[again]]


def _rounded_of(found: Estimate, table: Measurements) -> NDArray[np.bool_]:
    """Which rows are some of the calibration, to as many digits as the table's columns have.

    A quaternion is normalised when it is read, and has no digits of its own: it is left out.
    """
    space = found.mechanism.space
    kept = space.size if space.has_quaternion else space.coordinates
    rows, known = (
        np.hstack([each.poses[:, :kept], each.readings]) for each in (table, found.measurements)
    )
    again = np.zeros(len(rows), dtype=bool)
    seen = np.isfinite(rows[:, : space.size]).all(axis=1)
    if not (space.moves and seen.any()):
        return again
    steps = np.array([_step_of(column[np.isfinite(column)]) for column in rows.T])
    for place in np.flatnonzero(seen):
        near = np.abs(known - rows[place]) <= steps * (0.5 + _EXACT)
        missing = np.isnan(rows[place]) & np.isnan(known)
        again[place] = bool((near | missing).all(axis=1).any())
    return again


def _step_of(values: Array) -> float:
    """Of the last digit that a column was written with, in some unit; of full numbers next to 0."""
    for unit in _UNITS:
        for digits in range(_DIGITS):
            off = np.abs(values / unit - np.round(values / unit, digits))
            if (off <= _EXACT * np.maximum(np.abs(values / unit), 10.0**-digits)).all():
                return float(unit * 10.0**-digits)
    return float(_EXACT * np.abs(values).max(initial=1.0))


def row_digests(measured: Measurements) -> list[str]:
    """Of each row's pose and readings, to nine digits, as other units round them."""
    rows = np.hstack([measured.poses, measured.readings])
    return [" ".join(f"{value:.9e}" for value in row) for row in rows]
