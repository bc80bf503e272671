# SPDX-License-Identifier: MIT
"""A home pose that a mechanism can take."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np

from symkin.analysis.workspace import inside_workspace, workspace_coordinates
from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.model.settings import JointLimits
from symkin.values import Array


def with_usable_home(mechanism: Mechanism, poses: Array) -> Mechanism:
    """Return the mechanism with a home pose that it can take, as its file must have.

    Home stays if it meets the workspace's demands. Otherwise it becomes the nearest of some poses
    that does; failing that, one that the legs reach within their limits. Limits that exclude every
    pose which the legs reach are those of another sensor zero, and go; without any such pose, the
    workspace goes.
    """
    if mechanism.workspace is None:
        return mechanism
    own, none = mechanism.joint_limits, JointLimits()
    poses = poses[np.isfinite(mechanism.inverse_kinematics(poses)).all(axis=1)]
    for fits, limits in ((_fits, own), (_takes_home, own), (_takes_home, none)):
        robot = mechanism if limits is own else mechanism.replace(joint_limits=limits)
        candidates = itertools.chain([robot], _with_home_at(robot, poses))
        found = next(filter(fits, candidates), None)
        if found is not None:
            return found
    return robot.replace(workspace=None)


def _takes_home(mechanism: Mechanism) -> bool:
    """Whether every leg reaches home within its limits."""
    readings = mechanism.inverse_kinematics(mechanism.home)
    return bool(mechanism.within_limits(readings).all())


def _fits(mechanism: Mechanism) -> bool:
    """Whether home meets the demands of its own workspace."""
    try:
        return bool(inside_workspace(mechanism, mechanism.home)[0])
    except SymkinError:
        return False


def _with_home_at(mechanism: Mechanism, poses: Array) -> Iterator[Mechanism]:
    """The mechanism with home at each pose, those that are near home first."""
    settings = mechanism.workspace
    assert settings is not None
    coordinates = workspace_coordinates(mechanism, poses)
    apart = coordinates - workspace_coordinates(mechanism, mechanism.home)
    apart[:, mechanism.space.size :] *= mechanism.characteristic_length
    for row in np.linalg.norm(apart, axis=1).argsort(kind="stable"):
        home = tuple(coordinates[row].tolist())
        yield mechanism.replace(workspace=dataclasses.replace(settings, home=home))
