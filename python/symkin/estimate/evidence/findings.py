# SPDX-License-Identifier: MIT
"""What is found of an estimate, as values; their sentences are made here, from `codes`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar, TypeVar

from symkin.errors import few, named_legs
from symkin.estimate.evidence.codes import DOUBTS, NOTES, Code
from symkin.model.mechanism import Mechanism
from symkin.options import flags_of
from symkin.present import asker
from symkin.values import Value, field, record

_LISTED = 8


@record
class _Finding(Value):
    """Something that is known of an estimate.

    Attributes
    ----------
    code : str
        What it is: one of a closed list.
    legs : tuple of int
        The legs (from 0) that it is about, if it is about some.
    rows : tuple of int
        The rows, numbered as in their source.
    size : float
        How large it is; NaN if nothing is to be said of that.
    p : float
        Probability of as much for a sound robot; NaN where that was not computed.
    figures : mapping
        What its sentence says besides.
    options : mapping
        What `identify` should be asked for instead: arguments by name.
    then : tuple of Doubt
        Of a cause: what else is wrong once that is corrected.
    others : tuple of Doubt
        Others that explain the data as well.
    """

    CODES: ClassVar[Mapping[str, Code]] = {}
    derived: ClassVar[tuple[str, ...]] = ("cause", "remedy")

    code: str
    legs: tuple[int, ...] = field(number=True, default=())
    rows: tuple[int, ...] = ()
    size: float = math.nan
    p: float = math.nan
    figures: Mapping[str, Any] = field(private=True, default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    then: tuple[Doubt, ...] = ()
    others: tuple[Doubt, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a code that nobody documented."""
        if self.code not in self.CODES:
            raise KeyError(f'"{self.code}" is no code of a {type(self).__name__}')
        super().__post_init__()

    @property
    def cause(self) -> str:
        """What it says, in words."""
        return self._said(self.CODES[self.code].says)

    @property
    def remedy(self) -> str:
        """What to do about it, in the language of who asks, see `symkin.present`; may be empty."""
        words = self.CODES[self.code].remedy
        return "" if "{options}" in words and not self.options else self._said(words)

    def __str__(self) -> str:
        """Return it as a sentence."""
        return "; ".join(filter(None, (self.cause, self.remedy)))

    def __repr__(self) -> str:
        """Return the code, and of the rest what there is."""
        shown = {name: getattr(self, name) for name in ("legs", "rows", "size", "p", "options")}
        there = [
            f"{name}={value!r}"
            for name, value in shown.items()
            if (math.isfinite(value) if isinstance(value, float) else value)
        ]
        return f"{type(self).__name__}({', '.join([repr(self.code), *there])})"

    def asks(self) -> str:
        """Return the options as one would write them."""
        if asker() == "python":
            return ", ".join(f"{name}={_literal(value)}" for name, value in self.options.items())
        flags = flags_of(self.options)
        return " ".join(flag if value is True else f"{flag} {value}" for flag, value in flags)

    def _said(self, words: str) -> str:
        several = len(self.legs) != 1
        place = {
            "legs": named_legs(self.legs),
            "rows": few(self.rows, _LISTED, " ..."),
            "size": self.size,
            "p": self.p,
            "options": self.asks(),
            "s": "s" * several,
            "was": "were" if several else "was",
            "stand": "stand" if several else "stands",
            "count": len(self.rows),
        }
        return words.format_map({**place, **self.CODES[self.code].usual, **self.figures})


@record
class Doubt(_Finding):
    """Something that speaks against an estimate; its code is one of `DOUBTS`."""

    CODES: ClassVar[Mapping[str, Code]] = DOUBTS

    @property
    def words(self) -> str:
        """What is wrong, and what else once that is corrected."""
        return "; with that corrected, ".join(each.cause for each in (self, *self.then))

    def as_cause(
        self, others: Sequence[Doubt], before: float, after: float, *, whole: bool
    ) -> Doubt:
        """Return it as likely to blame, by chi-square per degree as stated and as corrected."""
        evidence = {"before": before, "after": after, "whole": whole}
        figures = {**self.figures, "_likely": evidence}
        return dataclasses.replace(self, figures=figures, others=tuple(others))

    @property
    def is_cause(self) -> bool:
        """Whether it is a mistake that explains the others, rather than what is noticed."""
        return "_likely" in self.figures

    @property
    def explains(self) -> bool:
        """Whether it is a mistake that explains the data but for noise, and not a part of them."""
        return self.is_cause and bool(self.figures["_likely"]["whole"])

    def __str__(self) -> str:
        """Return it as a sentence."""
        every = (self, *self.others)
        causes = ", or as well: ".join(each.words for each in every)
        remedies = (
            "; then ".join(filter(None, (one.remedy for one in (each, *each.then))))
            for each in every
        )
        remedy = ", or: ".join(dict.fromkeys(remedies))
        if not self.is_cause:
            return "; ".join(filter(None, (causes, remedy)))
        likely = self.figures["_likely"]
        said = ("likely cause: " if likely["whole"] else "part of what is wrong may be: ") + causes
        if self.code != "gross-errors":
            stated = likely["before"]
            before = f"{stated:.3g}" if math.isfinite(stated) else "none was found"
            said += (
                " (so corrected, chi-square with the tolerances is "
                f"{likely['after']:.3g} per degree of freedom, before {before}"
                f"{'' if likely['whole'] else '; that is more than the noise explains'})"
            )
        return f"{said}; {remedy}"


@record
class Note(_Finding):
    """Something to know of an estimate that may well be sound; its code is one of `NOTES`."""

    CODES: ClassVar[Mapping[str, Code]] = NOTES


def _literal(value: Any) -> str:
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(_literal, value)) + "]"
    return f'"{value}"' if isinstance(value, str) else repr(value)


_AnyFinding = TypeVar("_AnyFinding", bound=_Finding)


def of_readings(findings: Iterable[_AnyFinding], robot: Mechanism) -> tuple[_AnyFinding, ...]:
    """Findings that also say which readings their legs are, where a leg has several."""
    if not robot.ties:
        return tuple(findings)
    return tuple(
        dataclasses.replace(each, figures={**each.figures, "legs": robot.named_legs(each.legs)})
        for each in findings
    )
