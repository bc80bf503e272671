# SPDX-License-Identifier: MIT
"""Points on a platform as its poses: their places on it and where the device stands, from nothing.

Places that nobody knows are found by the distances among the points, or, of one or two points, by
turns with the device's frame; `theory.md` has the equations.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.frame_fit import align
from symkin.data.measurements import Measurements
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    STAYS,
    PoseSpace,
    Transform,
    frame,
    in_plane,
    nearest_rotation,
    poses_of,
)
from symkin.values import Array

_ROUNDS = 3
_ALTERNATIONS = 60
_SETTLED = 1e-7  # of the cost, below which an alternation saves nothing
_HARDLY_TILTED = 0.02  # rad: smaller tilts do not show where a point is on the platform
_IN_LINE = 1e-3  # of a body's size: its points are in a line
_MOST_POINTS = 5  # whose orders are all tried
_MOST_ROWS = 200  # of which the one is looked for that is most like all others
_FAR, _NEAR = 10.0, 5.0  # times as far off as most rows are in their best order


class PlacedPoints(NamedTuple):
    """Where a device stands, and where the points are on the platform."""

    base: Transform  # the robot's base in the device's frame
    places: Array  # (n, 3): of the points, in the platform's frame, m
    # What is left of the distances between points seen and points of the robot's poses, m.
    rms: float


def in_three(points: Array) -> Array:
    """Points of a plane or of space, shape (..., 2 or 3), as points of space."""
    return np.concatenate([points, np.zeros((*points.shape[:-1], 3 - points.shape[-1]))], axis=-1)


def whole(values: Array) -> NDArray[np.bool_]:
    """Which rows of numbers, the last dimension, are known."""
    return np.asarray(np.isfinite(values).all(axis=-1))


def motions_of(seen: Array, body: Array, space: PoseSpace) -> Transform:
    """The N motions that bring a body nearest to its points as they were seen (Kabsch 1976).

    Those are of shape (N, n, 3) in the device's frame, NaN where they were hidden; the body has
    shape (n, 3), in a frame of its own. Motions of a platform that never turns are translations; of
    a row whose points leave one open they are NaN.
    """
    shown = whole(seen)
    weights = shown / np.maximum(shown.sum(axis=1, keepdims=True), 1)
    filled = np.where(shown[:, :, None], seen, 0.0)
    middle, own_middle = np.einsum("ni,nik->nk", weights, filled), weights @ body
    own = (body - own_middle[:, None]) * shown[:, :, None]
    rotation = np.broadcast_to(np.eye(3), (len(seen), 3, 3)).copy()
    known = shown.any(axis=1)
    if space.turns:
        moments = np.einsum("nik,nil->nkl", (filled - middle[:, None]) * shown[:, :, None], own)
        sizes = np.linalg.svd(own, compute_uv=False)
        extent = max(float(np.linalg.norm(body - body.mean(axis=0), axis=1).max()), 1e-300)
        if own.shape[1] < (3 if space.in_space else 2):
            known = np.zeros(len(seen), dtype=np.bool_)
        else:
            known = sizes[:, 1 if space.in_space else 0] > _IN_LINE * extent
        for row in np.flatnonzero(known):
            turn = moments[row] if space.in_space else in_plane(moments[row])
            rotation[row] = nearest_rotation(turn)
    translation = middle - np.einsum("nij,nj->ni", rotation, own_middle)
    rotation[~known], translation[~known] = np.nan, np.nan
    return Transform(rotation, translation)


def body_of(seen: Array, space: PoseSpace) -> Array | None:
    """Where points are to each other, by the distances among them (Torgerson 1952), (n, 3).

    In a frame of their own, in their middle; None if two of them were never seen together, and for
    points that do not make a body.
    """
    count, size = seen.shape[1], 3 if space.in_space else 2
    if count < size:
        return None
    squares = np.zeros((count, count))
    for i, j in itertools.combinations(range(count), 2):
        distances = np.linalg.norm(seen[:, i] - seen[:, j], axis=1)
        distances = distances[np.isfinite(distances)]
        if not len(distances):
            return None
        squares[i, j] = squares[j, i] = distances.mean() ** 2
    centring = np.eye(count) - 1 / count
    values, vectors = np.linalg.eigh(-centring @ squares @ centring / 2)
    values, vectors = np.maximum(values[::-1][:size], 0.0), vectors[:, ::-1][:, :size]
    if np.sqrt(values[size - 2]) <= _IN_LINE * np.sqrt(values[0]) or not values[0]:
        return None
    found = in_three(vectors * np.sqrt(values))
    # Distances are those of the mirror image too, which differs for points beyond a plane.
    mirror = np.diag([1.0, -1.0, 1.0] if size == 2 else [1.0, 1.0, -1.0])
    bodies = (_refined(seen, found, space), _refined(seen, found @ mirror, space))
    return min(bodies, key=lambda each: _left(seen, motions_of(seen, each, space), each)[1])


def orders_of_points(seen: Array, body: Array | None = None) -> NDArray[np.intp]:
    """Which of its points each one is in each row, (N, n), by the distances among them.

    Points as seen have shape (N, n, 3), the body (n, 3); without one the points are named as in the
    row that is most like the others. As they stand where only their distances in another order are
    none of the body, or those in several are.
    """
    count = seen.shape[1]
    found = np.tile(np.arange(count), (len(seen), 1))
    rows = np.flatnonzero(whole(seen).all(axis=1))
    if not 2 < count <= _MOST_POINTS or not len(rows):
        return found
    apart = np.linalg.norm(seen[rows, :, None] - seen[rows, None], axis=-1)
    usual = _most_like_all(apart) if body is None else np.linalg.norm(body[:, None] - body, axis=-1)
    orders = np.array(list(itertools.permutations(range(count))))  # as they stand is the first
    off = np.stack([_off(apart, usual[order][:, order]) for order in orders], axis=1)
    best, second = np.sort(off, axis=1)[:, :2].T
    near = _NEAR * float(np.median(best))
    other = (off[:, 0] > _FAR / _NEAR * near) & (best <= near) & (second > near)
    found[rows[other]] = orders[off[other].argmin(axis=1)]
    return found


def _most_like_all(apart: Array) -> Array:
    some = apart[:: -(-len(apart) // _MOST_ROWS)]
    return np.asarray(some[np.argmin([np.sqrt(_off(some, each)).sum() for each in some])])


def _off(apart: Array, usual: Array) -> Array:
    """Root mean square, of each row, of distances less others."""
    return np.asarray(np.sqrt(np.square(apart - usual).mean(axis=(1, 2))))


def _refined(seen: Array, body: Array, space: PoseSpace) -> Array:
    for _ in range(_ROUNDS):
        motions = motions_of(seen, body, space)
        back = np.swapaxes(motions.rotation, 1, 2)
        own = np.einsum("nij,nkj->nki", back, seen - motions.translation[:, None])
        known = whole(own)
        if not known.any(axis=0).all():
            return body
        body = np.nansum(np.where(known[:, :, None], own, 0.0), axis=0) / known.sum(axis=0)[:, None]
    return body


class OwnPoses(NamedTuple):
    """Measured poses in the robot's own frame."""

    poses: Array  # (N, coordinates): of the platform; NaN where it was not measured in full
    # (3,): where on the platform it was measured best: the middle of points, else its origin.
    arm: Array


def own_poses(mechanism: Mechanism, measurements: Measurements) -> OwnPoses:
    """Return measured poses by the frames of a mechanism; by points where no pose was measured."""
    origin = np.zeros(3)
    posed = whole(measurements.poses).any()
    places = mechanism.frames.points if mechanism.frames else ()
    seen = measurements.points
    if posed or seen is None or len(places) != seen.shape[1] or not all(map(len, places)):
        return OwnPoses(unframed(mechanism, measurements.poses), origin)
    assert mechanism.frames is not None
    body, space = in_three(np.array(places)), mechanism.pose_space
    motions = motions_of(in_three(seen), body, mechanism.space)
    known = whole(motions.translation)
    inside = frame(space, mechanism.frames.base).inverse @ Transform(*(e[known] for e in motions))
    poses = np.full_like(measurements.poses, np.nan)
    poses[known] = poses_of(space, inside)
    return OwnPoses(poses, body.mean(axis=0) if known.any() else origin)


def place_points(
    robot: Transform,
    seen: Array,
    given: Array,
    space: PoseSpace,
    *,
    base: Transform = STAYS,
    base_free: bool = True,
    turned: Array | None = None,
) -> PlacedPoints | None:
    """Find the device's frame and the places of points, for a robot that is nearly as drawn.

    Of N poses of the platform in the base's frame, of points in the device's frame, (N, n, 3), and
    of their places in the platform's, (n, 3), those that nobody knows are NaN. `base` is that in
    the device's frame, a start if it is free; `turned`, (N, 3, 3), are orientations that were
    measured of something on the platform. None if no row has both a pose and a point.
    """
    rows = whole(robot.translation) & np.asarray(whole(seen).any(axis=1))
    if not rows.any():
        return None
    problem = _Placing(
        Transform(robot.rotation[rows], robot.translation[rows]),
        seen[rows],
        np.asarray(given, dtype=float),
        space,
        base_free,
    )
    if not base_free:
        return problem.placed(base)
    own = None if turned is None else turned[rows]
    return min((problem.settled(each) for each in problem.starts(base, own)), key=lambda e: e.rms)


class _Placing(NamedTuple):
    robot: Transform
    seen: Array
    given: Array
    space: PoseSpace
    base_free: bool

    def starts(self, base: Transform, turned: Array | None) -> Iterator[Transform]:
        """The base as it is given; for points in the platform's origin; by poses of a body."""
        yield base
        yield self._turned_to(np.nan_to_num(self.given), base)
        for wanted in self._bodies(turned):
            rows = whole(wanted.translation)
            length = float(np.ptp(self.robot.translation, axis=0).max()) or 1.0
            frames = align(
                Transform(self.robot.rotation[rows], self.robot.translation[rows]),
                Transform(wanted.rotation[rows], wanted.translation[rows]),
                length,
                self.space.name,
            )
            if frames is not None:
                yield frames[0]

    def _bodies(self, turned: Array | None) -> Iterator[Transform]:
        if not self.space.turns:
            return
        if turned is not None:
            for point in np.swapaxes(self.seen, 0, 1):
                gone = ~whole(turned.reshape(-1, 9))[:, None]
                yield Transform(turned, np.where(gone, np.nan, point))
        body = body_of(self.seen, self.space)
        if body is not None:
            yield motions_of(self.seen, body, self.space)

    def _turned_to(self, places: Array, base: Transform) -> Transform:
        """The base that brings points at these places nearest to those that were seen."""
        at = self._at(places).reshape(1, -1, 3)[0]
        found = motions_of(self.seen.reshape(1, -1, 3), at, turning(self.space))
        if not np.isfinite(found.translation).all():
            return base
        return Transform(found.rotation[0], found.translation[0])

    def _at(self, places: Array) -> Array:
        arms = np.einsum("nij,kj->nki", self.robot.rotation, places)
        return np.asarray(self.robot.translation[:, None] + arms)

    def settled(self, base: Transform) -> PlacedPoints:
        """Frame and places by turns."""
        found = self.placed(base)
        for _ in range(_ALTERNATIONS if np.isnan(self.given).any() else 1):
            new = self.placed(self._turned_to(found.places, found.base))
            if new.rms >= found.rms * (1 - _SETTLED):
                return new if new.rms < found.rms else found
            found = new
        return found

    def placed(self, base: Transform) -> PlacedPoints:
        """Unknown places, and the base's position unless it is held: linear for its rotation."""
        unknown = np.flatnonzero(np.isnan(self.given).any(axis=1))
        own = np.nan_to_num(self.given)
        turned = base.rotation @ self.robot.rotation
        rest = self.seen - np.einsum("ij,nj->ni", base.rotation, self.robot.translation)[:, None]
        rest = rest - np.einsum("nij,kj->nki", turned, own)
        shown = whole(rest)
        first = 3 if self.base_free else 0
        columns = np.zeros((*rest.shape, first + 3 * len(unknown)))
        if self.base_free:
            columns[..., :3] = np.eye(3)
        else:
            rest = rest - base.translation
        for number, point in enumerate(unknown):
            at = slice(first + 3 * number, first + 3 * number + 3)
            columns[:, point, :, at] = turned
        wanted = rest[shown].ravel()
        matrix = columns[shown].reshape(len(wanted), columns.shape[3])
        solution = np.linalg.lstsq(matrix, wanted, rcond=_HARDLY_TILTED)[0]
        own[unknown] = solution[first:].reshape(-1, 3)
        if not self.space.in_space:
            own[:, 2] = 0.0
        position = solution[:3] if self.base_free else base.translation
        found = Transform(base.rotation, position)
        left = float(np.sqrt(np.mean(np.sum((wanted - matrix @ solution).reshape(-1, 3) ** 2, 1))))
        return PlacedPoints(found, own, left)


def turning(space: PoseSpace) -> PoseSpace:
    """The kind of motions that a frame of this platform makes, which turns where it never does."""
    return space if space.turns else space._replace(rotation=("rx", "ry", "rz"))


def _left(seen: Array, motions: Transform, body: Array) -> tuple[Array, float]:
    """Points as seen less those of a moved body, and their root mean square."""
    made = np.einsum("nij,kj->nki", motions.rotation, body) + motions.translation[:, None]
    left = seen - made
    return left, float(np.sqrt(np.nanmean(left**2)))
