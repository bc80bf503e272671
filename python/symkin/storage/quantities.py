# SPDX-License-Identifier: MIT
"""Numbers and expressions with units, such as ``"6 m / sqrt(3)"``, as SI floats.

An expression is checked name by name, parsed by :mod:`ast` and walked over a white list of nodes;
nothing is passed to ``eval``. Angles have a dimension of their own, so that a length per angle is
no length, and so have the steps of a drive or an encoder.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable
from typing import NamedTuple

from symkin.errors import QuantityError, did_you_mean

# Factors to the SI unit, lengths and angles apart, and what is counted.
_LENGTHS = {
    "m": 1.0,
    "mm": 1e-3,
    "cm": 1e-2,
    "um": 1e-6,
    "nm": 1e-9,
    "km": 1e3,
    "inch": 0.0254,
    "ft": 0.3048,
}
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
COUNTS = ("step", "count", "px")
_EXPECTED = {
    "m": 'a length such as "120 mm"',
    "rad": 'an angle such as "30 deg"',
    "1": "a plain number without a unit",
    "m/rad": 'a length per angle such as "5 mm/rev"',
    "rad/m": 'an angle per length such as "0.2 rev/mm"',
    "m/step": 'a length per step such as "1/80 mm/step"',
    "rad/step": 'an angle per step such as "1.8 deg/step"',
}
_DIMENSIONS = {
    "m": (1, 0, 0),
    "rad": (0, 1, 0),
    "1": (0, 0, 0),
    "m/rad": (1, -1, 0),
    "rad/m": (-1, 1, 0),
    "m/step": (1, 0, -1),
    "rad/step": (0, 1, -1),
}
_MAX_LENGTH = 200
MOST = 1e30  # of which squares can still be added
# Two turns, since what was estimated or added up may be somewhat more than one.
MOST_OF_DIRECTION = 4 * math.pi

_TOKEN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)|(?P<operator>\*\*|[-+*/(),])"
)


def unit_names() -> tuple[str, ...]:
    """Names of the units that an expression or a column may use."""
    return (*_LENGTHS, *_ANGLES)


def counts_steps(unit: str) -> bool:
    """Whether a unit is the size of a step, such as ``"1/80 mm/step"``, of what was counted."""
    return bool(set(re.findall(r"[A-Za-z_]\w*", unit)) & set(COUNTS))


def unit_factor(unit: str, si_unit: str) -> float:
    """Return how many `si_unit` ("m" or "rad") one `unit` is, or a step of such a size.

    Raises
    ------
    QuantityError
        If the unit is unknown or of another dimension, or the step is not positive.
    """
    if counts_steps(unit):
        size = evaluate_quantity(unit, f"{si_unit}/step")
        if size <= 0:
            raise QuantityError(f'"{unit}" is {size:g}; expected a positive size of a step')
        return size
    return 1.0 if unit == si_unit else evaluate_quantity(f"1 {unit}", si_unit)


def is_unit(unit: str, si_unit: str) -> bool:
    """Whether a text is a unit of that kind, or a step of such a size."""
    try:
        return bool(unit and si_unit) and unit_factor(unit, si_unit) > 0
    except QuantityError:
        return False


def evaluate_quantity(value: object, si_unit: str, *, direction: bool = False) -> float:
    """Evaluate a number or an expression with units to a float in `si_unit`.

    Parameters
    ----------
    value : float, int or str
        A number, already in `si_unit`, or an expression of numbers, units, ``pi``, ``+ - * / **``,
        parentheses and the functions ``sqrt sin cos tan asin acos atan atan2 abs``. A space before
        a unit multiplies, from left to right as ``*`` does: ``pi/6 rad`` is 30 degrees, and a
        divisor with a unit wants parentheses. An expression without any unit is in `si_unit`.
    si_unit : {"m", "rad", "1", "m/rad", "rad/m", "m/step", "rad/step"}
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
        result, dimension, bare = _evaluate_text(value)
        if not bare and dimension != _DIMENSIONS[si_unit]:
            shown = _described(_Quantity(result, dimension))
            raise QuantityError(f'"{value}" is {shown}; expected {_EXPECTED[si_unit]}')
    elif isinstance(value, int | float) and not isinstance(value, bool):
        bare = True
        try:
            result = float(value)
        except OverflowError:
            result = math.inf
    else:
        raise QuantityError(f"{_quoted(value)} is not a number; expected {_EXPECTED[si_unit]}")
    if not math.isfinite(result):
        raise QuantityError(f"{_quoted(value)} is not a finite number")
    if abs(result) > MOST:
        raise QuantityError(f"{_quoted(value)} is too large; expected at most {MOST:g}")
    if direction and bare and abs(result) > MOST_OF_DIRECTION:
        raise QuantityError(
            f"is {_quoted(value)} without a unit, so {abs(result) / math.tau:.3g} turns; write "
            f'"{value} deg" if these are degrees, "{value} rad" if not'
        )
    return result


_Dimension = tuple[float, ...]  # powers of length, angle and steps
_NUMBER, _ANGLE = (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)


class _Quantity(NamedTuple):
    """A value in SI; one in which no unit occurs is bare, and takes the unit that is expected."""

    value: float
    dimension: _Dimension = _NUMBER
    bare: bool = False


def _function(
    function: Callable[..., float],
    accepts: tuple[_Dimension, ...] = (),
    gives: _Dimension | None = None,
) -> Callable[..., _Quantity]:
    """A function of values of one dimension, by default any; by default it gives the same."""

    def call(*given: _Quantity) -> _Quantity:
        dimension = given[0].dimension
        for each in given:
            if each.dimension != dimension or (accepts and dimension not in accepts):
                raise ArithmeticError(f"{_described(each)} cannot stand there")
        bare = gives != _ANGLE and all(each.bare for each in given)
        return _Quantity(function(*(each.value for each in given)), gives or dimension, bare)

    return call


def _product(sign: int, function: Callable[[float, float], float]) -> Callable[..., _Quantity]:
    def call(a: _Quantity, b: _Quantity) -> _Quantity:
        powers = zip(a.dimension, b.dimension, strict=True)
        dimension = tuple(one + sign * other for one, other in powers)
        return _Quantity(function(a.value, b.value), dimension, a.bare and b.bare)

    return call


def _power(base: _Quantity, exponent: _Quantity) -> _Quantity:
    if exponent.dimension != _NUMBER:
        raise ArithmeticError(f"{_described(exponent)} is no exponent")
    value: float | complex = base.value**exponent.value
    if isinstance(value, complex):
        raise ArithmeticError("a root of a negative number is not real")
    dimension = tuple(power * exponent.value for power in base.dimension)
    return _Quantity(value, dimension, base.bare and exponent.bare)


_OPERATORS: dict[type[ast.AST], Callable[..., _Quantity]] = {
    ast.Add: _function(operator.add),
    ast.Sub: _function(operator.sub),
    ast.Mult: _product(1, operator.mul),
    ast.Div: _product(-1, operator.truediv),
    ast.Pow: _power,
    ast.UAdd: _function(operator.pos),
    ast.USub: _function(operator.neg),
}
_FUNCTIONS: dict[str, tuple[int, Callable[..., _Quantity]]] = {
    "sqrt": (1, lambda root: _power(root, _Quantity(0.5, bare=True))),
    "abs": (1, _function(abs)),
    "sin": (1, _function(math.sin, (_NUMBER, _ANGLE), _NUMBER)),
    "cos": (1, _function(math.cos, (_NUMBER, _ANGLE), _NUMBER)),
    "tan": (1, _function(math.tan, (_NUMBER, _ANGLE), _NUMBER)),
    "asin": (1, _function(math.asin, (_NUMBER,), _ANGLE)),
    "acos": (1, _function(math.acos, (_NUMBER,), _ANGLE)),
    "atan": (1, _function(math.atan, (_NUMBER,), _ANGLE)),
    "atan2": (2, _function(math.atan2, (), _ANGLE)),
}
_NAMES = {
    "pi": _Quantity(math.pi, bare=True),
    **{name: _Quantity(factor, (1.0, 0.0, 0.0)) for name, factor in _LENGTHS.items()},
    **{name: _Quantity(factor, _ANGLE) for name, factor in _ANGLES.items()},
    **{name: _Quantity(1.0, (0.0, 0.0, 1.0)) for name in COUNTS},
}


def _evaluate_text(text: str) -> _Quantity:
    if len(text) > _MAX_LENGTH:
        raise QuantityError(f"an expression may have {_MAX_LENGTH} characters, not {len(text)}")
    python = _with_explicit_products(text)
    try:
        body = ast.parse(python, mode="eval").body
    except (SyntaxError, RecursionError, MemoryError, ValueError) as error:
        raise QuantityError(f'"{text}" cannot be read as a number with a unit') from error
    try:
        return _walk(body, text)
    except QuantityError:
        raise
    except (ArithmeticError, ValueError) as error:  # such as asin(2)
        raise QuantityError(f'"{text}" cannot be evaluated: {error}') from error


def _with_explicit_products(text: str) -> str:
    """Check every name, and write the product that "6 m" leaves out."""
    known = [*_FUNCTIONS, *_NAMES]
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


def _walk(node: ast.expr, text: str) -> _Quantity:
    match node:
        case ast.Constant(value=int() | float() as number):
            return _Quantity(float(number), bare=True)
        case ast.Name(id=name) if name in _NAMES:
            return _NAMES[name]
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


def _described(quantity: _Quantity) -> str:
    for si_unit, dimension in _DIMENSIONS.items():
        if quantity.dimension == dimension:
            return _EXPECTED[si_unit].split(" such as ")[0].split(" without ")[0]
    powers = zip(("m", "rad", "step"), quantity.dimension, strict=True)
    return "in " + " * ".join(f"{unit} ** {power:g}" for unit, power in powers if power)


def _quoted(value: object) -> str:
    try:
        text = str(value)
    except ValueError:  # Python writes no integer of thousands of digits
        text = "a number of thousands of digits"
    shown = text if len(text) <= _MAX_LENGTH else f"{text[:40]}..."
    return f'"{shown}"' if isinstance(value, str) else shown
