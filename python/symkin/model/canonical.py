# SPDX-License-Identifier: MIT
"""One way to write parameters that have several."""

from __future__ import annotations

import numpy as np

from symkin.model.file_frames import anchor
from symkin.model.mechanism import Mechanism
from symkin.values import Array

_TURN = 2 * np.pi


def canonical(mechanism: Mechanism, parameters: Array) -> tuple[Array, Array]:
    """Write points with radii that are not negative, and angles within half a turn of another's.

    The closures stay the same. A guide's distance from the centre keeps its sign, on which the
    direction of travel depends, and so does a base's radius less a platform's. The parameters are
    of legs of the mechanism's chains, whose angles are stayed near, shape (legs, p); or of many
    robots, leg by leg, robot by robot. Returns equivalent ones, and the derivative of each by its
    parameter, shape (legs p,): -1 where a sign changed.
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
        if role.kind.endswith(("azimuth", "polar_angle", "_elevation", "_swing"))
    ]
    values[:, angles] = _nearest_turn(values[:, angles], near[angles])
    for end in ("base", "platform"):
        # The angle of a link is counted from its axis' meridian, which would be another one.
        counted = end == "base" and anchor(info, end) == "axis"
        if (end, "polar_angle") in roles and not counted:
            _take_nearer_polar_angle(values, signs, near, names, end)


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
