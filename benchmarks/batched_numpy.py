# SPDX-License-Identifier: MIT
"""Gauss-Newton for a fleet of robots with legs [R]RR as one writes it by hand in NumPy.

All legs of all robots are arrays beside each other, as many steps are taken as the slowest leg
needs, derivatives are written out. What a library is to be measured by: no loop over robots.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def linearised(
    parameters: Array, poses: Array, readings: Array
) -> tuple[Array, Array, Array, Array]:
    """Closures of B legs at n poses (m), by their parameters, by the pose and by the reading.

    Parameters (B, 8), poses (B, n, 3), readings (B, n); shapes (B, n), (B, n, 8), (B, n, 3) and
    (B, n).
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
    return length - rod, derivatives, np.stack([rod_x, rod_y, by_turn], axis=-1), gain * by_angle


def identified(
    start: Array, poses: Array, readings: Array, noise: tuple[float, float, float]
) -> tuple[Array, Array, Array]:
    """Parameters and standard deviations (B, 8) and chi-square (B)."""
    parameters = start.copy()
    variances = np.square([noise[0], noise[0], noise[1]])
    for _ in range(20):
        closures, derivatives, by_pose, by_reading = linearised(parameters, poses, readings)
        weights = 1 / (by_pose**2 @ variances + (noise[2] * by_reading) ** 2)
        weighted = (weights[..., None] * derivatives).swapaxes(1, 2)
        information = weighted @ derivatives
        gradient = weighted @ closures[..., None]
        step = np.linalg.solve(information, gradient)
        if (gradient * step).sum(axis=1).max() < 1e-12:  # in variances
            break
        parameters -= step[..., 0]
    deviations = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2))
    return parameters, deviations, (weights * closures**2).sum(axis=1)


def identified_jointly(
    start: Array, poses: Array, readings: Array, noise: tuple[float, float, float]
) -> tuple[Array, Array]:
    """Parameters and standard deviations (R, legs, 8) of R robots, true poses unknown.

    Start (R, legs, 8), poses (R, n, 3), readings (R, n, legs). Poses and readings move together
    with the parameters; a pose is eliminated from its closures.
    """
    robots, legs, p = start.shape
    parameters = start.copy()
    true_poses, true_readings = poses.copy(), readings.copy()
    variances = np.square([noise[0], noise[0], noise[1]])
    for _ in range(20):
        h, by_parameters, by_pose, by_reading = (
            np.stack(each, axis=2)
            for each in zip(
                *(
                    linearised(parameters[:, leg], true_poses, true_readings[..., leg])
                    for leg in range(legs)
                ),
                strict=True,
            )
        )
        off = h - by_reading * (true_readings - readings)
        off -= (by_pose @ (true_poses - poses)[..., None])[..., 0]
        covariance = (by_pose * variances) @ by_pose.swapaxes(2, 3)
        covariance += np.eye(legs) * (noise[2] * by_reading[..., None]) ** 2
        weights = np.linalg.inv(covariance)
        information = np.empty((robots, legs, p, legs, p))
        for i, j in np.ndindex(legs, legs):
            weighted = weights[:, :, i, j, None] * by_parameters[:, :, i]
            information[:, i, :, j] = weighted.swapaxes(1, 2) @ by_parameters[:, :, j]
        information = information.reshape(robots, legs * p, legs * p)
        forces = (weights @ off[..., None])[..., 0]
        gradient = np.einsum("rnl,rnla->rla", forces, by_parameters).reshape(robots, legs * p)
        step = -np.linalg.solve(information, gradient[..., None])[..., 0]
        moved = step.reshape(robots, 1, legs, p)
        forces = (weights @ (off + (by_parameters * moved).sum(axis=3))[..., None])[..., 0]
        parameters += moved[:, 0]
        true_poses = poses - variances * (forces[..., None] * by_pose).sum(axis=2)
        true_readings = readings - noise[2] ** 2 * by_reading * forces
        if -(gradient * step).sum(axis=1).min() < 1e-12:  # in variances
            break
    deviations = np.sqrt(np.diagonal(np.linalg.inv(information), axis1=1, axis2=2))
    return parameters, deviations.reshape(start.shape)
