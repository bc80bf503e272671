# SPDX-License-Identifier: MIT
"""A number of the drawing that is wrong in all legs, as one that is typed once is.

It is found where it is free in each of them, and what is tried is the drawing so corrected: with no
unknown more, so that all else has to be within the tolerances, and the legs alike in it.
"""

from __future__ import annotations

import dataclasses
import heapq
import math
import re
from collections.abc import Iterator, Sequence

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.trial import Correction, with_priors
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import parameter_tolerances
from symkin.values import Array

_FAR = 3.0  # tolerances, by which at least a number is drawn wrong and not made so
_WIDE = 1.0  # of an angle, rad
_OF_SENSORS = ("sensor_gain", "sensor_offset")
# A diameter for a radius, a digit, inches or metres for millimetres: from where a number is found
# with which the drawing reaches nothing.
_STARTS = 12  # of those with which it comes nearest
_ROWS = 40  # by which that is told
_DIGITS = re.compile(r"\d+")
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
    numbers = _numbers(stated)
    for each in numbers:
        yield each.freed(stated.mechanism)
    if not math.isfinite(_off(stated, stated.mechanism.straight)):
        yield from _from_elsewhere(stated, [each for each in numbers if each.is_length])


def _from_elsewhere(stated: Correction, numbers: Sequence[_Number]) -> Iterator[Correction]:
    """Where the drawing reaches nothing, from numbers with which it comes nearest."""
    starts = [(each, each.with_values(times * each.drawn)) for each in numbers for times in _TIMES]
    core = stated.mechanism.straight
    off = [_off(stated, core.with_parameters(values)) for _, values in starts]
    for start in heapq.nsmallest(_STARTS, range(len(starts)), key=off.__getitem__):
        number, values = starts[start]
        if math.isfinite(off[start]) and (robot := number.robot(values)) is not None:
            yield number.freed(robot)


def _numbers(stated: Correction) -> list[_Number]:
    """Those of the drawing, and those that stand in it several times, by names but for digits.

    Readings of one declared leg have their geometry in common, and follow the first of them.
    """
    nominal = stated.mechanism
    known = stated.model.known(stated.measurements)
    columns = {name: column for column, name in enumerate(nominal.parameter_names)}
    numbers: list[_Number] = []
    alike: dict[object, list[str]] = {}
    for name, (legs, held) in known.items():
        leading = tuple(each for each in legs if name in _OF_SENSORS or _leads(nominal, each))
        if len(legs) > 1 and leading:
            numbers.append(_Number(stated, (columns[name],), (name,), legs, leading, held=held))
            drawn = tuple(nominal.parameters[list(legs), columns[name]].tolist())
            alike.setdefault((_DIGITS.sub("", name), legs, held, drawn), []).append(name)
    for names in alike.values():
        if len(names) > 1 and names[0] not in _OF_SENSORS:
            one = next(each for each in numbers if each.names == (names[0],))
            places = tuple(columns[name] for name in names)
            numbers.append(dataclasses.replace(one, places=places, names=tuple(names)))
    return numbers


def _leads(mechanism: Mechanism, leg: int) -> bool:
    """Whether it is the first reading of its leg, whose geometry the others follow."""
    return any(first == leg for first, *_ in mechanism.leg_readings)


@dataclasses.dataclass(frozen=True, eq=False)
class _Number:
    """One number, of the legs that have it, of which some lead; under several names if alike."""

    stated: Correction
    places: tuple[int, ...]
    names: tuple[str, ...]
    legs: tuple[int, ...]
    leading: tuple[int, ...]
    held: bool

    @property
    def name(self) -> str:
        """As it is told."""
        return ", ".join(self.names)

    @property
    def drawn(self) -> Array:
        """By leg and name."""
        return self._of(self.stated.mechanism.parameters)

    @property
    def is_length(self) -> bool:
        """Whether it may be a diameter for a radius, or in inches."""
        return self._unit == "m" and self._by_factor and self.names[0] not in _OF_SENSORS

    def _of(self, parameters: Array) -> Array:
        return np.asarray(parameters[np.ix_(self.legs, self.places)])

    @property
    def _unit(self) -> str:
        unit = self.stated.mechanism.leg_info(self.legs[0]).parameter_units[self.names[0]]
        return "" if unit == "1" else unit

    @property
    def _by_factor(self) -> bool:
        return self._unit != "rad" and bool(self.drawn.all())

    def with_values(self, values: Array) -> Array:
        """The drawing's parameters with others of these."""
        parameters = self.stated.mechanism.parameters.copy()
        parameters[np.ix_(self.legs, self.places)] = values
        return parameters

    def robot(self, parameters: Array) -> Mechanism | None:
        """The drawing with these; None if they are no mechanism's."""
        try:
            return self.stated.mechanism.with_parameters(parameters, symmetry=None)
        except SymkinError:
            return None

    def freed(self, robot: Mechanism) -> Correction:
        """With no tolerance of these numbers, from where a robot has them."""
        options = self.stated.options
        if self.held:  # in all legs by one factor, or by one shift
            fixed = tuple(each for each in options.fixed if each not in self.names)
            free = None if options.free is None else (*options.free, *self.names)
            shared = (*options.shared, *self.names)
            options = dataclasses.replace(options, fixed=fixed, free=free, shared=shared)
        wide = float(np.abs(self._of(robot.parameters)).max()) if self._by_factor else _WIDE
        patterns = (
            list(self.names)
            if self.leading == self.legs
            else [f"leg{leg + 1}.{name}" for leg in self.leading for name in self.names]
        )
        options = with_priors(options, dict.fromkeys(patterns, wide))
        stated = self.stated
        freed = stated.of(self._told, robot, options)
        if not self.held and robot is stated.mechanism:
            model = dataclasses.replace(freed.model, alike=stated.model)
            freed = freed._replace(model=model)
        unknowns = len(self.names) * (1 if self.held else len(self.leading))
        return freed._replace(wide=unknowns, again=self._again)

    def _again(self, learnt: Mechanism) -> Correction | None:
        """The drawing with the number that a robot has on average; None if that is the drawn."""
        drawn, nominal = self.drawn, self.stated.mechanism
        found = self._of(learnt.parameters)
        if self._by_factor:
            factor = float(np.mean(found / drawn))
            if factor <= 0:  # no length, and of a gain a sign, which is tried by itself
                return None
            values = drawn * factor
        else:  # of mirrored legs to either side
            away = found - drawn
            values = drawn + np.sign(away) * np.mean(np.abs(away))
        tolerances = self._of(parameter_tolerances(nominal))
        if (np.abs(values - drawn) <= _FAR * tolerances).any():
            return None
        robot = self.robot(self.with_values(values))
        if robot is None:
            return None
        corrected = self.stated.of(self._cause(values), robot, self.stated.options)
        return corrected._replace(redrawn=True)

    def _told(self, fit: _core.JointFit) -> Doubt:
        return self._cause(self._of(fit.setup.parameters))

    def _cause(self, values: Array) -> Doubt:
        drawn, unit = self.drawn, self._unit
        if self.name in _OF_SENSORS and not self.held:
            return sensors_off(self.stated.mechanism, self.legs, self.name, values[:, 0])
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
            told = (f"{value:.6g} {unit}".rstrip() for value in (values[0, 0], drawn[0, 0]))
            amount += " ({}, not {})".format(*told)
        figures = {"name": self.name, "amount": amount}
        return Doubt("drawn-wrong", self.legs, size=size, figures=figures)


def _off(stated: Correction, robot: _core.Mechanism) -> float:
    """How far the robot's readings or positions are in the median; infinite beyond its reach.

    Zero where frames are unknown and most readings have a pose.
    """
    measured = stated.some(_ROWS).measurements
    nominal, poses, readings = stated.mechanism, measured.poses, measured.readings
    try:
        if robot is nominal.straight:
            stated.model.problem(measured, 1)
        whole = np.isfinite(poses).all(axis=1)
        if whole.any() and not stated.options.frames:
            made = _core.inverse_kinematics(robot, unframed(nominal, poses[whole]))
            away = np.where(np.isfinite(readings[whole]), readings[whole] - made, 0.0)
        else:
            read = np.isfinite(readings).all(axis=1)
            if not read.any():
                return 0.0
            straight = nominal.straightened(readings[read])
            found = _core.forward_kinematics(robot, straight, nominal.home[None])
            seen = poses[read] if not stated.options.frames else np.full_like(poses[read], np.nan)
            away = np.where(np.isfinite(seen), seen - found.poses, 0 * found.poses)
    except SymkinError:
        return math.inf
    return float(np.median(np.where(np.isfinite(away), np.abs(away), np.inf).max(axis=1)))
