# SPDX-License-Identifier: MIT
"""What a study of symmetry says: how much asymmetry, joint noise and error are too much.

Asymmetry costs what poses that a symmetry carries from leg to leg are worth less to legs that lack
it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from symkin.planning import Plan
from symkin.planning.selection import LegRows, select_poses
from symkin.study.definition import Cell, StudyDefinition
from symkin.study.mapping import _log_information
from symkin.study.robots import Job
from symkin.study.summaries import CellSummary
from symkin.values import Array, Value, record

__all__ = ["LOSSES", "OFF", "Curve", "asymmetry_curves", "linearity_curves", "reading_curves"]


LOSSES = (0.01, 0.05, 0.10)  # of efficiency, that are asked for
OFF = 0.05  # of a prediction, beyond which linearisation has ended


@record
class Curve(Value):
    """A share that is lost, against what makes it lost.

    Attributes
    ----------
    mechanism : str
        Of which mechanism.
    what : str
        What grows along the curve, and
    of : str
        with which protocol.
    levels : ndarray, shape (k,)
        How much of it, ascending.
    values : ndarray, shape (k,)
        Efficiency, or simulated over predicted error, relative to the first level's.
    errors : ndarray, shape (k,)
        Their standard errors; zero where nothing is random.
    failed : ndarray of int, shape (k,)
        Robots that are not in it.
    """

    mechanism: str
    what: str
    of: str
    levels: Array
    values: Array
    errors: Array
    failed: NDArray[np.intp]

    def reaches(self, loss: float) -> float:
        """Level at which so much is off, between levels by the logarithms; NaN if none is."""
        off = np.abs(self.values - 1)
        beyond = np.flatnonzero(off >= loss)
        if not len(beyond):
            return math.nan
        after = int(beyond[0])
        if after == 0:
            return float(self.levels[0])
        pair = slice(after - 1, after + 1)
        x, y = np.log(self.levels[pair]), off[pair]
        return float(np.exp(np.interp(loss, y, x)))


class Studied(Protocol):
    """What of a study's result the curves are read from."""

    @property
    def definition(self) -> StudyDefinition: ...
    @property
    def job(self) -> Job: ...
    @property
    def cells(self) -> Mapping[str, CellSummary]: ...
    def rows(self, cell: str) -> Mapping[str, NDArray[Any]]:
        """Return the rows of a cell, a robot each."""


def asymmetry_curves(result: Studied) -> tuple[Curve, ...]:
    """Efficiency of mapped poses against the robots' errors, in multiples of the tolerances."""
    curves = []
    for cells in _series(result, "tolerance_level"):
        rows = [result.rows(cell.id)["mapped_efficiency"] for cell in cells]
        good = [each[np.isfinite(each)] for each in rows]
        if not all(len(each) for each in good):
            continue
        curve = _curve(
            cells,
            "tolerance_level",
            np.array([each.mean() for each in good]),
            np.array([each.std() / math.sqrt(len(each)) for each in good]),
            np.array([len(each) - len(left) for each, left in zip(rows, good, strict=True)]),
        )
        # Estimators do not matter to it.
        curve = dataclasses.replace(curve, of=_protocol(cells[0]))
        if curve not in curves:
            curves.append(curve)
    return tuple(curves)


def reading_curves(result: Studied) -> tuple[Curve, ...]:
    """Efficiency of a selection that is not told of the noise of the readings."""
    curves = []
    noises = np.array(sorted(each for each in result.definition.reading_noises if each > 0))
    for key, candidates in result.job.mapped.items() if len(noises) else ():
        plan = result.job.plans[key]
        assert isinstance(plan, Plan)
        cell = next(each for each in result.definition.cells if each.plan_key == key)
        values = np.array([_blind(plan, candidates[0], noise) for noise in noises])
        none = np.zeros(len(noises))
        curves.append(
            Curve(
                cell.mechanism,
                "noise of the readings",
                _protocol(cell),
                noises,
                values,
                none,
                none.astype(np.intp),
            )
        )
    return tuple(curves)


def linearity_curves(result: Studied, what: str) -> tuple[Curve, ...]:
    """Simulated over predicted position error as "noise_level" or "tolerance_level" grows.

    Robots and noise are the same at all levels but for their size, so what differs from the lowest
    level is what first order leaves out, nearly without chance.
    """
    return tuple(_linearity(result, cells, what) for cells in _series(result, what))


def _linearity(result: Studied, cells: Sequence[Cell], what: str) -> Curve:
    first = cells[0]
    start = result.rows(first.id)
    values, errors, failed = [], [], []
    for cell in cells:
        rows = result.rows(cell.id)
        both = rows["converged"] & start["converged"]
        squares = [
            (each["position_rms_m"][both] / result.cells[of.id].position.predicted) ** 2
            for each, of in ((rows, cell), (start, first))
        ]
        ratio = math.sqrt(squares[0].mean() / squares[1].mean()) if both.any() else math.nan
        apart = squares[0] / squares[0].mean() - squares[1] / squares[1].mean()
        values.append(ratio)
        errors.append(ratio * apart.std() / math.sqrt(max(len(apart), 1)) / 2)
        failed.append(int(np.count_nonzero(~rows["converged"])))
    return _curve(cells, what, np.array(values), np.array(errors), np.array(failed))


def _blind(plan: Plan, candidates: Array, noise: float) -> float:
    """Of the poses of leg 1, if its readings have a noise that the selection was not told of."""
    mechanism = plan.mechanism
    noisy = mechanism.replace(noise=dataclasses.replace(mechanism.noise, reading=noise))
    poses = plan.poses[plan.rows_of(0)]
    assert plan.basis is not None
    told = select_poses(
        LegRows(noisy, 0, candidates, "noise_aware"), len(poses), plan.basis.seed, threads=1
    )
    gain = _log_information(noisy, 0, poses) - told.log_det
    return math.exp(gain / mechanism.estimated_counts[0])


def _series(result: Studied, what: str) -> list[list[Cell]]:
    """Cells that differ in one level alone, the other being one; at least two, ascending."""
    other = {"noise_level": "tolerance_level", "tolerance_level": "noise_level"}[what]
    found: dict[tuple[Any, ...], list[Cell]] = {}
    for cell in result.definition.cells:
        if getattr(cell, other) == 1 and not isinstance(result.job.plans[cell.plan_key], str):
            key = *cell.plan_key, cell.estimator, cell.use, cell.loss
            found.setdefault(key, []).append(cell)
    return [
        sorted(cells, key=lambda cell: float(getattr(cell, what)))
        for cells in found.values()
        if len(cells) > 1
    ]


def _curve(
    cells: Sequence[Cell], what: str, values: Array, errors: Array, failed: NDArray[np.intp]
) -> Curve:
    cell = cells[0]
    return Curve(
        mechanism=cell.mechanism,
        what={"tolerance_level": "errors of the robots", "noise_level": "noise"}[what],
        of=f"{_protocol(cell)}, {cell.estimator}, {cell.use}",
        levels=np.array([getattr(each, what) for each in cells]),
        values=values,
        errors=errors,
        failed=failed,
    )


def _protocol(cell: Cell) -> str:
    return f"{cell.design}, {cell.rows}, {cell.criterion}, {cell.pose_count} poses a leg"
