# SPDX-License-Identifier: MIT
"""What of the paper's claims is measured on one mechanism and its plans."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.analysis.conditions import check_conditions
from symkin.analysis.evaluation import evaluate
from symkin.analysis.observability import analyse_observability, mechanism_rows, observability_rows
from symkin.analysis.promises import thinned
from symkin.analysis.workspace import inside_workspace, sample_workspace
from symkin.analysis.workspace.study import ConstantOrientation, WorkspaceStudy, study_workspace
from symkin.model.mechanism import Mechanism
from symkin.model.poses import pose_rows
from symkin.model.symmetry import leg_carriers, map_poses, observability_group
from symkin.planning import Plan, make_plan, predict_accuracy
from symkin.planning.selection import LegRows, SelectionMethod, select_poses
from symkin.planning.simulation import simulate_observed
from symkin.robot import load_mechanism
from symkin.study.cost import seconds_of
from symkin.study.summaries import Ratio

__all__ = [
    "ORIENTATIONS",
    "PROTOCOL",
    "iteration_figures",
    "legs_of",
    "observability_figures",
    "r_diagonals",
    "selection_figures",
    "slice_poses",
    "step_figures",
    "symmetry_figures",
    "tilt_figures",
]

Array = NDArray[np.float64]

ORIENTATIONS = (0.0, 0.4, 0.6)  # rad, section 6.2
_OFFSETS = np.deg2rad([30.0, 150.0, -90.0])  # Eq. 19
_MOVED_ZERO = 0.1  # rad, of a sensor that is not where Eq. 19 has it
_ITERATIONS = 4  # of Eqs. 24 to 26 in either direction
_REPETITIONS = 5  # of what is timed, the fastest of which counts
_STEP_REPETITIONS = 200  # of what takes a tenth of a millisecond

# How the paper chooses poses.
PROTOCOL: dict[str, Any] = {
    "rows": "paper",
    "method": "sun_hollerbach",
    "margin_sigmas": 0.0,
    "visit": "sets",
}


def slice_poses(found: ConstantOrientation) -> Array:
    """Poses of all cells, shape (rows, columns, 3)."""
    x, y = np.meshgrid(found.x, found.y)
    return np.stack([x, y, np.full(x.shape, found.orientation)], axis=-1)


def legs_of(plan: Plan) -> range:
    """Return the legs of its mechanism."""
    return range(plan.readings.shape[1])


def symmetry_figures(
    mechanism: Mechanism, seed: int, poses: int
) -> tuple[WorkspaceStudy, dict[str, Any]]:
    """Test the group on the workspace, the readings and the conditions."""
    workspace = study_workspace(mechanism, ORIENTATIONS, poses, seed)
    conditions = check_conditions(mechanism, poses, seed)
    checks = conditions.elements
    groups = {(each.symbol, each.meaning): each.elements for each in conditions.groups}
    structure = groups["G_M", "structure"]
    turns = [label for label in groups["G_W", "with the working modes"] if label != "r0"]
    offsets = mechanism.parameters[:, mechanism.parameter_names.index("sensor_offset")]
    off = offsets - _OFFSETS
    return workspace, {
        **_moved_zero_figures(mechanism, workspace.sample.poses),
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


def _moved_zero_figures(mechanism: Mechanism, poses: Array) -> dict[str, Any]:
    """Whether workspace and readings keep the symmetry where one sensor's zero is elsewhere."""
    parameters = mechanism.parameters.copy()
    parameters[1, mechanism.parameter_names.index("sensor_offset")] += _MOVED_ZERO
    moved = mechanism.replace(symmetry=None).with_parameters(parameters)
    carriers = leg_carriers(mechanism)
    image = map_poses(mechanism, carriers[1][1], poses)
    taken = [
        each.inverse_kinematics(where) for each in (mechanism, moved) for where in (poses, image)
    ]
    # Which leg reads at the image what the others read at the pose: as the symmetric robot says.
    order = [
        int(np.argmin([np.nanmax(np.abs(taken[1][:, leg] - other)) for other in taken[0].T]))
        for leg in range(len(mechanism.legs))
    ]
    return {
        "moved_zero_mismatches": int(
            (inside_workspace(moved, poses) != inside_workspace(moved, image)).sum()
        ),
        "moved_zero_deviation": float(np.nanmax(np.abs(taken[3] - taken[2][:, order]))),
    }


def _mismatches(mechanism: Mechanism, found: ConstantOrientation, turns: Sequence[str]) -> int:
    """Cells that are in the workspace while one of their images is not, or the reverse."""
    cells = slice_poses(found).reshape(-1, 3)
    inside = inside_workspace(mechanism, cells)
    wrong = np.zeros(len(cells), dtype=np.bool_)
    for turn in turns:
        wrong |= inside_workspace(mechanism, map_poses(mechanism, turn, cells)) != inside
    return int(wrong.sum())


def r_diagonals(mechanism: Mechanism, plan: Plan) -> Array:
    """abs(R_ii) of each leg at its own poses, shape (legs, p)."""
    sets = [plan.poses[plan.rows_of_set(leg)] for leg in legs_of(plan)]
    return np.array(
        [analyse_observability(mechanism, leg, each).r_diagonal for leg, each in enumerate(sets)]
    )


def observability_figures(mechanism: Mechanism, plan: Plan, diagonals: Array) -> dict[str, Any]:
    """Compare abs(R_ii) of the legs, of both ways to map and of orders of the parameters."""
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
    mapped = plan.poses[np.concatenate([plan.rows_of_set(leg) for leg in legs_of(plan)])]
    hexapod = load_mechanism("hexapod_jugglebot")
    moved = sample_workspace(hexapod, 100, 1).poses
    carried = np.stack(
        [map_poses(hexapod, each, moved) for each in observability_group(hexapod) or ()]
    )
    first, last = _r_extremes(observability_rows(mechanism, 0, reference))
    most = int(np.argmax(first / last))
    dots = np.abs(np.sum(carried[..., 3:] * moved[:, 3:], axis=-1))
    return {
        "legs": len(mechanism.legs),
        "mapped_deviation": float(np.abs(diagonals / diagonals[0] - 1).max()),
        "printed_deviation": max(float(np.abs(one / other - 1).max()) for one, other in printed),
        "order_parameter": mechanism.parameter_names[most],
        "order_diagonals": (float(first[most]), float(last[most])),
        "turned_planar": float(
            np.abs(mapped[:, 2] - np.tile(reference[:, 2], len(diagonals))).max()
        ),
        "turned_spatial": float(2 * np.arccos(np.minimum(1, dots)).max()),
    }


def _r_extremes(rows: Array) -> tuple[Array, Array]:
    """abs(R_ii) of each parameter, were it the first of all and were it the last."""
    inverse = np.linalg.inv(rows.T @ rows)
    return np.linalg.norm(rows, axis=0), 1 / np.sqrt(np.diag(inverse))


def tilt_figures(mechanism: Mechanism, plan: Plan) -> dict[str, Any]:
    """What axes that are not square to the plane do: a link's projection onto it is shorter."""
    tilt, parameters = mechanism.tolerances.angle, mechanism.parameters.copy()
    links = [mechanism.parameter_names.index(f"{each}_length") for each in ("proximal", "distal")]
    lengths = parameters[:, links].copy()
    parameters[:, links] *= np.cos(tilt)
    tilted = mechanism.replace(symmetry=None).with_parameters(parameters)
    found = evaluate(mechanism, actual=tilted, poses=thinned(pose_rows(plan.candidates)))
    return {
        "tilt": tilt,
        "tilted_error": found.position_rms,
        "tilted_out_of_plane": float(lengths.max() * np.sin(tilt)),
    }


def selection_figures(plan: Plan, seed: int) -> dict[str, Any]:
    """Time searches for poses, and compare what they find."""
    mechanism, candidates = plan.mechanism, pose_rows(plan.candidates)

    def search(legs: int, method: SelectionMethod = "sun_hollerbach") -> None:
        for leg in range(legs):
            rows = LegRows(mechanism, leg, candidates, "paper")
            select_poses(rows, 24, seed=seed, method=method, threads=1)

    rows = observability_rows(mechanism, 0, candidates)

    def replace_one() -> None:
        """Find the best of all candidates for one place, by the singular values of Eq. 13."""
        sets = np.empty((len(rows), 24, rows.shape[1]))
        sets[:, 1:], sets[:, 0] = rows[:23], rows
        np.linalg.svd(sets, compute_uv=False)

    def whole(*, symmetry: bool) -> None:
        make_plan(mechanism, candidates, seed=seed, symmetry=symmetry, threads=1, **PROTOCOL)

    count = len(mechanism.parameter_names)
    basis = plan.basis
    assert basis is not None  # it was made
    chosen = basis.choices[0].selection
    better = make_plan(mechanism, candidates, seed=seed, **PROTOCOL | {"method": "exchange"})
    assert better.basis is not None
    gap = (chosen.log_det - better.basis.choices[0].selection.log_det) / (2 * count)
    worths = [_worth(mechanism, candidates, factor * count, seed) for factor in (1, 2, 3, 10)]
    return {
        "selection_saving": _saving(lambda: search(len(mechanism.legs)), lambda: search(1)),
        "plan_saving": _saving(lambda: whole(symmetry=False), lambda: whole(symmetry=True)),
        "replacement_saving": _saving(replace_one, lambda: search(1), 2),
        "exchange_saving": _saving(lambda: search(1, "exchange"), lambda: search(1)),
        "selection_gap": max(0.0, -float(np.expm1(gap))),
        "selection_bound": 1 - chosen.certificate.o1_efficiency,
        "efficiencies": tuple(worth / worths[-1] for worth in worths[:-1]),
    }


def _worth(mechanism: Mechanism, candidates: Array, poses: int, seed: int) -> float:
    """Information that a pose brings among so many, up to a factor: 1 / (N variance)."""
    plan = make_plan(mechanism, candidates, poses, seed, spares=0, **PROTOCOL)
    expected = predict_accuracy(mechanism, plan, thinned(candidates), "paper", poses="own")
    return float(1 / (poses * expected.position**2))


def iteration_figures(mechanism: Mechanism, plan: Plan, seed: int) -> dict[str, Any]:
    """Iterate as Eqs. 24 to 26 are printed, and with the other sign."""
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
        yield float(np.sqrt(np.mean(closures**2))) if np.isfinite(closures).all() else float("nan")
        if not np.isfinite(closures).all():
            return
        step = np.linalg.lstsq(model.parameter_jacobian(0, poses), closures, rcond=None)[0]
        parameters[0] += direction * step
        model = model.with_parameters(parameters)


def step_figures(mechanism: Mechanism, plan: Plan, traditional: Plan) -> dict[str, Any]:
    """A Gauss-Newton step of all parameters at once, its zeros multiplied, against one a leg."""
    wanted = traditional.poses[~traditional.spare]
    whole = np.concatenate(list(mechanism_rows(mechanism, wanted, "paper")))
    legs = [
        observability_rows(mechanism, leg, plan.poses[plan.rows_of_set(leg)])
        for leg in legs_of(plan)
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
