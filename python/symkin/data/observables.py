# SPDX-License-Identifier: MIT
"""The table of what can be observed of a robot: where it is kept, its columns, its noise.

Reading, writing, simulation, planning and identification go through it, in the order of its rows,
which is the core's.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from symkin.model.poses import PoseSpace
from symkin.model.settings import NoiseSettings
from symkin.values import Array, record

REPORTED = "reported_"
PAIR = "pair"  # of columns of what was measured between a row and another one
ROW = "row"  # the column of the numbers that name rows in such columns
COMMANDED = "commanded_"  # where a fit may start, and no observation
Stem = tuple[str, str]  # a column's name without its unit, and the SI unit


class Sizes(NamedTuple):
    """How much of what is numbered there is, and of which kind."""

    space: PoseSpace
    legs: int = 0
    reading_unit: str = ""
    points: int = 0
    distances: int = 0
    pairs: int = 0


@record
class Observable:
    """What can be observed.

    Attributes
    ----------
    name : str
        The attribute of `Measurements` that holds it.
    deviations : str
        That of its standard deviations.
    kind : str
        One of it, in words.
    words : tuple of str
        What the option `observe` calls it, or parts of it.
    dimensions : int
        Of its array.
    noise : callable
        Its standard deviation if rows say none, from the noise settings and what was measured.
    stems : callable
        Its columns, without units; of poses that are read as such, those of its deviations.
    frames : tuple of str
        Which of `Frames` it depends on.
    numbered : str
        Pattern of the columns that are numbered from 1, of which ``{axes}`` are the coordinates.
    is_angle : bool
        Whether all of it are angles, rad.
    correlations : str
        The attribute of the correlations of its errors, of each place between its coordinates.
    between_rows : bool
        Whether it was measured between the row and another one; see `Measurements.partners`.
    """

    name: str
    deviations: str
    kind: str
    words: tuple[str, ...]
    dimensions: int
    noise: Callable[[NoiseSettings, PoseSpace, Array], ArrayLike]
    stems: Callable[[Sizes], list[Stem]]
    frames: tuple[str, ...] = ()
    numbered: str = ""
    is_angle: bool = False
    correlations: str = ""
    between_rows: bool = False

    @property
    def is_pose(self) -> bool:
        """Whether it is read as a pose, whose deviations have a column for each freedom."""
        return self.name in ("poses", "reported")

    @property
    def is_further(self) -> bool:
        """Whether it is beside poses and readings, which measurements always have."""
        return self.name not in ("poses", "readings")

    def columns(self, of: Sizes) -> list[Stem]:
        """Columns of its values; none of what is read as a pose or by the mapping."""
        return [] if self.is_pose or not self.is_further else self.stems(of)

    def deviation_columns(self, of: Sizes) -> list[Stem]:
        """Columns of its standard deviations."""
        return [(f"{stem}_sd", unit) for stem, unit in self.stems(of)]

    def correlation_columns(self, of: Sizes) -> list[str]:
        """Columns of the correlations of its errors, which have no unit."""
        if not self.correlations or not of.space.moves:
            return []
        places = [f"p{point + 1}_" for point in range(of.points)] if self.name == "points" else [""]
        pairs = ["".join(pair) for pair in itertools.combinations(of.space.position, 2)]
        return [f"{place}{pair}_correlation" for place in places for pair in pairs]

    def shape(self, of: Sizes) -> tuple[int, ...]:
        """Of the array of its values, for rows of columns; -1 for however many rows."""
        count = len(self.stems(of))
        size = of.space.size or 1
        return {3: (-1, count // size, size), 2: (-1, count), 1: (-1,)}[self.dimensions]

    def numbers(self, space: PoseSpace, units: str) -> re.Pattern[str]:
        """Pattern of its numbered columns and their deviations, whose first group is the number."""
        stem = self.numbered.format(axes="".join(space.position))
        return re.compile(rf"{stem}(?:_sd)?_(?:{units})", re.ASCII)


def _coordinates(space: PoseSpace, prefix: str = "") -> list[Stem]:
    return [(f"{prefix}{name}", unit) for name, unit in space.units.items()]


def _pose_noise(noise: NoiseSettings, space: PoseSpace, poses: Array) -> ArrayLike:
    position = noise.at(_distance(poses[:, : space.size]))
    turned = np.full(position.shape, noise.orientation)
    return np.repeat([position, turned], [space.size, len(space.rotation)], axis=0).T


def _point_noise(noise: NoiseSettings, _: PoseSpace, points: Array) -> ArrayLike:
    return noise.at(_distance(points))[..., np.newaxis]


def _distance(points: Array) -> Array:
    """From the device, in whose frame they are."""
    return np.asarray(np.linalg.norm(points, axis=-1))


_NUMBER = "(0|[1-9][0-9]*)"
ATTITUDE = ("roll", "pitch", "yaw")
TURN_AXIS = ("turn_axis_x", "turn_axis_y", "turn_axis_z")
# fmt: off
_ALL = (
    Observable("readings", "reading_deviations", "readings", ("readings",), 2,
               lambda noise, *_: noise.reading,
               lambda of: [(f"psi_{leg + 1}", of.reading_unit) for leg in range(of.legs)]),
    Observable("poses", "pose_deviations", "pose",
               ("pose", "position", "orientation", "straightness"), 2,
               _pose_noise, lambda of: _coordinates(of.space), ("base", "target"),
               correlations="pose_correlations"),
    Observable("reported", "reported_deviations", "reported pose", ("reported",), 2,
               lambda *_: 0.0, lambda of: _coordinates(of.space, REPORTED)),
    Observable("points", "point_deviations", "points", ("points",), 3,
               _point_noise,
               lambda of: [(f"p{point + 1}_{axis}", "m")
                           for point in range(of.points) for axis in of.space.position],
               ("base", "points"), f"p{_NUMBER}_[{{axes}}]", correlations="point_correlations"),
    Observable("distances", "distance_deviations", "distances", ("distance",), 2,
               lambda noise, _, distances: noise.at(distances),
               lambda of: [(f"distance_{number + 1}", "m") for number in range(of.distances)],
               ("base", "target", "anchors"), f"distance_{_NUMBER}"),
    Observable("heights", "height_deviations", "heights", ("height",), 1,
               lambda noise, *_: noise.position,
               lambda of: [("height", "m")] if of.space.size == 3 else [],
               ("target", "plane")),
    Observable("attitudes", "attitude_deviations", "attitudes", ("attitude", "tilt"), 2,
               lambda noise, *_: noise.orientation,
               lambda of: [(name, "rad") for name in ATTITUDE] if of.space.has_quaternion else [],
               ("base", "target"), is_angle=True),
    Observable("turns", "turn_deviations", "turns", (), 1,
               lambda noise, *_: noise.orientation,
               lambda of: [("turn", "rad")] if of.space.has_quaternion else [],
               ("base", "target"), is_angle=True),
    Observable("separations", "separation_deviations", "separations", ("separation",), 2,
               lambda noise, *_: noise.position,
               lambda of: [(f"{PAIR}{pair + 1}_distance", "m") for pair in range(of.pairs)],
               ("target",), f"{PAIR}{_NUMBER}_distance", between_rows=True),
    Observable("rises", "rise_deviations", "rises", ("rise",), 2,
               lambda noise, *_: noise.position,
               lambda of: [(f"{PAIR}{pair + 1}_height", "m") for pair in range(of.pairs)]
                          if of.space.size == 3 else [],
               ("target", "plane"), f"{PAIR}{_NUMBER}_height", between_rows=True),
    Observable("offsets", "offset_deviations", "offsets", ("offset",), 3,
               lambda noise, *_: noise.position,
               lambda of: [(f"{PAIR}{pair + 1}_{axis}", "m")
                           for pair in range(of.pairs) for axis in of.space.position],
               ("base", "target"), f"{PAIR}{_NUMBER}_[{{axes}}]", between_rows=True),
)
# fmt: on
PAIR_ROW = re.compile(f"{PAIR}{_NUMBER}_row", re.ASCII)
OBSERVABLES: Mapping[str, Observable] = {each.name: each for each in _ALL}


@record
class Circumstance:
    """What is known exactly of every row beside what was observed, and may be a covariate."""

    name: str  # the attribute of `Measurements` that holds it
    kind: str  # one of it, in words
    column: str  # its column, with the unit; of what every leg has, before its number
    # Whether every leg has one, which a table may give all by one column without a number.
    by_leg: bool = False
    by_axis: bool = False  # whether it is a vector in the frame of the measuring device
    # Behind the number or the axis in its columns; ``{reading}`` is that of the readings.
    unit: str = ""
    values: tuple[float, ...] = ()  # what it may be; empty for any number
    counts: bool = False  # whether it is a whole number, from 0

    @property
    def dimensions(self) -> int:
        """Of its array."""
        return 2 if self.by_leg or self.by_axis else 1

    def columns(self, of: Sizes) -> list[str]:
        """Columns that symkin writes."""
        own = [self.column]
        if self.by_leg:
            own = [f"{self.column}_{leg + 1}" for leg in range(of.legs)]
        elif self.by_axis:
            own = [f"{self.column}_{axis}" for axis in of.space.position]
        return [name + self.unit.format(reading=of.reading_unit) for name in own]


CIRCUMSTANCES: Mapping[str, Circumstance] = {
    each.name: each
    for each in (
        Circumstance("times", "time", "time_s"),
        Circumstance("temperatures", "temperature", "temperature_c"),
        Circumstance("sessions", "session", "session", counts=True),
        Circumstance("approaches", "approach", "approach", by_leg=True, values=(-1.0, 0.0, 1.0)),
        Circumstance("velocities", "velocity", "velocity", by_axis=True, unit="_m_s"),
        Circumstance("speeds", "speed", "speed", by_leg=True, unit="_{reading}_s"),
    )
}


def words_between_rows() -> set[str]:
    """What is observed between two rows, as the option `observe` calls it."""
    return {word for each in _ALL if each.between_rows for word in each.words}


def words_with(frame: str) -> set[str]:
    """What is observed that depends on one of the frames, as the option `observe` calls it."""
    return {word for each in _ALL if frame in each.frames for word in each.words}
