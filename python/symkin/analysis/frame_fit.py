# SPDX-License-Identifier: MIT
"""The constant motions of base and tool that bring poses nearest to others."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from symkin.model.poses import (
    POSE_SPACES,
    STAYS,
    Transform,
    cross_matrices,
    in_plane,
    moved,
    nearest_rotation,
    stepped,
)
from symkin.values import Array

_STEPS = 50
_CONVERGED = 1e-12  # of the step (m, rad), or of the share of the cost that it saves
_DEGENERATE = 1e-11  # of the largest eigenvalue: a frame's motion that no pose shows
_FEW = 500  # poses that decide which start is the best


def align(
    poses: Transform, wanted: Transform, length: float, pose_space: str, *, steps: int = _STEPS
) -> tuple[Transform, Transform] | None:
    """Find the constant motions of base and tool that bring N poses nearest to those wanted.

    Least squares of ``base @ poses @ tool`` against the wanted poses, where a rotation counts as
    the way of a point at `length` from the centre, m; at most so many steps from every start. A
    planar pose is moved in its plane; a platform that never turns has no tool frame, since the base
    frame does the same. Where the poses do not tell base and tool apart, either does. None for so
    few poses that they would always fit.
    """
    space = POSE_SPACES[pose_space]
    base_free, tool_free = space.frame_components, space.frame_components if space.turns else []
    if space.dof * len(wanted.translation) <= len(base_free) + len(tool_free):
        return None
    problem = _Problem(poses, wanted, length, base_free, tool_free)
    few = problem.some(_FEW)
    found = (few.polished(*start, steps) for start in few.starts())
    best = min(found, key=lambda each: few.cost(*each))
    if len(few.wanted.translation) == len(wanted.translation):
        return best
    return problem.polished(*best, steps)


class _Problem(NamedTuple):
    poses: Transform
    wanted: Transform
    length: float
    base_free: list[int]
    tool_free: list[int]

    def some(self, count: int) -> _Problem:
        """The same with about so many of the poses, evenly spread."""
        rows = slice(None, None, max(1, len(self.poses.translation) // count))
        return self._replace(
            poses=Transform(*(part[rows] for part in self.poses)),
            wanted=Transform(*(part[rows] for part in self.wanted)),
        )

    def residuals(self, base: Transform, tool: Transform) -> Array:
        # A point has no orientation, so that the base may turn without a rotation error.
        scale = np.repeat([1.0, self.length if self.tool_free else 0.0], 3)
        return np.asarray(moved(base, self.poses, tool, self.wanted) * scale)

    def cost(self, base: Transform, tool: Transform) -> float:
        return float(np.sum(self.residuals(base, tool) ** 2))

    def starts(self) -> Iterator[tuple[Transform, Transform]]:
        """No motion; what the rotations say; what the positions say."""
        yield STAYS, STAYS
        turns, wanted_turns = self.poses.rotation, self.wanted.rotation
        count = len(turns)
        if 3 in self.base_free:
            # From R_Y = R_B R_P R_T: kron(R_P, R_Y) vec(R_T) = vec(R_B') for all poses alike.
            product = np.einsum("nab,ncd->acbd", turns, wanted_turns).reshape(9, 9)
            stacked = np.linalg.svd(product)[0][:, 0].reshape(3, 3).T
            yield self._turned(stacked * np.sign(np.linalg.det(stacked)))
        # p_Y = b + R_B p_P + R_Y (R_T' t) is linear in b, R_B and R_T' t.
        points = np.einsum("ij,nk->nijk", np.eye(3), self.poses.translation).reshape(count, 3, 9)
        every = np.broadcast_to(np.eye(3), (count, 3, 3))
        matrix = np.concatenate([points, every, wanted_turns], axis=2).reshape(3 * count, 15)
        solution = np.linalg.lstsq(matrix, self.wanted.translation.ravel(), rcond=1e-9)[0]
        turn = solution[:9].reshape(3, 3)
        yield self._turned(turn if 3 in self.base_free else in_plane(turn))

    def _turned(self, near_base: Array) -> tuple[Transform, Transform]:
        """Frames turned as this matrix nearly says; the first step moves them."""
        base = nearest_rotation(near_base)
        tool = np.eye(3)
        if self.tool_free:
            tool = nearest_rotation(
                np.mean(
                    np.swapaxes(base @ self.poses.rotation, 1, 2) @ self.wanted.rotation, axis=0
                )
            )
        return Transform(base, np.zeros(3)), Transform(tool, np.zeros(3))

    def polished(self, base: Transform, tool: Transform, steps: int) -> tuple[Transform, Transform]:
        """Gauss-Newton, with halved steps where a whole one leads upwards."""
        cost = self.cost(base, tool)
        for _ in range(steps):
            step, decrease = self._step(base, tool)
            if decrease <= _CONVERGED * cost or np.abs(step).max() < _CONVERGED:
                break
            size = 1.0
            while size > 1e-6:
                new = _stepped(base, tool, size * step)
                new_cost = self.cost(*new)
                if new_cost <= cost:
                    break
                size /= 2
            else:
                break
            (base, tool), cost = new, new_cost
        return base, tool

    def _step(self, base: Transform, tool: Transform) -> tuple[Array, float]:
        """Tangents (12) of base (on its left) and tool (on its right), and what the cost loses."""
        found = base @ self.poses @ tool
        columns = np.zeros((len(found.translation), 6, 12))
        columns[:, :3, :3] = np.eye(3)
        columns[:, :3, 3:6] = -cross_matrices(found.translation - base.translation) / self.length
        columns[:, 3:, 3:6] = np.eye(3) if self.tool_free else 0.0
        columns[:, :3, 6:9] = base.rotation @ self.poses.rotation
        columns[:, 3:, 9:] = found.rotation
        # The derivative of a rotation vector is left out: it does not change the gradient.
        free = [*self.base_free, *(6 + index for index in self.tool_free)]
        matrix = columns[:, :, free].reshape(-1, len(free))
        gradient = matrix.T @ self.residuals(base, tool).ravel()
        values, vectors = np.linalg.eigh(matrix.T @ matrix)
        shown = values > _DEGENERATE * values[-1]
        along = vectors[:, shown].T @ gradient
        step = np.zeros(12)
        step[free] = -vectors[:, shown] @ (along / values[shown])
        step /= np.tile(np.repeat([1.0, self.length], 3), 2)
        return step, float(np.sum(along**2 / values[shown]))


def _stepped(base: Transform, tool: Transform, step: Array) -> tuple[Transform, Transform]:
    inside = stepped(STAYS, step[6:])
    turned = Transform(tool.rotation @ inside.rotation, tool.translation + inside.translation)
    return stepped(base, step[:6]), turned
