# SPDX-License-Identifier: MIT
"""Exceptions of symkin; each message names the value, the expectation and the place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

__all__ = [
    "FailedFitError",
    "MeasurementError",
    "MechanismError",
    "MechanismFileError",
    "NotIdentifiableError",
    "QuantityError",
    "ResultsError",
    "StudyFileError",
    "SymkinError",
    "SymmetryError",
    "TomlFileError",
    "did_you_mean",
    "few",
    "known_extension",
    "named_legs",
    "one_of",
    "printable",
    "unknowns_by_name",
]


_WORD = 4  # letters, so that "hexapod" means the name that it is part of
_NEAR = 0.6  # share of letters in common; "nope" and "bogus" are near nothing


class SymkinError(ValueError):
    """Base of every error that symkin raises about what it was given.

    Attributes
    ----------
    likely_cause : symkin.estimate.Doubt or None
        A mistake in the measurements that would explain it, if one was found.
    corrected : symkin.Measurements or None
        The measurements without that mistake, if it is one of the table.
    redrawn : symkin.Mechanism or None
        The mechanism without it, if it is one of the drawing.
    mapping : str
        A line of TOML with which a table with names of its own may be read; empty if none is known.
    """

    likely_cause: Any = None
    corrected: Any = None
    redrawn: Any = None
    mapping: str = ""


class QuantityError(SymkinError):
    """A number or an expression with units cannot be evaluated, or has another dimension."""


class MechanismError(SymkinError):
    """A leg or a mechanism is not possible as described."""


class SymmetryError(SymkinError):
    """A declared symmetry is absent or does not fit the number of legs."""


class NotIdentifiableError(SymkinError):
    """The measurements do not determine the parameters.

    Attributes
    ----------
    null_directions : array of float
        Directions of the unknowns that nothing shows, a column each; empty if none are known.
    unseen : tuple of str
        The same in the unknowns' names, such as ``"0.71 base_angle - 0.71 platform_angle"``.
    """

    null_directions: Any = ()
    unseen: tuple[str, ...] = ()


class FailedFitError(SymkinError):
    """An identification ended nowhere, or at parameters that no mechanism has."""


class MeasurementError(SymkinError):
    """A table of measurements, or a measurement plan, cannot be used as it is."""


class ResultsError(SymkinError):
    """A results file cannot be read or written."""


class TomlFileError(SymkinError):
    """A TOML file is wrong at a known place.

    Attributes
    ----------
    path : Path
        The file.
    line : int or None
        Line in the file, counted from 1; None when the file has no text to point at.
    key : str
        Dotted key, such as ``legs[2].base_radius``; empty for the file as a whole.
    whole : str
        What the file should be.
    """

    whole = "a file in TOML"

    def __init__(self, message: str, path: Path, line: int | None = None, key: str = "") -> None:
        place = f"{path}:{line}" if line is not None else f"{path}"
        super().__init__(f"{place}: {key}: {message}" if key else f"{place}: {message}")
        self.path = path
        self.line = line
        self.key = key


class MechanismFileError(TomlFileError):
    """A mechanism file is wrong at a known place."""

    whole = "a mechanism file, such as robot.toml, or the name of one that comes with symkin"


class StudyFileError(TomlFileError):
    """The file of a study is wrong at a known place."""

    whole = "the file of a study, in TOML"


def printable(text: str) -> str:
    """Return text with escapes for what a terminal or a file would not show as it is."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode() for char in text
    )


def shown(value: object) -> str:
    """Return a value as a message has it: a number or a short text as it is, else its kind."""
    if value is None or isinstance(value, bool | int | float | str | bytes | Path):
        text = repr(value)
        return text if len(text) <= 60 else f"{text[:57]}..."
    if isinstance(value, list | tuple) and len(value) < 4:
        left, right = "[]" if isinstance(value, list) else "()"
        return f"{left}{', '.join(map(shown, value))}{right}"
    name = getattr(value, "__name__", "") if isinstance(value, type) else type(value).__name__
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"


def known_extension(path: Path, *known: str) -> None:
    """Refuse to write what no program would read by its name, such as JSON into ``x.xlsx``.

    Raises
    ------
    SymkinError
        For an extension that is not one of the known, and for none.
    """
    if path.suffix.lower() not in known:
        *others, last = known
        expected = f"{', '.join(others)} or {last}" if others else last
        what = f'"{path.suffix}" is not what is written' if path.suffix else "has no extension"
        raise SymkinError(f"{path.name}: {what}; expected {expected}")


def did_you_mean(name: str, valid_names: Iterable[str]) -> str:
    """Return ``'; did you mean "x"?'`` for the nearest valid name, or an empty string."""
    # Only an error needs difflib: importing it here keeps `import symkin` fast.
    from difflib import get_close_matches

    by_lower_case = {valid.lower(): valid for valid in valid_names}
    whole = [valid for valid in by_lower_case if len(name) >= _WORD and name.lower() in valid]
    nearest = whole or get_close_matches(name.lower(), by_lower_case, n=1, cutoff=_NEAR)
    return f'; did you mean "{by_lower_case[nearest[0]]}"?' if nearest else ""


def named_legs(legs: Iterable[int], places: Mapping[int, str] | None = None) -> str:
    """Name legs (from 0) in a message: ``leg 2``, ``legs 2, 3``; `places` follow in brackets."""
    told = places or {}
    numbers = [f"{leg + 1} ({told[leg]})" if leg in told else f"{leg + 1}" for leg in legs]
    return f"leg{'' if len(numbers) == 1 else 's'} {', '.join(numbers)}"


def few(names: Sequence[object], most: int, more: str = " and {} more") -> str:
    """Some of many, and how many more there are."""
    listed = ", ".join(map(str, names[:most]))
    return listed + more.format(len(names) - most) if len(names) > most else listed


def unknowns_by_name(unknowns: Iterable[str]) -> list[str]:
    """Name unknowns, the same one of several legs once: `base_radius of legs 1, 2`."""
    by_name: dict[str, list[int]] = {}
    for name in unknowns:
        block, _, own = name.partition(".")
        if block.startswith("leg"):
            by_name.setdefault(own, []).append(int(block[3:]) - 1)
        else:
            by_name[name] = []
    return [f"{name} of {named_legs(legs)}" if legs else name for name, legs in by_name.items()]


def one_of(name: str, value: object, choices: Any) -> Any:
    """Return an option, or what it stands for, if it is one of its values.

    Parameters
    ----------
    name : str
        Of the option.
    value : object
        What was given.
    choices : iterable of str, mapping or `typing.Literal`
        What may be; a mapping says what it stands for.

    Raises
    ------
    SymkinError
        Naming the option, the value and the valid ones.
    """
    valid = get_args(choices) or tuple(choices)
    if not isinstance(value, str) or value not in valid:
        *others, last = (f'"{each}"' for each in valid)
        words = " or ".join([", ".join(others), last] if others else [last])
        raise SymkinError(f"{name} is {shown(value)}; expected {words}")
    return choices[value] if isinstance(choices, Mapping) else value
