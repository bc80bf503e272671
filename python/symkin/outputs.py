# SPDX-License-Identifier: MIT
"""The files of a check."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symkin.check_document import check_document
from symkin.checks.check import CheckResult
from symkin.io.output_files import OutputFiles

__all__ = [
    "CHECK_FILES",
    "PLAN_FILES",
    "POSE_COUNT_FILES",
    "WORKSPACE_FILES",
    "write_check",
]

# All that may come out, so that a command can tell before it begins what would be replaced.
CHECK_FILES = ("check.json", "report.html", "mechanism.png", "observability.png")
PLAN_FILES = (
    "plan.html",
    "plan.json",
    "workspace.png",
    "observability.png",
    "mechanism.png",
)
POSE_COUNT_FILES = ("pose-count.html", "pose-count.json", "pose_count.png")
WORKSPACE_FILES = (
    "workspace.html",
    "workspace.json",
    "constant_orientations.png",
    "active_joints.png",
)


def write_check(
    result: CheckResult,
    folder: str | os.PathLike[str],
    document: Mapping[str, Any] | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write the files of a check: ``check.json``, ``report.html`` and the report's figures.

    Parameters
    ----------
    result : CheckResult
        Of `check_mechanism`.
    folder : str or path
        Made if it does not exist.
    document : mapping, optional
        What ``check.json`` holds, by default `check_document`.
    overwrite : bool
        Whether files that exist may be replaced.

    Returns
    -------
    Path
        The report.
    """
    from symkin.io.results import write_results
    from symkin.report.check_report import write_check_report

    document = check_document(result) if document is None else document
    with OutputFiles(overwrite=overwrite) as outputs:
        target = outputs.folder(Path(folder), *CHECK_FILES)
        write_results(document, target / "check.json")
        report = write_check_report(result, target)
    return Path(folder) / report.name
