# SPDX-License-Identifier: MIT
"""What a study of symmetry says: how much asymmetry, joint noise and error are too much.

Asymmetry costs what poses that a symmetry carries from leg to leg are worth less to legs that lack
it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from symkin.mechanism import Mechanism
from symkin.observability import observability_rows
from symkin.planning import Plan
from symkin.planning.selection import LegRows, allowed_candidates, design_tasks, select_poses
from symkin.result import Value, record
from symkin.study.definition import Cell
from symkin.symmetry import map_poses

if TYPE_CHECKING:
    from symkin.study.result import StudyResult

__all__ = [
    "LOSSES",
    "OFF",
    "Curve",
    "asymmetry_curves",
    "linearity_curves",
    "mapped_candidates",
    "mapped_efficiency",
    "reading_curves",
]

Array = NDArray[np.float64]

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


def asymmetry_curves(result: StudyResult) -> tuple[Curve, ...]:
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


def reading_curves(result: StudyResult) -> tuple[Curve, ...]:
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


def linearity_curves(result: StudyResult, what: str) -> tuple[Curve, ...]:
    """Simulated over predicted position error as "noise_level" or "tolerance_level" grows.

    Robots and noise are the same at all levels but for their size, so what differs from the lowest
    level is what first order leaves out, nearly without chance.
    """
    return tuple(_linearity(result, cells, what) for cells in _series(result, what))


def _linearity(result: StudyResult, cells: Sequence[Cell], what: str) -> Curve:
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


def _series(result: StudyResult, what: str) -> list[list[Cell]]:
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


def mapped_candidates(plan: Plan, candidates: Array) -> tuple[Array, ...]:
    """What each leg's poses could have been: the candidates of its reference leg, carried to it.

    The plan is of design "legs", and chose from the candidates, shape (n, coordinates).
    """
    mechanism, basis = plan.mechanism, plan.basis
    assert basis is not None
    carried: dict[int, Array] = {}
    for task in design_tasks(mechanism, "legs", use_symmetry=True):
        allowed = allowed_candidates(task, candidates, None, (), basis.clearance)
        for leg, (element,) in task.sets:
            carried[leg] = map_poses(mechanism, element, candidates[allowed])
    return tuple(carried[leg] for leg in sorted(carried))


def mapped_efficiency(robot: Mechanism, plan: Plan, candidates: tuple[Array, ...]) -> float:
    """Compare a plan's poses with those that would have been chosen for the robot as it was made.

    With the `mapped_candidates`: ``(det M_plan / det M_own)^(1/p)`` of the least lucky leg, with M
    the information of the leg's own poses. With 0.9, so much is lost as with every tenth pose.
    """
    assert plan.basis is not None
    gains = []
    for leg, where in enumerate(candidates):
        poses = plan.poses[plan.rows_of(leg)]
        reached = where[np.isfinite(robot.inverse_kinematics(where)[:, leg])]
        own = select_poses(
            LegRows(robot, leg, reached, "noise_aware"), len(poses), plan.basis.seed, threads=1
        )
        gain = _log_information(robot, leg, poses) - own.log_det
        gains.append(gain / robot.estimated_counts[leg])
    return float(np.exp(min(gains)))


def _log_information(mechanism: Mechanism, leg: int, poses: Array) -> float:
    """Logarithm of the determinant of what a leg's poses show; those out of reach show nothing."""
    rows = observability_rows(mechanism, leg, poses, "noise_aware")
    rows = rows[np.isfinite(rows).all(axis=1)]
    sign, value = np.linalg.slogdet(rows.T @ rows)
    return float(value) if sign > 0 else -np.inf
