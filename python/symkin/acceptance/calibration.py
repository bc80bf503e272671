# SPDX-License-Identifier: MIT
"""The calibration of a robot, found beside its model, and the rows that it was fitted to."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.estimate import Estimate
from symkin.model.given import as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.pipeline import saved_estimate

_RESULTS = "results.json"


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
    """The numbers of those rows of a table that a calibration was fitted to."""
    known = set(row_digests(found.measurements))
    return [
        str(row)
        for row, digest in zip(table.row_numbers, row_digests(table), strict=True)
        if digest in known
    ]


def row_digests(measured: Measurements) -> list[str]:
    """Of each row's pose and readings, to nine digits, as other units round them."""
    rows = np.hstack([measured.poses, measured.readings])
    return [" ".join(f"{value:.9e}" for value in row) for row in rows]
