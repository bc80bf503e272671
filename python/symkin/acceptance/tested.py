# SPDX-License-Identifier: MIT
"""Commanded and attained poses of a table, and how well the device knows their difference."""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

import numpy as np

from symkin.analysis.promises import variances_by_readings
from symkin.analysis.reflectors import in_three, motions_of, turning
from symkin.analysis.seen import Seen
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.survey import check_coordinates
from symkin.model.framing import framed
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    STAYS,
    Transform,
    between,
    frame,
    poses_of,
    transforms,
)
from symkin.model.settings import Frames, NoiseSettings, height_of_bed
from symkin.options import Coordinates
from symkin.values import Array


class Tested:
    """Commanded and attained poses, row by row, in the device's frame.

    Where points of the platform were measured instead, each of them is a position of its own. Where
    errors of the position are `of` some coordinates, the others count as none.
    """

    def __init__(
        self,
        model: Mechanism,
        table: Measurements,
        noise: NoiseSettings,
        of: Coordinates | None = None,
    ) -> None:
        space = model.space
        heights = table.heights if of == "height" else None
        self._by_heights = heights is not None
        points = None
        if Seen.of(table).tracked:
            table, points = positions_of_points(model, table)
        read = np.isfinite(table.readings).all(axis=1)
        place = np.isfinite(table.poses[:, : space.size]).all(axis=1) & space.moves
        if heights is not None:
            place = np.isfinite(heights)
        turn = np.isfinite(table.poses[:, space.size :]).all(axis=1) & space.turns
        self.unread = int((~read).sum())
        self.unmeasured = int((read & ~(place | turn)).sum())
        kept = np.flatnonzero(read & (place | turn))
        if not len(kept):
            raise SymkinError(
                f"{table.origin}no row has readings of all legs and a measured position or "
                "orientation, so none can be tested"
            )
        table.require_table(model.sensor_table)
        poses, taken = model.forward_kinematics(table.readings[kept])
        self.failed = tuple(table.row_numbers[kept[~taken]].tolist())
        if not taken.any():
            raise SymkinError(f'mechanism "{model.name}" can take none of the {len(kept)} rows')
        self.model, self.noise = model, noise
        self._axes, self._along = _counting(model, of)
        self._is_height = of == "height"
        self.table = table.subset(kept[taken])
        self.own = poses[taken]
        self._moved = STAYS
        self._points = None if points is None else points[kept[taken]]
        self.commanded = self._framed(self.own)
        self.numbers = self.table.row_numbers
        self.errors = self._errors()

    @property
    def coordinates(self) -> Array:
        """Position and angle or rotation vector of the commanded poses in the robot's frame."""
        motions = transforms(self.model.pose_space, self.own)
        still = np.broadcast_to(STAYS.rotation, motions.rotation.shape)
        tangents = between(Transform(still, STAYS.translation), motions)
        return np.asarray(tangents[:, self.model.space.components])

    def distances(self, length: float, *, of_points: bool = True) -> Array:
        """Coordinates of which distances mean something: rotations at the characteristic length.

        Of points that were measured those of each, or else of the poses that they were seen at.
        """
        scale = np.ones(self.model.space.dof)
        scale[self.model.space.size :] = length
        coordinates = self.coordinates.copy()
        if of_points and self._points is not None:  # of which every one is somewhere else
            there = transforms(self.model.pose_space, self.commanded).translation
            coordinates[:, : self.model.space.size] = there[:, : self.model.space.size]
        return np.asarray(coordinates * scale)

    def part(self, kind: str) -> Array:
        """Errors of the position or of the orientation; NaN where it was not measured."""
        if kind == "position":
            return self.errors[:, self._axes]
        return self.errors[:, self.model.space.size :]

    def errors_of(self, kind: str) -> Array:
        """The same, of the rows where it was measured."""
        part = self.part(kind)
        known = part[np.isfinite(part).all(axis=1)]
        if not len(known):
            raise SymkinError(f"no row has a measured {kind}, of which a tolerance is given")
        return known

    def uncertainty(self, kind: str) -> Array:
        """Standard uncertainties like `part`, where it was measured; along the axes of the noise.

        Those of the measurements, with the distance from the device where they grow with it, and of
        the readings.
        """
        size = self.model.space.size
        if kind == "position" and self._along is not None:
            return self._uncertainty_along(self._along)
        columns = slice(None, size) if kind == "position" else slice(size, None)
        declared = self.table.standard_deviations(self.noise)["poses"]
        of_readings = variances_by_readings(
            self.model, self.table, self.own, self.noise.reading, self._points
        )
        found = np.sqrt(declared[:, columns] ** 2 + of_readings[:, columns])
        return np.where(np.isfinite(self.part(kind)).all(axis=1, keepdims=True), found, np.nan)

    def _uncertainty_along(self, along: Array) -> Array:
        """Standard uncertainties of the position along some directions of the robot's frame."""
        deviations = self.table.coordinate_deviations(self.noise)
        if self._by_heights:
            squares = deviations["heights"].reshape(-1, 1) ** 2
        else:
            size = self.model.space.size
            seen = (along @ self._base.rotation.T)[:, :size]
            squares = deviations["poses"][:, :size] ** 2 @ (seen**2).T
        squares = squares + variances_by_readings(
            self.model, self.table, self.own, self.noise.reading, self._points, along
        )
        return np.where(np.isfinite(self.part("position")), np.sqrt(squares), np.nan)

    @property
    def _base(self) -> Transform:
        frames = self.model.frames
        return frame(self.model.pose_space, frames.base if frames else ())

    def with_own_base(self) -> tuple[Tested, int]:
        """Fit the device's frame to the table; and of how many coordinates it takes account."""
        space, size = self.model.space, self.model.space.size
        name = self.model.pose_space
        known = np.isfinite(self.table.poses[:, :size]).all(axis=1)
        least = 2 if size == 2 else 3
        if not space.moves or known.sum() <= least:
            raise SymkinError(
                f"{known.sum()} rows have a measured position; expected more than {least} to fit "
                "the device's frame to"
            )
        wanted = transforms(name, self.commanded[known]).translation
        seen = np.zeros_like(wanted)
        seen[:, :size] = self.table.poses[known, :size]
        (rotation,), (translation,) = motions_of(seen[None], wanted, turning(space))
        if not np.isfinite(rotation).all():
            raise SymkinError(
                "the measured positions do not show how the device's frame is turned; measure "
                "poses that do not lie in a line"
            )
        moved = Transform(rotation, translation)
        made = self._commanding(poses_of(name, moved @ transforms(name, self.commanded)))
        made._moved = moved
        return made, len(space.frame_components)

    @property
    def moved_back(self) -> Measurements:
        """The positions that were measured, as seen from where the device was before."""
        size = self.model.space.size
        poses = np.full_like(self.table.poses, np.nan)
        moved = self._moved
        seen = self.table.poses[:, :size] - moved.translation[:size]
        poses[:, :size] = seen @ moved.rotation[:size, :size]
        return dataclasses.replace(self.table, poses=poses)

    def _framed(self, poses: Array) -> Array:
        """Poses of the platform as those of the target, or of the points, in the device's frame."""
        if self._points is None:
            return framed(self.model, poses)
        name = self.model.pose_space
        still = np.broadcast_to(STAYS.rotation, (len(poses), 3, 3))
        return poses_of(name, self._base @ transforms(name, poses) @ Transform(still, self._points))

    def _commanding(self, commanded: Array) -> Tested:
        """The same measurements, of other commanded poses."""
        made = copy.copy(self)
        made.commanded = commanded
        made.errors = made._errors()
        return made

    def _errors(self) -> Array:
        """Attained less commanded, shape (N, dof)."""
        space, name = self.model.space, self.model.pose_space
        errors = np.full((len(self.commanded), space.dof), np.nan)
        errors[:, : space.size] = (
            self.table.poses[:, : space.size]
            - transforms(name, self.commanded).translation[:, : space.size]
        )
        if self._by_heights:
            errors[:, : space.size] = 0
            assert self.table.heights is not None
            errors[:, 2] = self.table.heights - self._heights()
        elif self._is_height:
            assert self._along is not None
            above = errors[:, : space.size] @ self._base.rotation @ self._along[0]
            errors[:, : space.size] = np.where(np.isnan(above), np.nan, 0)[:, None]
            errors[:, 2] = above
        elif self._along is not None:
            others = np.setdiff1d(np.arange(space.size), self._axes)
            errors[:, others] *= 0
        turned = np.isfinite(self.table.poses[:, space.size :]).all(axis=1) & space.turns
        if turned.any():
            # Positions that were not measured have no part in how far it turned.
            attained = np.nan_to_num(self.table.poses[turned])
            tangents = between(transforms(name, self.commanded[turned]), transforms(name, attained))
            errors[turned, space.size :] = tangents[:, space.components][:, space.size :]
        return errors

    def _heights(self) -> Array:
        """Of the target above the bed, as commanded."""
        frames, name = self.model.frames or Frames(), self.model.pose_space
        places = (transforms(name, self.own) @ frame(name, frames.target)).translation
        plane = frames.plane or (0.0, 0.0, 0.0)
        above = places[:, 2] - height_of_bed(plane, places)
        return np.asarray(above / np.linalg.norm([1.0, *plane[1:3]]))


def _counting(model: Mechanism, of: Coordinates | None) -> tuple[list[int], Array | None]:
    """Columns of errors of the position, and along which directions of the robot's frame they are.

    No directions where all of them count.
    """
    check_coordinates(model, of)
    frames, name = model.frames or Frames(), model.pose_space
    if of is None:
        return [*range(model.space.size)], None
    if of == "height":
        slopes = (frames.plane or (0.0, 0.0, 0.0))[1:3]
        up = np.array([*(-each for each in slopes), 1.0])
        return [2], up[None] / np.linalg.norm(up)
    axes = ["xyz".index(axis) for axis in of]
    return axes, frame(name, frames.base).rotation[axes]


def positions_of_points(model: Mechanism, table: Measurements) -> tuple[Measurements, Array]:
    """A table whose rows are the points that were seen, and where they are on the platform."""
    assert table.points is not None
    places = model.frames.points if model.frames else ()
    if len(places) < table.points.shape[1] or not all(places):
        raise SymkinError(
            f"{table.points.shape[1]} points were measured, of which the mechanism does not say "
            "where they are on the platform; expected points in its [frames], as calibrated.toml "
            "has them"
        )
    size = model.space.size
    rows, which = np.nonzero(np.isfinite(table.points).all(axis=2))
    poses = np.full((len(rows), table.poses.shape[1]), np.nan)
    poses[:, :size] = table.points[rows, which]
    observed: dict[str, Any] = {}
    if table.point_deviations is not None:
        own = np.full((len(rows), model.space.dof), np.nan)
        own[:, :size] = table.point_deviations[rows, which]
        observed["pose_deviations"] = own
    if table.reading_deviations is not None:
        observed["reading_deviations"] = table.reading_deviations[rows]
    made = Measurements(
        poses,
        table.readings[rows],
        table.leg_sets[rows],
        table.row_numbers[rows],
        reading_unit=table.reading_unit,
        pose_space=table.pose_space,
        sensor_table=table.sensor_table,
        source=table.source,
        **observed,
    )
    return made, in_three(np.array(places))[which]
