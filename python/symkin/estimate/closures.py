# SPDX-License-Identifier: MIT
"""The closures of full poses, leg by leg: what each is off by, and what each pose does."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin.estimate.found import Found
from symkin.estimate.precision import Influence
from symkin.estimate.problem import KINDS, Rows
from symkin.values import Array


class _Leg(NamedTuple):
    """A leg's closures at its n poses, k each, whitened by their noise, and its p unknowns.

    `half`, shape (n, k, k), is the root of the noise's covariance; `left_open`, (n, k, k), the
    covariance of a whitened residual, or of the prediction of one that a loss rejects.
    """

    rows: NDArray[np.intp]
    columns: slice
    residual: Array
    half: Array
    white: Array
    by_unknowns: Array
    covariance: Array
    left_open: Array
    kept: NDArray[np.bool_]


def _legs(found: Found) -> Iterator[_Leg]:
    robot, space, noise = found.mechanism, found.mechanism.space, found.noise
    k, first = robot.closures, 0
    variances = np.repeat([noise.position, noise.orientation], 3)[space.components] ** 2
    for leg, fit in enumerate(found.legs):
        poses, readings = (
            getattr(found.measurements, name)[fit.rows] for name in ("poses", "readings")
        )
        at = robot.linearised(leg, poses, readings[:, leg])
        by_pose = at.by_pose.reshape(len(fit.rows), k, -1)
        by_reading = at.by_reading.reshape(-1, k, 1) * noise.reading
        noisy = (by_pose * variances) @ by_pose.swapaxes(1, 2)
        half = np.linalg.cholesky(noisy + by_reading @ by_reading.swapaxes(1, 2))
        residual = at.closure.reshape(-1, k, 1)
        by_own = at.by_parameters[:, found.nominal.estimated[leg]].reshape(len(fit.rows), k, -1)
        white, by_unknowns = np.linalg.solve(half, residual), np.linalg.solve(half, by_own)
        kept = ~np.isin(fit.rows, fit.rejected)
        information = np.einsum("nki,nkj->ij", by_unknowns[kept], by_unknowns[kept])
        scale = np.diag(1 / np.sqrt(np.diag(information)))
        covariance = scale @ np.linalg.inv(scale @ information @ scale) @ scale
        explained = by_unknowns @ covariance @ by_unknowns.swapaxes(1, 2)
        left_open = np.eye(k) + np.where(kept, -1, 1)[:, None, None] * explained
        own = slice(first, first := first + by_own.shape[2])
        flat = residual[..., 0], np.asarray(half), np.asarray(white[..., 0])
        solved = np.asarray(by_unknowns), np.asarray(covariance), left_open
        yield _Leg(fit.rows, own, *flat, *solved, kept)


def closure_rows(found: Found) -> Rows:
    """Say of each closure how far it is off; nothing where they have no noise."""
    pose, index, parts = [], [], [np.zeros((3, 0))]
    try:
        for number, leg in enumerate(_legs(found)):
            alone = np.linalg.solve(leg.left_open, leg.white[..., None])
            alone = np.where(leg.kept[:, None, None], alone, leg.white[..., None])
            left = np.diagonal(leg.left_open, axis1=1, axis2=2)
            # A pose that alone decides a parameter leaves nothing, and by rounding less.
            t = leg.white / np.sqrt(np.where(left > 0, left, np.nan))
            blunder = (leg.half @ alone)[..., 0]
            parts.append(np.stack([leg.residual, t, blunder]).reshape(3, -1))
            pose.append(np.repeat(leg.rows, found.mechanism.closures))
            index.append(np.full(len(pose[-1]), number))
    except np.linalg.LinAlgError:
        pose, index, parts = [], [], [np.zeros((3, 0))]
    none = np.zeros(0, dtype=np.intp)
    poses, legs = (np.concatenate([none, *each]) for each in (pose, index))
    kinds = np.full_like(poses, KINDS.index("closures"))
    return Rows(poses, kinds, legs, *np.concatenate(parts, axis=1))


def closure_influence(found: Found) -> Influence | None:
    """Every pose against all others, to first order; None where that says nothing.

    That is where a loss has weighed the poses, and of estimators that do not come to rest where
    the whitened closures do.
    """
    if found.options.loss != "none" or found.estimator != "implicit":
        return None
    count = len(found.measurements.poses)
    squares, moved, number = np.zeros(count), np.zeros(count), np.zeros(count)
    single = np.zeros((count, len(found.names)))
    try:
        for leg in _legs(found):
            alone = np.linalg.solve(leg.left_open, leg.white[..., None])
            changes = (leg.covariance @ leg.by_unknowns.swapaxes(1, 2) @ alone)[..., 0]
            inverse = np.linalg.inv(leg.covariance)
            squares[leg.rows] += np.einsum("nk,nkj->n", leg.white, alone)
            moved[leg.rows] += np.einsum("ni,ij,nj->n", changes, inverse, changes)
            number[leg.rows] += leg.white.shape[1]
            single[leg.rows, leg.columns] = np.abs(changes) / np.sqrt(np.diag(leg.covariance))
    except np.linalg.LinAlgError:
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        residual = np.sqrt(squares / number)
    most = np.argmax(single, axis=1)
    return Influence(
        residual=residual,
        moves=np.where(number > 0, np.sqrt(moved), np.nan),
        unknown=tuple(found.names[i] if n else "" for i, n in zip(most, number, strict=True)),
        by=np.where(number > 0, single[np.arange(count), most], np.nan),
    )
