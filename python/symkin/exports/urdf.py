# SPDX-License-Identifier: MIT
"""URDF: a tree, whose cut joints stand in comments.

A body with several joints becomes a row of links with one joint each.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from symkin.exports.bodies import Body, Structure
from symkin.exports.options import ExportOptions, Written
from symkin.exports.structure import structure_of
from symkin.exports.xml_text import MASS, about, roll_pitch_yaw, said, triple, xml_text
from symkin.mechanism import Mechanism
from symkin.poses import Transform

__all__ = ["write"]

_KINDS = {"hinge": "continuous", "slide": "prismatic", "free": "floating"}
_NOTE = "a URDF is a tree: the loops are open, and the joints that close them stand in comments"


def write(mechanism: Mechanism, options: ExportOptions) -> Written:  # noqa: ARG001
    """Write a mechanism as URDF; all joints at zero are all readings at zero, not home."""
    structure = structure_of(mechanism)
    root = Element("robot", name=mechanism.name)
    SubElement(root, "link", name="base")
    for body in structure.bodies:
        _links(root, body, structure.size)
    return Written(xml_text(root, [*about(mechanism), *_cuts(structure)]), (_NOTE,))


def _cuts(structure: Structure) -> list[str]:
    """The joints that are not in the tree."""
    return [
        f"cut joint {each.name}, ball: point {triple(each.point)} of {each.body} = "
        f"point {triple(each.platform_point)} of platform"
        for each in structure.closures
    ]


def _links(root: Element, body: Body, size: float) -> None:
    """The body's joints, each with the link that it moves; the last link is the body."""
    parent = body.parent or "base"
    frame = Transform(body.rotation, body.position)
    for number, joint in enumerate(body.joints, 1):
        name = body.name if number == len(body.joints) else f"{body.name}_{number}"
        link = SubElement(root, "link", name=name)
        inertial = SubElement(link, "inertial")
        SubElement(inertial, "mass", value=said(MASS))
        moment = said(0.4 * MASS * (0.1 * size) ** 2)
        equal, other = dict.fromkeys(("ixx", "iyy", "izz"), moment), ("ixy", "ixz", "iyz")
        SubElement(inertial, "inertia", {**equal, **dict.fromkeys(other, "0")})
        kind = _KINDS[joint.kind]
        element = SubElement(root, "joint", name=joint.name, type=kind)
        SubElement(element, "parent", link=parent)
        SubElement(element, "child", link=name)
        place, angles = roll_pitch_yaw(frame)
        SubElement(element, "origin", xyz=place, rpy=angles)
        if joint.kind != "free":
            SubElement(element, "axis", xyz=triple(joint.axis))
        if joint.kind == "slide":
            # The format wants limits of a slide; those of the robot are not known.
            far = said(10 * size)
            limits = {"lower": f"-{far}", "upper": far, "effort": "1000", "velocity": "10"}
            SubElement(element, "limit", limits)
        parent, frame = name, Transform(np.eye(3), np.zeros(3))
