# SPDX-License-Identifier: MIT
"""The paper reproduced: its figures 6 to 10, and what they say about its claims."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.conditions import check_conditions
from symkin.analysis.evaluation import evaluate
from symkin.analysis.observability import analyse_observability, mechanism_rows, observability_rows
from symkin.analysis.promises import thinned
from symkin.analysis.workspace import inside_workspace, sample_workspace
from symkin.analysis.workspace.study import (
    ConstantOrientation,
    WorkspaceStudy,
    constant_orientations,
    study_workspace,
)
from symkin.errors import SymkinError
from symkin.estimate.identification import identify
from symkin.estimate.options import PoseUse
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry import leg_carriers, map_poses, observability_group
from symkin.planning import Plan, make_plan, predict_accuracy
from symkin.planning.selection import LegRows, select_poses
from symkin.planning.simulation import simulate_observed
from symkin.robot import load_mechanism
from symkin.study.cost import seconds_of
from symkin.study.definition import StudyDefinition, has_cells_of
from symkin.study.result import StudyResult
from symkin.study.robots import Job, robot_seed
from symkin.study.summaries import Ratio
from symkin.values import Value, field, record
from symkin_paper.claims import Claim, Evidence, SliceErrors, judge

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

ORIENTATIONS = (0.0, 0.4, 0.6)  # rad, section 6.2
_OFFSETS = np.deg2rad([30.0, 150.0, -90.0])  # Eq. 19
_ITERATIONS = 4  # of Eqs. 24 to 26 in either direction
_REPETITIONS = 5  # of what is timed, the fastest of which counts
_STEP_REPETITIONS = 200  # of what takes a tenth of a millisecond
_RESOLUTION = 121  # cells a side of the maps of local errors
_MAPPED_ROBOTS = 100  # whose errors they show
_POSES = 100_000  # on which each element of the symmetry is tested

# Names of its cells: the paper's protocol, and what it is compared with.
PAPER, EACH_LEG = "paper", "paper, each leg"
TRADITIONAL, EQUAL_EFFORT = "traditional, 24 poses", "traditional, 72 poses"

# How the paper chooses poses.
_PROTOCOL: dict[str, Any] = {"rows": "paper", "method": "sun_hollerbach", "margin_sigmas": 0.0}
_PROTOCOL["visit"] = "sets"


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
    """

    orientation: float = field(unit="rad")
    x: Array = field(private=True)
    y: Array = field(private=True)
    divided: Array = field(private=True)
    traditional: Array = field(private=True)

    @property
    def figures(self) -> SliceErrors:
        """Root mean squares over the slice."""
        return SliceErrors(self.orientation, _rms(self.divided), _rms(self.traditional))

    def to_dict(self) -> dict[str, Any]:
        """Return the root mean squares."""
        return self.figures.to_dict()


def local_errors(
    study: StudyResult, slices: Sequence[ConstantOrientation], robots: int = _MAPPED_ROBOTS
) -> tuple[LocalErrors, ...]:
    """Simulate Fig. 10: where the calibrated robots err, at constant orientations.

    Parameters
    ----------
    study : StudyResult
        Of the study ``"paper"``.
    slices : sequence of ConstantOrientation
        Whose usable cells are evaluated.
    robots : int
        The first robots of the study, over which the errors are averaged.

    Returns
    -------
    tuple of LocalErrors
        One for each slice.
    """
    plans = study.plan(PAPER), study.plan(TRADITIONAL)
    return _local_errors(*plans, study.definition.seed, slices, robots)


def _local_errors(
    divided: Plan,
    traditional: Plan,
    study_seed: int,
    slices: Sequence[ConstantOrientation],
    robots: int,
) -> tuple[LocalErrors, ...]:
    commanded = np.concatenate([_slice_poses(each)[each.usable] for each in slices])
    ways: tuple[tuple[Plan, PoseUse], ...] = ((divided, "own"), (traditional, "all"))
    squares = np.zeros((len(ways), len(commanded)))
    taken = np.zeros(squares.shape)
    for robot in range(robots):
        seed = robot_seed(study_seed, robot)
        for way, (plan, use) in enumerate(ways):
            found = _position_errors(plan, use, seed, commanded)
            good = np.isfinite(found)
            squares[way, good] += found[good] ** 2
            taken[way, good] += 1
    with np.errstate(invalid="ignore"):
        roots = np.sqrt(squares / taken)
    ends = np.cumsum([each.usable.sum() for each in slices])[:-1]
    return tuple(
        LocalErrors(each.orientation, each.x, each.y, *(_on_grid(each, way) for way in errors))
        for each, errors in zip(slices, np.split(roots, ends, axis=1), strict=True)
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


def _slice_poses(found: ConstantOrientation) -> Array:
    """Poses of all cells, shape (rows, columns, 3)."""
    x, y = np.meshgrid(found.x, found.y)
    return np.stack([x, y, np.full(x.shape, found.orientation)], axis=-1)


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
    mapped_robots: int = _MAPPED_ROBOTS,
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
        (_selection_figures, plan, job.seed),
        (_paper_errors, plan, traditional, job.seed, mapped_robots),
        (_symmetry, plan.mechanism, job.seed, poses),
    ]


def study_paper(
    study: StudyResult,
    *,
    poses: int = _POSES,
    mapped_robots: int = _MAPPED_ROBOTS,
    parts: Sequence[Any] | None = None,
) -> PaperFindings:
    """Reproduce the paper's figures and judge its claims.

    Parameters
    ----------
    study : StudyResult
        Of the study ``"paper"``; its robots may be fewer.
    poses : int
        On which each element of the symmetry is tested.
    mapped_robots : int
        Whose local errors Fig. 10 shows.
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
    diagonals = _r_diagonals(mechanism, plan)
    evidence = Evidence(
        **symmetry,
        **_observability_figures(mechanism, plan, diagonals),
        **selection,
        **_iteration_figures(mechanism, plan, seed),
        **_step_figures(mechanism, plan, traditional),
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


def _legs(plan: Plan) -> range:
    return range(plan.readings.shape[1])


def _symmetry(mechanism: Mechanism, seed: int, poses: int) -> tuple[WorkspaceStudy, dict[str, Any]]:
    workspace = study_workspace(mechanism, ORIENTATIONS, poses, seed)
    conditions = check_conditions(mechanism, poses, seed)
    checks = conditions.elements
    groups = {(each.symbol, each.meaning): each.elements for each in conditions.groups}
    structure = groups["G_M", "structure"]
    turns = [label for label in groups["G_W", "with the working modes"] if label != "r0"]
    offsets = mechanism.parameters[:, mechanism.parameter_names.index("sensor_offset")]
    off = offsets - _OFFSETS
    return workspace, {
        "poses": poses,
        "rotations": sum(label.startswith("r") for label in structure),
        "reflections": sum(label.startswith("s") for label in structure),
        "mismatches": sum(each.mismatches for each in checks),
        "workspace_elements": groups["G_W", "with the working modes"],
        "reading_elements": groups["G_Q", "active joints"],
        "reading_deviation": max(each.reading_deviation for each in checks if each.keeps_modes),
        "reading_deviation_all": max(each.reading_deviation for each in checks),
        "slice_areas": tuple(each.usable_area for each in workspace.slices),
        "slice_mismatches": tuple(_mismatches(mechanism, each, turns) for each in workspace.slices),
        "conditions_met": sum(each.holds for each in conditions.conditions),
        "conditions": len(conditions.conditions),
        "offsets_off": float(np.abs(np.arctan2(np.sin(off), np.cos(off))).max()),
    }


def _mismatches(mechanism: Mechanism, found: ConstantOrientation, turns: Sequence[str]) -> int:
    """Cells that are in the workspace while one of their images is not, or the reverse."""
    cells = _slice_poses(found).reshape(-1, 3)
    inside = inside_workspace(mechanism, cells)
    wrong = np.zeros(len(cells), dtype=np.bool_)
    for turn in turns:
        wrong |= inside_workspace(mechanism, map_poses(mechanism, turn, cells)) != inside
    return int(wrong.sum())


def _r_diagonals(mechanism: Mechanism, plan: Plan) -> Array:
    """abs(R_ii) of each leg at its own poses, shape (legs, p)."""
    sets = [plan.poses[plan.rows_of_set(leg)] for leg in _legs(plan)]
    return np.array(
        [analyse_observability(mechanism, leg, each).r_diagonal for leg, each in enumerate(sets)]
    )


def _observability_figures(mechanism: Mechanism, plan: Plan, diagonals: Array) -> dict[str, Any]:
    reference = plan.poses[plan.rows_of_set(0)]
    printed = [
        (
            analyse_observability(mechanism, leg, reference).r_diagonal,
            analyse_observability(
                mechanism, 0, map_poses(mechanism, element, reference)
            ).r_diagonal,
        )
        for leg, (_, element) in enumerate(leg_carriers(mechanism))
    ]
    mapped = plan.poses[np.concatenate([plan.rows_of_set(leg) for leg in _legs(plan)])]
    hexapod = load_mechanism("hexapod_jugglebot")
    moved = sample_workspace(hexapod, 100, 1).poses
    carried = np.stack(
        [map_poses(hexapod, each, moved) for each in observability_group(hexapod) or ()]
    )
    dots = np.abs(np.sum(carried[..., 3:] * moved[:, 3:], axis=-1))
    return {
        "legs": len(mechanism.legs),
        "mapped_deviation": float(np.abs(diagonals / diagonals[0] - 1).max()),
        "printed_deviation": max(float(np.abs(one / other - 1).max()) for one, other in printed),
        "turned_planar": float(
            np.abs(mapped[:, 2] - np.tile(reference[:, 2], len(diagonals))).max()
        ),
        "turned_spatial": float(2 * np.arccos(np.minimum(1, dots)).max()),
    }


def _selection_figures(plan: Plan, seed: int) -> dict[str, Any]:
    mechanism, candidates = plan.mechanism, pose_rows(plan.candidates)

    def search(legs: int) -> None:
        for leg in range(legs):
            rows = LegRows(mechanism, leg, candidates, "paper")
            select_poses(rows, 24, seed=seed, method="sun_hollerbach", threads=1)

    def whole(*, symmetry: bool) -> None:
        make_plan(mechanism, candidates, seed=seed, symmetry=symmetry, threads=1, **_PROTOCOL)

    count = len(mechanism.parameter_names)
    basis = plan.basis
    assert basis is not None  # it was made
    chosen = basis.choices[0].selection
    better = make_plan(mechanism, candidates, seed=seed, **_PROTOCOL | {"method": "exchange"})
    assert better.basis is not None
    gap = (chosen.log_det - better.basis.choices[0].selection.log_det) / (2 * count)
    worths = [_worth(mechanism, candidates, factor * count, seed) for factor in (1, 2, 3, 10)]
    return {
        "selection_saving": _saving(lambda: search(len(mechanism.legs)), lambda: search(1)),
        "plan_saving": _saving(lambda: whole(symmetry=False), lambda: whole(symmetry=True)),
        "selection_gap": max(0.0, -float(np.expm1(gap))),
        "selection_bound": 1 - chosen.certificate.o1_efficiency,
        "efficiencies": tuple(worth / worths[-1] for worth in worths[:-1]),
    }


def _worth(mechanism: Mechanism, candidates: Array, poses: int, seed: int) -> float:
    """Information that a pose brings among so many, up to a factor: 1 / (N variance)."""
    plan = make_plan(mechanism, candidates, poses, seed, spares=0, **_PROTOCOL)
    expected = predict_accuracy(mechanism, plan, thinned(candidates), "paper", poses="own")
    return float(1 / (poses * expected.position**2))


def _iteration_figures(mechanism: Mechanism, plan: Plan, seed: int) -> dict[str, Any]:
    measured = simulate_observed(mechanism, plan, seed).measurements
    rows = measured.leg_sets == 0
    poses, readings = measured.poses[rows], measured.readings[rows, 0]
    return {
        name: tuple(_iterations(mechanism, poses, readings, direction))
        for name, direction in (("printed_steps", 1), ("corrected_steps", -1))
    }


def _iterations(
    mechanism: Mechanism, poses: Array, readings: Array, direction: int
) -> Iterator[float]:
    """Root mean squares of g - psi of leg 1 in the iteration of Eqs. 24 to 26, rad."""
    parameters = mechanism.parameters.copy()
    model = mechanism.replace(symmetry=None)
    for _ in range(_ITERATIONS + 1):
        off = model.inverse_kinematics(poses)[:, 0] - readings
        closures = np.arctan2(np.sin(off), np.cos(off))
        yield _rms(closures) if np.isfinite(closures).all() else float("nan")
        if not np.isfinite(closures).all():
            return
        step = np.linalg.lstsq(model.parameter_jacobian(0, poses), closures, rcond=None)[0]
        parameters[0] += direction * step
        model = model.with_parameters(parameters)


def _step_figures(mechanism: Mechanism, plan: Plan, traditional: Plan) -> dict[str, Any]:
    """A Gauss-Newton step of all parameters at once, its zeros multiplied, against one a leg."""
    wanted = traditional.poses[~traditional.spare]
    whole = np.concatenate(list(mechanism_rows(mechanism, wanted, "paper")))
    legs = [
        observability_rows(mechanism, leg, plan.poses[plan.rows_of_set(leg)]) for leg in _legs(plan)
    ]

    def solve(matrices: Sequence[Array]) -> None:
        for matrix in matrices:
            np.linalg.lstsq(matrix, np.ones(len(matrix)), rcond=None)

    return {
        "step_saving": _saving(lambda: solve([whole]), lambda: solve(legs), _STEP_REPETITIONS),
        "condition_whole": float(np.linalg.cond(whole)),
        "condition_leg": float(np.linalg.cond(legs[0])),
    }


def _saving(
    long: Callable[[], object], short: Callable[[], object], repetitions: int = _REPETITIONS
) -> Ratio:
    """Processor time of one task over another's, of each its fastest repetition.

    They take turns, so that what else the machine does hits both alike. The interval is that of the
    middle half of the turns, and has the ratio in it.
    """
    runs = np.array([(seconds_of(long), seconds_of(short)) for _ in range(repetitions)])
    found = float(runs[:, 0].min() / runs[:, 1].min())
    low, high = np.quantile(runs[:, 0] / runs[:, 1], [0.25, 0.75]).tolist()
    return Ratio(found, min(low, found), max(high, found))
