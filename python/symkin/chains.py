# SPDX-License-Identifier: MIT
"""The kinematic chains that symkin knows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from symkin import _core

__all__ = ["ChainInfo", "ParameterRole", "chain_info", "chains"]


class ParameterRole(NamedTuple):
    """What a parameter is, by which symmetry acts on it.

    Attributes
    ----------
    end : {"base", "platform", "none"}
        The end of the leg in whose frame it is given; none for links and sensor.
    kind : str
        "length" or "eccentricity" of a link; "radius", "azimuth" or "polar_angle" of a point;
        "direction_azimuth" or "direction_distance" of a guide; "gain" or "offset" of the sensor.
    """

    end: str
    kind: str

    @property
    def of_sensor(self) -> bool:
        """Whether the sensor has it, and not the leg's geometry."""
        return self.kind in ("gain", "offset")


@dataclass(frozen=True)
class ChainInfo:
    """A chain: its parameters, in the order of every array of parameters, and what it reads.

    Attributes
    ----------
    name : str
        Joints from base to platform, the actuated one in brackets.
    pose_space : {"planar", "point", "spatial"}
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
    """

    name: str
    pose_space: str
    parameter_names: tuple[str, ...]
    parameter_units: Mapping[str, str]
    parameter_roles: Mapping[str, ParameterRole]
    reading_unit: str
    description: str

    def units_of_sensor(self, reading_unit: str) -> dict[str, str]:
        """Units of the parameters for a sensor that reads "rad" or "m", whatever its joint does.

        The gain converts a reading to the active joint's unit: a plain number, or "m/rad" for a
        motor that winds a cable.
        """
        gain = "1" if reading_unit == self.reading_unit else f"{self.reading_unit}/{reading_unit}"
        return {**self.parameter_units, "sensor_gain": gain}


@cache
def chain_info(chain: str, platform: str = "rigid") -> ChainInfo:
    """Describe a chain.

    Parameters
    ----------
    chain : str
        Such as ``"[R]RR"``.
    platform : {"rigid", "point"}
        A platform that turns, or a point that only moves (five-bar).

    Returns
    -------
    ChainInfo

    Raises
    ------
    SymkinError
        For an unknown chain, with the nearest known one, or one that cannot carry the platform.
    """
    info = _core.chain_info(chain, platform)
    joint_unit = "rad" if info.reads_angle else "m"
    roles = {each.name: ParameterRole(each.end.name, each.kind.name) for each in info.parameters}
    units = {each.name: "rad" if info.is_angular(each) else "m" for each in info.parameters}
    units |= {name: "1" for name, role in roles.items() if role.kind == "gain"}
    return ChainInfo(
        name=info.name,
        pose_space=info.pose_space,
        parameter_names=tuple(units),
        parameter_units=units,
        parameter_roles=roles,
        reading_unit=joint_unit,
        description=info.working_mode,
    )


def chains(platform: str = "rigid") -> list[str]:
    """Return the names of the chains that can carry a platform ("rigid" or "point").

    Returns
    -------
    list of str
    """
    return list(_core.chain_names(platform))
