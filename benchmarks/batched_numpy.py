# SPDX-License-Identifier: MIT
"""Gauss-Newton for a fleet of robots with legs [R]RR as one writes it by hand in NumPy.

All legs of all robots are arrays beside each other, as many steps are taken as the slowest leg
needs, derivatives are written out. What a library is to be measured by: no loop over robots.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def linearised(
    parameters: Array, poses: Array, readings: Array, noise: tuple[float, float, float]
) -> tuple[Array, Array, Array]:
    """Closures of B legs at n poses (m), by their parameters, and one over their variances.

    Parameters (B, 8), poses (B, n, 3), readings (B, n), noise of position, orientation and reading;
    shapes (B, n), (B, n, 8) and (B, n).
    """
    crank, rod, base, base_angle, platform, platform_angle, gain, offset = parameters.T[..., None]
    x, y, phi = np.moveaxis(poses, -1, 0)
    angles = gain * readings + offset, base_angle, phi + platform_angle
    (crank_x, base_x, platform_x), (crank_y, base_y, platform_y) = (
        [function(angle) for angle in angles] for function in (np.cos, np.sin)
    )
    rod_x = x + platform * platform_x - base * base_x - crank * crank_x
    rod_y = y + platform * platform_y - base * base_y - crank * crank_y
    length = np.hypot(rod_x, rod_y)
    rod_x, rod_y = rod_x / length, rod_y / length
    by_angle = crank * (rod_x * crank_y - rod_y * crank_x)
    by_turn = platform * (rod_y * platform_x - rod_x * platform_y)
    derivatives = np.empty((*readings.shape, 8))
    derivatives[..., 0] = -(rod_x * crank_x + rod_y * crank_y)
    derivatives[..., 1] = -1
    derivatives[..., 2] = -(rod_x * base_x + rod_y * base_y)
    derivatives[..., 3] = base * (rod_x * base_y - rod_y * base_x)
    derivatives[..., 4] = rod_x * platform_x + rod_y * platform_y
    derivatives[..., 5] = by_turn
    derivatives[..., 6] = by_angle * readings
    derivatives[..., 7] = by_angle
    position, orientation, reading = noise
    variances = position**2 + (orientation * by_turn) ** 2 + (reading * gain * by_angle) ** 2
    return length - rod, derivatives, 1 / variances


def identified(
    start: Array, poses: Array, readings: Array, noise: tuple[float, float, float]
) -> tuple[Array, Array, Array]:
    """Parameters and standard deviations (B, 8) and chi-square (B)."""
    parameters = start.copy()
    for _ in range(20):
        closures, derivatives, weights = linearised(parameters, poses, readings, noise)
        weighted = (weights[..., None] * derivatives).swapaxes(1, 2)
        information = weighted @ derivatives
        gradient = weighted @ closures[..., None]
        step = np.linalg.solve(information, gradient)
        if (gradient * step).sum(axis=1).max() < 1e-12:  # in variances
            break
        parameters -= step[..., 0]
    deviations = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2))
    return parameters, deviations, (weights * closures**2).sum(axis=1)
