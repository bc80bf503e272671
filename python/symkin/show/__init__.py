# SPDX-License-Identifier: MIT
"""What results say: one page each, rendered as text and as HTML, with its figures.

`PAGES` and `SUMMARIES` are all of them; importing this package tells `symkin.present`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from symkin import present
from symkin.acceptance import Acceptance, Comparison
from symkin.analysis.alignment import Alignment
from symkin.analysis.checks import CheckResult
from symkin.analysis.conditions import Conditions
from symkin.analysis.evaluation import Evaluation
from symkin.analysis.observability import Observability
from symkin.analysis.workspace import WorkspaceSample
from symkin.analysis.workspace.study import WorkspaceStudy
from symkin.data.measurements import Measurements
from symkin.estimate.cross_validation import CrossValidation
from symkin.estimate.estimate import Estimate
from symkin.estimate.fleet import Fleet
from symkin.estimate.robot_symmetry import RobotSymmetry
from symkin.model.mechanism import Mechanism
from symkin.model.symmetry.comparison import SymmetryComparison
from symkin.model.symmetry.groups import DetectedSymmetry
from symkin.model.symmetry.pairs import SymmetryPairs
from symkin.pipeline import ProtocolResult
from symkin.planning.plan import Plan
from symkin.planning.prediction import NeededPoses, PoseCountCurve
from symkin.planning.simulation import Simulation
from symkin.show.acceptance import acceptance_page, comparison_of_calibrations_page
from symkin.show.check import check_page, comparison_page, conditions_page, detection_page
from symkin.show.estimate import estimate_page, estimate_summary
from symkin.show.evaluation import cross_validation_page, evaluation_page
from symkin.show.measurements import alignment_page, measurements_page, simulation_page
from symkin.show.mechanism import mechanism_html
from symkin.show.observability import observability_page
from symkin.show.plan import needed_poses_page, plan_page, pose_count_page
from symkin.show.run import fleet_page, run_page
from symkin.show.study import cost_page, study_page
from symkin.show.symmetry import pairs_page, robot_symmetry_page
from symkin.show.workspace import sample_page, workspace_page
from symkin.study.cost import CostResult
from symkin.study.result import StudyResult

PAGES: dict[type, Callable[[Any], present.Page]] = {
    Acceptance: acceptance_page,
    Alignment: alignment_page,
    CheckResult: check_page,
    Comparison: comparison_of_calibrations_page,
    Conditions: conditions_page,
    CostResult: cost_page,
    CrossValidation: cross_validation_page,
    DetectedSymmetry: detection_page,
    Estimate: estimate_page,
    Evaluation: evaluation_page,
    Fleet: fleet_page,
    Measurements: measurements_page,
    NeededPoses: needed_poses_page,
    Observability: observability_page,
    Plan: plan_page,
    PoseCountCurve: pose_count_page,
    ProtocolResult: run_page,
    RobotSymmetry: robot_symmetry_page,
    Simulation: simulation_page,
    StudyResult: study_page,
    SymmetryComparison: comparison_page,
    SymmetryPairs: pairs_page,
    WorkspaceSample: sample_page,
    WorkspaceStudy: workspace_page,
}

# The top of a page, with the sections that the command line has tables of; of what takes long to
# tell in full.
SUMMARIES: dict[type, Callable[[Any], present.Page]] = {Estimate: estimate_summary}

for kind, page in PAGES.items():
    present.page_of.register(kind, page)
for kind, summary in SUMMARIES.items():
    present.summary_of.register(kind, summary)
present.notebook_of.register(Mechanism, mechanism_html)
