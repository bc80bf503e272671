# SPDX-License-Identifier: MIT
"""Chains that a file declares joint by joint: what the core is told of them, kept by their names.

The name of such a chain says what is declared: it ends in a digest of it. So the same declaration
is the same chain wherever it is read, and a leg that travels to another process takes it along.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from symkin import _core
from symkin.values import record

_MARK = "@"


@record
class DeclaredChain:
    """A declared chain: a leg of which one joint is read.

    Of a leg with several joints that are read there is a chain for each: the same joints, the
    others of which turn freely. Where legs bind the platform, and are not all alike with one
    reading each, there is one for each closure that has no reading, too: then all joints turn
    freely. Together they have the closures that the leg has.
    """

    table_name: str  # as the file calls its table
    # The joint that is read, where it is not the only chain of the leg; of a closure without a
    # reading ``closure_1`` and so on.
    reading: str
    pose_space: str  # kind of the poses
    # What the core is told, in lists and plain values; see ``_core.Declaration``. A scalar is
    # [name, transform, slot, end, kind, held, uses], and a use, where else it stands, [kind, index,
    # slot, factor]: in another transform, or as a joint's ratio.
    joints: list[list[Any]]
    transforms: list[list[float]]
    loops: list[list[Any]]
    scalars: list[list[Any]]
    # The branch: a row of a pose array, and there the joints that stand by themselves.
    home_pose: list[float]
    home_joints: list[float]
    free: list[int]  # coordinates that can be chosen where legs bind the platform
    nominal: dict[str, float]  # the drawn value of every parameter but the sensor's
    exact: list[str]  # parameters that are held because the file says so
    table: dict[str, Any]  # the declaration as the file has it, with what was found filled in
    recognise: bool = True  # whether it is computed as a known chain where it is one
    closure: int = -1  # which closure of the leg it is; -1 for all that it has

    @property
    def label(self) -> str:
        """What a file calls it."""
        return f"{self.table_name}.{self.reading}" if self.reading else self.table_name

    @property
    def name(self) -> str:
        """The name of the chain."""
        return f"{self.label}{_MARK}{self._digest()}"

    @property
    def leg(self) -> str:
        """What all chains of one leg have in common."""
        return f"{self.table_name}{_MARK}{dataclasses.replace(self.unread(), closure=-1)._digest()}"

    @property
    def read(self) -> bool:
        """Whether a sensor reads one of its joints."""
        return any(joint[2] for joint in self.joints)

    def unread(self) -> DeclaredChain:
        """The same without a reading."""
        joints = [[kind, axis, False, *rest] for kind, axis, _, *rest in self.joints]
        return dataclasses.replace(self, joints=joints)

    def _digest(self) -> str:
        told = {**vars(self), "table_name": "", "reading": "", "table": {}}
        if self.closure < 0:
            del told["closure"]
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:8]

    def numbers_with(
        self, parameters: Mapping[str, float]
    ) -> tuple[list[list[float]], list[float]]:
        """The numbers of all transforms, and the ratios of all joints, of a leg."""
        numbers = [list(each) for each in self.transforms]
        ratios = [float(joint[4]) for joint in self.joints]
        for name, transform, slot, *_, uses in self.scalars:
            value = parameters[name]
            numbers[transform][slot] = value
            for kind, index, of, factor in uses:
                if kind == "joint":
                    ratios[index] = factor * value
                else:
                    numbers[index][of] = factor * value
        return numbers, ratios

    def core(self) -> _core.Declaration:
        """What the core is told."""
        scalars = [
            (
                *(name, transform, slot, _core.End[end], _core.ParameterKind[kind], held),
                list(map(tuple, uses)),
            )
            for name, transform, slot, end, kind, held, uses in self.scalars
        ]
        return _core.Declaration(
            self.name,
            self.pose_space,
            [tuple(each) for each in self.joints],
            self.transforms,
            [tuple(each) for each in self.loops],
            scalars,
            self.home_pose,
            self.home_joints,
            self.free,
            self.recognise,
            self.closure,
        )


_CHAINS: dict[str, DeclaredChain] = {}


def declare(chain: DeclaredChain) -> str:
    """Make a declaration a chain, and return its name.

    Raises
    ------
    SymkinError
        Where the leg does not close at home, or cannot be identified by one reading.
    """
    name = chain.name
    if name not in _CHAINS:
        _core.declare_chain(chain.core())
        _CHAINS[name] = chain
    return name


def declared_chain(name: str) -> DeclaredChain | None:
    """Return the declaration of a chain; None of those that symkin knows by itself."""
    return _CHAINS.get(name)


def label_of(name: str) -> str:
    """Return what a file calls a chain."""
    return name.partition(_MARK)[0] if name in _CHAINS else name


def readings_of_legs(chains: Sequence[str]) -> tuple[tuple[int, ...], ...]:
    """Which chains of a mechanism are one leg, each for itself where a leg has one chain alone.

    The first that reads a joint goes with the first that reads another joint of such a leg, and so
    on.
    """
    legs: dict[tuple[str, int], list[int]] = {}
    seen: Counter[str] = Counter()
    for number, chain in enumerate(chains):
        declared = declared_chain(chain)
        several = declared is not None and declared.reading
        whole = declared.leg if declared is not None and several else str(number)
        legs.setdefault((whole, seen[chain] if several else 0), []).append(number)
        seen[chain] += 1
    return tuple(map(tuple, legs.values()))
