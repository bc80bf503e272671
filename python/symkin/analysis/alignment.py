# SPDX-License-Identifier: MIT
"""The frames of a measuring device and of its target, against a robot whose geometry is trusted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.analysis.conventions import (
    ORDERS,
    Convention,
    ConventionFit,
    fits_of,
    is_elsewhere,
    rotations_from_angles,
    spread_of,
    ways_of,
)
from symkin.analysis.reflectors import body_of, in_three, motions_of
from symkin.analysis.seen import Seen
from symkin.data.columns import (
    has_columns,
    own_pose_columns,
    pose_column_names,
    read_pose_values,
)
from symkin.data.measurements import Measurements
from symkin.data.reading import read_measurements
from symkin.errors import MeasurementError, one_of
from symkin.errors import shown as shown_value
from symkin.model.core_setup import core_setup
from symkin.model.file_frames import as_drawn
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    POSE_SPACES,
    Transform,
    moved,
    poses_of,
    space_named,
    stepped,
    transforms,
)
from symkin.model.settings import Frames, MeasurementColumns
from symkin.options import checks
from symkin.results import Result
from symkin.storage.tables import Table, TableSource, read_table
from symkin.storage.toml_file import toml_value
from symkin.values import Array, field, record

__all__ = [
    "Alignment",
    "Convention",
    "ConventionFit",
    "SeenPoses",
    "align_frames",
    "poses_of_columns",
    "poses_of_mechanism",
]


_PLAINLY = 1.5  # times: a convention fits if the next one leaves so much more
_LITTLE_LEFT = 0.03  # of the spread: no other order of columns would leave less
_MOST_LEFT = 0.3  # of the spread: more than any drawing is wrong
_PLAIN: tuple[str, ...] = get_args(Convention)
_STEP = 1e-6
_UNSEEN = 1e-9  # of the largest eigenvalue


@record
class Alignment(Result):
    """Frames that bring the robot's poses nearest to those that a device measured.

    Attributes
    ----------
    frames : Frames
        The base in the device's frame, and the target in the platform's; or points there.
    base_deviations, target_deviations : ndarray, shape (6,) spatially, else (3,)
        Standard deviations, m and rad, from what is left; infinite where the poses do not tell. NaN
        of the target of a platform that never turns, which counts as the platform itself.
    convention : str
        The way of taking the measured poses that fits.
    conventions : tuple of ConventionFit
        All ways, the best first.
    position_rms, position_max, orientation_rms, orientation_max : float
        What is left: m and rad.
    differences : ndarray, shape (N, dof)
        The same of every pose: position, then angle or rotation vector.
    spread : float
        How far the poses are from their middle, as `ConventionFit.cost` counts.
    length : float
        At which a rotation was made comparable with a translation, m.
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses.
    """

    frames: Frames
    base_deviations: Array
    target_deviations: Array
    convention: str
    conventions: tuple[ConventionFit, ...]
    position_rms: float = field(unit="m")
    position_max: float = field(unit="m")
    orientation_rms: float = field(unit="rad")
    orientation_max: float = field(unit="rad")
    differences: Array = field(private=True)
    spread: float = field(private=True)
    length: float = field(unit="m")
    pose_space: str = field(private=True)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons not to trust the frames; empty if there are none."""
        return tuple(self._doubts())

    @property
    def trustworthy(self) -> bool:
        """Whether one convention fits plainly, and the poses show both frames."""
        return not self.doubts

    def _doubts(self) -> Iterator[str]:
        best, *others = self.conventions
        unit = f"m{POSE_SPACES[self.pose_space].closure_unit}"
        near = [each for each in others if each.cost < _PLAINLY * best.cost]
        if best.convention in _PLAIN:
            near = [each for each in near if each.convention in _PLAIN]
        elif not is_elsewhere(best.convention):
            near = [each for each in near if not is_elsewhere(each.convention)]
        if best.cost > _MOST_LEFT * self.spread:
            yield (
                f"no frames explain the poses: {1e3 * best.cost:.3g} {unit} are left where the "
                f"poses are {1e3 * self.spread:.3g} {unit} from their middle; see whether each row "
                "has the readings of its pose, each column what its name says, and the robot its "
                "geometry"
            )
        if near:
            names = ", ".join(f'"{each.convention}"' for each in near)
            yield (
                f'the poses fit "{best.convention}" ({1e3 * best.cost:.3g} {unit}), but hardly '
                f"better than {names} ({1e3 * near[0].cost:.3g} {unit}): measure poses that tilt "
                "and move more"
            )
        elif others and best.convention != "as measured":
            plain = next(each for each in others if each.convention == "as measured")
            yield (
                f'the poses were not taken as they are, but as "{best.convention}", which leaves '
                f"{1e3 * best.cost:.3g} {unit} instead of {1e3 * plain.cost:.3g} {unit}: correct "
                "the table, or say so with --convention"
            )
        deviations = np.concatenate([self.base_deviations, self.target_deviations])
        if np.isinf(deviations).any():
            yield (
                "these poses do not tell the base frame from the target frame: they need to turn "
                "about more than one axis, and to move"
            )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        found = super().to_dict()
        verdict = {"trustworthy": self.trustworthy, "doubts": list(self.doubts)}
        return {"command": "align", **verdict, **found}

    def frames_text(self) -> str:
        """Return the ``[frames]`` section of a mechanism file."""
        notes = {
            "base": "of the robot in the frame of the measuring device",
            "target": "in the platform's frame",
            "points": "in the platform's frame",
        }
        lines = [
            f"{name} = {toml_value(getattr(self.frames, name))}  # {note}"
            for name, note in notes.items()
            if name == "base" or getattr(self.frames, name)
        ]
        return "\n".join(["[frames]", *lines]) + "\n"

    def columns(self) -> Mapping[str, Any]:
        """Return what is left, a row a pose."""
        units = POSE_SPACES[self.pose_space].units
        names = [f"{name}_{unit}" for name, unit in units.items()]
        return dict(zip(names, self.differences.T, strict=True))


@checks("robot")
def align_frames(
    measured: ArrayLike,
    robot: ArrayLike,
    points: ArrayLike | None = None,
    *,
    convention: str | None = None,
    length: float = 1.0,
    pose_space: str = "",
) -> Alignment:
    """Find where a measuring device stands, and what it measures on the platform.

    Least squares of ``base @ robot @ target`` against the measured poses. The robot's geometry is
    trusted; to find both, see `identify` with ``frames``.

    Parameters
    ----------
    measured : array_like, shape (N, coordinates)
        Poses of the target in the device's frame; in space also positions and three numbers (N, 6),
        which may be a rotation vector or angles about axes in any order, rad.
    robot : array_like, shape (N, coordinates)
        Poses of the platform in the base's frame: reported by the controller, or of the forward
        kinematics. Rows with NaN in either are left out.
    points : array_like, shape (n, 2 or 3), optional
        Points of the target in its own frame, if the measured poses are theirs, m: the frames that
        are found have these on the platform, instead of a target.
    convention : str, optional
        How to take the measured poses, see `ConventionFit`; by default whichever fits best, which
        the result says: of three numbers out of 150, or of 440 where these leave much.
    length : float
        At which a rotation counts as much as a translation, m.
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses; by default the one with so many coordinates, planar if two have.

    Raises
    ------
    SymkinError
        For poses of unequal shapes, or too few of them.
    """
    device, own = (np.atleast_2d(np.asarray(each, dtype=float)) for each in (measured, robot))
    space = space_named(pose_space, own.shape[1]).name
    kind = POSE_SPACES[space]
    triples = kind.has_quaternion and device.shape[1] == kind.size + 3
    paired = device.ndim == 2 and own.ndim == 2 and len(device) == len(own)
    if not paired or not (triples or device.shape[1] == own.shape[1]):
        raise MeasurementError(
            f"the measured poses are {device.shape}, the robot's {own.shape}; expected as many of "
            "both"
        )
    kept = np.isfinite(device).all(axis=1) & np.isfinite(own).all(axis=1)
    if not kept.any():
        raise MeasurementError(_why_none(device, own, space))
    device, poses = device[kept], transforms(space, own[kept])
    ways = ways_of(device, space, triples=triples)
    rarer = ways_of(device, space, triples=triples, elsewhere=True)
    if convention is not None:
        if convention not in (*ways, *rarer):
            one_of("convention", convention, get_args(Convention))
        ways, rarer = [convention], []
    fits = fits_of(ways, device, poses, length, space)
    spread = spread_of(fits[0].wanted, length, space)
    if rarer and fits[0].told.cost > _LITTLE_LEFT * spread:
        others = fits_of(rarer, device, poses, length, space)
        plainly = others[0].told.cost * _PLAINLY < fits[0].told.cost
        (first, *behind), rest = (others, fits) if plainly else (fits, others)
        fits = [first, *sorted([*behind, *rest], key=lambda fit: fit.told.cost)]
    best, base, target, wanted = fits[0]
    size, shown = kind.size, kind.frame_components
    differences = moved(base, poses, target, wanted)[:, kind.components]
    deviations = _deviations(base, poses, target, wanted, space)
    position, orientation = (
        np.linalg.norm(part, axis=1) for part in (differences[:, :size], differences[:, size:])
    )
    return Alignment(
        frames=_frames(base, target, points, space),
        base_deviations=deviations[: len(shown)],
        target_deviations=deviations[len(shown) :],
        convention=best.convention,
        conventions=tuple(fit[0] for fit in fits),
        position_rms=best.position_rms,
        position_max=float(position.max()),
        orientation_rms=best.orientation_rms,
        orientation_max=float(orientation.max(initial=0.0)),
        differences=differences,
        spread=spread_of(wanted, length, space),
        length=length,
        pose_space=space,
    )


def _why_none(device: Array, own: Array, space: str) -> str:
    """What is missing where no pose is known in full on both sides."""
    names = [name.partition("_")[0] for name in pose_column_names(space)]
    for whose, values in (("measured pose", device), ("pose of the robot", own)):
        known = np.isfinite(values)
        if known.all(axis=1).any():
            continue
        lacking = np.flatnonzero(~known.any(axis=0))
        told = f"no {whose} is known in full"
        if 0 < len(lacking) < len(names) == values.shape[1]:
            told += f": none has {', '.join(names[column] for column in lacking)}"
        return f"{told}; frames are found from full poses"
    return "no row has both a full measured pose and one of the robot; expected some that do"


def _frames(base: Transform, target: Transform, points: ArrayLike | None, space: str) -> Frames:
    shown, size = POSE_SPACES[space].frame_components, POSE_SPACES[space].size
    outer, inner = (tuple(each.tangent[shown].tolist()) for each in (base, target))
    if points is None:
        return Frames(outer, inner)
    given = np.asarray(points, dtype=float)
    if given.ndim != 2 or given.shape[1] not in (size, 3) or not np.isfinite(given).all():
        raise MeasurementError(
            f"points are {shown_value(points)}; expected {size} coordinates of each, m"
        )
    own = in_three(given) @ target.rotation.T + target.translation
    return Frames(outer, points=tuple(map(tuple, own[:, :size].tolist())))


def poses_of_columns(
    table: Table, names: Sequence[str], angles: str | None = None, *, triples: bool = False
) -> Array:
    """Return the poses of columns of a table, position first, SI.

    Parameters
    ----------
    table : Table
        Of `read_table`.
    names : sequence of str
        Two columns of a point; three of a planar pose; four of a quaternion x, y, z, w alone; six
        of a position and a rotation vector, or angles; seven of a position and a quaternion.
    angles : str, optional
        Axes of three angles: ``"XYZ"`` each as it has turned, ``"xyz"`` fixed.

    triples : bool
        Whether three numbers of an orientation are left as they are, since nobody says what they
        mean.

    Returns
    -------
    ndarray, shape (N, coordinates)

    Raises
    ------
    MeasurementError
        For another number of columns, or as `read_pose_values`.
    """
    names = [name.strip() for name in names]
    size = {2: 2, 3: 2, 4: 0, 6: 3, 7: 3}.get(len(names))
    if size is None:
        raise MeasurementError(f"a pose has {len(names)} columns; expected 2, 3, 4, 6 or 7")
    if angles is not None and (
        len(names) != 6 or angles not in ORDERS
    ):  # fmt: skip
        raise MeasurementError(
            f'angles about "{angles}" of a pose of {len(names)} columns; expected three letters of '
            "XYZ, or of xyz, and six columns"
        )
    turns = names[size:]
    columns = MeasurementColumns(
        position=tuple(names[:size]),
        readings=(),
        angle=turns[0] if len(turns) == 1 else None,
        quaternion=tuple(turns) if len(turns) == 4 else (),
        rotation_vector=tuple(turns) if len(turns) == 3 else (),
    )
    values = read_pose_values(table, columns)
    if angles is None and triples and len(turns) == 3:
        return np.hstack([values.positions, values.angles])
    if angles is None:
        return values.poses()
    rotation = rotations_from_angles(values.angles, angles)
    return poses_of("spatial", Transform(rotation, values.positions))


class SeenPoses(NamedTuple):
    """Poses of a target and of the robot, row by row, as `align_frames` takes them.

    Attributes
    ----------
    measured, robot : ndarray, shape (N, coordinates)
        NaN where they were not measured in full, or the robot cannot take them. Measured ones have
        three numbers for the orientation, shape (N, 6), where the table has.
    points : ndarray, shape (n, 3), or None
        Points that the measured poses are of, in their own frame, m; None of poses as such.
    """

    measured: Array
    robot: Array
    points: Array | None = None


def poses_of_mechanism(
    mechanism: Mechanism,
    source: TableSource,
    columns: MeasurementColumns | None = None,
    *,
    ignore: Sequence[str] = (),
    robot: str | None = None,
) -> SeenPoses:
    """Return the measured poses of a table, and the robot's own, reported or calculated.

    Where points were measured instead of poses, three of them (two in the plane) are a target.

    Raises
    ------
    MeasurementError
        Without readings or reported poses, and for points that make no target.
    """
    taken = read_measurements(source, mechanism, columns, ignore=ignore, robot=robot)
    measured, points = taken.poses, None
    if Seen.of(taken).tracked and not np.isfinite(measured).all(axis=1).any():
        measured, points = _of_points(mechanism, taken)
    else:
        triples = _triples_of(mechanism, source, columns, taken.row_numbers)
        if triples is not None:
            measured = np.hstack([measured[:, : mechanism.space.size], triples])
    if taken.reported is not None:
        return SeenPoses(measured, as_drawn(mechanism, taken.reported), points)
    read = np.flatnonzero(np.isfinite(taken.readings).all(axis=1))
    if not len(read):
        raise MeasurementError("no row has readings of all legs, nor a reported pose")
    nowhere = np.full_like(taken.poses, np.nan)
    alone = Measurements.of(nowhere, taken.readings, pose_space=taken.pose_space).subset(read)
    own = np.array(nowhere)
    own[read] = _core.starting_poses(
        mechanism.straight,
        core_setup(mechanism.replace(frames=None)),
        alone.observations(mechanism.noise),
        mechanism.home,
    )
    # Frames are for the mechanism's file.
    return SeenPoses(measured, as_drawn(mechanism, own), points)


def _triples_of(
    mechanism: Mechanism,
    source: TableSource,
    columns: MeasurementColumns | None,
    taken: NDArray[np.intp],
) -> Array | None:
    """The orientations of rows of a table, three numbers of which nobody says which, rad.

    As they stand there: a rotation vector of more than half a turn is another one, too.
    """
    if not mechanism.space.has_quaternion or hasattr(source, "read"):
        return None
    table = read_table(source, mechanism.step)
    named = (each for each in (columns, mechanism.measurement_columns) if each is not None)
    own = next((each for each in named if has_columns(table, each)), None)
    own = own or own_pose_columns(table, mechanism.pose_space, partial=True)
    if not own.rotation_vector:
        return None
    angles = read_pose_values(table, own, mechanism.pose_space).angles
    return np.asarray(angles[np.isin(table.row_numbers, taken)])


def _of_points(mechanism: Mechanism, taken: Measurements) -> tuple[Array, Array]:
    """Poses of the body that points are, and the points in its frame."""
    assert taken.points is not None
    space, seen = mechanism.space, in_three(taken.points)
    if space.turns:
        body = body_of(seen, space)
    else:  # all of them do the same
        body = np.nanmean(seen - np.nanmean(seen[:, :1], axis=0), axis=0)
    if body is None:
        least = "three points that are not in a line" if space.in_space else "two points"
        raise MeasurementError(
            f"these points are no pose: frames alone need {least}, seen together; symkin identify "
            "finds the device and the places of fewer, --free base if the geometry is trusted"
        )
    motions = motions_of(seen, body, space)
    known = np.isfinite(motions.translation).all(axis=1)
    poses = np.full_like(taken.poses, np.nan)
    poses[known] = poses_of(space.name, Transform(*(each[known] for each in motions)))
    return poses, body


def _deviations(
    base: Transform, poses: Transform, target: Transform, wanted: Transform, space: str
) -> Array:
    """Standard deviations of the tangents of base and target, both outside, from what is left."""
    kind = POSE_SPACES[space]
    shown, free, size = kind.components, kind.frame_components, kind.size
    left = moved(base, poses, target, wanted)[:, shown]
    columns = []
    for number in range(2 if kind.turns else 1):
        for component in free:
            step = np.zeros(6)
            step[component] = _STEP
            sides = []
            for sign in (1, -1):
                frames = [base, target]
                frames[number] = stepped(frames[number], sign * step)
                sides.append(moved(frames[0], poses, frames[1], wanted)[:, shown])
            columns.append((sides[0] - sides[1]) / (2 * _STEP))
    matrix = np.stack(columns, axis=2)
    spare = left.size - len(columns)
    spread = np.ones(left.shape[1])
    for part in (slice(0, size), slice(size, None)):
        if left[:, part].size:
            spread[part] = np.sqrt(np.mean(left[:, part] ** 2) * left.size / max(spare, 1))
    spread[spread == 0] = 1e-15
    rows = (matrix / spread[:, None]).reshape(-1, len(columns))
    values, vectors = np.linalg.eigh(rows.T @ rows)
    unseen = values < _UNSEEN * values[-1]
    variances = np.sum(vectors[:, ~unseen] ** 2 / values[~unseen], axis=1)
    hidden = (np.abs(vectors[:, unseen]) > _UNSEEN).any(axis=1)
    found = np.full(2 * len(free), np.nan)
    found[: len(columns)] = np.where(hidden, np.inf, np.sqrt(variances))
    return found
