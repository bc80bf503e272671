# SPDX-License-Identifier: MIT
"""M665 and M666 of Marlin and RepRapFirmware: linear deltas.

Both know one radius R, a trim of each tower's angle from 210, 330 and 90 degrees, and the height H
of the nozzle at the endstops. They differ in the rods (Marlin: one L and trims A, B, C; of
RepRapFirmware an L for each) and in the sign and the mean of the endstops' corrections.
Sources: Marlin 2.1 src/module/delta.cpp and gcode/calibrate/M665.cpp, M666.cpp;
RepRapFirmware 3 src/Movement/Kinematics/LinearDeltaKinematics.cpp.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.exports.firmware import LinearDelta, linear_delta, mm
from symkin.exports.options import ExportOptions, Loss, Written
from symkin.mechanism import Mechanism

__all__ = ["write_marlin", "write_reprapfirmware"]

_TOWERS = np.array([210.0, 330.0, 90.0])
_RODS = (
    "A, B and C are trims of single rods: Marlin 2.1 knows them, older versions may take B for the "
    "radius that is probed"
)


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
    return _written(delta, loss, rods, height, height - delta.heights, "M500 ; keep it", notes)


def write_reprapfirmware(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a linear delta as commands for RepRapFirmware 2.03 or later.

    Its corrections are what an endstop is higher than the mean.
    """
    delta, loss = linear_delta(mechanism, options, "RepRapFirmware")
    rods = "L" + ":".join(mm(arm) for arm in delta.arms)
    height = float(np.mean(delta.heights))
    last = "; these lines belong into config.g"
    return _written(delta, loss, rods, height, delta.heights - height, last)


def _written(
    delta: LinearDelta,
    loss: Loss,
    rods: str,
    height: float,
    stops: NDArray[np.float64],
    last: str,
    above: tuple[str, ...] = (),
) -> Written:
    trims = (delta.degrees - _TOWERS + 180) % 360 - 180
    x, y, z = (f"{trim:.6f}" for trim in np.round(trims, 6) + 0.0)
    notes = above + tuple(
        f"{axis}: divide its steps per mm (M92) by {gain:.8f}, or the errors are larger than said "
        "here"
        for axis, gain in zip("XYZ", delta.gains, strict=True)
        if abs(gain - 1) > 1e-9
    )
    lines = [f"; {note}" for note in notes]
    lines.append(f"M665 {rods} R{mm(delta.radius)} H{mm(height)} X{x} Y{y} Z{z}")
    lines.append(f"M666 X{mm(stops[0])} Y{mm(stops[1])} Z{mm(stops[2])}")
    return Written("\n".join([*lines, last]) + "\n", notes, loss)
