# SPDX-License-Identifier: MIT
"""Simulated robots that are measured as a plan says."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.homes import with_usable_home
from symkin.analysis.observed import NO_NOISE, Observed, Observing
from symkin.data.measurements import Measurements
from symkin.data.reading import write_measurements
from symkin.estimate.changes import changed_observations, changed_poses
from symkin.estimate.survey import FIRST_ROW
from symkin.files.mechanism_writer import save_mechanism
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism, require_same_shape
from symkin.model.tolerances import noise_of
from symkin.model.turns import turned_into_table
from symkin.options import checks
from symkin.planning.accuracy import set_name
from symkin.planning.changes import changes_of, with_sessions
from symkin.planning.made import disturb
from symkin.planning.plan import Plan
from symkin.planning.plan_files import as_plan
from symkin.results import Result
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import TableSource
from symkin.values import record

__all__ = ["Simulation", "disturb", "simulate", "simulate_observed"]

_FULL_POSES = Observed()  # in the robot's own frame


@record
class Simulation(Result):
    """Measurements of a simulated robot.

    Attributes
    ----------
    measurements : Measurements
        What a laboratory would have measured.
    actual : Mechanism
        The robot, as made.
    replaced : tuple of int
        For each set of the plan, how many poses the robot could not take and spares replaced.
    nominal : Mechanism
        As drawn.
    plan : Plan
        The poses that the robot was told to take.
    """

    measurements: Measurements
    actual: Mechanism
    replaced: tuple[int, ...]
    nominal: Mechanism
    plan: Plan

    FILES: ClassVar[tuple[str, ...]] = ("measurements.csv", "actual.toml")

    @property
    def replaced_by_set(self) -> dict[str, int]:
        """How many poses of each set spares replaced: of ``leg 1``, ..., or of ``all legs``."""
        sets = np.unique(self.plan.leg_sets).tolist()
        return dict(zip(map(set_name, sets), self.replaced, strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Return what was measured, in numbers."""
        return {
            "command": "simulate",
            "mechanism": self.nominal.name,
            "measured": len(self.measurements.poses),
            "replaced": self.replaced_by_set,
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the measurements, as their file has them."""
        return self.measurements.columns(self.nominal)

    def write(self, folder: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the measurements and the robot, see `FILES`, and return the folder."""
        name = self.nominal.name
        header = f"Simulated by symkin: {name} as it may be made within its tolerances."
        with OutputFiles(overwrite=overwrite) as outputs:
            target = outputs.folder(Path(folder), *self.FILES)
            write_measurements(self.measurements, target / "measurements.csv", self.nominal)
            save_mechanism(self.actual, target / "actual.toml", header=header)
        return Path(folder)


@checks()
def simulate(
    mechanism: MechanismGiven,
    plan: Plan | TableSource,
    seed: int | None = None,
    actual: MechanismGiven | None = None,
    *,
    observe: Observing | None = None,
    changes: Mapping[str, float | str] | None = None,
) -> Simulation:
    """Simulate the measurements of a plan (section 6.5 of the paper).

    The commanded poses go through the nominal inverse kinematics to the joints; the actual
    mechanism's forward kinematics gives the poses that it takes; noise is added. A pose that it
    cannot take, or only beyond a singularity, is replaced by the next spare of its set and counted.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one; its noise and tolerances are used.
    plan : Plan, or what `read_plan` reads
        The poses to take.
    seed : int, optional
        Of the robot's errors and of the noise; by default the protocol's.
    actual : Mechanism, optional
        The robot as made, by default `disturb` of the nominal one.
    observe : Observed, str or sequence of str, optional
        What is observed besides the readings, by default what the plan was made for, what the
        mechanism's device does, or full poses. Base, target and plane that it does not give are
        those of the mechanism's `frames`; without, its own.
    changes : mapping of str to float or str, optional
        What changes while the poses are taken, in the order of the plan's rows, by the names of the
        unknowns of `identify`: ``{"leg2.drift": "1 mrad", "drift.x": 1e-4, "step40": "1 mrad",
        "growth": 5e-5, "leg1.backlash": "0.2 mrad"}``. Names of sessions (``leg2.session1``,
        ``session1.x``, and ``session1.noise``, as so many times the declared one) make as many of
        them, one after the other, of as many rows.

    Returns
    -------
    Simulation
        Its measurements are in the order in which the poses are taken.

    Raises
    ------
    SymkinError
        If a set runs out of spares, or the robot is of another kind than the nominal mechanism.
    """
    mechanism = as_mechanism(mechanism)
    actual = None if actual is None else as_mechanism(actual, "actual")
    plan = as_plan(plan, mechanism)
    survey = None if plan.basis is None else plan.basis.survey
    if observe is None and survey is not None:
        observe = survey.observed
    observed = Observed.of(mechanism, observe) or _FULL_POSES.in_frames(mechanism.frames)
    return simulate_observed(mechanism, plan, seed, actual, observed, changes or {})


def simulate_observed(
    mechanism: Mechanism,
    plan: Plan,
    seed: int | None = None,
    actual: Mechanism | None = None,
    observed: Observed = _FULL_POSES,
    changes: Mapping[str, float | str] | None = None,
) -> Simulation:
    """Simulate, with exactly these frames: by default poses in the robot's own."""
    seed = mechanism.protocol.seed if seed is None else seed
    made = actual is None
    actual = disturb(mechanism, seed) if actual is None else actual
    require_same_shape(actual, mechanism)
    curved = mechanism.curvature is not None or actual.curvature is not None
    sets = []
    for leg, rows, wanted in _sets(plan):
        poses = plan.poses[rows]
        told = actual.straightened(mechanism.inverse_kinematics(poses)) if curved else poses[:0]
        together = _together(observed, len(rows), wanted)
        sets.append(_core.PoseSet(leg, poses, wanted, together, told))
    as_usual = not curved and observed == _FULL_POSES and not changes
    as_usual = as_usual and not mechanism.noise.varies
    noise = mechanism.noise if as_usual else NO_NOISE
    result = _core.simulate(actual.straight, mechanism.straight, sets, noise_of(noise), seed)
    taken = result.measurements
    measurements = Measurements(
        taken.poses,
        turned_into_table(mechanism, actual.curved(taken.readings)),
        taken.leg_sets,
        np.arange(len(taken.poses)) + FIRST_ROW,
        reading_unit=mechanism.reading_unit,
        pose_space=mechanism.pose_space,
        sensor_table=mechanism.sensor_table,
    )
    if made:
        actual = with_usable_home(actual, measurements.poses)
    order = _order_taken(plan, result)
    if changes:
        in_order = with_sessions(measurements.subset(order), changes)
        what = changes_of(
            mechanism, replace(in_order, row_numbers=measurements.row_numbers), changes
        )
        measurements = changed_poses(actual, in_order, what)
        measurements = observed.measure(measurements, mechanism.noise, seed, what.noise)
        measurements = changed_observations(measurements, observed.base or (), what)
    else:
        if observed.together > 1:  # as the table has the rows
            measurements, order = measurements.subset(order), np.arange(len(order))
        if not as_usual:
            measurements = observed.measure(measurements, mechanism.noise, seed)
        measurements = measurements.subset(order)
    numbers = np.arange(len(order)) + FIRST_ROW
    measurements = measurements.numbered(numbers)
    return Simulation(measurements, actual, tuple(result.replaced), mechanism, plan)


def _together(observed: Observed, *counts: int) -> int:
    """How many rows spares replace together; of a plan that was not made in pairs, one."""
    return 1 if any(count % observed.together for count in counts) else observed.together


def _order_taken(plan: Plan, result: _core.Simulation) -> NDArray[np.intp]:
    """Rows of what was taken, set by set, in the order in which the plan visits them."""
    taken, own = np.array(result.rows, dtype=np.intp), result.measurements.leg_sets
    places = np.zeros(len(taken), dtype=np.intp)
    for leg, rows, _ in _sets(plan):
        places[own == leg] = rows[taken[own == leg]]
    return np.argsort(places, kind="stable")


def _sets(plan: Plan) -> list[tuple[int, np.ndarray, int]]:
    """Leg (from 0, -1 for all), rows with the spares behind, and number of wanted poses."""
    sets = []
    for leg in np.unique(plan.leg_sets).tolist():
        wanted = plan.rows_of_set(leg)
        rows = np.concatenate([wanted, plan.rows_of_set(leg, spare=True)])
        sets.append((leg, rows, len(wanted)))
    return sets
