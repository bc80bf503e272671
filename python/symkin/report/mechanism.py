# SPDX-License-Identifier: MIT
"""The mechanism and what its file asks of the protocol."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from symkin.chains import legs_in_words
from symkin.errors import named_legs
from symkin.mechanism import Mechanism
from symkin.report.content import Group, Image, Section, Table
from symkin.report.movable import movable
from symkin.report.wording import (
    NONE,
    has_lengths,
    leg_columns,
    plural,
    pose_coordinates,
    quantity,
    setting,
)
from symkin.symmetry import SymmetryGroup
from symkin.workspace import least_reach_margin

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PLATFORMS = {
    "planar": "moves in the plane and turns",
    "point": "a point that moves in the plane",
    "spatial": "moves and turns in space",
    "translating": "moves in space and never turns",
    "spherical": "turns about a fixed point",
}


def mechanism_section(
    mechanism: Mechanism,
    poses: NDArray[np.float64],
    symmetry: SymmetryGroup | None = None,
    *,
    keeps_modes: Collection[str] = (),
    nearly: bool = False,
) -> Section:
    """Describe a mechanism; it is drawn at home, or else at one of the poses that it reaches.

    Drawn are centre and mirrors of `symmetry`, of whose elements some keep the working modes, and
    which the mechanism may have nearly, within its tolerances.
    """
    groups = [
        Group(_structure(mechanism), "Structure"),
        Group(_workspace(mechanism), "Workspace"),
        Group(_noise(mechanism), "Measurement noise (standard deviations)"),
        Group(_tolerances(mechanism), "Manufacturing tolerances (standard deviations)"),
    ]
    settings = Table(
        "Mechanism and settings",
        ("Setting", "Value"),
        [group for group in groups if group.rows],
        wordy=True,
    )
    drawing = _drawing(mechanism, poses, symmetry, keeps_modes, nearly)
    paragraph = " ".join(
        [
            f"{mechanism.name} has {plural(len(mechanism.legs), 'leg')} with the "
            f"chain{'s' * mechanism.mixed} "
            f"{mechanism.chain}, and {_identified(mechanism)}.",
            *held_parameters(mechanism),
        ]
    )
    return Section("mechanism", "Mechanism", [paragraph], [*drawing, *movable(mechanism), settings])


def _identified(mechanism: Mechanism) -> str:
    """How many parameters each leg has to identify."""
    legs_of: dict[int, list[int]] = {}
    for leg, count in enumerate(mechanism.estimated_counts):
        legs_of.setdefault(count, []).append(leg)
    if len(legs_of) == 1:
        return f"{next(iter(legs_of))} parameters to identify on each"
    on = (f"{count} on {'each of ' * (len(w) > 1)}{named_legs(w)}" for count, w in legs_of.items())
    return f"parameters to identify: {'; '.join(on)}"


def mechanism_title(mechanism: Mechanism) -> str:
    """Return its name and kind in a line."""
    words = [legs_in_words(mechanism.legs), mechanism.pose_space]
    words += [] if mechanism.symmetry is None else [mechanism.symmetry.group]
    words += [] if mechanism.curvature is None else ["curved sensors"]
    words += [] if mechanism.sensor_table is None else ["sensors with a table"]
    words += [] if mechanism.deviations is None else ["with standard deviations"]
    return f"{mechanism.name}: {', '.join(words)}"


def mechanism_parts(mechanism: Mechanism) -> list[Image | Table]:
    """Return what a notebook shows of a mechanism: its drawing at home, and its legs."""
    straight = mechanism.replace(curvature=None)
    return [*_drawing(straight, np.empty((0, len(mechanism.home)))), legs_table(mechanism)]


def legs_table(
    mechanism: Mechanism,
    before: Sequence[Sequence[str]] = (),
    after: Sequence[Sequence[str]] = (),
) -> Table:
    """Return the parameters of all legs, a column a leg, between what else is said of each.

    A parameter whose unit is not that of leg 1 says so in its cell; one that a leg does not have
    has an empty one.
    """
    rows = [
        *([("chain", *mechanism.chains)] if mechanism.mixed else []),
        *before,
        ("working mode", *(f"{mode:+d}" for mode in mechanism.working_modes)),
        *(_parameter_row(mechanism, index) for index in range(len(mechanism.parameter_names))),
        *after,
    ]
    columns = ("", *leg_columns(len(mechanism.legs)))
    return Table("The legs", columns, [Group(rows)], brief=True)


def _parameter_row(mechanism: Mechanism, index: int) -> list[str]:
    legs = range(len(mechanism.legs))
    has = mechanism.has_parameter[:, index]
    units = [mechanism.parameter_units(leg)[index] for leg in legs]
    same = len({unit for unit, own in zip(units, has, strict=True) if own}) == 1
    unit = units[int(np.argmax(has))] if same else ""
    name = mechanism.parameter_names[index]
    values = mechanism.parameters[:, index].tolist()
    return [
        f"{name}, {unit}" if unit else name,
        *(
            setting(values[leg], "" if same else units[leg], digits=6) if has[leg] else NONE
            for leg in legs
        ),
    ]


def held_parameters(mechanism: Mechanism) -> list[str]:
    """Say which parameters are held since others do the same; nothing if none is."""
    why = "it makes upright legs longer"
    along = "it moves a point along its guide"
    legs: dict[tuple[tuple[str, ...], str], list[int]] = {}
    for leg, names in enumerate(mechanism.held):
        guided = "guide_elevation" in mechanism.legs[leg].parameters
        legs.setdefault((names, along if guided else why), []).append(leg)
    return [
        f"Held as it was drawn is {' and '.join(names)}"
        + ("" if len(legs) == 1 else f" of {named_legs(which)}")
        + f": {reason}, as the sensor's offset does."
        for (names, reason), which in legs.items()
        if names
    ]


def _drawing(
    mechanism: Mechanism,
    poses: NDArray[np.float64],
    symmetry: SymmetryGroup | None = None,
    keeps_modes: Collection[str] = (),
    nearly: bool = False,
) -> list[Image]:
    """The drawing, unless no pose is within reach of all legs."""
    tried = np.vstack([mechanism.home, poses])
    reached = np.flatnonzero(np.isfinite(mechanism.inverse_kinematics(tried)).all(axis=1))
    if not reached.size:
        return []
    where = "at its home pose" if reached[0] == 0 else "at one of its poses (home is out of reach)"
    pose = tried[reached[0]]

    def draw() -> Axes:
        from symkin import plot

        drawn = None if symmetry is None else plot.DrawnSymmetry(symmetry, keeps_modes, nearly)
        return plot.mechanism(mechanism, pose, symmetry=drawn)

    mirrors = ""
    if symmetry is not None and symmetry.size > 1:
        mirrors = f" The symmetry is {symmetry.title}{', nearly' if nearly else ''}."
    if not mechanism.space.moves:
        mirrors += " Drawn are the joints' axes and the links between them, inner links further in."
    return [
        Image(
            "mechanism",
            f"Drawing of {mechanism.name} {where}: base, platform and numbered legs.",
            f"{mechanism.name} {where}. Each leg keeps its colour in all figures.{mirrors}",
            draw,
        )
    ]


def _structure(mechanism: Mechanism) -> list[Sequence[str]]:
    rows: list[Sequence[str]] = [
        ("legs", str(len(mechanism.legs))),
        ("chain (actuated joint in brackets)", mechanism.chain),
        ("platform", _PLATFORMS[mechanism.pose_space]),
        ("sensor reading", mechanism.reading_unit),
    ]
    if mechanism.sensor_table is not None:
        rows.append(("readings shown here", "those of straight sensors, by the sensors' table"))
    legs_of: dict[str, list[int]] = {}
    for leg in range(len(mechanism.legs)):
        legs_of.setdefault(mechanism.leg_info(leg).description, []).append(leg)
    for description, legs in legs_of.items():
        if not description.startswith("without meaning"):
            modes = ", ".join(setting(mechanism.working_modes[leg]) for leg in legs)
            whose = f" of {named_legs(legs)}" if mechanism.mixed else ""
            rows.append((f"working modes{whose}", f"{modes} ({description})"))
    limits = mechanism.reading_limits
    if np.isfinite(limits).any():
        unit = mechanism.reading_unit
        spans = [
            f"{setting(low, unit)} to {setting(high, unit)}" for low, high in limits.T.tolist()
        ]
        if len({*spans}) == 1:
            rows.append(("limits of the reading", spans[0]))
        else:
            rows += [(f"limits of the reading, leg {i}", span) for i, span in enumerate(spans, 1)]
    return rows


def _workspace(mechanism: Mechanism) -> list[Sequence[str]]:
    settings = mechanism.workspace
    if settings is None:
        return []
    names = pose_coordinates(mechanism.space)
    rows: list[Sequence[str]] = [
        (
            names[each][0],
            f"{setting(settings.lower[each])} to {setting(settings.upper[each], names[each][1])}",
        )
        for each in mechanism.free
    ]
    home = settings.home_or_origin
    if mechanism.bound:
        others = [name for each, (name, _) in enumerate(names) if each not in mechanism.free]
        rows.append((" and ".join([", ".join(others[:-1]), others[-1]]), "follow from the legs"))
    rows += [
        (
            "home",
            ", ".join(
                f"{names[each][0]} = {setting(home[each], names[each][1])}"
                for each in mechanism.free
            ),
        ),
        (
            "margin to the limits of reach, at least",
            quantity(least_reach_margin(mechanism), mechanism.space.closure_unit),
        ),
        ("condition number, at most", setting(settings.conditioning_limit)),
    ]
    if mechanism.space.turns and mechanism.space.moves:
        length = setting(mechanism.characteristic_length, "m")
        rows.append(("length that weighs rotations in it", length))
    return rows


def _noise(mechanism: Mechanism) -> list[Sequence[str]]:
    noise = mechanism.noise
    rows: list[Sequence[str]] = []
    if mechanism.space.moves:
        rows.append(("position", setting(1e3 * noise.position, "mm")))
    if mechanism.space.turns:
        rows.append(("orientation", setting(1e3 * noise.orientation, "mrad")))
    reading = setting(noise.reading, mechanism.reading_unit) if noise.reading else "none"
    return [*rows, ("sensor reading", reading)]


def _tolerances(mechanism: Mechanism) -> list[Sequence[str]]:
    tolerances = mechanism.tolerances
    lengths = [("lengths", setting(1e3 * tolerances.length, "mm"))]
    return [
        *(lengths if has_lengths(mechanism) else []),
        ("angles", setting(1e3 * tolerances.angle, "mrad")),
        ("sensor gains", setting(100 * tolerances.gain, "%")),
    ]
