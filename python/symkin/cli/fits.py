# SPDX-License-Identifier: MIT
"""How an identification is told."""

from __future__ import annotations

import math

import numpy as np

from symkin.cli.console import say, show_legs
from symkin.cli.units import estimate, numbers, parameter_labels
from symkin.identification.estimate import Identification

__all__ = ["show_fits", "unconverged_legs"]


def show_fits(identification: Identification) -> None:
    """Print the parameters with standard deviations, how well each leg fits, and the doubts."""
    mechanism, fits = identification.mechanism, identification.legs
    values = mechanism.parameters
    deviations = np.full_like(values, math.nan)
    if mechanism.deviations is not None:
        deviations = mechanism.deviations
    show_legs(
        "identified",
        [
            *(
                (label, list(map(estimate, values[:, index], deviations[:, index])))
                for index, label in enumerate(parameter_labels(mechanism))
            ),
            ("poses used", [str(len(fit.rows)) for fit in fits]),
            ("chi-square (1: as declared)", numbers([fit.chi_square for fit in fits], 3)),
            ("condition number", numbers([fit.condition for fit in fits], 3)),
            *_rejections(identification),
        ],
    )
    for doubt in identification.doubts:
        say(f"Doubt: {doubt}")
    for note in identification.diagnosis.notes:
        say(f"Note: {note}")


def unconverged_legs(identification: Identification) -> str:
    """Name the legs whose estimator did not converge, and why."""
    failures = [
        f"leg {leg}" + (f" ({fit.failure})" if fit.failure else "")
        for leg, fit in enumerate(identification.legs, 1)
        if not fit.converged
    ]
    return ", ".join(failures) or "the joint estimate of all legs"


def _rejections(identification: Identification) -> list[tuple[str, list[str]]]:
    counts = [len(fit.rejected) for fit in identification.legs]
    return [("rejected as outliers", list(map(str, counts)))] if any(counts) else []
