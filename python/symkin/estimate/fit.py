# SPDX-License-Identifier: MIT
"""Estimates from the closures of full poses, and the mechanisms that estimates describe."""

from __future__ import annotations

import numpy as np

from symkin import _core
from symkin.analysis.checks import undefined_angles
from symkin.analysis.homes import with_usable_home
from symkin.analysis.observability import with_combinations
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, MechanismError, NotIdentifiableError, SymkinError
from symkin.estimate.conflict import DrawingConflict, after_priors, conflict_of
from symkin.estimate.found import Found, GoodnessOfFit, LegFit
from symkin.estimate.options import EstimateOptions, PoseUse
from symkin.estimate.parameters import unknowns_of
from symkin.estimate.problem import layout_of
from symkin.model.canonical import canonical
from symkin.model.core_setup import core_setup, scalar_values
from symkin.model.file_frames import with_correlations, with_moved_workspace
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import noise_of, parameter_tolerances
from symkin.values import Array

# Share of sound robots that one kind of test doubts, such as that of all parameters' distances.
FALSE_ALARMS = 1e-3

_FARTHEST = 1e12  # m and rad, which no file may hold either
LOOK_FOR = (  # where no cause is found
    "look for readings in another unit, of another leg, or with another sign, zero or working mode "
    "than the mechanism has, and for poses in another unit or frame"
)


def by_leg(mechanism: Mechanism, measurements: Measurements, options: EstimateOptions) -> Found:
    """Estimate all parameters from the closures of full poses in the robot's own frame.

    The errors are those of `identify`.
    """
    result = identified_by_leg(mechanism, measurements, options)
    noise = options.declared(mechanism.noise)
    calibrated, covariance = calibrated_mechanism(
        mechanism, result.parameters, result.covariance, measurements.poses
    )
    if result.converged:
        _require_deviations(mechanism, calibrated)
    alone, found = mechanism, calibrated
    if mechanism.frames is not None:
        alone, found = (each.replace(frames=None) for each in (alone, found))
    legs, count = mechanism.parameters.shape
    nothing = np.zeros((0, legs))  # readings matter to the tolerance of a quadratic term alone
    layout = layout_of(alone, core_setup(alone), EstimateOptions(), nothing)
    values = scalar_values(core_setup(found))
    deviations = np.full(len(values), np.nan)
    if calibrated.deviations is not None:
        deviations[: legs * (count + 3)].reshape(legs, -1)[:, :count] = calibrated.deviations
    fits = tuple(map(_leg_fit, result.legs))
    return Found(
        mechanism=calibrated,
        nominal=mechanism,
        measurements=measurements,
        options=options,
        noise=noise,
        unknowns=unknowns_of(alone, layout, values, deviations, deviations, np.zeros((0, 0))),
        names=layout.names,
        covariance=covariance,
        goodness=tuple(map(GoodnessOfFit.of, result.goodness)),
        converged=result.converged,
        failure=_failure(result),
        iterations=max(leg.iterations for leg in fits),
        rank=len(layout.names),
        data_rank=len(layout.names),
        unseen_directions=np.zeros((len(layout.names), 0)),
        legs=fits,
        rejected=tuple(
            (row, f"closure of leg {number}")
            for number, leg in enumerate(fits, 1)
            for row in leg.rejected.tolist()
        ),
        student_degrees=min(leg.student_degrees for leg in fits),
        unguarded=tuple(sorted({row for leg in fits for row in leg.unguarded})),
        model_covariance=covariance,
        conflict=_conflict(mechanism, calibrated, covariance) if result.converged else None,
    )


def identified_by_leg(
    mechanism: Mechanism, measurements: Measurements, options: EstimateOptions
) -> _core.Identification:
    """What the core says of `by_leg`."""
    _require_poses(mechanism, measurements, options.poses)
    try:
        return _core.identify(
            mechanism.core,
            core_measurements(measurements),
            _core.Estimator.__members__[options.estimator],
            _core.PoseUse.__members__[options.poses],
            noise_of(options.declared(mechanism.noise)),
            options.loss,
            options.loss_scale or 0.0,
            options.max_iterations,
        )
    except NotIdentifiableError as error:
        raise _named(error, mechanism) from None
    except FailedFitError as error:
        raise _no_mechanism(error) from None


def _no_mechanism(why: SymkinError) -> FailedFitError:
    return FailedFitError(f"the estimate is no mechanism: {why}. {LOOK_FOR.capitalize()}")


def _conflict(
    mechanism: Mechanism, calibrated: Mechanism, covariance: Array
) -> DrawingConflict | None:
    """Of parameters that were estimated without priors."""
    own = mechanism.is_estimated
    change = (calibrated.parameters - mechanism.parameters)[own]
    tolerances = parameter_tolerances(mechanism)[own]
    if not np.isfinite(covariance).all():
        return None
    nothing = np.full(len(change), np.inf)
    return conflict_of(*after_priors(change, covariance, nothing, tolerances))


def _failure(result: _core.Identification) -> str:
    """Which legs' estimators did not converge, and why; empty if all did."""
    if result.converged:
        return ""
    failures = [
        f"leg {number}" + (f" ({leg.failure})" if leg.failure else "")
        for number, leg in enumerate(result.legs, 1)
        if not leg.converged
    ]
    return ", ".join(failures) or "the joint estimate of all legs"


def core_measurements(measurements: Measurements) -> _core.MeasurementSet:
    """Measurements as the core takes them."""
    return _core.MeasurementSet(
        measurements.poses,
        measurements.readings,
        measurements.leg_sets.astype(np.int64, copy=False),
    )


def _require_poses(mechanism: Mechanism, measurements: Measurements, poses: PoseUse) -> None:
    measurements.require_legs(len(mechanism.legs))
    measurements.require_complete()
    used = measurements.for_all_legs() if poses == "all" else measurements
    unmeasured = sorted(set(range(len(mechanism.legs))) - set(used.measured_legs))
    if unmeasured:
        whose = "its" if len(unmeasured) == 1 else "their"
        raise NotIdentifiableError(
            f"{measurements.origin}no readings of {mechanism.named_legs(unmeasured)}: {whose} "
            "parameters cannot be identified"
        )
    used.require([-(-count // mechanism.closures) for count in mechanism.estimated_counts])


def _require_deviations(mechanism: Mechanism, calibrated: Mechanism) -> None:
    found = np.isfinite(np.asarray(calibrated.deviations))
    unknown = np.argwhere(mechanism.is_estimated & ~found)
    if len(unknown):
        leg, parameter = unknown[0]
        raise NotIdentifiableError(
            f"leg {leg + 1}: {calibrated.parameter_names[parameter]} has no finite standard "
            "deviation: the measurements do not determine it"
        )


def _named(error: NotIdentifiableError, mechanism: Mechanism) -> NotIdentifiableError:
    """The error with the combinations of parameters, in tolerances, that nothing shows."""
    names, scales = mechanism.parameter_names, parameter_tolerances(mechanism)
    own = _columns(mechanism, len(error.null_directions))
    alone = {leg for leg, _ in own} == {0}
    called = [names[i] if alone else f"{names[i]} of leg {leg + 1}" for leg, i in own]
    scale = [scales[:, i].max() if alone else scales[leg, i] for leg, i in own]
    named = with_combinations(error, called, np.array(scale)) if own else error
    causes = [
        each for leg in range(len(mechanism.legs)) for each in undefined_angles(mechanism, leg)
    ]
    return NotIdentifiableError("; ".join([str(named), *causes]))


def _columns(mechanism: Mechanism, count: int) -> list[tuple[int, int]]:
    """Leg and parameter of so many columns; of one leg's, leg 1 stands for all.

    They are those of one leg or of all together, and all of them or those that are estimated.
    """
    everything = np.ones_like(mechanism.is_estimated)
    for columns in (everything, mechanism.is_estimated):
        for legs in (1, len(mechanism.legs)):
            own = np.argwhere(columns[:legs])
            if len(own) == count:
                return [(leg, i) for leg, i in own.tolist()]
    return []


def _leg_fit(leg: _core.LegIdentification) -> LegFit:
    return LegFit(
        converged=leg.converged,
        failure=leg.failure,
        iterations=leg.iterations,
        rows=np.array(leg.rows, dtype=np.intp),
        rejected=np.array(leg.rejected, dtype=np.intp),
        residuals=leg.residuals,
        standardised=leg.standardised,
        condition=leg.condition,
        student_degrees=leg.student_degrees,
        unguarded=tuple(leg.unguarded),
    )


def calibrated_mechanism(
    nominal: Mechanism, parameters: Array, covariance: Array, poses: Array
) -> tuple[Mechanism, Array]:
    """Return the mechanism that an estimate describes, and the covariance of its parameters.

    Points are given by radii that are not negative and angles near the nominal ones; where a radius
    changes its sign, its covariances do, which are those of what is estimated. Where the frames of
    the measurements are others than the nominal ones, home and the workspace's box move with them;
    see also `with_usable_home`.
    """
    values, signs = canonical(nominal, parameters)
    covariance = covariance * np.outer(signs, signs)
    made = as_mechanism(nominal, values, np.sqrt(np.diag(covariance)).reshape(values.shape))
    made = with_correlations(made, covariance)
    own = np.flatnonzero(nominal.is_estimated)
    made = with_usable_home(with_moved_workspace(nominal, made), poses)
    return made, covariance[np.ix_(own, own)]


def as_mechanism(nominal: Mechanism, values: Array, deviations: Array) -> Mechanism:
    """Return the mechanism with parameters (legs, p) that were found, without its symmetry.

    What is held has no standard deviation.

    Raises
    ------
    FailedFitError
        If no mechanism has such parameters.
    """
    far = np.argwhere(~(np.abs(values) < _FARTHEST))
    if len(far):
        leg, parameter = far[0]
        raise FailedFitError(
            f"the estimate ran away: leg {leg + 1}, {nominal.parameter_names[parameter]} = "
            f"{values[leg, parameter]:.3g}; {LOOK_FOR}"
        )
    legs = range(len(nominal.legs))
    given = np.array([[role.is_given for role in nominal.parameter_roles(leg)] for leg in legs])
    known = nominal.is_estimated | (given & (deviations > 0))  # given, but freed
    deviations = np.where(known, deviations, np.nan)
    try:
        made = nominal.with_parameters(values, deviations, symmetry=None)
    except MechanismError as error:
        raise _no_mechanism(error) from error
    return with_correlations(made, None)


def changed_settings(nominal: Mechanism, calibrated: Mechanism) -> list[str]:
    """Say in sentences what was changed besides the parameters, and why."""
    before, after = nominal.workspace, calibrated.workspace
    changes = []
    if before is not None and after is None:
        changes.append("The workspace is left out, since the legs found reach no measured pose.")
    elif before is not None and after is not None and after != before:
        if (after.lower, after.upper) == (before.lower, before.upper):
            changes.append("Home is a measured pose, since the legs found do not suit the old one.")
        else:
            changes.append("Home and workspace are moved, as the frames are not the nominal ones.")
    if calibrated.joint_limits != nominal.joint_limits:
        changes.append("The joint limits are left out, since the zeros found do not suit them.")
    return changes
