# SPDX-License-Identifier: MIT
"""Models for simulators: MJCF, URDF and SDF.

MuJoCo's MJCF closes loops by ``<equality><connect>``. A fixed tendon of the active joint with the
coefficient 1 / gain has the length that the sensor reads, so that what is sensed and commanded in
the model are the robot's own readings.

URDF is a tree, whose cut joints stand in comments; a body with several joints becomes a row of
links with one joint each.

SDFormat closes loops by ball joints, the robot standing at home: its joints are at zero where the
model is drawn, so that it must be drawn closed.
"""

from __future__ import annotations

import json
import re
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.exports.exported import MARK, ExportOptions, Written
from symkin.exports.structure import Body, Structure, structure_of
from symkin.mechanism import Mechanism
from symkin.poses import Transform
from symkin.workspace import workspace_coordinates

__all__ = ["write_mjcf", "write_sdf", "write_urdf"]

_THICKNESS = 0.012  # of what is drawn, as a share of the mechanism's size


def write_mjcf(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as MJCF, with the key frame "home"."""
    structure = structure_of(mechanism)
    root = Element("mujoco", model=mechanism.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    world = SubElement(root, "worldbody")
    elements = {"": world}
    radius = _THICKNESS * structure.size
    for body in structure.bodies:
        elements[body.name] = _mjcf_body(elements[body.parent], body, radius)
    _held_points(elements["platform"], structure, radius)
    for closure in structure.closures:
        place = _triple(closure.point)
        SubElement(elements[closure.body], "site", name=closure.name, pos=place, size=_said(radius))
    _constraints(root, structure)
    _readings(root, mechanism)
    return Written(_xml_text(root, _about(mechanism)))


def _mjcf_body(parent: Element, body: Body, radius: float) -> Element:
    turned = _triple(np.hstack([body.rotation[:, 0], body.rotation[:, 1]]))
    element = SubElement(parent, "body", name=body.name, pos=_triple(body.position), xyaxes=turned)
    for joint in body.joints:
        if joint.kind == "free":
            SubElement(element, "freejoint", name=joint.name)
        else:
            SubElement(element, "joint", name=joint.name, type=joint.kind, axis=_triple(joint.axis))
    _drawn(element, body.tip, radius)
    return element


def _drawn(element: Element, tip: NDArray[np.float64], radius: float) -> None:
    """A rod from the body's origin to a point, or a ball; bodies pass through each other."""
    pale = {"contype": "0", "conaffinity": "0"}
    if np.linalg.norm(tip) > radius:
        shape = {"type": "capsule", "fromto": _triple([np.zeros(3), tip]), "size": _said(radius)}
    else:
        shape = {"type": "sphere", "size": _said(2 * radius)}
    SubElement(element, "geom", shape | pale)


def _held_points(element: Element, structure: Structure, radius: float) -> None:
    """Points that the legs hold, and spokes to them."""
    for closure in structure.closures:
        point = closure.platform_point
        if np.linalg.norm(point) > radius:
            _drawn(element, point, radius)
        name = f"platform_{closure.name}"
        SubElement(element, "site", name=name, pos=_triple(point), size=_said(radius))


def _constraints(root: Element, structure: Structure) -> None:
    equality = SubElement(root, "equality")
    for closure in structure.closures:
        sites = {"site1": closure.name, "site2": f"platform_{closure.name}"}
        SubElement(equality, "connect", {"name": closure.name, **sites})
    values = [np.atleast_1d(structure.home[joint.name]) for joint in structure.joints]
    SubElement(SubElement(root, "keyframe"), "key", name="home", qpos=_triple(np.hstack(values)))


def _readings(root: Element, mechanism: Mechanism) -> None:
    tendon, sensor = SubElement(root, "tendon"), SubElement(root, "sensor")
    for leg, gain in enumerate(mechanism.sensor_gains, 1):
        fixed = SubElement(tendon, "fixed", name=f"reading_{leg}")
        SubElement(fixed, "joint", joint=f"leg{leg}_active", coef=_said(1 / gain))
        SubElement(sensor, "tendonpos", name=f"psi_{leg}", tendon=f"reading_{leg}")


_URDF_KINDS = {"hinge": "continuous", "slide": "prismatic", "free": "floating"}
_OPEN = "a URDF is a tree: the loops are open, and the joints that close them stand in comments"


def write_urdf(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as URDF; all joints at zero are all readings at zero, not home."""
    structure = structure_of(mechanism)
    root = Element("robot", name=mechanism.name)
    SubElement(root, "link", name="base")
    for body in structure.bodies:
        _urdf_links(root, body, structure.size)
    return Written(_xml_text(root, [*_about(mechanism), *_cuts(structure)]), (_OPEN,))


def _cuts(structure: Structure) -> list[str]:
    """The joints that are not in the tree."""
    return [
        f"cut joint {each.name}, ball: point {_triple(each.point)} of {each.body} = "
        f"point {_triple(each.platform_point)} of platform"
        for each in structure.closures
    ]


def _urdf_links(root: Element, body: Body, size: float) -> None:
    """The body's joints, each with the link that it moves; the last link is the body."""
    parent = body.parent or "base"
    frame = Transform(body.rotation, body.position)
    for number, joint in enumerate(body.joints, 1):
        name = body.name if number == len(body.joints) else f"{body.name}_{number}"
        link = SubElement(root, "link", name=name)
        inertial = SubElement(link, "inertial")
        SubElement(inertial, "mass", value=_said(_MASS))
        moment = _said(0.4 * _MASS * (0.1 * size) ** 2)
        equal, other = dict.fromkeys(("ixx", "iyy", "izz"), moment), ("ixy", "ixz", "iyz")
        SubElement(inertial, "inertia", {**equal, **dict.fromkeys(other, "0")})
        kind = _URDF_KINDS[joint.kind]
        element = SubElement(root, "joint", name=joint.name, type=kind)
        SubElement(element, "parent", link=parent)
        SubElement(element, "child", link=name)
        place, angles = _roll_pitch_yaw(frame)
        SubElement(element, "origin", xyz=place, rpy=angles)
        if joint.kind != "free":
            SubElement(element, "axis", xyz=_triple(joint.axis))
        if joint.kind == "slide":
            # The format wants limits of a slide; those of the robot are not known.
            far = _said(10 * size)
            limits = {"lower": f"-{far}", "upper": far, "effort": "1000", "velocity": "10"}
            SubElement(element, "limit", limits)
        parent, frame = name, Transform(np.eye(3), np.zeros(3))


_SDF_KINDS = {"hinge": "revolute", "slide": "prismatic"}


def write_sdf(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as SDF 1.8, at home."""
    structure = structure_of(mechanism)
    root = Element("sdf", version="1.8")
    model = SubElement(root, "model", name=mechanism.name)
    placed = structure.frames(structure.home)
    for body in structure.bodies:
        parent = body.parent or "world"
        for number, joint in enumerate(body.joints, 1):
            name = body.name if number == len(body.joints) else f"{body.name}_{number}"
            _sdf_link(model, name, placed[body.name][number - 1], structure.size)
            if joint.kind != "free":
                element = _sdf_joint(model, joint.name, _SDF_KINDS[joint.kind], parent, name)
                SubElement(SubElement(element, "axis"), "xyz").text = _triple(joint.axis)
            parent = name
    for closure in structure.closures:
        element = _sdf_joint(model, closure.name, "ball", closure.body, "platform")
        SubElement(element, "pose").text = f"{_triple(closure.platform_point)} 0.0 0.0 0.0"
    readings = mechanism.inverse_kinematics(mechanism.home)[0]
    note = (
        "SDF counts joints from where the model stands: joint = gain * (reading - reading at "
        f"home), readings at home: {_triple(readings).replace(' ', ', ')}."
    )
    return Written(_xml_text(root, [*_about(mechanism), note]))


def _sdf_link(model: Element, name: str, frame: Transform, size: float) -> None:
    link = SubElement(model, "link", name=name)
    SubElement(link, "pose").text = " ".join(_roll_pitch_yaw(frame))
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass").text = _said(_MASS)
    inertia = SubElement(inertial, "inertia")
    for axis in ("ixx", "iyy", "izz"):
        SubElement(inertia, axis).text = _said(0.4 * _MASS * (0.1 * size) ** 2)


def _sdf_joint(model: Element, name: str, kind: str, parent: str, child: str) -> Element:
    element = SubElement(model, "joint", name=name, type=kind)
    SubElement(element, "parent").text = parent
    SubElement(element, "child").text = child
    return element


# Nobody measured masses, and simulators refuse bodies without any.
_MASS = 1.0


def _said(value: float) -> str:
    """A number with all its digits; no negative zero."""
    return repr(float(value) + 0.0)


def _triple(values: ArrayLike) -> str:
    """Numbers beside each other."""
    return " ".join(_said(value) for value in np.asarray(values, dtype=np.float64).ravel())


def _roll_pitch_yaw(frame: Transform) -> tuple[str, str]:
    """Translation, and fixed-axis angles about x, y, z, as URDF and SDF write a frame."""
    r: NDArray[np.float64] = frame.rotation
    level = np.hypot(r[0, 0], r[1, 0])
    pitch = np.arctan2(-r[2, 0], level)
    # Pitched upright, roll and yaw turn about the same line: all of it is roll then.
    if level < 1e-12:
        roll, yaw = np.arctan2(-r[1, 2], r[1, 1]), 0.0
    else:
        roll, yaw = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
    return _triple(frame.translation), _triple([roll, pitch, yaw])


def _about(mechanism: Mechanism) -> list[str]:
    """What a reader must know of any model, and what a tree cannot say, for comments."""
    # Two hyphens would end an XML comment.
    name = re.sub("-(?=-)", "- ", mechanism.name)
    known = {
        "chain": mechanism.chains if mechanism.mixed else mechanism.chain,
        "platform": mechanism.platform,
        "reading_unit": mechanism.reading_unit,
        "working_modes": mechanism.working_modes,
        "gains": mechanism.sensor_gains.tolist(),
        "home": workspace_coordinates(mechanism, mechanism.home)[0].tolist(),
    }
    return [
        f'"{name}", written by symkin. Lengths are m, angles rad. Geometry is the mechanism '
        "file's; masses, radii and limits are placeholders, since nobody measured them. Each leg "
        "is cut at its end, which a constraint holds at a point of the platform; leg<N>_active is "
        "the actuated joint: joint = gain * sensor reading.",
        f"{MARK} {json.dumps(known)}",
    ]


def _xml_text(root: Element, comments: list[str]) -> str:
    """A document with comments above what it says."""
    indent(root)
    above = "".join(f"<!-- {comment} -->\n" for comment in comments)
    body = tostring(root, encoding="unicode")
    return f'<?xml version="1.0"?>\n{above}{body}\n'
