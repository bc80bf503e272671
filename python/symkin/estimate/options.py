# SPDX-License-Identifier: MIT
"""How an estimate is made: what is unknown, from what, by which estimator."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Literal, TypedDict

from symkin.analysis.promises import CONFIDENCE
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError, one_of
from symkin.estimate.covariates import Covariate, covariates_of, steps_of
from symkin.estimate.unknowns import Priors
from symkin.model.mechanism import Mechanism
from symkin.model.settings import NoiseSettings
from symkin.options import (
    Coordinates,
    Estimator,
    Gauge,
    Loss,
    LossPer,
    Moving,
    PoseUse,
    Sensor,
    SessionsOwn,
    flags_of,
)
from symkin.shell import typed_word
from symkin.storage.quantities import evaluate_quantity
from symkin.values import Value, record

__all__ = [
    "ROBUST",
    "EstimateOptions",
    "Estimator",
    "FleetOptions",
    "IdentifyOptions",
    "Loss",
    "PoseUse",
    "Unknowns",
]

ROBUST: Loss = "cauchy"  # the loss that bears most: of gross errors, and of leverage


class Unknowns(TypedDict, total=False):
    """What is unknown, as the arguments of `identify` with these names."""

    free: Sequence[str] | None
    fixed: Sequence[str] | None
    shared: Sequence[str] | None
    tie: Sequence[str] | None
    prior: Priors | None
    frames: Sequence[str] | None
    sensor: Sensor | None
    drift: Sequence[str] | None
    step: Sequence[str | int] | str | int | None
    growth: bool | None
    backlash: bool | None
    assume: Mapping[str, float | str] | None
    sessions: Sequence[str] | None
    bow: float | str | None


class FleetOptions(Unknowns, total=False):
    """And how it is estimated, of one robot or of many."""

    poses: PoseUse
    loss: Loss
    loss_scale: float | None
    loss_per: LossPer | None
    noise: NoiseSettings | Literal["estimate"] | None
    max_iterations: int
    gauge: Gauge | None
    clock_offset: bool | None
    of: Coordinates | None


class IdentifyOptions(FleetOptions, total=False):
    """And with which confidence it is promised, of one robot."""

    confidence: float


@record
class EstimateOptions(Value):
    """What is unknown, and how it is estimated; the attributes are the arguments of `identify`."""

    estimator: Estimator = "implicit"
    poses: PoseUse = "all"
    loss: Loss = "none"
    loss_scale: float | None = None
    noise: NoiseSettings | Literal["estimate"] | None = None
    max_iterations: int = 100
    free: tuple[str, ...] | None = None
    fixed: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    tie: tuple[str, ...] = ()
    prior: Priors | None = None
    frames: tuple[str, ...] = ()
    sensor: Sensor = "linear"
    gauge: Gauge = "prior"
    loss_per: LossPer = "pose"
    assume: Mapping[str, float | str] | None = None
    drift: tuple[str, ...] = ()
    step: tuple[str, ...] = ()
    growth: bool = False
    backlash: bool = False
    sessions: tuple[str, ...] = ()
    clock_offset: bool = False
    bow: float | str | None = None
    confidence: float = CONFIDENCE
    of: Coordinates | None = None

    def __post_init__(self) -> None:
        """Refuse words that mean nothing, naming those that do."""
        choices = (("estimator", Estimator), ("poses", PoseUse), ("loss", Loss))
        for name, words in (*choices, ("sensor", Sensor), ("gauge", Gauge), ("loss_per", LossPer)):
            one_of(name, getattr(self, name), words)
        if self.loss == "robust":
            object.__setattr__(self, "loss", ROBUST)
        if isinstance(self.noise, str):
            one_of("noise", self.noise, ("estimate",))
        object.__setattr__(self, "step", steps_of(self.step))
        for name in ("free", "fixed", "shared", "tie", "frames", "drift", "sessions"):
            value = getattr(self, name)
            if value is not None:
                many = (value,) if isinstance(value, str) else tuple(value)
                object.__setattr__(self, name, many)
        for each in self.drift:
            one_of("drift", each, Moving)
        for each in self.sessions:
            one_of("sessions", each, SessionsOwn)
        if "noise" in self.sessions and self.noise == "estimate":
            raise SymkinError(
                'noise is "estimate" and of every session; expected one of both: of sessions it is '
                "estimated as so many times the declared one"
            )
        if self.bow is not None:
            object.__setattr__(self, "bow", _bow(self.bow))
        super().__post_init__()

    def on_command_line(self) -> str | None:
        """The same as options of the command, each after a space; None if it cannot say them."""
        stated = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        given = {
            each.name: stated[each.name]
            for each in dataclasses.fields(self)
            if stated[each.name] != each.default
        }
        words = flags_of(given)
        if not all(isinstance(value, str | int | float) for _, value in words):
            return None
        return "".join(
            f" {flag}" if value is True else f" {flag} {typed_word(value)}" for flag, value in words
        )

    def covariates(self, mechanism: Mechanism, measurements: Measurements) -> tuple[Covariate, ...]:
        """What may change while it is measured, by rows of the measurements."""
        return covariates_of(
            mechanism,
            measurements,
            drift=self.drift,
            step=self.step,
            growth=self.growth,
            backlash=self.backlash,
            sessions=self.sessions,
            clock_offset=self.clock_offset,
        )

    @property
    def bow_deviation(self) -> float | None:
        """How far the rim of a bed may be above its middle, m; None where it is not unknown."""
        return None if self.bow is None else float(self.bow)

    def declared(self, noise: NoiseSettings) -> NoiseSettings:
        """The noise that was given, or else this."""
        return self.noise if isinstance(self.noise, NoiseSettings) else noise


def _bow(given: float | str) -> float:
    """A bow's deviation, m."""
    try:
        value = evaluate_quantity(given, "m") if isinstance(given, str) else float(given)
    except SymkinError as error:
        raise SymkinError(f'the bow "{given}" {error}') from error
    if not 0 < value < math.inf:
        raise SymkinError(
            f"the bow is {given}; expected how far the rim of the bed may be above its middle, as "
            "a positive standard deviation"
        )
    return value
