# SPDX-License-Identifier: MIT
"""Figures of the cells of a study."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from symkin.analysis.promises import NORMAL_95
from symkin.study.definition import Cell
from symkin.values import Array, Value, field, record


@record
class Ratio(Value):
    """A ratio of root mean squares, with its 95% interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, logarithm: float, standard_error: float) -> Ratio:
        """Return the ratio of which this is the logarithm."""
        reach = NORMAL_95 * standard_error
        return cls(*(math.exp(logarithm + step) for step in (0.0, -reach, reach)))


@record
class ErrorFigure(Value):
    """One kind of end-effector error of a cell, root mean square over robots and poses.

    Attributes
    ----------
    rms : float
        After identification, of the robots that converged; m or rad.
    low, high : float
        Its 95% interval, from the scatter of the robots' mean squares; NaN for one robot.
    median : float
        Over robots, of each one's root mean square.
    before : float
        Of the mechanism as drawn, the same robots.
    predicted : float
        To first order, see `predict_accuracy`; NaN if it cannot be told.
    """

    rms: float
    low: float
    high: float
    median: float
    before: float
    predicted: float
    derived = ("ratio", "ratio_error")

    @property
    def ratio(self) -> float:
        """Simulated over predicted."""
        return self.rms / self.predicted if self.predicted > 0 else math.nan

    @property
    def ratio_error(self) -> float:
        """Standard error of the ratio."""
        return self.ratio * (math.log(self.high / self.low) / (2 * NORMAL_95)) if self.rms else 0.0


@record
class CellSummary(Value):
    """What the robots of a cell had in common.

    Attributes
    ----------
    cell : Cell
        What was done.
    robots, failed : int
        Robots, and how many of them could not be measured or did not converge; those are in no
        other figure.
    failures : dict of str to int
        Why, and how often.
    measured_poses : int
        Poses that every robot is measured at.
    replaced : int
        Poses, of all robots, that spares replaced.
    position, orientation : ErrorFigure
        m (zero for a platform that only turns), and rad (zero for one that never turns).
    combined : ErrorFigure
        Both as one length, m: a rotation counts as the way of a point at the characteristic length.
    coverage, coverage_error : float
        Share of the parameters whose 95% interval holds the truth, and its standard error.
    chi_square : float
        Mean of chi-square per degree of freedom.
    mapped_efficiency : float
        Mean over robots, see `mapped_efficiency`; NaN unless the study asks for it.
    """

    cell: Cell
    robots: int
    failed: int
    failures: Mapping[str, int]
    measured_poses: int
    replaced: int
    position: ErrorFigure = field(unit="m")
    orientation: ErrorFigure = field(unit="rad")
    combined: ErrorFigure = field(unit="m")
    coverage: float
    coverage_error: float
    chi_square: float
    mapped_efficiency: float

    @property
    def first_kind(self) -> str:
        """What cells are compared by: "position", or "orientation" where nothing moves."""
        return "position" if self.position.before != 0 else "orientation"

    @property
    def first(self) -> ErrorFigure:
        """The error of that kind."""
        return self.position if self.first_kind == "position" else self.orientation


@record
class PairedComparison(Value):
    """Two cells compared on the same robots.

    Attributes
    ----------
    first, second : str
        Their names.
    robots : int
        Those that converged in both.
    position, orientation : Ratio
        Root mean square error of the first over that of the second.
    """

    first: str
    second: str
    robots: int
    position: Ratio
    orientation: Ratio


def paired(one: Array, other: Array) -> Ratio:
    """Compare root mean squares of the same robots, shape (robots,), by two protocols."""
    if not len(one) or not one.any() or not other.any():
        return Ratio(math.nan, math.nan, math.nan)
    # To first order the logarithm of a ratio of means is the mean of this.
    squares = one**2 / np.mean(one**2), other**2 / np.mean(other**2)
    logarithm = math.log(np.mean(one**2) / np.mean(other**2)) / 2
    return Ratio.of(logarithm, standard_error(squares[0] - squares[1]) / 2)


def standard_error(values: Array) -> float:
    """Of the mean; NaN of one value."""
    count = len(values)
    return float(values.std(ddof=1) / math.sqrt(count)) if count > 1 else math.nan
