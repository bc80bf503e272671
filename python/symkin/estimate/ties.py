# SPDX-License-Identifier: MIT
"""Unknowns that are tied to each other: equations of them in words, and what they leave free."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

from symkin.errors import SymkinError, did_you_mean
from symkin.storage.quantities import evaluate_quantity

_NAME = re.compile(r"[A-Za-z_][\w.]*[A-Za-z_]\w*|[A-Za-z_]\w*")
_NOTHING = 1e-9  # of an equation's size: it says nothing, or its sides agree
_WHOLE = 1e-12  # of a factor, to which rounding may have moved it


class Equation(NamedTuple):
    """``sum of factors times unknowns = constant``, of one tie."""

    text: str  # as it was written
    factors: dict[str, float]  # by the names of the unknowns, in the order in which they were named
    constant: float  # in SI units
    # Whether somebody measured it, so that all keep priors of their own; else they are one draw of
    # the workshop. If that is not said: where a number is stated, or a sum.
    measured: bool
    within: str = ""  # the standard deviation with which it holds; empty if it is exact


def meaning_of(text: str) -> tuple[str, str]:
    """Part a tie into its equation and what is said of that, such as ``, one draw``."""
    match = _MEANING.search(text)
    return (text[: match.start()].strip(), match.group().strip()) if match else (text.strip(), "")


def equation_of(text: str, units: Mapping[str, str]) -> Equation:
    """Read a tie, such as ``leg1.distal_length = 2 * leg2.distal_length``.

    Its two sides are sums of unknowns with factors and of quantities; behind them stands nothing,
    ``, measured``, ``, one draw`` or ``within 10 um``. `units` are those of all unknowns. Raises
    `SymkinError` quoting the tie, and what is wrong with it.
    """
    return equations_of([text], units)[0]


def equations_of(texts: Sequence[str], units: Mapping[str, str]) -> list[Equation]:
    """The same of several ties."""
    return list(_equations_of(tuple(texts), tuple(units.items())))


@lru_cache(maxsize=16)  # a declared robot has hundreds, and is laid out for each of many tables
def _equations_of(
    texts: tuple[str, ...], units: tuple[tuple[str, str], ...]
) -> tuple[Equation, ...]:
    of_legs: dict[str, str] = {}
    for each, _ in units:
        of_legs.setdefault(each.partition(".")[2], each)
    known = dict(units)
    return tuple(_equation_of(text, known, of_legs) for text in texts)


def _equation_of(text: str, units: Mapping[str, str], of_legs: Mapping[str, str]) -> Equation:
    equation, meaning = meaning_of(text)
    sides = equation.split("=")
    if len(sides) != 2 or not all(each.strip() for each in sides):
        raise SymkinError(f'tie "{text}" is no equation; expected two sides, such as {_EXAMPLE}')
    named = [name for name in _NAME.findall(equation) if name in units]
    for name in _NAME.findall(equation):
        if name in of_legs:
            raise SymkinError(
                f'tie "{text}": {name} of which leg? Expected such as {of_legs[name]}; '
                f"--shared {name} has it move by the same amount in all legs"
            )
        if "." in name and name not in units and not name.replace(".", "").isdigit():
            raise SymkinError(f'tie "{text}": {name} is no unknown{did_you_mean(name, units)}')
    if not named:
        raise SymkinError(f'tie "{text}" names no unknown; expected such as {_EXAMPLE}')
    kinds = sorted({units[name] for name in named})
    if len(kinds) > 1:
        shown = " and ".join(each or "a number" for each in kinds)
        raise SymkinError(f'tie "{text}" is of unknowns in {shown}; expected one unit')
    factors, constant = dict.fromkeys(named, 0.0), 0.0
    for sign, side in zip((1.0, -1.0), sides, strict=True):
        of_side, rest = _linear(text, side, frozenset(named), kinds[0])
        constant -= sign * rest
        for name, factor in of_side.items():
            factors[name] += sign * factor
    if not any(factors.values()):
        raise SymkinError(f'tie "{text}" says nothing of its unknowns')
    two_alike = sum(map(bool, factors.values())) <= 2 and not constant
    measured = meaning == MEASURED or (meaning != ONE_DRAW and not two_alike)
    return Equation(text, factors, constant, measured, meaning.partition("within")[2].strip())


ONE_DRAW, MEASURED = ", one draw", ", measured"
_MEANING = re.compile(rf"\s*{ONE_DRAW}\s*$|\s*{MEASURED}\s*$|\s+within\b(?!.*=).*$", re.DOTALL)
_EXAMPLE = "'leg1.distal_length = leg2.distal_length' or 'leg1.x + leg2.x = 0.2 m'"


@lru_cache(maxsize=2048)  # with other unknowns, too
def _linear(
    text: str, side: str, unknowns: frozenset[str], unit: str
) -> tuple[Mapping[str, float], float]:
    """Factors of the unknowns on a side, and the rest."""
    named = list(dict.fromkeys(name for name in _NAME.findall(side) if name in unknowns))
    spaced = re.sub(r"([\d.)])\s+(?=[A-Za-z_]\w*\.[A-Za-z_])", r"\1 * ", side)

    def at(values: Mapping[str, float]) -> float:
        def shown(match: re.Match[str]) -> str:
            name = match.group()
            return f"({values[name]!r} {unit})" if name in values else name

        try:
            return evaluate_quantity(_NAME.sub(shown, spaced).strip(), unit or "1")
        except SymkinError as error:
            raise SymkinError(f'tie "{text}": a side {error}') from error

    rest = at(dict.fromkeys(named, 0.0))
    found = {}
    for name in named:
        once, twice = (at({**dict.fromkeys(named, 0.0), name: step}) - rest for step in (1.0, 2.0))
        if not math.isclose(twice, 2 * once, rel_tol=1e-9, abs_tol=1e-12):
            raise SymkinError(f'tie "{text}" is not linear in {name}; expected sums and factors')
        whole = round(once)
        found[name] = float(whole) if abs(once - whole) < _WHOLE else once
    all_of_them = at(dict.fromkeys(named, 1.0)) - rest
    if not math.isclose(all_of_them, sum(found.values()), rel_tol=1e-9, abs_tol=1e-12):
        raise SymkinError(f'tie "{text}" is no sum of unknowns with factors')
    return found, rest


class Solved(NamedTuple):
    """What ties leave of the unknowns."""

    # Of every unknown that they bind: which others it follows, and by which factors.
    by: dict[str, dict[str, float]]
    constants: dict[str, float]  # and what is added
    measured: frozenset[str]  # those of them that keep a draw of their own: of sums
    redundant: tuple[str, ...]  # ties that follow from those before them


def solved(
    equations: Sequence[Equation], free: Collection[str], values: Mapping[str, float]
) -> Solved:
    """Solve ties one by one for the unknown that each names last (Gauss-Jordan).

    What is not free has its value of the drawing. Raises `SymkinError` naming the ties that
    contradict each other.
    """
    found = Solved({}, {}, frozenset(), ())
    made_of: dict[str, set[int]] = {}  # of a bound unknown, the ties that it follows from
    leading: dict[str, dict[str, None]] = {}  # of another, the bound ones that follow it
    for number, tie in enumerate(equations):
        row = {name: factor for name, factor in tie.factors.items() if name in free and factor}
        constant = tie.constant - sum(
            factor * values[name] for name, factor in tie.factors.items() if name not in free
        )
        used = {number}
        for name in [each for each in row if each in found.by]:
            factor = row.pop(name)
            constant -= factor * found.constants[name]
            used |= made_of[name]
            for other, by in found.by[name].items():
                row[other] = row.get(other, 0.0) + factor * by
        size = max(map(abs, tie.factors.values()))
        row = {name: factor for name, factor in row.items() if abs(factor) > _NOTHING * size}
        if not row:
            scale = max([abs(tie.constant), *(abs(values[name]) for name in tie.factors)])
            if abs(constant) > _NOTHING * max(scale, 1e-300):
                texts = [f'"{equations[each].text}"' for each in sorted(used)]
                raise SymkinError(
                    f"{' and '.join(texts)} contradict{'s the drawing' * (len(texts) == 1)}"
                    f"{' each other' * (len(texts) > 1)}: off by {abs(constant):.3g}; "
                    "take one out, or free what is held"
                )
            found = found._replace(redundant=(*found.redundant, tie.text))
            continue
        last = [name for name in (*tie.factors, *row) if name in row][-1]
        last = next((name for name in reversed(list(tie.factors)) if name in row), last)
        factor = row.pop(last)
        own, rest = {name: -by / factor for name, by in row.items()}, constant / factor
        followers = leading.pop(last, {})
        for name in followers:
            terms = found.by[name]
            part = terms.pop(last, 0.0)
            if part:
                found.constants[name] += part * rest
                made_of[name] |= used
                for other, more in own.items():
                    terms[other] = terms.get(other, 0.0) + part * more
        found.by[last], found.constants[last], made_of[last] = own, rest, used
        for other in own:
            leading.setdefault(other, {}).update({**followers, last: None})
        if tie.measured:
            found = found._replace(measured=found.measured | {last})
    return found
