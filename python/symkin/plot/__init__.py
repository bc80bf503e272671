# SPDX-License-Identifier: MIT
"""The figures of the reports, each a function.

A function that draws into one axes takes them as ``ax=`` and returns them; one that needs several
panels takes a matplotlib figure or subfigure as ``figure=`` and returns it. By default each makes
a new figure, without pyplot: no window opens, notebooks show what is returned, and
``.figure.savefig("residuals.pdf")`` writes it. `explore` alone makes a view to be turned, with
plotly.
Importing this module imports matplotlib; `symkin` by itself does not.
"""

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

from symkin.plot.drawing import DrawnSymmetry, mechanism  # noqa: E402
from symkin.plot.estimates import (  # noqa: E402
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
from symkin.plot.interactive import explore  # noqa: E402
from symkin.plot.paper import chosen_readings, local_errors, protocol_errors  # noqa: E402
from symkin.plot.studies import (  # noqa: E402
    study_cells,
    study_cost,
    study_curves,
    study_protocols,
)
from symkin.plot.workspaces import active_joints, poses, workspace  # noqa: E402

__all__ = [
    "INTERVAL",
    "DrawnSymmetry",
    "active_joints",
    "chosen_readings",
    "dependence",
    "error_histogram",
    "error_map",
    "explore",
    "local_errors",
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
