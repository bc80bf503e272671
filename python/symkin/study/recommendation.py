# SPDX-License-Identifier: MIT
"""Which protocol gives a wanted accuracy with the fewest measured poses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from symkin.errors import SymkinError
from symkin.planning.prediction import pose_count_curve
from symkin.result import Value, field, record
from symkin.study.definition import Cell

if TYPE_CHECKING:
    from symkin.study.result import StudyResult

__all__ = ["Protocol", "Recommendation", "recommend"]


@record
class Protocol(Value):
    """A protocol, and what it needs for a wanted accuracy.

    Attributes
    ----------
    cell : Cell
        One of its cells; the others have another number of poses.
    pose_count : int
        Fewest poses of each leg that are predicted to be enough; if none are, the most tried.
    measured_poses : int
        Poses to measure in all.
    enough : bool
        Whether they are.
    position, orientation : float
        Root mean square error that is predicted with them, m and rad.
    trust : float
        Of its simulated cells, how far the position error was from the prediction at the most: 1.03
        is 3% larger or smaller; NaN where none could be simulated.
    """

    cell: Cell
    pose_count: int
    measured_poses: int
    enough: bool
    position: float = field(unit="m")
    orientation: float = field(unit="rad")
    trust: float


@record
class Recommendation(Value):
    """The protocols of a mechanism, ordered by what they cost for a wanted accuracy.

    Attributes
    ----------
    mechanism : str
        Its name.
    wanted_position, wanted_orientation : float or None
        Root mean square error wanted, m and rad.
    protocols : tuple of Protocol
        Those that reach it first, the fewest measured poses first; then the others, the smallest
        error first.
    """

    mechanism: str
    wanted_position: float | None = field(unit="m")
    wanted_orientation: float | None = field(unit="rad")
    protocols: tuple[Protocol, ...]


def recommend(
    result: StudyResult, mechanism: str, position: float | None, orientation: float | None
) -> Recommendation:
    """Find how many poses each protocol of a study needs for a wanted accuracy.

    The numbers are predicted, to first order; what the study simulated says how far predictions can
    be trusted. Protocols differ in design, rows, criterion and estimator: cells with another
    method, clearance, loss, noise or tolerance, or without symmetry, take no part.

    Raises
    ------
    SymkinError
        For nothing wanted, or an error that is not positive.
    """
    series: dict[tuple[Any, ...], list[Cell]] = {}
    for cell in result.definition.cells:
        usual = (cell.method, cell.use_symmetry, cell.margin_sigmas, cell.loss)
        levels = cell.noise_level, cell.tolerance_level
        if (
            cell.mechanism == mechanism
            and usual == ("exchange", True, 3, "none")
            and levels == (1, 1)
        ):
            key = cell.design, cell.rows, cell.criterion, cell.estimator, cell.use
            series.setdefault(key, []).append(cell)
    known = (_protocol(result, cells, position, orientation) for cells in series.values())
    protocols = sorted(
        (each for each in known if each is not None),
        key=lambda each: (
            not each.enough,
            each.measured_poses if each.enough else 0,
            each.position,
        ),
    )
    return Recommendation(mechanism, position, orientation, tuple(protocols))


def _protocol(
    result: StudyResult, cells: list[Cell], position: float | None, orientation: float | None
) -> Protocol | None:
    cell = cells[0]
    planned = [each for each in cells if not isinstance(result.job.plans[each.plan_key], str)]
    if not planned:
        return None
    plan = result.plan(planned[0].id)
    assert plan.candidates is not None  # it was made here
    try:
        needed = pose_count_curve(
            plan.mechanism,
            plan.candidates,
            [each.pose_count for each in planned],
            result.definition.seed,
            design=cell.design,
            rows=cell.rows,
            criterion=cell.criterion,
            estimator=cell.estimator,
            poses=cell.use,
        ).for_accuracy(position, orientation)
    except SymkinError:
        if position is None and orientation is None:
            raise
        return None
    ratios = [result.cells[each.id].position.ratio for each in planned]
    off = [max(ratio, 1 / ratio) for ratio in ratios if ratio > 0]
    return Protocol(
        cell=cell,
        pose_count=needed.tried,
        measured_poses=needed.measured,
        enough=needed.count is not None,
        position=needed.expected.position,
        orientation=needed.expected.orientation,
        trust=max(off, default=math.nan),
    )
