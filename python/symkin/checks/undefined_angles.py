# SPDX-License-Identifier: MIT
"""Joints at the origin of their frame, where polar coordinates have no angle."""

from __future__ import annotations

import math
from collections.abc import Iterator

from symkin.mechanism import Mechanism

__all__ = ["undefined_angles"]

_ENDS = {
    "base": "shift the origin of the base frame, in the mechanism and in the measured poses alike",
    "platform": "shift the origin of the platform frame, which is the point that poses give",
}


def undefined_angles(mechanism: Mechanism, leg: int) -> tuple[str, ...]:
    """Say which joints of a leg (from 0) have no angle, being within a tolerance of the origin.

    Such a joint can be identified, but not by its polar coordinates.

    Parameters
    ----------
    mechanism : Mechanism
        Whose length tolerance says how near counts.
    leg : int
        From 0.

    Returns
    -------
    tuple of str
        A sentence for each end, with what to do; empty for nearly every leg.
    """
    return tuple(_sentences(mechanism, leg))


def _sentences(mechanism: Mechanism, leg: int) -> Iterator[str]:
    values = mechanism.legs[leg].parameters
    joints = mechanism.chain.replace("[", "").replace("]", "")
    for (end, remedy), joint in zip(_ENDS.items(), (joints[0], joints[-1]), strict=True):
        radius = values.get(f"{end}_radius")
        if radius is None or joint == "P":  # the normal of a guide has its angle anywhere
            continue
        polar = values.get(f"{end}_polar_angle")
        azimuth = "angle" if polar is None else "azimuth"
        if abs(radius) <= mechanism.tolerances.length:
            names = [f"{end}_{azimuth}"] if polar is None else [f"{end}_polar_angle"]
            names += [] if polar is None else [f"{end}_{azimuth}"]
            where = f"{end}_radius is {radius:g} m: its {end} point is the frame's origin"
        elif polar is not None and abs(radius * math.sin(polar)) <= mechanism.tolerances.length:
            names = [f"{end}_{azimuth}"]
            where = f"{end}_polar_angle is {math.degrees(polar):g} deg: its {end} point is on Z"
        else:
            continue
        verb = "are" if len(names) > 1 else "is"
        yield f"leg {leg + 1}: {where}, where {' and '.join(names)} {verb} undefined; {remedy}"
