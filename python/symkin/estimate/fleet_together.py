# SPDX-License-Identifier: MIT
"""A robot of a fleet of which all is estimated together, as `identify` does alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symkin.analysis.evaluation import closures_of
from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.estimate import Estimate
from symkin.estimate.evidence.findings import Doubt, Note
from symkin.estimate.identification import identify
from symkin.estimate.options import EstimateOptions
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.values import Array, Value, record


@record
class FoundTogether(Value):
    """What a row of a fleet has of a robot."""

    failure: str  # why there is no estimate; or empty
    doubts: tuple[Doubt, ...] = ()  # what speaks against it
    notes: tuple[Note, ...] = ()  # what to know of it
    redrawn: Mechanism | None = None  # the drawing as the likely cause would have it
    # As the core's fleet has them, of one robot; deviations of what is held are zero. Empty for one
    # that failed.
    columns: Mapping[str, Array] | None = None
    # Of each unknown of the frames: its unit, value and standard deviation.
    surroundings: Mapping[str, tuple[str, float, float]] | None = None


def found_together(
    nominal: Mechanism,
    robots: Sequence[Measurements],
    options: EstimateOptions,
    asked: Mapping[str, Any],
) -> list[FoundTogether]:
    """Identify robots, each by itself; `asked` is what is unknown, as `identify` takes it."""
    how = {name: getattr(options, name) for name in ("poses", "loss", "loss_scale")}
    how |= {"noise": options.noise, "max_iterations": options.max_iterations, **asked}
    made = []
    for measured in robots:
        try:
            found = identify(nominal, measured, "joint", **how)
        except SymkinError as error:
            made.append(FoundTogether(str(error)))
            continue
        made.append(_row(found) if found.converged else FoundTogether(found.failure))
    return made


def surroundings_of(
    robots: int, found: Mapping[int, FoundTogether]
) -> tuple[tuple[tuple[str, str], ...], Array]:
    """Names and units of what was estimated besides the legs, and of each robot's the estimates.

    These have shape (robots, surroundings, 2): value and standard deviation.
    """
    names = {
        name: unit
        for each in found.values()
        for name, (unit, *_) in (each.surroundings or {}).items()
    }
    values = np.full((robots, len(names), 2), np.nan)
    for robot, each in found.items():
        for at, name in enumerate(names):
            if name in (each.surroundings or {}):
                values[robot, at] = (each.surroundings or {})[name][1:]
    return tuple(names.items()), values


def _row(found: Estimate) -> FoundTogether:
    deviations = found.mechanism.deviations
    assert deviations is not None  # it is calibrated
    numbers = {
        "parameters": found.mechanism.parameters.ravel(),
        "deviations": np.nan_to_num(deviations).ravel(),
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.degrees_of_freedom,
        "limit": found.limit,
        "least": found.least,
        "residual_rms": _residual_rms(found),
        "rejected": len(found.rejected),
    }
    return FoundTogether(
        failure="",
        doubts=found.doubts,
        notes=found.notes,
        redrawn=found.redrawn,
        columns={name: np.atleast_1d(np.asarray(each, float)) for name, each in numbers.items()},
        surroundings={
            each.name: (each.unit, each.value, each.deviation)
            for each in found.unknowns
            if not each.name.startswith("leg") and np.isfinite(each.deviation)
        },
    )


def _residual_rms(found: Estimate) -> float:
    """Closures at the poses that were measured in full, in the frames that were found."""
    measured = found.measurements
    full = measured.subset(np.flatnonzero(np.isfinite(measured.poses).all(axis=1)))
    if not len(full.poses):
        return float("nan")
    poses = unframed(found.mechanism, full.poses)
    straight = Measurements.of(poses, full.readings, pose_space=full.pose_space)
    return float(np.sqrt(np.nanmean(closures_of(found.mechanism, straight) ** 2)))
