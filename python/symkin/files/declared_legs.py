# SPDX-License-Identifier: MIT
"""Reading legs that a mechanism file declares joint by joint, ``[chains.NAME]``."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symkin import _core
from symkin.errors import SymkinError, did_you_mean, one_of
from symkin.files.declared_forms import box_of, home_values, written_out
from symkin.files.declared_parts import (
    LegBuilder,
    has_several_paths,
    stays_in_plane,
    transform_matrix,
    turn_about_z,
)
from symkin.model.declared import DeclaredChain, declare, declared_chain
from symkin.model.poses import (
    POSE_SPACES,
    coordinates_of,
    poses_from_bounds,
    transforms,
)
from symkin.storage.quantities import evaluate_quantity
from symkin.storage.toml_file import (
    KeyPath,
    Kind,
    TomlSource,
    WrongValueError,
    check_keys,
    choice,
    list_of,
    read_at,
)
from symkin.values import Array

_Values = dict[str, Any]

PARTS = ("path", "platform_path", "rods", "loops")
_KEYS = (*PARTS, "closes", "home", "pose", "free")
SECTIONS_OF_LEGS = ("reference_leg", "reference_legs", "legs")
# What ends of a path compare, by what a file says and whether the leg stays in the plane.
_COMPARES = {
    ("pose", False): "pose",
    ("point", False): "point",
    ("rotation", False): "rotation",
    ("pose", True): "planar pose",
    ("point", True): "planar point",
}
_WHERE = ("planar", "spatial")  # a rigid platform moves
_CLOSES = {
    "spatial": "pose",
    "planar": "pose",
    "point": "point",
    "translating": "point",
    "schoenflies": "point",
}


def with_declared_chains(source: TomlSource) -> TomlSource:
    """Return a file with the chains that it declares by name, and legs with all parameters."""
    source = written_out(source)
    tables = source.values.get("chains")
    if tables is None:
        return source
    if not isinstance(tables, dict) or not tables:
        raise source.error(("chains",), "is no table of chains; expected [chains.NAME]")
    values = {name: each for name, each in source.values.items() if name != "chains"}
    workspace = values.get("workspace")
    free = workspace.get("free") if isinstance(workspace, dict) else None
    if isinstance(workspace, dict):
        values["workspace"] = {name: each for name, each in workspace.items() if name != "free"}
    alone = len(_labels_of_legs(values)) < 2
    names: dict[str, tuple[str, ...]] = {}
    written: dict[KeyPath, KeyPath] = {}
    space = None
    for label in tables:
        place = ("chains", label)
        try:
            given = tables[label]
            if isinstance(given, dict) and free is not None:
                given = {"free": free, **given}
            readings = declared_leg(label, given, values, alone=alone)
            names[label] = tuple(map(declare, readings))
            names |= {each.label: (each.name,) for each in readings if each.reading}
            space = POSE_SPACES[readings[0].pose_space]
        except WrongValueError as error:
            said_above = error.keys[:1] == ("free",) and "free" not in tables[label]
            above: KeyPath = ("workspace",) if said_above else place
            raise source.error((*above, *error.keys), str(error)) from error
        except SymkinError as error:
            raise source.error(place, str(error)) from error
    if values.get("platform") in _WHERE:
        del values["platform"]  # which the legs say
    if space is not None and isinstance(values.get("workspace"), dict):
        try:
            values["workspace"] = box_of(values["workspace"], space, free)
        except WrongValueError as error:
            raise source.error(("workspace", *error.keys), str(error)) from error
    for key, chain in _chains_of_legs(values):
        if chain not in names and "[" not in chain:  # as known chains have
            raise source.error(key, f"is {chain!r}; expected {' or '.join(tables)}")
    default = names.get(str(values.get("chain")), ())
    if len(default) == 1:
        values["chain"] = default[0]
    elif default:
        del values["chain"]
    if not any(section in values for section in SECTIONS_OF_LEGS):
        values["reference_leg"] = {}
    for section in SECTIONS_OF_LEGS:
        given = values.get(section)
        legs = [given] if isinstance(given, dict) else given
        if not isinstance(legs, list):
            continue
        read, places = _with_readings(legs, names, default)
        if isinstance(given, dict) and len(read) == 1:
            values[section] = read[0]
            written |= _written((section,), (section,), given, places[0][1])
            continue
        del values[section]
        into = "reference_legs" if section == "reference_leg" else section
        values[into] = read
        for row, (number, joint) in enumerate(places):
            own: KeyPath = (section,) if isinstance(given, dict) else (section, number)
            written |= _written((into, row), own, legs[number], joint)
        symmetry = values.get("symmetry")
        if isinstance(symmetry, dict) and len(read) > len(legs):
            values["symmetry"] = _with_count(symmetry, len(legs), len(read), section)
    return dataclasses.replace(source, values=values, written=written)


def _chains_of_legs(values: _Values) -> list[tuple[KeyPath, str]]:
    """Where a file says of which chain legs are, and what it says."""
    found: list[tuple[KeyPath, Any]] = [(("chain",), values.get("chain"))]
    for section in SECTIONS_OF_LEGS:
        given = values.get(section)
        if isinstance(given, dict):
            found.append(((section, "chain"), given.get("chain")))
        for number, leg in enumerate(given if isinstance(given, list) else ()):
            if isinstance(leg, dict):
                found.append(((section, number, "chain"), leg.get("chain")))
    return [(place, chain) for place, chain in found if isinstance(chain, str)]


def _labels_of_legs(values: _Values) -> set[str]:
    """What legs of a file are called."""
    given = [values[section] for section in SECTIONS_OF_LEGS if section in values]
    legs = [leg for each in given for leg in (each if isinstance(each, list) else [each])]
    default = str(values.get("chain"))
    return {str(leg.get("chain", default)) for leg in legs if isinstance(leg, dict)}


def _with_readings(
    legs: list[Any], names: Mapping[str, tuple[str, ...]], default: tuple[str, ...]
) -> tuple[list[Any], list[tuple[int, str]]]:
    """Legs' tables with all drawn values; a leg with several chains once for each of them.

    The first readings of all legs stand before the second, closures without a reading behind them
    all, leg by leg. And of each which leg it is, from 0, and which joint it reads.
    """
    chains = [
        names.get(str(leg.get("chain")), () if "chain" in leg else default)
        if isinstance(leg, dict)
        else ()
        for leg in legs
    ]
    own = [[_is_read(chain) for chain in of_leg] or [True] for of_leg in chains]
    rows = [
        (not is_read, leg if not is_read else number, leg, number)
        for leg, of_leg in enumerate(own)
        for number, is_read in enumerate(of_leg)
    ]
    read, places = [], []
    for *_, place, number in sorted(rows):
        leg, of_leg = legs[place], chains[place]
        stands_out = "chain" in leg or len(of_leg) > 1
        read.append(_filled(leg, of_leg, number, own=stands_out) if of_leg else leg)
        declared = declared_chain(of_leg[number]) if of_leg else None
        places.append((place, declared.reading if declared else ""))
    return read, places


def _is_read(chain: str) -> bool:
    declared = declared_chain(chain)
    return declared is None or declared.read


def _written(read: KeyPath, own: KeyPath, leg: Any, joint: str) -> dict[KeyPath, KeyPath]:
    """Where a file has the values of a leg that is read so."""
    found: dict[KeyPath, KeyPath] = {read: own}
    for name, value in leg.items() if isinstance(leg, dict) else ():
        if isinstance(value, dict) and "value" not in value:
            if name.startswith("sensor_") and joint in value:
                found[*read, name] = (*own, name, joint)
            else:
                found |= {(*read, f"{name}_{each}"): (*own, name, each) for each in value}
    return found


def _with_count(symmetry: _Values, legs: int, readings: int, section: str) -> _Values:
    """The symmetry with the number of readings for that of legs, where each has as many."""
    count = symmetry.get("legs")
    if not isinstance(count, int):
        return symmetry
    others = {name: value for name, value in symmetry.items() if name != "legs"}
    if section == "legs":
        return others if count == legs else symmetry
    return others | ({"legs": count * readings // legs} if readings % legs == 0 else {})


def _filled(leg: _Values, chains: Sequence[str], reading: int, *, own: bool) -> _Values:
    """A leg's table with the drawn values that it does not change, for one of its readings."""
    declared = [each for each in map(declared_chain, chains) if each is not None]
    joints = [each.reading for each in declared]
    given: _Values = {"sensor_gain": 1.0, "sensor_offset": 0.0, **declared[reading].nominal}
    for name, value in leg.items():
        if name.startswith("sensor_") and not declared[reading].read:
            continue
        if not isinstance(value, dict) or "value" in value:
            given[name] = value
        elif name.startswith("sensor_") and {*value} <= {*joints}:
            given[name] = value.get(joints[reading], given[name])
        else:
            given |= _flat(name, value)
    if own:
        given["chain"] = chains[reading]
    return given


def _flat(name: str, value: Any) -> _Values:
    """The numbers of a transform, or of the transforms of a rod, by their names in results."""
    if not isinstance(value, dict) or "value" in value:
        return {name: value}
    parts = (_flat(f"{name}_{each}", number) for each, number in value.items())
    return {key: number for part in parts for key, number in part.items()}


def declared_leg(
    label: str, table: Any, file: _Values, *, alone: bool = True
) -> list[DeclaredChain]:
    """The chains of a table: one for each joint that is read, and closure without a reading.

    Where all legs are of it `alone`, and one joint is read, that chain has all closures.
    """
    if not isinstance(table, dict):
        raise WrongValueError("is not a table; expected path, rods, home")
    check_keys(table, _KEYS)
    parts = [table.get(key, []) for key in PARTS]
    planar = stays_in_plane(parts)
    pose_space = _pose_space(file.get("platform", "rigid"), planar)
    if pose_space not in POSE_SPACES:
        raise SymkinError(f"platform {pose_space!r} is none that legs are declared for")
    space = POSE_SPACES[pose_space]
    if space.size == 2 and not planar:
        raise WrongValueError("leaves the plane, in which the platform moves", ("path",))
    builder = LegBuilder(planar=planar, turn=space.rotation[0] if space.has_angle else "")
    builder.read_path(table.get("path", []), whole="platform_path" in table or "rods" in table)
    builder.read_platform_path(table.get("platform_path", []))
    rods = table.get("rods", [])
    several = any(has_several_paths(table.get(key)) for key in ("path", "platform_path"))
    if several and "closes" in table:
        raise WrongValueError("of several paths none closes by itself", ("closes",))
    if several and builder.aimed:
        raise WrongValueError("has aim, which is for a leg of one path", ("path",))
    if several and not rods and not table.get("loops"):
        raise WrongValueError(
            "are several paths, of which none closes by itself; expected rods or loops, too",
            ("path",),
        )
    of_path = "" if rods or several else _CLOSES.get(pose_space, "rotation")
    closes = table.get("closes", of_path)
    if builder.ends_in_ball:
        closes = "point"
    if closes:
        one_of("closes", closes, ("pose", "point", "rotation"))
        if (closes, space.size == 2) not in _COMPARES:
            raise WrongValueError("a leg in the plane closes on a pose or a point", ("closes",))
        builder.close(_COMPARES[closes, space.size == 2])
    planar = space.size == 2
    read_at("rods", list_of(Kind(builder.read_rod, {})), rods)
    of_loop = Kind(lambda raw: builder.read_loop(raw, planar=planar), {})
    read_at("loops", list_of(of_loop), table.get("loops", []))
    home_pose = _home_pose(table, file, pose_space)
    _aim(builder, pose_space, home_pose)
    return _chain(label, table, builder, pose_space, home_pose, alone=alone)


def _pose_space(platform: str, planar: bool) -> str:
    if platform == "rigid":
        return "planar" if planar else "spatial"
    return str(platform)


def _free(table: _Values, pose_space: str) -> list[str]:
    """The coordinates of the pose that can be chosen."""
    names = list_of(choice(*POSE_SPACES[pose_space].units))
    return list(read_at("free", names, table.get("free", [])))


def _home_pose(table: _Values, file: _Values, pose_space: str) -> list[float]:
    """The pose at which the joints have the values of home, a row of a pose array."""
    space = POSE_SPACES[pose_space]
    given = table.get("pose")
    if given is None:
        workspace = file.get("workspace")
        given = workspace.get("home") if isinstance(workspace, dict) else None
    if given is None:
        values = [0.0] * space.dof
    else:
        units = space.units
        free = _free(table, pose_space) or list(units)
        if isinstance(given, dict):
            given = home_values(given, space, free)
        whole = isinstance(given, list) and len(given) == space.dof
        names = list(units) if whole else list(free)
        if not isinstance(given, list):
            raise WrongValueError(f"home is {given!r}; expected {', '.join(names)}")
        if len(given) != len(names):
            raise WrongValueError(f"home has {len(given)} values; expected {', '.join(names)}")
        found = {}
        for name, each in zip(names, given, strict=True):
            try:
                found[name] = evaluate_quantity(each, units[name], direction=units[name] == "rad")
            except SymkinError as error:
                what = (
                    f"{name} of the workspace's home" if "pose" not in table else f"{name} of pose"
                )
                raise WrongValueError(f"{what} ({', '.join(names)}): {error}") from error
        values = [found.get(name, 0.0) for name in units]
    return [float(each) for each in poses_from_bounds(pose_space, values)]


def _aim(builder: LegBuilder, pose_space: str, home_pose: list[float]) -> None:
    """Turn the transforms with ``aim`` so that their z runs from base to platform at home."""
    if not builder.aimed:
        return
    motion = transforms(pose_space, np.array([home_pose]))
    rotation, position = motion.rotation[0], motion.translation[0]
    left = np.eye(4)
    for kind, index in builder.left_steps:
        if kind == "joint":
            break
        left = left @ transform_matrix(builder.values[index])
    right = np.eye(4)
    for kind, index in builder.right_steps:
        if kind == "transform":
            right = right @ transform_matrix(builder.values[index])
    start, end = left[:3, 3], rotation @ right[:3, 3] + position
    along = (end - start) / np.linalg.norm(end - start)
    for index in builder.aimed:
        values = builder.values[index]
        first = turn_about_z(values["azimuth"])
        on_platform = builder.is_of_platform(index)
        seen = first.T @ (rotation.T @ along if on_platform else along)
        values["roll"] = float(-np.arcsin(seen[1]))
        values["pitch"] = float(np.arctan2(seen[0], seen[2]))
        builder.write_turn(index, "roll")
        builder.write_turn(index, "pitch")


def _chain(
    label: str,
    table: _Values,
    builder: LegBuilder,
    pose_space: str,
    home_pose: list[float],
    *,
    alone: bool,
) -> list[DeclaredChain]:
    scalars, nominal, exact = builder.scalars()
    own = builder.own_joints
    start, known = _home_joints(table.get("home", {}), builder)
    read = [each for each in own if builder.joints[each][2]]
    units = list(POSE_SPACES[pose_space].units)
    chain = DeclaredChain(
        label,
        "",
        pose_space,
        [list(each) for each in builder.joints],
        [builder.numbers(each) for each in range(len(builder.values))],
        builder.loops,
        scalars,
        home_pose,
        start,
        sorted(units.index(each) for each in _free(table, pose_space)),
        nominal | {"hand": 1.0},
        exact,
        {},
    )
    found = _joints_at_home(chain, builder, known)
    home_joints = [float(each) for each in found]
    home = dict(zip(builder.own_names, home_joints, strict=True))
    written = {**builder.written(table), "home": home, "pose": _bounds(pose_space, home_pose)}
    chain = dataclasses.replace(chain, home_joints=home_joints, table=written)
    binding = 0 if alone and len(read) == 1 else _core.binding_closures(chain.core())
    if not read and not binding:
        raise WrongValueError(
            "has no joint in brackets; expected one that is read, since the leg binds nothing",
            ("path",),
        )
    chains = [chain]
    if binding or len(read) > 1:
        chains = [_reading(chain, each, builder.names[each]) for each in read]
    for each in chains if len(read) > 1 else ():
        if _core.binding_closures(each.core(), passive=True) < 1:
            others = " and ".join(builder.names[joint] for joint in read)
            raise WrongValueError(
                f"reads {others}, but has so many joints that the others meet all equations of its "
                f"loops without {each.reading}: it shows nothing by itself; expected fewer joints",
                ("path",),
            )
    if binding:
        chains = [dataclasses.replace(each, closure=0) for each in chains]
        chains += [
            dataclasses.replace(chain.unread(), reading=f"closure_{each + 1}", closure=each)
            for each in range(binding)
        ]
    redundant = _core.redundant_scalars([each.core() for each in chains])
    held = [
        [*each[:5], each[5] or shown, each[6]]
        for each, shown in zip(scalars, redundant, strict=True)
    ]
    return [dataclasses.replace(each, scalars=held) for each in chains]


def _joints_at_home(chain: DeclaredChain, builder: LegBuilder, known: list[bool]) -> Array:
    """Joint values that close the leg near those that are known; if none do, names others."""
    try:
        return _core.joints_at_home(chain.core(), known)
    except SymkinError as error:
        if not any(known):
            raise
        try:
            other = _core.joints_at_home(chain.core(), [False] * len(known))
        except SymkinError:
            raise SymkinError(f"{error}, nor any others") from error
        told = [
            f'{name} = "{math.degrees(value):.4g} deg"'
            if builder.joints[index][0] == "R"
            else f'{name} = "{value:.4g} m"'
            for name, index, value in zip(
                builder.own_names, builder.own_joints, other.tolist(), strict=True
            )
        ]
        raise WrongValueError(f"{error}; others do: {', '.join(told)}", ("home",)) from error


def _reading(chain: DeclaredChain, joint: int, name: str) -> DeclaredChain:
    """The chain with one joint that is read; the others that are turn freely."""
    joints = [
        [kind, axis, index == joint, *rest]
        for index, (kind, axis, _, *rest) in enumerate(chain.joints)
    ]
    return dataclasses.replace(chain, reading=name, joints=joints)


def _bounds(pose_space: str, pose: list[float]) -> list[float]:
    """A pose as position and angle or rotation vector."""
    coordinates = coordinates_of(pose_space, transforms(pose_space, np.array([pose])))
    return [float(each) for each in coordinates[0]]


def _home_joints(given: Any, builder: LegBuilder) -> tuple[list[float], list[bool]]:
    """Where joints are sought, and which of them the file has given."""
    if not isinstance(given, dict):
        raise WrongValueError("is not a table of joints; expected one", ("home",))
    for name in given:
        if name not in builder.own_names:
            raise WrongValueError(
                f"no joint of that name{did_you_mean(name, builder.own_names)}", ("home", name)
            )
    start, known = [], []
    for name, index in zip(builder.own_names, builder.own_joints, strict=True):
        unit = "rad" if builder.joints[index][0] == "R" else "m"
        try:
            start.append(evaluate_quantity(given.get(name, 0.0), unit, direction=unit == "rad"))
        except SymkinError as error:
            raise WrongValueError(str(error), ("home", name)) from error
        known.append(name in given)
    return start, known
