# SPDX-License-Identifier: MIT
"""Measurement plans: which poses to take, for which leg, in which order."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.observability import Observability, RowKind, analyse_observability
from symkin.analysis.promises import CONFIDENCE, ExpectedAccuracy, thinned
from symkin.analysis.workspace import WorkspaceSample
from symkin.data.columns import pose_column_names, reading_column_names
from symkin.data.measured_rows import make_arrays
from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.data.sensor_tables import shown_readings
from symkin.errors import MeasurementError, SymkinError
from symkin.estimate.options import Estimator
from symkin.estimate.survey import HeldByPriors, PlannedUnknown, Survey, coordinates_of
from symkin.model.file_frames import as_drawn
from symkin.model.given import MechanismGiven, as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.options import checks
from symkin.planning.accuracy import predict_accuracy, survey_assuming, survey_rows
from symkin.planning.basis import PlanBasis
from symkin.planning.drift import drift_shown
from symkin.planning.visiting import travel_length
from symkin.results import Result
from symkin.storage.output_files import OutputFiles
from symkin.storage.tables import write_table
from symkin.values import Array, record


@record
class Plan(Result):
    """Commanded poses of every set, with the readings of all legs at the nominal parameters.

    The rows stand in the order in which the poses are to be visited.

    Attributes
    ----------
    mechanism : Mechanism
        The nominal one.
    leg_sets : ndarray of int, shape (N,)
        The leg, from 0, that the pose identifies; -1 for all legs. (Files, reports and messages
        count legs from 1, and write 0 for all.)
    order : ndarray of int, shape (N,)
        Place of the pose within its set, from 1; spares come last, the best first.
    spare : ndarray of bool, shape (N,)
        Whether the pose only replaces one that cannot be taken.
    poses : ndarray, shape (N, coordinates)
        Commanded poses, m and rad (spatial: position and quaternion).
    readings : ndarray, shape (N, legs)
        Commanded readings in the sensor's unit.
    basis : PlanBasis or None
        How it was made; None for a plan that was read from a file.
    candidates : WorkspaceSample, ndarray or None
        What the poses were chosen from, of more than 100 000 candidates as many or fewer, evenly
        spread over them: errors are averaged over them and figures show them. `basis` has the
        number of all.
    measured : Measurements or None
        What is measured already, to which it adds.
    confidence : float
        Share of all such robots that are within the bounds of `expected`.
    """

    mechanism: Mechanism
    leg_sets: NDArray[np.intp]
    order: NDArray[np.intp]
    spare: NDArray[np.bool_]
    poses: Array
    readings: Array
    basis: PlanBasis | None = None
    candidates: WorkspaceSample | Array | None = None
    measured: Measurements | None = None
    confidence: float = CONFIDENCE

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose."""
        make_arrays(
            self,
            poses=(2, "float"),
            readings=(2, "float"),
            leg_sets=(1, "int"),
            order=(1, "int"),
            spare=(1, "bool"),
        )
        rows = len(self.poses)
        for name in ("leg_sets", "order", "spare", "readings"):
            count = len(getattr(self, name))
            if count != rows:
                raise MeasurementError(f"the plan has {count} {name} for {rows} poses")
        super().__post_init__()

    @property
    def row_kind(self) -> RowKind:
        """What its poses were chosen by; of a plan that does not say, the paper's rows."""
        return "paper" if self.basis is None else self.basis.rows

    @property
    def travel(self) -> float:
        """Length of the way from home through the poses in order, without spares, m or rad."""
        return travel_length(self.mechanism, self.poses[~self.spare])

    @cached_property
    def drift_shown(self) -> float | None:
        """How much of a sensor's drift is not taken for geometry, from 0 to 1; None if unknown.

        In the order of the rows. What `identify` is told to take as an unknown has none left.
        """
        return drift_shown(self.mechanism, self, self._survey)

    @property
    def estimator(self) -> Estimator:
        """What it is worth most to: poses that are chosen for all legs at once, to `joint`."""
        joint = self.basis is not None and self.basis.design == "mechanism"
        return "joint" if joint else "implicit"

    @cached_property
    def expected(self) -> ExpectedAccuracy | None:
        """The end-effector error to expect over the candidates; None if that cannot be told.

        With `estimator`, all poses and those measured already, for what the plan was made to
        observe; see `predict_accuracy`.
        """
        if self.candidates is None:
            return None
        cloud = pose_rows(self.candidates)
        try:
            return predict_accuracy(
                self.mechanism,
                self,
                thinned(cloud),
                self.estimator,
                measured=self.measured,
                confidence=self.confidence,
                anywhere=cloud,
            )
        except SymkinError:  # as `joint` without a noise of redundant readings
            return None

    @cached_property
    def unknowns(self) -> tuple[PlannedUnknown, ...]:
        """How well each unknown will be known; empty for full poses and all parameters."""
        if self._survey is None:
            return ()
        survey = survey_assuming(self._survey, self, measured=self.measured)
        return survey.promised(survey.covariance(self._survey_rows))

    @cached_property
    def unseen(self) -> tuple[str, ...]:
        """Combinations of unknowns, in tolerances, that priors alone hold."""
        return () if self._survey is None else self._survey.unseen(self._survey_rows)

    @cached_property
    def held(self) -> HeldByPriors | None:
        """What the priors hold, as the observations will say next to nothing of it, if anything.

        None too where the end-effector error to expect cannot be told.
        """
        if self._survey is None or self.expected is None or self.candidates is None:
            return None
        cloud = thinned(pose_rows(self.candidates))
        known = self._survey.covariance(self._survey_rows)
        found = self._survey.held(cloud, known, of=coordinates_of(self.mechanism))
        return found if found.combinations else None

    @cached_property
    def _survey(self) -> Survey | None:
        chosen_for = None if self.basis is None else self.basis.survey
        return chosen_for and chosen_for.in_order(self.poses[~self.spare])

    @cached_property
    def _survey_rows(self) -> list[Array]:
        assert self._survey is not None
        return survey_rows(self._survey, self, measured=self.measured)

    @cached_property
    def observability(self) -> tuple[Observability, ...]:
        """What the poses show of each leg, with those measured already, if they are full.

        Empty where something else is observed or unknown, see `unknowns`. The indices are those of
        the rows that the selection saw, the rest of the paper's rows.
        """
        if self._survey is not None:
            return ()
        legs = []
        for leg, poses in enumerate(self.leg_poses()):
            shown = analyse_observability(self.mechanism, leg, poses)
            chosen = analyse_observability(self.mechanism, leg, poses, self.row_kind)
            legs.append(replace(shown, indices=chosen.indices))
        return tuple(legs)

    def rows_of_set(self, leg: int, *, spare: bool = False) -> NDArray[np.intp]:
        """Return the rows, from 0, of a leg's set (-1 for all legs) in its order; or its spares."""
        rows = np.flatnonzero((self.leg_sets == leg) & (self.spare == spare))
        return rows[np.argsort(self.order[rows], kind="stable")]

    def rows_of(self, leg: int) -> NDArray[np.intp]:
        """Return the rows, from 0, that identify a leg (from 0): its own and those of all legs."""
        return self._leg_rows[leg]

    @cached_property
    def _leg_rows(self) -> tuple[NDArray[np.intp], ...]:
        common, legs = self.rows_of_set(ALL_LEGS), range(self.readings.shape[1])
        return tuple(np.concatenate([self.rows_of_set(leg), common]) for leg in legs)

    def leg_poses(self) -> list[Array]:
        """Return the poses that identify each leg, with those measured already."""
        sets = [self.poses[rows] for rows in self._leg_rows]
        taken = self.measured
        if taken is None:
            return sets
        return [np.concatenate([own, taken.poses[taken.rows_of(i)]]) for i, own in enumerate(sets)]

    def to_dict(self) -> dict[str, Any]:
        """Return what it shows of each leg's parameters, and how it was made."""
        spares = [int(self.spare[self.leg_sets == leg].sum()) for leg in range(len(self._leg_rows))]
        common = int(self.spare[self.leg_sets == ALL_LEGS].sum())
        expected = self.expected
        return {
            "mechanism": self.mechanism.name,
            "poses": int(np.sum(~self.spare)),
            "spares": int(np.sum(self.spare)),
            f"travel_{self.mechanism.space.closure_unit}": self.travel,
            "drift_shown": self.drift_shown,
            "selection": self.basis and self.basis.to_dict(),
            "expected": expected and {"estimator": self.estimator, **expected.to_dict()},
            "unknowns": [each.to_dict() for each in self.unknowns],
            "unseen": list(self.unseen),
            "held_by_priors": self.held and self.held.to_dict(),
            "legs": [
                {
                    "poses": len(self.rows_of(shown.leg)),
                    "spares": spares[shown.leg] + common,
                    **shown.to_dict(),
                }
                for shown in self.observability
            ],
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the columns of its file."""
        return plan_columns(self, self.mechanism)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write it as CSV or Parquet, by extension, and return the file; `read_plan` reads it.

        As ``.json`` it is written with how its poses were chosen, see `Result.save`. A file that
        exists is replaced with `overwrite` alone.
        """
        if Path(path).suffix.lower() == ".json":
            return super().save(path, overwrite=overwrite)
        write_plan(self, path, self.mechanism, overwrite=overwrite)
        return Path(path)


ROLES = ("primary", "spare")
_DIGITS = 9  # of metres and radians: more than any device shows


@checks()
def write_plan(
    plan: Plan, path: str | os.PathLike[str], mechanism: MechanismGiven, *, overwrite: bool = False
) -> None:
    """Write a plan as CSV or Parquet, by extension, to nanometres and nanoradians.

    A file that exists is replaced only with `overwrite`.

    Columns ``leg, order, role``, the pose (``x_m, y_m, phi_rad``, or spatially ``x_m, y_m, z_m, qx,
    qy, qz, qw``) and the reading of every leg (``psi_1_rad``, ...).
    """
    mechanism = as_mechanism(mechanism)
    with OutputFiles(overwrite=overwrite) as outputs:
        write_table(outputs.file(Path(path)), plan_columns(plan, mechanism))


def plan_columns(plan: Plan, mechanism: Mechanism) -> dict[str, Any]:
    """Return the columns of a plan's table."""
    pose_names = pose_column_names(mechanism.pose_space)
    reading_names = reading_column_names(mechanism.reading_count, mechanism.reading_unit)
    readings = shown_readings(mechanism, plan.readings)[:, mechanism.is_read]
    beyond = np.argwhere(np.isnan(readings))
    if len(beyond):
        row, leg = beyond[0].tolist()
        raise MeasurementError(
            f"the plan has pose {plan.order[row]} where the table of the sensors has nothing that "
            f"leg {leg + 1} would show; set joint_limits within the table, or measure more of it"
        )
    return {
        "leg": plan.leg_sets + 1,
        "order": plan.order,
        "role": [ROLES[int(spare)] for spare in plan.spare],
        **dict(zip(pose_names, _commanded(as_drawn(mechanism, plan.poses)).T, strict=True)),
        **dict(zip(reading_names, _commanded(readings).T, strict=True)),
    }


def _commanded(values: Array) -> Array:
    """With the digits that a controller may need, and no negative zeros."""
    return np.round(values, _DIGITS) + 0.0
