# SPDX-License-Identifier: MIT
"""Mechanisms as bodies and joints, for models of simulators: legs of known chains, and platforms.

Each leg is a branch of bodies that is cut where it meets the platform, and so is the platform.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import MechanismError, SymkinError
from symkin.exports.bodies import Body, Closure, Joint, Structure, universal
from symkin.exports.declared_bodies import declared_structure
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    POSE_SPACES,
    Transform,
    pose_rows,
    rotations_from_quaternions,
    transforms,
)
from symkin.values import Array

_X, _Y, _Z = np.eye(3)
_SPHERE = 0.1  # m: where the points of axes are held that have directions alone


def structure_of(mechanism: Mechanism, poses: ArrayLike | None = None) -> Structure:
    """Take a mechanism apart into bodies and joints, with the joints' values at poses.

    Raises
    ------
    SymkinError
        For a chain that has no model, curved sensors, or a leg that does not reach home.
    """
    written = LEGS if mechanism.space.moves else LEGS_ON_A_SPHERE
    known = (*written, _PINNED) if mechanism.space.moves else (*written,)
    declared = mechanism.has_declared
    for number, chain in enumerate(() if declared else mechanism.chains, 1):
        if chain not in known:
            which = f" (leg {number})" if mechanism.mixed else ""
            raise MechanismError(
                f'a model of bodies and joints is not written for chain "{chain}"{which}; expected '
                f"one of {', '.join(known)}"
            )
    if mechanism.curvature is not None:
        raise MechanismError(
            f'the sensors of "{mechanism.name}" are not straight lines; a model of bodies and '
            "joints has straight ones alone"
        )
    home = mechanism.home[None]
    rows = home if poses is None else np.vstack([home, pose_rows(poses)])
    body, moves = _platform(mechanism.pose_space, rows)
    if declared:
        return declared_structure(mechanism, rows, body, moves)
    readings = mechanism.inverse_kinematics(rows)
    if np.isnan(readings[0]).any():
        raise SymkinError(f'home of "{mechanism.name}" is out of reach; a model is built there')
    platform = transforms(mechanism.pose_space, rows)
    bodies: list[Body] = []
    pins: list[Body] = []
    closures: list[Closure] = []
    values: dict[str, Array] = {}
    far = 0.0 if mechanism.space.moves else _SPHERE
    for leg, gain in enumerate(mechanism.sensor_gains):
        own, travel = mechanism.legs[leg].parameters, gain * readings[:, leg]
        point = platform_point(own)
        ends = platform.translation + platform.rotation @ point
        name, other = f"leg{leg + 1}", "platform"
        if mechanism.chains[leg] == _PINNED:
            links, tip = [_carriage(name, own)], np.zeros(3)
            pin, passive = _pin(name, own, travel, links[0], Transform(platform.rotation, ends))
            pins.append(pin)
            other, point = pin.name, np.zeros(3)
        else:
            links, tip, passive = written[mechanism.chains[leg]](name, own, travel, ends)
        bodies += links
        closures.append(Closure(f"{name}_end", links[-1].name, tip, point, other))
        values |= {f"{name}_active": travel, **passive}
        far = max(far, float(np.linalg.norm(links[0].position - platform.translation[0])))
    values |= moves
    return Structure(
        (*bodies, body, *pins),
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
    elif space == "spherical":
        joints = tuple(
            Joint(f"platform_{name}", "hinge", axis)
            for name, axis in zip("xyz", np.eye(3), strict=True)
        )
        turned = rotations_from_quaternions(rows)
        about_y = np.arcsin(np.clip(turned[:, 0, 2], -1, 1))
        about_x = np.arctan2(-turned[:, 1, 2], turned[:, 2, 2])
        about_z = np.arctan2(-turned[:, 0, 1], turned[:, 0, 0])
        angles = (about_x, about_y, about_z)
        values = {joint.name: each for joint, each in zip(joints, angles, strict=True)}
    else:
        along = list(zip("xyz", np.eye(3), strict=True))[: 2 if space in ("planar", "point") else 3]
        joints = tuple(Joint(f"platform_{name}", "slide", axis) for name, axis in along)
        if POSE_SPACES[space].has_angle:
            joints += (Joint(f"platform_{POSE_SPACES[space].rotation[0]}", "hinge", _Z),)
        values = {joint.name: rows[:, column] for column, joint in enumerate(joints)}
    return Body("platform", "", np.zeros(3), np.eye(3), joints, np.zeros(3)), values


def platform_point(own: Mapping[str, float]) -> Array:
    """The point of the platform that a leg holds, in the platform's frame."""
    if "platform_radius" in own:
        return _point(own, "platform")
    if "platform_polar_angle" in own:
        return _SPHERE * _axis(own, "platform")[:, 2]
    return np.zeros(3)


def _axis(own: Mapping[str, float], end: str) -> Array:
    """A frame about an axis of a spherical leg: z along it, x downwards (as its polar angle)."""
    polar, azimuth = own[f"{end}_polar_angle"], own[f"{end}_azimuth"]
    rho = _rho(azimuth)
    down = np.cos(polar) * rho - np.sin(polar) * _Z
    across = _rho(azimuth + np.pi / 2)
    return np.column_stack([down, across, np.sin(polar) * rho + np.cos(polar) * _Z])


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
    turned = _about_z(zero + travel)
    links = ends - proximal.position - crank * turned[:, :, 0]
    local = np.einsum("nji,nj->ni", turned, links)
    distal, values = _hinged(name, "distal", proximal.name, crank * _X, rod, local)
    return [proximal, distal], rod * _X, values


def _slider(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[P]RR, whose guide runs along the normal of the direction to its foot, [P]US and [P]RS."""
    slider = _carriage(name, own)
    links = ends - slider.position - np.outer(travel, slider.joints[0].axis)
    distal, values = _hung(own)(
        name, "distal", slider.name, np.zeros(3), own["distal_length"], links
    )
    return [slider, distal], distal.tip, values


def _carriage(name: str, own: Mapping[str, float]) -> Body:
    """What slides on a guide of the base."""
    if "guide_azimuth" not in own:
        along = _rho(own["base_angle"] + np.pi / 2)
    else:
        elevation, swing = own["guide_elevation"], own["guide_swing"]
        rho, tau = _rho(own["guide_azimuth"]), _rho(own["guide_azimuth"] + np.pi / 2)
        along = np.cos(swing) * (np.cos(elevation) * rho + np.sin(elevation) * _Z)
        along = along + np.sin(swing) * tau
    start = _point(own, "base") + own["sensor_offset"] * along
    active = Joint(f"{name}_active", "slide", along)
    return Body(f"{name}_slider", "", start, np.eye(3), (active,), np.zeros(3))


def _pin(
    name: str, own: Mapping[str, float], travel: Array, slider: Body, feet: Transform
) -> tuple[Body, dict[str, Array]]:
    """The pin of [P]RP, which slides on the platform's guide; feet of that are as it turns."""
    along = _rho(own["platform_angle"] + np.pi / 2)
    joint = Joint(f"{name}_passive", "slide", along)
    pin = Body(f"{name}_pin", "platform", _point(own, "platform"), np.eye(3), (joint,), np.zeros(3))
    ways = slider.position + np.outer(travel, slider.joints[0].axis) - feet.translation
    return pin, {joint.name: np.einsum("ni,ni->n", ways, feet.rotation @ along)}


def _strut(name: str, own: Mapping[str, float], _travel: Array, ends: Array) -> _Leg:
    """R[P]R, R[P]S and U[P]S."""
    base = _point(own, "base")
    links = ends - base
    length = float(np.linalg.norm(links[0]))
    lower, values = _hung(own)(name, "lower", "", base, length / 2, links)
    along = 2 / length * lower.tip
    active = Joint(f"{name}_active", "slide", along)
    start = own["sensor_offset"] * along
    upper = Body(f"{name}_upper", lower.name, start, np.eye(3), (active,), -length / 2 * along)
    return [lower, upper], np.zeros(3), values


def _crank(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[R]US: the crank's frame has x along the crank at the angle zero, z along the axis."""
    crank, rod = own["proximal_length"], own["distal_length"]
    frame = _about_axis(own)
    zero = own["sensor_offset"]
    active = Joint(f"{name}_active", "hinge", _Z)
    base = _point(own, "base")
    proximal = Body(f"{name}_proximal", "", base, frame @ _about_z(zero), (active,), crank * _X)
    turned = frame @ _about_z(zero + travel)
    links = ends - base - crank * turned[:, :, 0]
    local = np.einsum("nji,nj->ni", turned, links)
    distal, values = universal(name, "distal", proximal.name, crank * _X, rod, local)
    return [proximal, distal], rod * _Z, values


def _arm_on_sphere(name: str, own: Mapping[str, float], travel: Array, ends: Array) -> _Leg:
    """[R]RR about the centre of a sphere: all axes pass it, and links are arcs of great circles."""
    inner, outer = own["proximal_arc"], own["distal_arc"]
    frame, zero = _axis(own, "base"), own["sensor_offset"]
    cosine, sine = np.cos(inner), np.sin(inner)
    bent = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])  # z along the elbow
    active = Joint(f"{name}_active", "hinge", _Z)
    elbow, tip = _SPHERE * bent[:, 2], _SPHERE * np.array([np.sin(outer), 0.0, np.cos(outer)])
    start = frame @ _about_z(zero)
    proximal = Body(f"{name}_proximal", "", np.zeros(3), start, (active,), elbow)
    local = np.einsum("nji,nj->ni", frame @ _about_z(zero + travel) @ bent, ends)
    angles = np.arctan2(local[:, 1], local[:, 0])
    joint = Joint(f"{name}_passive", "hinge", _Z)
    placed = bent @ _about_z(angles[0])
    distal = Body(f"{name}_distal", proximal.name, np.zeros(3), placed, (joint,), tip)
    return [proximal, distal], tip, {joint.name: _wrapped(angles - angles[0])}


LEGS: dict[str, Callable[[str, Mapping[str, float], Array, Array], _Leg]] = {
    "[R]RR": _crank_in_plane,
    "[P]RR": _slider,
    "R[P]R": _strut,
    "U[P]S": _strut,
    "[P]US": _slider,
    "[R]US": _crank,
    "R[P]S": _strut,
    "[P]RS": _slider,
}
LEGS_ON_A_SPHERE = {"[R]RR": _arm_on_sphere}
_PINNED = "[P]RP"  # its last guide is on the platform, whose body its pin is


_Hung = Callable[[str, str, str, Array, float, Array], tuple[Body, dict[str, Array]]]


def _hung(own: Mapping[str, float]) -> _Hung:
    """What a link of a chain hangs on: a hinge in the plane, one about its axis, or two."""
    if "axis_azimuth" in own:
        return partial(_hinged, frame=_about_axis(own))
    return _hinged if "base_angle" in own else universal


def _about_axis(own: Mapping[str, float]) -> Array:
    """A frame whose z is along a joint's axis, and x where an angle about it is zero."""
    elevation, swing = own["axis_elevation"], own["axis_swing"]
    rho, tau = _rho(own["axis_azimuth"]), _rho(own["axis_azimuth"] + np.pi / 2)
    level = np.cos(elevation) * tau + np.sin(elevation) * _Z
    axis = np.cos(swing) * level + np.sin(swing) * rho
    start = np.cos(swing) * rho - np.sin(swing) * level
    return np.column_stack([start, np.cross(axis, start), axis])


def _hinged(
    name: str,
    what: str,
    parent: str,
    place: Array,
    length: float,
    links: Array,
    frame: Array = np.eye(3),  # noqa: B008  # never written to
) -> tuple[Body, dict[str, Array]]:
    """A link along x of its body, on a hinge about z of a frame, at zero at home; and its angles.

    `links` are its directions in the parent's frame, and `frame` is in it.
    """
    x, y, _ = (links @ frame).T
    angles = np.arctan2(y, x)
    joint = Joint(f"{name}_passive", "hinge", _Z)
    turned = frame @ _about_z(angles[0])
    body = Body(f"{name}_{what}", parent, place, turned, (joint,), length * _X)
    return body, {joint.name: _wrapped(angles - angles[0])}


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
