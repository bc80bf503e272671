# SPDX-License-Identifier: MIT
"""Rows that do not fit the others: poses by their closures, or single observations."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError, few
from symkin.estimate.blunders import ALIKE, limit_of, without, without_blunders, worst_first
from symkin.estimate.evidence.changes import is_noise
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.linear_rows import LinearRows, linear_rows
from symkin.estimate.evidence.residuals import ALARMS, Diagnosed
from symkin.estimate.found import Found, GoodnessOfFit
from symkin.estimate.kept import once
from symkin.estimate.problem import KINDS, Problem, Rows
from symkin.values import Value, field, record

_NAMED = 5
_READINGS = "readings"
_ASIDE = 0.1  # of the rows, if not one


@record
class Outlier(Value):
    """A pose that does not fit the others, or an observation of it.

    Attributes
    ----------
    row : int
        Of the measurements, from 0.
    row_number : int
        Where it stands in their source, from 1; this is what messages and files call its row.
    what : str
        What is furthest off there: ``closure of leg 2``, ``reading of leg 2``, ``x of the pose``.
    leg : int or None
        The leg (from 0) of it, if it is of one.
    student : float
        Its studentised residual.
    p_value : float
        Probability of a pose or observation as far off, before it is one of many.
    size : float
        The error that it has if it alone is wrong, in `unit`; NaN where that is not known.
    unit : str
        Of the observation.
    place : int
        Of a single observation in `Estimate.rows`; -1 of a closure.
    """

    row: int = field(private=True)
    row_number: int
    what: str
    leg: int | None = field(number=True)
    student: float
    p_value: float
    size: float = math.nan
    unit: str = ""
    place: int = field(private=True, default=-1)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        names = {"row_number": "row", "student": "studentised_residual"}
        return {names.get(name, name): value for name, value in super().to_dict().items()}


def outliers_of(found: Found, result: Diagnosed | None) -> tuple[Outlier, ...]:
    """Give poses, or observations, that do not fit the others, the worst first."""
    if not found.legs:
        return blunders_of(found)
    return () if result is None else _closures(found, result)


def _closures(found: Found, result: Diagnosed) -> tuple[Outlier, ...]:
    # Half of the false alarms for poses as a whole, half for single closures.
    rows, core = result
    read = np.isfinite(core.student)
    poses = np.flatnonzero(read.any(axis=1))
    limit_of_pose = ALARMS / 2 / max(len(poses), 1)
    limit_of_closure = ALARMS / 2 / max(int(read.sum()), 1)
    closures = np.where(read, core.student_p, 1.0)
    numbers = found.measurements.row_numbers
    outliers = []
    for pose in poses:
        leg = int(np.argmin(closures[pose]))
        if core.pose_p[pose] < limit_of_pose or closures[pose, leg] < limit_of_closure:
            p_value = float(min(core.pose_p[pose], closures[pose, leg]))
            student, row = float(core.student[pose, leg]), int(rows[pose])
            what = f"closure of leg {leg + 1}"
            outliers.append(Outlier(row, int(numbers[row]), what, leg, student, p_value))
    outliers.sort(key=lambda outlier: (outlier.p_value, -abs(outlier.student)))
    return tuple(_without_each_other(found, outliers, limit_of_pose))


def _without_each_other(found: Found, outliers: list[Outlier], limit: float) -> Iterator[Outlier]:
    """Those poses that do not fit what is left without the worse ones, which they may be due to."""
    rows = _of_poses(found) if len(outliers) > 1 else None
    if rows is None:
        yield from outliers
        return
    every = _places(rows, outliers)
    left = rows.square - rows.drop_without(every)
    scale = max(left / max(rows.spare - int(rows.used[every].sum()), 1), 1.0)
    told, gone = list[Outlier](), 0.0
    for each in outliers:
        drop = rows.drop_without(_places(rows, [*told, each]))
        own = int(rows.used[_places(rows, [each])].sum())
        if _core.chi_square_tail(max(drop - gone, 0.0) / scale, max(own, 1)) < limit:
            told.append(each)
            gone = drop
            yield each


def blunder_limit(found: Found, without: Sequence[Outlier] = ()) -> float:
    """Beyond which t an observation does not fit the others, as one in 1000 sound robots has one.

    By the size of the others: where all residuals are too large, one that is as large as they are
    is no blunder, and one that is far off makes the sum large by itself. `without` those that are
    known to be.
    """
    limit = limit_of(int(np.isfinite(found.rows.t).sum()))
    left = found.chi_square - sum(each.student**2 for each in without)
    others = found.degrees_of_freedom - len(without) - 1
    if others <= 0:
        return limit * found.spread
    # Where t is so many times the root mean square of what it leaves.
    alone = limit * math.sqrt(max(left, 0.0) / (others + limit**2))
    return min(limit * found.spread, max(limit, alone))


class SingleErrors(NamedTuple):
    """Observations without which the others fit better, and how these fit."""

    outliers: tuple[Outlier, ...]
    left: GoodnessOfFit


@once
def single_errors(found: Found) -> SingleErrors | None:
    """Those that do not fit what is left without them; None without any, or where they are many.

    A robust fit finds them, since they may hide each other and make sound ones look wrong, and a
    few sound ones besides: none is told that fits when it alone comes back.
    """
    if (
        found.legs
        or found.options.loss != "none"
        or not worst_first(found.rows, blunder_limit(found))
    ):
        return None
    options, measured = dataclasses.replace(found.options, noise=found.noise), found.measurements
    nearest, most = options.gauge == "nominal", max(int(_ASIDE * len(measured)), 1)
    try:
        problem, fit, _ = Problem.of(found.nominal, measured, options).resolved()
        _, clean, rejected = without_blunders(problem, fit, most)

        def fitted(out: Sequence[tuple[int, str]]) -> _core.JointFit:
            rest = dataclasses.replace(problem, measurements=without(measured, out))
            return rest.fit(nearest=nearest)

        left = GoodnessOfFit.of(clean.goodness)
        spread = math.sqrt(left.chi_square_ratio) if left.unexplained else 1.0
        limit = spread * limit_of(int(np.isfinite(found.rows.t).sum()))
        told, kept = list[Outlier](), list[tuple[int, str]]()
        for pose, what in rejected:
            rows = Rows.of(fitted([each for each in rejected if each[0] != pose]))
            for row in worst_first(rows, limit):
                if rows.pose[row] == pose:
                    told.append(_blunder(found, rows, row, spread))
                    kept.append((pose, what))
        if len(kept) < len(rejected):
            left = GoodnessOfFit.of(fitted(kept).goodness)
    except SymkinError:
        return None
    told.sort(key=lambda each: -abs(each.student))
    return SingleErrors(tuple(told), left) if told else None


def blunders_of(found: Found) -> tuple[Outlier, ...]:
    """Give single observations that do not fit, the worst first; of a pose only the worst."""
    errors = single_errors(found)
    return tuple(_in_turn(found)) if errors is None else errors.outliers


def _in_turn(found: Found) -> Iterator[Outlier]:
    """By the estimate itself."""
    left, spare = found.chi_square, found.degrees_of_freedom
    told = list[Outlier]()
    for place in worst_first(found.rows, 0.0):
        t = float(found.rows.t[place])
        if abs(t) <= blunder_limit(found, told):
            break
        left, spare = left - t**2, spare - 1
        others = math.sqrt(max(left / spare, 1.0)) if spare > 0 else math.inf
        told.append(_blunder(found, found.rows, place, min(found.spread, others)))
        yield told[-1]
        if found.unexplained and left <= found.limit:  # what is left is far off by these alone
            break


def _blunder(found: Found, rows: Rows, row: int, spread: float) -> Outlier:
    """One observation of a fit's rows, as an outlier of the estimate."""
    pose, kind, index = int(rows.pose[row]), rows.kind[row], rows.index[row]
    known, space = found.rows, found.nominal.pose_space
    same = (known.pose == pose) & (known.kind == kind) & (known.index == index)
    t = float(rows.t[row])
    return Outlier(
        row=pose,
        row_number=int(found.measurements.row_numbers[pose]),
        what=rows.what(row, space),
        leg=int(index) if KINDS[kind] == _READINGS else None,
        student=t,
        p_value=2 * NormalDist().cdf(-abs(t) / spread),
        size=float(rows.blunder[row]),
        unit=rows.unit(row, space, found.nominal.reading_unit),
        place=int(np.argmax(same)),
    )


def explain_all(found: Found, outliers: Sequence[Outlier]) -> bool:
    """Whether without a few single observations noise explains the others."""
    many = len(outliers) > max(_ASIDE * len(found.measurements), 1)
    if not outliers or not found.unexplained or many:
        return False
    errors = single_errors(found)
    if errors is not None:
        return not errors.left.unexplained
    rows = _of_poses(found)
    if rows is not None:
        used = int(rows.used[_places(rows, outliers)].sum())
        return is_noise(rows.square - drop_without(found, outliers), rows.spare - used)
    return found.chi_square - drop_without(found, outliers) <= found.limit


def drop_without(found: Found, outliers: Sequence[Outlier]) -> float:
    """What chi-square loses without them."""
    errors = single_errors(found)
    if errors is not None:
        return found.chi_square - errors.left.chi_square
    rows = _of_poses(found)
    if rows is not None:
        return rows.drop_without(_places(rows, outliers))
    return sum(each.student**2 for each in outliers)


def _of_poses(found: Found) -> LinearRows | None:
    """The rows of an estimate of legs, whose outliers are poses."""
    try:
        return linear_rows(found, ()) if found.legs else None
    except SymkinError:
        return None


def _places(rows: LinearRows, outliers: Sequence[Outlier]) -> NDArray[np.intp]:
    return np.flatnonzero(np.isin(rows.order, [each.row for each in outliers]))


def doubts_of_rows(found: Found, outliers: Sequence[Outlier]) -> Iterator[Doubt]:
    """Name the rows that do not fit, and how far they are off."""
    if outliers:
        told = [_off(found.rows, each) if each.place >= 0 else _far(each) for each in outliers]
        named = few(told, _NAMED)
        these = f"row {named} does" if len(told) == 1 else f"rows {named} do"
        worst = outliers[0]
        legs = tuple(sorted({each.leg for each in outliers if each.leg is not None}))
        yield Doubt(
            "rows-unlike",
            legs,
            tuple(each.row_number for each in outliers),
            worst.size if math.isfinite(worst.size) else worst.student,
            worst.p_value,
            figures={"these": these},
        )


def _far(each: Outlier) -> str:
    what = each.what.removeprefix("closure of ")
    return f"{each.row_number} ({what}, {each.student:+.1f} deviations)"


def _off(rows: Rows, each: Outlier) -> str:
    # With one condition any observation of the pose may be to blame.
    same = (rows.pose == each.row) & (np.abs(rows.t) > ALIKE * abs(rows.t[each.place]))
    another = ", or as well another observation of that row" if same.sum() > 1 else ""
    return (
        f"{each.row_number} ({each.what}: off by {each.size:+.3g} {each.unit}, "
        f"{abs(each.student):.3g} deviations{another})"
    )
