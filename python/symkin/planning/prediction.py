# SPDX-License-Identifier: MIT
"""What accuracy a plan promises before anything is measured, and how many poses are enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.errors import SymkinError
from symkin.identification.estimate import Estimator, PoseUse, identify
from symkin.measurements import Measurements
from symkin.mechanism import Mechanism
from symkin.observability import ExpectedAccuracy, RowKind, expected_accuracy
from symkin.planning.designs import Design, design_tasks
from symkin.planning.making import make_plan
from symkin.planning.plan import Plan
from symkin.planning.selection import Criterion

__all__ = ["PoseCountCurve", "pose_count_curve", "predict_accuracy"]

_POINTS = 25  # of a curve
_LARGEST = 10  # times as many poses as parameters
_AVERAGED = 2000  # poses over which the error is averaged


def predict_accuracy(
    mechanism: Mechanism,
    plan: Plan,
    workspace: ArrayLike,
    estimator: Estimator = "implicit",
    *,
    poses: PoseUse = "all",
    measured: Measurements | None = None,
) -> ExpectedAccuracy:
    """Predict the end-effector error after identification with a plan, to first order.

    The covariance is the estimator's at the nominal parameters and the mechanism's declared noise;
    no robot is simulated.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    plan : Plan
        Its spares do not count.
    workspace : array_like, shape (n, coordinates)
        Poses over which the error is averaged.
    estimator, poses
        See `identify`.
    measured : Measurements, optional
        What is measured already and identifies the legs too.

    Returns
    -------
    ExpectedAccuracy

    Raises
    ------
    SymkinError
        If the plan's poses do not show all parameters.
    """
    wanted = ~plan.spare
    parts = [(plan.poses[wanted], plan.readings[wanted], plan.leg_sets[wanted])]
    if measured is not None:
        readings = mechanism.inverse_kinematics(measured.poses)
        readings[~np.isfinite(measured.readings)] = np.nan
        parts.append((measured.poses, readings, measured.leg_sets))
    exact = Measurements.of(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    covariance = identify(mechanism, exact, estimator, poses=poses).covariance
    if not np.isfinite(covariance).all():
        raise SymkinError("the plan's poses do not show all parameters")
    return expected_accuracy(mechanism, workspace, covariance)


@dataclass(frozen=True)
class PoseCountCurve:
    """What more poses bring.

    Attributes
    ----------
    counts : ndarray of int, shape (k,)
        Poses that each leg is identified from, ascending.
    measured : ndarray of int, shape (k,)
        Poses to measure in all.
    position : ndarray, shape (k,)
        Expected root mean square position error, m.
    orientation : ndarray, shape (k,)
        The same of the orientation, rad.
    efficiency : ndarray, shape (k,)
        Of the selection's determinant against the bound for distinct poses, the least of all legs'.
    least_gain : float
        Another pose is worth while if it makes the position error smaller by this share.
    enough : int or None
        The first count from which on another pose is not; None if all are.
    """

    counts: NDArray[np.intp]
    measured: NDArray[np.intp]
    position: NDArray[np.float64]
    orientation: NDArray[np.float64]
    efficiency: NDArray[np.float64]
    least_gain: float
    enough: int | None


def pose_count_curve(
    mechanism: Mechanism,
    candidates: ArrayLike,
    counts: Sequence[int] | None = None,
    seed: int | None = None,
    *,
    design: Design = "legs",
    rows: RowKind = "noise_aware",
    criterion: Criterion = "O1",
    estimator: Estimator = "implicit",
    poses: PoseUse = "all",
    least_gain: float = 0.02,
) -> PoseCountCurve:
    """Predict the accuracy that different numbers of poses give.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    candidates : array_like, shape (n, coordinates)
        Poses to choose from, over which the error is averaged too.
    counts : sequence of int, optional
        Numbers of poses, by default 25 from the number p of a leg's parameters to 10 p.
    seed : int, optional
        By default the protocol's.
    design, rows, criterion
        See `make_plan`.
    estimator, poses
        See `identify`.
    least_gain : float
        Share of the position error that another pose must save to be worth while.

    Returns
    -------
    PoseCountCurve

    Raises
    ------
    SymkinError
        As `make_plan` does.
    """
    if not 0 < least_gain < 1:
        raise SymkinError(f"the least gain is {least_gain:g}; expected a share between 0 and 1")
    cloud = np.atleast_2d(np.ascontiguousarray(candidates, dtype=np.float64))
    workspace = cloud[:: -(-len(cloud) // _AVERAGED)]
    numbers = _counts(mechanism, design, counts)
    points = []
    for count in numbers:
        plan = make_plan(
            mechanism,
            cloud,
            count,
            seed,
            design=design,
            rows=rows,
            criterion=criterion,
            spares=0,
        )
        accuracy = predict_accuracy(mechanism, plan, workspace, estimator, poses=poses)
        choices = plan.basis.choices if plan.basis else ()
        efficiency = min(choice.selection.certificate.o1_efficiency for choice in choices)
        points.append((len(plan.poses), accuracy.position, accuracy.orientation, efficiency))
    measured, position, orientation, efficiency = np.array(points).T
    return PoseCountCurve(
        counts=np.array(numbers, dtype=np.intp),
        measured=measured.astype(np.intp),
        position=position,
        orientation=orientation,
        efficiency=efficiency,
        least_gain=least_gain,
        enough=_enough(numbers, position, least_gain),
    )


def _counts(mechanism: Mechanism, design: Design, counts: Sequence[int] | None) -> list[int]:
    """Counts to try, ascending, as whole orbits."""
    p = len(mechanism.parameter_names)
    if counts is None:
        counts = np.rint(np.geomspace(p, _LARGEST * p, _POINTS)).astype(int).tolist()
    (task, *_) = design_tasks(mechanism, design, use_symmetry=True)
    size = len(task.elements) if task.is_orbit else 1
    return sorted({-(-count // size) * size for count in counts})


def _enough(counts: Sequence[int], errors: NDArray[np.float64], least_gain: float) -> int | None:
    """First count from which on no further pose saves `least_gain` of the error."""
    best = np.minimum.accumulate(errors)  # a selection may be a little worse than one of fewer
    saved = 1 - (best[1:] / best[:-1]) ** (1 / np.diff(counts))
    worth_while = np.flatnonzero(saved >= least_gain)
    first = int(worth_while[-1]) + 1 if worth_while.size else 0
    return counts[first] if first < len(saved) else None
