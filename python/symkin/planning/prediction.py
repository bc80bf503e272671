# SPDX-License-Identifier: MIT
"""What accuracy a plan promises before anything is measured, and how many poses are enough."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Unpack, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.analysis.observability import RowKind
from symkin.analysis.observed import Observed, Observing
from symkin.analysis.promises import ExpectedAccuracy, thinned
from symkin.analysis.workspace import WorkspaceSample
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.options import Estimator, PoseUse, Unknowns
from symkin.estimate.survey import HeldByPriors, Survey
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.options import checks
from symkin.planning.accuracy import predict_accuracy, require_joint
from symkin.planning.making import default_design, in_visiting_order, make_plan, usual_visit
from symkin.planning.observing import where_observed
from symkin.planning.plan import Plan
from symkin.planning.selection import Criterion, Design, design_tasks
from symkin.results import Result
from symkin.values import Array, Value, plain, record

_POINTS = 25  # of a curve
_LARGEST = 10  # times as many poses as parameters, of a curve
_MOST = 50  # the same, when an accuracy asks for them
_LEAST_HELP = 0.01  # share of the error that a remedy takes away
_OF_SURVEY = ("observe", *Unknowns.__annotations__)
_OF_PREDICTION = ("estimator", "poses", "confidence")  # settings that choose no poses


class CurveSettings(Unknowns, total=False):
    """What a curve was predicted for."""

    design: Design
    rows: RowKind
    criterion: Criterion
    estimator: Estimator
    poses: PoseUse
    confidence: float
    seed: int
    observe: Observing


@record
class PoseCountCurve(Result):
    """What more poses bring.

    Attributes
    ----------
    mechanism : Mechanism
        The nominal one.
    candidates : ndarray, shape (n, coordinates)
        What the poses were chosen from.
    settings : dict
        What they were predicted for: design, rows, criterion, estimator, poses, seed; observe and
        what is unknown, if that is not full poses and all parameters.
    counts : ndarray of int, shape (k,)
        Poses that each leg is identified from, ascending.
    measured : ndarray of int, shape (k,)
        Poses to measure in all.
    position : ndarray, shape (k,)
        Mean root mean square position error, m: about half of all robots exceed it.
    orientation : ndarray, shape (k,)
        The same of the orientation, rad.
    position_bound, orientation_bound : ndarray, shape (k,)
        Root mean square errors that `confidence` of all such robots are within.
    efficiency : ndarray, shape (k,)
        Of the selection's determinant against the bound for distinct poses, the least of all legs'.
    least_gain : float
        Another pose is worth while if it makes the position error smaller by this share.
    enough : int or None
        The first count from which on another pose is not; None if all are.
    held : HeldByPriors or None
        What priors hold even with the most poses, if anything.
    """

    mechanism: Mechanism
    candidates: Array
    settings: CurveSettings
    counts: NDArray[np.intp]
    measured: NDArray[np.intp]
    position: Array
    orientation: Array
    position_bound: Array
    orientation_bound: Array
    efficiency: Array
    least_gain: float
    enough: int | None
    held: HeldByPriors | None = None

    def for_accuracy(
        self, position: float | None = None, orientation: float | None = None
    ) -> NeededPoses:
        """Find how many poses a wanted accuracy needs, beyond the curve if it must be.

        The fewest poses found by bisection, at most 50 times as many as a leg has parameters. If
        they are not enough, what else would help is predicted too.

        Parameters
        ----------
        position, orientation : float, optional
            Root mean square end-effector error that the curve's confidence of all robots shall be
            within, m and rad; at least one of them.

        Raises
        ------
        SymkinError
            For nothing wanted, an error that is not positive, or the orientation of a point.
        """
        check_wanted(self.mechanism, position, orientation)
        limits = np.array([np.inf if each is None else each for each in (position, orientation)])
        size, low, high = _together(self.mechanism, self.candidates, self.settings), 0, 0
        points: dict[int, _Point] = {}

        def reaches(orbits: int) -> bool:
            if orbits not in points:
                count = orbits * size
                try:
                    points[orbits] = _predicted(
                        self.mechanism, self.candidates, count, self.settings
                    )
                except NotIdentifiableError:  # so few do not show all that is unknown
                    return False
            return bool((bounds_of(points[orbits].accuracy) <= limits).all())

        p = _least(self.mechanism, self.candidates, self.settings)
        fewest = -(-p // size)
        bounds = np.column_stack([self.position_bound, self.orientation_bound])
        met = np.flatnonzero((bounds <= limits).all(axis=1))
        if len(met):
            low = int(self.counts[met[0] - 1]) // size if met[0] else fewest - 1
            high = int(self.counts[met[0]]) // size
        else:
            low = high = int(self.counts[-1]) // size
            reaches(high)
            available = points[high].allowed // size
            most = max(high, min(_MOST * p // size, available))
            while not reaches(high) and high < most:
                low, high = high, min(2 * high, most)
        reached = reaches(high)
        while reached and high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if reaches(middle) else (middle, high)
        return NeededPoses(
            curve=self,
            position=position,
            orientation=orientation,
            count=high * size if reached else None,
            tried=high * size,
            measured=len(points[high].plan.poses),
            expected=predict_accuracy(
                self.mechanism,
                # As `make_plan` gives it, so that both promise the same to the last digit.
                points[high].visited(self.settings["seed"]),
                thinned(self.candidates),
                anywhere=self.candidates,
                **_some(self.settings, _OF_PREDICTION),
            ),
            remedies=() if reached else _remedies(self, points[high], limits),
        )

    @property
    def confidence(self) -> float:
        """Share of all such robots that the bounds are for."""
        return float(self.settings["confidence"])

    @property
    def survey(self) -> Survey | None:
        """What will be observed and what is unknown; None for full poses and all parameters."""
        return _survey_of(self.mechanism, self.candidates, self.settings)

    def columns(self) -> Mapping[str, Any]:
        """Return the curve, a row a count."""
        return {
            "poses_per_leg": self.counts,
            "poses": self.measured,
            "position_rms_m": self.position,
            "orientation_rms_rad": self.orientation,
            "position_bound_rms_m": self.position_bound,
            "orientation_bound_rms_rad": self.orientation_bound,
            "efficiency": self.efficiency,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the curve and what it was predicted for."""
        return {
            "mechanism": self.mechanism.name,
            "settings": plain(dict(self.settings)),
            **{name: np.asarray(column).tolist() for name, column in self.columns().items()},
            "confidence": self.confidence,
            "least_gain": self.least_gain,
            "enough": self.enough,
            "held_by_priors": self.held and self.held.to_dict(),
        }


@record
class Remedy(Value):
    """What else would make the expected error smaller, at the same poses.

    Attributes
    ----------
    change : str
        What to change.
    expected : ExpectedAccuracy
        What is then expected.
    enough : bool
        Whether that is the accuracy wanted.
    """

    change: str
    expected: ExpectedAccuracy
    enough: bool


@record
class NeededPoses(Result):
    """How many poses a wanted accuracy needs.

    Attributes
    ----------
    curve : PoseCountCurve
        What more poses bring.
    position, orientation : float or None
        Root mean square error wanted of the curve's confidence of all robots, m and rad.
    count : int or None
        Poses that each leg is identified from; None if not even `tried` are enough.
    tried : int
        Poses of each leg,
    measured : int
        poses to measure in all, and
    expected : ExpectedAccuracy
        what they promise: those that are needed, or the most that were tried.
    remedies : tuple of Remedy
        What else would help, the most helpful first; empty if the accuracy is reached.
    """

    curve: PoseCountCurve
    position: float | None
    orientation: float | None
    count: int | None
    tried: int
    measured: int
    expected: ExpectedAccuracy
    remedies: tuple[Remedy, ...]

    @property
    def excess(self) -> float:
        """How many times the bound of the error is what is wanted; at most 1 if it is reached.

        Without priors all errors are to first order proportional to the noise: so many times
        smaller it must be.
        """
        errors = zip(bounds_of(self.expected), (self.position, self.orientation), strict=True)
        return max(float(error) / limit for error, limit in errors if limit is not None)

    def columns(self) -> Mapping[str, Any]:
        """Return the curve."""
        return self.curve.columns()

    def to_dict(self) -> dict[str, Any]:
        """Return the curve, and the answer as ``accuracy``."""
        return self.curve.to_dict() | {
            "accuracy": {
                "wanted_position_rms_m": self.position,
                "wanted_orientation_rms_rad": self.orientation,
                "poses_per_leg": self.count,
                "tried": self.tried,
                "poses": self.measured,
                "expected": self.expected.to_dict(),
                "remedies": [remedy.to_dict() for remedy in self.remedies],
            }
        }


@checks()
def pose_count_curve(
    mechanism: MechanismGiven,
    candidates: ArrayLike | WorkspaceSample,
    counts: Sequence[int] | None = None,
    seed: int | None = None,
    *,
    design: Design | None = None,
    rows: RowKind = "noise_aware",
    criterion: Criterion = "O1",
    estimator: Estimator | None = None,
    poses: PoseUse = "all",
    least_gain: float = 0.02,
    confidence: float = 0.95,
    observe: Observing | None = None,
    progress: Callable[[str, float], None] | None = None,
    **unknowns: Unpack[Unknowns],
) -> PoseCountCurve:
    """Predict the accuracy that different numbers of poses give.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    candidates : WorkspaceSample, or array_like of shape (n, coordinates)
        Poses to choose from, over which the error is averaged too; moved as `make_plan` does.
    counts : sequence of int, optional
        Numbers of poses, by default 25 from the number p of a leg's parameters to 10 p; with
        unknowns, p is the least number of poses that bring as many conditions.
    seed : int, optional
        By default the protocol's.
    design, rows, criterion
        See `make_plan`.
    estimator, poses
        See `predict_accuracy`.
    least_gain : float
        Share of the position error that another pose must save to be worth while.
    confidence : float
        Share of all such robots that the bounds are for.
    progress : callable, optional
        Told what is being done and which share of it is done, from 0 to 1.
    observe, **unknowns
        What will be observed and what is unknown, see `make_plan`.

    Raises
    ------
    SymkinError
        As `make_plan` does.
    """
    mechanism = as_mechanism(mechanism)
    if not 0 < least_gain < 1:
        raise SymkinError(f"the least gain is {least_gain:g}; expected a share between 0 and 1")
    cloud = where_observed(mechanism, Observed.of(mechanism, observe), pose_rows(candidates))
    known = {name: value for name, value in unknowns.items() if value is not None}
    asked = known if observe is None else {"observe": observe, **known}
    surveyed = _survey_of(mechanism, cloud, asked)
    if surveyed is not None:
        require_joint(estimator)
    settings = {
        "design": default_design(surveyed) if design is None else design,
        "rows": rows,
        "criterion": criterion,
        "estimator": estimator or ("joint" if surveyed else "implicit"),
        "poses": poses,
        "confidence": confidence,
        "seed": mechanism.protocol.seed if seed is None else seed,
        **asked,
    }
    numbers = _counts(mechanism, cloud, settings, counts)
    tell = progress or (lambda _doing, _share: None)
    points = _points(mechanism, cloud, settings, numbers, tell, beginning=counts is None)
    errors = {
        kind: np.array([getattr(point.accuracy, kind) for point in points])
        for kind in ("position", "orientation", "position_bound", "orientation_bound")
    }
    (first, _), *_ = mechanism.space.errors
    return PoseCountCurve(
        mechanism=mechanism,
        candidates=cloud,
        settings=cast(CurveSettings, settings),
        counts=np.array(numbers[-len(points) :], dtype=np.intp),
        measured=np.array([len(point.plan.poses) for point in points], dtype=np.intp),
        **errors,
        efficiency=np.array([point.efficiency for point in points]),
        least_gain=least_gain,
        enough=_enough(numbers[-len(points) :], errors[first], least_gain),
        held=points[-1].plan.held,
    )


@record
class _Point:
    """A plan and what it promises."""

    plan: Plan
    accuracy: ExpectedAccuracy
    efficiency: float
    allowed: int

    def visited(self, seed: int) -> Plan:
        """Return the plan with its poses in the order in which they are to be measured."""
        if _goes_with_order(self.plan):  # it is so already
            return self.plan
        return in_visiting_order(self.plan, seed, usual_visit(self.plan.mechanism))


def _goes_with_order(plan: Plan) -> bool:
    """Whether something unknown changes while the poses are measured."""
    survey = None if plan.basis is None else plan.basis.survey
    return survey is not None and bool(survey.in_order(plan.poses).covariates)


def _points(
    mechanism: Mechanism,
    cloud: Array,
    settings: Mapping[str, Any],
    numbers: Sequence[int],
    tell: Callable[[str, float], None],
    *,
    beginning: bool,
) -> list[_Point]:
    """Predict for the numbers of poses; if wanted, from the first that shows all unknowns on."""
    points: list[_Point] = []
    for done, count in enumerate(numbers):
        tell(f"{count} poses", done / len(numbers))
        try:
            points.append(_predicted(mechanism, cloud, count, settings))
        except NotIdentifiableError:
            if points or not beginning or count == numbers[-1]:
                raise
    return points


def _predicted(
    mechanism: Mechanism, cloud: Array, count: int, settings: Mapping[str, Any]
) -> _Point:
    made_by = {k: v for k, v in settings.items() if k not in _OF_PREDICTION}
    plan = make_plan(mechanism, cloud, count, spares=0, visit="sets", **made_by)
    basis = plan.basis
    assert basis is not None  # it was made, not read
    if _goes_with_order(plan):
        plan = in_visiting_order(plan, settings["seed"], usual_visit(mechanism))
    asked = _some(settings, _OF_PREDICTION)
    accuracy = predict_accuracy(mechanism, plan, thinned(cloud), **asked)
    certificates = [choice.selection.certificate for choice in basis.choices]
    efficiency = min(certificate.o1_efficiency for certificate in certificates)
    return _Point(plan, accuracy, efficiency, basis.candidates - basis.excluded)


def _remedies(curve: PoseCountCurve, point: _Point, limits: Array) -> tuple[Remedy, ...]:
    """Changes of noise, estimate and assumptions that make the error smaller, the best first."""
    mechanism, settings = curve.mechanism, curve.settings
    noise = mechanism.noise
    changes: list[tuple[str, Mechanism, dict[str, Any]]] = [
        (
            f"half the noise of the {what}",
            mechanism.replace(
                noise=dataclasses.replace(
                    noise,
                    **{
                        each: value / 2
                        for each in names
                        if (value := getattr(noise, each)) is not None
                    },
                )
            ),
            {},
        )
        for (name, *names), what in (
            (
                ("position", "position", "per_metre", "along", "along_per_metre"),
                "measured positions",
            ),
            (("orientation", "orientation"), "measured orientations"),
            (("reading", "reading"), "sensor readings"),
        )
        if getattr(noise, name) > 0 and (name != "position" or mechanism.space.moves)
    ]
    if settings["poses"] == "own" and settings["estimator"] != "joint":
        changes.append(("every leg identified from all poses", mechanism, {"poses": "all"}))
    if settings["estimator"] != "joint":
        joint = {"estimator": "joint", "poses": "all"}
        changes.append(("the estimator joint", mechanism, joint))
    survey = curve.survey
    assumed = dict((survey and survey.options.assume) or {})
    of_survey = _some(settings, _OF_SURVEY)
    changes += [
        (
            f"{name} known, of which {declared} is assumed",
            mechanism,
            {**of_survey, "assume": {key: assumed[key] for key in assumed if key != name}},
        )
        for name, declared in assumed.items()
    ]
    before = bounds_of(point.accuracy)
    binding = np.isfinite(limits)
    found = []
    for change, changed, other in changes:
        made = {**_some(settings, _OF_PREDICTION), **other}
        try:
            expected = predict_accuracy(changed, point.plan, thinned(curve.candidates), **made)
        except SymkinError:  # as `joint` without a noise of redundant readings
            continue
        after = bounds_of(expected)
        excess = float((after / limits)[binding].max())
        if excess < (1 - _LEAST_HELP) * (before / limits)[binding].max():
            found.append((excess, Remedy(change, expected, excess <= 1)))
    return tuple(remedy for _, remedy in sorted(found, key=lambda each: each[0]))


def bounds_of(accuracy: ExpectedAccuracy) -> Array:
    """The position and orientation error that its confidence of all robots are within."""
    return np.array([accuracy.position_bound, accuracy.orientation_bound])


def check_wanted(mechanism: Mechanism, position: float | None, orientation: float | None) -> None:
    """Refuse an accuracy that nobody can want."""
    wanted = {"position": position, "orientation": orientation}
    if position is None and orientation is None:
        raise SymkinError("no accuracy is wanted; expected one of the position or the orientation")
    if orientation is not None and not mechanism.space.turns:
        raise SymkinError(
            f"the platform of {mechanism.name} never turns: it has no orientation to be in error"
        )
    if position is not None and not mechanism.space.moves:
        raise SymkinError(
            f"the platform of {mechanism.name} only turns: it has no position to be in error"
        )
    for name, value in wanted.items():
        if value is not None and not 0 < value < np.inf:
            raise SymkinError(f"the {name} error wanted is {value:g}; expected a positive one")


def _together(mechanism: Mechanism, cloud: Array, settings: Mapping[str, Any]) -> int:
    """Poses that are chosen together."""
    survey = _survey_of(mechanism, cloud, settings)
    if survey is not None:
        return survey.together
    (task, *_) = design_tasks(mechanism, settings["design"], use_symmetry=True)
    return len(task.elements) if task.is_orbit else 1


def _survey_of(mechanism: Mechanism, cloud: Array, settings: Mapping[str, Any]) -> Survey | None:
    """What the settings of a curve say of what is observed and unknown."""
    asked = cast(Unknowns, _some(settings, Unknowns.__annotations__))
    return Survey.of(mechanism, cloud, settings.get("observe"), asked)


def _some(settings: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Those of the settings that have these names."""
    return {name: settings[name] for name in names if name in settings}


def _least(mechanism: Mechanism, cloud: Array, settings: Mapping[str, Any]) -> int:
    """As many poses as bring an equation for each parameter of a leg, or for each unknown."""
    survey = _survey_of(mechanism, cloud, settings)
    if survey is None:
        return mechanism.least_poses
    rows = survey.rows(cloud[: survey.together])
    conditions = int(rows.any(axis=2).sum())
    return survey.together * -(-int(rows.shape[2]) // max(conditions, 1))


def _counts(
    mechanism: Mechanism,
    cloud: Array,
    settings: Mapping[str, Any],
    counts: Sequence[int] | None,
) -> list[int]:
    """Counts to try, ascending, as whole orbits or pairs."""
    if counts is None:
        p = _least(mechanism, cloud, settings)
        counts = np.rint(np.geomspace(p, _LARGEST * p, _POINTS)).astype(int).tolist()
    if not len(counts):
        raise SymkinError("counts is empty; expected the numbers of poses to try")
    size = _together(mechanism, cloud, settings)
    return sorted({-(-count // size) * size for count in counts})


def _enough(counts: Sequence[int], errors: Array, least_gain: float) -> int | None:
    """First count from which on no further pose saves `least_gain` of the error."""
    best = np.minimum.accumulate(errors)  # a selection may be a little worse than one of fewer
    saved = 1 - (best[1:] / best[:-1]) ** (1 / np.diff(counts))
    worth_while = np.flatnonzero(saved >= least_gain)
    first = int(worth_while[-1]) + 1 if worth_while.size else 0
    return counts[first] if first < len(saved) else None
