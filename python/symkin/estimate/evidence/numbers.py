# SPDX-License-Identifier: MIT
"""A number of the drawing that is wrong in all legs, as one that is typed once is.

It is found where it is free in each of them, and what is tried is the drawing so corrected: with no
unknown more, so that all else has to be within the tolerances, and the legs alike in it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array

_FAR = 3.0  # tolerances, by which at least a number is drawn wrong and not made so
_WIDE = 1.0  # of an angle, rad
_OF_SENSORS = ("sensor_gain", "sensor_offset")
# A diameter for a radius, a digit, inches or metres for millimetres: from where a number is found
# with which the drawing reaches nothing.
_TIMES = (2.0, 0.5, 10.0, 0.1, 25.4, 1 / 25.4, 1e3, 1e-3)


def sensors_off(nominal: Mechanism, legs: Sequence[int], name: str, found: Array) -> Doubt:
    """Gains or zeros of sensors that are not the drawing's."""
    own = list(legs)
    drawn = nominal.parameters[own, list(nominal.parameter_names).index(name)]
    if name == "sensor_gain":
        rates = drawn / found
        figures = {"rates": ", ".join(f"{rate:.3g}" for rate in rates)}
        return Doubt("gain", tuple(own), size=float(rates[0]), figures=figures)
    shifts = (drawn - found) / nominal.sensor_gains[own]
    told = ", ".join(f"{shift:+.3g}" for shift in shifts)
    figures = {"shifts": told, "unit": nominal.reading_unit}
    return Doubt("zero", tuple(own), size=float(shifts[0]), figures=figures)


def numbers_of_the_drawing(stated: Correction) -> Iterator[Correction]:
    """Correct one number of the drawing, free or held, in all legs alike."""
    nominal = stated.mechanism
    for place, name in enumerate(nominal.parameter_names):
        legs, held = stated.model.known(name, stated.measurements)
        if len(legs) > 1:
            yield from _Number(stated, place, name, legs, held=held).corrections()


@dataclasses.dataclass(frozen=True, eq=False)
class _Number:
    """One number, of the legs that have it."""

    stated: Correction
    place: int
    name: str
    legs: tuple[int, ...]
    held: bool

    @property
    def _drawn(self) -> Array:
        return np.asarray(self.stated.mechanism.parameters[list(self.legs), self.place])

    @property
    def _unit(self) -> str:
        unit = self.stated.mechanism.leg_info(self.legs[0]).parameter_units[self.name]
        return "" if unit == "1" else unit

    @property
    def _by_factor(self) -> bool:
        return self._unit != "rad" and bool(self._drawn.all())

    def corrections(self) -> Iterator[Correction]:
        """From where it is drawn, and if the drawing reaches nothing there, from elsewhere."""
        nominal = self.stated.mechanism
        yield self._free(nominal)
        of_sensor = self.name in _OF_SENSORS
        if self._unit == "m" and self._by_factor and not of_sensor and not _reaches(self.stated):
            for times in _TIMES:
                if (robot := self._with(nominal, times * self._drawn)) is not None:
                    yield self._free(robot)

    def _with(self, robot: Mechanism, values: Array) -> Mechanism | None:
        parameters = robot.parameters.copy()
        parameters[list(self.legs), self.place] = values
        try:
            return robot.with_parameters(parameters, symmetry=None)
        except SymkinError:
            return None

    def _free(self, robot: Mechanism) -> Correction:
        options = self.stated.options
        given = {} if isinstance(options.prior, str) or options.prior is None else options.prior
        if self.held:  # in all legs by one factor, or by one shift
            fixed = tuple(each for each in options.fixed if each != self.name)
            free = None if options.free is None else (*options.free, self.name)
            shared = (*options.shared, self.name)
            options = dataclasses.replace(options, fixed=fixed, free=free, shared=shared)
        wide = np.abs(robot.parameters[list(self.legs), self.place]).max()
        prior = {**given, self.name: float(wide) if self._by_factor else _WIDE}
        options = dataclasses.replace(options, prior=prior)
        freed = self.stated.of(self._told, robot, options)
        return freed._replace(wide=1 if self.held else len(self.legs), again=self._again)

    def _again(self, learnt: Mechanism) -> Correction | None:
        """The drawing with the number that a robot has on average; None if that is the drawn."""
        drawn, nominal = self._drawn, self.stated.mechanism
        found = learnt.parameters[list(self.legs), self.place]
        if self._by_factor:
            values = drawn * np.mean(found / drawn)
        else:  # of mirrored legs to either side
            away = found - drawn
            values = drawn + np.sign(away) * np.mean(np.abs(away))
        tolerances = parameter_tolerances(nominal)[list(self.legs), self.place]
        if (np.abs(values - drawn) <= _FAR * tolerances).any():
            return None
        robot = self._with(nominal, values)
        if robot is None:
            return None
        corrected = self.stated.of(self._cause(values), robot, self.stated.options)
        return corrected._replace(redrawn=True)

    def _told(self, fit: _core.JointFit) -> Doubt:
        return self._cause(fit.setup.parameters[list(self.legs), self.place])

    def _cause(self, values: Array) -> Doubt:
        drawn, unit = self._drawn, self._unit
        if self.name in _OF_SENSORS and not self.held:
            return sensors_off(self.stated.mechanism, self.legs, self.name, values)
        if self._by_factor:
            size = float(np.mean(values / drawn))
            amount = f"{size:.4g} times the drawing's"
        else:
            size = float(np.mean(np.abs(values - drawn)))
            signs = np.unique(np.sign(values - drawn))
            size *= float(signs[0]) if len(signs) == 1 else 1.0
            sign = "+" if len(signs) == 1 else ""
            amount = f"{size:{sign}.4g} {unit}".rstrip() + " off the drawing's"
            amount += "" if len(signs) == 1 else ", to either side"
        if np.ptp(np.abs(drawn)) <= 1e-9 * np.abs(drawn).max():
            told = (f"{value:.6g} {unit}".rstrip() for value in (values[0], drawn[0]))
            amount += " ({}, not {})".format(*told)
        figures = {"name": self.name, "amount": amount}
        return Doubt("drawn-wrong", self.legs, size=size, figures=figures)


def _reaches(stated: Correction) -> bool:
    """Whether the drawing takes most of what was measured."""
    robot, measured = stated.mechanism, stated.measurements
    try:
        stated.model.problem(measured, 1)
    except SymkinError:
        return False
    whole = np.isfinite(measured.poses).all(axis=1)
    if whole.any() and not stated.options.frames:
        found = robot.inverse_kinematics(unframed(robot, measured.poses[whole]))
        found = np.where(np.isfinite(measured.readings[whole]), found, 0.0)
    else:
        read = np.isfinite(measured.readings).all(axis=1)
        if not read.any():
            return True
        try:
            found = robot.forward_kinematics(measured.readings[read])[0]
        except SymkinError:
            return False
    return 2 * int(np.isfinite(found).all(axis=1).sum()) > len(found)
