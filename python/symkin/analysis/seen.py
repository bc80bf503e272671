# SPDX-License-Identifier: MIT
"""What is seen of a robot, measured or planned, and what is unknown then if nobody says."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES
from symkin.model.mechanism import Mechanism
from symkin.model.poses import PoseSpace
from symkin.model.settings import Frames

_OF_TARGET = {each.name for each in OBSERVABLES.values() if "target" in each.frames}
_ANGLES = {each.name for each in OBSERVABLES.values() if each.is_angle}
_BETWEEN = {each.name for each in OBSERVABLES.values() if each.between_rows}


class Seen(NamedTuple):
    """What is seen of the platform in any row.

    Attributes
    ----------
    space : PoseSpace
        Of its poses.
    axes : tuple of bool
        Whether each coordinate of the target's position is.
    turn : bool
        Whether its orientation is, as that of a pose.
    further : frozenset of str
        What else is, as `OBSERVABLES` names it.
    """

    space: PoseSpace
    axes: tuple[bool, ...]
    turn: bool
    further: frozenset[str]

    @classmethod
    def of(cls, measurements: Measurements) -> Seen:
        """What was measured."""
        poses, space = np.isfinite(measurements.poses), measurements.space
        axes = tuple(bool(each.any()) for each in poses.T[: space.size])
        values = {
            each.name: getattr(measurements, each.name)
            for each in OBSERVABLES.values()
            if each.is_further
        }
        further = frozenset(
            name for name, of in values.items() if of is not None and np.isfinite(of).any()
        )
        return cls(space, axes, bool(poses[:, space.size :].any()), further)

    @classmethod
    def by(cls, kinds: Collection[str], space: PoseSpace) -> Seen:
        """What will be, by kinds of observation as the option `observe` calls them."""
        whole, offsets = {"pose", "position"} & {*kinds}, "straightness" in kinds
        axes = tuple(bool(whole or (offsets and each)) for each in range(space.size))
        further = frozenset(
            each.name
            for each in OBSERVABLES.values()
            if each.is_further and {*each.words} & {*kinds}
        )
        return cls(space, axes, bool({"pose", "orientation"} & {*kinds}), further)

    @property
    def nothing(self) -> bool:
        """Whether there are readings alone."""
        return not (any(self.axes) or self.turn or self.further)

    @property
    def placed(self) -> bool:
        """Whether anything depends on where the target is."""
        return any(self.axes) or bool(self.further & _OF_TARGET - _ANGLES)

    @property
    def turned(self) -> bool:
        """Whether anything depends on how the target is turned."""
        return self.turn or bool(self.further & _OF_TARGET & _ANGLES)

    @property
    def tracked(self) -> bool:
        """Whether points are all that is seen of positions."""
        others = self.further & {"heights", "distances"}
        return "points" in self.further and not (any(self.axes) or others)

    @property
    def probed(self) -> bool:
        """Whether heights are all that is seen of poses.

        Of a platform that never turns, x and y may be there too: those of marks on a piece.
        """
        own = self.axes[2:] if self.space.name == "translating" else self.axes
        others = any(own) or self.turn or self.further & {"reported", "points"}
        return "heights" in self.further and not others

    @property
    def marked(self) -> bool:
        """Whether a probed robot that never turns has positions in the plane: marks on a piece."""
        return self.probed and self.axes[:2] == (True, True)

    @property
    def along_edge(self) -> bool:
        """Whether offsets from a line are all that shows where the device's frame is."""
        others = {"points", "distances", "attitudes", "turns", "offsets"} & self.further
        offsets = any(self.axes) and self.axes == (False, *[True] * (len(self.axes) - 1))
        return offsets and not (self.turn or others)

    @property
    def between_rows(self) -> bool:
        """Whether all is seen between rows, and nothing of poses besides."""
        return bool(self.further) and self.further <= _BETWEEN and not (any(self.axes) or self.turn)


def with_defaults(wanted: Mapping[str, Any], mechanism: Mechanism, seen: Seen) -> dict[str, Any]:
    """Arguments of `identify` with what is unknown, or held, where nothing was said of it."""
    if seen.tracked:
        wanted = _of_points(wanted, mechanism, seen)
    elif seen.between_rows:
        wanted = _with_priors(wanted)
    elif seen.along_edge:
        wanted = _with_edge_held(wanted, mechanism.space)
    elif seen.probed:
        wanted = _of_bed(wanted, seen)
    return _with_target_held(wanted, mechanism.space, seen)


def _of_points(wanted: Mapping[str, Any], mechanism: Mechanism, seen: Seen) -> dict[str, Any]:
    """The device's frame is unknown, unless the mechanism says where that is.

    And, where orientations are seen too, that of what they are of.
    """
    chosen, frames = dict(wanted), mechanism.frames or Frames()
    placed = any(name.startswith("base") for name in chosen.get("free") or ())
    if "frames" in chosen or frames.base or placed:
        return chosen
    chosen["frames"] = ("base", "target") if mechanism.space.turns and seen.turn else ("base",)
    return chosen


def _of_bed(wanted: Mapping[str, Any], seen: Seen) -> dict[str, Any]:
    """The bed's plane is unknown; the tolerances are priors, and count for what is held.

    Where positions in the plane are seen the place of the ruler is, too, which nobody knows who
    says what is free, and nothing of frames.
    """
    chosen = dict(wanted)
    chosen["assume"] = {"tolerances": 1.0, **(chosen.get("assume") or {})}
    if "frames" in chosen:
        return chosen
    said = "free" in chosen
    placed = any(name.startswith("base.") for name in chosen.get("free") or ())
    chosen["frames"] = ("base",) * (seen.marked and not placed) + ("plane",) * (not said)
    if "base" in chosen["frames"]:
        chosen["fixed"] = (*chosen.get("fixed", ()), "base.z", "base.rx", "base.ry")
    return _with_priors(chosen)


def _with_priors(wanted: Mapping[str, Any]) -> dict[str, Any]:
    """The tolerances are priors, where what is seen shows no place of the robot."""
    chosen = dict(wanted)
    if "free" not in chosen and "gauge" not in chosen:
        chosen.setdefault("prior", "tolerances")
    return chosen


def _with_edge_held(wanted: Mapping[str, Any], space: PoseSpace) -> dict[str, Any]:
    """What offsets do not show of an unknown edge is held, unless `free` names it."""
    if "base" not in (wanted.get("frames") or ()):
        return dict(wanted)
    held = ["x", "rx"] if space.in_space else ["x"]
    blocks = ["base", *["session*"] * ("frames" in (wanted.get("sessions") or ()))]
    return _with_held(wanted, [f"{block}.{each}" for block in blocks for each in held])


def _with_target_held(wanted: Mapping[str, Any], space: PoseSpace, seen: Seen) -> dict[str, Any]:
    """What nothing depends on of an unknown target is held, unless `free` names it.

    A target of which only the place is seen has no orientation, and the other way round.
    """
    if "target" not in (wanted.get("frames") or ()) or not (seen.placed or seen.turned):
        return dict(wanted)
    turns = ("phi",) if space.size == 2 else ("rx", "ry", "rz")
    unseen = [*space.position * (not seen.placed), *turns * (not seen.turned)]
    return _with_held(wanted, [f"target.{each}" for each in unseen])


def _with_held(wanted: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    named: Sequence[str] = wanted.get("free") or ()
    held = tuple(each for each in names if each not in named)
    return {**wanted, "fixed": (*(wanted.get("fixed") or ()), *held)} if held else dict(wanted)
