# SPDX-License-Identifier: MIT
"""Mechanisms read from other formats: printers, and the models that symkin writes."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from symkin.chains import Leg, chain_info
from symkin.drawing import point_parameters, polar
from symkin.errors import SymkinError
from symkin.exports.exported import MARK
from symkin.exports.printers import Imported, import_printer
from symkin.io.tables import file_bytes
from symkin.mechanism import Mechanism
from symkin.poses import rotations_from_vectors
from symkin.settings import WorkspaceSettings

__all__ = ["import_mechanism"]

Array = NDArray[np.float64]

_X, _Y, _Z = np.eye(3)
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


def import_mechanism(path: str | os.PathLike[str]) -> Imported:
    """Read a mechanism from Klipper's printer.cfg, or from an MJCF or URDF file of symkin.

    Of a model the geometry is read from bodies and joints, so it may have been changed there. What
    a tree cannot say (chain, working modes, gains, home) is in a comment that symkin writes; a
    model without it is refused, and so is SDF, which places bodies at home alone.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Imported

    Raises
    ------
    SymkinError
        Naming the file and what is missing.
    """
    path = Path(path)
    data = file_bytes(path, lambda message: SymkinError(f"{path}: {message}"))
    if not data.lstrip().startswith(b"<"):
        return import_printer(path)
    try:
        return _model(data.decode("utf-8"))
    except (ET.ParseError, UnicodeDecodeError) as error:
        raise SymkinError(f"{path}: is neither a printer.cfg nor XML: {error}") from error
    except SymkinError as error:
        raise SymkinError(f"{path}: {error}") from error
    except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
        raise SymkinError(f"{path}: is not as symkin writes such a model: {error!r}") from error


def _model(text: str) -> Imported:
    said = re.search(rf"<!-- {MARK} (\{{.*?\}}) -->", text)
    root = ET.fromstring(text)
    read: dict[str, Callable[[ET.Element, str], _Tree]] = {"mujoco": _mjcf, "robot": _urdf}
    if said is None or root.tag not in read:
        raise SymkinError(
            f'expected an MJCF or URDF file that symkin wrote, with a comment "{MARK} ..." above; '
            f"a parallel robot's chain cannot be told from <{root.tag}> alone"
        )
    known: dict[str, Any] = json.loads(said[1])
    tree = read[root.tag](root, text)
    chains, platform = known["chain"], known["platform"]
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
    far = max(float(np.linalg.norm(b.position)) for b in tree.bodies.values())
    size = _AROUND * np.array([far] * min(3, len(home)) + [1.0] * max(0, len(home) - 3))
    if (platform, len(home)) == ("rigid", 3):
        size[2] = _AROUND
    box = WorkspaceSettings(tuple(home - size), tuple(home + size), home=tuple(home))
    mechanism = Mechanism(
        tree.name, legs, platform=platform, reading_unit=known["reading_unit"], workspace=box
    )
    return Imported(mechanism, None, (_NOTE,))


def _mjcf(root: ET.Element, _text: str) -> _Tree:
    bodies: dict[str, _Placed] = {}
    sites: dict[str, Array] = {}
    for body in root.iter("body"):
        across = _numbers(body, "xyaxes").reshape(2, 3)
        turned = np.column_stack([*across, np.cross(*across)])
        joint = body.find("joint")
        axis = _Z if joint is None else _numbers(joint, "axis")
        bodies[body.attrib["name"]] = _Placed(_numbers(body, "pos"), turned, axis)
        sites |= {site.attrib["name"]: _numbers(site, "pos") for site in body.findall("site")}
    points = {
        name.removeprefix("platform_"): at for name, at in sites.items() if "platform" in name
    }
    return _Tree(root.attrib["model"], bodies, sites, points)


def _urdf(root: ET.Element, text: str) -> _Tree:
    bodies = {}
    for joint in root.findall("joint"):
        parts = {part.tag: part for part in joint}
        # The first joint of a body moves its first link, which places it.
        name = parts["child"].attrib["link"]
        first, last = re.fullmatch(r"(.*?)_1", name), re.fullmatch(r"(.*?)_[2-9]", name)
        if last or (not first and name in bodies):
            continue
        roll, pitch, yaw = _numbers(parts["origin"], "rpy")
        turned = _about(_Z, yaw) @ _about(_Y, pitch) @ _about(_X, roll)
        axis = _numbers(parts["axis"], "xyz") if "axis" in parts else _Z
        placed = _Placed(_numbers(parts["origin"], "xyz"), turned, axis)
        bodies[first[1] if first else name] = placed
    cut = r"cut joint (\w+), ball: point (\S+ \S+ \S+) of \w+ = point (\S+ \S+ \S+) of platform"
    found = [
        (name, np.array([*map(float, a.split())]), np.array([*map(float, b.split())]))
        for name, a, b in re.findall(cut, text)
    ]
    ends, points = ({f[0]: f[k] for f in found} for k in (1, 2))
    return _Tree(root.attrib["name"], bodies, ends, points)


# --- Parameters of a leg from its bodies ---


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
        upper = tree.bodies[f"{leg}_upper"]
        base = _coordinates("base", tree.bodies[f"{leg}_lower"].position, chain)
        return {**base, "sensor_offset": float(upper.position @ upper.axis)}

    return parameters


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
    swing = float(np.arcsin(np.clip(axis @ rho, -1, 1)))
    elevation = float(np.arctan2(axis[2], axis @ tau))
    start = np.cos(swing) * rho
    start = start - np.sin(swing) * (np.cos(elevation) * tau + np.sin(elevation) * _Z)
    return {
        **_links(tree, leg),
        **base,
        "axis_elevation": elevation,
        "axis_swing": swing,
        "sensor_offset": float(np.arctan2(along @ np.cross(axis, start), along @ start)),
    }


_LEGS: dict[str, Callable[[_Tree, str], dict[str, float]]] = {
    "[R]RR": _crank_in_plane,
    "[P]RR": _slider_in_plane,
    "R[P]R": _strut("R[P]R"),
    "U[P]S": _strut("U[P]S"),
    "[P]US": _slider,
    "[R]US": _crank,
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


def _about(axis: Array, angle: float) -> Array:
    return np.asarray(rotations_from_vectors((angle * axis)[None])[0])


def _numbers(element: ET.Element, name: str) -> Array:
    return np.array([float(each) for each in element.attrib[name].split()])
