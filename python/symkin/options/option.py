# SPDX-License-Identifier: MIT
"""An option: what may be asked for, wherever it is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from symkin.errors import SymkinError, one_of, shown


@dataclass(frozen=True)
class Option:
    """What may be asked for, wherever it is."""

    name: str  # in Python and in files
    # `int`, `float`, `bool`, `str` or `Path`-like; a `Literal` of its words; ``list[...]`` of any
    # number of them, which on the command line is given several times.
    kind: Any
    help: str  # what the command line says of it
    default: Any = None  # None where it follows from something else, which the help says
    metavar: str = ""  # what stands for a value in the help
    least: float | None = None  # of a number
    most: float | None = None
    unit: str = ""  # of a number that the command line takes with any unit, as text
    seldom: str = ""  # title of its group in the whole help, if the short one leaves it out
    objects: bool = False  # whether Python takes an object for it, too, which its function looks at

    @property
    def flag(self) -> str:
        """What it is called on the command line."""
        return f"--{self.name.replace('_', '-')}"

    @property
    def words(self) -> tuple[str, ...]:
        """The words that it may be; empty if it is no choice."""
        kind = get_args(self.kind)[0] if get_origin(self.kind) is list else self.kind
        return get_args(kind) if get_origin(kind) is Literal else ()

    def check(self, value: object) -> None:
        """Refuse a value that it cannot have."""
        if value is None and self.default is None:
            return
        if self.kind is dict and not isinstance(value, str | Mapping):
            raise SymkinError(f"{self.name} is {shown(value)}; expected a text or a mapping")
        plain = int | float if self.kind in (int, float) else str
        if self.objects and not isinstance(value, plain):
            return
        if get_origin(self.kind) is Literal:
            one_of(self.name, value, self.kind)
        elif self.kind is bool:
            if not isinstance(value, bool):
                raise SymkinError(f"{self.name} is {shown(value)}; expected True or False")
        elif self.kind in (int, float):
            self._check_number(value)
        elif get_origin(self.kind) is list:
            self._check_list(value)

    def _check_number(self, value: object) -> None:
        """Also of NumPy's numbers."""
        whole = self.kind is int
        names = ("__index__",) if whole else ("__index__", "__float__")
        is_number = any(hasattr(value, each) for each in names) and not isinstance(value, bool)
        if is_number and not hasattr(value, "__len__"):  # as arrays have
            try:
                number = float(value)  # type: ignore[arg-type]
            except OverflowError:  # of a whole number with hundreds of digits
                number = math.inf
            low = -math.inf if self.least is None else self.least
            high = math.inf if self.most is None else self.most
            if low <= number <= high and math.isfinite(number):
                return
        expected = "a whole number" if whole else "a number"
        raise SymkinError(f"{self.name} is {shown(value)}; expected {expected}{self.limits}")

    @property
    def limits(self) -> str:
        """What a number is between, in words."""
        if self.most is not None:
            return f" from {self.least or 0} to {self.most}"
        return "" if self.least is None else f", {self.least:g} or more"

    def _check_list(self, value: object) -> None:
        """A sequence of its words or texts; one of them alone is one, too."""
        items = [value] if isinstance(value, str) else value
        is_list = isinstance(items, list | tuple | set | frozenset)
        for item in items if is_list else [None]:  # type: ignore[attr-defined]
            if not isinstance(item, str):
                wrong = value if item is None else item
                expected = "a list of texts" if item is None else "texts in the list"
                raise SymkinError(f"{self.name} is {shown(wrong)}; expected {expected}")
            if self.words:
                one_of(self.name, item, self.words)
