# SPDX-License-Identifier: MIT
"""Corrections of the table: units and conventions of poses."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from symkin.analysis.conventions import (
    ORDERS,
    fits_of,
    rotations_from_angles,
    taken_as,
    ways_of,
)
from symkin.data.columns import pose_column_names
from symkin.data.measured_rows import changed_arrays
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    poses_of,
    quaternions_from_rotation_vectors,
    roll_pitch_yaw,
    rotations_from_quaternions,
    transforms,
    vectors_from_quaternions,
    vectors_from_rotations,
)
from symkin.values import Array

_UNITS = {1e-3: "millimetres, not metres", 1e3: "a thousandth of what they should be"}
_RARER_UNITS = {
    1e-2: "centimetres, not metres",
    25.4e-3: "inches, not metres",
    10.0: "centimetres, not millimetres",
    25.4: "inches, not millimetres",
}
UNITS_OF_LENGTHS = (1.0, *_UNITS, *_RARER_UNITS)  # of what is taken for a metre
_SAYS = 3.0  # times the noise that heights are apart
_MIRRORED = " is mirrored"
_LEAST_TURNED = 6  # rows
_POSES = ("poses", "pose_deviations")
_LENGTHS = (
    *("points", "point_deviations", "distances", "distance_deviations"),
    *("heights", "height_deviations"),
)
_PLAINLY_OFF = 3.0  # times what the drawing and the noise leave of orientations
_BETTER = 1.5
_OTHER_END = "the base is told as the platform sees it, not the platform as the base does"
_AS_VECTORS = "give them as rotation vectors (rx, ry, rz) or quaternions (qx, qy, qz, qw)"


def with_readings(measured: Measurements, change: Callable[[Array], Array]) -> Measurements:
    """With other readings; their standard deviations change as differences of readings do."""
    changes: dict[str, Any] = {"readings": change(np.array(measured.readings))}
    if measured.reading_deviations is not None:
        nothing = np.zeros_like(measured.reading_deviations)
        moved = change(np.array(measured.reading_deviations)) - change(nothing)
        changes["reading_deviations"] = np.abs(moved)
    return dataclasses.replace(measured, **changes)


def edits_of_poses(stated: Correction) -> Iterator[Correction]:
    """Correct what was observed in another unit or convention."""
    yield from _in_units(stated, _UNITS)
    conventions = _conventions(stated.mechanism, stated.measurements.poses)
    mirrored = False
    for words, poses, remedy in conventions:
        if words.endswith(_MIRRORED) and _turns_freely(stated):
            if mirrored:  # which of the axes it is no frame tells
                continue
            mirrored = True
            words += ", or another axis, or two are exchanged: the axes are left-handed"
        yield from _with_poses(stated, words, poses, remedy)


def _turns_freely(stated: Correction) -> bool:
    """Whether the frames that are unknown do to poses what turned axes do."""
    space, frames = stated.mechanism.space, stated.options.frames
    oriented = np.isfinite(stated.measurements.poses[:, space.size :]).any()
    return "base" in frames and ("target" in frames or not space.turns or not oriented)


def _in_units(stated: Correction, units: Mapping[float, str]) -> Iterator[Correction]:
    for factor, unit in units.items():
        lengths = scaled(stated.measurements, factor)
        if lengths is not None and not _only_noise(stated, lengths):
            cause = Doubt("unit-of-lengths", size=1 / factor, figures={"unit": unit})
            yield stated._replace(cause=cause, measurements=lengths)


def _only_noise(stated: Correction, lengths: Measurements) -> bool:
    """Whether heights become so small that noise explains them, whatever is wrong."""
    heights = lengths.heights
    if heights is None or np.isfinite(lengths.poses).any() or lengths.distances is not None:
        return False
    return bool(np.nanstd(heights) < _SAYS * stated.model.noise.position)


def rarer_edits(stated: Correction) -> Iterator[Correction]:
    """Correct what is mistaken less often, and so not looked for beside another mistake."""
    nominal, poses = stated.mechanism, stated.measurements.poses
    yield from _angles(stated)
    yield from _in_units(stated, _RARER_UNITS)
    size, names = nominal.space.size, nominal.space.position
    oriented = np.isfinite(poses[:, size:]).any()
    exchanges = [] if _turns_freely(stated) and not oriented else range(size)
    for one, other in itertools.combinations(exchanges, 2):
        order = np.arange(poses.shape[1])
        order[[one, other]] = other, one
        words = f"{names[one]} and {names[other]} are exchanged"
        remedy = f"exchange the columns of {names[one]} and {names[other]}"
        yield from _with_poses(stated, words, poses[:, order], remedy)
    if oriented:
        for axis in range(size):
            signs = np.where(np.arange(poses.shape[1]) == axis, -1.0, 1.0)
            words = f"{names[axis]} has the opposite sign, but not the orientation"
            yield from _with_poses(stated, words, poses * signs, _negate(nominal, signs))
    for words, turned, remedy in _rarer_orientations(nominal, poses):
        yield from _with_poses(stated, words, turned, remedy)
    measured = np.isfinite(poses).all(axis=1)
    if nominal.space.moves and nominal.space.turns and measured.any():
        inverse, name = np.full_like(poses, np.nan), nominal.pose_space
        inverse[measured] = poses_of(name, taken_as("inverse", poses[measured], name))
        yield from _with_poses(stated, _OTHER_END, inverse, "invert them")


def _angles(stated: Correction) -> Iterator[Correction]:
    """Rotation vectors that are angles about axes in some order."""
    nominal, poses = stated.mechanism, stated.measurements.poses
    space, measured = nominal.space, np.isfinite(poses).all(axis=1)
    if not (space.has_quaternion and space.moves) or measured.sum() < _LEAST_TURNED:
        return
    vectors = vectors_from_quaternions(poses[:, space.size :])
    device = np.hstack([poses[:, : space.size], vectors])
    ways = ways_of(device[measured], space.name, triples=True)
    ways = [each for each in ways if each[:3] in ORDERS]
    if not measured.all():
        ways = _as_drawn(stated, device, ways)
    for way in ways:
        taken = np.full_like(poses, np.nan)
        meant = taken_as(way, device[measured], space.name)
        taken[measured] = poses_of(space.name, meant)
        words = f"the orientations are no rotation vectors, but angles {way}"
        yield from _with_poses(stated, words, taken, _AS_VECTORS)


def _as_drawn(stated: Correction, device: Array, ways: Sequence[str]) -> list[str]:
    """The way that fits the drawing, if one plainly does, where every way would be a fit."""
    nominal, readings = stated.mechanism, stated.measurements.readings
    space, read = nominal.space, np.isfinite(readings).all(axis=1)
    drawn = np.full((len(device), space.coordinates), np.nan)
    try:
        drawn[read] = nominal.forward_kinematics(readings[read])[0]
    except SymkinError:
        return []
    rows = np.isfinite(device).all(axis=1) & np.isfinite(drawn).all(axis=1)
    if rows.sum() < _LEAST_TURNED:
        return []
    asked = (device[rows], transforms(space.name, drawn[rows]), nominal.characteristic_length)
    (as_measured,) = fits_of(["as measured"], *asked, space.name)
    made = nominal.tolerances
    off = made.angle + made.length / nominal.characteristic_length + nominal.noise.orientation
    if as_measured.told.orientation_rms < _PLAINLY_OFF * off:
        return []  # no order of angles would leave so little
    best = fits_of(list(ways), *asked, space.name)[0].told
    return [best.convention] if best.cost * _BETTER <= as_measured.told.cost else []


def _with_poses(
    stated: Correction, convention: str, poses: Array, remedy: str
) -> Iterator[Correction]:
    if not np.array_equal(poses, stated.measurements.poses, equal_nan=True):
        made = dataclasses.replace(stated.measurements, poses=poses)
        cause = Doubt("convention-of-poses", figures={"convention": convention, "do": remedy})
        yield stated._replace(cause=cause, measurements=made)


def _negate(nominal: Mechanism, signs: Array) -> str:
    """What to do about columns that have the opposite sign."""
    names = (name.partition("_")[0] for name in pose_column_names(nominal.pose_space))
    wrong = [name for name, sign in zip(names, signs, strict=True) if sign < 0]
    return f"negate the column{'s' * (len(wrong) > 1)} of {', '.join(wrong)}"


def _conventions(nominal: Mechanism, poses: Array) -> Iterator[tuple[str, Array, str]]:
    """Ways in which poses may have been written down, and what to do about them."""
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
    conventions["schoenflies"] = {
        words: (*signs, -1 if words[0] in "xy" else 1) for words, signs in positions.items()
    }
    conventions["spatial"] = {
        words: positions.get(words, (1, 1, 1)) + signs for words, signs in rotations.items()
    }
    for words, factors in conventions[nominal.pose_space].items():
        signs = np.array(factors, dtype=float)
        yield words, poses * signs, _negate(nominal, signs)
    if nominal.space.has_angle:
        still, name = np.ones(nominal.space.size), nominal.space.rotation[0]
        signs = np.append(still, -1.0)
        yield "the angle has the opposite sign", poses * signs, _negate(nominal, signs)
        radians = poses * np.append(still, math.pi / 180)
        yield "angles are degrees, not radians", radians, f"name their column {name}_deg"
    if nominal.space.has_quaternion:
        position = nominal.space.size
        scalar_last = np.hstack([poses[:, :position], np.roll(poses[:, position:], -1, axis=1)])
        words = "the quaternions are in the order w, x, y, z"
        yield words, scalar_last, "name their columns qw, qx, qy, qz in that order"


def _rarer_orientations(nominal: Mechanism, poses: Array) -> Iterator[tuple[str, Array, str]]:
    """Ways in which orientations may have been written down, less often; as `_conventions`."""
    if nominal.space.has_angle:
        still, name = np.zeros(nominal.space.size), nominal.space.rotation[0]
        for quarter, side in ((math.pi / 2, "y"), (-math.pi / 2, "minus y")):
            words = f"the angle is counted from {side}, not x"
            remedy = f"{'add 90 degrees to' if quarter > 0 else 'take 90 degrees from'} {name}"
            yield words, poses + np.append(still, quarter), remedy
    size = nominal.space.size
    if not nominal.space.has_quaternion or not np.isfinite(poses[:, size:]).all():
        return
    own = rotations_from_quaternions(poses[:, size:])
    angles, inverse = roll_pitch_yaw(own), roll_pitch_yaw(own.transpose(0, 2, 1))
    vectors = "rotation vectors stand where roll, pitch and yaw are expected"
    reversed_order = "roll, pitch and yaw turn in the reversed order"
    for words, quaternions in (
        (vectors, quaternions_from_rotation_vectors(angles)),
        (reversed_order, _quaternions(rotations_from_angles(angles, "XYZ"))),
        (reversed_order, _quaternions(rotations_from_angles(-inverse, "xyz"))),
    ):
        yield words, np.hstack([poses[:, :size], quaternions]), _AS_VECTORS


def _quaternions(rotations: Array) -> Array:
    return quaternions_from_rotation_vectors(vectors_from_rotations(rotations))


def scaled(measured: Measurements, factor: float) -> Measurements | None:
    """With other lengths, but for what a controller reports; None without any that have a unit."""
    size = measured.space.size
    factors = np.ones(measured.poses.shape[1])
    factors[:size] = factor
    changes = changed_arrays(measured, lambda poses: poses * factors[: poses.shape[1]], *_POSES)
    changes |= changed_arrays(measured, lambda lengths: factor * lengths, *_LENGTHS)
    lengths = (
        np.abs(values[:, :size] if name == "poses" else values)
        for name, values in changes.items()
        if not name.endswith("_deviations")
    )
    known = np.concatenate([each[np.isfinite(each)] for each in lengths])
    # Heights where a probe touches are zero in any unit: a wrong one would only become small.
    if not len(known) or np.median(known) == 0:
        return None
    return dataclasses.replace(measured, **changes)
