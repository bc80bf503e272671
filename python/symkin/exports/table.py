# SPDX-License-Identifier: MIT
"""A correction table for controllers that know nothing but the nominal kinematics.

At a pose the calibrated robot's readings are g(pose), and the nominal mechanism believes that they
mean another pose. A controller that is told to go there commands these readings, and the robot goes
to the first. Between rows the difference of the two is interpolated linearly in each coordinate.
"""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.evaluation import Evaluation, evaluate
from symkin.exports.exported import ExportOptions, Loss, Written, workspace_poses
from symkin.frames import transforms
from symkin.mechanism import Mechanism, require_same_shape
from symkin.poses import poses_from_bounds, vectors_from_rotations
from symkin.workspace.sample import workspace_coordinates

__all__ = ["write_table"]

Array = NDArray[np.float64]

_GRID = {2: 21, 3: 21, 6: 5}  # poses along each coordinate, by how many there are
_MOST = 10**6


def write_table(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a CSV: pose wanted, then pose to command; what is out of reach has no row."""
    nominal = options.nominal
    if nominal is None:
        raise SymkinError(
            "a correction table needs the mechanism that the controller computes with (--nominal)"
        )
    require_same_shape(mechanism, nominal)
    if mechanism.bound:
        raise SymkinError(
            f'the legs of "{mechanism.name}" bind its platform; expected a mechanism whose '
            "coordinates can all be commanded"
        )
    test = workspace_poses(mechanism)
    assert mechanism.workspace is not None  # or there were no poses
    lower, upper = mechanism.workspace.lower, mechanism.workspace.upper
    count = options.grid or _GRID[len(lower)]
    flat = [a == b for a, b in zip(lower, upper, strict=True)]
    if count < 2 or float(count) ** flat.count(False) > _MOST:
        raise SymkinError(
            f"a grid of {count} poses along each of {len(lower)} coordinates; expected at least 2, "
            f"and at most {_MOST} poses in all"
        )
    bounds = zip(lower, upper, flat, strict=True)
    axes = [np.linspace(a, b, 1 if level else count) for a, b, level in bounds]
    nodes = np.array(list(itertools.product(*axes)))
    commands = _commands(mechanism, nominal, nodes)
    shape = tuple(len(axis) for axis in axes)
    corrections = (commands - nodes).reshape(*shape, len(axes))
    wanted = workspace_coordinates(mechanism, test)
    told = wanted + _interpolated(axes, corrections, wanted)
    covered = np.isfinite(told).all(axis=1)
    if not covered.any():
        raise SymkinError(
            "no cell of the grid is in reach with all its corners; make the workspace's box "
            "smaller, or the grid finer"
        )
    after = _evaluated(mechanism, nominal, test[covered], told[covered])
    before = evaluate(nominal, actual=mechanism, poses=test[covered])
    loss = _loss(after)
    notes = [f"Without the table the errors are {_loss(before)}"]
    missing = len(test) - int(covered.sum())
    if missing:
        notes.append(
            f"{missing} of {len(test)} poses of the workspace lie in cells of the grid with a "
            "corner out of reach: the table says nothing of them, nor do the errors"
        )
    return Written(_csv(mechanism, nodes, commands), tuple(notes), loss)


def _commands(mechanism: Mechanism, nominal: Mechanism, nodes: Array) -> Array:
    """Coordinates to command to go to others; NaN where the robot, or its model, cannot go."""
    poses = poses_from_bounds(mechanism.pose_space, nodes)
    readings = mechanism.inverse_kinematics(poses)
    commands = np.full(nodes.shape, np.nan)
    reached = np.flatnonzero(np.isfinite(readings).all(axis=1))
    if len(reached):
        believed, converged = nominal.forward_kinematics(readings[reached], start=poses[reached])
        taken = reached[converged]
        commands[taken] = workspace_coordinates(nominal, believed[converged])
    if mechanism.pose_space == "planar":
        # The same turn as the pose wanted, which may be beyond half of one.
        turns = np.rint((commands[:, 2] - nodes[:, 2]) / (2 * np.pi))
        commands[:, 2] -= 2 * np.pi * turns
    return commands


def _interpolated(axes: Sequence[Array], values: Array, points: Array) -> Array:
    """Multilinear interpolation on a grid, shape (N, k); NaN beside a node that is NaN."""
    lower, share = [], []
    for axis, column in zip(axes, points.T, strict=True):
        last = max(len(axis) - 2, 0)
        cell = np.clip(np.searchsorted(axis, column, side="right") - 1, 0, last)
        width = axis[cell + 1] - axis[cell] if len(axis) > 1 else np.ones(len(column))
        lower.append(cell)
        share.append((column - axis[cell]) / width)
    found = np.zeros((len(points), values.shape[-1]))
    for corner in itertools.product(*([(0, 1) if len(axis) > 1 else (0,) for axis in axes])):
        weight = np.ones(len(points))
        for up, part in zip(corner, share, strict=True):
            weight *= part if up else 1 - part
        index = tuple(cell + up for cell, up in zip(lower, corner, strict=True))
        found += weight[:, None] * values[index]
    return found


def _evaluated(mechanism: Mechanism, nominal: Mechanism, wanted: Array, told: Array) -> Evaluation:
    """Errors of the poses that the robot takes when other poses are commanded."""
    readings = nominal.inverse_kinematics(poses_from_bounds(nominal.pose_space, told))
    taken = mechanism.forward_kinematics(readings, start=wanted)[0]
    ends = [transforms(mechanism.pose_space, poses) for poses in (taken, wanted)]
    turned = ends[0].rotation @ np.swapaxes(ends[1].rotation, 1, 2)
    moved = np.hstack([ends[0].translation - ends[1].translation, vectors_from_rotations(turned)])
    return Evaluation.of(moved[:, mechanism.space.components], wanted, mechanism)


def _loss(errors: Evaluation) -> Loss:
    if errors.failed:
        raise SymkinError(
            f"{errors.failed} of {errors.failed + errors.evaluated} poses of the workspace cannot "
            "be taken by the nominal mechanism; make the workspace smaller"
        )
    figures = errors.position_max, errors.position_rms
    return Loss(*figures, errors.orientation_max, errors.orientation_rms, errors.evaluated)


def _csv(mechanism: Mechanism, nodes: Array, commands: Array) -> str:
    names = [f"{name}_{unit}" for name, unit in mechanism.space.units.items()]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*names, *(f"command_{name}" for name in names)])
    rows = np.hstack([nodes, commands])
    writer.writerows(rows[np.isfinite(rows).all(axis=1)].tolist())
    return text.getvalue()
