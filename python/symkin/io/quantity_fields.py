# SPDX-License-Identifier: MIT
"""Annotations that make a pydantic field a quantity with a unit and a sign."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from symkin.errors import QuantityError, did_you_mean
from symkin.io.quantities import evaluate_quantity

__all__ = ["Estimate", "EstimateOf", "IntervalOf", "Quantity", "QuantityList"]

Sign = Literal["any", "positive", "not negative", "not zero"]
_ACCEPTS: dict[Sign, Callable[[float], bool]] = {
    "any": math.isfinite,
    "positive": lambda value: value > 0,
    "not negative": lambda value: value >= 0,
    "not zero": lambda value: value != 0,
}


class _Field:
    """An annotation that reads a raw TOML value by itself."""

    def read(self, raw: Any) -> Any:
        raise NotImplementedError

    def json_schema(self) -> JsonSchemaValue:
        raise NotImplementedError

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return self.json_schema()


@dataclass(frozen=True)
class Quantity(_Field):
    """A number or an expression, read as a float in an SI unit; the note is for its description."""

    unit: str
    sign: Sign = "any"
    note: str = ""
    direction: bool = False

    def read(self, raw: Any) -> float:
        """Return the value in SI; QuantityError names the unit or the sign expected."""
        value = evaluate_quantity(raw, self.unit, direction=self.direction)
        if not _ACCEPTS[self.sign](value):
            raise QuantityError(f"is {raw}; expected a value that is {self.sign}")
        return value

    def json_schema(self) -> JsonSchemaValue:
        """A number in the SI unit, or text with a unit."""
        plain = "a plain number" if self.unit == "1" else f"{self.unit} unless a unit is written"
        text = self.note or plain
        if self.sign != "any":
            text += f"; {self.sign}"
        kind = f"{self.unit} {self.sign} {self.note}".replace("/", " per ")
        title = "_".join(["Quantity", *kind.split()]).replace("'", "")
        return {"type": ["number", "string"], "description": text, "title": title}


@dataclass(frozen=True)
class QuantityList(_Field):
    """A list of coordinates of a pose, each with its own unit."""

    units: tuple[str, ...]

    def read(self, raw: Any) -> tuple[float, ...]:
        """Return the values in SI."""
        if not isinstance(raw, list) or len(raw) != len(self.units):
            count = len(raw) if isinstance(raw, list) else "no list of"
            raise QuantityError(
                f"has {count} values; expected {len(self.units)}, in {', '.join(self.units)}"
            )
        pairs = zip(raw, self.units, strict=True)
        return tuple(evaluate_quantity(item, unit, direction=unit == "rad") for item, unit in pairs)

    def json_schema(self) -> JsonSchemaValue:
        """An array of the right length."""
        items = [Quantity(unit).json_schema() for unit in self.units]
        count = len(self.units)
        return {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count}


class IntervalOf(QuantityList):
    """``[lower, upper]`` in one unit."""

    def __init__(self, unit: str) -> None:
        super().__init__((unit, unit))

    def read(self, raw: Any) -> tuple[float, ...]:
        """Return lower and upper in SI."""
        lower, upper = super().read(raw)
        if lower > upper:
            raise QuantityError(f"is {raw}; expected the lower bound first")
        return lower, upper


@dataclass(frozen=True)
class Estimate:
    """A parameter and its standard deviation, which is NaN where the file gives none."""

    value: float
    standard_deviation: float = float("nan")


@dataclass(frozen=True)
class EstimateOf(_Field):
    """A quantity, or a table ``{ value = ..., standard_deviation = ... }``."""

    quantity: Quantity

    def read(self, raw: Any) -> Estimate:
        """Return the value and its standard deviation in SI."""
        if not isinstance(raw, dict):
            return Estimate(self.quantity.read(raw))
        names = ("value", "standard_deviation")
        for name in raw:
            if name not in names:
                raise QuantityError(f'has an unknown key "{name}"{did_you_mean(name, names)}')
        if "value" not in raw:
            raise QuantityError('has no "value"')
        deviation = Quantity(self.quantity.unit, "not negative")
        return Estimate(
            self.quantity.read(raw["value"]),
            deviation.read(raw["standard_deviation"]) if len(raw) == 2 else float("nan"),
        )

    def json_schema(self) -> JsonSchemaValue:
        """A quantity, or an object of two."""
        value = self.quantity.json_schema()
        deviation = Quantity(self.quantity.unit, "not negative").json_schema()
        table = {
            "type": "object",
            "properties": {"value": value, "standard_deviation": deviation},
            "required": ["value"],
            "additionalProperties": False,
        }
        title = value["title"].replace("Quantity", "Estimate")
        return {"anyOf": [value, table], "title": title}
