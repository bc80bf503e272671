# SPDX-License-Identifier: MIT
"""What measurements say of a robot, and how far that can be trusted."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any, ClassVar, Self, get_args

import numpy as np

from symkin.data.columns import pose_column_names
from symkin.data.measurements import Measurements
from symkin.estimate.cross_validation import cross_validation_of
from symkin.estimate.evidence.corrections import explained
from symkin.estimate.evidence.wider import contradiction_of
from symkin.estimate.examined import Examined
from symkin.estimate.fit import by_leg, changed_settings
from symkin.estimate.found import M
from symkin.estimate.options import EstimateOptions
from symkin.estimate.parameters import Status, Unknown
from symkin.estimate.solution import together
from symkin.files.mechanism_writer import save_mechanism
from symkin.model.file_frames import as_drawn
from symkin.model.mechanism import Mechanism
from symkin.results import FolderResult
from symkin.storage.tables import write_table
from symkin.values import plain, record

REDRAWN = "corrected.toml"  # the drawing without its likely mistake, if that is the cause
CORRECTED = "corrected.csv"  # the measurements without their likely mistake, if that is the cause


def save_corrections(
    folder: Path,
    nominal: Mechanism,
    cause: str,
    table: Measurements | None,
    drawing: Mechanism | None,
) -> None:
    """Write table and drawing without a likely mistake, which the drawing's header names."""
    if table is not None:
        table.save(folder / CORRECTED, nominal)
    if drawing is not None:
        header = f"As drawn, but for a mistake that its measurements show: {cause}."
        save_mechanism(drawing, folder / REDRAWN, header=header)


@record
class Estimate(Examined[M], FolderResult):
    """What measurements say of the unknowns, and how far that can be trusted.

    The same for every estimator, whatever was unknown and observed. What takes long is computed
    when it is first asked for, and kept by copies and `dataclasses.replace`.

    Attributes
    ----------
    mechanism : Mechanism
        The calibrated one, with its frames, and the standard deviations of what was estimated.
    nominal : Mechanism
        From which it started.
    measurements : Measurements
        What was observed.
    options : EstimateOptions
        How it was estimated.
    noise : NoiseSettings
        Declared, or estimated if that was asked for.
    unknowns : tuple of Unknown
        Every scalar of the legs, and of the frames that there are; by name in `params`.
    names : tuple of str
        Of what was estimated: the columns of
    covariance : ndarray, shape (columns, columns)
        What deviations and promises rest on: `model_covariance`, of which what the noise leaves is
        taken times `noise_factor`, and what the priors leave times the larger of that and
        `conflict_factor`, and what was `assumed` besides. Leg by leg it is the jackknife's where
        the residuals are larger than the declared noise explains, from those of all legs. With a
        loss it follows the residuals that the loss keeps.
    goodness : tuple of GoodnessOfFit
        Chi-square of each fit: of each leg, or one of all. `chi_square`, `degrees_of_freedom`,
        `chi_square_ratio`, `limit` and `least` are of all together.
    converged : bool
        Whether it did, and
    failure : str
        why not.
    iterations : int
        Steps of the solver; leg by leg, of the one that took most.
    rank, data_rank : int
        Of observations and priors, and of observations alone.
    unseen : tuple of str
        Combinations of unknowns, in tolerances, that the observations alone do not show.
    unseen_directions : ndarray, shape (columns, columns - data_rank)
        The same in numbers.
    gauge : str
        How these were settled; empty if there are none.
    legs : tuple of LegFit
        How the closures of each leg were fitted; empty where everything was estimated together,
        with latent poses.
    latent : Latent or None
        The latent poses that were estimated too; None leg by leg. See `latent_poses`.
    rejected : tuple of (int, str)
        Rows of the measurements, from 0, and what of them was left out as a blunder.
    aside : tuple of int
        Rows, from 0, that no latent pose was found for.
    student_degrees : float
        Of Student's t, which errors over their standard deviations follow; infinite without a loss.
    unguarded : tuple of int
        Rows, from 0, at which the robust loss would not see a gross error.
    model_covariance : ndarray, shape (columns, columns)
        Of noise and priors as they are declared; with a loss as that has it.
    conflict : DrawingConflict or None
        How far the estimate is from the drawing, against priors and tolerances; None where nothing
        can be said.
    noise_factor : float
        Chi-square per degree of freedom where that is larger than the declared noise explains,
        else 1.
    conflict_factor : float
        On what the priors leave of variances: of `conflict.ratio`, which says how much further from
        the drawing the robot is than they do, one and a half times its square less 1, at least 1;
        1 without priors.
    assumed : tuple of Assumed
        What was declared of what is held or assumed (`identify`'s `assume`), and how far it moves
        the estimates; `covariance` contains it, `observed_covariance` does not.
    relations : ndarray
        Priors of several unknowns together, as `prior_rows` has all of them.
    fitted_prior : FittedPrior or None
        What the measurements say of the tolerances, if that was asked for; `covariance` contains
        what it leaves open.
    session_noise : tuple of float
        Times the declared noise, of each session in the order of their numbers, if that was asked
        for; `measurements` have these deviations then.
    cross_validation : CrossValidation or None
        If it was asked for, see `cross_validated`.
    """

    FILES: ClassVar[tuple[str, ...]] = (
        "calibrated.toml",
        "results.json",
        "latent_poses.csv",
        "residuals.csv",
        "report.html",
    )
    SOMETIMES: ClassVar[tuple[str, ...]] = (REDRAWN, CORRECTED)

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        measurements: Measurements,
        options: EstimateOptions,
        *,
        legs: bool,
        explain: bool = True,
    ) -> Self:
        """Estimate, leg by leg from full poses or whatever there is; errors are `identify`'s.

        Where there is none, `explain` looks for why.
        """
        why_not = (
            explained(mechanism, measurements, options, by_leg=legs) if explain else nullcontext()
        )
        with why_not:
            found = (by_leg if legs else together)(mechanism, measurements, options)
            why = contradiction_of(found) if explain and not legs and not found.converged else ""
        return cls(**vars(found) | ({"failure": f"{found.failure}; {why}"} if why else {}))

    def cross_validated(
        self, folds: int = 5, seed: int | None = None, *, blocks: bool = False
    ) -> Self:
        """Return the same with its cross-validation, see `cross_validate`."""
        seed = self.nominal.protocol.seed if seed is None else seed
        asked = self.nominal, self.measurements, folds, seed, self.options
        found = cross_validation_of(*asked, blocks=blocks, legs=bool(self.legs))
        return dataclasses.replace(self, cross_validation=found)

    def __repr__(self) -> str:
        """Return title and the few numbers that matter; doubts only if they are known."""
        assert self.kept is not None
        verdict = "not converged"
        if self.converged:
            verdict = "converged; ask for its doubts"
            if "doubts" in self.kept.known:
                count = len(self.doubts)
                verdict = f"converged, {count or 'no'} doubt{'' if count == 1 else 's'}"
        return (
            f"Estimate({self.nominal.name}, {self.estimator}, {len(self.names)} unknowns, "
            f"{len(self.measurements.poses)} poses, {verdict}, chi_square={self.chi_square:.4g} "
            f"of {self.degrees_of_freedom:.4g} degrees of freedom)"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return what its results file says."""
        measurements, numbers = self.measurements, self.measurements.row_numbers
        unit, found = self.nominal.space.closure_unit, super().to_dict()
        return {
            "command": "identify",
            "mechanism": self.nominal.name,
            "measurements": {
                "file": measurements.source_name or None,
                **({"robot": measurements.robot} if measurements.robot else {}),
                "poses": len(measurements.poses),
            },
            "settings": plain(dataclasses.replace(self.options, noise=self.noise)),
            "identification": {
                "estimator": self.estimator,
                "converged": self.converged,
                "trustworthy": self.trustworthy,
                "doubts": plain(self.doubts),
                "notes": plain(self.notes),
                "params": {each.name: _without_name(each) for each in self.unknowns},
                **found,
                "noise_is_estimated": self.noise_is_estimated,
                "frames": plain(self.frames),
                "sensor_curvature": plain(self.mechanism.curvature),
                "legs": [
                    {
                        "leg": number,
                        **leg.to_dict(),
                        "poses": len(leg.rows),
                        "rejected_rows": plain(numbers[leg.rejected]),
                    }
                    for number, leg in enumerate(self.legs, 1)
                ],
                "aside_rows": plain(numbers[list(self.aside)]),
                "rejected": [[int(numbers[row]), what] for row, what in self.rejected],
                "tests": plain(self.tests),
                "outliers": plain(self.outliers),
                "wider_models": plain(self.alternatives),
                "models": plain(self.models),
                "hypotheses": plain(self.hypotheses),
                "known_worst_and_best": plain(self.directions),
                "correlations": plain(self.correlations),
                "strains": plain(self.strains),
                "expected_accuracy": plain(self.expected),
                "influence": plain(self.influence),
                f"residual_before_rms_{unit}": plain(self.nominal_residual_rms),
                f"residual_after_rms_{unit}": plain(self.residual_rms),
                f"residual_after_max_{unit}": plain(self.residual_max),
            },
            "heights": plain(self.heights),
            "evaluation": {"before": plain(self.before), "after": plain(self.after)},
            "cross_validation": plain(self.cross_validation),
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

    def write_files(self, folder: Path, *, report: bool = True) -> None:
        """Write the calibrated mechanism, the results, two tables and the report into a folder."""
        self.write_tables(folder)
        if self.corrected is not None or self.redrawn is not None:
            save_corrections(
                folder, self.nominal, self.doubts[0].words, self.corrected, self.redrawn
            )
        super().write_files(folder, report=report)

    @property
    def files(self) -> tuple[str, ...]:
        """Names of its files, table and drawing as the likely cause corrects them among them."""
        corrected = (self.redrawn, self.corrected)
        made = [
            name for name, each in zip(self.SOMETIMES, corrected, strict=True) if each is not None
        ]
        return (*made, *self.FILES)

    def write_tables(self, folder: Path) -> None:
        """Write the calibrated mechanism and the two tables alone."""
        self.save_calibrated(folder / "calibrated.toml")
        write_table(folder / "latent_poses.csv", self.latent_columns())
        write_table(folder / "residuals.csv", self.residual_columns())

    def save_calibrated(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the calibrated mechanism, whose header says how it was found."""
        measurements, unit = self.measurements, self.nominal.space.closure_unit
        header = [
            f"Identified by symkin: {self.nominal.name}, {len(measurements.poses)} poses "
            f"({measurements.named or 'simulated measurements'}), "
            f"estimator {self.estimator}.",
            "Standard deviations are one sigma; what has none was held.",
            *([f"Gauge: {self.gauge}."] if self.gauge else []),
            *(f"{number} unknowns {words}: {names}." for words, number, names in self._not_shown),
            *([] if self.trustworthy else ["Not to be trusted as it is: see the report."]),
            *changed_settings(self.nominal, self.mechanism),
        ]
        if np.isfinite(self.residual_rms):
            header.insert(
                1,
                f"Closure residual {self.nominal_residual_rms:.3g} {unit} before, "
                f"{self.residual_rms:.3g} {unit} after (rms).",
            )
        save_mechanism(self.mechanism, path, header="\n".join(header), overwrite=overwrite)

    @property
    def _not_shown(self) -> list[tuple[str, int, str]]:
        """What the data do not show by themselves: the words, how many, and which."""
        found = []
        for status in get_args(Status)[5:]:
            names = [each.name for each in self.unknowns if each.status == status]
            if names:
                found.append((status.replace("its", "their"), len(names), ", ".join(names)))
        return found


def _without_name(unknown: Unknown) -> dict[str, Any]:
    return {key: value for key, value in unknown.to_dict().items() if key != "name"}
