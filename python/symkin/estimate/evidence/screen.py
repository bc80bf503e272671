# SPDX-License-Identifier: MIT
"""How well a correction can do, told without a fit: what makes looking for a mistake cheap."""

from __future__ import annotations

import heapq
import math
import operator
from collections.abc import Iterable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.estimate.evidence.trial import Correction
from symkin.model.chains import shortest
from symkin.model.core_setup import frames_of
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.model.tolerances import parameter_tolerances
from symkin.model.turns import turn_of
from symkin.values import record

__all__ = ["FIRST", "Screen", "ShortList"]

Array = NDArray[np.float64]

_KEPT = 8  # of the edits, by their distance from the drawing
_FRAMED = 12  # of those with unknown frames
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
    step of each leg's parameters. Unknown frames are where forward kinematics puts them.
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
        """Keep the few that can be it."""
        wide: list[Correction] = []
        scored: dict[bool, list[tuple[float, Correction]]] = {False: [], True: []}
        for each in corrections:
            if each.wide:
                wide.append(each)
            else:
                scored[bool(each.options.frames)].append((self.score(each), each))
        framed = heapq.nsmallest(_FRAMED, scored[True], key=operator.itemgetter(0))
        best = heapq.nsmallest(_KEPT, scored[False], key=operator.itemgetter(0))
        settled = [self.settled(each) for _, each in best]
        stepped = sorted(((self.step(each), each) for each in settled), key=operator.itemgetter(0))
        least = stepped[0][0] if stepped else math.inf
        most = _RIVALS * least if least < _EXPLAINED else _HOPELESS
        return ShortList(
            tuple(each for each in stepped[:_FOLLOWED] if each[0] <= most),
            (*(each for value, each in framed if math.isfinite(value)), *wide),
            tuple(each for _, each in (best or framed)[:FIRST]),
            explains=least < _NOISE and least * _BETTER < self.step(stated),
        )

    def score(self, correction: Correction) -> float:
        """Robust distance from the drawing per reading; infinite without any."""
        taken = _Taken.of(correction)
        if taken is None:
            return math.inf
        squares = (taken.residuals / self._widths) ** 2
        squares = np.where(np.isfinite(squares), squares, _LOST)
        logs = np.log1p(np.minimum(squares, _LOST))
        return float(logs[taken.read].mean()) + self._unbound(correction.mechanism, taken)

    @staticmethod
    def agrees(stated: Correction) -> bool:
        """Whether most readings of each leg, or most positions, are where the drawing has them.

        Then a mistake may be there, but no two of them.
        """
        screen = Screen.of(stated)
        if screen is None:
            return not stated.options.frames and _agrees_in_place(stated)
        taken = _Taken.of(stated)
        if taken is None:
            return False
        off = np.where(np.isfinite(taken.residuals), np.abs(taken.residuals), np.inf)
        # No width of a leg out of reach.
        widths = np.where(screen._widths > 0, screen._widths, 1.0)
        off = np.where(taken.read, off / widths, np.nan)
        return bool((np.nanmedian(off[:, taken.read.any(axis=0)], axis=0) < _AGREES).all())

    def step(self, correction: Correction) -> float:
        """Chi-square per reading after one step within the tolerances."""
        taken = _Taken.of(correction)
        return (
            math.inf
            if taken is None
            else self._stepped(correction.mechanism, taken, robust=False)[0]
        )

    def settled(self, correction: Correction) -> Correction:
        """Give values to rows again, where that is the edit, by a robot that learns from them."""
        return correction.settled(self._learnt)

    def _learnt(self, correction: Correction) -> Mechanism | None:
        """The robot after a robust step; None where there are no rows for one."""
        robot, taken = correction.mechanism, _Taken.of(correction)
        if taken is None:
            return None
        _, parameters = self._stepped(robot, taken, robust=True)
        return robot.with_parameters(parameters, symmetry=None)

    @cached_property
    def _widths(self) -> Array:
        """Standard deviation of a reading of each leg, from noise and tolerances, at home."""
        by_pose = self._noise_of(self.drawn, self.drawn.home[None])[0]
        return np.asarray(np.sqrt(by_pose + _by_tolerances(self.drawn)))

    def _noise_of(self, robot: Mechanism, poses: Array) -> Array:
        """Variance of readings less those at measured poses, shape (N, legs)."""
        sigma = np.full(robot.space.dof, self.noise.position)
        sigma[robot.space.size :] = self.noise.orientation
        jacobian = robot.pose_jacobian(poses)
        return np.asarray(self.noise.reading**2 + np.einsum("nld,d->nl", jacobian**2, sigma**2))

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
        known = taken.known
        off = [
            robot.closure(leg, taken.poses[known], np.nan_to_num(taken.readings[known, leg]))
            for leg in range(taken.readings.shape[1])
        ]
        binding = np.stack(off)[..., 1:] / width
        return float(np.log1p(binding[np.isfinite(binding)] ** 2).mean())

    def _stepped(self, robot: Mechanism, taken: _Taken, *, robust: bool) -> tuple[float, Array]:
        """Chi-square per reading, and the parameters, after a step of each leg's."""
        parameters, tolerances = np.array(robot.parameters), parameter_tolerances(robot)
        lost = taken.read & ~np.isfinite(taken.residuals)
        total = _OUT_OF_REACH * float(lost.sum())
        variances = np.full(taken.residuals.shape, np.nan)
        variances[taken.known] = self._noise_of(robot, taken.poses[taken.known])
        usable = taken.read & np.isfinite(taken.residuals) & np.isfinite(variances)
        for leg in range(len(parameters)):
            rows = np.flatnonzero(usable[:, leg])
            free = tolerances[leg] > 0
            jacobian = robot.parameter_jacobian(leg, taken.poses[rows])[:, free]
            scaled = jacobian * tolerances[leg, free]
            own = taken.residuals[rows, leg]
            weights = 1 / variances[rows, leg]
            if robust:
                weights /= 1 + (own / (_BEND * self._widths[leg])) ** 2
            normal = (scaled.T * weights) @ scaled + np.eye(int(free.sum()))
            right = scaled.T @ (weights * own)
            step = np.linalg.solve(normal, right)
            total += float(weights @ own**2 - right @ step)
            parameters[leg, free] += tolerances[leg, free] * step
        return total / max(int(taken.read.sum()), 1), parameters


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
    by_reading = np.linalg.pinv(robot.pose_jacobian(robot.home[None])[0])[:size]
    variances = by_reading**2 @ (_by_tolerances(robot) + noise.reading**2) + noise.position**2
    try:
        drawn = robot.forward_kinematics(measured.readings[known])[0]
    except SymkinError:
        return False
    off = np.linalg.norm(drawn[:, :size] - measured.poses[known, :size], axis=1)
    off = np.where(np.isfinite(off), off, np.inf)
    return bool(np.median(off) < _AGREES * np.sqrt(variances.sum()))


@record
class _Taken:
    """A table against its robot: which readings it has at known poses, and how far they are off."""

    poses: Array
    readings: Array
    known: NDArray[np.bool_]
    read: NDArray[np.bool_]
    residuals: Array

    @classmethod
    def of(cls, correction: Correction) -> _Taken | None:
        """In the robot's own frame; angles the shorter way round. None without any."""
        robot, measured = correction.mechanism, correction.measurements
        if correction.options.frames:
            try:
                few = correction.some(_PLACED).measurements
                setup = correction.model.problem(few, 1).setup
            except SymkinError:
                return None
            robot = robot.replace(frames=frames_of(robot, setup))
        known = np.asarray(np.isfinite(measured.poses).all(axis=1))
        poses = np.array(measured.poses)
        poses[known] = unframed(robot, poses[known])
        residuals = np.full(measured.readings.shape, np.nan)
        away = measured.readings[known] - robot.inverse_kinematics(poses[known])
        for leg in range(away.shape[1]):
            away[:, leg] = shortest(away[:, leg], turn_of(robot, leg))
        residuals[known] = away
        read = known[:, None] & np.isfinite(measured.readings)
        return cls(poses, measured.readings, known, read, residuals) if read.any() else None
