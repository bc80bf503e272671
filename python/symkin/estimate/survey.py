# SPDX-License-Identifier: MIT
"""What observations that are not made yet will say of the unknowns."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from symkin import _core
from symkin.analysis.observability import name_combination
from symkin.analysis.observed import Observed, Observing
from symkin.analysis.probing import with_bed_radius
from symkin.analysis.promises import (
    CONFIDENCE,
    ExpectedAccuracy,
    examined,
    parameter_effects,
    promised,
)
from symkin.analysis.promises import anywhere as largest_anywhere
from symkin.analysis.seen import Seen, with_defaults
from symkin.data.measurements import Measurements
from symkin.errors import NotIdentifiableError, SymkinError
from symkin.estimate.assumed import Assumed, moved_by, widened
from symkin.estimate.covariates import Covariate, observations_of, slopes_of
from symkin.estimate.options import EstimateOptions, Unknowns
from symkin.estimate.problem import Problem, layout_of, says_nothing, what_holds
from symkin.estimate.starting import starting_poses
from symkin.estimate.unknowns import BED, SAG, SCALE, Layout
from symkin.estimate.whitened import typical_sizes
from symkin.model.core_setup import core_setup, scalar_values
from symkin.model.mechanism import Mechanism
from symkin.model.poses import frame, pose_rows, transforms
from symkin.model.settings import Frames, asked_or_set, height_of_bed, unusual
from symkin.options import Coordinates
from symkin.values import Array, Value, field, record

FIRST_ROW = 2  # of a table that symkin writes, below its header
_RANK = 1e-9  # of the largest singular value, with the unknowns in their tolerances
_FEW_POSES = 200  # at which ranks are taken
_BLOCK = 4096  # poses whose effects are held together
_IN_CACHE = 500  # and made together
_OF_FRAMES = 12  # scalars of the base frame and the target
SILENT = 0.9  # of a prior's deviation: the data will say next to nothing
_PLANAR = ("x", "y")  # both together are all
_BESIDE = (SCALE, BED, SAG, "target", "plane")  # are no part of the robot


def form_of(effects: Array) -> Array:
    """Sum over poses of effects' effects, as a quadratic form of the unknowns, (n, 3, unknowns)."""
    rows = effects.reshape(-1, effects.shape[2])
    return np.asarray(rows.T @ rows)


@record
class PlannedUnknown(Value):
    """How well an unknown will be known.

    Attributes
    ----------
    name, unit : str
        As `Estimate.names` has it; ``m``, ``rad``, or empty for a number.
    deviation : float
        Expected standard deviation.
    tolerance, prior : float
        Standard deviations of manufacturing and of the prior; NaN without.
    """

    name: str
    unit: str
    deviation: float
    tolerance: float
    prior: float


@record
class HeldByPriors(Value):
    """What observations will say next to nothing of: the priors hold it.

    Attributes
    ----------
    combinations : tuple of str
        Of the unknowns, in tolerances.
    position, orientation : float
        The part of the expected end-effector error that comes from them, m and rad: no more poses
        of this kind make it smaller, and it is as right as the priors are.
    """

    combinations: tuple[str, ...]
    position: float = field(unit="m")
    orientation: float = field(unit="rad")


@record
class Survey(Value):
    """What will be observed of a robot beside its readings, and what of it is unknown then.

    Attributes
    ----------
    observed : Observed
        What will be observed, with the frames of the mechanism where it gives none itself.
    unknowns : tuple of str
        Names of the columns that are estimated.
    priors : ndarray
        Standard deviation of each about the drawing; infinite without a prior.
    assumed : tuple of Assumed
        What an estimate rests on besides; each is a further column of `effects`.
    """

    observed: Observed
    unknowns: tuple[str, ...]
    priors: Array
    mechanism: Mechanism = field(private=True)
    layout: Layout = field(private=True)
    options: EstimateOptions = field(private=True)
    assumed: tuple[Assumed, ...] = field(private=True, default=())
    # With the places that the drawing knows; the mechanism itself if that is not said.
    drawn: Mechanism | None = field(private=True, default=None)
    covariates: tuple[Covariate, ...] = field(private=True, default=())
    # What sessions will have of their own, which nobody knows before and no plan counts.
    sessions: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        poses: Array,
        observe: Observing | None,
        unknowns: Mapping[str, Any],
    ) -> Survey | None:
        """What was asked for at such poses; None if that is full poses and all parameters.

        What the arguments do not say is what the mechanism's `identification` does.

        Raises
        ------
        SymkinError
            For options that `identify` refuses, and for what nobody can know beforehand.
        """
        observe = Observed.of(mechanism, observe or ("pose" if mechanism.noise.varies else None))
        given = {name: unknowns.get(name) for name in Unknowns.__annotations__}
        wanted = asked_or_set(given, mechanism.identification)
        sessions = tuple(wanted.pop("sessions", ()))
        said = any(each is not None for each in given.values())
        asked = said or mechanism.ties or {*unusual(wanted)} & given.keys()
        if observe is None and not asked:
            return None
        readings = mechanism.inverse_kinematics(poses)
        drawn = mechanism.frames or Frames()
        observed, mechanism = placed(mechanism, "pose" if observe is None else observe)
        seen = Seen.by(observed.kinds, mechanism.space)
        wanted = with_defaults(wanted, mechanism.replace(frames=drawn), seen)
        if wanted.get("bow") is not None:
            probed = not seen.further.isdisjoint({"heights", "rises"})
            mechanism = with_bed_radius(mechanism, poses if probed else poses[:0])
        frames = wanted.get("frames") or ()
        floats = mechanism.device is not None and bool(frames or seen.nothing)
        floats = floats or (seen.tracked and "base" in frames and not drawn.base)
        if floats and "gauge" not in wanted:
            wanted.setdefault("prior", "tolerances")
        # Places that a plan is made for alone are no knowledge of the drawing's.
        more = ((),) * (len(observed.points) - len(drawn.points))
        known = dataclasses.replace(drawn, points=(*drawn.points, *more))
        options = EstimateOptions(**wanted)
        known_places = mechanism.replace(frames=known)
        layout = layout_of(known_places, core_setup(mechanism), options, readings)
        found = cls(
            observed,
            layout.names,
            layout.prior,
            mechanism,
            layout,
            options,
            drawn=known_places,
            sessions=sessions,
        )
        return found.with_datum(poses) if "readings" in observed.kinds else found

    def with_datum(self, poses: Array) -> Survey:
        """Return it with the tolerances as priors where poses do not show all, as `identify`."""
        if self.options.prior is not None or not self.unseen([self.rows(poses[:_FEW_POSES])]):
            return self
        options = dataclasses.replace(self.options, prior="tolerances")
        layout = self.layout.with_prior("tolerances")
        return dataclasses.replace(self, options=options, layout=layout, priors=layout.prior)

    def in_order(self, poses: Array) -> Survey:
        """Return the survey of poses that are visited in this order, with what changes meanwhile.

        Before the order is known, slopes along what goes with it are held.
        """
        readings = self.mechanism.inverse_kinematics(poses)
        taken = Measurements.of(poses, readings, pose_space=self.mechanism.pose_space)
        taken = dataclasses.replace(taken, row_numbers=taken.row_numbers + FIRST_ROW - 1)
        found = self.options.covariates(self.mechanism, taken)
        if not found:
            return self
        setup = core_setup(self.mechanism, slopes=slopes_of(found, len(self.mechanism.legs)))
        layout = layout_of(self.drawn or self.mechanism, setup, self.options, readings, found)
        return dataclasses.replace(
            self, unknowns=layout.names, priors=layout.prior, layout=layout, covariates=found
        )

    @property
    def together(self) -> int:
        """How many poses are measured together: pairs where something is observed between them."""
        return self.observed.together

    @property
    def floating(self) -> bool:
        """Whether points at unknown places, or nothing, are all that is seen of positions.

        Where the platform's frame is among them no observation shows, so that errors are those
        that no other base and platform frame would take away.
        """
        seen = self._seen
        if seen.nothing or (seen.between_rows and seen.further == {"separations"}):
            return True
        return seen.tracked and any(name.startswith("point") for name in self.unknowns)

    @property
    def turned_anyhow(self) -> bool:
        """Whether only the place of a target is seen of which nobody knows where it is.

        How the platform's frame is turned no observation shows then; errors of its orientation are
        those that no other turn would take away.
        """
        seen = self._seen
        return "target" in self.options.frames and seen.placed and not seen.turned

    @property
    def _seen(self) -> Seen:
        return Seen.by(self.observed.kinds, self.mechanism.space)

    @property
    def asked(self) -> dict[str, Any]:
        """What is unknown, as it was asked for."""
        return {name: getattr(self.options, name) for name in Unknowns.__annotations__}

    @property
    def scale(self) -> Array:
        """A typical size of each unknown: its tolerance, else its prior, else a small one."""
        return typical_sizes(self.layout)

    @property
    def prior_information(self) -> Array:
        """What the priors say, as an information matrix."""
        return self.layout.prior_information

    def rows(self, poses: Array, read: NDArray[np.bool_] | None = None) -> Array:
        """Rows that the observations bring at poses, shape (n, r, unknowns).

        Whitened, at the nominal values: the least squares of these rows is what `joint` solves. A
        pose with fewer conditions than another has rows of zeros; one out of reach, of NaN. `read`,
        shape (n, legs), says which readings are taken; by default all.

        Raises
        ------
        NotIdentifiableError
            If no pose says anything.
        """
        rows = self._rows(self.layout, poses, read)
        if not rows.shape[1]:
            raise says_nothing((*self.observed.kinds, "readings"))
        return rows

    def _rows(self, layout: Layout, poses: Array, read: NDArray[np.bool_] | None) -> Array:
        mechanism = self.mechanism
        readings = mechanism.inverse_kinematics(poses)
        reached = np.asarray(np.isfinite(readings).all(axis=1))
        if read is not None:
            readings = np.where(read, readings, np.nan)
        exact = Measurements.of(
            poses,
            readings,
            reading_unit=mechanism.reading_unit,
            pose_space=mechanism.pose_space,
        )
        taken = observations_of(self.observed.exact(exact), mechanism.noise, self.covariates)
        places = np.where(reached[:, None], poses, np.nan)
        return layout.rows_of(mechanism.straight, self._setup, taken, places)

    @property
    def _setup(self) -> _core.Setup:
        slopes = slopes_of(self.covariates, len(self.mechanism.legs))
        return core_setup(self.mechanism, slopes=slopes)

    def measured_rows(self, measured: Measurements) -> Array:
        """Rows of what is measured already, of any kind, without poses that no start is found for.

        Returns
        -------
        ndarray, shape (k, r, unknowns)
        """
        return self._measured_rows(self.layout, measured)[0]

    def _measured_rows(self, layout: Layout, measured: Measurements) -> tuple[Array, Array]:
        """Rows, and the poses that they are of."""
        if self.covariates:
            raise SymkinError(
                "what changes while poses are measured cannot be planned beside poses that were "
                "measured before; plan without drift, step, growth and backlash"
            )
        problem = Problem.of(self.mechanism, measured, self.options)
        setup, seen = problem.setup, problem.observations
        places = starting_poses(self.mechanism, setup, measured, seen)
        rows = layout.rows_of(self.mechanism.straight, setup, seen, places)
        found = np.isfinite(rows).all(axis=(1, 2))
        return rows[found], places[found]

    def assuming(
        self,
        poses: Array,
        read: NDArray[np.bool_] | None = None,
        measured: Measurements | None = None,
    ) -> Survey:
        """Return the survey with what `assume` declares, on which an estimate from poses rests.

        The arguments are those of `rows`, and what is measured already.

        Raises
        ------
        SymkinError
            For names that are estimated, or a bed that will not be probed.
        """
        declared = self.layout.declared(self.options.assume or {})
        if not declared:
            return self
        every = self.layout.of_every_scalar()
        parts = [(self._rows(every, poses, read), poses)]
        parts += [] if measured is None else [self._measured_rows(every, measured)]
        most = max(rows.shape[1] for rows, _ in parts)
        rows = np.concatenate(
            [np.pad(each, ((0, 0), (0, most - each.shape[1]), (0, 0))) for each, _ in parts]
        )
        places = np.concatenate([each for _, each in parts])
        touched = np.full(len(places), "height" in self.observed.kinds)
        values = scalar_values(self._setup)
        found = moved_by(declared, self.layout, rows, values, places, touched)
        return dataclasses.replace(self, assumed=found)

    def covariance(self, rows: Sequence[Array]) -> Array:
        """Covariance of the unknowns that rows and priors promise.

        Raises
        ------
        NotIdentifiableError
            Naming combinations that neither shows.
        """
        half = self._half(rows)
        return np.asarray(half @ half.T)

    def covariances(self, rows: Sequence[Array], taken: Iterable[Array]) -> Array:
        """The same of robots that are measured elsewhere, shape (robots, unknowns, unknowns).

        The first rows are those of where they are told to be, in place of which each has its own,
        `taken`.
        """
        half = self._half(rows)
        known = half.T @ self.prior_information @ half
        known += sum(form_of(each @ half) for each in rows[1:])
        forms = (known + form_of(each @ half) for each in taken)
        return np.stack([half @ np.linalg.inv(form) @ half.T for form in forms])

    def _half(self, rows: Sequence[Array]) -> Array:
        """Root H of the covariance H H' that rows and priors promise, see `covariance`."""
        values, vectors = self._decomposed([*rows, self.layout.prior_rows[None]])
        if len(values) < len(vectors):
            unseen = self._named(vectors[len(values) :])
            error = NotIdentifiableError(
                f"the plan's poses do not show all of the {len(vectors)} unknowns (not shown, in "
                f"tolerances: {'; '.join(unseen)}); {what_holds(self.mechanism, unseen)}"
            )
            error.unseen = unseen
            raise error
        return np.asarray((vectors / values[:, None] * self.scale).T)

    def unseen(self, rows: Sequence[Array]) -> tuple[str, ...]:
        """Combinations of unknowns, in tolerances, that the observations alone do not show."""
        values, vectors = self._decomposed(rows)
        return self._named(vectors[len(values) :])

    def held(
        self,
        workspace: ArrayLike | Any,
        covariance: Array,
        noise_factor: float = 1.0,
        conflict_factor: float = 1.0,
        of: Coordinates | None = None,
    ) -> HeldByPriors:
        """What of this covariance is the priors' own; see `HeldByPriors`.

        Combinations of unknowns that have priors, each in units of its own, whose deviation is not
        a tenth smaller than before. The factors widen what comes from them, as `widened_by` does.
        """
        known = np.flatnonzero(np.isfinite(self.priors))
        rows = self.layout.prior_rows
        rows = rows[(rows != 0)[:, np.delete(np.arange(rows.shape[1]), known)].sum(axis=1) == 0]
        # A root of their covariance before; without relations the priors' deviations.
        units = np.linalg.inv(np.linalg.cholesky(rows[:, known].T @ rows[:, known])).T
        back = np.linalg.inv(units)
        shares, vectors = np.linalg.eigh(back @ covariance[np.ix_(known, known)] @ back.T)
        kept = shares > SILENT**2
        if not kept.any():
            return HeldByPriors((), 0.0, 0.0)
        # What goes with each of these, which are independent of the other combinations.
        moves = covariance[:, known] @ back.T @ vectors[:, kept] / np.sqrt(shares[kept])
        apart = max(conflict_factor - noise_factor, 0.0)
        moves *= np.sqrt(noise_factor + apart * shares[kept])
        named = np.zeros((int(kept.sum()), len(self.scale)))
        named[:, known] = (units @ vectors[:, kept] / self.scale[known, None]).T
        expected = self.expected(workspace, moves @ moves.T, of=of)
        return HeldByPriors(self._named(named), expected.position, expected.orientation)

    def _decomposed(self, rows: Sequence[Array]) -> tuple[Array, Array]:
        """Singular values above zero, and all directions of the unknowns in their scale."""
        columns = len(self.scale)
        whole = [*(each.reshape(-1, columns) for each in rows), np.zeros((columns, columns))]
        _, values, vectors = np.linalg.svd(np.concatenate(whole) * self.scale, full_matrices=False)
        return values[values > _RANK * values[0]], vectors

    def _named(self, directions: Array) -> tuple[str, ...]:
        return tuple(name_combination(each, self.unknowns) for each in directions)

    def expected(
        self,
        workspace: ArrayLike | Any,
        covariance: Array,
        *,
        confidence: float = CONFIDENCE,
        noise_degrees: float = math.inf,
        anywhere: ArrayLike | Any | None = None,
        of: Coordinates | None = None,
    ) -> ExpectedAccuracy:
        """Error to expect of the target in the device's frame, at given readings.

        Without frames that is the platform's in the robot's own. What frames and parameters explain
        alike does not matter to it, however uncertain either is. `anywhere` are poses over which
        the largest error is bounded too. The covariance may be several robots', see `promised`. The
        position's error is `of` these coordinates, as `error_forms` has it.
        """
        poses = pose_rows(workspace)
        position, orientation, *counts = self.error_forms(poses, of)
        forms, known = (position, orientation), (confidence, noise_degrees)
        found = promised(forms, covariance, (counts[0], counts[1]), *known)
        found = dataclasses.replace(
            found, up_to_frames=self.floating, up_to_turn=self.turned_anyhow, of=of
        )
        if anywhere is None:
            return found
        where = examined(pose_rows(anywhere))
        effects, good = self.effects(where)
        largest = largest_anywhere(self.alone(effects, where[good], of), covariance, *known)
        return dataclasses.replace(
            found, position_anywhere=largest[0], orientation_anywhere=largest[1]
        )

    def error_weight(self, workspace: ArrayLike | Any) -> Array:
        """As `symkin.analysis.observability.error_weight`, by the unknowns."""
        position, orientation, *_ = self.error_forms(pose_rows(workspace))
        return np.asarray(position + self.mechanism.characteristic_length**2 * orientation)

    def promised(self, covariance: Array) -> tuple[PlannedUnknown, ...]:
        """How well each unknown will be known, with what was assumed."""
        layout, covariance = self.layout, widened(covariance, self.assumed)
        tolerances = layout.column_tolerances
        values = (
            np.sqrt(np.diag(covariance)),
            np.where(tolerances > 0, tolerances, np.nan),
            np.where(np.isfinite(self.priors), self.priors, np.nan),
        )
        columns = zip(*(each.tolist() for each in values), strict=True)
        named = zip(layout.names, layout.column_units, columns, strict=True)
        return tuple(PlannedUnknown(name, unit, *each) for name, unit, each in named)

    def error_forms(
        self, poses: Array, of: Coordinates | None = None
    ) -> tuple[Array, Array, int, int]:
        """Mean squared position and orientation errors over poses, by errors of the unknowns.

        Quadratic forms, shape (unknowns, unknowns); and how many poses are in them, and left out.
        The position's error is `of` these coordinates alone, in the device's frame: "z", "xy", or
        the "height" above the plane that heights are measured from; by default of all.
        """
        columns = len(self.unknowns) + len(self.assumed)
        forms, evaluated = np.zeros((2, columns, columns)), 0
        for first in range(0, len(poses), _BLOCK):
            block = poses[first : first + _BLOCK]
            effects, good = self.effects(block)
            evaluated += len(effects)
            effects = self.alone(effects, block[good], of)
            for form, part in zip(forms, (effects[:, :3], effects[:, 3:]), strict=True):
                form += form_of(part)
        if not evaluated:
            raise SymkinError(
                f'mechanism "{self.mechanism.name}" can take none of the {len(poses)} poses over '
                "which accuracy is expected"
            )
        position, orientation = forms / evaluated
        return position, orientation, evaluated, len(poses) - evaluated

    def alone(self, effects: Array, poses: Array, of: Coordinates | None) -> Array:
        """Effects at such poses, of whose positions all but these coordinates are left out."""
        if of is None:
            return effects
        kept = effects.copy()
        kept[:, :3] = 0
        if of == "height":
            kept[:, 2:3] = self._heights(poses)
        else:
            own = ["xyz".index(axis) for axis in of]
            kept[:, own] = effects[:, own]
        return kept

    def effects(self, poses: Array) -> tuple[Array, NDArray[np.bool_]]:
        """How the target moves in the device's frame with the unknowns, at the readings of poses.

        Shape (n, 6, unknowns + assumed): tangents of the poses that are neither out of reach nor
        singular; and which those are. What was assumed moves it by what the estimate makes of it,
        less what it does to the robot itself. See `floating` and `turned_anyhow`.
        """
        if self.floating or self.turned_anyhow:  # one motion of all poses
            return self._effects(poses)
        blocks = range(0, max(len(poses), 1), _IN_CACHE)
        parts = (self._effects(poses[at : at + _IN_CACHE]) for at in blocks)
        effects, good = zip(*parts, strict=True)
        return np.concatenate(effects), np.concatenate(good)

    def _effects(self, poses: Array) -> tuple[Array, NDArray[np.bool_]]:
        by_legs, good = parameter_effects(self.mechanism, poses)
        effects = by_legs.reshape(*by_legs.shape[:2], -1)
        onto, of_legs = self.layout.by_columns, effects.shape[2]
        frames = self.mechanism.frames or Frames()
        placed = frames.base or frames.target or onto[of_legs : of_legs + _OF_FRAMES].any()
        if placed or self.floating or self.turned_anyhow or self.assumed:
            effects = self._in_device(effects, poses[good], frames)
        return self._by_unknowns(effects), good

    def _by_unknowns(self, effects: Array) -> Array:
        """Effects of the unknowns and of what was assumed, of those of the first scalars."""
        onto = self.layout.by_columns[: effects.shape[2]]
        moved = by_columns(effects, onto)
        if not self.assumed:
            return moved
        beside = []
        for each in self.assumed:
            itself = np.zeros(len(onto))
            of_robot = not each.name.startswith(("point", "anchor"))
            if of_robot and each.name.partition(".")[0] not in _BESIDE:
                itself[self.layout.scalars.index(each.name)] = 1
            beside.append((moved @ each.moves - effects @ itself)[..., None])
        return np.concatenate([moved, *beside], axis=2)

    def _heights(self, poses: Array) -> Array:
        """How the target's height above the plane changes with the unknowns, shape (n, 1, ...).

        The plane ``z = c0 + c1 x + c2 y + bow (x^2 + y^2) / radius^2`` is in the robot's own frame,
        and may be unknown, too; see `Frames`.
        """
        frames, space = self.mechanism.frames or Frames(), self.mechanism.pose_space
        by_legs, _ = parameter_effects(self.mechanism, poses)
        platform = transforms(space, poses)
        arm = platform.rotation @ frame(space, frames.target).translation
        place = platform.translation + arm
        upright = np.broadcast_to(np.eye(3), platform.rotation.shape)
        moves = np.concatenate(
            [
                adjoint(upright, arm) @ by_legs.reshape(*by_legs.shape[:2], -1),
                np.zeros((len(poses), 6, 6)),  # the base's frame is the device's alone
                adjoint(platform.rotation, np.zeros_like(arm)),
            ],
            axis=2,
        )[:, :3]
        plane = frames.plane or (0.0, 0.0, 0.0)
        slopes, (bow, radius) = np.array(plane[1:3]), plane[3:] or (0.0, 1.0)
        across, length = place[:, :2], math.hypot(1.0, *slopes)
        tilts = slopes + 2 * bow / radius**2 * across
        above = moves[:, 2] - np.einsum("ni,nij->nj", tilts, moves[:, :2])
        # By slopes also the length changes by which the distance along z is divided.
        longer = (place[:, 2] - height_of_bed(plane, place))[:, None] * slopes / length**2
        bowed = np.square(across).sum(axis=1) / radius**2
        of_plane = -np.column_stack([np.ones(len(poses)), across + longer, bowed])
        heights = np.column_stack([above, of_plane]) / length
        return self._by_unknowns(heights[:, None, : len(self.layout.by_columns)])

    def _in_device(self, moves: Array, poses: Array, frames: Frames) -> Array:
        """Tangents of the target in the device's frame, by those of the platform and by frames."""
        mechanism, space = self.mechanism, self.mechanism.pose_space
        base, target = frame(space, frames.base), frame(space, frames.target)
        platform = transforms(space, poses)
        arm = platform.rotation @ target.translation
        seen = (platform.translation + arm) @ base.rotation.T
        turned = base.rotation @ platform.rotation
        frames_alone = np.concatenate(
            [
                adjoint(np.broadcast_to(np.eye(3), turned.shape), seen),
                adjoint(turned, np.zeros_like(seen)),
            ],
            axis=2,
        )
        of_legs = adjoint(np.broadcast_to(base.rotation, turned.shape), arm) @ moves
        effects = np.concatenate([of_legs, frames_alone], axis=2)
        if space == "point":
            effects[:, 3:] = 0
            frames_alone[:, 3:] = 0
        motions = frames_alone if self.floating else frames_alone[..., 9:]  # turns of the target
        if self.floating or self.turned_anyhow:
            effects = without_motions(effects, motions, mechanism.characteristic_length)
        return effects


def coordinates_of(mechanism: Mechanism) -> Coordinates | None:
    """Of which of them errors of the position are, by the mechanism's file; None: of all."""
    said = mechanism.identification
    return None if said is None else cast("Coordinates | None", said.of)


def check_coordinates(mechanism: Mechanism, of: str | None) -> None:
    """Refuse coordinates of a position that the robot does not have."""
    if of is None:
        return
    words = [each for each in get_args(Coordinates) if mechanism.space.in_space or each in _PLANAR]
    if not mechanism.space.moves or of not in words:
        wanted = f"expected {', '.join(words)}" if mechanism.space.moves else "it only turns"
        raise SymkinError(f'the platform of {mechanism.name} has no "{of}"; {wanted}')


def by_columns(effects: Array, onto: Array) -> Array:
    """Effects by columns, of those by scalars that they move; most columns move one alone."""
    chosen = onto.argmax(axis=0)
    if np.array_equal(onto, np.eye(len(onto))[:, chosen]):
        return np.asarray(effects[:, :, chosen])
    return np.asarray(effects @ onto)


def without_motions(effects: Array, motions: Array, length: float) -> Array:
    """Tangents less what constant motions make of them at best; a rotation counts at `length`."""
    scale = np.repeat([1.0, length], 3)[:, None]
    flat = (scale * effects).reshape(-1, effects.shape[2])
    basis, sizes, _ = np.linalg.svd(
        (scale * motions).reshape(-1, motions.shape[2]), full_matrices=False
    )
    if not len(sizes):
        return effects
    basis = basis[:, sizes > _RANK * sizes[0]]
    return np.asarray((flat - basis @ (basis.T @ flat)).reshape(effects.shape) / scale)


def adjoint(rotations: Array, arms: Array) -> Array:
    """Tangents of points at the ends of arms, turned, by those of where the arms begin."""
    made = np.zeros((len(arms), 6, 6))
    made[:, :3, :3] = made[:, 3:, 3:] = rotations
    made[:, :3, 3:] = rotations @ np.cross(arms[:, None], np.eye(3))
    return made


def placed(mechanism: Mechanism, observe: Observing) -> tuple[Observed, Mechanism]:
    """What is observed and the mechanism, with the same frames: those observed, else its own."""
    frames = mechanism.frames or Frames()
    observed = Observed.of(mechanism, observe)
    assert observed is not None  # since something was asked for
    for name in ("missing", "spread"):
        if getattr(observed, name):
            raise SymkinError(
                f"observe has {name} = {getattr(observed, name):g}; expected 0 in a plan, since "
                "nobody knows beforehand which rows that will be"
            )
    placed = Frames(
        base=observed.base or (),
        target=observed.target or (),
        points=observed.points or frames.points,
        anchors=observed.anchors or frames.anchors,
        zeros=observed.zeros if observed.anchors else frames.zeros,
        plane=observed.plane if mechanism.space.size == 3 else (),
    )
    return observed, mechanism.replace(frames=placed)
