# SPDX-License-Identifier: MIT
"""Measured poses and sensor readings, and what they refuse."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields, replace
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.data.error_axes import (
    Directed,
    correlated_errors,
    correlation_matrices,
    directed_errors,
)
from symkin.data.observables import CIRCUMSTANCES, OBSERVABLES, Observable
from symkin.errors import MeasurementError, NotIdentifiableError, printable, shown
from symkin.model.poses import POSE_SPACES, PoseSpace, space_named, wrong_quaternion
from symkin.model.sensor_table import SensorTable
from symkin.model.settings import NoiseSettings
from symkin.results import Result
from symkin.shell import typed_word
from symkin.values import Array, Value, field, read_only, record

ALL_LEGS = -1  # the set of poses that serve every leg; in files it is 0, and legs count from 1
# What may have been observed besides poses and readings.
_FURTHER = tuple(each for each in OBSERVABLES.values() if each.is_further)
_DEVIATIONS = tuple(each.deviations for each in OBSERVABLES.values())
_BESIDE = attrgetter(*(each.name for each in _FURTHER), *_DEVIATIONS)
_BETWEEN = tuple(each for each in OBSERVABLES.values() if each.between_rows)
_NEARLY_ONE = 1e-6  # of an axis as it is written


@record
class MeasuredRows(Result):
    """What `Measurements` hold and refuse; they add how they are written."""

    poses: Array
    readings: Array
    leg_sets: NDArray[np.intp] = field(number=True)
    row_numbers: NDArray[np.intp]
    source: Path | None = field(compare=False, default=None)
    pose_space: str = ""
    reading_unit: str = ""
    pose_deviations: Array | None = None
    pose_correlations: Array | None = None
    reading_deviations: Array | None = None
    reported: Array | None = None
    reported_deviations: Array | None = None
    points: Array | None = None
    point_deviations: Array | None = None
    point_correlations: Array | None = None
    distances: Array | None = None
    distance_deviations: Array | None = None
    heights: Array | None = None
    height_deviations: Array | None = None
    attitudes: Array | None = None
    attitude_deviations: Array | None = None
    turns: Array | None = None
    turn_deviations: Array | None = None
    turn_axes: Array | None = None
    partners: NDArray[np.intp] | None = None
    separations: Array | None = None
    separation_deviations: Array | None = None
    rises: Array | None = None
    rise_deviations: Array | None = None
    offsets: Array | None = None
    offset_deviations: Array | None = None
    commanded: Array | None = None
    times: Array | None = None
    temperatures: Array | None = None
    sessions: NDArray[np.intp] | None = None
    approaches: Array | None = None
    velocities: Array | None = None
    speeds: Array | None = None
    sensor_table: SensorTable | None = field(private=True, default=None)
    unread: tuple[str, ...] = field(compare=False, default=())
    robot: str = field(compare=False, default="")
    ignored: tuple[str, ...] = field(compare=False, default=())

    def __post_init__(self) -> None:
        """Check that all arrays have a row for each pose, and that quaternions are rotations."""
        make_arrays(
            self,
            poses=(2, "float"),
            readings=(2, "float"),
            leg_sets=(1, "int"),
            row_numbers=(1, "int"),
        )
        space = space_named(self.pose_space, self.poses.shape[1])
        object.__setattr__(self, "pose_space", space.name)
        given = [each for each in _FURTHER if getattr(self, each.name) is not None]
        make_arrays(self, **{each.name: (each.dimensions, "float") for each in given})
        further = [each.name for each in given]
        if self.commanded is not None:
            make_arrays(self, commanded=(2, "float"))
            further.append("commanded")
        for name, kind in (("turn_axes", "float"), ("partners", "int")):
            if getattr(self, name) is not None:
                make_arrays(self, **{name: (2, kind)})
                further.append(name)
        rows = len(self.poses)
        for name in ("readings", "leg_sets", "row_numbers", *further):
            count = len(getattr(self, name))
            if count != rows:
                raise MeasurementError(f"there are {count} {name} for {rows} poses")
        for name in ("poses", *further):
            self._check_values(name)
        self._check_pairs()
        self._check_circumstances()
        for each in OBSERVABLES.values():
            self._check_deviations(each.name, each.deviations)
            if each.correlations and getattr(self, each.correlations) is not None:
                self._check_correlations(each)
        posed = {"": self.poses, "reported ": self.reported, "commanded ": self.commanded}
        for what, poses in posed.items():
            turned = poses if space.has_quaternion else None
            wrong = None if turned is None else wrong_quaternion(turned)
            if wrong is not None:
                raise MeasurementError(
                    f"row {self.row_numbers[wrong[0]]} has a {what}quaternion of norm "
                    f"{wrong[1]:.6g}; expected 1"
                )
        legs = self.readings.shape[1]
        if rows and not ALL_LEGS <= self.leg_sets.min() <= self.leg_sets.max() < legs:
            raise MeasurementError(
                f"a leg set is not one of the legs 0 to {legs - 1}, or {ALL_LEGS} for all"
            )
        super().__post_init__()

    @classmethod
    def of(
        cls,
        poses: ArrayLike,
        readings: ArrayLike,
        leg_sets: ArrayLike | None = None,
        reading_unit: str = "",
        pose_space: str = "",
        **observed: Any,
    ) -> Self:
        """Measurements from arrays, rows from 1; without `leg_sets`, each serves all legs.

        `observed` is what else was: ``pose_deviations``, ``heights`` and so on, see the attributes.
        """
        rows = np.asarray(poses, dtype=np.float64)
        sets = np.full(len(rows), ALL_LEGS) if leg_sets is None else np.asarray(leg_sets)
        numbers = np.arange(1, len(rows) + 1)
        observed |= {"pose_space": pose_space, "reading_unit": reading_unit}
        return cls(rows, np.asarray(readings), sets, numbers, **observed)

    def _check_values(self, name: str) -> None:
        """Refuse another shape than the poses want, infinite values, and half quaternions."""
        values, space = getattr(self, name), self.space
        if name in ("reported", "commanded") and values.shape != self.poses.shape:
            raise MeasurementError(f"{name} are {values.shape}; expected {self.poses.shape}")
        if name == "points" and values.shape[2] != space.size:
            raise MeasurementError(f"points are {values.shape}; expected (N, n, {space.size})")
        if name in ("heights", "rises") and not space.in_space:
            raise MeasurementError(
                "there are heights above a plane; expected none, since the robot is planar"
            )
        if name in ("attitudes", "turns") and not space.has_quaternion:
            raise MeasurementError(
                f"there are {name}; expected none, since the platform does not turn in space"
            )
        if name == "attitudes" and values.shape[1] != 3:
            raise MeasurementError(f"attitudes are {values.shape}; expected roll, pitch and yaw")
        if name == "turn_axes":
            wrong = np.abs(np.linalg.norm(values, axis=1) - 1) > _NEARLY_ONE
            if values.shape[1] != 3 or wrong.any():
                raise MeasurementError(
                    f"row {self.row_numbers[wrong.argmax()]} has the axis of turns "
                    f"{values[wrong.argmax()].tolist()}; expected three components of length 1"
                )
        if name != "poses":
            self._refuse(
                np.isinf(values),
                f"an infinite value in {name}; expected numbers, or NaN for what was not measured",
            )
        if name in ("poses", "reported", "commanded") and len(space.orientation) > 1:
            missing = np.isnan(values[:, space.size :])
            self._refuse(
                missing.any(axis=1) & ~missing.all(axis=1),
                "a part of a quaternion; expected all of it, or NaN in all four",
            )

    def _refuse(self, wrong: NDArray[np.bool_], what: str) -> None:
        """Refuse the first row that has something wrong in it, by its number."""
        rows = _flat(wrong).any(axis=1)
        if rows.any():
            raise MeasurementError(f"row {self.row_numbers[rows.argmax()]} has {what}")

    def _check_pairs(self) -> None:
        """Refuse what was measured between rows if nobody says which."""
        count = 0 if self.partners is None else self.partners.shape[1]
        for each in _BETWEEN:
            values = getattr(self, each.name)
            if values is None:
                continue
            expected = (len(self.poses), count) + (self.space.size,) * (each.dimensions == 3)
            if values.shape != expected:
                raise MeasurementError(
                    f"{each.name} have shape {values.shape}; expected {expected}, as many as there "
                    "are partners, the numbers of the other rows"
                )
        if self.partners is None:
            return
        known = np.isin(self.partners, self.row_numbers) | (self.partners == 0)
        own = self.partners == self.row_numbers[:, np.newaxis]
        wrong = (own | ~known).any(axis=1)
        if wrong.any():
            row = int(wrong.argmax())
            other = self.partners[row][(own | ~known)[row]][0]
            span = f"{self.row_numbers.min()} to {self.row_numbers.max()}"
            what = "is the row itself" if own[row].any() else f"is no row; rows are {span}"
            raise MeasurementError(
                f"row {self.row_numbers[row]} names row {other} as the other one, which {what}"
            )

    def numbered(self, numbers: NDArray[np.intp]) -> Self:
        """Return them with other row numbers, by which partners are named from then on."""
        places = self.partner_places
        given: dict[str, Any] = {"row_numbers": numbers}
        if self.partners is not None:
            given["partners"] = np.where(places >= 0, np.asarray(numbers)[places], 0)
        return replace(self, **given)

    @property
    def partner_places(self) -> NDArray[np.intp]:
        """Where the other rows of `partners` are, from 0; -1 for none, or one that is not here."""
        if self.partners is None:
            return np.zeros((len(self.poses), 0), dtype=np.intp)
        order = np.argsort(self.row_numbers, kind="stable")
        at = np.searchsorted(self.row_numbers, self.partners, sorter=order)
        places = order[np.minimum(at, len(order) - 1)] if len(order) else at
        there = (self.partners > 0) & (self.row_numbers[places] == self.partners)
        return np.where(there, places, -1)

    @property
    def first_of_block(self) -> NDArray[np.intp]:
        """Of each row the first of those that partners connect it with, from 0."""
        first, places = np.arange(len(self.poses)), self.partner_places
        rows, pairs = np.nonzero(places >= 0)
        ends = np.column_stack([rows, places[rows, pairs]])
        while len(ends):
            least = np.minimum(first[ends[:, 0]], first[ends[:, 1]])
            before = first.copy()
            np.minimum.at(first, ends[:, 0], least)
            np.minimum.at(first, ends[:, 1], least)
            if (first == before).all():
                break
        return first

    def _check_circumstances(self) -> None:
        """Refuse another shape than the rows want, and a row without a value."""
        for name, each in CIRCUMSTANCES.items():
            if getattr(self, name) is None:
                continue
            make_arrays(self, **{name: (each.dimensions, "int" if each.counts else "float")})
            values, rows = getattr(self, name), len(self.poses)
            shape: tuple[int, ...] = (rows, self.space.size) if each.by_axis else (rows,)
            shape = self.readings.shape if each.by_leg else shape
            if values.shape != shape:
                raise MeasurementError(f"{name} have shape {values.shape}; expected {shape}")
            right = np.isin(values, each.values) if each.values else np.isfinite(values)
            right &= values >= 0 if each.counts else True
            expected = ", ".join(f"{value:g}" for value in each.values) or "a number"
            what = f"no {each.kind}; expected {expected} in every row, or none at all"
            self._refuse(~right, what)

    def _check_deviations(self, name: str, deviations: str) -> None:
        values, found = getattr(self, name), getattr(self, deviations)
        if found is None:
            return
        if values is None:
            raise MeasurementError(f"there are {deviations} without {name}")
        make_arrays(self, **{deviations: (values.ndim, "float")})
        found = getattr(self, deviations)
        shape = self._deviation_shape(name)
        if found.shape != shape:
            raise MeasurementError(f"{deviations} have shape {found.shape}; expected {shape}")
        self._refuse(
            np.isinf(found) | (found < 0),
            f"a negative or infinite value in {deviations}; expected standard deviations, or NaN "
            "for the noise settings'",
        )

    def _check_correlations(self, of: Observable) -> None:
        """Refuse what is no correlation of errors, and one of errors of unknown size."""
        name, size = of.correlations, self.space.size
        values = getattr(self, of.name)
        if values is None:
            raise MeasurementError(f"there are {name} without {of.name}")
        make_arrays(self, **{name: (values.ndim, "float")})
        found, pairs = getattr(self, name), size * (size - 1) // 2
        shape = (*values.shape[:-1], pairs)
        if found.shape != shape or not pairs:
            raise MeasurementError(f"{name} have shape {found.shape}; expected {shape}")
        places = found.reshape(len(found), -1, pairs)
        stated = np.isfinite(places).any(axis=-1)
        with np.errstate(invalid="ignore"):
            least = np.linalg.eigvalsh(correlation_matrices(places, size))[..., 0]
        wrong = ~(least > 0) | np.isinf(places).any(axis=-1)
        if wrong.any():
            row, place = np.argwhere(wrong)[0]
            raise MeasurementError(
                f"row {self.row_numbers[row]} has the correlations "
                f"{np.nan_to_num(places[row, place]).tolist()} in {name}; expected those of a "
                "covariance that is positive definite"
            )
        own = getattr(self, of.deviations)
        cut = self._places(of.name, np.full(values.shape, np.nan) if own is None else own)
        lacking = stated & (np.isnan(cut) & np.isfinite(self._places(of.name, values))).any(axis=-1)
        self._refuse(
            lacking,
            "a correlation of errors and no standard deviation of its own; expected "
            f"{of.deviations} of each coordinate",
        )

    def _places(self, name: str, values: Array) -> Array:
        """Of poses and points the coordinates of places, shape (N, n, size)."""
        size = self.space.size
        cut = values[:, :size] if name == "poses" else values
        return cut.reshape(len(values), -1, size)

    def _deviation_shape(self, name: str) -> tuple[int, ...]:
        shape: tuple[int, ...] = getattr(self, name).shape
        return (shape[0], self.space.dof) if OBSERVABLES[name].is_pose else shape

    @property
    def space(self) -> PoseSpace:
        """What the poses are made of."""
        return POSE_SPACES[self.pose_space]

    @property
    def complete(self) -> bool:
        """Whether every row has its full pose, and nothing else was observed: see the next."""
        return not self.incomplete_because

    @cached_property
    def incomplete_because(self) -> str:
        """Why estimators that look at each leg alone cannot use them; empty if they can.

        In words, with the first row: a coordinate of a pose was not measured, something else than
        poses and readings was observed, or a row has a standard deviation of its own.
        """
        missing = np.isnan(self.poses)
        if missing.any():
            if missing.all():
                return "no pose was measured"
            row, coordinate = np.argwhere(missing)[0].tolist()
            name = (*self.space.position, *self.space.orientation)[coordinate]
            name = "orientation" if name.startswith("q") else name
            return f"row {self.row_numbers[row]} has no measured {name}"
        for each in _FURTHER:
            row = _first_row(getattr(self, each.name))
            if row is not None:
                more = f"more than a pose and readings: {each.name}"
                return f"row {self.row_numbers[row]} has {more}"
        for name in _DEVIATIONS:
            row = _first_row(getattr(self, name))
            if row is not None:
                return f"row {self.row_numbers[row]} has standard deviations of its own"
        return ""

    @staticmethod
    def look_through(tables: Sequence[MeasuredRows]) -> None:
        """Find which tables are complete, all at once: of thousands, one by one takes far longer.

        Parameters
        ----------
        tables
            They know it from then on.
        """
        plain = [
            each
            for each in tables
            if "incomplete_because" not in vars(each)
            and each.poses.size
            and not [of for of in _BESIDE(each) if of is not None]
        ]
        if plain:
            ends = np.cumsum([each.poses.size for each in plain])
            poses = np.concatenate([each.poses.ravel() for each in plain])
            sums = np.add.reduceat(poses, [0, *ends[:-1]])  # NaN of a table that has one
            for each, missing in zip(plain, np.isnan(sums).tolist(), strict=True):
                if not missing:
                    vars(each)["incomplete_because"] = ""

    def require_complete(self) -> None:
        """Refuse what estimators that look at each leg alone cannot use.

        Raises
        ------
        NotIdentifiableError
            With `incomplete_because`.
        """
        if not self.complete:
            raise NotIdentifiableError(
                f"{self.origin}{self.incomplete_because}; legs are identified one by one from full "
                "poses only"
            )

    def require_table(self, table: SensorTable | None) -> None:
        """Refuse to be used with a mechanism whose sensors have another table.

        Raises
        ------
        MeasurementError
            Saying where the readings have to go through it.
        """
        if table != self.sensor_table:
            raise MeasurementError(
                "the readings did not go through the sensor table of this mechanism; read them "
                "with it, or make them straight (SensorTable.straight) and say so "
                "(Measurements.of(..., sensor_table=...))"
            )

    def standard_deviations(self, noise: NoiseSettings) -> dict[str, Array]:
        """Return the standard deviations of all that was observed.

        Parameters
        ----------
        noise : NoiseSettings
            Those of rows that have none of their own; reported poses are exact then.

        Returns
        -------
        dict
            Of arrays like ``pose_deviations`` by what they belong to: ``poses``, ``heights``, ...
            Where the noise of positions differs along a direction, they are along that and across
            it, each in the place of the coordinate that it is nearest to.
        """
        found = self.coordinate_deviations(noise)
        return {name: _along(own, self._directed(name, noise, own)) for name, own in found.items()}

    def coordinate_deviations(self, noise: NoiseSettings) -> dict[str, Array]:
        """As `standard_deviations`, along the coordinates, whatever is correlated."""
        found = {}
        for name, each in OBSERVABLES.items():
            values = getattr(self, name)
            if values is not None:
                own = getattr(self, each.deviations)
                shape = self._deviation_shape(name)
                usual = np.broadcast_to(each.noise(noise, self.space, values), shape)
                found[name] = usual if own is None else np.where(np.isnan(own), usual, own)
        return found

    def _directed(self, name: str, noise: NoiseSettings, deviations: Array) -> Directed | None:
        """Errors of places along axes of their own; None where coordinates are as good.

        A place that has a standard deviation of its own has it along its coordinates, unless it has
        correlations, too.
        """
        if name not in ("poses", "points") or not self.space.moves:
            return None
        correlations = getattr(self, OBSERVABLES[name].correlations)
        if noise.along is None and correlations is None:
            return None
        places = self._places(name, getattr(self, name))
        sizes = self._places(name, deviations)
        found = None if noise.along is None else directed_errors(noise, places)
        own = getattr(self, OBSERVABLES[name].deviations)
        if found is not None and own is not None:
            stated = np.asarray(np.isfinite(self._places(name, own)).any(axis=-1))
            found = found.without(stated, sizes)
        if correlations is None:
            return found
        between = correlations.reshape(*places.shape[:2], -1)
        correlated = correlated_errors(sizes, between, np.isfinite(places))
        if found is None:
            return correlated
        return found.but(np.isfinite(between).any(axis=-1), correlated)

    def observations(
        self,
        noise: NoiseSettings,
        leg_covariates: Array | None = None,
        base_covariates: Array | None = None,
    ) -> _core.Observations:
        """Return all that was observed as the core takes it; `noise` as `standard_deviations`.

        With the covariates that the slopes of a setup belong to, if it has any.
        """
        nothing = np.empty((0, 0))
        deviations = self.coordinate_deviations(noise)

        def observed(name: str) -> _core.Observed:
            values = getattr(self, name)
            if values is None:
                return _core.Observed(nothing, nothing)
            directed = self._directed(name, noise, deviations[name])
            sizes = _along(deviations[name], directed)
            own, sizes = (np.ascontiguousarray(_flat(e)) for e in (values, sizes))
            axes = nothing if directed is None else directed.in_space
            return _core.Observed(own, sizes, axes)

        covariates = (
            nothing if each is None else each for each in (leg_covariates, base_covariates)
        )
        axes = self.turn_axes
        if self.turns is not None and axes is None:
            axes = np.tile([0.0, 0.0, 1.0], (len(self.poses), 1))
        beside = (nothing if axes is None else axes, self.partner_places.astype(float))
        given: list[Any] = [*map(observed, OBSERVABLES), *beside, *covariates]
        return _core.Observations(*given)

    @property
    def origin(self) -> str:
        """The file that they are of, before a sentence; empty without one."""
        return f"{self.source}: " if self.source else ""

    @property
    def source_name(self) -> str:
        """Name of the file, as it can be printed; empty without one."""
        return printable(self.source.name) if self.source else ""

    @property
    def named(self) -> str:
        """The same, with the robot if they are of one of many; empty without both."""
        robot = f"robot {printable(self.robot)}" if self.robot else ""
        return ", ".join(filter(None, (self.source_name, robot)))

    @property
    def typed(self) -> str:
        """What a command line takes for them; empty without a file."""
        if self.source is None:
            return ""
        robot = f" --robot {typed_word(self.robot)}" if self.robot else ""
        ignored = "".join(f" --ignore {typed_word(name)}" for name in self.ignored)
        return f"{typed_word(self.source)}{robot}{ignored}"

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of the table that they were read from."""
        if not self.unread:
            return ()
        columns = f"column{'s' * (len(self.unread) > 1)} {', '.join(self.unread)}"
        origin = self.source_name or "the measurements"
        return (f"nothing was read from {columns} of {origin}",)

    def rows_of(self, leg: int) -> NDArray[np.intp]:
        """Return the rows, from 0, that identify a leg (from 0): of its set, with its reading."""
        return self._leg_rows[leg]

    @cached_property
    def _leg_rows(self) -> tuple[NDArray[np.intp], ...]:
        own = self.leg_sets[:, np.newaxis] == np.arange(self.readings.shape[1])
        used = (own | (self.leg_sets == ALL_LEGS)[:, np.newaxis]) & np.isfinite(self.readings)
        return tuple(read_only(np.flatnonzero(each)) for each in used.T)

    @property
    def measured_legs(self) -> tuple[int, ...]:
        """The legs, from 0, that have any row of their own."""
        return tuple(leg for leg, rows in enumerate(self._leg_rows) if len(rows))

    def for_all_legs(self) -> Self:
        """Return the same measurements without sets: every row serves all legs."""
        return replace(self, leg_sets=np.full(len(self.poses), ALL_LEGS))

    def require_legs(self, count: int) -> None:
        """Refuse readings of another number of legs.

        Raises
        ------
        MeasurementError
            With both numbers.
        """
        if self.readings.shape[1] != count:
            raise MeasurementError(
                f"there are readings of {self.readings.shape[1]} legs; the mechanism has {count}"
            )

    def require(self, counts: int | Sequence[int]) -> None:
        """Refuse fewer poses per measured leg than it has parameters: `counts`, of all or of each.

        Raises
        ------
        NotIdentifiableError
            Naming the leg, its number of poses and what it needs.
        """
        if not self.measured_legs:
            raise NotIdentifiableError(f"{self.origin}no leg has a measured pose")
        for leg in self.measured_legs:
            poses = len(self.rows_of(leg))
            count = counts if isinstance(counts, int) else counts[leg]
            if poses < count:
                raise NotIdentifiableError(
                    f"{self.origin}leg {leg + 1} has {poses} measured poses; "
                    f"its {count} parameters need at least {count}"
                )

    def __len__(self) -> int:
        """How many rows there are."""
        return len(self.poses)

    def __getitem__(self, rows: slice | ArrayLike) -> Self:
        """Return the measurements of a slice, of rows by their places from 0, or of a mask."""
        if isinstance(rows, slice):
            return self.subset(np.arange(len(self))[rows])
        wanted = np.atleast_1d(np.asarray(rows))
        if wanted.dtype == bool and wanted.shape != (len(self),):
            raise MeasurementError(f"a mask of {wanted.size} for {len(self)} rows")
        if wanted.ndim != 1 or wanted.dtype.kind not in "bi":
            raise MeasurementError(f"rows {shown(rows)}; expected a slice, places or a mask")
        return self.subset(np.flatnonzero(wanted) if wanted.dtype == bool else wanted)

    def subset(self, rows: NDArray[np.intp]) -> Self:
        """Return the measurements of some rows, from 0; what was checked of all holds of them."""
        if np.ndim(rows) != 1:
            raise MeasurementError(f"rows have shape {np.shape(rows)}; expected 1 dimension")
        try:
            state = {
                each.name: read_only(value[rows]) if isinstance(value, np.ndarray) else value
                for each in fields(self)
                for value in (getattr(self, each.name),)
            }
        except IndexError as error:
            raise MeasurementError(f"no subset of {len(self.poses)} rows: {error}") from None
        return self._part(state)

    def split(self, ends: Iterable[int], robots: Iterable[str]) -> Iterator[Self]:
        """Yield parts that follow each other, as views: rows up to each of `ends`, of a robot."""
        state = {each.name: getattr(self, each.name) for each in fields(self)}
        arrays = {name: value for name, value in state.items() if isinstance(value, np.ndarray)}
        first = 0
        for end, robot in zip(ends, robots, strict=True):
            rows = {name: value[first:end] for name, value in arrays.items()}
            yield self._part({**state, **rows, "robot": robot})
            first = end

    def _part(self, state: dict[str, Any]) -> Self:
        """Some of the rows, of which nothing has to be checked again."""
        if self.partners is not None:  # without those that stay behind
            there = np.isin(state["partners"], state["row_numbers"])
            state["partners"] = read_only(np.where(there, state["partners"], 0))
        part = object.__new__(type(self))
        part.__dict__.update(state)
        return part

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values, without what was not observed at all."""
        optional = {"commanded", "partners", "turn_axes", *(each.name for each in _FURTHER)}
        optional |= {each.deviations for each in OBSERVABLES.values()}
        optional |= {each.correlations for each in OBSERVABLES.values()}
        optional |= {*CIRCUMSTANCES}
        document = super().to_dict()
        return {k: v for k, v in document.items() if not (v is None and k in optional)}


def _along(deviations: Array, directed: Directed | None) -> Array:
    """Deviations of coordinates, or those along axes of their own in the places of these."""
    if directed is None:
        return deviations
    found = np.array(deviations)
    count = directed.deviations[0].size if len(found) else 0
    found.reshape(len(found), -1)[:, :count] = directed.deviations.reshape(len(found), -1)
    return found


def _flat(values: NDArray[Any]) -> NDArray[Any]:
    """A row of numbers for each row, also of none."""
    return values.reshape(len(values), math.prod(values.shape[1:]))


def _first_row(values: Array | None) -> int | None:
    """The first row, from 0, that has any value."""
    if values is None:
        return None
    rows = np.flatnonzero(_flat(np.isfinite(values)).any(axis=1))
    return int(rows[0]) if len(rows) else None


def make_arrays(table: Value, **fields: tuple[int, str]) -> None:
    """Make arrays of a frozen table's fields, each of so many dimensions and such a type."""
    for name, (dimensions, kind) in fields.items():
        array = np.asarray(getattr(table, name), dtype=None if kind == "int" else kind)
        if array.ndim != dimensions:
            raise MeasurementError(
                f"{name} have shape {array.shape}; expected {dimensions} "
                f"dimension{'s' * (dimensions > 1)}"
            )
        if kind == "int" and array.size and array.dtype.kind not in "iu":
            raise MeasurementError(f"{name} are of type {array.dtype}; expected integers")
        object.__setattr__(table, name, array)


def changed_arrays(
    measured: MeasuredRows, change: Callable[[Array], Array], *names: str
) -> dict[str, Any]:
    """Copies of those of some arrays that there are, changed, for `dataclasses.replace`."""
    given = {name: getattr(measured, name) for name in names}
    return {name: change(np.array(each)) for name, each in given.items() if each is not None}
