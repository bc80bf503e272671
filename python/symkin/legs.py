# SPDX-License-Identifier: MIT
"""Legs, and what makes some of them those of one mechanism."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from symkin.chains import ChainInfo, FrozenMapping
from symkin.errors import MechanismError, did_you_mean

__all__ = [
    "Leg",
    "chains_in_words",
    "common_reading_unit",
    "legs_in_words",
    "parameter_values",
    "require_mixable",
    "union_of_names",
]


@dataclass(frozen=True)
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


def chains_in_words(legs: Sequence[Leg]) -> str:
    """Return the chain of all legs, or how many there are of each: ``"2 [R]RR + 1 [P]RP"``."""
    counts = Counter(leg.chain for leg in legs)
    if len(counts) == 1:
        return legs[0].chain
    return " + ".join(f"{count} {chain}" for chain, count in counts.items())


def legs_in_words(legs: Sequence[Leg]) -> str:
    """Return their number and chains, ``"3 legs [R]RR"`` or ``"3 legs, 2 [R]RR + 1 [P]RP"``."""
    number = f"{len(legs)} leg{'' if len(legs) == 1 else 's'}"
    alike = len({leg.chain for leg in legs}) == 1
    return f"{number}{'' if alike else ','} {chains_in_words(legs)}"


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
    first = infos[0]
    for number, info in enumerate(infos, 1):
        if info.reading_unit != first.reading_unit:
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
