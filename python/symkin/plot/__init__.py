# SPDX-License-Identifier: MIT
"""Figures: each function takes data and returns a `matplotlib.figure.Figure`."""

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

from symkin.plot.errors import error_histogram_figure, error_map_figure  # noqa: E402
from symkin.plot.mechanism import mechanism_figure  # noqa: E402
from symkin.plot.mirrors import DrawnSymmetry  # noqa: E402
from symkin.plot.observability import observability_figure  # noqa: E402
from symkin.plot.parameters import parameter_errors_figure  # noqa: E402
from symkin.plot.pose_count import pose_count_figure  # noqa: E402
from symkin.plot.residuals import dependence_figure, residuals_figure  # noqa: E402
from symkin.plot.workspace import poses_figure  # noqa: E402

__all__ = [
    "DrawnSymmetry",
    "dependence_figure",
    "error_histogram_figure",
    "error_map_figure",
    "mechanism_figure",
    "observability_figure",
    "parameter_errors_figure",
    "pose_count_figure",
    "poses_figure",
    "residuals_figure",
]
