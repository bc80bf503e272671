# SPDX-License-Identifier: MIT
"""Parameters against the drawing and its tolerances."""

from __future__ import annotations

from collections.abc import Iterator
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import named_legs
from symkin.frames import transforms
from symkin.identification.fit import Fit
from symkin.observability import parameter_tolerances
from symkin.poses import POSE_SPACES, cross_matrices

__all__ = [
    "FALSE_ALARMS",
    "UNKNOWN",
    "implausible_parameters",
    "unknown_parameters",
    "weak_parameters",
]

Array = NDArray[np.float64]

# Share of sound robots that one kind of test doubts, such as that of all parameters' distances.
FALSE_ALARMS = 1e-3
# Times the tolerance: a parameter of such a standard deviation is in effect not measured.
UNKNOWN = 10
# Share of the squared distance from the drawing that a common movement must explain to be named.
_EXPLAINED = 0.5
_MOVEMENTS = {
    "base": "the frame of the measured poses is {} against the drawing's base",
    "platform": "the measured target is {} against the drawing's platform frame",
    "scale": "the measured positions are {} against the drawing's lengths",
}


def implausible_parameters(found: Fit) -> Iterator[str]:
    """Name parameters, and movements of all of them, that the tolerances make implausible."""
    nominal, moved, deviations = found.nominal, found.changes, found.deviations
    identified = nominal.is_estimated
    if not np.isfinite(deviations[identified]).all():
        return
    tolerances = parameter_tolerances(nominal)
    yield from _common_movements(found, moved, tolerances)
    distances = np.abs(moved) / np.hypot(tolerances, deviations)
    far = np.argwhere(distances > NormalDist().inv_cdf(1 - FALSE_ALARMS / 4 / identified.sum()))
    if len(far):
        order = np.argsort(-distances[tuple(far.T)])
        named = ", ".join(
            f"{nominal.parameter_names[parameter]} of leg {leg + 1} by "
            f"{moved[leg, parameter]:+.3g} {nominal.parameter_units(leg)[parameter]}".rstrip()
            + f" ({distances[leg, parameter]:.3g} times what tolerance and noise allow)"
            for leg, parameter in far[order[:3]]
        )
        more = f" and {len(far) - 3} more" if len(far) > 3 else ""
        yield f"parameters are further from the drawing than is plausible: {named}{more}"


def unknown_parameters(found: Fit) -> Iterator[str]:
    """Name parameters that the measurements in effect do not show."""
    unknown = np.argwhere(found.deviations > UNKNOWN * parameter_tolerances(found.nominal))
    if len(unknown):
        yield (
            f"the measurements say nothing of {_named(found, unknown)}: the standard deviation is "
            f"more than {UNKNOWN} times the tolerance, so the drawing knows better"
        )


def weak_parameters(found: Fit) -> Iterator[str]:
    """Name parameters that the drawing knows better than the measurements."""
    shares = found.deviations / parameter_tolerances(found.nominal)
    weak = np.argwhere((shares > 1) & (shares <= UNKNOWN))
    if len(weak):
        yield (
            f"the measurements say less than the tolerances of {_named(found, weak)}: the standard "
            "deviation is larger than the tolerance; what the platform does follows from "
            "combinations of these parameters, which are known better"
        )


def _named(found: Fit, places: NDArray[np.intp]) -> str:
    by_name: dict[str, list[int]] = {}
    for leg, parameter in places:
        by_name.setdefault(found.nominal.parameter_names[parameter], []).append(int(leg))
    return ", ".join(f"{name} of {named_legs(legs)}" for name, legs in by_name.items())


def _common_movements(found: Fit, moved: Array, tolerances: Array) -> Iterator[str]:
    """Movements of all parameters as one, which show far below the tolerance of any of them."""
    own = np.flatnonzero(found.nominal.is_estimated)
    total = found.covariance + np.diag(tolerances.ravel() ** 2)
    inverse = np.linalg.inv(total[np.ix_(own, own)])
    z = moved.ravel()[own]
    distance = float(z @ inverse @ z)
    if distance == 0:
        return
    best = (FALSE_ALARMS / 8, "")
    for kind, words in _MOVEMENTS.items():
        if kind == "scale" and not found.nominal.space.moves:
            continue
        directions = _directions(found, kind)
        if directions.shape[1] == 0:
            continue
        information = directions.T @ inverse @ directions
        gradient = directions.T @ inverse @ z
        amounts = np.linalg.pinv(information, rcond=1e-10) @ gradient
        explained = float(gradient @ amounts)
        share = f"which explains {explained / distance:.0%} of their distance from the drawing"
        movement = words.format(_in_words(kind, amounts, found.nominal.space.size))
        p_value = _core.chi_square_tail(explained, directions.shape[1])
        if explained < _EXPLAINED * distance:
            continue
        best = min(best, (p_value, f"{movement}, {share}"))
    if best[1]:
        yield f"the parameters of all legs moved together: {best[1]}"
        return
    p_value = _core.chi_square_tail(distance, z.size)
    if p_value < FALSE_ALARMS / 8:
        yield (
            "all parameters together are further from the drawing than their tolerances make "
            f"plausible (chi-square {distance:.3g} for {z.size} parameters)"
        )


def _directions(found: Fit, kind: str) -> Array:
    """Changes of what is identified, one a column, that stand for moving a frame or for a scale.

    They are those with which the closures at the measured poses stay as they are, leg by leg.
    """
    calibrated, measurements = found.mechanism, found.measurements
    columns = []
    for leg, fit in enumerate(found.legs):
        rows = _core.linearise(
            calibrated.core,
            leg,
            measurements.poses[fit.rows],
            measurements.readings[fit.rows, leg],
        )
        movement = _movements(kind, found.nominal.pose_space, measurements.poses[fit.rows])
        movement = np.repeat(movement, calibrated.closures, axis=0)
        wanted = -np.einsum("nd,ndk->nk", rows.by_pose, movement)
        by_parameters = rows.by_parameters[:, found.nominal.estimated[leg]]
        scale = np.linalg.norm(by_parameters, axis=0)
        scale[scale == 0] = 1
        solved = np.linalg.lstsq(by_parameters / scale, wanted, rcond=1e-12)[0]
        columns.append(solved / scale[:, None])
    return np.vstack(columns)


def _movements(kind: str, pose_space: str, poses: Array) -> Array:
    """Changes of the poses on their tangent, shape (N, dof, movements)."""
    rotation, translation = transforms(pose_space, poses)
    none, same = np.zeros_like(rotation), np.broadcast_to(np.eye(3), rotation.shape)
    movements = {
        "base": np.block([[same, -cross_matrices(translation)], [none, same]]),
        "platform": np.block([[rotation, none], [none, rotation]]),
        "scale": np.concatenate([translation, np.zeros_like(translation)], axis=1)[:, :, None],
    }[kind]
    space = POSE_SPACES[pose_space]
    shown = space.components
    if kind == "scale":
        return movements[:, shown]
    free = space.frame_components
    if kind == "platform" and not space.turns:
        free = []  # its target's offset cannot be told from the base frame's
    return movements[:, shown][:, :, free]


def _in_words(kind: str, amounts: Array, positions: int) -> str:
    if kind == "scale":
        return (
            f"{100 * amounts[0]:+.3g} % too large"
            if amounts[0] > 0
            else (f"{-100 * amounts[0]:.3g} % too small")
        )
    angle = np.degrees(np.linalg.norm(amounts[positions:]))
    turned = f"turned by about {angle:.3g} degrees"
    if not positions:
        return turned
    shift = ", ".join(f"{1e3 * value:.3g}" for value in amounts[:positions])
    return f"shifted by about ({shift}) mm and {turned}"
