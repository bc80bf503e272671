# SPDX-License-Identifier: MIT
"""The mechanism and what its file asks of the protocol; drawn, and to be moved by the reader.

The page's script knows no kinematics but rigid motion: it moves from node to node of a grid over
the workspace's box, and what it shows at a node is calculated here by the core: the inner joints of
the legs, the condition number, what stands against the pose, and the coordinates that the legs
bind. Where rigid motion is all there is to the legs, since they are straight, it moves freely, and
interpolates between the nodes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.second_order import second_order
from symkin.analysis.workspace import (
    inside_workspace,
    interpolated,
    least_reach_margin,
    workspace_coordinates,
)
from symkin.model.chains import legs_counted, legs_in_words
from symkin.model.declared import declared_chain, label_of
from symkin.model.mechanism import Mechanism
from symkin.model.poses import transforms
from symkin.model.symmetry import SymmetryGroup
from symkin.present import Group, Image, Movable, Page, Section, Table, notebook_of
from symkin.show.rendering import summary_html
from symkin.show.skeleton import drawn_centres, joints_of, outline, rails_of
from symkin.show.units import on_paper
from symkin.show.wording import (
    NONE,
    given,
    has_lengths,
    leg_columns,
    milli,
    pose_coordinates,
    setting,
    span,
)
from symkin.values import Array, places_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DIGITS = 7  # of a parameter, which has micrometres then,
_FEW_DIGITS, _MANY_LEGS = 5, 4  # and of more legs, beside each other
_PLATFORMS = {
    "planar": "moves in the plane and turns",
    "point": "a point that moves in the plane",
    "spatial": "moves and turns in space",
    "translating": "moves in space and never turns",
    "spherical": "turns about a fixed point",
    "schoenflies": "moves in space and turns about z",
}


def mechanism_section(
    mechanism: Mechanism,
    poses: Array,
    symmetry: SymmetryGroup | None = None,
    *,
    keeps_modes: Collection[str] = (),
    nearly: bool = False,
    steps: Mapping[str, Array] | None = None,
) -> Section:
    """Describe a mechanism; it is drawn at home, or else at one of the poses that it reaches.

    It can be stepped through the poses `steps`, each of which has a name.

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
    moved = movable(mechanism, steps)
    drawing = _drawing(mechanism, poses, symmetry, keeps_modes, nearly)
    if moved and symmetry is None:
        drawing = [replace(image, details=True) for image in drawing]  # as it stands at home there
    told = (
        f"{mechanism.name} has {legs_counted(mechanism.legs)}, of the "
        f"chain{'s' * mechanism.mixed} {mechanism.chain}, and {_identified(mechanism)}."
    )
    paragraph = " ".join([told, *held_parameters(mechanism)])
    parts: list[Table | Image | Movable] = [*drawing, *moved, settings]
    return Section("mechanism", "Mechanism", [paragraph], parts)


def _identified(mechanism: Mechanism) -> str:
    """How many parameters each leg has to identify."""
    legs_of = places_of(mechanism.estimated_counts)
    if len(legs_of) == 1:
        return f"{next(iter(legs_of))} parameters to identify on each"
    on = []
    for count, which in legs_of.items():
        named = mechanism.named_legs(which)
        on.append(f"{count} on {'each of ' * named.startswith('legs')}{named}")
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
    mechanism: Mechanism, before: Sequence[Sequence[str]] = (), after: Sequence[Sequence[str]] = ()
) -> Table:
    """Return the parameters of all legs, a column a leg, between what else is said of each.

    A parameter whose unit is not that of leg 1 says so in its cell; one that a leg does not have
    has an empty one.
    """
    legs = mechanism.told_legs
    chains = [
        chain if mechanism.is_read[leg] else chain.rpartition(".")[0] or chain
        for leg, chain in enumerate(map(label_of, mechanism.chains))
    ]
    rows: list[Sequence[str]] = [
        *([("chain", *chains)] if mechanism.mixed else []),
        *before,
        ("working mode", *(f"{mode:+d}" for mode in mechanism.working_modes)),
        *(_parameter_row(mechanism, index) for index in range(len(mechanism.parameter_names))),
        *after,
    ]
    rows = [(row[0], *(row[1 + leg] for leg in legs)) for row in rows]
    columns = ("", *leg_columns(legs))
    return Table("The legs", columns, [Group(rows)], brief=True)


def _parameter_row(mechanism: Mechanism, index: int) -> list[str]:
    legs = range(len(mechanism.legs))
    has = mechanism.has_parameter[:, index]
    units = [mechanism.parameter_units(leg)[index] for leg in legs]
    same = len({unit for unit, own in zip(units, has, strict=True) if own}) == 1
    unit = units[int(np.argmax(has))] if same else ""
    name = mechanism.parameter_names[index]
    digits = _DIGITS if len(legs) <= _MANY_LEGS else _FEW_DIGITS
    shown = [on_paper(unit) for unit in units]
    values = mechanism.parameters[:, index] * [factor for factor, _ in shown]
    unit = on_paper(unit)[1]
    return [
        f"{name}, {unit}" if unit else name,
        *(
            setting(float(values[leg]), "" if same else shown[leg][1], digits) if has[leg] else NONE
            for leg in legs
        ),
    ]


def held_parameters(mechanism: Mechanism) -> list[str]:
    """Say which parameters are held since others do the same; nothing if none is."""
    if mechanism.has_declared:
        return _held_of_declared(mechanism)
    legs = places_of(
        (
            names,
            "it moves a point along its guide"
            if "guide_elevation" in leg.parameters
            else "it makes upright legs longer",
        )
        for leg, names in zip(mechanism.legs, mechanism.held, strict=True)
    )
    return [
        f"Held as it was drawn is {' and '.join(names)}"
        + ("" if len(legs) == 1 else f" of {mechanism.named_legs(which)}")
        + f": {reason}, as the sensor's offset does."
        for (names, reason), which in legs.items()
        if names
    ]


def _recognised(mechanism: Mechanism) -> list[str]:
    """Which declared legs are computed as a known chain."""
    every = len(mechanism.legs)
    found = places_of(mechanism.leg_info(leg).runs_as for leg in range(every))
    return [
        f"{'Every leg' if len(which) == every else mechanism.named_legs(which).capitalize()} "
        f"{'is' if len(which) in (1, every) else 'are'} the known chain {known}, and computed as "
        "that."
        for known, which in found.items()
        if known
    ]


def _held_of_declared(mechanism: Mechanism) -> list[str]:
    """Which numbers of declared legs are held by their structure, and which by the file."""
    exact: dict[tuple[str, ...], list[int]] = {}
    redundant: dict[tuple[str, ...], list[int]] = {}
    hardly: dict[tuple[str, ...], list[int]] = {}
    largest, seen = 0.0, dict[tuple[str, tuple[str, ...]], dict[str, float]]()
    for leg, names in enumerate(mechanism.held):
        declared = declared_chain(mechanism.chains[leg])
        said = declared.exact if declared else []
        alike = mechanism.chains[leg], names
        if alike not in seen:
            seen[alike] = second_order(mechanism, leg, tuple(said))
        effects = seen[alike]
        largest = max(largest, *effects.values(), 0.0)
        for legs, own in (
            (exact, [name for name in names if name in said]),
            (redundant, [name for name in names if name not in said and name not in effects]),
            (hardly, [name for name in names if name in effects]),
        ):
            if own:
                legs.setdefault(tuple(own), []).append(leg)
    sentences = _recognised(mechanism)
    for legs, why in (
        (redundant, "redundant by structure"),
        (hardly, "of second order"),
        (exact, "called exact by the file"),
    ):
        for names, which in legs.items():
            of_legs = (
                "" if len(which) == len(mechanism.legs) else f" of {mechanism.named_legs(which)}"
            )
            sentences.append(f"Held as drawn: {', '.join(names)}{of_legs}; {why}.")
    if redundant:
        sentences.append(
            "What is redundant by structure does what others do, with errors within the tolerances "
            "too."
        )
    if hardly:
        effect = milli(largest, mechanism.space.closure_unit)
        sentences.append(
            "What is of second order shows nothing at the drawn geometry that the others do not "
            f"show, and with errors within the tolerances at most {effect} of a leg's closure, "
            "root mean square, which stays in the residuals."
        )
    return sentences


def _drawing(
    mechanism: Mechanism,
    poses: Array,
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
        figures = import_module("symkin.show.figures")  # which takes a while
        drawn = None if symmetry is None else figures.DrawnSymmetry(symmetry, keeps_modes, nearly)
        axes: Axes = figures.mechanism(mechanism, pose, symmetry=drawn)
        return axes

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
        ("legs", str(len(mechanism.leg_readings))),
        ("chain (actuated joint in brackets)", mechanism.chain),
        ("platform", _PLATFORMS[mechanism.pose_space]),
        ("sensor reading", mechanism.reading_unit),
    ]
    if mechanism.sensor_table is not None:
        rows.append(("readings shown here", "those of straight sensors, by the sensors' table"))
    every = range(len(mechanism.legs))
    legs_of = places_of(mechanism.leg_info(leg).description for leg in every)
    for description, legs in legs_of.items():
        if not description.startswith("without meaning"):
            modes = ", ".join(setting(mechanism.working_modes[leg]) for leg in legs)
            whose = f" of {mechanism.named_legs(legs)}" if mechanism.mixed else ""
            rows.append((f"working modes{whose}", f"{modes} ({description})"))
    limits = mechanism.reading_limits
    if np.isfinite(limits).any():
        unit = mechanism.reading_unit
        spans = [span(low, high, unit) for low, high in limits.T.tolist()]
        if len({*spans}) == 1:
            rows.append(("limits of the reading", spans[0]))
        else:
            rows += [(f"limits of the reading, leg {i}", span) for i, span in enumerate(spans, 1)]
    return rows


def _workspace(mechanism: Mechanism) -> list[Sequence[str]]:
    settings = mechanism.workspace
    if settings is None:
        return []
    names, rows = pose_coordinates(mechanism.space), list[Sequence[str]]()
    for each in mechanism.free:
        (name, unit), lower, upper = names[each], settings.lower[each], settings.upper[each]
        rows.append((name, span(lower, upper, unit)))
    home = settings.home_or_origin
    if mechanism.bound:
        others = [name for each, (name, _) in enumerate(names) if each not in mechanism.free]
        rows.append((" and ".join([", ".join(others[:-1]), others[-1]]), "follow from the legs"))
    at_home = [f"{names[each][0]} = {given(home[each], names[each][1])}" for each in mechanism.free]
    margin = milli(least_reach_margin(mechanism), mechanism.space.closure_unit)
    rows += [
        ("home", ", ".join(at_home)),
        ("margin to the limits of reach, at least", margin),
        ("condition number, at most", setting(settings.conditioning_limit)),
    ]
    if mechanism.space.turns and mechanism.space.moves:
        length = given(mechanism.characteristic_length, "m")
        rows.append(("length that weighs rotations in it", length))
    return rows


def _noise(mechanism: Mechanism) -> list[Sequence[str]]:
    noise = mechanism.noise
    rows: list[Sequence[str]] = [
        (kind, given(getattr(noise, kind), unit)) for kind, unit in mechanism.space.errors
    ]
    if noise.per_metre:
        more = given(noise.per_metre, "m")
        rows.append(("position, more for each metre from the device", more))
    if noise.along is not None:
        way = "the beam" if noise.direction == "beam" else f"the device's {noise.direction}"
        rows.append((f"position along {way}", given(noise.along, "m")))
    if noise.along_per_metre:
        more = given(noise.along_per_metre, "m")
        rows.append(("the same, more for each metre from the device", more))
    reading = given(noise.reading, mechanism.reading_unit) if noise.reading else "none"
    device = mechanism.device
    by = [] if device is None else [("measured by", device.kind)]
    return [*by, *rows, ("sensor reading", reading)]


def _tolerances(mechanism: Mechanism) -> list[Sequence[str]]:
    tolerances = mechanism.tolerances
    lengths = [("lengths", given(tolerances.length, "m"))]
    return [
        *(lengths if has_lengths(mechanism) else []),
        ("angles", given(tolerances.angle, "rad")),
        ("sensor gains", setting(100 * tolerances.gain, "%")),
    ]


# Two characters hold a number up to 4095; "__" is none.
_ALPHABET = np.frombuffer(
    b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_", dtype=np.uint8
)
_LARGEST, _NONE = 4094, 4095
_DECADES = 4  # of the condition number
_BUDGET, _INTERPOLATED = 100_000, 60_000  # characters of all nodes; of straight legs
_MOST, _LEAST = 61, 3  # nodes along an axis
_FINE, _LINES = 25, 24  # points of a line along which the condition number is looked at; such lines
_TRIED = 1000  # poses, for the error of the interpolation
_STATES = ("inside", "reach", "margin", "limits", "aspect", "conditioning")


def movable(mechanism: Mechanism, steps: Mapping[str, Array] | None = None) -> tuple[Movable, ...]:
    """Return a mechanism that can be moved through its workspace's box; nothing if it has none.

    It can be stepped through poses, `steps`, each of which has a name.
    """
    if mechanism.workspace is None:
        return ()
    names = list(mechanism.space.units)
    bound = [names[each] for each in _bound(mechanism)]
    follow = f", and {', '.join(bound)} as the legs bind them" if bound else ""
    caption = (
        f"{mechanism.name}, to be moved through the box of its workspace. The legs follow by the "
        f"inverse kinematics of the core{follow}. The condition number is that of the readings "
        "against the pose; it grows beyond all bounds towards a parallel singularity."
    )
    alternative = f"Drawing of {mechanism.name} that follows the sliders beside it."
    return (Movable("movable", alternative, caption, lambda: movable_data(mechanism, steps)),)


def movable_data(mechanism: Mechanism, steps: Mapping[str, Array] | None = None) -> dict[str, Any]:
    """Return what the page's script needs: a grid of poses, rigid bodies, and what each pose shows.

    Axes, the corners of base and platform, each leg's joints, how many of them lie between its
    ends, and the nodes as text: for each a character for its state, two for the logarithm of its
    condition number, for each leg and inner joint two for each of its coordinates, and two for each
    coordinate of the pose that the legs bind. Of `steps` the pose and the joints themselves.
    """
    home = mechanism.home
    readings = mechanism.inverse_kinematics(home)[0]
    ends = [drawn_centres(mechanism, leg, home, reading) for leg, reading in enumerate(readings)]
    inner = [len(centres) - 2 for centres in ends]
    rails = rails_of(mechanism, home, readings)
    base = np.array([centres[0] for centres in ends])
    platform = _in_platform(mechanism, np.array([centres[-1] for centres in ends]))
    dimensions = base.shape[1]
    bound = _bound(mechanism)
    characters = 3 + 2 * (dimensions * sum(inner) + len(bound))
    counts = _equal_counts(mechanism, _BUDGET // characters)
    if not any(inner):
        counts = _counts_by_need(mechanism, _INTERPOLATED // characters)
    axes = _axes(mechanism, counts)
    # All places of the grid, the last coordinate running fastest.
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    poses = _poses(mechanism, nodes)
    followed = workspace_coordinates(mechanism, poses)[:, bound]
    _, parallel, conditions = mechanism.singularity_measures(poses)
    readings = mechanism.inverse_kinematics(poses)
    centres = _inner_centres(mechanism, poses, readings, inner, dimensions)
    inside = inside_workspace(mechanism, poses)
    states = _states(mechanism, poses, readings, inside, parallel)
    offset, step = _scale(centres[inside] if inside.any() else centres)
    coordinates = ((centres - offset) / step).reshape(len(poses), -1)
    codes = np.hstack([states[:, None], _codes(conditions, coordinates, followed)])
    names = pose_coordinates(mechanism.space)
    home_values = mechanism.home_coordinates[list(mechanism.free)]
    assert mechanism.workspace is not None
    return {
        "dimensions": dimensions,
        "moves": mechanism.space.moves,
        "axes": [
            {"name": names[place][0], "unit": names[place][1], "values": np.round(axis, 9).tolist()}
            for place, axis in zip(mechanism.free, axes, strict=True)
        ],
        "free": mechanism.free,
        "bound": [[place, *_span(each)] for place, each in zip(bound, followed.T, strict=True)],
        "home": [
            int(np.argmin(np.abs(axis - value)))
            for axis, value in zip(axes, home_values, strict=True)
        ],
        "base": _rounded(base),
        "platform": _rounded(platform),
        "outlines": [_rounded(outline(base)), _rounded(outline(platform))],
        "joints": [
            [[joint.kind == "P", joint.actuated] for joint in joints_of(chain)]
            for chain in mechanism.chains
        ],
        "steps": _steps(mechanism, steps or {}, inner, dimensions),
        "rails": [None if each is None else _rounded(each) for each in rails],
        "inner": inner,
        "error": _interpolation_error(mechanism, axes, conditions) if not any(inner) else 0,
        "offset": np.round(offset, 9).tolist(),
        "step": step,
        "decades": _DECADES,
        "states": _STATES,
        "limit": mechanism.workspace.conditioning_limit,
        "margin": milli(least_reach_margin(mechanism), mechanism.space.closure_unit),
        "allowed": setting(mechanism.workspace.conditioning_limit),
        "nodes": _ALPHABET[codes].tobytes().decode("ascii"),
    }


def _bound(mechanism: Mechanism) -> list[int]:
    """Which coordinates of a pose follow from the others."""
    return [each for each in range(mechanism.space.dof) if each not in mechanism.free]


def _equal_counts(mechanism: Mechanism, nodes: int) -> list[int]:
    """As many steps along each axis as so many nodes allow."""
    axes = len(mechanism.free)
    return [min(_MOST, int(nodes ** (1 / axes) + 1e-9))] * axes


def _counts_by_need(mechanism: Mechanism, nodes: int) -> list[int]:
    """So many nodes, more along axes along which the condition number is further from straight.

    That is how far it is from straight between nodes, on lines through some poses of the box.
    """
    fine = _axes(mechanism, [_FINE] * len(mechanism.free))
    through = np.random.default_rng(0).integers(_FINE, size=(_LINES, len(fine)))
    lines = []
    for place, axis in enumerate(fine):
        at = np.stack([axis[own] for axis, own in zip(fine, through.T, strict=True)], axis=-1)
        at = at.repeat(_FINE, axis=0)
        at[:, place] = np.tile(axis, _LINES)
        conditions = mechanism.singularity_measures(_poses(mechanism, at))[2]
        lines.append(np.log(conditions).reshape(_LINES, _FINE))

    @cache
    def bend(place: int, count: int) -> float:
        shares = np.linspace(0, 1, _FINE)
        nodes = np.linspace(0, 1, count)
        missed = [
            np.abs(np.interp(shares, nodes, np.interp(nodes, shares, line)) - line)
            for line in lines[place]
        ]
        return float(np.nanmax(missed, initial=0.0))

    counts = [_LEAST] * len(fine)
    while True:
        fits = [
            place
            for place, count in enumerate(counts)
            if count < _MOST and math.prod(counts) // count * (count + 1) <= nodes
        ]
        if not fits:
            return counts
        counts[max(fits, key=lambda place: bend(place, counts[place]))] += 1


def _axes(mechanism: Mechanism, counts: Sequence[int]) -> list[Array]:
    """So many steps along each axis, one of them at home, which may be beyond the box."""
    settings = mechanism.workspace
    assert settings is not None
    axes = []
    for place, count in zip(mechanism.free, counts, strict=True):
        low, high = settings.lower[place], settings.upper[place]
        home = mechanism.home_coordinates[place]
        axis = np.linspace(min(low, home), max(high, home), count)
        axis[np.argmin(np.abs(axis - home))] = home
        axes.append(axis)
    return axes


def _poses(mechanism: Mechanism, chosen: Array) -> Array:
    """Poses by the coordinates that can be chosen, (N, free); NaN where the legs have none."""
    values = np.tile(mechanism.home_coordinates, (len(chosen), 1))
    values[:, mechanism.free] = chosen
    return np.ascontiguousarray(mechanism.poses_at(values))


def _span(values: Array) -> tuple[float, float]:
    """The least of them and the unit in which they are counted from there."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    return float(known.min()), float(np.ptp(known)) / _LARGEST or 1.0


def _interpolation_error(mechanism: Mechanism, axes: list[Array], conditions: Array) -> float:
    """The largest relative error of the condition number between the nodes, at some poses."""
    shape = [len(axis) for axis in axes]
    logarithms = np.log(conditions).reshape(shape)
    places = np.random.default_rng(0).uniform(0, np.array(shape) - 1, (_TRIED, len(axes)))
    steps = [np.arange(count, dtype=np.float64) for count in shape]
    between = interpolated(steps, logarithms[..., np.newaxis], places)[:, 0]
    values = [
        np.interp(place, np.arange(len(axis)), axis)
        for place, axis in zip(places.T, axes, strict=True)
    ]
    exact = mechanism.singularity_measures(_poses(mechanism, np.stack(values, axis=-1)))[2]
    with np.errstate(invalid="ignore"):
        return float(np.nanmax(np.abs(np.exp(between) / exact - 1)))


def _codes(conditions: Array, coordinates: Array, followed: Array) -> NDArray[np.int64]:
    """Characters of every node after its state."""
    with np.errstate(invalid="ignore", divide="ignore"):
        logarithm = np.log10(conditions) * _LARGEST / _DECADES
    least, unit = np.array([_span(each) for each in followed.T]).reshape(-1, 2).T
    numbers = np.hstack([logarithm[:, None], coordinates, (followed - least) / unit])
    known = np.isfinite(numbers)
    numbers[:, :1] = np.clip(numbers[:, :1], 0, _LARGEST)
    drawn = known & (numbers >= 0) & (numbers <= _LARGEST)
    whole = np.where(drawn, np.round(np.where(drawn, numbers, 0)), _NONE).astype(np.int64)
    return np.stack([whole // 64, whole % 64], axis=-1).reshape(len(conditions), -1)


def _steps(
    mechanism: Mechanism, steps: Mapping[str, Array], inner: list[int], dimensions: int
) -> list[dict[str, Any]]:
    """Of poses to step through what is drawn: the pose, and joints between the ends of legs."""
    if not steps:
        return []
    poses = np.array(list(steps.values()))
    readings = mechanism.inverse_kinematics(poses)
    centres = _inner_centres(mechanism, poses, readings, inner, dimensions)
    seen = workspace_coordinates(mechanism, poses)
    return [
        {"name": name, "pose": np.round(pose, 4).tolist()}
        | ({"joints": _split(joints, inner)} if any(inner) else {})
        for name, pose, joints in zip(steps, seen, centres, strict=True)
        if np.isfinite(joints).all()
    ]


def _split(joints: Array, inner: list[int]) -> list[list[list[float]]]:
    """The joints of each leg."""
    return [np.round(own, 4).tolist() for own in np.split(joints, np.cumsum(inner)[:-1])]


def _inner_centres(
    mechanism: Mechanism, poses: Array, readings: Array, inner: list[int], dimensions: int
) -> Array:
    """Of the joints between the first and the last of each leg, leg by leg: (N, joints, 2 or 3)."""
    centres = np.full((len(poses), sum(inner), dimensions), np.nan)
    behind = np.cumsum(inner)
    for leg in np.flatnonzero(inner).tolist():
        for row in np.flatnonzero(np.isfinite(readings[:, leg])):
            drawn = drawn_centres(mechanism, leg, poses[row], readings[row, leg])
            centres[row, behind[leg] - inner[leg] : behind[leg]] = drawn[1:-1]
    return centres


def _scale(centres: Array) -> tuple[Array, float]:
    """Least coordinates and unit of what is drawn, with room around what the workspace needs."""
    known = centres.reshape(-1, centres.shape[-1])
    known = known[np.isfinite(known).all(axis=1)]
    if not len(known):
        return np.zeros(centres.shape[-1]), 1.0
    lower, upper = known.min(axis=0), known.max(axis=0)
    size = float(max(upper - lower)) or 1.0
    return (lower + upper) / 2 - size, 2 * size / _LARGEST


def _states(
    mechanism: Mechanism, poses: Array, readings: Array, inside: NDArray[np.bool_], parallel: Array
) -> NDArray[np.int64]:
    """What speaks against each pose, as the sampling of the workspace asks, by its place."""
    with np.errstate(invalid="ignore"):
        beyond = ~np.isfinite(readings).all(axis=1)
        margin = (
            _core.reach_margin(mechanism.straight, poses) < least_reach_margin(mechanism)
        ).any(1)
        stopped = ~mechanism.within_limits(readings).all(axis=1)  # or beyond, which comes first
        at_home = mechanism.singularity_measures(mechanism.home)[1]
        other = (parallel * at_home <= 0) & (not mechanism.straight.redundant)
    causes = [inside, beyond, margin, stopped, other]
    return np.select(causes, range(len(causes)), default=len(causes)).astype(np.int64)


def _in_platform(mechanism: Mechanism, points: Array) -> Array:
    """Points at home, in the platform's frame."""
    platform, size = transforms(mechanism.pose_space, mechanism.home[np.newaxis]), points.shape[1]
    local = (points - platform.translation[0, :size]) @ platform.rotation[0, :size, :size]
    return np.asarray(local)


def _rounded(points: Array) -> list[list[float]]:
    return np.round(points, 6).tolist()  # type: ignore[no-any-return]


@notebook_of.register(Mechanism)
def mechanism_html(mechanism: Mechanism) -> str:
    """Return what a notebook shows of a mechanism: its drawing and its legs."""
    return summary_html(Page(mechanism_title(mechanism)), mechanism_parts(mechanism))
