# SPDX-License-Identifier: MIT
"""Whether a workspace can be sampled around the home pose, and what to do if not."""

from __future__ import annotations

import numpy as np

from symkin import _core
from symkin.errors import MechanismFileError, SymkinError, named_legs
from symkin.mechanism import Mechanism
from symkin.poses import poses_from_bounds

__all__ = ["require_usable_home"]

_SINGULAR = 1e8  # condition number that rounding cannot tell from infinity
_TRIED = 2000  # poses of the box, for one that home could be


def require_usable_home(mechanism: Mechanism, reach_margin: float) -> None:
    """Refuse a home pose that is not in the workspace whose aspect it defines.

    Parameters
    ----------
    mechanism : Mechanism
        With workspace settings.
    reach_margin : float
        That every leg must keep, m.

    Raises
    ------
    SymkinError
        With the figure, the limit that it misses and what to try; of a mechanism that was read from
        a file a MechanismFileError with the line.
    """
    settings = mechanism.workspace
    assert settings is not None
    values = settings.home or (0.0,) * mechanism.core.dof
    home = f"the home pose {_listed(values)}"
    margins = _core.reach_margin(mechanism.core, mechanism.home[None])[0]
    if not (margins >= reach_margin).all():
        leg = int(np.argmin(margins))
        inside = f"{margins[leg]:.3g} m within the reach of"
        what = inside if margins[leg] >= 0 else "out of reach of"
        raise _refusal(
            mechanism,
            "home",
            f"{home} is {what} {named_legs([leg])}, and reach_margin is "
            f"{reach_margin:g} m; {_another(mechanism, reach_margin)}, or lower reach_margin",
        )
    condition = float(mechanism.singularity_measures(mechanism.home)[2][0])
    if not condition <= settings.conditioning_limit:
        singular = not condition < _SINGULAR
        what = "is singular (condition number infinite)"
        if not singular:
            what = f"has the condition number {condition:.3g}"
        limit = f"conditioning_limit is {settings.conditioning_limit:g}"
        raise _refusal(
            mechanism,
            "home",
            f"{home} {what}, and {limit}; {_another(mechanism, reach_margin)}"
            + ("" if singular else ", or raise conditioning_limit"),
        )


def _another(mechanism: Mechanism, reach_margin: float) -> str:
    """What to try: a well-conditioned pose of the box, if it has one."""
    settings = mechanism.workspace
    assert settings is not None
    random = np.random.default_rng(0)
    values = random.uniform(settings.lower, settings.upper, (_TRIED, mechanism.core.dof)).round(3)
    poses = poses_from_bounds(mechanism.pose_space, values)
    readings = mechanism.inverse_kinematics(poses)
    limits = mechanism.joint_limits
    usable = ((readings >= limits.lower) & (readings <= limits.upper)).all(axis=1)
    usable &= (_core.reach_margin(mechanism.core, poses) >= reach_margin).all(axis=1)
    conditions = np.where(usable, mechanism.singularity_measures(poses)[2], np.nan)
    if not usable.any() or not np.nanmin(conditions) <= settings.conditioning_limit:
        return (
            f"none of {_TRIED} poses of the workspace box would do either: change the box, or the "
            "geometry"
        )
    best = int(np.nanargmin(conditions))
    return (
        f"try another home, such as {_listed(values[best].tolist())} (m, rad), whose condition "
        f"number is {conditions[best]:.3g}"
    )


def _listed(values: tuple[float, ...] | list[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


def _refusal(mechanism: Mechanism, key: str, message: str) -> SymkinError:
    """At its line, if the file from which the mechanism was read is still there."""
    from symkin.io.toml_file import read_toml

    if mechanism.source is not None:
        try:
            return read_toml(mechanism.source).error(("workspace", key), message)
        except MechanismFileError:
            pass
    return SymkinError(f'mechanism "{mechanism.name}": {message}')
