# SPDX-License-Identifier: MIT
"""The report as one HTML file that needs no other, and its figures as PNG files."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import jinja2
from markupsafe import Markup, escape

from symkin.comparison import EstimatorFigures, expected
from symkin.evaluation import Evaluation
from symkin.identification import CrossValidation, Identification
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import expected_accuracy
from symkin.outcome import closure_residual
from symkin.pipeline import ProtocolResult
from symkin.report.content import Image, Section, Summary
from symkin.report.sections.accuracy import measured_accuracy_section, simulated_accuracy_section
from symkin.report.sections.identification import identification_section
from symkin.report.sections.mechanism import mechanism_section
from symkin.report.sections.observability import observability_section
from symkin.report.sections.plan import plan_section
from symkin.report.sections.summary import identification_summary, protocol_summary
from symkin.report.sections.symmetry import symmetry_section
from symkin.report.sections.workspace import measured_poses_section, workspace_section

__all__ = ["write_identification_report", "write_report"]

_TEMPLATES = Path(__file__).parent / "templates"


def write_report(
    result: ProtocolResult,
    folder: str | os.PathLike[str],
    comparison: Sequence[EstimatorFigures] = (),
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

    Returns
    -------
    Path
        The HTML file.
    """
    nominal, poses = result.nominal, result.candidates.poses
    foreseen = expected(result, result.identification)
    sets = [result.plan.poses[result.plan.rows_of(leg)] for leg in range(len(nominal.legs))]
    sections = [
        mechanism_section(nominal, poses[:1]),
        symmetry_section(nominal),
        workspace_section(nominal, result.candidates, result.plan),
        plan_section(nominal, result.plan, result.simulation),
        observability_section(nominal, sets, symmetric=True),
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
    return _write(protocol_summary(result, foreseen), sections, Path(folder))


def write_identification_report(
    nominal: Mechanism,
    measurements: Measurements,
    identification: Identification,
    before: Evaluation | None,
    after: Evaluation | None,
    folder: str | os.PathLike[str],
    cross_validation: CrossValidation | None = None,
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
    return _write(summary, sections, Path(folder))


def _write(summary: Summary, sections: Sequence[Section], folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for section in sections:
        for figure in section.images:
            (folder / f"{figure.name}.png").write_bytes(figure.png)
    path = folder / "report.html"
    path.write_text(_page(summary, sections), encoding="utf-8")
    return path


def _page(summary: Summary, sections: Sequence[Section]) -> str:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["image"] = lambda part: isinstance(part, Image)
    environment.filters["symbols"] = _symbols
    template = environment.get_template("report.html")
    return template.render(summary=summary, sections=sections, version=_version())


def _symbols(text: str) -> Markup:
    """Set the subscripts of symbols such as ``G_M``; names such as ``base_radius`` stay."""
    return Markup(re.sub(r"\b([A-Z])_(\w+)", r"\1<sub>\2</sub>", str(escape(text))))


def _version() -> str:
    try:
        return metadata.version("symkin")
    except metadata.PackageNotFoundError:  # run from the source tree
        return ""
