# SPDX-License-Identifier: MIT
"""A mechanism as a tree of bodies, cut where each leg meets the platform.

Simulators have no closures: they have bodies with a joint to their parent, and loops that are
closed again by constraints. A leg is such a branch, and so is the platform.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MechanismError, SymkinError
from symkin.exports.bodies import Body, Closure, Joint, Structure
from symkin.exports.branches import LEGS, platform_point
from symkin.frames import transforms
from symkin.measurements import pose_rows
from symkin.mechanism import Mechanism

__all__ = ["structure_of"]

Array = NDArray[np.float64]


def structure_of(mechanism: Mechanism, poses: ArrayLike | None = None) -> Structure:
    """Take a mechanism apart into bodies and joints.

    Parameters
    ----------
    mechanism : Mechanism
        Of a chain `[R]RR`, `[P]RR`, `R[P]R`, `U[P]S`, `[P]US` or `[R]US`, with straight sensors.
    poses : array_like, shape (N, coordinates), optional
        Where the values of all joints are wanted.

    Returns
    -------
    Structure

    Raises
    ------
    SymkinError
        For another chain, curved sensors, or a leg that does not reach home.
    """
    if mechanism.chain not in LEGS:
        raise MechanismError(
            f'a model of bodies and joints is not written for chain "{mechanism.chain}"; expected '
            f"one of {', '.join(LEGS)}"
        )
    if mechanism.curvature is not None:
        raise MechanismError(
            f'the sensors of "{mechanism.name}" are not straight lines; a model of bodies and '
            "joints has straight ones alone"
        )
    home = mechanism.home[None]
    rows = home if poses is None else np.vstack([home, pose_rows(poses)])
    parameters = [dict(leg.parameters) for leg in mechanism.legs]
    readings = mechanism.inverse_kinematics(rows)
    if np.isnan(readings[0]).any():
        raise SymkinError(f'home of "{mechanism.name}" is out of reach; a model is built there')
    platform = transforms(mechanism.pose_space, rows)
    bodies: list[Body] = []
    closures: list[Closure] = []
    values: dict[str, Array] = {}
    far = 0.0
    for leg, (own, gain) in enumerate(zip(parameters, mechanism.sensor_gains, strict=True)):
        travel = gain * readings[:, leg]
        point = platform_point(own)
        ends = platform.translation + platform.rotation @ point
        links, tip, passive = LEGS[mechanism.chain](f"leg{leg + 1}", own, travel, ends)
        bodies += links
        closures.append(Closure(f"leg{leg + 1}_end", links[-1].name, tip, point))
        values |= {f"leg{leg + 1}_active": travel, **passive}
        far = max(far, float(np.linalg.norm(links[0].position - platform.translation[0])))
    body, moves = _platform(mechanism.pose_space, rows)
    values |= moves
    return Structure(
        (*bodies, body),
        tuple(closures),
        {name: each[1:] for name, each in values.items()},
        {name: each[0] for name, each in values.items()},
        far,
    )


def _platform(space: str, rows: Array) -> tuple[Body, dict[str, Array]]:
    """The platform, which moves by joints of its own: where the legs hold it, loops are closed."""
    if space == "spatial":
        joints: tuple[Joint, ...] = (Joint("platform", "free", np.zeros(3)),)
        values = {"platform": np.hstack([rows[:, :3], rows[:, 6:], rows[:, 3:6]])}
    else:
        slides = dict(zip("xyz", np.eye(3), strict=True))
        count = 3 if space == "translating" else 2
        moving = [Joint(f"platform_{n}", "slide", axis) for n, axis in slides.items()][:count]
        if space == "planar":
            moving.append(Joint("platform_phi", "hinge", np.eye(3)[2]))
        joints = tuple(moving)
        values = {joint.name: rows[:, column] for column, joint in enumerate(joints)}
    return Body("platform", "", np.zeros(3), np.eye(3), joints, np.zeros(3)), values
