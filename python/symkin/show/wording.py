# SPDX-License-Identifier: MIT
"""Numbers as a person reads them: sensible digits, with units."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

from symkin.analysis.promises import ExpectedAccuracy
from symkin.errors import printable
from symkin.estimate.precision import Expected
from symkin.estimate.survey import HeldByPriors
from symkin.model.chains import legs_counted
from symkin.model.mechanism import Mechanism
from symkin.model.poses import PoseSpace
from symkin.show.units import on_paper

NONE = "\N{EN DASH}"
_SPACE = "\N{NO-BREAK SPACE}"
_DEGREE = "\N{DEGREE SIGN}"
_GIVEN_DIGITS = 4
_NOTHING = 1e-8  # m or rad, a hundredth of what the best instruments tell
_MUCH = 0.3  # of an expected error: the rest is then 5% smaller than all of it
_MINUS = "\N{MINUS SIGN}"
SUPERSCRIPTS = str.maketrans(
    "-0123456789", "\u207b\u2070\xb9\xb2\xb3\u2074\u2075\u2076\u2077\u2078\u2079"
)


def significant(value: float, digits: int = 3) -> str:
    """So many significant digits, a power of ten where the number is far from one."""
    if math.isfinite(value) and value != 0 and not 1e-4 <= abs(value) < 1e6:
        mantissa, power = f"{value:.{digits - 1}e}".split("e")
        power = str(int(power)).translate(SUPERSCRIPTS)
        return _signed(f"{mantissa}{_SPACE}\N{MULTIPLICATION SIGN}{_SPACE}10{power}")
    return _decimal(value, digits)


def _decimal(value: float, digits: int = 3) -> str:
    """So many significant digits, written out."""
    if not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    # The exponent after rounding: 9.999 has one digit more before the point than it seems.
    exponent = int(f"{value:.{digits - 1}e}".split("e")[1])
    decimals = digits - 1 - exponent
    return _signed(f"{round(value, decimals):.{max(0, decimals)}f}")


def fixed(value: float, decimals: int) -> str:
    """So many digits after the point."""
    if not math.isfinite(value):
        return NONE
    return _signed(f"{round(value, decimals) + 0.0:.{decimals}f}")  # no negative zero


def decimals_of(deviation: float, otherwise: int = 6) -> int:
    """Digits after the point that show a standard deviation to its second digit."""
    if not (math.isfinite(deviation) and deviation > 0):
        return otherwise
    return max(0, 1 - math.floor(math.log10(deviation)))


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A number with its unit: ``2.94 mm``."""
    return _with(significant(value, digits), unit) if math.isfinite(value) else NONE


def setting(value: float, unit: str = "", digits: int = 5) -> str:
    """A number that was given, without the zeros that nobody wrote: ``0.1 mm``."""
    # No negative zero.
    return _with(_signed(f"{value + 0.0:.{digits}g}"), unit)


def given(value: float, unit: str) -> str:
    """A length or angle that was given, in the unit that is told: ``0.1 mm``."""
    factor, name = on_paper(unit)
    return setting(factor * value, name, _GIVEN_DIGITS)


def span(low: float, high: float, unit: str) -> str:
    """Between what something was given to lie: ``-550 to 550 mm``."""
    factor, name = on_paper(unit)
    return f"{setting(factor * low)} to {setting(factor * high, name)}"


def milli(value: float, unit: str) -> str:
    """A small length, angle or time with its unit: ``0.0821 mm``; what rounding left is none."""
    if not math.isfinite(value):
        return NONE
    factor, name = small(unit)
    if 0 < abs(value) < _NOTHING and unit in ("m", "rad"):
        return f"< {_with(_decimal(factor * _NOTHING, 1), name)}"
    return _with(_decimal(factor * value), name)


def bare(value: float | None, unit: str) -> str:
    """The same without its unit, which the table's heading has; empty for None."""
    if value is None:
        return ""
    factor, _ = small(unit)
    if 0 < abs(value) < _NOTHING and unit in ("m", "rad"):
        return f"< {_decimal(factor * _NOTHING, 1)}"
    return _decimal(factor * value)


def small(unit: str) -> tuple[float, str]:
    """The unit of small lengths, angles and times, and how many of it are one."""
    return (1e3, "ms") if unit == "s" else on_paper(unit)


def _with(number: str, unit: str) -> str:
    """A number and its unit; nothing stands before a degree sign."""
    return f"{number}{'' if unit in ('', _DEGREE) else _SPACE}{unit}"


def left_by_priors(
    mechanism: Mechanism, held: HeldByPriors, expected: Expected | ExpectedAccuracy
) -> list[str]:
    """How much of the errors to expect priors leave, of those of which it is much."""
    return [
        f"{milli(getattr(held, kind), unit)} of the expected {kind} error of "
        f"{milli(getattr(expected, kind), unit)}"
        for kind, unit in mechanism.space.errors
        if getattr(held, kind) > _MUCH * getattr(expected, kind)
    ]


def percent(share: float) -> str:
    """A share in percent: ``95 %``."""
    return f"{100 * share:.5g}{_SPACE}%"


TURN_LEFT_OUT = "orientation is up to a turn of the platform's frame, which no observation shows"


def place(of: str | None, *, whole: str = "position") -> str:
    """What an error of the position is of: the position, or those of its coordinates that count."""
    return {None: whole, "height": "height above the bed"}.get(of, str(of))


def promise(space: PoseSpace, accuracy: Expected | ExpectedAccuracy) -> str:
    """What robots keep, in a sentence: most of them, on average, and anywhere."""

    def figures(name: str) -> str:
        return " and ".join(
            milli(getattr(accuracy, f"{kind}{name}"), unit) for kind, unit in space.errors
        )

    share = percent(accuracy.confidence)
    words = (
        f"{share} of such robots are within {figures('_bound')}, on average {figures('')} (root "
        f"mean square over the {'bed' if accuracy.of == 'height' else 'workspace'}"
        f"{'' if accuracy.of is None else f', {place(accuracy.of)} alone'})"
    )
    if accuracy.position_anywhere is not None:
        words += f"; anywhere in the workspace {share} are within {figures('_anywhere')}"
    if accuracy.up_to_frames:
        words += "; errors are those that no other base and platform frame would take away"
    if accuracy.up_to_turn and space.turns:
        words += f"; {TURN_LEFT_OUT}"
    return f"{words}."


def ratio(before: float, after: float) -> str:
    """How much smaller an error became: ``44 times smaller``."""
    if not (before > 0 and after > 0):
        return NONE
    if after <= before:
        return f"{significant(before / after, 2)} times smaller"
    return f"{significant(after / before, 2)} times larger"


def became(before: float, after: float, unit: str) -> str:
    """A small error as it was and as it is: ``0.82 mm`` and ``0.0821 mm`` with an arrow between."""
    return f"{milli(before, unit)} \N{RIGHTWARDS ARROW} {milli(after, unit)}"


def count(number: int) -> str:
    """An integer with its thousands apart."""
    return f"{number:,}".replace(",", _SPACE)


def share(part: int, whole: int) -> str:
    """Part of a whole in percent."""
    return f"{100 * part / whole:.1f}{_SPACE}%" if whole else NONE


def plural(number: int, noun: str, many: str | None = None) -> str:
    """A counted noun: ``1 pose``, ``72 poses``."""
    return f"{count(number)} {noun if number == 1 else many or noun + 's'}"


def chain_subtitle(mechanism: Mechanism) -> str:
    """Number and chain of the legs: ``3 legs, chain [R]RR``."""
    return f"{legs_counted(mechanism.legs)}, chain{'s' * mechanism.mixed} {mechanism.chain}"


def has_lengths(mechanism: Mechanism) -> bool:
    """Whether any parameter is a length."""
    return any("m" in mechanism.parameter_units(leg) for leg in range(len(mechanism.legs)))


def leg_columns(legs: Iterable[int]) -> tuple[str, ...]:
    """Headings of a table with a column a leg (from 0)."""
    return tuple(f"Leg {leg + 1}" for leg in legs)


def pose_coordinates(space: PoseSpace) -> tuple[tuple[str, str], ...]:
    """Name and unit of the coordinates of a workspace's bounds."""
    names = {"phi": "\N{GREEK SMALL LETTER PHI}"}
    return tuple((names.get(name, name), unit) for name, unit in space.units.items())


def sources(*files: Path | None) -> list[tuple[str, Path]]:
    """Name the files that this comes from."""
    return [(printable(path.name), path) for path in files if path is not None]


def quoted(text: str) -> str:
    """Return text in quotation marks."""
    return f"\N{LEFT DOUBLE QUOTATION MARK}{text}\N{RIGHT DOUBLE QUOTATION MARK}"


def _signed(text: str) -> str:
    return text.replace("-", _MINUS)
