# SPDX-License-Identifier: MIT
"""What of an unknown target frame counts where only its place, or only its turn, is observed."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES, Observable
from symkin.model.poses import PoseSpace

_FURTHER = [each for each in OBSERVABLES.values() if "target" in each.frames and not each.is_pose]


class TargetSeen(NamedTuple):
    """Whether any observation depends on where the target is, and on how it is turned."""

    placed: bool
    turned: bool

    @classmethod
    def by(cls, kinds: Collection[str]) -> TargetSeen:
        """Of kinds of observation, as the option `observe` calls them."""
        further = [each for each in _FURTHER if {*each.words} & {*kinds}]
        return cls(
            bool({"pose", "position", "straightness"} & {*kinds} or _places(further)),
            bool({"pose", "orientation"} & {*kinds} or _turns(further)),
        )

    @classmethod
    def of(cls, measurements: Measurements) -> TargetSeen:
        """Of what was measured."""
        values = [(each, getattr(measurements, each.name)) for each in _FURTHER]
        further = [each for each, of in values if of is not None and np.isfinite(of).any()]
        poses, size = np.isfinite(measurements.poses), measurements.space.size
        return cls(
            bool(poses[:, :size].any()) or _places(further),
            bool(poses[:, size:].any()) or _turns(further),
        )


def _places(further: Iterable[Observable]) -> bool:
    return any(not each.is_angle for each in further)


def _turns(further: Iterable[Observable]) -> bool:
    return any(each.is_angle for each in further)


def with_target_held(
    wanted: Mapping[str, Any], space: PoseSpace, seen: TargetSeen
) -> dict[str, Any]:
    """Arguments of `identify` with what no observation depends on of an unknown target held.

    A target of which only the place is seen has no orientation, and the other way round. Unless
    `free` names it.
    """
    if "target" not in (wanted.get("frames") or ()) or not any(seen):
        return dict(wanted)
    turns = ("phi",) if space.size == 2 else ("rx", "ry", "rz")
    unseen = [*space.position * (not seen.placed), *turns * (not seen.turned)]
    return with_held(wanted, [f"target.{each}" for each in unseen])


def with_held(wanted: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Arguments of `identify` with more that is held, but what `free` names."""
    named = wanted.get("free") or ()
    held = tuple(each for each in names if each not in named)
    return {**wanted, "fixed": (*(wanted.get("fixed") or ()), *held)} if held else dict(wanted)
