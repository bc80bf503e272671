# SPDX-License-Identifier: MIT
"""Kinematic identification (geometric calibration) of symmetric parallel mechanisms.

The flow, each arrow one function::

    load -> sample_workspace -> make_plan -> simulate or read_measurements -> identify -> evaluate

`run_protocol` is all of it, and a `Robot`, which `load` returns, has these stages as methods. Units
are metres and radians throughout; poses are arrays with one pose a row (see `Mechanism`). Legs and
rows count from 0 in Python, from 1 in files and on the command line. Wherever a mechanism is asked
for, the path of its file or a shipped name will do, and a file for measurements and plans; what an
argument cannot be is refused as a `SymkinError`, in one sentence.

The rooms have more, each above those that it is made of: `symkin.model` (a mechanism, its settings,
its symmetry), `symkin.data` (measurements), `symkin.files`, `symkin.analysis` (workspace,
observability, evaluation), `symkin.estimate`, `symkin.planning`, `symkin.study`, `symkin.exports`,
`symkin.plot` and `symkin.show`.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import TYPE_CHECKING, Any

# Only looked for: the core brings NumPy, which what needs neither need not wait for.
if importlib.util.find_spec("symkin._core") is None:
    raise ImportError(
        "symkin's compiled core is missing; build the package with `make` or `pip install .` "
        "from the source directory"
    )

if TYPE_CHECKING:
    from symkin.acceptance import accept, compare
    from symkin.analysis.alignment import align_frames
    from symkin.analysis.checks import check_mechanism
    from symkin.analysis.evaluation import evaluate
    from symkin.analysis.workspace import sample_workspace
    from symkin.analysis.workspace.study import study_workspace
    from symkin.data.measurements import Measurements
    from symkin.data.reading import read_measurements, write_measurements
    from symkin.errors import SymkinError
    from symkin.estimate import cross_validate, identify, identify_many
    from symkin.exports import export
    from symkin.files.mechanism_file import load_columns, shipped_mechanisms
    from symkin.files.mechanism_schema import mechanism_schema
    from symkin.files.mechanism_writer import save_mechanism
    from symkin.guided import measure
    from symkin.model.chains import chain_info, chains
    from symkin.model.mechanism import Leg, Mechanism
    from symkin.model.symmetry import compare_symmetry, detect_symmetry
    from symkin.pipeline import run_protocol
    from symkin.planning import Plan, make_plan, pose_count_curve, predict_accuracy
    from symkin.planning.making import plan
    from symkin.planning.plan import write_plan
    from symkin.planning.plan_files import read_plan
    from symkin.planning.selection import select_poses
    from symkin.planning.simulation import simulate
    from symkin.robot import Robot, load, load_mechanism, read_estimate, read_result
    from symkin.storage.results_file import read_results
    from symkin.study import run_study

__all__ = [
    "Leg",
    "Measurements",
    "Mechanism",
    "Plan",
    "Robot",
    "SymkinError",
    "accept",
    "align_frames",
    "chain_info",
    "chains",
    "check_mechanism",
    "compare",
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
    "measure",
    "mechanism_schema",
    "plan",
    "pose_count_curve",
    "predict_accuracy",
    "read_estimate",
    "read_measurements",
    "read_plan",
    "read_result",
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
    "acceptance": ("accept", "compare"),
    "analysis.alignment": ("align_frames",),
    "analysis.checks": ("check_mechanism",),
    "analysis.evaluation": ("evaluate",),
    "analysis.workspace": ("sample_workspace",),
    "analysis.workspace.study": ("study_workspace",),
    "data.measurements": ("Measurements",),
    "data.reading": ("read_measurements", "write_measurements"),
    "errors": ("SymkinError",),
    "estimate": ("cross_validate", "identify", "identify_many"),
    "exports": ("export",),
    "files.mechanism_file": ("load_columns", "shipped_mechanisms"),
    "files.mechanism_schema": ("mechanism_schema",),
    "files.mechanism_writer": ("save_mechanism",),
    "guided": ("measure",),
    "model.chains": ("chain_info", "chains"),
    "model.mechanism": ("Leg", "Mechanism"),
    "model.symmetry": ("compare_symmetry", "detect_symmetry"),
    "pipeline": ("run_protocol",),
    "planning": ("Plan", "make_plan", "pose_count_curve", "predict_accuracy"),
    "planning.making": ("plan",),
    "planning.plan": ("write_plan",),
    "planning.plan_files": ("read_plan",),
    "planning.selection": ("select_poses",),
    "planning.simulation": ("simulate",),
    "robot": ("Robot", "load", "load_mechanism", "read_estimate", "read_result"),
    "storage.results_file": ("read_results",),
    "study": ("run_study",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}
_ROOMS = (
    "acceptance", "analysis", "data", "errors", "estimate", "exports", "files", "guided", "model",
    "pipeline", "planning", "plot", "present", "results", "robot", "show", "storage", "study",
    "values",
)  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("symkin.version").version()
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
