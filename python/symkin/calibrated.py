# SPDX-License-Identifier: MIT
"""Parameters that were found, as a mechanism that can be written, read and used."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from symkin.errors import FailedFitError
from symkin.frames import anchor, with_moved_workspace
from symkin.mechanism import Mechanism
from symkin.settings import JointLimits
from symkin.workspace import workspace_coordinates

__all__ = ["calibrated_mechanism", "canonical", "with_usable_home"]

Array = NDArray[np.float64]

_TURN = 2 * np.pi
_NO_GAIN = 1e-9  # of the nominal one


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
    _require_possible(nominal, parameters)
    values, signs = canonical(nominal, parameters)
    covariance = covariance * np.outer(signs, signs)
    deviations = np.sqrt(np.diag(covariance)).reshape(values.shape)
    made = nominal.replace(symmetry=None).with_parameters(values, deviations)
    return with_usable_home(with_moved_workspace(nominal, made), poses), covariance


def canonical(mechanism: Mechanism, parameters: Array) -> tuple[Array, Array]:
    """Write points with radii that are not negative, and angles within half a turn of another's.

    The closures stay the same. A guide's distance from the centre keeps its sign, on which the
    direction of travel depends.

    Parameters
    ----------
    mechanism : Mechanism
        Whose chain it is, and whose angles are stayed near.
    parameters : ndarray, shape (legs, p)
        Of the same chain.

    Returns
    -------
    values : ndarray, shape (legs, p)
        Equivalent parameters.
    signs : ndarray, shape (legs p,)
        Derivative of each value by its parameter: -1 where a sign changed.
    """
    names = list(mechanism.parameter_names)
    values = np.array(parameters, dtype=float)
    signs = np.ones_like(values)
    near = mechanism.parameters
    for end in ("base", "platform"):
        if anchor(mechanism, end) != "point":
            continue
        radius = names.index(f"{end}_radius")
        azimuth = names.index(
            f"{end}_azimuth" if mechanism.pose_space == "spatial" else f"{end}_angle"
        )
        for leg in np.flatnonzero(values[:, radius] < 0):
            values[leg, [radius, azimuth]] = -values[leg, radius], values[leg, azimuth] + np.pi
            signs[leg, radius] = -1
            if mechanism.pose_space == "spatial":
                polar = names.index(f"{end}_polar_angle")
                values[leg, polar] = np.pi - values[leg, polar]
                signs[leg, polar] = -1
    angles = [index for index, name in enumerate(names) if name.endswith(("_angle", "_azimuth"))]
    values[:, angles] = _nearest_turn(values[:, angles], near[:, angles])
    if mechanism.pose_space == "spatial":
        for end in ("base", "platform"):
            _take_nearer_polar_angle(values, signs, near, names, end)
    return values, signs.ravel()


def with_usable_home(mechanism: Mechanism, poses: Array) -> Mechanism:
    """Return the mechanism with a home pose that it can take, as its file must have.

    A home pose that a leg cannot reach or the joint limits exclude is replaced by the nearest of
    some poses for which neither is so. Limits that exclude all poses which the legs reach are those
    of another sensor zero, and go; without any such pose, the workspace goes.
    """
    if mechanism.workspace is None or _takes(mechanism, mechanism.home[None])[0]:
        return mechanism
    unlimited = mechanism.replace(joint_limits=JointLimits())
    for candidate, places in (
        (mechanism, poses),
        (unlimited, mechanism.home[None]),
        (unlimited, poses),
    ):
        good = places[_takes(candidate, places)]
        if len(good):
            settings = dataclasses.replace(mechanism.workspace, home=_nearest(mechanism, good))
            return candidate.replace(workspace=settings)
    return unlimited.replace(workspace=None)


def _require_possible(nominal: Mechanism, parameters: Array) -> None:
    names, units = nominal.parameter_names, nominal.parameter_units
    for leg, row in enumerate(parameters):
        for name, unit, value, start in zip(
            names, units, row, nominal.parameters[leg], strict=True
        ):
            impossible = not np.isfinite(value)
            impossible |= name.endswith("_length") and value <= 0
            impossible |= name == "sensor_gain" and abs(value) < _NO_GAIN * abs(start)
            if impossible:
                raise FailedFitError(
                    f"leg {leg + 1} ({name} ended at {value:.3g} {unit}".rstrip()
                    + ", which no leg can have; look for readings in another unit, of another leg "
                    "or with another sign or zero than the mechanism's file says, and for poses in "
                    "another unit or frame)"
                )


def _nearest_turn(angles: Array, near: Array) -> Array:
    return angles - _TURN * np.round((angles - near) / _TURN)


def _take_nearer_polar_angle(
    values: Array, signs: Array, near: Array, names: list[str], end: str
) -> None:
    """Of the two ways to write a direction, take the one that is nearer; in place."""
    columns = [names.index(f"{end}_polar_angle"), names.index(f"{end}_azimuth")]
    found = values[:, columns]
    other = _nearest_turn(found * [-1, 1] + [0, np.pi], near[:, columns])
    apart = [np.abs(each - near[:, columns]).sum(axis=1) for each in (found, other)]
    nearer = apart[1] < apart[0]
    values[np.ix_(nearer, columns)] = other[nearer]
    signs[nearer, columns[0]] *= -1


def _takes(mechanism: Mechanism, poses: Array) -> NDArray[np.bool_]:
    """Whether every leg reaches a pose within its limits."""
    readings = mechanism.inverse_kinematics(poses)
    limits = mechanism.joint_limits
    return np.asarray(((readings >= limits.lower) & (readings <= limits.upper)).all(axis=1))


def _nearest(mechanism: Mechanism, poses: Array) -> tuple[float, ...]:
    """The pose that is nearest to home, as a workspace's home is written."""
    coordinates = workspace_coordinates(mechanism, poses)
    apart = coordinates - workspace_coordinates(mechanism, mechanism.home)
    positions = 3 if mechanism.pose_space == "spatial" else 2
    apart[:, positions:] *= mechanism.characteristic_length
    return tuple(coordinates[np.linalg.norm(apart, axis=1).argmin()].tolist())
