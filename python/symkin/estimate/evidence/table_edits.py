# SPDX-License-Identifier: MIT
"""Corrections of the table: rows that do not belong together, units and conventions of poses."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.conventions import ORDERS, fits_of, taken_as, ways_of
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction
from symkin.model.mechanism import Mechanism
from symkin.model.poses import poses_of, transforms, vectors_from_quaternions

__all__ = ["edits_of_poses", "rarer_edits", "with_readings"]

Array = NDArray[np.float64]

_LATE = 3  # rows, of all readings
_LATE_ALONE = 2  # of one leg's
_LEAST_TURNED = 6  # rows
_PLAINLY_OFF = 3.0  # times what the drawing and the noise leave of orientations
_BETTER = 1.5
_FAR = 30.0  # times as far out as the drawing has it: in another unit


def with_readings(measured: Measurements, change: Callable[[Array], Array]) -> Measurements:
    """With other readings; their standard deviations change as differences of readings do."""
    changes: dict[str, Array] = {"readings": change(np.array(measured.readings))}
    if measured.reading_deviations is not None:
        nothing = np.zeros_like(measured.reading_deviations)
        moved = change(np.array(measured.reading_deviations)) - change(nothing)
        changes["reading_deviations"] = np.abs(moved)
    return dataclasses.replace(measured, **changes)  # type: ignore[arg-type]


def _edits_of_rows(stated: Correction) -> Iterator[Correction]:
    """Readings that stand some rows late or early, of all legs or of one."""
    measured = stated.measurements
    count, legs = measured.readings.shape
    if (measured.leg_sets >= 0).any() or count <= 2 * _LATE:
        return
    every = tuple(range(legs))
    for size in range(1, _LATE + 1):
        for late in (size, -size):
            sets = [every, *((leg,) for leg in every if size <= _LATE_ALONE)]
            for own in sets:
                rows = np.arange(max(0, -late), count - max(0, late))
                at = measured.subset(rows)
                from_rows = measured.subset(rows + late)
                readings = np.array(at.readings)
                readings[:, own] = from_rows.readings[:, own]
                changes = {"readings": readings}
                if measured.reading_deviations is not None:
                    deviations = np.array(at.reading_deviations)
                    deviations[:, own] = np.asarray(from_rows.reading_deviations)[:, own]
                    changes["reading_deviations"] = deviations
                n, way = abs(late), "late" if late > 0 else "early"
                figures = {"shift": f"{n} row{'s' * (n > 1)} {way}"}
                yield stated._replace(
                    cause=Doubt("rows-shifted", own, size=float(late), figures=figures),
                    measurements=dataclasses.replace(at, **changes),  # type: ignore[arg-type]
                )


def _blocks(stated: Correction) -> Correction | None:
    """Some rows whose positions are far beyond those of most, as if in millimetres."""
    measured = stated.measurements
    positions = measured.poses[:, : measured.space.size]
    if not np.isfinite(positions).any():
        return None
    size = np.linalg.norm(positions, axis=1)
    if np.nanmax(size, initial=0.0) <= _FAR * np.nanmedian(size):
        return None  # all in one unit, whichever that is
    try:
        drawn = stated.mechanism.forward_kinematics(measured.readings)[0]
    except SymkinError:
        return None
    drawn_size = np.linalg.norm(drawn[:, : measured.space.size], axis=1)
    usual = np.nanmedian(drawn_size) if np.isfinite(drawn_size).any() else np.inf
    far = size > _FAR * np.where(np.isfinite(drawn_size), drawn_size, usual)
    if not far.any() or far[np.isfinite(size)].all():
        return None
    poses = np.array(measured.poses)
    poses[far, : measured.space.size] *= 1e-3
    rows = tuple(measured.row_numbers[far].tolist())
    return stated._replace(
        cause=Doubt("rows-in-another-unit", rows=rows, figures={"unit": "millimetres"}),
        measurements=dataclasses.replace(measured, poses=poses),
    )


def edits_of_poses(stated: Correction) -> Iterator[Correction]:
    """Correct what was observed in another unit or convention."""
    measured = stated.measurements
    for factor, unit in ((1e-3, "millimetres"), (1e3, "a thousandth of what they should be")):
        lengths = _scaled(measured, factor)
        if lengths is not None:
            figures = {"unit": unit + ", not metres" * (factor < 1)}
            cause = Doubt("unit-of-lengths", size=1 / factor, figures=figures)
            yield stated._replace(cause=cause, measurements=lengths)
    for convention, poses in _conventions(stated.mechanism, measured.poses):
        yield from _with_poses(stated, convention, poses)


def rarer_edits(stated: Correction) -> Iterator[Correction]:
    """Correct what is mistaken less often, and so not looked for beside another mistake."""
    yield from _edits_of_rows(stated)
    nominal, poses = stated.mechanism, stated.measurements.poses
    yield from _angles(stated)
    blocks = _blocks(stated)
    if blocks is not None:
        yield blocks
    size, names = nominal.space.size, nominal.space.position
    for one, other in itertools.combinations(range(size), 2):
        order = np.arange(poses.shape[1])
        order[[one, other]] = other, one
        words = f"{names[one]} and {names[other]} are exchanged"
        yield from _with_poses(stated, words, poses[:, order])
    if np.isfinite(poses[:, size:]).any():
        for axis in range(size):
            signs = np.where(np.arange(poses.shape[1]) == axis, -1.0, 1.0)
            words = f"{names[axis]} has the opposite sign, but not the orientation"
            yield from _with_poses(stated, words, poses * signs)


def _angles(stated: Correction) -> Iterator[Correction]:
    """Rotation vectors that are angles about axes in some order, where that fits the drawing."""
    nominal, poses = stated.mechanism, stated.measurements.poses
    space, read = nominal.space, np.isfinite(stated.measurements.readings).all(axis=1)
    if not (space.has_quaternion and space.moves) or not read.any():
        return
    drawn = np.full_like(poses, np.nan)
    try:
        drawn[read] = nominal.forward_kinematics(stated.measurements.readings[read])[0]
    except SymkinError:
        return
    measured = np.isfinite(poses).all(axis=1)
    rows = measured & np.isfinite(drawn).all(axis=1)
    if rows.sum() < _LEAST_TURNED:
        return
    vectors = vectors_from_quaternions(poses[:, space.size :])
    device = np.hstack([poses[:, : space.size], vectors])
    asked = (device[rows], transforms(space.name, drawn[rows]), nominal.characteristic_length)
    (as_measured,) = fits_of(["as measured"], *asked, space.name)
    made = nominal.tolerances
    off = made.angle + made.length / nominal.characteristic_length + nominal.noise.orientation
    if as_measured.told.orientation_rms < _PLAINLY_OFF * off:
        return  # no order of angles would leave so little
    best = fits_of(ways_of(device[rows], space.name, triples=True), *asked, space.name)[0].told
    if best.cost * _BETTER > as_measured.told.cost or best.convention[:3] not in ORDERS:
        return
    taken = np.full_like(poses, np.nan)
    meant = taken_as(best.convention, device[measured], space.name)
    taken[measured] = poses_of(space.name, meant)
    words = f"the orientations are no rotation vectors, but angles {best.convention}"
    yield from _with_poses(stated, words, taken)


def _with_poses(stated: Correction, convention: str, poses: Array) -> Iterator[Correction]:
    if not np.array_equal(poses, stated.measurements.poses, equal_nan=True):
        made = dataclasses.replace(stated.measurements, poses=poses)
        cause = Doubt("convention-of-poses", figures={"convention": convention})
        yield stated._replace(cause=cause, measurements=made)


def _conventions(nominal: Mechanism, poses: Array) -> Iterator[tuple[str, Array]]:
    """Ways in which poses may have been written down."""
    # A mirrored rotation keeps the component of its axis along the mirror's normal.
    rotations: dict[str, tuple[int, ...]] = {
        "x is mirrored": (1, -1, -1, 1),
        "y is mirrored": (-1, 1, -1, 1),
        "z is mirrored": (-1, -1, 1, 1),
        "the quaternions turn the other way (base to platform)": (-1, -1, -1, 1),
    }
    conventions: dict[str, dict[str, tuple[int, ...]]] = {
        "planar": {"y is mirrored": (1, -1, -1), "x is mirrored": (-1, 1, -1)},
        "point": {"y is mirrored": (1, -1), "x is mirrored": (-1, 1)},
        "translating": {
            "x is mirrored": (-1, 1, 1),
            "y is mirrored": (1, -1, 1),
            "z is mirrored": (1, 1, -1),
        },
        "spherical": rotations,
    }
    positions = conventions["translating"]
    conventions["spatial"] = {
        words: positions.get(words, (1, 1, 1)) + signs for words, signs in rotations.items()
    }
    for words, factors in conventions[nominal.pose_space].items():
        yield words, poses * np.array(factors, dtype=float)
    if nominal.pose_space == "planar":
        yield "the angle has the opposite sign", poses * np.array([1.0, 1.0, -1.0])
        yield "angles are degrees, not radians", poses * np.array([1.0, 1.0, math.pi / 180])
    if nominal.space.has_quaternion:
        position = nominal.space.size
        scalar_last = np.hstack([poses[:, :position], np.roll(poses[:, position:], -1, axis=1)])
        yield "the quaternions are in the order w, x, y, z", scalar_last


def _scaled(measured: Measurements, factor: float) -> Measurements | None:
    """With other lengths, but for what a controller reports; None without any that have a unit."""
    size = measured.space.size
    changes: dict[str, Array] = {}
    for name in ("poses", "pose_deviations"):
        if getattr(measured, name) is not None:
            changes[name] = np.array(getattr(measured, name))
            changes[name][:, :size] *= factor
    for kind in ("point", "distance", "height"):
        for name in (f"{kind}s", f"{kind}_deviations"):
            if getattr(measured, name) is not None:
                changes[name] = factor * getattr(measured, name)
    lengths = (
        np.abs(values[:, :size] if name == "poses" else values)
        for name, values in changes.items()
        if not name.endswith("_deviations")
    )
    known = np.concatenate([each[np.isfinite(each)] for each in lengths])
    # Heights where a probe touches are zero in any unit: a wrong one would only become small.
    if not len(known) or np.median(known) == 0:
        return None
    return dataclasses.replace(measured, **changes)  # type: ignore[arg-type]
