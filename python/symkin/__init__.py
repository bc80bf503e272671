# SPDX-License-Identifier: MIT
"""Kinematic identification (geometric calibration) of symmetric parallel mechanisms.

The flow, each arrow one function::

    load_mechanism -> sample_workspace -> observability_rows -> select_poses -> map_poses
      -> make_plan -> simulate or read_measurements -> identify -> evaluate

`run_protocol` is all of it. Units are metres and radians throughout; poses are arrays with one pose
a row (see `Mechanism`).
"""

from __future__ import annotations

import importlib
import os
from typing import TYPE_CHECKING, Any

# Ceres' messages are not for users: what they are about comes back as results and errors.
os.environ.setdefault("GLOG_minloglevel", "3")

try:
    from symkin import _core as _core
except ModuleNotFoundError as error:
    if error.name != "symkin._core":
        raise
    raise ImportError(
        "symkin's compiled core is missing; build the package with `make` or `pip install .` "
        "from the source directory"
    ) from error

from symkin.chains import ChainInfo, chain_info, chains
from symkin.checks import CheckResult, check_mechanism
from symkin.conditions import Condition, Conditions, check_conditions
from symkin.errors import (
    FailedFitError,
    MeasurementError,
    MechanismError,
    MechanismFileError,
    NotIdentifiableError,
    QuantityError,
    ResultsError,
    SymkinError,
    SymmetryError,
)
from symkin.evaluation import AlignedErrors, Evaluation, evaluate
from symkin.identification import (
    CrossValidation,
    Diagnosis,
    GoodnessOfFit,
    Identification,
    LegFit,
    Outlier,
    ResidualTest,
    cross_validate,
    identify,
)
from symkin.measurements import Measurements
from symkin.mechanism import Leg, Mechanism
from symkin.observability import (
    ExpectedAccuracy,
    Observability,
    analyse_observability,
    error_weight,
    expected_accuracy,
    mechanism_rows,
    observability_rows,
)
from symkin.pipeline import ProtocolResult, run_protocol
from symkin.planning import (
    ChosenPoses,
    Clearance,
    Plan,
    PlanBasis,
    PoseCountCurve,
    make_plan,
    pose_count_curve,
    predict_accuracy,
    travel_length,
)
from symkin.planning.selection import Certificate, LegRows, Selection, select_poses
from symkin.settings import (
    DeclaredSymmetry,
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.simulation import Simulation, disturb, simulate
from symkin.symmetry import (
    DetectedSymmetry,
    NamedGroup,
    ParameterDeviation,
    SymmetryComparison,
    SymmetryElement,
    SymmetryGroup,
    compare_symmetry,
    detect_symmetry,
    leg_carriers,
    map_poses,
)
from symkin.workspace.sample import WorkspaceSample, sample_workspace
from symkin.workspace.study import ElementCheck, WorkspaceStudy, study_workspace

if TYPE_CHECKING:
    from symkin.io.measurements import read_measurements, write_measurements
    from symkin.io.mechanism_file import load_columns, load_mechanism, shipped_mechanisms
    from symkin.io.mechanism_schema import mechanism_schema
    from symkin.io.mechanism_writer import save_mechanism
    from symkin.io.plans import read_plan, read_pose_list, write_plan
    from symkin.io.results import read_results, write_results

__all__ = [
    "AlignedErrors",
    "Certificate",
    "ChainInfo",
    "CheckResult",
    "ChosenPoses",
    "Clearance",
    "Condition",
    "Conditions",
    "CrossValidation",
    "DeclaredSymmetry",
    "DetectedSymmetry",
    "Diagnosis",
    "ElementCheck",
    "Evaluation",
    "ExpectedAccuracy",
    "FailedFitError",
    "GoodnessOfFit",
    "Identification",
    "JointLimits",
    "Leg",
    "LegFit",
    "LegRows",
    "MeasurementColumns",
    "MeasurementError",
    "Measurements",
    "Mechanism",
    "MechanismError",
    "MechanismFileError",
    "NamedGroup",
    "NoiseSettings",
    "NotIdentifiableError",
    "Observability",
    "Outlier",
    "ParameterDeviation",
    "Plan",
    "PlanBasis",
    "PoseCountCurve",
    "ProtocolResult",
    "ProtocolSettings",
    "QuantityError",
    "ResidualTest",
    "ResultsError",
    "Selection",
    "Simulation",
    "SymkinError",
    "SymmetryComparison",
    "SymmetryElement",
    "SymmetryError",
    "SymmetryGroup",
    "Tolerances",
    "WorkspaceSample",
    "WorkspaceSettings",
    "WorkspaceStudy",
    "analyse_observability",
    "chain_info",
    "chains",
    "check_conditions",
    "check_mechanism",
    "compare_symmetry",
    "cross_validate",
    "detect_symmetry",
    "disturb",
    "error_weight",
    "evaluate",
    "expected_accuracy",
    "identify",
    "leg_carriers",
    "load",
    "load_columns",
    "load_mechanism",
    "make_plan",
    "map_poses",
    "mechanism_rows",
    "mechanism_schema",
    "observability_rows",
    "pose_count_curve",
    "predict_accuracy",
    "read_measurements",
    "read_plan",
    "read_pose_list",
    "read_results",
    "run_protocol",
    "sample_workspace",
    "save_mechanism",
    "select_poses",
    "shipped_mechanisms",
    "simulate",
    "study_workspace",
    "travel_length",
    "write_measurements",
    "write_plan",
    "write_results",
]

# What reads and writes files needs libraries that take a while to import, so these names are
# resolved when they are first used.
_FILE_FUNCTIONS = {
    "load_columns": "mechanism_file",
    "load": "mechanism_file",
    "load_mechanism": "mechanism_file",
    "mechanism_schema": "mechanism_schema",
    "read_measurements": "measurements",
    "read_plan": "plans",
    "read_pose_list": "plans",
    "read_results": "results",
    "save_mechanism": "mechanism_writer",
    "shipped_mechanisms": "mechanism_file",
    "write_measurements": "measurements",
    "write_plan": "plans",
    "write_results": "results",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("symkin")
    if name not in _FILE_FUNCTIONS:
        raise AttributeError(f"module 'symkin' has no attribute {name!r}")
    return getattr(importlib.import_module(f"symkin.io.{_FILE_FUNCTIONS[name]}"), name)


def __dir__() -> list[str]:
    """Names for completion, those that are resolved when they are first used too."""
    return sorted({*globals(), *__all__, "__version__"})
