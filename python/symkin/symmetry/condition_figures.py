# SPDX-License-Identifier: MIT
"""The figures on which the verdicts on the paper's conditions rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.chains import chain_info
from symkin.mechanism import Mechanism
from symkin.symmetry.comparison import SymmetryComparison
from symkin.symmetry.group import SymmetryGroup
from symkin.symmetry.verification import ElementCheck
from symkin.workspace.sample import sample_workspace

__all__ = ["ConditionFigures", "condition_figures", "tested_group"]


@dataclass(frozen=True)
class ConditionFigures:
    """Figures on which several conditions rest.

    Attributes
    ----------
    comparison : SymmetryComparison
        The symmetry that there is.
    group : str
        The group that was tested, in the paper's notation.
    exact : bool
        Whether the legs have it to rounding.
    trivial : bool
        Whether it has nothing to test.
    tested : int
        Poses whose images were looked at.
    mismatches : int
        Those in the workspace with images outside, or the reverse.
    deviation : float
        Largest difference between readings at images and images of readings, sensor's unit, over
        the elements that keep the working modes; NaN if only the identity does.
    closure : float
        Largest of a leg at its inverse kinematics, m.
    home : float
        How far the home readings are from images of each other; NaN if no leg is an image.
    gains : float
        Largest relative difference.
    """

    comparison: SymmetryComparison
    group: str
    exact: bool
    trivial: bool
    tested: int
    mismatches: int
    deviation: float
    closure: float
    home: float
    gains: float

    @property
    def symmetric(self) -> bool:
        """Whether the structure has a symmetry, to rounding."""
        return self.comparison.found.structure.size > 1

    def sensors(self, differ: bool) -> str:
        """Say that a figure is the sensors' alone, where it is."""
        only = self.comparison.only_sensors_differ if differ else ""
        return only and f"; {only}"

    @property
    def under(self) -> str:
        """Which group the figures are of, where that needs saying."""
        return "" if self.exact else f" under {self.group}"


def tested_group(
    comparison: SymmetryComparison,
) -> tuple[SymmetryGroup, _core.SymmetryTolerance]:
    """Return the group to test, and within which tolerance it maps the legs.

    It is the structure's; but the one declared, or the one nearly there where there is none, if the
    legs miss it by no more than their tolerances.
    """
    reference, found = comparison.reference, comparison.found.structure
    wanted = reference is comparison.declared or found.size == 1
    if comparison.verdict == "nearly" and reference is not None and wanted:
        return reference, comparison.tolerance
    return found, _core.SymmetryTolerance()


def condition_figures(
    mechanism: Mechanism,
    comparison: SymmetryComparison,
    elements: tuple[ElementCheck, ...],
    count: int,
    seed: int,
) -> ConditionFigures:
    """Measure what the conditions ask for; the arguments are those of `check_conditions`."""
    group, tolerance = tested_group(comparison)
    sample = sample_workspace(mechanism, min(count, 1000), seed)
    closures = [
        mechanism.closure(leg, sample.poses, sample.readings[:, leg])
        for leg in range(len(mechanism.legs))
    ]
    gains = mechanism.sensor_gains
    return ConditionFigures(
        comparison=comparison,
        group=group.paper_name,
        exact=group is comparison.found.structure,
        trivial=group.size == 1,
        tested=count * (group.size - 1),
        mismatches=sum(check.mismatches for check in elements),
        deviation=max(
            (check.reading_deviation for check in elements[1:] if check.keeps_modes),
            default=float("nan"),
        ),
        closure=float(np.max(np.abs(closures))),
        home=max(_home_deviations(mechanism, group, tolerance), default=float("nan")),
        gains=float(np.ptp(gains) / np.abs(gains).max()),
    )


def _home_deviations(
    mechanism: Mechanism, group: SymmetryGroup, tolerance: _core.SymmetryTolerance
) -> Iterator[float]:
    """How far the home readings are from the images of the readings of each leg's reference."""
    home = mechanism.home[None, :]
    readings = mechanism.inverse_kinematics(home)[0]
    for leg, carrier in enumerate(_core.leg_carriers(mechanism.core, group, tolerance)):
        if carrier.reference == leg:
            continue
        moved = _core.transform_poses(group, carrier.element, mechanism.core, home)
        sign = _core.reading_sign(carrier.element, mechanism.core)
        found = np.array([readings[leg], mechanism.inverse_kinematics(moved)[0, leg]])
        yield float(
            np.abs(_turned(mechanism, leg, found - sign * readings[carrier.reference])).max()
        )


def _turned(
    mechanism: Mechanism, leg: int, differences: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Differences of readings, of an angle by the shortest turn of the joint."""
    if chain_info(mechanism.chain, mechanism.platform).reading_unit != "rad":
        return differences
    gain = mechanism.sensor_gains[leg]
    shortest: NDArray[np.float64] = np.angle(np.exp(1j * gain * differences)) / gain
    return shortest
