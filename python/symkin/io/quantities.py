# SPDX-License-Identifier: MIT
"""Numbers and expressions with units, such as ``"6 m / sqrt(3)"``, as SI floats.

An expression is checked name by name, parsed by :mod:`ast` and walked over a white list of nodes;
nothing is passed to ``eval``. Units are pint's, in a registry of our own where the angle is a
base dimension: pint's default registry counts radians as plain numbers, so it would take a length
per angle for a length, and it needs 0.1 s to start where this one needs 3 ms.
"""

from __future__ import annotations

import ast
import functools
import math
import operator
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symkin.errors import QuantityError, did_you_mean

if TYPE_CHECKING:
    import pint

__all__ = ["MOST", "MOST_OF_DIRECTION", "evaluate_quantity", "unit_factor", "unit_names"]

# Factors to the SI unit, lengths and angles apart.
_LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "km": 1e3, "inch": 0.0254, "ft": 0.3048}
_ANGLES = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": math.pi / 180,
    "arcmin": math.pi / 180 / 60,
    "arcsec": math.pi / 180 / 3600,
    "rev": 2 * math.pi,
    "turn": 2 * math.pi,
}
_EXPECTED = {
    "m": 'a length such as "120 mm"',
    "rad": 'an angle such as "30 deg"',
    "1": "a plain number without a unit",
    "m/rad": 'a length per angle such as "5 mm/rev"',
    "rad/m": 'an angle per length such as "0.2 rev/mm"',
}
_MAX_LENGTH = 200
MOST = 1e30  # of which squares can still be added
# Two turns, since what was estimated or added up may be somewhat more than one.
MOST_OF_DIRECTION = 4 * math.pi

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<operator>\*\*|[-+*/(),])"
)
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: lambda base, exponent: _real(base**exponent),
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}
_CONSTANTS = {"pi": math.pi}


def unit_names() -> tuple[str, ...]:
    """Names of the units that an expression or a column may use."""
    return (*_LENGTHS, *_ANGLES)


def unit_factor(unit: str, si_unit: str) -> float:
    """Return how many `si_unit` ("m" or "rad") one `unit` is.

    Raises
    ------
    QuantityError
        If the unit is unknown or of another dimension.
    """
    return 1.0 if unit == si_unit else evaluate_quantity(f"1 {unit}", si_unit)


def evaluate_quantity(value: object, si_unit: str, *, direction: bool = False) -> float:
    """Evaluate a number or an expression with units to a float in `si_unit`.

    Parameters
    ----------
    value : float, int or str
        A number, already in `si_unit`, or an expression of numbers, units, ``pi``, ``+ - * / **``,
        parentheses and the functions ``sqrt sin cos tan asin acos atan atan2 abs``. A space before
        a unit multiplies, from left to right as ``*`` does: ``pi/6 rad`` is 30 degrees, and a
        divisor with a unit wants parentheses. An expression without any unit is in `si_unit`.
    si_unit : {"m", "rad", "1", "m/rad", "rad/m"}
        The expected dimension and the unit of the result.
    direction : bool
        Whether the angle is a direction, so that many turns without a unit are degrees in truth.

    Returns
    -------
    float

    Raises
    ------
    QuantityError
        If the expression cannot be read, is of another dimension, is not finite, or is a direction
        of many turns without a unit.
    """
    if isinstance(value, str):
        evaluated = _evaluate_text(value)
        result = _to_si(evaluated, si_unit, value)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        try:
            evaluated = result = float(value)
        except OverflowError:
            evaluated = result = math.inf
    else:
        raise QuantityError(f"{_quoted(value)} is not a number; expected {_EXPECTED[si_unit]}")
    if not math.isfinite(result):
        raise QuantityError(f"{_quoted(value)} is not a finite number")
    if abs(result) > MOST:
        raise QuantityError(f"{_quoted(value)} is too large; expected at most {MOST:g}")
    if direction and isinstance(evaluated, float) and abs(result) > MOST_OF_DIRECTION:
        raise QuantityError(
            f"is {_quoted(value)} without a unit, so {abs(result) / math.tau:.3g} turns; write "
            f'"{value} deg" if these are degrees, "{value} rad" if not'
        )
    return result


@functools.cache
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None)
    registry.load_definitions(
        ["m = [length]", "rad = [angle]", "radian = rad"]
        + [f"{unit} = {factor!r} m" for unit, factor in _LENGTHS.items() if unit != "m"]
        + [f"{unit} = {factor!r} rad" for unit, factor in _ANGLES.items() if unit != "rad"]
    )
    return registry


def _unit(name: str) -> Any:
    return _registry().Quantity(1.0, name)


def _gives_angle(function: Callable[..., Any]) -> Callable[..., Any]:
    # On quantities, numpy's inverse functions return an angle; on floats, a number without a unit.
    return lambda *arguments: function(*(_registry().Quantity(a) for a in arguments))


_FUNCTIONS: dict[str, tuple[int, Callable[..., Any]]] = {
    "sqrt": (1, np.sqrt),
    "abs": (1, np.abs),
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "tan": (1, np.tan),
    "asin": (1, _gives_angle(np.arcsin)),
    "acos": (1, _gives_angle(np.arccos)),
    "atan": (1, _gives_angle(np.arctan)),
    "atan2": (2, _gives_angle(np.arctan2)),
}


def _evaluate_text(text: str) -> Any:
    """A float if no unit occurs in the text, else a pint quantity."""
    if len(text) > _MAX_LENGTH:
        raise QuantityError(f"an expression may have {_MAX_LENGTH} characters, not {len(text)}")
    python = _with_explicit_products(text)
    try:
        with np.errstate(all="raise"):
            return _walk(ast.parse(python, mode="eval").body, text)
    except QuantityError:
        raise
    except (SyntaxError, RecursionError, MemoryError, ValueError) as error:
        raise QuantityError(f'"{text}" cannot be read as a number with a unit') from error
    except (ArithmeticError, TypeError) as error:  # pint's dimension errors are TypeErrors
        raise QuantityError(f'"{text}" cannot be evaluated: {error}') from error


def _with_explicit_products(text: str) -> str:
    """Check every name, and write the product that "6 m" leaves out."""
    known = [*_FUNCTIONS, *_CONSTANTS, *_LENGTHS, *_ANGLES]
    words: list[str] = []
    position = 0
    stripped = text.strip()
    while position < len(stripped):
        token = _TOKEN.match(stripped, position)
        if token is None:
            raise QuantityError(f'"{text}" has an unexpected character {stripped[position]!r}')
        word = token.group()
        if token.lastgroup == "name":
            if word not in known:
                raise QuantityError(
                    f'"{text}" uses an unknown unit or function "{word}"{did_you_mean(word, known)}'
                )
            if words and (words[-1][-1].isalnum() or words[-1][-1] in "_.)"):
                words.append("*")
        words.append(word)
        position = token.end()
        while position < len(stripped) and stripped[position].isspace():
            position += 1
    return " ".join(words)


def _walk(node: ast.expr, text: str) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name) if name in _CONSTANTS:
            return _CONSTANTS[name]
        case ast.Name(id=name) if name not in _FUNCTIONS:
            return _unit(name)
        case ast.UnaryOp(op=op, operand=operand):
            return _OPERATORS[type(op)](_walk(operand, text))
        case ast.BinOp(left=left, op=op, right=right):
            return _OPERATORS[type(op)](_walk(left, text), _walk(right, text))
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in _FUNCTIONS:
            count, function = _FUNCTIONS[name]
            if len(arguments) != count:
                values = "one value" if count == 1 else f"{count} values"
                raise QuantityError(f'"{text}": {name} takes {values}, not {len(arguments)}')
            return function(*(_walk(argument, text) for argument in arguments))
    raise QuantityError(f'"{text}" cannot be read as a number with a unit')


def _real(result: Any) -> Any:
    if isinstance(getattr(result, "magnitude", result), complex):
        raise ArithmeticError("a root of a negative number is not real")
    return result


def _to_si(result: Any, si_unit: str, text: str) -> float:
    if isinstance(result, float):
        return result
    target = _registry().Unit("" if si_unit == "1" else si_unit)
    if result.dimensionality != target.dimensionality:
        raise QuantityError(f'"{text}" is {_described(result)}; expected {_EXPECTED[si_unit]}')
    return float(result.m_as(target))


def _described(quantity: Any) -> str:
    for si_unit, description in _EXPECTED.items():
        unit = _registry().Unit("" if si_unit == "1" else si_unit)
        if quantity.dimensionality == unit.dimensionality:
            return description.split(" such as ")[0].split(" without ")[0]
    return f"in {quantity.units}"


def _quoted(value: object) -> str:
    try:
        text = str(value)
    except ValueError:  # Python writes no integer of thousands of digits
        text = "a number of thousands of digits"
    shown = text if len(text) <= _MAX_LENGTH else f"{text[:40]}..."
    return f'"{shown}"' if isinstance(value, str) else shown
