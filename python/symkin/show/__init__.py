# SPDX-License-Identifier: MIT
"""What results say: one page each, rendered as text and as HTML, with its figures.

Each kind of result, by where its class is, has here the function of this room that tells it; both
are loaded when `symkin.present` is asked for the page of one.
"""

from symkin.show import units as units

PAGES = {
    "acceptance.certificate.Acceptance": "acceptance.acceptance_page",
    "acceptance.comparing.Comparison": "acceptance.comparison_of_calibrations_page",
    "analysis.alignment.Alignment": "measurements.alignment_page",
    "analysis.checks.CheckResult": "check.check_page",
    "analysis.conditions.Conditions": "check.conditions_page",
    "analysis.evaluation.Evaluation": "evaluation.evaluation_page",
    "analysis.observability.Observability": "observability.observability_page",
    "analysis.workspace.WorkspaceSample": "workspace.sample_page",
    "analysis.workspace.study.WorkspaceStudy": "workspace.workspace_page",
    "data.measurements.Measurements": "measurements.measurements_page",
    "estimate.cross_validation.CrossValidation": "evaluation.cross_validation_page",
    "estimate.estimate.Estimate": "estimate.estimate_page",
    "estimate.fleet.Fleet": "run.fleet_page",
    "estimate.robot_symmetry.RobotSymmetry": "symmetry.robot_symmetry_page",
    "model.symmetry.comparison.SymmetryComparison": "check.comparison_page",
    "model.symmetry.groups.DetectedSymmetry": "check.detection_page",
    "model.symmetry.pairs.SymmetryPairs": "symmetry.pairs_page",
    "pipeline.ProtocolResult": "run.run_page",
    "planning.plan.Plan": "plan.plan_page",
    "planning.prediction.NeededPoses": "plan.needed_poses_page",
    "planning.prediction.PoseCountCurve": "plan.pose_count_page",
    "planning.simulation.Simulation": "measurements.simulation_page",
    "study.cost.CostResult": "study.cost_page",
    "study.result.StudyResult": "study.study_page",
}

# The top of a page, with the sections that the command line has tables of; of what takes long to
# tell in full.
SUMMARIES = {"estimate.estimate.Estimate": "estimate.estimate_summary"}

NOTEBOOKS = {"model.mechanism.Mechanism": "mechanism.mechanism_html"}
