# SPDX-License-Identifier: MIT
"""Kinematics of a mechanism, over many poses at once."""

from __future__ import annotations

import operator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.errors import MechanismError
from symkin.model.poses import POSE_SPACES, pose_rows, poses_from_bounds, wrong_quaternion
from symkin.values import Array

__all__ = ["ClosureRows", "Kinematics"]


# Newton's, from a straight sensor's reading to a curved one's.
_STEPS = 20
_MISSED = 1e-9
_STRAYED = 10  # as far from closing as other poses: the least of squares, but not the least of all


class ClosureRows(NamedTuple):
    """A leg's closures, k rows a pose, and their derivatives.

    Attributes
    ----------
    closure : ndarray, shape (k N,)
        m.
    by_pose : ndarray, shape (k N, dof)
        Per m and rad.
    by_reading : ndarray, shape (k N,)
        Per unit of the sensor.
    by_parameters : ndarray, shape (k N, p)
        Per unit of each parameter.
    """

    closure: Array
    by_pose: Array
    by_reading: Array
    by_parameters: Array


class Kinematics:
    """What the core computes of a `Mechanism`, which has these methods.

    Poses are arrays with one pose a row, or a `WorkspaceSample`; see `Mechanism`.
    """

    curvature: Array | None
    straight: _core.Mechanism

    @property
    def closures(self) -> int:
        """Closures of a leg."""
        raise NotImplementedError

    @property
    def bound(self) -> bool:
        """Whether the legs bind some coordinates of the platform."""
        raise NotImplementedError

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the columns of the parameters."""
        raise NotImplementedError

    @property
    def sensor_gains(self) -> Array:
        """Change of the active joint by a sensor's reading, shape (legs,)."""
        raise NotImplementedError

    def straightened(self, readings: ArrayLike) -> Array:
        """Readings that straight sensors of the same gains and offsets would show, (N, legs).

        Returns
        -------
        ndarray, shape (N, legs)
            The same readings if the sensors are straight.
        """
        rows = pose_rows(readings)
        if self.curvature is None:
            return rows
        quadratic, cosine, sine = self.curvature.T
        bend = quadratic * rows**2 + cosine * np.cos(rows) + sine * np.sin(rows)
        return np.asarray(rows + bend / self.sensor_gains)

    def curved(self, straight: ArrayLike) -> Array:
        """What the sensors show where straight ones show these readings, (N, legs).

        Returns
        -------
        ndarray, shape (N, legs)
            The readings whose `straightened` ones these are; NaN where there are none nearby.
        """
        straight = pose_rows(straight)
        if self.curvature is None:
            return straight
        found = straight
        for _ in range(_STEPS):
            found = found - (self.straightened(found) - straight) / self._straightening(found)
        missed = np.abs(self.straightened(found) - straight) > _MISSED * (1 + np.abs(straight))
        return np.where(missed, np.nan, found)

    def _straightening(self, readings: Array) -> Array:
        """How fast the `straightened` readings grow with those of curved sensors."""
        assert self.curvature is not None
        quadratic, cosine, sine = self.curvature.T / self.sensor_gains
        bend = 2 * quadratic * readings - cosine * np.sin(readings) + sine * np.cos(readings)
        return np.asarray(1 + bend)

    @property
    def home(self) -> Array:
        """The pose at which the workspace's aspect is defined, shape (coordinates,)."""
        raise NotImplementedError

    @property
    def characteristic_length(self) -> float:
        """Length that makes rotations comparable with translations, m."""
        raise NotImplementedError

    def inverse_kinematics(self, poses: ArrayLike) -> Array:
        """Sensor readings at poses.

        Parameters
        ----------
        poses : array_like, shape (N, coordinates)
            One pose a row; a single pose may be one-dimensional.

        Returns
        -------
        ndarray, shape (N, legs)
            In the sensor's unit, angles within half a turn of the reading at home; NaN where a leg
            cannot reach.
        """
        return self.curved(_core.inverse_kinematics(self.straight, self._poses(poses)))

    def forward_kinematics(
        self, readings: ArrayLike, start: ArrayLike | None = None
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Poses at sensor readings, by Newton's method on the closures.

        Parameters
        ----------
        readings : array_like, shape (N, legs)
            In the sensor's unit.
        start : array_like, shape (coordinates,) or (N, coordinates), optional
            Where to start, whose aspect is the one that counts. By default home, and where that
            does not lead to a pose the nearest readings that have one, which are continued from,
            and so where more legs than the freedoms close much worse than at other readings.

        Returns
        -------
        poses : ndarray, shape (N, coordinates)
            NaN where the method does not converge.
        converged : ndarray of bool, shape (N,)
            Whether the pose solves the closures within the start's aspect.
        """
        begin = self.home if start is None else start
        straight = self.straightened(readings)
        result = _core.forward_kinematics(self.straight, straight, self._poses(begin))
        if start is not None or not len(straight):
            return result.poses, result.converged
        known = np.where(result.converged[:, None], result.poses, np.nan)
        open_by = self._open_by(known, straight)
        known[open_by > max(_STRAYED * float(np.median(open_by)), _MISSED)] = np.nan
        if np.isfinite(known).all():
            return result.poses, result.converged
        poses = _core.continued(self.straight, straight, self.home, known)
        stays = result.converged & ~(self._open_by(poses, straight) <= open_by)
        poses[stays] = result.poses[stays]
        return poses, np.asarray(np.isfinite(poses).all(axis=1))

    def _open_by(self, poses: Array, straight: Array) -> Array:
        """How far more legs than the freedoms are from closing, m, shape (N,); of fewer 0."""
        found = np.zeros(len(poses))
        if self.straight.redundant:
            for leg in range(straight.shape[1]):
                read = np.ascontiguousarray(straight[:, leg])
                closures = _core.closure(self.straight, leg, poses, read)
                found += np.square(closures).reshape(len(poses), -1).sum(axis=1)
        return np.where(np.isnan(poses).any(axis=1), np.inf, np.sqrt(found))

    @property
    def open_coordinates(self) -> tuple[str, ...]:
        """What readings leave to gravity, as ``("rx", "ry")``: legs fewer than the freedoms.

        At home; measured beside the readings these determine the pose.
        """
        return tuple(_core.open_coordinates(self.straight, self.home))

    def closure(self, leg: int, poses: ArrayLike, readings: ArrayLike) -> Array:
        """Closure h of a leg (from 0), m, shape (N,): how far it is from closing at the poses.

        `readings` are this leg's, shape (N,). Zero for a perfect leg; finite beyond its reach, but
        NaN inside of a pulley, where there is no cable.

        Returns
        -------
        ndarray, shape (N,), or (N, k) where a leg has k closures
            m.
        """
        own = self._straight(leg, readings)
        values = _core.closure(self.straight, leg, self._poses(poses), own)
        return values if self.closures == 1 else values.reshape(-1, self.closures)

    def _straight(self, leg: int, readings: ArrayLike) -> Array:
        """`straightened` readings of one leg, (N,)."""
        own = np.atleast_1d(np.ascontiguousarray(readings, dtype=np.float64))
        if self.curvature is None:
            return own
        if operator.index(leg) not in range(len(self.curvature)):
            last = len(self.curvature) - 1
            raise MechanismError(f"leg {leg} does not exist; expected 0 to {last}")
        every = np.zeros((len(own), len(self.curvature)))
        every[:, leg] = own
        return np.ascontiguousarray(self.straightened(every)[:, leg])

    def linearised(self, leg: int, poses: ArrayLike, readings: ArrayLike) -> ClosureRows:
        """Closures of a leg (from 0) at poses and at its readings, shape (N,), and derivatives.

        Returns
        -------
        ClosureRows
            In m, per m, rad and units of the sensor.
        """
        read = np.atleast_1d(np.ascontiguousarray(readings, dtype=np.float64))
        rows = self._poses(poses)
        made = _core.linearise(self.straight, leg, rows, self._straight(leg, read))
        by_reading, by_parameters = made.by_reading, made.by_parameters
        if self.curvature is not None:
            every = np.zeros((len(read), len(self.curvature)))
            every[:, leg] = read
            slopes = self._straightening(every)[:, leg]
            by_reading = by_reading * np.repeat(slopes, self.closures)
            by_parameters = self._by_own_gain(by_parameters, np.repeat(read, self.closures))
        return ClosureRows(made.closure, made.by_pose, by_reading, by_parameters)

    def _by_own_gain(self, by_parameters: Array, readings: Array) -> Array:
        """Derivatives by a gain that multiplies these readings, and not the `straightened` ones."""
        gain, offset = map(self.parameter_names.index, ("sensor_gain", "sensor_offset"))
        found = by_parameters.copy()
        found[:, gain] = found[:, offset] * readings
        return found

    def closure_error(self, leg: int, poses: ArrayLike, readings: ArrayLike) -> Array:
        """The same as one number a pose: of several closures their root mean square.

        Returns
        -------
        ndarray, shape (N,)
            m.
        """
        values = self.closure(leg, poses, readings)
        return values if self.closures == 1 else np.sqrt(np.mean(values**2, axis=1))

    def poses_at(self, coordinates: ArrayLike) -> Array:
        """Poses by position (m) and angle or rotation vector (rad), shape (..., dof).

        Of a platform that the legs bind (3-RPS, 3-PRS) z, rx and ry are those given, and x, y and
        rz follow from the legs, near what is given for them.

        Returns
        -------
        ndarray, shape (..., coordinates)
            NaN where the legs have no such pose.
        """
        poses = poses_from_bounds(self.straight.pose_space, coordinates)
        if not self.bound:
            return poses
        rows = np.ascontiguousarray(poses.reshape(-1, poses.shape[-1]))
        return _core.on_constraint(self.straight, rows).reshape(poses.shape)

    def parameter_jacobian(self, leg: int, poses: ArrayLike) -> Array:
        """dg/dparam of a leg (from 0) at its inverse kinematics, shape (N, p).

        The rows of the paper's identification matrix C (Eqs. 8, 11), in sensor units per parameter
        unit; NaN where the leg cannot reach.

        Returns
        -------
        ndarray, shape (N, p)
            In sensor units per parameter unit.
        """
        rows = self._poses(poses)
        found = _core.parameter_jacobian(self.straight, leg, rows)
        if self.curvature is None:
            return found
        readings = self.inverse_kinematics(rows)
        slopes = self._straightening(readings)[:, [leg]]
        return np.asarray(self._by_own_gain(found, readings[:, leg]) / slopes)

    def pose_jacobian(self, poses: ArrayLike) -> Array:
        """dg/dpose of all legs at the inverse kinematics, shape (N, legs, dof).

        Returns
        -------
        ndarray, shape (N, legs, dof)
            In sensor units per m and rad.
        """
        rows = self._poses(poses)
        flat, dof = _core.pose_jacobian(self.straight, rows), self.straight.dof
        jacobian = flat.reshape(len(rows), flat.shape[1] // dof, dof)
        if self.curvature is not None:
            jacobian = jacobian / self._straightening(self.inverse_kinematics(rows))[..., None]
        return np.asarray(jacobian)

    def singularity_measures(
        self, poses: ArrayLike, characteristic_length: float | None = None
    ) -> tuple[Array, Array, Array]:
        """How near poses are to singularities.

        Returns
        -------
        serial : ndarray, shape (N, legs)
            dh/dq of each leg: zero at a serial (type 1) singularity.
        parallel : ndarray, shape (N,)
            det(dg/dpose), with what else binds the platform: zero at a parallel (type 2)
            singularity.
        condition : ndarray, shape (N,)
            Condition number of dq/dpose, rotations scaled by the characteristic length (m), which
            is by default the workspace's, else the mean platform radius.
        """
        length = characteristic_length or self.characteristic_length
        measures = _core.singularity_measures(self.straight, self._poses(poses), length)
        return measures.serial, measures.parallel, measures.condition

    def _poses(self, poses: ArrayLike) -> Array:
        """Poses as rows; a quaternion that stands for no rotation is refused."""
        rows = pose_rows(poses)
        turned = POSE_SPACES[self.straight.pose_space].has_quaternion
        wrong = wrong_quaternion(rows) if turned else None
        if wrong is not None:
            raise MechanismError(
                f"pose {wrong[0] + 1} has a quaternion of norm {wrong[1]:.6g}; expected 1"
            )
        return rows
