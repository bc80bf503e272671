# SPDX-License-Identifier: MIT
"""The paper reproduced: its figures 6 to 10, and what they say about its claims."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.evaluation import evaluate
from symkin.analysis.workspace.study import (
    ConstantOrientation,
    WorkspaceStudy,
    constant_orientations,
)
from symkin.errors import SymkinError
from symkin.estimate.identification import identify
from symkin.estimate.options import PoseUse
from symkin.model.mechanism import Mechanism
from symkin.planning import Plan
from symkin.planning.simulation import simulate_observed
from symkin.study.definition import StudyDefinition, has_cells_of
from symkin.study.result import StudyResult
from symkin.study.robots import Job, robot_seed
from symkin.study.summaries import Ratio, paired
from symkin.values import Value, field, record
from symkin_paper.claims import Claim, judge
from symkin_paper.evidence import Evidence, SliceErrors
from symkin_paper.measured import (
    ORIENTATIONS,
    iteration_figures,
    observability_figures,
    r_diagonals,
    selection_figures,
    slice_poses,
    step_figures,
    symmetry_figures,
    tilt_figures,
)

__all__ = [
    "STUDY_FILE",
    "LocalErrors",
    "PaperFindings",
    "local_errors",
    "paper_calls",
    "study_paper",
]

Array = NDArray[np.float64]
Call = tuple[Any, ...]  # a function and its arguments

STUDY_FILE = Path(__file__).parent / "paper.toml"

_RESOLUTION = 121  # cells a side of the maps of local errors
_POSES = 100_000  # on which each element of the symmetry is tested

# Names of its cells: the paper's protocol, and what it is compared with.
PAPER, EACH_LEG = "paper", "paper, each leg"
TRADITIONAL, EQUAL_EFFORT = "traditional, 24 poses", "traditional, 72 poses"


@record
class LocalErrors(Value):
    """Position errors of a calibrated robot over a constant-orientation workspace.

    Attributes
    ----------
    orientation : float
        rad, exactly.
    x, y : ndarray, shape (columns,), (rows,)
        Centres of the cells, m.
    divided, traditional : ndarray, shape (rows, columns)
        Root mean square over the robots of the position error, of the paper's protocol and of the
        traditional method, m; NaN outside the workspace.
    ratio : Ratio
        Root mean square over the slice of the first over that of the second, robot by robot.
    """

    orientation: float = field(unit="rad")
    x: Array = field(private=True)
    y: Array = field(private=True)
    divided: Array = field(private=True)
    traditional: Array = field(private=True)
    ratio: Ratio

    @property
    def figures(self) -> SliceErrors:
        """Root mean squares over the slice."""
        return SliceErrors(self.orientation, _rms(self.divided), _rms(self.traditional), self.ratio)

    def to_dict(self) -> dict[str, Any]:
        """Return the root mean squares."""
        return self.figures.to_dict()


def local_errors(
    study: StudyResult, slices: Sequence[ConstantOrientation], robots: int | None = None
) -> tuple[LocalErrors, ...]:
    """Simulate Fig. 10: where the calibrated robots err, at constant orientations.

    Parameters
    ----------
    study : StudyResult
        Of the study ``"paper"``.
    slices : sequence of ConstantOrientation
        Whose usable cells are evaluated.
    robots : int, optional
        The first robots of the study, over which the errors are averaged; by default all.

    Returns
    -------
    tuple of LocalErrors
        One for each slice.
    """
    plans = study.plan(PAPER), study.plan(TRADITIONAL)
    count = study.robots if robots is None else robots
    return _local_errors(*plans, study.definition.seed, slices, count)


def _local_errors(
    divided: Plan,
    traditional: Plan,
    study_seed: int,
    slices: Sequence[ConstantOrientation],
    robots: int,
) -> tuple[LocalErrors, ...]:
    commanded = np.concatenate([slice_poses(each)[each.usable] for each in slices])
    ends = np.cumsum([each.usable.sum() for each in slices])[:-1]
    ways: tuple[tuple[Plan, PoseUse], ...] = ((divided, "own"), (traditional, "all"))
    squares = np.zeros((len(ways), len(commanded)))
    taken = np.zeros(squares.shape)
    means = np.full((len(slices), len(ways), robots), np.nan)  # of one robot over one slice
    for robot in range(robots):
        seed = robot_seed(study_seed, robot)
        for way, (plan, use) in enumerate(ways):
            found = _position_errors(plan, use, seed, commanded)
            good = np.isfinite(found)
            squares[way, good] += found[good] ** 2
            taken[way, good] += 1
            for place, part in enumerate(np.split(found, ends)):
                means[place, way, robot] = _rms(part) if np.isfinite(part).any() else np.nan
    with np.errstate(invalid="ignore"):
        roots = np.sqrt(squares / taken)
    return tuple(
        LocalErrors(
            each.orientation,
            each.x,
            each.y,
            _on_grid(each, errors[0]),
            _on_grid(each, errors[1]),
            paired(*own[:, np.isfinite(own).all(axis=0)]),
        )
        for each, errors, own in zip(slices, np.split(roots, ends, axis=1), means, strict=True)
    )


def _paper_errors(
    divided: Plan, traditional: Plan, seed: int, robots: int
) -> tuple[LocalErrors, ...]:
    slices = constant_orientations(divided.mechanism, ORIENTATIONS, _RESOLUTION)
    return _local_errors(divided, traditional, seed, slices, robots)


def _position_errors(plan: Plan, use: PoseUse, seed: int, poses: Array) -> Array:
    """Of one robot; NaN where it cannot take a pose, everywhere if it cannot be calibrated."""
    try:
        simulation = simulate_observed(plan.mechanism, plan, seed)
        found = identify(plan.mechanism, simulation.measurements, "paper", poses=use)
        return evaluate(found.mechanism, actual=simulation.actual, poses=poses).errors[0]
    except SymkinError:
        return np.full(len(poses), np.nan)


def _on_grid(found: ConstantOrientation, values: Array) -> Array:
    grid = np.full(found.usable.shape, np.nan)
    grid[found.usable] = values
    return grid


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))


@record
class PaperFindings(Value):
    """Sections 4 to 6 of the paper, done again and judged.

    Attributes
    ----------
    mechanism : Mechanism
        The 3-RRR.
    workspace : WorkspaceStudy
        Figs. 6a to 6d.
    plan : Plan
        The 24 poses a leg of Fig. 7.
    r_diagonals : ndarray, shape (legs, p)
        abs(R_ii) of Fig. 8.
    local : tuple of LocalErrors
        Fig. 10.
    evidence : Evidence
        The figures by which the claims are judged.
    claims : tuple of Claim
        Every claim with its verdict.
    """

    mechanism: Mechanism = field(private=True)
    workspace: WorkspaceStudy = field(private=True)
    plan: Plan = field(private=True)
    r_diagonals: Array
    local: tuple[LocalErrors, ...]
    evidence: Evidence
    claims: tuple[Claim, ...]


def paper_calls(
    definition: StudyDefinition,
    job: Job,
    *,
    poses: int = _POSES,
    mapped_robots: int | None = None,
) -> list[Call]:
    """Return the calls for what of `study_paper` needs no result of the study's robots.

    None for another study, or one whose poses could not be chosen.
    """
    if not has_cells_of(definition, STUDY_FILE):
        return []
    by_name = {cell.id: cell for cell in definition.cells}
    plan, traditional = (job.plans[by_name[name].plan_key] for name in (PAPER, TRADITIONAL))
    if isinstance(plan, str) or isinstance(traditional, str):
        return []
    return [
        (selection_figures, plan, job.seed),
        (
            _paper_errors,
            plan,
            traditional,
            job.seed,
            definition.robots if mapped_robots is None else mapped_robots,
        ),
        (symmetry_figures, plan.mechanism, job.seed, poses),
    ]


def study_paper(
    study: StudyResult,
    *,
    poses: int = _POSES,
    mapped_robots: int | None = None,
    parts: Sequence[Any] | None = None,
) -> PaperFindings:
    """Reproduce the paper's figures and judge its claims.

    Parameters
    ----------
    study : StudyResult
        Of the study ``"paper"``; its robots may be fewer.
    poses : int
        On which each element of the symmetry is tested.
    mapped_robots : int, optional
        How many robots' local errors Fig. 10 shows and are compared; by default all.
    parts : sequence, optional
        What the `paper_calls` returned; by default they are made here.

    Raises
    ------
    SymkinError
        For a study without the cells of the paper.
    """
    if not has_cells_of(study.definition, STUDY_FILE):
        raise SymkinError('the paper is judged by the cells of the study "paper" alone')
    plan, traditional, seed = study.plan(PAPER), study.plan(TRADITIONAL), study.definition.seed
    if parts is None:
        calls = paper_calls(study.definition, study.job, poses=poses, mapped_robots=mapped_robots)
        parts = [function(*arguments) for function, *arguments in calls]
    selection, local, (workspace, symmetry) = parts
    mechanism = plan.mechanism
    diagonals = r_diagonals(mechanism, plan)
    evidence = Evidence(
        **symmetry,
        **observability_figures(mechanism, plan, diagonals),
        **selection,
        **iteration_figures(mechanism, plan, seed),
        **step_figures(mechanism, plan, traditional),
        **tilt_figures(mechanism, plan),
        **_study_figures(study),
        slices=tuple(each.figures for each in local),
    )
    return PaperFindings(mechanism, workspace, plan, diagonals, local, evidence, judge(evidence))


def _study_figures(study: StudyResult) -> dict[str, Any]:
    divided, traditional = study.cells[PAPER], study.cells[TRADITIONAL]
    rows = study.rows(PAPER)
    taken = rows["evaluated"][rows["converged"]]

    def against(other: str) -> tuple[Ratio, Ratio]:
        found = study.compare(PAPER, other)
        return found.position, found.orientation

    kinds = divided.position, divided.orientation
    return {
        "measured_divided": divided.measured_poses,
        "measured_traditional": traditional.measured_poses,
        "drawn_error": divided.position.before,
        "evaluation_poses": study.definition.evaluation_poses,
        "improvement": tuple(each.before / each.rms for each in kinds),
        "against_traditional": against(TRADITIONAL),
        "against_equal_effort": against(EQUAL_EFFORT),
        "against_independent": against(EACH_LEG),
        "robots": study.robots,
        "replaced": divided.replaced,
        "commanded": divided.measured_poses * study.robots,
        "unreachable": int((study.definition.evaluation_poses - taken).sum()),
        "evaluated": study.definition.evaluation_poses * len(taken),
    }
