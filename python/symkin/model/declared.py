# SPDX-License-Identifier: MIT
"""Chains that a file declares joint by joint: what the core is told of them, kept by their names.

The name of such a chain says what is declared: it ends in a digest of it. So the same declaration
is the same chain wherever it is read, and a leg that travels to another process takes it along.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from symkin import _core

__all__ = ["DeclaredChain", "declare", "declared_chain", "label_of"]

_MARK = "@"


@dataclass(frozen=True)
class DeclaredChain:
    """A declared chain.

    Attributes
    ----------
    label : str
        As the file calls it.
    pose_space : str
        Kind of the poses.
    joints, transforms, loops, scalars : list
        What the core is told, in lists and plain values; see ``_core.Declaration``. A scalar is
        [name, transform, slot, end, kind, held].
    home_pose, home_joints : list of float
        The branch: a row of a pose array, and there the joints that stand by themselves.
    free : list of int
        Coordinates that can be chosen where legs bind the platform.
    nominal : dict of str to float
        The drawn value of every parameter but the sensor's.
    exact : list of str
        Parameters that are held because the file says so.
    table : dict
        The declaration as the file has it, with what was found filled in.
    """

    label: str
    pose_space: str
    joints: list[list[Any]]
    transforms: list[list[float]]
    loops: list[list[Any]]
    scalars: list[list[Any]]
    home_pose: list[float]
    home_joints: list[float]
    free: list[int]
    nominal: dict[str, float]
    exact: list[str]
    table: dict[str, Any]

    @property
    def name(self) -> str:
        """The name of the chain."""
        told = {**vars(self), "label": "", "table": {}}
        digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
        return f"{self.label}{_MARK}{digest[:8]}"

    def core(self) -> _core.Declaration:
        """What the core is told."""
        scalars = [
            (name, transform, slot, _core.End[end], _core.ParameterKind[kind], held)
            for name, transform, slot, end, kind, held in self.scalars
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


def declare_again(fields: Mapping[str, Any]) -> None:
    """Make a chain of a declaration that another process or a copy brings along."""
    declare(DeclaredChain(**fields))


def label_of(name: str) -> str:
    """Return what a file calls a chain."""
    return name.partition(_MARK)[0] if name in _CHAINS else name
