# SPDX-License-Identifier: MIT
"""Results of a run as JSON: versioned, and the same bytes for the same results."""

from __future__ import annotations

import json
import os
import reprlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symkin.errors import ResultsError
from symkin.options import checks
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import file_bytes, kind_of_file
from symkin.values import plain

SCHEMA_VERSION = 2


def results_text(results: Mapping[str, Any]) -> str:
    """Return results as JSON text.

    Arrays become lists, dataclasses objects, NaN and infinities null (JSON has neither). Keys keep
    the order in which they were given, below ``"schema"``.

    Raises
    ------
    ResultsError
        If a value has no JSON form, naming its key.
    """
    document = {"schema": SCHEMA_VERSION, **plain(results)}
    text = json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    # A file's name may have bytes that are no character: JSON has an escape for them.
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def write_results(
    results: Mapping[str, Any], path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write results as a JSON file; see `results_text`.

    A file that exists is replaced only with `overwrite`.
    """
    text = results_text(results)
    with OutputFiles(overwrite=overwrite) as outputs:
        outputs.file(Path(path)).write_text(text, encoding="utf-8", newline="\n")


@checks()
def read_results(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a results file as plain dictionaries and lists, without ``"schema"``.

    Returns
    -------
    dict

    Raises
    ------
    ResultsError
        If the file is missing, is not JSON, or is of another version.
    """
    path = Path(path)
    data = file_bytes(path, lambda message: ResultsError(f"{path}: {message}"))
    try:
        document: Any = json.loads(data)
    except json.JSONDecodeError as error:
        other = kind_of_file(path)
        if other and path.suffix.lower() != ".json":
            raise ResultsError(
                f"{path}: is {other}; expected a folder that a command wrote with --out, or the "
                f"JSON file in it{_beside(path)}"
            ) from error
        raise ResultsError(f"{path}:{error.lineno}: is not valid JSON: {error.msg}") from error
    except UnicodeDecodeError as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error
    except (ValueError, RecursionError) as error:  # integers of many digits, lists in lists
        raise ResultsError(f"{path}: is not a results file: {error}") from error
    version = document.get("schema") if isinstance(document, dict) else None
    if version != SCHEMA_VERSION or isinstance(version, bool | float):
        raise ResultsError(
            f"{path}: is not a results file of version {SCHEMA_VERSION}: its schema is "
            f"{reprlib.repr(version)}{_remedy(version)}"
        )
    return {name: value for name, value in document.items() if name != "schema"}


def _beside(path: Path) -> str:
    """Where the result of a folder is, of which another file was given; after a sentence."""
    return f'; did you mean "{path.parent}"?' if (path.parent / "results.json").is_file() else ""


def _remedy(version: object) -> str:
    """What to do about a file of another version."""
    if isinstance(version, bool) or not isinstance(version, int):
        return ""
    if version > SCHEMA_VERSION:
        return ", of a newer symkin; update symkin to read it"
    return ", of an older symkin; run the command again that wrote it"
