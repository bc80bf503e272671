# SPDX-License-Identifier: MIT
"""What the XML formats of models share."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.mechanism import Mechanism
from symkin.poses import Transform

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


def about(mechanism: Mechanism) -> str:
    """What a reader must know of any model, for a comment."""
    gains = ", ".join(said(gain) for gain in mechanism.sensor_gains)
    # Two hyphens would end an XML comment.
    name = mechanism.name.replace("--", "- -")
    return (
        f'"{name}", {len(mechanism.legs)} legs {mechanism.chain}, written by symkin. Lengths are m, '
        "angles rad. Geometry is the mechanism file's; masses, radii and colours are "
        "placeholders, since nobody measured them. Each leg is cut at its end, which a "
        "constraint holds at a point of the platform; leg<N>_active is the actuated joint. "
        f"Joint = gain * sensor reading, gains: {gains}."
    )


def xml_text(root: ElementTree.Element, comments: list[str]) -> str:
    """A document with comments above what it says."""
    ElementTree.indent(root)
    above = "".join(f"<!-- {comment} -->\n" for comment in comments)
    body = ElementTree.tostring(root, encoding="unicode")
    return f'<?xml version="1.0"?>\n{above}{body}\n'
