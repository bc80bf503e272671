# SPDX-License-Identifier: MIT
"""One simulated robot in every cell: the same robot, the same noise, wherever cells allow it."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.evaluation import evaluate
from symkin.analysis.promises import NORMAL_95
from symkin.analysis.workspace import sample_workspace
from symkin.errors import SymkinError
from symkin.estimate.fit import by_leg
from symkin.estimate.options import EstimateOptions
from symkin.model.mechanism import Mechanism
from symkin.model.settings import Tolerances
from symkin.planning import Plan, make_plan
from symkin.planning.making import for_all_parameters
from symkin.planning.simulation import Simulation, disturb, simulate_observed
from symkin.study.definition import Cell, StudyDefinition
from symkin.study.mapping import mapped_candidates, mapped_efficiency
from symkin.values import Array, Value, record

Plans = Mapping[tuple[Any, ...], Plan | str]

COLUMNS: dict[str, type] = {
    "cell": str,
    "robot": int,
    "seed": int,
    "converged": bool,
    "failure": str,
    "measured_poses": int,
    "replaced": int,
    "position_before_m": float,
    "orientation_before_rad": float,
    "position_rms_m": float,
    "orientation_rms_rad": float,
    "position_max_m": float,
    "orientation_max_rad": float,
    "evaluated": int,
    "inside_95": float,
    "parameter_count": int,
    "chi_square_ratio": float,
    "mapped_efficiency": float,
}
_SEED_BITS = 53  # so that a program that reads numbers as floats gets them whole


def robot_seed(seed: int, robot: int) -> int:
    """The seed of a robot, from which `simulate` makes it and its noise."""
    state = np.random.SeedSequence([seed, robot]).generate_state(1, np.uint64)[0]
    return int(state) >> (64 - _SEED_BITS)


def scaled(mechanism: Mechanism, noise: float, tolerance: float) -> Mechanism:
    """The mechanism with multiples of its noise and of its tolerances."""
    if noise == tolerance == 1:
        return mechanism
    sigmas = {name: noise * value for name, value in mechanism.noise.deviations.items()}
    limits = {name: tolerance * value for name, value in vars(mechanism.tolerances).items()}
    return mechanism.replace(
        noise=dataclasses.replace(mechanism.noise, **sigmas),  # type: ignore[arg-type]
        tolerances=Tolerances(**limits),
    )


@record
class Job(Value):
    """What it takes to compute any robot of a study, on any machine.

    Attributes
    ----------
    cells : tuple of Cell
        In their order.
    mechanisms : mapping
        The nominal ones, by name.
    plans : mapping
        By `Cell.plan_key`: the plan, or why there is none.
    poses : mapping
        By the mechanism's name: those over which errors are taken.
    mapped : mapping
        By `Cell.plan_key`, of a study of symmetry: what poses are chosen from for each robot too,
        see `mapped_candidates`.
    seed : int
        Of the study.
    """

    cells: tuple[Cell, ...]
    mechanisms: Mapping[str, Mechanism]
    plans: Plans
    poses: Mapping[str, Array]
    mapped: Mapping[tuple[Any, ...], tuple[Array, ...]]
    seed: int

    @classmethod
    def of(
        cls,
        definition: StudyDefinition,
        make_plans: Callable[[Mapping[str, Array]], Iterable[tuple[tuple[Any, ...], Plan | str]]],
        progress: Callable[[str, float], None],
    ) -> Job:
        """Sample the workspaces of a study and have its plans made of what was sampled."""
        candidates, poses = {}, {}
        for name, mechanism in definition.loaded.items():
            count = definition.candidates or mechanism.protocol.candidates
            most = max(count, definition.evaluation_poses)
            sampled = sample_workspace(mechanism, most, definition.seed).poses
            candidates[name] = sampled[:count]
            poses[name] = np.ascontiguousarray(sampled[: definition.evaluation_poses])
        made: dict[tuple[Any, ...], Plan | str] = {}
        progress("selecting poses", 0.0)
        for key, plan in make_plans(candidates):
            made[key] = plan
            progress("selecting poses", 0.0)
        plans = {cell.plan_key: made[cell.plan_key] for cell in definition.cells}
        mapped = {
            key: mapped_candidates(plan, candidates[key[0]])
            for key, plan in plans.items()
            if definition.kind == "symmetry"
            and isinstance(plan, Plan)
            and plan.basis is not None
            and plan.basis.design == "legs"
            and plan.basis.symmetrical
        }
        return cls(definition.cells, definition.loaded, plans, poses, mapped, definition.seed)

    def light(self) -> Job:
        """It without what no robot needs, to be sent to other processes."""
        plans = {
            key: plan if isinstance(plan, str) else dataclasses.replace(plan, candidates=None)
            for key, plan in self.plans.items()
        }
        return dataclasses.replace(self, plans=plans)

    def rows(self, robot: int) -> list[dict[str, Any]]:
        """The rows of a robot, one a cell in their order."""
        return _Robot(self, robot_seed(self.seed, robot)).rows(robot)

    def chunk(self, first: int, end: int) -> dict[str, NDArray[Any]]:
        """The rows of some robots as columns; `cell` is the number of the cell, from 0."""
        rows = [row for robot in range(first, end) for row in self.rows(robot)]
        columns = {
            name: np.array([row[name] for row in rows]) for name in COLUMNS if name != "cell"
        }
        return {"cell": np.tile(np.arange(len(self.cells)), end - first), **columns}

    @functools.cached_property
    def _scaled(self) -> dict[tuple[str, float, float], Mechanism]:
        return {}

    def mechanism(self, cell: Cell) -> Mechanism:
        """The nominal mechanism of a cell, with the cell's noise and tolerances."""
        key = cell.mechanism, cell.noise_level, cell.tolerance_level
        if key not in self._scaled:
            self._scaled[key] = scaled(self.mechanisms[cell.mechanism], *key[1:])
        return self._scaled[key]

    def __getstate__(self) -> dict[str, Any]:
        """Pickle what was given."""
        return {each.name: self.__dict__[each.name] for each in dataclasses.fields(self)}


def planned(mechanism: Mechanism, cell: Cell, candidates: Array, seed: int) -> Plan | str:
    """The plan of a cell, or why there is none."""
    try:
        return make_plan(
            for_all_parameters(mechanism),
            candidates,
            cell.pose_count,
            seed,
            design=cell.design,
            rows=cell.rows,
            criterion=cell.criterion,
            method=cell.method,
            margin_sigmas=cell.margin_sigmas,
            symmetry=cell.use_symmetry,
            visit="sets",
        )
    except SymkinError as error:
        return f"no plan: {error}"


class _Robot:
    """A robot, of which everything is computed once, however many cells use it."""

    def __init__(self, job: Job, seed: int) -> None:
        self._job, self._seed = job, seed
        self._known: dict[tuple[Any, ...], Any] = {}

    def rows(self, robot: int) -> list[dict[str, Any]]:
        return [{"robot": robot, "seed": self._seed, **self._row(cell)} for cell in self._job.cells]

    def _row(self, cell: Cell) -> dict[str, Any]:
        row: dict[str, Any] = {
            "converged": False,
            "failure": "",
            "measured_poses": 0,
            "replaced": 0,
            **dict.fromkeys([name for name, kind in COLUMNS.items() if kind is float], np.nan),
            "evaluated": 0,
            "parameter_count": int(self._job.mechanisms[cell.mechanism].is_estimated.sum()),
        }
        try:
            row["position_before_m"], row["orientation_before_rad"] = self._before(cell)
            if cell.plan_key in self._job.mapped:
                row["mapped_efficiency"] = self._efficiency(cell)
            simulation = self._simulated(cell)
            row["measured_poses"] = len(simulation.measurements.poses)
            row["replaced"] = sum(simulation.replaced)
            row |= self._figures(cell, simulation)
        except SymkinError as error:
            row["failure"] = " ".join(str(error).split())
        return row

    def _figures(self, cell: Cell, simulation: Simulation) -> dict[str, Any]:
        options = EstimateOptions(cell.estimator, cell.use, cell.loss)
        mechanism = self._job.mechanism(cell)
        fit = by_leg(mechanism, simulation.measurements, options)
        after = evaluate(
            fit.mechanism, actual=simulation.actual, poses=self._job.poses[cell.mechanism]
        )
        off = np.abs(fit.mechanism.parameters - simulation.actual.parameters)
        estimated = mechanism.is_estimated
        return {
            "converged": fit.converged,
            "failure": fit.failure,
            "position_rms_m": after.position_rms,
            "orientation_rms_rad": after.orientation_rms,
            "position_max_m": after.position_max,
            "orientation_max_rad": after.orientation_max,
            "evaluated": after.evaluated,
            "inside_95": float(np.mean((off < NORMAL_95 * fit.deviations)[estimated])),
            "chi_square_ratio": fit.chi_square_ratio,
        }

    def _actual(self, cell: Cell) -> Mechanism:
        result: Mechanism = self._once(
            ("made", *cell.robot_key), lambda: disturb(self._job.mechanism(cell), self._seed)
        )
        return result

    def _before(self, cell: Cell) -> tuple[float, float]:
        def evaluated() -> tuple[float, float]:
            nominal, poses = self._job.mechanisms[cell.mechanism], self._job.poses[cell.mechanism]
            found = evaluate(nominal, actual=self._actual(cell), poses=poses)
            return found.position_rms, found.orientation_rms

        result: tuple[float, float] = self._once(("before", *cell.robot_key), evaluated)
        return result

    def _simulated(self, cell: Cell) -> Simulation:
        plan = self._job.plans[cell.plan_key]
        if isinstance(plan, str):
            raise SymkinError(plan)
        result: Simulation = self._once(
            ("measured", *cell.measured_key),
            lambda: simulate_observed(
                self._job.mechanism(cell), plan, self._seed, self._actual(cell)
            ),
        )
        return result

    def _efficiency(self, cell: Cell) -> float:
        plan, candidates = self._job.plans[cell.plan_key], self._job.mapped[cell.plan_key]
        assert isinstance(plan, Plan)
        result: float = self._once(
            ("efficiency", *cell.plan_key, *cell.robot_key),
            lambda: mapped_efficiency(self._actual(cell), plan, candidates),
        )
        return result

    def _once(self, key: tuple[Any, ...], function: Callable[[], Any]) -> Any:
        """What a function returns, or raises, called once for all cells with this key."""
        if key not in self._known:
            try:
                self._known[key] = function()
            except SymkinError as error:
                self._known[key] = error
        known = self._known[key]
        if isinstance(known, SymkinError):
            raise known
        return known
