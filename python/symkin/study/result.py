# SPDX-License-Identifier: MIT
"""What a study found: figures of cells with their uncertainty, and which protocol to take."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.promises import CONFIDENCE, ExpectedAccuracy
from symkin.errors import SymkinError, did_you_mean
from symkin.options import checked
from symkin.planning import Plan, predict_accuracy
from symkin.planning.prediction import check_wanted, pose_count_curve
from symkin.results import FolderResult
from symkin.study.asymmetry import Curve, asymmetry_curves, linearity_curves, reading_curves
from symkin.study.definition import Cell, StudyDefinition, extension_of
from symkin.study.extension import StudyExtension
from symkin.study.robots import Job
from symkin.study.summaries import (
    CellSummary,
    ErrorFigure,
    PairedComparison,
    Ratio,
    paired,
    standard_error,
)
from symkin.values import Array, Value, field, plain, record

_ERRORS = ("position_rms_m", "orientation_rms_rad")


@record
class StudyResult(FolderResult):
    """What a study of simulated robots found.

    Attributes
    ----------
    definition : StudyDefinition
        What was compared.
    table : dict of str to ndarray
        A row a robot and cell, in their order: see `symkin.study.robots.COLUMNS`.
    job : Job
        The mechanisms, plans and poses of the cells.
    wanted : (float or None, float or None)
        Root mean square error of position (m) and orientation (rad) for which `recommendations`
        look, and
    confidence : float
        the share of robots that shall be within it.
    extension_parts : sequence, optional
        What the calls of its `StudyExtension` returned to who ran it, for `findings`.
    """

    definition: StudyDefinition
    table: Mapping[str, NDArray[Any]]
    job: Job
    wanted: tuple[float | None, float | None] = (None, None)
    confidence: float = CONFIDENCE
    extension_parts: Sequence[Any] | None = field(default=None, private=True, compare=False)

    @property
    def robots(self) -> int:
        """Robots in each cell."""
        return len(self.table["robot"]) // len(self.definition.cells)

    @cached_property
    def cells(self) -> Mapping[str, CellSummary]:
        """The cells by name, in their order."""
        return {cell.id: self._summary(cell) for cell in self.definition.cells}

    @cached_property
    def extension(self) -> tuple[str, StudyExtension] | None:
        """Name and extension of the study that an installed package brings, if it is one."""
        return extension_of(self.definition)

    @cached_property
    def findings(self) -> Any:
        """What it says of its extension's questions, as of the paper; None without an extension."""
        if self.extension is None:
            return None
        return self.extension[1].findings(self, parts=self.extension_parts)

    def rows(self, cell: str) -> Mapping[str, NDArray[Any]]:
        """Return the rows of a cell, a robot each."""
        place = self._place(cell)
        part = slice(place * self.robots, (place + 1) * self.robots)
        return {name: column[part] for name, column in self.table.items()}

    def plan(self, cell: str) -> Plan:
        """Return the plan of a cell.

        Raises
        ------
        SymkinError
            If there is none, saying why.
        """
        plan = self.job.plans[self.definition.cells[self._place(cell)].plan_key]
        if isinstance(plan, str):
            raise SymkinError(f"{cell}: {plan}")
        return plan

    def poses(self, cell: str) -> Array:
        """Return the poses over which a cell's errors are taken."""
        return self.job.poses[self.definition.cells[self._place(cell)].mechanism]

    def compare(self, first: str, second: str) -> PairedComparison:
        """Compare the errors of two cells, robot by robot.

        Parameters
        ----------
        first, second : str
            Names of cells with the same robots.

        Raises
        ------
        SymkinError
            For a name that no cell has, or cells with other robots.
        """
        cells = [self.definition.cells[self._place(name)] for name in (first, second)]
        if cells[0].robot_key != cells[1].robot_key:
            raise SymkinError(
                f'"{first}" and "{second}" have other robots; expected one mechanism and one level '
                "of its tolerances"
            )
        one, other = self.rows(first), self.rows(second)
        both = one["converged"] & other["converged"]
        ratios = [paired(one[name][both], other[name][both]) for name in _ERRORS]
        return PairedComparison(first, second, int(both.sum()), *ratios)

    def for_accuracy(
        self,
        position: float | None = None,
        orientation: float | None = None,
        confidence: float = CONFIDENCE,
    ) -> StudyResult:
        """Return it with recommendations for a wanted accuracy.

        Parameters
        ----------
        position, orientation : float, optional
            Root mean square end-effector error that is wanted, m and rad; at least one of them.
        confidence : float
            Share of all such robots that shall be within it.

        Raises
        ------
        SymkinError
            For nothing wanted, an error that is not positive, or the orientation of a point.
        """
        checked(confidence=confidence)
        for mechanism in self.definition.loaded.values():
            check_wanted(mechanism, position, orientation)
        return dataclasses.replace(self, wanted=(position, orientation), confidence=confidence)

    @cached_property
    def recommendations(self) -> tuple[Recommendation, ...]:
        """For each mechanism, what each protocol needs for the wanted accuracy; empty without."""
        if self.wanted == (None, None):
            return ()
        return tuple(recommend(self, name, *self.wanted) for name in self.definition.loaded)

    @cached_property
    def curves(self) -> Mapping[str, tuple[Curve, ...]]:
        """Of a study of symmetry: what is lost to asymmetry, to joint noise, and to linearising."""
        if self.definition.kind != "symmetry":
            return {}
        return {
            "asymmetry": asymmetry_curves(self),
            "readings": reading_curves(self),
            "noise": linearity_curves(self, "noise_level"),
            "errors": linearity_curves(self, "tolerance_level"),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the cells' figures."""
        return {
            "command": "study",
            "study": self.definition.name,
            "title": self.definition.title,
            "kind": self.definition.kind,
            "digest": self.definition.digest,
            "robots": self.robots,
            "seed": self.definition.seed,
            "cells": [summary.to_dict() for summary in self.cells.values()],
            "recommendations": [each.to_dict() for each in self.recommendations],
            "curves": plain(self.curves),
            **({self.extension[0]: self.findings.to_dict()} if self.extension else {}),
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the rows, as their file has them."""
        return {
            name: column.astype(np.int64) if column.dtype == np.bool_ else column
            for name, column in self.table.items()
        }

    def _place(self, name: str) -> int:
        names = [cell.id for cell in self.definition.cells]
        if name not in names:
            raise SymkinError(f'there is no cell "{name}"{did_you_mean(name, names)}')
        return names.index(name)

    def _summary(self, cell: Cell) -> CellSummary:
        rows = self.rows(cell.id)
        good = rows["converged"]
        length = self.job.mechanisms[cell.mechanism].characteristic_length
        after = [rows[name][good] for name in _ERRORS]
        before = [rows[name][good] for name in ("position_before_m", "orientation_before_rad")]
        expected = self._predicted(cell)
        predicted = [expected.position, expected.orientation] if expected else [math.nan] * 2
        after.append(np.hypot(after[0], length * after[1]))
        before.append(np.hypot(before[0], length * before[1]))
        predicted.append(math.hypot(predicted[0], length * predicted[1]))
        reasons, counts = np.unique(rows["failure"][~good], return_counts=True)
        position, orientation, combined = map(_figure, after, before, predicted)
        inside = rows["inside_95"][good]
        return CellSummary(
            cell=cell,
            robots=len(good),
            failed=int(np.count_nonzero(~good)),
            failures=dict(zip(reasons.tolist(), counts.tolist(), strict=True)),
            measured_poses=int(rows["measured_poses"].max()),
            replaced=int(rows["replaced"].sum()),
            position=position,
            orientation=orientation,
            combined=combined,
            coverage=_mean(inside),
            coverage_error=standard_error(inside),
            chi_square=_mean(rows["chi_square_ratio"][good]),
            mapped_efficiency=_mean(rows["mapped_efficiency"]),
        )

    def _predicted(self, cell: Cell) -> ExpectedAccuracy | None:
        """To first order, see `predict_accuracy`."""
        plan = self.job.plans[cell.plan_key]
        if isinstance(plan, str):
            return None
        how = cell.noise_level, cell.tolerance_level, cell.estimator, cell.use
        key = *cell.plan_key, *how
        if key not in self._predictions:
            poses = self.job.poses[cell.mechanism]
            try:
                found = predict_accuracy(
                    self.job.mechanism(cell), plan, poses, cell.estimator, poses=cell.use
                )
            except SymkinError:  # as `joint` without a noise of redundant readings
                found = None
            self._predictions[key] = found
        return self._predictions[key]

    @cached_property
    def _predictions(self) -> dict[tuple[Any, ...], ExpectedAccuracy | None]:
        return {}


def _figure(after: Array, before: Array, predicted: float) -> ErrorFigure:
    rms, low, high = root_mean_square(after)
    return ErrorFigure(
        rms=rms,
        low=low,
        high=high,
        median=float(np.median(after)) if len(after) else math.nan,
        before=root_mean_square(before)[0],
        predicted=predicted,
    )


def root_mean_square(values: Array) -> tuple[float, float, float]:
    """Root mean square over robots and its 95% interval (delta method, of its logarithm)."""
    if not len(values):
        return math.nan, math.nan, math.nan
    squares = values**2
    mean = float(squares.mean())
    if mean == 0:
        return 0.0, 0.0, 0.0
    interval = Ratio.of(math.log(mean) / 2, standard_error(squares) / (2 * mean))
    return interval.value, interval.low, interval.high


def _mean(values: Array) -> float:
    good = values[np.isfinite(values)]
    return float(good.mean()) if len(good) else math.nan


@record
class Protocol(Value):
    """A protocol, and what it needs for a wanted accuracy.

    Attributes
    ----------
    cell : Cell
        One of its cells; the others have another number of poses.
    pose_count : int
        Fewest poses of each leg that are predicted to be enough; if none are, the most tried.
    measured_poses : int
        Poses to measure in all.
    enough : bool
        Whether they are.
    position, orientation : float
        Mean root mean square error that is predicted with them, m and rad, and
    position_bound, orientation_bound : float
        what the wanted share of all robots is within.
    trust : float
        Of its simulated cells, how far the position error was from the prediction at the most: 1.03
        is 3% larger or smaller; NaN where none could be simulated.
    """

    cell: Cell
    pose_count: int
    measured_poses: int
    enough: bool
    position: float = field(unit="m")
    orientation: float = field(unit="rad")
    position_bound: float = field(unit="m")
    orientation_bound: float = field(unit="rad")
    trust: float


@record
class Recommendation(Value):
    """The protocols of a mechanism, ordered by what they cost for a wanted accuracy.

    Attributes
    ----------
    mechanism : str
        Its name.
    wanted_position, wanted_orientation : float or None
        Root mean square error wanted, m and rad, of
    confidence : float
        this share of all robots.
    protocols : tuple of Protocol
        Those that reach it first, the fewest measured poses first; then the others, the smallest
        error first.
    """

    mechanism: str
    wanted_position: float | None = field(unit="m")
    wanted_orientation: float | None = field(unit="rad")
    confidence: float
    protocols: tuple[Protocol, ...]


def recommend(
    result: StudyResult, mechanism: str, position: float | None, orientation: float | None
) -> Recommendation:
    """Find how many poses each protocol of a study needs for a wanted accuracy.

    The numbers are predicted, to first order; what the study simulated says how far predictions can
    be trusted. Protocols differ in design, rows, criterion and estimator: cells with another
    method, clearance, loss, noise or tolerance, or without symmetry, take no part.

    Raises
    ------
    SymkinError
        For nothing wanted, or an error that is not positive.
    """
    series: dict[tuple[Any, ...], list[Cell]] = {}
    for cell in result.definition.cells:
        usual = (cell.method, cell.use_symmetry, cell.margin_sigmas, cell.loss)
        levels = cell.noise_level, cell.tolerance_level
        if (
            cell.mechanism == mechanism
            and usual == ("exchange", True, 3, "none")
            and levels == (1, 1)
        ):
            key = cell.design, cell.rows, cell.criterion, cell.estimator, cell.use
            series.setdefault(key, []).append(cell)
    known = (_protocol(result, cells, position, orientation) for cells in series.values())
    protocols = sorted(
        (each for each in known if each is not None),
        key=lambda each: (
            not each.enough,
            each.measured_poses if each.enough else 0,
            each.position_bound,
        ),
    )
    return Recommendation(mechanism, position, orientation, result.confidence, tuple(protocols))


def _protocol(
    result: StudyResult, cells: list[Cell], position: float | None, orientation: float | None
) -> Protocol | None:
    cell = cells[0]
    planned = [each for each in cells if not isinstance(result.job.plans[each.plan_key], str)]
    if not planned:
        return None
    plan = result.plan(planned[0].id)
    assert plan.candidates is not None  # it was made here
    try:
        needed = pose_count_curve(
            plan.mechanism,
            plan.candidates,
            [each.pose_count for each in planned],
            result.definition.seed,
            design=cell.design,
            rows=cell.rows,
            criterion=cell.criterion,
            estimator=cell.estimator,
            poses=cell.use,
            confidence=result.confidence,
        ).for_accuracy(position, orientation)
    except SymkinError:
        if position is None and orientation is None:
            raise
        return None
    ratios = [result.cells[each.id].position.ratio for each in planned]
    off = [max(ratio, 1 / ratio) for ratio in ratios if ratio > 0]
    return Protocol(
        cell=cell,
        pose_count=needed.tried,
        measured_poses=needed.measured,
        enough=needed.count is not None,
        position=needed.expected.position,
        orientation=needed.expected.orientation,
        position_bound=needed.expected.position_bound,
        orientation_bound=needed.expected.orientation_bound,
        trust=max(off, default=math.nan),
    )
