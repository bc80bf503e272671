# SPDX-License-Identifier: MIT
"""What is said to change while a simulated robot is measured: drift, steps, sessions and so on."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.changes import Changes
from symkin.estimate.covariates import covariates_of, slopes_of
from symkin.estimate.scalars import matches_name, slope_units
from symkin.model.core_setup import core_setup, scalar_names
from symkin.model.mechanism import Mechanism
from symkin.storage.quantities import evaluate_quantity

_EXPECTED = (
    "expected drift, backlash, growth, step with the number of a row, or session with its own, as "
    "leg2.drift of a leg, drift of every leg, drift.x of where the base is, or session1.noise"
)


def with_sessions(taken: Measurements, sizes: Mapping[str, float | str]) -> Measurements:
    """Rows one after the other in as many sessions as are named, of as many rows; none without."""
    named = [int(each) for name in sizes for each in re.findall(r"session(\d+)", name)]
    if not named:
        return taken
    count = max(2, *named)
    return replace(taken, sessions=1 + np.arange(len(taken)) * count // max(len(taken), 1))


def changes_of(
    mechanism: Mechanism, taken: Measurements, sizes: Mapping[str, float | str]
) -> Changes:
    """Read sizes by name, in SI units or as text, for poses in the order in which they are taken.

    Raises
    ------
    SymkinError
        For a name of nothing that may change, or a size that is no quantity of its unit.
    """
    asked: dict[str, Any] = {"drift": [], "step": [], "sessions": []}
    noise = {name: size for name, size in sizes.items() if name.endswith(".noise")}
    sizes = {name: size for name, size in sizes.items() if name not in noise}
    for name in sizes:
        block, _, own = name.rpartition(".")
        of_frame = bool(block) and not block.startswith("leg")
        what = block if of_frame else own
        found = re.fullmatch(r"drift|growth|backlash|session\d+|step(\d+)", what)
        if not found or (of_frame and what in ("growth", "backlash")):
            raise SymkinError(f'changes has "{name}"; {_EXPECTED}')
        moving = "frame" if of_frame else "leg"
        if found[1]:
            asked["step"].append(f"{moving}:{found[1]}")
        elif what == "drift":
            asked["drift"].append(moving)
        elif what.startswith("session"):
            asked["sessions"].append("frames" if of_frame else "offsets")
        else:
            asked[what] = True
    asked |= {key: list(dict.fromkeys(asked[key])) for key in ("drift", "step", "sessions")}
    covariates = covariates_of(mechanism, taken, **asked)
    slopes = slopes_of(covariates, len(mechanism.legs))
    names = scalar_names(mechanism, core_setup(mechanism, slopes=slopes))
    legs, base = slopes.legs.size, slopes.base.size
    own_names = names[len(names) - legs - base :]
    units = slope_units(mechanism, own_names, {each.name: each.per for each in covariates})
    values = np.zeros(len(own_names))
    for pattern, given in sizes.items():
        matched = [i for i, name in enumerate(own_names) if name and matches_name(name, pattern)]
        if not matched:
            raise SymkinError(f'changes has "{pattern}"; {_EXPECTED}')
        for i in matched:
            values[i] = _size(pattern, given, units[i])
    return Changes(
        covariates,
        slopes._replace(
            legs=values[:legs].reshape(slopes.legs.shape),
            base=values[legs:].reshape(slopes.base.shape),
        ),
        _larger_noise(taken, noise),
    )


def _larger_noise(taken: Measurements, sizes: Mapping[str, float | str]) -> np.ndarray:
    """Times the declared noise, of every row."""
    times = np.ones(len(taken))
    for name, given in sizes.items():
        found = re.fullmatch(r"session(\d+)\.noise", name)
        size = _size(name, given, "") if found else 0.0
        if not found or size <= 0:
            raise SymkinError(
                f'changes has "{name}" of {given}; expected the noise of a session, such as '
                "session1.noise, as a positive number of times the declared one"
            )
        assert taken.sessions is not None
        times[taken.sessions == int(found[1])] = size
    return times


def _size(pattern: str, given: float | str, unit: str) -> float:
    if isinstance(given, str):
        try:
            given = evaluate_quantity(given, unit or "1")
        except SymkinError as error:
            raise SymkinError(f'the change of "{pattern}" {error}') from error
    if not np.isfinite(given):
        raise SymkinError(f'the change of "{pattern}" is {given}; expected a finite number')
    return float(given)
