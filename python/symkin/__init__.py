# SPDX-License-Identifier: MIT
"""Kinematic identification (geometric calibration) of symmetric parallel mechanisms.

The flow, each arrow one function::

    load -> sample_workspace -> make_plan -> simulate or read_measurements -> identify -> evaluate

`run_protocol` is all of it, and a `Mechanism` has these stages as methods. Units are metres and
radians throughout; poses are arrays with one pose a row (see `Mechanism`). Legs and rows count from
0 in Python, from 1 in files and on the command line.

The modules have more: `symkin.settings`, `symkin.errors`, `symkin.symmetry`, `symkin.workspace`,
`symkin.observability`, `symkin.planning`, `symkin.identification`, `symkin.study`, `symkin.plot`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

try:
    from symkin import _core as _core
except ModuleNotFoundError as error:
    if error.name != "symkin._core":
        raise
    raise ImportError(
        "symkin's compiled core is missing; build the package with `make` or `pip install .` "
        "from the source directory"
    ) from error

# At once, since the function has the name of its module.
from symkin.chains import chain_info, chains

if TYPE_CHECKING:
    from symkin.alignment import align_frames
    from symkin.checks import check_mechanism
    from symkin.errors import SymkinError
    from symkin.evaluation import evaluate
    from symkin.exports import export
    from symkin.identification import cross_validate, identify, identify_many
    from symkin.io.measurements import read_measurements, write_measurements
    from symkin.io.mechanism_file import load, load_columns, load_mechanism, shipped_mechanisms
    from symkin.io.mechanism_schema import mechanism_schema
    from symkin.io.mechanism_writer import save_mechanism
    from symkin.io.plans import read_plan, write_plan
    from symkin.io.results import read_results
    from symkin.measurements import Measurements
    from symkin.mechanism import Leg, Mechanism
    from symkin.pipeline import run_protocol
    from symkin.planning import Plan, make_plan, pose_count_curve, predict_accuracy
    from symkin.planning.selection import select_poses
    from symkin.simulation import simulate
    from symkin.study import run_study
    from symkin.symmetry import compare_symmetry, detect_symmetry
    from symkin.workspace import sample_workspace
    from symkin.workspace.study import study_workspace

__all__ = [
    "Leg",
    "Measurements",
    "Mechanism",
    "Plan",
    "SymkinError",
    "align_frames",
    "chain_info",
    "chains",
    "check_mechanism",
    "compare_symmetry",
    "cross_validate",
    "detect_symmetry",
    "evaluate",
    "export",
    "identify",
    "identify_many",
    "load",
    "load_columns",
    "load_mechanism",
    "make_plan",
    "mechanism_schema",
    "pose_count_curve",
    "predict_accuracy",
    "read_measurements",
    "read_plan",
    "read_results",
    "run_protocol",
    "run_study",
    "sample_workspace",
    "save_mechanism",
    "select_poses",
    "shipped_mechanisms",
    "simulate",
    "study_workspace",
    "write_measurements",
    "write_plan",
]

# Resolved when they are first used, so that nobody waits for what he does not use.
_MODULES = {
    "alignment": ("align_frames",),
    "checks": ("check_mechanism",),
    "errors": ("SymkinError",),
    "evaluation": ("evaluate",),
    "exports": ("export",),
    "identification": ("cross_validate", "identify", "identify_many"),
    "io.measurements": ("read_measurements", "write_measurements"),
    "io.mechanism_file": ("load", "load_columns", "load_mechanism", "shipped_mechanisms"),
    "io.mechanism_schema": ("mechanism_schema",),
    "io.mechanism_writer": ("save_mechanism",),
    "io.plans": ("read_plan", "write_plan"),
    "io.results": ("read_results",),
    "measurements": ("Measurements",),
    "mechanism": ("Leg", "Mechanism"),
    "pipeline": ("run_protocol",),
    "planning": ("Plan", "make_plan", "pose_count_curve", "predict_accuracy"),
    "planning.selection": ("select_poses",),
    "simulation": ("simulate",),
    "study": ("run_study",),
    "symmetry": ("compare_symmetry", "detect_symmetry"),
    "workspace": ("sample_workspace",),
    "workspace.study": ("study_workspace",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}
_ROOMS = (
    "alignment", "checks", "conditions", "errors", "evaluation", "exports", "identification", "io",
    "kinematics", "measurements", "mechanism",
    "observability", "pipeline", "planning", "plot", "poses", "report", "settings", "simulation",
    "study", "symmetry", "workspace",
)  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("symkin")
    if name in _MODULE_OF:
        module = importlib.import_module(f"symkin.{_MODULE_OF[name]}")
        found = globals()[name] = getattr(module, name)
        return found
    if name in _ROOMS:
        return importlib.import_module(f"symkin.{name}")
    raise AttributeError(f"module 'symkin' has no attribute {name!r}")


def __dir__() -> list[str]:
    """Names for completion, those that are resolved when they are first used too."""
    return sorted({*globals(), *__all__, *_ROOMS, "__version__"})
