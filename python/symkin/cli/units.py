# SPDX-License-Identifier: MIT
"""Numbers with units, as a person reads them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from symkin.evaluation import Evaluation
from symkin.mechanism import Mechanism

__all__ = ["error_rows", "estimate", "milli", "numbers", "parameter_labels"]


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


def error_rows(mechanism: Mechanism, *evaluations: Evaluation) -> list[list[str]]:
    """Rows of a table with a column an evaluation; a point platform has no orientation."""
    kinds = [("position", "m"), ("orientation", "rad")]
    if mechanism.pose_space == "point":
        kinds.pop()
    return [
        [
            f"{kind} error {label}",
            *(milli(getattr(each, f"{kind}_{figure}"), unit) for each in evaluations),
        ]
        for kind, unit in kinds
        for label, figure in (("rms", "rms"), ("maximum", "max"))
    ]


def estimate(value: float, deviation: float) -> str:
    """A value with its standard deviation, both to the deviation's second digit."""
    if not (math.isfinite(deviation) and deviation > 0):
        return f"{value:.6f} ±?"
    decimals = max(0, 1 - math.floor(math.log10(deviation)))
    return f"{value:.{decimals}f} ±{deviation:.{decimals}f}"
