# SPDX-License-Identifier: MIT
"""The noise as the observations of each kind show it, where chi-square is none of the declared."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping

from symkin import _core
from symkin.errors import SymkinError
from symkin.estimate.evidence.findings import Doubt
from symkin.estimate.evidence.residuals import ALARMS
from symkin.estimate.found import Found, total_of
from symkin.estimate.kept import once
from symkin.estimate.noise import Share, estimated_noise, shares_by_axis
from symkin.estimate.options import EstimateOptions
from symkin.estimate.problem import Problem
from symkin.model.settings import NoiseSettings
from symkin.values import record

_LEAST = 1.5  # times: what is told
_LARGEST = 900.0  # per degree of freedom: of so large residuals noise is not the cause
_KINDS = ("position", "along", "orientation", "reading")

Another = Callable[[NoiseSettings], Found | None]


@record
class Shown:
    """Noise by restricted maximum likelihood, and what each axis of the device says of it then."""

    noise: NoiseSettings
    by_axis: Mapping[str, Share]


def is_unusual(found: Found) -> bool:
    """Whether chi-square is none that the declared noise has, but may be that of another."""
    total = total_of(found.goodness)
    as_declared = total.least <= total.chi_square <= total.limit
    return not (found.noise_is_estimated or as_declared or _is_beyond_noise(found))


def _is_beyond_noise(found: Found) -> bool:
    return found.chi_square > _LARGEST * found.degrees_of_freedom


@once
def noise_shown(found: Found) -> Shown | None:
    """As large as it is shown; None where it is not, as leg by leg."""
    if found.legs or not found.converged or found.options.loss != "none":
        return None
    if _is_beyond_noise(found):
        return None
    return shown_by(found, dataclasses.replace(found.options, noise=found.noise))


def shown_by(found: Found, options: EstimateOptions) -> Shown | None:
    """Estimated with other options, from their noise, whose kinds are those that are told apart."""
    try:
        problem, fit, _ = Problem.of(found.nominal, found.measurements, options).resolved()
        problem, fit = estimated_noise(problem, fit)
        return Shown(problem.noise, shares_by_axis(problem, fit))
    except SymkinError:
        return None


def by_kind(found: Found) -> str:
    """How many times the declared noise that of each kind is, in words, if these differ."""
    shown = noise_shown(found)
    if shown is None:
        return ""
    times = {
        name: getattr(shown.noise, name) / declared
        for name in _KINDS
        if (declared := getattr(found.noise, name))
        and getattr(shown.noise, name) != declared  # as what was not observed stays
    }
    if len(times) < 2 or max(times.values()) < _LEAST * min(times.values()):
        return ""
    told = ", ".join(f"of {name} {each:.2g}" for name, each in times.items())
    return f"; as shown, the noise is, in times what is declared, {told}"


def doubts_of_directions(found: Found, another: Another) -> Iterator[Doubt]:
    """Say along which axis of the device positions scatter more than across it, or less.

    If nothing else is left once that is declared, by `another` estimate.
    """
    shown = noise_shown(found)
    if shown is None or shown.noise.along is not None or len(shown.by_axis) < 2:
        return
    tests = {axis: _times(axis, shown.by_axis) for axis in shown.by_axis}
    axis = min(tests, key=lambda each: tests[each][1])
    times, p_value = tests[axis]
    if p_value >= ALARMS / len(tests) or max(times, 1 / times) < _LEAST:
        return
    across = [each for name, each in shown.by_axis.items() if name != axis]
    position = shown.noise.position * math.exp(_pooled(across))
    directed = dataclasses.replace(
        shown.noise, position=position, along=times * position, direction=axis
    )
    settled = shown_by(found, dataclasses.replace(found.options, noise=directed))
    if settled is None or not (settled.noise.position and settled.noise.along):
        return  # along or across it other noise hides the positions'
    declared = found.nominal.noise.deviations
    sizes = {  # what other noise hides is as declared
        name: float(f"{size:.2g}") or declared[name]
        for name, size in settled.noise.deviations.items()
    }
    noise = NoiseSettings(**sizes, direction=axis)
    times = sizes["along"] / sizes["position"]
    if another(noise) is None:
        return
    figures = {"axis": axis, "evidence": f" (p {p_value:.1g})"}
    yield Doubt("noise-along", size=times, p=p_value, figures=figures, options={"noise": noise})


def _times(axis: str, by_axis: Mapping[str, Share]) -> tuple[float, float]:
    """How many times the noise across it that along an axis is, and the probability of that."""
    own, across = by_axis[axis], [each for name, each in by_axis.items() if name != axis]
    log = own.step - _pooled(across)
    variance = 1 / (2 * own.redundancy) + 1 / (2 * sum(each.redundancy for each in across))
    return math.exp(log), float(_core.chi_square_tail(log**2 / variance, 1))


def _pooled(shares: list[Share]) -> float:
    weights = [each.redundancy for each in shares]
    squares = [each.redundancy * math.exp(2 * each.step) for each in shares]
    return math.log(sum(squares) / sum(weights)) / 2
