# SPDX-License-Identifier: MIT
"""Klipper's printer.cfg, written of linear and rotary deltas, and read of linear ones.

https://www.klipper3d.org/Config_Reference.html, klippy/kinematics/delta.py and rotary_delta.py:
a linear delta has one radius, and an angle, arm and endstop for each tower; a rotary one a shoulder
radius and height, and an angle, two arms and an endstop for each.

Klipper keeps what DELTA_CALIBRATE recorded at the end of the file: how many steps below its endstop
each carriage stood where the probe met the bed (``heightN_pos`` of ``[delta_calibrate]``), and the
height of the nozzle there (``heightN``): readings and heights. See
klippy/extras/delta_calibrate.py.
"""

from __future__ import annotations

import configparser
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from symkin.chains import Leg
from symkin.errors import SymkinError
from symkin.exports.exported import (
    ExportOptions,
    Written,
    loss_of,
    named_columns,
    nearest,
    workspace_poses,
)
from symkin.exports.firmware import (
    LinearDelta,
    endstop_readings,
    gain_notes,
    linear_delta,
    mm,
    require_delta,
)
from symkin.io.tables import file_bytes
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.result import Value, field, record
from symkin.settings import (
    Frames,
    IdentificationSettings,
    JointLimits,
    NoiseSettings,
    Tolerances,
    WorkspaceSettings,
)

__all__ = ["Imported", "import_printer", "write_klipper"]

_TOWERS = ("stepper_a", "stepper_b", "stepper_c")  # the names of their sections
_FORMAT = "Klipper"
_MERGE = "These sections are to be merged into those of the printer.cfg that has pins and speeds"
_TILT = np.radians(10)


def write_klipper(mechanism: Mechanism, options: ExportOptions) -> Written:
    """Write a linear or rotary delta as sections of a printer.cfg."""
    if mechanism.chain == "[R]US":
        return _rotary(mechanism, options)
    delta, loss = linear_delta(mechanism, options, _FORMAT)
    lines = ["[printer]", "kinematics: delta", f"delta_radius: {mm(delta.radius)}", ""]
    for tower, angle, arm, height in zip(
        _TOWERS, delta.degrees, delta.arms, delta.heights, strict=True
    ):
        lines += [f"[{tower}]", f"angle: {angle:.6f}", f"arm_length: {mm(arm)}"]
        lines += [f"position_endstop: {mm(height)}", ""]
    lines += ["[delta_calibrate]", f"radius: {mm(_probed_radius(mechanism))}"]
    notes = (_MERGE, *gain_notes(_TOWERS, delta.gains, "multiply rotation_distance"))
    return Written(_commented(notes, lines), notes, loss)


def _rotary(mechanism: Mechanism, options: ExportOptions) -> Written:
    """A rotary delta: the crank's axis level and tangential, an angle that turns up positive."""
    require_delta(mechanism, "[R]US", "rad", "rotary deltas", _FORMAT)
    own = named_columns(mechanism)
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
    found = named_columns(model)
    # Cranks turn up to their endstops, which is towards smaller angles.
    readings = endstop_readings(mechanism, options, mechanism.reading_limits[0])
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
    for leg, tower in enumerate(_TOWERS):
        lines += [
            f"[{tower}]",
            f"angle: {np.degrees(found['base_azimuth'][leg]) % 360:.6f}",
        ]
        lines += [f"upper_arm_length: {mm(crank[leg])}", f"lower_arm_length: {mm(rod[leg])}"]
        lines += [f"position_endstop: {mm(heights[leg])}", ""]
    shift = f"z in Klipper is z here + {mm(-bed)} mm"
    gains = gain_notes(_TOWERS, found["sensor_gain"], "divide its gear_ratio")
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


def _commented(notes: tuple[str, ...], lines: list[str]) -> str:
    return "\n".join([*(f"# {note}." for note in notes), "", *lines]) + "\n"


_SAVED = "#*#"  # begins the lines that SAVE_CONFIG writes
_ANGLES = (210.0, 330.0, 90.0)
_FULL_STEPS = 200.0
_CONDITION = 10.0
_NOISE = NoiseSettings(position=2.5e-5, orientation=0.0, reading=5e-6)
_ASSUMED = (
    f"Noise is assumed: {_NOISE.position * 1e3:g} mm of a height, {_NOISE.reading * 1e3:g} mm of a "
    "carriage. So are workspace and tolerances; the file has them"
)
# What Klipper's own calibration estimates.
_UNKNOWN = ("sensor_offset", "base_radius", "leg1.base_azimuth", "leg2.base_azimuth")


@record
class Imported(Value):
    """A robot read from another format.

    Attributes
    ----------
    mechanism : Mechanism
        As it is described there; a sensor reads the way of its carriage from the endstop.
    measurements : Measurements or None
        Readings and heights that were recorded; None if there are none.
    notes : tuple of str
        What was not read, or assumed.
    """

    mechanism: Mechanism = field(private=True)
    measurements: Measurements | None = field(private=True)
    notes: tuple[str, ...]


def import_printer(path: str | os.PathLike[str]) -> Imported:
    """Read a linear delta from Klipper's printer.cfg, with ``kinematics: delta``.

    What SAVE_CONFIG has written at its end counts, as in Klipper.

    Raises
    ------
    SymkinError
        With the file, section and option at fault: another kinematics, a number that is missing or
        is none, a probe record that cannot be read.
    """
    config = _Config(Path(path))
    kinematics = config.text("printer", "kinematics")
    if kinematics != "delta":
        raise config.error(
            "printer", "kinematics", f'is "{kinematics}"; symkin reads "delta", a linear delta'
        )
    radius = config.number("printer", "delta_radius", above=0.0)
    first = [
        config.number("stepper_a", name, above=0.0) for name in ("arm_length", "position_endstop")
    ]
    arms = np.array(
        [config.number(tower, "arm_length", first[0], above=radius) for tower in _TOWERS]
    )
    heights = np.array(
        [config.number(tower, "position_endstop", first[1], above=0.0) for tower in _TOWERS]
    )
    angles = [config.number(t, "angle", each) for t, each in zip(_TOWERS, _ANGLES, strict=True)]
    delta = LinearDelta(
        radius * 1e-3,
        np.radians(angles),
        arms * 1e-3,
        (heights + np.sqrt(arms**2 - radius**2)) * 1e-3,
        np.ones(3),
    )
    printed = config.number("printer", "print_radius", radius, above=0.0)
    notes = [*config.notes, _ASSUMED]
    measurements, skipped = _records(config)
    if skipped:
        notes.append(
            f"{skipped} distances of printed objects were not read: symkin knows distances from "
            "fixed points alone"
        )
    mechanism = Mechanism(
        Path(path).stem,
        delta.legs((0.0, 0.0, 0.0)),
        platform="translating",
        reading_unit="m",
        workspace=_workspace(delta, printed * 1e-3),
        joint_limits=JointLimits(upper=0.0),
        noise=_NOISE,
        tolerances=Tolerances(length=1e-3, angle=1e-2, gain=2e-3),
        frames=Frames(plane=(0.0, 0.0, 0.0)),
        identification=IdentificationSettings(free=_UNKNOWN, shared=("base_radius",)),
    )
    return Imported(mechanism, measurements, tuple(notes))


def _workspace(delta: LinearDelta, radius: float) -> WorkspaceSettings:
    """The largest box below the endstops whose corners are on the circle that is printed on."""
    reach = min(radius, float(delta.arms.min()) - delta.radius)
    side = 0.7 * reach
    # The carriages are highest where the effector is at a corner next to their tower.
    top = float((delta.endstops - delta.arms).min())
    if side <= 0 or top <= 0:
        raise SymkinError(
            f"rods of {delta.arms.min() * 1e3:g} mm, a radius of {delta.radius * 1e3:g} mm and "
            f"endstops {delta.endstops.min() * 1e3:g} mm above the bed leave no room to print"
        )
    return WorkspaceSettings(
        (-side, -side, 0.0),
        (side, side, top),
        home=(0.0, 0.0, top / 2),
        conditioning_limit=_CONDITION,
    )


def _records(config: _Config) -> tuple[Measurements | None, int]:
    """What was probed, and how many distances there are besides."""
    section = "delta_calibrate"
    heights, steps = [], []
    for prefix in ("height", "manual_height"):
        for name in config.numbered(section, prefix):
            heights.append(config.number(section, name))
            steps.append(config.triple(section, f"{name}_pos"))
    skipped = sum(1 for _ in config.numbered(section, "distance"))
    if not heights:
        return None, skipped
    ways = np.array([_step(config, tower) for tower in _TOWERS])
    # Steps count downwards from the endstop; zero is no negative zero.
    readings = -np.array(steps) * ways * 1e-3 + 0.0
    unknown = np.full((len(heights), 3), np.nan)
    return (
        Measurements.of(
            unknown,
            readings,
            heights=np.array(heights) * 1e-3,
            pose_space="translating",
            reading_unit="m",
        ),
        skipped,
    )


def _step(config: _Config, stepper: str) -> float:
    """Way of a carriage by one step of its motor, mm."""
    if config.has(stepper, "step_distance"):  # before Klipper 0.10
        return config.number(stepper, "step_distance", above=0.0)
    turn = config.number(stepper, "rotation_distance", above=0.0)
    steps = config.number(stepper, "full_steps_per_rotation", _FULL_STEPS, above=0.0)
    steps *= config.number(stepper, "microsteps", above=0.0)
    for pair in re.split(r"\s*,\s*", config.text(stepper, "gear_ratio", "1:1")):
        found = re.fullmatch(r"(\d+(?:\.\d*)?)\s*:\s*(\d+(?:\.\d*)?)", pair)
        if not found or min(map(float, found.groups())) <= 0:
            raise config.error(stepper, "gear_ratio", f'is "{pair}"; expected such as "80:16"')
        steps *= float(found[1]) / float(found[2])
    return turn / steps


class _Config:
    """A printer.cfg, the saved part over the rest; errors name file, section and option."""

    def __init__(self, path: Path) -> None:
        self.path = path
        data = file_bytes(path, lambda message: SymkinError(f"{path}: {message}"))
        lines = data.decode("utf-8", "replace").splitlines()
        saved = [line[len(_SAVED) :].strip() for line in lines if line.startswith(_SAVED)]
        own = [line for line in lines if not line.startswith(_SAVED)]
        begun = next((i for i, line in enumerate(saved) if line.startswith("[")), len(saved))
        self._parser = configparser.RawConfigParser(
            strict=False, inline_comment_prefixes=("#", ";"), allow_no_value=True
        )
        try:
            self._parser.read_string("\n".join(own), str(path))
            self._parser.read_string("\n".join(saved[begun:]), str(path))
        except configparser.Error as error:
            reason = " ".join(str(error).split())
            raise SymkinError(f"{path}: is not a printer.cfg: {reason}") from error
        included = [name for name in self._parser.sections() if name.startswith("include ")]
        self.notes = [f"[{name}] was not read" for name in included]

    def error(self, section: str, option: str, message: str) -> SymkinError:
        """An error at an option."""
        return SymkinError(f"{self.path}: [{section}] {option}: {message}")

    def has(self, section: str, option: str) -> bool:
        """Whether an option is there."""
        return self._parser.has_option(section, option)

    def text(self, section: str, option: str, default: str | None = None) -> str:
        """An option's text."""
        if not self.has(section, option):
            if default is not None:
                return default
            included = f" ({'; '.join(self.notes)})" if self.notes else ""
            raise self.error(section, option, f"is missing{included}")
        return str(self._parser.get(section, option) or "").strip()

    def number(
        self, section: str, option: str, default: float | None = None, above: float | None = None
    ) -> float:
        """An option's number, mm or degrees."""
        text = self.text(section, option, None if default is None else repr(default))
        value = self._float(section, option, text)
        if above is not None and value <= above:
            raise self.error(section, option, f"is {value:g}; expected more than {above:g}")
        return value

    def triple(self, section: str, option: str) -> tuple[float, ...]:
        """Three numbers with commas between them."""
        parts = self.text(section, option).split(",")
        if len(parts) != len(_TOWERS):
            raise self.error(section, option, f"has {len(parts)} numbers; expected {len(_TOWERS)}")
        return tuple(self._float(section, option, part) for part in parts)

    def numbered(self, section: str, prefix: str) -> Iterator[str]:
        """Names of the options ``prefix0``, ``prefix1``, ... as far as there are any."""
        number = 0
        while self.has(section, f"{prefix}{number}"):
            yield f"{prefix}{number}"
            number += 1

    def _float(self, section: str, option: str, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(section, option, f'is "{text.strip()}"; expected a number')
        return value
