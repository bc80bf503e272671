# SPDX-License-Identifier: MIT
"""What is unknown of a robot as it is measured: the columns that its scalars make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.errors import SymkinError, one_of
from symkin.estimate.scalars import (
    BOW,
    CLOCK,
    Names,
    reasons_held,
    sorts_of,
    tolerances_of,
    units_of,
)
from symkin.estimate.sharing import followers_by_role, written_tie
from symkin.estimate.ties import Equation, Solved, equations_of, solved
from symkin.model.chains import CURVATURE_TERMS
from symkin.model.core_setup import scalar_values
from symkin.model.mechanism import Mechanism
from symkin.options import Frame, Prior, Sensor
from symkin.storage.quantities import evaluate_quantity
from symkin.values import Array, Value, field, record

__all__ = [
    "BED",
    "FRAMES",
    "SAG",
    "SCALE",
    "Layout",
    "Priors",
    "widening_of",
]

Priors = str | Mapping[str, float | str]

FRAMES: tuple[str, ...] = get_args(Frame)
_CURVATURE = {
    "linear": (),
    "quadratic": ("sensor_quadratic",),
    "eccentric": ("sensor_cosine", "sensor_sine"),
}
SCALE, BED, SAG = "scale", "bed", "sag"  # what may be assumed besides scalars,
TOLERANCES = "tolerances"  # and that all that is held of the legs is off by so many of these
_NO_TOLERANCE = 1e-6  # m or rad: next to what is made within a tolerance, as good as held
_WEAK = 1e-6  # of a tolerance that is no prior, next to those that are


@record
class Layout(Value):
    """Which scalars are unknown, and in which column of the estimate each of them is.

    Attributes
    ----------
    scalars : tuple of str
        Names of all scalars of the setup, ``leg2.distal_length``, ``base.x``, ...; empty for one
        that the mechanism does not have.
    units : tuple of str
        Of each scalar.
    tolerances : ndarray
        Of each scalar; zero where there is none, as of a frame.
    always_held : tuple of str
        Of each scalar: why it is never free; empty if it may be.
    column : ndarray of int
        Of each scalar: its column, or -1 if it is held.
    names : tuple of str
        Of the columns: a scalar's, or ``distal_length`` for one that all legs share.
    prior : ndarray
        Standard deviation of each column about its start; infinite without a prior.
    relations : ndarray
        Priors of several columns together: these rows (k, columns) times their changes since the
        start are independent and standard normal.
    ties : tuple of (int, int, float)
        Scalars without a column of their own that follow columns, and by which factors.
    roles : tuple of int
        Those of them that are shared: mirror images, or mixed by a turn about a tilted axis.
    sums : tuple of int
        Those of them that keep a prior of their own, since a sum was measured.
    shift : ndarray
        Of each scalar: how far from the drawing it starts, so that all ties hold, where the priors
        have it.
    deviations : ndarray
        Of the prior of each scalar about the drawing; infinite without one.
    near : tuple of (dict of int to float, float, float)
        Sums of scalars that are nearly known: factors, by how much the drawing's is too large, and
        its standard deviation.
    joint_prior : (tuple of int, ndarray) or None
        Scalars whose changes since the drawing are normal with this covariance, instead of by their
        own `deviations`.
    """

    scalars: tuple[str, ...]
    units: tuple[str, ...]
    tolerances: Array
    always_held: tuple[str, ...]
    column: NDArray[np.intp]
    names: tuple[str, ...]
    prior: Array
    ties: tuple[tuple[int, int, float], ...] = ()
    roles: tuple[int, ...] = ()
    sums: tuple[int, ...] = ()
    shift: Array = field(default_factory=lambda: np.zeros(0))
    deviations: Array = field(default_factory=lambda: np.zeros(0))
    near: tuple[tuple[dict[int, float], float, float], ...] = ()
    relations: Array = field(default_factory=lambda: np.zeros((0, 0)))
    joint_prior: tuple[tuple[int, ...], Array] | None = None

    @classmethod
    def of(
        cls,
        mechanism: Mechanism,
        setup: _core.Setup,
        *,
        free: Sequence[str] | None = None,
        fixed: Sequence[str] = (),
        shared: Sequence[str] = (),
        tie: Sequence[str] = (),
        prior: Priors | None = None,
        frames: Sequence[str] = (),
        sensor: Sensor = "linear",
        largest_readings: Sequence[float] | None = None,
        per: Mapping[str, str] | None = None,
        reference: Sequence[str] = (),
        bow: float | None = None,
    ) -> Layout:
        """Lay out what is unknown; the arguments are those of `identify`.

        `largest_readings`, of each leg, make a length or an angle comparable with a sensor's
        quadratic term; by default 1 in its unit. `per`, by the names of covariates, are the units
        of their columns; slopes along them are unknown unless they are fixed. Of a `reference`
        they are only where `free` or a prior names them. `bow` is the deviation of a bed's, which
        is unknown if there is one.

        Raises
        ------
        SymkinError
            For a pattern that matches nothing, naming the nearest name; for a prior of what is not
            free; if nothing is free.
        """
        scalars = tuple(_core.unknown_names(mechanism.straight, setup))
        per = per or {}
        units = units_of(mechanism, scalars, per)
        one_of("sensor", sensor, Sensor)
        always_held = reasons_held(mechanism, scalars)
        given = [
            name
            for leg in range(len(mechanism.legs))
            for name, role in mechanism.leg_info(leg).parameter_roles.items()
            if role.is_given
        ]
        names = Names(scalars, _CURVATURE[sensor], always_held, given)
        sorts = sorts_of(mechanism, scalars, units)
        slopes = {i for i, name in enumerate(scalars) if per.keys() & {*name.split(".")}}
        chosen = _chosen_frames(names, frames) | _curved(mechanism, names, sensor)
        chosen |= names.matching("free", free) if free is not None else names.of_legs
        named = [*(free or ()), *(prior if isinstance(prior, Mapping) else ())]
        chosen = _with_slopes(names, chosen, slopes, reference, named)
        if bow is not None:
            chosen |= names.matching("bow", [BOW])
        shared = [shared] if isinstance(shared, str) else list(shared)
        if "growth" in per:  # of one part as of another
            shared = [*shared, "growth"]
        of_one_leg = _of_one_leg(mechanism, names)
        ties = [
            {of_one_leg.get(scalar, scalar) for scalar in _tie(names, pattern, sorts, shared)}
            for pattern in shared
        ]
        late = {i for i in slopes if sorts[i][0] == CLOCK}
        chosen -= {i for i in slopes - late if scalars[i].startswith(CLOCK)}
        ties += [late] * bool(late)
        chosen = chosen.union(*ties) - names.matching("fixed", fixed) | _placeless(mechanism, names)
        values = dict(zip(scalars, scalar_values(setup).tolist(), strict=True))
        equations = [*mechanism.ties, *([tie] if isinstance(tie, str) else tie)]
        exact, loose = _equations(mechanism, names, units, equations, values)
        bound = solved(exact, {names.scalars[i] for i in chosen}, values)
        followers = {names.index[name] for name in bound.by}
        if twice := followers & set().union(*ties):
            own = names.scalars[min(twice)]
            raise SymkinError(f"{own} is shared and tied; expected one of both")
        chosen -= followers
        if not chosen:
            raise SymkinError("nothing is free, so there is nothing to identify")
        groups = _groups(names, ties, chosen, sorts)
        follow = followers_by_role(mechanism, scalars, groups)
        column = np.full(len(scalars), -1, dtype=np.intp)
        for number, members in enumerate(groups):
            column[[each for each in members if each not in follow]] = number
        made = cls(
            scalars=scalars,
            units=units,
            tolerances=tolerances_of(
                mechanism, scalars, largest_readings or [1.0] * len(mechanism.legs)
            ),
            always_held=always_held,
            column=column,
            names=tuple(_name(names, members) for members in groups),
            prior=np.full(len(groups), np.inf),
            ties=_following(names, column, bound, follow),
            roles=tuple(sorted(follow)),
            sums=tuple(sorted(names.index[name] for name in bound.measured)),
        )
        is_bow = (np.array(scalars) == BOW) & (bow is not None)
        made = replace(
            made,
            shift=_off(bound, scalars, values),
            deviations=np.where(is_bow, bow if bow is not None else np.inf, np.inf),
            near=tuple(_near(each, names, units, values, made.by_columns) for each in loose),
        )
        return made.with_prior(prior) if prior is not None else made._settled()

    @property
    def column_tolerances(self) -> Array:
        """Tolerance of each column; zero where there is none."""
        found, of_column = np.zeros(len(self.names)), self.column >= 0
        np.maximum.at(found, self.column[of_column], self.tolerances[of_column])
        return found

    def rows_of(
        self,
        robot: _core.Mechanism,
        setup: _core.Setup,
        observations: _core.Observations,
        poses: Array,
    ) -> Array:
        """Whitened rows of what was observed, (N, r, columns); NaN where they are none."""
        rows = _core.observed_rows(
            robot,
            setup,
            observations,
            self.column.tolist(),
            self.prior,
            poses,
            ties=list(self.ties),
        )
        return np.asarray(rows.jacobian.reshape(len(poses), -1, len(self.names)))

    def of_every_scalar(self) -> Layout:
        """The layout in which every scalar that there is has a column of its own."""
        named = np.array([bool(name) for name in self.scalars])
        return replace(
            self,
            column=np.where(named, np.cumsum(named) - 1, -1),
            names=tuple(name for name in self.scalars if name),
            ties=(),
            roles=(),
            deviations=np.full(len(named), np.inf),
            near=(),
            joint_prior=None,
        )._settled()

    @property
    def by_columns(self) -> Array:
        """How the scalars move with the columns, shape (scalars, columns)."""
        found = np.zeros((len(self.scalars), len(self.names)))
        own = np.flatnonzero(self.column >= 0)
        found[own, self.column[own]] = 1.0
        for scalar, column, factor in self.ties:
            found[scalar, column] += factor
        return found

    @property
    def prior_rows(self) -> Array:
        """Rows that the priors make of the columns' changes standard normal, one column's first."""
        own = np.flatnonzero(np.isfinite(self.prior))
        return np.vstack([(np.eye(len(self.names)) / self.prior)[own], self.relations])

    @property
    def prior_information(self) -> Array:
        """What the priors say, as an information matrix."""
        return np.diag(self.prior**-2.0) + self.relations.T @ self.relations

    def prior_information_of(self, scalars: Sequence[int]) -> Array:
        """What their own priors say of scalars with columns, as an information matrix."""
        if self.joint_prior is None:
            return np.asarray(np.diag(self.deviations[list(scalars)] ** -2.0))
        places = [self.joint_prior[0].index(each) for each in scalars]
        return np.asarray(np.linalg.inv(self.joint_prior[1][np.ix_(places, places)]))

    def prior_of(self, scalar: int) -> float:
        """Standard deviation of the prior of a scalar with a column, whatever others have."""
        if self.joint_prior is not None and scalar in self.joint_prior[0]:
            return float(self.deviations[scalar])
        return float(self.prior[self.column[scalar]])

    def with_joint_prior(self, scalars: tuple[int, ...], covariance: Array) -> Layout:
        """Return it with one prior for several scalars in place of their own."""
        deviations = np.array(self.deviations)
        deviations[list(scalars)] = np.sqrt(np.diag(covariance))
        made = replace(self, deviations=deviations, joint_prior=(scalars, covariance))
        return made._settled()

    def _joint_rows(self) -> tuple[NDArray[np.intp], Array, Array]:
        """Columns of a joint prior, and its parts: a deviation of each alone, and rows."""
        assert self.joint_prior is not None
        scalars, covariance = (np.array(each) for each in self.joint_prior)
        kept = self.column[scalars] >= 0
        of_kept = covariance[np.ix_(kept, kept)]
        own = np.sqrt(np.diag(of_kept))
        wide = widening_of(of_kept)
        values, vectors = np.linalg.eigh(of_kept / np.outer(own, own))
        rest = np.maximum(1 / values - wide**-2, 0.0)
        rows = (np.sqrt(rest) * vectors).T[rest > 0] / own
        return self.column[scalars[kept]], wide * own, rows

    def _settled(self) -> Layout:
        """Return it with the priors of its columns, starting where they are met best."""
        by, count = self.by_columns, len(self.names)
        own = np.flatnonzero((self.column >= 0) & np.isfinite(self.deviations))
        widths = np.zeros(count)
        np.maximum.at(widths, self.column[own], self.deviations[own])
        precisions = np.divide(1.0, widths**2, out=np.zeros(count), where=widths > 0)
        joint = np.zeros((0, count))
        if self.joint_prior is not None:
            columns, alone, of_columns = self._joint_rows()
            precisions[columns] = alone**-2.0
            joint = np.zeros((len(of_columns), count))
            joint[:, columns] = of_columns
        sums = [scalar for scalar in self.sums if np.isfinite(self.deviations[scalar])]
        rows = [by[scalar] / self.deviations[scalar] for scalar in sums]
        rows += [self._sum_of(by, factors) / deviation for factors, _, deviation in self.near]
        for row in rows:  # of one column: a prior of its own like any other
            if np.count_nonzero(row) == 1:
                precisions += row**2
        together = [row for row in rows if np.count_nonzero(row) > 1]
        with np.errstate(divide="ignore"):
            prior = precisions**-0.5
        return replace(
            self,
            prior=prior,
            relations=np.vstack([np.array(together).reshape(-1, count), joint]),
            shift=self._nearest(by),
        )

    @staticmethod
    def _sum_of(values: Array, factors: Mapping[int, float]) -> Array:
        return np.asarray([*factors.values()] @ values[[*factors]])

    def _nearest(self, by: Array) -> Array:
        """Where ties hold that the drawing breaks: by priors, then nearest in tolerances."""
        shift, followers = self.shift, list(dict.fromkeys(scalar for scalar, _, _ in self.ties))
        if not shift.any() and not any(off for _, off, _ in self.near):
            return shift
        concerned = np.abs(by[followers]).sum(axis=0) > 0
        for factors, _, _ in self.near:
            concerned |= np.abs(self._sum_of(by, factors)) > 0
        rows = np.asarray((by[:, concerned] != 0).any(axis=1)) | (shift != 0)
        usual = np.where(self.tolerances > 0, self.tolerances, _NO_TOLERANCE)
        counts = np.isfinite(self.deviations)
        counts[[each for each in followers if each not in self.sums]] = False
        weights = np.where(counts, 1 / self.deviations, _WEAK / usual)[rows]
        matrix, off = [by[rows][:, concerned] * weights[:, None]], [shift[rows] * weights]
        for factors, drawn, deviation in self.near:
            matrix.append(self._sum_of(by, factors)[None, concerned] / deviation)
            off.append(np.atleast_1d(drawn + self._sum_of(shift, factors)) / deviation)
        moves = np.zeros(len(self.names))
        moves[concerned] = -np.linalg.lstsq(np.vstack(matrix), np.hstack(off), rcond=None)[0]
        return np.asarray(shift + by @ moves)

    @property
    def column_units(self) -> tuple[str, ...]:
        """Unit of each column."""
        return tuple(self.units[self.members(i)[0]] for i in range(len(self.names)))

    def members(self, column: int) -> NDArray[np.intp]:
        """Scalars that move with a column, the first by as much as it."""
        own = set(np.flatnonzero(self.column == column).tolist())
        own |= {scalar for scalar, each, _ in self.ties if each == column and scalar in self.roles}
        return np.array(sorted(own), dtype=np.intp)

    def with_prior(self, prior: Priors) -> Layout:
        """Return it with priors; columns that have one keep it where they are given none."""
        known = np.array(self.deviations)
        if isinstance(prior, str):
            one_of("prior", prior, Prior)
            columns = self.column[np.isfinite(known) & (self.column >= 0)]
            has_none = np.isinf(known) & ~np.isin(self.column, columns) & (self.tolerances > 0)
            return replace(self, deviations=np.where(has_none, self.tolerances, known))._settled()
        names = Names(self.scalars, CURVATURE_TERMS, self.always_held)
        for pattern, given in prior.items():
            for scalar in sorted(names.matching("prior", [pattern])):
                if scalar in self.roles:
                    continue
                if self.column[scalar] < 0 and scalar not in self.sums:
                    followed = any(scalar == each for each, _, _ in self.ties)
                    what = "is not free"
                    if followed:
                        what = 'follows others by a tie: one draw, unless that ends in ", measured"'
                    raise SymkinError(
                        f'prior "{pattern}" is of {self.scalars[scalar]}, which {what}'
                    )
                known[scalar] = _deviation(pattern, given, self.units[scalar])
        return replace(self, deviations=known)._settled()

    def declared(self, assume: Mapping[str, float | str]) -> dict[str, tuple[str, float]]:
        """Unit and standard deviation of each assumption: of scalars that are held or shared.

        Raises
        ------
        SymkinError
            For a pattern that matches nothing, or nothing that is held; a deviation that is none,
            or a bare number for scalars of several units.
        """
        names = Names(self.scalars, (), self.always_held)
        held_ones = np.flatnonzero(~self.by_columns.any(axis=1) | self._alike).tolist()
        of_legs = [each for each in held_ones if each in names.of_legs]
        found = self._off_by_tolerances(assume.get(TOLERANCES, 0.0), of_legs)
        for pattern, given in assume.items():
            if pattern == TOLERANCES:
                continue
            if pattern == BED and BOW in self.names:
                raise SymkinError(
                    f'assume "{BED}" is of a bed whose bow is estimated; expected one of both'
                )
            if pattern in (SCALE, BED, SAG):
                unit = "" if pattern == SCALE else "m"
                found[pattern] = unit, _deviation(pattern, given, unit, "assumption")
                continue
            matched = sorted(names.matching("assume", [pattern], (SCALE, BED, SAG, TOLERANCES)))
            held = [scalar for scalar in matched if scalar in held_ones]
            if not held:
                raise SymkinError(
                    f'assume "{pattern}" is of {self.scalars[matched[0]]}, which is estimated; '
                    "a prior says how far it may be from the drawing"
                )
            units = dict.fromkeys(self.units[scalar] for scalar in held)
            fitting = [unit for unit in units if _is_of(given, unit)]
            unit = (fitting or list(units))[0]
            if len(fitting) > 1:
                raise SymkinError(
                    f'assume "{pattern}" is {given}, of scalars in {" and ".join(units)}; expected '
                    "a unit, such as 1 mm"
                )
            for scalar in held:
                if self.units[scalar] == unit:
                    deviation = _deviation(pattern, given, unit, "assumption")
                    found[self.scalars[scalar]] = unit, deviation
        return found

    @property
    def _alike(self) -> NDArray[np.bool_]:
        """Which scalars of legs are estimated as one with others, from which they may differ."""
        own = self.column >= 0
        members = np.bincount(self.column[own], minlength=len(self.names))
        shared = np.zeros(len(self.column), dtype=bool)
        shared[own] = members[self.column[own]] > 1
        return np.asarray(shared & (self.tolerances > 0))

    def _off_by_tolerances(
        self, given: float | str, held: Sequence[int]
    ) -> dict[str, tuple[str, float]]:
        """What is held of the legs, off by so many times its tolerance; 0 counts it as exact."""
        if given in (0, "0"):
            return {}
        times = _deviation(TOLERANCES, given, "", "assumption")
        return {
            self.scalars[i]: (self.units[i], times * float(self.tolerances[i]))
            for i in held
            if self.tolerances[i] > 0
        }

    @property
    def length_powers(self) -> Array:
        """Of each scalar: 1 if it is a length, or makes lengths of readings; else 0."""
        joints = {
            name.partition(".")[0]: unit
            for name, unit in zip(self.scalars, self.units, strict=True)
            if name.endswith(".sensor_offset")
        }
        powers = np.zeros(len(self.scalars))
        for i, (name, unit) in enumerate(zip(self.scalars, self.units, strict=True)):
            block, _, own = name.partition(".")
            powers[i] = (joints[block] if own.startswith("sensor_") else unit) == "m"
        return powers

    def without(self, columns: Iterable[int]) -> Layout:
        """Return it with the scalars of some columns held."""
        kept = np.delete(np.arange(len(self.names)), list(columns))
        renumbered = np.full(len(self.names) + 1, -1, dtype=np.intp)
        renumbered[kept] = np.arange(len(kept))
        return replace(
            self,
            column=renumbered[self.column],
            names=tuple(self.names[i] for i in kept),
            ties=tuple((s, int(renumbered[c]), f) for s, c, f in self.ties if renumbered[c] >= 0),
        )._settled()


def widening_of(covariance: Array) -> float:
    """Times the deviation of each variable at which normal ones of its own never say too much."""
    own = np.sqrt(np.diag(covariance))
    return float(np.sqrt(np.linalg.eigvalsh(covariance / np.outer(own, own))[-1]))


def _with_slopes(
    names: Names, chosen: set[int], slopes: set[int], reference: Sequence[str], named: Sequence[str]
) -> set[int]:
    """With slopes along covariates; those of a reference are only where a session is named."""
    of_session = [each for each in named if "session" in each]
    others = {i for i in slopes if {*names.scalars[i].split(".")} & {*reference}}
    return (chosen | slopes) - others | (others & names.matching("free", of_session))


def _following(
    names: Names,
    column: NDArray[np.intp],
    bound: Solved,
    follow: Mapping[int, Mapping[int, float]],
) -> tuple[tuple[int, int, float], ...]:
    """Scalars that follow columns and by which factors: by equations, then by role."""

    def moves(scalar: int) -> list[tuple[int, float]]:
        terms = follow.get(scalar, {scalar: 1.0})
        return [(int(column[other]), factor) for other, factor in terms.items()]

    by_equations = (
        (names.index[name], each, factor * by)
        for name, terms in bound.by.items()
        for other, factor in terms.items()
        for each, by in moves(names.index[other])
        if factor
    )
    by_role = ((scalar, each, by) for scalar in sorted(follow) for each, by in moves(scalar))
    return *by_equations, *by_role


def _chosen_frames(names: Names, frames: Sequence[str]) -> set[int]:
    chosen: set[int] = set()
    for each in [frames] if isinstance(frames, str) else frames:
        one_of("frames", each, FRAMES)
        block = each.rstrip("s") + "*" if each in ("points", "anchors") else each
        matched = {i for name, i in names.index.items() if fnmatchcase(name, f"{block}.*")}
        matched.discard(names.index.get(BOW, -1))  # beds are flat but for who says otherwise
        if not matched:
            raise SymkinError(
                f'frames "{each}": this mechanism has none; give where they are nominally in the '
                "[frames] of its file"
                if each in ("points", "anchors")
                else f'frames "{each}": a planar mechanism has none'
            )
        chosen |= matched
    return chosen


def _placeless(mechanism: Mechanism, names: Names) -> set[int]:
    """Coordinates of points whose places nobody gave.

    Where a platform never turns, the base's frame does what the first of them would.
    """
    points = mechanism.frames.points if mechanism.frames else ()
    open_ = [f"point{i + 1}" for i, place in enumerate(points) if not len(place)]
    if not mechanism.space.turns and len(open_) == len(points):
        open_ = open_[1:]
    return {i for name, i in names.index.items() if name.partition(".")[0] in open_}


def _curved(mechanism: Mechanism, names: Names, sensor: Sensor) -> set[int]:
    if sensor == "eccentric" and mechanism.reading_unit != "rad":
        raise SymkinError(
            'sensor "eccentric" has a period of one turn, but the sensors of this mechanism read '
            "lengths"
        )
    return {i for name, i in names.index.items() if name.partition(".")[2] in _CURVATURE[sensor]}


def _tie(
    names: Names, pattern: str, sorts: Sequence[tuple[object, ...]], asked: Sequence[str]
) -> set[int]:
    """Scalars that a pattern shares; those of different sorts would each be by themselves."""
    tie = names.matching("shared", [pattern])
    if len({sorts[scalar] for scalar in tie}) == len(tie):
        found = [names.scalars[scalar] for scalar in sorted(tie)]
        own = found[0].partition(".")[2]
        shown = ", ".join(found[:2]) + ", ..." * (len(found) > 2)
        raise SymkinError(
            f'shared "{pattern}" ties nothing: it matches {shown}; expected one pattern of the '
            f'same parameter in several legs, such as "{own}", or "leg[12].{own}" of two'
            f"{_tie_instead(names, min(tie), sorts, (*tie, *names.matching('shared', asked)))}"
        )
    return tie


def _of_one_leg(mechanism: Mechanism, names: Names) -> dict[int, int]:
    """Scalars that are those of another reading of the same leg, and which."""
    pairs = [tie.split(" = ") for tie in mechanism.ties]
    return {names.index[same]: names.index[first] for first, same in pairs}


def _tie_instead(
    names: Names, first: int, sorts: Sequence[tuple[object, ...]], asked: Sequence[int]
) -> str:
    """Say how two names are tied: with what was asked for as well, or the same of another leg."""
    alike = [i for i, sort in enumerate(sorts) if sort == sorts[first]]
    _, unit, *_ = sorts[first]
    others = [i for i in (*sorted(asked), *alike) if i != first and sorts[i][1] == unit]
    if not others:
        return ""
    pair = sorted((first, others[0]))
    return f"; of two names: --tie '{' = '.join(names.scalars[i] for i in pair)}'"


def _equations(
    mechanism: Mechanism,
    names: Names,
    units: Sequence[str],
    ties: Sequence[str],
    values: Mapping[str, float],
) -> tuple[list[Equation], list[Equation]]:
    """Ties of the legs' parameters, exact ones and others; angles as drawn, by whole turns."""
    of_legs = {name: units[i] for name, i in names.index.items() if name.startswith("leg")}
    equations = []
    texts = [each for given in ties for each in written_tie(mechanism, given)]
    for tie in equations_of(texts, of_legs):
        unit = of_legs[next(iter(tie.factors))]
        if unit == "rad" and all(factor == round(factor) for factor in tie.factors.values()):
            drawn = sum(factor * values[name] for name, factor in tie.factors.items())
            turns = round((drawn - tie.constant) / (2 * np.pi))
            equations.append(tie._replace(constant=tie.constant + 2 * np.pi * turns))
        else:
            equations.append(tie)
    exact = [each for each in equations if not each.within]
    return exact, [each for each in equations if each.within]


def _off(bound: Solved, scalars: Sequence[str], values: Mapping[str, float]) -> Array:
    """Of each scalar: how far from the drawing ties have it where all that they leave is drawn."""
    found = np.zeros(len(scalars))
    for name, terms in bound.by.items():
        wanted = bound.constants[name] + sum(f * values[each] for each, f in terms.items())
        found[scalars.index(name)] = wanted - values[name]
    return found


def _near(
    tie: Equation,
    names: Names,
    units: Sequence[str],
    values: Mapping[str, float],
    by: Array,
) -> tuple[dict[int, float], float, float]:
    """What a tie within a deviation says: as `Layout.near` has it."""
    factors = {names.index[name]: factor for name, factor in tie.factors.items()}
    row = Layout._sum_of(by, factors)
    if not np.abs(row).max(initial=0.0) > 1e-9 * max(map(abs, factors.values())):
        raise SymkinError(f'tie "{tie.text}" says nothing of what is free')
    unit = units[next(iter(factors))]
    drawn = sum(factor * values[name] for name, factor in tie.factors.items())
    return factors, drawn - tie.constant, _deviation(tie.text, tie.within, unit, "width of tie")


def _groups(
    names: Names, ties: Sequence[set[int]], chosen: set[int], sorts: Sequence[object]
) -> list[list[int]]:
    """Scalars of each column, in the order of the scalars: tied where they are of one sort."""
    group_of: dict[int, tuple[int, object]] = {}
    for number, tie in enumerate(ties):
        for scalar in sorted(tie & chosen):
            if scalar in group_of:
                raise SymkinError(f"{names.scalars[scalar]} is shared twice; expected once")
            group_of[scalar] = (number, sorts[scalar])
    groups: dict[object, list[int]] = {}
    for scalar in sorted(chosen):
        groups.setdefault(group_of.get(scalar, scalar), []).append(scalar)
    return list(groups.values())


def _name(names: Names, members: Sequence[int]) -> str:
    first = names.scalars[members[0]]
    if first.startswith(f"{CLOCK}_"):
        return CLOCK
    if len(members) == 1:
        return first
    own = first.partition(".")[2]
    alike = sum(name.startswith("leg") and name.endswith(f".{own}") for name in names.index)
    if len(members) == alike:
        return own
    return "+".join(names.scalars[i].partition(".")[0] for i in members) + f".{own}"


def _is_of(given: float | str, unit: str) -> bool:
    """Whether a quantity may have this unit, as any number without one may."""
    if isinstance(given, str):
        try:
            evaluate_quantity(given, unit or "1")
        except SymkinError:
            return False
    return True


def _deviation(pattern: str, given: float | str, unit: str, what: str = "prior") -> float:
    value = given if isinstance(given, int | float) else _quantity(pattern, given, unit, what)
    if not 0 < value < np.inf:
        raise SymkinError(
            f'the {what} of "{pattern}" is {given}; expected a positive standard deviation '
            "(fixed holds a parameter)"
        )
    return float(value)


def _quantity(pattern: str, text: str, unit: str, what: str) -> float:
    try:
        return evaluate_quantity(text, unit or "1")
    except SymkinError as error:
        raise SymkinError(f'the {what} of "{pattern}" {error}') from error
