# SPDX-License-Identifier: MIT
"""A device whose clock is so far off that the first order of it says nothing."""

from __future__ import annotations

import dataclasses

from symkin.errors import SymkinError
from symkin.estimate.covariates import late_clock
from symkin.estimate.evidence.changes import thousandths
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.sessions import leaves_little
from symkin.estimate.found import Found
from symkin.estimate.solution import together


def late_that_explains(found: Found) -> list[Doubt]:
    """That a clock is off, if an estimate with its offset leaves hardly more than noise."""
    if found.options.clock_offset or not late_clock(found.nominal, found.measurements):
        return []
    options = dataclasses.replace(found.options, estimator="joint", clock_offset=True)
    try:
        tried = together(found.nominal, found.measurements, options)
    except SymkinError:
        return []
    if not tried.converged or not leaves_little(found, tried):
        return []
    late = next(each for each in tried.unknowns if each.unit == "s" and each.column >= 0)
    amount = thousandths(late.value, late.deviation, late.unit)
    told = {"whole": True, "evidence": "", "amount": amount}
    return [Doubt("clock-late", (), (), late.value, 0.0, told, {"clock_offset": True})]
