# SPDX-License-Identifier: MIT
"""A mechanism as a tree of bodies, cut where each leg meets the platform.

Simulators have no closures: they have bodies with a joint to their parent, and loops that are
closed again by constraints. A leg is such a branch, and so is the platform.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MechanismError, SymkinError
from symkin.measurements import pose_rows
from symkin.mechanism import Mechanism
from symkin.poses import Transform, rotations_from_quaternions, rotations_from_vectors, transforms

__all__ = ["Body", "Closure", "Joint", "Structure", "structure_of"]

Array = NDArray[np.float64]
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True)
class Joint:
    """One degree of freedom between a body and its parent.

    Attributes
    ----------
    name : str
        Such as ``leg1_active``, which the sensor reads: value = gain * reading.
    kind : {"hinge", "slide", "free"}
        A free one has all six, and no axis.
    axis : ndarray, shape (3,)
        In the body's own frame.
    """

    name: str
    kind: str
    axis: Array


@dataclass(frozen=True)
class Body:
    """A body; its joints come one after the other, each in the frame that the last one left.

    Attributes
    ----------
    name, parent : str
        The parent "" is the base.
    position, rotation : ndarray, shapes (3,) and (3, 3)
        In the parent's frame, while all joints are at zero.
    joints : tuple of Joint
        From the parent outwards.
    tip : ndarray, shape (3,)
        The end of the link that is drawn, in the body's frame.
    """

    name: str
    parent: str
    position: Array
    rotation: Array
    joints: tuple[Joint, ...]
    tip: Array


@dataclass(frozen=True)
class Closure:
    """The end of a leg, which is held at a point of the platform by a joint that turns any way."""

    name: str
    body: str
    point: Array
    platform_point: Array


@dataclass(frozen=True)
class Structure:
    """Bodies, parents first, and what closes the loops.

    Attributes
    ----------
    bodies : tuple of Body
        Those of each leg, then the platform.
    closures : tuple of Closure
        One for each leg.
    values : mapping of str to ndarray, shape (N,) or (N, 7)
        Of every joint at the poses that were asked for, m and rad; of a free joint the position
        and the quaternion, scalar first.
    home : mapping of str to ndarray
        The same at home.
    size : float
        Largest distance of a base point from the platform's origin at home, m.
    """

    bodies: tuple[Body, ...]
    closures: tuple[Closure, ...]
    values: Mapping[str, Array]
    home: Mapping[str, Array]
    size: float

    @property
    def joints(self) -> Iterator[Joint]:
        """Every joint, in the order of the bodies."""
        return (joint for body in self.bodies for joint in body.joints)

    def frames(self, values: Mapping[str, Array]) -> dict[str, list[Transform]]:
        """Frames of each body in the base's, with the given joint values: after each joint."""
        placed: dict[str, list[Transform]] = {"": [Transform(np.eye(3), np.zeros(3))]}
        for body in self.bodies:
            frame = placed[body.parent][-1] @ Transform(body.rotation, body.position)
            steps = placed[body.name] = []
            for joint in body.joints:
                frame = frame @ _motion(joint, values[joint.name])
                steps.append(frame)
        del placed[""]
        return placed


def _motion(joint: Joint, value: Array) -> Transform:
    """What a joint does in its body's frame."""
    if joint.kind == "free":
        return Transform(rotations_from_quaternions(value[None, [4, 5, 6, 3]])[0], value[:3])
    if joint.kind == "slide":
        return Transform(np.eye(3), value * joint.axis)
    return Transform(rotations_from_vectors((value * joint.axis)[None])[0], np.zeros(3))


def structure_of(mechanism: Mechanism, poses: ArrayLike | None = None) -> Structure:
    """Take a mechanism apart into bodies and joints, with the joints' values at poses.

    Raises
    ------
    SymkinError
        For a chain that is not in `LEGS`, curved sensors, or a leg that does not reach home.
    """
    for number, chain in enumerate(mechanism.chains, 1):
        if chain not in LEGS:
            which = f" (leg {number})" if mechanism.mixed else ""
            raise MechanismError(
                f'a model of bodies and joints is not written for chain "{chain}"{which}; expected '
                f"one of {', '.join(LEGS)}"
            )
    if mechanism.curvature is not None:
        raise MechanismError(
            f'the sensors of "{mechanism.name}" are not straight lines; a model of bodies and '
            "joints has straight ones alone"
        )
    home = mechanism.home[None]
    rows = home if poses is None else np.vstack([home, pose_rows(poses)])
    readings = mechanism.inverse_kinematics(rows)
    if np.isnan(readings[0]).any():
        raise SymkinError(f'home of "{mechanism.name}" is out of reach; a model is built there')
    platform = transforms(mechanism.pose_space, rows)
    bodies: list[Body] = []
    closures: list[Closure] = []
    values: dict[str, Array] = {}
    far = 0.0
    for leg, gain in enumerate(mechanism.sensor_gains):
        own, travel = mechanism.legs[leg].parameters, gain * readings[:, leg]
        point = platform_point(own)
        ends = platform.translation + platform.rotation @ point
        links, tip, passive = LEGS[mechanism.chains[leg]](f"leg{leg + 1}", own, travel, ends)
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
        along = list(zip("xyz", np.eye(3), strict=True))[: 3 if space == "translating" else 2]
        joints = tuple(Joint(f"platform_{name}", "slide", axis) for name, axis in along)
        if space == "planar":
            joints += (Joint("platform_phi", "hinge", _Z),)
        values = {joint.name: rows[:, column] for column, joint in enumerate(joints)}
    return Body("platform", "", np.zeros(3), np.eye(3), joints, np.zeros(3)), values


def platform_point(own: Mapping[str, float]) -> Array:
    """The point of the platform that a leg holds, in the platform's frame."""
    if "platform_radius" not in own:
        return np.zeros(3)
    return _point(own, "platform")


def _point(own: Mapping[str, float], end: str) -> Array:
    """A point that is given by a radius and angles, as its chain has them."""
    radius = own[f"{end}_radius"]
    if f"{end}_angle" in own:
        return radius * _rho(own[f"{end}_angle"])
    azimuth = own[f"{end}_azimuth"]
    if f"{end}_polar_angle" in own:
        polar = own[f"{end}_polar_angle"]
        return np.asarray(radius * (np.sin(polar) * _rho(azimuth) + np.cos(polar) * _Z))
    return np.asarray(radius * _rho(azimuth) + own[f"{end}_height"] * _Z)


# Bodies, the end in the frame of the last, and the values of passive joints.
_Leg = tuple[list[Body], Array, dict[str, Array]]


def _crank_in_plane(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[R]RR."""
    crank, rod = own["proximal_length"], own["distal_length"]
    zero = own["sensor_offset"]
    active = Joint(f"{name}_active", "hinge", _Z)
    proximal = Body(
        f"{name}_proximal", "", _point(own, "base"), _about_z(zero), (active,), crank * _X
    )
    angles = zero + travel
    links = ends - proximal.position - crank * _rho(angles)
    distal, values = _hinged(name, "distal", proximal, crank * _X, rod, links, angles)
    return [proximal, distal], rod * _X, values


def _slider_in_plane(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[P]RR: the guide runs along the normal of the direction to its foot."""
    rod, along = own["distal_length"], _rho(own["base_angle"] + np.pi / 2)
    start = _point(own, "base") + own["sensor_offset"] * along
    active = Joint(f"{name}_active", "slide", along)
    slider = Body(f"{name}_slider", "", start, np.eye(3), (active,), np.zeros(3))
    links = ends - start - np.outer(travel, along)
    distal, values = _hinged(name, "distal", slider, np.zeros(3), rod, links, np.zeros(len(travel)))
    return [slider, distal], rod * _X, values


def _strut_in_plane(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """R[P]R."""
    base = _point(own, "base")
    links = ends - base
    ground = Body("", "", np.zeros(3), np.eye(3), (), np.zeros(3))
    length = float(np.linalg.norm(links[0]))
    lower, values = _hinged(name, "lower", ground, base, length / 2, links, np.zeros(len(travel)))
    active = Joint(f"{name}_active", "slide", _X)
    start = own["sensor_offset"] * _X
    upper = Body(f"{name}_upper", lower.name, start, np.eye(3), (active,), -length / 2 * _X)
    return [lower, upper], np.zeros(3), values


def _strut(name: str, own: Mapping[str, float], _travel: Array, ends: Array) -> _Leg:
    """U[P]S."""
    base = _point(own, "base")
    links = ends - base
    ground = Body("", "", np.zeros(3), np.eye(3), (), np.zeros(3))
    length = float(np.linalg.norm(links[0]))
    lower, values = _universal(name, "lower", ground, base, length / 2, links)
    active = Joint(f"{name}_active", "slide", _Z)
    start = own["sensor_offset"] * _Z
    upper = Body(f"{name}_upper", lower.name, start, np.eye(3), (active,), -length / 2 * _Z)
    return [lower, upper], np.zeros(3), values


def _slider(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[P]US."""
    rod = own["distal_length"]
    elevation, swing = own["guide_elevation"], own["guide_swing"]
    rho, tau = _rho(own["guide_azimuth"]), _rho(own["guide_azimuth"] + np.pi / 2)
    along = np.cos(swing) * (np.cos(elevation) * rho + np.sin(elevation) * _Z)
    along = along + np.sin(swing) * tau
    start = _point(own, "base") + own["sensor_offset"] * along
    active = Joint(f"{name}_active", "slide", along)
    slider = Body(f"{name}_slider", "", start, np.eye(3), (active,), np.zeros(3))
    links = ends - start - np.outer(travel, along)
    distal, values = _universal(name, "distal", slider, np.zeros(3), rod, links)
    return [slider, distal], rod * _Z, values


def _crank(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[R]US: the crank's frame has x along the crank at the angle zero, z along the axis."""
    crank, rod = own["proximal_length"], own["distal_length"]
    elevation, swing = own["axis_elevation"], own["axis_swing"]
    rho, tau = _rho(own["axis_azimuth"]), _rho(own["axis_azimuth"] + np.pi / 2)
    level = np.cos(elevation) * tau + np.sin(elevation) * _Z
    axis = np.cos(swing) * level + np.sin(swing) * rho
    start = np.cos(swing) * rho - np.sin(swing) * level
    frame = np.column_stack([start, np.cross(axis, start), axis])
    zero = own["sensor_offset"]
    active = Joint(f"{name}_active", "hinge", _Z)
    base = _point(own, "base")
    proximal = Body(f"{name}_proximal", "", base, frame @ _about_z(zero), (active,), crank * _X)
    turned = frame @ _about_z(zero + travel)
    links = ends - base - crank * turned[:, :, 0]
    local = np.einsum("nji,nj->ni", turned, links)
    distal, values = _universal(name, "distal", proximal, crank * _X, rod, local)
    return [proximal, distal], rod * _Z, values


LEGS: dict[str, Callable[[str, Mapping[str, float], Array, Array], _Leg]] = {
    "[R]RR": _crank_in_plane,
    "[P]RR": _slider_in_plane,
    "R[P]R": _strut_in_plane,
    "U[P]S": _strut,
    "[P]US": _slider,
    "[R]US": _crank,
}


def _hinged(
    name: str, what: str, parent: Body, place: Array, length: float, links: Array, turned: Array
) -> tuple[Body, dict[str, Array]]:
    """A link along x in the plane, whose hinge is at zero at home, and its angles.

    `links` are its directions in the base frame, `turned` the angles of its parent there.
    """
    angles = np.arctan2(links[:, 1], links[:, 0]) - turned
    joint = Joint(f"{name}_passive", "hinge", _Z)
    body = Body(f"{name}_{what}", parent.name, place, _about_z(angles[0]), (joint,), length * _X)
    return body, {joint.name: _wrapped(angles - angles[0])}


def _universal(
    name: str, what: str, parent: Body, place: Array, length: float, links: Array
) -> tuple[Body, dict[str, Array]]:
    """A link along z on a universal joint that is at zero at home, and its two angles.

    `links` are its directions in the parent's frame. The angle about x, then y, of a direction
    (x, y, z) in the frame at home: x is the sine of the second, (-y, z) has the first.
    """
    directions = links / np.linalg.norm(links, axis=1, keepdims=True)
    frame = _with_z(directions[0])
    x, y, z = (directions @ frame).T
    names = f"{name}_passive_x", f"{name}_passive_y"
    joints = Joint(names[0], "hinge", _X), Joint(names[1], "hinge", _Y)
    body = Body(f"{name}_{what}", parent.name, place, frame, joints, length * _Z)
    return body, {names[0]: np.arctan2(-y, z), names[1]: np.arctan2(x, np.hypot(y, z))}


def _with_z(direction: Array) -> Array:
    """A rotation whose third column is a unit vector."""
    across = _X if abs(direction[0]) < 0.7 else _Y
    first = np.cross(across, direction)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(direction, first), direction])


def _rho(angle: float | Array) -> Array:
    """Horizontal unit vectors, shape (..., 3)."""
    return np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)


def _about_z(angle: float | Array) -> Array:
    """Rotations about z, shape (..., 3, 3)."""
    return np.stack(
        [_rho(angle), _rho(angle + np.pi / 2), np.broadcast_to(_Z, (*np.shape(angle), 3))], axis=-1
    )


def _wrapped(angles: Array) -> Array:
    return np.asarray(np.arctan2(np.sin(angles), np.cos(angles)))
