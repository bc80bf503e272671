# SPDX-License-Identifier: MIT
"""What is drawn of a mechanism at a pose, for figures, pages and views to be turned alike."""

from __future__ import annotations

import itertools
import re
from typing import Any, NamedTuple

import numpy as np

from symkin.model.mechanism import Mechanism
from symkin.model.poses import quaternions_from_rotation_vectors
from symkin.values import Array

_SEEN = 0.3  # of the characteristic length
_ARC, _ARC_RADIUS = 37, 0.4  # points of an arc, and its radius as a share of the crank
# Radii at which axes of base, elbow and platform are drawn: on a sphere they may coincide.
_SHELLS = np.array([[1.0], [0.875], [0.75]])


class Joint(NamedTuple):
    """A joint of a chain: its letter, and whether it is the actuated one."""

    kind: str
    actuated: bool

    @property
    def style(self) -> dict[str, Any]:
        """Square if it slides, filled if it is actuated."""
        marker, size = "s" if self.kind == "P" else "o", 7.5 if self.actuated else 6
        return {"marker": marker, "markersize": size, "markeredgewidth": 1.4}


class Skeleton(NamedTuple):
    """What is drawn of a mechanism: per leg its joints and their centres, (joints, 2 or 3), m.

    On a sphere they are the joints' axes, and links are arcs between them. Of a leg that begins
    with an actuated carriage `rails` has the ends of its way, shape (2, 2 or 3), and of one that
    begins with a crank between limits `swings` an arc about its joint, (n, 2 or 3); others None.
    """

    legs: tuple[Array, ...]
    joints: tuple[tuple[Joint, ...], ...]
    on_sphere: bool = False
    rails: tuple[Array | None, ...] = ()
    swings: tuple[Array | None, ...] = ()

    @property
    def points(self) -> Array:
        """All joint centres, one a row; of arcs what lies between them, too."""
        if self.on_sphere:
            return np.concatenate([arcs(leg) for leg in self.legs])
        return np.concatenate([*self.legs, *(each for each in self.rails if each is not None)])

    def scaled(self, factor: float) -> Skeleton:
        """The same in another unit."""

        def times(lines: tuple[Array | None, ...]) -> tuple[Array | None, ...]:
            return tuple(None if each is None else factor * each for each in lines)

        return self._replace(
            legs=tuple(factor * each for each in self.legs),
            rails=times(self.rails),
            swings=times(self.swings),
        )

    @property
    def bodies(self) -> dict[str, Array]:
        """Corners of base and platform in order, of those that have three."""
        outlines = {
            body: outline(np.array([centres[end] for centres in self.legs]))
            for end, body in ((0, "base"), (-1, "platform"))
        }
        return {body: corners for body, corners in outlines.items() if len(corners) > 2}


def skeleton_of(mechanism: Mechanism, pose: Array) -> Skeleton:
    """The joints of all legs at a pose that they reach."""
    joints = tuple(map(joints_of, mechanism.chains))
    readings = mechanism.inverse_kinematics(pose)[0]
    legs = tuple(
        _one_centre_a_joint(drawn_centres(mechanism, leg, pose, reading), len(joints[leg]))
        for leg, reading in enumerate(readings)
    )
    on_sphere, rails = not mechanism.space.moves, rails_of(mechanism, pose, readings)
    return Skeleton(legs, joints, on_sphere, rails, _swings(mechanism, pose))


def _swings(mechanism: Mechanism, pose: Array) -> tuple[Array | None, ...]:
    """Where each crank that a leg begins with may point: an arc about its joint."""
    lower, upper = mechanism.reading_limits
    swings: list[Array | None] = []
    for leg, chain in enumerate(mechanism.chains):
        turns = joints_of(chain)[0] == Joint("R", actuated=True) and mechanism.space.moves
        if not turns or not np.isfinite([lower[leg], upper[leg]]).all():
            swings.append(None)
            continue
        readings = np.linspace(lower[leg], upper[leg], _ARC).tolist()
        ends = np.array([drawn_centres(mechanism, leg, pose, each)[:2] for each in readings])
        swings.append(ends[:, 0] + _ARC_RADIUS * (ends[:, 1] - ends[:, 0]))
    return tuple(swings)


def rails_of(mechanism: Mechanism, pose: Array, readings: Array) -> tuple[Array | None, ...]:
    """The way of each carriage that a leg begins with: to its limits, or as the workspace needs."""
    ends = _ends(mechanism, readings)
    return tuple(
        np.array([drawn_centres(mechanism, leg, pose, end)[1] for end in ends[:, leg].tolist()])
        if joints_of(chain)[0] == Joint("P", actuated=True)
        else None
        for leg, chain in enumerate(mechanism.chains)
    )


def _ends(mechanism: Mechanism, readings: Array) -> Array:
    """Least and largest reading of each leg, shape (2, legs)."""
    settings, limits = mechanism.workspace, mechanism.reading_limits
    taken = readings[np.newaxis]
    if settings is not None:
        lower, upper = np.array(settings.lower), np.array(settings.upper)
        corners = np.array(list(itertools.product(*np.column_stack([lower, upper]).tolist())))
        if mechanism.space.has_quaternion:
            turns = quaternions_from_rotation_vectors(corners[:, mechanism.space.size :])
            corners = np.hstack([corners[:, : mechanism.space.size], turns])
        if corners.shape[1] == len(mechanism.home):
            found = mechanism.inverse_kinematics(corners)
            taken = np.vstack([taken, np.where(np.isfinite(found), found, readings)])
    reached = np.array([taken.min(axis=0), taken.max(axis=0)])
    short = np.ptp(reached, axis=0) <= 0  # where no corner is reached: enough to be seen
    reached += np.where(short, _SEEN, 0.0) * mechanism.characteristic_length * [[-1], [1]]
    return np.where(np.isfinite(limits), limits, reached)


def drawn_centres(mechanism: Mechanism, leg: int, pose: Array, reading: float) -> Array:
    """Centres of a leg's joints, m; of a spherical leg points of its axes, from outside inwards."""
    readings = np.zeros((1, len(mechanism.legs)))
    readings[0, leg] = reading
    straight = float(mechanism.straightened(readings)[0, leg])
    centres = mechanism.straight.joint_centres(leg, pose, straight)
    return centres if mechanism.space.moves else np.asarray(centres * _SHELLS)


def joints_of(chain: str) -> tuple[Joint, ...]:
    """The joints of a chain, from base to platform."""
    joints = chain.split()[0]  # behind it, as of a cable, what it runs over
    return tuple(
        Joint(bracketed or free, bool(bracketed))
        for bracketed, free in re.findall(r"\[(\w)\]|(\w)", joints)
    )


def outline(corners: Array) -> Array:
    """Distinct corners in their order around the middle, seen from above."""
    corners = np.unique(np.round(corners, 9), axis=0)
    around = corners[:, :2] - corners[:, :2].mean(axis=0)
    ordered: Array = corners[np.argsort(np.arctan2(around[:, 1], around[:, 0]))]
    return ordered


def _one_centre_a_joint(centres: Array, joints: int) -> Array:
    """A telescopic leg has centres at its ends only; its actuator is drawn half-way."""
    shares = np.linspace(0, 1, joints - len(centres) + 2)[1:-1, np.newaxis]
    between = centres[0] + shares * (centres[1] - centres[0])
    return np.concatenate([centres[:1], between, centres[1:]])


def arcs(centres: Array) -> Array:
    """Points on the great circles between axes: to the elbow outside, and from it inside."""
    shares = np.linspace(0, 1, 25)[:, np.newaxis]
    axes = centres / np.linalg.norm(centres, axis=1, keepdims=True)
    parts = []
    for (start, end), radius in zip(itertools.pairwise(axes), _SHELLS[[0, 2], 0], strict=True):
        chord = start + shares * (end - start)
        parts.append(radius * chord / np.linalg.norm(chord, axis=1, keepdims=True))
    return np.concatenate(parts)
