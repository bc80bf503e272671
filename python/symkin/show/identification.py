# SPDX-License-Identifier: MIT
"""What was identified, from how well the measurements fit to what to do next."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.evaluation import AlignedErrors, Evaluation
from symkin.errors import named_legs
from symkin.estimate.cross_validation import CrossValidation
from symkin.estimate.fit import LegFit
from symkin.estimate.identification import Identification
from symkin.estimate.joint import JointIdentification
from symkin.model.mechanism import Mechanism
from symkin.present import Group, Headline, Image, Page, Section, Table, Verdict
from symkin.show.check import symmetry_section
from symkin.show.evaluation import (
    ALIGNED,
    before_and_after,
    error_figures,
    error_table,
    errors_in_words,
    left_out,
)
from symkin.show.images import plotted
from symkin.show.measurements import measured_poses_section
from symkin.show.mechanism import mechanism_section
from symkin.show.observability import observability_section
from symkin.show.wording import (
    NONE,
    became,
    chain_subtitle,
    decimals_of,
    fixed,
    milli,
    plural,
    quoted,
    ratio,
    significant,
    sources,
)

_INTERVAL = 1.96  # standard deviations: holds 95% of normal errors
_SHOWN_ROWS = 8
_WORST_ROWS = 5
# Where standard deviations come from.
EXPLAINED = "from the declared noise, which explains the residuals"
SCALED_UP = (
    "from the declared noise, scaled up by the root of chi-square per degree of freedom, since the "
    "residuals are larger than it explains"
)
_SUSPECTS = {
    "sensor_curvature": "square of the reading",
    "sensor_eccentricity": "period of a turn in the reading",
    "geometry": "coordinates of the pose and their squares",
    "order": "likeness of neighbours in the order of measuring",
    "legs": "likeness of two legs",
    "estimators": "disagreement of implicit and joint",
}


def identification_page(found: Identification) -> Page:
    """Tell an identification from measurements."""
    nominal, measurements = found.nominal, found.measurements
    sets = [measurements.poses[fit.rows] for fit in found.legs]
    sections = [
        parameter_section(found),
        _accuracy_section(found),
        measured_poses_section(nominal, measurements),
        observability_section(nominal, sets, symmetric=False),
        symmetry_section(nominal),
        mechanism_section(nominal, measurements.poses),
    ]
    return dataclasses.replace(identification_summary(found), sections=sections)


def identification_summary(found: Identification) -> Page:
    """Tell the answer, and whether to trust it."""
    nominal = found.nominal
    headlines, paragraphs = _achieved(found)
    verdict, words = judgement(found)
    return Page(
        title=f"{nominal.name}: identification from measurements",
        subtitle=chain_subtitle(nominal),
        headlines=headlines,
        verdict=verdict,
        judgement=words,
        doubts=found.doubts,
        notes=found.notes,
        paragraphs=[_done(found), *paragraphs],
        next_step=next_step(
            found,
            "`symkin check` shows what the mechanism expects.",
            "poses are",
            "on poses measured anew: symkin evaluate calibrated.toml --measurements FILE.",
        ),
        inputs=sources(nominal.source, found.measurements.source),
    )


def judgement(found: Identification | JointIdentification) -> tuple[Verdict, str]:
    """Whether an estimate can be trusted, for the eye and in words."""
    if not found.converged:
        return "bad", f"Not converged: {found.failure}."
    if found.doubts:
        return "doubtful", "Converged, with doubts."
    return "good", "Converged; nothing speaks against the estimate."


def parameter_section(found: Identification, actual: Mechanism | None = None) -> Section:
    """Give the parameters with their uncertainty, compared with the truth where it is known."""
    paragraphs = [f"Standard deviations follow {_origin_of_deviations(found)}."]
    parts: list[Table | Image] = [_parameter_table(found, actual)]
    if actual is not None:
        errors = _in_deviations(found, actual)
        paragraphs.append(_coverage(errors))
        parts.append(
            Image(
                "parameter_errors",
                "Errors of all identified parameters in standard deviations, with the 95% "
                "interval.",
                "Errors of the identified parameters, each in its own standard deviations.",
                plotted("parameter_errors", found, actual),
            )
        )
    parts += [
        _worst_rows(found, brief=actual is None),
        _fit_table(found, brief=actual is None),
        _test_table(found),
        _correlation_table(found),
        Image(
            "residuals",
            "Closure of every leg at every measured pose.",
            "What the identified parameters leave of the closures, at every pose of every leg.",
            plotted("residuals", found.measurements, found),
        ),
        Image(
            "dependence",
            "Closures of every leg against the variable that they depend on most.",
            "The same against what they depend on most: the reading, a coordinate of the pose or "
            "the order of measuring. The line is a parabola; noise alone makes it explain a few "
            "percent.",
            plotted("dependence", found.measurements, found),
        ),
    ]
    return Section("identification", "Identified parameters", paragraphs, parts)


def _done(found: Identification) -> str:
    measurements, nominal = found.measurements, found.nominal
    source = f" ({measurements.source_name})" if measurements.source else ""
    poses = len(measurements.poses)
    return (
        f"{plural(poses, 'measured pose')}{source} {'was' if poses == 1 else 'were'} used to "
        f"identify the {int(nominal.has_parameter.sum())} parameters of "
        f"{plural(len(nominal.legs), 'leg')} with the estimator {quoted(found.estimator)}."
    )


def _achieved(found: Identification) -> tuple[list[Headline], list[str]]:
    """The errors before and after, as headlines and in words."""
    before, after, validation = found.before, found.after, found.cross_validation
    unit = found.nominal.space.closure_unit
    words = (
        f"The legs miss closing by {milli(found.nominal_residual_rms, unit)} (root mean square) "
        f"with the nominal parameters, and by {milli(found.residual_rms, unit)} with the "
        "identified ones."
    )
    if validation is not None:
        words += (
            " At poses that the identification did not see they miss by "
            f"{milli(validation.residual_rms, unit)} ({validation.name})."
        )
        if not validation.converged:
            words += " Not every identification of the cross-validation converged."
    closure = closure_headline(found)
    if before is None or after is None:
        return [closure], [words]
    missed = [_missed(before, after, validation), *left_out({"before": before, "after": after})]
    return [*_measured_headlines(before, after), closure], [*missed, words]


def closure_headline(found: Identification | JointIdentification) -> Headline:
    """By how much the legs miss closing, before and after, and at poses that were not seen."""
    unit, validation = found.nominal.space.closure_unit, found.cross_validation
    remark = ratio(found.nominal_residual_rms, found.residual_rms)
    if validation is not None:
        remark += f"; {milli(validation.residual_rms, unit)} in cross-validation"
    value = became(found.nominal_residual_rms, found.residual_rms, unit)
    return "Closure of the legs, root mean square", value, remark


def _measured_headlines(before: Evaluation, after: Evaluation) -> list[Headline]:
    """Errors of aligned frames, and beside them those as they are."""
    raw = before_and_after(before, after, after)
    if before.aligned is None or after.aligned is None:
        return raw
    aligned = before_and_after(before.aligned, after.aligned, after)
    return [
        (f"{label}, frames aligned", value, f"{remark}; {as_it_is} without alignment")
        for (label, value, remark), (_, as_it_is, _) in zip(aligned, raw, strict=True)
    ]


def _missed(before: Evaluation, after: Evaluation, validation: CrossValidation | None) -> str:
    def missed(old: Evaluation | AlignedErrors, new: Evaluation | AlignedErrors) -> str:
        return (
            f"by {errors_in_words(after, old)} (root mean square) with the nominal parameters, "
            f"and by {errors_in_words(after, new)} with the identified ones"
        )

    text = f"The forward kinematics misses the measured poses {missed(before, after)}."
    if before.aligned is not None and after.aligned is not None:
        text = (
            "After the best constant motions of base frame and tool frame, which need no "
            "calibration of the legs, the forward kinematics misses the measured poses "
            f"{missed(before.aligned, after.aligned)}. As it is, it misses them "
            f"{missed(before, after)}."
        )
    if validation is not None and validation.evaluation is not None:
        text += (
            " Poses that the identification did not see are missed by "
            f"{errors_in_words(after, validation.evaluation)}."
        )
    return text


def next_step(
    found: Identification | JointIdentification, advice: str, predicted: str, where: str
) -> str:
    """What to do now: with `advice` if it did not converge; else what to predict or evaluate."""
    if not found.converged:
        return (
            "look for what keeps the estimate from converging: units, frames, signs, the order of "
            f"the legs, the working mode; {advice}"
        )
    if found.doubts:
        return "settle the doubts, beginning with the first, and identify again."
    if found.cross_validation is None:
        return (
            f"see how well {predicted} predicted that the fit did not see: identify with "
            "--cross-validate 5."
        )
    return f"let the controller use the calibrated mechanism, and evaluate it {where}"


def _accuracy_section(found: Identification) -> Section:
    """Compare measured poses with those that the models calculate from the readings."""
    before, after = found.before, found.after
    if before is None or after is None:
        text = (
            "No end-effector error: at no measured pose are there readings of all legs that both "
            "the nominal and the calibrated mechanism can take."
        )
        return Section("accuracy", "Errors", [text], [_closure_table(found)])
    paragraph = (
        "The error is the distance between the measured pose and the one that the nominal (before) "
        "or the calibrated (after) forward kinematics gives for the measured readings. It contains "
        f"the noise of the measurements. {quoted('Expected')} is what the uncertainty of the "
        "identified parameters adds at these poses by itself, to first order. " + ALIGNED
    )
    table = error_table(
        {"Before": before, "After": after}, found.expected_accuracy(), found.cross_validation
    )
    parts: list[Table | Image] = [table, _closure_table(found), *error_figures(before, after)]
    return Section("accuracy", "End-effector error", [paragraph], parts)


def _closure_table(found: Identification) -> Table:
    validation, unit = found.cross_validation, found.nominal.space.closure_unit
    rows = [
        ("nominal", milli(found.nominal_residual_rms, unit), NONE),
        ("calibrated", milli(found.residual_rms, unit), milli(found.residual_max, unit)),
    ]
    if validation is not None:
        label = f"{validation.name} (poses that the fit did not see)"
        rms, largest = validation.residual_rms, validation.residual_max
        rows.append((label, milli(rms, unit), milli(largest, unit)))
    columns = ("Parameters", "Root mean square", "Maximum")
    return Table("Closure residual of all legs", columns, [Group(rows)], brief=True)


def _origin_of_deviations(found: Identification) -> str:
    if found.options.loss != "none":
        return "from the residuals that the loss keeps; their errors follow Student's t"
    if not any(fit.unexplained for fit in found.goodness):
        return EXPLAINED
    if found.estimator == "joint":
        return SCALED_UP
    return "from the residuals, since these are larger than the declared noise explains"


def _in_deviations(found: Identification, actual: Mechanism) -> NDArray[np.float64]:
    """Error of each parameter over its standard deviation, shape (legs, p); NaN without one."""
    errors, deviations = found.mechanism.parameters - actual.parameters, found.deviations
    scaled: NDArray[np.float64] = np.full_like(errors, np.nan)
    np.divide(errors, deviations, out=scaled, where=deviations > 0)
    # Of normal errors, so that the same interval holds 95% of all.
    scaled *= np.array([[_INTERVAL / leg.interval] for leg in found.legs])
    return scaled


def _coverage(errors: NDArray[np.float64]) -> str:
    known = errors[np.isfinite(errors)]
    inside = np.sum(np.abs(known) <= _INTERVAL)
    return (
        f"The 95% interval of {inside} of {known.size} parameters holds the true value; "
        f"{significant(0.95 * known.size)} can be expected."
    )


def _parameter_table(found: Identification, actual: Mechanism | None) -> Table:
    columns = ["Parameter", "Unit", "Nominal", "Identified", "Standard deviation", "Change"]
    columns += [] if actual is None else ["True", "Error / standard deviation"]
    legs = range(len(found.legs))
    groups = [Group(_parameter_rows(found, actual, leg), f"Leg {leg + 1}") for leg in legs]
    return Table("Identified parameters", columns, groups, brief=actual is None)


def _parameter_rows(found: Identification, actual: Mechanism | None, leg: int) -> list[list[str]]:
    nominal, names = found.nominal, found.nominal.parameter_names
    errors = None if actual is None else _in_deviations(found, actual)
    rows = []
    for i, (name, unit) in enumerate(zip(names, nominal.parameter_units(leg), strict=True)):
        if name not in nominal.legs[leg].parameters:
            continue
        drawn, value = nominal.parameters[leg, i], found.mechanism.parameters[leg, i]
        deviation = float(found.deviations[leg, i])
        decimals = decimals_of(deviation)
        row = [name, unit, fixed(drawn, decimals), fixed(value, decimals)]
        change = _change(value - drawn, drawn, unit, deviation)
        row += [significant(deviation, 2), change if nominal.is_estimated[leg, i] else "held"]
        if actual is not None and errors is not None:
            row += [fixed(actual.parameters[leg, i], decimals), fixed(errors[leg, i], 2)]
        rows.append(row)
    return rows


def _change(change: float, drawn: float, unit: str, deviation: float) -> str:
    """A change from the drawing as a person says it: in mm, degrees, or percent of a gain."""
    in_words = {"m": (1e3, " mm"), "rad": (180 / np.pi, "\N{DEGREE SIGN}")}
    factor, name = in_words.get(unit, (100 / abs(drawn) if drawn else 1.0, " %"))
    text = fixed(factor * change, decimals_of(factor * deviation, 3))
    return f"{'+' if change > 0 else ''}{text}{name}"


def _worst_rows(found: Identification, brief: bool) -> Table:
    """The rows that fit worst, whether that is suspicious or not."""
    student = np.nan_to_num(found.diagnosis.student)
    numbers, unit = found.measurements.row_numbers, found.nominal.space.closure_unit
    outliers = {outlier.row for outlier in found.diagnosis.outliers}
    rows = []
    for row in np.argsort(-np.abs(student).max(axis=1), kind="stable")[:_WORST_ROWS].tolist():
        leg = int(np.argmax(np.abs(student[row])))
        fit = found.legs[leg]
        closures = fit.residuals[fit.closure_rows == row]
        closure = milli(float(max(closures, key=abs)), unit) if closures.size else NONE
        said = "does not fit" if row in outliers else "as noise has it"
        rows.append([str(numbers[row]), str(leg + 1), closure, fixed(student[row, leg], 1), said])
    columns = ("Row", "Leg", "Closure", "In deviations", "")
    return Table("Rows that fit worst", columns, [Group(rows)], brief=brief)


def _fit_table(found: Identification, brief: bool) -> Table:
    columns = ["Leg", "Converged", "Iterations", "Poses used", "Rejected as outliers"]
    columns += ["Closure residual, rms", "Chi-square", "Condition number"]
    rows = [
        [
            f"leg {leg}",
            "yes" if fit.converged else f"no: {fit.failure}",
            str(fit.iterations),
            str(len(fit.rows)),
            _rejected(found, fit),
            milli(fit.residual_rms, found.nominal.space.closure_unit),
            significant(fit.chi_square),
            significant(fit.condition),
        ]
        for leg, fit in enumerate(found.legs, 1)
    ]
    caption = "How the legs fit (chi-square per degree of freedom, 1 if the noise is as declared)"
    return Table(caption, columns, [Group(rows)], brief=brief)


def _test_table(found: Identification) -> Table:
    """The most suspicious test of each kind."""
    columns = ("Residuals tested for", "Worst in", "Statistic", "Probability", "Alarm below", "")
    rows = []
    for suspect, words in _SUSPECTS.items():
        tests = [test for test in found.diagnosis.tests if test.suspect == suspect]
        if not tests:
            continue
        worst = min(tests, key=lambda test: (test.p_value, -abs(test.statistic)))
        terms, spare = worst.degrees_of_freedom
        rows.append(
            [
                words + (f" (most {worst.term})" if worst.term else ""),
                "all legs" if len(worst.legs) == len(found.legs) else named_legs(worst.legs),
                f"{worst.statistic:+.2f} standard deviations"
                if suspect in ("order", "legs")
                else f"F({terms}, {spare}) = {significant(worst.statistic)}",
                f"{worst.p_value:.2g}",
                f"{worst.limit:.2g}",
                "found" if worst.alarms else "not found",
            ]
        )
    return Table("What the model may lack", columns, [Group(rows)])


def _rejected(found: Identification, fit: LegFit) -> str:
    if not len(fit.rejected):
        return "none"
    numbers = found.measurements.row_numbers[fit.rejected]
    shown = ", ".join(map(str, numbers[:_SHOWN_ROWS].tolist()))
    more = f" and {len(numbers) - _SHOWN_ROWS} more" if len(numbers) > _SHOWN_ROWS else ""
    return f"{len(numbers)} (row{'s' * (len(numbers) > 1)} {shown}{more})"


def _correlation_table(found: Identification) -> Table:
    """The two parameters of each leg that are told apart worst."""
    names, count = found.nominal.parameter_names, len(found.nominal.parameter_names)
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = found.correlation
    rows: list[Sequence[str]] = []
    for leg in range(len(found.legs)):
        block = correlation[leg * count :, leg * count :][:count, :count]
        lower = np.tril(np.nan_to_num(block), -1)
        i, j = np.unravel_index(np.argmax(np.abs(lower)), lower.shape)
        if lower[i, j]:
            pair = f"{names[j]}, {names[i]}"
            rows.append((f"leg {leg + 1}", pair, fixed(float(lower[i, j]), 3)))
    columns = ("Leg", "Parameters", "Correlation")
    return Table("Parameters that are told apart worst", columns, [Group(rows)], wordy=True)
