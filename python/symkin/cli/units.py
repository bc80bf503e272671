# SPDX-License-Identifier: MIT
"""Numbers with units, as a person reads them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from symkin.evaluation import AlignedErrors, Evaluation
from symkin.mechanism import Mechanism
from symkin.workspace.sample import coordinate_names

__all__ = [
    "error_rows",
    "estimate",
    "left_out_rows",
    "milli",
    "numbers",
    "parameter_labels",
    "root_mean_squares",
]


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
    """Rows of a table with a column an evaluation; a point platform has no orientation.

    First what remains after the best alignment of the frames, then the errors as they are, then
    their means.
    """
    kinds = [("position", "m"), ("orientation", "rad")]
    if mechanism.pose_space == "point":
        kinds.pop()
    aligned = [each.aligned for each in evaluations]
    rows = [
        [f"{prefix}{kind} error {label}", *(_figure(each, f"{kind}_{figure}", unit) for each in of)]
        for prefix, of in (("aligned ", aligned), ("", evaluations))
        if any(of)
        for kind, unit in kinds
        for label, figure in (("rms", "rms"), ("maximum", "max"))
    ]
    units = ["m"] * 3 + ["rad"] * 3 if mechanism.pose_space == "spatial" else ["m", "m", "rad"]
    return rows + [
        [f"mean {name} error", *(milli(each.means[index], unit) for each in evaluations)]
        for index, (name, unit) in enumerate(zip(coordinate_names(mechanism), units, strict=False))
    ]


def root_mean_squares(
    mechanism: Mechanism, evaluation: Evaluation | None
) -> list[tuple[str, float, str]]:
    """Kind, size and unit of the errors; a point platform has no orientation."""
    if evaluation is None:
        return []
    kinds = [
        ("position", evaluation.position_rms, "m"),
        ("orientation", evaluation.orientation_rms, "rad"),
    ]
    return kinds[:1] if mechanism.pose_space == "point" else kinds


def left_out_rows(*counts: int) -> list[list[str]]:
    """A row that says how many poses the figures of each column leave out, if any do."""
    return [["poses left out", *map(str, counts)]] if any(counts) else []


def _figure(errors: Evaluation | AlignedErrors | None, name: str, unit: str) -> str:
    return milli(getattr(errors, name), unit) if errors else "-"


def estimate(value: float, deviation: float) -> str:
    """A value with its standard deviation, both to the deviation's second digit."""
    if not (math.isfinite(deviation) and deviation > 0):
        return f"{value:.6f} ±?"
    decimals = max(0, 1 - math.floor(math.log10(deviation)))
    return f"{value:.{decimals}f} ±{deviation:.{decimals}f}"
