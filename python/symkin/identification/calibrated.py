# SPDX-License-Identifier: MIT
"""Parameters that were found, as a mechanism that can be written, read and used."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from symkin.errors import FailedFitError, MechanismError, SymkinError
from symkin.frames import anchor, with_moved_workspace
from symkin.mechanism import Mechanism
from symkin.points import with_correlations
from symkin.settings import JointLimits
from symkin.workspace.sample import inside_workspace, workspace_coordinates

__all__ = [
    "as_mechanism",
    "calibrated_mechanism",
    "canonical",
    "changed_settings",
    "with_usable_home",
]

Array = NDArray[np.float64]

_TURN = 2 * np.pi
_FARTHEST = 1e12  # m and rad, which no file may hold either
_LOOK_FOR = (
    "look for readings in another unit, of another leg, or with another sign, zero or working mode "
    "than the mechanism has, and for poses in another unit or frame"
)


def calibrated_mechanism(
    nominal: Mechanism, parameters: Array, covariance: Array, poses: Array
) -> tuple[Mechanism, Array]:
    """Return the mechanism that an estimate describes, and the covariance of its parameters.

    Points are given by radii that are not negative and angles near the nominal ones. Where the
    frames of the measurements are others than the nominal ones, home and the workspace's box move
    with them; see also `with_usable_home`.

    Parameters
    ----------
    nominal : Mechanism
        From which the estimate started.
    parameters : ndarray, shape (legs, p)
        The estimate.
    covariance : ndarray, shape (legs p, legs p)
        Of the estimate; where a radius changes its sign, its covariances do.
    poses : ndarray, shape (N, coordinates)
        At which the robot was measured.

    Raises
    ------
    FailedFitError
        If no mechanism has such parameters.
    """
    values, signs = canonical(nominal, parameters)
    covariance = covariance * np.outer(signs, signs)
    made = as_mechanism(nominal, values, np.sqrt(np.diag(covariance)).reshape(values.shape))
    made = with_correlations(made, covariance)
    return with_usable_home(with_moved_workspace(nominal, made), poses), covariance


def as_mechanism(nominal: Mechanism, values: Array, deviations: Array) -> Mechanism:
    """Return the mechanism with parameters (legs, p) that were found, without its symmetry.

    What is held has no standard deviation.

    Raises
    ------
    FailedFitError
        If no mechanism has such parameters.
    """
    far = np.argwhere(~(np.abs(values) < _FARTHEST))
    if len(far):
        leg, parameter = far[0]
        raise FailedFitError(
            f"the estimate ran away: leg {leg + 1}, {nominal.parameter_names[parameter]} = "
            f"{values[leg, parameter]:.3g}; {_LOOK_FOR}"
        )
    legs = range(len(nominal.legs))
    given = np.array([[role.is_given for role in nominal.parameter_roles(leg)] for leg in legs])
    known = nominal.is_estimated | (given & (deviations > 0))  # given, but freed
    deviations = np.where(known, deviations, np.nan)
    try:
        made = nominal.with_parameters(values, deviations, symmetry=None)
    except MechanismError as error:
        raise FailedFitError(
            f"the estimate is no mechanism: {error}. {_LOOK_FOR.capitalize()}"
        ) from error
    return with_correlations(made, None)


def canonical(mechanism: Mechanism, parameters: Array) -> tuple[Array, Array]:
    """Write points with radii that are not negative, and angles within half a turn of another's.

    The closures stay the same. A guide's distance from the centre keeps its sign, on which the
    direction of travel depends, and so does a base's radius less a platform's.

    Parameters
    ----------
    mechanism : Mechanism
        Whose chains they are, and whose angles are stayed near.
    parameters : ndarray, shape (legs, p)
        Of the same chains; or of many robots, leg by leg, robot by robot.

    Returns
    -------
    values : ndarray, shape (legs, p)
        Equivalent parameters.
    signs : ndarray, shape (legs p,)
        Derivative of each value by its parameter: -1 where a sign changed.
    """
    values = np.array(parameters, dtype=float)
    signs = np.ones_like(values)
    count = len(mechanism.legs)
    for leg in range(count):
        _make_canonical(mechanism, leg, values[leg::count], signs[leg::count])
    return values, signs.ravel()


def _make_canonical(mechanism: Mechanism, leg: int, values: Array, signs: Array) -> None:
    """Do so with a leg (from 0) of robots, shape (robots, p); in place."""
    names, roles = list(mechanism.parameter_names), mechanism.parameter_roles(leg)
    info, near = mechanism.leg_info(leg), mechanism.parameters[leg]
    for end in ("base", "platform"):
        if anchor(info, end) != "point" or info.signed_radius:
            continue
        radius = roles.index((end, "radius"))
        azimuth = roles.index((end, "azimuth"))
        for row in np.flatnonzero(values[:, radius] < 0):
            values[row, [radius, azimuth]] = -values[row, radius], values[row, azimuth] + np.pi
            signs[row, radius] = -1
            if (end, "polar_angle") in roles:
                polar = roles.index((end, "polar_angle"))
                values[row, polar] = np.pi - values[row, polar]
                signs[row, polar] = -1
    angles = [
        index
        for index, role in enumerate(roles)
        if role.kind in ("polar_angle", "swing") or role.kind.endswith(("azimuth", "_elevation"))
    ]
    values[:, angles] = _nearest_turn(values[:, angles], near[angles])
    for end in ("base", "platform"):
        # The angle of a link is counted from its axis' meridian, which would be another one.
        counted = end == "base" and anchor(info, end) == "axis"
        if (end, "polar_angle") in roles and not counted:
            _take_nearer_polar_angle(values, signs, near, names, end)


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
    for fits, limits in ((_fits, own), (_takes_home, own), (_takes_home, none)):
        robot = mechanism if limits is own else mechanism.replace(joint_limits=limits)
        candidates = itertools.chain([robot], _with_home_at(robot, poses))
        found = next(filter(fits, candidates), None)
        if found is not None:
            return found
    return robot.replace(workspace=None)


def _nearest_turn(angles: Array, near: Array) -> Array:
    return angles - _TURN * np.round((angles - near) / _TURN)


def _take_nearer_polar_angle(
    values: Array, signs: Array, near: Array, names: list[str], end: str
) -> None:
    """Of the two ways to write a direction, take the one that is nearer; in place."""
    columns = [names.index(f"{end}_polar_angle"), names.index(f"{end}_azimuth")]
    found = values[:, columns]
    other = _nearest_turn(found * [-1, 1] + [0, np.pi], near[columns])
    apart = [np.abs(each - near[columns]).sum(axis=1) for each in (found, other)]
    nearer = apart[1] < apart[0]
    values[np.ix_(nearer, columns)] = other[nearer]
    signs[nearer, columns[0]] *= -1


def changed_settings(nominal: Mechanism, calibrated: Mechanism) -> list[str]:
    """Say in sentences what was changed besides the parameters, and why."""
    before, after = nominal.workspace, calibrated.workspace
    changes = []
    if before is not None and after is None:
        changes.append("The workspace is left out, since the legs found reach no measured pose.")
    elif before is not None and after is not None and after != before:
        if (after.lower, after.upper) == (before.lower, before.upper):
            changes.append("Home is a measured pose, since the legs found do not suit the old one.")
        else:
            changes.append("Home and workspace are moved, as the frames are not the nominal ones.")
    if calibrated.joint_limits != nominal.joint_limits:
        changes.append("The joint limits are left out, since the zeros found do not suit them.")
    return changes


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
