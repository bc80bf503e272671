# SPDX-License-Identifier: MIT
"""Selection of the poses to measure: for whose parameters, among which candidates, how good."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.analysis.observability import (
    RowKind,
    error_weight,
    mechanism_rows,
    observability_rows,
    with_combinations,
)
from symkin.analysis.workspace import (
    WorkspaceSample,
    closure_deviation,
    coordinate_names,
    inside_box,
    least_reach_margin,
    workspace_coordinates,
)
from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.errors import NotIdentifiableError, SymkinError, one_of
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry import (
    Carrying,
    SymmetryElement,
    leg_carriers,
    map_poses,
    observability_group,
    symmetry_group,
)
from symkin.model.symmetry.groups import core_pairs
from symkin.model.tolerances import noise_of, parameter_tolerances
from symkin.options import Criterion, Design, SelectionMethod, checks
from symkin.values import Array, Value, field, record

__all__ = [
    "Certificate",
    "Clearance",
    "Criterion",
    "Design",
    "LegRows",
    "Region",
    "Selection",
    "SelectionMethod",
    "Task",
    "allowed_candidates",
    "check_regions",
    "clearance",
    "design_tasks",
    "select_poses",
]

Region = Mapping[str, tuple[float, float]]

_BLOCK = 2**17  # candidates
_SAMPLE = 200  # poses at which the effect of the tolerances is evaluated


@record
class Certificate(Value):
    """How far a selection can be from the best possible one.

    Efficiencies of the determinant are ``(det M / bound)**(1/p)``: 1 for the best, and no selection
    exceeds it.

    Attributes
    ----------
    efficiency : float
        By the criterion that was optimised, against what no selection of distinct poses exceeds:
        of the determinant for O1, value over bound for O2 to O5, bound over value for
        "expected_error".
    o1_efficiency : float
        Of the determinant (O1), against the bound for distinct poses, whatever the criterion.
    efficiency_repeats : float
        Of the determinant, against the Kiefer-Wolfowitz bound, which lets a pose be measured more
        than once.
    proven_optimal : bool
        No other selection is better by more than rounding.
    """

    efficiency: float
    o1_efficiency: float
    efficiency_repeats: float
    proven_optimal: bool


@record
class Selection(Value):
    """Candidates chosen for measurement.

    Attributes
    ----------
    indices : ndarray of int, shape (N,)
        Rows of the candidates, from 0, ascending.
    log_det : float
        Logarithm of det(C'C) of the chosen rows (and of the prior).
    criterion : str
        What was optimised.
    criterion_value : float
        Its value: O1 to O5, or trace(M^-1 B).
    certificate : Certificate
        How far it can be from the best.
    spares : ndarray of int
        Further candidates, in the order in which they add most to the chosen ones.
    nodes : int
        Nodes of the proof's search tree; 0 without one.
    """

    indices: NDArray[np.intp] = field(number=True)
    log_det: float
    criterion: Criterion
    criterion_value: float
    certificate: Certificate
    spares: NDArray[np.intp] = field(number=True)
    nodes: int


class LegRows:
    """Observability rows of one leg at candidate poses, made when a selection needs them.

    Many candidates then need no array of rows, and all threads make them. The rows are those of
    `observability_rows`.

    Parameters
    ----------
    mechanism : Mechanism
        Its noise weighs the rows of kind "noise_aware".
    leg : int
        From 0.
    poses : WorkspaceSample, or array_like of shape (n, coordinates)
        Candidate poses.
    kind : {"paper", "noise_aware"}
        See `observability_rows`.
    orbit : sequence of SymmetryElement, SymmetryPair or str, optional
        Elements of the mechanism's group, such as ``("r0", "r1", "r2")``. Each candidate then
        stands for all poses to which they carry it (see `map_poses`), and brings one row for each
        element: that of the leg at the carried pose. Measured at whole orbits, legs that the group
        carries onto each other are all seen equally well.

    Raises
    ------
    SymkinError
        For a leg that does not exist or poses of the wrong shape.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        leg: int,
        poses: ArrayLike | WorkspaceSample,
        kind: RowKind = "paper",
        *,
        orbit: Sequence[Carrying | str] = ("r0",),
    ) -> None:
        self.core = _core.LegRows(
            mechanism.straight,
            leg,
            pose_rows(poses),
            one_of("kind of rows", kind, _core.RowKind.__members__),
            noise_of(mechanism.noise),
            core_pairs(mechanism, orbit),
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Candidates, rows of each, parameters."""
        return self.core.size, self.core.rows_per_pose, self.core.parameters


@checks("rows", "prior", "count", "spares")
def select_poses(
    rows: ArrayLike | LegRows,
    count: int,
    seed: int = 1,
    *,
    method: SelectionMethod = "exchange",
    criterion: Criterion = "O1",
    spares: int = 0,
    required: Sequence[int] = (),
    forbidden: ArrayLike | None = None,
    prior: ArrayLike | None = None,
    coordinates: ArrayLike | None = None,
    minimum_distance: float = 0.0,
    scale: ArrayLike | None = None,
    error_weight: ArrayLike | None = None,
    time_limit: float = 10.0,
    threads: int = 0,
    memory_limit: int = 768 << 20,
    parameter_names: Sequence[str] | None = None,
) -> Selection:
    """Choose the candidates whose measurement tells most of the parameters (Eqs. 12, 13).

    Parameters
    ----------
    rows : array_like, shape (n, p) or (n, r, p), or LegRows
        One row of the identification matrix a candidate, or r of them (the whole mechanism at
        once: one a leg); see `observability_rows`. An array of C-contiguous float64 is not copied.
    count : int
        Number of poses to choose, the required ones included.
    seed : int
        Of what is random. The same seed gives the same poses on any number of threads.
    method : {"exchange", "sun_hollerbach", "exhaustive", "random", "all"}
        Approximate design, rounding and exchange; Sun and Hollerbach's add and drop, for
        comparison; the exchange with a proof by branch and bound; and two baselines.
    criterion : {"O1", "O2", "O3", "O4", "O5", "expected_error"}
        The observability index, or trace(M^-1 B) with B = `error_weight`.
    spares : int
        Number of further candidates, to replace poses that cannot be taken.
    required : sequence of int
        Candidates that must be chosen.
    forbidden : array_like of bool, shape (n,), optional
        Candidates that must not be chosen.
    prior : array_like, shape (p, p), optional
        Information matrix of what is measured already.
    coordinates : array_like, shape (n, m), optional
        Where the candidates are, for
    minimum_distance : float
        between any two chosen ones, in the unit of `coordinates`.
    scale : array_like, shape (p,), optional
        Unit of each parameter in O1 to O5 and in messages, such as its tolerance; O1 chooses the
        same in any.
    error_weight : array_like, shape (p, p), optional
        B of the expected error.
    time_limit : float
        Of the proof, s.
    threads : int
        0 for as many as the machine has.
    memory_limit : int
        Bytes in which the rows of `LegRows` are kept. More are made again in each of the passes
        over all candidates, usually four: as many times slower, but in little memory.
    parameter_names : sequence of str, optional
        To name the combinations that nothing shows in the error message.

    Raises
    ------
    NotIdentifiableError
        If no choice of so many candidates shows all parameters; names the combination.
    SymkinError
        For options that contradict each other, or rows that are not finite.
    """
    options = _core.SelectionOptions()
    options.count, options.seed, options.spare_count = count, seed, spares
    options.method = one_of("method", method, _core.SelectionMethod.__members__)
    options.criterion = one_of("criterion", criterion, _core.Criterion.__members__)
    options.required = list(required)
    options.minimum_distance, options.time_limit_s = minimum_distance, time_limit
    options.threads, options.memory_limit_bytes = threads, memory_limit
    if forbidden is not None:
        options.forbidden = array_of("forbidden", forbidden, 1).astype(bool)
    for name, field_, array, dimensions in (
        ("prior", "prior", prior, 2),
        ("coordinates", "coordinates", coordinates, 2),
        ("scale", "column_scale", scale, 1),
        ("error_weight", "error_weight", error_weight, 2),
    ):
        if array is not None:
            setattr(options, field_, array_of(name, array, dimensions))
    try:
        result = _select(rows, options)
    except NotIdentifiableError as error:
        raise with_combinations(error, parameter_names, options.column_scale) from None
    return _selection(result, criterion)


def array_of(name: str, given: ArrayLike, *dimensions: int) -> Array:
    """Return an array of numbers of so many dimensions."""
    values = np.ascontiguousarray(given, dtype=np.float64)
    if np.ndim(given) not in dimensions:
        expected = " or ".join(map(str, dimensions))
        raise SymkinError(f"{name} has {np.ndim(given)} dimensions; expected {expected}")
    return values


def _select(rows: ArrayLike | LegRows, options: _core.SelectionOptions) -> _core.Selection:
    if isinstance(rows, LegRows):
        return _core.select_poses(rows.core, options)
    values = array_of("rows", rows, 2, 3)
    per_pose = values.shape[1] if values.ndim == 3 else 1
    return _core.select_poses(values.reshape(-1, values.shape[-1]), per_pose, options)


def _selection(result: _core.Selection, criterion: Criterion) -> Selection:
    certificate = result.certificate
    return Selection(
        indices=np.array(result.indices, dtype=np.intp),
        log_det=result.log_det,
        criterion=criterion,
        criterion_value=result.criterion_value,
        certificate=Certificate(
            efficiency=certificate.criterion_efficiency,
            o1_efficiency=certificate.efficiency_distinct,
            efficiency_repeats=certificate.efficiency_repeats,
            proven_optimal=certificate.proven_optimal,
        ),
        spares=np.array(result.spares, dtype=np.intp),
        nodes=result.nodes,
    )


@record
class Task:
    """One selection of a design."""

    mechanism: Mechanism  # the nominal one
    leg: int | None  # the leg, from 0, whose parameters it shows; None for those of all legs
    # The sets that it gives: the leg (from 0; -1 for all legs) and the elements that carry each
    # chosen pose into the set.
    sets: tuple[tuple[int, tuple[Carrying, ...]], ...]

    @property
    def elements(self) -> tuple[Carrying, ...]:
        """All elements that carry its poses, in the order of the sets."""
        return tuple(element for _, elements in self.sets for element in elements)

    @property
    def is_orbit(self) -> bool:
        """Whether every chosen pose is measured at its images too."""
        return any(len(elements) > 1 for _, elements in self.sets)

    def candidate_rows(self, poses: Array, kind: RowKind) -> Array | LegRows:
        """Rows that candidates bring to a selection; those of one leg need not be held."""
        if self.leg is None:
            return mechanism_rows(self.mechanism, poses, kind)
        orbit = self.elements if self.is_orbit else ("r0",)
        return LegRows(self.mechanism, self.leg, poses, kind, orbit=orbit)

    def rows(self, poses: Array, kind: RowKind) -> Array:
        """The same as an array, shape (n, rows, p)."""
        if self.leg is None or not self.is_orbit:
            return self.measured_rows(poses, kind)
        images = [map_poses(self.mechanism, element, poses) for element in self.elements]
        return np.concatenate([self.measured_rows(image, kind) for image in images], axis=1)

    def measured_rows(self, poses: Array, kind: RowKind) -> Array:
        """Rows of poses that are measured as they are, without images, shape (n, r, p)."""
        if self.leg is None:
            return mechanism_rows(self.mechanism, poses, kind)
        rows = observability_rows(self.mechanism, self.leg, poses, kind)
        return rows.reshape(len(poses), self.mechanism.closures, rows.shape[1])

    def parameter_names(self) -> tuple[str, ...]:
        """Names of the columns of its rows."""
        if self.leg is not None:
            return self.mechanism.estimated_names(self.leg)
        return tuple(
            f"leg {leg + 1} {name}"
            for leg in range(len(self.mechanism.legs))
            for name in self.mechanism.estimated_names(leg)
        )

    def scale(self) -> Array:
        """A typical size of an error in each column: its tolerance."""
        return parameter_tolerances(self.mechanism)[self._identified()]

    def error_weight(self, poses: Array) -> Array:
        """B of the expected squared error, see `symkin.analysis.observability.error_weight`."""
        own = np.flatnonzero(self._identified())
        return error_weight(self.mechanism, poses)[np.ix_(own, own)]

    def _identified(self) -> NDArray[np.bool_]:
        """Which parameters its rows have columns for, shape (legs, p)."""
        identified = np.array(self.mechanism.is_estimated)
        if self.leg is not None:
            identified[np.arange(len(identified)) != self.leg] = False
        return identified

    def prior(self, measured: Measurements | None, kind: RowKind) -> Array | None:
        """Information of what is measured already; rows that miss a reading do not count."""
        if measured is None:
            return None
        readings = measured.readings if self.leg is None else measured.readings[:, [self.leg]]
        measured.require_complete()
        complete = np.isfinite(readings).all(axis=1)
        rows = self.measured_rows(measured.poses[complete], kind)
        rows = rows[np.isfinite(rows).all(axis=(1, 2))]  # beyond the nominal reach
        return np.asarray(np.einsum("nri,nrj->ij", rows, rows))

    def advice(self, _unseen: Sequence[str]) -> str:
        """What to do where nothing shows combinations of columns; empty if there is nothing."""
        return ""


def design_tasks(mechanism: Mechanism, design: Design, *, use_symmetry: bool) -> list[Task]:
    """Return the selections of a design, see `make_plan`.

    With `use_symmetry` one selection serves all legs of an orbit (design "legs").

    Raises
    ------
    SymkinError
        For orbits of a mechanism whose legs are not all images of leg 1.
    """
    one_of("design", design, Design)
    if design == "legs":
        return _leg_tasks(mechanism, use_symmetry)
    if design == "orbits":
        return [_orbit_task(mechanism)]
    return [Task(mechanism, None, ((ALL_LEGS, (_identity(mechanism),)),))]


def _leg_tasks(mechanism: Mechanism, use_symmetry: bool) -> list[Task]:
    if not use_symmetry:
        identity = _identity(mechanism)
        return [Task(mechanism, leg, ((leg, (identity,)),)) for leg in range(len(mechanism.legs))]
    carriers = leg_carriers(mechanism)
    return [
        Task(
            mechanism,
            reference,
            tuple(
                (leg, (element,))
                for leg, (origin, element) in enumerate(carriers)
                if origin == reference
            ),
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
    return Task(mechanism, 0, ((ALL_LEGS, tuple(elements)),))


def _identity(mechanism: Mechanism) -> SymmetryElement:
    return symmetry_group(mechanism).parse("r0")


def check_regions(mechanism: Mechanism, regions: Sequence[Region]) -> None:
    """Raise SymkinError for a region whose coordinates or limits make no sense."""
    known = coordinate_names(mechanism)
    for region in regions:
        if not region:
            raise SymkinError("a region to avoid has no limits; that would be every pose")
        for name, (lower, upper) in region.items():
            if name not in known:
                raise SymkinError(
                    f'a region to avoid limits "{name}"; expected coordinates of the poses, '
                    f"{', '.join(known)}"
                )
            if math.isnan(lower) or math.isnan(upper) or not lower <= upper:
                raise SymkinError(
                    f"a region to avoid reaches from {name} = {lower:g} to {upper:g}; expected "
                    "the lower limit first"
                )


@record
class Clearance(Value):
    """How far candidates stay from where a robot with errors may not follow.

    Attributes
    ----------
    reach_margin : float
        Least distance of every leg from the end of its reach, m or rad.
    conditioning_limit : float
        Largest condition number of dg/dpose, see `Mechanism.singularity_measures`.
    closure_unit : {"m", "rad"}
        Of the distance.
    """

    reach_margin: float = field(unit="closure")
    conditioning_limit: float
    closure_unit: str = field(private=True, default="m")


def clearance(mechanism: Mechanism, poses: Array, sigmas: float) -> Clearance:
    """Return the clearance that the manufacturing tolerances ask for, or the workspace's own.

    A leg closes with an error of `sigmas` standard deviations of the closure h, whose parameters
    have errors of the tolerances' size (the largest of some of the poses): so far every leg stays
    from the end of its reach. The platform is moved by that error times the condition number c,
    and a singularity lies about the characteristic length over c away, to first order: so c stays
    below the square root of the length over the error. Poses up to twice as ill-conditioned as home
    are never left out.
    """
    workspace = mechanism.workspace
    own = Clearance(
        least_reach_margin(mechanism) if workspace else 0.0,
        workspace.conditioning_limit if workspace else math.inf,
        mechanism.space.closure_unit,
    )
    error = sigmas * closure_deviation(mechanism, poses[:: -(-len(poses) // _SAMPLE)])
    if error == 0:
        return own
    home = float(mechanism.singularity_measures(mechanism.home)[2][0])
    limit = max(math.sqrt(mechanism.characteristic_length / error), 2 * home)
    margin = max(own.reach_margin, error)
    return Clearance(margin, min(own.conditioning_limit, limit), own.closure_unit)


def allowed_candidates(
    task: Task,
    poses: Array,
    conditions: Array | None,
    regions: Sequence[Region],
    kept: Clearance,
) -> NDArray[np.bool_]:
    """Whether each candidate may be measured, at all its images, shape (n,).

    Every image must lie in the workspace's box, within the joint limits of all legs and in no
    region to avoid; where the clearance is wider than the workspace's own, the candidate must keep
    it. `conditions` are the candidates' condition numbers, if they are known.
    """
    if len(poses) > _BLOCK:  # images of all candidates at once would take more memory than they do
        blocks = [slice(first, first + _BLOCK) for first in range(0, len(poses), _BLOCK)]
        return np.concatenate(
            [
                allowed_candidates(
                    task,
                    poses[block],
                    None if conditions is None else conditions[block],
                    regions,
                    kept,
                )
                for block in blocks
            ]
        )
    mechanism = task.mechanism
    allowed = np.ones(len(poses), dtype=np.bool_)
    settings = mechanism.workspace
    if settings is not None and kept.reach_margin > least_reach_margin(mechanism):
        margins = _core.reach_margin(mechanism.straight, poses).min(axis=1)
        allowed &= margins >= kept.reach_margin
    if settings is not None and kept.conditioning_limit < settings.conditioning_limit:
        if conditions is None:
            conditions = mechanism.singularity_measures(poses)[2]
        allowed &= conditions <= kept.conditioning_limit
    identity = _identity(mechanism)
    # An element carries a leg's readings to another leg, whose limits may be others.
    limited = bool(np.isfinite(mechanism.reading_limits).any())
    for element in task.elements:
        images = poses if element == identity else map_poses(mechanism, element, poses)
        allowed &= inside_box(mechanism, images)
        if limited:
            readings = mechanism.inverse_kinematics(images)
            allowed &= mechanism.within_limits(readings).all(axis=1)
        for region in regions:
            allowed &= ~_contains(mechanism, region, images)
    return allowed


def _contains(mechanism: Mechanism, region: Region, poses: Array) -> NDArray[np.bool_]:
    names = coordinate_names(mechanism)
    coordinates = workspace_coordinates(mechanism, poses)
    inside = np.ones(len(poses), dtype=np.bool_)
    for name, (lower, upper) in region.items():
        values = coordinates[:, names.index(name)]
        inside &= (values >= lower) & (values <= upper)
    return inside
