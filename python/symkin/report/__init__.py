# SPDX-License-Identifier: MIT
"""The report: one HTML page with tables and figures."""

import contextlib
import importlib
import os
import sys


def _import_matplotlib() -> None:
    """Import matplotlib although MPLBACKEND may name what it does not have; figures need none."""
    backend = os.environ.pop("MPLBACKEND", None)
    if backend is None:
        return
    try:
        matplotlib = importlib.import_module("matplotlib")
    finally:
        os.environ["MPLBACKEND"] = backend
    with contextlib.suppress(ValueError):
        matplotlib.rcParams["backend"] = backend


if "matplotlib" not in sys.modules:
    _import_matplotlib()

from symkin.report.pages import write_identification_report, write_report  # noqa: E402

__all__ = ["write_identification_report", "write_report"]
