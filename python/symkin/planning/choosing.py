# SPDX-License-Identifier: MIT
"""One selection of a plan, with its constraints and its spares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.checks import undefined_angles
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import RowKind, error_weight, tolerances_of
from symkin.planning.designs import Design, Task
from symkin.planning.limits import (
    Clearance,
    Region,
    allowed_candidates,
    check_regions,
    clearance,
)
from symkin.planning.plan import ChosenPoses
from symkin.planning.selection import Criterion, Selection, SelectionMethod, select_poses
from symkin.planning.spares import spare_poses

__all__ = ["Chosen", "Demands", "choose"]

Poses = NDArray[np.float64]

_AVERAGED = 2000  # candidates over which the expected error is averaged


@dataclass(frozen=True)
class Demands:
    """What `make_plan` was asked for, by the names of its arguments."""

    mechanism: Mechanism
    candidates: Poses
    conditions: NDArray[np.float64] | None  # of the candidates, if known
    required: Poses
    measured: Measurements | None
    count: int
    seed: int
    design: Design
    rows: RowKind
    criterion: Criterion
    method: SelectionMethod
    avoid: Sequence[Region]
    minimum_distance: float
    margin_sigmas: float
    spares: int | None
    time_limit: float
    threads: int

    def __post_init__(self) -> None:
        """Refuse demands that do not go together."""
        if self.criterion == "expected_error" and self.rows == "paper":
            raise SymkinError(
                "the expected error follows from what the noise does, which the paper's rows do "
                'not know; choose rows "noise_aware"'
            )
        if self.design == "orbits" and (self.tells_legs_apart or self.minimum_distance):
            raise SymkinError(
                "orbits are chosen for one leg and serve all legs alike, so required poses, "
                "measured poses and a minimum distance do not go with them; choose the design "
                '"legs" or "mechanism"'
            )
        check_regions(self.mechanism, self.avoid)

    @property
    def tells_legs_apart(self) -> bool:
        """Whether what is given already shows more of one leg than of another."""
        return len(self.required) > 0 or self.measured is not None

    def clearance(self) -> Clearance:
        """How far candidates stay from where a robot with errors may not follow."""
        return clearance(self.mechanism, self.candidates, self.margin_sigmas)


@dataclass(frozen=True)
class Chosen:
    """What came of a task: poses and spares before they are carried to the legs."""

    task: Task
    selection: Selection
    poses: Poses
    spares: Poses
    excluded: int

    def record(self, leg_count: int) -> ChosenPoses:
        """What a plan keeps of it."""
        legs = tuple(number for number, _ in self.task.sets)
        return ChosenPoses(
            legs=tuple(range(1, leg_count + 1)) if legs == (0,) else legs,
            elements=tuple(element.label for element in self.task.elements),
            selection=self.selection,
        )


def choose(demands: Demands, task: Task, kept: Clearance) -> Chosen:
    """Select the poses of a task and their spares."""
    mechanism, required = demands.mechanism, demands.required
    allowed = allowed_candidates(
        mechanism, task, demands.candidates, demands.conditions, demands.avoid, kept
    )
    excluded = int(np.count_nonzero(~allowed))
    if demands.method != "all" and len(allowed) - excluded < demands.count - len(required):
        raise SymkinError(
            f"{demands.count} poses are wanted, but only {len(allowed) - excluded} of "
            f"{len(allowed)} candidates may be measured: the others, or their images under the "
            "symmetry, lie outside the workspace's box, in a region to avoid, within "
            f"{kept.reach_margin:.3g} m of the end of a leg's reach, or are conditioned worse than "
            f"{kept.conditioning_limit:.3g}"
        )
    poses = demands.candidates
    if len(required):  # behind the candidates: nobody else may choose them
        poses = np.concatenate([poses, required])
        allowed = np.concatenate([allowed, np.ones(len(required), dtype=np.bool_)])
    numbers = np.arange(len(demands.candidates), len(poses), dtype=np.intp)
    rows = task.candidate_rows(mechanism, poses, demands.rows)
    wanted = demands.count
    if task.is_orbit:
        wanted = -(-wanted // len(task.elements))
    prior = _prior(demands, task)
    selection = _select(
        demands,
        task,
        rows,
        wanted,
        demands.seed,
        method=demands.method,
        criterion=demands.criterion,
        required=numbers.tolist(),
        forbidden=~allowed,
        prior=prior,
        time_limit=demands.time_limit,
        threads=demands.threads,
        parameter_names=task.parameter_names(mechanism),
        **_distances(demands, poses),
        **_criterion_settings(demands, task),
    )
    chosen = np.setdiff1d(selection.indices, numbers)
    spare_count = -(-len(chosen) // 2) if demands.spares is None else demands.spares
    spares = poses[:0]
    if spare_count:
        available = allowed.copy()
        available[numbers] = False
        found = spare_poses(
            mechanism,
            poses,
            lambda some: task.rows(mechanism, some, demands.rows),
            selection.indices,
            available,
            prior,
            spare_count,
            demands.seed,
        )
        spares = poses[found]
    return Chosen(task, selection, poses[chosen], spares, excluded)


def _select(demands: Demands, task: Task, *args: Any, **settings: Any) -> Selection:
    """Select; a refusal says so if a joint's angle is undefined, which no pose can show."""
    try:
        return select_poses(*args, **settings)
    except NotIdentifiableError as error:
        legs = range(len(demands.mechanism.legs)) if task.leg is None else [task.leg]
        causes = [each for leg in legs for each in undefined_angles(demands.mechanism, leg)]
        error.args = ("; ".join([str(error), *causes]),)
        raise


def _prior(demands: Demands, task: Task) -> NDArray[np.float64] | None:
    """Information of what is measured already; rows in which a reading is missing do not count."""
    measured = demands.measured
    if measured is None:
        return None
    readings = measured.readings if task.leg is None else measured.readings[:, [task.leg]]
    complete = np.isfinite(readings).all(axis=1)
    rows = task.measured_rows(demands.mechanism, measured.poses[complete], demands.rows)
    rows = rows[np.isfinite(rows).all(axis=(1, 2))]  # beyond the nominal reach
    return np.asarray(np.einsum("nri,nrj->ij", rows, rows))


def _distances(demands: Demands, poses: Poses) -> dict[str, Any]:
    if not demands.minimum_distance:
        return {}
    size = 3 if demands.mechanism.pose_space == "spatial" else 2
    return {"coordinates": poses[:, :size], "minimum_distance": demands.minimum_distance}


def _criterion_settings(demands: Demands, task: Task) -> dict[str, Any]:
    mechanism, p = demands.mechanism, len(demands.mechanism.parameter_names)
    legs = range(len(mechanism.legs)) if task.leg is None else [task.leg]
    tolerances = tolerances_of(mechanism.tolerances)
    scale = np.concatenate([tolerances.deviations(mechanism.core, leg) for leg in legs])
    if demands.criterion != "expected_error":
        return {"scale": scale}
    some = demands.candidates[:: -(-len(demands.candidates) // _AVERAGED)]
    own = slice(legs[0] * p, (legs[-1] + 1) * p)
    return {"scale": scale, "error_weight": error_weight(mechanism, some)[own, own]}
