# SPDX-License-Identifier: MIT
"""Plans for what will be observed and what is unknown then: rows, priors and what they promise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symkin.analysis.observability import RowKind
from symkin.analysis.observed import Observed
from symkin.analysis.straightedge import on_the_edge
from symkin.data.measurements import Measurements
from symkin.data.observables import words_between_rows
from symkin.errors import SymkinError
from symkin.estimate.problem import what_holds
from symkin.estimate.survey import Survey, placed
from symkin.model.mechanism import Mechanism
from symkin.model.settings import height_of_bed
from symkin.planning.selection import Task
from symkin.values import Array, record


@record
class ObservedTask(Task):
    """The selection for a survey: of poses for all unknowns at once.

    Of pairs of poses, one behind the other, where something is observed between them.
    """

    survey: Survey

    def candidate_rows(self, poses: Array, _kind: RowKind) -> Array:
        """Rows that candidates bring to a selection."""
        return self.survey.rows(poses)

    def rows(self, poses: Array, _kind: RowKind) -> Array:
        """The same."""
        return self.survey.rows(poses)

    def parameter_names(self) -> tuple[str, ...]:
        """Names of the columns of its rows."""
        return self.survey.unknowns

    def scale(self) -> Array:
        """A typical size of each."""
        return self.survey.scale

    def error_weight(self, poses: Array) -> Array:
        """B of the expected squared error, see `symkin.analysis.observability.error_weight`."""
        return self.survey.error_weight(poses)

    def prior(self, measured: Measurements | None, _kind: RowKind) -> Array | None:
        """Information of the priors and of what is measured already."""
        information = self.survey.prior_information
        if measured is not None:
            rows = self.survey.measured_rows(measured)
            information = information + np.einsum("nri,nrj->ij", rows, rows)
        return information if information.any() else None

    def advice(self, unseen: Sequence[str]) -> str:
        """What to do where nothing shows combinations of unknowns."""
        return what_holds(self.survey.mechanism, unseen)


_PAIRINGS = 4  # times that every pose is paired with another one
_FREE_ROOM = 1e-9  # m, by which rounding may put a plane beyond the workspace


def is_probing(mechanism: Mechanism, observe: Observed | None) -> bool:
    """Whether heights are all that is observed of a platform that never turns."""
    return (
        observe is not None
        and observe.kinds == ("height",)
        and mechanism.pose_space == "translating"
    )


def dealt(poses: Array, together: int, seed: int) -> Array:
    """Candidates of so many poses each, shape (n, together, coordinates); each pose is in a few."""
    if together == 1:
        return poses[:, None]
    random = np.random.default_rng(seed)
    even = len(poses) - len(poses) % together
    order = np.concatenate([random.permutation(len(poses))[:even] for _ in range(_PAIRINGS)])
    return np.asarray(poses[order].reshape(-1, together, poses.shape[1]))


def where_observed(mechanism: Mechanism, observe: Observed | None, poses: Array) -> Array:
    """Poses moved to where all that is observed can be: to a bed, or a straightedge.

    Raises
    ------
    SymkinError
        If the workspace has none.
    """
    if observe is None:
        return poses
    each = {*observe.kinds} - words_between_rows()
    printed = mechanism.device is not None and mechanism.device.prints and not each
    if (printed or each == {"height"}) and mechanism.pose_space == "translating":
        return _on_the_bed(mechanism, observe, poses)
    if observe.kinds == ("straightness",):
        return _on_the_edge(mechanism, observe, poses)
    return poses


def _on_the_edge(mechanism: Mechanism, observe: Observed, poses: Array) -> Array:
    moved = on_the_edge(placed(mechanism, observe)[1], poses)
    if mechanism.workspace is None:
        return moved
    own, size = mechanism.workspace, mechanism.space.size
    low = np.array(own.lower[:size]) - _FREE_ROOM
    high = np.array(own.upper[:size]) + _FREE_ROOM
    inside = ((moved[:, :size] >= low) & (moved[:, :size] <= high)).all(axis=1)
    if not inside.any():
        raise SymkinError(
            "the straightedge, the x axis of the device's frame, does not go through the "
            "workspace; say where it is: base in the [frames] of the mechanism's file, the robot's "
            "base in that frame"
        )
    return np.asarray(moved[inside])


def _on_the_bed(mechanism: Mechanism, observe: Observed, poses: Array) -> Array:
    """Poses moved along z to the plane that is observed, those that the workspace has there."""
    plane = placed(mechanism, observe)[0].plane
    moved = np.array(poses)
    moved[:, 2] = height_of_bed(plane, moved)
    if mechanism.workspace is None:
        return moved
    low, high = mechanism.workspace.lower[2], mechanism.workspace.upper[2]
    inside = (moved[:, 2] >= low - _FREE_ROOM) & (moved[:, 2] <= high + _FREE_ROOM)
    if not inside.any():
        raise SymkinError(
            f"the bed is at z = {plane[0]:g} m, outside of the workspace's {low:g} to {high:g} m; "
            'say where it is: --plane "c0, c1, c2" of z = c0 + c1 x + c2 y, or plane in the '
            "[frames] of the mechanism's file"
        )
    return moved[inside]
