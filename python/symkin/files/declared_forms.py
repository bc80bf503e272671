# SPDX-License-Identifier: MIT
"""Shorter forms of files that declare their legs, written out as the others are.

``home`` as a table, a box of tilts, legs that a turn about any axis carries to each other, and a
planar dyad with several readings by its chain's name and parameters.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symkin.errors import SymkinError
from symkin.files.declared_parts import has_several_paths
from symkin.model.poses import PoseSpace, roll_pitch_yaw, rotations_from_vectors
from symkin.storage.quantities import evaluate_quantity
from symkin.storage.toml_file import TomlSource, WrongValueError, check_keys, quantity, read_at
from symkin.values import Array

_Values = dict[str, Any]
_DYAD = re.compile(r"(\[R\]|R)(\[R\]|R)(\[R\]|R)")
DYAD_KEYS = (
    "proximal_length", "distal_length", "base_radius", "base_angle", "platform_radius",
    "platform_angle", "home",
)  # fmt: skip
# The devices that measure so much.
_DEVICES = {
    "readings": "nothing (redundant encoders)",
}
_ROUNDING = 1e-12  # rad
_TURN = {"azimuth": "0 rad", "roll": "0 rad", "pitch": "0 rad", "yaw": "0 rad"}


def written_out(source: TomlSource) -> TomlSource:
    """Return a file with such forms written out, as far as they concern the legs."""
    values = dict(source.values)
    try:
        if "chains" not in values and _several_readings(values.get("chain")):
            values = _dyad(values)
        symmetry = values.get("symmetry")
        if "chains" in values:
            if isinstance(symmetry, dict) and isinstance(symmetry.get("axis"), list):
                values = _turned_legs(values, symmetry)
            values = _observed(values)
    except WrongValueError as error:
        raise source.error(error.keys, str(error)) from error
    except SymkinError as error:
        raise source.error(("reference_leg",), str(error)) from error
    if "chains" in values and values.get("schema") == 2 and values["schema"] is not True:
        values["schema"] = 1  # these forms came with it; files of either number may have them
    return dataclasses.replace(source, values=values)


def home_values(given: Mapping[str, Any], space: PoseSpace, free: Sequence[str]) -> list[Any]:
    """A home that is written as ``{ position = [...], phi = ... }`` as a list of coordinates.

    Angles that are left out are zero.
    """
    check_keys(given, ("position", *space.rotation), (), "home")
    place = given.get("position", [])
    if not isinstance(place, list) or len(place) != space.size:
        raise WrongValueError(
            f"is {place!r}; expected {', '.join(space.position)}", ("home", "position")
        )
    values = dict(zip(space.position, place, strict=True))
    values |= {name: given.get(name, 0.0) for name in space.rotation}
    return [values[name] for name in free]


def box_of(workspace: _Values, space: PoseSpace, free: Sequence[str] | None) -> _Values:
    """A workspace whose ``home`` may be a table, and whose turns a ``tilt`` may limit."""
    made = dict(workspace)
    home = made.get("home")
    if isinstance(home, dict):
        made["home"] = home_values(home, space, free or list(space.units))
    if "tilt" in made:
        if space.name != "spatial":
            raise WrongValueError("limits how a platform tilts in space", ("tilt",))
        for name in ("rx", "ry"):
            if name in made:
                raise WrongValueError(f"stands beside {name}; expected one of the two", ("tilt",))
        most = read_at("tilt", quantity("rad", "not negative"), made.pop("tilt"))
        made |= {"rx": [-most, most], "ry": [-most, most]}
        made.setdefault("rz", [0.0, 0.0])
    return made


def _several_readings(chain: Any) -> bool:
    return isinstance(chain, str) and chain.count("[") > 1 and bool(_DYAD.fullmatch(chain))


def _dyad(values: _Values) -> _Values:
    """A planar dyad with several readings, ``[R][R]R``, as a declared leg."""
    leg = values.get("reference_leg")
    if not isinstance(leg, dict):
        raise WrongValueError(
            "reads several joints of a leg; expected its dimensions in [reference_leg]", ("chain",)
        )
    check_keys(leg, DYAD_KEYS, DYAD_KEYS[:-1], "reference_leg")
    # The named chain counts the first link from x, the declared one from its base.
    home = leg.get("home", {})
    if isinstance(home, dict) and "q1" in home:
        home = dict(home)
        home["q1"] = math.remainder(_angle(home["q1"]) - _angle(leg["base_angle"]), 2 * math.pi)
    read = _DYAD.fullmatch(str(values["chain"]))
    assert read is not None  # or this is no dyad
    first, second, third = read.groups()
    path = [
        {"name": "base", "azimuth": leg["base_angle"], "x": leg["base_radius"]},
        f"q1: {first}",
        {"name": "proximal", "x": leg["proximal_length"]},
        f"q2: {second}",
        {"name": "distal", "x": leg["distal_length"]},
        f"q3: {third}",
        {"name": "platform", "azimuth": leg["platform_angle"], "x": leg["platform_radius"]},
    ]
    others = {name: each for name, each in values.items() if name not in ("chain", "reference_leg")}
    table = {"path": path, "home": home}
    return others | {"chain": "dyad", "chains": {"dyad": table}}


def _observed(values: _Values) -> _Values:
    """What [observation] says is measured, as a device; noise by the same names."""
    values = dict(values)
    noise = values.get("noise")
    if isinstance(noise, dict):
        noise = dict(noise)
        if "tilt" in noise:
            if "orientation" in noise:
                raise WrongValueError(
                    "stands beside orientation; expected one of the two", ("noise", "tilt")
                )
            noise["orientation"] = noise.pop("tilt")
        if isinstance(noise.get("reading"), dict):
            sizes = list(noise["reading"].values())
            if len(set(map(str, sizes))) != 1:
                told = ", ".join(map(str, sizes)) or "nothing"
                raise WrongValueError(
                    f"has {told} for the joints that are read; expected one noise of all readings "
                    "(a table of measurements may give each its own, in columns such as "
                    "psi_4_sd_rad)",
                    ("noise", "reading"),
                )
            noise["reading"] = sizes[0]
        values["noise"] = noise
    observation = values.pop("observation", None)
    if observation is None:
        return values
    if not isinstance(observation, dict):
        raise WrongValueError("is not a table; expected measured", ("observation",))
    check_keys(observation, ("measured", "datum"), (), "observation")
    measured = observation.get("measured")
    kind = _DEVICES.get(", ".join(map(str, measured if isinstance(measured, list) else [measured])))
    if kind is None:
        known = " or ".join(f'"{each}"' for each in _DEVICES)
        raise WrongValueError(
            f"is {measured!r}; expected {known}, or no [observation] where all of the pose is",
            ("observation", "measured"),
        )
    if "device" in values:
        raise WrongValueError("stands beside [device]; expected one of the two", ("observation",))
    values["device"] = {"kind": kind}
    datum = observation.get("datum", {})
    if not isinstance(datum, dict):
        raise WrongValueError(
            "is no table of lengths by legs; expected one", ("observation", "datum")
        )
    fixed = []
    for name, leg in datum.items():
        number = re.fullmatch(r"leg ([1-9][0-9]*)", leg) if isinstance(leg, str) else None
        if number is None:
            raise WrongValueError(
                f'is {leg!r}; expected such as "leg 1"', ("observation", "datum", name)
            )
        own = re.sub(r"_length$", "_x", name)  # of a dyad by its chain's name
        fixed.append(f"leg{number[1]}.{own}")
    settings = values.get("identification", {})
    if fixed and isinstance(settings, dict) and isinstance(settings.get("fixed", []), list):
        values["identification"] = settings | {"fixed": [*settings.get("fixed", []), *fixed]}
    return values


def _angle(raw: Any) -> float:
    return evaluate_quantity(raw, "rad", direction=True)


def _turned_legs(values: _Values, symmetry: _Values) -> _Values:
    """Legs that turns about an axis carry to each other, one by one, each turned as a whole."""
    axis = symmetry["axis"]
    if (
        len(axis) != 3
        or any(isinstance(each, bool) or not isinstance(each, int | float) for each in axis)
        or not np.linalg.norm(axis) > 0
    ):
        raise WrongValueError(
            f"is {axis}; expected an angle, or the direction x, y, z of an axis",
            ("symmetry", "axis"),
        )
    group = symmetry.get("group")
    number = re.fullmatch("C([1-9][0-9]?)", group) if isinstance(group, str) else None
    if number is None:
        raise WrongValueError(
            f'is {group!r}; expected turns about the axis, such as "C3"', ("symmetry", "group")
        )
    count = int(number[1])
    if symmetry.get("legs", count) != count:
        raise WrongValueError(
            f"is {symmetry['legs']}; group {group} carries one leg to {count}", ("symmetry", "legs")
        )
    if "legs" in values or "reference_legs" in values:
        raise WrongValueError(
            "turns one leg about an axis, but legs are listed; expected one of the two",
            ("symmetry", "axis"),
        )
    unit = np.array(axis, dtype=float) / np.linalg.norm(axis)
    leg = values.get("reference_leg", {})
    legs = []
    for each in range(count):
        turn = _roll_pitch_yaw(rotations_from_vectors(unit[None] * 2 * np.pi * each / count))
        legs.append({**leg, "turn": turn, "platform_turn": turn})
    tables = {
        name: _turnable(table) if isinstance(table, dict) else table
        for name, table in values["chains"].items()
    }
    others = {
        name: each for name, each in values.items() if name not in ("symmetry", "reference_leg")
    }
    return others | {"chains": tables, "legs": legs}


def _turnable(table: _Values) -> _Values:
    """A leg's table with a transform at either end that turns the whole leg."""
    path, made = list(table.get("path", [])), dict(table)
    of_platform = list(table.get("platform_path", []))
    own_path = "platform_path" not in table and "rods" not in table
    if own_path and path and isinstance(path[-1], dict):
        of_platform = [path.pop()]
    made["path"] = [{"name": "turn", **_TURN}, *path]
    made["platform_path"] = [{"name": "platform_turn", **_TURN}, *of_platform]
    if has_several_paths(path) or has_several_paths(of_platform):
        raise WrongValueError("turns a leg of one path; expected [[legs]]", ("symmetry", "axis"))
    known = {item.get("name") for item in path if isinstance(item, dict)}
    if "rods" in table and isinstance(table["rods"], list):
        made["rods"] = [
            {**rod, "from": "turn"}
            if isinstance(rod, dict) and rod.get("from", "base") == "base" and "base" not in known
            else rod
            for rod in table["rods"]
        ]
    return made


def _roll_pitch_yaw(turn: Array) -> dict[str, str]:
    """A turn (1, 3, 3) as one about z by yaw, then y by pitch, then x by roll."""
    return {
        name: f"{value if abs(value) > _ROUNDING else 0.0!r} rad"
        for name, value in zip(
            ("roll", "pitch", "yaw"), roll_pitch_yaw(turn)[0].tolist(), strict=True
        )
    }
