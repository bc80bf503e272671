# SPDX-License-Identifier: MIT
"""What is fitted where anything may be unknown and anything observed: the problem and its rows."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.observability import with_combinations
from symkin.analysis.probing import ruler, with_bed_radius
from symkin.analysis.seen import Seen
from symkin.analysis.straightedge import edge_of
from symkin.data.measurements import ALL_LEGS, Measurements
from symkin.data.observables import ATTITUDE, OBSERVABLES
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.covariates import Covariate, observations_of, sessions_of, slopes_of
from symkin.estimate.fitted_prior import FittedPrior, fitted_prior
from symkin.estimate.options import EstimateOptions, Loss
from symkin.estimate.starting import setup_by_points, starting_poses
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup, of_core, setup_with, to_core
from symkin.model.mechanism import Mechanism
from symkin.model.poses import (
    POSE_SPACES,
    between,
    stepped,
)
from symkin.model.settings import Frames, NoiseSettings
from symkin.values import Array, Value, record

OBSERVED = tuple(OBSERVABLES)
# As those, and what an estimator that looks at each leg alone makes of a pose and a reading.
KINDS = (*(each.kind for each in OBSERVABLES.values()), "closures")
_ANGLES = tuple(each.kind for each in OBSERVABLES.values() if each.is_angle)
UNSEEN = 1e-6  # of a direction of length one, in tolerances
_STUCK = "no step lowers the cost"  # of the core's solver
_FEW = 0.05  # of the poses: as many are looked at one by one
PRIORS_HOLD = 'prior "tolerances" holds parameters; a prior of its own, or fixed, anything'
FRAMES_ALIKE = (
    "a target moves what a platform that never turns shows as the base does: of the frames ask "
    'for one, such as frames "base" alone'
)
_UNLIKELY = 1e-4  # probability of what a sound pose leaves unexplained
_FAR = 4  # times as far as any other: a pose that does not


@record
class Rows(Value):
    """Single observations, and what the fit says of each.

    Attributes
    ----------
    pose : ndarray of int, shape (M,)
        Rows of the measurements, from 0.
    kind : ndarray of int, shape (M,)
        Index into `KINDS`.
    index : ndarray of int, shape (M,)
        The leg, the component of the pose, the point's coordinate, the anchor, the angle, the pair
        or its coordinate; from 0.
    residual : ndarray, shape (M,)
        The estimated error, in the observation's own unit.
    t : ndarray, shape (M,)
        Standard normal if the observation is sound; NaN where nothing can be said.
    blunder : ndarray, shape (M,)
        The error that it would have if it alone were wrong, in its own unit.
    """

    pose: NDArray[np.intp]
    kind: NDArray[np.intp]
    index: NDArray[np.intp]
    residual: Array
    t: Array
    blunder: Array

    @classmethod
    def of(cls, fit: _core.JointFit) -> Rows:
        """The rows of a fit."""
        rows = fit.rows
        return cls(
            pose=np.array([row.pose for row in rows], dtype=np.intp),
            kind=np.array([row.kind for row in rows], dtype=np.intp),
            index=np.array([row.index for row in rows], dtype=np.intp),
            residual=np.array([row.residual for row in rows], dtype=float),
            t=np.array([row.t for row in rows], dtype=float),
            blunder=np.array([row.blunder for row in rows], dtype=float),
        )

    def what(self, row: int, pose_space: str) -> str:
        """Name an observation: ``reading of leg 2``, ``x of the pose``."""
        return self.named(KINDS[self.kind[row]], int(self.index[row]), pose_space)

    @staticmethod
    def named(kind: str, index: int, pose_space: str) -> str:
        """Name an observation of a kind."""
        space = POSE_SPACES[pose_space]
        axes, components = space.position, (*space.position, *space.rotation)
        if kind in ("readings", "closures"):
            return f"{kind[:-1]} of leg {index + 1}"
        if kind in ("pose", "reported pose"):
            return f"{components[index]} of the {kind}"
        if kind == "points":
            point, axis = divmod(index, len(axes))
            return f"{axes[axis]} of point {point + 1}"
        if kind == "attitudes":
            return ATTITUDE[index]
        if kind == "offsets":
            pair, axis = divmod(index, len(axes))
            return f"{axes[axis]} from the other row of pair {pair + 1}"
        pairs = {"separations": "distance from", "rises": "height above"}
        if kind in pairs:
            return f"{pairs[kind]} the other row of pair {index + 1}"
        return f"distance {index + 1}" if kind == "distances" else kind[:-1]

    def unit(self, row: int, pose_space: str, reading_unit: str) -> str:
        """Unit of an observation."""
        kind, index = KINDS[self.kind[row]], self.index[row]
        if kind == "readings":
            return reading_unit
        space = POSE_SPACES[pose_space]
        if kind == "closures":
            return space.closure_unit
        if kind in _ANGLES:
            return "rad"
        return "rad" if kind in ("pose", "reported pose") and index >= space.size else "m"


@record
class Problem:
    """What is fitted: the robot and its frames where they start, the layout, and the data."""

    mechanism: Mechanism
    setup: _core.Setup
    layout: Layout
    measurements: Measurements
    noise: NoiseSettings
    options: EstimateOptions
    covariates: tuple[Covariate, ...] = ()
    fitted_prior: FittedPrior | None = None

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        measurements: Measurements,
        options: EstimateOptions,
        lay_out: Callable[..., Layout] | None = None,
    ) -> Problem:
        """Lay out what is unknown, by default by `layout_of`, and find where the frames are."""
        if options.poses == "own":
            measurements = own_readings(mechanism, measurements)
        measurements.require_legs(len(mechanism.legs))
        readings = measurements.readings
        mechanism = _with_surroundings(mechanism, measurements)
        if options.bow is not None:
            mechanism = with_bed_radius(mechanism, _touched(mechanism, measurements))
        marked = "base" in options.frames and Seen.of(measurements).marked
        placed = _with_ruler(mechanism, measurements) if marked else mechanism
        covariates = options.covariates(mechanism, measurements)
        slopes = slopes_of(covariates, len(mechanism.legs))
        setup = core_setup(placed, slopes)
        layout = (lay_out or layout_of)(mechanism, setup, options, readings, covariates)
        noise = options.declared(mechanism.noise)
        made = cls(mechanism, setup, layout, measurements, noise, options, covariates)
        made = made if marked else made._with_frames()
        return made._moved(layout.shift)

    @cached_property
    def observations(self) -> _core.Observations:
        """What was observed, as the core takes it."""
        return self.observed_in(self.measurements)

    def observed_in(
        self, measurements: Measurements, rows: NDArray[np.intp] | None = None
    ) -> _core.Observations:
        """The same of other measurements at these rows, or at all."""
        covariates = self.covariates
        if rows is not None:
            covariates = tuple(
                dataclasses.replace(each, values=each.values[rows]) for each in covariates
            )
        return observations_of(measurements, self.noise, covariates)

    def _with_frames(self) -> Problem:
        """Start free frames and places where the nominal robot's poses put them, by sessions."""
        if not self._is_free("session"):
            return self._with_own_frames()
        rows = sessions_of(self.measurements)
        started = self._of_rows(rows[max(rows)])._with_own_frames().setup
        slopes = np.array(started.base_slopes)
        for k, name in enumerate(started.base_covariates):
            number = name.removeprefix("session")
            if number == name or not self._is_free(name):
                continue
            own = dataclasses.replace(self._of_rows(rows[int(number)]), setup=started)
            with contextlib.suppress(NotIdentifiableError):  # too few poses: where the others are
                slopes[k] = own._moved_base()
        made = setup_with(started, self.mechanism.straight, base_slopes=slopes)
        return dataclasses.replace(self, setup=made)

    def _of_rows(self, rows: NDArray[np.bool_]) -> Problem:
        """The same of some of the rows."""
        covariates = tuple(
            dataclasses.replace(each, values=each.values[rows]) for each in self.covariates
        )
        some = self.measurements[rows]
        return dataclasses.replace(self, measurements=some, covariates=covariates)

    def _moved_base(self) -> Array:
        """How far from the setup's base these rows have it, as a tangent of six."""
        seen = self.measurements.points
        if seen is not None and np.isfinite(seen).any():
            places = np.zeros(len(self.setup.points), dtype=bool)
            own = (self.mechanism, self.setup, self.measurements, self.noise)
            found = setup_by_points(*own, base=True, target=False, free=places)
        else:
            found = self._with_posed_frames(base=True, target=False).setup
        return between(of_core(self.setup.base), of_core(found.base))

    def _with_own_frames(self) -> Problem:
        """Start free frames and places where the nominal robot's poses put them."""
        base, target = self._is_free("base"), self._is_free("target")
        seen = self.measurements.points
        points = seen is not None and bool(np.isfinite(seen).any())
        if points and (base or self._is_free("point")):
            made = self._with_points(base, target)
            return dataclasses.replace(made, setup=self._as_held(made.setup))
        if not (base or target):
            return self
        return self._with_posed_frames(base, target)

    def _moved(self, shift: Array) -> Problem:
        """Start the scalars elsewhere, as where ties hold that the drawing breaks."""
        setup = self.setup
        if not shift.any():
            return self
        legs, count = setup.parameters.shape
        by_leg = shift[: legs * (count + 3)].reshape(legs, count + 3)
        moved = self.mechanism.with_parameters(setup.parameters + by_leg[:, :count], symmetry=None)
        curvature = np.asarray(setup.curvature) + by_leg[:, count:]
        made = setup_with(setup, moved.straight, curvature=curvature)
        return dataclasses.replace(self, setup=made)

    def _is_free(self, block: str) -> bool:
        """Whether a frame, or a place, is unknown, and no prior says where it is."""
        layout = self.layout
        without = (layout.column >= 0) & np.append(np.isinf(layout.prior), False)[layout.column]
        return any(
            block in (own := layout.scalars[i].partition(".")[0], own.rstrip("0123456789"))
            for i in np.flatnonzero(without)
        )

    def _with_posed_frames(self, base: bool, target: bool) -> Problem:
        given = self.mechanism.frames
        if base and Seen.of(self.measurements).along_edge:
            edge = to_core(edge_of(self.mechanism, self.measurements))
            made = setup_with(self.setup, self.mechanism.straight, base=edge)
            return dataclasses.replace(self, setup=made)
        try:
            setup = _core.with_starting_frames(
                self.mechanism.straight,
                self.setup,
                self.observations,
                self.mechanism.home,
                base,
                target,
            )
        except NotIdentifiableError:
            raise
        except SymkinError as error:
            if given is not None and (given.base or given.target):
                return self
            raise NotIdentifiableError(
                f"the frames cannot be found from these measurements: {error}; say where they are "
                "nominally, in the [frames] of the mechanism's file"
            ) from error
        return dataclasses.replace(self, setup=self._as_held(setup))

    def _as_held(self, setup: _core.Setup) -> _core.Setup:
        """A setup with what is held of its frames as drawn, where only a part of one is free."""
        moves = self.layout.column >= 0
        moves[[scalar for scalar, *_ in self.layout.ties]] = True
        scalars, made = np.array(self.layout.scalars), {}
        for block in ("base", "target"):
            # Of the six that a frame has those that there are, as names say.
            own = [f"{block}.{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")]
            own[5] = f"{block}.phi" if f"{block}.phi" in scalars else own[5]
            held = np.array([bool((~moves & (scalars == name)).any()) for name in own])
            there = np.isin(own, scalars)
            if not held.any() or held[there].all():
                continue
            drawn, found = (of_core(getattr(each, block)) for each in (self.setup, setup))
            made[block] = to_core(stepped(drawn, np.where(held, 0.0, between(drawn, found))))
        if not made:
            return setup
        return setup_with(
            setup, self.mechanism.straight, base=made.get("base"), target=made.get("target")
        )

    def _with_points(self, base: bool, target: bool) -> Problem:
        layout = self.layout
        names = [layout.scalars[i] for i in np.flatnonzero(layout.column >= 0)]
        count = len(self.setup.points)
        free = np.array([f"point{i + 1}.x" in names for i in range(count)])
        setup = self.setup
        posed = np.isfinite(self.measurements.poses[:, : self.mechanism.space.size]).any()
        if posed and (base or target):
            setup, base = self._with_posed_frames(base, target).setup, False
        setup = setup_by_points(
            self.mechanism,
            setup,
            self.measurements,
            self.noise,
            base=base,
            target=target and not posed,
            free=free,
        )
        return dataclasses.replace(self, setup=setup)

    def fit(
        self,
        *,
        nearest: bool = False,
        loss: Loss | None = None,
        start: Array | None = None,
        whole: bool = True,
    ) -> _core.JointFit:
        """Fit; `nearest` takes of all solutions the nearest to the start.

        The latent poses start where forward kinematics has them, or at `start`. Poses that keep
        the solver from coming to rest are set aside, if it has to (`whole`).

        Raises
        ------
        NotIdentifiableError
            Without `nearest`, naming combinations of unknowns that nothing shows.
        """
        how = self.options.loss if loss is None else loss
        if start is None:
            start = self._starting_poses()
        fit = self._fitted(nearest, how, start)
        unlikely = _unlikely(fit, start) if how == "none" else []
        if unlikely:
            moved = fit.poses.copy()
            moved[unlikely] = np.nan
            again = self._fitted(nearest, how, moved)
            better = again.goodness.chi_square < fit.goodness.chi_square
            return again if again.converged and better and again.aside == fit.aside else fit
        stuck = whole and fit.failure == _STUCK
        return self._at_rest(fit, nearest, how, start) if stuck else fit

    def _starting_poses(self) -> Array:
        """Where the latent poses start, by where the base is in each row."""
        setup, measured = self.setup, self.measurements
        columns = [each.values for each in self.covariates if each.of == "base"]
        if not columns:
            return starting_poses(self.mechanism, setup, measured, self.observations)
        moves = np.column_stack(columns) @ setup.base_slopes
        poses = np.full(measured.poses.shape, np.nan)
        different, group = np.unique(moves, axis=0, return_inverse=True)
        for k, move in enumerate(different):
            rows = np.flatnonzero(group.ravel() == k)
            base = to_core(stepped(of_core(setup.base), move))
            there = setup_with(setup, self.mechanism.straight, base=base)
            own = measured.subset(rows) if len(different) > 1 else measured
            seen = own.observations(self.noise)
            poses[rows] = starting_poses(self.mechanism, there, own, seen)
        return poses

    def _at_rest(
        self, stuck: _core.JointFit, nearest: bool, loss: Loss, start: Array
    ) -> _core.JointFit:
        """Fit without the few poses that keep the solver from coming to rest, if that does it."""
        problem, fit = self, stuck
        for _ in range(math.floor(_FEW * len(start))):
            again = problem._fitted(nearest, loss, fit.poses)
            if again.converged:
                return again
            restless = _restless(fit, again)
            if restless < 0:
                break
            kept = without_pose(problem.measurements, restless)
            problem = dataclasses.replace(problem, measurements=kept)
            fit = problem._fitted(nearest, loss, start)
            if fit.failure != _STUCK:
                break
        return fit if fit.converged else stuck

    def _fitted(self, nearest: bool, loss: Loss, start: Array) -> _core.JointFit:
        layout = self.layout
        tolerances = layout.column_tolerances
        try:
            return _core.fit_jointly(
                self.mechanism.straight,
                self.setup,
                self.observations,
                layout.column.tolist(),
                layout.prior,
                loss,
                self._bend(loss),
                0.0 if self.options.noise == "estimate" else 1.0,  # of the residuals, or declared
                self.options.max_iterations,
                nearest,
                tolerances,
                start,
                ties=list(layout.ties),
                relations=layout.relations,
            )
        except NotIdentifiableError as error:
            scale = np.where(tolerances > 0, tolerances, 1e-3)
            unseen = with_combinations(error, layout.names, scale)
            if unseen.unseen:
                unseen.args = (f"{unseen}; {what_holds(self.mechanism, unseen.unseen)}",)
            raise unseen from None

    def _bend(self, loss: Loss) -> float:
        """Where the loss bends; of single observations as for one condition."""
        usual = _core.loss_bend(loss, 1) if self.options.loss_per == "reading" else 0.0
        return self.options.loss_scale or usual

    def with_layout(self, layout: Layout) -> Problem:
        """Return it with other unknowns or priors, from where these have them start."""
        made = dataclasses.replace(self, layout=layout)
        same = layout.scalars == self.layout.scalars
        return made._moved(layout.shift - self.layout.shift) if same else made

    def has_loss(self, fit: _core.JointFit) -> bool:
        """Whether a fit follows the residuals that a loss keeps."""
        return self.options.loss != "none" or math.isfinite(fit.student_degrees)

    def covariance_of(self, fit: _core.JointFit) -> Array:
        """Of a fit's unknowns, by noise and priors as they are declared, or as a loss has them."""
        return np.asarray(fit.covariance if self.has_loss(fit) else fit.model_covariance)

    def with_fitted_prior(self, fit: _core.JointFit) -> tuple[Problem, _core.JointFit]:
        """Fit scale and share of the tolerances, if that was asked for, and once more by them."""
        if self.options.prior != "fitted" or not fit.converged:
            return self, fit
        prior = fitted_prior(self.mechanism, self.layout, fit.change, self.covariance_of(fit))
        if prior is None:
            return self, fit
        problem = self.with_layout(prior.on(self.layout))
        problem = dataclasses.replace(problem, fitted_prior=prior)
        return problem, problem.fit(nearest=self.options.gauge == "nominal")

    def resolved(self) -> tuple[Problem, _core.JointFit, str]:
        """Fit under the gauge that was asked for, and a prior; says what the gauge did."""
        problem, fit, gauge = self._in_gauge()
        return *problem.with_fitted_prior(fit), gauge

    def _in_gauge(self) -> tuple[Problem, _core.JointFit, str]:
        gauge = self.options.gauge
        if gauge == "nominal":
            fit = self.fit(nearest=True)
            count = fit.gauge_directions
            words = (
                "of all solutions the nearest to the drawing, in tolerances, since "
                f"{count} direction{'s' * (count > 1)} of the unknowns no observation shows"
                if count
                else ""
            )
            return self, fit, words
        start = starting_poses(self.mechanism, self.setup, self.measurements, self.observations)
        try:
            return self, self.fit(start=start), ""
        except NotIdentifiableError as error:
            if not error.unseen:
                raise
        if gauge == "prior":
            problem = self.with_layout(self.layout.with_prior("tolerances"))
            words = (
                "the tolerances are priors of all parameters, since the observations alone do not "
                "show all of them"
            )
            return problem, problem.fit(start=start), words
        held = _datum(self.fit(nearest=True, start=start), self.layout)
        problem = self.with_layout(self.layout.without(held))
        names = ", ".join(self.layout.names[i] for i in held)
        verbs = ("is", "carries") if len(held) == 1 else ("are", "carry")
        return (
            problem,
            problem.fit(start=start),
            f"{names} {verbs[0]} held as drawn, and {verbs[1]} the others",
        )


def what_holds(mechanism: Mechanism, unseen: Sequence[str]) -> str:
    """What to ask for where combinations of unknowns are not shown, as an error names them."""
    both = all("base." in each and "target." in each for each in unseen)
    return FRAMES_ALIKE if unseen and both and not mechanism.space.turns else PRIORS_HOLD


def _restless(fit: _core.JointFit, again: _core.JointFit) -> int:
    """The pose that a new start from where a fit got stuck moves far more than any other, or -1.

    Of such a pose the observations hardly show a direction, along which their closures bend. It
    moves as far whatever the unknowns do, and the cost, which is of first order in the poses,
    rises with that: no step of the unknowns lowers it, however short.
    """
    moves = np.abs(again.poses - fit.poses).max(axis=1)
    moves[np.array(fit.conditions) == 0] = 0  # it may wander, and says nothing
    moves = np.nan_to_num(moves)
    pose = int(np.argmax(moves))
    others = np.delete(moves, pose)
    return pose if len(others) and moves[pose] > _FAR * others.max() else -1


def _unlikely(fit: _core.JointFit, start: Array) -> list[int]:
    """Poses, few, without a start of their own that a fit does not explain.

    Where its observations bend, such a pose may have ended on the wrong side of a fold, since it
    was taken in from its neighbours when the unknowns were not yet what they are.
    """
    if not fit.converged:
        return []
    tails = np.array([
        _core.chi_square_tail(square, count) if count else 1.0
        for square, count in zip(fit.chi_squares, fit.conditions, strict=True)
    ])  # fmt: skip
    poses = np.flatnonzero((tails < _UNLIKELY) & ~np.isfinite(start).all(axis=1)).tolist()
    return poses if len(poses) <= _FEW * len(start) else []


def observed_count(taken: Measurements) -> NDArray[np.intp]:
    """How many scalars were observed of each row; a rotation in space counts as three."""
    count = np.zeros(len(taken.poses), dtype=np.intp)
    for name in OBSERVED:
        values = getattr(taken, name)
        if values is not None:
            known = np.isfinite(values).reshape(len(values), -1)
            count += known.sum(axis=1)
            if name in ("poses", "reported") and taken.space.has_quaternion:
                count -= known[:, -1]
    return count


def spare_conditions(mechanism: Mechanism, taken: Measurements) -> NDArray[np.intp]:
    """How many more conditions each row has than its pose has coordinates.

    A leg of several closures has some beside the one that its reading is in.
    """
    beside = len(mechanism.legs) * (mechanism.closures - 1)
    return observed_count(taken) + beside - mechanism.space.dof


def without_pose(measurements: Measurements, pose: int) -> Measurements:
    """Without any observation of a pose, whose row stays."""
    changes: dict[str, Array] = {}
    for name in OBSERVED:
        values = getattr(measurements, name)
        if values is not None:
            changes[name] = np.array(values)
            changes[name][pose] = np.nan
            if OBSERVABLES[name].between_rows:
                changes[name][measurements.partner_places == pose] = np.nan
    return dataclasses.replace(measurements, **changes)  # type: ignore[arg-type]


def _touched(mechanism: Mechanism, measurements: Measurements) -> Array:
    """Where the nominal robot is at the readings of heights, and of both ends of rises."""
    heights, rises = measurements.heights, measurements.rises
    rows = np.zeros(len(measurements), dtype=bool)
    if heights is not None:
        rows |= np.isfinite(heights).ravel()
    if rises is not None:
        risen = np.isfinite(rises)
        rows |= risen.any(axis=1)
        rows[measurements.partner_places[risen]] = True
    if not rows.any():
        return np.zeros((0, 3))
    return np.asarray(mechanism.forward_kinematics(measurements.readings[rows])[0])


def _with_ruler(mechanism: Mechanism, measurements: Measurements) -> Mechanism:
    """The mechanism with its base where marks on a piece were measured, unless that is given."""
    frames = mechanism.frames or Frames()
    if frames.base:
        return mechanism
    base = ruler(mechanism, measurements)
    return mechanism.replace(frames=dataclasses.replace(frames, base=base))


def layout_of(
    mechanism: Mechanism,
    setup: _core.Setup,
    options: EstimateOptions,
    readings: Array,
    covariates: Sequence[Covariate] = (),
) -> Layout:
    """Which scalars are unknown, and their columns."""
    return Layout.of(
        mechanism,
        setup,
        free=options.free,
        fixed=options.fixed,
        shared=options.shared,
        tie=options.tie,
        prior=options.prior,
        frames=options.frames,
        sensor=options.sensor,
        largest_readings=_largest_readings(mechanism, readings),
        per={each.name: each.per for each in covariates},
        reference=[each.name for each in covariates if each.is_reference],
        bow=options.bow_deviation,
    )


def _largest_readings(mechanism: Mechanism, readings: Array) -> tuple[float, ...]:
    """For each leg the largest reading of the legs whose joints are of the same unit."""
    units = np.array([mechanism.leg_info(leg).reading_unit for leg in range(readings.shape[1])])
    return tuple(
        float(np.nanmax(np.abs(readings[:, units == unit]), initial=0.0)) for unit in units
    )


def says_nothing(seen: Iterable[str]) -> NotIdentifiableError:
    """Why observations of these kinds are none: poses have no more of them than freedoms."""
    kinds = " and ".join(dict.fromkeys(seen))
    return NotIdentifiableError(
        f"some pose explains any {kinds}, so they say nothing of what is unknown; observe more of "
        "the poses"
    )


def own_readings(mechanism: Mechanism, measurements: Measurements) -> Measurements:
    """Readings of the legs whose set the pose belongs to alone; legs without one hold always."""
    legs = np.arange(measurements.readings.shape[1])
    sets = measurements.leg_sets[:, None]
    own = (sets == ALL_LEGS) | (sets == legs) | ~mechanism.is_read
    return dataclasses.replace(measurements, readings=np.where(own, measurements.readings, np.nan))


def _with_surroundings(mechanism: Mechanism, measurements: Measurements) -> Mechanism:
    """The mechanism with a place, or none, for every point that was observed.

    Refuses anchors whose places nobody gave, and points that were not observed.
    """
    frames = mechanism.frames or Frames()
    for name, given in (("points", frames.points), ("distances", frames.anchors)):
        observed = getattr(measurements, name)
        count = 0 if observed is None else observed.shape[1]
        if count and (count < len(given) or (name == "distances" and count > len(given))):
            key = "points" if name == "points" else "anchors"
            place = ", ".join("xyz"[: mechanism.space.size])
            raise SymkinError(
                f"{count} {name} were observed, and {len(given)} {key} are given; "
                + (
                    "say the nominal places of their fixed points in the device's frame in the "
                    f"[frames] of the mechanism's file: anchors = [[{place}], ...]"
                    if key == "anchors"
                    else "expected as many columns, empty for what was hidden"
                )
            )
    if measurements.points is None:
        return mechanism
    more = measurements.points.shape[1] - len(frames.points)
    if more <= 0:
        return mechanism
    places = (*frames.points, *((),) * more)
    return mechanism.replace(frames=dataclasses.replace(frames, points=places))


def _datum(fit: _core.JointFit, layout: Layout) -> list[int]:
    """Columns that, held, settle what no observation and no prior shows.

    The largest effect first, of equal ones that of the first column: rounding shall not choose.
    """
    tolerances = layout.column_tolerances
    scale = np.where(tolerances > 0, tolerances, 1e-3)
    unseen = np.asarray(fit.unseen)
    # Directions that a prior sees are settled.
    seen = layout.prior_rows @ (scale[:, None] * unseen)
    _, values, vectors = np.linalg.svd(seen)
    silent = np.pad(values, (0, vectors.shape[0] - len(values))) < UNSEEN
    left = unseen @ vectors[silent].T
    left = left * np.where(tolerances > 0, 1.0, 1e-6)[:, None]  # parameters before frames
    held: list[int] = []
    for _ in range(left.shape[1]):
        sizes = np.linalg.norm(left, axis=1)
        column = int(np.argmax(sizes > (1 - 1e-6) * sizes.max()))
        held.append(column)
        along = left[column] / np.linalg.norm(left[column])
        left = left - np.outer(left @ along, along)
    return sorted(held)
