# SPDX-License-Identifier: MIT
"""What selection and identification cost, with and without symmetry, against the number of legs."""

from __future__ import annotations

import dataclasses
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin import _core
from symkin.analysis.workspace import sample_workspace
from symkin.errors import SymkinError
from symkin.estimate.fit import core_measurements
from symkin.estimate.options import Estimator, PoseUse
from symkin.model.mechanism import Mechanism
from symkin.model.settings import DeclaredSymmetry
from symkin.model.symmetry import generate_legs
from symkin.model.tolerances import noise_of
from symkin.planning import Design, make_plan
from symkin.planning.selection import LegRows, select_poses
from symkin.planning.simulation import simulate_observed
from symkin.results import FolderResult
from symkin.study.definition import Cell, StudyDefinition
from symkin.values import Array, Value, record

# What is timed, in the order of the columns, and what the theory says of n legs.
TASKS: dict[str, str] = {
    "select_reference_s": "selection for the reference leg",
    "select_each_s": "selection for each leg",
    "plan_mapped_s": "plan with mapped poses",
    "plan_each_s": "plan for each leg",
    "identify_legs_s": "identification leg by leg",
    "identify_together_s": "identification of all legs together",
}


@record
class Exponent(Value):
    """How a time grows with the number of legs: as its power, fitted by least squares.

    Attributes
    ----------
    mechanism, task : str
        Of what.
    value, low, high : float
        The power, and its 95% interval from the scatter about the line; NaN for too few numbers.
    """

    mechanism: str
    task: str
    value: float
    low: float
    high: float


@record
class CostResult(FolderResult):
    """What a study of cost measured.

    Attributes
    ----------
    definition : StudyDefinition
        What was asked.
    table : dict of str to ndarray
        A row a mechanism and number of legs: ``mechanism``, ``legs`` and the median times of
        `TASKS`, s.
    """

    definition: StudyDefinition
    table: Mapping[str, NDArray[Any]]

    @cached_property
    def exponents(self) -> tuple[Exponent, ...]:
        """Of every mechanism and task."""
        return tuple(
            Exponent(name, task, *_power(self.legs(name), self.times(name, task)))
            for name in self.mechanisms
            for task in TASKS
        )

    @property
    def mechanisms(self) -> tuple[str, ...]:
        """Their names, in the order of the study."""
        return tuple(dict.fromkeys(self.table["mechanism"].tolist()))

    def legs(self, mechanism: str) -> NDArray[np.intp]:
        """Numbers of legs that were measured."""
        return np.asarray(self.table["legs"][self.table["mechanism"] == mechanism])

    def times(self, mechanism: str, task: str) -> Array:
        """Times of a task, s, one a number of legs."""
        return np.asarray(self.table[task][self.table["mechanism"] == mechanism])

    def to_dict(self) -> dict[str, Any]:
        """Return the times and how they grow."""
        return {
            "command": "study",
            "study": self.definition.name,
            "title": self.definition.title,
            "kind": self.definition.kind,
            "times": {name: column.tolist() for name, column in self.table.items()},
            "exponents": [each.to_dict() for each in self.exponents],
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the times."""
        return self.table


def with_legs(mechanism: Mechanism, count: int) -> Mechanism:
    """Return the mechanism with its first leg repeated, so many times in all.

    Rotations carry it to the others. Two legs opposite each other would be in line at the centre,
    so they are mirror images, a third of a turn apart.
    """
    symmetry = DeclaredSymmetry(f"C{count}")
    if count == 2:
        azimuth = mechanism.parameter_roles(0).index(("base", "azimuth"))
        symmetry = DeclaredSymmetry("D1", axis=mechanism.parameters[0, azimuth] + math.pi / 3)
    legs = generate_legs(mechanism.legs[0], symmetry, count)
    return mechanism.replace(legs=legs, symmetry=symmetry, name=f"{mechanism.name} x {count}")


def measure_cost(definition: StudyDefinition, progress: Callable[[str, float], None]) -> CostResult:
    """Time selections and identifications for every number of legs, on one thread.

    Numbers of legs that leave a mechanism movable are passed over. Readings get a noise, without
    which the legs of a redundant mechanism could not be identified together.
    """
    cases = [
        (name, mechanism, count)
        for name, mechanism in definition.loaded.items()
        for count in definition.legs
        if count >= mechanism.space.dof
    ]
    if not cases:
        raise SymkinError(
            f"legs: none of {', '.join(map(str, definition.legs))} legs is enough for a mechanism "
            "of the study; expected at least as many as degrees of freedom"
        )
    rows = []
    for done, (name, mechanism, count) in enumerate(cases):
        progress(f"{name} with {count} legs", done / len(cases))
        cell = next(each for each in definition.cells if each.mechanism == name)
        times = _times(_noisy(with_legs(mechanism, count)), definition, cell)
        rows.append({"mechanism": name, "legs": count, **times})
    return CostResult(definition, {name: np.array([row[name] for row in rows]) for name in rows[0]})


def _noisy(mechanism: Mechanism) -> Mechanism:
    noise = mechanism.noise
    size = noise.orientation if mechanism.reading_unit == "rad" else noise.position
    return mechanism.replace(noise=dataclasses.replace(noise, reading=noise.reading or size))


def _times(mechanism: Mechanism, definition: StudyDefinition, cell: Cell) -> dict[str, float]:
    """Median times of all tasks, s; tasks take turns, so that a busy machine hits all alike."""
    seed, legs = definition.seed, range(len(mechanism.legs))
    candidates = definition.candidates or mechanism.protocol.candidates
    poses = sample_workspace(mechanism, candidates, seed).poses
    settings: dict[str, Any] = {"rows": cell.rows, "criterion": cell.criterion, "threads": 1}
    settings["visit"] = "sets"

    def identification(design: Design, estimator: Estimator, use: PoseUse) -> Callable[[], object]:
        plan = make_plan(mechanism, poses, cell.pose_count, seed, design=design, **settings)
        measured = simulate_observed(mechanism, plan, seed).measurements
        if design == "orbits":  # of which the last may be more than was asked for
            measured = measured.subset(np.arange(cell.pose_count))
        readings = core_measurements(measured)
        return lambda: _core.identify(
            mechanism.core,
            readings,
            _core.Estimator.__members__[estimator],
            _core.PoseUse.__members__[use],
            noise_of(mechanism.noise),
            "none",
            0.0,
            100,
        )

    def select(chosen_for: Sequence[int]) -> None:
        for leg in chosen_for:
            rows = LegRows(mechanism, leg, poses, cell.rows)
            select_poses(rows, cell.pose_count, seed, threads=1)

    def plan_with(symmetry: bool) -> None:
        make_plan(mechanism, poses, cell.pose_count, seed, symmetry=symmetry, **settings)

    tasks: dict[str, Callable[[], object]] = {
        "select_reference_s": lambda: select(legs[:1]),
        "select_each_s": lambda: select(legs),
        "plan_mapped_s": lambda: plan_with(True),
        "plan_each_s": lambda: plan_with(False),
        "identify_legs_s": identification("legs", "implicit", "own"),
        "identify_together_s": identification("orbits", "joint", "all"),
    }
    assert tasks.keys() == TASKS.keys()
    runs = [
        {name: seconds_of(task) for name, task in tasks.items()}
        for _ in range(definition.repetitions)
    ]
    return {name: statistics.median(run[name] for run in runs) for name in tasks}


def seconds_of(task: Callable[[], object]) -> float:
    """Processor time that a call takes, in the calling thread: other threads are not its."""
    begin = time.thread_time()
    task()
    return time.thread_time() - begin


def _power(legs: NDArray[np.intp], times: Array) -> tuple[float, float, float]:
    """Slope of the logarithms and its 95% interval."""
    x, y = np.log(legs), np.log(np.maximum(times, 1e-9))
    if len(x) < 3:
        return math.nan, math.nan, math.nan
    x = x - x.mean()
    slope = float(x @ y / (x @ x))
    left = y - y.mean() - slope * x
    spare = len(x) - 2
    reach = _core.student_limit(0.05, spare) * math.sqrt(left @ left / spare / (x @ x))
    return slope, slope - reach, slope + reach
