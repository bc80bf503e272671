# SPDX-License-Identifier: MIT
"""What accuracy a plan promises before anything is measured."""

from __future__ import annotations

from typing import Any, Protocol, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.analysis.observability import expected_accuracy
from symkin.analysis.observed import Observing
from symkin.analysis.promises import ExpectedAccuracy, require_determined
from symkin.analysis.workspace import WorkspaceSample
from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.errors import SymkinError, one_of
from symkin.estimate.assumed import with_assumed
from symkin.estimate.fit import identified_by_leg
from symkin.estimate.options import EstimateOptions, Estimator, PoseUse, Unknowns
from symkin.estimate.survey import Survey, coordinates_of
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.options import checks
from symkin.planning.basis import PlanBasis
from symkin.planning.made import poses_taken
from symkin.values import Array

__all__ = ["predict_accuracy", "set_name"]


class PlannedPoses(Protocol):
    """What of a plan its accuracy depends on."""

    @property
    def poses(self) -> Array: ...
    @property
    def readings(self) -> Array: ...
    @property
    def leg_sets(self) -> NDArray[np.intp]: ...
    @property
    def spare(self) -> NDArray[np.bool_]: ...
    @property
    def basis(self) -> PlanBasis | None: ...


@checks()
def predict_accuracy(
    mechanism: MechanismGiven,
    plan: PlannedPoses,
    workspace: ArrayLike | WorkspaceSample,
    estimator: Estimator | None = None,
    *,
    poses: PoseUse = "all",
    measured: Measurements | None = None,
    confidence: float = 0.95,
    anywhere: ArrayLike | WorkspaceSample | None = None,
    observe: Observing | None = None,
    **unknowns: Unpack[Unknowns],
) -> ExpectedAccuracy:
    """Predict the end-effector error after identification with a plan, to first order.

    The covariance is the estimator's at the nominal parameters and the mechanism's declared noise,
    at the poses that robots made within the tolerances take when they are told the plan's: a few
    robots, always the same ones, over which the figures are. No measurement is simulated.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one.
    plan : Plan
        Its spares do not count.
    workspace : WorkspaceSample, or array_like of shape (n, coordinates)
        Poses over which the error is averaged.
    estimator, poses
        See `identify`; by default "implicit", and "joint" with what follows.
    measured : Measurements, optional
        What is measured already and identifies the legs too.
    confidence : float
        Share of such robots that keep the bounds.
    anywhere : WorkspaceSample, or array_like of shape (n, coordinates), optional
        Poses over which the largest error is bounded too, at most 4000 of them; it takes some
        tenths of a second.
    observe, **unknowns
        What will be observed and what is unknown, see `make_plan`; by default what the plan was
        made for. What is held has no error but what `assume` declares, and priors count. The error
        is that of the target in the device's frame, at given readings: without frames, of the
        platform in the robot's own.

    Raises
    ------
    NotIdentifiableError
        If the plan's poses and the priors do not show all unknowns; names the combination.
    SymkinError
        If the plan's poses do not show all parameters, or for an estimator that cannot know what is
        observed or unknown.
    """
    mechanism = as_mechanism(mechanism)
    require_determined(mechanism)
    made_for = None if plan.basis is None else plan.basis.survey
    said = observe is not None or any(each is not None for each in unknowns.values())
    if made_for is not None and not said:
        survey = Survey.of(mechanism, plan.poses, made_for.observed, made_for.asked)
    else:
        survey = Survey.of(mechanism, plan.poses, observe, unknowns)
    if survey is not None:
        require_joint(estimator)
        survey = survey.in_order(plan.poses[~plan.spare])
        survey = survey_assuming(survey, plan, poses=poses, measured=measured)
        known = _surveyed(mechanism, survey, plan, poses, measured)
        asked: dict[str, Any] = {"confidence": confidence, "anywhere": anywhere}
        return survey.expected(workspace, known, of=coordinates_of(mechanism), **asked)
    known = _leg_by_leg(mechanism, plan, EstimateOptions(estimator or "implicit", poses), measured)
    if not np.isfinite(known).all():
        raise SymkinError("the plan's poses do not show all parameters")
    return expected_accuracy(mechanism, workspace, known, confidence=confidence, anywhere=anywhere)


def _surveyed(
    mechanism: Mechanism,
    survey: Survey,
    plan: PlannedPoses,
    poses: PoseUse,
    measured: Measurements | None,
) -> Array:
    """Covariances of the unknowns and of what is assumed, of robots from the workshop."""
    rows = survey_rows(survey, plan, poses=poses, measured=measured)
    told, read = _poses_of(plan, poses)
    taken = (survey.rows(each, read) for each in poses_taken(mechanism, told))
    return np.stack(
        [with_assumed(each, survey.assumed) for each in survey.covariances(rows, taken)]
    )


def _leg_by_leg(
    mechanism: Mechanism, plan: PlannedPoses, how: EstimateOptions, measured: Measurements | None
) -> Array:
    """Covariances of all parameters, of robots from the workshop."""
    wanted = ~plan.spare
    told, sets = plan.poses[wanted], plan.leg_sets[wanted]
    further, read = np.empty((0, told.shape[1])), np.empty((0, plan.readings.shape[1]))
    if measured is not None:
        measured.require_complete()
        further, sets = measured.poses, np.concatenate([sets, measured.leg_sets])
        read = mechanism.inverse_kinematics(further)
        read[~np.isfinite(measured.readings)] = np.nan

    def known_at(poses: Array) -> Array:
        readings = np.concatenate([mechanism.inverse_kinematics(poses), read])
        every = np.concatenate([poses, further])
        exact = Measurements.of(every, readings, sets, pose_space=mechanism.pose_space)
        return np.asarray(identified_by_leg(mechanism, exact, how).covariance)

    known_at(told)  # what they do not show, a robot that is elsewhere does by chance
    return np.stack([known_at(each) for each in poses_taken(mechanism, told)])


def require_joint(estimator: Estimator | None) -> None:
    if estimator is not None and one_of("estimator", estimator, Estimator) != "joint":
        raise SymkinError(
            f'the estimator "{estimator}" looks at each leg by itself, from full poses; expected '
            '"joint" for what is observed or unknown otherwise'
        )


def set_name(leg: int) -> str:
    """Name the set of a leg (from 0), or of all (-1), as people count."""
    return "all legs" if leg == ALL_LEGS else f"leg {leg + 1}"


def survey_rows(
    survey: Survey,
    plan: PlannedPoses,
    *,
    poses: PoseUse = "all",
    measured: Measurements | None = None,
) -> list[Array]:
    """Rows of a survey that a plan's poses and what is measured bring, see `predict_accuracy`."""
    rows = [survey.rows(*_poses_of(plan, poses))]
    if not np.isfinite(rows[0]).all():
        raise SymkinError("a pose of the plan is out of the nominal robot's reach")
    return rows if measured is None else [*rows, survey.measured_rows(measured)]


def survey_assuming(
    survey: Survey,
    plan: PlannedPoses,
    *,
    poses: PoseUse = "all",
    measured: Measurements | None = None,
) -> Survey:
    """A survey with what was declared of what it holds, see `Survey.assuming`."""
    return survey.assuming(*_poses_of(plan, poses), measured)


def _poses_of(plan: PlannedPoses, poses: PoseUse) -> tuple[Array, NDArray[np.bool_] | None]:
    """Poses that are wanted, and which readings are taken there; None if all are."""
    wanted = ~plan.spare
    sets = plan.leg_sets[wanted, None]
    own = (sets == ALL_LEGS) | (sets == np.arange(plan.readings.shape[1]))
    return plan.poses[wanted], own if poses == "own" else None
