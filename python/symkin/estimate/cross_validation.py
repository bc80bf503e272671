# SPDX-License-Identifier: MIT
"""Errors at poses that an identification did not see."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.evaluation import Evaluation, at_arm, closures_of, pose_differences
from symkin.analysis.reflectors import own_poses, whole
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.changes import in_last_session
from symkin.estimate.evidence.corrections import explained
from symkin.estimate.fit import by_leg
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import KINDS, OBSERVED, Rows
from symkin.estimate.solution import settled, together
from symkin.model.mechanism import Mechanism
from symkin.results import Result
from symkin.values import Array, field, record


@record
class CrossValidation(Result):
    """Errors at poses that the identification did not see.

    Attributes
    ----------
    folds : int
        Number of parts, each predicted from the others.
    blocks : bool
        Whether the parts were blocks of consecutive poses.
    converged : bool
        Whether every identification did.
    residual_rms, residual_max : float
        Closures, m or rad.
    residuals : ndarray, shape (N, legs)
        NaN where a leg does not use the pose, or was not read.
    row_numbers : ndarray of int, shape (N,)
        Where the poses stand in the source.
    evaluation : Evaluation or None
        End-effector errors at the measured readings of all legs, as of `evaluate`; None if no such
        pose can be taken.
    observed_rms : mapping of str to float
        How well each observation of a pose is predicted from the others of that pose, by kind, as
        ``readings_rad`` and ``pose_m``; empty for identification leg by leg.
    closure_unit : {"m", "rad"}
        Of the closures.
    """

    folds: int
    blocks: bool
    converged: bool
    residual_rms: float = field(unit="closure")
    residual_max: float = field(unit="closure")
    residuals: Array = field(private=True)
    row_numbers: NDArray[np.intp] = field(private=True)
    evaluation: Evaluation | None
    observed_rms: Mapping[str, float] = field(default_factory=dict)
    closure_unit: str = field(private=True, default="m")

    @property
    def name(self) -> str:
        """What it is, in words: ``5-fold cross-validation``."""
        return f"{self.folds}-{'block' if self.blocks else 'fold'} cross-validation"

    def columns(self) -> Mapping[str, Any]:
        """Return the closures at unseen poses, a row a pose."""
        legs = {
            f"closure_{leg}_{self.closure_unit}": values
            for leg, values in enumerate(self.residuals.T, 1)
        }
        return {"row": self.row_numbers, **legs}


def cross_validation_of(
    mechanism: Mechanism,
    measurements: Measurements,
    folds: int,
    seed: int,
    options: EstimateOptions,
    *,
    blocks: bool = False,
    legs: bool = False,
) -> CrossValidation:
    """Predict each part of the observations from an identification on the others.

    Each observation of an unseen pose is compared with what the others of that pose predict. What
    fewer rows than parts observe, no part is without. With `legs` these are identified one by one,
    from full poses; with poses "own" each leg's set is dealt by itself then, and a leg is predicted
    at those poses.
    """
    if legs and options.poses == "all":
        measurements = measurements.for_all_legs()
    taken, readings = measurements.poses, measurements.readings
    sets = measurements.leg_sets if legs else np.zeros(len(taken), dtype=np.intp)
    fold_of = folds_of(sets, folds, None if blocks else seed)[measurements.first_of_block]
    fold_of[_rarely_observed(measurements, folds)] = -1
    residuals: Array = np.full(readings.shape, np.nan)
    differences = np.full((len(taken), mechanism.straight.dof), np.nan)
    read = whole(readings)
    own = np.array(taken)
    places = np.array(taken)  # of what was measured, where its place on the platform is its own
    squares: dict[str, list[float]] = {}
    converged = True
    for fold in np.unique(fold_of[fold_of >= 0]).tolist():
        unseen = np.flatnonzero(fold_of == fold)
        part = measurements.subset(np.flatnonzero(fold_of != fold))
        refused = explained(mechanism, part, options, by_leg=legs)
        with without_part(fold, folds), refused:
            found = (by_leg if legs else together)(mechanism, part, options)
        converged &= found.converged
        there = in_last_session(found, measurements)
        if not legs:
            left = settled(found.mechanism, found.noise, there.subset(unseen))
            _add_squares(squares, Rows.of(left.fit()), mechanism)
            own[unseen], arm = own_poses(found.mechanism, there.subset(unseen))
        full = unseen[whole(own[unseen])]
        kept = full[read[full]]
        there = dataclasses.replace(there, poses=own)
        residuals[full] = closures_of(found.mechanism, there.subset(full))
        if len(kept):
            by_origin = pose_differences(found.mechanism, there.subset(kept))
            differences[kept], places[kept] = at_arm(
                by_origin, own[kept], np.zeros(3) if legs else arm, mechanism.space
            )
    for leg in range(len(mechanism.legs) if legs else 0):
        residuals[~np.isin(np.arange(len(taken)), measurements.rows_of(leg)), leg] = np.nan
    known, evaluation = np.isfinite(residuals).any(), None
    complete = whole(own) & read
    if np.isfinite(differences).any():
        evaluation = Evaluation.of(
            differences[complete],
            places[complete],
            mechanism,
            row_numbers=measurements.row_numbers[complete],
        )
    return CrossValidation(
        folds=folds,
        blocks=blocks,
        converged=converged,
        residual_rms=float(np.sqrt(np.nanmean(residuals**2))) if known else float("nan"),
        residual_max=float(np.nanmax(np.abs(residuals))) if known else float("nan"),
        residuals=residuals,
        row_numbers=measurements.row_numbers,
        evaluation=evaluation,
        observed_rms={kind: float(np.sqrt(np.mean(each))) for kind, each in squares.items()},
        closure_unit=mechanism.space.closure_unit,
    )


def _add_squares(squares: dict[str, list[float]], rows: Rows, mechanism: Mechanism) -> None:
    """By kind and unit, of what each observation is off from what the others of its pose say."""
    for row in np.flatnonzero(np.isfinite(rows.blunder)).tolist():
        unit = rows.unit(row, mechanism.pose_space, mechanism.reading_unit)
        kind = f"{KINDS[rows.kind[row]].replace(' ', '_')}_{unit}"
        squares.setdefault(kind, []).append(float(rows.blunder[row]) ** 2)


def _rarely_observed(measurements: Measurements, folds: int) -> NDArray[np.bool_]:
    """Rows with something besides readings that fewer rows than folds have."""
    count = len(measurements.poses)
    rare = np.zeros(count, dtype=bool)
    for name in OBSERVED[1:]:
        values = getattr(measurements, name)
        if values is not None:
            there = np.isfinite(values.reshape(count, -1)).any(axis=1)
            rare |= there & (there.sum() < folds)
    return rare


@contextlib.contextmanager
def without_part(fold: int, folds: int) -> Iterator[None]:
    """Say of an identification that is refused that it was one without a part of the poses."""
    try:
        yield
    except SymkinError as error:
        before = f"in cross-validation, without part {fold + 1} of {folds}: "
        error.args = (f"{before}{error.args[0]}", *error.args[1:])
        raise


def folds_of(sets: NDArray[np.intp], folds: int, seed: int | None) -> NDArray[np.intp]:
    """The part that each row belongs to, dealt set by set; in blocks without a seed."""
    whole = isinstance(folds, SupportsIndex)
    if not whole or not 2 <= folds <= len(sets):
        raise SymkinError(
            f"cross-validation in {folds!r} folds; expected a whole number from 2 to {len(sets)}"
        )
    fold_of = np.empty(len(sets), dtype=np.intp)
    random = np.random.default_rng(seed)
    for number in np.unique(sets):
        rows = np.flatnonzero(sets == number)
        order = np.arange(len(rows))
        fold_of[rows] = (
            order * folds // len(rows) if seed is None else random.permutation(order % folds)
        )
    return fold_of
