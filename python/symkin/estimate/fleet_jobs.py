# SPDX-License-Identifier: MIT
"""Where the robots of a fleet are identified: chunks of them, here or on workers."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from symkin import _core
from symkin.cluster import dask_client, require_version, spread
from symkin.data.measurements import Measurements
from symkin.estimate.fleet_together import FoundTogether, found_together
from symkin.estimate.identification import why_together
from symkin.estimate.options import EstimateOptions
from symkin.model.framing import unframed
from symkin.model.mechanism import Mechanism
from symkin.model.tolerances import noise_of
from symkin.values import Array
from symkin.version import version

Robots = Mapping[str, Measurements | str]
Identified = tuple[list[str], dict[str, Array], dict[int, FoundTogether]]

_CHUNK = 250  # robots that travel to a worker together
_COLUMNS = (
    "parameters",
    "deviations",
    "chi_square",
    "degrees_of_freedom",
    "limit",
    "least",
    "residual_rms",
    "rejected",
)


@dataclass
class Found:
    """What is known of some robots: failures, columns, and more of those estimated together."""

    failures: list[str]
    columns: Mapping[str, Array]
    together: Sequence[FoundTogether] = ()


@dataclass
class Job:
    """How robots are identified, wherever that is; `asked` is what is unknown, if not all."""

    nominal: Mechanism
    options: EstimateOptions
    asked: Mapping[str, Any]
    threads: int

    @cached_property
    def all_together(self) -> bool:
        """Whether every robot is identified as `identify` does, by itself."""
        return bool(self.asked or why_together(self.nominal, {}, self.options.noise))

    def those_together(self, robots: Mapping[int, Measurements]) -> dict[int, Measurements]:
        """Those that are, by their places."""
        if self.all_together:
            return dict(robots)
        return {place: each for place, each in robots.items() if each.incomplete_because}

    def refusals(self, robots: Mapping[int, Measurements]) -> dict[int, str]:
        """Why robots cannot be identified so, by the places of those that cannot."""
        coordinates, legs = expected = self.nominal.home.size, len(self.nominal.legs)
        refused = {}
        if self.options.estimator != "joint":
            refused = {
                place: f"{each.incomplete_because}, where the legs of all others are identified "
                'one by one from full poses; expected the estimator "joint", or the measurements '
                "without it"
                for place, each in robots.items()
                if each.incomplete_because
            }
        return refused | {
            place: f"poses of {each.poses.shape[1]} coordinates and readings of "
            f"{each.readings.shape[1]} legs; expected {coordinates} and {legs}"
            for place, each in robots.items()
            if (each.poses.shape[1], each.readings.shape[1]) != expected
        }

    def columns(self, robots: int) -> dict[str, Array]:
        """Columns of robots of which nothing is known yet."""
        fits = 1 if self.options.estimator == "joint" else len(self.nominal.legs)
        size = self.nominal.parameters.size
        widths = (size, size, fits, fits, fits, fits)
        shapes: list[tuple[int, ...]] = [(robots, width) for width in widths]
        shapes += [(robots,)] * 2
        return {name: np.full(shape, np.nan) for name, shape in zip(_COLUMNS, shapes, strict=True)}

    def identify(self, robots: Sequence[Measurements]) -> Found:
        """Identify some robots, all of them each by itself, or all at once."""
        if self.those_together({0: robots[0]}):
            return self._together(robots)
        options = self.options
        poses = [each.poses for each in robots]
        if self.nominal.frames is not None:
            ends = np.cumsum([len(each) for each in poses])
            poses = np.split(unframed(self.nominal, np.concatenate(poses)), ends[:-1])
        found = _core.identify_many(
            self.nominal.core,
            poses,
            [each.readings for each in robots],
            [each.leg_sets.astype(np.int64, copy=False) for each in robots],
            _core.Estimator.__members__[options.estimator],
            _core.PoseUse.__members__[options.poses],
            noise_of(options.declared(self.nominal.noise)),
            options.loss,
            options.loss_scale or 0.0,
            options.max_iterations,
            self.threads,
        )
        return Found(list(found.failures), {name: getattr(found, name) for name in _COLUMNS})

    def _together(self, robots: Sequence[Measurements]) -> Found:
        made = found_together(self.nominal, robots, self.options, self.asked)
        columns = self.columns(len(robots))
        for row, each in enumerate(made):
            for name, values in (each.columns or {}).items():
                columns[name][row] = values if columns[name].ndim > 1 else values[0]
        return Found([each.failure for each in made], columns, made)


@contextmanager
def identifying(
    job: Job, *, workers: int, scheduler: str | None
) -> Iterator[Callable[[Robots], Identified]]:
    """Here or on workers, for as long as the context lasts: a function that identifies robots.

    It returns their failures and columns, in their order, and more of those estimated together.
    """
    if workers == 1 and scheduler is None:
        yield partial(_identified, job, None)
        return
    job.threads = 1
    with dask_client(workers, scheduler) as client:
        yield partial(_identified, job, client)


def _identified(job: Job, client: Any, robots: Robots) -> Identified:
    failures = [each if isinstance(each, str) else "" for each in robots.values()]
    usable = {row: each for row, each in enumerate(robots.values()) if not isinstance(each, str)}
    Measurements.look_through([*usable.values()])
    for row, failure in job.refusals(usable).items():
        failures[row] = failure
        del usable[row]
    own = job.those_together(usable)
    alike = {row: each for row, each in usable.items() if row not in own} if own else usable
    columns = job.columns(len(robots))
    together: dict[int, FoundTogether] = {}
    computed = (_computed(job, client, *each) for each in ((alike, _CHUNK), (own, 1)))
    for rows, found in itertools.chain(*computed):
        for row, failure in zip(rows, found.failures, strict=True):
            failures[row] = failure
        first, end = rows[0], rows[-1] + 1
        places = slice(first, end) if end - first == len(rows) else np.array(rows)
        for name, values in found.columns.items():
            columns[name][places] = values
        if found.together:
            together.update(zip(rows, found.together, strict=True))
    return failures, columns, together


def _computed(
    job: Job, client: Any, robots: Mapping[int, Measurements], size: int
) -> Iterator[tuple[list[int], Found]]:
    """What is found of chunks of robots of this size, in whatever order they are ready."""
    if client is None:
        if robots:
            yield [*robots], job.identify([*robots.values()])
        return
    places = [[*robots][first : first + size] for first in range(0, len(robots), size)]
    chunks = ([(row, robots[row]) for row in rows] for rows in places)
    yield from spread(client, _chunk, ((version(), job, chunk) for chunk in chunks))


def _chunk(
    wanted: str, job: Job, robots: list[tuple[int, Measurements]]
) -> tuple[list[int], Found]:
    """What a worker does."""
    require_version(wanted)
    return [number for number, _ in robots], job.identify([each for _, each in robots])
