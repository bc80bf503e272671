# SPDX-License-Identifier: MIT
"""Whitened rows at an estimate, what its unknowns explain of them, and columns to test beside.

What changed, what scatters and what differs between sessions is tested with these: each is a column
whose slope was held at zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.estimate.blunders import without_rejected
from symkin.estimate.changes import slopes_found
from symkin.estimate.covariates import Covariate, clock, observations_of
from symkin.estimate.found import Found
from symkin.estimate.kept import once
from symkin.estimate.problem import own_readings
from symkin.model.core_setup import core_setup, scalar_names
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.values import Array, record

_RANK = 1e-9  # of the largest singular value
_ALIKE = 1e-10  # of the largest eigenvalue of columns of unit length
_PER_LEG, _GROWS = "one", "all"  # names of covariates that are 1 in every row


class Explained(NamedTuple):
    """What columns explain of residuals, together: sizes and their covariance, of chi-square."""

    sizes: Array
    covariance: Array
    drop: float


@record
class LinearRows:
    """Whitened rows of poses in the order of time, and what is left of them."""

    residual: Array  # n x r, less what the unknowns explain
    basis: Array  # n x r x k, orthonormal, of what they explain
    by_basis: Array  # k x unknowns: how these move with it
    by_leg: Array  # n x r x legs: of readings that show 1 more
    by_growth: Array  # n x r
    by_base: Array  # n x r x components
    by_point: Array  # n x r x points x axes: of places on the platform
    components: tuple[str, ...]
    order: NDArray[np.intp]  # the rows of the measurements
    spare: int
    used: NDArray[np.bool_]  # n x r: which are conditions
    by_priors: float = 0.0  # of chi-square: what they ask for

    @property
    def square(self) -> float:
        """Chi-square, as a sum of squares."""
        return float(np.square(self.residual).sum()) + self.by_priors

    def left(self, column: Array) -> Array:
        """What the unknowns leave of a column, n x r."""
        explained = np.einsum("nrk,nr->k", self.basis, column)
        return np.asarray(column - self.basis @ explained)

    def length(self, column: Array) -> float:
        """Of what the unknowns leave of a column: by how many deviations a unit of it shows.

        Unknowns with priors explain it at a cost, so that more is left than `left` is long.
        """
        return math.sqrt(max(float(np.sum(column * self.left(column))), 0.0))

    def score(self, column: Array) -> float:
        """How many standard deviations of noise as declared there are of a column alone."""
        return -float(np.sum(column * self.residual)) / self.length(column)

    def explained(self, columns: Sequence[Array]) -> Explained:
        """By columns together, which may be of very different lengths, or alike."""
        stacked = np.stack(columns)
        shared = np.einsum("anr,bnr->ab", stacked, np.stack([self.left(each) for each in stacked]))
        unit = 1 / np.sqrt(np.diag(shared))
        both = unit[:, None] * unit
        inverse = np.linalg.pinv(shared * both, rcond=_ALIKE, hermitian=True) * both
        along = -np.einsum("anr,nr->a", stacked, self.residual)
        sizes = inverse @ along
        return Explained(sizes, inverse, float(along @ sizes))

    def shown_by_repeating(self, column: Array) -> Array:
        """How much longer each row would make what is `left` (squared), measured again without it.

        Shape (n,): by what the unknowns explain of the column there, and how well they are known.
        """
        there = column - self.left(column)
        known = np.eye(there.shape[1]) + self.basis @ self.basis.swapaxes(1, 2)
        return np.asarray(
            np.einsum("nr,nr->n", there, np.linalg.solve(known, there[..., None])[..., 0])
        )

    def drop_without(self, places: NDArray[np.intp]) -> float:
        """What chi-square loses without the rows at some places."""
        residual, basis = self.residual[places], self.basis[places]
        along = np.einsum("nrk,nr->k", basis, residual)
        rest = np.eye(len(along)) - np.einsum("nrk,nrl->kl", basis, basis)
        # What these rows alone show follows them.
        answer = np.linalg.pinv(rest, rcond=_RANK, hermitian=True) @ along
        return float(np.square(residual).sum() + along @ answer)

    def moved(self, column: Array) -> Array:
        """By how much the unknowns are off if so much of a column, n x r, was taken for noise."""
        return np.asarray(-np.einsum("nrk,nr->k", self.basis, column) @ self.by_basis)


@once
def linear_rows(found: Found, apart: tuple[int, ...]) -> LinearRows | None:
    """Rows of the poses that were estimated from, linearised at the estimate."""
    robot, places = as_estimated(found)
    measured = without_rejected(found)
    if found.options.poses == "own":
        measured = own_readings(robot, measured)
    estimated = found.options.covariates(robot, measured)
    covariates = (*estimated, *_tested(robot, len(measured)))
    setup = core_setup(robot, slopes_found(found, covariates))
    columns = _Columns.of_scalars(found, scalar_names(robot, setup))
    rows = _core.observed_rows(
        robot.straight,
        setup,
        observations_of(measured, found.noise, covariates),
        columns.of,
        np.full(columns.number, np.inf),
        np.ascontiguousarray(places),
        ties=columns.ties,
    )
    n, free = len(measured), len(found.names)
    jacobian, residual = rows.jacobian.reshape(n, -1, columns.number), rows.residual.reshape(n, -1)
    finite = np.isfinite(jacobian).all(axis=(1, 2))
    by_leg = [row for row, _ in found.rejected] if found.legs else []
    without = np.isin(np.arange(n), [*apart, *found.aside, *by_leg])
    order = np.argsort(clock(measured), kind="stable")
    order = order[(finite & ~without)[order]]
    removed = _gradient(jacobian[finite & without, :, :free], residual[finite & without])
    by_priors = found.chi_square - float(np.square(residual[finite]).sum())
    jacobian, residual = jacobian[order], residual[order]
    if not residual.size:
        return None
    own, priors = jacobian[..., :free], found.prior_rows
    if len(priors) and found.options.loss == "none":  # where all gradients cancel
        gradient = -removed
    else:
        asked = priors @ np.nan_to_num(np.array([each.change for each in found.first_unknowns]))
        gradient, by_priors = _gradient(own, residual) + priors.T @ asked, float(asked @ asked)
    basis, half = _basis_of(own, priors)
    residual = residual - own @ (half.T @ (half @ gradient))
    used = np.abs(jacobian).max(axis=2) > 0
    spare = int(used.sum()) + int(np.linalg.matrix_rank(priors)) - len(half)
    growth = jacobian[..., columns.growth].sum(axis=-1)
    return LinearRows(
        residual=residual,
        basis=basis,
        by_basis=half,
        by_leg=jacobian[..., columns.legs],
        by_growth=growth,
        by_base=jacobian[..., [*columns.base.values()]],
        by_point=jacobian[..., np.array(columns.points, dtype=int)],
        components=tuple(columns.base),
        order=order,
        spare=spare,
        used=used,
        by_priors=max(by_priors, 0.0),
    )


def as_estimated(found: Found) -> tuple[Mechanism, Array]:
    """The estimate's robot and its poses in the frame that they were estimated in."""
    robot = found.mechanism
    if found.legs:
        return robot.replace(frames=None), unframed(robot, found.measurements.poses)
    return robot, found.latent_poses


class _Columns(NamedTuple):
    """Columns of the rows: of an estimate's unknowns, and behind them of what is tested."""

    of: list[int]  # of each scalar, -1 where it has none
    number: int
    ties: list[tuple[int, int, float]]  # of scalars that follow unknowns
    legs: list[int]
    growth: list[int]  # one for all legs, if they have lengths
    base: dict[str, int]  # by component
    points: list[list[int]]  # of their axes

    @classmethod
    def of_scalars(cls, found: Found, names: Sequence[str]) -> _Columns:
        values = {each.name: each for each in found.unknowns}
        of = [values[each].column if each in values else -1 for each in names]
        owners = [each.partition(".")[0] for each in names]
        ones = [i for i, each in enumerate(names) if _PER_LEG in each.split(".")]
        grown = [i for i, each in enumerate(names) if _GROWS in each.split(".")]
        placed = [i for i, each in enumerate(names) if each.startswith("point")]
        if any(of[i] < 0 and names[i] in values and values[names[i]].moves for i in placed):
            placed = []
        number = len(found.names)
        alike = [*([i] for i in ones), grown, *([i] for i in placed if of[i] < 0)]
        for members in filter(None, alike):
            for i in members:
                of[i] = number
            number += 1
        ties = [
            (i, *each)
            for i, name in enumerate(names)
            if of[i] < 0 and name in values
            for each in values[name].moves
        ]
        return cls(
            of,
            number,
            ties,
            legs=[of[i] for i in ones if owners[i] != _PER_LEG],
            growth=[of[i] for i in grown[:1]],
            base={names[i].partition(".")[2]: of[i] for i in ones if owners[i] == _PER_LEG},
            points=[[of[i] for i in own] for _, own in groupby(placed, owners.__getitem__)],
        )


def _tested(robot: Mechanism, rows: int) -> list[Covariate]:
    """Covariates that are 1 in every row: of each leg's reading, of all lengths, of the base."""
    ones = np.ones((rows, len(robot.legs)))
    lengths = [Covariate(_GROWS, "lengths", ones)] if robot.space.moves else []
    return [
        Covariate(_PER_LEG, "reading", ones),
        *lengths,
        Covariate(_PER_LEG, "base", ones[:, 0]),
    ]


def _basis_of(own: Array, priors: Array) -> tuple[Array, Array]:
    """What unknowns explain of rows, as an orthonormal basis, and how they move with it.

    From their columns, n x r x unknowns, and the priors' rows; shaped as those of `LinearRows`.
    """
    stacked = np.concatenate([own.reshape(-1, own.shape[2]), priors])
    lengths = np.linalg.norm(stacked, axis=0)
    lengths[lengths == 0] = 1
    tall, upper = np.linalg.qr(stacked / lengths)
    left, singular, right = np.linalg.svd(upper, full_matrices=False)
    shown = singular > _RANK * singular[0]
    basis = (tall @ left[:, shown])[: own.shape[0] * own.shape[1]].reshape(*own.shape[:2], -1)
    return basis, (right[shown] / lengths) / singular[shown, None]


def _gradient(rows: Array, residual: Array) -> Array:
    return np.asarray(np.einsum("nrk,nr->k", rows, residual))
