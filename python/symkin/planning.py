# SPDX-License-Identifier: MIT
"""Measurement plans: which poses to take, for which leg, in which order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import MeasurementError
from symkin.mechanism import Mechanism
from symkin.observability import RowKind, observability_rows
from symkin.selection import SelectionMethod, select_poses
from symkin.symmetry import leg_carriers, map_poses

__all__ = ["Plan", "make_plan"]


@dataclass(frozen=True)
class Plan:
    """Commanded poses of every leg's set, with the readings of all legs at the nominal parameters.

    Attributes
    ----------
    leg_sets : ndarray of int, shape (N,)
        The leg, from 1, that the pose identifies.
    order : ndarray of int, shape (N,)
        Place of the pose within its leg's set, from 1.
    spare : ndarray of bool, shape (N,)
        Whether the pose only replaces one that cannot be taken.
    poses : ndarray, shape (N, coordinates)
        Commanded poses, m and rad (spatial: position and quaternion).
    readings : ndarray, shape (N, legs)
        Commanded readings in the sensor's unit.
    """

    leg_sets: NDArray[np.intp]
    order: NDArray[np.intp]
    spare: NDArray[np.bool_]
    poses: NDArray[np.float64]
    readings: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose."""
        rows = len(self.poses)
        for name in ("leg_sets", "order", "spare", "readings"):
            count = len(getattr(self, name))
            if count != rows:
                raise MeasurementError(f"the plan has {count} {name} for {rows} poses")

    def rows_of(self, leg: int, *, spare: bool = False) -> NDArray[np.intp]:
        """Return the rows, from 0, of a leg's set (leg from 0), in order; its spares on demand."""
        rows = np.flatnonzero((self.leg_sets == leg + 1) & (self.spare == spare))
        return rows[np.argsort(self.order[rows], kind="stable")]


def make_plan(
    mechanism: Mechanism,
    candidates: ArrayLike,
    count: int | None = None,
    seed: int | None = None,
    *,
    rows: RowKind = "paper",
    method: SelectionMethod = "exchange",
) -> Plan:
    """Choose the poses to measure: for the reference leg, carried to the other legs by symmetry.

    Steps PS1 to PS3 of the paper (section 5.1). A leg that is not the image of another has its
    poses chosen for itself: every leg of a mechanism without symmetry.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    candidates : array_like, shape (n, coordinates)
        Poses to choose from, see `sample_workspace`.
    count : int, optional
        Poses for each leg, by default the protocol's.
    seed : int, optional
        By default the protocol's.
    rows : {"paper", "noise_aware"}
        What the selection takes a pose to be worth, see `observability_rows`.
    method
        See `select_poses`.

    Returns
    -------
    Plan
        With half as many spares as poses for each leg.
    """
    poses = np.atleast_2d(np.ascontiguousarray(candidates, dtype=np.float64))
    count = mechanism.protocol.pose_count if count is None else count
    seed = mechanism.protocol.seed if seed is None else seed
    spares = -(-count // 2)

    def chosen(leg: int) -> NDArray[np.float64]:
        leg_rows = observability_rows(mechanism, leg, poses, rows)
        selection = select_poses(
            leg_rows, count, seed, method=method, parameter_names=mechanism.parameter_names
        )
        backup = _spares(mechanism, poses, leg_rows, selection.indices, spares, seed)
        ordered: NDArray[np.float64] = poses[np.concatenate([selection.indices, backup])]
        return ordered

    carriers = leg_carriers(mechanism)
    references = {reference: chosen(reference) for reference in {leg for leg, _ in carriers}}
    sets = [map_poses(mechanism, element, references[leg]) for leg, element in carriers]
    return _plan(mechanism, sets, count)


def _spares(
    mechanism: Mechanism,
    poses: NDArray[np.float64],
    rows: NDArray[np.float64],
    chosen: NDArray[np.intp],
    count: int,
    seed: int,
) -> NDArray[np.intp]:
    """Candidates to replace chosen poses that a real robot cannot take, best first.

    The best poses crowd at the rim of the workspace, where a robot with errors misses neighbours
    together. Spares keep twice the distance from singularities and complete the chosen poses that
    do so too.
    """
    some = np.unique(np.concatenate([chosen, np.arange(0, len(poses), -(-len(poses) // 2000))]))
    limit = mechanism.workspace.conditioning_limit / 2 if mechanism.workspace else np.inf
    safe = mechanism.singularity_measures(poses[some])[2] <= limit
    is_chosen = np.isin(some, chosen)
    if np.count_nonzero(safe & ~is_chosen) < count:
        safe[:] = True
    # Poses that may be missed count for little, but keep the information regular.
    weights = np.where(safe[is_chosen], 1.0, 0.01)[:, None]
    kept = rows[some[is_chosen]]
    information = kept.T @ (weights * kept)
    left = some[safe & ~is_chosen]
    if len(left) <= count:
        return left
    found = select_poses(rows[left], count, seed, prior=information)
    return _best_first(left[found.indices], rows, information)


def _best_first(
    indices: NDArray[np.intp], rows: NDArray[np.float64], information: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Order candidates so that each adds most to the information of those before it."""
    left, ordered = indices.tolist(), []
    while left:
        gains = np.einsum("ij,ji->i", rows[left], np.linalg.solve(information, rows[left].T))
        best = left.pop(int(np.argmax(gains)))
        information = information + np.outer(rows[best], rows[best])
        ordered.append(best)
    return np.array(ordered, dtype=np.intp)


def _plan(mechanism: Mechanism, sets: Sequence[NDArray[np.float64]], count: int) -> Plan:
    """Join the sets of all legs, each `count` poses and then spares."""
    size = len(sets[0])
    poses = np.concatenate(sets)
    return Plan(
        leg_sets=np.repeat(np.arange(1, len(sets) + 1), size),
        order=np.tile(np.arange(1, size + 1), len(sets)),
        spare=np.tile(np.arange(size) >= count, len(sets)),
        poses=poses,
        readings=mechanism.inverse_kinematics(poses),
    )
