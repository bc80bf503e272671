# SPDX-License-Identifier: MIT
"""Commanded and attained poses of a table, and how well the device knows their difference."""

from __future__ import annotations

import copy
import math

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.reflectors import motions_of, turning
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
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
from symkin.model.settings import NoiseSettings

__all__ = ["Tested"]

Array = NDArray[np.float64]


class Tested:
    """Commanded and attained poses, row by row, in the device's frame."""

    def __init__(self, model: Mechanism, table: Measurements, noise: NoiseSettings) -> None:
        space = model.space
        read = np.isfinite(table.readings).all(axis=1)
        place = np.isfinite(table.poses[:, : space.size]).all(axis=1) & space.moves
        turn = np.isfinite(table.poses[:, space.size :]).all(axis=1) & space.turns
        self.unread = int((~read).sum())
        self.unmeasured = int((read & ~(place | turn)).sum())
        kept = np.flatnonzero(read & (place | turn))
        if not len(kept):
            origin = f"{table.source}: " if table.source else ""
            raise SymkinError(
                f"{origin}no row has readings of all legs and a measured position or orientation, "
                "so none can be tested"
            )
        table.require_table(model.sensor_table)
        poses, taken = model.forward_kinematics(table.readings[kept])
        self.failed = tuple(table.row_numbers[kept[~taken]].tolist())
        if not taken.any():
            raise SymkinError(f'mechanism "{model.name}" can take none of the {len(kept)} rows')
        self.model, self.noise = model, noise
        self.table = table.subset(kept[taken])
        self.own = poses[taken]
        self.commanded = framed(model, self.own)
        self.numbers = self.table.row_numbers
        self.errors = self._errors()

    @property
    def coordinates(self) -> Array:
        """Position and angle or rotation vector of the commanded poses in the robot's frame."""
        motions = transforms(self.model.pose_space, self.own)
        still = np.broadcast_to(STAYS.rotation, motions.rotation.shape)
        tangents = between(Transform(still, STAYS.translation), motions)
        return np.asarray(tangents[:, self.model.space.components])

    def distances(self, length: float) -> Array:
        """Coordinates of which distances mean something: rotations at the characteristic length."""
        scale = np.ones(self.model.space.dof)
        scale[self.model.space.size :] = length
        return np.asarray(self.coordinates * scale)

    def part(self, kind: str) -> Array:
        """Errors of the position or of the orientation; NaN where it was not measured."""
        size = self.model.space.size
        return self.errors[:, :size] if kind == "position" else self.errors[:, size:]

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
        columns = slice(None, size) if kind == "position" else slice(size, None)
        declared = self.table.standard_deviations(self.noise)["poses"]
        found = np.sqrt(declared[:, columns] ** 2 + self._of_readings()[:, columns])
        return np.where(np.isfinite(self.part(kind)).all(axis=1, keepdims=True), found, np.nan)

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
        return made, len(space.frame_components)

    def of_model(self, model: Mechanism) -> dict[str, float]:
        """Root mean squares of another model at the same rows; NaN where it cannot take one."""
        poses, taken = model.forward_kinematics(self.table.readings)
        if not taken.all():
            return {"position": math.nan, "orientation": math.nan}
        other = self._commanding(framed(self.model, poses))
        found = {}
        for kind in ("position", "orientation"):
            part = other.part(kind)
            known = part[np.isfinite(part).all(axis=1)] if part.size else part
            found[kind] = float(np.sqrt(np.sum(known**2) / len(known))) if known.size else math.nan
        return found

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
        turned = np.isfinite(self.table.poses[:, space.size :]).all(axis=1) & space.turns
        if turned.any():
            # Positions that were not measured have no part in how far it turned.
            attained = np.nan_to_num(self.table.poses[turned])
            tangents = between(transforms(name, self.commanded[turned]), transforms(name, attained))
            errors[turned, space.size :] = tangents[:, space.components][:, space.size :]
        return errors

    def _of_readings(self) -> Array:
        """Variances of the commanded pose that the readings' noise makes, (N, dof)."""
        model = self.model
        variances = np.full(self.table.readings.shape, self.noise.reading**2)
        own = self.table.reading_deviations
        if own is not None:
            variances = np.where(np.isfinite(own), own**2, variances)
        if not variances.any():
            return np.zeros((len(self.own), model.space.dof))
        by_readings = np.linalg.pinv(model.pose_jacobian(self.own))
        moves = np.zeros((len(self.own), 6, by_readings.shape[2]))
        moves[:, model.space.components] = by_readings
        target = frame(model.pose_space, (model.frames.target if model.frames else ()))
        arms = transforms(model.pose_space, self.own).rotation @ target.translation
        moves[:, :3] += np.cross(moves[:, 3:], arms[:, :, None], axis=1)
        squares = np.einsum("nij,nj->ni", moves**2, variances)
        # Along other axes in the device's frame, but as large together.
        for part in (slice(None, 3), slice(3, None)):
            shown = [each for each in model.space.components if part.indices(6)[0] <= each]
            shown = [each for each in shown if each < part.indices(6)[1]]
            if shown:
                squares[:, shown] = squares[:, shown].mean(axis=1, keepdims=True)
        return np.asarray(squares[:, model.space.components])
