# SPDX-License-Identifier: MIT
"""Designs: whose parameters a selection of poses is for, and what becomes of its poses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.mechanism import Mechanism
from symkin.observability import RowKind, mechanism_rows, observability_rows
from symkin.planning.selection import LegRows
from symkin.symmetry import (
    SymmetryElement,
    leg_carriers,
    map_poses,
    observability_group,
    symmetry_group,
)

__all__ = ["Design", "Task", "design_tasks"]

Design = Literal["legs", "orbits", "mechanism"]


@dataclass(frozen=True)
class Task:
    """One selection of a design.

    Attributes
    ----------
    leg : int or None
        The leg, from 0, whose parameters it shows; None for those of all legs.
    sets : tuple of (int, tuple of SymmetryElement)
        The sets that it gives: the leg (from 1; 0 for all legs) and the elements that carry each
        chosen pose into the set.
    rows_per_pose : int
        Rows of the identification matrix that a candidate brings.
    """

    leg: int | None
    sets: tuple[tuple[int, tuple[SymmetryElement, ...]], ...]
    rows_per_pose: int

    @property
    def elements(self) -> tuple[SymmetryElement, ...]:
        """All elements that carry its poses, in the order of the sets."""
        return tuple(element for _, elements in self.sets for element in elements)

    @property
    def is_orbit(self) -> bool:
        """Whether every chosen pose is measured at its images too."""
        return any(len(elements) > 1 for _, elements in self.sets)

    def candidate_rows(
        self, mechanism: Mechanism, poses: NDArray[np.float64], kind: RowKind
    ) -> NDArray[np.float64] | LegRows:
        """Rows that candidates bring to a selection; those of one leg need not be held."""
        if self.leg is None:
            return mechanism_rows(mechanism, poses, kind)
        orbit = self.elements if self.is_orbit else ("r0",)
        return LegRows(mechanism, self.leg, poses, kind, orbit=orbit)

    def rows(
        self, mechanism: Mechanism, poses: NDArray[np.float64], kind: RowKind
    ) -> NDArray[np.float64]:
        """The same as an array, shape (n, rows_per_pose, p)."""
        if self.leg is None or not self.is_orbit:
            return self.measured_rows(mechanism, poses, kind)
        images = [map_poses(mechanism, element, poses) for element in self.elements]
        return np.stack(
            [observability_rows(mechanism, self.leg, image, kind) for image in images], axis=1
        )

    def measured_rows(
        self, mechanism: Mechanism, poses: NDArray[np.float64], kind: RowKind
    ) -> NDArray[np.float64]:
        """Rows of poses that are measured as they are, without images, shape (n, r, p)."""
        if self.leg is None:
            return mechanism_rows(mechanism, poses, kind)
        return observability_rows(mechanism, self.leg, poses, kind)[:, None, :]

    def parameter_names(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Names of the columns of its rows."""
        names = mechanism.parameter_names
        if self.leg is not None:
            return names
        return tuple(
            f"leg {leg} {name}" for leg in range(1, len(mechanism.legs) + 1) for name in names
        )


def design_tasks(mechanism: Mechanism, design: Design, *, use_symmetry: bool) -> list[Task]:
    """Return the selections of a design.

    Parameters
    ----------
    mechanism : Mechanism
        Its symmetry carries poses from leg to leg.
    design : {"legs", "orbits", "mechanism"}
        See `make_plan`.
    use_symmetry : bool
        Whether one selection serves all legs of an orbit (design "legs").

    Raises
    ------
    SymkinError
        For orbits of a mechanism whose legs are not all images of leg 1.
    """
    makers: dict[str, Callable[[], list[Task]]] = {
        "legs": lambda: _leg_tasks(mechanism, use_symmetry),
        "orbits": lambda: [_orbit_task(mechanism)],
        "mechanism": lambda: [_mechanism_task(mechanism)],
    }
    if design not in makers:
        raise SymkinError(f'unknown design "{design}"; expected {_listed(makers)}')
    return makers[design]()


def _leg_tasks(mechanism: Mechanism, use_symmetry: bool) -> list[Task]:
    if not use_symmetry:
        identity = _identity(mechanism)
        return [Task(leg, ((leg + 1, (identity,)),), 1) for leg in range(len(mechanism.legs))]
    carriers = leg_carriers(mechanism)
    return [
        Task(
            reference,
            tuple(
                (leg + 1, (element,))
                for leg, (origin, element) in enumerate(carriers)
                if origin == reference
            ),
            1,
        )
        for reference in sorted({origin for origin, _ in carriers})
    ]


def _orbit_task(mechanism: Mechanism) -> Task:
    elements = observability_group(mechanism)
    if elements is None:
        raise SymkinError(
            f'mechanism "{mechanism.name}" has legs that are not images of leg 1, so no orbit of '
            'poses serves all legs; choose the design "legs" or "mechanism"'
        )
    return Task(0, ((0, tuple(elements)),), len(elements))


def _mechanism_task(mechanism: Mechanism) -> Task:
    return Task(None, ((0, (_identity(mechanism),)),), len(mechanism.legs))


def _identity(mechanism: Mechanism) -> SymmetryElement:
    return symmetry_group(mechanism).parse("r0")


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)
