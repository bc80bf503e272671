# SPDX-License-Identifier: MIT
"""The symmetry of a mechanism on its drawing: centre and mirrors."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from symkin.plot.style import ACCENT, BEFORE
from symkin.symmetry import SymmetryGroup

__all__ = ["DrawnSymmetry", "draw_symmetry"]


@dataclass(frozen=True)
class DrawnSymmetry:
    """The symmetry of a drawing.

    Attributes
    ----------
    group : SymmetryGroup
        With its centre and its axis.
    keeps_modes : collection of str
        Labels of the elements that keep the working modes.
    nearly : bool
        Whether the mechanism has it within its tolerances only.
    """

    group: SymmetryGroup
    keeps_modes: Collection[str]
    nearly: bool = False


def draw_symmetry(axes: Axes, symmetry: DrawnSymmetry) -> list[Line2D]:
    """Draw the centre of the rotations and the lines of the reflections, seen from above.

    Parameters
    ----------
    axes : Axes
        Whose limits stay.
    symmetry : DrawnSymmetry
        Of the mechanism that is drawn there.

    Returns
    -------
    list of Line2D
        Legend entries of what was drawn.
    """
    group = symmetry.group
    centre = np.asarray(group.frame.base_centre, dtype=float)
    shown: dict[bool, Line2D] = {}
    for element in group.elements:
        if element.reflection:
            kept = element.label in symmetry.keeps_modes
            azimuth = group.frame.base_axis + group.angle(element)
            direction = np.array([math.cos(azimuth), math.sin(azimuth)])
            colour = ACCENT if kept else BEFORE
            dashes: Literal["--", ":"] = "--" if kept else ":"
            axes.axline(
                (centre[0], centre[1]),
                tuple(centre + direction),
                color=colour,
                linestyle=dashes,
                linewidth=1.2,
                zorder=2,
            )
            label = "mirror" if kept else "mirror, flips the working modes"
            shown[kept] = Line2D([], [], color=colour, linestyle=dashes, linewidth=1.2, label=label)
    handles = [shown[kept] for kept in sorted(shown, reverse=True)]
    if group.rotations > 1:
        # A polygon with as many corners as there are turns; a diamond for two.
        handles += axes.plot(
            *centre,
            marker=(group.rotations, 0, 0) if group.rotations > 2 else "d",
            markersize=12,
            markerfacecolor="none",
            markeredgecolor=ACCENT,
            linestyle="none",
            label=f"{group.rotations}-fold centre",
            zorder=6,
        )
    return handles
