# SPDX-License-Identifier: MIT
"""End-effector errors before and after, and what was to be expected."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.evaluation import AlignedErrors, Evaluation
from symkin.identification.comparison import EstimatorFigures
from symkin.identification.cross_validation import CrossValidation
from symkin.identification.estimate import Identification
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import ExpectedAccuracy
from symkin.plot import error_histogram_figure, error_map_figure
from symkin.report.content import Group, Image, Section, Table, image
from symkin.report.wording import NONE, count, milli, ratio
from symkin.workspace.sample import coordinate_names

__all__ = ["comparison_table", "measured_accuracy_section", "simulated_accuracy_section"]

Array = NDArray[np.float64]

_ALIGNED = (
    "A constant error of the base frame or of the tool frame can be taken out by measuring the "
    "frames, without any calibration of the legs. So the table says first what remains after the "
    "best alignment of both, fitted to these poses."
)


def simulated_accuracy_section(
    mechanism: Mechanism,
    poses: Array,
    before: Evaluation,
    after: Evaluation,
    expected: ExpectedAccuracy,
    comparison: Sequence[EstimatorFigures] = (),
) -> Section:
    """Compare the poses that the robot takes with those that it is told to take."""
    paragraph = (
        "Every candidate pose is commanded through the nominal (before) and the calibrated (after) "
        "inverse kinematics; the error is how far the robot ends up from it. "
        "\N{LEFT DOUBLE QUOTATION MARK}Expected\N{RIGHT DOUBLE QUOTATION MARK} is predicted to "
        "first order from the covariance of the identified parameters, without looking at the true "
        "ones; for one robot the error achieved scatters about it. " + _ALIGNED
    )
    tables = [_table(mechanism, before, after, expected)]
    if comparison:
        tables.append(comparison_table(mechanism, comparison))
    figures = _figures(mechanism, poses, before, after, expected)
    return Section("accuracy", "End-effector error", [paragraph], [*tables, *figures])


def measured_accuracy_section(
    mechanism: Mechanism,
    measurements: Measurements,
    evaluations: tuple[Evaluation | None, Evaluation | None],
    expected: ExpectedAccuracy,
    residuals: tuple[float, Identification, CrossValidation | None],
) -> Section:
    """Compare measured poses with those that the models calculate from the readings.

    `evaluations` are those before and after, None if no pose can be evaluated; `residuals` are the
    root mean square of the nominal closures (m), and where the calibrated ones and those of unseen
    poses come from.
    """
    paragraph = (
        "The error is the distance between the measured pose and the one that the nominal (before) "
        "or the calibrated (after) forward kinematics gives for the measured readings. It contains "
        "the noise of the measurements. \N{LEFT DOUBLE QUOTATION MARK}Expected"
        "\N{RIGHT DOUBLE QUOTATION MARK} is what the uncertainty of the identified parameters adds "
        "at these poses by itself, to first order. " + _ALIGNED
    )
    before, after = evaluations
    closures = _closure_table(*residuals)
    if before is None or after is None:
        text = (
            "No end-effector error: at no measured pose are there readings of all legs that both "
            "the nominal and the calibrated mechanism can take."
        )
        return Section("accuracy", "Errors", [text], [closures])
    # Those that `evaluate` uses: it leaves out a row without all readings.
    poses = measurements.poses[np.isfinite(measurements.readings).all(axis=1)]
    tables = [_table(mechanism, before, after, expected, residuals[2]), closures]
    figures = _figures(mechanism, poses, before, after, expected=None)
    return Section("accuracy", "End-effector error", [paragraph], [*tables, *figures])


def _table(
    mechanism: Mechanism,
    before: Evaluation,
    after: Evaluation,
    expected: ExpectedAccuracy,
    validation: CrossValidation | None = None,
) -> Table:
    groups = []
    if before.aligned is not None and after.aligned is not None:
        rows = _error_rows(mechanism, before.aligned, after.aligned, prefix="aligned ")
        groups.append(Group(rows, "After the best alignment of the frames"))
    groups.append(Group(_error_rows(mechanism, before, after, expected), "As it is"))
    if validation is not None and validation.evaluation is not None:
        unseen = validation.evaluation
        rows = _error_rows(mechanism, before, unseen, prefix="unseen ")
        groups.append(Group(rows, f"As it is, {validation.name}"))
    units = ["m", "m", "m", "rad", "rad", "rad"]
    coordinates = zip(
        coordinate_names(mechanism),
        units if mechanism.pose_space == "spatial" else units[1:4],
        before.means,
        after.means,
        strict=False,
    )
    means = [
        (f"mean {name}", milli(old, unit), milli(new, unit), "", "")
        for name, unit, old, new in coordinates
    ]
    groups.append(Group(means, "Mean difference, as it is"))
    poses = [
        (label, *(count(getattr(each, key)) for each in (before, after)), "", of_expected)
        for label, key, of_expected in (
            ("evaluated", "evaluated", count(expected.evaluated)),
            ("failed", "failed", count(expected.failed)),
        )
    ]
    groups.append(Group(poses, "Poses"))
    columns = ("", "Before", "After", "Change", "Expected after")
    return Table("End-effector error", columns, groups)


def _error_rows(
    mechanism: Mechanism,
    before: Evaluation | AlignedErrors,
    after: Evaluation | AlignedErrors,
    expected: ExpectedAccuracy | None = None,
    prefix: str = "",
) -> list[Sequence[str]]:
    kinds = [("position", "m"), ("orientation", "rad")]
    rows: list[Sequence[str]] = []
    for kind, unit in kinds[:1] if mechanism.pose_space == "point" else kinds:
        for figure, name in (("rms", "root mean square"), ("max", "maximum")):
            old, new = (getattr(each, f"{kind}_{figure}") for each in (before, after))
            foreseen = NONE if expected is not None else ""
            if expected is not None and figure == "rms":
                foreseen = milli(getattr(expected, kind), unit)
            cells = (milli(old, unit), milli(new, unit), ratio(old, new), foreseen)
            rows.append((f"{prefix}{kind}, {name}", *cells))
    return rows


def _closure_table(
    nominal_rms: float, identification: Identification, validation: CrossValidation | None
) -> Table:
    rows = [
        ("nominal", milli(nominal_rms, "m"), NONE),
        (
            "calibrated",
            milli(identification.residual_rms, "m"),
            milli(identification.residual_max, "m"),
        ),
    ]
    if validation is not None:
        rows.append(
            (
                f"{validation.name} (poses that the fit did not see)",
                milli(validation.residual_rms, "m"),
                milli(validation.residual_max, "m"),
            )
        )
    columns = ("Parameters", "Root mean square", "Maximum")
    return Table("Closure residual of all legs", columns, [Group(rows)])


def comparison_table(mechanism: Mechanism, comparison: Sequence[EstimatorFigures]) -> Table:
    """What every estimator makes of the same measurements."""
    columns = ["Estimator", "Poses of a leg", "Position, rms", "Expected"]
    turns = mechanism.pose_space != "point"
    if turns:
        columns += ["Orientation, rms", "Expected"]
    rows = []
    for figures in comparison:
        achieved, expected = figures.evaluation, figures.expected
        row = [
            figures.estimator + ("" if figures.converged else " (not converged)"),
            figures.poses,
            milli(achieved.position_rms, "m") if achieved else NONE,
            milli(expected.position, "m") if expected else NONE,
        ]
        if turns:
            row += [
                milli(achieved.orientation_rms, "rad") if achieved else NONE,
                milli(expected.orientation, "rad") if expected else NONE,
            ]
        rows.append(row)
    return Table("Every estimator on the same measurements", columns, [Group(rows)])


def _figures(
    mechanism: Mechanism,
    poses: Array,
    before: Evaluation,
    after: Evaluation,
    expected: ExpectedAccuracy | None,
) -> list[Image]:
    histogram = image(
        error_histogram_figure(before, after, expected),
        "error_histogram",
        alternative="Histograms of the end-effector errors before and after, logarithmic scale.",
        caption="How large the errors are, before and after.",
    )
    columns = {
        "planar": " Columns are bands of the platform angle.",
        "point": "",
        "spatial": " Columns are projections.",
    }[mechanism.pose_space]
    where = image(
        error_map_figure(mechanism.pose_space, poses, before, after),
        "error_map",
        alternative="Maps of the position error over the workspace, before and after.",
        caption=f"Where the position errors are, before and after.{columns} Mind that each state "
        "has its own scale.",
    )
    return [histogram, where]
