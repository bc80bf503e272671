# SPDX-License-Identifier: MIT
"""What is found of some of the robots of a fleet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import Measurements
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.fleet_doubts import doubted, examined, impossible, suspects, unshown
from symkin.estimate.fleet_jobs import Identified, Job, Robots
from symkin.estimate.fleet_together import FoundTogether
from symkin.estimate.identification import identify
from symkin.estimate.options import EstimateOptions
from symkin.estimate.workshop import Share, share_of
from symkin.model.canonical import canonical
from symkin.model.mechanism import Mechanism
from symkin.model.settings import IdentificationSettings, unusual
from symkin.values import Array

COLUMNS = (
    "parameters",
    "deviations",
    "chi_square",
    "degrees_of_freedom",
    "residual_rms",
    "rejected",
)
_OF = "of"  # which is no unknown: of which errors is told when a robot is looked into


@dataclass
class FleetPart:
    """Rows of a fleet; doubts and what was estimated together by their places in it."""

    names: tuple[str, ...]
    failures: Sequence[str]
    columns: Mapping[str, Array]
    doubts: Mapping[int, tuple[Doubt, ...]]
    drawings: Mapping[int, Mechanism]  # as likely causes would have them
    together: Mapping[int, FoundTogether]
    unread: Mapping[tuple[str, ...], list[str]]
    typed: Mapping[int, str]  # what a command line takes for those to look into
    shares: Sequence[Share] = field(default_factory=list)


def part_of(job: Job, robots: Robots, identified: Identified, looked_at: int) -> FleetPart:
    """Judge robots that were identified; so many of a fleet were looked at before."""
    nominal, options = job.nominal, job.options
    size = len(nominal.legs), len(nominal.parameter_names)
    failures, found, together = identified
    parameters = found["parameters"].reshape(-1, *size)
    shown = np.flatnonzero(np.isfinite(parameters).all(axis=(1, 2)))
    values, _ = canonical(nominal, parameters[shown].reshape(-1, size[1]))
    parameters[shown] = values.reshape(-1, *size)
    deviations = found["deviations"].reshape(-1, *size)
    for robot in suspects(nominal, parameters, deviations):
        if not failures[robot]:
            failures[robot] = impossible(nominal, parameters[robot], deviations[robot])
    strange, hidden = doubted(nominal, options, parameters, deviations, found)
    measured = list(robots.values())
    strange |= np.array([bool(failure) for failure in failures], dtype=bool)

    def screened(which: NDArray[np.bool_]) -> dict[int, Measurements]:
        return {
            robot: each
            for robot in np.flatnonzero(which).tolist()
            if isinstance(each := measured[robot], Measurements)
            and robot not in together
            and each.complete
        }

    looks = (
        examined(nominal, options, screened(strange), looked_at),
        unshown(nominal, options, screened(hidden & ~strange)),
    )
    doubts = {number: each.doubts for number, each in together.items()}
    drawings = {number: each.redrawn for number, each in together.items() if each.redrawn}
    for look in looks:
        doubts |= look.doubts
        drawings |= look.drawings
        for robot, failure in look.failures.items():
            failures[robot] = failures[robot] or failure
    estimated = deviations > 0 if job.asked else nominal.is_estimated
    found |= {"parameters": parameters, "deviations": np.where(estimated, deviations, np.nan)}
    failed = np.array([bool(failure) for failure in failures], dtype=bool)
    for name in COLUMNS:
        found[name][failed] = np.nan
    return FleetPart(
        tuple(robots),
        failures,
        {name: found[name] for name in COLUMNS},
        doubts,
        drawings,
        together,
        _unread(robots),
        {
            robot: each.typed
            for robot in sorted({*np.flatnonzero(failed).tolist(), *doubts})
            if isinstance(each := measured[robot], Measurements)
            and (failures[robot] or doubts.get(robot))
        },
    )


def numbered(parts: Sequence[FleetPart], what: str) -> dict[int, Any]:
    """What parts have by places, by the places in the whole fleet."""
    found: dict[int, Any] = {}
    first = 0
    for part in parts:
        found |= {first + place: each for place, each in getattr(part, what).items()}
        first += len(part.names)
    return found


def shares_of(
    nominal: Mechanism, robots: Robots, options: EstimateOptions, failures: Sequence[str]
) -> list[Share]:
    """What robots that were identified say of tolerances, each once more with its covariance."""
    by_leg = options.estimator != "joint"
    own = {"estimator", "poses", "loss", "loss_scale", "noise", "max_iterations"}
    how = vars(options) if not by_leg else {name: getattr(options, name) for name in own}
    told = (
        identify(nominal, measured, **how)
        for measured, failure in zip(robots.values(), failures, strict=True)
        if not failure and not isinstance(measured, str)
    )
    return [share_of(each) for each in told if each.converged]


def asked_of(nominal: Mechanism, options: EstimateOptions) -> dict[str, Any]:
    """What is unknown, as `identify` takes it; empty if that is all parameters of all legs."""
    names = [name for name in vars(IdentificationSettings()) if name != "noise"]
    wanted = {name: getattr(options, name) for name in names}
    said = {name for name in wanted if getattr(nominal.identification, name, None) is not None}
    further = {*unusual(wanted)} - {_OF}
    noise = {"noise": options.noise} if isinstance(options.noise, str) else {}
    if not (further or noise):
        return {}
    return {name: wanted[name] for name in wanted if name in further | said | {_OF}} | noise


def _unread(robots: Robots) -> dict[tuple[str, ...], list[str]]:
    """The tables by the columns that nothing was read from, each once."""
    unread: dict[tuple[str, ...], dict[str, None]] = {}
    for name, each in robots.items():
        if isinstance(each, Measurements) and each.unread:
            unread.setdefault(each.unread, {})[each.source_name or name] = None
    return {columns: list(names) for columns, names in unread.items()}
