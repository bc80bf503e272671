# SPDX-License-Identifier: MIT
"""How devices mean their poses: the ways of taking them, and which of these fits a robot."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np

from symkin.analysis.frame_fit import align
from symkin.errors import SymkinError
from symkin.model.poses import (
    POSE_SPACES,
    Transform,
    between,
    moved,
    nearest_rotation,
    rotations_from_vectors,
    transforms,
    vectors_from_rotations,
)
from symkin.values import Array, Value, evenly, field, record

Convention = Literal["as measured", "inverse", "conjugate", "scalar first", "mirrored"]

# Axes of three angles: each as it has turned, or (small letters) fixed ones.
ORDERS = tuple(
    "".join(order)
    for letters in ("XYZ", "xyz")
    for order in itertools.product(letters, repeat=3)
    if order[0] != order[1] != order[2]
)
# The same where columns are not in the order of the turns, nor in the reverse; small letters would
# say it again.
_ELSEWHERE = tuple(
    f"{order} from columns {''.join(columns)}"
    for order in ORDERS
    if order.isupper()
    for columns in itertools.permutations("123")
    if columns[1] != "2"
)
_FEW = 10  # poses that decide which ways are looked at with all of them
_KEPT = 8
_BRIEFLY, _WHOLLY = 6, 50  # steps of a fit
_TURN = 2 * math.pi


@record
class ConventionFit(Value):
    """How well the measured poses fit, taken in one way.

    Attributes
    ----------
    convention : str
        "as measured"; "inverse", the device's pose in the target's frame; "conjugate", rotations
        the other way round; "scalar first", quaternions w, x, y, z; "mirrored", a left-handed
        frame. Of three angles besides, such as "ZYX", "xyz, inverse" or "ZYX in degrees,
        conjugate": about these axes, each as it has turned (capitals) or fixed ones; "ZYX from
        columns 312" where the first of them is the third column, and so on.
    position_rms, orientation_rms : float
        What is left of the distance (m) and of the angle (rad).
    cost : float
        Root mean square of both (m), a rotation counting as the way at `Alignment.length`; of a
        platform that only turns in rad.
    closure_unit : {"m", "rad"}
        Of it.
    """

    convention: str
    position_rms: float = field(unit="m")
    orientation_rms: float = field(unit="rad")
    cost: float = field(unit="closure")
    closure_unit: str = field(private=True, default="m")


class Fit(NamedTuple):
    """One way of taking the measured poses, the frames that fit then, and the poses."""

    told: ConventionFit
    base: Transform
    target: Transform
    wanted: Transform


def rotations_from_angles(angles: Array, order: str) -> Array:
    """Rotation matrices (N, 3, 3) of angles (N, 3), rad, about the axes of one of `ORDERS`.

    Or of some other columns, ``"ZYX from columns 312"``.
    """
    order, _, columns = order.partition(" from columns ")
    angles = angles[:, [int(column) - 1 for column in columns or "123"]]
    rotation = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for letter, angle in zip(order.lower(), angles.T, strict=True):
        turn = rotations_from_vectors(angle[:, None] * np.eye(3)["xyz".index(letter)])
        rotation = rotation @ turn if order.isupper() else turn @ rotation
    return np.asarray(rotation)


def ways_of(device: Array, space: str, *, triples: bool, elsewhere: bool = False) -> list[str]:
    """The ways in which poses, or positions and three numbers, may be meant.

    `triples` says that the orientations were three numbers: a rotation vector, or angles in any
    order; `elsewhere` asks for the ways instead whose columns are neither in the order of their
    turns nor in the reverse.
    """
    kind = POSE_SPACES[space]
    angles = triples and kind.has_quaternion
    if elsewhere:
        return _ways_of_angles(_ELSEWHERE, device, space) if angles else []
    ways = ["as measured"]
    if kind.turns and not (kind.has_quaternion and triples):
        ways += ["scalar first"] * kind.has_quaternion
    if kind.turns:
        ways += ["inverse"] + ["conjugate"] * kind.moves
    ways += ["mirrored"] * kind.moves
    return ways + (_ways_of_angles(("", *ORDERS), device, space) if angles else [])


def _ways_of_angles(orders: Sequence[str], device: Array, space: str) -> list[str]:
    units = ["", _other_unit(_triple(device, space))]
    return [
        f"{order}{unit}{end}".strip()
        for order, unit, end in itertools.product(orders, units, _ENDS)
        if (order or unit) and (POSE_SPACES[space].moves or end != ", conjugate")
    ]


def is_elsewhere(way: str) -> bool:
    """Whether the columns of angles are neither in the order of the turns nor in the reverse."""
    return " from columns " in way


_ENDS = ("", ", inverse", ", conjugate")


def _triple(device: Array, space: str) -> Array:
    """The three numbers of each orientation: as they are, or of its rotation vector."""
    kind = POSE_SPACES[space]
    own = device[:, kind.size :]
    if own.shape[1] == 3:
        return own
    return vectors_from_rotations(transforms(space, device).rotation)


def _other_unit(numbers: Array) -> str:
    """The unit that angles may have been given in, if not the one that was said."""
    largest = float(np.abs(numbers).max(initial=0.0))
    return " in radians" if math.degrees(largest) <= _TURN else " in degrees"


def taken_as(way: str, device: Array, space: str) -> Transform:
    """The measured poses in one of the ways of `ways_of`."""
    kind = POSE_SPACES[space]
    if way == "scalar first":
        turned = np.roll(device[:, kind.size :], -1, axis=1)
        return transforms(space, np.hstack([device[:, : kind.size], turned]))
    name, _, end = way.partition(", ")
    end = name if name in ("inverse", "conjugate", "mirrored") else end
    order, _, unit = name.partition("in ")
    order = order.strip() if order[:3] in ORDERS else ""
    if order or unit or device.shape[1] == kind.size + 3 != kind.coordinates:
        factor = {"degrees": math.pi / 180, "radians": 180 / math.pi}.get(unit, 1.0)
        angles = factor * _triple(device, space)
        rotations = (
            rotations_from_angles(angles, order) if order else rotations_from_vectors(angles)
        )
        positions = np.zeros((len(device), 3))
        positions[:, : kind.size] = device[:, : kind.size]
        poses = Transform(rotations, positions)
    else:
        poses = transforms(space, device)
    back = np.swapaxes(poses.rotation, 1, 2)
    if end == "inverse":
        return Transform(back, -np.einsum("nij,nj->ni", back, poses.translation))
    if end == "conjugate":
        return Transform(back, poses.translation)
    if end == "mirrored":
        mirror = np.diag([1.0, 1.0, -1.0] if kind.in_space else [1.0, -1.0, 1.0])
        return Transform(mirror @ poses.rotation @ mirror, poses.translation @ mirror)
    return poses


def fits_of(
    ways: Sequence[str], device: Array, poses: Transform, length: float, space: str
) -> list[Fit]:
    """How well the poses fit in each way, the best first; see `align_frames`.

    With many ways the worst are dropped by some of the poses.

    Raises
    ------
    SymkinError
        For so few poses that they would always fit.
    """
    if len(ways) > _KEPT:
        some = evenly(len(device), _FEW)
        few = Transform(poses.rotation[some], poses.translation[some])
        tried = list(_fits(ways, device[some], few, length, space, _BRIEFLY))
        tried.sort(key=lambda fit: fit.told.cost)
        kept = {fit.told.convention for fit in tried[:_KEPT]} | {"as measured"}
        ways = [way for way in ways if way in kept]
    return sorted(_fits(ways, device, poses, length, space), key=lambda fit: fit.told.cost)


def _fits(
    ways: Sequence[str],
    device: Array,
    poses: Transform,
    length: float,
    space: str,
    steps: int = _WHOLLY,
) -> Iterator[Fit]:
    kind = POSE_SPACES[space]
    for way in ways:
        wanted = taken_as(way, device, space)
        frames = align(poses, wanted, length, space, steps=steps)
        if frames is None:
            raise SymkinError(f"{len(device)} poses always fit two frames; measure more")
        left = _sizes_of(moved(frames[0], poses, frames[1], wanted), length, space)
        told = ConventionFit(way, *left, kind.closure_unit)
        yield Fit(told, *frames, wanted)


def spread_of(poses: Transform, length: float, space: str) -> float:
    """How far poses are from their middle, as `ConventionFit.cost` counts."""
    middle = Transform(
        np.broadcast_to(nearest_rotation(poses.rotation.sum(axis=0)), poses.rotation.shape),
        np.broadcast_to(poses.translation.mean(axis=0), poses.translation.shape),
    )
    return _sizes_of(between(middle, poses), length, space)[2]


def _sizes_of(left: Array, length: float, space: str) -> tuple[float, float, float]:
    """Root mean squares of distances, of angles, and of both."""
    kind = POSE_SPACES[space]
    position = _rms(left[:, :3])
    orientation = _rms(left[:, 3:]) if kind.turns else 0.0
    cost = math.hypot(position, length * orientation) if kind.moves else orientation
    return position, orientation, cost


def _rms(rows: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))
