# SPDX-License-Identifier: MIT
"""Mechanisms and their legs."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core, present
from symkin.errors import MechanismError, named_legs, one_of, printable
from symkin.model.chains import (
    ABSENT,
    ChainInfo,
    Leg,
    ParameterRole,
    chain_info,
    chains_in_words,
    common_reading_unit,
    legs_in_words,
    parameter_values,
    require_mixable,
    union_of_names,
)
from symkin.model.declared import label_of, readings_of_legs
from symkin.model.devices import Device, device_of, equipped
from symkin.model.kinematics import Kinematics
from symkin.model.poses import POSE_SPACES, PoseSpace
from symkin.model.sensor_table import SensorTable
from symkin.model.settings import (
    DeclaredSymmetry,
    DrawnPoints,
    Frames,
    IdentificationSettings,
    JointLimits,
    MeasurementColumns,
    NoiseSettings,
    ProtocolSettings,
    Tolerances,
    WorkspaceSettings,
)
from symkin.values import Array, read_only

__all__ = ["Leg", "Mechanism"]


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Mechanism(Kinematics):
    """A parallel mechanism: legs between a base and a platform, and its settings.

    Arrays of poses have one pose a row: ``x, y, phi`` (planar), ``x, y`` (point platform), ``x, y,
    z, qx, qy, qz, qw`` (spatial, unit quaternion from platform to base frame), ``x, y, z``
    (translating platform) or ``qx, qy, qz, qw`` (spherical platform); m and rad.
    Pose derivatives and errors have the position first, then the angle or the rotation vector in
    the base frame.

    Parameters
    ----------
    name : str
        For messages and reports.
    legs : sequence of Leg
        At least as many as the platform has degrees of freedom. Three of them where a leg binds it
        (3-RPS, 3-PRS): they leave it z and two tilts. Legs may be of different chains if each
        brings one closure; see `has_parameter`.
    platform : {"rigid", "point", "translating", "spherical", "schoenflies"}
        A platform that turns, a point that only moves in the plane (five-bar), one that moves in
        space and never turns (delta), or one that only turns, about a fixed point (Agile Eye).
    reading_unit : {"rad", "m"}, optional
        Unit of all sensors, by default the active joints'; required if some of those are angles
        and some lengths. A motor that winds a cable, or turns a screw, reads "rad" while its joint
        is a length; the gain is then m/rad.
    reading_step : float, optional
        How much of the reading's unit one step of a drive, or one count of an encoder, is: tables
        may have columns such as ``psi_1_step``.
    reading_wraps : bool
        Whether sensors of angles show each turn the same, such as absolute encoders: readings of
        tables are then taken within half a turn of home, as those that are calculated are. Others
        count on.
    symmetry, workspace, noise, tolerances, protocol, joint_limits, measurement_columns
        What a mechanism file holds besides the legs, see `symkin.model.settings`.
    deviations : array_like, shape (legs, p), optional
        Standard deviation of each parameter, of a calibrated mechanism.
    source : Path, optional
        The file that it was read from.
    frames : Frames, optional
        What stands around it as it is measured. Measured poses are those of the target in the
        device's frame; poses that are commanded or calculated are the robot's own.
    identification : IdentificationSettings, optional
        What is unknown, unless `identify` is told otherwise.
    curvature : array_like, shape (legs, 3), optional
        c, a, b of sensors that are not straight: the active joint is at ``gain psi + offset +
        c psi^2 + a cos(psi) + b sin(psi)`` at the reading psi (in rad for a and b).
    points : DrawnPoints, optional
        That its file gives points by coordinates, and in which frames.
    sensor_table : SensorTable, optional
        Through which readings in files go, and which makes the sensors straight. The mechanism's
        readings, their noise and their limits are those of straight sensors.
    device : Device, optional
        What measures it, whose presets plans, simulations and estimates obey; see `with_device`.

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
    reading_step: float | None
    reading_wraps: bool
    symmetry: DeclaredSymmetry | None
    workspace: WorkspaceSettings | None
    noise: NoiseSettings
    tolerances: Tolerances
    protocol: ProtocolSettings
    joint_limits: JointLimits
    deviations: Array | None
    measurement_columns: MeasurementColumns | None
    source: Path | None
    frames: Frames | None
    identification: IdentificationSettings | None
    curvature: Array | None
    points: DrawnPoints | None
    sensor_table: SensorTable | None
    device: Device | None
    straight: _core.Mechanism
    _infos: ClassVar[tuple[ChainInfo, ...]]  # set with the others, but no fields
    _names: ClassVar[tuple[str, ...]]
    _parameters: ClassVar[Array]

    def __init__(
        self,
        name: str,
        legs: Sequence[Leg],
        *,
        platform: str = "rigid",
        reading_unit: str | None = None,
        reading_step: float | None = None,
        reading_wraps: bool = False,
        symmetry: DeclaredSymmetry | None = None,
        workspace: WorkspaceSettings | None = None,
        noise: NoiseSettings | None = None,
        tolerances: Tolerances | None = None,
        protocol: ProtocolSettings | None = None,
        joint_limits: JointLimits | None = None,
        deviations: ArrayLike | None = None,
        measurement_columns: MeasurementColumns | None = None,
        source: Path | None = None,
        frames: Frames | None = None,
        identification: IdentificationSettings | None = None,
        curvature: ArrayLike | None = None,
        points: DrawnPoints | None = None,
        sensor_table: SensorTable | None = None,
        device: Device | None = None,
    ) -> None:
        if not name.isprintable():
            raise MechanismError(
                f'the name "{printable(name)}" has characters that cannot be printed'
            )
        legs = tuple(legs)
        if reading_step is not None and not 0 < reading_step < np.inf:
            raise MechanismError(f"reading_step is {reading_step:g}; expected a positive number")
        if not legs:
            raise MechanismError("a mechanism needs legs; got none")
        infos = tuple(chain_info(leg.chain, platform) for leg in legs)
        read = sum(info.read for info in infos)
        if not all(info.read for info in infos[:read]):
            raise MechanismError("expected legs without a reading behind those that have one")
        (joint_limits or JointLimits()).of_legs(read)  # raises if there are not as many
        if sensor_table is not None:
            sensor_table.require_legs(len(legs))
            if read < len(legs):
                raise MechanismError("a table of sensors goes with legs that are all read")
        require_mixable(infos)
        reading_unit = reading_unit or common_reading_unit(infos)
        names = union_of_names(infos)
        legs = tuple(
            dataclasses.replace(
                leg, chain=info.name, parameters=parameter_values(leg, info, number)
            )
            for number, (leg, info) in enumerate(zip(legs, infos, strict=True), 1)
        )
        values = np.array([[leg.parameters.get(name, 0.0) for name in names] for leg in legs])
        fields: dict[str, Any] = {
            "name": name,
            "legs": legs,
            "platform": platform,
            "reading_unit": one_of("reading_unit", reading_unit, ("rad", "m")),
            "reading_step": reading_step,
            "reading_wraps": reading_wraps,
            "symmetry": symmetry,
            "workspace": workspace,
            "noise": noise or NoiseSettings(),
            "tolerances": tolerances or Tolerances(),
            "protocol": protocol or ProtocolSettings(),
            "joint_limits": joint_limits or JointLimits(),
            "deviations": None if deviations is None else _deviations(deviations, legs, names),
            "measurement_columns": measurement_columns,
            "source": source,
            "frames": frames,
            "identification": identification,
            "curvature": (
                None
                if curvature is None or not np.any(curvature)
                else _of_legs("curvature", curvature, (len(legs), 3))
            ),
            "points": points,
            "sensor_table": sensor_table,
            "device": device,
            "straight": _core.Mechanism(
                name,
                [info.name for info in infos],
                platform,
                values,
                [leg.working_mode for leg in legs],
            ),
            "_infos": infos,
            "_names": names,
            "_parameters": read_only(values),
        }
        vars(self).update(fields)
        # Readings count on from home, wherever the sensors' zeros are.
        vars(self)["straight"] = self.straight.counted_from(self.home)

    @property
    def arguments(self) -> dict[str, Any]:
        """The constructor's arguments."""
        names = (field.name for field in dataclasses.fields(self) if field.name != "straight")
        return {name: getattr(self, name) for name in names}

    def __reduce__(self) -> tuple[Any, ...]:
        """Make it anew, since the core cannot be pickled."""
        return partial(type(self), **self.arguments), ()

    def __eq__(self, other: object) -> bool:
        """Whether it is the same mechanism with the same settings, wherever it comes from."""
        if not isinstance(other, Mechanism):
            return NotImplemented
        mine, others = self.arguments | {"source": None}, other.arguments | {"source": None}
        arrays = ("deviations", "curvature")
        pairs = [(mine.pop(name), others.pop(name)) for name in arrays]
        return mine == others and all(
            one is another
            if one is None or another is None
            else np.array_equal(one, another, equal_nan=True)
            for one, another in pairs
        )

    def __hash__(self) -> int:
        """Return a hash of its geometry."""
        return hash((self.name, self.legs, self.platform, self.reading_unit))

    def __repr__(self) -> str:
        """Return what kind of mechanism it is."""
        symmetry = f", {self.symmetry.group}" if self.symmetry is not None else ""
        calibrated = ", with standard deviations" if self.deviations is not None else ""
        legs = legs_in_words(self.legs)
        curved = ", curved sensors" if self.curvature is not None else ""
        what = f"{legs}, {self.pose_space}{symmetry}{curved}{calibrated}"
        return f'<{type(self).__name__} "{self.name}": {what}>'

    def _repr_html_(self) -> str:
        """Show its drawing and its legs in a notebook."""
        return present.notebook_of(self)

    @property
    def core(self) -> _core.Mechanism:
        """The mechanism in the core, for what knows straight sensors alone.

        Raises
        ------
        MechanismError
            For curved sensors, since what is computed with straight ones would be wrong.
        """
        if self.curvature is not None:
            raise MechanismError(
                f'the sensors of "{self.name}" are not straight lines; expected straight ones: '
                "identification leg by leg has no terms for curved ones"
            )
        return self.straight

    @property
    def chain(self) -> str:
        """The chain of all legs; of mixed ones how many have each, ``"2 [R]RR + 1 [P]RP"``."""
        return chains_in_words(self.legs)

    @property
    def chains(self) -> tuple[str, ...]:
        """The chain of each leg."""
        return tuple(leg.chain for leg in self.legs)

    @property
    def has_declared(self) -> bool:
        """Whether a leg is declared joint by joint."""
        return any(info.declared for info in self._infos)

    @property
    def mixed(self) -> bool:
        """Whether legs have different chains."""
        return len(set(self.chains)) > 1

    def leg_info(self, leg: int) -> ChainInfo:
        """Return the description of the chain of a leg (from 0)."""
        return self._infos[leg]

    @cached_property
    def leg_readings(self) -> tuple[tuple[int, ...], ...]:
        """The legs (from 0), each by itself, but those that are readings of one leg together.

        A declared leg with several joints that are read is in every array as many legs, which share
        their geometry.
        """
        return readings_of_legs(self.chains)

    def named_legs(self, legs: Iterable[int]) -> str:
        """Name legs (from 0) in a message; of several readings of one leg, also which they are.

        ``legs 2, 3``, or ``leg 11 (length of leg 3)``. Where all that a leg has is meant, its
        closures without a reading are not told.
        """
        named = [*legs]
        places: dict[int, str] = {}
        for number, readings in enumerate(self.leg_readings, 1):
            told = readings
            if {*readings} <= {*named}:
                told = tuple(leg for leg in readings if leg in self.told_legs)
                named = [leg for leg in named if leg in told or leg not in readings]
            if len(told) > 1:
                places |= {
                    each: f"{label_of(self.chains[each]).rpartition('.')[2]} of leg {number}"
                    for each in told
                }
        return named_legs(named, places)

    @property
    def told_legs(self) -> list[int]:
        """The legs (from 0) that are told of: each reading, and the first closure without any."""
        firsts = {readings[0] for readings in self.leg_readings}
        return [leg for leg, read in enumerate(self.is_read) if read or leg in firsts]

    @property
    def ties(self) -> tuple[str, ...]:
        """What readings of one leg have in common: ``leg1.rod_x = leg4.rod_x``, see `identify`."""
        return tuple(
            f"leg{first + 1}.{name} = leg{other + 1}.{name}"
            for first, *others in self.leg_readings
            for other in others
            for column, name in zip(self.estimated[first], self.estimated_names(first), strict=True)
            if not self.parameter_roles(first)[column].of_sensor
        )

    @property
    def not_leg_by_leg(self) -> str:
        """Why no leg can be identified by itself, from full poses; empty where they can."""
        if not self.is_read.all():
            return "closures of a leg have no reading"
        if self.ties:
            return "several joints of a leg are read"
        return "the sensors are curved" if self.curvature is not None else ""

    @property
    def pose_space(self) -> str:
        """Kind of the poses: a name of `POSE_SPACES`."""
        return self.straight.pose_space

    @property
    def closures(self) -> int:
        """Closures of a leg."""
        return self._infos[0].closures

    @property
    def free(self) -> tuple[int, ...]:
        """Which coordinates of a pose can be chosen, see `ChainInfo.free`."""
        return tuple(self.straight.free_coordinates)

    @cached_property
    def is_read(self) -> NDArray[np.bool_]:
        """Whether a sensor reads each leg, shape (legs,); the others bind the platform."""
        return read_only(np.array([info.read for info in self._infos]))

    @property
    def reading_count(self) -> int:
        """How many legs are read; they are the first."""
        return int(self.is_read.sum())

    @property
    def bound(self) -> bool:
        """Whether some cannot, since the legs bind the platform."""
        return len(self.free) < self.space.dof

    @property
    def space(self) -> PoseSpace:
        """What the poses are made of."""
        return POSE_SPACES[self.pose_space]

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the p parameters that legs have, in the order of every array.

        Of mixed legs these are all that any leg has; see `has_parameter`.
        """
        return self._names

    @property
    def has_parameter(self) -> NDArray[np.bool_]:
        """Whether each leg's chain has each parameter, shape (legs, p): all, unless it is mixed."""
        own = (info.parameter_names for info in self._infos)
        return np.array([[name in names for name in self._names] for names in own])

    def parameter_units(self, leg: int) -> tuple[str, ...]:
        """Unit of each parameter of a leg (from 0) with its sensor: "m", "rad", "m/rad", ...

        Empty for a number, and for a parameter that the leg does not have.
        """
        units = self._infos[leg].units_of_sensor(self.reading_unit)
        return tuple("" if units.get(name) == "1" else units.get(name, "") for name in self._names)

    @property
    def step(self) -> str:
        """The size of a step as files say it, ``"1.25e-05 m/step"``; empty if nobody said it."""
        return (
            "" if self.reading_step is None else f"{self.reading_step!r} {self.reading_unit}/step"
        )

    def parameter_roles(self, leg: int) -> tuple[ParameterRole, ...]:
        """What each parameter of a leg (from 0) is: which end it belongs to, and its kind.

        The kind of one that the leg does not have is "absent".
        """
        return self._roles[leg]

    @cached_property
    def _roles(self) -> tuple[tuple[ParameterRole, ...], ...]:
        return tuple(
            tuple(info.parameter_roles.get(name, ABSENT) for name in self._names)
            for info in self._infos
        )

    @cached_property
    def estimated(self) -> tuple[NDArray[np.intp], ...]:
        """For each leg the columns of the parameters that are identified, ascending.

        The others are held at their values: constants of the description, radii of pulleys, which
        `identify` may free, and of a guide in space
        that coordinate of its point along which it runs, since the sensor's offset does the same.
        """
        columns = self.straight.estimated_parameters
        return tuple(read_only(np.array(each, dtype=np.intp)) for each in columns)

    @property
    def is_estimated(self) -> NDArray[np.bool_]:
        """Whether each parameter is identified, shape (legs, p)."""
        identified = np.zeros(self.parameters.shape, dtype=np.bool_)
        for row, columns in zip(identified, self.estimated, strict=True):
            row[columns] = True
        return identified

    @property
    def estimated_counts(self) -> tuple[int, ...]:
        """How many parameters of each leg are identified."""
        return tuple(map(len, self.estimated))

    @property
    def least_poses(self) -> int:
        """Poses that every leg needs: as many closures as it has parameters to identify."""
        return max(
            -(-len(self._names_of(readings)) // (self.closures * len(readings)))
            for readings in self.leg_readings
        )

    def _names_of(self, readings: Sequence[int]) -> set[str]:
        return {name for reading in readings for name in self.names_in_leg(reading)}

    def estimated_names(self, leg: int) -> tuple[str, ...]:
        """Names of a leg's (from 0) parameters that are identified."""
        return tuple(self.parameter_names[column] for column in self.estimated[leg])

    def names_in_leg(self, leg: int) -> tuple[str, ...]:
        """The same as they are called among all readings of one leg.

        What they share by its name, the sensors of all but the first as ``leg4.sensor_offset``.
        """
        first = next(each[0] for each in self.leg_readings if leg in each)
        roles = self.parameter_roles(leg)
        return tuple(
            f"leg{leg + 1}.{name}" if leg != first and roles[column].of_sensor else name
            for column, name in zip(self.estimated[leg], self.estimated_names(leg), strict=True)
        )

    @cached_property
    def held(self) -> tuple[tuple[str, ...], ...]:
        """Names of each leg's parameters that are held since others do the same."""
        return tuple(
            tuple(
                name
                for name, role, identified in zip(
                    self.parameter_names, self.parameter_roles(leg), row, strict=True
                )
                if not (identified or role.is_constant or role.is_given)
                and (self.is_read[leg] or not role.of_sensor)
            )
            for leg, row in enumerate(self.is_estimated)
        )

    @property
    def sensor_gains(self) -> Array:
        """Change of the active joint by a sensor's reading, shape (legs,)."""
        gain = self.parameter_roles(0).index(ParameterRole("none", "gain"))
        return np.asarray(self.straight.parameters[:, gain])

    @property
    def parameters(self) -> Array:
        """Parameters, read-only, shape (legs, p)."""
        return self._parameters

    @property
    def reading_limits(self) -> Array:
        """Lower and upper limit of each sensor's reading, shape (2, legs); infinite without."""
        limits = np.full((2, len(self.legs)), [[-np.inf], [np.inf]])
        limits[:, self.is_read] = self.joint_limits.of_legs(self.reading_count)
        return limits

    @property
    def files(self) -> tuple[Path, ...]:
        """Files that it was read from: its own, and that of its sensors' table."""
        table = self.sensor_table
        found = (self.source, None if table is None else table.source)
        return tuple(each for each in found if each is not None)

    def within_limits(self, readings: ArrayLike) -> NDArray[np.bool_]:
        """Whether readings, shape (..., legs), are within their limits; NaN is not.

        Returns
        -------
        ndarray of bool, shape (..., legs)
        """
        lower, upper = self.reading_limits
        values = np.asarray(readings, dtype=np.float64)
        if values.shape[-1:] != lower.shape:
            raise MechanismError(
                f"readings have shape {values.shape}; expected (..., {len(self.legs)})"
            )
        return np.asarray((values >= lower) & (values <= upper))

    @property
    def working_modes(self) -> tuple[int, ...]:
        """Working mode of each leg."""
        return tuple(leg.working_mode for leg in self.legs)

    @cached_property
    def home(self) -> Array:
        """The pose at which the workspace's aspect is defined, shape (coordinates,)."""
        return read_only(self.poses_at(self.home_coordinates))

    @property
    def home_coordinates(self) -> Array:
        """Home as position (m), then angle or rotation vector (rad), shape (dof,)."""
        settings = self.workspace
        return np.array((0.0,) * self.straight.dof if settings is None else settings.home_or_origin)

    @property
    def characteristic_length(self) -> float:
        """Length that makes rotations comparable with translations, m."""
        if self.workspace is not None and self.workspace.characteristic_length is not None:
            return self.workspace.characteristic_length
        radii = [abs(leg.parameters.get("platform_radius", 0.0)) for leg in self.legs]
        having = ["platform_radius" in leg.parameters for leg in self.legs]
        return (float(np.mean(np.array(radii)[having])) if any(having) else 0.0) or 1.0

    def replace(self, **changes: Any) -> Self:
        """Return a copy with other values of the constructor's arguments."""
        return type(self)(**(self.arguments | changes))

    def with_device(self, kind: str | Device) -> Self:
        """Return it measured by another device, with what that sets: its noise and what is unknown.

        The readings' noise and the frames that are placed stay.

        Parameters
        ----------
        kind : str or Device
            A name of `symkin.model.devices.DEVICES`, or an unambiguous beginning of one.

        Raises
        ------
        SymkinError
            For an unknown device, and one that sees nothing of such a platform.
        """
        device, unknown = device_of(kind), self.identification
        if self.device is not None and self.device.kind == device.kind:
            return self  # with what its file says of it
        if unknown is not None and self.device is not None:
            was = self.device.unknown_frames(self.space, self.frames)
            kept = None if unknown.frames == was else unknown.frames
            unknown = dataclasses.replace(unknown, frames=kept)
        noise = {"reading": self.noise.reading}
        return self.replace(**equipped(device, self.space, noise, unknown, self.frames))

    def with_parameters(
        self, parameters: ArrayLike, deviations: ArrayLike | None = None, **changes: Any
    ) -> Self:
        """Return the mechanism with other parameter values, shape (legs, p), and other changes."""
        values = _of_legs("parameters", parameters, self.parameters.shape)
        named = (dict(zip(self._names, row, strict=True)) for row in values.tolist())
        legs = [
            dataclasses.replace(leg, parameters={name: row[name] for name in leg.parameters})
            for leg, row in zip(self.legs, named, strict=True)
        ]
        return self.replace(legs=legs, deviations=deviations, **changes)


def require_same_shape(actual: Mechanism, model: Mechanism) -> None:
    """Refuse a robot that is of another kind than its model.

    Raises
    ------
    MechanismError
        Naming legs, chains and pose space of both.
    """
    shapes = [
        f"{len(each.legs)} legs {', '.join(each.chains) if each.mixed else each.chain}, "
        f"{each.pose_space}"
        for each in (actual, model)
    ]
    if shapes[0] != shapes[1]:
        raise MechanismError(
            f'the robot "{actual.name}" has {shapes[0]}, its model "{model.name}" {shapes[1]}; '
            "expected the same"
        )


def _of_legs(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    array = read_only(np.array(values, dtype=np.float64))
    if array.shape != shape:
        raise MechanismError(f"{name} have shape {array.shape}; expected (legs, p) = {shape}")
    return array


def _deviations(given: ArrayLike, legs: Sequence[Leg], names: Sequence[str]) -> Array:
    """NaN where a leg has no such parameter."""
    has = np.array([[name in leg.parameters for name in names] for leg in legs])
    return read_only(np.where(has, _of_legs("deviations", given, has.shape), np.nan))
