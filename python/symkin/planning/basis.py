# SPDX-License-Identifier: MIT
"""How the poses of a plan were chosen."""

from __future__ import annotations

from symkin.analysis.observability import RowKind
from symkin.estimate.survey import Survey
from symkin.planning.selection import Clearance, Criterion, Design, Selection, SelectionMethod
from symkin.values import Value, field, record


@record
class ChosenPoses(Value):
    """One selection of a plan.

    Attributes
    ----------
    legs : tuple of int
        The legs, from 0, that it serves.
    elements : tuple of str
        The symmetry elements that carry its poses to them: to one leg each, or (design "orbits")
        all of them to every leg.
    selection : Selection
        What was chosen, with its certificate. A pose of an orbit counts once.
    """

    legs: tuple[int, ...] = field(number=True)
    elements: tuple[str, ...]
    selection: Selection


@record
class PlanBasis(Value):
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
    survey : Survey or None
        What will be observed and what is unknown then; None for full poses and all parameters.
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
    survey: Survey | None = None

    @property
    def symmetrical(self) -> bool:
        """Whether one choice serves all legs alike, so that all are equally observable."""
        return self.design != "mechanism" and len(self.choices) == 1
