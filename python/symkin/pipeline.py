# SPDX-License-Identifier: MIT
"""The protocol of the paper as one function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from symkin.errors import one_of
from symkin.evaluation import Evaluation, evaluate
from symkin.identification.estimate import Estimator, Identification, PoseUse, identify
from symkin.mechanism import Mechanism
from symkin.observability import RowKind
from symkin.planning import Design, Plan, make_plan
from symkin.planning.selection import Criterion, SelectionMethod
from symkin.simulation import Simulation, simulate
from symkin.workspace.sample import WorkspaceSample, sample_workspace

__all__ = ["ProtocolResult", "run_protocol"]


@dataclass(frozen=True)
class ProtocolResult:
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
    identification : Identification
        The calibrated mechanism and its uncertainty.
    before, after : Evaluation
        End-effector errors over the candidates with the nominal and the calibrated mechanism.
    """

    nominal: Mechanism
    candidates: WorkspaceSample
    plan: Plan
    simulation: Simulation
    identification: Identification
    before: Evaluation
    after: Evaluation


def run_protocol(
    mechanism: Mechanism,
    *,
    estimator: Estimator = "implicit",
    poses: PoseUse = "own",
    design: Design = "legs",
    rows: RowKind = "noise_aware",
    criterion: Criterion = "O1",
    method: SelectionMethod = "exchange",
    seed: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> ProtocolResult:
    """Run the protocol on a simulated robot: PS1-PS3 and DC1-DC3 of the paper (section 5).

    Parameters
    ----------
    mechanism : Mechanism
        The nominal one, with its workspace, noise, tolerances and protocol settings.
    estimator, poses
        See `identify`; the paper identifies each leg from its own set.
    design, rows, criterion, method
        See `make_plan`.
    seed : int, optional
        Of candidates, selection, robot and noise; by default the protocol's.
    progress : callable, optional
        Called with a short description before each stage.

    Returns
    -------
    ProtocolResult
    """
    one_of("estimator", estimator, Estimator)
    one_of("poses", poses, PoseUse)
    progress = progress or _silent
    progress("sampling the workspace")
    candidates = sample_workspace(mechanism, seed=seed)
    progress("selecting poses for the reference leg")
    plan = make_plan(
        mechanism,
        candidates,
        seed=seed,
        design=design,
        rows=rows,
        criterion=criterion,
        method=method,
    )
    progress("simulating measurements")
    simulation = simulate(mechanism, plan, seed)
    progress("identifying the legs")
    identification = identify(mechanism, simulation.measurements, estimator, poses=poses)
    progress("evaluating before and after")
    actual, calibrated = simulation.actual, identification.mechanism
    before = evaluate(mechanism, actual=actual, poses=candidates.poses)
    after = evaluate(calibrated, actual=actual, poses=candidates.poses)
    return ProtocolResult(mechanism, candidates, plan, simulation, identification, before, after)


def _silent(stage: str) -> None:
    """Tell nobody about a stage."""
