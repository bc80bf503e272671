# SPDX-License-Identifier: MIT
"""SDFormat: loops closed by ball joints, the robot standing at home.

The joints of SDF are at zero where the model is drawn, so that it must be drawn closed.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from symkin.exports.options import ExportOptions, Written
from symkin.exports.structure import structure_of
from symkin.exports.xml_text import MASS, about, roll_pitch_yaw, said, triple, xml_text
from symkin.mechanism import Mechanism
from symkin.poses import Transform

__all__ = ["write"]

_KINDS = {"hinge": "revolute", "slide": "prismatic"}


def write(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as SDF 1.8, at home."""
    structure = structure_of(mechanism)
    root = Element("sdf", version="1.8")
    model = SubElement(root, "model", name=mechanism.name)
    placed = structure.frames(structure.home)
    for body in structure.bodies:
        parent = body.parent or "world"
        for number, joint in enumerate(body.joints, 1):
            name = body.name if number == len(body.joints) else f"{body.name}_{number}"
            _link(model, name, placed[body.name][number - 1], structure.size)
            if joint.kind != "free":
                element = _joint(model, joint.name, _KINDS[joint.kind], parent, name)
                SubElement(SubElement(element, "axis"), "xyz").text = triple(joint.axis)
            parent = name
    for closure in structure.closures:
        element = _joint(model, closure.name, "ball", closure.body, "platform")
        SubElement(element, "pose").text = f"{triple(closure.platform_point)} 0.0 0.0 0.0"
    readings = mechanism.inverse_kinematics(mechanism.home)[0]
    note = (
        "SDF counts joints from where the model stands: joint = gain * (reading - reading at "
        f"home), readings at home: {triple(readings).replace(' ', ', ')}."
    )
    return Written(xml_text(root, [*about(mechanism), note]))


def _link(model: Element, name: str, frame: Transform, size: float) -> None:
    link = SubElement(model, "link", name=name)
    SubElement(link, "pose").text = " ".join(roll_pitch_yaw(frame))
    inertial = SubElement(link, "inertial")
    SubElement(inertial, "mass").text = said(MASS)
    inertia = SubElement(inertial, "inertia")
    for axis in ("ixx", "iyy", "izz"):
        SubElement(inertia, axis).text = said(0.4 * MASS * (0.1 * size) ** 2)


def _joint(model: Element, name: str, kind: str, parent: str, child: str) -> Element:
    element = SubElement(model, "joint", name=name, type=kind)
    SubElement(element, "parent").text = parent
    SubElement(element, "child").text = child
    return element
