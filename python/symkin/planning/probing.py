# SPDX-License-Identifier: MIT
"""Points at which a probe is to touch a bed."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.identification.estimate import with_file_settings
from symkin.mechanism import Mechanism
from symkin.observed import Observed
from symkin.planning.observing import Observing, Unknowns, placed
from symkin.probing import with_probing_defaults

if TYPE_CHECKING:
    from symkin.planning.plan import Plan

__all__ = ["is_probing", "on_the_bed", "probing_unknowns", "write_bed_points"]

Array = NDArray[np.float64]

_FREE_ROOM = 1e-9  # m, by which rounding may put a plane beyond the workspace


def is_probing(mechanism: Mechanism, observe: Observing) -> bool:
    """Whether heights are all that is observed of a platform that never turns."""
    kinds = observe.kinds if isinstance(observe, Observed) else observe
    alone = kinds == "height" or tuple(kinds) == ("height",)
    return alone and mechanism.pose_space == "translating"


def on_the_bed(mechanism: Mechanism, observe: Observing, poses: Array) -> Array:
    """Poses moved along z to the plane that is observed, those that the workspace has there.

    Raises
    ------
    SymkinError
        If the workspace has none.
    """
    c0, c1, c2 = placed(mechanism, observe)[0].plane
    moved = np.array(poses)
    moved[:, 2] = c0 + c1 * moved[:, 0] + c2 * moved[:, 1]
    if mechanism.workspace is None:
        return moved
    low, high = mechanism.workspace.lower[2], mechanism.workspace.upper[2]
    inside = (moved[:, 2] >= low - _FREE_ROOM) & (moved[:, 2] <= high + _FREE_ROOM)
    if not inside.any():
        raise SymkinError(
            f"the bed is at z = {c0:g} m, outside of the workspace's {low:g} to {high:g} m; say "
            'where it is: --plane "c0, c1, c2" of z = c0 + c1 x + c2 y, or plane in the [frames] '
            "of the mechanism's file"
        )
    return moved[inside]


def probing_unknowns(mechanism: Mechanism, unknowns: Mapping[str, Any]) -> Unknowns:
    """What is unknown as `identify` will have it."""
    given = {name: unknowns.get(name) for name in Unknowns.__annotations__}
    chosen = with_probing_defaults(with_file_settings(given, mechanism.identification))
    return cast(Unknowns, {name: chosen.get(name) for name in given})


def write_bed_points(plan: Plan, path: str | os.PathLike[str]) -> None:
    """Write where to probe, in the order of the plan, without spares: ``x_mm,y_mm``."""
    from symkin.io.tables import write_table

    points = np.round(1e3 * plan.poses[~plan.spare, :2], 2)
    write_table(Path(path), {"x_mm": points[:, 0], "y_mm": points[:, 1]})
