# SPDX-License-Identifier: MIT
"""What measured poses show of the parameters."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from symkin import _core
from symkin.analysis.promises import (
    CONFIDENCE,
    ExpectedAccuracy,
    examined,
    parameter_effects,
    promised,
)
from symkin.analysis.promises import anywhere as largest_anywhere
from symkin.analysis.workspace import WorkspaceSample
from symkin.errors import NotIdentifiableError, SymkinError, one_of
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry import SymmetryPair, leg_carriers
from symkin.model.tolerances import noise_of, parameter_tolerances
from symkin.options import RowKind
from symkin.results import Result
from symkin.values import Array, field, record

__all__ = [
    "ExpectedAccuracy",
    "Observability",
    "RowKind",
    "analyse_observability",
    "error_weight",
    "expected_accuracy",
    "mechanism_rows",
    "observability_rows",
    "with_combinations",
]


@record
class Observability(Result):
    """What a set of rows shows of a leg's parameters.

    Attributes
    ----------
    leg : int
        From 0.
    parameter_names : tuple of str
        The p parameters that are identified, see `Mechanism.estimated`.
    r_diagonal : ndarray, shape (p,)
        abs(R_ii) of the QR decomposition in the parameters' order (Eq. 9). Depends on units.
    indices : dict of str to float
        With each parameter in units of its tolerance, O1 (Borm and Menq 1989, 1991; Eq. 13), O2
        (Driels and Pathre 1990), O3 (Nahvi, Hollerbach and Hayward 1994), O4 (Nahvi and Hollerbach
        1996), O5 (Sun and Hollerbach 2008).
    singular_values : ndarray, shape (p,)
        Of the rows with columns of length one, descending: free of units.
    condition : float
        Largest over smallest of them.
    rank : int
        How many are above 1e-10 of the largest.
    unseen : tuple of str
        For each missing rank the combination of parameters (in tolerances) that no row shows.
    """

    leg: int = field(number=True)
    parameter_names: tuple[str, ...] = field(private=True)
    r_diagonal: Array
    indices: Mapping[str, float]
    singular_values: Array
    condition: float
    rank: int
    unseen: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values, the diagonal by the names of the parameters."""
        document = super().to_dict()
        named = zip(self.parameter_names, document["r_diagonal"], strict=True)
        return document | {"r_diagonal": dict(named)}

    def columns(self) -> Mapping[str, Any]:
        """Return the diagonal, a row a parameter."""
        return {"parameter": self.parameter_names, "r_diagonal": self.r_diagonal}


def observability_rows(
    mechanism: Mechanism, leg: int, poses: ArrayLike | WorkspaceSample, kind: RowKind = "paper"
) -> Array:
    """Rows of the identification matrix of a leg (from 0), shape (N, p), p those identified.

    Legs with k closures have k rows a pose, one behind the other: shape (k N, p).

    Parameters
    ----------
    mechanism : Mechanism
        Its noise weighs the rows of kind "noise_aware".
    leg : int
        From 0.
    poses : WorkspaceSample, or array_like of shape (N, coordinates)
        Candidate poses.
    kind : {"paper", "noise_aware"}
        dg/dparam (Eqs. 8, 11), or the closure's derivatives over its standard deviation at the
        pose, which is what a measurement is worth.

    Returns
    -------
    ndarray, shape (N, p), or (k N, p)
        NaN where the leg cannot reach.
    """
    rows = pose_rows(poses)
    row_kind = one_of("kind of rows", kind, _core.RowKind.__members__)
    return _core.observability_rows(
        mechanism.straight, leg, rows, row_kind, noise_of(mechanism.noise)
    )


def mechanism_rows(
    mechanism: Mechanism, poses: ArrayLike | WorkspaceSample, kind: RowKind = "paper"
) -> Array:
    """Rows of all legs at once, shape (N, legs, legs p), p those of a leg that are identified.

    Legs with k closures have k rows each: shape (N, legs k, legs p).

    Parameters
    ----------
    mechanism : Mechanism
        Its noise weighs the rows of kind "noise_aware".
    poses : WorkspaceSample, or array_like of shape (N, coordinates)
        Candidate poses.
    kind : {"paper", "noise_aware"}
        Each leg's dg/dparam in its own columns; or the closures of a pose whitened by their full
        covariance, since they share its noise, as the estimator "joint" does.

    Returns
    -------
    ndarray, shape (N, legs, legs p), or (N, legs k, legs p)
        NaN where a leg cannot reach.

    Raises
    ------
    SymkinError
        If that covariance is singular: more legs than degrees of freedom need a noise of the
        readings.
    """
    values = pose_rows(poses)
    row_kind = one_of("kind of rows", kind, _core.RowKind.__members__)
    rows = _core.mechanism_rows(mechanism.straight, values, row_kind, noise_of(mechanism.noise))
    return rows.reshape(len(values), len(mechanism.legs) * mechanism.closures, -1)


def analyse_observability(
    mechanism: Mechanism, leg: int, poses: ArrayLike | WorkspaceSample, kind: RowKind = "paper"
) -> Observability:
    """Analyse what poses show of a leg's (from 0) parameters.

    A leg that a symmetry about a tilted axis carries from another is analysed in coordinates that
    are carried with it, those of that leg: its own mix, and mean nothing on Z (see `carried_back`).

    Raises
    ------
    SymkinError
        For fewer poses than parameters, or a pose out of reach.
    """
    if not 0 <= leg < len(mechanism.legs):
        raise SymkinError(f"leg {leg} does not exist; expected 0 to {len(mechanism.legs) - 1}")
    seen, own, carried = carried_back(mechanism, leg, poses)
    rows, names, scale = rows_of_leg(seen, own, carried, kind)
    result = _core.analyse_observability(rows, scale)
    return Observability(
        leg=leg,
        parameter_names=names,
        r_diagonal=result.r_diagonal,
        indices={f"O{i}": value for i, value in enumerate(result.indices, 1)},
        singular_values=result.singular_values,
        condition=result.condition,
        rank=result.rank,
        unseen=tuple(name_combination(direction, names) for direction in result.null_directions.T),
    )


def carried_back(
    mechanism: Mechanism, leg: int, poses: ArrayLike | WorkspaceSample
) -> tuple[Mechanism, int, ArrayLike | WorkspaceSample]:
    """Put a leg, with its poses, where the leg is that a tilted symmetry carries onto it.

    There it shows of its joints what it shows where it stands (``C_j D = C_i``), in coordinates
    that mean the same for all legs of an orbit: then Eq. 10 holds about any axis. Of any other leg
    all stays as it is. Returns the mechanism with the leg in the place of its reference, that, and
    the poses carried back.
    """
    reference, element = leg_carriers(mechanism)[leg]
    if reference == leg or not isinstance(element, SymmetryPair) or not element.tilts:
        return mechanism, leg, poses
    back = element.core.inverse()
    values, mode = _core.carried_leg(mechanism.straight, leg, back, reference)
    named = zip(mechanism.parameter_names, values.tolist(), strict=True)
    legs, own = list(mechanism.legs), mechanism.legs[reference]
    parameters = {name: value for name, value in named if name in own.parameters}
    legs[reference] = dataclasses.replace(own, parameters=parameters, working_mode=mode)
    moved = mechanism.replace(legs=tuple(legs), symmetry=None)
    return moved, reference, back.transform_poses(mechanism.straight, pose_rows(poses))


def rows_of_leg(
    mechanism: Mechanism, leg: int, poses: ArrayLike | WorkspaceSample, kind: RowKind
) -> tuple[Array, tuple[str, ...], Array]:
    """Rows of all readings of a leg, with names and tolerances of what they have to show."""
    readings = next((each for each in mechanism.leg_readings if leg in each), (leg,))
    tolerances = parameter_tolerances(mechanism)
    scale: dict[str, float] = {}
    parts = []
    for reading in readings:
        part = observability_rows(mechanism, reading, poses, kind)
        names = mechanism.names_in_leg(reading)
        own = tolerances[reading, mechanism.estimated[reading]]
        scale |= dict(zip(names, own.tolist(), strict=True))
        places = [list(scale).index(name) for name in names]
        parts.append((places, part))
    rows = np.zeros((sum(len(part) for _, part in parts), len(scale)))
    first = 0
    for places, part in parts:
        rows[first : first + len(part), places] = part
        first += len(part)
    return rows, tuple(scale), np.array(list(scale.values()))


def expected_accuracy(
    mechanism: Mechanism,
    poses: ArrayLike | WorkspaceSample,
    covariance: ArrayLike,
    *,
    confidence: float = CONFIDENCE,
    noise_degrees: float = math.inf,
    anywhere: ArrayLike | WorkspaceSample | None = None,
) -> ExpectedAccuracy:
    """End-effector error to expect, to first order, from uncertain parameters.

    Parameters
    ----------
    mechanism : Mechanism
        Where the error is linearised.
    poses : WorkspaceSample, or array_like of shape (N, coordinates)
        Over which the error is averaged.
    covariance : array_like, shape (legs p, legs p), or (robots, legs p, legs p)
        Of all parameters, leg by leg; of robots that are not known equally well, one of each.
    confidence : float
        Share of such robots that keep the bounds.
    noise_degrees : float
        Degrees of freedom of a noise that was estimated and scales the covariance.
    anywhere : WorkspaceSample, or array_like of shape (N, coordinates), optional
        Poses over which the largest error is bounded too, at most 4000 of them.

    Raises
    ------
    SymkinError
        If the mechanism can take none of the poses, or the covariance has another shape.
    """
    rows = pose_rows(poses)
    weights = _core.accuracy_weights(mechanism.straight, rows)
    given = np.ascontiguousarray(covariance, dtype=np.float64)
    for each in given if given.ndim == 3 else given[None]:
        _core.expected_accuracy(weights, each)  # which refuses another shape
    forms, counts = (weights.position, weights.orientation), (weights.evaluated, weights.failed)
    found = promised(forms, given, counts, confidence, noise_degrees)
    if anywhere is None:
        return found
    effects, _ = parameter_effects(mechanism, examined(pose_rows(anywhere)))
    legs = effects[..., : len(mechanism.parameter_names)].reshape(*effects.shape[:2], -1)
    largest = largest_anywhere(legs, given, confidence, noise_degrees)
    return replace(found, position_anywhere=largest[0], orientation_anywhere=largest[1])


def error_weight(mechanism: Mechanism, poses: ArrayLike | WorkspaceSample) -> Array:
    """B of the mean squared end-effector error trace(covariance B), shape (legs p, legs p).

    To first order, and averaged over the poses, less those out of reach or singular. A rotation
    counts as the way of a point at the mechanism's characteristic length from the centre, so that
    the error is one length (m).
    """
    weights = _core.accuracy_weights(mechanism.straight, pose_rows(poses))
    return weights.position + mechanism.characteristic_length**2 * weights.orientation


def name_combination(direction: Array, names: tuple[str, ...]) -> str:
    """Write a direction as ``"0.71 base_angle - 0.71 platform_angle"``, small terms left out."""
    largest = float(np.abs(direction).max())
    sign = np.sign(direction[np.argmax(np.abs(direction))])
    terms = [
        f"{'-' if value < 0 else '+'} {abs(value):.2g} {name}"
        for value, name in zip(sign * direction, names, strict=True)
        if abs(value) > 0.01 * largest
    ]
    return " ".join(terms).removeprefix("+ ")


def with_combinations(
    error: NotIdentifiableError, names: Sequence[str] | None, scale: Array
) -> NotIdentifiableError:
    """The error with the combinations of parameters (each in its scale) that nothing shows."""
    directions = np.asarray(error.null_directions)
    if names is None or not directions.size:
        return error
    scale = np.asarray(scale, dtype=np.float64)
    if scale.size:
        if scale.shape != directions.shape[:1]:
            raise SymkinError(
                f"scale has shape {scale.shape}; expected ({len(directions)},), or nothing"
            )
        directions = directions / np.where(scale > 0, scale, 1)[:, None]
        directions = directions / np.linalg.norm(directions, axis=0)
    error.unseen = tuple(name_combination(direction, tuple(names)) for direction in directions.T)
    error.args = (f"{error} (not shown: {'; '.join(error.unseen)})",)
    return error
