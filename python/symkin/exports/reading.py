# SPDX-License-Identifier: MIT
"""Mechanisms read from other formats: Klipper's printer.cfg, and the models that symkin writes.

Klipper keeps what DELTA_CALIBRATE recorded at the end of the file: how many steps below its endstop
each carriage stood where the probe met the bed (``heightN_pos`` of ``[delta_calibrate]``), and the
height of the nozzle there (``heightN``): readings and heights. See
klippy/extras/delta_calibrate.py.
"""

from __future__ import annotations

import configparser
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

from symkin.analysis.probing import CALIPER
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError, TomlFileError
from symkin.exports.declared_reading import mechanism_of_scene
from symkin.exports.firmware import NOMINAL_DEGREES, TOWERS, LinearDelta
from symkin.exports.printers import (
    ASSUMED,
    ASSUMED_OF_CRANKS,
    CONDITION,
    few_heights,
    printer_of,
    workspace_of,
)
from symkin.exports.scene import Scene
from symkin.exports.scenes import read_scene
from symkin.model.chains import Leg, chain_info
from symkin.model.file_frames import point_parameters, polar
from symkin.model.mechanism import Mechanism
from symkin.model.settings import WorkspaceSettings
from symkin.storage.tables import file_bytes, kind_of_file
from symkin.values import Array, Value, field, record

_Z = np.array([0.0, 0.0, 1.0])
_AROUND = 0.05  # of the size, m, and rad: the box around home
_NOTE = "The workspace is a small box around home, since a model says nothing of it"


class _Placed(NamedTuple):
    """A body as a model places it in its parent, and the axis of its first joint."""

    position: Array
    rotation: Array
    axis: Array


class _Tree(NamedTuple):
    """What a model says: bodies and ends of legs by name, points of the platform by leg."""

    name: str
    bodies: Mapping[str, _Placed]
    ends: Mapping[str, Array]
    points: Mapping[str, Array]


@record
class Imported(Value):
    """A robot read from another format.

    Attributes
    ----------
    mechanism : Mechanism
        As it is described there; a sensor reads the way of its carriage from the endstop.
    measurements : Measurements or None
        Readings and heights that were recorded, and behind them the ends of distances on printed
        objects, as rows in pairs; None if there are none.
    notes : tuple of str
        What was not read, or assumed.
    """

    mechanism: Mechanism = field(private=True)
    measurements: Measurements | None = field(private=True)
    notes: tuple[str, ...]


def import_mechanism(
    path: str | os.PathLike[str], loops: str | os.PathLike[str] | None = None, *, body: str = ""
) -> Imported:
    """Read a mechanism from Klipper's printer.cfg, or from a model: MJCF, URDF or SDF.

    Of a model the geometry is read from bodies and joints, so it may have been changed there. A
    leg of a known chain is read as symkin writes it; any other model becomes declared legs, by its
    tree and what closes its loops: `connect` and `weld` of MJCF, second parents of SDF, a file of
    loops beside a URDF, or the comments that symkin writes. What cannot be a leg is named.

    Parameters
    ----------
    path : str or path
        The file.
    loops : str or path, optional
        Beside a model a TOML file: ``active``, the joints that are read; ``home``, values of
        joints; ``free``, coordinates that can be chosen where legs bind the platform; and
        ``[[loops]]`` with ``body``, ``point``, ``other``, ``other_point``, each a point in its
        link's frame, and, with ``closes = "pose"``, ``rpy`` and ``other_rpy``.
    body : str
        The body of a model that is the platform; by default "platform".

    Returns
    -------
    Imported

    Raises
    ------
    SymkinError
        Naming the file and what is missing.
    """
    path = Path(path)
    data = file_bytes(path, lambda message: SymkinError(f"{path}: {message}"), _MOST_BYTES)
    if not data.lstrip().startswith(b"<"):
        if loops is not None or body:
            raise SymkinError(f"{path}: is no model; loops and a body belong to one")
        return _printer(path)
    try:
        return _model(path, data.decode("utf-8"), None if loops is None else Path(loops), body)
    except (ET.ParseError, UnicodeDecodeError) as error:
        raise SymkinError(f"{path}: is neither a printer.cfg nor XML: {error}") from error
    except TomlFileError:  # of loops, which has their file
        raise
    except SymkinError as error:
        raise SymkinError(f"{path}: {error}") from error
    except (AttributeError, KeyError, IndexError, TypeError, ValueError, RecursionError) as error:
        raise SymkinError(f"{path}: is not as symkin writes such a model: {error!r}") from error


def _model(path: Path, text: str, loops: Path | None, body: str) -> Imported:
    root = ET.fromstring(text)
    scene = read_scene(root, path, text, loops)
    known = scene.known
    if "chain" not in known or "joints" in known or root.tag == "sdf":  # of no known chains
        mechanism, notes = mechanism_of_scene(scene, body)
        return Imported(mechanism, None, notes)
    tree = _tree_of(scene)
    chains, platform = known["chain"], known["platform"]
    if platform == "spherical":
        raise SymkinError("has a spherical platform; such models are written, but not read back")
    if isinstance(chains, str):
        chains = [chains] * len(known["gains"])
    legs = []
    sensors = zip(chains, known["working_modes"], known["gains"], strict=True)
    for number, (chain, mode, gain) in enumerate(sensors, 1):
        if chain not in _LEGS:
            raise SymkinError(f'has chain "{chain}"; expected one of {", ".join(_LEGS)}')
        own = _LEGS[chain](tree, f"leg{number}") | {"sensor_gain": gain}
        if platform == "rigid":
            own |= _coordinates("platform", tree.points[f"leg{number}_end"], chain)
        legs.append(Leg(chain, own, mode))
    home = np.array(known["home"], dtype=np.float64)
    if not np.isfinite(home).all():
        raise SymkinError(f"has home {known['home']}; expected finite numbers")
    far = max(float(np.linalg.norm(b.position)) for b in tree.bodies.values())
    size = _AROUND * np.array([far] * min(3, len(home)) + [1.0] * max(0, len(home) - 3))
    if (platform, len(home)) == ("rigid", 3):
        size[2] = _AROUND
    box = WorkspaceSettings(tuple(home - size), tuple(home + size), home=tuple(home))
    mechanism = Mechanism(
        tree.name, legs, platform=platform, reading_unit=known["reading_unit"], workspace=box
    )
    return Imported(mechanism, None, (_NOTE,))


def _tree_of(scene: Scene) -> _Tree:
    """What a leg of a known chain is read from."""
    bodies: dict[str, _Placed] = {}
    for name, part in scene.parts.items():
        # The first joint of a body moves its first link in URDF, which places it.
        first, last = re.fullmatch(r"(.*?)_1", name), re.fullmatch(r"(.*?)_[2-9]", name)
        if last or (not first and name in bodies):
            continue
        axis = part.joints[0].axis if part.joints else _Z
        bodies[first[1] if first else name] = _Placed(part.frame[:3, 3], part.frame[:3, :3], axis)
    ends = {loop.name: loop.frame[:3, 3] for loop in scene.loops}
    points = {loop.name: loop.other_frame[:3, 3] for loop in scene.loops}
    return _Tree(scene.name, bodies, ends, points)


def _crank_in_plane(tree: _Tree, leg: str) -> dict[str, float]:
    crank = tree.bodies[f"{leg}_proximal"]
    return {
        **_links(tree, leg),
        **_coordinates("base", crank.position, "[R]RR"),
        "sensor_offset": float(np.arctan2(crank.rotation[1, 0], crank.rotation[0, 0])),
    }


def _slider_in_plane(tree: _Tree, leg: str) -> dict[str, float]:
    slider = tree.bodies[f"{leg}_slider"]
    angle = float(np.arctan2(slider.axis[1], slider.axis[0])) - np.pi / 2
    foot = float(slider.position @ [np.cos(angle), np.sin(angle), 0.0])
    return {
        "distal_length": float(np.linalg.norm(tree.ends[f"{leg}_end"])),
        "base_radius": foot,
        "base_angle": angle,
        "sensor_offset": float(slider.position @ slider.axis),
    }


def _strut(chain: str) -> Callable[[_Tree, str], dict[str, float]]:
    def parameters(tree: _Tree, leg: str) -> dict[str, float]:
        lower, upper = (tree.bodies[f"{leg}_{name}"] for name in ("lower", "upper"))
        own = _coordinates("base", lower.position, chain)
        if "axis_swing" in chain_info(chain).parameter_names:
            own |= _axis(lower.rotation[:, 2], own["base_azimuth"])
        return {**own, "sensor_offset": float(upper.position @ upper.axis)}

    return parameters


def _swinging_slider(tree: _Tree, leg: str) -> dict[str, float]:
    own = _slider(tree, leg)
    return own | _axis(tree.bodies[f"{leg}_distal"].rotation[:, 2], own["base_azimuth"])


def _axis(axis: Array, azimuth: float) -> dict[str, float]:
    """A joint's axis by its elevation and swing at an azimuth."""
    rho, tau = _level(azimuth)
    return {
        "axis_elevation": float(np.arctan2(axis[2], axis @ tau)),
        "axis_swing": float(np.arcsin(np.clip(axis @ rho, -1, 1))),
    }


def _slider(tree: _Tree, leg: str) -> dict[str, float]:
    slider = tree.bodies[f"{leg}_slider"]
    # To move the base point along its guide changes the offset alone: upright guides begin at 0.
    offset = slider.position[2] / slider.axis[2] if abs(slider.axis[2]) > 0.5 else 0.0
    base = _coordinates("base", slider.position - offset * slider.axis, "[P]US")
    rho, tau = _level(base["base_azimuth"])
    return {
        "distal_length": float(np.linalg.norm(tree.ends[f"{leg}_end"])),
        **base,
        "guide_elevation": float(np.arctan2(slider.axis[2], slider.axis @ rho)),
        "guide_swing": float(np.arcsin(np.clip(slider.axis @ tau, -1, 1))),
        "sensor_offset": float(offset),
    }


def _crank(tree: _Tree, leg: str) -> dict[str, float]:
    crank = tree.bodies[f"{leg}_proximal"]
    base = _coordinates("base", crank.position, "[R]US")
    rho, tau = _level(base["base_azimuth"])
    along, axis = crank.rotation[:, 0], crank.rotation[:, 2]
    angles = _axis(axis, base["base_azimuth"])
    elevation, swing = angles.values()
    start = np.cos(swing) * rho
    start = start - np.sin(swing) * (np.cos(elevation) * tau + np.sin(elevation) * _Z)
    return {
        **_links(tree, leg),
        **base,
        **angles,
        "sensor_offset": float(np.arctan2(along @ np.cross(axis, start), along @ start)),
    }


_LEGS: dict[str, Callable[[_Tree, str], dict[str, float]]] = {
    "[R]RR": _crank_in_plane,
    "[P]RR": _slider_in_plane,
    "R[P]R": _strut("R[P]R"),
    "U[P]S": _strut("U[P]S"),
    "[P]US": _slider,
    "[R]US": _crank,
    "R[P]S": _strut("R[P]S"),
    "[P]RS": _swinging_slider,
}


def _links(tree: _Tree, leg: str) -> dict[str, float]:
    """Lengths of crank and rod."""
    return {
        "proximal_length": float(np.linalg.norm(tree.bodies[f"{leg}_distal"].position)),
        "distal_length": float(np.linalg.norm(tree.ends[f"{leg}_end"])),
    }


def _coordinates(end: str, point: Array, chain: str) -> dict[str, float]:
    """A point as its chain gives it."""
    names = point_parameters(chain_info(chain), end)
    return {names[kind]: float(value) for kind, value in polar(point, names).items()}


def _level(azimuth: float) -> tuple[Array, Array]:
    """Radial and tangential unit vectors."""
    rho = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    return rho, np.cross(_Z, rho)


_MOST_BYTES = 10_000_000  # of a file: models have meshes beside them, not in them

_SAVED = "#*#"  # begins the lines that SAVE_CONFIG writes
_FULL_STEPS = 200.0


def _printer(path: Path) -> Imported:
    """Read a delta from Klipper's printer.cfg; what SAVE_CONFIG has written at its end counts."""
    config = _Config(path)
    kinematics = config.text("printer", "kinematics")
    if kinematics == "rotary_delta":
        return _rotary(config)
    if kinematics != "delta":
        raise config.error(
            "printer",
            "kinematics",
            f'is "{kinematics}"; symkin reads "delta" and "rotary_delta"',
        )
    radius = config.number("printer", "delta_radius", above=0.0)
    first = [
        config.number("stepper_a", name, above=0.0) for name in ("arm_length", "position_endstop")
    ]
    arms = np.array(
        [config.number(tower, "arm_length", first[0], above=radius) for tower in TOWERS]
    )
    heights = np.array(
        [config.number(tower, "position_endstop", first[1], above=0.0) for tower in TOWERS]
    )
    angles = [
        config.number(t, "angle", each) for t, each in zip(TOWERS, NOMINAL_DEGREES, strict=True)
    ]
    delta = LinearDelta(
        radius * 1e-3,
        np.radians(angles),
        arms * 1e-3,
        (heights + np.sqrt(arms**2 - radius**2)) * 1e-3,
        np.ones(3),
    )
    printed = config.number("printer", "print_radius", radius, above=0.0)
    notes = [*config.notes, ASSUMED]
    found = _records(config, "m")
    notes += found.notes
    mechanism = printer_of(
        path.stem,
        delta.legs((0.0, 0.0, 0.0)),
        workspace_of(delta, printed * 1e-3),
        few=found.are_few,
        rods=bool(found.distances),
    )
    return Imported(mechanism, found.measurements, tuple(notes))


def _rotary(config: _Config) -> Imported:
    """Read a rotary delta: its sensors read how far a crank has turned down from its endstop."""
    radius = config.number("printer", "shoulder_radius", above=0.0)
    height = config.number("printer", "shoulder_height", above=0.0)
    names = ("upper_arm_length", "lower_arm_length", "position_endstop")
    first = {each: config.number("stepper_a", each, above=0.0) for each in names}
    crank, rod, stop = (
        np.array([config.number(tower, each, first[each], above=0.0) for tower in TOWERS])
        for each in names
    )
    angles = [
        config.number(tower, "angle", each)
        for tower, each in zip(TOWERS, (30.0, 150.0, 270.0), strict=True)
    ]
    raised = _raised(config, radius, height - stop, crank, rod)
    legs = [
        Leg(
            "[R]US",
            {
                "proximal_length": float(crank[leg]) * 1e-3,
                "distal_length": float(rod[leg]) * 1e-3,
                "base_radius": radius * 1e-3,
                "base_azimuth": math.radians(angles[leg]),
                "base_height": height * 1e-3,
                "axis_azimuth": math.radians(angles[leg]),
                "axis_elevation": 0.0,
                "axis_swing": 0.0,
                "sensor_gain": 1.0,
                "sensor_offset": -float(raised[leg]),
            },
            working_mode=1,
        )
        for leg in range(3)
    ]
    reach = 0.5 * float(min(crank.min(), rod.min() - radius))
    top = float(stop.min())
    low = config.number("printer", "minimum_z_position", 0.0)
    if reach <= 0 or top <= low:
        raise SymkinError(
            f"{config.path}: cranks of {crank.min():g} mm and rods of {rod.min():g} mm leave no "
            "room to print"
        )
    box = WorkspaceSettings(
        (-reach * 1e-3, -reach * 1e-3, low * 1e-3),
        (reach * 1e-3, reach * 1e-3, top * 1e-3),
        home=(0.0, 0.0, (low + top) / 2e3),
        conditioning_limit=CONDITION,
    )
    found = _records(config, "rad")
    mechanism = printer_of(
        config.path.stem, legs, box, few=found.are_few, rods=bool(found.distances)
    )
    notes = [*config.notes, ASSUMED_OF_CRANKS, *found.notes]
    return Imported(mechanism, found.measurements, tuple(notes))


def _raised(config: _Config, radius: float, below: Array, crank: Array, rod: Array) -> Array:
    """Angles of cranks whose rods hold a nozzle in the middle, so far below the shoulders, rad."""
    # Elbows are outwards, where circles about the shoulder and the nozzle meet.
    away = np.hypot(radius, below)
    with np.errstate(invalid="ignore"):
        inner = np.arccos((crank**2 + away**2 - rod**2) / (2 * crank * away))
    raised = (np.arctan2(-below, -radius) + inner + np.pi) % (2 * np.pi) - np.pi
    if not np.isfinite(raised).all():
        tower = TOWERS[int(np.argmax(~np.isfinite(raised)))]
        raise config.error(
            tower, "position_endstop", "is a height that these arms do not reach in the middle"
        )
    return np.asarray(raised)


def _ways(config: _Config, steps: Sequence[Sequence[float]], unit: str) -> Array:
    """Ways from the endstops, which steps count downwards: to smaller heights, larger angles."""
    radians = unit == "rad"
    ways = np.array([_step(config, tower, radians=radians) for tower in TOWERS])
    ways *= 1.0 if radians else -1e-3
    return np.asarray(np.array(steps) * ways + 0.0)  # zero is no negative zero


class _Recorded(NamedTuple):
    """What Klipper kept of a bed and of printed objects."""

    measurements: Measurements | None
    heights: int
    distances: int
    notes: list[str]

    @property
    def are_few(self) -> bool:
        """Whether there are heights, and so few that they do not tell how well a probe repeats."""
        return self.measurements is not None and few_heights(self.heights)


def _records(config: _Config, unit: str) -> _Recorded:
    """What was probed, and what DELTA_ANALYZE was told: distances between two rows behind it."""
    section = "delta_calibrate"
    heights, steps = [], []
    for prefix in ("height", "manual_height"):
        for name in config.numbered(section, prefix):
            heights.append(config.number(section, name) * 1e-3)
            steps.append(config.triple(section, f"{name}_pos"))
    probed, lost = len(heights), 0
    rows: dict[tuple[float, ...], int] = {}  # of ends, each by where it is: a pillar is one
    pairs: dict[int, list[tuple[int, float]]] = {}  # of a row the earlier one, and how far it is
    for name in config.numbered(section, "distance"):
        if not config.has(section, f"{name}_pos1"):
            lost += 1
            continue
        ends = [config.triple(section, f"{name}_pos{end}") for end in (1, 2)]
        first, second = sorted(rows.setdefault(end, probed + len(rows)) for end in ends)
        if first == second:
            raise config.error(section, f"{name}_pos2", f"is where {name}_pos1 is; expected apart")
        away = config.number(section, name, above=0.0) * 1e-3
        pairs.setdefault(second, []).append((first, away))
    steps += rows
    count = sum(map(len, pairs.values()))
    notes = []
    if lost:
        notes.append(f"{lost} distances of printed objects are left out: they have no positions")
    if count:
        notes.append(
            f"{count} distances of printed objects are between two rows each, measured "
            f"with {CALIPER * 1e3:g} mm; with them the length of the rods is unknown, too"
        )
    if not steps:
        return _Recorded(None, 0, 0, notes)
    between: dict[str, Any] = {}
    if count:
        most = max(map(len, pairs.values()))
        partners = np.zeros((len(steps), most), dtype=np.intp)
        separations = np.full((len(steps), most), np.nan)
        for second, of in pairs.items():
            for k, (first, away) in enumerate(of):
                partners[second, k], separations[second, k] = first + 1, away
        between = {
            "partners": partners,
            "separations": separations,
            "separation_deviations": np.where(np.isnan(separations), np.nan, CALIPER),
        }
    if probed:
        between["heights"] = np.array([*heights, *[np.nan] * (len(steps) - probed)])
    measurements = Measurements.of(
        np.full((len(steps), 3), np.nan),
        _ways(config, steps, unit),
        pose_space="translating",
        reading_unit=unit,
        **between,
    )
    return _Recorded(measurements, probed, count, notes)


def _step(config: _Config, stepper: str, *, radians: bool = False) -> float:
    """Way of a carriage by one step of its motor, mm; of a crank its turn, rad."""
    if config.has(stepper, "step_distance"):  # before Klipper 0.10
        return config.number(stepper, "step_distance", above=0.0)
    whole = 2 * math.pi if radians else None
    turn = config.number(stepper, "rotation_distance", whole, above=0.0)
    steps = config.number(stepper, "full_steps_per_rotation", _FULL_STEPS, above=0.0)
    steps *= config.number(stepper, "microsteps", above=0.0)
    for pair in re.split(r"\s*,\s*", config.text(stepper, "gear_ratio", "1:1")):
        found = re.fullmatch(r"(\d+(?:\.\d*)?)\s*:\s*(\d+(?:\.\d*)?)", pair)
        if not found or min(map(float, found.groups())) <= 0:
            raise config.error(stepper, "gear_ratio", f'is "{pair}"; expected such as "80:16"')
        steps *= float(found[1]) / float(found[2])
    return turn / steps


class _Config:
    """A printer.cfg, the saved part over the rest; errors name file, section and option."""

    def __init__(self, path: Path) -> None:
        self.path = path
        data = file_bytes(path, lambda message: SymkinError(f"{path}: {message}"), _MOST_BYTES)
        lines = data.decode("utf-8", "replace").splitlines()
        saved = [line[len(_SAVED) :].strip() for line in lines if line.startswith(_SAVED)]
        own = [line for line in lines if not line.startswith(_SAVED)]
        begun = next((i for i, line in enumerate(saved) if line.startswith("[")), len(saved))
        self._parser = configparser.RawConfigParser(
            strict=False, inline_comment_prefixes=("#", ";"), allow_no_value=True
        )
        try:
            self._parser.read_string("\n".join(own), str(path))
            self._parser.read_string("\n".join(saved[begun:]), str(path))
        except configparser.Error as error:
            raise self._none(" ".join(str(error).split())) from error
        included = [name for name in self._parser.sections() if name.startswith("include ")]
        self.notes = [f"[{name}] was not read" for name in included]
        if not (included or self._parser.has_section("printer")):
            raise self._none("has no [printer]")

    def _none(self, reason: str) -> SymkinError:
        other = kind_of_file(self.path)
        if other:
            return SymkinError(
                f"{self.path}: is {other}; expected a printer.cfg, a model or a log. Tables and "
                "mechanism files need no import: symkin identify takes them"
            )
        return SymkinError(
            f"{self.path}: is not a printer.cfg: {reason}; expected a printer.cfg, a model (URDF, "
            "SDF or MJCF) or a log"
        )

    def error(self, section: str, option: str, message: str) -> SymkinError:
        """An error at an option."""
        return SymkinError(f"{self.path}: [{section}] {option}: {message}")

    def has(self, section: str, option: str) -> bool:
        """Whether an option is there."""
        return self._parser.has_option(section, option)

    def text(self, section: str, option: str, default: str | None = None) -> str:
        """An option's text."""
        if not self.has(section, option):
            if default is not None:
                return default
            included = f" ({'; '.join(self.notes)})" if self.notes else ""
            raise self.error(section, option, f"is missing{included}")
        return str(self._parser.get(section, option) or "").strip()

    def number(
        self, section: str, option: str, default: float | None = None, above: float | None = None
    ) -> float:
        """An option's number, mm or degrees."""
        text = self.text(section, option, None if default is None else repr(default))
        value = self._float(section, option, text)
        if above is not None and value <= above:
            raise self.error(section, option, f"is {value:g}; expected more than {above:g}")
        return value

    def triple(self, section: str, option: str) -> tuple[float, ...]:
        """Three numbers with commas between them."""
        parts = self.text(section, option).split(",")
        if len(parts) != len(TOWERS):
            raise self.error(section, option, f"has {len(parts)} numbers; expected {len(TOWERS)}")
        return tuple(self._float(section, option, part) for part in parts)

    def numbered(self, section: str, prefix: str) -> Iterator[str]:
        """Names of the options ``prefix0``, ``prefix1``, ... as far as there are any."""
        number = 0
        while self.has(section, f"{prefix}{number}"):
            yield f"{prefix}{number}"
            number += 1

    def _float(self, section: str, option: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(section, option, f'is "{text.strip()}"; expected a number')
        return value
