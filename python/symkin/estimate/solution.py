# SPDX-License-Identifier: MIT
"""The estimate of everything together, and the mechanism that it describes."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from symkin import _core
from symkin.analysis.homes import with_usable_home
from symkin.analysis.observability import name_combination
from symkin.data.measurements import Measurements
from symkin.errors import FailedFitError, SymkinError, SymmetryError
from symkin.estimate.assumed import assumed_of, widened
from symkin.estimate.blunders import without_blunders
from symkin.estimate.conflict import (
    LIMIT,
    DrawingConflict,
    after_priors,
    conflict_of,
    widened_by,
)
from symkin.estimate.fit import as_mechanism
from symkin.estimate.found import Found, GoodnessOfFit, Latent
from symkin.estimate.noise import estimated_noise, noise_of_sessions
from symkin.estimate.options import EstimateOptions
from symkin.estimate.parameters import unknowns_of
from symkin.estimate.problem import KINDS, Problem, Rows, says_nothing
from symkin.model.canonical import canonical
from symkin.model.core_setup import frames_of, scalar_values
from symkin.model.file_frames import with_correlations
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.model.symmetry import verify_declared
from symkin.values import Array


def together(
    mechanism: Mechanism,
    measurements: Measurements,
    options: EstimateOptions,
    most: int | None = None,
) -> Found:
    """Estimate whatever is unknown from whatever was observed; the errors are `identify`'s.

    Of single observations that do not fit `most` are looked for, if that is said.
    """
    problem, fit, gauge = Problem.of(mechanism, measurements, options).resolved()
    rejected: tuple[tuple[int, str], ...] = ()
    if options.loss_per == "reading":
        problem, fit, rejected = without_blunders(problem, fit, most)
    if options.noise == "estimate":
        problem, fit = estimated_noise(problem, fit)
        problem, fit = problem.with_fitted_prior(fit)
    session_noise: tuple[float, ...] = ()
    if "noise" in options.sessions:
        problem, fit, session_noise = noise_of_sessions(problem, fit)
        problem, fit = problem.with_fitted_prior(fit)
        measurements = problem.measurements
    taken = Rows.of(fit).kind  # none where no pose could be explained
    if fit.converged and len(taken) and not any(fit.conditions):
        raise says_nothing(KINDS[kind] for kind in taken)
    known, assumed = _Known.of(problem, fit), assumed_of(problem, fit)
    total = widened(known.covariance, assumed)
    if problem.fitted_prior is not None:
        total = total + problem.fitted_prior.spread
    values, deviations, signs, calibrated = _calibrated(mechanism, problem, fit, total)
    with np.errstate(invalid="ignore"):
        declared = np.append(np.sqrt(np.diag(known.model)), np.nan)[problem.layout.column]
    unseen, layout = np.asarray(fit.unseen) * signs[:, None], problem.layout
    mirrored = np.outer(signs, signs)
    every, prior = tuple(range(len(mechanism.legs))), problem.fitted_prior
    conditions = np.array(fit.conditions, dtype=np.intp)
    return Found(
        mechanism=calibrated,
        nominal=mechanism,
        measurements=measurements,
        options=options,
        noise=problem.noise,
        unknowns=unknowns_of(mechanism, layout, values, deviations, declared, unseen),
        names=layout.names,
        covariance=total * mirrored,
        goodness=(replace(GoodnessOfFit.of(fit.goodness), legs=every),),
        converged=fit.converged,
        failure=fit.failure or ("" if fit.converged else "the solver made no more progress"),
        iterations=fit.iterations,
        rank=fit.rank,
        data_rank=fit.data_rank,
        unseen=tuple(name_combination(each, layout.names) for each in unseen.T),
        unseen_directions=unseen,
        gauge=gauge,
        latent=Latent(fit.poses, fit.reading_errors, conditions, Rows.of(fit)),
        rejected=rejected,
        aside=tuple(fit.aside),
        student_degrees=fit.student_degrees,
        unguarded=tuple(fit.unguarded),
        model_covariance=known.model * mirrored,
        conflict=known.conflict,
        noise_factor=known.noise_factor,
        conflict_factor=known.conflict_factor,
        assumed=tuple(replace(each, moves=each.moves * signs) for each in assumed),
        session_noise=session_noise,
        relations=layout.relations * signs,
        fitted_prior=None if prior is None else prior.signed(layout.names, signs),
    )


class _Known(NamedTuple):
    """How far the unknowns are known: as declared, and as residuals and drawing say."""

    model: Array
    covariance: Array
    conflict: DrawingConflict | None
    noise_factor: float
    conflict_factor: float

    @classmethod
    def of(cls, problem: Problem, fit: _core.JointFit) -> _Known:
        """Of a fit: noise by its factor, what priors say by the larger of both."""
        layout = problem.layout
        has_loss, model = problem.has_loss(fit), problem.covariance_of(fit)
        noise = 1.0
        if not has_loss and fit.goodness.chi_square > fit.goodness.limit:
            noise = fit.goodness.chi_square / fit.goodness.degrees_of_freedom
        told = held = None
        if fit.converged and not fit.gauge_directions:
            # What priors leave of the way from the drawing a loss hardly changes, whatever it says
            # of how well that is known.
            declared = fit.model_covariance
            held = conflict_of(fit.change, declared, layout.prior, layout.relations)
            known = declared * noise if held is None else declared
            told = conflict_of(
                *after_priors(fit.change, known, layout.prior, layout.column_tolerances),
                layout.relations,
            )
        factor = held.variance_factor if held else 1.0
        known = widened_by(model, layout.prior_rows, noise, factor)
        return cls(model, known, told, noise, factor)


def settled(robot: Mechanism, noise: NoiseSettings, measurements: Measurements) -> Problem:
    """Observations of a calibrated robot, of which only the poses are unknown."""
    held = EstimateOptions(free=("leg1.sensor_offset",), prior={"leg1.sensor_offset": _HELD})
    return Problem.of(robot.replace(identification=None, noise=noise), measurements, held)


def computed_from_drawing(found: Found) -> bool:
    """Whether the drawing itself explains the observations better than noise would let it."""
    drawn = found.nominal.replace(frames=None if found.legs else found.mechanism.frames)
    try:
        fit = settled(drawn, found.noise, found.measurements).fit()
    except SymkinError:
        return False
    conditions = int(np.sum(fit.conditions))
    if not fit.converged or not conditions or fit.aside:
        return False
    return 1 - _core.chi_square_tail(fit.chi_square_data, conditions) < LIMIT


def _calibrated(
    nominal: Mechanism, problem: Problem, fit: _core.JointFit, known: Array
) -> tuple[Array, Array, Array, Mechanism]:
    """Values and deviations of all scalars, signs of the columns, and the mechanism."""
    setup, layout = fit.setup, problem.layout
    values = scalar_values(setup)
    by = layout.by_columns
    with np.errstate(invalid="ignore"):
        deviations = np.sqrt(np.einsum("ij,jk,ik->i", by, known, by))
    deviations[~by.any(axis=1)] = np.nan
    legs, count = len(nominal.legs), len(nominal.parameter_names)
    parameters, signs = canonical(nominal, setup.parameters)
    by_leg = deviations[: legs * (count + 3)].reshape(legs, count + 3)
    by_value = values[: legs * (count + 3)].reshape(legs, count + 3)
    by_value[:, :count] = parameters
    made = as_mechanism(nominal.replace(curvature=None), parameters, by_leg[:, :count])
    of_legs = by[: legs * (count + 3)].reshape(legs, count + 3, -1)[:, :count]
    of_legs = of_legs.reshape(legs * count, -1)
    made = with_correlations(made, of_legs @ known @ of_legs.T * np.outer(signs, signs))
    made = _with_symmetry(made, nominal)
    latent = fit.poses[np.isfinite(fit.poses).all(axis=1)]
    if not len(latent):
        raise FailedFitError("no measured pose could be explained at all: see units, order, signs")
    made = with_usable_home(made, latent)
    with_frames = nominal.frames is not None or any(
        name.startswith(("base.", "target.", "point", "anchor", "plane.")) for name in layout.names
    )
    flipped = np.ones(len(values))
    flipped[: by_value.size].reshape(by_value.shape)[:, :count] = signs.reshape(legs, count)
    return (
        values,
        deviations,
        np.array([flipped[layout.members(column)[0]] for column in range(len(layout.names))]),
        made.replace(
            frames=frames_of(nominal, setup) if with_frames else None,
            curvature=setup.curvature,
            noise=problem.noise,
        ),
    )


def _with_symmetry(made: Mechanism, nominal: Mechanism) -> Mechanism:
    """Keep the declared symmetry where the estimate still has it."""
    if nominal.symmetry is None:
        return made
    declared = made.replace(symmetry=nominal.symmetry)
    try:
        verify_declared(declared)
    except SymmetryError:
        return made
    return declared


_HELD = 1e-12  # m or rad: a prior that is as good as none of it being free
