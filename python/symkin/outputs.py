# SPDX-License-Identifier: MIT
"""The files of a run and of an identification."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from symkin.check_document import check_document
from symkin.checking import CheckResult
from symkin.comparison import EstimatorFigures
from symkin.documents import measured_document, run_document
from symkin.identification import Identification
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.outcome import MeasuredIdentification, closure_residual
from symkin.pipeline import ProtocolResult

__all__ = [
    "CHECK_FILES",
    "IDENTIFICATION_FILES",
    "RUN_FILES",
    "write_actual",
    "write_check",
    "write_identification",
    "write_run",
]

# What always comes out; a report comes with figures, and may be missing.
CHECK_FILES = ("check.json", "report.html")
IDENTIFICATION_FILES = ("calibrated.toml", "results.json")
RUN_FILES = ("plan.csv", "measurements.csv", "actual.toml", *IDENTIFICATION_FILES)


def write_check(
    result: CheckResult,
    folder: str | os.PathLike[str],
    document: Mapping[str, Any] | None = None,
) -> Path:
    """Write the files of a check: ``check.json``, ``report.html`` and the report's figures.

    Parameters
    ----------
    result : CheckResult
        Of `check_mechanism`.
    folder : str or path
        Made if it does not exist; files in it are replaced.
    document : mapping, optional
        What ``check.json`` holds, by default `check_document`.

    Returns
    -------
    Path
        The report.
    """
    from symkin.files.results import write_results
    from symkin.report.check_report import write_check_report

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    document = check_document(result) if document is None else document
    write_results(document, folder / "check.json")
    return write_check_report(result, folder)


def write_run(
    result: ProtocolResult,
    folder: str | os.PathLike[str],
    document: Mapping[str, Any] | None = None,
    comparison: Sequence[EstimatorFigures] = (),
) -> Path:
    """Write the files of a run.

    They are ``plan.csv``, ``measurements.csv``, ``actual.toml``, ``calibrated.toml``,
    ``results.json``, ``report.html`` and the report's figures.

    Parameters
    ----------
    result : ProtocolResult
        Of `run_protocol`.
    folder : str or path
        Made if it does not exist; files in it are replaced.
    document : mapping, optional
        What ``results.json`` holds, by default `run_document`.
    comparison : sequence of EstimatorFigures
        Of `compare_estimators`, for the report.

    Returns
    -------
    Path
        The report.
    """
    from symkin.files.measurements import write_measurements
    from symkin.files.plan import write_plan
    from symkin.files.results import write_results
    from symkin.report import write_report

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    nominal, simulation = result.nominal, result.simulation
    write_plan(result.plan, folder / "plan.csv", nominal)
    write_measurements(simulation.measurements, folder / "measurements.csv", nominal)
    write_actual(simulation.actual, nominal, folder / "actual.toml")
    _write_calibrated(
        nominal, simulation.measurements, result.identification, folder / "calibrated.toml"
    )
    document = run_document(result, comparison) if document is None else document
    write_results(document, folder / "results.json")
    return write_report(result, folder, comparison)


def write_actual(actual: Mechanism, nominal: Mechanism, path: str | os.PathLike[str]) -> None:
    """Write the mechanism file of a simulated robot."""
    from symkin.files.mechanism_writer import save_mechanism

    header = f"Simulated by symkin: {nominal.name} as it may be made within its tolerances."
    save_mechanism(actual, path, header=header)


def write_identification(
    result: MeasuredIdentification,
    folder: str | os.PathLike[str],
    document: Mapping[str, Any] | None = None,
) -> Path | None:
    """Write the files of an identification from measurements.

    They are ``calibrated.toml``, ``results.json``, ``report.html`` and the report's figures. The
    arguments and what is returned are as for `write_run`, but there is no report if the models
    cannot be evaluated on the measurements.
    """
    from symkin.files.results import write_results
    from symkin.report import write_identification_report

    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    _write_calibrated(
        result.nominal, result.measurements, result.identification, folder / "calibrated.toml"
    )
    document = measured_document(result) if document is None else document
    write_results(document, folder / "results.json")
    if result.before is None or result.after is None:
        return None
    return write_identification_report(
        result.nominal,
        result.measurements,
        result.identification,
        result.before,
        result.after,
        folder,
        cross_validation=result.cross_validation,
    )


def _write_calibrated(
    nominal: Mechanism, measurements: Measurements, identification: Identification, path: Path
) -> None:
    from symkin.files.mechanism_writer import save_mechanism

    origin = measurements.source.name if measurements.source else "simulated measurements"
    header = (
        f"Identified by symkin: {nominal.name}, {len(measurements.poses)} poses ({origin}), "
        f"estimator {identification.estimator}.\n"
        f"Closure residual {closure_residual(nominal, measurements):.3g} m before, "
        f"{identification.residual_rms:.3g} m after (rms); standard deviations are one sigma."
    )
    save_mechanism(identification.mechanism, path, header=header)
