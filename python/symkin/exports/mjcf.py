# SPDX-License-Identifier: MIT
"""MuJoCo's MJCF: loops closed by ``<equality><connect>``, readings as tendons.

A fixed tendon of the active joint with the coefficient 1 / gain has the length that the sensor
reads, so that what is sensed and commanded in the model are the robot's own readings.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np
from numpy.typing import NDArray

from symkin.exports.bodies import Body, Structure
from symkin.exports.options import ExportOptions, Written
from symkin.exports.structure import structure_of
from symkin.exports.xml_text import about, said, triple, xml_text
from symkin.mechanism import Mechanism

__all__ = ["write"]

_THICKNESS = 0.012  # of what is drawn, as a share of the mechanism's size


def write(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as MJCF, with the key frame "home"."""
    structure = structure_of(mechanism)
    root = Element("mujoco", model=mechanism.name)
    SubElement(root, "compiler", angle="radian", autolimits="true")
    world = SubElement(root, "worldbody")
    elements = {"": world}
    radius = _THICKNESS * structure.size
    for body in structure.bodies:
        elements[body.name] = _body(elements[body.parent], body, radius)
    _platform(elements["platform"], structure, radius)
    for closure in structure.closures:
        place = triple(closure.point)
        SubElement(elements[closure.body], "site", name=closure.name, pos=place, size=said(radius))
    _constraints(root, structure)
    _readings(root, mechanism)
    return Written(xml_text(root, about(mechanism)))


def _body(parent: Element, body: Body, radius: float) -> Element:
    turned = triple(np.hstack([body.rotation[:, 0], body.rotation[:, 1]]))
    element = SubElement(parent, "body", name=body.name, pos=triple(body.position), xyaxes=turned)
    for joint in body.joints:
        if joint.kind == "free":
            SubElement(element, "freejoint", name=joint.name)
        else:
            SubElement(element, "joint", name=joint.name, type=joint.kind, axis=triple(joint.axis))
    _drawn(element, body.tip, radius)
    return element


def _drawn(element: Element, tip: NDArray[np.float64], radius: float) -> None:
    """A rod from the body's origin to a point, or a ball; bodies pass through each other."""
    pale = {"contype": "0", "conaffinity": "0"}
    if np.linalg.norm(tip) > radius:
        shape = {"type": "capsule", "fromto": triple([np.zeros(3), tip]), "size": said(radius)}
    else:
        shape = {"type": "sphere", "size": said(2 * radius)}
    SubElement(element, "geom", shape | pale)


def _platform(element: Element, structure: Structure, radius: float) -> None:
    """Points that the legs hold, and spokes to them."""
    for closure in structure.closures:
        point = closure.platform_point
        if np.linalg.norm(point) > radius:
            _drawn(element, point, radius)
        name = f"platform_{closure.name}"
        SubElement(element, "site", name=name, pos=triple(point), size=said(radius))


def _constraints(root: Element, structure: Structure) -> None:
    equality = SubElement(root, "equality")
    for closure in structure.closures:
        sites = {"site1": closure.name, "site2": f"platform_{closure.name}"}
        SubElement(equality, "connect", {"name": closure.name, **sites})
    values = [np.atleast_1d(structure.home[joint.name]) for joint in structure.joints]
    SubElement(SubElement(root, "keyframe"), "key", name="home", qpos=triple(np.hstack(values)))


def _readings(root: Element, mechanism: Mechanism) -> None:
    tendon, sensor = SubElement(root, "tendon"), SubElement(root, "sensor")
    for leg, gain in enumerate(mechanism.sensor_gains, 1):
        fixed = SubElement(tendon, "fixed", name=f"reading_{leg}")
        SubElement(fixed, "joint", joint=f"leg{leg}_active", coef=said(1 / gain))
        SubElement(sensor, "tendonpos", name=f"psi_{leg}", tendon=f"reading_{leg}")
