# SPDX-License-Identifier: MIT
"""Whether there is enough to judge by, and residuals against the declared noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from symkin import _core
from symkin.analysis.seen import Seen
from symkin.errors import named_legs
from symkin.estimate.blunders import without_rejected
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.shown_noise import by_kind
from symkin.estimate.fit import FALSE_ALARMS
from symkin.estimate.found import Found, GoodnessOfFit
from symkin.estimate.problem import KINDS, spare_conditions
from symkin.estimate.solution import settled

# Beyond this the parameters of a leg are told apart only by digits that no measurement has.
CONDITION_LIMIT = 1e5
# With fewer poses to spare, a noise three times larger than declared would often pass.
_FEW_SPARE_POSES = 3
# Times what the fit leaves, and the noise: points that the unknowns follow one by one.
_FAR_ABOVE_FIT = 4
_COMPUTED = 1e-6  # of chi-square per degree of freedom: no measurement
_NORMAL_MEDIAN = 0.6745  # of the absolute value of a standard normal


def doubts_of_size(found: Found) -> Iterator[Doubt]:
    """Too little to judge by."""
    yield from _of_legs(found)
    if not found.legs:
        silent = np.isnan(found.measurements.readings).all(axis=0)
        for leg in np.flatnonzero(silent).tolist():
            if any(name.startswith(f"leg{leg + 1}.") for name in found.names):
                yield Doubt("leg-not-read", (leg,))
        if found.degrees_of_freedom <= 0:
            yield Doubt("nothing-to-spare", figures={"who": ""})
        elif Seen.of(found.measurements).probed:
            yield from _of_heights(found)


def _of_heights(found: Found) -> Iterator[Doubt]:
    """Heights that the fit follows, and that the others hardly predict.

    Each pose brings one condition, and the tolerances make up for those that are too few, so that
    chi-square is as it should be however few there are.
    """
    rows = found.rows
    own = (rows.kind == KINDS.index("heights")) & np.isfinite(rows.blunder) & (rows.t != 0)
    deviations = found.measurements.standard_deviations(found.noise)
    errors = np.column_stack([found.reading_errors[rows.pose[own]], rows.residual[own]])
    sigma = np.column_stack([deviations[name][rows.pose[own]] for name in ("readings", "heights")])
    # Of one condition a pose: a pose left out is off by its residual over what it is not given by.
    whitened = np.divide(errors, sigma, out=np.zeros_like(errors), where=sigma > 0)
    fitted = np.nansum(whitened**2, axis=1)
    left_out = rows.t[own] ** 4 / fitted
    times = float(np.sqrt(left_out.mean() / fitted.mean())) if own.any() else 0.0
    if times > _FAR_ABOVE_FIT and left_out.mean() > _FAR_ABOVE_FIT**2:
        off = float(np.sqrt(np.mean(rows.blunder[own] ** 2)))
        sizes = {"left_out": off, "fitted": off / times}
        figures = {name: f"{1e3 * value:.3g} mm" for name, value in sizes.items()}
        yield Doubt("others-say-little", size=times, figures=figures)


def doubts_of_lost_rows(found: Found) -> Iterator[Doubt]:
    """Rows that no pose explains, as one has that was mistyped."""
    if aside := unexplained_rows(found):
        numbers = tuple(found.measurements.row_numbers[aside].tolist())
        several = len(aside) > 1
        figures = {"n": "s" * several, "verb": "are" if several else "is"}
        yield Doubt("rows-without-pose", rows=numbers, figures=figures)


def doubts_of_poses(found: Found) -> Iterator[Doubt]:
    """Poses that are too much alike, which they may be for an estimate alone that went astray."""
    for number, leg in enumerate(found.legs):
        if not leg.condition <= CONDITION_LIMIT:
            options = {"prior": "tolerances"}
            yield Doubt("parameters-alike", (number,), size=leg.condition, options=options)
        if len(leg.rejected) > 0.2 * len(leg.rows):
            rejected = tuple(found.measurements.row_numbers[leg.rejected].tolist())
            yield Doubt("many-rejected", (number,), rejected, figures={"total": len(leg.rows)})


def _of_legs(found: Found) -> Iterator[Doubt]:
    counts = found.nominal.estimated_counts
    for number, (leg, parameters) in enumerate(zip(found.legs, counts, strict=False)):
        own = (number,)
        closures = found.nominal.closures
        freedom = closures * (len(leg.rows) - len(leg.rejected)) - parameters
        spare = freedom // closures
        if freedom < 1:
            yield Doubt("nothing-to-spare", own, figures={"who": f"{named_legs(own)}: "})
        elif spare < _FEW_SPARE_POSES:
            poses = {0: "a part of a pose", 1: "one pose"}.get(spare, f"{spare} poses")
            yield Doubt("little-to-spare", own, size=float(spare), figures={"poses": poses})


def unexplained_rows(found: Found) -> list[int]:
    """Rows that were set aside and that the noise does not explain: what they observed is lost.

    Not those with no more conditions than a pose has coordinates, which noise alone may leave
    without any pose, nor those that hardly show a direction of the pose, in which nothing can be
    linearised.
    """
    if not found.aside:
        return []
    measured = without_rejected(found)
    told = spare_conditions(found.nominal, measured)
    problem = settled(found.mechanism, found.noise, measured)
    core = problem.mechanism.straight, problem.setup, problem.observations
    limit = FALSE_ALARMS / max(len(found.conditions), 1)
    return [
        row
        for row in found.aside
        if told[row] > 0
        and _core.chi_square_tail(
            _core.left_unexplained(*core, found.latent_poses, row), int(told[row])
        )
        < limit
    ]


def doubts_of_noise(found: Found) -> Iterator[Doubt]:
    """Residuals larger or smaller than the declared noise."""
    if found.noise_is_estimated:
        return  # chi-square is what it was made to be
    judged = [fit for fit in found.goodness if fit.degrees_of_freedom > 0]
    large = [fit for fit in judged if fit.unexplained]
    if large:
        times = max(fit.chi_square_ratio for fit in large) ** 0.5
        figures = {**_figures(found, large, "limit"), "then": _consequence(found)}
        figures["by_kind"] = by_kind(found)
        yield Doubt("residuals-large", _legs(large), size=times, figures=figures)
        standardised = [np.median(np.abs(leg.standardised)) for leg in found.legs]
        bulk = max(standardised, default=np.inf) / _NORMAL_MEDIAN
        if times > 4 and bulk < times / 2:
            yield Doubt("few-far-off", size=float(bulk))
    small = [fit for fit in judged if fit.chi_square < fit.least]
    if small and found.options.loss == "none":
        least = min(fit.chi_square_ratio for fit in small)
        why = (
            "these are numbers that were computed, such as those of a plan, not measured"
            if least < _COMPUTED
            else "the declared noise is too large, or the measurements were smoothed"
        )
        measured = least >= _COMPUTED and not found.legs
        told = by_kind(found) if measured else ""
        figures = {**_figures(found, small, "least"), "why": why, "by_kind": told}
        options = {"noise": "estimate"} if measured else {}
        yield Doubt(
            "residuals-small", _legs(small), size=least**0.5, figures=figures, options=options
        )


def _consequence(found: Found) -> str:
    """What a chi-square that is too large changes of the standard deviations."""
    if found.options.loss != "none":
        return "the standard deviations are those of the residuals that the loss keeps"
    if found.estimator == "joint":
        return "the standard deviations are scaled up by that factor"
    return "the standard deviations are taken from the residuals instead"


def _legs(fits: Sequence[GoodnessOfFit]) -> tuple[int, ...]:
    return tuple(leg for fit in fits for leg in fit.legs)


def _figures(found: Found, fits: Sequence[GoodnessOfFit], which: str) -> dict[str, Any]:
    legs = _legs(fits)
    every = len(legs) == len(found.nominal.legs)
    limits = (getattr(fit, which) / fit.degrees_of_freedom for fit in fits)
    return {
        "who": f"{'all legs' if every else named_legs(legs)}: " if found.legs else "",
        "ratios": ", ".join(f"{fit.chi_square_ratio:.3g}" for fit in fits),
        "degrees": ", ".join(dict.fromkeys(f"{fit.degrees_of_freedom:.4g}" for fit in fits)),
        "limits": ", ".join(dict.fromkeys(f"{limit:.3g}" for limit in limits)),
    }
