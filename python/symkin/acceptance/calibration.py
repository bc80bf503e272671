# SPDX-License-Identifier: MIT
"""The calibration of a robot, found beside its model, and the rows that it was fitted to."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.acceptance.alike import last_digit, rows_alike
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.estimate import Estimate
from symkin.model.given import as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.pipeline import saved_estimate
from symkin.values import Array

_RESULTS = "results.json"
_EXACT = 1e-9


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


class Again(NamedTuple):
    """Which rows a calibration was fitted to, and whether it is noise that tells."""

    rows: NDArray[np.bool_]
    altered: bool


def rows_seen(found: Estimate, table: Measurements, stated: Array | None = None) -> Again:
    """Those rows of a table that a calibration was fitted to.

    Also if the table has them rounded, as programs export them: then most of its rows are. Also if
    they are altered by less than noise would, that which is `stated`, too; see `rows_alike`.
    """
    known = set(row_digests(found.measurements))
    again = np.array([digest in known for digest in row_digests(table)], dtype=bool)
    altered = False
    if not again.any():
        rounded = _rounded_of(found, table)
        again = rounded if rounded.sum() > len(rounded) / 2 else again
    if not again.any():
        again = rows_alike(found.measurements, table, found.noise, stated)
        altered = True
    return Again(again, altered)


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
    steps = np.array([last_digit(column) for column in rows.T])
    for place in np.flatnonzero(seen):
        near = np.abs(known - rows[place]) <= steps * (0.5 + _EXACT)
        missing = np.isnan(rows[place]) & np.isnan(known)
        again[place] = bool((near | missing).all(axis=1).any())
    return again


def row_digests(measured: Measurements) -> list[str]:
    """Of each row's pose and readings, to nine digits, as other units round them."""
    rows = np.hstack([measured.poses, measured.readings])
    return [" ".join(f"{value:.9e}" for value in row) for row in rows]
