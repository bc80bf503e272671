# SPDX-License-Identifier: MIT
"""Printers read from Klipper's printer.cfg, with what DELTA_CALIBRATE recorded.

Klipper keeps, at the end of the file, how many steps below its endstop each carriage stood where
the probe met the bed (``heightN_pos`` of ``[delta_calibrate]``), and the height of the nozzle there
(``heightN``): readings and heights. See klippy/extras/delta_calibrate.py.
"""

from __future__ import annotations

import configparser
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from symkin.errors import SymkinError
from symkin.exports.firmware import LinearDelta
from symkin.exports.klipper import TOWERS
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

__all__ = ["Imported", "import_printer"]

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
    """Read a linear delta from Klipper's printer.cfg.

    Parameters
    ----------
    path : str or path
        With ``kinematics: delta``. What SAVE_CONFIG has written at its end counts, as in Klipper.

    Returns
    -------
    Imported

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
    towers = [f"stepper_{tower}" for tower in TOWERS]
    arms = np.array(
        [config.number(tower, "arm_length", first[0], above=radius) for tower in towers]
    )
    heights = np.array(
        [config.number(tower, "position_endstop", first[1], above=0.0) for tower in towers]
    )
    angles = [config.number(t, "angle", each) for t, each in zip(towers, _ANGLES, strict=True)]
    delta = LinearDelta(
        radius * 1e-3,
        np.radians(angles),
        arms * 1e-3,
        (heights + np.sqrt(arms**2 - radius**2)) * 1e-3,
        np.ones(3),
    )
    printed = config.number("printer", "print_radius", radius, above=0.0)
    notes = [*config.notes, _ASSUMED]
    measurements, skipped = _records(config, towers)
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


def _records(config: _Config, towers: list[str]) -> tuple[Measurements | None, int]:
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
    ways = np.array([_step(config, tower) for tower in towers])
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
        if len(parts) != len(TOWERS):
            raise self.error(section, option, f"has {len(parts)} numbers; expected {len(TOWERS)}")
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
