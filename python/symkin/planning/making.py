# SPDX-License-Identifier: MIT
"""How a plan is made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import RowKind
from symkin.planning.choosing import Chosen, Demands, choose
from symkin.planning.designs import Design, design_tasks
from symkin.planning.limits import Clearance, Region
from symkin.planning.plan import Plan, PlanBasis
from symkin.planning.selection import Criterion, SelectionMethod
from symkin.planning.visiting import visiting_order
from symkin.symmetry import SymmetryElement, map_poses
from symkin.workspace.sample import WorkspaceSample

__all__ = ["make_plan"]

Poses = NDArray[np.float64]


def make_plan(
    mechanism: Mechanism,
    candidates: ArrayLike | WorkspaceSample,
    count: int | None = None,
    seed: int | None = None,
    *,
    design: Design = "legs",
    rows: RowKind = "noise_aware",
    criterion: Criterion = "O1",
    method: SelectionMethod = "exchange",
    required: ArrayLike | None = None,
    measured: Measurements | None = None,
    avoid: Sequence[Region] = (),
    minimum_distance: float = 0.0,
    margin_sigmas: float = 3.0,
    use_symmetry: bool = True,
    visit: Literal["sets", "travel"] = "sets",
    spares: int | None = None,
    time_limit: float = 10.0,
    threads: int = 0,
) -> Plan:
    """Choose the poses to measure: for the reference leg, carried to the other legs by symmetry.

    Steps PS1 to PS3 of the paper (section 5.1). A leg that is not the image of another has its
    poses chosen for itself: every leg of a mechanism without symmetry.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    candidates : WorkspaceSample, or array_like of shape (n, coordinates)
        Poses to choose from, see `sample_workspace`.
    count : int, optional
        Poses that each leg is identified from, by default the protocol's.
    seed : int, optional
        By default the protocol's.
    design : {"legs", "orbits", "mechanism"}
        "legs": a set of `count` poses for each leg (the paper's). "orbits": `count` poses in all
        (rounded up to whole orbits), made of base poses and their images under the symmetry, which
        every leg uses. "mechanism": `count` poses in all, chosen for the parameters of all legs at
        once (the traditional way).
    rows : {"noise_aware", "paper"}
        What a pose is worth, see `observability_rows` and `mechanism_rows`.
    criterion : {"O1", "O2", "O3", "O4", "O5", "expected_error"}
        What is optimised, see `select_poses`; O2 to O5 with every parameter in units of its
        tolerance. "expected_error" is the expected mean squared end-effector error over the
        candidates (I- or V-optimality), see `error_weight`; it needs noise-aware rows.
    method : {"exchange", "sun_hollerbach", "exhaustive", "random", "all"}
        See `select_poses`.
    required : array_like, shape (k, coordinates), optional
        Poses that must be measured; they count among `count`, and serve all legs.
    measured : Measurements, optional
        What is measured already, to be augmented by `count` further poses.
    avoid : sequence of mappings, optional
        Regions without poses, such as ``{"x": (0.1, 0.3), "y": (-math.inf, 0.0)}``: limits of some
        of the coordinates x, y, phi (spatially x, y, z, rx, ry, rz; m and rad).
    minimum_distance : float
        Between the positions of any two poses of a set, m.
    margin_sigmas : float
        Poses stay away from the end of a leg's reach and from singularities by so many standard
        deviations of what the tolerances do to the closures, if that is more than the workspace's
        own margins: a robot with errors could not follow. See `Clearance`.
    use_symmetry : bool
        False chooses for every leg by itself. So it is, too, where required or measured poses tell
        the legs apart.
    visit : {"sets", "travel"}
        Order of the plan's rows: set by set, or a short way from home through all poses.
    spares : int, optional
        For each selection, by default half as many as poses.
    time_limit : float
        Of the proof of method "exhaustive", s.
    threads : int
        0 for as many as the machine has; the plan is the same with any number.

    Returns
    -------
    Plan
        With the certificates of its selections in `Plan.basis`.

    Raises
    ------
    NotIdentifiableError
        If no choice shows all parameters; names the combination.
    SymkinError
        For demands that contradict each other or the mechanism.
    """
    sampled = candidates if isinstance(candidates, WorkspaceSample) else None
    poses = np.ascontiguousarray(sampled.poses if sampled else candidates, dtype=np.float64)
    poses = np.atleast_2d(poses)
    demands = Demands(
        mechanism=mechanism,
        candidates=poses,
        conditions=sampled.conditions if sampled else None,
        required=poses[:0] if required is None else np.atleast_2d(np.asarray(required, float)),
        measured=measured,
        count=mechanism.protocol.pose_count if count is None else count,
        seed=mechanism.protocol.seed if seed is None else seed,
        design=design,
        rows=rows,
        criterion=criterion,
        method=method,
        avoid=avoid,
        minimum_distance=minimum_distance,
        margin_sigmas=margin_sigmas,
        spares=spares,
        time_limit=time_limit,
        threads=threads,
    )
    symmetric = use_symmetry and not demands.tells_legs_apart
    kept = demands.clearance()
    chosen = [
        choose(demands, task, kept)
        for task in design_tasks(mechanism, design, use_symmetry=symmetric)
    ]
    plan = _assemble(demands, chosen, kept)
    return _in_visiting_order(mechanism, plan, demands.seed) if visit == "travel" else plan


def _assemble(demands: Demands, chosen: Sequence[Chosen], kept: Clearance) -> Plan:
    """Join the sets of all selections; required poses begin the set of all legs."""
    mechanism = demands.mechanism
    sets = {0: [demands.required]} if len(demands.required) else {}
    spares: dict[int, Poses] = {}
    for found in chosen:
        for number, elements in found.task.sets:
            sets.setdefault(number, []).append(_images(mechanism, elements, found.poses))
            spares[number] = _images(mechanism, elements, found.spares)
    parts = [
        (number, spare, poses)
        for number, wanted in sorted(sets.items())
        for spare, poses in (
            (False, np.concatenate(wanted)),
            (True, spares.get(number, demands.required[:0])),
        )
    ]
    poses = np.concatenate([poses for _, _, poses in parts])
    order = [np.arange(1, len(poses) + 1) for _, _, poses in parts]
    for at, (_, spare, _) in enumerate(parts):
        if spare:  # spares go on counting behind the poses of their set
            order[at] = order[at] + len(order[at - 1])
    return Plan(
        leg_sets=np.concatenate([np.full(len(poses), number) for number, _, poses in parts]),
        order=np.concatenate(order),
        spare=np.concatenate([np.full(len(poses), spare) for _, spare, poses in parts]),
        poses=poses,
        readings=mechanism.inverse_kinematics(poses),
        basis=PlanBasis(
            design=demands.design,
            rows=demands.rows,
            criterion=demands.criterion,
            method=demands.method,
            seed=demands.seed,
            candidates=len(demands.candidates),
            excluded=max(found.excluded for found in chosen),
            clearance=kept,
            choices=tuple(found.record(len(mechanism.legs)) for found in chosen),
        ),
    )


def _images(mechanism: Mechanism, elements: Sequence[SymmetryElement], poses: Poses) -> Poses:
    """Carry poses by each element, all images of a pose together."""
    if not len(poses):
        return poses
    images = np.stack([map_poses(mechanism, element, poses) for element in elements], axis=1)
    return images.reshape(-1, poses.shape[1])


def _in_visiting_order(mechanism: Mechanism, plan: Plan, seed: int) -> Plan:
    """Put the rows in the order of a short way, spares behind."""
    wanted = np.flatnonzero(~plan.spare)
    way = wanted[visiting_order(mechanism, plan.poses[wanted], seed)]
    rows = np.concatenate([way, np.flatnonzero(plan.spare)])
    return replace(
        plan,
        leg_sets=plan.leg_sets[rows],
        order=plan.order[rows],
        spare=plan.spare[rows],
        poses=plan.poses[rows],
        readings=plan.readings[rows],
    )
