# SPDX-License-Identifier: MIT
"""Tolerances and noise as the core takes them."""

from __future__ import annotations

import numpy as np

from symkin import _core
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings, Tolerances
from symkin.values import Array

# Times the tolerance: a parameter of such a standard deviation is in effect not measured.
UNKNOWN = 10


def noise_of(noise: NoiseSettings) -> _core.MeasurementNoise:
    """Settings as the core takes them."""
    return _core.MeasurementNoise(noise.position, noise.orientation, noise.reading)


def tolerances_of(tolerances: Tolerances) -> _core.Tolerances:
    """Settings as the core takes them."""
    return _core.Tolerances(tolerances.length, tolerances.angle, tolerances.gain)


def parameter_tolerances(mechanism: Mechanism) -> Array:
    """Tolerance of every parameter, shape (legs, p); zero of those that are held."""
    tolerances = tolerances_of(mechanism.tolerances)
    legs = range(len(mechanism.legs))
    return np.array([tolerances.deviations(mechanism.straight, leg) for leg in legs])
