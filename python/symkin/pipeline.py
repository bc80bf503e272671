# SPDX-License-Identifier: MIT
"""The protocol of the paper as one function."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic, Unpack

from symkin.analysis.evaluation import Evaluation, evaluate
from symkin.analysis.promises import ExpectedAccuracy
from symkin.analysis.workspace import WorkspaceSample, sample_workspace
from symkin.errors import SymkinError, one_of
from symkin.estimate.estimate import Estimate
from symkin.estimate.found import M
from symkin.estimate.identification import Nominal, identify, identify_legs
from symkin.estimate.options import Estimator, PoseUse
from symkin.model.framing import framed
from symkin.model.given import as_mechanism
from symkin.model.mechanism import Mechanism
from symkin.options import checks
from symkin.planning import Plan, make_plan
from symkin.planning.making import ChoosingForPlan, for_all_parameters
from symkin.planning.plan import write_plan
from symkin.planning.simulation import Simulation, simulate, simulate_observed
from symkin.results import FolderResult, loaded
from symkin.values import Value, plain, record

__all__ = ["EstimatorFigures", "ProtocolResult", "run_protocol"]

# The paper's, then each step that takes more out of the same measurements.
_ESTIMATORS: tuple[tuple[Estimator, PoseUse], ...] = (
    ("paper", "own"),
    ("implicit", "own"),
    ("implicit", "all"),
    ("joint", "all"),
)


@record
class EstimatorFigures(Value):
    """What one estimator achieves.

    Attributes
    ----------
    estimator, poses : str
        As `identify` takes them.
    converged : bool
        Whether it did.
    evaluation : Evaluation or None
        End-effector errors over the candidates; None if it gave nothing to evaluate.
    expected : ExpectedAccuracy or None
        The same figures, predicted from its covariance.
    """

    estimator: Estimator
    poses: PoseUse
    converged: bool
    evaluation: Evaluation | None
    expected: ExpectedAccuracy | None


@record
class ProtocolResult(FolderResult, Generic[M]):
    """Everything that the protocol made on its way.

    Attributes
    ----------
    nominal : Mechanism
        The mechanism as drawn.
    candidates : WorkspaceSample
        Poses of the workspace without singularities.
    plan : Plan
        Poses chosen for every leg.
    simulation : Simulation
        The simulated robot and its measurements.
    identification : Estimate
        The calibrated mechanism and its uncertainty.
    before, after : Evaluation
        End-effector errors over the candidates with the nominal and the calibrated mechanism.
    seed : int
        Of candidates, selection, robot and noise.
    """

    nominal: M
    candidates: WorkspaceSample
    plan: Plan
    simulation: Simulation
    identification: Estimate[M]
    before: Evaluation
    after: Evaluation
    seed: int

    FILES: ClassVar[tuple[str, ...]] = ("plan.csv", *Simulation.FILES, *Estimate.FILES)
    SOMETIMES: ClassVar[tuple[str, ...]] = Estimate.SOMETIMES

    @cached_property
    def expected(self) -> ExpectedAccuracy:
        """The errors after, predicted from the covariance of the parameters."""
        return self.identification.expected_accuracy(self.candidates.poses)

    @cached_property
    def comparison(self) -> tuple[EstimatorFigures, ...]:
        """What every estimator makes of the same measurements."""
        if self.nominal.device is not None or self.nominal.not_leg_by_leg:
            return (self._figures("joint", self.identification.options.poses),)
        # The paper's knows legs by their readings alone.
        known = _ESTIMATORS if self.nominal.closures == 1 else _ESTIMATORS[1:]
        return tuple(self._figures(*each) for each in known)

    def to_dict(self) -> dict[str, Any]:
        """Return what its results file holds."""
        protocol, basis = self.nominal.protocol, self.plan.basis
        found, told = self.identification, self.identification.to_dict()
        return {
            "command": "run",
            "mechanism": self.nominal.name,
            "settings": {
                "estimator": found.estimator,
                "poses": found.options.poses,
                **{
                    name: plain(getattr(basis, name, None))
                    for name in ("design", "rows", "criterion", "method")
                },
                "pose_count": protocol.pose_count,
                "seed": self.seed,
            },
            "candidates": len(self.candidates.poses),
            "plan": self.plan.to_dict(),
            "simulation": {
                "measured": len(self.simulation.measurements.poses),
                "replaced": list(self.simulation.replaced),
            },
            "identification": told["identification"],
            "evaluation": {
                "before": self.before.to_dict(),
                "after": self.after.to_dict(),
                "expected": self.expected.to_dict(),
            },
            "comparison": plain(self.comparison),
        }

    def columns(self) -> Mapping[str, Any]:
        """Return the parameters, a row each, and how far they are from those of the robot."""
        has, true = self.nominal.has_parameter, self.simulation.actual.parameters
        errors = self.identification.mechanism.parameters - true
        return {**self.identification.columns(), "true": true[has], "error": errors[has]}

    def write_files(self, folder: Path, *, report: bool = True) -> None:
        """Write the files of all stages into a folder."""
        write_plan(self.plan, folder / "plan.csv", self.nominal)
        simulation, measured = self.simulation, self.simulation.measurements
        if self.nominal.device is None:
            seen = framed(self.nominal, measured.poses)  # as a laboratory's device has them
            measured = dataclasses.replace(measured, poses=seen)
            simulation = dataclasses.replace(simulation, measurements=measured)
        simulation.write(folder)
        self.identification.write_tables(folder)
        super().write_files(folder, report=report)

    def _figures(self, estimator: Estimator, poses: PoseUse) -> EstimatorFigures:
        simulation, where = self.simulation, self.candidates.poses
        main = self.identification
        if (estimator, poses) == (main.estimator, main.options.poses):
            return EstimatorFigures(estimator, poses, main.converged, self.after, self.expected)
        try:
            found = identify_legs(self.nominal, simulation.measurements, estimator, poses=poses)
            reached = evaluate(found.mechanism, actual=simulation.actual, poses=where)
        except SymkinError:  # too few poses for it, or an estimate that no pose suits
            return EstimatorFigures(estimator, poses, False, None, None)
        expected = found.expected_accuracy(where)
        return EstimatorFigures(estimator, poses, found.converged, reached, expected)


@checks()
def run_protocol(
    mechanism: Nominal | str | os.PathLike[str],
    *,
    estimator: Estimator | None = None,
    poses: PoseUse = "all",
    seed: int | None = None,
    progress: Callable[[str], None] | None = None,
    **choosing: Unpack[ChoosingForPlan],
) -> ProtocolResult[Nominal]:
    """Run the protocol on a simulated robot: PS1-PS3 and DC1-DC3 of the paper (section 5).

    A mechanism with a device is planned for, simulated and identified as that measures it.

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, with its workspace, noise, tolerances and protocol settings.
    estimator, poses
        See `identify`, by default "implicit", with a device "joint"; the paper identifies each leg
        from its own set.
    design, rows, criterion, method, margin_sigmas
        See `make_plan`.
    seed : int, optional
        Of candidates, selection, robot and noise; by default the protocol's.
    progress : callable, optional
        Called with a short description before each stage.
    """
    own = as_mechanism(mechanism)
    if estimator is not None:
        one_of("estimator", estimator, Estimator)
    one_of("poses", poses, PoseUse)
    observed = own.device is not None
    progress = progress or (lambda _stage: None)
    seed = own.protocol.seed if seed is None else seed
    progress("sampling the workspace")
    candidates = sample_workspace(own, seed=seed)
    progress("selecting poses for the reference leg")
    plan = make_plan(
        # Whose legs are identified one by one, unless a device measures something else.
        own if observed else for_all_parameters(own),
        candidates,
        seed=seed,
        **choosing,
        visit=None if observed else "sets",
    )
    progress("simulating measurements")
    simulation = (simulate if observed else simulate_observed)(own, plan, seed)
    measured = simulation.measurements
    progress("identifying the legs")
    if observed or own.not_leg_by_leg:
        found = identify(own, measured, estimator, poses=poses)
    else:
        found = identify_legs(own, measured, estimator or "implicit", poses=poses)
    progress("evaluating before and after")
    before, after = (
        evaluate(model, actual=simulation.actual, poses=candidates)
        for model in (own, found.mechanism)
    )
    return ProtocolResult(own, candidates, plan, simulation, found, before, after, seed)


def saved_estimate(path: str | os.PathLike[str], robot: type[Mechanism] = Mechanism) -> Any:
    """Read the estimate, of a `robot`, from the folder or the file that it or a run was written to.

    Raises
    ------
    ResultsError
        As `loaded`.
    """
    found = loaded(path, (Estimate, ProtocolResult), {Mechanism: robot})
    return found.identification if isinstance(found, ProtocolResult) else found
