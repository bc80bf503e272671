# SPDX-License-Identifier: MIT
"""A robot and a table as they may have been meant, fitted with the tolerances as priors."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.covariates import Covariate, slopes_of
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.measured import Taken, nearer_other_root
from symkin.estimate.evidence.watching import looked
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem, layout_of
from symkin.estimate.unknowns import Layout
from symkin.model.core_setup import core_setup
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.values import Array, evenly

Cause = Doubt | Callable[[_core.JointFit], Doubt | None]  # which may depend on the fit

LITTLE = 9.0  # of chi-square per degree: what more leaves explains nothing
SECOND = (40, 40)  # poses and steps of what the first looks leave
_FAR_TOO_GOOD = 0.01  # per degree: observations have lost what they say
_WIDER = 3  # times as many steps for what is further from its start
_REJECTED = 0.5  # of a pose's weight: below it a loss rejects the pose
_NEARLY_EXACT = 0.01  # of the noise of positions
_ASIDE = 0.1  # share of the poses that may remain without explanation, if not one
_ROUNDS = 3  # of giving the values of a column to rows by a robot that has learnt from them


@dataclasses.dataclass(frozen=True, eq=False)
class Statement:
    """A robot and how it is fitted, with tolerances as priors; laid out once for all readings.

    `alike` is another of the same robot that differs in the priors of some unknowns alone.
    """

    mechanism: Mechanism
    options: EstimateOptions
    alike: Statement | None = None

    def problem(self, measurements: Measurements, steps: int) -> Problem:
        """Of some measurements; errors are those of `identify`."""
        options = dataclasses.replace(self._options, max_iterations=steps)
        return Problem.of(self.mechanism, measurements, options, self._laid_out)

    def known(self, measurements: Measurements) -> Mapping[str, tuple[tuple[int, ...], bool]]:
        """Of each parameter the legs where it could be free, and whether it is held in all.

        Without those that are held in some; shared ones are free.
        """
        robot = self.mechanism
        covariates = self._options.covariates(robot, measurements)
        setup = core_setup(robot, slopes=slopes_of(covariates, len(robot.legs)))
        layout = self._laid_out(robot, setup, self._options, measurements.readings, covariates)
        places = {name: place for place, name in enumerate(layout.scalars)}
        free = np.asarray(layout.by_columns.any(axis=1))
        known: dict[str, tuple[tuple[int, ...], bool]] = {}
        for name in robot.parameter_names:
            own = {leg: places.get(f"leg{leg + 1}.{name}") for leg in range(len(robot.legs))}
            open_ = {
                leg: place
                for leg, place in own.items()
                if place is not None and not layout.always_held[place]
            }
            held = {not free[place] for place in open_.values()}
            if len(held) == 1:
                known[name] = tuple(open_), held.pop()
        return known

    @property
    def noise(self) -> NoiseSettings:
        """As it was declared, if it was, else the mechanism's."""
        given = self.options.noise
        return given if isinstance(given, NoiseSettings) else self.mechanism.noise

    @cached_property
    def _options(self) -> EstimateOptions:
        given, robot = self.options, self.mechanism
        noise = given.noise if isinstance(given.noise, NoiseSettings) else None
        declared = self.noise
        if len(robot.legs) > robot.space.dof and not declared.reading:
            # More exact readings than a pose has coordinates leave no pose.
            arm = robot.characteristic_length if robot.reading_unit == "rad" else 1.0
            noise = dataclasses.replace(declared, reading=_NEARLY_EXACT * declared.position / arm)
        return dataclasses.replace(given, gauge="prior", loss="none", loss_per="pose", noise=noise)

    @cached_property
    def _layouts(self) -> dict[object, Layout]:
        return {}

    def _laid_out(
        self,
        mechanism: Mechanism,
        setup: _core.Setup,
        options: EstimateOptions,
        readings: Array,
        covariates: Sequence[Covariate] = (),
    ) -> Layout:
        """As `layout_of`, once for all tables that have it in common."""
        largest = ()  # the tolerance of a quadratic term depends on the readings
        if options.sensor == "quadratic":
            largest = tuple(np.nanmax(np.abs(readings), axis=0, initial=0.0).tolist())
        key = largest, tuple((each.name, each.per, each.is_reference) for each in covariates)
        if key not in self._layouts:
            other = self.alike
            if other is not None and isinstance(options.prior, Mapping):
                asked = mechanism, setup, other._options, readings, covariates
                self._layouts[key] = other._laid_out(*asked).with_prior(options.prior)
            else:
                made = layout_of(mechanism, setup, options, readings, covariates)
                self._layouts[key] = made.with_prior("tolerances")
        return self._layouts[key]


class Correction(NamedTuple):
    """What to fit instead; `wide` counts unknowns besides, `left_out` rows that it does without.

    `again` makes the same correction by a robot that is better known than the drawing; None where
    it does not depend on the robot, or there is nothing to correct. `redrawn`: the mistake is a
    number of the drawing, which the mechanism has as it is found, and nothing more is free.
    """

    cause: Cause
    model: Statement
    measurements: Measurements
    wide: int = 0
    again: Callable[[Mechanism], Correction | None] | None = None
    left_out: int = 0
    redrawn: bool = False

    @property
    def mechanism(self) -> Mechanism:
        """The robot that it may have been."""
        return self.model.mechanism

    @property
    def options(self) -> EstimateOptions:
        """What it is asked for."""
        return self.model.options

    @property
    def columns(self) -> int:
        """How many columns of readings can be wrong: of legs with a sensor, which are the first."""
        return self.mechanism.reading_count

    def of(self, cause: Cause, mechanism: Mechanism, options: EstimateOptions) -> Correction:
        """Of another robot, or fitted otherwise."""
        return self._replace(cause=cause, model=Statement(mechanism, options))

    def fit(
        self, steps: int, *, whole: bool = True, start: Array | None = None
    ) -> _core.JointFit | None:
        """With tolerances as priors; None where that has no solution, or not the `whole` of it."""
        looked()
        try:
            fit = self.model.problem(self.measurements, steps).fit(start=start, whole=whole)
        except SymkinError:
            return None
        explained = len(fit.aside) <= max(_ASIDE * len(self.measurements.poses), 1)
        good = explained and fit.goodness.degrees_of_freedom > 0 and (fit.converged or not whole)
        # A closure does not know its leg's mode: what fits another robot than this is none of it.
        return (
            fit if good and not (per_degree(fit) < LITTLE and self._in_other_modes(fit)) else None
        )

    def _in_other_modes(self, fit: _core.JointFit) -> bool:
        """Whether at fitted poses most readings of any leg are those of another mode."""
        measured = self.measurements
        try:
            robot = self.mechanism.with_parameters(fit.setup.parameters, symmetry=None)
        except SymkinError:  # the estimate is no mechanism
            return False
        taken = Taken(robot, robot, fit.poses, measured.readings, measured.row_numbers)
        other = nearer_other_root(taken)
        return any(
            other[rows, leg].sum() > len(rows) // 2
            for leg in range(other.shape[1])
            if len(rows := taken.rows(leg))
        )

    def look(self, poses: int, steps: int) -> float:
        """What comes first in a look at few poses: not where observations lost what they say."""
        value = per_degree(
            self.some(poses).fit(_WIDER * steps if self.wide else steps, whole=False)
        )
        return value if value > _FAR_TOO_GOOD else math.inf

    def settled(self, learn: Callable[[Correction], Mechanism | None]) -> Correction:
        """Make it again by what a robot learns from it, till that changes nothing."""
        correction = self
        for _ in range(_ROUNDS):
            if correction.again is None:
                break
            try:
                learnt = learn(correction)
                made = None if learnt is None else correction.again(learnt)
            except SymkinError:
                break
            if made is None or (
                made.model is correction.model and made.measurements == correction.measurements
            ):
                break
            correction = made
        return correction

    def some(self, most: int) -> Correction:
        """With few of the poses, evenly spread, and over the sets of the legs too."""
        order = np.argsort(self.measurements.leg_sets, kind="stable")
        return self.subset(np.sort(order[evenly(len(order), most)]))

    def subset(self, rows: NDArray[np.intp]) -> Correction:
        """With some of the poses."""
        return self._replace(measurements=self.measurements.subset(rows))

    def not_rejected(self) -> NDArray[np.intp]:
        """Rows that the loss keeps; all unless it keeps most, of which a wrong robot has few."""
        every = np.arange(len(self.measurements.poses))
        try:
            fit = self.model.problem(self.measurements, SECOND[1]).fit(loss=self.options.loss)
        except SymkinError:
            return every
        kept = np.flatnonzero(np.asarray(fit.loss_weights) >= _REJECTED)
        return kept if 2 * len(kept) > len(every) else every

    @property
    def key(self) -> object:
        """The same for the same correction from another start."""
        cause = self.cause
        if not isinstance(cause, Doubt):
            return id(cause)
        # A number is found a little otherwise from elsewhere.
        return (cause.code, cause.figures.get("name")) if self.redrawn else cause.words

    def told(self, fit: _core.JointFit | None) -> Doubt | None:
        """What it says the mistake is; None of what depends on a fit that there is not."""
        if isinstance(self.cause, Doubt):
            return self.cause
        return None if fit is None else self.cause(fit)


def with_priors(options: EstimateOptions, priors: Mapping[str, float]) -> EstimateOptions:
    """With priors beside those that are asked for by name, or over them."""
    given = options.prior if isinstance(options.prior, Mapping) else {}
    return dataclasses.replace(options, prior={**given, **priors})


def per_degree(fit: _core.JointFit | None) -> float:
    """Chi-square per degree of freedom; infinite without a fit."""
    return math.inf if fit is None else fit.goodness.chi_square / fit.goodness.degrees_of_freedom
