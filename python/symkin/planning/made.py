# SPDX-License-Identifier: MIT
"""Robots as a workshop may make them, and the poses that they take when they are sent to some."""

from __future__ import annotations

import numpy as np

from symkin import _core
from symkin.model.canonical import canonical
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import tolerances_of
from symkin.values import Array

_ROBOTS = 32  # by which a promise is known to 0.7% of a Hexa, and to 0.1% of others
_FIRST_SEED = 2**62  # of robots that nobody simulates


def disturb(mechanism: Mechanism, seed: int) -> Mechanism:
    """Return the mechanism as the workshop may make it: normal errors within its tolerances.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    seed : int
        Of the errors.

    Returns
    -------
    Mechanism
        Without a declared symmetry, which it has no longer.
    """
    return mechanism.with_parameters(
        canonical(mechanism, _parameters(mechanism, seed))[0], symmetry=None
    )


def _parameters(mechanism: Mechanism, seed: int) -> Array:
    made = _core.disturb(mechanism.straight, tolerances_of(mechanism.tolerances), seed)
    values = made.parameters
    links = [not role.of_sensor for role in mechanism.parameter_roles(0)]
    for first, *others in mechanism.leg_readings:  # of one leg, which is made once
        values[np.ix_(others, links)] = values[first, links]
    return values


def poses_taken(mechanism: Mechanism, poses: Array) -> list[Array]:
    """Poses at which robots are measured that are told to take these, robot by robot.

    The drawing says which readings these are, and a robot that is not as drawn is elsewhere with
    them: where a plan chose the best poses, in worse ones. The robots are always the same ones. A
    pose that one of them, or the drawing, cannot take is as it was told.
    """
    readings = mechanism.inverse_kinematics(poses)
    found = []
    for seed in range(_FIRST_SEED, _FIRST_SEED + _ROBOTS):
        robot = mechanism.straight.with_parameters(_parameters(mechanism, seed))
        taken = np.array(_core.forward_kinematics(robot, readings, poses).poses)
        known = np.isfinite(taken).all(axis=1)
        taken[~known] = poses[~known]
        # The nearest that the drawing has, of which legs may guide the platform otherwise.
        drawn = mechanism.forward_kinematics(mechanism.inverse_kinematics(taken), taken)[0]
        reached = np.asarray(np.isfinite(drawn).all(axis=1))
        found.append(np.where(reached[:, None], drawn, poses))
    return found
