# SPDX-License-Identifier: MIT
"""What the protocol needs besides the legs: workspace, noise, tolerances, defaults; SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symkin.errors import SymkinError
from symkin.values import Array, record

__all__ = [
    "DeclaredSymmetry",
    "DrawnPoints",
    "Frames",
    "IdentificationSettings",
    "JointLimits",
    "MeasurementColumns",
    "NoiseSettings",
    "ProtocolSettings",
    "Tolerances",
    "WorkspaceSettings",
]

DIRECTIONS = ("beam", "x", "y", "z")  # along which the noise of positions may differ
# What is unknown if nobody says so; every other name has nothing.
_USUAL = {"sensor": "linear", "gauge": "prior", "loss_per": "pose"}


class _Settings:
    """Takes any sequences: lists and arrays, which could be changed, become tuples."""

    def __post_init__(self) -> None:
        """Make floats of numpy's numbers, too."""
        for name, value in vars(self).items():
            if isinstance(value, list | tuple | np.ndarray):
                items = value.tolist() if isinstance(value, np.ndarray) else value
                object.__setattr__(self, name, tuple(_plain(item) for item in items))


def _plain(item: object) -> object:
    if isinstance(item, list | tuple):
        return tuple(_plain(each) for each in item)
    return float(item) if isinstance(item, float) else item


@record
class DeclaredSymmetry(_Settings):
    """The symmetry that a mechanism is said to have.

    Attributes
    ----------
    group : str
        ``"C3"`` (rotations), ``"D3"`` (rotations and reflections), ...
    axis : float
        Azimuth of the line (spatially, the plane through Z) of the reflection ``s0``, rad.
    elements : tuple of str or None
        The elements that carry leg 1 to legs 1, 2, ..., or each of several reference legs to its
        orbit: ``r0``, ``r1``, ... are rotations, ``s0``, ``s1``, ... reflections. None is their
        natural order.
    direction : tuple of float or None
        In space: the axis of the rotations, of any length; None is Z.
    mirror : tuple of float or None
        In space: a direction in the plane of the reflection ``s0``, beside the axis; None is Z, or
        for an upright axis the azimuth `axis`.
    centre : tuple of float or None
        In space: a point of the axis, m; None is the origin.
    """

    group: str
    axis: float = 0.0
    elements: tuple[str, ...] | None = None
    direction: tuple[float, ...] | None = None
    mirror: tuple[float, ...] | None = None
    centre: tuple[float, ...] | None = None

    @property
    def about_z(self) -> bool:
        """Whether it is said to be about Z through the origin, as all are in the plane."""
        return self.direction is None and self.mirror is None and self.centre is None


@record
class WorkspaceSettings(_Settings):
    """The box of poses that are sampled, and what keeps a pose away from singularities.

    Bounds and home are written as position (m), then orientation (rad): ``x, y, phi`` for a planar
    platform, ``x, y`` for a point platform, ``x, y, z, rx, ry, rz`` with the rotation vector in the
    base frame for a spatial one.

    Attributes
    ----------
    lower, upper : tuple of float
        Corners of the box.
    reach_margin : float or None
        Least distance of every leg from its limits of reach, m; None means three standard
        deviations of what the tolerances do to a leg's closure at home, but at most half of what
        home itself keeps.
    conditioning_limit : float
        Largest condition number of the inverse pose Jacobian, after scaling by
        `characteristic_length`.
    characteristic_length : float or None
        Length that makes rotations comparable with translations, m; None leaves it to symkin.
    home : tuple of float or None
        The pose whose aspect the workspace is; None means the origin at zero orientation.
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    reach_margin: float | None = None
    conditioning_limit: float = 20.0
    characteristic_length: float | None = None
    home: tuple[float, ...] | None = None

    @property
    def home_or_origin(self) -> tuple[float, ...]:
        """The coordinates of home."""
        return self.home or (0.0,) * len(self.lower)


@record
class NoiseSettings:
    """Standard deviations of the measurements.

    Attributes
    ----------
    position : float
        Of each position coordinate, m.
    orientation : float
        Of the angle, or of each component of the rotation vector, rad.
    reading : float
        Of a sensor reading, in the unit of the sensor (rad or m).
    per_metre : float
        What each metre from the measuring device to what it sees adds to `position`, m/m.
    along : float or None
        Of a position along `direction`, m, where an instrument sees that better or worse than
        across it, which `position` and `per_metre` are then; None: it is the same.
    along_per_metre : float
        What each metre adds to `along`, m/m.
    direction : {"beam", "x", "y", "z"}
        From the origin of the device's frame to what it sees, as of a laser tracker; or an axis of
        that frame, as of a camera that looks along it.
    """

    position: float = 1e-4
    orientation: float = 1e-4
    reading: float = 0.0
    per_metre: float = 0.0
    along: float | None = None
    along_per_metre: float = 0.0
    direction: str = "beam"

    def __post_init__(self) -> None:
        """Refuse a direction that is none."""
        if self.direction not in DIRECTIONS:
            raise SymkinError(
                f'the direction of the noise is "{self.direction}"; expected one of '
                f"{', '.join(DIRECTIONS)}"
            )

    @property
    def varies(self) -> bool:
        """Whether positions are not all seen alike in all directions."""
        return self.per_metre > 0 or self.along is not None

    @property
    def deviations(self) -> dict[str, float]:
        """All that grow and shrink with it, by name."""
        return {name: value for name, value in vars(self).items() if isinstance(value, int | float)}

    def along_at(self, distances: ArrayLike) -> Array:
        """Standard deviation along `direction` so far from the device, m."""
        if self.along is None:
            return self.at(distances)
        return np.asarray(self.along + self.along_per_metre * np.nan_to_num(distances))

    def at(self, distances: ArrayLike) -> Array:
        """Standard deviation of a position so far from the device, m; NaN as if beside it."""
        return np.asarray(self.position + self.per_metre * np.nan_to_num(distances))


@record
class Tolerances:
    """Manufacturing standard deviations of the parameters.

    All are positive, since they are the scale in which observability counts the parameters; what is
    known well has a small one.

    Attributes
    ----------
    length : float
        Of lengths, m.
    angle : float
        Of angles, rad.
    gain : float
        Of sensor gains, relative to the gain.

    Raises
    ------
    SymkinError
        Naming the one that is not positive.
    """

    length: float = 1e-3
    angle: float = 1e-3
    gain: float = 1e-3

    def __post_init__(self) -> None:
        """Refuse what cannot be a scale."""
        for name, value in vars(self).items():
            if not 0 < value < math.inf:
                raise SymkinError(
                    f"the tolerance of a {name} is {value:g}; expected a positive standard "
                    "deviation, a small one for what is known well"
                )


@record
class ProtocolSettings:
    """Defaults of the protocol: poses measured per leg, candidates sampled, and the seed."""

    pose_count: int = 24
    candidates: int = 30000
    seed: int = 1


@record
class JointLimits(_Settings):
    """Limits of the sensor readings, in their unit (rad or m).

    Attributes
    ----------
    lower, upper : float or tuple of float
        Of every leg, or one a leg.
    """

    lower: float | tuple[float, ...] = -math.inf
    upper: float | tuple[float, ...] = math.inf

    def of_legs(self, count: int) -> Array:
        """Lower and upper limit of each leg, shape (2, legs).

        Raises
        ------
        SymkinError
            For another number of limits, or a lower one that is not less than the upper one.
        """
        limits = np.empty((2, count))
        for row, given in zip(limits, (self.lower, self.upper), strict=True):
            if np.size(given) not in (1, count):
                raise SymkinError(
                    f"{np.size(given)} joint limits for {count} legs; expected one, or one a leg"
                )
            row[:] = given
        for leg, (lower, upper) in enumerate(limits.T, 1):
            if not lower < upper:
                raise SymkinError(
                    f"the lower joint limit of leg {leg} is {lower:g}; expected less than the "
                    f"upper limit, {upper:g}"
                )
        return limits


@record
class Frames(_Settings):
    """What stands around the robot as it is measured; what is empty is not there.

    A frame is written as a pose: ``x, y, phi`` in the plane, ``x, y, z, rx, ry, rz`` with a
    rotation vector in space; m and rad.

    Attributes
    ----------
    base : tuple of float
        The robot's base in the frame of the measuring device.
    target : tuple of float
        What the device measures the pose of, in the platform's frame.
    points : tuple of tuple of float
        Further targets in the platform's frame, m; an empty one is somewhere, as are those that are
        observed beyond these.
    anchors : tuple of tuple of float
        Fixed points that distances are measured from, in the device's frame, m.
    zeros : tuple of float
        Of each anchor, by how much more the distance is than is shown, m; empty if nothing is.
    plane : tuple of float
        c0, c1, c2 of the plane z = c0 + c1 x + c2 y of the base's frame that a probe touches; of a
        bed that is not flat, its bow and radius beside: how far its rim, at this radius, is above
        its middle, with the square of the way from there.

    Raises
    ------
    SymkinError
        If there are zeros, and another number of anchors.
    """

    base: tuple[float, ...] = ()
    target: tuple[float, ...] = ()
    points: tuple[tuple[float, ...], ...] = ()
    anchors: tuple[tuple[float, ...], ...] = ()
    zeros: tuple[float, ...] = ()
    plane: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse zeros of some anchors alone."""
        super().__post_init__()
        if self.zeros and len(self.zeros) != len(self.anchors):
            raise SymkinError(
                f"zeros of distances are {len(self.zeros)}, of {len(self.anchors)} anchors; "
                "expected one of each"
            )


def height_of_bed(plane: Sequence[float], places: Array) -> Array:
    """Heights of a bed below places, shape (n, 2 or 3), in the base's frame; see `Frames`."""
    c0, c1, c2, *bowed = plane
    x, y = places[:, 0], places[:, 1]
    bow, radius = bowed or (0.0, 1.0)
    return np.asarray(c0 + c1 * x + c2 * y + bow * (x**2 + y**2) / radius**2)


@record
class DrawnPoints(_Settings):
    """That a file gives points of legs by coordinates, and in which frames.

    A mechanism's parameters are polar, about centres. Its own frames, in which its parameters,
    home, workspace and poses are, stand there; their axes are parallel to those of the file's.

    Attributes
    ----------
    base, platform : tuple of float or None
        The centre of that end in the file's frame, m; None if the end is not given by coordinates.
    workspace : WorkspaceSettings or None
        As the file has it, in its own frames.
    correlations : mapping of str to tuple
        For each such end and each leg the correlation matrix of the errors of the point's polar
        parameters, in the order of the chain's; an empty one of a leg whose end is no point. An end
        that is missing has independent ones.
    """

    base: tuple[float, ...] | None = None
    platform: tuple[float, ...] | None = None
    workspace: WorkspaceSettings | None = None
    correlations: Mapping[str, tuple[tuple[tuple[float, ...], ...], ...]] = field(
        default_factory=dict, hash=False
    )

    @property
    def ends(self) -> tuple[str, ...]:
        """The ends whose points are given by coordinates."""
        return tuple(end for end in ("base", "platform") if getattr(self, end) is not None)

    @property
    def moved(self) -> bool:
        """Whether the mechanism's frames are others than the file's."""
        return any((*(self.base or ()), *(self.platform or ())))


@record
class IdentificationSettings(_Settings):
    """What is unknown, as the arguments of `identify` with these names; None where none is given.

    Attributes
    ----------
    free, fixed, shared : tuple of str or None
        Patterns of names.
    tie : tuple of str or None
        Equations of parameters, exact or within a standard deviation.
    prior : str, mapping of str to float or str, or None
        ``"tolerances"``, ``"fitted"``, or a standard deviation for each pattern.
    frames : tuple of str
        Of ``"base"``, ``"target"``, ``"points"``, ``"anchors"`` and ``"plane"``.
    sensor, gauge, loss_per : str or None
        See `identify`.
    assume : mapping of str to float or str, or None
        A standard deviation for each pattern of what is held, for ``"scale"``, ``"bed"`` and
        ``"sag"``, and times the ``"tolerances"``; in a file the section ``[assumed]``.
    drift, step : tuple of str or None
        Of ``"leg"`` and ``"frame"``; rows, such as ``"63"`` or ``"frame:63"``.
    growth, backlash, clock_offset : bool or None
        See `identify`.
    bow : float or None
        How far the rim of a probed bed may be above its middle, m.
    noise : str or None
        ``"estimate"``.
    sessions : tuple of str or None
        Of ``"offsets"``, ``"frames"`` and ``"noise"``.
    of : str or None
        Coordinates that errors of the position are of, such as ``"z"``, or ``"height"``.
    """

    free: tuple[str, ...] | None = None
    fixed: tuple[str, ...] | None = None
    shared: tuple[str, ...] | None = None
    tie: tuple[str, ...] | None = None
    prior: str | Mapping[str, float | str] | None = field(default=None, hash=False)
    frames: tuple[str, ...] | None = None
    sensor: str | None = None
    gauge: str | None = None
    loss_per: str | None = None
    assume: Mapping[str, float | str] | None = field(default=None, hash=False)
    drift: tuple[str, ...] | None = None
    step: tuple[str, ...] | None = None
    growth: bool | None = None
    backlash: bool | None = None
    clock_offset: bool | None = None
    bow: float | None = None
    noise: str | None = None
    sessions: tuple[str, ...] | None = None
    of: str | None = None

    @property
    def unusual(self) -> tuple[str, ...]:
        """Names of what asks for other than all parameters of all legs."""
        return unusual(vars(self))


def asked_or_set(
    asked: Mapping[str, Any], settings: IdentificationSettings | None
) -> dict[str, Any]:
    """Arguments of `identify`: what was asked for, or else what the settings say; none is None."""
    chosen = {
        name: getattr(settings, name, None) if value is None else value
        for name, value in asked.items()
    }
    return {name: value for name, value in chosen.items() if value is not None}


def unusual(wanted: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of what asks for other unknowns than all parameters of all legs, or another estimate.

    `wanted` are arguments of `identify`; None is what is not said.
    """
    return tuple(
        name
        for name, value in wanted.items()
        if value is not None and value != _USUAL.get(name, ()) and (value is True or value)
    )


@record
class MeasurementColumns(_Settings):
    """Which columns of a table hold the measured pose and the readings.

    A unit that is None is taken from the column's name (``x_mm``, ``psi_1_rev``). At most one of
    `angle`, `quaternion` and `rotation_vector` is not empty.

    Attributes
    ----------
    position : tuple of str
        Columns of x, y (and z); empty, or an empty name, for what was not measured.
    angle : str or None
        Column of the planar platform angle.
    quaternion : tuple of str
        Columns of the unit quaternion in the order x, y, z, w, platform frame to base frame.
    rotation_vector : tuple of str
        Columns of the rotation vector in the base frame.
    readings : tuple of str
        Column of each leg's reading, in the order of the legs.
    position_unit, orientation_unit, reading_unit : str or None
        Units, such as "mm", "deg" and "rev"; positions in pixels and readings in counts have the
        size of one: "0.1 mm/px", "360 deg/4096/count".
    leg : str or None
        Column of the leg (1, 2, ...) whose set the pose belongs to.
    robot : str
        Column of the robot that the row belongs to, of tables of many.
    names : mapping of str to str, or None
        Columns of what else was observed, and of standard deviations: the key is symkin's name with
        the column's unit, such as ``height_mm`` or ``x_sd_mm``, the value the table's. None stands
        for the names that symkin itself writes.
    source : Path, optional
        The file that it was read from by itself.
    """

    position: tuple[str, ...]
    readings: tuple[str, ...]
    angle: str | None = None
    quaternion: tuple[str, ...] = ()
    rotation_vector: tuple[str, ...] = ()
    position_unit: str | None = None
    orientation_unit: str | None = None
    reading_unit: str | None = None
    leg: str | None = None
    robot: str = "robot"
    names: Mapping[str, str] | None = field(default_factory=dict, hash=False)
    source: Path | None = field(default=None, compare=False)
