# SPDX-License-Identifier: MIT
"""Firmware: Klipper, Marlin and RepRapFirmware of delta printers, and LinuxCNC's HAL.

All of them know a linear delta by the same model: tower i stands at the radius R and an angle a_i,
its carriage at the height ``z + sqrt(L_i^2 - (x - R cos a_i)^2 - (y - R sin a_i)^2)``, and it is
found at the endstop. They differ in which of R, a_i and L_i may be told.

Klipper knows an angle, arm and endstop for each tower; of a rotary delta a shoulder radius and
height, and an angle, two arms and an endstop for each. Sources:
https://www.klipper3d.org/Config_Reference.html, klippy/kinematics/delta.py and rotary_delta.py.

M665 and M666 of Marlin and RepRapFirmware know one radius R, a trim of each tower's angle from 210,
330 and 90 degrees, and the height H of the nozzle at the endstops. They differ in the rods (Marlin:
one L and trims A, B, C; of RepRapFirmware an L for each) and in the sign and the mean of the
endstops' corrections.
Sources: Marlin 2.1 src/module/delta.cpp and gcode/calibrate/M665.cpp, M666.cpp;
RepRapFirmware 3 src/Movement/Kinematics/LinearDeltaKinematics.cpp.

LinuxCNC's genhexkins (man page, src/emc/kinematics/genhexkins.c) has the ends of six struts as
pins, so a hexapod is expressed in full. Its lineardeltakins has one radius R, one rod length L, and
towers at exactly 90, 210 and 330 degrees; where a carriage is found is HOME_OFFSET of the ini file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from symkin.errors import SymkinError
from symkin.exports.common import (
    ExportOptions,
    Loss,
    Written,
    loss_of,
    named_columns,
    nearest,
    workspace_poses,
)
from symkin.exports.known_bodies import structure_of
from symkin.model.chains import Leg, legs_in_words
from symkin.model.mechanism import Mechanism
from symkin.values import Array, record

_TILT = np.radians(10)  # that an upright tower or a level axis may have
_DIGITS = 6  # of millimetres and degrees, as Klipper saves them
_LINUXCNC_TOWERS = np.radians([90.0, 210.0, 330.0])
_NEAR = np.radians(30)
_FAR = 10  # times as far from the workspace's readings as these from each other
TOWERS = ("stepper_a", "stepper_b", "stepper_c")  # the names of their sections
NOMINAL_DEGREES = (210.0, 330.0, 90.0)  # where they stand
_MERGE = "These sections are to be merged into those of the printer.cfg that has pins and speeds"


@record
class LinearDelta:
    """A linear delta as firmware knows it; arrays have a value for each tower."""

    radius: float  # of the towers, less that of the effector, m
    angles: Array  # of the towers, rad
    arms: Array  # lengths of the rods, m
    endstops: Array  # heights of the carriages' joints above the bed at their endstops, m
    gains: Array  # way of each carriage for one unit that its drive counts

    @property
    def heights(self) -> Array:
        """Height of the nozzle above the middle of the bed with each carriage at its endstop, m."""
        return np.asarray(self.endstops - np.sqrt(self.arms**2 - self.radius**2))

    @property
    def degrees(self) -> Array:
        """Angles of the towers in [0, 360)."""
        return np.asarray(np.degrees(self.angles) % 360)

    def legs(self, readings: Sequence[float] | Array) -> list[Leg]:
        """Legs of a mechanism, whose sensors read this at the endstops."""
        offsets = self.endstops - self.gains * np.asarray(readings)
        rows = zip(self.angles, self.arms, offsets, self.gains, strict=True)
        return [
            Leg(
                "[P]US",
                {
                    "distal_length": float(arm),
                    "base_radius": self.radius,
                    "base_azimuth": float(angle),
                    "base_height": 0.0,
                    "guide_elevation": np.pi / 2,
                    "guide_swing": 0.0,
                    "sensor_gain": float(gain),
                    "sensor_offset": float(offset),
                },
                working_mode=-1,
            )
            for angle, arm, offset, gain in rows
        ]

    def rounded(self) -> LinearDelta:
        """What a file with six decimals of millimetres and degrees says."""

        def decimals(values: Array, unit: float) -> Array:
            return np.asarray(np.round(values / unit, _DIGITS) * unit)

        degree = np.pi / 180
        radius = float(decimals(np.array(self.radius), 1e-3))
        arms, angles = decimals(self.arms, 1e-3), decimals(self.angles, degree)
        heights = decimals(self.heights, 1e-3)
        endstops = heights + np.sqrt(arms**2 - radius**2)
        return LinearDelta(radius, angles, arms, endstops, self.gains)


def mm(length: float) -> str:
    """A length in millimetres with six decimals; no negative zero."""
    return f"{round(length * 1e3, _DIGITS) + 0.0:.{_DIGITS}f}"


def gain_notes(drives: Iterable[str], gains: Iterable[float], change: str) -> list[str]:
    """What a person must change in the drives, since they count another way than they go."""
    return [
        f"{drive}: {change} by {gain:.8f}, or the errors are larger than said here"
        for drive, gain in zip(drives, gains, strict=True)
        if abs(gain - 1) > 1e-9
    ]


def require_delta(mechanism: Mechanism, chain: str, unit: str, kind: str, firmware: str) -> None:
    """Refuse a robot that is no delta, or whose drives count something else."""
    found = f"{legs_in_words(mechanism.legs)}, {mechanism.pose_space}"
    if (mechanism.chain, mechanism.pose_space, len(mechanism.legs)) != (chain, "translating", 3):
        raise SymkinError(
            f"{firmware} knows {kind}, 3 legs {chain} with a translating platform; "
            f'"{mechanism.name}" has {found}'
        )
    if mechanism.reading_unit != unit:
        raise SymkinError(
            f'the sensors of "{mechanism.name}" read {mechanism.reading_unit}; {firmware} counts '
            f"the way of its drives in {unit}"
        )
    if mechanism.curvature is not None:
        raise SymkinError(f"{firmware} has no curved sensors")
    wrong = np.flatnonzero(mechanism.sensor_gains <= 0)
    if len(wrong):
        leg = int(wrong[0])
        raise SymkinError(
            f"leg {leg + 1} has sensor_gain {mechanism.sensor_gains[leg]:g}; expected a positive "
            "one: turn the motor round in the firmware, and the sign in the mechanism's file"
        )


def endstop_readings(mechanism: Mechanism, options: ExportOptions, *, upper: bool) -> Array:
    """Reading of each sensor at its endstop: as told, or its upper or lower limit."""
    given = options.endstops or tuple(mechanism.reading_limits[int(upper)].tolist())
    if len(given) not in (1, 3):
        raise SymkinError(f"{len(given)} endstops; expected one for all legs, or 3")
    if not np.isfinite(given).all():
        raise SymkinError(
            f'where the endstops of "{mechanism.name}" are is not known: firmware counts from '
            "them. Say what the sensors read there (--endstops, or [joint_limits] in the file)"
        )
    stops = np.array(given * (3 // len(given)))
    if options.endstops and mechanism.workspace is not None:
        _require_near(mechanism, stops, upper=upper)
    return stops


def _require_near(mechanism: Mechanism, stops: Array, *, upper: bool) -> None:
    """Refuse endstops that were told in another unit, or with the other sign."""
    taken = mechanism.inverse_kinematics(workspace_poses(mechanism))
    low, high = np.nanmin(taken, axis=0), np.nanmax(taken, axis=0)
    beyond = np.maximum(low - stops, stops - high)
    passed = stops < low if upper else stops > high
    wrong = np.flatnonzero((beyond > _FAR * (high - low)) | passed)
    if len(wrong):
        leg, unit = int(wrong[0]), mechanism.reading_unit
        raise SymkinError(
            f"the endstop of leg {leg + 1} is at {stops[leg]:g} {unit}, and the workspace has "
            f"readings from {low[leg]:.4g} to {high[leg]:.4g} {unit}; expected it near the "
            f"{'upper' if upper else 'lower'} end of these, or beyond. Say its unit, such as "
            '"400 mm"'
        )


def linear_delta(
    mechanism: Mechanism,
    options: ExportOptions,
    firmware: str,
    *,
    own_arms: bool = True,
    angles: Sequence[float] | None = None,
) -> tuple[LinearDelta, Loss]:
    """Find the values of the firmware's model that are nearest to a robot, and what is lost.

    The carriages run upwards above the effector. The values are rounded as the file has them. With
    `own_arms` each tower may have a rod length of its own; `angles` (rad) are those of the towers
    if they cannot be told.
    """
    require_delta(mechanism, "[P]US", "m", "linear deltas", firmware)
    own = named_columns(mechanism)
    tilts = np.hypot(own["guide_elevation"] - np.pi / 2, own["guide_swing"])
    if tilts.max() > _TILT or set(mechanism.working_modes) != {-1}:
        raise SymkinError(
            f"{firmware} knows upright towers with the carriages above the effector; expected "
            "guide_elevation near 90 deg, guide_swing near 0 and working_mode -1 in every leg of "
            f'"{mechanism.name}"'
        )
    readings = endstop_readings(mechanism, options, upper=True)
    arms = own["distal_length"]
    start = LinearDelta(
        float(own["base_radius"].mean()),
        own["base_azimuth"] if angles is None else np.array(angles),
        arms if own_arms else np.full(3, arms.mean()),
        own["sensor_offset"] + own["base_height"] + own["sensor_gain"] * readings,
        own["sensor_gain"],
    )
    every = range(3)
    unknowns = [[(leg, "base_radius") for leg in every]]
    unknowns += [[(leg, name)] for leg in every for name in ("sensor_offset", "sensor_gain")]
    rods = [(leg, "distal_length") for leg in every]
    unknowns += [[rod] for rod in rods] if own_arms else [rods]
    if angles is None:
        unknowns += [[(leg, "base_azimuth")] for leg in every]
    poses = workspace_poses(mechanism)
    model = mechanism.replace(legs=start.legs(readings), symmetry=None, deviations=None)
    model = nearest(mechanism, model, unknowns, poses)
    found = named_columns(model)
    values = LinearDelta(
        float(found["base_radius"][0]),
        found["base_azimuth"],
        found["distal_length"],
        found["sensor_offset"] + found["sensor_gain"] * readings,
        found["sensor_gain"],
    )
    if not 0 < values.radius < values.arms.min():
        raise SymkinError(
            f"the towers' radius is {values.radius:g} m and the shortest rod "
            f"{values.arms.min():g} m; {firmware} wants rods longer than a positive radius"
        )
    values = values.rounded()
    return values, loss_of(mechanism, model.replace(legs=values.legs(readings)), poses)


def write_klipper(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a linear or rotary delta as sections of a printer.cfg."""
    if mechanism.chain == "[R]US":
        return _rotary(mechanism, options)
    delta, loss = linear_delta(mechanism, options, "Klipper")
    lines = ["[printer]", "kinematics: delta", f"delta_radius: {mm(delta.radius)}", ""]
    for tower, angle, arm, height in zip(
        TOWERS, delta.degrees, delta.arms, delta.heights, strict=True
    ):
        lines += [f"[{tower}]", f"angle: {angle:.6f}", f"arm_length: {mm(arm)}"]
        lines += [f"position_endstop: {mm(height)}", ""]
    notes = (_MERGE, *gain_notes(TOWERS, delta.gains, "multiply rotation_distance"))
    return Written(_commented(notes, lines[:-1]), notes, loss)


def _rotary(mechanism: Mechanism, options: ExportOptions) -> Written:
    """A rotary delta: the crank's axis level and tangential, an angle that turns up positive."""
    require_delta(mechanism, "[R]US", "rad", "rotary deltas", "Klipper")
    own = named_columns(mechanism)
    tilts = np.hypot(own["axis_elevation"], own["axis_swing"])
    turned = np.abs(np.sin(own["axis_azimuth"] - own["base_azimuth"]))
    if max(tilts.max(), turned.max()) > _TILT or set(mechanism.working_modes) != {1}:
        raise SymkinError(
            "Klipper knows cranks whose axes are level and tangential, with the elbows "
            "outwards; expected axis_elevation and axis_swing near 0 and working_mode 1 in every "
            f'leg of "{mechanism.name}"'
        )
    poses = workspace_poses(mechanism)
    assert mechanism.workspace is not None
    # Klipper's bed is at 0, below the shoulders; a robot that hangs from its origin has its bed
    # where the workspace ends.
    bed = 0.0 if own["base_height"].min() > 0 else float(mechanism.workspace.lower[2])
    every = range(3)
    level = {"axis_elevation": 0.0, "axis_swing": 0.0}
    radius, height = float(own["base_radius"].mean()), float(own["base_height"].mean())
    legs = []
    for leg, given in zip(every, mechanism.legs, strict=True):
        # The direction of an axis is counted from its base point here.
        azimuth = {"axis_azimuth": own["base_azimuth"][leg]}
        same = {"base_radius": radius, "base_height": height}
        legs.append(Leg("[R]US", {**given.parameters, **level, **azimuth, **same}, 1))
    unknowns = [[(leg, name) for leg in every] for name in ("base_radius", "base_height")]
    single = ("proximal_length", "distal_length", "sensor_offset", "sensor_gain")
    unknowns += [[(leg, name)] for leg in every for name in single]
    unknowns += [[(leg, "base_azimuth"), (leg, "axis_azimuth")] for leg in every]
    start = mechanism.replace(legs=legs, symmetry=None, deviations=None)
    model = nearest(mechanism, start, unknowns, poses)
    found = named_columns(model)
    # Cranks turn up to their endstops, which is towards smaller angles.
    readings = endstop_readings(mechanism, options, upper=False)
    raised = -(found["sensor_offset"] + found["sensor_gain"] * readings)
    radius, height = float(found["base_radius"][0]), float(found["base_height"][0]) - bed
    if min(radius, height) <= 0:
        raise SymkinError(
            f'the shoulders of "{mechanism.name}" are {radius:g} m from the middle and '
            f"{height:g} m above the bed; Klipper wants both positive"
        )
    crank, rod = found["proximal_length"], found["distal_length"]
    heights = _nozzle_heights(radius, height, crank, rod, raised)
    lines = ["[printer]", "kinematics: rotary_delta", f"shoulder_radius: {mm(radius)}"]
    lines += [f"shoulder_height: {mm(height)}", ""]
    for leg, tower in enumerate(TOWERS):
        lines += [f"[{tower}]", f"angle: {np.degrees(found['base_azimuth'][leg]) % 360:.6f}"]
        lines += [f"upper_arm_length: {mm(crank[leg])}", f"lower_arm_length: {mm(rod[leg])}"]
        lines += [f"position_endstop: {mm(heights[leg])}", ""]
    shift = f"z in Klipper is z here + {mm(-bed)} mm"
    gains = gain_notes(TOWERS, found["sensor_gain"], "divide its gear_ratio")
    notes = (_MERGE, shift, *gains)
    return Written(_commented(notes, lines), notes, loss_of(mechanism, model, poses))


def _nozzle_heights(
    radius: float,
    height: float,
    crank: Array,
    rod: Array,
    raised: Array,
) -> Array:
    """Height of a nozzle in the middle with each crank raised so far, its elbow above."""
    across = radius + crank * np.cos(raised)
    if (np.abs(across) > rod).any():
        raise SymkinError(
            "with a crank at its endstop the nozzle does not reach the middle of the bed; "
            "Klipper wants its height there"
        )
    return np.asarray(height + crank * np.sin(raised) - np.sqrt(rod**2 - across**2))


def _print_radius(mechanism: Mechanism) -> float | None:
    """Radius of the largest circle about the middle that the workspace's box has room for, m."""
    assert mechanism.workspace is not None  # or nothing could be fitted
    lower, upper = mechanism.workspace.lower[:2], mechanism.workspace.upper[:2]
    room = min(*(-each for each in lower), *upper)
    return room if room > 0 else None


def _commented(notes: tuple[str, ...], lines: list[str]) -> str:
    return "\n".join([*(f"# {note}." for note in notes), "", *lines]) + "\n"


_RODS = (
    "A, B and C are trims of single rods: Marlin 2.1 knows them, older versions may take B for the "
    "radius that is probed"
)


_REPRAP_RADIUS = "B is the printable radius that the workspace has room for; keep yours if you know"


def write_marlin(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a linear delta as commands for Marlin, whose carriages come down by M666 after homing.

    With the carriages there the nozzle is at the height H in the middle of the bed, so that H is
    the least height and no correction is positive.
    """
    delta, loss = linear_delta(mechanism, options, "Marlin")
    rod, height = float(np.mean(delta.arms)), float(delta.heights.min())
    trims = [mm(arm - float(mm(rod)) / 1e3) for arm in delta.arms]
    rods, notes = f"L{mm(rod)}", tuple[str, ...]()
    if any(float(trim) for trim in trims):
        rods += f" A{trims[0]} B{trims[1]} C{trims[2]}"
        notes = (_RODS,)
    return _commands(delta, loss, rods, height, height - delta.heights, "M500 ; keep it", notes)


def write_reprapfirmware(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a linear delta as commands for RepRapFirmware 2.03 or later.

    Its corrections are what an endstop is higher than the mean.
    """
    delta, loss = linear_delta(mechanism, options, "RepRapFirmware")
    rods = "L" + ":".join(mm(arm) for arm in delta.arms)
    height, radius = float(np.mean(delta.heights)), _print_radius(mechanism)
    last, above = "; these lines belong into config.g", tuple[str, ...]()
    if radius is not None:
        rods, above = f"{rods} B{mm(radius)}", (_REPRAP_RADIUS,)
    return _commands(delta, loss, rods, height, delta.heights - height, last, above)


def _commands(
    delta: LinearDelta,
    loss: Loss,
    rods: str,
    height: float,
    stops: Array,
    last: str,
    above: tuple[str, ...] = (),
) -> Written:
    trims = (delta.degrees - NOMINAL_DEGREES + 180) % 360 - 180
    x, y, z = (f"{trim:.6f}" for trim in np.round(trims, 6) + 0.0)
    notes = (*above, *gain_notes("XYZ", delta.gains, "divide its steps per mm (M92)"))
    lines = [f"; {note}" for note in notes]
    lines.append(f"M665 {rods} R{mm(delta.radius)} H{mm(height)} X{x} Y{y} Z{z}")
    lines.append(f"M666 X{mm(stops[0])} Y{mm(stops[1])} Z{mm(stops[2])}")
    return Written("\n".join([*lines, last]) + "\n", notes, loss)


def write_linuxcnc(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a hexapod or a linear delta as HAL commands, and what the ini file has to say."""
    if mechanism.chain == "[P]US" and mechanism.pose_space == "translating":
        return _linuxcnc_delta(mechanism, options)
    if (mechanism.chain, mechanism.pose_space, len(mechanism.legs)) != ("U[P]S", "spatial", 6):
        raise SymkinError(
            "LinuxCNC has kinematics for hexapods, 6 legs U[P]S, and linear deltas, 3 legs [P]US "
            f'with a translating platform; "{mechanism.name}" has '
            f"{legs_in_words(mechanism.legs)}, {mechanism.pose_space}"
        )
    if options.endstops:
        raise SymkinError(
            f'endstops say nothing of the struts of "{mechanism.name}"; LinuxCNC counts from them '
            "in linear deltas alone"
        )
    structure = structure_of(mechanism)
    bases = [body.position for body in structure.bodies if not body.parent][:6]
    ends = [closure.platform_point for closure in structure.closures]
    lines = ["loadrt genhexkins"]
    for strut, (base, end) in enumerate(zip(bases, ends, strict=True)):
        for what, point in (("base", base), ("platform", end)):
            for axis, value in zip("xyz", point, strict=True):
                lines.append(f"setp genhexkins.{what}.{strut}.{axis} {mm(value)}")
    lines += ["", *_ini("genhexkins", 6)]
    unit = mechanism.reading_unit
    for strut, leg in enumerate(mechanism.legs):
        gain, offset = leg.parameters["sensor_gain"] * 1e3, leg.parameters["sensor_offset"] * 1e3
        lines.append(f"# [JOINT_{strut}] mm = {gain:.9g} * reading in {unit} + {offset:.6f}")
    notes = (
        "A joint is the length of a strut: SCALE and HOME_OFFSET of each [JOINT_N] follow from the "
        "last lines of the file",
        "A, B, C of LinuxCNC are roll, pitch and yaw in degrees",
    )
    return Written("\n".join([*(f"# {note}." for note in notes), *lines]) + "\n", notes)


def _linuxcnc_delta(mechanism: Mechanism, options: ExportOptions) -> Written:
    """A linear delta, whose joint N is the leg that stands nearest to its tower."""
    column = mechanism.parameter_names.index("base_azimuth")
    away = mechanism.parameters[:, column, None] - _LINUXCNC_TOWERS
    away = np.abs((away + np.pi) % (2 * np.pi) - np.pi)
    towers = away.argmin(axis=1)
    if sorted(towers) != [0, 1, 2] or away.min(axis=1).max() > _NEAR:
        raise SymkinError(
            "LinuxCNC's towers stand at 90, 210 and 330 degrees; those of "
            f'"{mechanism.name}" are not near them'
        )
    delta, loss = linear_delta(
        mechanism, options, "LinuxCNC", own_arms=False, angles=_LINUXCNC_TOWERS[towers].tolist()
    )
    lines = ["loadrt lineardeltakins"]
    lines += [f"setp lineardeltakins.R {mm(delta.radius)}"]
    lines += [f"setp lineardeltakins.L {mm(delta.arms[0])}", "", *_ini("lineardeltakins", 3)]
    notes = []
    for joint in range(3):
        leg = int(np.flatnonzero(towers == joint)[0])
        lines.append(f"# [JOINT_{joint}] HOME_OFFSET = {mm(delta.endstops[leg])}")
        notes.append(f"Joint {joint} is leg {leg + 1}")
        notes += gain_notes([f"Joint {joint}"], delta.gains[leg : leg + 1], "divide its SCALE")
    above = [f"# {note}." for note in notes]
    return Written("\n".join([*above, *lines]) + "\n", tuple(notes), loss)


def _ini(module: str, joints: int) -> list[str]:
    """What the ini file has to say, as comments of the HAL file."""
    return [
        "# Of the ini file:",
        f"# [KINS] KINEMATICS = {module}",
        f"# [KINS] JOINTS = {joints}",
        "# [TRAJ] LINEAR_UNITS = mm",
        "# [TRAJ] ANGULAR_UNITS = degree",
    ]
