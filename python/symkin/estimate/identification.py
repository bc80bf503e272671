# SPDX-License-Identifier: MIT
"""Identification of the parameters from measurements, and what is to be said of it."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin.analysis.evaluation import Evaluation, closures_of, pose_differences
from symkin.analysis.observability import ExpectedAccuracy, expected_accuracy
from symkin.analysis.probing import is_marked, is_probed, refuse_commanded, with_probing_defaults
from symkin.data.measurements import Measurements
from symkin.data.reading import Measured, as_measurements
from symkin.errors import SymkinError, one_of
from symkin.estimate.corrections import explained
from symkin.estimate.cross_validation import (
    CrossValidation,
    folds_of,
    joint_cross_validation,
    validation_of,
    without_part,
)
from symkin.estimate.diagnosis import Diagnosis, diagnose
from symkin.estimate.fit import Estimator, Fit, FitOptions, Loss, M, PoseUse, changed_settings
from symkin.estimate.joint import JointIdentification, evaluated
from symkin.estimate.problem import JointOptions
from symkin.estimate.unknowns import Gauge, LossPer, Priors, Sensor, with_file_settings
from symkin.files.mechanism_writer import save_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.settings import IdentificationSettings, NoiseSettings
from symkin.results import FolderResult
from symkin.values import plain, record

__all__ = ["Identification", "cross_validate", "identify", "identify_legs"]

Array = NDArray[np.float64]
Nominal = TypeVar("Nominal", bound=Mechanism)


@record
class Identification(Fit[M], FolderResult):
    """What the measurements say of the parameters, and how far that can be trusted.

    Attributes
    ----------
    mechanism, covariance, legs, goodness, converged, residual_rms, residual_max, nominal, \
measurements, options
        As of `Fit`.
    cross_validation : CrossValidation or None
        If it was asked for, see `cross_validated`.
    """

    cross_validation: CrossValidation | None = None

    FILES: ClassVar[tuple[str, ...]] = ("calibrated.toml", "results.json", "report.html")

    @cached_property
    def diagnosis(self) -> Diagnosis:
        """What the residuals and the parameters say of the model and of the measurements."""
        return diagnose(self)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons not to trust the estimate, apart from convergence; empty if there are none.

        All tests together raise one in fewer than 1 of 100 sound robots.
        """
        return self.diagnosis.doubts

    @property
    def trustworthy(self) -> bool:
        """Whether it converged and nothing speaks against it."""
        return self.converged and not self.doubts

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of the estimate and of the mechanism's settings, in sentences."""
        changed = changed_settings(self.nominal, self.mechanism)
        return (*self.measurements.notes, *self.diagnosis.notes, *changed)

    @cached_property
    def before(self) -> Evaluation | None:
        """End-effector errors of the nominal mechanism at the measured poses.

        None if no pose has readings of all legs that the mechanism can take.
        """
        return evaluated(self.nominal, self.measurements)

    @cached_property
    def after(self) -> Evaluation | None:
        """End-effector errors of the calibrated mechanism at the measured poses, or None."""
        return evaluated(self.mechanism, self.measurements)

    @cached_property
    def nominal_residual_rms(self) -> float:
        """Closures of all legs of the nominal mechanism, at all poses where they were read, m."""
        return float(np.sqrt(np.nanmean(closures_of(self.nominal, self.measurements) ** 2)))

    def expected_accuracy(self, poses: ArrayLike | None = None) -> ExpectedAccuracy:
        """Predict the end-effector error over poses, by default those measured."""
        where = self.measurements.poses if poses is None else poses
        return expected_accuracy(self.mechanism, where, self.covariance)

    def cross_validated(
        self, folds: int = 5, seed: int | None = None, *, blocks: bool = False
    ) -> Self:
        """Return the same with its cross-validation, see `cross_validate`."""
        seed = self.nominal.protocol.seed if seed is None else seed
        options = vars(self.options)
        found = cross_validate(
            self.nominal, self.measurements, folds, seed, blocks=blocks, **options
        )
        return dataclasses.replace(self, cross_validation=found)

    def to_dict(self) -> dict[str, Any]:
        """Return what its results file holds."""
        measurements, diagnosis = self.measurements, self.diagnosis
        unit = self.nominal.space.closure_unit
        return {
            "command": "identify",
            "mechanism": self.nominal.name,
            "measurements": {
                "file": measurements.source_name or None,
                "poses": len(measurements.poses),
            },
            "settings": plain(dataclasses.replace(self.options, noise=self.noise)),
            "identification": {
                "estimator": self.estimator,
                "converged": self.converged,
                "trustworthy": self.trustworthy,
                "doubts": list(self.doubts),
                "notes": list(self.notes),
                "goodness_of_fit": plain(self.goodness),
                "residual_tests": plain(diagnosis.tests),
                "outliers": plain(diagnosis.outliers),
                f"residual_before_rms_{unit}": plain(self.nominal_residual_rms),
                f"residual_after_rms_{unit}": plain(self.residual_rms),
                f"residual_after_max_{unit}": plain(self.residual_max),
                "legs": [self._leg(leg) for leg in range(len(self.legs))],
                "covariance": plain(self.covariance),
            },
            "evaluation": {"before": plain(self.before), "after": plain(self.after)},
            "cross_validation": plain(self.cross_validation),
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the parameters, a row each."""
        nominal, has = self.nominal, self.nominal.has_parameter
        legs, indices = np.nonzero(has)
        return {
            "leg": legs + 1,
            "parameter": tuple(nominal.parameter_names[index] for index in indices),
            "unit": tuple(
                nominal.parameter_units(leg)[index]
                for leg, index in zip(legs.tolist(), indices, strict=True)
            ),
            "nominal": nominal.parameters[has],
            "value": self.mechanism.parameters[has],
            "change": self.changes[has],
            "standard_deviation": self.deviations[has],
        }

    def write_files(self, folder: Path) -> None:
        """Write the calibrated mechanism, the results and the report into a folder."""
        self.save_calibrated(folder / "calibrated.toml")
        super().write_files(folder)

    def save_calibrated(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the calibrated mechanism, whose header says how it was found."""
        nominal, measurements = self.nominal, self.measurements
        unit = nominal.space.closure_unit
        header = [
            f"Identified by symkin: {nominal.name}, {len(measurements.poses)} poses "
            f"({measurements.source_name or 'simulated measurements'}), "
            f"estimator {self.estimator}.",
            f"Closure residual {self.nominal_residual_rms:.3g} {unit} before, "
            f"{self.residual_rms:.3g} {unit} after (rms); standard deviations are one sigma.",
            *changed_settings(nominal, self.mechanism),
        ]
        save_mechanism(self.mechanism, path, header="\n".join(header), overwrite=overwrite)

    def _leg(self, leg: int) -> dict[str, Any]:
        fit, nominal = self.legs[leg], self.nominal
        columns = nominal.parameters, self.mechanism.parameters, self.deviations
        parameters = zip(nominal.parameter_names, *(each[leg] for each in columns), strict=True)
        return {
            "leg": leg + 1,
            **fit.to_dict(),
            "poses": len(fit.rows),
            "rejected_rows": plain(self.measurements.row_numbers[fit.rejected]),
            "parameters": {
                name: plain({"nominal": drawn, "value": value, "standard_deviation": deviation})
                for name, drawn, value, deviation in parameters
                if name in nominal.legs[leg].parameters
            },
        }


def identify(
    mechanism: Nominal,
    measurements: Measured,
    estimator: Estimator | None = None,
    *,
    poses: PoseUse = "all",
    loss: Loss = "none",
    loss_scale: float | None = None,
    noise: NoiseSettings | Literal["estimate"] | None = None,
    max_iterations: int = 100,
    free: Sequence[str] | None = None,
    fixed: Sequence[str] | None = None,
    shared: Sequence[str] | None = None,
    prior: Priors | None = None,
    frames: Sequence[str] | None = None,
    sensor: Sensor | None = None,
    gauge: Gauge | None = None,
    loss_per: LossPer | None = None,
) -> Identification[Nominal] | JointIdentification[Nominal]:
    """Identify what is unknown of a robot from what was observed of it.

    By default that is every parameter of every leg, leg by leg from full poses. As soon as anything
    else is unknown or was observed, all is estimated together by maximum likelihood, with the true
    poses unknown too. Patterns are those of `fnmatch`: ``leg2.distal_length``, ``leg[12].*``,
    ``base.x``; without a dot they match a parameter in any leg (``sensor_offset``, ``*_length``),
    or a whole block (``leg2``).

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, from which the estimators start. Its `identification` has the defaults of
        `free` to `loss_per`.
    measurements : Measurements, Simulation, or what `read_measurements` reads
        Leg by leg, at least as many poses for a leg as it has parameters. A path, a DataFrame or a
        dict of columns is read first.
    estimator : {"implicit", "paper", "inverse", "joint"}, optional
        Whitened closures per leg; the paper's Gauss-Newton on g - psi per leg (Eqs. 15, 24-26); the
        same cost by Levenberg-Marquardt; all legs together, maximum likelihood. By default
        "implicit", and "joint" where the options or the measurements need it.
    poses : {"all", "own"}
        Which poses a leg uses: all at which it was read, or those of its own set (the paper).
    loss : {"none", "huber", "cauchy", "tukey"}
        Robust loss; refused where a single pose decides too much for one.
    loss_scale : float, optional
        Where the loss bends, in standard deviations and times the root of the number of conditions
        of a pose; by default where it keeps 95% efficiency on normal residuals (1.345, 2.385 and
        4.685 for one condition).
    noise : NoiseSettings or "estimate", optional
        Of the measurements, by default the mechanism's; or estimated with the unknowns.
    max_iterations : int
        Of each solve.
    free : sequence of str, optional
        Patterns of what is unknown; by default all parameters of all legs.
    fixed : sequence of str, optional
        Patterns of what is not, whatever else says so.
    shared : sequence of str, optional
        Patterns of parameters that differ from the drawing by the same amount in all legs that the
        pattern matches.
    prior : "tolerances", or mapping of str to float or str, optional
        Standard deviations about the drawing: the tolerances of everything unknown that has one, or
        one for each pattern, in SI units or as an expression (``"0.1 mm"``).
    frames : sequence of {"base", "target", "points", "anchors", "plane"}, optional
        What is unknown of the frames, see `Frames`: the base in the frame of the measuring device,
        the target on the platform, further targets, fixed points, the plane that a probe touches.
        Where heights are all that was measured of poses, and neither `free` nor `frames` is given,
        the plane; the tolerances are priors then. Of a platform that never turns some rows may have
        x and y instead, of marks on a piece, in a frame of the ruler's own.
    sensor : {"linear", "quadratic", "eccentric"}, optional
        What else is unknown of the sensors: their curvature, or an error of one period a turn.
    gauge : {"prior", "nominal", "datum"}, optional
        How combinations that no observation shows are settled: by the tolerances as priors; by the
        solution nearest to the drawing, in tolerances; by holding as few parameters as will do.
    loss_per : {"pose", "reading"}, optional
        Whether a blunder spoils a pose, or single observations are found and left out.

    Returns
    -------
    Identification or JointIdentification
        The second where all was estimated together from what the first has no words for.

    Raises
    ------
    NotIdentifiableError
        For fewer poses than parameters, or for poses and readings that leave a combination of
        parameters without effect; names the combination.
    FailedFitError
        For an estimate that no mechanism can be, such as a negative length.
    SymkinError
        For measurements that do not fit the mechanism's shape, an unknown option or pattern, with
        the nearest valid one, or an estimator that cannot do what is asked for, with the reason.
    """
    if estimator is not None:
        one_of("estimator", estimator, Estimator)
    _refuse_what_is_no_option(mechanism, noise)
    if free is not None and not len(free) and not (shared or frames or sensor):
        raise SymkinError("free is empty, so that nothing is unknown; expected patterns")
    measurements = as_measurements(measurements, mechanism)
    measurements.require_table(mechanism.sensor_table)
    given = {
        "free": free,
        "fixed": fixed,
        "shared": shared,
        "prior": prior,
        "frames": frames,
        "sensor": sensor,
        "gauge": gauge,
        "loss_per": loss_per,
    }
    wanted = _wanted(mechanism, measurements, given)
    reason = _needs_joint(mechanism, measurements, wanted, noise)
    if not reason:
        return identify_legs(
            mechanism,
            measurements,
            estimator or "implicit",
            poses=poses,
            loss=loss,
            loss_scale=loss_scale,
            noise=noise,
            max_iterations=max_iterations,
        )
    if estimator not in (None, "joint"):
        raise SymkinError(
            f'the estimator "{estimator}" looks at each leg by itself, from full poses in the '
            f'robot\'s own frame; expected "joint" here, since {reason}'
        )
    joint = JointOptions(
        noise=noise,
        poses=poses,
        loss=loss,
        loss_scale=loss_scale,
        max_iterations=max_iterations,
        **wanted,
    )
    # What is made of a mechanism is of its class.
    return cast(
        "JointIdentification[Nominal]", JointIdentification.of(mechanism, measurements, joint)
    )


def _refuse_what_is_no_option(mechanism: object, noise: object) -> None:
    """Of what would be passed over, or end far from here in another error."""
    if not isinstance(mechanism, Mechanism):
        raise SymkinError(
            f"{type(mechanism).__name__} is given as the mechanism; expected a Mechanism, such as "
            "load_mechanism returns, and the measurements behind it"
        )
    if noise is not None and not isinstance(noise, str | NoiseSettings):
        raise SymkinError(
            f"noise is {noise!r}; expected NoiseSettings, as replace(mechanism.noise, "
            'reading=1e-5), or "estimate"'
        )


def identify_legs(
    mechanism: Nominal, measurements: Measurements, estimator: Estimator, **options: Any
) -> Identification[Nominal]:
    """Identify every parameter of every leg from full poses in the robot's own frame.

    Whatever the mechanism says of frames and unknowns, which simulated protocols do not have.
    """
    how = FitOptions(estimator, **options)
    with explained(mechanism, measurements, how):
        return cast("Identification[Nominal]", Identification.of(mechanism, measurements, how))


def _wanted(
    mechanism: Mechanism, measurements: Measurements, given: Mapping[str, Any]
) -> dict[str, Any]:
    """What was asked for, by the arguments, the file, or what was measured."""
    wanted = with_file_settings(given, mechanism.identification)
    if not is_probed(measurements):
        return wanted
    marked = is_marked(measurements)
    if marked:
        refuse_commanded(mechanism, measurements)
    return with_probing_defaults(wanted, marked=marked)


def _needs_joint(
    mechanism: Mechanism,
    measurements: Measurements,
    wanted: Mapping[str, Any],
    noise: NoiseSettings | str | None,
) -> str:
    """Why the legs cannot be identified one by one; empty if they can."""
    usual = {"sensor": "linear", "gauge": "prior", "loss_per": "pose"}
    unusual = [
        name for name, value in wanted.items() if value != usual.get(name, ()) and len(value)
    ]
    if unusual:
        return f"{' and '.join(unusual)} {'was' if len(unusual) == 1 else 'were'} given"
    if isinstance(noise, str):
        return "the noise is to be estimated"
    if mechanism.frames is not None:
        return "the mechanism has frames, in which the poses are measured"
    if mechanism.curvature is not None:
        return "the sensors are curved"
    return measurements.incomplete_because


def cross_validate(
    mechanism: Mechanism,
    measurements: Measurements,
    folds: int = 5,
    seed: int = 1,
    estimator: Estimator | None = None,
    *,
    blocks: bool = False,
    **options: Any,
) -> CrossValidation:
    """Predict each part of the measurements from an identification on the others.

    Parameters
    ----------
    mechanism, measurements, estimator
        As for `identify`, and so are the other `options`. With poses "own", each leg's set is dealt
        by itself, and a leg is predicted at those poses alone.
    folds : int
        Number of parts, from 2 to the number of poses.
    seed : int
        Of the random assignment of poses to parts.
    blocks : bool
        Parts are blocks of consecutive poses. Neighbours are often measured at similar places and
        at similar times, so that random parts hide what drifts and what depends on the place.

    Raises
    ------
    SymkinError
        For an impossible number of folds, or too few poses left in one.
    """
    names = {each.name for each in dataclasses.fields(IdentificationSettings)}
    given = {name: options.pop(name) for name in names & options.keys()}
    wanted = _wanted(mechanism, measurements, {**dict.fromkeys(names), **given})
    reason = _needs_joint(mechanism, measurements, wanted, options.get("noise"))
    if reason:
        if estimator not in (None, "joint"):
            raise SymkinError(f'the estimator is "{estimator}"; expected "joint", since {reason}')
        joint = JointOptions(**options, **wanted)
        return joint_cross_validation(mechanism, measurements, folds, seed, joint, blocks=blocks)
    how = FitOptions(estimator or "implicit", **options)
    if how.poses == "all":
        measurements = measurements.for_all_legs()
    fold_of = folds_of(measurements.leg_sets, folds, None if blocks else seed)
    residuals = np.full(measurements.readings.shape, np.nan)
    complete = np.flatnonzero(np.isfinite(measurements.readings).all(axis=1))
    differences = np.full((len(measurements.poses), mechanism.core.dof), np.nan)
    converged = True
    for fold in np.unique(fold_of):
        seen, unseen = np.flatnonzero(fold_of != fold), np.flatnonzero(fold_of == fold)
        refused = explained(mechanism, measurements.subset(seen), how)
        with without_part(int(fold), folds), refused:
            found = Fit.of(mechanism, measurements.subset(seen), how)
        converged &= found.converged
        for leg in range(len(mechanism.legs)):
            rows = np.intersect1d(measurements.rows_of(leg), unseen)
            residuals[rows, leg] = found.mechanism.closure_error(
                leg, measurements.poses[rows], measurements.readings[rows, leg]
            )
        whole = np.intersect1d(complete, unseen)
        differences[whole] = pose_differences(found.mechanism, measurements.subset(whole))
    numbers, off = measurements.row_numbers, (differences, measurements.poses, complete)
    return validation_of(mechanism, numbers, residuals, *off, folds, blocks, converged)
