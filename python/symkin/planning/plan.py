# SPDX-License-Identifier: MIT
"""Measurement plans: which poses to take, for which leg, in which order."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MeasurementError, SymkinError
from symkin.measurements import ALL_LEGS, Measurements, make_arrays, pose_rows
from symkin.mechanism import Mechanism
from symkin.observability import ExpectedAccuracy, Observability, RowKind, analyse_observability
from symkin.planning.observing import HeldByPriors, PlannedUnknown, Survey
from symkin.planning.selection import Clearance, Criterion, Design, Selection, SelectionMethod
from symkin.result import Result, Value, field, record

if TYPE_CHECKING:
    from symkin.identification.fit import Estimator, PoseUse
    from symkin.workspace import WorkspaceSample

__all__ = [
    "ChosenPoses",
    "Plan",
    "PlanBasis",
    "set_name",
    "thinned",
    "travel_length",
    "visiting_order",
]

Array = NDArray[np.float64]
Way = NDArray[np.intp]  # stations in their order; what stands first and last stays there

_AVERAGED = 2000  # poses over which an expected error is averaged
_KICKS = 100  # restarts from a way that is changed a little
_EFFORT = 5 * 10**6  # restarts times the square of the stations, so that large plans do not wait
_NEIGHBOURHOOD = 50  # stations among which a way is changed
_PIECE = 600  # stations that are improved together
_MOVED = 3  # stations that are moved together
_GAIN = -1e-12  # of the longest distance: less is rounding


def set_name(leg: int) -> str:
    """Name the set of a leg (from 0), or of all (-1), as people count."""
    return "all legs" if leg == ALL_LEGS else f"leg {leg + 1}"


def thinned(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """At most 2000 of the poses, over which an expected error is averaged."""
    return poses[:: -(-len(poses) // _AVERAGED)]


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


@record
class Plan(Result):
    """Commanded poses of every set, with the readings of all legs at the nominal parameters.

    The rows stand in the order in which the poses are to be visited.

    Attributes
    ----------
    mechanism : Mechanism
        The nominal one.
    leg_sets : ndarray of int, shape (N,)
        The leg, from 0, that the pose identifies; -1 for all legs. (Files, reports and messages
        count legs from 1, and write 0 for all.)
    order : ndarray of int, shape (N,)
        Place of the pose within its set, from 1; spares come last, the best first.
    spare : ndarray of bool, shape (N,)
        Whether the pose only replaces one that cannot be taken.
    poses : ndarray, shape (N, coordinates)
        Commanded poses, m and rad (spatial: position and quaternion).
    readings : ndarray, shape (N, legs)
        Commanded readings in the sensor's unit.
    basis : PlanBasis or None
        How it was made; None for a plan that was read from a file.
    candidates : WorkspaceSample, ndarray or None
        What the poses were chosen from.
    measured : Measurements or None
        What is measured already, to which it adds.
    """

    mechanism: Mechanism
    leg_sets: NDArray[np.intp]
    order: NDArray[np.intp]
    spare: NDArray[np.bool_]
    poses: NDArray[np.float64]
    readings: NDArray[np.float64]
    basis: PlanBasis | None = None
    candidates: WorkspaceSample | NDArray[np.float64] | None = None
    measured: Measurements | None = None

    PAGE: ClassVar[str] = "plan.plan_page"

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose."""
        make_arrays(
            self,
            poses=(2, "float"),
            readings=(2, "float"),
            leg_sets=(1, "int"),
            order=(1, "int"),
            spare=(1, "bool"),
        )
        rows = len(self.poses)
        for name in ("leg_sets", "order", "spare", "readings"):
            count = len(getattr(self, name))
            if count != rows:
                raise MeasurementError(f"the plan has {count} {name} for {rows} poses")
        super().__post_init__()

    @property
    def row_kind(self) -> RowKind:
        """What its poses were chosen by; of a plan that does not say, the paper's rows."""
        return "paper" if self.basis is None else self.basis.rows

    @property
    def travel(self) -> float:
        """Length of the way from home through the poses in order, without spares, m or rad."""
        return travel_length(self.mechanism, self.poses[~self.spare])

    @property
    def estimator(self) -> Estimator:
        """What it is worth most to: poses that are chosen for all legs at once, to `joint`."""
        joint = self.basis is not None and self.basis.design == "mechanism"
        return "joint" if joint else "implicit"

    @cached_property
    def expected(self) -> ExpectedAccuracy | None:
        """The end-effector error to expect over the candidates; None if that cannot be told.

        With `estimator`, all poses and those measured already, for what the plan was made to
        observe; see `predict_accuracy`.
        """
        from symkin.planning.prediction import predict_accuracy

        if self.candidates is None:
            return None
        cloud = thinned(pose_rows(self.candidates))
        try:
            return predict_accuracy(
                self.mechanism, self, cloud, self.estimator, measured=self.measured
            )
        except SymkinError:  # as `joint` without a noise of redundant readings
            return None

    @cached_property
    def unknowns(self) -> tuple[PlannedUnknown, ...]:
        """How well each unknown will be known; empty for full poses and all parameters."""
        if self._survey is None:
            return ()
        return self._survey.promised(self._survey.covariance(self._survey_rows))

    @cached_property
    def unseen(self) -> tuple[str, ...]:
        """Combinations of unknowns, in tolerances, that priors alone hold."""
        return () if self._survey is None else self._survey.unseen(self._survey_rows)

    @cached_property
    def held(self) -> HeldByPriors | None:
        """What the priors hold, as the observations will say next to nothing of it, if anything.

        None too where the end-effector error to expect cannot be told.
        """
        if self._survey is None or self.expected is None or self.candidates is None:
            return None
        cloud = thinned(pose_rows(self.candidates))
        found = self._survey.held(cloud, self._survey.covariance(self._survey_rows))
        return found if found.combinations else None

    @property
    def _survey(self) -> Survey | None:
        return None if self.basis is None else self.basis.survey

    @cached_property
    def _survey_rows(self) -> list[NDArray[np.float64]]:
        assert self._survey is not None
        return survey_rows(self._survey, self, measured=self.measured)

    @cached_property
    def observability(self) -> tuple[Observability, ...]:
        """What the poses show of each leg, with those measured already, if they are full.

        Empty where something else is observed or unknown, see `unknowns`. The indices are those of
        the rows that the selection saw, the rest of the paper's rows.
        """
        if self._survey is not None:
            return ()
        legs = []
        for leg, poses in enumerate(self.leg_poses()):
            shown = analyse_observability(self.mechanism, leg, poses)
            chosen = analyse_observability(self.mechanism, leg, poses, self.row_kind)
            legs.append(replace(shown, indices=chosen.indices))
        return tuple(legs)

    def rows_of_set(self, leg: int, *, spare: bool = False) -> NDArray[np.intp]:
        """Return the rows, from 0, of a leg's set (-1 for all legs) in its order; or its spares."""
        rows = np.flatnonzero((self.leg_sets == leg) & (self.spare == spare))
        return rows[np.argsort(self.order[rows], kind="stable")]

    def rows_of(self, leg: int) -> NDArray[np.intp]:
        """Return the rows, from 0, that identify a leg (from 0): its own and those of all legs."""
        return self._leg_rows[leg]

    @cached_property
    def _leg_rows(self) -> tuple[NDArray[np.intp], ...]:
        common, legs = self.rows_of_set(ALL_LEGS), range(self.readings.shape[1])
        return tuple(np.concatenate([self.rows_of_set(leg), common]) for leg in legs)

    def leg_poses(self) -> list[NDArray[np.float64]]:
        """Return the poses that identify each leg, with those measured already."""
        sets = [self.poses[rows] for rows in self._leg_rows]
        taken = self.measured
        if taken is None:
            return sets
        return [np.concatenate([own, taken.poses[taken.rows_of(i)]]) for i, own in enumerate(sets)]

    def to_dict(self) -> dict[str, Any]:
        """Return what it shows of each leg's parameters, and how it was made."""
        spares = [int(self.spare[self.leg_sets == leg].sum()) for leg in range(len(self._leg_rows))]
        common = int(self.spare[self.leg_sets == ALL_LEGS].sum())
        expected = self.expected
        return {
            "mechanism": self.mechanism.name,
            "poses": int(np.sum(~self.spare)),
            "spares": int(np.sum(self.spare)),
            f"travel_{self.mechanism.space.closure_unit}": self.travel,
            "selection": self.basis and self.basis.to_dict(),
            "expected": expected and {"estimator": self.estimator, **expected.to_dict()},
            "unknowns": [each.to_dict() for each in self.unknowns],
            "unseen": list(self.unseen),
            "held_by_priors": self.held and self.held.to_dict(),
            "legs": [
                {
                    "poses": len(self.rows_of(shown.leg)),
                    "spares": spares[shown.leg] + common,
                    **shown.to_dict(),
                }
                for shown in self.observability
            ],
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the columns of its file."""
        from symkin.io.plans import plan_columns

        return plan_columns(self, self.mechanism)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write it as CSV or Parquet, by extension, and return the file; `read_plan` reads it.

        A file that exists is replaced with `overwrite` alone.
        """
        from symkin.io.plans import write_plan

        write_plan(self, path, self.mechanism, overwrite=overwrite)
        return Path(path)


def survey_rows(
    survey: Survey,
    plan: Plan,
    *,
    poses: PoseUse = "all",
    measured: Measurements | None = None,
) -> list[NDArray[np.float64]]:
    """Rows of a survey that a plan's poses and what is measured bring, see `predict_accuracy`."""
    wanted = ~plan.spare
    sets = plan.leg_sets[wanted, None]
    own = (sets == ALL_LEGS) | (sets == np.arange(plan.readings.shape[1]))
    rows = [survey.rows(plan.poses[wanted], own if poses == "own" else None)]
    if not np.isfinite(rows[0]).all():
        raise SymkinError("a pose of the plan is out of the nominal robot's reach")
    return rows if measured is None else [*rows, survey.measured_rows(measured)]


def travel_length(mechanism: Mechanism, poses: ArrayLike | WorkspaceSample) -> float:
    """Length of the way from home through poses in their order, m; of a platform that turns, rad.

    Beside a position a rotation counts as the way of a point at the characteristic length from the
    centre.
    """
    stations = np.vstack([mechanism.home, pose_rows(poses)])
    return float(_distances(mechanism, stations[:-1], stations[1:]).sum())


def visiting_order(mechanism: Mechanism, poses: Array, seed: int) -> NDArray[np.intp]:
    """Order poses for a short way from home through all of them (a heuristic), to the last one.

    Rows of the poses, shape (N,); in the given order if the heuristic finds no shorter way.
    """
    given = np.arange(len(poses), dtype=np.intp)
    if len(poses) < 2:
        return given
    stations = np.vstack([mechanism.home, poses])
    ways = np.zeros((len(stations) + 1,) * 2)  # the last one is nowhere: it ends an open way
    ways[:-1, :-1] = _distances(mechanism, stations[:, None], stations[None])
    found = _short_way(ways / max(ways.max(), 1e-300), seed)[1:-1] - 1
    shorter = travel_length(mechanism, poses[found]) < travel_length(mechanism, poses)
    return found if shorter else given


def _short_way(ways: Array, seed: int) -> Way:
    """A short path through all stations, from the first to the last."""
    count = len(ways)
    best = _improved(ways, _nearest_neighbours(ways))
    random = np.random.default_rng(seed)
    width = min(_NEIGHBOURHOOD, count - 2)
    for _ in range(min(_KICKS, _EFFORT // count**2) if width >= 3 else 0):
        begin = random.integers(1, count - width)
        first, second, third = begin + np.sort(random.choice(width, 3, replace=False))
        swapped = [best[:first], best[second:third], best[first:second], best[third:]]
        tried = _improved(ways, np.concatenate(swapped))
        if _length(ways, tried) < _length(ways, best):
            best = tried
    return best


def _nearest_neighbours(ways: Array) -> Way:
    """Always go to the nearest station that is left."""
    left = ways.copy()
    path = [0]
    for _ in range(len(ways) - 2):
        left[:, path[-1]] = np.inf
        path.append(int(left[path[-1], :-1].argmin()))
    return np.array([*path, len(ways) - 1], dtype=np.intp)


def _improved(ways: Array, path: Way) -> Way:
    """The path when neither turning a part of it round nor moving a few stations helps."""
    if len(path) > _PIECE:
        pieces = range(0, len(path) - 1, _PIECE - 1)
        improved = [_improved(ways, path[begin : begin + _PIECE]) for begin in pieces]
        return np.concatenate([*(piece[:-1] for piece in improved), path[-1:]])
    while len(path) > 3:
        between = ways[np.ix_(path, path)]
        better = _turned(between)
        if better is None:
            better = _moved(between)
        if better is None:
            break
        path = path[better]
    return path


def _turned(ways: Array) -> Way | None:
    """Places of the path in a better order, by the part that is best turned round."""
    steps, last = ways.diagonal(1), len(ways) - 2
    gains = ways[:last, 1:-1] + ways[1:-1, 2:] - steps[:-1, None] - steps[1:]
    gains[np.tril_indices(last)] = 0
    first, end = np.unravel_index(gains.argmin(), gains.shape)
    if gains[first, end] > _GAIN:
        return None
    order = np.arange(len(ways))
    order[first + 1 : end + 2] = order[first + 1 : end + 2][::-1]
    return order


def _moved(ways: Array) -> Way | None:
    """The same by moving up to three stations to the best other place (or-opt)."""
    steps, order = ways.diagonal(1), np.arange(len(ways))
    gaps = order[:-1]
    best, better = _GAIN, None
    for size in range(1, min(_MOVED, len(ways) - 3) + 1):
        first = np.arange(1, len(ways) - size)
        last = first + size - 1
        freed = steps[first - 1] + steps[last] - ways[first - 1, last + 1]
        forth = ways[first, :-1] + ways[last, 1:]
        back = ways[last, :-1] + ways[first, 1:]
        gains = np.minimum(forth, back) - steps - freed[:, None]
        gains[(gaps >= first[:, None] - 1) & (gaps <= last[:, None])] = 0
        at, gap = np.unravel_index(gains.argmin(), gains.shape)
        if gains[at, gap] < best:
            best = gains[at, gap]
            part = order[first[at] : last[at] + 1]
            part = part[::-1] if back[at, gap] < forth[at, gap] else part
            rest = np.delete(order, part)
            place = gap + 1 if gap < first[at] else gap + 1 - size
            better = np.concatenate([rest[:place], part, rest[place:]])
    return better


def _length(ways: Array, path: Way) -> float:
    return float(ways[path[:-1], path[1:]].sum())


def _distances(mechanism: Mechanism, one: Array, other: Array) -> Array:
    """Way between poses, in the shape that the poses broadcast to, m or rad."""
    size = mechanism.space.size
    ways = np.linalg.norm(one[..., :size] - other[..., :size], axis=-1)
    if mechanism.space.has_quaternion:
        # From the chord: the arc cosine of a product has 1e-8 rad of rounding near zero.
        chords = [
            np.linalg.norm(one[..., size:] + sign * other[..., size:], axis=-1) for sign in (1, -1)
        ]
        angles = 4 * np.arcsin(np.minimum(np.minimum(*chords) / 2, 1))
    else:
        angles = np.abs(one[..., size:] - other[..., size:]).sum(axis=-1)
    length = mechanism.characteristic_length if mechanism.space.moves else 1.0
    return np.asarray(ways + length * angles)
