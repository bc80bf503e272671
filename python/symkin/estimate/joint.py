# SPDX-License-Identifier: MIT
"""Maximum likelihood of whatever is unknown, from whatever was observed."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, Self, cast, get_args

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.evaluation import Evaluation, closures_of, evaluate
from symkin.analysis.observability import name_combination
from symkin.data.columns import pose_column_names
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.corrections import Hypothesis, explained, hypotheses_of
from symkin.estimate.cross_validation import CrossValidation, joint_cross_validation
from symkin.estimate.doubts import contradiction_of, doubts_of, notes_of, symptoms_of
from symkin.estimate.fit import FALSE_ALARMS, M, changed_settings
from symkin.estimate.precision import (
    Correlation,
    Direction,
    Expected,
    Heights,
    Influence,
    correlations_of,
    directions_of,
    heights_of,
)
from symkin.estimate.problem import UNSEEN, JointOptions, Problem, Rows, observed_count
from symkin.estimate.reading_checks import Taken, lost_turns, other_modes
from symkin.estimate.solution import settled, solved
from symkin.estimate.unknowns import CONSTANT, REDUNDANT, Layout, Status, Unknown
from symkin.estimate.wider_models import Alternative, Model, alternatives_of, model_of, models_of
from symkin.files.mechanism_writer import save_mechanism
from symkin.model.core_setup import core_setup, scalar_values
from symkin.model.file_frames import as_drawn
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Frames, NoiseSettings
from symkin.results import FolderResult
from symkin.storage.tables import write_table
from symkin.values import field, plain, record

__all__ = ["JointIdentification"]

Array = NDArray[np.float64]

# A deviation beyond this share of the prior's says that the data told next to nothing, and one
# beyond the other that they told less than the prior did, or not much more.
_SILENT = 0.9
_SHOWN = 0.5


@record
class JointIdentification(FolderResult, Generic[M]):
    """What observations of any kind say of the unknowns, and how far that can be trusted.

    Attributes
    ----------
    mechanism : Mechanism
        The calibrated one, with its frames, and the standard deviations of what was estimated.
    unknowns : tuple of Unknown
        Every scalar of the legs, and of the frames that there are.
    names : tuple of str
        Of the columns that were estimated.
    covariance : ndarray, shape (columns, columns)
        Of these; scaled up, but for the priors' share, where the residuals are larger than the
        declared noise explains. With a loss it follows the residuals that the loss keeps.
    chi_square, degrees_of_freedom : float, int
        Of all observations and priors.
    limit, least : float
        What chi-square exceeds, and falls short of, in one of 1000 sound robots.
    conditions : ndarray of int, shape (N,)
        How many equations each pose brings.
    rank, data_rank : int
        Of observations and priors, and of observations alone.
    unseen : tuple of str
        Combinations of unknowns, in tolerances, that the observations alone do not show.
    unseen_directions : ndarray, shape (columns, columns - data_rank)
        The same in numbers.
    gauge : str
        How these were settled; empty if there are none.
    latent_poses : ndarray, shape (N, coordinates)
        Where the platform was, in the robot's own frame; NaN where no start was found.
    reading_errors : ndarray, shape (N, legs)
        True less read, in the sensor's unit.
    rows : Rows
        Of the single observations.
    rejected : tuple of (int, str)
        Rows of the measurements, from 0, and what of them was left out as a blunder.
    aside : tuple of int
        Rows, from 0, that no latent pose was found for.
    converged : bool
        Whether it did, and
    failure : str
        why not.
    iterations : int
        Steps of the solver.
    noise : NoiseSettings
        Declared, or estimated if that was asked for.
    nominal : Mechanism
        From which it started.
    measurements : Measurements
        What was observed.
    options : JointOptions
        How.
    cross_validation : CrossValidation or None
        If it was asked for, see `cross_validated`.
    student_degrees : float
        Of Student's t, which errors over their standard deviations follow; infinite without a loss.
    unguarded : tuple of int
        Rows, from 0, at which the robust loss would not see a gross error.
    """

    mechanism: M = field(private=True)
    unknowns: tuple[Unknown, ...]
    names: tuple[str, ...]
    covariance: Array
    chi_square: float
    degrees_of_freedom: float
    limit: float
    least: float
    conditions: NDArray[np.intp] = field(private=True)
    rank: int
    data_rank: int
    unseen: tuple[str, ...]
    unseen_directions: Array = field(private=True)
    gauge: str
    latent_poses: Array = field(private=True)
    reading_errors: Array = field(private=True)
    rows: Rows = field(private=True)
    rejected: tuple[tuple[int, str], ...] = field(private=True)
    aside: tuple[int, ...] = field(private=True)
    converged: bool
    failure: str
    iterations: int
    noise: NoiseSettings
    nominal: M = field(private=True)
    measurements: Measurements = field(private=True)
    options: JointOptions = field(private=True)
    cross_validation: CrossValidation | None = field(private=True, default=None)
    student_degrees: float = field(private=True, default=math.inf)
    unguarded: tuple[int, ...] = field(private=True, default=())

    FILES: ClassVar[tuple[str, ...]] = (
        "calibrated.toml",
        "results.json",
        "latent_poses.csv",
        "residuals.csv",
        "report.html",
    )

    @classmethod
    def of(
        cls, mechanism: Mechanism, measurements: Measurements, options: JointOptions
    ) -> JointIdentification:
        """Estimate what is unknown; the arguments and errors are those of `identify`."""
        with explained(mechanism, measurements, options):
            return cls._of(mechanism, measurements, options)

    @classmethod
    def _of(
        cls, mechanism: Mechanism, measurements: Measurements, options: JointOptions
    ) -> JointIdentification:
        solution = solved(mechanism, measurements, options)
        problem, fit = solution.problem, solution.fit
        unseen = np.asarray(fit.unseen)
        found = cls(
            mechanism=cast("M", solution.mechanism),  # of the class of the nominal one
            unknowns=_unknowns(mechanism, problem, fit, solution.values, solution.deviations),
            names=problem.layout.names,
            covariance=fit.covariance,
            chi_square=fit.goodness.chi_square,
            degrees_of_freedom=fit.goodness.degrees_of_freedom,
            limit=fit.goodness.limit,
            least=fit.goodness.least,
            conditions=np.array(fit.conditions, dtype=np.intp),
            rank=fit.rank,
            data_rank=fit.data_rank,
            unseen=tuple(name_combination(each, problem.layout.names) for each in unseen.T),
            unseen_directions=unseen,
            gauge=solution.gauge,
            latent_poses=fit.poses,
            reading_errors=fit.reading_errors,
            rows=Rows.of(fit),
            rejected=solution.rejected,
            aside=tuple(fit.aside),
            converged=fit.converged,
            failure=fit.failure or ("" if fit.converged else "the solver made no more progress"),
            iterations=fit.iterations,
            noise=problem.noise,
            nominal=cast("M", mechanism),
            measurements=measurements,
            options=options,
            student_degrees=fit.student_degrees,
            unguarded=tuple(fit.unguarded),
        )
        why = "" if found.converged else contradiction_of(found)
        return dataclasses.replace(found, failure=f"{found.failure}; {why}") if why else found

    @cached_property
    def heights(self) -> Heights | None:
        """What heights that a probe touched show, if nothing else was measured of poses in space.

        None for platforms that turn, and if it did not converge.
        """
        return heights_of(self)

    @property
    def first_unknowns(self) -> list[Unknown]:
        """Of each column that was estimated, the first unknown that moves with it."""
        by_name = {each.name: each for each in self.unknowns}
        return [
            by_name.get(name) or next(each for each in self.unknowns if _is_in(each.name, name))
            for name in self.names
        ]

    @property
    def frames(self) -> Frames:
        """Where the frames are."""
        return self.mechanism.frames or Frames()

    @property
    def unexplained(self) -> bool:
        """Whether the residuals are larger than noise and priors explain."""
        return self.chi_square > self.limit

    @property
    def spread(self) -> float:
        """Factor on the declared noise, 1 if that explains the residuals."""
        return (
            float(np.sqrt(self.chi_square / self.degrees_of_freedom)) if self.unexplained else 1.0
        )

    @cached_property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Wider models, and how much better they explain the same observations."""
        return tuple(alternatives_of(self))

    @cached_property
    def turns(self) -> tuple[str, ...]:
        """Readings that are turns, or a working mode, away from the calibrated model, in words."""
        readings = np.where(np.isfinite(self.reading_errors), self.measurements.readings, np.nan)
        numbers = self.measurements.row_numbers
        taken = Taken(self.nominal, self.mechanism, self.latent_poses, readings, numbers)
        # Where residuals are not explained, neither are the poses that tell modes apart.
        return (*(() if self.unexplained else other_modes(taken)), *lost_turns(taken))

    @cached_property
    def symptoms(self) -> tuple[str, ...]:
        """What speaks against the estimate, whatever the cause."""
        return tuple(symptoms_of(self))

    @cached_property
    def models(self) -> tuple[Model, ...]:
        """What else explains the observations, since something speaks against the estimate.

        Empty if nothing does, if it did not converge, or if nothing is to spare.
        """
        if not self.converged or self.degrees_of_freedom <= 0 or not self.symptoms:
            return ()
        return tuple(models_of(self))

    def model(self, what: str) -> Model | None:
        """One of `models` by its `what`, fitted once; None if that has no solution."""
        if what not in self._models:
            self._models[what] = model_of(self, what)
        return self._models[what]

    @cached_property
    def _models(self) -> dict[str, Model | None]:
        return {}

    @cached_property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """Corrections that were tried since something speaks against it; empty otherwise."""
        if self.converged and not self.symptoms:
            return ()
        return hypotheses_of(self.nominal, self.measurements, self.options)

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Reasons not to trust the estimate, apart from convergence; empty if there are none."""
        return tuple(doubts_of(self))

    @cached_property
    def influence(self) -> Influence | None:
        """What each pose does to the estimate; None if a loss has weighed the poses."""
        return Influence.of(self) if self.converged else None

    @cached_property
    def expected(self) -> Expected | None:
        """Errors to expect over the workspace; None without one, or for curved sensors."""
        return Expected.of(self)

    @property
    def directions(self) -> tuple[Direction, ...]:
        """The combinations of unknowns that are known worst and best, in tolerances."""
        return directions_of(self, np.array([each.tolerance for each in self.first_unknowns]))

    @property
    def correlations(self) -> tuple[Correlation, ...]:
        """Pairs of unknowns that are told apart worst."""
        return correlations_of(self.covariance, self.names)

    @property
    def trustworthy(self) -> bool:
        """Whether it converged and nothing speaks against it."""
        return self.converged and not self.doubts

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What to know of the estimate and of the mechanism's settings, in sentences."""
        changed = changed_settings(self.nominal, self.mechanism)
        return (*self.measurements.notes, *notes_of(self), *changed)

    @cached_property
    def before(self) -> Evaluation | None:
        """End-effector errors of the nominal mechanism at poses measured in full, or None.

        In the frames that were found, since no robot could do well in others.
        """
        return evaluated(self._drawn, self.measurements)

    @cached_property
    def after(self) -> Evaluation | None:
        """End-effector errors of the calibrated mechanism at poses measured in full, or None."""
        return evaluated(self.mechanism, self.measurements)

    @cached_property
    def residual_rms(self) -> float:
        """Closures of all legs at poses measured in full, m; NaN if there are none."""
        return _closure_rms(self.mechanism, self.measurements)

    @cached_property
    def nominal_residual_rms(self) -> float:
        """The same of the nominal mechanism, in the frames that were found."""
        return _closure_rms(self._drawn, self.measurements)

    @property
    def _drawn(self) -> Mechanism:
        return self.nominal.replace(frames=self.mechanism.frames)

    def cross_validated(
        self, folds: int = 5, seed: int | None = None, *, blocks: bool = False
    ) -> Self:
        """Return the same with its cross-validation, see `cross_validate`."""
        seed = self.nominal.protocol.seed if seed is None else seed
        found = joint_cross_validation(
            self.nominal, self.measurements, folds, seed, self.options, blocks=blocks
        )
        return dataclasses.replace(self, cross_validation=found)

    @property
    def _not_shown(self) -> list[tuple[str, int, str]]:
        """What the data do not show by themselves: the words, how many, and which."""
        found = []
        for status in get_args(Status)[5:]:
            names = [each.name for each in self.unknowns if each.status == status]
            if names:
                found.append((status.replace("its", "their"), len(names), ", ".join(names)))
        return found

    def predicting(self, unseen: Measurements) -> _core.JointFit:
        """Fit the latent poses of further observations alone, everything else as estimated.

        `Rows.blunder` of it is what each observation differs by from what the others of its pose
        predict.
        """
        return settled(self.mechanism, self.noise, unseen).fit()

    @cached_property
    def unexplained_rows(self) -> tuple[int, ...]:
        """Rows of `aside` that the noise does not explain: what they observed is lost.

        Not those where no more was observed than a pose has coordinates, which noise alone may
        leave without any pose, nor those that hardly show a direction of the pose, in which nothing
        can be linearised.
        """
        told = observed_count(self.measurements) - self.nominal.space.dof
        problem = settled(self.mechanism, self.noise, self.measurements)
        core = problem.mechanism.straight, problem.setup, problem.observations
        limit = FALSE_ALARMS / max(len(self.conditions), 1)
        return tuple(
            row
            for row in self.aside
            if told[row] > 0
            and _core.chi_square_tail(
                _core.left_unexplained(*core, self.latent_poses, row), int(told[row])
            )
            < limit
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what its results file holds."""
        measurements, numbers = self.measurements, self.measurements.row_numbers
        found = super().to_dict()
        return {
            "command": "identify",
            "mechanism": self.nominal.name,
            "measurements": {
                "file": measurements.source_name or None,
                "poses": len(measurements.poses),
            },
            "settings": plain({"estimator": "joint", **vars(self.options), "noise": self.noise}),
            "identification": {
                "estimator": "joint",
                "converged": found.pop("converged"),
                "trustworthy": self.trustworthy,
                "doubts": list(self.doubts),
                "notes": list(self.notes),
                "wider_models": [each.to_dict() for each in self.alternatives],
                "models": [each.to_dict() for each in self.models],
                "hypotheses": [each.to_dict() for each in self.hypotheses],
                **found,
                "frames": plain(self.frames),
                "sensor_curvature": plain(self.mechanism.curvature),
                "noise_is_estimated": self.options.noise == "estimate",
                "aside_rows": plain(numbers[list(self.aside)]),
                "rejected": [[int(numbers[row]), what] for row, what in self.rejected],
                "known_worst_and_best": [each.to_dict() for each in self.directions],
                "correlations": [each.to_dict() for each in self.correlations],
                "expected_accuracy": plain(self.expected),
                "influence": plain(self.influence),
                f"residual_before_rms_{self.nominal.space.closure_unit}": plain(
                    self.nominal_residual_rms
                ),
                f"residual_after_rms_{self.nominal.space.closure_unit}": plain(self.residual_rms),
            },
            "heights": plain(self.heights),
            "evaluation": {"before": plain(self.before), "after": plain(self.after)},
            "cross_validation": plain(self.cross_validation),
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the unknowns, a row each."""
        numbers = ("nominal", "value", "deviation", "tolerance", "prior", "change_in_tolerances")
        names = ("name", "unit", *numbers, "status")
        found = {name: [getattr(each, name) for each in self.unknowns] for name in names}
        return {
            {"deviation": "standard_deviation"}.get(name, name): (
                np.array(column) if name in numbers else column
            )
            for name, column in found.items()
        }

    def latent_columns(self) -> Mapping[str, Any]:
        """Return the latent poses and the reading errors, a row a pose."""
        names = pose_column_names(self.nominal.pose_space)
        unit, influence = self.nominal.reading_unit, self.influence
        table = {
            "row": self.measurements.row_numbers,
            **dict(zip(names, as_drawn(self.mechanism, self.latent_poses).T, strict=True)),
            **{
                f"error_{leg}_{unit}": errors for leg, errors in enumerate(self.reading_errors.T, 1)
            },
            "conditions": self.conditions,
        }
        if influence is not None:
            table |= {"left_out_residual": influence.residual, "left_out_moves": influence.moves}
        return table

    def residual_columns(self) -> Mapping[str, Any]:
        """Return the residuals of the single observations, a row each."""
        rows, space = self.rows, self.nominal.pose_space
        every = range(len(rows.pose))
        return {
            "row": self.measurements.row_numbers[rows.pose],
            "observation": [rows.what(row, space) for row in every],
            "unit": [rows.unit(row, space, self.nominal.reading_unit) for row in every],
            "residual": rows.residual,
            "t": rows.t,
            "error_if_alone_wrong": rows.blunder,
        }

    def write_files(self, folder: Path) -> None:
        """Write the calibrated mechanism, the results, two tables and the report into a folder."""
        self.save_calibrated(folder / "calibrated.toml")
        write_table(folder / "latent_poses.csv", self.latent_columns())
        write_table(folder / "residuals.csv", self.residual_columns())
        super().write_files(folder)

    def save_calibrated(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the calibrated mechanism, whose header says how it was found."""
        measurements = self.measurements
        header = [
            f"Identified by symkin: {self.nominal.name}, {len(measurements.poses)} poses "
            f"({measurements.source_name or 'simulated measurements'}), estimator joint.",
            "Standard deviations are one sigma; what has none was held.",
            *([f"Gauge: {self.gauge}."] if self.gauge else []),
            *(f"{number} unknowns {words}: {names}." for words, number, names in self._not_shown),
            *([] if self.trustworthy else ["Not to be trusted as it is: see the report."]),
            *changed_settings(self.nominal, self.mechanism),
        ]
        save_mechanism(self.mechanism, path, header="\n".join(header), overwrite=overwrite)


def _is_in(scalar: str, column: str) -> bool:
    block, _, own = scalar.partition(".")
    blocks, _, name = column.rpartition(".")
    return own == name and (not blocks or block in blocks.split("+"))


def _unknowns(
    nominal: Mechanism, problem: Problem, fit: _core.JointFit, values: Array, deviations: Array
) -> tuple[Unknown, ...]:
    layout = problem.layout
    # What was not said to be anywhere has no nominal place.
    drawn = scalar_values(core_setup(problem.mechanism, nominal.curvature))
    given = nominal.frames or Frames()
    places = {"base": given.base, "target": given.target, "plane": given.plane}
    unseen = np.linalg.norm(np.asarray(fit.unseen), axis=1) if len(layout.names) else np.empty(0)
    found = []
    for i, name in enumerate(layout.scalars):
        block, _, own = name.partition(".")
        column = layout.column[i]
        of_leg = block.startswith("leg")
        curved = of_leg and own in ("sensor_quadratic", "sensor_cosine", "sensor_sine")
        if not name or (column < 0 and curved and values[i] == 0):
            continue
        if not of_leg and column < 0 and not places.get(block, block[:5] in ("point", "ancho")):
            continue
        has_place = of_leg or places.get(block, True)
        tolerance = layout.tolerances[i]
        prior = layout.prior[column] if column >= 0 else np.nan
        found.append(
            Unknown(
                name=name,
                unit=layout.units[i],
                nominal=float(drawn[i]) if has_place else float("nan"),
                value=float(values[i]),
                deviation=float(deviations[i]),
                tolerance=float(tolerance) if tolerance > 0 else float("nan"),
                prior=float(prior) if np.isfinite(prior) else float("nan"),
                status=_status(layout, i, deviations[i], unseen),
            )
        )
    return tuple(found)


def _status(layout: Layout, scalar: int, deviation: float, unseen: Array) -> Status:
    column = layout.column[scalar]
    if column < 0:
        reasons: dict[str, Status] = {
            CONSTANT: "held, a constant of the description",
            REDUNDANT: "held, since the sensor's offset does the same",
        }
        return reasons.get(layout.always_held[scalar], "held")
    prior = layout.prior[column]
    if np.isfinite(prior) and deviation > _SILENT * prior:
        return "held by its prior: not shown by the data"
    if deviation > _SHOWN * prior:
        return "shown by the data and priors together"
    if len(unseen) and unseen[column] > UNSEEN:
        if np.isfinite(layout.prior).any():
            return "shown by the data and priors together"
        return "shown by the data up to the gauge"
    return "shared" if len(layout.members(column)) > 1 else "free"


def evaluated(mechanism: Mechanism, measurements: Measurements) -> Evaluation | None:
    """End-effector errors at the measured poses; None if none can be evaluated."""
    try:
        return evaluate(mechanism, measurements=measurements)
    except SymkinError:
        return None


def _closure_rms(mechanism: Mechanism, measurements: Measurements) -> float:
    own = dataclasses.replace(measurements, poses=unframed(mechanism, measurements.poses))
    squares = closures_of(mechanism, own) ** 2
    return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else float("nan")
