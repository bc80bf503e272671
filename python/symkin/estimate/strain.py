# SPDX-License-Identifier: MIT
"""How far an estimate pulls ties that hold within a deviation."""

from __future__ import annotations

import math

import numpy as np

from symkin import _core
from symkin.estimate.found import Found
from symkin.estimate.sharing import written_tie
from symkin.estimate.ties import equation_of
from symkin.storage.quantities import evaluate_quantity
from symkin.values import Value, record

_SILENT = 1e-6  # share of a tie's variance that all else took away, at least


@record
class Strain(Value):
    """How far an estimate pulls a tie that holds within a deviation, against what all else says.

    Attributes
    ----------
    tie : str
        As it was written.
    unit : str
        "m", "rad", or empty for a number.
    size : float
        By how much the left side is larger than the right one as estimated.
    deviation : float
        Standard deviation that the tie states.
    others, others_deviation : float
        The same size as all else has it, observations and priors, and its standard deviation; NaN
        where that says nothing of it.
    statistic : float
        Of the difference: standard normal where the tie holds as stated; NaN likewise.
    p_value : float
        Probability of one as large then.
    """

    tie: str
    unit: str
    size: float
    deviation: float
    others: float
    others_deviation: float
    statistic: float
    p_value: float


def strains_of(found: Found) -> tuple[Strain, ...]:
    """Of all ties that hold within a deviation, in their order.

    What all else says follows from the estimate as it would without the tie's own row.
    """
    unknowns = {each.name: each for each in found.unknowns}
    units = {name: each.unit for name, each in unknowns.items()}
    covariance = found.model_covariance if found.model_covariance.size else found.covariance
    strains = []
    for given in found.options.tie:
        for text in written_tie(found.nominal, given):
            tie = equation_of(text, units)
            if not tie.within:
                continue
            row, size = np.zeros(len(found.names)), -tie.constant
            for name, factor in tie.factors.items():
                size += factor * unknowns[name].value
                for column, by in unknowns[name].moves:
                    row[column] += factor * by
            unit = units[next(iter(tie.factors))]
            if unit == "rad":  # meant up to whole turns
                size = math.remainder(size, math.tau)
            stated = evaluate_quantity(tie.within, unit or "1")
            left = stated**2 - float(row @ covariance @ row)
            others = spread = statistic = p_value = math.nan
            if left > _SILENT * stated**2:
                others = size * stated**2 / left
                spread = stated * math.sqrt(max(stated**2 / left - 1, 0.0))
                statistic = size / math.sqrt(left)
                p_value = float(_core.chi_square_tail(statistic**2, 1))
            strains.append(Strain(text, unit, size, stated, others, spread, statistic, p_value))
    return tuple(strains)
