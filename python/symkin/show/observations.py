# SPDX-License-Identifier: MIT
"""How well an estimate explains what was observed, and what else would."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from symkin.analysis.promises import NORMAL_95
from symkin.errors import few, named_legs
from symkin.estimate.estimate import Estimate
from symkin.estimate.found import LegFit
from symkin.estimate.problem import KINDS
from symkin.model.mechanism import Mechanism
from symkin.present import Group, Image, Section, Table
from symkin.show.images import plotted
from symkin.show.theme import MANY
from symkin.show.wording import fixed, milli, quoted, significant
from symkin.values import Array

_BINNED = (
    " Of so many rows bins are shown, by their median and what holds 90% of them, and those rows "
    "that fit worst; residuals.csv, beside the page, has all."
)
_WORST_ROWS, _BRIEF_ROWS = 8, 4
_SHOWN_ROWS = 8
_WIDER = {
    "quadratic": "sensors that bend",
    "eccentric": "sensors that err once a turn",
    "bow": "a bed that is bowed",
    "held": "nothing held or shared",
    "frames": "frames of device and target, the drawing within its tolerances",
}
_SUSPECTS = {
    "sensor_curvature": "square of the reading",
    "sensor_eccentricity": "period of a turn in the reading",
    "geometry": "coordinates of the pose and their squares",
    "order": "likeness of neighbours in the order of measuring",
    "legs": "likeness of two legs",
    "estimators": "disagreement of implicit and joint",
}
_T = (
    f"{quoted('t')} is an estimated error over what it would vary by if the observation was sound: "
    "standard normal. The error if alone wrong is what the other observations say that this one is "
    "off by."
)
_CLOSURES = (
    " Leg by leg an observation is a closure, by how much a leg misses a measured pose at its "
    "reading."
)


def observation_section(found: Estimate, *, brief: bool = True) -> Section:
    """Show what fits how well; `brief` says why it is doubted on the command line."""
    doubted = brief and bool(found.doubts)
    tables = [
        *_worst_rows(found, doubted),
        *_leg_table(found),
        *_kind_table(found),
        *_test_table(found),
        *_corrections(found),
        *_wider_models(found),
        *_models(found, doubted),
    ]
    paragraph = _T + _CLOSURES * _of_closures(found)
    return Section("observations", "Observations", [paragraph], [*tables, *_figures(found)])


def _figures(found: Estimate) -> Iterator[Image]:
    binned = _BINNED if len(found.measurements.poses) > MANY else ""
    yield Image(
        "residuals",
        "Closure of every leg at every measured pose.",
        "What the identified parameters leave of the closures, at every pose of every leg; where "
        "no pose was measured in full, the estimated errors of the readings." + binned,
        plotted("residuals", found),
        details=True,
    )
    yield Image(
        "dependence",
        "Closures of every leg against the variable that they depend on most.",
        "The same against what they depend on most: the reading, a coordinate of the pose or "
        "the order of measuring. The line is a parabola; noise alone makes it explain a few "
        "percent." + binned,
        plotted("dependence", found),
        details=True,
    )
    if np.isfinite(found.rows.t).any():
        yield Image(
            "t_values",
            "Estimated errors of all observations in their standard deviations, row by row.",
            "All observations against what the others say, in standard deviations. The lines are "
            "where one of 1000 sound robots has any, by the size of all but those that are named; "
            "these may draw others beyond them." + binned,
            plotted("t_values", found),
        )


def _worst_rows(found: Estimate, brief: bool) -> list[Table]:
    """The observations that do not fit, and then those that fit worst."""
    rows, space, unit = found.rows, found.nominal.pose_space, found.nominal.reading_unit
    outliers = {(each.row, each.what) for each in found.outliers}
    # Where closures were judged, and not what they are made of, any observation of a pose.
    whole = {each.row for each in found.outliers} if found.legs and not _of_closures(found) else ()
    size = np.abs(np.nan_to_num(rows.t))
    wrong = np.array([
        pose in whole or (pose, rows.what(row, space)) in outliers
        for row, pose in enumerate(rows.pose.tolist())
    ], dtype=bool)  # fmt: skip
    told = []
    for row in np.lexsort((-size, ~wrong))[:_WORST_ROWS].tolist():
        if size[row] == 0:
            continue
        of = rows.unit(row, space, unit)
        number = str(found.measurements.row_numbers[rows.pose[row]])
        error = [milli(rows.residual[row], of), fixed(rows.t[row], 1), milli(rows.blunder[row], of)]
        said = "does not fit" if wrong[row] else "as noise has it"
        told.append([number, rows.what(row, space), *error, said])
    columns = ("Row", "Observation", "Estimated error", "t", "Error if alone wrong", "")
    caption = "Rows that fit worst"
    table = Table(caption, columns, [Group(told)], brief=brief, brief_rows=_BRIEF_ROWS)
    return [table] if told else []


def _of_closures(found: Estimate) -> bool:
    return bool(KINDS.index("closures") in found.rows.kind)


def _leg_table(found: Estimate) -> list[Table]:
    """How the closures of each leg were fitted; none where all was estimated together."""
    ratios = {leg: fit.chi_square_ratio for fit in found.goodness for leg in fit.legs}
    columns = ["Leg", "Converged", "Iterations", "Poses used", "Rejected as outliers"]
    columns += ["Closure residual, rms", "Chi-square", "Condition number"]
    rows = [
        [
            f"leg {leg + 1}",
            "yes" if fit.converged else f"no: {fit.failure}",
            str(fit.iterations),
            str(len(fit.rows)),
            _rejected(found, fit),
            milli(fit.residual_rms, found.nominal.space.closure_unit),
            significant(ratios[leg]),
            significant(fit.condition),
        ]
        for leg, fit in enumerate(found.legs)
    ]
    caption = "How the legs fit (chi-square per degree of freedom, 1 if the noise is as declared)"
    return [Table(caption, columns, [Group(rows)])] if rows else []


def _rejected(found: Estimate, fit: LegFit) -> str:
    if not len(fit.rejected):
        return "none"
    numbers = found.measurements.row_numbers[fit.rejected]
    shown = few(numbers.tolist(), _SHOWN_ROWS)
    return f"{len(numbers)} (row{'s' * (len(numbers) > 1)} {shown})"


def _kind_table(found: Estimate) -> list[Table]:
    rows, space, unit = found.rows, found.nominal.pose_space, found.nominal.reading_unit
    told, validation = [], found.cross_validation
    units = np.array([rows.unit(row, space, unit) for row in range(len(rows.pose))], dtype=object)
    for kind, name in enumerate(KINDS[:-1]):  # of closures the table of the legs tells
        for of in dict.fromkeys(units[rows.kind == kind]):
            own = (rows.kind == kind) & (units == of)
            t = rows.t[own & np.isfinite(rows.t)]
            row = [f"{name}, {of}", str(int(own.sum())), milli(rms(rows.residual[own]), of)]
            row += [significant(rms(t)), significant(np.abs(t).max() if len(t) else math.nan)]
            if validation is not None:
                key = f"{name.replace(' ', '_')}_{of}"
                row.append(milli(validation.observed_rms.get(key, math.nan), of))
            told.append(row)
    columns = ["Observations", "Number", "Estimated error, rms", "t, rms", "t, largest"]
    columns += [] if validation is None else ["Predicted unseen within"]
    caption = "What was observed, and how it fits"
    return [Table(caption, columns, [Group(told)])] if told else []


def _test_table(found: Estimate) -> list[Table]:
    """The most suspicious test of each kind."""
    columns = ("Residuals tested for", "Worst in", "Statistic", "Probability", "Alarm below", "")
    rows = []
    for suspect, words in _SUSPECTS.items():
        tests = [test for test in found.tests if test.suspect == suspect]
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
    return [Table("What the model may lack", columns, [Group(rows)])] if rows else []


def _wider_models(found: Estimate) -> list[Table]:
    """What else was tried, whether it explains more or not."""
    rows = [
        (
            _WIDER[each.what],
            f"F({each.terms}, {each.spare}) = {significant(each.statistic)}",
            f"{each.p_value:.2g}",
            f"{each.limit:.2g}",
            "explains more" if each.alarms else "as chance has it",
        )
        for each in found.alternatives
    ]
    columns = ("Also unknown", "Statistic", "Probability", "Alarm below", "")
    caption = "Wider models of the same observations"
    return [Table(caption, columns, [Group(rows)])] if rows else []


def _models(found: Estimate, brief: bool) -> list[Table]:
    """Which of noise, sensors, frames and geometry explains how much."""
    words = {
        "identified": "as identified",
        "noise": f"noise {significant(found.spread)} times as large as declared",
        **_WIDER,
        "frames alone": "frames alone, the geometry as drawn",
    }
    rows = [
        (
            words[each.what],
            str(each.unknowns),
            f"{significant(each.chi_square, 4)} / {each.degrees_of_freedom}",
            milli(each.unseen_rms, "m"),
        )
        for each in found.models
    ]
    columns = ("Model", "Unknowns", "Chi-square / degrees of freedom", "Closures, unseen poses")
    table = Table("What explains the residuals", columns, [Group(rows)], brief=brief)
    return [table] if rows else []


def _corrections(found: Estimate) -> list[Table]:
    """Mistakes that were tried since something speaks against the estimate."""
    told = [each for each in found.hypotheses if each.degrees_of_freedom > 0][:_WORST_ROWS]
    rows = [
        (
            each.what or "none: as it is stated",
            significant(each.chi_square, 4),
            str(each.degrees_of_freedom),
            "proposed" if each.proposed else "",
        )
        for each in told
    ]
    columns = ("Mistake", "Chi-square", "Degrees of freedom", "")
    caption = "Mistakes that were corrected and refitted, with the tolerances as priors"
    return [Table(caption, columns, [Group(rows)], wordy=True)] if rows else []


def rms(values: Array) -> float:
    """Root mean square; NaN of none."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan


def in_deviations(found: Estimate, actual: Mechanism) -> Array:
    """Error of each parameter over its standard deviation, shape (legs, p); NaN without one."""
    errors, deviations = found.mechanism.parameters - actual.parameters, found.deviations
    scaled: Array = np.full_like(errors, np.nan)
    np.divide(errors, deviations, out=scaled, where=deviations > 0)
    # Of normal errors, so that the same interval holds 95% of all.
    intervals = [leg.interval for leg in found.legs] or [found.interval] * len(scaled)
    return scaled * (NORMAL_95 / np.array(intervals))[:, None]
