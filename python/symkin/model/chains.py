# SPDX-License-Identifier: MIT
"""The kinematic chains that symkin knows, and the legs of one mechanism."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, get_args

import numpy as np

from symkin import _core
from symkin.errors import MechanismError, did_you_mean, one_of
from symkin.model.declared import (
    DeclaredChain,
    declare,
    declared_chain,
    label_of,
    readings_of_legs,
)
from symkin.model.poses import POSE_SPACES
from symkin.options import Platform, checks
from symkin.values import Array, FrozenMapping, record

# Of a sensor that is no straight line, in the order of `Mechanism.curvature`.
CURVATURE_TERMS = ("sensor_quadratic", "sensor_cosine", "sensor_sine")
PLATFORMS: tuple[Platform, ...] = get_args(Platform)


_CONSTANTS = (
    "guide_azimuth",
    "axis_azimuth",
    "written_turn",
    "mirrored_written_turn",
    "frame_roll",
    "frame_pitch",
    "frame_yaw",
    "handedness",
    "absent",
)


class ParameterRole(NamedTuple):
    """What a parameter is, by which symmetry acts on it.

    Attributes
    ----------
    end : {"base", "platform", "none"}
        The end of the leg in whose frame it is given; none for links and sensor.
    kind : str
        "length", "arc" or "eccentricity" of a link; "radius", "azimuth", "polar_angle" or "height"
        of a point; "azimuth" and "polar_angle" of an axis through the centre; "direction_azimuth"
        or "direction_distance" of a guide in the plane; "guide_elevation" and "guide_swing", or
        "axis_elevation" and "axis_swing", of a direction in space, and the "guide_azimuth" or
        "axis_azimuth" that it is given from;
        "pulley_radius" of a cable; "coordinate" and "small_turn" of a declared transform, and its
        "written_turn", each ``mirrored_`` where a mirror changes the sign; "frame_roll",
        "frame_pitch" and "frame_yaw" of the frame that a declared end begins with, behind its
        "axis_azimuth"; the "handedness" of a declared leg; "gain" or "offset" of the sensor;
        "absent" where mixed legs have the parameter and this one does not.
    """

    end: str
    kind: str

    @property
    def is_constant(self) -> bool:
        """Whether it belongs to the description, or is absent, and is never estimated."""
        return self.kind in _CONSTANTS

    @property
    def is_given(self) -> bool:
        """Whether it is taken as it is given, unless somebody frees it."""
        return self.kind == "pulley_radius"

    @property
    def of_sensor(self) -> bool:
        """Whether the sensor has it, and not the leg's geometry."""
        return self.kind in ("gain", "offset")


ABSENT = ParameterRole("none", "absent")


def platform_of(pose_space: str) -> str:
    """What has such poses, one of `PLATFORMS`."""
    return {"planar": "rigid", "spatial": "rigid"}.get(pose_space, pose_space)


@record
class ChainInfo:
    """A chain: its parameters, in the order of every array of parameters, and what it reads.

    Attributes
    ----------
    name : str
        Joints from base to platform, the actuated one in brackets.
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses, see `Mechanism`.
    parameter_names : tuple of str
        Of the leg's geometry, then of its sensor.
    parameter_units : mapping of str to str
        "m", "rad" or "1" of each parameter, for a sensor that reads in the joint's own unit.
    parameter_roles : mapping of str to ParameterRole
        What each of them is, whatever its name.
    reading_unit : {"rad", "m"}
        Unit of the active joint.
    description : str
        What the sign of the working mode means.
    closures : int
        Equations that a leg brings. One shows the reading; more of them bind the platform.
    free : tuple of int
        Which of the coordinates of bounds (see `PoseSpace.units`) can be chosen: of a platform that
        the legs bind z and the two tilts, and all of any other.
    runs_as : str
        The known chain that a declared leg is, as which it is computed; empty if it is none.
    read : bool
        Whether a sensor reads it. Readings of legs without one are zero and in no table.
    """

    name: str
    pose_space: str
    parameter_names: tuple[str, ...]
    parameter_units: Mapping[str, str]
    parameter_roles: Mapping[str, ParameterRole]
    reading_unit: str
    description: str
    closures: int
    free: tuple[int, ...]
    runs_as: str = ""
    read: bool = True

    @property
    def platform(self) -> str:
        """What it carries, one of `PLATFORMS`."""
        return platform_of(self.pose_space)

    @property
    def declared(self) -> bool:
        """Whether a file declares it joint by joint."""
        return any(role.kind == "handedness" for role in self.parameter_roles.values())

    @property
    def box(self) -> dict[str, str]:
        """The coordinates of a workspace's box, with their units: those that can be chosen."""
        units = list(POSE_SPACES[self.pose_space].units.items())
        return dict(units[each] for each in self.free)

    def whole(self, chosen: Sequence[float]) -> tuple[float, ...]:
        """All coordinates by those of the `box`; zero for those that the legs bind."""
        values = [0.0] * POSE_SPACES[self.pose_space].dof
        for place, value in zip(self.free, chosen, strict=True):
            values[place] = value
        return tuple(values)

    @property
    def signed_radius(self) -> bool:
        """Whether a point's radius may be negative, being the base's less the platform's."""
        return self.pose_space == "translating"

    @functools.cached_property
    def defaults(self) -> Mapping[str, str]:
        """Parameters that may be left out, and the parameter whose value they then have."""
        constants = [name for name, role in self.parameter_roles.items() if role.is_constant]
        if self.declared:  # whose file fills in what is drawn
            return FrozenMapping({})
        return FrozenMapping(dict.fromkeys(constants, "base_azimuth"))

    def units_of_sensor(self, reading_unit: str) -> dict[str, str]:
        """Units of the parameters for a sensor that reads "rad" or "m", whatever its joint does.

        The gain converts a reading to the active joint's unit: a plain number, or "m/rad" for a
        motor that winds a cable.
        """
        gain = "1" if reading_unit == self.reading_unit else f"{self.reading_unit}/{reading_unit}"
        return {**self.parameter_units, "sensor_gain": gain}


@checks()
@functools.cache
def chain_info(chain: str, platform: Platform = "rigid") -> ChainInfo:
    """Describe a chain.

    Parameters
    ----------
    chain : str
        Such as ``"[R]RR"``.
    platform : {"rigid", "point", "translating", "spherical", "schoenflies"}
        A platform that turns, a point that only moves in the plane (five-bar), one that moves in
        space and never turns (delta), or one that only turns, about a fixed point (Agile Eye).

    Raises
    ------
    SymkinError
        For an unknown chain, with the nearest known one, or one that cannot carry the platform.
    """
    one_of("platform", platform, PLATFORMS)
    info = _core.chain_info(chain, platform)
    joint_unit = "rad" if info.reads_angle else "m"
    roles = {each.name: ParameterRole(each.end.name, each.kind.name) for each in info.parameters}
    units = {each.name: "rad" if info.is_angular(each) else "m" for each in info.parameters}
    pure = ("gain", "handedness")
    units |= {name: "1" for name, role in roles.items() if role.kind in pure}
    return ChainInfo(
        name=info.name,
        pose_space=info.pose_space,
        parameter_names=tuple(units),
        parameter_units=FrozenMapping(units),
        parameter_roles=FrozenMapping(roles),
        reading_unit=joint_unit,
        description=info.working_mode,
        closures=info.closures,
        free=tuple(info.free_coordinates),
        runs_as=info.runs_as,
        read=info.read,
    )


@checks()
def chains(platform: Platform = "rigid") -> list[str]:
    """Return the names of the chains that can carry a platform, one of `PLATFORMS`."""
    one_of("platform", platform, PLATFORMS)
    return list(_core.chain_names(platform))


def shortest(differences: Array, turn: float | None) -> Array:
    """Differences of readings by the shortest turn; of lengths, whose `turn` is None, as given."""
    if turn is None:
        return differences
    return np.asarray(differences - turn * np.round(differences / turn))


@record
class Leg:
    """One leg.

    Attributes
    ----------
    chain : str
        Joints from base to platform, the actuated one in brackets, such as ``"[R]RR"``.
    parameters : mapping of str to float
        By name, m and rad; `symkin.chain_info` lists them.
    working_mode : {-1, 1}
        Which root of the closure; `ChainInfo.description` says what the sign means.
    """

    chain: str
    parameters: Mapping[str, float]
    working_mode: int = -1

    def __post_init__(self) -> None:
        """Keep what the mapping holds now."""
        values = {str(name): _number(name, value) for name, value in self.parameters.items()}
        object.__setattr__(self, "parameters", FrozenMapping(values))
        object.__setattr__(self, "working_mode", int(self.working_mode))

    @property
    def arguments(self) -> dict[str, Any]:
        """What a copy needs: of a declared chain the declaration, for another process."""
        declared = declared_chain(self.chain)
        return vars(self) | ({"declared": declared} if declared else {})

    @classmethod
    def of_arguments(cls, *, declared: DeclaredChain | None = None, **fields: Any) -> Leg:
        """Return the leg of such a copy."""
        if declared is not None:
            declare(declared)
        return cls(**fields)

    def __reduce__(self) -> tuple[Any, ...]:
        """Take the declaration along."""
        return functools.partial(Leg.of_arguments, **self.arguments), ()


def chains_in_words(legs: Sequence[Leg]) -> str:
    """Return the chain of all legs, or how many there are of each: ``"2 [R]RR + 1 [P]RP"``.

    Closures without a reading are told where they are all of a leg, once.
    """
    chains = [leg.chain for leg in legs]
    groups = readings_of_legs(chains)
    counts = Counter(
        _label_in_words(chains[each])
        for group in groups
        for each in group
        if each == group[0] or _is_read(chains[each])
    )
    if len(counts) == 1:
        return next(iter(counts))
    return " + ".join(f"{count} {chain}" for chain, count in counts.items())


def _is_read(chain: str) -> bool:
    declared = declared_chain(chain)
    return declared is None or bool(declared.read)


def _label_in_words(chain: str) -> str:
    if _is_read(chain):
        return label_of(chain)
    return f"{label_of(chain).rpartition('.')[0]} without a reading"


def legs_in_words(legs: Sequence[Leg]) -> str:
    """Return their number and chains, ``"3 legs [R]RR"`` or ``"3 legs, 2 [R]RR + 1 [P]RP"``."""
    alike = len({leg.chain for leg in legs}) == 1
    return f"{legs_counted(legs)}{'' if alike else ','} {chains_in_words(legs)}"


def legs_counted(legs: Sequence[Leg]) -> str:
    """Return their number, ``"3 legs"``, and how often these are read if that is not once each."""
    count = len(readings_of_legs([leg.chain for leg in legs]))
    readings = sum(_is_read(leg.chain) for leg in legs)
    read = f" with {readings} readings" if count < len(legs) else ""
    return f"{count} leg{'' if count == 1 else 's'}{read}"


def union_of_names(infos: Sequence[ChainInfo]) -> tuple[str, ...]:
    """Return the parameters that any of the legs has, those of the sensor last."""
    names = dict.fromkeys(name for info in infos for name in info.parameter_names)
    sensor = [name for name, role in infos[0].parameter_roles.items() if role.of_sensor]
    return (*(name for name in names if name not in sensor), *sensor)


def require_mixable(infos: Sequence[ChainInfo], noun: str = "leg") -> None:
    """Refuse legs that cannot carry one platform together; the noun is for messages.

    Raises
    ------
    MechanismError
        For legs of different pose spaces, and for mixed ones that bind the platform.
    """
    first = infos[0]
    for number, info in enumerate(infos, 1):
        if info.pose_space != first.pose_space:
            raise MechanismError(
                f"{noun} {number} ({info.name}) carries a {info.pose_space} platform, {noun} 1 "
                f"({first.name}) a {first.pose_space} one; expected one kind of platform"
            )
        if info.name != first.name and max(info.closures, first.closures) > 1:
            raise MechanismError(
                f"{noun} {number} is a {info.name}, {noun} 1 a {first.name}; legs that bind the "
                "platform are not mixed with others"
            )


def common_reading_unit(infos: Sequence[ChainInfo], noun: str = "leg") -> str:
    """Return the unit of all active joints; the noun is for messages.

    Raises
    ------
    MechanismError
        If some are angles and some lengths, so that somebody must say what the sensors read.
    """
    first = next((each for each in infos if each.read), infos[0])
    for number, info in enumerate(infos, 1):
        if info.read and info.reading_unit != first.reading_unit:
            raise MechanismError(
                f"the joint that is read is in {first.reading_unit} in {noun} 1 ({first.name}) and "
                f"in {info.reading_unit} in {noun} {number} ({info.name}); expected reading_unit, "
                'the one unit of all sensors: "rad", say, if all are motors, and then the '
                "sensor_gain of a leg whose joint slides is in m/rad"
            )
    return first.reading_unit


def parameter_values(leg: Leg, info: ChainInfo, number: int) -> dict[str, float]:
    """Return the parameters of a leg (from 1, for messages) in the chain's order.

    A constant that was not given, such as the azimuth that a guide is described from, is that of
    the base point.
    """
    given, names, defaults = dict(leg.parameters), info.parameter_names, info.defaults
    for name in given:
        if name not in names:
            raise MechanismError(
                f'leg {number}: "{name}" is no parameter of chain {leg.chain}'
                f"{did_you_mean(name, names)}"
            )
    missing = [name for name in names if name not in given and name not in defaults]
    if missing:
        raise MechanismError(f"leg {number}: {', '.join(missing)} missing")
    return {name: given[name if name in given else defaults[name]] for name in names}


def _number(name: str, value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise MechanismError(f'"{name}" is {value!r}; expected a number') from None
