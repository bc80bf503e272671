# SPDX-License-Identifier: MIT
"""What a declared leg's drawing holds: redundant by structure, or visible in second order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from symkin import _core
from symkin.errors import SymkinError
from symkin.model.mechanism import Mechanism
from symkin.model.poses import poses_from_bounds
from symkin.values import Array

_POSES, _DRAWS = 40, 2
_NOTHING = 1e-7  # of a column: what rounding leaves of one that others explain


def second_order(mechanism: Mechanism, leg: int, exact: Sequence[str] = ()) -> dict[str, float]:
    """Held parameters of a leg that errors within the tolerances make visible, with their effect.

    What is null at the drawn geometry, and at draws of all of the leg's numbers within the
    tolerances too, is redundant by structure, and is not among them. `exact` ones have no errors.
    The effect is what one tolerance does to the closures, root mean square, beside all that is
    estimated: m or rad, the largest of some draws. Without a workspace nothing is found.
    """
    settings, names = mechanism.workspace, mechanism.parameter_names
    held = [names.index(name) for name in mechanism.held[leg] if name not in exact]
    if settings is None or not held:
        return {}
    random = np.random.default_rng(5)
    lower, upper = np.array(settings.lower), np.array(settings.upper)
    values = random.uniform(lower, upper, (_POSES, len(lower)))
    home = mechanism.home_coordinates
    values = home + 0.7 * (values - home)
    poses = np.ascontiguousarray(poses_from_bounds(mechanism.pose_space, values))
    sizes = _tolerances(mechanism, leg)
    sizes[[name in exact for name in names]] = 0.0
    found: dict[str, float] = {}
    for _ in range(_DRAWS):
        parameters = mechanism.parameters.copy()
        parameters[leg] += sizes * random.standard_normal(len(names))
        try:
            robot = mechanism.straight.with_parameters(parameters)
        except SymkinError:  # no such leg is possible
            continue
        rows = _rows(robot, leg, poses)
        if rows is None:
            continue
        kept = rows[:, mechanism.is_estimated[leg]]
        for each in held:
            column = rows[:, each] * sizes[each]
            left = column - kept @ np.linalg.lstsq(kept, column, rcond=1e-12)[0]
            size = float(np.sqrt(np.mean(left**2)))
            if size > _NOTHING * np.sqrt(np.mean(column**2)) and size > 1e-15:
                found[names[each]] = max(size, found.get(names[each], 0.0))
    return found


def _rows(robot: _core.Mechanism, leg: int, poses: Array) -> Array | None:
    """Derivatives of a leg's closures at poses that it reaches."""
    taken = _core.on_constraint(robot, poses)
    readings = _core.inverse_kinematics(robot, taken)[:, leg]
    fine = np.isfinite(readings) & np.isfinite(taken).all(axis=1)
    if not fine.any():
        return None
    at = np.ascontiguousarray(taken[fine])
    return np.asarray(_core.linearise(robot, leg, at, readings[fine]).by_parameters)


def _tolerances(mechanism: Mechanism, leg: int) -> Array:
    """Of all numbers that are drawn, held ones too; zero of constants and of the sensor."""
    tolerances = mechanism.tolerances
    roles = mechanism.parameter_roles(leg)
    units = mechanism.parameter_units(leg)
    return np.array(
        [
            0.0
            if role.is_constant or role.is_given or role.kind in ("gain", "offset")
            else tolerances.angle
            if unit == "rad"
            else tolerances.length
            for role, unit in zip(roles, units, strict=True)
        ]
    )
