# SPDX-License-Identifier: MIT
"""The scalars of a robot as it is measured: what each was found to be, and how far it is shown."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import ClassVar, Literal

import numpy as np

from symkin.estimate.problem import UNSEEN
from symkin.estimate.scalars import CONSTANT, REDUNDANT
from symkin.estimate.sharing import sum_in_words
from symkin.estimate.unknowns import Layout
from symkin.model.chains import CURVATURE_TERMS
from symkin.model.core_setup import core_setup, scalar_values
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames
from symkin.values import Array, Value, field, record

# A deviation beyond this share of the prior's says that the data told next to nothing, and one
# beyond the other that they told less than the prior did, or not much more.
_SILENT = 0.9
_SHOWN = 0.5


Status = Literal[
    "free",
    "shared",
    "tied",
    "held",
    "held, a constant of the description",
    "held, since the sensor's offset does the same",
    "held by its prior: not shown by the data",
    "shown by the data and priors together",
    "shown by the data up to the gauge",
]


@record
class Unknown(Value):
    """A scalar of the robot as it is measured.

    Attributes
    ----------
    name : str
        ``leg2.distal_length``, ``base.x``, ``plane.c1``, ...
    unit : str
        "m", "rad", ...; empty for a number.
    nominal : float
        Of the drawing; NaN for what no drawing shows.
    value, deviation : float
        The estimate and its standard deviation; NaN if it is held. A frame's rotation is written as
        a rotation vector, and its deviations are those of a small rotation about the axes outside.
    tolerance, prior : float
        Standard deviations of manufacturing and of the prior; NaN without.
    status : str
        "free", "shared", "tied" or "held", with the reason if it always is; or what the data do not
        show by themselves.
    column : int
        Of the covariance; -1 if it is held, or tied.
    moves : tuple of (int, float)
        With which columns it moves, and by which factors.
    """

    name: str
    unit: str
    nominal: float
    value: float
    deviation: float
    tolerance: float
    prior: float
    status: Status
    column: int = field(private=True, default=-1)
    moves: tuple[tuple[int, float], ...] = field(private=True, default=())

    derived: ClassVar[tuple[str, ...]] = ("change", "change_in_tolerances")

    @property
    def change(self) -> float:
        """How far it is from the drawing; NaN without one, and if it is held."""
        return self.value - self.nominal if self.moves else float("nan")

    @property
    def shown(self) -> bool:
        """Whether the data determine it by themselves."""
        return self.status in ("free", "shared", "tied")

    @property
    def change_in_tolerances(self) -> float:
        """The same in tolerances."""
        return self.change / self.tolerance


def unknowns_of(
    nominal: Mechanism,
    layout: Layout,
    values: Array,
    deviations: Array,
    declared: Array,
    unseen: Array,
) -> tuple[Unknown, ...]:
    """Every scalar of the legs, and of the frames that there are.

    `values`, `deviations` and `declared`, by the declared noise and priors alone, are of the
    layout's scalars, `unseen` the directions of its columns
    that the observations alone do not show, one a column.
    """
    # What was not said to be anywhere has no nominal place.
    given = nominal.frames or Frames()
    count = sum(name.startswith("point") and name.endswith(".x") for name in layout.scalars)
    points = (*given.points, *((),) * (count - len(given.points)))
    whole = nominal.replace(frames=dataclasses.replace(given, points=points))
    of_drawing = scalar_values(core_setup(whole))
    drawn = np.zeros(len(layout.scalars))  # of what changes with the rows nothing is drawn
    drawn[: len(of_drawing)] = of_drawing
    places = {"base": given.base, "target": given.target, "plane": given.plane}
    places |= {f"point{i + 1}": place for i, place in enumerate(points)}
    places |= {f"distance{i + 1}": (zero,) for i, zero in enumerate(given.zeros)}
    by = layout.by_columns
    hidden = np.linalg.norm(unseen, axis=1) if unseen.size else np.zeros(len(layout.names))
    tied = {scalar for scalar, _, _ in layout.ties}
    found = []
    for i, name in enumerate(layout.scalars):
        block, _, own = name.partition(".")
        column = int(layout.column[i])
        of_leg = block.startswith("leg")
        curved = of_leg and own in CURVATURE_TERMS
        slope = i >= len(of_drawing)
        if not name or (column < 0 and (curved or slope) and values[i] == 0):
            continue
        if not of_leg and column < 0 and not places.get(block, slope or block[:5] == "ancho"):
            continue
        has_place = of_leg or places.get(block, True)
        tolerance = layout.tolerances[i]
        prior = layout.prior_of(i) if column >= 0 else np.nan
        found.append(
            Unknown(
                name=name,
                unit=layout.units[i],
                nominal=float(drawn[i]) if has_place else float("nan"),
                value=float(values[i]),
                deviation=float(deviations[i]),
                tolerance=float(tolerance) if tolerance > 0 else float("nan"),
                prior=float(prior) if np.isfinite(prior) else float("nan"),
                status=_status(layout, i, declared[i], hidden, tied),
                column=column,
                moves=tuple((k, float(by[i, k])) for k in np.flatnonzero(by[i]).tolist()),
            )
        )
    return tuple(found)


def shared_by_role(unknowns: Sequence[Unknown]) -> tuple[str, ...]:
    """Say which shared parameters do not change by the same amount, as equations of the changes."""
    firsts: dict[int, str] = {}
    for each in unknowns:
        if each.column >= 0:
            firsts.setdefault(each.column, each.name)
    return tuple(
        f"{each.name} = {sum_in_words((factor, firsts[column]) for column, factor in each.moves)}"
        for each in unknowns
        if each.column < 0 and each.status != "tied" and each.moves
    )


def _status(layout: Layout, scalar: int, deviation: float, hidden: Array, tied: set[int]) -> Status:
    column = layout.column[scalar]
    if scalar in layout.roles:
        column = next(each for own, each, _ in layout.ties if own == scalar)
    elif scalar in tied:
        return "tied"
    if column < 0:
        reasons: dict[str, Status] = {
            CONSTANT: "held, a constant of the description",
            REDUNDANT: "held, since the sensor's offset does the same",
        }
        return reasons.get(layout.always_held[scalar], "held")
    prior = layout.prior[column] if scalar in layout.roles else layout.prior_of(scalar)
    if np.isfinite(prior) and deviation > _SILENT * prior:
        return "held by its prior: not shown by the data"
    if deviation > _SHOWN * prior:
        return "shown by the data and priors together"
    if hidden[column] > UNSEEN:
        if np.isfinite(layout.prior).any():
            return "shown by the data and priors together"
        return "shown by the data up to the gauge"
    return "shared" if len(layout.members(column)) > 1 else "free"
