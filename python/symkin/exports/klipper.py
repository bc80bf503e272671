# SPDX-License-Identifier: MIT
"""Klipper's printer.cfg: linear and rotary deltas.

https://www.klipper3d.org/Config_Reference.html, klippy/kinematics/delta.py and rotary_delta.py:
a linear delta has one radius, and an angle, arm and endstop for each tower; a
rotary one a shoulder radius and height, and an angle, two arms and an endstop for each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.exports.firmware import endstop_readings, linear_delta, mm, require_delta
from symkin.exports.nearest import loss_of, nearest, workspace_poses
from symkin.exports.options import ExportOptions, Written
from symkin.legs import Leg
from symkin.mechanism import Mechanism

__all__ = ["TOWERS", "write"]

TOWERS = "abc"
_FORMAT = "Klipper"
_MERGE = "These sections are to be merged into those of the printer.cfg that has pins and speeds"
_TILT = np.radians(10)


def write(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a linear or rotary delta as sections of a printer.cfg."""
    if mechanism.chain == "[R]US":
        return _rotary(mechanism, options)
    delta, loss = linear_delta(mechanism, options, _FORMAT)
    lines = ["[printer]", "kinematics: delta", f"delta_radius: {mm(delta.radius)}", ""]
    for tower, angle, arm, height in zip(
        TOWERS, delta.degrees, delta.arms, delta.heights, strict=True
    ):
        lines += [f"[stepper_{tower}]", f"angle: {angle:.6f}", f"arm_length: {mm(arm)}"]
        lines += [f"position_endstop: {mm(height)}", ""]
    lines += ["[delta_calibrate]", f"radius: {mm(_probed_radius(mechanism))}"]
    notes = (_MERGE, *_travel(delta.gains))
    return Written(_commented(notes, lines), notes, loss)


def _rotary(mechanism: Mechanism, options: ExportOptions) -> Written:
    """A rotary delta: the crank's axis level and tangential, an angle that turns up positive."""
    require_delta(mechanism, "[R]US", "rad", "rotary deltas", _FORMAT)
    own = {name: mechanism.parameters[:, k] for k, name in enumerate(mechanism.parameter_names)}
    tilts = np.hypot(own["axis_elevation"], own["axis_swing"])
    turned = np.abs(np.sin(own["axis_azimuth"] - own["base_azimuth"]))
    if max(tilts.max(), turned.max()) > _TILT or set(mechanism.working_modes) != {1}:
        raise SymkinError(
            f"{_FORMAT} knows cranks whose axes are level and tangential, with the elbows "
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
    found = {name: model.parameters[:, k] for k, name in enumerate(model.parameter_names)}
    limits = mechanism.joint_limits
    # Cranks turn up to their endstops, which is towards smaller angles.
    readings = endstop_readings(mechanism, options, limits.lower)
    raised = -(found["sensor_offset"] + found["sensor_gain"] * readings)
    radius, height = float(found["base_radius"][0]), float(found["base_height"][0]) - bed
    if min(radius, height) <= 0:
        raise SymkinError(
            f'the shoulders of "{mechanism.name}" are {radius:g} m from the middle and '
            f"{height:g} m above the bed; {_FORMAT} wants both positive"
        )
    crank, rod = found["proximal_length"], found["distal_length"]
    heights = _nozzle_heights(radius, height, crank, rod, raised)
    lines = ["[printer]", "kinematics: rotary_delta", f"shoulder_radius: {mm(radius)}"]
    lines += [f"shoulder_height: {mm(height)}", ""]
    for leg, tower in enumerate(TOWERS):
        lines += [
            f"[stepper_{tower}]",
            f"angle: {np.degrees(found['base_azimuth'][leg]) % 360:.6f}",
        ]
        lines += [f"upper_arm_length: {mm(crank[leg])}", f"lower_arm_length: {mm(rod[leg])}"]
        lines += [f"position_endstop: {mm(heights[leg])}", ""]
    shift = f"z in Klipper is z here + {mm(-bed)} mm"
    gains = [
        f"stepper_{tower}: divide its gear_ratio by {gain:.8f}, "
        "or the errors are larger than said here"
        for tower, gain in zip(TOWERS, found["sensor_gain"], strict=True)
        if abs(gain - 1) > 1e-9
    ]
    notes = (_MERGE, shift, *gains)
    return Written(_commented(notes, lines), notes, loss_of(mechanism, model, poses))


def _nozzle_heights(
    radius: float,
    height: float,
    crank: NDArray[np.float64],
    rod: NDArray[np.float64],
    raised: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Height of a nozzle in the middle with each crank raised so far, its elbow above."""
    across = radius + crank * np.cos(raised)
    if (np.abs(across) > rod).any():
        raise SymkinError(
            "with a crank at its endstop the nozzle does not reach the middle of the bed; "
            f"{_FORMAT} wants its height there"
        )
    return np.asarray(height + crank * np.sin(raised) - np.sqrt(rod**2 - across**2))


def _probed_radius(mechanism: Mechanism) -> float:
    """Radius of the largest circle about the middle that the workspace's box has room for."""
    assert mechanism.workspace is not None  # or nothing could be fitted
    lower, upper = mechanism.workspace.lower[:2], mechanism.workspace.upper[:2]
    room = min(*(-each for each in lower), *upper)
    if room <= 0:
        raise SymkinError("the middle of the bed is not in the workspace; Klipper probes around it")
    return room


def _travel(gains: NDArray[np.float64]) -> list[str]:
    """What the drives have to be told, which a printer.cfg says by what is not known here."""
    return [
        f"stepper_{tower}: multiply rotation_distance by {gain:.8f}, or the errors are larger than "
        "said here"
        for tower, gain in zip(TOWERS, gains, strict=True)
        if abs(gain - 1) > 1e-9
    ]


def _commented(notes: tuple[str, ...], lines: list[str]) -> str:
    return "\n".join([*(f"# {note}." for note in notes), "", *lines]) + "\n"
