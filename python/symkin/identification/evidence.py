# SPDX-License-Identifier: MIT
"""When a correction of a mistake explains what is not explained as it is stated."""

from __future__ import annotations

import math

__all__ = ["MUCH_BETTER", "cause", "explains", "left_in_words"]

# What a correction must leave less of chi-square than what is stated does, per degree of freedom.
MUCH_BETTER = 9.0
_HUGE = 1000.0  # so much better suffices even if something else is wrong besides


def explains(after: float, before: float) -> bool:
    """Whether a correction explains what is not explained as it is stated.

    Parameters
    ----------
    after, before : float
        Chi-square with the tolerances, per degree of freedom: of the corrected fit, and of what is
        stated at the best that its solver reaches from any start, converged or not; infinite where
        there is no fit at all.

    Returns
    -------
    bool
    """
    tolerated = max(MUCH_BETTER, before / _HUGE) if math.isfinite(before) else MUCH_BETTER
    return after * MUCH_BETTER < before and after < tolerated


def cause(what: str, *, whole: bool) -> str:
    """A proposal in words; a doubt unless the `whole` of what was measured is explained by it."""
    return f"{'likely cause' if whole else 'part of what is wrong may be'}: {what}"


def left_in_words(after: float, before: float, *, whole: bool) -> str:
    """What speaks for a proposal, with the arguments of `explains`."""
    words = f"so corrected, chi-square with the tolerances is {after:.3g} per degree of freedom"
    words += f", before {before:.3g}" if math.isfinite(before) else ", before none was found"
    return words if whole else f"{words}; that is more than the noise explains"
