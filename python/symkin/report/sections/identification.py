# SPDX-License-Identifier: MIT
"""The identified parameters and how well the legs fit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.errors import named_legs
from symkin.identification.estimate import Identification, LegFit
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.plot import (
    dependence_figure,
    parameter_errors_figure,
    residuals_figure,
)
from symkin.plot.parameters import INTERVAL
from symkin.report.content import Group, Image, Section, Table, image
from symkin.report.wording import (
    NONE,
    decimals_of,
    fixed,
    milli,
    plural,
    significant,
)

__all__ = ["identification_section"]

_SHOWN_ROWS = 8


def identification_section(
    nominal: Mechanism,
    measurements: Measurements,
    identification: Identification,
    actual: Mechanism | None = None,
) -> Section:
    """Give the parameters with their uncertainty, compared with the truth where it is known."""
    paragraph = (
        f"{plural(nominal.parameters.size, 'parameter')} of {plural(len(nominal.legs), 'leg')} "
        f"identified from {plural(len(measurements.poses), 'measured pose')} with the estimator "
        f"\N{LEFT DOUBLE QUOTATION MARK}{identification.estimator}\N{RIGHT DOUBLE QUOTATION MARK}. "
        f"Standard deviations follow {_origin_of_deviations(identification)}."
    )
    notes = [f"{note[0].upper()}{note[1:]}." for note in identification.diagnosis.notes]
    residuals = image(
        residuals_figure(measurements, identification),
        "residuals",
        alternative="Closure of every leg at every measured pose.",
        caption="What the identified parameters leave of the closures, at every pose of every leg.",
    )
    dependence = image(
        dependence_figure(measurements, identification),
        "dependence",
        alternative="Closures of every leg against the variable that they depend on most.",
        caption="The same against what they depend on most: the reading, a coordinate of the pose "
        "or the order of measuring. The line is a parabola; noise alone makes it explain a few "
        "percent.",
    )
    left: list[Table | Image] = [_test_table(identification), residuals, dependence]
    parameters = _parameter_table(nominal, identification, actual)
    fits = _fit_table(nominal, measurements, identification)
    if actual is None:
        return Section(
            "identification", "Identification", [paragraph, *notes], [parameters, fits, *left]
        )
    errors = in_sigmas(identification, actual)
    figure = image(
        parameter_errors_figure(nominal.parameter_names, errors),
        "parameter_errors",
        alternative="Errors of all identified parameters in standard deviations, with the 95% "
        "interval.",
        caption="Errors of the identified parameters, each in its own standard deviations.",
    )
    return Section(
        "identification",
        "Identification",
        [paragraph, *notes, _coverage(errors)],
        [parameters, figure, fits, *left],
    )


def _origin_of_deviations(identification: Identification) -> str:
    if not any(fit.unexplained for fit in identification.goodness):
        return "from the declared noise, which explains the residuals"
    if identification.estimator == "joint":
        return (
            "from the declared noise, scaled up by the root of chi-square per degree of freedom, "
            "since the residuals are larger than it explains"
        )
    return "from the residuals, since these are larger than the declared noise explains"


def in_sigmas(identification: Identification, actual: Mechanism) -> NDArray[np.float64]:
    """Error of each parameter over its standard deviation, shape (legs, p); NaN without one."""
    errors = identification.mechanism.parameters - actual.parameters
    deviations = _deviations(identification)
    scaled: NDArray[np.float64] = np.full_like(errors, np.nan)
    return np.divide(errors, deviations, out=scaled, where=deviations > 0)


def _coverage(errors: NDArray[np.float64]) -> str:
    known = errors[np.isfinite(errors)]
    inside = int(np.sum(np.abs(known) <= INTERVAL))
    return (
        f"The 95% interval of {inside} of {known.size} parameters holds the true value; "
        f"{significant(0.95 * known.size)} can be expected."
    )


def _deviations(identification: Identification) -> NDArray[np.float64]:
    calibrated = identification.mechanism
    if calibrated.deviations is None:
        return np.full_like(calibrated.parameters, np.nan)
    return calibrated.deviations


def _parameter_table(
    nominal: Mechanism, identification: Identification, actual: Mechanism | None
) -> Table:
    columns = ["Parameter", "Unit", "Nominal", "Identified", "Standard deviation"]
    if actual is not None:
        columns += ["True", "Error / standard deviation"]
    groups = [
        Group(_parameter_rows(nominal, identification, actual, leg), f"Leg {leg + 1}")
        for leg in range(len(nominal.legs))
    ]
    return Table("Identified parameters", columns, groups)


def _parameter_rows(
    nominal: Mechanism, identification: Identification, actual: Mechanism | None, leg: int
) -> list[list[str]]:
    estimates, deviations = identification.mechanism.parameters, _deviations(identification)
    errors = None if actual is None else in_sigmas(identification, actual)
    rows = []
    for i, (name, unit) in enumerate(
        zip(nominal.parameter_names, nominal.parameter_units, strict=True)
    ):
        decimals = decimals_of(float(deviations[leg, i]))
        row = [
            name,
            unit,
            fixed(nominal.parameters[leg, i], decimals),
            fixed(estimates[leg, i], decimals),
            significant(deviations[leg, i], 2),
        ]
        if actual is not None and errors is not None:
            row += [fixed(actual.parameters[leg, i], decimals), fixed(errors[leg, i], 2)]
        rows.append(row)
    return rows


def _fit_table(
    nominal: Mechanism, measurements: Measurements, identification: Identification
) -> Table:
    columns = (
        "Leg",
        "Converged",
        "Iterations",
        "Poses used",
        "Rejected as outliers",
        "Closure residual, rms",
        "Chi-square per degree of freedom",
        "Condition number",
        "Strongest correlation",
    )
    correlations = _correlations(nominal, identification)
    rows = [
        (
            f"leg {leg}",
            "yes" if fit.converged else f"no: {fit.failure}",
            str(fit.iterations),
            str(len(fit.rows)),
            _rejected(measurements, fit),
            milli(_rms(fit.residuals), "m"),
            significant(fit.chi_square),
            significant(fit.condition),
            correlation,
        )
        for leg, (fit, correlation) in enumerate(
            zip(identification.legs, correlations, strict=True), 1
        )
    ]
    return Table("How the legs fit", columns, [Group(rows)])


_SUSPECTS = {
    "sensor_curvature": "square of the reading",
    "sensor_eccentricity": "period of a turn in the reading",
    "geometry": "coordinates of the pose and their squares",
    "order": "likeness of neighbours in the order of measuring",
    "legs": "likeness of two legs",
    "estimators": "disagreement of implicit and joint",
}


def _test_table(identification: Identification) -> Table:
    """The most suspicious test of each kind."""
    columns = ("Residuals tested for", "Worst in", "Statistic", "Probability", "Alarm below", "")
    rows = []
    for suspect, words in _SUSPECTS.items():
        tests = [test for test in identification.diagnosis.tests if test.suspect == suspect]
        if not tests:
            continue
        worst = min(tests, key=lambda test: (test.p_value, -abs(test.statistic)))
        everywhere = len(worst.legs) == len(identification.legs)
        terms, spare = worst.freedom
        rows.append(
            (
                words + (f" (most {worst.term})" if worst.term else ""),
                "all legs" if everywhere else named_legs(worst.legs),
                f"{worst.statistic:+.2f} standard deviations"
                if suspect in ("order", "legs")
                else f"F({terms}, {spare}) = {significant(worst.statistic)}",
                f"{worst.p_value:.2g}",
                f"{worst.limit:.2g}",
                "found" if worst.alarms else "not found",
            )
        )
    return Table("What the model may lack", columns, [Group(rows)])


def _rejected(measurements: Measurements, fit: LegFit) -> str:
    if not len(fit.rejected):
        return "none"
    numbers = measurements.row_numbers[fit.rejected]
    shown = ", ".join(map(str, numbers[:_SHOWN_ROWS].tolist()))
    more = f" and {len(numbers) - _SHOWN_ROWS} more" if len(numbers) > _SHOWN_ROWS else ""
    return f"{len(numbers)} (row{'s' * (len(numbers) > 1)} {shown}{more})"


def _correlations(nominal: Mechanism, identification: Identification) -> list[str]:
    """The two parameters of each leg that are told apart worst."""
    names, count = nominal.parameter_names, len(nominal.parameter_names)
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = identification.correlation
    texts = []
    for leg in range(len(nominal.legs)):
        block = correlation[leg * count :, leg * count :][:count, :count]
        lower = np.tril(np.nan_to_num(block), -1)
        i, j = np.unravel_index(np.argmax(np.abs(lower)), lower.shape)
        value = float(lower[i, j])
        texts.append(f"{names[j]}, {names[i]}: {fixed(value, 3)}" if value else NONE)
    return texts


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else float("nan")
