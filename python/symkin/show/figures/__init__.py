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
from typing import Any

from symkin.present import asker


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


def _without_manual() -> None:
    """Keep matplotlib from documenting all properties of its artists as it is imported.

    That is a third of its import, and nobody reads it in a command. Where matplotlib has other
    names for it, this does nothing.
    """
    artists: Any = importlib.import_module("matplotlib.artist")
    artists.kwdoc = lambda _: ""
    artists.Artist._update_set_signature_and_docstring = classmethod(lambda _: None)


if sys.modules.get("matplotlib") is None:
    _import_matplotlib()
    if asker() == "command":
        _without_manual()

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
