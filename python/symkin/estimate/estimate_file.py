# SPDX-License-Identifier: MIT
"""Estimates in results files, from which they load back."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Any

from symkin.errors import ResultsError
from symkin.estimate.examined import Examined
from symkin.files.mechanism_file import read_mechanism, shipped_mechanisms
from symkin.model.mechanism import Mechanism
from symkin.storage.records import decoded, encoded
from symkin.storage.results_file import read_results

__all__ = ["loaded", "saved"]

_VERSION = 1  # of the fields of an estimate, and of what they hold


def saved(found: Examined) -> dict[str, Any]:
    """Return all fields as plain values: mechanisms, measurements, options and what was found."""
    fields = (each.name for each in dataclasses.fields(found))
    values = {name: getattr(found, name) for name in fields if name != "kept"}
    document = {"version": _VERSION, **encoded(values)}
    for part in ("mechanism", "nominal", "measurements"):
        if document[part].get("source"):
            document[part]["source"] = _portable(Path(document[part]["source"]))
    return document


def _portable(source: Path) -> str:
    """A file as another machine may know it: a shipped name, the way from here, or its name."""
    own, here = source.resolve(), Path.cwd()
    if source.stem in shipped_mechanisms() and read_mechanism(source.stem).source == source:
        return source.stem
    return (own.relative_to(here) if own.is_relative_to(here) else Path(source.name)).as_posix()


def loaded(kind: type[Examined], robot: type[Mechanism], path: str | os.PathLike[str]) -> Any:
    """Read an estimate of a `robot` from its folder or its results file.

    Raises
    ------
    ResultsError
        If the file cannot be read, or has no estimate, or one of another version.
    """
    file = Path(path) / "results.json" if Path(path).is_dir() else Path(path)
    document = dict(read_results(file).get("estimate") or {})
    version = document.pop("version", None)
    if version != _VERSION:
        has = f"that of version {version}" if version else "none"
        raise ResultsError(
            f"{file}: expected an estimate of version {_VERSION}, and it has {has}; identify again "
            "with this version of symkin, which writes what it reads (symkin identify MECHANISM "
            "MEASUREMENTS --out FOLDER)"
        )
    try:
        return decoded(kind, document, {Mechanism: robot})
    except ResultsError as error:
        raise ResultsError(f"{file}: {error}") from error
