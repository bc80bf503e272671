# SPDX-License-Identifier: MIT
from __future__ import annotations

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from symkin.errors import QuantityError
from symkin.storage.quantities import evaluate_quantity, unit_factor, unit_names


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("6 m / sqrt(3)", "m", 6 / math.sqrt(3)),
        ("1.5m", "m", 1.5),
        ("210 deg", "rad", math.radians(210)),
        ("pi/6 rad", "rad", math.pi / 6),
        ("pi/6", "rad", math.pi / 6),
        ("2 pi rad - 1 turn", "rad", 0.0),
        ("1 / (0.0138 rev/mm)", "m/rad", 1e-3 / 0.0138 / (2 * math.pi)),
        ("0.2 rev/mm", "rad/m", 0.2 * 2 * math.pi / 1e-3),
        ("57.29577951308232 deg/rad", "1", 1.0),
        ("-(3 + 4*2) ** 2", "1", -121.0),
        ("atan2(1 m, 1000 mm)", "rad", math.pi / 4),
        ("asin(0.5) + acos(0.5)", "rad", math.pi / 2),
        ("atan(1)", "rad", math.pi / 4),
        ("3 m * sin(30 deg)", "m", 1.5),
        ("3 m * cos(pi/3)", "m", 1.5),
        ("1 m * tan(45 deg)", "m", 1.0),
        ("sqrt(9 mm**2 + 16 mm**2)", "m", 5e-3),
        ("abs(-2 inch)", "m", 0.0508),
        (" 1e-4 ", "m", 1e-4),
        (3, "m", 3.0),
    ],
)
def test_an_expression_has_its_value_in_si(text: object, unit: str, expected: float) -> None:
    assert evaluate_quantity(text, unit) == pytest.approx(expected, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("20 mm", "rad", ["is a length", "expected an angle"]),
        ("20 deg", "m", ["is an angle", "expected a length"]),
        ("20 deg", "1", ["is an angle", "expected a plain number"]),
        ("20 mm", "m/rad", ["is a length", "expected a length per angle"]),
        ("20 mm/rev", "m", ["is a length per angle", "expected a length"]),
        ("1 m / (1 m)", "m", ["is a plain number", "expected a length"]),
        ("sin(30 deg)", "m", ["is a plain number"]),
        ("3 m**2", "m", ["m ** 2"]),
        ("3 kg", "m", ['unknown unit or function "kg"']),
        ("3 Deg", "rad", ['"Deg"', '"deg"']),
        ("1 m + 2", "m", ["cannot be evaluated"]),
        ("1 m + 2 rad", "m", ["cannot be evaluated"]),
        ("sin(3 m)", "1", ["cannot be evaluated"]),
        ("2 ** (1 m)", "1", ["cannot be evaluated"]),
        ("1/0", "m", ["division by zero"]),
        ("sqrt(-1)", "m", ["cannot be evaluated"]),
        ("(-1)**0.5", "m", ["not real"]),
        ("abs((-1)**0.5)", "m", ["not real"]),
        ("(-1 m**2)**0.5", "m", ["not real"]),
        (10**400, "m", ["not a finite number"]),
        ("9**9**9**9", "m", ["cannot be evaluated"]),
        ("1e999", "m", ["not a finite number"]),
        ("1e31", "m", ["too large; expected at most 1e+30"]),
        ("", "m", ["cannot be read"]),
        ("1,5 m", "m", ["cannot be read"]),
        ("sqrt(1, 2)", "m", ["sqrt takes one value, not 2"]),
        ("m(3)", "m", ["cannot be read"]),
        ("sqrt", "m", ["cannot be read"]),
        ("30°", "rad", ["unexpected character '°'"]),
        ("1 +" * 200 + "1", "m", ["200 characters"]),
        (True, "m", ["True is not a number"]),
        (None, "m", ["None is not a number"]),
        (math.inf, "m", ["not a finite number"]),
        (math.nan, "rad", ["not a finite number"]),
    ],
)
def test_a_wrong_expression_is_refused_in_words(text: object, unit: str, words: list[str]) -> None:
    with pytest.raises(QuantityError) as error:
        evaluate_quantity(text, unit)
    for word in words:
        assert word in str(error.value)


def test_an_integer_of_thousands_of_digits_is_refused() -> None:
    with pytest.raises(QuantityError, match="thousands of digits is not a finite number"):
        evaluate_quantity(10**5000, "m")


@pytest.mark.parametrize("value", [135, 135.0, "135", "-30", "45 * 1", 12.6])
def test_a_direction_of_many_turns_wants_a_unit(value: object) -> None:
    with pytest.raises(QuantityError, match=r'without a unit, so .* turns; write "-?[\d. *]+ deg"'):
        evaluate_quantity(value, "rad", direction=True)
    assert abs(evaluate_quantity(value, "rad")) > 12
    assert evaluate_quantity(f"({value}) deg", "rad", direction=True) != 0
    assert evaluate_quantity(f"({value}) rad", "rad", direction=True) != 0
    assert evaluate_quantity(12.5, "rad", direction=True) == 12.5


@pytest.mark.parametrize(
    "text",
    ["__import__('os').getcwd()", "m.__class__", "(1).real", "[1][0]", "lambda: 1", "x := 1"],
)
def test_an_expression_cannot_reach_python(text: str) -> None:
    with pytest.raises(QuantityError):
        evaluate_quantity(text, "m")


@given(st.text(alphabet="0123456789.e+-*/(), mradegpisqt", max_size=30))
def test_any_text_gives_a_number_or_a_quantity_error(text: str) -> None:
    with contextlib.suppress(QuantityError):
        assert math.isfinite(evaluate_quantity(text, "m"))


@given(st.floats(-1e30, 1e30))
def test_a_printed_number_in_si_reads_back_exactly(value: float) -> None:
    for unit, text in (("m", f"{value!r} m"), ("m/rad", f"{value!r} m/rad"), ("1", repr(value))):
        assert evaluate_quantity(text, unit) == value


@pytest.mark.parametrize("unit", unit_names())
def test_every_unit_is_either_a_length_or_an_angle(unit: str) -> None:
    factors = []
    for si_unit in ("m", "rad"):
        with contextlib.suppress(QuantityError):
            factors.append(unit_factor(unit, si_unit))
    assert len(factors) == 1
    assert factors[0] > 0
