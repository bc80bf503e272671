# SPDX-License-Identifier: MIT
"""Simulated robots and measurements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symkin import _core
from symkin.identification.calibrated import canonical, with_usable_home
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism, require_same_shape
from symkin.observability import noise_of, tolerances_of
from symkin.planning import Plan

__all__ = ["Simulation", "disturb", "simulate"]


@dataclass(frozen=True)
class Simulation:
    """Measurements of a simulated robot.

    Attributes
    ----------
    measurements : Measurements
        What a laboratory would have measured.
    actual : Mechanism
        The robot, as made.
    replaced : tuple of int
        For each leg's set, how many poses the robot could not take and spares replaced.
    """

    measurements: Measurements
    actual: Mechanism
    replaced: tuple[int, ...]


def disturb(mechanism: Mechanism, seed: int) -> Mechanism:
    """Return the mechanism as the workshop may make it: normal errors within its tolerances.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    seed : int
        Of the errors.

    Returns
    -------
    Mechanism
        Without a declared symmetry, which it has no longer.
    """
    made = _core.disturb(mechanism.core, tolerances_of(mechanism.tolerances), seed)
    return mechanism.replace(symmetry=None).with_parameters(
        canonical(mechanism, made.parameters)[0]
    )


def simulate(
    mechanism: Mechanism, plan: Plan, seed: int | None = None, actual: Mechanism | None = None
) -> Simulation:
    """Simulate the measurements of a plan (section 6.5 of the paper).

    The commanded poses go through the nominal inverse kinematics to the joints; the actual
    mechanism's forward kinematics gives the poses that it takes; noise is added. A pose that it
    cannot take, or only beyond a singularity, is replaced by the next spare of its set and counted.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one; its noise and tolerances are used.
    plan : Plan
        The poses to take.
    seed : int, optional
        Of the robot's errors and of the noise; by default the protocol's.
    actual : Mechanism, optional
        The robot as made, by default `disturb` of the nominal one.

    Returns
    -------
    Simulation

    Raises
    ------
    SymkinError
        If a set runs out of spares, or the robot is of another kind than the nominal mechanism.
    """
    seed = mechanism.protocol.seed if seed is None else seed
    made = actual is None
    actual = disturb(mechanism, seed) if actual is None else actual
    require_same_shape(actual, mechanism)
    sets = [_core.PoseSet(leg, plan.poses[rows], wanted) for leg, rows, wanted in _sets(plan)]
    result = _core.simulate(actual.core, mechanism.core, sets, noise_of(mechanism.noise), seed)
    taken = result.measurements
    measurements = Measurements(
        taken.poses,
        taken.readings,
        np.array(taken.leg_sets, dtype=np.intp),
        np.arange(len(taken.poses)) + 2,  # below the header of the table that is written
        reading_unit=mechanism.reading_unit,
    )
    if made:
        actual = with_usable_home(actual, measurements.poses)
    return Simulation(measurements, actual, tuple(result.replaced))


def _sets(plan: Plan) -> list[tuple[int, np.ndarray, int]]:
    """Leg (from 0, -1 for all), rows with the spares behind, and number of wanted poses."""
    sets = []
    for leg in np.unique(plan.leg_sets).tolist():
        wanted = plan.rows_of_set(leg)
        rows = np.concatenate([wanted, plan.rows_of_set(leg, spare=True)])
        sets.append((leg, rows, len(wanted)))
    return sets
