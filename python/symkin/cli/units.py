# SPDX-License-Identifier: MIT
"""Numbers with units, as a person reads them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from symkin.mechanism import Mechanism

__all__ = ["milli", "numbers", "parameter_labels"]


def parameter_labels(mechanism: Mechanism) -> list[str]:
    """Return the parameters' names with their units."""
    units = zip(mechanism.parameter_names, mechanism.parameter_units, strict=True)
    return [f"{name}, {unit}" if unit else name for name, unit in units]


def numbers(values: Iterable[float], digits: int = 6) -> list[str]:
    """Return numbers as text, a dash for what there is not."""
    return ["-" if math.isnan(value) else f"{value:.{digits}g}" for value in values]


def milli(value: float, unit: str) -> str:
    """A small length or angle: ``0.0821 mm``."""
    return f"{value * 1e3:.3g} m{unit}"
