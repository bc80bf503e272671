# SPDX-License-Identifier: MIT
"""Simulated robots, and what a laboratory observes of them: poses, distances, heights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.data.error_axes import drawn_along
from symkin.data.measurements import Measurements
from symkin.data.observables import OBSERVABLES, words_between_rows, words_with
from symkin.errors import SymkinError, one_of
from symkin.model.devices import DEVICES
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    POSE_SPACES,
    Transform,
    frame,
    poses_of,
    roll_pitch_yaw,
    stepped,
    tangents_of,
    transforms,
)
from symkin.model.settings import Frames, NoiseSettings, height_of_bed
from symkin.options import OPTIONS, Observable
from symkin.values import Array, record

__all__ = ["Observable", "Observed", "Observing"]

_STREAM = 3  # of the seed: the core draws robots and full poses from others


@record
class Observed:
    """What is observed besides the sensor readings, with which frames, and how well.

    The device measures the target, in its own frame. A frame is written as position (m), then angle
    or rotation vector (rad): ``x, y, phi``, or ``x, y, z, rx, ry, rz`` in space.

    Attributes
    ----------
    kinds : tuple of str
        ``"pose"`` of the target, or its ``"position"`` or ``"orientation"`` alone;
        ``"straightness"``: its position but for x, as offsets from a straightedge; ``"points"``;
        ``"distance"`` of the target from anchors; ``"height"`` of the target above a plane, in
        space; ``"attitude"``: its roll, pitch and yaw, or ``"tilt"``: roll and pitch alone;
        ``"reported"``: the platform's own pose in the base frame, exactly, by a controller that
        knows the robot; ``"readings"``: nothing else. Between the first row and the second, the
        third and the fourth and so on: ``"separation"``, how far the targets are from each other,
        ``"rise"``, how much higher the second is, ``"offset"``, along each coordinate. One of them
        may be given as it is.
    base : tuple of float or None
        The robot's base in the device's frame; None: the same.
    target : tuple of float or None
        The target in the platform's frame; None: the same.
    points : tuple of tuple of float
        Further targets in the platform's frame, m.
    anchors : tuple of tuple of float
        Fixed points in the device's frame, m.
    zeros : tuple of float
        Of each anchor, by how much more its distance is than is shown, m; empty if nothing is.
    plane : tuple of float
        ``c0, c1, c2`` of the plane ``z = c0 + c1 x + c2 y`` in the base frame; of a bed that is
        not flat its bow and radius beside, as in `Frames`.
    missing : float
        The fraction of readings that are not taken; each row keeps one.
    spread : float
        How much the noise differs from row to row: its standard deviation is the mechanism's, times
        ``exp(spread * z)`` with a normal ``z`` for each row and kind. The measurements say it.

    Raises
    ------
    SymkinError
        Naming what cannot be, and what is expected.
    """

    kinds: tuple[Observable, ...] = ("pose",)
    base: tuple[float, ...] | None = None
    target: tuple[float, ...] | None = None
    points: tuple[tuple[float, ...], ...] = ()
    anchors: tuple[tuple[float, ...], ...] = ()
    zeros: tuple[float, ...] = ()
    plane: tuple[float, ...] = (0.0, 0.0, 0.0)
    missing: float = 0.0
    spread: float = 0.0

    def __post_init__(self) -> None:
        """Take a single kind, and refuse what contradicts itself."""
        given: Any = self.kinds
        kinds = (given,) if isinstance(given, str) else tuple(given)
        for kind in kinds:
            one_of("observe", kind, Observable)
        object.__setattr__(self, "kinds", kinds)
        whole = {"pose", "position", "orientation", "straightness"}.intersection(kinds)
        if {"attitude", "tilt"}.issubset(kinds):
            raise SymkinError("observe has attitude and tilt, which is a part of it; expected one")
        if not kinds or len(set(kinds)) < len(kinds) or len(whole) > 1:
            shown = ", ".join(kinds) or "nothing"
            raise SymkinError(
                f"observe is {shown}; expected each kind once, and one of pose, position, "
                "orientation, straightness"
            )
        if "readings" in kinds and len(kinds) > 1:
            raise SymkinError("observe has readings, which means nothing else, beside other kinds")
        for what, values in (("points", self.points), ("anchors", self.anchors)):
            (kind,) = words_with(what)
            if (kind in kinds) != bool(len(values)):
                raise SymkinError(
                    f'{what} are given, but "{kind}" is not observed; expected both or neither'
                    if values
                    else f'{what} are not given, but "{kind}" is observed; expected {what} under '
                    f"[frames] of the mechanism's file{_or_device(what)}"
                )
        if not 0 <= self.missing < 1:
            raise SymkinError(f"missing is {self.missing:g}; expected a fraction from 0 to below 1")
        if not 0 <= self.spread <= 3:
            raise SymkinError(f"spread is {self.spread:g}; expected 0 to 3")

    @property
    def together(self) -> int:
        """How many poses are measured together: two where something is observed between rows."""
        return 2 if words_between_rows().intersection(self.kinds) else 1

    @classmethod
    def of(cls, mechanism: Mechanism, observe: Observing | None) -> Observed | None:
        """What is observed of a mechanism, in its frames, as it is asked for.

        Points and anchors are the mechanism's. Without a word it is what the mechanism's device
        observes; None without a device.
        """
        frames, device = mechanism.frames or Frames(), mechanism.device
        if observe is None and device is None:
            return None
        if isinstance(observe, Observed):
            return observe.in_frames(frames)
        if observe is None and device is not None:
            kinds: Any = device.kinds(mechanism.space)
        else:
            kinds = (observe,) if isinstance(observe, str) else tuple(observe or ())
        points: Any = frames.points if "points" in kinds else ()
        base = None
        if device is not None:
            base = device.base(mechanism.space) or None
            places = device.places(mechanism.space.size, mechanism.characteristic_length)
            if "points" in kinds and not (points and all(points)):
                points = tuple(a or b for a, b in zip(points or places, places, strict=False))
        anchors = frames.anchors if "distance" in kinds else ()
        seen = cls(kinds, base=frames.base or base, points=points, anchors=anchors)
        return seen.in_frames(frames)

    def in_frames(self, frames: Frames | None) -> Observed:
        """Return it with a mechanism's base, target and plane where it gives none itself.

        And with the zeros of its anchors, if it has the same.
        """
        given = frames or Frames()
        level = not any(self.plane[:4])
        return replace(
            self,
            base=self.base or given.base or None,
            target=self.target or given.target or None,
            zeros=self.zeros
            or (given.zeros if np.array_equal(self.anchors, given.anchors) else ()),
            plane=given.plane if level and given.plane else self.plane,
        )

    def measure(
        self,
        taken: Measurements,
        noise: NoiseSettings,
        seed: int,
        times: Array | float = 1.0,
    ) -> Measurements:
        """Measure poses and readings that are exact.

        Parameters
        ----------
        taken : Measurements
            Full poses of the platform in the base frame, and the readings there.
        noise : NoiseSettings
            Standard deviations.
        seed : int
            Of the noise, and of what is missing.
        times : ndarray, shape (N,), or float
            As large as that the noise of each row is, whatever is said of it.

        Raises
        ------
        SymkinError
            If a frame, a point or an anchor has another number of coordinates than the robot wants.
        """
        random = np.random.default_rng([seed, _STREAM])
        space = taken.pose_space
        size, dof = POSE_SPACES[space].size, POSE_SPACES[space].dof
        base, target = self._frame("base", space), self._frame("target", space)
        platform = transforms(space, taken.poses)
        in_base = platform @ target
        seen = base @ in_base
        rows = len(taken.poses)
        deviations: dict[str, Any] = {}

        def noisy(name: str, values: Array) -> Array:
            return values + errors(name, values, values.shape)

        def errors(name: str, values: Array, shape: tuple[int, ...]) -> Array:
            deviation = OBSERVABLES[name].noise(noise, POSE_SPACES[space], values)
            factor = np.exp(self.spread * random.normal(size=(rows, *[1] * (len(shape) - 1))))
            own = np.broadcast_to(np.asarray(deviation), shape) * factor
            if self.spread:
                deviations[OBSERVABLES[name].deviations] = own
            larger = np.reshape(times, (-1, *[1] * (len(shape) - 1)))
            drawn = larger * random.normal(size=shape)
            found = np.asarray(own * drawn)
            if noise.along is not None and name in ("poses", "points") and not self.spread:
                where = np.reshape(values, (rows, -1, size))
                count = where.shape[1] * size
                along = drawn_along(
                    noise, where, drawn.reshape(rows, -1)[:, :count].reshape(where.shape)
                )
                found.reshape(rows, -1)[:, :count] = along.reshape(rows, count)
            return found

        places = seen.translation[:, :size]
        moves = tangents_of(POSE_SPACES[space], errors("poses", places, (rows, dof)))
        poses = poses_of(space, stepped(seen, moves))
        if "straightness" in self.kinds:
            poses[:, 0] = np.nan
        elif not {"pose", "position"}.intersection(self.kinds):
            poses[:, :size] = np.nan
        if not {"pose", "orientation"}.intersection(self.kinds):
            poses[:, size:] = np.nan
        if np.isnan(poses).all():
            deviations.pop("pose_deviations", None)
        readings = noisy("readings", taken.readings)
        readings[self._missing(readings.shape, random)] = np.nan
        found: dict[str, Any] = {}
        if self.points:
            points = np.stack(
                [
                    (base @ platform @ Transform(np.eye(3), p)).translation
                    for p in self._of("points", size)
                ],
                axis=1,
            )[:, :, :size]
            found["points"] = noisy("points", points)
        if self.anchors:
            away = seen.translation[:, None] - np.array(self._of("anchors", size))
            distances = np.linalg.norm(away, axis=2)
            found["distances"] = noisy("distances", distances) - np.array(self.zeros or (0.0,))
        if "reported" in self.kinds:
            found["reported"] = taken.poses
        if "height" in self.kinds:
            if size != 3:
                raise SymkinError(
                    f"a height above a plane is observed in space; this robot is {space}"
                )
            above = in_base.translation[:, 2] - height_of_bed(self.plane, in_base.translation)
            heights = above / math.hypot(1.0, self.plane[1], self.plane[2])
            found["heights"] = noisy("heights", heights)
        if {"attitude", "tilt"}.intersection(self.kinds):
            found["attitudes"] = noisy("attitudes", _attitudes(space, seen.rotation))
            if "tilt" in self.kinds:
                found["attitudes"][:, 2] = np.nan
        pairs = self._pairs(in_base.translation[:, :size], seen.translation[:, :size])
        if pairs:
            first = np.arange(0, rows - 1, 2)
            found["partners"] = np.zeros((rows, 1), dtype=np.intp)
            found["partners"][first + 1, 0] = taken.row_numbers[first]
            found |= {name: noisy(name, values) for name, values in pairs.items()}
        return replace(taken, poses=poses, readings=readings, **found, **deviations)

    def _pairs(self, in_base: Array, seen: Array) -> dict[str, Array]:
        """What is observed of every second row from the one before, NaN in the others."""
        found: dict[str, Array] = {}
        second = np.arange(len(seen)) % 2 == 1
        ways = [np.diff(each, axis=0, prepend=np.nan) for each in (in_base, seen)]
        within, offsets = (np.where(second[:, None], way, np.nan) for way in ways)
        if "separation" in self.kinds:
            found["separations"] = np.linalg.norm(within, axis=1)[:, None]
        if "rise" in self.kinds:
            if in_base.shape[1] != 3:
                raise SymkinError("heights above a plane are observed in space; this robot is not")
            above = in_base[:, 2] - height_of_bed(self.plane, in_base)
            slope = math.hypot(1.0, self.plane[1], self.plane[2])
            rises = np.where(second, np.diff(above, prepend=np.nan), np.nan)
            found["rises"] = (rises / slope)[:, None]
        if "offset" in self.kinds:
            found["offsets"] = offsets[:, None]
        return found

    def exact(self, taken: Measurements) -> Measurements:
        """Measure poses and readings that are exact without noise; the arguments of `measure`."""
        return self.measure(taken, NO_NOISE, 0)

    def _frame(self, name: str, space: str) -> Transform:
        given, count = getattr(self, name), len(POSE_SPACES[space].frame_components)
        values = np.zeros(count) if given is None else np.array(given, dtype=float)
        if values.shape != (count,) or not np.isfinite(values).all():
            names = {6: "x, y, z, rx, ry, rz in m and rad", 3: "rx, ry, rz in rad"}[count]
            if not POSE_SPACES[space].in_space:
                names = "x, y, phi in m and rad"
            raise SymkinError(f"{name} is {given}; expected {names}")
        return frame(space, values.tolist())

    def _of(self, name: str, size: int) -> Array:
        """Points in space, shape (n, 3)."""
        values = np.zeros((len(getattr(self, name)), 3))
        for index, given in enumerate(getattr(self, name)):
            if len(given) != size or not np.isfinite(given).all():
                raise SymkinError(f"{name} has {given}; expected {size} coordinates, m")
            values[index, :size] = given
        return values

    def _missing(self, shape: tuple[int, int], random: np.random.Generator) -> NDArray[np.bool_]:
        """Which readings are not taken: each with the same chance, but not all of a row."""
        chance = random.random(shape)
        kept = chance == chance.max(axis=1, keepdims=True)
        return np.asarray((chance < self.missing) & ~kept)


def _attitudes(space: str, rotation: Array) -> Array:
    """Roll, pitch and yaw of rotations, see `Measurements.attitudes`."""
    if not POSE_SPACES[space].has_quaternion:
        raise SymkinError(
            f"roll, pitch and yaw are of platforms that turn in space; this robot is {space}"
        )
    return roll_pitch_yaw(rotation)


Observing = Observed | Observable | Sequence[Observable]


NO_NOISE = NoiseSettings(1e-300, 0.0, 0.0)  # none at all is refused, as a slip


def _or_device(what: str) -> str:
    """Devices that would give what a file does not."""
    kinds = [f'"{each.kind}"' for each in DEVICES.values() if what in each.observe and each.points]
    flag = OPTIONS["device_kind"].flag
    return f", or a device that has some: {flag} {' or '.join(kinds)}" if kinds else ""
