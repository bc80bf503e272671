# SPDX-License-Identifier: MIT
"""Points that were seen on a platform as poses of it, whose mistakes are corrected more easily."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.reflectors import (
    body_of,
    in_three,
    motions_of,
    orders_of_points,
    whole,
)
from symkin.analysis.seen import Seen
from symkin.data.measured_rows import changed_arrays
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.table_edits import UNITS_OF_LENGTHS
from symkin.estimate.options import EstimateOptions
from symkin.model.mechanism import Mechanism
from symkin.model.poses import Transform, poses_of
from symkin.model.settings import Frames, NoiseSettings
from symkin.values import Array

_FAR = 5.0  # times as large as the same body in other rows: in another unit
_LEAST = 0.25  # of the rows are in the unit that is taken for the usual one
_OF_POINTS = ("base.", "target.", "point")
_SEEN = ("points", "point_deviations", "point_correlations")


class AsPoses(NamedTuple):
    """A table of points as one of poses of the body that they make, wherever that is.

    Attributes
    ----------
    mechanism : Mechanism
        Without places of points.
    measurements : Measurements
        With the poses, and no points.
    options : EstimateOptions
        With their frames unknown, and the noise of the poses.
    seen : Measurements
        The points.
    """

    mechanism: Mechanism
    measurements: Measurements
    options: EstimateOptions
    seen: Measurements

    @classmethod
    def of(
        cls, mechanism: Mechanism, measured: Measurements, options: EstimateOptions
    ) -> Self | None:
        """None where points are not all that was measured, or do not make a body."""
        space = mechanism.space
        shown = Seen.of(measured)
        if not shown.tracked or shown.turn:
            return None
        assert measured.points is not None
        points = in_three(measured.points)
        larger = _times_as_large(points)[:, None]
        body = body_of(points / larger[:, None], space) if space.turns else np.zeros_like(points[0])
        if body is None:
            return None
        motions = motions_of(points / larger[:, None], body, space)
        known = whole(motions.translation) & whole(points.reshape(len(points), -1))
        poses = np.full_like(measured.poses, np.nan)
        poses[known] = poses_of(
            space.name, Transform(motions.rotation[known], (motions.translation * larger)[known])
        )
        frames, given = mechanism.frames or Frames(), options.frames
        unknown = ("base",) * ("base" in given or not frames.base) + ("target",) * space.turns
        return cls(
            mechanism.replace(frames=dataclasses.replace(frames, points=())),
            dataclasses.replace(measured, poses=poses, points=None, point_deviations=None),
            dataclasses.replace(
                options,
                frames=unknown,
                fixed=tuple(each for each in options.fixed if not each.startswith(_OF_POINTS)),
                noise=_noise_of(mechanism, measured, options, body, motions.translation),
            ),
            measured,
        )

    def told(self, cause: Doubt) -> Doubt | None:
        """A mistake of the poses in words of the points; None of what points do not have."""
        then = tuple(self.told(each) for each in cause.then)
        if None in then:
            return None
        figures = cause.figures
        if cause.code == "convention-of-poses":
            axis, mirrored, _ = str(figures["convention"]).partition(" is mirrored")
            if not mirrored:
                return None
            figures = {**figures, "do": f"negate the columns of {axis} of all points"}
        kept = tuple(each for each in then if each is not None)
        return dataclasses.replace(cause, figures=figures, then=kept)

    def table(self, cause: Doubt, corrected: Measurements) -> Measurements | None:
        """The points as a table of poses is corrected, if their readings or units are."""
        rows = np.flatnonzero(np.isin(self.seen.row_numbers, corrected.row_numbers))
        kept, before = self.seen.subset(rows), self.measurements.subset(rows).poses
        points, factors = kept.points, np.ones(len(rows))
        assert points is not None
        if cause.code in ("unit-of-lengths", "rows-in-another-unit"):
            size = before.shape[1] if not kept.space.size else kept.space.size
            own, other = (
                np.linalg.norm(each[:, :size], axis=1) for each in (corrected.poses, before)
            )
            factors = np.where(np.isfinite(own), own / other, 1.0)
        elif not np.array_equal(corrected.poses, before, equal_nan=True):
            return None
        return dataclasses.replace(
            kept,
            points=points * factors[:, None, None],
            readings=corrected.readings,
            reading_deviations=corrected.reading_deviations,
        )


def exchanged_points(mechanism: Mechanism, measured: Measurements) -> Iterator[Doubt]:
    """Points that stand in each other's columns, by the distances among them."""
    if measured.points is None:
        return
    order = _order_of_points(mechanism, measured)
    moved = order != np.arange(order.shape[1])
    if (rows := moved.any(axis=1)).any():
        which = np.flatnonzero(moved.any(axis=0)) + 1
        numbers = tuple(measured.row_numbers[rows].tolist())
        figures = {"which": ", ".join(map(str, which.tolist())), "n": "s" * (len(numbers) > 1)}
        yield Doubt("points-exchanged", (), numbers, figures=figures)


def with_points_in_order(mechanism: Mechanism, measured: Measurements) -> Measurements:
    """The measurements with the points as `exchanged_points` says that they are."""
    places = np.argsort(_order_of_points(mechanism, measured), axis=1)
    rows = np.arange(len(places))[:, None]
    ordered = changed_arrays(measured, lambda given: given[rows, places], *_SEEN)
    return dataclasses.replace(measured, **ordered)


def _order_of_points(mechanism: Mechanism, measured: Measurements) -> NDArray[np.intp]:
    """Which point each column has, by row; by the places on the platform where they are given."""
    assert measured.points is not None
    places = (mechanism.frames or Frames()).points
    known = len(places) == measured.points.shape[1] and all(places)
    body = in_three(np.array(places)) if known else None
    return orders_of_points(in_three(measured.points), body)


def with_another_point(measured: Measurements, point: int, rows: NDArray[np.bool_]) -> Measurements:
    """With a point in some rows as another one, the last, and not seen there as itself."""

    def apart(given: Array) -> Array:
        both = np.concatenate([given, given[:, [point]]], axis=1)
        both[rows, point], both[~rows, -1] = np.nan, np.nan
        return both

    return dataclasses.replace(measured, **changed_arrays(measured, apart, *_SEEN))


def _times_as_large(points: Array) -> Array:
    """How large the points' distances are in each row, over those of most; 1 unless that is far."""
    if points.shape[1] < 2:
        return np.ones(len(points))
    pairs = itertools.combinations(range(points.shape[1]), 2)
    distances = np.stack(
        [np.linalg.norm(points[:, i] - points[:, j], axis=1) for i, j in pairs], axis=1
    )
    seen = np.isfinite(distances).any(axis=1)
    times = np.ones(len(points))
    usual = np.nanquantile(distances[seen], _LEAST, axis=0)
    times[seen] = np.nanmedian(distances[seen] / usual, axis=1)
    return np.where(np.abs(np.log(times)) > np.log(_FAR), times, 1.0)


def _noise_of(
    mechanism: Mechanism,
    measured: Measurements,
    options: EstimateOptions,
    body: Array,
    places: Array,
) -> NoiseSettings:
    """Of the middle of the points, and of a turn about it."""
    declared = options.noise if isinstance(options.noise, NoiseSettings) else mechanism.noise
    assert measured.points is not None
    unit = _unit_of(mechanism, measured.readings, places)
    arms = unit * np.sqrt(np.square(body).sum() * (2 / 3 if mechanism.space.in_space else 1))
    away = unit * np.linalg.norm(measured.points, axis=2)
    own = float(np.sqrt(np.nanmedian(declared.at(away) ** 2 + declared.along_at(away) ** 2) / 2))
    if measured.point_deviations is not None and np.isfinite(measured.point_deviations).any():
        own = float(np.sqrt(np.nanmean(measured.point_deviations**2)))
    return NoiseSettings(
        position=own / np.sqrt(len(body)),
        orientation=own / arms if arms else own,
        reading=declared.reading,
    )


def _unit_of(mechanism: Mechanism, readings: Array, places: Array) -> float:
    """In metres, by how far places are apart where the drawing is at the readings."""
    try:
        drawn = mechanism.forward_kinematics(readings)[0][:, : mechanism.space.size]
    except SymkinError:
        return 1.0
    sizes = [
        float(np.nanmedian(np.linalg.norm(each - np.nanmedian(each, axis=0), axis=1)))
        for each in (places[np.isfinite(places).all(axis=1)], drawn[np.isfinite(drawn).all(axis=1)])
        if len(each) and each.shape[1]
    ]
    if len(sizes) < 2 or min(sizes) <= 0:
        return 1.0
    return min(UNITS_OF_LENGTHS, key=lambda unit: abs(np.log(unit * sizes[0] / sizes[1])))
