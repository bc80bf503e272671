# SPDX-License-Identifier: MIT
"""Measurement plans: which poses to take, for which leg, in which order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin.errors import MeasurementError
from symkin.measurements import Measurements, make_arrays
from symkin.observability import RowKind
from symkin.planning.designs import Design
from symkin.planning.limits import Clearance
from symkin.planning.selection import Criterion, Selection, SelectionMethod

__all__ = ["ChosenPoses", "Plan", "PlanBasis"]


@dataclass(frozen=True)
class ChosenPoses:
    """One selection of a plan.

    Attributes
    ----------
    legs : tuple of int
        The legs, from 1, that it serves.
    elements : tuple of str
        The symmetry elements that carry its poses to them: to one leg each, or (design "orbits")
        all of them to every leg.
    selection : Selection
        What was chosen, with its certificate. A pose of an orbit counts once.
    """

    legs: tuple[int, ...]
    elements: tuple[str, ...]
    selection: Selection


@dataclass(frozen=True)
class PlanBasis:
    """How a plan was made.

    Attributes
    ----------
    design, rows, criterion, method
        As `make_plan` takes them.
    seed : int
        Of the selections.
    candidates : int
        Poses to choose from, and
    excluded : int
        how many of them the constraints left out.
    clearance : Clearance
        How far they stay from the end of a leg's reach and from singularities.
    choices : tuple of ChosenPoses
        One for each leg that is its own reference.
    """

    design: Design
    rows: RowKind
    criterion: Criterion
    method: SelectionMethod
    seed: int
    candidates: int
    excluded: int
    clearance: Clearance
    choices: tuple[ChosenPoses, ...]

    @property
    def symmetrical(self) -> bool:
        """Whether one choice serves all legs alike, so that all are equally observable."""
        return self.design != "mechanism" and len(self.choices) == 1


@dataclass(frozen=True)
class Plan:
    """Commanded poses of every set, with the readings of all legs at the nominal parameters.

    The rows stand in the order in which the poses are to be visited.

    Attributes
    ----------
    leg_sets : ndarray of int, shape (N,)
        The leg, from 1, that the pose identifies; 0 for all legs.
    order : ndarray of int, shape (N,)
        Place of the pose within its set, from 1; spares come last, the best first.
    spare : ndarray of bool, shape (N,)
        Whether the pose only replaces one that cannot be taken.
    poses : ndarray, shape (N, coordinates)
        Commanded poses, m and rad (spatial: position and quaternion).
    readings : ndarray, shape (N, legs)
        Commanded readings in the sensor's unit.
    basis : PlanBasis or None
        How it was made; None for a plan that was read from a file.
    """

    leg_sets: NDArray[np.intp]
    order: NDArray[np.intp]
    spare: NDArray[np.bool_]
    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    basis: PlanBasis | None = None

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose."""
        make_arrays(
            self,
            poses=(2, "float"),
            readings=(2, "float"),
            leg_sets=(1, "int"),
            order=(1, "int"),
            spare=(1, "bool"),
        )
        rows = len(self.poses)
        for name in ("leg_sets", "order", "spare", "readings"):
            count = len(getattr(self, name))
            if count != rows:
                raise MeasurementError(f"the plan has {count} {name} for {rows} poses")

    @property
    def row_kind(self) -> RowKind:
        """What its poses were chosen by; of a plan that does not say, the paper's rows."""
        return "paper" if self.basis is None else self.basis.rows

    def rows_of_set(self, number: int, *, spare: bool = False) -> NDArray[np.intp]:
        """Return the rows, from 0, of a set (0 for all legs) in its order; or its spares."""
        rows = np.flatnonzero((self.leg_sets == number) & (self.spare == spare))
        return rows[np.argsort(self.order[rows], kind="stable")]

    def rows_of(self, leg: int) -> NDArray[np.intp]:
        """Return the rows, from 0, that identify a leg (from 0): its own and those of all legs."""
        return np.concatenate([self.rows_of_set(leg + 1), self.rows_of_set(0)])

    def leg_poses(self, measured: Measurements | None = None) -> list[NDArray[np.float64]]:
        """Return the poses that identify each leg; with those measured already, if given."""
        legs = range(self.readings.shape[1])
        sets = [self.poses[self.rows_of(leg)] for leg in legs]
        if measured is None:
            return sets
        return [np.concatenate([sets[leg], measured.poses[measured.rows_of(leg)]]) for leg in legs]
