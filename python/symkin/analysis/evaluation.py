# SPDX-License-Identifier: MIT
"""End-effector errors of a model."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.analysis.frame_fit import align
from symkin.analysis.promises import CONFIDENCE, sampled_bound, thinned, variances_by_readings
from symkin.analysis.reflectors import own_poses
from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.data.measurements import Measurements
from symkin.data.reading import Measured, as_measurements
from symkin.errors import SymkinError
from symkin.model.framing import framed
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism, require_same_shape
from symkin.model.poses import (
    POSE_SPACES,
    PoseSpace,
    Transform,
    moved,
    pose_rows,
    poses_of,
    stepped,
    tangents_of,
    transforms,
)
from symkin.options import checks
from symkin.results import Result
from symkin.values import Array, Value, field, plain, record

__all__ = [
    "AlignedErrors",
    "Evaluation",
    "SampledPromise",
    "closures_of",
    "evaluate",
    "pose_differences",
]

# Root mean square and maximum of the distance (m) and of the angle (rad), and of how many poses.
_Figures = tuple[float, float, float, float, int]

# Twelve numbers need no more, and an alignment of 30 000 poses takes a second.
_ALIGNED_POSES = 2000


@record
class AlignedErrors(Value):
    """End-effector errors that no other base frame and tool frame would take away.

    Two constant motions, of the base and of the tool, are fitted to the poses taken (least squares,
    a rotation counting as the way of a point at the characteristic length from the centre); a point
    platform has the base alone.

    Attributes
    ----------
    position_rms, position_max : float
        m, of the distance.
    orientation_rms, orientation_max : float
        rad, of the angle; zero for a point platform.
    base, tool : ndarray, shape (6,) spatially, else (3,)
        The motions: ``B taken T`` is nearest to what was wanted. Translation (m), then rotation
        vector (spatially) or angle (rad). Poses that hardly turn do not tell one from the other.
    differences : ndarray, shape (N, dof)
        What is left of those of the evaluation.
    """

    position_rms: float = field(unit="m")
    position_max: float = field(unit="m")
    orientation_rms: float = field(unit="rad")
    orientation_max: float = field(unit="rad")
    base: Array
    tool: Array
    differences: Array = field(private=True)


@record
class SampledPromise(Value):
    """What errors at some poses say of all poses that these were drawn from.

    Only for poses that the model has not seen: an identification fits its own.

    Attributes
    ----------
    confidence : float
        With which both are kept.
    position_bound, orientation_bound : float
        What the root mean square over all such poses is within, m and rad, see `sampled_bound`; NaN
        for one pose.
    inside : float
        Share of all such poses, at least, of which the error is within the largest here (Wilks,
        1941: whatever the errors' distribution).
    """

    confidence: float
    position_bound: float = field(unit="rms_m")
    orientation_bound: float = field(unit="rms_rad")
    inside: float


@record
class Evaluation(Result):
    """End-effector errors over poses.

    Attributes
    ----------
    position_rms, position_max : float
        m, of the distance.
    orientation_rms, orientation_max : float
        rad, of the angle; zero for a point platform, NaN where positions alone were measured.
    evaluated, failed : int
        Poses in the figures, and poses left out because the mechanism cannot take them.
    differences : ndarray, shape (N, dof)
        Position, then angle or rotation vector; NaN where it failed. Of measurements the model's
        pose less the measured one; of commanded poses the one that the robot takes less that which
        the model wanted. To first order E (model - robot) and its negative, see the theory.
    poses : ndarray, shape (N, coordinates)
        The poses wanted: measured, or commanded.
    row_numbers : ndarray of int, shape (N,)
        Where the poses stand in their source, or from 1.
    characteristic_length : float
        Length that makes rotations comparable with translations, m.
    pose_space : {"planar", "point", "spatial", "translating", "spherical", "schoenflies"}
        Kind of the poses.
    name : str
        Of the model.
    unread : int
        Poses left out since not all legs were read there.
    partial : int
        Poses left out since they were measured in part.
    closures : ndarray, shape (N, legs), or None
        How far each leg is from closing at all measurements, m (spherical: rad); NaN where it was
        not read. None for a robot that was not measured, or of which positions alone were.
    instrument : mapping of str to float, or None
        What the declared noise of poses and readings contributes to the root mean squares of
        ``"position"`` and ``"orientation"``, m and rad; None where none of poses is declared, or
        nothing was measured.
    notes : tuple of str
        What to know of the table that was measured, such as columns that nothing was read from.
    confidence : float
        With which `promise` is kept.
    """

    position_rms: float = field(unit="m")
    position_max: float = field(unit="m")
    orientation_rms: float = field(unit="rad")
    orientation_max: float = field(unit="rad")
    evaluated: int
    failed: int
    differences: Array = field(private=True)
    poses: Array = field(private=True)
    row_numbers: NDArray[np.intp] = field(private=True)
    characteristic_length: float = field(private=True)
    pose_space: str = field(private=True)
    name: str = field(private=True, default="")
    unread: int = field(private=True, default=0)
    partial: int = field(private=True, default=0)
    closures: Array | None = field(private=True, default=None)
    instrument: Mapping[str, float] | None = field(private=True, default=None)
    notes: tuple[str, ...] = field(compare=False, default=())
    confidence: float = CONFIDENCE

    @classmethod
    def of(
        cls,
        differences: Array,
        poses: Array,
        mechanism: Mechanism,
        *,
        row_numbers: NDArray[np.intp] | None = None,
        figures: _Figures | None = None,
    ) -> Evaluation:
        """Return the figures of single differences, made unless they are given.

        Poses count from 1 without `row_numbers`.
        """
        figures = figures or _figures(differences, mechanism.space)
        return cls(
            *figures[:4],
            evaluated=figures[4],
            failed=len(differences) - figures[4],
            differences=differences,
            poses=poses,
            row_numbers=np.arange(1, len(poses) + 1) if row_numbers is None else row_numbers,
            characteristic_length=mechanism.characteristic_length,
            pose_space=mechanism.pose_space,
            name=mechanism.name,
        )

    @property
    def space(self) -> PoseSpace:
        """What the poses are made of."""
        return POSE_SPACES[self.pose_space]

    @property
    def kinds(self) -> list[tuple[str, str]]:
        """What was evaluated, "position" and "orientation", with the units."""
        return [
            each for each in self.space.errors if math.isfinite(getattr(self, f"{each[0]}_rms"))
        ]

    @property
    def difference_names(self) -> tuple[str, ...]:
        """The coordinates of `differences` with their units: ``x_m``, ..."""
        return tuple(f"{name}_{unit}" for name, unit in self.space.units.items())

    @property
    def errors(self) -> tuple[Array, Array]:
        """Size of each pose's position error (m) and orientation error (rad), both (N,)."""
        size = self.space.size
        position, angle = (
            np.sqrt(np.sum(part**2, axis=1))
            for part in (self.differences[:, :size], self.differences[:, size:])
        )
        return position, angle

    @cached_property
    def promise(self) -> SampledPromise:
        """What the errors say of poses that were not evaluated, if these are like them."""
        position, orientation = (sampled_bound(each, self.confidence) for each in self.errors)
        inside = (1 - self.confidence) ** (1 / self.evaluated)
        return SampledPromise(self.confidence, position, orientation, inside)

    @property
    def closure_rms(self) -> tuple[float, Array] | None:
        """Root mean square of all closures, and of each leg's, m or rad; NaN if never read."""
        if self.closures is None:
            return None
        counts = np.isfinite(self.closures).sum(axis=0)
        squares = np.nansum(self.closures**2, axis=0)
        legs = np.sqrt(np.divide(squares, counts, np.full(len(counts), np.nan), where=counts > 0))
        return float(np.sqrt(squares.sum() / counts.sum())), legs

    @property
    def means(self) -> Array:
        """Mean of each coordinate's difference, shape (dof,), m and rad."""
        known = np.isfinite(self.differences)
        sums, counts = np.where(known, self.differences, 0).sum(axis=0), known.sum(axis=0)
        means = np.full(len(counts), np.nan)
        means[counts > 0] = sums[counts > 0] / counts[counts > 0]
        return means

    @cached_property
    def aligned(self) -> AlignedErrors | None:
        """Errors after the best alignment of base and tool frame; None for too few full poses.

        The frames are those of at most some 2000 poses, evenly taken, and the errors of all.
        """
        rows = np.flatnonzero(_complete(self.differences))
        if not len(rows):
            return None
        space = self.space
        components = space.components
        wanted = transforms(space.name, self.poses[rows])
        taken = stepped(wanted, tangents_of(space, self.differences[rows]))
        some = slice(None, None, -(-len(rows) // _ALIGNED_POSES) or 1)
        frames = align(
            Transform(taken.rotation[some], taken.translation[some]),
            Transform(wanted.rotation[some], wanted.translation[some]),
            self.characteristic_length,
            space.name,
        )
        if frames is None:
            return None
        left = moved(frames[0], taken, frames[1], wanted)[:, components]
        differences = np.full_like(self.differences, np.nan)
        differences[rows] = left
        base, tool = (frame.tangent[space.frame_components] for frame in frames)
        return AlignedErrors(*_figures(left, space)[:4], base, tool, differences)

    def to_dict(self) -> dict[str, Any]:
        """Return its figures, without the single poses."""
        names, closures, unit = self.difference_names, self.closure_rms, self.space.closure_unit
        return {
            **super().to_dict(),
            "mean_difference": plain(dict(zip(names, self.means, strict=True))),
            "closures": plain(
                closures and {f"rms_{unit}": closures[0], f"legs_rms_{unit}": closures[1]}
            ),
            "aligned": plain(self.aligned),
            "promise": plain(self.promise),
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the errors, a row a pose; empty where the mechanism cannot take it."""
        position, orientation = self.errors
        return {
            "row": self.row_numbers,
            **dict(zip(self.difference_names, self.differences.T, strict=True)),
            "position_error_m": position,
            "orientation_error_rad": orientation,
        }


def _complete(rows: Array) -> NDArray[np.bool_]:
    """Which rows have finite numbers alone; a reduction of short rows takes ten times as long."""
    return np.isfinite(rows @ np.ones(rows.shape[1]))


def _figures(differences: Array, space: PoseSpace) -> _Figures:
    """Of the rows that have finite numbers alone."""
    complete = _complete(differences)
    good = differences if complete.all() else differences[complete]
    figures: list[float] = []
    for part in (good[:, : space.size], good[:, space.size :]):
        squares = sum((column**2 for column in part.T), np.zeros(len(part)))
        figures += [float(np.sqrt(squares.mean())), float(np.sqrt(squares.max()))]
    return figures[0], figures[1], figures[2], figures[3], len(good)


@checks("poses")
def evaluate(
    model: MechanismGiven,
    *,
    actual: MechanismGiven | None = None,
    poses: ArrayLike | WorkspaceSample | None = None,
    measurements: Measured | None = None,
    confidence: float = CONFIDENCE,
) -> Evaluation:
    """Evaluate a model by its end-effector errors.

    Give either `actual`, or `measurements`.

    Parameters
    ----------
    model : Mechanism
        The model that a controller would use.
    actual : Mechanism
        The robot as made (simulation): errors are those of the poses that it takes when the model's
        inverse kinematics commands `poses`.
    poses : array_like, shape (N, coordinates), or WorkspaceSample
        Commanded poses; by default a sample of the model's workspace.
    measurements : Measurements, Simulation, or what `read_measurements` reads
        Errors are those of the model's forward kinematics at the measured readings; a row without
        all readings is left out. The poses are those of the target in the device's frame if the
        model has `frames`. Where points were measured instead of poses, these are what the points
        say of the platform, and the errors those in their middle. Where positions alone were, so
        are the errors.
    confidence : float
        With which `Evaluation.promise` is kept.

    Raises
    ------
    SymkinError
        If no pose can be evaluated, or the robot is of another kind than the model.
    """
    model = as_mechanism(model, "model")
    actual = None if actual is None else as_mechanism(actual, "actual")
    numbers, placed = None, False
    if measurements is not None:
        measurements = as_measurements(measurements, model)
    arm = np.zeros(3)
    if measurements is not None and actual is None and poses is None:
        placed = _is_placed(measurements)
        if placed:
            measurements = _turned_as(model, measurements)
        own, arm = own_poses(model, measurements)
        measurements = dataclasses.replace(measurements, poses=own)
        whole = np.isfinite(measurements.poses).all(axis=1)
        measurements.require_table(model.sensor_table)
        if not whole.any():
            raise SymkinError(
                f"{measurements.origin}no row has a full measured pose, so none can be evaluated"
            )
        complete = np.flatnonzero(whole & np.isfinite(measurements.readings).all(axis=1))
        if not len(complete):
            raise SymkinError(
                f"{measurements.origin}no pose has readings of all legs, so none can be evaluated"
            )
        rows, numbers = measurements.poses[complete], measurements.row_numbers[complete]
        errors = _measurement_errors(model, measurements.subset(complete))
    elif actual is not None and measurements is None:
        require_same_shape(actual, model)
        rows = pose_rows(sample_workspace(model) if poses is None else poses)
        errors = _command_errors(actual, model, rows)
    else:
        raise SymkinError("evaluate takes `actual`, with or without `poses`, or `measurements`")
    if not errors.evaluated:
        raise SymkinError(
            f'mechanism "{model.name}" can take none of the {len(rows)} poses to evaluate'
        )
    figures = (
        errors.position_rms,
        errors.position_max,
        errors.orientation_rms,
        errors.orientation_max,
        errors.evaluated,
    )
    result = Evaluation.of(errors.differences, rows, model, row_numbers=numbers, figures=figures)
    if arm.any():
        result = Evaluation.of(
            *at_arm(errors.differences, rows, arm, model.space), model, row_numbers=numbers
        )
    result = dataclasses.replace(result, confidence=confidence)
    if measurements is None:
        return result
    if placed:
        differences = result.differences.copy()
        differences[:, model.space.size :] = np.nan
        result = dataclasses.replace(
            result, differences=differences, orientation_rms=math.nan, orientation_max=math.nan
        )
    partial = int((~whole).sum())
    return dataclasses.replace(
        result,
        unread=whole.size - partial - len(rows),
        partial=partial,
        closures=None if placed else closures_of(model, measurements),
        instrument=_instrument(model, measurements.subset(complete), arm),
        notes=measurements.notes,
    )


def _is_placed(measurements: Measurements) -> bool:
    """Whether positions, and nothing of orientations, were measured of a platform that turns."""
    space, known = measurements.space, np.isfinite(measurements.poses)
    if not (space.turns and space.moves) or measurements.points is not None:
        return False
    return bool(known[:, : space.size].all(axis=1).any() and not known[:, space.size :].any())


def _turned_as(model: Mechanism, measurements: Measurements) -> Measurements:
    """Positions that were measured, with the orientations that the model has at the readings."""
    poses, read = measurements.poses.copy(), np.isfinite(measurements.readings).all(axis=1)
    taken, _ = model.forward_kinematics(measurements.readings[read])
    poses[read, model.space.size :] = framed(model, taken)[:, model.space.size :]
    return dataclasses.replace(measurements, poses=poses)


def at_arm(differences: Array, poses: Array, arm: Array, space: PoseSpace) -> tuple[Array, Array]:
    """Differences of poses, and the poses, of another place on the platform than its origin.

    `arm` is that place in the platform's frame, m, shape (3,).
    """
    wanted = transforms(space.name, poses)
    taken = stepped(wanted, tangents_of(space, differences))
    turns = (taken.rotation - wanted.rotation) @ arm
    there = wanted @ Transform(np.eye(3), arm)
    moved_by = differences.copy()
    moved_by[:, : space.size] += turns[:, : space.size]
    return moved_by, poses_of(space.name, there)


def _instrument(
    model: Mechanism, measurements: Measurements, arm: Array
) -> dict[str, float] | None:
    """What the declared noise contributes, of measured poses and of readings.

    None where that is not known: noise that is exact, or a model that does not reach the readings.
    """
    space, noise, seen = model.space, model.noise, measurements.poses[:, : model.space.size]
    if measurements.points is not None and np.isnan(seen).all():
        seen = measurements.points.reshape(-1, space.size)
    places = noise.at(np.linalg.norm(seen, axis=1))
    of_poses = {
        "position": space.size * float(np.mean(places**2)),
        "orientation": len(space.rotation) * noise.orientation**2,
    }
    # A mean needs no more rows; a pseudoinverse for each of many takes seconds.
    some = thinned(np.arange(len(measurements.poses)))
    poses, taken = model.forward_kinematics(measurements.readings[some])
    if not taken.any():
        return None
    there = np.broadcast_to(arm, (int(taken.sum()), 3)) if arm.any() else None
    by_readings = variances_by_readings(
        model, measurements.subset(some[taken]), poses[taken], noise.reading, there
    ).mean(axis=0)
    of_readings = {
        "position": by_readings[: space.size].sum(),
        "orientation": by_readings[space.size :].sum(),
    }
    return {
        kind: math.sqrt(of_poses[kind] + of_readings[kind])
        for kind, _ in space.errors
        if of_poses[kind] > 0
    } or None


def _command_errors(actual: Mechanism, model: Mechanism, rows: Array) -> _core.PoseErrors:
    if actual.curvature is None and model.curvature is None:
        return _core.command_errors(actual.straight, model.straight, rows)
    poses = _core.on_constraint(model.straight, np.ascontiguousarray(rows))
    told = actual.straightened(model.inverse_kinematics(poses))
    return _core.measurement_errors(actual.straight, poses, told)


def pose_differences(model: Mechanism, measurements: Measurements) -> Array:
    """The model's poses at the readings, which are complete, less the measured ones (N, dof)."""
    return _measurement_errors(model, measurements).differences


def _measurement_errors(model: Mechanism, measurements: Measurements) -> _core.PoseErrors:
    return _core.measurement_errors(
        model.straight,
        np.ascontiguousarray(measurements.poses),
        np.ascontiguousarray(model.straightened(measurements.readings)),
    )


def closures_of(model: Mechanism, measurements: Measurements) -> Array:
    """How far each leg is from closing at the measurements, m, NaN where it was not read."""
    closures = np.full(measurements.readings.shape, np.nan)
    for leg in range(len(model.legs)):
        read = np.isfinite(measurements.readings[:, leg])
        closures[read, leg] = model.closure_error(
            leg, measurements.poses[read], measurements.readings[read, leg]
        )
    return closures
