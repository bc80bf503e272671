# SPDX-License-Identifier: MIT
"""The reports of a run and of an identification."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path

from symkin.evaluation import Evaluation
from symkin.identification.comparison import EstimatorFigures, expected
from symkin.identification.cross_validation import CrossValidation
from symkin.identification.estimate import Identification
from symkin.identification.outcome import closure_residual
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import expected_accuracy
from symkin.pipeline import ProtocolResult
from symkin.report.html import write_page
from symkin.report.mechanism import mechanism_section
from symkin.report.observability import observability_section
from symkin.report.plan import plan_section
from symkin.report.sections.accuracy import measured_accuracy_section, simulated_accuracy_section
from symkin.report.sections.identification import identification_section
from symkin.report.sections.summary import identification_summary, protocol_summary
from symkin.report.symmetry import symmetry_section
from symkin.report.workspace import measured_poses_section, workspace_section

__all__ = ["write_identification_report", "write_report"]

_PAGE = "report.html"


def write_report(
    result: ProtocolResult,
    folder: str | os.PathLike[str],
    comparison: Sequence[EstimatorFigures] = (),
    *,
    overwrite: bool = False,
) -> Path:
    """Write the report of a run of the protocol.

    Parameters
    ----------
    result : ProtocolResult
        Of `run_protocol`.
    folder : str or path
        For ``report.html`` and the PNG files of its figures; made if it does not exist.
    comparison : sequence of EstimatorFigures
        Of `compare_estimators`; adds a table.
    overwrite : bool
        Whether files that exist may be replaced.

    Returns
    -------
    Path
        The HTML file.
    """
    nominal, poses = result.nominal, result.candidates.poses
    foreseen = expected(result, result.identification)
    plan = result.plan
    sets = plan.leg_poses()
    symmetric = plan.basis is not None and plan.basis.symmetrical
    sections = [
        mechanism_section(nominal, poses[:1]),
        symmetry_section(nominal),
        workspace_section(nominal, result.candidates, plan),
        plan_section(plan, result.simulation),
        observability_section(nominal, sets, symmetric=symmetric, rows=plan.row_kind),
        identification_section(
            nominal,
            result.simulation.measurements,
            result.identification,
            result.simulation.actual,
        ),
        simulated_accuracy_section(
            nominal, poses, result.before, result.after, foreseen, comparison
        ),
    ]
    summary = protocol_summary(result, foreseen)
    return write_page(
        dataclasses.replace(summary, sections=sections), Path(folder) / _PAGE, overwrite=overwrite
    )


def write_identification_report(
    nominal: Mechanism,
    measurements: Measurements,
    identification: Identification,
    before: Evaluation | None,
    after: Evaluation | None,
    folder: str | os.PathLike[str],
    cross_validation: CrossValidation | None = None,
    *,
    overwrite: bool = False,
) -> Path:
    """Write the report of an identification from measurements.

    Parameters
    ----------
    nominal : Mechanism
        From which the identification started.
    measurements : Measurements
        What was measured.
    identification : Identification
        Of `identify`.
    before, after : Evaluation or None
        Of the nominal and the calibrated mechanism on these measurements; None if no pose can be
        evaluated.
    folder : str or path
        For ``report.html`` and the PNG files of its figures; made if it does not exist.
    cross_validation : CrossValidation, optional
        Of `cross_validate`.
    overwrite : bool
        Whether files that exist may be replaced.

    Returns
    -------
    Path
        The HTML file.
    """
    residual_before = closure_residual(nominal, measurements)
    foreseen = expected_accuracy(
        identification.mechanism, measurements.poses, identification.covariance
    )
    sets = [measurements.poses[fit.rows] for fit in identification.legs]
    sections = [
        mechanism_section(nominal, measurements.poses),
        symmetry_section(nominal),
        measured_poses_section(nominal, measurements),
        observability_section(nominal, sets, symmetric=False),
        identification_section(nominal, measurements, identification),
        measured_accuracy_section(
            nominal,
            measurements,
            (before, after),
            foreseen,
            (residual_before, identification, cross_validation),
        ),
    ]
    summary = identification_summary(
        nominal, measurements, identification, before, after, residual_before, cross_validation
    )
    return write_page(
        dataclasses.replace(summary, sections=sections), Path(folder) / _PAGE, overwrite=overwrite
    )
