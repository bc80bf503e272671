# SPDX-License-Identifier: MIT
"""What the XML formats of models share."""

from __future__ import annotations

import json
import re
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.exports.options import MARK
from symkin.mechanism import Mechanism
from symkin.poses import Transform
from symkin.workspace.sample import workspace_coordinates

__all__ = ["MASS", "about", "roll_pitch_yaw", "said", "triple", "xml_text"]

# Nobody measured masses, and simulators refuse bodies without any.
MASS = 1.0


def said(value: float) -> str:
    """A number with all its digits; no negative zero."""
    return repr(float(value) + 0.0)


def triple(values: ArrayLike) -> str:
    """Numbers beside each other."""
    return " ".join(said(value) for value in np.asarray(values, dtype=np.float64).ravel())


def roll_pitch_yaw(frame: Transform) -> tuple[str, str]:
    """Translation, and fixed-axis angles about x, y, z, as URDF and SDF write a frame."""
    r: NDArray[np.float64] = frame.rotation
    level = np.hypot(r[0, 0], r[1, 0])
    pitch = np.arctan2(-r[2, 0], level)
    # Pitched upright, roll and yaw turn about the same line: all of it is roll then.
    if level < 1e-12:
        roll, yaw = np.arctan2(-r[1, 2], r[1, 1]), 0.0
    else:
        roll, yaw = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
    return triple(frame.translation), triple([roll, pitch, yaw])


def about(mechanism: Mechanism) -> list[str]:
    """What a reader must know of any model, and what a tree cannot say, for comments."""
    # Two hyphens would end an XML comment.
    name = re.sub("-(?=-)", "- ", mechanism.name)
    known = {
        "chain": mechanism.chain,
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


def xml_text(root: ET.Element, comments: list[str]) -> str:
    """A document with comments above what it says."""
    ET.indent(root)
    above = "".join(f"<!-- {comment} -->\n" for comment in comments)
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0"?>\n{above}{body}\n'
