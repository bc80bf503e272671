# SPDX-License-Identifier: MIT
"""A mechanism file to begin with, for any chain."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

from symkin.errors import MechanismError
from symkin.files.mechanism_writer import SCHEMA_LINE
from symkin.model.chains import ChainInfo, Leg, chain_info, require_mixable
from symkin.model.mechanism import Mechanism
from symkin.model.poses import POSE_SPACES
from symkin.model.settings import DeclaredSymmetry, WorkspaceSettings
from symkin.model.symmetry import generate_legs
from symkin.storage.quantities import evaluate_quantity
from symkin.storage.templates import templates_of
from symkin.storage.toml_file import toml_value

_TEMPLATES = Path(__file__).parent / "templates"
_SAME = 1e-9
_WORST = 15.0  # condition number at home, which the limit of the file must leave room
_LENGTH = 0.2  # m, that makes turns of mixed legs' platforms comparable with ways
_TURNS = range(0, 360, 30)  # degrees, of a chain's platform points
_MOST_ORDERS = 5000  # of legs in the ring, each of which is looked at
# Value and meaning; turned by 60 degrees against the base, no platform is singular at home.
_PARAMETERS = {
    "proximal_length": ('"0.4 m"', "link on the side of the base"),
    "distal_length": ('"0.4 m"', "link on the side of the platform"),
    "guide_offset": ('"0.03 m"', "distance of the guide from its pivot"),
    "pulley_radius": ('"20 mm"', "of the pulley that swivels about the vertical axis there"),
    "base_radius": ('"0.5 m"', "distance of the leg's base point from the origin"),
    "base_angle": ('"210 deg"', "azimuth of the base point"),
    "platform_radius": ('"0.12 m"', "distance of its platform point from the platform's origin"),
    "platform_angle": ('"270 deg"', "azimuth of the platform point, in the platform's frame"),
    "base_polar_angle": ('"90 deg"', "from Z: the base points lie in the plane of the base"),
    "base_azimuth": ('"200 deg"', "of the base point"),
    "base_height": ('"0 m"', "of the base point"),
    "guide_elevation": ('"90 deg"', "of the guide: 0 radial, 90 deg vertical"),
    "guide_swing": ('"0 deg"', "of the guide, to the side"),
    "axis_elevation": ('"0 deg"', "of the joint's axis: 0 tangential, 90 deg vertical"),
    "axis_swing": ('"0 deg"', "of the joint's axis, outwards"),
    "platform_polar_angle": ('"90 deg"', "from the platform's Z"),
    "platform_azimuth": ('"154 deg"', "of the platform point, in the platform's frame"),
    "platform_height": ('"0 m"', "of the platform point, in the platform's frame"),
    "proximal_arc": ('"90 deg"', "link on the side of the base, between the axes of its joints"),
    "distal_arc": ('"90 deg"', "link on the side of the platform"),
    "sensor_gain": ("1", "active joint per sensor reading; -1 for a sensor that counts down"),
    "sensor_offset": ("0", "active joint at the sensor's zero"),
}
_BASE_GUIDE = {
    "base_radius": ('"0.2 m"', "distance of the guide from the origin"),
    "base_angle": ('"210 deg"', "azimuth of the guide's normal"),
}
_PLATFORM_GUIDE = {
    "platform_radius": ('"0 m"', "distance of the platform's guide from the platform's origin"),
    "platform_angle": ('"275 deg"', "azimuth of the guide's normal, in the platform's frame"),
}
_SPATIAL = {"base_radius": '"0.4 m"', "platform_radius": '"0.2 m"'}
# What suits single chains in space.
_OF_CHAIN: dict[tuple[str, str], dict[str, str]] = {
    ("[P]US", "translating"): {"base_radius": '"0.25 m"'},
    ("[P]US", "spatial"): {
        "distal_length": '"1 m"',
        "base_radius": '"0.5 m"',
        "base_azimuth": '"202 deg"',
        "platform_radius": '"0.1 m"',
        "platform_azimuth": '"167 deg"',
    },
    ("[R]US", "translating"): {
        "proximal_length": '"0.2 m"',
        "distal_length": '"0.5 m"',
        "base_radius": '"0.1 m"',
    },
    ("[R]US", "spatial"): {
        "proximal_length": '"0.1 m"',
        "distal_length": '"0.62 m"',
        "base_radius": '"0.32 m"',
        "base_azimuth": '"234.5 deg"',
        "axis_swing": '"-65.5 deg"',
        "platform_radius": '"0.2 m"',
        "platform_azimuth": '"255 deg"',
        "sensor_offset": '"180 deg"',
    },
    ("R[P]S", "spatial"): {
        "base_radius": '"0.3 m"',
        "base_azimuth": '"210 deg"',
        "platform_radius": '"0.3 m"',
        "platform_azimuth": '"210 deg"',
    },
    ("[P]RS", "spatial"): {
        "distal_length": '"0.7 m"',
        "base_radius": '"0.3 m"',
        "base_azimuth": '"210 deg"',
        "guide_elevation": '"0 deg"',
        "platform_radius": '"0.3 m"',
        "platform_azimuth": '"210 deg"',
    },
}
# Axes of the joints, through the centre about which a spherical platform turns.
_AXES = {
    "base_polar_angle": ('"54.7356 deg"', "of the base joint's axis from Z"),
    "base_azimuth": ('"0 deg"', "of the base joint's axis"),
    "platform_polar_angle": ('"54.7356 deg"', "of the platform joint's axis from the platform's Z"),
    "platform_azimuth": ('"120 deg"', "of the platform joint's axis, in the platform's frame"),
}
_PLANE = {"x": '["-0.1 m", "0.1 m"]', "y": '["-0.1 m", "0.1 m"]'}
_TILT = '["-10 deg", "10 deg"]'
_BOXES = {
    "planar": _PLANE | {"phi": '["-20 deg", "20 deg"]'},
    "point": _PLANE,
    "spatial": _PLANE | {"z": '["0.4 m", "0.6 m"]', "rx": _TILT, "ry": _TILT, "rz": _TILT},
    "translating": _PLANE | {"z": '["0.4 m", "0.6 m"]'},
    "spherical": dict.fromkeys(("rx", "ry", "rz"), '["-25 deg", "25 deg"]'),
}
_HEIGHT = "0.5 m"  # of home in space
# A slider stands above its rod, or outside the platform; the cranks hang the platform below them,
# or carry it.
_MODES = {"[P]US": -1, "[P]RS": -1}
_HANGING = {"z": '["-0.5 m", "-0.4 m"]'}, "-0.45 m"
_LITTLE = '["-0.03 m", "0.03 m"]', '["-5 deg", "5 deg"]'
_CARRIED = (
    {"x": _LITTLE[0], "y": _LITTLE[0], "z": '["0.56 m", "0.62 m"]'}
    | dict.fromkeys(("rx", "ry", "rz"), _LITTLE[1]),
    "0.59 m",
)


class _LegText(NamedTuple):
    """What a file says of a leg: value and meaning of each parameter."""

    info: ChainInfo
    mode: int
    texts: Mapping[str, tuple[str, str]]


def mechanism_template(chain: str, legs: int | None = None, platform: str = "rigid") -> str:
    """Return the text of a mechanism file to begin with.

    It describes a mechanism that has a workspace, with symmetrical legs, so that every command
    works on it before a dimension is changed. Legs of several chains are listed one by one.

    Parameters
    ----------
    chain : str
        Such as ``"[R]RR"``; `chains` lists them. Or several with how many legs have each,
        ``"2 [R]RR + 1 [P]RP"``, as `Mechanism.chain` says it.
    legs : int, optional
        By default as few as the platform needs. Several chains say it themselves.
    platform : {"rigid", "point", "translating", "spherical", "schoenflies"}
        A platform that turns, a point that only moves in the plane, one that moves in space and
        never turns, or one that only turns.

    Raises
    ------
    SymkinError
        For an unknown chain, or a number of legs that the platform does not go with.
    """
    counted = _counted(chain)
    if len(counted) == 1:
        (only, given), *_ = counted.items()
        if legs is not None and given is not None and legs != given:
            raise MechanismError(f'"{chain}" has {given} legs, not {legs}')
        return _symmetric_template(only, given if legs is None else legs, platform)
    if legs is not None:
        raise MechanismError(f'"{chain}" says how many legs there are; expected no other number')
    return _mixed_template({name: count or 1 for name, count in counted.items()}, platform)


def _counted(chain: str) -> dict[str, int | None]:
    """Chains with their numbers of legs, None where none is said."""
    found: dict[str, int | None] = {}
    for part in map(str.strip, chain.split("+")):
        number = re.match("[0-9]{1,2} +", part)
        name = part if number is None else part[number.end() :]
        if name in found:
            raise MechanismError(f'"{chain}" names {name} twice; expected once')
        found[name] = None if number is None else int(number[0])
    return found


def _symmetric_template(chain: str, legs: int | None, platform: str) -> str:
    info = chain_info(chain, platform)
    pose_space = info.pose_space
    space = POSE_SPACES[pose_space]
    legs = _checked(legs, info)
    no_radius = space.moves and not any(name.endswith("_radius") for name in info.parameter_names)
    if no_radius and legs % 2 == 0 and legs > 2:
        raise MechanismError(
            f"{legs} legs {chain}: two of them would be the same; expected 2 or an odd number"
        )
    symmetry, axis, carried = _symmetry(info, legs)
    described = _LegText(info, _mode(info), _texts(info))
    mirror = {"symmetry": symmetry, "axis": axis, "carried": carried, "count": legs}
    return _file([described], info.reading_unit, chain=chain, **mirror)


def _mixed_template(counts: Mapping[str, int], platform: str) -> str:
    """Legs in a ring; where each chain stands, and how its platform points, suits home best."""
    infos = [chain_info(chain, platform) for chain, count in counts.items() for _ in range(count)]
    require_mixable(infos)
    number = _checked(len(infos), infos[0])
    unit = infos[0].reading_unit
    if any(info.reading_unit != unit for info in infos):
        unit = "rad"
    orders = math.factorial(number) // math.prod(map(math.factorial, counts.values()))
    if orders > _MOST_ORDERS:
        raise MechanismError(
            f"there are too many ways to place {number} legs of {' and '.join(counts)}: begin with "
            "fewer, and add to the [[legs]]"
        )
    symmetry, _, _ = _symmetry(infos[0], number)
    texts = {info.name: _mixed_texts(info, unit) for info in infos}
    given = {info.name: _values(info, unit, texts[info.name]) for info in infos}
    rings = {
        (chain, turn): generate_legs(
            _turned(chain_info(chain, platform), given[chain], turn), symmetry, number
        )
        for chain in counts
        for turn in _TURNS
    }
    chains = [info.name for info in infos]
    best, least = None, math.inf
    for places in _orders([*counts.values()], range(number)):
        for turn in _TURNS:
            legs = [
                rings[chain, turn if chain != chains[0] else 0][place]
                for chain, place in zip(chains, places, strict=True)
            ]
            condition = _condition(legs, infos, platform, unit)
            if condition < least * (1 - _SAME):
                best, least = legs, condition
    if best is None or least > _WORST:
        raise MechanismError(
            f"there is no file to begin with for {' and '.join(counts)} together: begin with that "
            "of one chain, list the [[legs]], and give each its chain"
        )
    described = []
    for leg, info in zip(best, infos, strict=True):
        own = dict(texts[info.name])
        for name, value in given[info.name].items():
            found, of = leg.parameters[name], info.units_of_sensor(unit)[name]
            if abs(found - value) > _SAME:  # an angle, or what a reflection turns round
                said = f'"{math.degrees(found):.6g} deg"' if of == "rad" else f"{found!r}"
                own[name] = (said, own[name][1])
        described.append(_LegText(info, leg.working_mode, own))
    return _file(described, unit, chain="", symmetry=None)


def _orders(counts: Sequence[int], places: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """All ways to give each chain so many places of the ring: those of the first, of the next."""
    if not counts:
        yield ()
        return
    for own in combinations(places, counts[0]):
        left = [place for place in places if place not in own]
        for others in _orders(counts[1:], left):
            yield (*own, *others)


def _mixed_texts(info: ChainInfo, unit: str) -> dict[str, tuple[str, str]]:
    texts = _texts(info)
    if info.reading_unit != unit:
        texts["sensor_gain"] = ('"5 mm/rev"', "pitch of the screw that the motor turns")
    return texts


def _values(info: ChainInfo, unit: str, texts: Mapping[str, tuple[str, str]]) -> dict[str, float]:
    units = info.units_of_sensor(unit)
    return {
        name: evaluate_quantity(text.strip('"'), units[name], direction=units[name] == "rad")
        for name, (text, _) in texts.items()
    }


def _turned(info: ChainInfo, values: Mapping[str, float], degrees: float) -> Leg:
    """The first leg of a chain with its platform point, or guide, turned."""
    kinds = ("azimuth", "direction_azimuth")
    turned = {
        name: values[name] + math.radians(degrees)
        for name, role in info.parameter_roles.items()
        if role.end == "platform" and role.kind in kinds
    }
    return Leg(info.name, {**values, **turned}, _mode(info))


def _condition(legs: Sequence[Leg], infos: Sequence[ChainInfo], platform: str, unit: str) -> float:
    """The condition number at home; infinite where home is out of reach."""
    _, height = _common_box(infos)
    at = dict.fromkeys(infos[0].box, 0.0)
    if "z" in at:
        at["z"] = evaluate_quantity(height, "m")
    home = infos[0].whole([*at.values()])
    workspace = WorkspaceSettings(home, home, characteristic_length=_LENGTH)
    robot = Mechanism("ring", legs, platform=platform, reading_unit=unit, workspace=workspace)
    found = float(robot.singularity_measures(robot.poses_at(home))[2][0])
    return found if math.isfinite(found) else math.inf


def _checked(legs: int | None, info: ChainInfo) -> int:
    """The number of legs, by default the least."""
    least = len(info.free)
    space = POSE_SPACES[info.pose_space]
    most = least if (space.size == 3 and space.turns) or info.closures > 1 else 64
    legs = least if legs is None else legs
    if not least <= legs <= most:
        expected = str(least) if least == most else f"{least} to {most}"
        two = legs == 2 and info.pose_space == "planar"
        hint = '; two hold a "point" (--platform), as in a five-bar' if two else ""
        raise MechanismError(
            f"{legs} legs for a {info.pose_space} platform; expected {expected}{hint}"
        )
    return legs


def _symmetry(info: ChainInfo, legs: int) -> tuple[DeclaredSymmetry, str, str]:
    """What carries a leg to as many, what the file says of its axis, and how it does."""
    space = POSE_SPACES[info.pose_space]
    if space.size == 3 and space.turns and info.closures == 1:
        return (
            DeclaredSymmetry("D3", math.radians(210)),
            '"210 deg"  # of the mirror between legs 1 and 2',
            "by turns and reflections, in mirrored pairs",
        )
    if legs == 2:
        mirror = DeclaredSymmetry("D1", math.radians(90))
        return mirror, '"90 deg"  # of the mirror', "by a reflection"
    return DeclaredSymmetry(f"C{legs}"), "", f"by turns of 360/{legs} degrees"


def _texts(info: ChainInfo) -> dict[str, tuple[str, str]]:
    """Value and meaning of each parameter of the first leg, but for those with a default."""
    joints = info.name.replace("[", "").replace("]", "")
    space = POSE_SPACES[info.pose_space]
    known = _PARAMETERS | (_BASE_GUIDE if joints[0] == "P" else {})
    known |= _PLATFORM_GUIDE if joints[-1] == "P" else {}
    known |= {} if space.moves else _AXES
    special = (_SPATIAL if space.in_space else {}) | _OF_CHAIN.get((info.name, info.pose_space), {})
    known |= {name: (value, known[name][1]) for name, value in special.items()}
    return {name: known[name] for name in info.parameter_names if name not in info.defaults}


def _mode(info: ChainInfo) -> int:
    return _MODES.get(info.name, 1) if POSE_SPACES[info.pose_space].moves else -1


def _box(info: ChainInfo) -> tuple[dict[str, str], str]:
    """Limits of the coordinates that can be chosen, and the height of home."""
    box, height = {name: _BOXES[info.pose_space][name] for name in info.box}, _HEIGHT
    if info.name == "[R]US":
        other, height = _CARRIED if POSE_SPACES[info.pose_space].turns else _HANGING
        box = box | other
    if info.name == "[P]RS":
        box, height = box | {"z": '["0.42 m", "0.6 m"]'}, "0.52 m"
    return box, height


def _common_box(infos: Sequence[ChainInfo]) -> tuple[dict[str, str], str]:
    """That of one chain, or what the boxes of several have in common."""
    boxes = [_box(info) for info in infos]
    if len({info.name for info in infos}) == 1:
        return boxes[0]
    found = {}
    middle = 0.0
    for name, unit in infos[0].box.items():
        sides = [tomllib.loads(f"sides = {box[name]}")["sides"] for box, _ in boxes]
        lower = max((each[0] for each in sides), key=lambda text: evaluate_quantity(text, unit))
        upper = min((each[1] for each in sides), key=lambda text: evaluate_quantity(text, unit))
        if evaluate_quantity(lower, unit) >= evaluate_quantity(upper, unit):
            chains = " and ".join(dict.fromkeys(info.name for info in infos))
            raise MechanismError(f"there is no file to begin with for {chains} together")
        found[name] = toml_value([lower, upper])
        if name == "z":
            middle = (evaluate_quantity(lower, unit) + evaluate_quantity(upper, unit)) / 2
    return found, f"{middle:g} m"


def _file(legs: Sequence[_LegText], reading_unit: str, **described: Any) -> str:
    """The whole: what is at the top, the legs, and the settings that suit them."""
    infos = [leg.info for leg in legs]
    info = infos[0]
    space = POSE_SPACES[info.pose_space]
    box, height = _common_box(infos)
    home = ""
    if space.size == 3:
        at = dict(zip(space.units, ["0 m", "0 m", height] + ["0 deg"] * 3, strict=False))
        home = toml_value([at[name] for name in info.box])
    mixed = len({each.name for each in infos}) > 1
    text = (
        templates_of(_TEMPLATES)
        .get_template("mechanism.toml")
        .render(
            schema_line=SCHEMA_LINE,
            platform=info.platform,
            reading_unit=reading_unit,
            legs=legs,
            box=box,
            home=home,
            length=_LENGTH if space.turns and mixed else None,
            moves=space.moves,
            identified=max(_identified(each) for each in infos),
            **described,
        )
    )
    return f"{text}\n"


def _identified(info: ChainInfo) -> int:
    """How many parameters of a leg are; no mechanism has one leg alone."""
    leg = _turned(info, _values(info, info.reading_unit, _texts(info)), 0.0)
    legs = [leg] * (POSE_SPACES[info.pose_space].dof // info.closures)
    return Mechanism("leg", legs, platform=info.platform).estimated_counts[0]
