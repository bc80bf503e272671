# SPDX-License-Identifier: MIT
"""The figures of the reports, each a function.

A function that draws into one axes takes them as ``ax=`` and returns them; one that needs several
panels takes a matplotlib figure or subfigure as ``figure=`` and returns it. By default each makes
a new figure, without pyplot: no window opens, notebooks show what is returned, and
``.figure.savefig("residuals.pdf")`` writes it. `explore` alone makes a view to be turned, with
plotly.
Importing this module imports matplotlib, which comes with the extra ``symkin[figures]``; `symkin`
by itself does not, and calculates and writes everything but figures without it.
"""

import contextlib
import importlib
import os
import sys


def _import_matplotlib() -> None:
    """Import matplotlib although MPLBACKEND may name what it does not have; figures need none."""
    backend = os.environ.pop("MPLBACKEND", None)
    try:
        matplotlib = importlib.import_module("matplotlib")
    except ModuleNotFoundError as error:
        raise ImportError('figures need matplotlib: pip install "symkin[figures]"') from error
    finally:
        if backend is not None:
            os.environ["MPLBACKEND"] = backend
    if backend is not None:
        with contextlib.suppress(ValueError):
            matplotlib.rcParams["backend"] = backend


if sys.modules.get("matplotlib") is None:
    _import_matplotlib()

from symkin.show.figures.estimates import (  # noqa: E402
    INTERVAL,
    dependence,
    error_histogram,
    error_map,
    observability,
    parameter_errors,
    pose_count,
    residuals,
    t_values,
)
from symkin.show.figures.mechanisms import DrawnSymmetry, explore, mechanism  # noqa: E402
from symkin.show.figures.studies import (  # noqa: E402
    chosen_readings,
    protocol_errors,
    study_cells,
    study_cost,
    study_curves,
    study_protocols,
)
from symkin.show.figures.workspaces import active_joints, bed_points, poses, workspace  # noqa: E402

__all__ = [
    "INTERVAL",
    "DrawnSymmetry",
    "active_joints",
    "bed_points",
    "chosen_readings",
    "dependence",
    "error_histogram",
    "error_map",
    "explore",
    "mechanism",
    "observability",
    "parameter_errors",
    "pose_count",
    "poses",
    "protocol_errors",
    "residuals",
    "study_cells",
    "study_cost",
    "study_curves",
    "study_protocols",
    "t_values",
    "workspace",
]
