# SPDX-License-Identifier: MIT
"""Poses without which everything fits."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from symkin.data.measurements import Measurements
from symkin.errors import SymkinError
from symkin.estimate.evidence.drawing import implausible_parameters
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.outliers import outliers_of
from symkin.estimate.evidence.residuals import diagnosed
from symkin.estimate.fit import by_leg
from symkin.estimate.found import Found
from symkin.estimate.options import EstimateOptions, Estimator
from symkin.estimate.problem import spare_conditions
from symkin.estimate.solution import together

# Chi-square per degree of freedom from which gross errors are looked for by a robust loss.
_CHI_SQUARE = 9.0
_PLAIN = 100.0  # the same of single observations, of which more could be left out of a larger noise
_MOST = 0.25  # of the poses, or of one sensor's readings: more are no errors of single ones
_MOST_ROWS = 0.5  # that have one: of more of them something else is wrong
_STEPS = 20  # of a fit, several times as many with a loss: where it does not end there are others


def gross_errors(found: Found) -> tuple[Doubt | None, Measurements]:
    """Poses without which everything fits, and the measurements without them.

    No doubt if there are none, or if the rest fits no robot of this drawing: one that has a gain of
    the opposite sign, say, which may itself be due to a mistake.

    A robust loss finds them, since some may mask each other, and rejects a few sound ones besides.
    Only those are named that do not fit the others when they alone come back.
    """
    measured, options = found.measurements, found.options
    worst = max((fit.chi_square_ratio for fit in found.goodness if fit.unexplained), default=0.0)
    if options.loss != "none" or worst < _CHI_SQUARE:
        return None, measured
    name: Estimator = "joint" if found.estimator == "joint" else "implicit"
    if not found.legs:
        return _of_readings(found) if worst > _PLAIN else None, measured
    options = EstimateOptions(name, options.poses, noise=found.noise)
    count = len(measured.poses)

    def fitted(rows: NDArray[np.intp], how: EstimateOptions) -> Found:
        return by_leg(found.nominal, measured.subset(rows), how)

    try:
        robust = fitted(np.arange(count), replace(options, loss="cauchy"))
        gross = np.unique([row for row, _ in robust.rejected]).astype(np.intp)
        sound = np.setdiff1d(np.arange(count), gross)
        for row in gross if robust.converged and len(gross) <= 2 * _MOST * count else ():
            rows = np.union1d(sound, [row])
            back = fitted(rows, options)
            outliers = outliers_of(back, diagnosed(back))
            if row not in rows[[each.row for each in outliers]]:
                gross = np.setdiff1d(gross, [row])
        clean = fitted(np.setdiff1d(np.arange(count), gross), options)
    except SymkinError:
        return None, measured
    few = 0 < len(gross) <= _MOST * count
    if not clean.converged or not few or any(fit.unexplained for fit in clean.goodness):
        return None, measured
    if any(implausible_parameters(clean)):
        return None, clean.measurements
    return _told(found, gross, clean.chi_square_ratio), clean.measurements


def _of_readings(found: Found) -> Doubt | None:
    """Where everything is estimated together: single observations, whatever else a row has."""
    steps = min(found.options.max_iterations, _STEPS)
    options = replace(
        found.options, loss="cauchy", loss_per="reading", noise=found.noise, max_iterations=steps
    )
    most = int(_MOST * found.measurements.readings.size)
    try:
        robust = together(found.nominal, found.measurements, options, most)
    except SymkinError:
        return None
    few = 0 < len(robust.rejected) <= most
    if not few or not robust.converged or robust.unexplained or any(implausible_parameters(robust)):
        return None
    rows = np.unique([row for row, _ in robust.rejected])
    if len(rows) > _MOST_ROWS * len(found.measurements.poses):
        return None
    alike = Counter(what for _, what in robust.rejected)
    if max(alike.values()) > _MOST * len(found.measurements.poses):  # of one sensor, say
        return None
    # With one condition any observation of a pose may be it.
    told = spare_conditions(found.nominal, found.measurements)[rows]
    single = len(alike) == 1 and (told > 1).all()
    what = f", each in the {next(iter(alike))}" if single else ""
    return _told(found, rows, robust.chi_square_ratio, what, {"loss_per": "reading"})


def _told(
    found: Found,
    gross: NDArray[np.intp],
    ratio: float,
    what: str = "",
    more: Mapping[str, str] = MappingProxyType({}),
) -> Doubt:
    numbers = tuple(found.measurements.row_numbers[gross].tolist())
    figures = {"total": len(found.measurements.poses), "after": ratio, "what": what}
    doubt = Doubt("gross-errors", rows=numbers, figures=figures, options={"loss": "cauchy", **more})
    return doubt.as_cause((), found.chi_square_ratio, ratio, whole=True)
