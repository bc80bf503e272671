# SPDX-License-Identifier: MIT
"""Mechanisms and their legs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.chains import ParameterRole, chain_info
from symkin.errors import MechanismError, did_you_mean, printable
from symkin.settings import (
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)

__all__ = ["DeclaredSymmetry", "Leg", "Mechanism"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Leg:
    """One leg.

    Attributes
    ----------
    chain : str
        Joints from base to platform, the actuated one in brackets, such as ``"[R]RR"``.
    parameters : mapping of str to float
        By name, m and rad; `symkin.chain_info` lists them.
    working_mode : {-1, 1}
        Which root of the closure; `ChainInfo.description` says what the sign means.
    """

    chain: str
    parameters: Mapping[str, float]
    working_mode: int = -1


@dataclass(frozen=True)
class DeclaredSymmetry:
    """The symmetry that a mechanism is said to have.

    Attributes
    ----------
    group : str
        ``"C3"`` (rotations), ``"D3"`` (rotations and reflections), ...
    axis : float
        Azimuth of the line (spatially, the plane through Z) of the reflection ``s0``, rad.
    elements : tuple of str or None
        The elements that carry leg 1 to legs 1, 2, ...: ``r0``, ``r1``, ... are rotations, ``s0``,
        ``s1``, ... reflections. None is their natural order.
    """

    group: str
    axis: float = 0.0
    elements: tuple[str, ...] | None = None


@dataclass(frozen=True, init=False, eq=False)
class Mechanism:
    """A parallel mechanism: legs of one chain between a base and a platform, and its settings.

    Arrays of poses have one pose a row: ``x, y, phi`` (planar), ``x, y`` (point platform) or
    ``x, y, z, qx, qy, qz, qw`` (spatial, unit quaternion from platform to base frame); m and rad.
    Pose derivatives and errors have the position first, then the angle or the rotation vector in
    the base frame.

    Parameters
    ----------
    name : str
        For messages and reports.
    legs : sequence of Leg
        All of one chain; at least as many as the platform has degrees of freedom.
    platform : {"rigid", "point"}
        A platform that turns, or a point that only moves (five-bar).
    reading_unit : {"rad", "m"}, optional
        Unit of the sensors, by default the active joint's. A motor that winds a cable reads "rad"
        while its joint is a length; the gain is then m/rad.
    symmetry, workspace, noise, tolerances, protocol, joint_limits, measurement_columns
        What a mechanism file holds besides the legs, see `symkin.settings`.
    deviations : array_like, shape (legs, p), optional
        Standard deviation of each parameter, of a calibrated mechanism.
    source : Path, optional
        The file that it was read from.

    Raises
    ------
    SymkinError
        Naming the leg and the parameter at fault. The methods that take poses raise it for a
        quaternion that is not of unit length within 1e-3.
    """

    name: str
    legs: tuple[Leg, ...]
    platform: str
    reading_unit: str
    symmetry: DeclaredSymmetry | None
    workspace: WorkspaceSettings | None
    noise: NoiseSettings
    tolerances: Tolerances
    protocol: ProtocolSettings
    joint_limits: JointLimits
    deviations: Array | None
    measurement_columns: MeasurementColumns | None
    source: Path | None
    core: _core.Mechanism = dataclasses.field(repr=False)

    def __init__(
        self,
        name: str,
        legs: Sequence[Leg],
        *,
        platform: str = "rigid",
        reading_unit: str | None = None,
        symmetry: DeclaredSymmetry | None = None,
        workspace: WorkspaceSettings | None = None,
        noise: NoiseSettings | None = None,
        tolerances: Tolerances | None = None,
        protocol: ProtocolSettings | None = None,
        joint_limits: JointLimits | None = None,
        deviations: ArrayLike | None = None,
        measurement_columns: MeasurementColumns | None = None,
        source: Path | None = None,
    ) -> None:
        if not name.isprintable():
            raise MechanismError(
                f'the name "{printable(name)}" has characters that cannot be printed'
            )
        legs = tuple(legs)
        info = chain_info(_common_chain(legs), platform)
        values = np.array([_values(leg, info.parameter_names, i) for i, leg in enumerate(legs, 1)])
        fields: dict[str, Any] = {
            "name": name,
            "legs": legs,
            "platform": platform,
            "reading_unit": reading_unit or info.reading_unit,
            "symmetry": symmetry,
            "workspace": workspace,
            "noise": noise or NoiseSettings(),
            "tolerances": tolerances or Tolerances(),
            "protocol": protocol or ProtocolSettings(),
            "joint_limits": joint_limits or JointLimits(),
            "deviations": (
                None if deviations is None else _of_legs("deviations", deviations, values.shape)
            ),
            "measurement_columns": measurement_columns,
            "source": source,
            "core": _core.Mechanism(
                name, info.name, platform, values, [leg.working_mode for leg in legs]
            ),
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)

    @property
    def chain(self) -> str:
        """The chain of all legs."""
        return self.legs[0].chain

    @property
    def pose_space(self) -> str:
        """Kind of the poses: "planar", "point" or "spatial"."""
        return self.core.pose_space

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the p parameters of a leg, in the order of every array."""
        return chain_info(self.chain, self.platform).parameter_names

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Unit of each parameter with this sensor: "m", "rad", "m/rad", ...; "" for a number."""
        info = chain_info(self.chain, self.platform)
        units = info.units_of_sensor(self.reading_unit).values()
        return tuple("" if unit == "1" else unit for unit in units)

    @property
    def parameter_roles(self) -> tuple[ParameterRole, ...]:
        """What each parameter is: the end of the leg that it belongs to, and its kind."""
        return tuple(chain_info(self.chain, self.platform).parameter_roles.values())

    @property
    def sensor_gains(self) -> Array:
        """Change of the active joint by a sensor's reading, shape (legs,)."""
        gain = self.parameter_roles.index(ParameterRole("none", "gain"))
        return np.asarray(self.core.parameters[:, gain])

    @property
    def parameters(self) -> Array:
        """Parameters, shape (legs, p)."""
        return self.core.parameters

    @property
    def working_modes(self) -> tuple[int, ...]:
        """Working mode of each leg."""
        return tuple(leg.working_mode for leg in self.legs)

    @property
    def home(self) -> Array:
        """The pose at which the workspace's aspect is defined, shape (coordinates,)."""
        given = None if self.workspace is None else self.workspace.home
        return poses_from_bounds(self.pose_space, given or (0.0,) * self.core.dof)

    def replace(self, **changes: Any) -> Mechanism:
        """Return a copy with other values of the constructor's arguments.

        Returns
        -------
        Mechanism
        """
        given = {
            field.name: getattr(self, field.name)
            for field in dataclasses.fields(self)
            if field.name != "core"
        }
        return Mechanism(**(given | changes))

    def with_parameters(
        self, parameters: ArrayLike, deviations: ArrayLike | None = None
    ) -> Mechanism:
        """Return the mechanism with other parameter values, shape (legs, p).

        Returns
        -------
        Mechanism
        """
        values = _of_legs("parameters", parameters, self.parameters.shape)
        legs = [
            dataclasses.replace(leg, parameters=dict(zip(self.parameter_names, row, strict=True)))
            for leg, row in zip(self.legs, values.tolist(), strict=True)
        ]
        return self.replace(legs=legs, deviations=deviations)

    def inverse_kinematics(self, poses: ArrayLike) -> Array:
        """Sensor readings at poses.

        Parameters
        ----------
        poses : array_like, shape (N, coordinates)
            One pose a row; a single pose may be one-dimensional.

        Returns
        -------
        ndarray, shape (N, legs)
            In the sensor's unit, angles within half a turn of the sensor's zero; NaN where a leg
            cannot reach.
        """
        return _core.inverse_kinematics(self.core, self._poses(poses))

    def forward_kinematics(
        self, readings: ArrayLike, start: ArrayLike | None = None
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Poses at sensor readings, by Newton's method on the closures.

        Parameters
        ----------
        readings : array_like, shape (N, legs)
            In the sensor's unit.
        start : array_like, shape (coordinates,) or (N, coordinates), optional
            Where to start, by default at home. Its aspect is the one that counts.

        Returns
        -------
        poses : ndarray, shape (N, coordinates)
            NaN where the method does not converge.
        converged : ndarray of bool, shape (N,)
            Whether the pose solves the closures within the start's aspect.
        """
        begin = self.home if start is None else start
        result = _core.forward_kinematics(self.core, _rows(readings), self._poses(begin))
        return result.poses, result.converged

    def closure(self, leg: int, poses: ArrayLike, readings: ArrayLike) -> Array:
        """Closure h of a leg (from 0), m, shape (N,): how far it is from closing at the poses.

        `readings` are this leg's, shape (N,). Zero for a perfect leg; finite beyond its reach.

        Returns
        -------
        ndarray, shape (N,)
            m.
        """
        return _core.closure(self.core, leg, self._poses(poses), np.atleast_1d(_floats(readings)))

    def parameter_jacobian(self, leg: int, poses: ArrayLike) -> Array:
        """dg/dparam of a leg (from 0) at its inverse kinematics, shape (N, p).

        The rows of the paper's identification matrix C (Eqs. 8, 11), in sensor units per parameter
        unit; NaN where the leg cannot reach.

        Returns
        -------
        ndarray, shape (N, p)
            In sensor units per parameter unit.
        """
        return _core.parameter_jacobian(self.core, leg, self._poses(poses))

    def pose_jacobian(self, poses: ArrayLike) -> Array:
        """dg/dpose of all legs at the inverse kinematics, shape (N, legs, dof).

        Returns
        -------
        ndarray, shape (N, legs, dof)
            In sensor units per m and rad.
        """
        rows = self._poses(poses)
        jacobian = _core.pose_jacobian(self.core, rows)
        return jacobian.reshape(len(rows), len(self.legs), self.core.dof)

    def singularity_measures(
        self, poses: ArrayLike, characteristic_length: float | None = None
    ) -> tuple[Array, Array, Array]:
        """How near poses are to singularities.

        Returns
        -------
        serial : ndarray, shape (N, legs)
            dh/dq of each leg: zero at a serial (type 1) singularity.
        parallel : ndarray, shape (N,)
            det(dg/dpose): zero at a parallel (type 2) singularity.
        condition : ndarray, shape (N,)
            Condition number of dq/dpose, rotations scaled by the characteristic length (m), which
            is by default the workspace's, else the mean platform radius.
        """
        length = characteristic_length or self.characteristic_length
        measures = _core.singularity_measures(self.core, self._poses(poses), length)
        return measures.serial, measures.parallel, measures.condition

    @property
    def characteristic_length(self) -> float:
        """Length that makes rotations comparable with translations, m."""
        if self.workspace is not None and self.workspace.characteristic_length is not None:
            return self.workspace.characteristic_length
        if "platform_radius" in self.parameter_names:
            column = self.parameter_names.index("platform_radius")
            return float(np.mean(np.abs(self.parameters[:, column]))) or 1.0
        return 1.0

    def _poses(self, poses: ArrayLike) -> Array:
        """Poses as rows; a quaternion that stands for no rotation is refused."""
        rows = _rows(poses)
        wrong = wrong_quaternion(rows) if self.pose_space == "spatial" else None
        if wrong is not None:
            raise MechanismError(
                f"pose {wrong[0] + 1} has a quaternion of norm {wrong[1]:.6g}; expected 1"
            )
        return rows


def wrong_quaternion(poses: Array) -> tuple[int, float] | None:
    """Return the first of spatial poses whose quaternion is not of unit length, and its norm.

    A norm within 1e-3 of 1 is rounded, and is brought to 1 by the core; NaN is no pose at all.
    """
    if poses.ndim != 2 or poses.shape[1] != 7:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        norms = np.linalg.norm(poses[:, 3:], axis=1)
        wrong = np.flatnonzero(np.abs(norms - 1) > 1e-3)
    return (int(wrong[0]), float(norms[wrong[0]])) if len(wrong) else None


def poses_from_bounds(pose_space: str, values: ArrayLike) -> Array:
    """Poses written as position and angle or rotation vector, as pose arrays.

    Parameters
    ----------
    pose_space : {"planar", "point", "spatial"}
        Kind of the poses.
    values : array_like, shape (..., dof)
        Position (m), then angle or rotation vector (rad).

    Returns
    -------
    ndarray, shape (..., coordinates)
    """
    values = _floats(values)
    if pose_space != "spatial":
        return values
    from symkin.poses import quaternions_from_rotation_vectors

    quaternions = quaternions_from_rotation_vectors(values[..., 3:].reshape(-1, 3))
    return np.concatenate([values[..., :3], quaternions.reshape(*values.shape[:-1], 4)], axis=-1)


def require_same_shape(actual: Mechanism, model: Mechanism) -> None:
    """Refuse a robot that is of another kind than its model.

    Raises
    ------
    MechanismError
        Naming legs, chain and pose space of both.
    """
    shapes = [f"{len(each.legs)} legs {each.chain}, {each.pose_space}" for each in (actual, model)]
    if shapes[0] != shapes[1]:
        raise MechanismError(
            f'the robot "{actual.name}" has {shapes[0]}, its model "{model.name}" {shapes[1]}; '
            "expected the same"
        )


def _floats(values: ArrayLike) -> Array:
    return np.ascontiguousarray(values, dtype=np.float64)


def _of_legs(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise MechanismError(f"{name} have shape {array.shape}; expected (legs, p) = {shape}")
    return array


def _rows(values: ArrayLike) -> Array:
    return np.atleast_2d(_floats(values))


def _common_chain(legs: Sequence[Leg]) -> str:
    if not legs:
        raise MechanismError("a mechanism needs legs; got none")
    for number, leg in enumerate(legs, 1):
        if leg.chain != legs[0].chain:
            raise MechanismError(
                f'leg {number} is a "{leg.chain}", leg 1 a "{legs[0].chain}"; expected one chain '
                "for all legs"
            )
    return legs[0].chain


def _values(leg: Leg, names: Sequence[str], number: int) -> list[float]:
    """The parameters of a leg in the chain's order."""
    for name in leg.parameters:
        if name not in names:
            raise MechanismError(
                f'leg {number}: "{name}" is no parameter of chain {leg.chain}'
                f"{did_you_mean(name, names)}"
            )
    missing = [name for name in names if name not in leg.parameters]
    if missing:
        raise MechanismError(f"leg {number}: {', '.join(missing)} missing")
    return [float(leg.parameters[name]) for name in names]
