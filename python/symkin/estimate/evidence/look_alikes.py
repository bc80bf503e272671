# SPDX-License-Identifier: MIT
"""What is told beside parameters that are set free, where it explains as much.

Sensors that are not linear, and a measuring device whose scale is off: a gain that is held looks
like either.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from symkin import _core
from symkin.estimate.evidence.drawing import scale_in_words
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.table_edits import scaled
from symkin.estimate.evidence.trial import SECOND, Correction
from symkin.options.words import Sensor

_SENSORS: Mapping[Sensor, str] = {"quadratic": "sensor-curved", "eccentric": "sensor-eccentric"}
_SHARE = 1e-3  # of the lengths, by which chi-square is taken to be a parabola


def look_alikes(stated: Correction) -> Iterator[Correction]:
    """Give those that are not asked for already."""
    robot = stated.mechanism
    every = tuple(range(len(robot.legs)))
    if stated.options.sensor == "linear" and robot.curvature is None:
        figures = {"whose": "all legs", "amount": "", "evidence": "", "help": ""}
        for sensor, code in _SENSORS.items():
            if sensor == "quadratic" or robot.reading_unit == "rad":
                cause = Doubt(code, every, figures=figures, options={"sensor": sensor})
                asked = dataclasses.replace(stated.options, sensor=sensor)
                yield stated.of(cause, robot, asked)
    if robot.space.moves:
        yield from _of_another_scale(stated)


def _of_another_scale(stated: Correction) -> Iterator[Correction]:
    """With lengths by that metre with which the robot is nearest to the drawing and to them."""
    fits: list[_core.JointFit] = []
    for share in (-_SHARE, 0.0, _SHARE):
        table = scaled(stated.measurements, 1 + share)
        fit = None if table is None else stated._replace(measurements=table).fit(SECOND[1])
        if fit is None:
            return
        fits.append(fit)
    less, same, more = (each.goodness.chi_square for each in fits)
    bend = less - 2 * same + more
    if bend <= 0:
        return
    share = _SHARE * (less - more) / (2 * bend)
    table = scaled(stated.measurements, 1 + share)
    if table is None:
        return
    every, before = tuple(range(len(stated.mechanism.legs))), _from_drawing(fits[1])

    def cause(fit: _core.JointFit) -> Doubt:
        movement = scale_in_words(-share)
        figures = {"movement": movement, "share": max(1 - _from_drawing(fit) / before, 0.0)}
        return Doubt("moved-together", every, size=abs(share), figures=figures)

    yield stated._replace(cause=cause, measurements=table)


def _from_drawing(fit: _core.JointFit) -> float:
    """What the tolerances contribute to chi-square."""
    return max(fit.goodness.chi_square - float(np.nansum(fit.chi_squares)), 1e-12)
