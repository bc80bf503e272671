# SPDX-License-Identifier: MIT
"""Poses that replace those that a real robot cannot take."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from symkin.mechanism import Mechanism
from symkin.planning.selection import select_poses

__all__ = ["spare_poses"]

_THINNED = 2000  # candidates among which spares are sought


def spare_poses(
    mechanism: Mechanism,
    poses: NDArray[np.float64],
    rows_of: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    chosen: NDArray[np.intp],
    allowed: NDArray[np.bool_],
    prior: NDArray[np.float64] | None,
    count: int,
    seed: int,
) -> NDArray[np.intp]:
    """Candidates to replace chosen poses that a real robot cannot take, best first.

    The best poses crowd at the rim of the workspace, where a robot with errors misses neighbours
    together. Spares keep twice the distance from singularities and complete the chosen poses that
    do so too.

    Parameters
    ----------
    mechanism : Mechanism
        With its workspace, if it has one.
    poses : ndarray, shape (n, coordinates)
        The candidates.
    rows_of : callable
        What poses (k, coordinates) show: their rows (k, r, p).
    chosen : ndarray of int
        Candidates that are measured.
    allowed : ndarray of bool, shape (n,)
        Which candidates may be measured.
    prior : ndarray, shape (p, p), optional
        Information of what is measured already.
    count : int
        Spares wanted.
    seed : int
        Of their selection.
    """
    thinned = np.flatnonzero(allowed)[:: -(-len(poses) // _THINNED)]
    some = np.unique(np.concatenate([chosen, thinned]))
    rows = rows_of(poses[some])
    limit = mechanism.workspace.conditioning_limit / 2 if mechanism.workspace else np.inf
    safe = mechanism.singularity_measures(poses[some])[2] <= limit
    is_chosen = np.isin(some, chosen)
    if np.count_nonzero(safe & ~is_chosen) < count:
        safe[:] = True
    # Poses that may be missed count for little, but keep the information regular.
    weights = np.where(safe[is_chosen], 1.0, 0.01)[:, None, None]
    information = np.einsum("nri,nrj->ij", rows[is_chosen], weights * rows[is_chosen])
    if prior is not None:
        information = information + prior
    left = np.flatnonzero(safe & ~is_chosen)
    if len(left) <= count:
        return np.asarray(some[left])
    found = select_poses(rows[left], count, seed, prior=information)
    return np.asarray(some[_best_first(left[found.indices], rows, information)])


def _best_first(
    indices: NDArray[np.intp], rows: NDArray[np.float64], information: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Order candidates so that each adds most to the information of those before it."""
    left, ordered = indices.tolist(), []
    while left:
        candidates = rows[left]
        answers = np.linalg.solve(information, candidates.transpose(0, 2, 1))
        gains = np.linalg.slogdet(np.eye(rows.shape[1]) + candidates @ answers)[1]
        best = left.pop(int(np.argmax(gains)))
        information = information + rows[best].T @ rows[best]
        ordered.append(best)
    return np.array(ordered, dtype=np.intp)
