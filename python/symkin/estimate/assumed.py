# SPDX-License-Identifier: MIT
"""What an estimate takes as given though it is uncertain, and how far that moves the unknowns.

The type B part of an uncertainty (GUM, JCGM 100:2008, 4.3): a held parameter, the target's place,
the device's scale, a bed that is taken as flat, a robot that is taken as stiff. Least squares
answers to first order with ``G = (J'J + P)^-1 J'B``, where B is the change of the whitened rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.problem import Problem
from symkin.estimate.unknowns import BED, SAG, SCALE, Layout
from symkin.estimate.whitened import information_of, whitened_rows
from symkin.model.core_setup import scalar_values
from symkin.values import Array, Value, record


@record
class Assumed(Value):
    """Something that an estimate rests on without having estimated it.

    Attributes
    ----------
    name, unit : str
        A scalar that is held, such as ``target.x``; ``scale`` of the device, relative; ``bed``,
        how far its rim is above its middle; ``sag``, how much lower the outermost pose was
        measured than the middle.
    deviation : float
        The declared standard deviation.
    moves : ndarray, shape (columns,)
        How far the estimates of `names` are from the truth for each unit that this is.
    """

    name: str
    unit: str
    deviation: float
    moves: Array


def assumed_of(problem: Problem, fit: _core.JointFit) -> tuple[Assumed, ...]:
    """Whatever was declared of what is not estimated.

    With a loss as if it kept all observations.

    Raises
    ------
    SymkinError
        For a bed without heights, and a sag without positions.
    """
    layout = problem.layout
    declared = layout.declared(problem.options.assume or {})
    if not declared:
        return ()
    rows = whitened_rows(problem.with_layout(layout.of_every_scalar()), fit)
    heights = problem.measurements.heights
    touched = np.zeros(len(rows), dtype=bool) if heights is None else np.isfinite(heights)
    touched &= np.isfinite(fit.poses).all(axis=1)
    return moved_by(declared, layout, rows, scalar_values(fit.setup), fit.poses, touched)


def moved_by(
    declared: Mapping[str, tuple[str, float]],
    layout: Layout,
    rows: Array,
    values: Array,
    poses: Array,
    touched: NDArray[np.bool_],
) -> tuple[Assumed, ...]:
    """How far estimates go with what was declared, see `Layout.declared`.

    From whitened rows of every scalar, shape (N, r, scalars), which have these values, and the
    poses, of which some were found as heights above a bed.
    """
    named = np.array([bool(name) for name in layout.scalars])
    own = rows @ layout.by_columns[named]
    answer = information_of(layout, own)[1]
    found = []
    for name, (unit, deviation) in declared.items():
        if name == SCALE:
            # Whatever a larger metre measures, a larger robot explains, all of whose lengths are.
            changed = rows @ (values * layout.length_powers)[named]
        elif name == BED:
            changed = _bowed(layout, rows, poses, touched)
        elif name == SAG:
            changed = _sagging(layout, rows, poses)
        else:
            changed = rows[:, :, _place_of(name, layout)]
        moves = answer @ np.einsum("nri,nr->i", own, changed)
        found.append(Assumed(name, unit, deviation, moves))
    return tuple(found)


def _place_of(name: str, layout: Layout) -> int:
    return [each for each in layout.scalars if each].index(name)


def _bowed(layout: Layout, rows: Array, poses: Array, touched: NDArray[np.bool_]) -> Array:
    """Change of the whitened rows with the height of a bed's rim above its middle."""
    if not touched.any():
        raise SymkinError(f'assume "{BED}" is of a bed that was probed; no height was observed')
    squares = np.where(touched, np.sum(poses[:, :2] ** 2, axis=1), 0.0)
    plane = rows[:, :, _place_of("plane.c0", layout)]
    return np.asarray(plane * (squares / squares.max())[:, None])


def _sagging(layout: Layout, rows: Array, poses: Array) -> Array:
    """Change of the whitened rows with how much lower the outermost pose is than the middle.

    With the square of the distance; down is against the last axis of the device's frame.
    """
    axes = [name for name in layout.scalars if name in ("base.x", "base.y", "base.z")]
    known = np.isfinite(poses).all(axis=1)
    squares = np.zeros(len(poses))
    if axes and known.any():
        places = poses[known, : len(axes)]
        squares[known] = np.square(places - places.mean(axis=0)).sum(axis=1)
    raised = rows[:, :, _place_of(axes[-1], layout)] if axes else np.zeros(rows.shape[:2])
    if not squares.any() or not raised.any():
        raise SymkinError(f'assume "{SAG}" is of positions that were measured; none was')
    return np.asarray(raised * -(squares / squares.max())[:, None])


def with_assumed(covariance: Array, assumed: Sequence[Assumed]) -> Array:
    """Covariance of the unknowns without what was assumed, and of that, beside each other."""
    columns = len(covariance)
    known = np.diag([0.0] * columns + [each.deviation**2 for each in assumed])
    known[:columns, :columns] = covariance
    return known


def widened(covariance: Array, assumed: Sequence[Assumed]) -> Array:
    """Covariance of the unknowns, with what was assumed."""
    total = np.array(covariance)
    for each in assumed:
        total += each.deviation**2 * np.outer(each.moves, each.moves)
    return total
