# SPDX-License-Identifier: MIT
"""What end-effector error uncertain parameters lead to: on average, and in most of all robots."""

from __future__ import annotations

import contextlib
import math
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.model.poses import frame, transforms
from symkin.values import Array, Value, field, record

_Scalar = TypeVar("_Scalar", bound=np.generic)

CONFIDENCE = 0.95
NORMAL_95 = 1.959963984540054  # standard deviations that hold as many normal errors
_RANK = 1e-9  # of the largest singular value
_AVERAGED = 2000  # poses over which an expected error is averaged,
_EXAMINED = 4000  # and among which its largest is looked for


@record
class ExpectedAccuracy(Value):
    """End-effector error to expect after identification, to first order.

    Errors are root mean squares over poses of the workspace. Robots differ: the mean says what they
    have on average, about half of them have more; the bounds are kept by a share of them.

    Attributes
    ----------
    position : float
        The mean: root mean square over robots, too, m.
    orientation : float
        The same, rad; zero for a point platform.
    evaluated, failed : int
        Poses in the figures, and poses left out because they are out of reach or singular.
    confidence : float
        Share of such robots that are within
    position_bound, orientation_bound : float
        these, m and rad.
    position_anywhere, orientation_anywhere : float
        What the same share of such robots is within at every pose, m and rad; None if nobody asked.
    up_to_frames : bool
        Whether errors are those that no other base and platform frame would take away, since no
        observation shows where the platform's frame is.
    up_to_turn : bool
        Whether those of the orientation are what no other turn of the platform's frame would take
        away, since of an unknown target only the place is observed.
    of : str or None
        The coordinates that those of the position are of, such as "z" or "height"; None: of all.
    """

    position: float = field(unit="rms_m")
    orientation: float = field(unit="rms_rad")
    evaluated: int
    failed: int
    confidence: float = CONFIDENCE
    position_bound: float = field(unit="rms_m", default=math.nan)
    orientation_bound: float = field(unit="rms_rad", default=math.nan)
    position_anywhere: float | None = field(unit="m", default=None)
    orientation_anywhere: float | None = field(unit="rad", default=None)
    up_to_frames: bool = False
    up_to_turn: bool = False
    of: str | None = None


def promised(
    forms: tuple[Array, Array],
    covariance: Array,
    poses: tuple[int, int],
    confidence: float = CONFIDENCE,
    noise_degrees: float = math.inf,
) -> ExpectedAccuracy:
    """Return what mean squared errors, quadratic forms of those of the parameters, come to.

    The covariance is that of all robots, or has shape (robots, parameters, parameters), of some
    that stand for them. `poses` are those in the forms and those left out; `noise_degrees` the
    degrees of freedom of a noise that was estimated and scales the covariance.
    """
    count = covariance.size // covariance.shape[-1] ** 2
    means = [math.sqrt(max(float(np.sum(form * covariance)) / count, 0.0)) for form in forms]
    bounds = [bound_of(form, covariance, confidence, noise_degrees) for form in forms]
    return ExpectedAccuracy(means[0], means[1], *poses, confidence, bounds[0], bounds[1])


def bound_of(
    form: Array, covariance: Array, confidence: float, noise_degrees: float = math.inf
) -> float:
    """Return what the root of one such mean squared error is within; NaN if nothing is known."""
    stacked = _stacked(covariance)
    if not np.isfinite(stacked).all():
        return math.nan
    return math.sqrt(_core.mixed_quantile(form, stacked, confidence, noise_degrees))


def anywhere(
    effects: Array, covariance: Array, confidence: float, noise_degrees: float = math.inf
) -> tuple[float, float]:
    """Return what the largest position and orientation error over poses are within, m and rad.

    `effects`, shape (n, 6, parameters), are tangents of the poses by the parameters; the covariance
    is as `promised` takes it.
    """
    if not len(effects) or not np.isfinite(covariance).all():
        return math.nan, math.nan
    rows = np.ascontiguousarray(effects.reshape(-1, effects.shape[2]))
    position, orientation = _core.largest_errors(
        rows, 6, 2, _stacked(covariance), confidence, noise_degrees
    )
    return float(position), float(orientation)


def _stacked(covariance: Array) -> Array:
    """One or several covariances, one below the other."""
    return np.ascontiguousarray(covariance).reshape(-1, covariance.shape[-1])


def sampled_bound(errors: Array, confidence: float = CONFIDENCE) -> float:
    """Return what the root mean square over all poses is within, by errors at some of them.

    They are a random sample of these, of one robot: the logarithm of their mean square is taken
    for normal, with the standard error that their scatter says. NaN of fewer than two.
    """
    squares = errors[np.isfinite(errors)] ** 2
    count = len(squares)
    if count < 2:
        return math.nan
    mean = float(squares.mean())
    if mean == 0:
        return 0.0
    error = float(squares.std(ddof=1)) / (mean * math.sqrt(count))
    one_sided = _core.student_limit(2 * (1 - confidence), count - 1)
    return math.sqrt(mean * math.exp(one_sided * error))


def left_to_gravity(mechanism: Mechanism) -> str:
    """What the readings of a platform that hangs leave open, and what to measure."""
    names = ", ".join(mechanism.open_coordinates)
    bound = mechanism.space.dof - len(mechanism.open_coordinates)
    return (
        f"readings determine {bound} of the platform's {mechanism.space.dof} coordinates, gravity "
        f"decides the rest: measure {names} as well wherever its pose is to be known"
    )


def require_determined(mechanism: Mechanism) -> None:
    """Refuse errors of poses at given readings where readings do not determine poses."""
    if mechanism.open_coordinates:
        raise SymkinError(
            f"{left_to_gravity(mechanism)}. So no accuracy of poses at given readings can be told"
        )


def parameter_effects(mechanism: Mechanism, poses: Array) -> tuple[Array, NDArray[np.bool_]]:
    """How the platform moves in the robot's own frame with the parameters, at given readings.

    Tangents of the poses that are neither out of reach nor singular, by the parameters of each leg
    and by the terms of curved sensors, shape (n, 6, legs, p + 3); and which poses those are, (N,).
    """
    require_determined(mechanism)
    p, k = len(mechanism.parameter_names), mechanism.closures
    offset = mechanism.parameter_names.index("sensor_offset")
    readings = mechanism.inverse_kinematics(poses)
    by_pose, by_leg = [], []
    for leg, psi in enumerate(readings.T):
        rows = mechanism.linearised(leg, poses, psi)
        terms = np.column_stack([psi**2, np.cos(psi), np.sin(psi)])  # of the curvature
        bent = rows.by_parameters[:, [offset]] * np.repeat(terms, k, axis=0)
        by_pose.append(rows.by_pose.reshape(len(poses), k, -1))
        by_leg.append(np.hstack([rows.by_parameters, bent]).reshape(len(poses), k, -1))
    by_poses = np.concatenate(by_pose, axis=1)
    by_legs = np.stack(by_leg, axis=1)  # poses, legs, closures, scalars
    reached = np.isfinite(by_poses).all(axis=(1, 2)) & np.isfinite(by_legs).all(axis=(1, 2, 3))
    good, inverse = _inverses(by_poses, reached)
    of_rows = -inverse.reshape(len(inverse), -1, len(readings.T), k)
    by_legs = by_legs if good.all() else by_legs[good]
    moved = np.einsum("ndlk,nlks->ndls", of_rows, by_legs)
    if moved.shape[1] == 6:
        return moved, good
    moves = np.zeros((len(inverse), 6, len(readings.T), p + 3))
    moves[:, mechanism.space.components] = moved
    return moves, good


def variances_by_readings(
    model: Mechanism,
    table: Measurements,
    poses: Array,
    deviation: float,
    places: Array | None = None,
    along: Array | None = None,
) -> Array:
    """Variances of the target's pose that the readings' noise makes, shape (N, dof).

    At the model's poses in its own frame, (N, coordinates); `deviation`, m or rad, is that of
    readings for which the table has none of its own. With `places`, (N, 3), of points on the
    platform, m, instead of the target; of its place `along` some directions alone, (k, 3).
    """
    space, own = model.space, table.reading_deviations
    variances = np.full(table.readings.shape, deviation**2)
    if own is not None:
        variances = np.where(np.isfinite(own), own**2, variances)
    if not variances.any():
        return np.zeros((len(poses), space.dof if along is None else len(along)))
    by_readings = np.linalg.pinv(model.pose_jacobian(poses))
    moves = np.zeros((len(poses), 6, by_readings.shape[2]))
    moves[:, space.components] = by_readings
    target = frame(model.pose_space, model.frames.target if model.frames else ()).translation
    there = np.broadcast_to(target, (len(poses), 3)) if places is None else places
    arms = np.einsum("nij,nj->ni", transforms(model.pose_space, poses).rotation, there)
    moves[:, :3] += np.cross(moves[:, 3:], arms[:, :, None], axis=1)
    if along is not None:
        return np.asarray(np.einsum("nkj,nj->nk", (along @ moves[:, :3]) ** 2, variances))
    squares = np.einsum("nij,nj->ni", moves**2, variances)
    # Along other axes in the device's frame, but as large together.
    for part in (range(3), range(3, 6)):
        shown = [each for each in space.components if each in part]
        if shown:
            squares[:, shown] = squares[:, shown].mean(axis=1, keepdims=True)
    return np.asarray(squares[:, space.components])


def _inverses(matrices: Array, some: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Array]:
    """Which of some matrices are not singular, and the inverses or pseudoinverses of these."""
    if matrices.shape[1] == matrices.shape[2]:
        with contextlib.suppress(np.linalg.LinAlgError):  # one is singular to the last digit
            # By Frobenius norms, which takes a fifth of the time of singular values.
            inverse = np.linalg.inv(matrices[some])
            sizes = [np.square(each).sum(axis=(1, 2)) for each in (matrices[some], inverse)]
            regular = sizes[0] * sizes[1] < _RANK**-2
            good = some.copy()
            good[some] = regular
            return good, inverse[regular]
    singular = np.linalg.svd(np.where(some[:, None, None], matrices, 0), compute_uv=False)
    good = some & (singular[:, -1] > _RANK * singular[:, 0])
    return good, np.asarray(np.linalg.pinv(matrices[good]))


def thinned(poses: NDArray[_Scalar], most: int = _AVERAGED) -> NDArray[_Scalar]:
    """At most so many poses, or numbers of theirs, by default as errors are averaged over."""
    return poses[:: -(-len(poses) // most)]


def examined(poses: Array) -> Array:
    """The poses among which the largest error is looked for."""
    return thinned(poses, _EXAMINED)
