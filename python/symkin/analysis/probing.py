# SPDX-License-Identifier: MIT
"""Tables of a probe that touched a bed: what they are, and what is unknown then."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames
from symkin.values import Array, Value, field, record

CALIPER = 5e-5  # m, standard deviation of a length that was measured with calipers
_FEW = 3  # rows, by which nothing is judged
_COMMANDED = 2e-5  # m, to which steps and rounding keep what was commanded


@record
class PrintedLength(Value):
    """A piece along x, centred on z, that the robot made with its nominal parameters.

    Attributes
    ----------
    commanded, measured : float
        Its length as it was ordered and as it came out, m.
    deviation : float
        Standard deviation of `measured`.
    """

    commanded: float = field(unit="m")
    measured: float = field(unit="m")
    deviation: float = field(unit="m", default=CALIPER)

    def __post_init__(self) -> None:
        """Refuse what is no length."""
        for name in ("commanded", "measured", "deviation"):
            if not 0 < getattr(self, name) < np.inf:
                raise SymkinError(
                    f"the {name} of a printed length is {getattr(self, name):g} m; expected a "
                    "length above zero"
                )
        if not 0.5 < self.measured / self.commanded < 2:
            raise SymkinError(
                f"a printed length is {self.measured:g} m, {self.commanded:g} m were commanded; "
                "expected about the same: are the units right?"
            )
        super().__post_init__()


def refuse_commanded(mechanism: Mechanism, measurements: Measurements) -> None:
    """Refuse positions beside heights that were commanded, and so say nothing of the robot.

    Raises
    ------
    SymkinError
        If the nominal robot is just there at the readings.
    """
    heights = measurements.heights
    both = _marks(measurements) & np.isfinite(np.nan if heights is None else heights)
    taken = mechanism.forward_kinematics(measurements.readings[both])[0]
    away = np.linalg.norm((taken - measurements.poses[both])[:, :2], axis=1)
    if both.sum() > _FEW and np.nanmedian(away) < _COMMANDED:
        raise SymkinError(
            "the x and y beside the heights are where the nominal robot is at the readings, to "
            f"{1e3 * np.nanmedian(away):.2g} mm: they were commanded, not measured; leave them "
            "out, or call the columns commanded_x_mm and commanded_y_mm"
        )


def _marks(measurements: Measurements) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(measurements.poses[:, :2]).all(axis=1))


def ruler(mechanism: Mechanism, measurements: Measurements) -> tuple[float, ...]:
    """The base in the frame of a ruler, ``x, y, z, rx, ry, rz``, as the nominal robot has it.

    Of the rotation, that about z alone.
    """
    rows = _marks(measurements) & np.isfinite(measurements.readings).all(axis=1)
    taken = mechanism.forward_kinematics(measurements.readings[rows])[0][:, :2]
    read = measurements.poses[rows, :2][np.isfinite(taken).all(axis=1)]
    taken = taken[np.isfinite(taken).all(axis=1)]
    if not len(taken):
        return (0.0,) * 6
    # Complex numbers turn in the plane: the best rotation is the angle of a sum.
    own, other = ((each - each.mean(axis=0)) @ [1, 1j] for each in (taken, read))
    angle = float(np.angle(np.sum(other * own.conj())))
    c, s = np.cos(angle), np.sin(angle)
    x, y = read.mean(axis=0) - np.array([[c, -s], [s, c]]) @ taken.mean(axis=0)
    return float(x), float(y), 0.0, 0.0, 0.0, angle


def with_bed_radius(mechanism: Mechanism, touched: Array) -> Mechanism:
    """The mechanism with the radius of its bed's rim, where the farthest of these poses is.

    Unless its frames say it.

    Raises
    ------
    SymkinError
        If no pose is anywhere: no height is observed, or its readings are none of the robot's.
    """
    frames = mechanism.frames or Frames()
    if len(frames.plane) > 3:
        return mechanism
    away = np.hypot(*touched[:, :2].T) if mechanism.space.size == 3 else np.zeros(0)
    radius = float(np.nanmax(away, initial=0.0))
    if len(touched) and np.isnan(touched).all():
        raise NotIdentifiableError(
            "the nominal robot can take none of the readings at which heights were observed, so "
            "that nothing says where the bed was touched"
        )
    if not radius > 0:
        raise SymkinError("bow is of a bed that is probed; no height is observed away from 0, 0")
    plane = (*(frames.plane or (0.0, 0.0, 0.0)), 0.0, radius)
    return mechanism.replace(frames=dataclasses.replace(frames, plane=plane))


def with_printed_length(
    mechanism: Mechanism, measurements: Measurements, printed: PrintedLength
) -> Measurements:
    """Measurements with two rows more: the ends of a piece, in the frame of the ruler along it.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, whose inverse kinematics the controller used.
    measurements : Measurements
        Heights, with readings of all legs.
    printed : PrintedLength
        The piece.

    Raises
    ------
    SymkinError
        If the mechanism does not reach the ends of the piece on the plane that was touched.
    """
    taken, _ = mechanism.forward_kinematics(measurements.readings)
    if mechanism.pose_space != "translating" or not np.isfinite(taken).any():
        raise SymkinError(
            "a printed length goes with heights that a robot touched whose platform never turns, "
            f"with readings that it can take; this is a {mechanism.pose_space} one"
        )
    half = printed.commanded / 2
    ends = np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]])
    ends[:, 2] = np.nanmean(taken[:, 2])
    readings = mechanism.inverse_kinematics(ends)
    if not np.isfinite(readings).all():
        raise SymkinError(
            f"the ends of a printed length of {printed.commanded:g} m along x are out of reach"
        )
    share = printed.deviation / np.sqrt(2)
    new = {
        "poses": [[0.0, 0.0, np.nan], [printed.measured, 0.0, np.nan]],
        "pose_deviations": np.full((2, 3), share),
        "readings": readings,
        "leg_sets": np.full(2, ALL_LEGS),
        "row_numbers": int(measurements.row_numbers.max(initial=0)) + np.arange(1, 3),
    }
    joined: dict[str, Any] = {}
    for each in dataclasses.fields(measurements):
        old = getattr(measurements, each.name)
        if each.name == "pose_deviations" and old is None:
            old = np.full(measurements.poses.shape, np.nan)
        if isinstance(old, np.ndarray):
            nothing = 0 if old.dtype.kind == "i" else np.nan  # of a pair: no other row
            more = new.get(each.name, np.full((2, *old.shape[1:]), nothing))
            joined[each.name] = np.concatenate([old, more])
    return dataclasses.replace(measurements, **joined)
