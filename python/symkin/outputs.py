# SPDX-License-Identifier: MIT
"""The files of a run and of an identification."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from symkin.documents import measured_document, run_document
from symkin.identification.calibrated import changed_settings
from symkin.identification.comparison import EstimatorFigures
from symkin.identification.estimate import Identification
from symkin.identification.outcome import MeasuredIdentification, closure_residual
from symkin.io.output_files import OutputFiles
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.pipeline import ProtocolResult

__all__ = [
    "IDENTIFICATION_FILES",
    "PLAN_FILES",
    "POSE_COUNT_FILES",
    "RUN_FILES",
    "write_actual",
    "write_identification",
    "write_run",
]

# All that may come out, so that a command can tell before it begins what would be replaced.
IDENTIFICATION_FILES = (
    "calibrated.toml",
    "results.json",
    "report.html",
    "mechanism.png",
    "poses.png",
    "observability.png",
    "residuals.png",
    "dependence.png",
    "error_histogram.png",
    "error_map.png",
)
RUN_FILES = (
    "plan.csv",
    "measurements.csv",
    "actual.toml",
    *IDENTIFICATION_FILES,
    "workspace.png",
    "parameter_errors.png",
)
PLAN_FILES = ("plan.csv", "plan.json", "plan.html")
POSE_COUNT_FILES = ("pose-count.json", "pose-count.html")


def write_run(
    result: ProtocolResult,
    folder: str | os.PathLike[str],
    document: Mapping[str, Any] | None = None,
    comparison: Sequence[EstimatorFigures] = (),
    *,
    overwrite: bool = False,
) -> Path:
    """Write the files of a run.

    They are ``plan.csv``, ``measurements.csv``, ``actual.toml``, ``calibrated.toml``,
    ``results.json``, ``report.html`` and the report's figures.

    Parameters
    ----------
    result : ProtocolResult
        Of `run_protocol`.
    folder : str or path
        Made if it does not exist.
    document : mapping, optional
        What ``results.json`` holds, by default `run_document`.
    comparison : sequence of EstimatorFigures
        Of `compare_estimators`, for the report.
    overwrite : bool
        Whether files that exist may be replaced.

    Returns
    -------
    Path
        The report.
    """
    from symkin.io.measurements import write_measurements
    from symkin.io.plans import write_plan
    from symkin.io.results import write_results
    from symkin.report import write_report

    nominal, simulation = result.nominal, result.simulation
    measurements = simulation.measurements
    document = run_document(result, comparison) if document is None else document
    with OutputFiles(overwrite=overwrite) as outputs:
        target = outputs.folder(Path(folder), *RUN_FILES)
        write_plan(result.plan, target / "plan.csv", nominal)
        write_measurements(measurements, target / "measurements.csv", nominal)
        write_actual(simulation.actual, nominal, target / "actual.toml")
        _write_calibrated(nominal, measurements, result.identification, target / "calibrated.toml")
        write_results(document, target / "results.json")
        report = write_report(result, target, comparison)
    return Path(folder) / report.name


def write_actual(
    actual: Mechanism,
    nominal: Mechanism,
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
) -> None:
    """Write the mechanism file of a simulated robot."""
    from symkin.io.mechanism_writer import save_mechanism

    header = f"Simulated by symkin: {nominal.name} as it may be made within its tolerances."
    save_mechanism(actual, path, header=header, overwrite=overwrite)


def write_identification(
    result: MeasuredIdentification,
    folder: str | os.PathLike[str],
    document: Mapping[str, Any] | None = None,
    *,
    overwrite: bool = False,
) -> Path | None:
    """Write the files of an identification from measurements.

    They are ``calibrated.toml``, ``results.json``, ``report.html`` and the report's figures. The
    arguments and what is returned are as for `write_run`, but there is no report if the models
    cannot be evaluated on the measurements.
    """
    from symkin.io.results import write_results
    from symkin.report import write_identification_report

    nominal, measurements, identification = (
        result.nominal,
        result.measurements,
        result.identification,
    )
    document = measured_document(result) if document is None else document
    with OutputFiles(overwrite=overwrite) as outputs:
        target = outputs.folder(Path(folder), *IDENTIFICATION_FILES)
        _write_calibrated(nominal, measurements, identification, target / "calibrated.toml")
        write_results(document, target / "results.json")
        if result.before is None or result.after is None:
            return None
        report = write_identification_report(
            nominal,
            measurements,
            identification,
            result.before,
            result.after,
            target,
            cross_validation=result.cross_validation,
        )
    return Path(folder) / report.name


def _write_calibrated(
    nominal: Mechanism, measurements: Measurements, identification: Identification, path: Path
) -> None:
    from symkin.io.mechanism_writer import save_mechanism

    origin = measurements.source_name if measurements.source else "simulated measurements"
    header = (
        f"Identified by symkin: {nominal.name}, {len(measurements.poses)} poses ({origin}), "
        f"estimator {identification.estimator}.\n"
        f"Closure residual {closure_residual(nominal, measurements):.3g} m before, "
        f"{identification.residual_rms:.3g} m after (rms); standard deviations are one sigma."
    )
    changes = changed_settings(nominal, identification.mechanism)
    save_mechanism(identification.mechanism, path, header="\n".join([header, *changes]))
