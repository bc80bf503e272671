# SPDX-License-Identifier: MIT
"""What follows from an estimate: what it knows, what speaks against it, what it is worth."""

from __future__ import annotations

import dataclasses
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from symkin import _core
from symkin.analysis.evaluation import Evaluation, closures_of, evaluate
from symkin.analysis.observability import expected_accuracy
from symkin.analysis.promises import CONFIDENCE, ExpectedAccuracy
from symkin.analysis.reflectors import own_poses
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.changes import at_rest
from symkin.estimate.closures import closure_influence, closure_rows
from symkin.estimate.cross_validation import CrossValidation
from symkin.estimate.evidence.corrections import Hypothesis
from symkin.estimate.evidence.examine import Evidence, Noticed, judged, noticed
from symkin.estimate.evidence.findings import Doubt, Note, of_readings
from symkin.estimate.evidence.models import Model, model_of, models_of
from symkin.estimate.evidence.notes import notes_of
from symkin.estimate.evidence.outliers import Outlier
from symkin.estimate.evidence.residuals import ResidualTest
from symkin.estimate.evidence.wider import Alternative, alternatives_of
from symkin.estimate.found import Found, Latent, M
from symkin.estimate.kept import Kept, once
from symkin.estimate.precision import (
    Correlation,
    Direction,
    Expected,
    Heights,
    Influence,
    correlations_of,
    directions_of,
    heights_of,
    promising,
)
from symkin.estimate.solution import settled, together
from symkin.estimate.strain import Strain, strains_of
from symkin.estimate.survey import check_coordinates
from symkin.files.mechanism_writer import can_be_read
from symkin.model.mechanism import Mechanism
from symkin.options import Coordinates
from symkin.values import Array, field, record

_OF_CROSS_VALIDATION = ("heights", "notes")  # computed from it, if there is one


@record
class Examined(Found[M]):
    """The part of `Estimate` that is computed when it is first asked for."""

    cross_validation: CrossValidation | None = field(private=True, default=None)
    kept: Kept | None = field(private=True, default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        """Keep what was computed from the same fields, as far as it follows from them."""
        super().__post_init__()
        made, before = Kept(self._basis()), self.kept
        if before is not None:
            changed = {
                name for name, value in made.basis.items() if value is not before.basis[name]
            }
            if changed <= {"cross_validation"}:
                lost = _OF_CROSS_VALIDATION if changed else ()
                made.known = {
                    name: value for name, value in before.known.items() if name not in lost
                }
        object.__setattr__(self, "kept", made)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """What has been copied or unpickled has arrays of its own."""
        super().__setstate__(state)
        assert self.kept is not None
        self.kept.basis = self._basis()

    def _basis(self) -> dict[str, object]:
        names = (each.name for each in dataclasses.fields(self))
        return {name: getattr(self, name) for name in names if name != "kept"}

    @property
    @once
    def seen(self) -> Latent:
        """The latent poses and the observations; leg by leg the closures, see `rows`."""
        if self.latent is not None:
            return self.latent
        alone, taken = self.nominal.replace(frames=None), self.measurements
        try:
            if self.estimator == "joint":
                latent = together(alone, taken, self.options).latent
                assert latent is not None
                return latent
            fit = self.predicting(taken)
            poses, errors = fit.poses, fit.reading_errors
        except SymkinError:
            poses, errors = (np.full_like(each, np.nan) for each in (taken.poses, taken.readings))
        used = np.concatenate([leg.rows for leg in self.legs])
        count = np.bincount(used, minlength=len(taken.poses)) * self.nominal.closures
        return Latent(poses, errors, count.astype(np.intp), closure_rows(self))

    @property
    @once
    def _noticed(self) -> Noticed:
        return noticed(self, lambda: self.alternatives, self.model)

    @property
    @once
    def _evidence(self) -> Evidence:
        return judged(self, self._noticed)

    @property
    @once
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons not to trust the estimate, apart from convergence; empty if there are none.

        All tests together raise one in fewer than 1 of 100 sound robots.
        """
        return of_readings(self._evidence.doubts, self.nominal)

    @property
    def symptoms(self) -> tuple[Doubt, ...]:
        """What speaks against the estimate, whatever the cause."""
        return (*self._noticed.lasting, *self._noticed.symptoms)

    @property
    def trustworthy(self) -> bool:
        """Whether it converged and nothing speaks against it."""
        return self.converged and not self.doubts

    @property
    @once
    def notes(self) -> tuple[Note, ...]:
        """What to know of the estimate and of the mechanism's settings."""
        complete = self._evidence.complete
        notes = notes_of(self, self.heights, self.symptoms, complete=complete)
        return of_readings(notes, self.nominal)

    @property
    def tests(self) -> tuple[ResidualTest, ...]:
        """Tests of the closures at poses measured in full for what the model may lack."""
        return self._noticed.tests

    @property
    def outliers(self) -> tuple[Outlier, ...]:
        """Poses, or observations, that do not fit the others, the worst first."""
        return self._noticed.outliers

    @property
    @once
    def alternatives(self) -> tuple[Alternative, ...]:
        """Wider models, and how much better they explain the same observations.

        None leg by leg, where `tests` tell.
        """
        return tuple(alternatives_of(self))

    @property
    @once
    def models(self) -> tuple[Model, ...]:
        """What else explains the observations, since something speaks against the estimate.

        Empty if nothing does, if it did not converge, if nothing is to spare, and leg by leg.
        """
        if self.legs or not self.converged or self.degrees_of_freedom <= 0 or not self.symptoms:
            return ()
        return tuple(models_of(self, self.alternatives, self.model))

    def model(self, what: str) -> Model | None:
        """One of `models` by its `what`, fitted once; None if that has no solution."""
        if what not in self._models:
            self._models[what] = model_of(self, self.alternatives, what)
        return self._models[what]

    @property
    @once
    def _models(self) -> dict[str, Model | None]:
        return {}

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """Corrections that were tried since something speaks against it; empty otherwise."""
        return self._evidence.hypotheses

    @property
    def corrected(self) -> Measurements | None:
        """The measurements as the likely cause would have them, for `identify`.

        None unless it is a single one that explains all, of the table and not of the mechanism.
        """
        return self._evidence.corrected

    @property
    @once
    def redrawn(self) -> M | None:
        """The mechanism as the likely cause would have it drawn, for `identify`.

        None unless it is a single one that explains all, of the drawing (a working mode, a gain, a
        zero, what is held) and not of the table alone; and where no file could say it.
        """
        found = self._evidence.redrawn
        if found is None or not can_be_read(found):
            return None
        return cast("M", found)

    @property
    @once
    def influence(self) -> Influence | None:
        """What each pose does to the estimate, to first order.

        None if a loss has weighed the poses, and of the estimators `paper` and `inverse`.
        """
        if not self.converged:
            return None
        if self.legs and self.estimator != "joint":
            return closure_influence(self)
        return Influence.of(self)

    @property
    @once
    def expected(self) -> Expected | None:
        """Errors to expect over the workspace; None without one."""
        return Expected.by(self)

    @property
    def directions(self) -> tuple[Direction, ...]:
        """The combinations of unknowns that are known worst and best, in tolerances."""
        return directions_of(self, np.array([each.tolerance for each in self.first_unknowns]))

    @property
    def correlations(self) -> tuple[Correlation, ...]:
        """Pairs of unknowns that are told apart worst."""
        return correlations_of(self.covariance, self.names)

    @property
    @once
    def strains(self) -> tuple[Strain, ...]:
        """How far ties that hold within a deviation are pulled, each against all else."""
        return strains_of(self)

    @property
    @once
    def heights(self) -> Heights | None:
        """What heights that a probe touched show, if nothing else was measured of poses in space.

        None for platforms that turn, and if it did not converge.
        """
        return heights_of(self)

    @property
    @once
    def at_rest(self) -> Measurements:
        """The measurements without what changed meanwhile, as far as that was estimated."""
        return at_rest(self)

    @property
    def own_poses(self) -> Array:
        """The measured poses in the robot's own frame, as the calibrated mechanism has it."""
        if self.legs:
            return self.measurements.poses
        return own_poses(self.mechanism, self.at_rest).poses

    @property
    @once
    def before(self) -> Evaluation | None:
        """End-effector errors of the nominal mechanism at poses measured in full.

        In the frames that were found, since no robot could do well in others. None if no such pose
        has readings of all legs that the mechanism can take.
        """
        return self._evaluated(self.nominal)

    @property
    @once
    def after(self) -> Evaluation | None:
        """End-effector errors of the calibrated mechanism at poses measured in full, or None."""
        return self._evaluated(self.mechanism)

    def _evaluated(self, mechanism: Mechanism) -> Evaluation | None:
        frames = None if self.legs else self.mechanism.frames
        try:
            return evaluate(mechanism.replace(frames=frames), measurements=self.at_rest)
        except SymkinError:
            return None

    @property
    @once
    def residual_rms(self) -> float:
        """Closures of all legs at poses measured in full, m; NaN if there are none."""
        return _rms(self.closures())

    @property
    @once
    def residual_max(self) -> float:
        """The largest of them."""
        closures = self.closures()
        known = np.abs(closures[np.isfinite(closures)])
        return float(known.max()) if known.size else float("nan")

    @property
    @once
    def nominal_residual_rms(self) -> float:
        """Closures of the nominal mechanism, in the frames that were found."""
        return _rms(self.closures(self.nominal))

    def closures(self, mechanism: Mechanism | None = None) -> Array:
        """Return the closures of a mechanism, by default the calibrated one, shape (N, legs).

        At poses measured in full; NaN elsewhere, and where a leg was not read.
        """
        own = dataclasses.replace(self.at_rest, poses=self.own_poses)
        return closures_of(mechanism or self.mechanism, own)

    def expected_accuracy(
        self,
        poses: ArrayLike | None = None,
        confidence: float = CONFIDENCE,
        *,
        of: Coordinates | None = None,
        assumed: bool = True,
    ) -> ExpectedAccuracy:
        """Predict the end-effector error over poses in the robot's own frame.

        By default those of the measurements. To first order, from what is uncertain of the
        unknowns alone and, if `assumed`, of what was declared besides; `confidence` is the share
        of such robots that are within the bounds. The position's error is `of` these coordinates
        alone in the device's frame, such as "z", or of the "height" above the bed; by default of
        all three.

        Raises
        ------
        SymkinError
            For coordinates that the robot does not have, or of an estimate leg by leg.
        """
        check_coordinates(self.mechanism, of)
        asked: dict[str, Any] = {"confidence": confidence, "noise_degrees": self.noise_degrees}
        if poses is None:
            known = np.isfinite(self.latent_poses).all(axis=1)
            poses = self.measurements.poses if self.legs else self.latent_poses[known]
        if self.legs and of is not None:
            raise SymkinError(f'"{of}" alone is of an estimate of all legs together: by "joint"')
        if self.legs:
            return expected_accuracy(self.mechanism, poses, self.parameter_covariance, **asked)
        survey, covariance = promising(self, self.mechanism)
        if not assumed:
            survey = dataclasses.replace(survey, assumed=())
            covariance = self.observed_covariance
        return survey.expected(poses, covariance, of=of, **asked)

    @property
    @once
    def accuracy_at_poses(self) -> ExpectedAccuracy:
        """The error to expect at the measured poses by what is uncertain, and nothing assumed."""
        return self.expected_accuracy(assumed=False)

    @property
    @once
    def expected_at_poses(self) -> ExpectedAccuracy:
        """The same with what is assumed."""
        return self.expected_accuracy() if self.assumed else self.accuracy_at_poses

    def predicting(self, unseen: Measurements) -> _core.JointFit:
        """Fit the latent poses of further observations alone, everything else as estimated.

        `Rows.blunder` of it is what each observation differs by from what the others of its pose
        predict.
        """
        robot = self.mechanism.replace(frames=None) if self.legs else self.mechanism
        return settled(robot, self.noise, unseen).fit()


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")
