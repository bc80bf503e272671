# SPDX-License-Identifier: MIT
"""Whole turns of sensors that read angles."""

from __future__ import annotations

import math

import numpy as np

from symkin.model.chains import shortest
from symkin.model.mechanism import Mechanism
from symkin.model.sensor_table import SAME_TURN
from symkin.values import Array


def turn_of(mechanism: Mechanism, leg: int) -> float | None:
    """One turn of a leg's angular joint in the sensor's unit; None for a length."""
    if mechanism.leg_info(leg).reading_unit != "rad":
        return None
    return abs(2 * math.pi / float(mechanism.sensor_gains[leg]))


def shortest_ways(mechanism: Mechanism, differences: Array) -> Array:
    """Differences of readings, (..., legs), by the shortest turns of each leg."""
    ways = np.array(differences)
    for leg in range(ways.shape[-1]):
        ways[..., leg] = shortest(ways[..., leg], turn_of(mechanism, leg))
    return ways


def turned_into_table(mechanism: Mechanism, straight: Array) -> Array:
    """Return readings of straight sensors, (N, legs), whole turns further where the table is there.

    Readings that are calculated are within half a turn of home; an encoder that counts from 0 to
    360 degrees shows some of them a turn further.
    """
    table = mechanism.sensor_table
    turned = np.array(straight)
    for leg in range(turned.shape[1] if table is not None else 0):
        span, turn = table.span(leg) if table is not None else None, turn_of(mechanism, leg)
        if span is not None and turn is not None:
            values = turned[:, leg]
            below = np.ceil((span[0] - values) / turn - SAME_TURN)
            above = np.ceil((values - span[1]) / turn - SAME_TURN)
            turned[:, leg] += turn * (np.fmax(below, 0) - np.fmax(above, 0))
    return turned


def turned_home(mechanism: Mechanism, readings: Array) -> Array:
    """Return readings, (N, legs), of angles within half a turn of home, where that is known."""
    turned = np.array(readings)
    for leg, home in enumerate(mechanism.inverse_kinematics(mechanism.home)[0]):
        turn = turn_of(mechanism, leg)
        if turn is not None and math.isfinite(home):
            turned[:, leg] -= turn * np.rint((turned[:, leg] - home) / turn)
    return turned
