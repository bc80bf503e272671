# SPDX-License-Identifier: MIT
"""How a plan is made: poses and spares are chosen for each task of the design, and carried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.analysis.checks import undefined_angles
from symkin.analysis.observability import RowKind
from symkin.analysis.observed import Observed, Observing
from symkin.analysis.promises import CONFIDENCE, thinned
from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.data.pose_tables import as_poses
from symkin.data.reading import Measured, as_measurements
from symkin.errors import NotIdentifiableError, SymkinError, one_of
from symkin.estimate.options import Unknowns
from symkin.estimate.survey import Survey
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry import Carrying, map_poses
from symkin.options import Visit, checks
from symkin.planning.basis import ChosenPoses, PlanBasis
from symkin.planning.observing import ObservedTask, dealt, where_observed
from symkin.planning.plan import Plan
from symkin.planning.selection import (
    Clearance,
    Criterion,
    Design,
    Region,
    Selection,
    SelectionMethod,
    Task,
    allowed_candidates,
    check_regions,
    clearance,
    design_tasks,
    select_poses,
)
from symkin.planning.visiting import there_and_back, visiting_order
from symkin.storage.tables import TableSource
from symkin.values import Array, record

Poses = Array

_THINNED = 2000  # candidates among which spares are sought
_TIME_LIMIT = 10.0  # s
_MOST_KEPT = 100_000  # candidates in a plan: 11 MB of its file


class Choosing(TypedDict, total=False):
    """How poses are chosen."""

    design: Design | None
    rows: RowKind
    criterion: Criterion


class ChoosingForPlan(Choosing, total=False):
    """And where a plan is made."""

    method: SelectionMethod
    margin_sigmas: float


class PlanOptions(ChoosingForPlan, Unknowns, total=False):
    """And from what, for what."""

    required: ArrayLike | WorkspaceSample | TableSource | None
    measured: Measured | None
    avoid: Sequence[Region] | None
    minimum_distance: float
    symmetry: bool
    visit: Visit | None
    spares: int | None
    time_limit: float | None
    threads: int
    confidence: float
    observe: Observing | None


@checks()
def plan(
    mechanism: MechanismGiven,
    pose_count: int | None = None,
    *,
    candidates: int | ArrayLike | WorkspaceSample | None = None,
    seed: int | None = None,
    **options: Unpack[PlanOptions],
) -> Plan:
    """Choose the poses to measure out of a mechanism's workspace, as ``symkin plan`` does.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    pose_count : int, optional
        Poses that each leg is identified from, by default the protocol's.
    candidates : int, or poses, optional
        How many poses are drawn from the workspace to choose from, by default the protocol's; or
        these themselves, see `make_plan`.
    seed : int, optional
        Of the candidates and the selection, by default the protocol's.
    **options
        See `make_plan`.

    Returns
    -------
    Plan
        With the certificates of its selections in `Plan.basis`.

    Raises
    ------
    SymkinError
        As `make_plan` and `sample_workspace`.
    """
    mechanism = as_mechanism(mechanism)
    if candidates is None or isinstance(candidates, int | np.integer):
        number = None if candidates is None else int(candidates)
        candidates = sample_workspace(mechanism, number, seed)
    return make_plan(mechanism, candidates, pose_count, seed, **options)


def usual_visit(mechanism: Mechanism) -> Visit:
    """The order of the poses if nobody says one."""
    return "there_and_back" if mechanism.device is None else mechanism.device.visit


def for_all_parameters(mechanism: Mechanism) -> Mechanism:
    """A mechanism whose plans are for all parameters of all legs, whatever its file says."""
    return mechanism if mechanism.identification is None else mechanism.replace(identification=None)


def default_design(survey: Survey | None) -> Design:
    """The design of whoever says none: what is observed or unknown otherwise needs all at once."""
    return "legs" if survey is None else "mechanism"


@checks("candidates")
def make_plan(
    mechanism: MechanismGiven,
    candidates: ArrayLike | WorkspaceSample,
    pose_count: int | None = None,
    seed: int | None = None,
    **options: Unpack[PlanOptions],
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
    pose_count : int, optional
        Poses that each leg is identified from, by default the protocol's.
    seed : int, optional
        By default the protocol's.
    design : {"legs", "orbits", "mechanism"}, optional
        "legs", the default: a set of `pose_count` poses for each leg (the paper's). "orbits":
        `pose_count` poses in all (rounded up to whole orbits), made of base poses and their images
        under the symmetry, which every leg uses. "mechanism": `pose_count` poses in all, chosen for
        the parameters of all legs at once (the traditional way); the default where something else
        is observed or unknown.
    rows : {"noise_aware", "paper"}
        What a pose is worth, see `observability_rows` and `mechanism_rows`.
    criterion : {"O1", "O2", "O3", "O4", "O5", "expected_error"}
        What is optimised, see `select_poses`; O2 to O5 with every parameter in units of its
        tolerance. "expected_error" is the expected mean squared end-effector error over the
        candidates (I- or V-optimality), see `error_weight`; it needs noise-aware rows.
    method : {"exchange", "sun_hollerbach", "exhaustive", "random", "all"}
        See `select_poses`.
    required : WorkspaceSample, array_like of shape (k, coordinates), or a table, optional
        Poses that must be measured, or what `read_pose_list` reads; they count among `pose_count`,
        and serve all legs.
    measured : Measurements, or what `read_measurements` reads, optional
        What is measured already, to be augmented by `pose_count` further poses.
    avoid : sequence of mappings, optional
        Regions without poses, such as ``{"x": (0.1, 0.3), "y": (-math.inf, 0.0)}``: limits of some
        of the coordinates x, y, phi (spatially x, y, z, rx, ry, rz; m and rad).
    minimum_distance : float
        Between the positions of any two poses of a set, m.
    margin_sigmas : float
        Poses stay away from the end of a leg's reach and from singularities by so many standard
        deviations of what the tolerances do to the closures, if that is more than the workspace's
        own margins: a robot with errors could not follow. See `Clearance`.
    symmetry : bool
        False chooses for every leg by itself. So it is, too, where required or measured poses tell
        the legs apart.
    visit : {"there_and_back", "travel", "sets"}, optional
        Order of the plan's rows, by default as the mechanism's device has it, or there and back:
        along a short way from home, every second pose going and the
        others coming back, so that a drift is not taken for geometry; the short way itself; or set
        by set.
    spares : int, optional
        For each selection, by default half as many as poses.
    time_limit : float, optional
        Of the proof of method "exhaustive", s; by default 10.
    threads : int
        0 for as many as the machine has; the plan is the same with any number.
    confidence : float
        Share of all such robots that are within the bounds of `Plan.expected`.
    observe : Observed, str or sequence of str, optional
        What will be observed besides the readings, by default what the mechanism's device does, or
        full poses. A frame, point or anchor
        that it does not give is where the mechanism's `frames` has it. The poses are then chosen
        for everything that is unknown at once, as `identify` estimates it, with noise-aware rows;
        the design is "mechanism". With heights alone, a platform that never turns probes a bed:
        the candidates are put on the plane, which is unknown, and the tolerances are priors, as
        `identify` has it. With straightness alone they are put on the edge, the x axis of the
        device's frame. For what is observed between rows (separation, rise, offset) poses are
        chosen in pairs: rows 1 and 2, 3 and 4 and so on, an odd number rounded up.
    **unknowns
        `free`, `fixed`, `shared`, `tie`, `prior`, `frames` and `sensor` of `identify`: what is
        unknown; by default what the mechanism's `identification` says, or all parameters. Priors
        count as information that is there beforehand. As with `observe`, the design is "mechanism".

    Returns
    -------
    Plan
        With the certificates of its selections in `Plan.basis`.

    Raises
    ------
    NotIdentifiableError
        If no choice shows all parameters, or unknowns; names the combination.
    SymkinError
        For demands that contradict each other or the mechanism.
    """
    mechanism = as_mechanism(mechanism)
    said: dict[str, Any] = dict(options)
    unknowns = {name: said.pop(name, None) for name in Unknowns.__annotations__}
    observed = Observed.of(mechanism, said.pop("observe", None))
    visit = one_of("visit", said.pop("visit", None) or usual_visit(mechanism), Visit)
    symmetry, margin_sigmas = said.pop("symmetry", True), said.pop("margin_sigmas", 3.0)
    required, measured = said.pop("required", None), said.pop("measured", None)
    given = pose_rows(candidates)
    poses = where_observed(mechanism, observed, given)
    sample = candidates if isinstance(candidates, WorkspaceSample) and poses is given else None
    survey = Survey.of(mechanism, poses, observed, unknowns)
    design = said.pop("design", None) or default_design(survey)
    demands = _Demands(
        mechanism=mechanism,
        candidates=poses,
        sample=sample,
        required=poses[:0] if required is None else as_poses(required, mechanism),
        measured=None if measured is None else as_measurements(measured, mechanism),
        count=mechanism.protocol.pose_count if pose_count is None else pose_count,
        seed=mechanism.protocol.seed if seed is None else seed,
        design=design,
        survey=survey,
        avoid=said.pop("avoid", None) or (),
        **said,
    )
    symmetric = symmetry and not demands.tells_legs_apart
    kept = clearance(mechanism, poses, margin_sigmas)
    tasks = design_tasks(mechanism, design, use_symmetry=symmetric)
    if survey is not None:
        tasks = [ObservedTask(**vars(task), survey=survey) for task in tasks]
    chosen = [_choose(demands, task, kept) for task in tasks]
    plan = _assemble(demands, chosen, kept)
    return plan if visit == "sets" else in_visiting_order(plan, demands.seed, visit)


def _assemble(demands: _Demands, chosen: Sequence[_Chosen], kept: Clearance) -> Plan:
    """Join the sets of all selections; required poses begin the set of all legs."""
    mechanism = demands.mechanism
    sets = {ALL_LEGS: [demands.required]} if len(demands.required) else {}
    spares: dict[int, Poses] = {}
    for found in chosen:
        for leg, elements in found.task.sets:
            sets.setdefault(leg, []).append(_images(mechanism, elements, found.poses))
            spares[leg] = _images(mechanism, elements, found.spares)
    parts = [
        (leg, spare, poses)
        for leg, wanted in sorted(sets.items())
        for spare, poses in (
            (False, np.concatenate(wanted)),
            (True, spares.get(leg, demands.required[:0])),
        )
    ]
    poses = np.concatenate([poses for _, _, poses in parts])
    order = [np.arange(1, len(poses) + 1) for _, _, poses in parts]
    for at, (_, spare, _) in enumerate(parts):
        if spare:  # spares go on counting behind the poses of their set
            order[at] = order[at] + len(order[at - 1])
    return Plan(
        mechanism=mechanism,
        leg_sets=np.concatenate([np.full(len(poses), leg) for leg, _, poses in parts]),
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
            survey=demands.survey,
        ),
        candidates=_kept(demands),
        measured=demands.measured,
        confidence=demands.confidence,
    )


def _kept(demands: _Demands) -> WorkspaceSample | Poses:
    """The candidates, or as many as a plan keeps, evenly spread over them."""
    sample = demands.sample
    if sample is None:
        return np.ascontiguousarray(thinned(demands.candidates, _MOST_KEPT))
    columns = ("poses", "readings", "conditions", "shown", "as_drawn")
    values = {name: getattr(sample, name) for name in columns}
    kept: dict[str, Any] = {
        name: np.ascontiguousarray(thinned(each, _MOST_KEPT))
        for name, each in values.items()
        if each is not None
    }
    return replace(sample, **kept)


def _images(mechanism: Mechanism, elements: Sequence[Carrying], poses: Poses) -> Poses:
    """Carry poses by each element, all images of a pose together."""
    if not len(poses):
        return poses
    images = np.stack([map_poses(mechanism, element, poses) for element in elements], axis=1)
    return images.reshape(-1, poses.shape[1])


def in_visiting_order(plan: Plan, seed: int, visit: Visit) -> Plan:
    """Put the rows in the order of a short way, spares behind."""
    wanted = np.flatnonzero(~plan.spare)
    survey = None if plan.basis is None else plan.basis.survey
    together = 1 if survey is None else survey.together
    first = wanted[::together]
    way = first[visiting_order(plan.mechanism, plan.poses[first], seed)]
    if visit == "there_and_back":
        way = there_and_back(way)
    way = (way[:, None] + np.arange(together)).ravel()
    rows = np.concatenate([way, np.flatnonzero(plan.spare)])
    return replace(
        plan,
        leg_sets=plan.leg_sets[rows],
        order=plan.order[rows],
        spare=plan.spare[rows],
        poses=plan.poses[rows],
        readings=plan.readings[rows],
    )


@record
class _Demands:
    """What `make_plan` was asked for, by the names of its arguments."""

    mechanism: Mechanism
    candidates: Poses
    sample: WorkspaceSample | None  # the candidates, if they are one
    required: Poses
    measured: Measurements | None
    count: int
    seed: int
    design: Design
    survey: Survey | None
    rows: RowKind = "noise_aware"
    criterion: Criterion = "O1"
    method: SelectionMethod = "exchange"
    avoid: Sequence[Region] = ()
    minimum_distance: float = 0.0
    spares: int | None = None
    time_limit: float | None = None
    confidence: float = CONFIDENCE
    threads: int = 0

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
        if self.time_limit is not None and self.method != "exhaustive":
            raise SymkinError(
                f'a time limit is of the proof of the method "exhaustive"; the method is '
                f'"{self.method}"'
            )
        if self.survey is not None and self.design != "mechanism":
            raise SymkinError(
                f'the design "{self.design}" is chosen from full poses for the parameters of one '
                "leg, so what is observed or unknown otherwise does not go with it; choose the "
                'design "mechanism"'
            )
        if self.survey is not None and self.rows == "paper":
            raise SymkinError(
                "the paper's rows know full poses and all parameters alone, so what is observed or "
                'unknown otherwise does not go with them; choose rows "noise_aware"'
            )
        if self.together > 1 and (self.tells_legs_apart or self.minimum_distance):
            raise SymkinError(
                "poses are chosen in pairs for what is observed between them, beside which there "
                "are no required or measured poses and no minimum distance"
            )
        check_regions(self.mechanism, self.avoid)
        readings = self.mechanism.inverse_kinematics(self.required)
        beyond = np.argwhere(~self.mechanism.within_limits(readings))
        if len(beyond):
            pose, leg = beyond[0].tolist()
            what = "joint limits" if np.isfinite(readings[pose, leg]) else "reach"
            whose = self.mechanism.named_legs([leg])
            raise SymkinError(f"required pose {pose + 1} is beyond the {what} of {whose}")

    @property
    def together(self) -> int:
        """How many poses a candidate has."""
        return 1 if self.survey is None else self.survey.together

    @property
    def tells_legs_apart(self) -> bool:
        """Whether what is given already shows more of one leg than of another."""
        return len(self.required) > 0 or self.measured is not None


@record
class _Chosen:
    """What came of a task: poses and spares before they are carried to the legs."""

    task: Task
    selection: Selection
    poses: Poses
    spares: Poses
    excluded: int

    def record(self, leg_count: int) -> ChosenPoses:
        """What a plan keeps of it."""
        legs = tuple(leg for leg, _ in self.task.sets)
        return ChosenPoses(
            legs=tuple(range(leg_count)) if legs == (ALL_LEGS,) else legs,
            elements=tuple(element.label for element in self.task.elements),
            selection=self.selection,
        )


def _choose(demands: _Demands, task: Task, kept: Clearance) -> _Chosen:
    """Select the poses of a task and their spares."""
    required, together = demands.required, demands.together
    allowed = _allowed(demands, task, kept)
    excluded = int(np.count_nonzero(~allowed))
    wanted = -(-demands.count // together)  # candidates: poses, or pairs of them
    if demands.method != "all" and len(allowed) - excluded < together * wanted - len(required):
        raise SymkinError(
            f"{together * wanted} poses are wanted, but only {len(allowed) - excluded} of "
            f"{len(allowed)} candidates may be measured: the others, or their images under the "
            "symmetry, lie outside the workspace's box, beyond joint limits, in a region to avoid, "
            f"within {kept.reach_margin:.3g} {kept.closure_unit} of the end of a leg's reach, or "
            f"are conditioned worse than {kept.conditioning_limit:.3g}"
            f"{_without_images(demands, kept)}"
        )
    poses = demands.candidates[:, None]  # those of each candidate
    prior = task.prior(demands.measured, demands.rows)
    if together > 1:
        poses = dealt(demands.candidates[allowed], together, demands.seed)
        allowed = np.ones(len(poses), dtype=np.bool_)
    numbers = np.arange(len(poses), len(poses) + len(required), dtype=np.intp)
    if len(required):  # behind the candidates: nobody else may choose them
        poses = np.concatenate([poses, required[:, None]])
        allowed = np.concatenate([allowed, np.ones(len(required), dtype=np.bool_)])
    rows = _grouped(task.candidate_rows(_flat(poses), demands.rows), together)
    if task.is_orbit:
        wanted = -(-wanted // len(task.elements))
    settings: dict[str, Any] = {}
    if demands.minimum_distance:
        settings["coordinates"] = poses[:, 0, : demands.mechanism.space.size]
        settings["minimum_distance"] = demands.minimum_distance
    settings |= {"required": numbers.tolist(), "forbidden": ~allowed}
    selection = _selected(demands, task, rows, wanted, prior, **settings)
    chosen = np.setdiff1d(selection.indices, numbers)
    spare_count = -(-len(chosen) // 2)
    if demands.spares is not None:
        spare_count = -(-demands.spares // together)
    spares = poses[:0]
    if spare_count:
        available = allowed.copy()
        available[numbers] = False
        found = _spares(demands, task, poses, selection.indices, available, prior, spare_count)
        spares = poses[found]
    return _Chosen(task, selection, _flat(poses[chosen]), _flat(spares), excluded)


def _flat(poses: Poses) -> Poses:
    """Poses of candidates, one behind the other."""
    return poses.reshape(-1, poses.shape[-1])


def _grouped(rows: Any, together: int) -> Any:
    """Rows of candidates of so many poses; of single ones as they are."""
    if together == 1:
        return rows
    return np.ascontiguousarray(rows.reshape(len(rows) // together, -1, rows.shape[-1]))


def _selected(
    demands: _Demands,
    task: Task,
    rows: Any,
    wanted: int,
    prior: Array | None,
    **settings: Any,
) -> Selection:
    """Select of the rows of candidates."""
    settings["scale"] = task.scale()
    if demands.criterion == "expected_error":
        settings["error_weight"] = task.error_weight(thinned(demands.candidates))
    try:
        return select_poses(
            rows,
            wanted,
            demands.seed,
            method=demands.method,
            criterion=demands.criterion,
            prior=prior,
            time_limit=_TIME_LIMIT if demands.time_limit is None else demands.time_limit,
            threads=demands.threads,
            parameter_names=task.parameter_names(),
            **settings,
        )
    except NotIdentifiableError as error:  # maybe of a joint whose angle no pose can show
        legs = range(len(demands.mechanism.legs)) if task.leg is None else [task.leg]
        causes = [each for leg in legs for each in undefined_angles(demands.mechanism, leg)]
        error.args = ("; ".join(filter(None, [str(error), *causes, task.advice(error.unseen)])),)
        raise


def _allowed(demands: _Demands, task: Task, kept: Clearance) -> NDArray[np.bool_]:
    """The candidates that may be measured, with all images that the task has of them."""
    conditions = None if demands.sample is None else demands.sample.conditions
    return allowed_candidates(task, demands.candidates, conditions, demands.avoid, kept)


def _without_images(demands: _Demands, kept: Clearance) -> str:
    """What to say if poses without images would be enough, as in a box without the symmetry."""
    tasks = design_tasks(demands.mechanism, "legs", use_symmetry=False)
    left = min(int(_allowed(demands, task, kept).sum()) for task in tasks)
    if left < demands.count - len(demands.required):
        return ""
    return (
        f". Without images {left} may be: choose for all legs at once (design mechanism), or for "
        "each by itself (symkin plan --no-symmetry, in Python symmetry=False)"
    )


def _spares(
    demands: _Demands,
    task: Task,
    poses: Poses,
    chosen: NDArray[np.intp],
    allowed: NDArray[np.bool_],
    prior: Array | None,
    count: int,
) -> NDArray[np.intp]:
    """Candidates to replace chosen poses that a real robot cannot take, best first.

    The best poses crowd at the rim of the workspace, where a robot with errors misses neighbours
    together. Spares keep twice the distance from singularities and complete the chosen poses that
    do so too.
    """
    mechanism = demands.mechanism
    together = poses.shape[1]
    few = np.flatnonzero(allowed)[:: -(-len(poses) // _THINNED)]
    is_chosen = np.zeros(len(poses), dtype=np.bool_)
    is_chosen[chosen] = True
    looked_at = is_chosen.copy()
    looked_at[few] = True
    some = np.flatnonzero(looked_at)
    is_chosen = is_chosen[some]
    rows = _grouped(task.rows(_flat(poses[some]), demands.rows), together)
    limit = mechanism.workspace.conditioning_limit / 2 if mechanism.workspace else np.inf
    conditioning = mechanism.singularity_measures(_flat(poses[some]))[2]
    safe = np.asarray(conditioning.reshape(-1, together).max(axis=1) <= limit)
    if np.count_nonzero(safe & ~is_chosen) < count:
        safe[:] = True
    # Poses that may be missed count for little, but keep the information regular.
    weights = np.where(safe[is_chosen], 1.0, 0.01)[:, None, None]
    information = np.einsum("nri,nrj->ij", rows[is_chosen], weights * rows[is_chosen])
    if prior is not None:
        information = information + prior
    left = np.flatnonzero(safe & ~is_chosen)
    if len(left) <= count:
        return np.asarray(some[left])
    found = select_poses(rows[left], count, demands.seed, prior=information)
    return np.asarray(some[_best_first(left[found.indices], rows, information)])


def _best_first(indices: NDArray[np.intp], rows: Array, information: Array) -> NDArray[np.intp]:
    """Order candidates so that each adds most to the information of those before it."""
    added = rows[indices].transpose(0, 2, 1) @ rows[indices]
    order: list[int] = []
    for _ in indices:
        determinants = np.linalg.slogdet(information + added)[1]
        determinants[order] = -np.inf
        order.append(int(determinants.argmax()))
        information = information + added[order[-1]]
    return indices[order]
