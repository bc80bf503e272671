# SPDX-License-Identifier: MIT
"""Legs, and what makes some of them those of one mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from symkin.chains import ChainInfo, FrozenMapping
from symkin.errors import MechanismError, did_you_mean

__all__ = ["Leg", "common_chain", "parameter_values"]


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


def common_chain(legs: Sequence[Leg]) -> str:
    """Return the chain of all legs."""
    if not legs:
        raise MechanismError("a mechanism needs legs; got none")
    for number, leg in enumerate(legs, 1):
        if leg.chain != legs[0].chain:
            raise MechanismError(
                f'leg {number} is a "{leg.chain}", leg 1 a "{legs[0].chain}"; expected one chain '
                "for all legs"
            )
    return legs[0].chain


def parameter_values(leg: Leg, info: ChainInfo, number: int) -> dict[str, float]:
    """Return the parameters of a leg (from 1, for messages) in the chain's order.

    A constant that was not given, such as the azimuth that a guide is described from, is that of
    the base point.
    """
    names = info.parameter_names
    for name in leg.parameters:
        if name not in names:
            raise MechanismError(
                f'leg {number}: "{name}" is no parameter of chain {leg.chain}'
                f"{did_you_mean(name, names)}"
            )
    missing = [name for name in names if name not in {*leg.parameters, *info.defaults}]
    if missing:
        raise MechanismError(f"leg {number}: {', '.join(missing)} missing")
    defaults = {name: leg.parameters[other] for name, other in info.defaults.items()}
    given = defaults | dict(leg.parameters)
    return {name: given[name] for name in names}


def _number(name: str, value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise MechanismError(f'"{name}" is {value!r}; expected a number') from None
