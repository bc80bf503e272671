# SPDX-License-Identifier: MIT
"""Which pose to measure next: a function of the drawing, the seed and the tries so far alone."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.observed import Observed
from symkin.analysis.promises import bound_of, thinned
from symkin.analysis.workspace import workspace_coordinates
from symkin.estimate.assumed import with_assumed
from symkin.estimate.conflict import widened_by
from symkin.estimate.estimate import Estimate
from symkin.estimate.precision import expected_over, over_bed
from symkin.estimate.survey import SILENT, Survey
from symkin.guided.regions import Regions
from symkin.model.mechanism import Mechanism
from symkin.options import Coordinates
from symkin.planning.completion import Completing
from symkin.planning.visiting import visiting_order
from symkin.values import Array, record

_AHEAD = 5  # poses that are chosen together and visited by a short way
_MOST = 60  # poses that are planned at most
_WIDE = 1e3  # times its scale: what is known of an unknown without a prior
_SPOILT = 10.0  # times the tolerances or the noise: an estimate that is no robot
_SAME = 1e-7  # m or rad, by which a pose that was written and read again may differ
_AVOIDED = 1.5  # standard deviations of the candidates, around a pose to avoid
_AVOIDED_SHARE = 0.05  # of the candidates, that are avoided with it at most
_ASSUMED_AT = 200  # candidates, whose estimate rests on what is assumed as one of all does
_AMONG = 2000  # poses over which the error is averaged while poses are chosen
_LOOKED_AT = 5000  # candidates among which new ones are looked for at a time, others the next time
_SINGLE: tuple[Coordinates, ...] = ("height", "x", "y", "z")
_KEPT = ("_tries", "queue", "_held", "_begun", "planned", "_stale", "more")


@record
class Target:
    """The accuracy that is wanted: position and orientation, m and rad; None for any.

    Of the position these coordinates alone count, "z" or the "height" above a bed; None: all.
    """

    position: float | None
    orientation: float | None
    confidence: float
    of: Coordinates | None = None

    @property
    def wanted(self) -> dict[str, float]:
        """Those that are wanted, by name."""
        both = {"position": self.position, "orientation": self.orientation}
        return {name: value for name, value in both.items() if value is not None}


@dataclass
class _Tries:
    """What became of the candidates."""

    taken: list[Array] = field(default_factory=list)  # poses, of all candidates that count
    used: set[int] = field(default_factory=set)
    tried: list[int] = field(default_factory=list)  # single poses of the candidates
    failed: list[int] = field(default_factory=list)
    avoided: list[int] = field(default_factory=list)


_Surveyed: TypeAlias = tuple[Survey, Array, dict[str, Array]]


class Chooser:
    """Holds a completion of what is measured, and gives its poses one by one.

    Candidates are poses that are measured together, shape (n, together, coordinates): single ones,
    or pairs for what is observed between them.
    """

    def __init__(
        self,
        robot: Mechanism,
        candidates: Array,
        observe: Observed | None,
        unknowns: Mapping[str, Any],
        target: Target,
        seed: int,
    ) -> None:
        self.robot, self.candidates, self.target = robot, candidates, target
        self._observe, self._unknowns, self._seed = observe, unknowns, seed
        # The poses that the promise is for: some of them may not be measured.
        self._over = thinned(expected_over(robot, target.of), _AMONG)
        poses = candidates.reshape(-1, candidates.shape[2])
        coordinates = workspace_coordinates(robot, poses)
        spread = coordinates.std(axis=0)
        places = coordinates / np.where(spread > 0, spread, 1.0)
        self._places = places  # of single poses, one candidate's after the other
        self._regions = Regions(places, robot.space.size, seed)
        self.begin()

    def begin(self) -> None:
        """Forget all tries."""
        self._tries = _Tries()
        self.queue: list[int] = []  # the next poses, in their order
        self._held: list[int] = []  # the completion without them
        self._begun: list[Array] = []  # poses taken of the first of them
        self.planned = False
        self._stale = False
        self.more = 0  # rows that are needed besides those taken, as far as can be told

    def kept(self) -> dict[str, Any]:
        """What has become of the tries so far, to go `back` to."""
        return copy.deepcopy({name: getattr(self, name) for name in _KEPT})

    def back(self, kept: Mapping[str, Any]) -> None:
        """Forget the tries since."""
        vars(self).update(copy.deepcopy(dict(kept)))

    def start(self, pose: Array | None) -> None:
        """The first of several poses that are measured together was taken; None: it is not."""
        self._begun = [] if pose is None else [pose]
        self.more = max(self.more - len(self._begun), 0)

    def take(self, group: Array | None) -> None:
        """Poses were measured, together, of one candidate; None if nobody knows which."""
        if group is None:
            return
        self.more = max(self.more - len(group) + len(self._begun), 0)
        self._begun = []
        self._tries.taken.append(group)
        place = self._place(group)
        if place is not None:
            self._tries.used.add(place)
            self._tries.tried.extend(self._singles(place))
            self._drop(place)
        if not self.queue or self._stale:
            self.planned = False

    def again(self) -> None:
        """What is known has changed: choose anew, once all of a candidate is taken."""
        self._stale = True
        self.planned = bool(self._begun)

    def fail(self, pose: Array, *, counts: bool = True, avoid: bool = False) -> None:
        """A pose could not be taken, or shall not be; `avoid` its neighbourhood too."""
        at = len(self._begun)
        place = self._place(np.array([*self._begun, pose]))
        self._begun = []
        if place is None:
            return
        self._tries.used.add(place)
        where = self._singles(place)[at]
        if counts:
            self._tries.tried.append(where)
            self._tries.failed.append(where)
        if avoid:
            self._tries.avoided.append(where)
        self._held = [*self.queue, *self._held]
        self.queue = []
        self._drop(place)
        self.planned = False

    @property
    def region_fails(self) -> bool:
        """Whether the last failure was the second nearby."""
        failed = self._tries.failed
        if len(failed) < 2:
            return False
        return bool(self._near(failed[-1])[failed[:-1]].any())

    def plan(self, estimate: Estimate[Any] | None, confidence: float, again: Array) -> None:
        """Choose the next poses, by the robot as it is known now.

        The accuracy shall be kept with this confidence, poses `again` being measured once more.
        """
        among = self._looked_at()
        completing, reached = self._completing(among, estimate, confidence, again)
        held = np.searchsorted(among, np.array([*self.queue, *self._held], dtype=np.intp))
        members = completing.completion(held.tolist(), reached, _MOST)
        first = completing.first(members, _AHEAD)
        chosen = among[first].tolist()
        self._held = among[[each for each in members if each not in first]].tolist()
        start = self._tries.taken[-1][-1] if self._tries.taken else None
        order = visiting_order(self.robot, self.candidates[chosen, 0], self._seed, start)
        self.queue = [chosen[place] for place in order.tolist()]
        self.planned, self._stale = True, False
        done = reached(completing.covariance([]))
        self.more = 0 if done else len(members) * self.candidates.shape[1]

    @property
    def ahead(self) -> Array:
        """The next poses, as far as they are chosen."""
        poses = self.candidates[self.queue].reshape(-1, self.candidates.shape[2])
        return np.asarray(poses[len(self._begun) :])

    @property
    def begun(self) -> bool:
        """Whether the next pose is measured with the one before."""
        return bool(self._begun)

    def floor(self) -> tuple[dict[str, float], tuple[str, ...]]:
        """What all candidates together would not undercut, and the unknowns that do it.

        Bounds by name, m and rad, and names of what priors alone hold even then, the worst first.
        """
        survey, _, forms = self._at_drawing
        covariance = self._known_at_best
        shares = np.sqrt(np.diag(covariance)) / survey.priors
        names = [survey.unknowns[i] for i in np.argsort(-shares) if shares[i] > SILENT]
        covariance = with_assumed(covariance, survey.assumed)
        return self._bounds(forms, covariance, self.target.confidence), tuple(names)

    @cached_property
    def shown(self) -> dict[str, float]:
        """Single coordinates that would be as accurate as was wanted of more, and their floors."""
        wanted, found = self.target.position, dict[str, float]()
        if self.target.of is not None or wanted is None or self.floor()[0]["position"] <= wanted:
            return found
        survey = self._at_drawing[0]
        probed = self._observe is not None and "height" in self._observe.kinds
        for each in _SINGLE:
            if each in self.robot.space.position or (probed and each == "height"):
                poses = thinned(expected_over(self.robot, each), _AMONG)
                form, *_ = survey.error_forms(poses, each)
                covariance = with_assumed(self._known_at_best, survey.assumed)
                floor = bound_of(form, covariance, self.target.confidence)
                if floor < wanted:
                    found[each] = floor
        return found

    @cached_property
    def _known_at_best(self) -> Array:
        """The unknowns' covariance, if all candidates were measured of the robot as drawn."""
        survey, rows, _ = self._at_drawing
        flat = rows[np.isfinite(rows).all(axis=(1, 2))].reshape(-1, rows.shape[2])
        known = np.linalg.inv(_prior_information(survey) + flat.T @ flat)
        return np.asarray(np.outer(survey.scale, survey.scale) * known)

    def reaches(self, estimate: Estimate[Any], confidence: float, again: Array) -> bool:
        """Whether the accuracy is kept with this confidence once these poses are measured again."""
        survey = self._survey(estimate, self._taken_at(estimate, again))
        information = self._information(survey, estimate, again)
        reached = self._reached(survey, self._forms(survey), estimate, confidence)
        return reached(np.asarray(np.linalg.inv(information)))

    def _looked_at(self) -> NDArray[np.intp]:
        """The candidates to choose from now, in their order: of many a part, and those held."""
        count = len(self.candidates)
        if count <= _LOOKED_AT:
            return np.arange(count)
        random = np.random.default_rng([self._seed, len(self._tries.used)])
        some = random.choice(count, _LOOKED_AT, replace=False)
        return np.unique([*some.tolist(), *self.queue, *self._held]).astype(np.intp)

    def _completing(
        self,
        among: NDArray[np.intp],
        estimate: Estimate[Any] | None,
        confidence: float,
        again: Array,
    ) -> tuple[Completing, Callable[[Array], bool]]:
        survey, rows, forms = self._surveyed(among, estimate)
        scaled = np.outer(survey.scale, survey.scale)
        # What is assumed stays as it is, whatever is measured.
        count = len(scaled)
        squares = [
            forms[name][:count, :count] / wanted**2 * scaled
            for name, wanted in self.target.wanted.items()
        ]
        chance = self._chance()[among] * np.isfinite(rows).all(axis=(1, 2))
        information = self._information(survey, estimate, again)
        completing = Completing(
            np.nan_to_num(rows), sum(squares[1:], squares[0]), information, chance
        )
        return completing, self._reached(survey, forms, estimate, confidence)

    def _information(self, survey: Survey, estimate: Estimate[Any] | None, again: Array) -> Array:
        """Of what was measured and will be `again`, in units of the unknowns' scale."""
        scale, poses = survey.scale, list(again)
        known = self._known(survey, estimate)
        if known is not None:
            information = np.asarray(np.linalg.inv(known / np.outer(scale, scale)))
        else:
            information = _prior_information(survey)
            poses += [pose for group in self._tries.taken for pose in group]
        if poses:
            taken = self._taken_at(estimate, np.array(poses))
            own = survey.rows(taken).reshape(-1, len(scale)) * scale
            own = own[np.isfinite(own).all(axis=1)]
            information = information + own.T @ own
        return information

    def _reached(
        self,
        survey: Survey,
        forms: Mapping[str, Array],
        estimate: Estimate[Any] | None,
        confidence: float,
    ) -> Callable[[Array], bool]:
        """Whether the accuracy is kept with a covariance, in units of the unknowns' scale."""
        factors = (estimate.noise_factor, estimate.conflict_factor) if estimate else (1.0, 1.0)
        scaled = np.outer(survey.scale, survey.scale)
        wanted = {name: forms[name] for name in self.target.wanted}

        def reached(covariance: Array) -> bool:
            printed = widened_by(scaled * covariance, survey.layout.prior_rows, *factors)
            bounds = self._bounds(wanted, with_assumed(printed, survey.assumed), confidence)
            return all(bounds[name] <= value for name, value in self.target.wanted.items())

        return reached

    def _surveyed(self, among: NDArray[np.intp], estimate: Estimate[Any] | None) -> _Surveyed:
        if estimate is None:
            survey, rows, forms = self._at_drawing
            return survey, rows[among], forms
        return self._surveyed_at(self.candidates[among], estimate)

    @cached_property
    def _at_drawing(self) -> _Surveyed:
        return self._surveyed_at(self.candidates, None)

    def _surveyed_at(self, candidates: Array, estimate: Estimate[Any] | None) -> _Surveyed:
        poses = self._taken_at(estimate, candidates.reshape(-1, candidates.shape[2]))
        survey = self._survey(estimate, poses)
        rows = survey.rows(poses) * survey.scale
        rows = rows.reshape(len(candidates), -1, rows.shape[2])
        return survey, rows, self._forms(survey)

    def _survey(self, estimate: Estimate[Any] | None, poses: Array) -> Survey:
        survey = Survey.of(self._as_known(estimate), poses, self._observe, self._unknowns)
        assert survey is not None  # since there is always a prior
        if not survey.options.assume:
            return survey
        own = self._own(survey, estimate)
        if estimate is not None and own is not None:
            known = (replace(each, moves=each.moves[own]) for each in estimate.assumed)
            return replace(survey, assumed=tuple(known))
        some = thinned(poses, _ASSUMED_AT)
        return survey.assuming(some[np.isfinite(survey.rows(some)).all(axis=(1, 2))])

    def _forms(self, survey: Survey) -> dict[str, Array]:
        poses = over_bed(survey.mechanism, self._over, self.target.of)
        position, orientation, *_ = survey.error_forms(poses, self.target.of)
        return {"position": position, "orientation": orientation}

    def _known(self, survey: Survey, estimate: Estimate[Any] | None) -> Array | None:
        """What an estimate knows of the unknowns, with whatever else it has taken for unknown."""
        own = self._own(survey, estimate)
        if estimate is None or own is None:
            return None
        return np.asarray(estimate.model_covariance[np.ix_(own, own)])

    def _own(self, survey: Survey, estimate: Estimate[Any] | None) -> list[int] | None:
        """Where the unknowns are among those of an estimate, unless a row has spoilt it."""
        if estimate is None or estimate.widened > _SPOILT:
            return None
        if not set(survey.unknowns) <= set(estimate.names):
            return None
        return [estimate.names.index(name) for name in survey.unknowns]

    def _as_known(self, estimate: Estimate[Any] | None) -> Mechanism:
        """The robot where it is linearised: as estimated, unless a row has spoilt the estimate."""
        if estimate is None or estimate.widened > _SPOILT:
            return self.robot
        known = self.robot.with_parameters(estimate.mechanism.parameters, symmetry=None)
        settings, frames = known.identification, estimate.options.frames or ()
        if settings is not None and {*frames} > {*(settings.frames or ())}:  # its device was moved
            known = known.replace(identification=replace(settings, frames=frames))
        return known.replace(frames=estimate.mechanism.frames)

    def _taken_at(self, estimate: Estimate[Any] | None, poses: Array) -> Array:
        """Where the robot as it is known comes to, if the drawing's readings send it to poses."""
        known = self._as_known(estimate)
        if known is self.robot:
            return poses
        found, there = known.forward_kinematics(self.robot.inverse_kinematics(poses), poses)
        return np.where(there[:, None], found, poses)

    def _bounds(
        self, forms: Mapping[str, Array], covariance: Array, confidence: float
    ) -> dict[str, float]:
        return {name: bound_of(form, covariance, confidence) for name, form in forms.items()}

    def _chance(self) -> Array:
        """How likely each candidate can be measured, by what became of the others."""
        tries = self._tries
        chance = self._regions.chance(tries.tried, tries.failed)
        for place in tries.avoided:
            chance[self._near(place, _AVOIDED_SHARE)] = 0
        chance = chance.reshape(self.candidates.shape[:2]).prod(axis=1)
        chance[list(tries.used)] = 0
        return np.asarray(chance)

    def _near(self, place: int, share: float = 1.0) -> NDArray[np.bool_]:
        """The poses around one, this share of all at most: on a bed many are near."""
        away = np.linalg.norm(self._places - self._places[place], axis=1)
        return np.asarray(away < min(_AVOIDED, float(np.quantile(away, share))))

    def _singles(self, place: int) -> range:
        """The poses of a candidate among the single ones."""
        together = self.candidates.shape[1]
        return range(place * together, (place + 1) * together)

    def _place(self, group: Array) -> int | None:
        """The candidate that begins with these poses, the next one before others."""
        away = np.abs(self.candidates[:, : len(group)] - group).max(axis=(1, 2))
        here = np.flatnonzero(away < _SAME).tolist()
        return next((each for each in (*self.queue, *here) if each in here), None)

    def _drop(self, place: int) -> None:
        self.queue = [each for each in self.queue if each != place]
        self._held = [each for each in self._held if each != place]


def _prior_information(survey: Survey) -> Array:
    """In units of the unknowns' scale; what has no prior has a wide one."""
    scale = survey.scale
    known = np.where(np.isfinite(survey.priors), survey.priors, _WIDE * scale)
    relations = survey.layout.relations * scale
    return np.diag((scale / known) ** 2) + relations.T @ relations


def not_known() -> dict[str, float]:
    """Bounds of what nothing is known of yet."""
    return {"position": math.inf, "orientation": math.inf}
