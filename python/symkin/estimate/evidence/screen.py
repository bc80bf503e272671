# SPDX-License-Identifier: MIT
"""How well a correction can do, told without a fit: what makes looking for a mistake cheap."""

from __future__ import annotations

import dataclasses
import heapq
import math
import operator
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.trial import Correction, Statement
from symkin.model.core_setup import frames_of
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.model.tolerances import parameter_tolerances
from symkin.model.turns import turn_of
from symkin.values import Array, record

_KEPT = 8  # of the edits, by their distance from the drawing
_FRAMED = 12  # of those with unknown frames
_APART = 5.0  # in scores, of a frame that does what a correction does which explains all
_PLACED = 10  # poses by which unknown frames are placed
_AGREES = 4.0  # standard deviations that half of a leg's readings are from the drawing at most
FIRST = 6  # that are tried with a second
_FOLLOWED = 4  # after a step
_EXPLAINED = 3.0  # per reading: noise leaves about one, what is wrong more than 20
_NOISE = 1.5  # per reading: no more than that
_BETTER = 2.0  # times less than what is stated leaves
_RIVALS = 3.0  # times that, at most
_HOPELESS = 1e4  # per reading, after a step
_LOST = 1e12  # (r/s)^2 of a reading at a pose that the leg cannot take
_OUT_OF_REACH = 1e3  # of chi-square, after a step
_BEND = 3.0  # prior standard deviations, where a robust step's weights fall to a half
_ROWS = 240  # by which corrections are told apart, evenly spread over a longer table


class ShortList(NamedTuple):
    """What is left of many corrections.

    Attributes
    ----------
    likely : tuple of (float, Correction)
        Those that explain best, each with its chi-square per reading after one step.
    open : tuple of Correction
        Those that only a fit judges: they set more free.
    first : tuple of Correction
        Those that come first as they are, to be tried together with others.
    explains : bool
        Whether one leaves no more than noise where what is stated does not, so that nothing need be
        set free.
    """

    likely: tuple[tuple[float, Correction], ...]
    open: tuple[Correction, ...]
    first: tuple[Correction, ...]
    explains: bool = False


@record
class Screen:
    """Corrections of one robot's table where its poses are known in full, and so its readings.

    The readings of an edited table are compared with the inverse kinematics of the drawing, within
    what noise and tolerances make of them: first as they are, robustly, then after one Gauss-Newton
    step of each leg's parameters. Unknown frames are where forward kinematics puts them. What a
    robot has at poses is found once for all corrections that leave both as they are.
    """

    drawn: Mechanism
    noise: NoiseSettings

    @classmethod
    def of(cls, stated: Correction) -> Screen | None:
        """Return that of what is stated; None unless most poses are known in full."""
        known = np.asarray(np.isfinite(stated.measurements.poses).all(axis=1))
        if 2 * known.sum() <= len(known):
            return None
        return cls(stated.mechanism, stated.options.declared(stated.mechanism.noise))

    def short_list(self, stated: Correction, corrections: Iterable[Correction]) -> ShortList:
        """Keep the few that can be it.

        What leaves rows out is open: of a long table they may not be among those looked at.
        """
        wide: list[Correction] = []
        scored: dict[bool, list[tuple[float, Correction]]] = {False: [], True: []}
        for each in corrections:
            if each.wide or each.left_out:
                wide.append(each)
            else:
                scored[bool(each.options.frames)].append((self.score(each), each))
        framed = heapq.nsmallest(_FRAMED, scored[True], key=operator.itemgetter(0))
        best = heapq.nsmallest(_KEPT, scored[False], key=operator.itemgetter(0))
        settled = [self.settled(each) for _, each in best]
        stepped = sorted(((self.step(each), each) for each in settled), key=operator.itemgetter(0))
        least = stepped[0][0] if stepped else math.inf
        most = _RIVALS * least if least < _EXPLAINED else _HOPELESS
        explains = leaves_noise(least, lambda: self.step(stated))
        farthest = self.score(stepped[0][1]) + _APART if explains else math.inf
        return ShortList(
            tuple(each for each in stepped[:_FOLLOWED] if each[0] <= most),
            (*(e for value, e in framed if math.isfinite(value) and value <= farthest), *wide),
            tuple(each for _, each in (best or framed)[:FIRST]),
            explains=explains,
        )

    def score(self, correction: Correction) -> float:
        """Robust distance from the drawing per reading; infinite without any."""
        taken = self._taken(correction)
        if taken is None:
            return math.inf
        squares = (taken.residuals / self._widths) ** 2
        squares = np.where(np.isfinite(squares), squares, _LOST)
        logs = np.log1p(np.minimum(squares, _LOST))
        return float(logs[taken.read].mean()) + self._unbound(correction.mechanism, taken)

    def agrees(self, stated: Correction) -> bool:
        """As the function, by the readings of each leg."""
        taken = self._taken(stated)
        if taken is None:
            return False
        off = np.where(np.isfinite(taken.residuals), np.abs(taken.residuals), np.inf)
        # No width of a leg out of reach.
        widths = np.where(self._widths > 0, self._widths, 1.0)
        off = np.where(taken.read, off / widths, np.nan)
        return bool((np.nanmedian(off[:, taken.read.any(axis=0)], axis=0) < _AGREES).all())

    def step(self, correction: Correction) -> float:
        """Chi-square per reading after one step within the tolerances."""
        taken = self._taken(correction)
        return math.inf if taken is None else self._stepped(taken, robust=False)[0]

    def settled(self, correction: Correction) -> Correction:
        """Give values to rows again, where that is the edit, by a robot that learns from them."""
        return correction.settled(self._learnt)

    def _learnt(self, correction: Correction) -> Mechanism | None:
        """The robot after a robust step; None where there are no rows for one."""
        taken = self._taken(correction)
        if taken is None:
            return None
        _, parameters = self._stepped(taken, robust=True)
        return correction.mechanism.with_parameters(parameters, symmetry=None)

    @cached_property
    def _widths(self) -> Array:
        """Standard deviation of a reading of each leg, from noise and tolerances, at home."""
        by_pose = self._noise_of(self.drawn.pose_jacobian(self.drawn.home[None]))[0]
        return np.asarray(np.sqrt(by_pose + _by_tolerances(self.drawn)))

    @cached_property
    def _places(self) -> dict[tuple[int, bytes], _Place]:
        return {}

    def _taken(self, correction: Correction) -> _Taken | None:
        """Some rows of its table against its robot; None without a reading at a known pose."""
        robot, measured = correction.mechanism, correction.measurements
        if correction.options.frames:
            placed = self._placed(correction)
            if placed is None:
                return None
            robot = placed
        if len(measured.poses) > _ROWS:
            measured = correction.some(_ROWS).measurements
        key = id(robot), measured.poses.tobytes()
        place = self._places.get(key)
        if place is None:
            place = self._places[key] = _Place.of(robot, measured.poses)  # the robot lives with it
        read = place.known[:, None] & np.isfinite(measured.readings)
        return _Taken(place, measured.readings, read) if read.any() else None

    def _placed(self, correction: Correction) -> Mechanism | None:
        """The robot with frames where few of the rows put them; None where they do not say.

        Most corrections leave these rows as they are, or as another one does.
        """
        model, few = correction.model, correction.some(_PLACED).measurements
        key = id(model), few.poses.tobytes(), few.readings.tobytes()
        known = self._robots.setdefault(key, [])
        for own, measured, robot in known:
            if own is model and measured == few:
                return robot
        found = None
        with suppress(SymkinError):
            setup = model.problem(self._with_own_poses(model.mechanism, few), 1).setup
            found = model.mechanism.replace(frames=frames_of(model.mechanism, setup))
        known.append((model, few, found))
        return found

    def _with_own_poses(self, robot: Mechanism, few: Measurements) -> Measurements:
        """Rows with the poses that the robot says it was in, as its controller would.

        Readings are what takes time to get them from, and most corrections leave a row of them.
        """
        bound = len(robot.legs) * robot.closures >= robot.space.dof
        if few.reported is not None or few.commanded is not None or not bound:
            return few
        own, reached = self._reached.setdefault(id(robot), (robot, {}))
        straight = np.ascontiguousarray(robot.straightened(few.readings))
        nowhere = np.full(len(robot.home), np.nan)
        known = np.array([reached.get(row.tobytes(), nowhere) for row in straight])
        poses = known
        if np.isnan(known).any():
            key = straight.tobytes()  # rows that nothing leads to stay so
            if key not in reached:
                reached[key] = _core.continued(own.straight, straight, robot.home, known)
            poses = reached[key]
            found = np.isfinite(poses).all(axis=1)
            reached |= {r.tobytes(): p for r, p in zip(straight[found], poses[found], strict=True)}
        read = np.where(np.isfinite(poses).all(axis=1)[:, None], few.readings, np.nan)
        return dataclasses.replace(few, readings=read, reported=poses)

    @cached_property
    def _reached(self) -> dict[int, tuple[Mechanism, dict[bytes, Array]]]:
        return {}

    @cached_property
    def _robots(self) -> dict[object, list[tuple[Statement, Measurements, Mechanism | None]]]:
        return {}

    def _noise_of(self, by_pose: Array) -> Array:
        """Variance of readings less those at measured poses, shape (N, legs)."""
        space = self.drawn.space
        sigma = np.full(space.dof, self.noise.position)
        sigma[space.size :] = self.noise.orientation
        return np.asarray(self.noise.reading**2 + np.einsum("nld,d->nl", by_pose**2, sigma**2))

    def _unbound(self, robot: Mechanism, taken: _Taken) -> float:
        """As a score, how far poses are from those that the legs leave to a platform they bind."""
        if not robot.bound:
            return 0.0
        tolerances = robot.tolerances
        width = math.hypot(
            self.noise.position,
            self.noise.orientation * robot.characteristic_length,
            tolerances.length,
            tolerances.angle * robot.characteristic_length,
        )
        off = [
            taken.place.closure(leg, taken.readings[:, leg])
            for leg in range(taken.readings.shape[1])
        ]
        binding = np.stack(off)[..., 1:] / width
        return float(np.log1p(binding[np.isfinite(binding)] ** 2).mean())

    def _stepped(self, taken: _Taken, *, robust: bool) -> tuple[float, Array]:
        """Chi-square per reading, and the parameters, after a step of each leg's."""
        place = taken.place
        parameters, tolerances = np.array(place.robot.parameters), place.tolerances
        residuals = taken.residuals
        lost = taken.read & ~np.isfinite(residuals)
        total = _OUT_OF_REACH * float(lost.sum())
        variances = self._noise_of(place.by_pose)
        usable = taken.read & np.isfinite(residuals) & np.isfinite(variances)
        for leg in range(len(parameters)):
            rows = np.flatnonzero(usable[:, leg])
            free = tolerances[leg] > 0
            scaled = place.by_tolerances[leg][rows]
            own = residuals[rows, leg]
            weights = 1 / variances[rows, leg]
            if robust:
                weights /= 1 + (own / (_BEND * self._widths[leg])) ** 2
            normal = (scaled.T * weights) @ scaled + np.eye(int(free.sum()))
            right = scaled.T @ (weights * own)
            step = np.linalg.solve(normal, right)
            total += float(weights @ own**2 - right @ step)
            parameters[leg, free] += tolerances[leg, free] * step
        return total / max(int(taken.read.sum()), 1), parameters


def leaves_noise(after: float, before: Callable[[], float]) -> bool:
    """Whether a correction leaves no more than noise, and so much less than what is stated.

    Of both chi-square per reading, or per degree of freedom.
    """
    return after < _NOISE and after * _BETTER < before()


def agrees(stated: Correction, screen: Screen | None) -> bool:
    """Whether most readings of each leg, or most positions, are where the drawing has them.

    Then a mistake may be there, but no two of them.
    """
    if screen is None:
        return not stated.options.frames and _agrees_in_place(stated)
    return screen.agrees(stated)


def _by_tolerances(robot: Mechanism) -> Array:
    """Variance of each leg's reading at home, from the tolerances alone."""
    home, tolerances = robot.home[None], parameter_tolerances(robot)
    moved = [
        robot.parameter_jacobian(leg, home)[0] * tolerances[leg] for leg in range(len(tolerances))
    ]
    return np.asarray(np.nansum(np.square(moved), axis=1))


def _agrees_in_place(stated: Correction) -> bool:
    """Whether most positions are where the drawing has them at the readings."""
    robot, measured = stated.mechanism, stated.measurements
    size = measured.space.size
    observed = np.hstack([measured.poses[:, :size], measured.readings])
    known = np.asarray(np.isfinite(observed).all(axis=1))
    if not size or 2 * known.sum() <= len(known):
        return False
    noise = stated.options.declared(robot.noise)
    by_pose = robot.pose_jacobian(robot.home[None])[0]
    if not np.isfinite(by_pose).all():  # the drawing does not reach its own home
        return False
    by_reading = np.linalg.pinv(by_pose)[:size]
    variances = by_reading**2 @ (_by_tolerances(robot) + noise.reading**2) + noise.position**2
    try:
        drawn = robot.forward_kinematics(measured.readings[known])[0]
    except SymkinError:
        return False
    off = np.linalg.norm(drawn[:, :size] - measured.poses[known, :size], axis=1)
    off = np.where(np.isfinite(off), off, np.inf)
    return bool(np.median(off) < _AGREES * np.sqrt(variances.sum()))


@record
class _Place:
    """A robot at poses, in its own frame: its readings there and their derivatives, found once."""

    robot: Mechanism
    poses: Array
    known: NDArray[np.bool_]

    @classmethod
    def of(cls, robot: Mechanism, measured: Array) -> _Place:
        """At poses as they were measured, of which some may not be known."""
        known = np.asarray(np.isfinite(measured).all(axis=1))
        poses = np.array(measured)
        poses[known] = unframed(robot, poses[known])
        return cls(robot, poses, known)

    @cached_property
    def readings(self) -> Array:
        """Shape (N, legs); NaN where a pose is not known, or a leg does not reach it."""
        found = np.full((len(self.poses), len(self.robot.legs)), np.nan)
        found[self.known] = self.robot.inverse_kinematics(self.poses[self.known])
        return found

    def closure(self, leg: int, readings: Array) -> Array:
        """Of a leg at the known poses, shape (n, k), zero for a reading that there is not.

        Most corrections leave the readings of most legs as they are.
        """
        own = np.nan_to_num(readings[self.known])
        key = leg, own.tobytes()
        if key not in self._closures:
            self._closures[key] = self.robot.closure(leg, self.poses[self.known], own)
        return self._closures[key]

    @cached_property
    def _closures(self) -> dict[tuple[int, bytes], Array]:
        return {}

    @cached_property
    def turns(self) -> Array:
        """Turns of the legs' sensors; NaN of lengths."""
        turns = (turn_of(self.robot, leg) for leg in range(len(self.robot.legs)))
        return np.array([math.nan if each is None else each for each in turns])

    @cached_property
    def tolerances(self) -> Array:
        """Of the parameters, shape (legs, p)."""
        return parameter_tolerances(self.robot)

    @cached_property
    def by_pose(self) -> Array:
        """Shape (N, legs, dof); NaN where no leg reaches."""
        reached = np.isfinite(self.readings).any(axis=1)
        found = np.full((*self.readings.shape, self.robot.space.dof), np.nan)
        found[reached] = self.robot.pose_jacobian(self.poses[reached])
        return found

    @cached_property
    def by_tolerances(self) -> tuple[Array, ...]:
        """By what each leg has tolerances for, in these, shape (N, k)."""
        found = []
        for leg, tolerances in enumerate(self.tolerances):
            reached = np.isfinite(self.readings[:, leg])
            free = tolerances > 0
            rows = np.full((len(self.poses), int(free.sum())), np.nan)
            jacobian = self.robot.parameter_jacobian(leg, self.poses[reached])
            rows[reached] = jacobian[:, free] * tolerances[free]
            found.append(rows)
        return tuple(found)


@record
class _Taken:
    """Readings at a place, and which of them there are at known poses."""

    place: _Place
    readings: Array
    read: NDArray[np.bool_]

    @cached_property
    def residuals(self) -> Array:
        """Readings less the robot's, angles the shorter way round; NaN out of its reach."""
        away, turns = self.readings - self.place.readings, self.place.turns
        return np.where(np.isnan(turns), away, away - turns * np.round(away / turns))
