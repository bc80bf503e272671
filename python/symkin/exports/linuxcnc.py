# SPDX-License-Identifier: MIT
"""LinuxCNC's HAL: genhexkins for hexapods, lineardeltakins for linear deltas.

genhexkins (man page, src/emc/kinematics/genhexkins.c) has the ends of six struts as pins, so a
hexapod is expressed in full. lineardeltakins has one radius R, one rod length L, and towers at
exactly 90, 210 and 330 degrees; where a carriage is found is HOME_OFFSET of the ini file.
"""

from __future__ import annotations

import numpy as np

from symkin.errors import SymkinError
from symkin.exports.exported import ExportOptions, Written
from symkin.exports.firmware import gain_notes, linear_delta, mm
from symkin.exports.structure import structure_of
from symkin.mechanism import Mechanism

__all__ = ["write_linuxcnc"]

_TOWERS = np.radians([90.0, 210.0, 330.0])
_NEAR = np.radians(30)


def write_linuxcnc(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a hexapod or a linear delta as HAL commands, and what the ini file has to say."""
    if mechanism.chain == "[P]US" and mechanism.pose_space == "translating":
        return _delta(mechanism, options)
    if (mechanism.chain, mechanism.pose_space, len(mechanism.legs)) != ("U[P]S", "spatial", 6):
        raise SymkinError(
            "LinuxCNC has kinematics for hexapods, 6 legs U[P]S, and linear deltas, 3 legs [P]US "
            f'with a translating platform; "{mechanism.name}" has {len(mechanism.legs)} legs '
            f"{mechanism.chain}, {mechanism.pose_space}"
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


def _delta(mechanism: Mechanism, options: ExportOptions) -> Written:
    """A linear delta, whose joint N is the leg that stands nearest to its tower."""
    column = mechanism.parameter_names.index("base_azimuth")
    away = mechanism.parameters[:, column, None] - _TOWERS
    away = np.abs((away + np.pi) % (2 * np.pi) - np.pi)
    towers = away.argmin(axis=1)
    if sorted(towers) != [0, 1, 2] or away.min(axis=1).max() > _NEAR:
        raise SymkinError(
            "LinuxCNC's towers stand at 90, 210 and 330 degrees; those of "
            f'"{mechanism.name}" are not near them'
        )
    delta, loss = linear_delta(
        mechanism, options, "LinuxCNC", own_arms=False, angles=_TOWERS[towers].tolist()
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
